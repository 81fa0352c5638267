//! A sweep under way: what strategies ask for is looked up, or evaluated and kept.
//!
//! ```text
//! strategy --ordinals, Extent--> Sweep::evaluate --> objectives, all minimised | None
//!            Space::candidate -> hashes -> store? -> Evaluator -> store
//! ```
//! What is in the store is not run again, so a sweep that was cut off goes on where it was by being run again. Batches have a
//! fixed size, so neither the number of threads nor what was found in the store changes what is asked for.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;

use super::evaluate::{
    Accuracy, Counted, Evaluator, Extent, Job, WorkloadSetup, fewest_cycles, measure_accuracy, minimised,
    optimistic, values,
};
use super::metric::Needs;
use super::points::point_of;
use super::results::pareto::dominates;
use super::space::{Candidate, Impossible, Space};
use super::store::{Store, StoreError, StoredPoint, accuracy_hash, evaluation_hash};
use crate::frame::FrameError;
use crate::recorded::Setting;

/// Candidates that are asked for at once: enough for any number of cores, few enough that pruning learns.
pub const BATCH: usize = 64;

/// Why a sweep ended early.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The store.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A scene.
    #[error("workload {workload}: {source}")]
    Workload {
        /// Which.
        workload: String,
        /// Why.
        source: Box<FrameError>,
    },
    /// The search.
    #[error("the search cannot go on: {0}")]
    Search(String),
}

/// What becomes of the combinations that were asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// It ran: metrics, in the order of `METRICS`.
    Known {
        /// Whole, a sample, or shortened.
        extent: Extent,
        /// Metrics.
        metrics: Vec<Option<f64>>,
    },
    /// It cannot be built.
    Impossible(String),
    /// It ran into an error.
    Failed(String),
    /// Its best is no better than what is known.
    Pruned,
}

/// How far a sweep is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Candidates that were evaluated now.
    pub evaluated: u64,
    /// Found in the store.
    pub found: u64,
    /// Ran into errors.
    pub failed: u64,
    /// Not run, since their bounds are dominated.
    pub pruned: u64,
    /// Not possible.
    pub impossible: u64,
}

/// What stops a sweep between two evaluations.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// No batch begins after this long.
    pub time: Option<Duration>,
    /// Run only this share of the commands.
    pub sample: Option<f64>,
    /// Leave out what cannot be on the front.
    pub prune: bool,
}

/// What a board counted in each workload, or why it failed.
type Counts = Result<Vec<Counted>, String>;

/// A sweep under way.
pub struct Sweep<'a> {
    space: &'a Space,
    store: &'a mut Store,
    evaluator: Evaluator,
    setups: Vec<WorkloadSetup>,
    settings: Vec<Vec<Setting>>,
    limits: Limits,
    began: Instant,
    stop: &'a AtomicBool,
    progress: &'a mut dyn FnMut(&Tally),
    tally: Tally,
    /// The latest of each combination that was asked for.
    outcomes: BTreeMap<u64, Outcome>,
}

