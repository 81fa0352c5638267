//! What is not dominated, and how much a front dominates.
//!
//! ```text
//! rows --goals: all minimised--> points --front, ranks--> members, layers
//!                                       `--Ranges: to [0, 1]--> hypervolume against REFERENCE in every objective
//! ```
//! A point dominates another when it is no worse in every objective and better in one; equal points do not dominate each
//! other. Rows that failed, were pruned or shortened, or lack an objective take no part.
//!
//! Sources: layers by binary search (ENS-BS): Zhang, Tian, Cheng, Jin 2015. Hypervolume, exact in any number of
//! objectives: While, Bradstreet, Barone 2012 (WFG), a sweep in two.

use std::cmp::Ordering;

use super::{Results, Row, Status};
use crate::explore::metric::Goal;

/// The reference point of a normalised hypervolume, in every objective: a tenth of the range beyond the worst value.
pub const REFERENCE: f64 = 1.1;

/// True when `a` is no worse than `b` everywhere and better somewhere; all minimised.
pub fn dominates(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(x, y)| x <= y) && a.iter().zip(b).any(|(x, y)| x < y)
}

/// Places of the points that no other dominates, in ascending order; all minimised. A point with a NaN takes no part.
pub fn front(points: &[Vec<f64>]) -> Vec<usize> {
    let mut members: Vec<usize> = Vec::new();
    for i in in_order(points) {
        // None that comes later in lexicographic order dominates an earlier one.
        if !members.iter().any(|m| dominates(&points[*m], &points[i])) {
            members.push(i);
        }
    }
    members.sort_unstable();
    members
}

/// The layer of each point: 0 on the front, 1 on the front of the rest, and so on; none for a point with a NaN.
pub fn ranks(points: &[Vec<f64>]) -> Vec<Option<u32>> {
    let mut layers: Vec<Vec<usize>> = Vec::new();
    let mut ranks = vec![None; points.len()];
    for i in in_order(points) {
        // Whoever is dominated in a layer is dominated in all layers before it.
        let dominated = |layer: &Vec<usize>| layer.iter().rev().any(|m| dominates(&points[*m], &points[i]));
        let rank = layers.partition_point(dominated);
        if rank == layers.len() {
            layers.push(Vec::new());
        }
        layers[rank].push(i);
        ranks[i] = u32::try_from(rank).ok();
    }
    ranks
}

/// Places of the points without NaN in lexicographic order.
fn in_order(points: &[Vec<f64>]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|i| !points[*i].iter().any(|x| x.is_nan())).collect();
    order.sort_by(|a, b| lexicographic(&points[*a], &points[*b]).then(a.cmp(b)));
    order
}

fn lexicographic(a: &[f64], b: &[f64]) -> Ordering {
    a.partial_cmp(b).unwrap_or(Ordering::Equal)
}

/// Volume between the points and the reference that they dominate; all minimised. Exact, in units of the product of the
/// objectives. Points that are not better than the reference everywhere add nothing.
pub fn hypervolume(points: &[Vec<f64>], reference: &[f64]) -> f64 {
    let inside = |p: &&Vec<f64>| p.len() == reference.len() && p.iter().zip(reference).all(|(x, r)| x < r);
    let inside: Vec<Vec<f64>> = points.iter().filter(inside).cloned().collect();
    if reference.is_empty() {
        return 0.0;
    }
    volume(kept(inside), reference)
}

/// The members of the front, each value once.
fn kept(points: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let mut members: Vec<Vec<f64>> = front(&points).into_iter().map(|i| points[i].clone()).collect();
    members.sort_by(|a, b| lexicographic(a, b));
    members.dedup();
    members
}

/// Of points that do not dominate each other, in lexicographic order.
fn volume(points: Vec<Vec<f64>>, reference: &[f64]) -> f64 {
    match reference.len() {
        1 => points.first().map_or(0.0, |p| reference[0] - p[0]),
        2 => {
            // Along the first objective the second falls: a staircase.
            let mut sum = 0.0;
            let mut above = reference[1];
            for p in &points {
                sum += (reference[0] - p[0]) * (above - p[1]);
                above = p[1];
            }
            sum
        }
        _ => {
            // Each point adds what those before it do not dominate: its box without theirs, cut to it.
            let mut sum = 0.0;
            for (i, p) in points.iter().enumerate() {
                let own: f64 = p.iter().zip(reference).map(|(x, r)| r - x).product();
                let cut = |q: &Vec<f64>| q.iter().zip(p).map(|(a, b)| a.max(*b)).collect();
                sum += own - volume(kept(points[i + 1..].iter().map(cut).collect()), reference);
            }
            sum
        }
    }
}

