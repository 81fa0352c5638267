//! NSGA-II: a population that crosses and mutates toward the front.
//!
//! ```text
//! genes: a place an axis, as (place + 1/2) / values --repair: snapped--> ordinals --Sweep::evaluate--> objectives
//! ```
//! Source: Deb, Pratap, Agarwal, Meyarivan 2002, by the crate `moors` (selection, sorting, crowding, survival). Ours: genes
//! are places of an ordered list, so mutation moves a few places or anywhere, and crossover exchanges axes; what cannot
//! be built, has failed or is beyond the number of points does not survive. A combination that comes back costs nothing; the
//! search ends when `points` different ones were asked for, or generations bring no new one.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::rc::Rc;

use moors::{
    AdaptiveController, AlgorithmContext, ControlSignal, ExactDuplicatesCleaner, MutationOperator,
    Nsga2Builder, Population, RandomGenerator, SamplingOperator, UniformBinaryCrossover,
    operators::RepairOperator,
};
use ndarray::{Array1, Array2, ArrayViewMut1, Ix2};

use super::sample;
use crate::explore::space::Space;
use crate::explore::sweep::{Sweep, SweepError};

/// Generations without a new combination after which the search ends.
const IDLE_GENERATIONS: u32 = 20;
/// Generations at most.
const MAX_GENERATIONS: usize = 100_000;
/// Places that a mutation moves at most, when it does not go anywhere.
const STEP: i64 = 2;

/// How many values each axis has.
#[derive(Clone, Debug)]
struct Genes(Vec<usize>);

impl Genes {
    fn of(space: &Space) -> Genes {
        Genes(space.axes.iter().map(|axis| axis.values.len()).collect())
    }

    /// The place that a gene of axis `axis` means.
    fn place(&self, axis: usize, gene: f64) -> usize {
        let n = self.0[axis];
        ((gene * n as f64).max(0.0) as usize).min(n - 1)
    }

    fn gene(&self, axis: usize, place: usize) -> f64 {
        (place as f64 + 0.5) / self.0[axis] as f64
    }
}

/// The first generation.
#[derive(Clone, Debug)]
struct First(Vec<Vec<f64>>);

impl SamplingOperator for First {
    fn sample_individual(&self, _: usize, rng: &mut impl RandomGenerator) -> Array1<f64> {
        Array1::from_vec(self.0[rng.gen_range_usize(0, self.0.len())].clone())
    }

    fn operate(&self, _: usize, n_genes: usize, _: &mut impl RandomGenerator) -> Array2<f64> {
        Array2::from_shape_fn((self.0.len(), n_genes), |(i, gene)| self.0[i][gene])
    }
}

/// On average one gene moves: a few places, or anywhere.
#[derive(Clone, Debug)]
struct Move(Genes);

impl MutationOperator for Move {
    fn mutate<'a>(&self, mut individual: ArrayViewMut1<'a, f64>, rng: &mut impl RandomGenerator) {
        let Move(genes) = self;
        let rate = 1.0 / individual.len() as f64;
        for (axis, gene) in individual.iter_mut().enumerate() {
            let n = genes.0[axis];
            if n < 2 || !rng.gen_bool(rate.min(1.0)) {
                continue;
            }
            let place = if rng.gen_bool(0.5) {
                let step = 1 + rng.gen_range_usize(0, STEP as usize) as i64;
                let step = if rng.gen_bool(0.5) { step } else { -step };
                (genes.place(axis, *gene) as i64 + step).clamp(0, n as i64 - 1) as usize
            } else {
                rng.gen_range_usize(0, n)
            };
            *gene = genes.gene(axis, place);
        }
    }
}

/// Genes to the middles of their places, so that equal combinations have equal genes.
#[derive(Clone, Debug)]
struct Snap(Genes);

impl RepairOperator for Snap {
    fn repair(&self, mut individual: ArrayViewMut1<'_, f64>) {
        for (axis, gene) in individual.iter_mut().enumerate() {
            *gene = self.0.gene(axis, self.0.place(axis, *gene));
        }
    }
}

/// Ends the search.
#[derive(Debug)]
struct End(Rc<Cell<bool>>);

impl AdaptiveController<Ix2, Ix2> for End {
    fn observe(&mut self, _: usize, _: &Population<Ix2, Ix2>, _: &AlgorithmContext) -> ControlSignal {
        ControlSignal { stop: self.0.get(), ..ControlSignal::default() }
    }
}

/// What the search shares with the crate's callbacks.
struct Search<'s, 'a> {
    sweep: &'s mut Sweep<'a>,
    genes: Genes,
    points: u64,
    asked: BTreeSet<u64>,
    idle: u32,
    fault: Option<SweepError>,
    is_over: Rc<Cell<bool>>,
}