impl<'a> Sweep<'a> {
    /// Of a space, kept in `store`.
    pub fn new(
        space: &'a Space,
        workloads: Workloads,
        store: &'a mut Store,
        limits: Limits,
        stop: &'a AtomicBool,
        progress: &'a mut dyn FnMut(&Tally),
    ) -> Sweep<'a> {
        let Workloads { setups, settings } = workloads;
        Sweep {
            space,
            store,
            evaluator: Evaluator::new(setups.clone()),
            setups,
            settings,
            limits,
            began: Instant::now(),
            stop,
            progress,
            tally: Tally::default(),
            outcomes: BTreeMap::new(),
        }
    }

    /// The space.
    pub fn space(&self) -> &'a Space {
        self.space
    }

    /// True when no further batch may begin.
    pub fn is_over(&self) -> bool {
        self.is_stopped() || self.limits.time.is_some_and(|time| self.began.elapsed() >= time)
    }

    /// True when the user wants it to end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// What was done.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// How whole workloads are run.
    pub fn whole(&self) -> Extent {
        match self.limits.sample {
            Some(share) => Extent::Sample { share, seed: self.space.search.seed },
            None => Extent::Whole,
        }
    }

    /// The store.
    pub(super) fn store(&self) -> &Store {
        self.store
    }

    /// What each workload's rays depend on.
    pub(super) fn settings(&self) -> &[Vec<Setting>] {
        &self.settings
    }

    /// Every workload on a board that traces every ray itself, without record or store.
    pub(super) fn simulate_in_full(&self, spec: &BoardSpec) -> Vec<Result<BoardStatistics, String>> {
        self.setups.iter().map(|setup| setup.simulate(spec, Extent::Whole)).collect()
    }

    /// The bound of a job's cycles.
    pub(super) fn fewest_cycles(&mut self, job: &Job) -> Result<u64, String> {
        Ok(fewest_cycles(&job.spec, self.evaluator.work(job)?))
    }

    /// The objectives that follow from these counts, all to be minimised.
    pub(super) fn objectives_of(&mut self, candidate: &Candidate, counted: &[Counted]) -> Option<Vec<f64>> {
        let accuracies = self.accuracies(std::slice::from_ref(candidate)).ok()?;
        let accuracy = accuracies.get(&candidate.ordinal).and_then(|a| a.as_ref().ok());
        minimised(&self.space.objectives, &values(candidate, counted, accuracy))
    }

    /// What became of all that was asked for, at the end.
    pub fn into_outcomes(self) -> BTreeMap<u64, Outcome> {
        self.outcomes
    }

    /// What became of all that was asked for.
    pub fn outcomes(&self) -> &BTreeMap<u64, Outcome> {
        &self.outcomes
    }

    /// Evaluates combinations, those that were asked for already at no cost. The answer has one entry for each: its
    /// objectives, all to be minimised, or `None` where it cannot be built, failed, was pruned, or the sweep is over.
    ///
    /// # Errors
    /// When the store fails.
    pub fn evaluate(
        &mut self,
        ordinals: &[u64],
        extent: Extent,
    ) -> Result<Vec<Option<Vec<f64>>>, SweepError> {
        let mut order: Vec<u64> = ordinals.to_vec();
        if self.limits.prune && extent == Extent::Whole {
            order = self.most_hopeful_first(ordinals)?;
        }
        for batch in order.chunks(BATCH) {
            if self.is_over() {
                break;
            }
            self.batch(batch, extent)?;
        }
        Ok(ordinals.iter().map(|ordinal| self.known(*ordinal, extent)).collect())
    }

    /// The objectives of a combination that ran to this extent, all to be minimised.
    pub fn known(&self, ordinal: u64, wanted: Extent) -> Option<Vec<f64>> {
        match self.outcomes.get(&ordinal)? {
            Outcome::Known { extent, metrics } if *extent == wanted => {
                minimised(&self.space.objectives, metrics)
            }
            _ => None,
        }
    }

    fn is_known(&self, ordinal: u64, wanted: Extent) -> bool {
        match self.outcomes.get(&ordinal) {
            Some(Outcome::Known { extent, .. }) => *extent == wanted,
            Some(_) => true,
            None => false,
        }
    }

    fn batch(&mut self, ordinals: &[u64], extent: Extent) -> Result<(), SweepError> {
        let mut candidates: Vec<Candidate> = Vec::new();
        let asked: BTreeSet<u64> =
            ordinals.iter().copied().filter(|ordinal| !self.is_known(*ordinal, extent)).collect();
        let mut kept = Vec::new();
        for &ordinal in ordinals.iter().filter(|ordinal| asked.contains(ordinal)) {
            match self.space.candidate(ordinal) {
                Ok(candidate) => candidates.push(candidate),
                Err(Impossible { reason, .. }) => {
                    self.tally.impossible += 1;
                    kept.push(self.point(ordinal, Outcome::Impossible(reason)));
                }
            }
        }
        let accuracies = self.accuracies(&candidates)?;
        if self.limits.prune && extent == Extent::Whole {
            let hopeful = self.hopeful(&candidates, &accuracies)?;
            let mut hopeful = hopeful.into_iter();
            candidates.retain(|candidate| {
                let is_kept = hopeful.next().unwrap_or(true);
                if !is_kept {
                    self.tally.pruned += 1;
                    self.outcomes.insert(candidate.ordinal, Outcome::Pruned);
                    kept.push(point_of(self.space, candidate.ordinal, &Outcome::Pruned));
                }
                is_kept
            });
        }
        let counted = self.counted(&candidates, extent)?;
        for (candidate, counted) in candidates.iter().zip(counted) {
            let Some(counted) = counted else { continue };
            let accuracy = accuracies.get(&candidate.ordinal);
            let outcome = match (counted, accuracy) {
                (Err(error), _) => Outcome::Failed(error),
                (Ok(_), Some(Err(error))) => Outcome::Failed(error.clone()),
                (Ok(counted), accuracy) => {
                    let accuracy = accuracy.and_then(|a| a.as_ref().ok());
                    Outcome::Known { extent, metrics: values(candidate, &counted, accuracy) }
                }
            };
            self.tally.failed += u64::from(matches!(outcome, Outcome::Failed(_)));
            kept.push(self.point(candidate.ordinal, outcome));
        }
        self.store.put_points(&kept)?;
        (self.progress)(&self.tally);
        Ok(())
    }

    /// Notes an outcome; the point for the store.
    fn point(&mut self, ordinal: u64, outcome: Outcome) -> (StoredPoint, String, String) {
        let point = point_of(self.space, ordinal, &outcome);
        self.outcomes.insert(ordinal, outcome);
        point
    }

    /// What each candidate counts in each workload; `None` where the sweep was stopped before.
    fn counted(
        &mut self,
        candidates: &[Candidate],
        extent: Extent,
    ) -> Result<Vec<Option<Counts>>, SweepError> {
        let n = self.setups.len();
        let mut hashes = Vec::with_capacity(candidates.len() * n);
        let mut known: BTreeMap<String, Result<Counted, String>> = BTreeMap::new();
        let mut jobs: Vec<(String, Job)> = Vec::new();
        for candidate in candidates {
            let mut all_found = true;
            for workload in 0..n {
                let hash = evaluation_hash(&candidate.spec, &self.settings[workload], extent);
                if !known.contains_key(&hash) && jobs.iter().all(|(asked, _)| *asked != hash) {
                    match self.store.evaluation(&hash)? {
                        Some(counted) => drop(known.insert(hash.clone(), counted)),
                        None => {
                            all_found = false;
                            jobs.push((hash.clone(), Job { spec: candidate.spec.clone(), workload, extent }));
                        }
                    }
                }
                hashes.push(hash);
            }
            self.tally.found += u64::from(all_found);
            self.tally.evaluated += u64::from(!all_found);
        }
        let (store, stop) = (Mutex::new(&mut *self.store), self.stop);
        let fault: Mutex<Option<StoreError>> = Mutex::new(None);
        let made: Mutex<BTreeMap<String, Result<Counted, String>>> = Mutex::new(BTreeMap::new());
        let (hashes_of_jobs, jobs): (Vec<String>, Vec<Job>) = jobs.into_iter().unzip();
        // A poisoned lock has a panic on its way already; the data are whole between two statements.
        self.evaluator.evaluate(&jobs, &|| stop.load(Ordering::Relaxed), &|i, counted| {
            let put = store
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .put_evaluation(&hashes_of_jobs[i], &counted);
            if let Err(error) = put {
                fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            }
            let mut made = made.lock().unwrap_or_else(PoisonError::into_inner);
            made.insert(hashes_of_jobs[i].clone(), counted);
        });
        if let Some(error) = fault.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error.into());
        }
        known.extend(made.into_inner().unwrap_or_else(PoisonError::into_inner));
        Ok(hashes
            .chunks(n)
            .map(|hashes| {
                hashes.iter().map(|hash| known.get(hash).cloned()).collect::<Option<Result<_, _>>>()
            })
            .collect())
    }

    /// How accurate each candidate's formats are, where an objective asks for it.
    fn accuracies(
        &mut self,
        candidates: &[Candidate],
    ) -> Result<BTreeMap<u64, Result<Accuracy, String>>, SweepError> {
        let needs = |needs| self.space.objectives.iter().any(|o| o.metric.needs == needs);
        let pictures = needs(Needs::Pictures);
        if !pictures && !needs(Needs::Verification) {
            return Ok(BTreeMap::new());
        }
        let mut known: BTreeMap<String, Result<Accuracy, String>> = BTreeMap::new();
        let mut found = BTreeMap::new();
        for candidate in candidates {
            let canonical = candidate.spec.canonical();
            let mut worst: Option<Result<Accuracy, String>> = None;
            for (setup, settings) in self.setups.iter().zip(&self.settings) {
                let hash = accuracy_hash(&canonical, settings, pictures);
                let accuracy = match known.get(&hash) {
                    Some(accuracy) => accuracy.clone(),
                    None => {
                        let accuracy = match self.store.accuracy(&hash)? {
                            Some(accuracy) => accuracy,
                            None if self.is_stopped() => break,
                            None => {
                                let measured = measure_accuracy(setup, &canonical, pictures);
                                self.store.put_accuracy(&hash, &measured)?;
                                measured
                            }
                        };
                        known.entry(hash).or_insert(accuracy).clone()
                    }
                };
                worst = Some(match (worst, accuracy) {
                    (None, one) => one,
                    (Some(Ok(a)), Ok(b)) => Ok(a.worse(b)),
                    (Some(Err(e)), _) | (_, Err(e)) => Err(e),
                });
            }
            found.extend(worst.map(|accuracy| (candidate.ordinal, accuracy)));
        }
        Ok(found)
    }

    /// The best objectives that a candidate can have.
    fn best(&mut self, candidate: &Candidate, accuracy: Option<&Accuracy>) -> Result<Vec<f64>, SweepError> {
        let (mut cycles, mut rays) = (0, 0);
        for workload in 0..self.setups.len() {
            let job = Job { spec: candidate.spec.clone(), workload, extent: Extent::Whole };
            // What cannot be prepared fails when it runs, with its reason: it is not pruned here.
            let Ok(work) = self.evaluator.work(&job) else {
                return Ok(vec![f64::NEG_INFINITY; self.space.objectives.len()]);
            };
            cycles += fewest_cycles(&candidate.spec, work);
            rays += work.iter().map(|command| command.rays).sum::<u64>();
        }
        Ok(optimistic(&self.space.objectives, candidate, cycles, rays, accuracy))
    }

    /// Whether each candidate's best is not dominated by what is known.
    fn hopeful(
        &mut self,
        candidates: &[Candidate],
        accuracies: &BTreeMap<u64, Result<Accuracy, String>>,
    ) -> Result<Vec<bool>, SweepError> {
        let known: Vec<Vec<f64>> =
            self.outcomes.keys().filter_map(|ordinal| self.known(*ordinal, Extent::Whole)).collect();
        candidates
            .iter()
            .map(|candidate| {
                let accuracy = accuracies.get(&candidate.ordinal).and_then(|a| a.as_ref().ok());
                let best = self.best(candidate, accuracy)?;
                Ok(!known.iter().any(|point| dominates(point, &best)))
            })
            .collect()
    }

    /// The ordinals, those first whose bounds rank best: the sum of their ranks over the objectives.
    fn most_hopeful_first(&mut self, ordinals: &[u64]) -> Result<Vec<u64>, SweepError> {
        let mut bounds = Vec::new();
        let mut rest = Vec::new();
        for &ordinal in ordinals {
            match self.space.candidate(ordinal) {
                Ok(candidate) => bounds.push((ordinal, self.best(&candidate, None)?)),
                Err(_) => rest.push(ordinal),
            }
        }
        let mut ranks = vec![0_usize; bounds.len()];
        for objective in 0..self.space.objectives.len() {
            let mut order: Vec<usize> = (0..bounds.len()).collect();
            order.sort_by(|a, b| bounds[*a].1[objective].total_cmp(&bounds[*b].1[objective]));
            order.iter().enumerate().for_each(|(rank, i)| ranks[*i] += rank);
        }
        let mut order: Vec<usize> = (0..bounds.len()).collect();
        order.sort_by_key(|i| (ranks[*i], bounds[*i].0));
        let mut sorted: Vec<u64> = order.into_iter().map(|i| bounds[i].0).collect();
        sorted.extend(rest);
        Ok(sorted)
    }
}

/// The workloads of a space, ready to run.
#[derive(Clone, Debug)]
pub struct Workloads {
    setups: Vec<WorkloadSetup>,
    /// What the rays of each depend on.
    settings: Vec<Vec<Setting>>,
}

impl Workloads {
    /// Looks at the scenes of a space.
    ///
    /// # Errors
    /// A scene that cannot be read, or that has no camera for camera rays.
    pub fn of(space: &Space) -> Result<Workloads, SweepError> {
        let setups: Vec<WorkloadSetup> = space.workloads.iter().map(WorkloadSetup::new).collect();
        let named = |setup: &WorkloadSetup| {
            let workload = setup.workload.name.clone();
            setup.settings().map_err(|source| SweepError::Workload { workload, source: Box::new(source) })
        };
        let settings = setups.iter().map(named).collect::<Result<_, _>>()?;
        Ok(Workloads { setups, settings })
    }
}

#[cfg(test)]
#[path = "sweep_tests.rs"]
mod tests;