/// Smallest and largest value of each objective.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranges(pub Vec<(f64, f64)>);

impl Ranges {
    /// Of points of one length; a NaN is left out.
    pub fn of(points: &[Vec<f64>]) -> Ranges {
        let n = points.first().map_or(0, Vec::len);
        let of = |k: usize| {
            let values = points.iter().filter_map(|p| p.get(k));
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
        };
        Ranges((0..n).map(of).collect())
    }

    /// Each objective from 0 at the best value to 1 at the worst; 0 where there is one value.
    pub fn normalise(&self, points: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let share = |(x, (low, high)): (&f64, &(f64, f64))| {
            if high > low { (x - low) / (high - low) } else { 0.0 }
        };
        points.iter().map(|p| p.iter().zip(&self.0).map(share).collect()).collect()
    }

    /// Hypervolume of points in these ranges against [`REFERENCE`], as a share of the whole box: 0 to 1.
    pub fn hypervolume(&self, points: &[Vec<f64>]) -> f64 {
        let reference = vec![REFERENCE; self.0.len()];
        let whole = REFERENCE.powi(self.0.len() as i32);
        hypervolume(&self.normalise(points), &reference) / whole
    }
}

/// The front of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Front {
    /// Columns of the metrics that are objectives.
    pub objectives: Vec<usize>,
    /// Rows on the front, in the order of the first objective, best first.
    pub members: Vec<usize>,
    /// Layer of each row; none for those that take no part.
    pub rank: Vec<Option<u32>>,
    /// Rows that take part.
    pub n_compared: usize,
    /// Share of the box between the best values and the reference that the front dominates; none without rows.
    pub hypervolume: Option<f64>,
}

/// A value so that less is better.
pub fn minimised(value: f64, goal: Goal) -> f64 {
    match goal {
        Goal::Minimise => value,
        Goal::Maximise => -value,
    }
}

/// True for rows whose metrics are those of whole workloads.
pub fn is_measured(row: &Row) -> bool {
    matches!(row.status, Status::Simulated | Status::Sampled)
}

impl Front {
    /// Of all rows that are measured and have every objective.
    pub fn of(results: &Results) -> Front {
        let objectives: Vec<usize> =
            (0..results.metrics.len()).filter(|m| results.metrics[*m].is_objective).collect();
        let point = |row: &Row| -> Option<Vec<f64>> {
            let value = |m: &usize| {
                let value = row.metrics.get(*m).copied().flatten()?;
                (!value.is_nan()).then(|| minimised(value, results.metrics[*m].goal))
            };
            is_measured(row).then(|| objectives.iter().map(value).collect())?
        };
        let (rows, points): (Vec<usize>, Vec<Vec<f64>>) =
            results.rows.iter().enumerate().filter_map(|(i, row)| Some((i, point(row)?))).unzip();
        if objectives.is_empty() {
            let rank = vec![None; results.rows.len()];
            return Front { objectives, members: Vec::new(), rank, n_compared: 0, hypervolume: None };
        }
        let mut rank = vec![None; results.rows.len()];
        for (row, layer) in rows.iter().zip(ranks(&points)) {
            rank[*row] = layer;
        }
        let mut best: Vec<usize> = front(&points);
        best.sort_by(|a, b| lexicographic(&points[*a], &points[*b]).then(a.cmp(b)));
        let hypervolume = (!points.is_empty()).then(|| Ranges::of(&points).hypervolume(&points));
        let members = best.into_iter().map(|i| rows[i]).collect();
        Front { objectives, members, rank, n_compared: points.len(), hypervolume }
    }

    /// True for a row of the front.
    pub fn contains(&self, row: usize) -> bool {
        self.rank.get(row).copied().flatten() == Some(0)
    }

    /// The best of the rows that take part in a metric, the first of equals, and its value.
    pub fn best(&self, results: &Results, metric: usize) -> Option<(usize, f64)> {
        let goal = results.metrics.get(metric)?.goal;
        let rows =
            results.rows.iter().enumerate().filter(|(i, _)| self.rank.get(*i).is_some_and(Option::is_some));
        let known = rows.filter_map(|(i, row)| Some((i, row.metrics.get(metric).copied().flatten()?)));
        known.filter(|(_, x)| !x.is_nan()).reduce(|best, other| {
            let better = minimised(other.1, goal) < minimised(best.1, goal);
            if better { other } else { best }
        })
    }
}

#[cfg(test)]
#[path = "pareto_tests.rs"]
mod tests;