impl Search<'_, '_> {
    fn ordinals(&self, genes: &Array2<f64>) -> Vec<u64> {
        let choice = |row: ndarray::ArrayView1<'_, f64>| -> Vec<usize> {
            row.iter().enumerate().map(|(axis, gene)| self.genes.place(axis, *gene)).collect()
        };
        genes.outer_iter().map(|row| self.sweep.space().ordinal(&choice(row))).collect()
    }

    /// Objectives of each; `None` for those that must not survive.
    fn objectives(&mut self, genes: &Array2<f64>) -> Vec<Option<Vec<f64>>> {
        let ordinals = self.ordinals(genes);
        let mut new = Vec::new();
        for &ordinal in &ordinals {
            let is_new = !self.asked.contains(&ordinal) && self.sweep.space().candidate(ordinal).is_ok();
            if is_new && (self.asked.len() as u64) < self.points {
                self.asked.insert(ordinal);
                new.push(ordinal);
            }
        }
        self.idle = if new.is_empty() { self.idle + 1 } else { 0 };
        let whole = self.sweep.whole();
        if let Err(error) = self.sweep.evaluate(&new, whole) {
            self.fault.get_or_insert(error);
        }
        let is_spent = self.asked.len() as u64 >= self.points || self.idle >= IDLE_GENERATIONS;
        self.is_over.set(is_spent || self.sweep.is_over() || self.fault.is_some());
        ordinals.iter().map(|ordinal| self.sweep.known(*ordinal, whole)).collect()
    }
}

/// Searches with generations of `population`, `points` combinations at most.
pub(super) fn run(sweep: &mut Sweep<'_>, points: u64, population: u32) -> Result<(), SweepError> {
    let space = sweep.space();
    let genes = Genes::of(space);
    let first: Vec<Vec<f64>> = sample::random(space, points.min(u64::from(population)))
        .into_iter()
        .map(|ordinal| {
            let choice = space.choice(ordinal);
            choice.into_iter().enumerate().map(|(axis, place)| genes.gene(axis, place)).collect()
        })
        .collect();
    if first.len() < 2 {
        return Err(SweepError::Search("fewer than two combinations can be built".to_owned()));
    }
    let size = first.len();
    let (n_axes, n_objectives) = (space.axes.len(), space.objectives.len());
    let is_over = Rc::new(Cell::new(false));
    let search = RefCell::new(Search {
        sweep,
        genes: genes.clone(),
        points,
        asked: BTreeSet::new(),
        idle: 0,
        fault: None,
        is_over: Rc::clone(&is_over),
    });
    let fitness = |genes: &Array2<f64>| {
        let objectives = search.borrow_mut().objectives(genes);
        Array2::from_shape_fn((genes.nrows(), n_objectives), |(i, objective)| {
            objectives[i].as_ref().map_or(f64::MAX, |values| values[objective])
        })
    };
    let must_not_survive = |genes: &Array2<f64>| {
        let search = search.borrow();
        let whole = search.sweep.whole();
        let known = search.ordinals(genes).into_iter().map(|o| search.sweep.known(o, whole).is_some());
        let violation: Vec<f64> = known.map(|known| if known { -1.0 } else { 1.0 }).collect();
        Array2::from_shape_fn((genes.nrows(), 1), |(i, _)| violation[i])
    };
    let built = Nsga2Builder::default()
        .sampler(First(first))
        .crossover(UniformBinaryCrossover::new())
        .mutation(Move(genes.clone()))
        .repair(Snap(genes))
        .duplicates_cleaner(ExactDuplicatesCleaner::new())
        .controller(End(is_over))
        .fitness_fn(fitness)
        .constraints_fn(must_not_survive)
        .num_vars(n_axes)
        .population_size(size)
        .num_offsprings(size)
        .num_iterations(MAX_GENERATIONS)
        .mutation_rate(0.8)
        .crossover_rate(0.9)
        .keep_infeasible(false)
        .verbose(false)
        .seed(space.search.seed)
        .build();
    let ended = built.map_err(|e| e.to_string()).and_then(|mut nsga2| nsga2.run().map_err(|e| e.to_string()));
    let search = search.into_inner();
    match (search.fault, ended) {
        (Some(fault), _) => Err(fault),
        // A sweep that was stopped, or all of whose first generation failed, has nothing to go on with.
        (None, Err(_)) if search.sweep.is_over() => Ok(()),
        (None, Err(what)) => Err(SweepError::Search(what)),
        (None, Ok(())) => Ok(()),
    }
}
