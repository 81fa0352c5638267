//! Candidates through the board: what is shared is prepared once, then each board runs by itself, on all cores.
//!
//! ```text
//! Job (board, workload, Extent) --canonical board--> Shared: patch memory + record | commands, work.rs
//!                                     `--> one Board each: replay | sample --> Counted
//! Counted of all workloads, Cost, Accuracy --metrics.rs--> a value a metric
//! canonical work alone --estimate.rs--> fewest cycles --> is it dominated already?
//! ```
//! A record of one board serves all whose canonical boards are equal: any clusters, contexts, depths, caches, memory, bus,
//! scheduling, clocks. Two do not share: one whose patch memory is too small for the wanted grid, and one that is sampled.
//! An internal fault of a board is a failure of its candidate, not of the sweep.

mod accuracy;
mod estimate;
mod metrics;
mod work;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;
use rtl_model::board::Board;
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;
use serde::{Deserialize, Serialize};

pub use accuracy::{Accuracy, measure as measure_accuracy};
pub use estimate::{CommandWork, fewest_cycles};
pub use metrics::{minimised, optimistic, values};
pub use work::{Extent, Shared, WorkloadSetup};

use crate::recorded::sample;

/// What a board counted in a workload.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Counted {
    /// Every counter; of a sample those of the commands that ran, `cycles` apart.
    pub statistics: BoardStatistics,
    /// Of a sample: half the 95 % interval of `statistics.cycles`, which are estimated.
    pub half_width_cycles: Option<f64>,
}

/// A board and what it is driven with.
#[derive(Clone, Debug)]
pub struct Job {
    /// The board.
    pub spec: BoardSpec,
    /// Which workload of the space.
    pub workload: usize,
    /// How much of it.
    pub extent: Extent,
}

/// What groups of boards have in common, by workload, extent and canonical board.
type Key = (usize, String, String);

/// Evaluates jobs; keeps what they share.
pub struct Evaluator {
    setups: Vec<WorkloadSetup>,
    shared: BTreeMap<Key, Result<Shared, String>>,
}

/// Groups that are kept when a batch needs none of them.
const KEPT_GROUPS: usize = 64;

impl Evaluator {
    /// Of a space's workloads.
    pub fn new(setups: Vec<WorkloadSetup>) -> Evaluator {
        Evaluator { setups, shared: BTreeMap::new() }
    }

    /// Evaluates `jobs` on all cores; `done` is told each result as it comes, in no order.
    ///
    /// Results depend on the jobs alone.
    pub fn evaluate(
        &mut self,
        jobs: &[Job],
        is_stopped: &(dyn Fn() -> bool + Sync),
        done: &(dyn Fn(usize, Result<Counted, String>) + Sync),
    ) {
        let keys = self.prepare(jobs);
        let shared = &self.shared;
        jobs.par_iter().zip(&keys).enumerate().for_each(|(i, (job, key))| {
            if is_stopped() {
                return;
            }
            let counted = match &shared[key] {
                Ok(shared) => guarded(|| self.run(job, shared)),
                Err(fault) => Err(fault.clone()),
            };
            done(i, counted);
        });
    }

    /// The canonical work of each command of a job.
    ///
    /// # Errors
    /// Why its work cannot be prepared.
    pub fn work(&mut self, job: &Job) -> Result<&[CommandWork], String> {
        let key = self.prepare(std::slice::from_ref(job)).remove(0);
        match &self.shared[&key] {
            Ok(shared) => Ok(&shared.work),
            Err(fault) => Err(fault.clone()),
        }
    }

    /// Prepares what the jobs share; the key of each.
    fn prepare(&mut self, jobs: &[Job]) -> Vec<Key> {
        let keys: Vec<Key> = jobs.iter().map(key_of).collect();
        let mut missing: BTreeMap<&Key, &Job> = BTreeMap::new();
        for (key, job) in keys.iter().zip(jobs) {
            if !self.shared.contains_key(key) {
                missing.entry(key).or_insert(job);
            }
        }
        if self.shared.len() + missing.len() > KEPT_GROUPS {
            self.shared.retain(|key, _| keys.contains(key));
        }
        let setups = &self.setups;
        let missing: Vec<(&Key, &Job)> = missing.into_iter().collect();
        let made: Vec<(Key, Result<Shared, String>)> = missing
            .par_iter()
            .map(|(key, job)| {
                let setup = &setups[job.workload];
                ((*key).clone(), guarded(|| Shared::prepare(setup, &job.spec.canonical(), job.extent)))
            })
            .collect();
        self.shared.extend(made);
        keys
    }

    /// Runs a job.
    fn run(&self, job: &Job, shared: &Shared) -> Result<Counted, String> {
        let spec = &job.spec;
        let needed = shared.image.size_bytes() as u64 + spec.mask_bytes(shared.image.n_patches);
        if spec.grid_log2.is_none() && needed > spec.dram.bytes {
            // Its automatic grid is coarser: nobody else's record.
            return self.setups[job.workload].simulate(spec, job.extent).map(Counted::whole);
        }
        let mut board = Board::new(spec, shared.image.clone()).map_err(|e| e.to_string())?;
        match job.extent {
            Extent::Sample { share, seed } => {
                let (by_purpose, estimate) =
                    sample::run(&mut board, &shared.commands, share, seed, &mut |_| {})
                        .map_err(|e| e.to_string())?;
                let mut statistics =
                    by_purpose.into_iter().fold(BoardStatistics::default(), |sum, (_, s)| sum.plus(&s));
                statistics.cycles = estimate.cycles.round() as u64;
                Ok(Counted { statistics, half_width_cycles: Some(estimate.half_width_cycles) })
            }
            Extent::Whole | Extent::Rung(_) => {
                for command in &shared.record {
                    board.replay(command).map_err(|e| e.to_string())?;
                }
                Ok(Counted::whole(board.statistics()))
            }
        }
    }
}

impl Counted {
    /// Counts of a whole run.
    pub fn whole(statistics: BoardStatistics) -> Counted {
        Counted { statistics, half_width_cycles: None }
    }
}

fn key_of(job: &Job) -> Key {
    // Debug shows every field, and floats exactly.
    (job.workload, format!("{:?}", job.extent), format!("{:?}", job.spec.canonical()))
}

/// A panic of the model as an error of its candidate.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let said = payload
            .downcast_ref::<String>()
            .cloned()
            .or_else(|| payload.downcast_ref::<&str>().map(|s| (*s).to_owned()));
        Err(format!("internal error: {}", said.unwrap_or_else(|| "a panic without a message".to_owned())))
    })
}

#[cfg(test)]
mod tests;
