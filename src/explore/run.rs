//! The product `explore`: a sweep from its space to its results, whole, in part, resumed, or merged.
//!
//! ```text
//! Space, Options --open store: new | resumed--> plan -> [shard's part | merge] -> strategy -> collect -> Explored
//!                                                                                     `-> check: in full, no record
//! ```

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use super::STORE_FILE;
use super::collect;
use super::evaluate::{Extent, Job};
use super::results::Results;
use super::results::pareto::dominates;
use super::shard::{self, MergeError, Shard, Whole, key};
use super::space::Space;
use super::store::{Store, StoreError, evaluation_hash, hash_of, version};
use super::strategy;
use super::sweep::{Limits, Outcome, Sweep, SweepError, Tally, Workloads};
use crate::sampling::mix;

/// How a sweep is run.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Its folder.
    pub folder: PathBuf,
    /// Go on with the store that is there.
    pub resume: bool,
    /// Only a part.
    pub shard: Option<Shard>,
    /// Put these shards together, simulating nothing.
    pub merge: Vec<PathBuf>,
    /// When it ends, what it leaves out.
    pub limits: Limits,
    /// Share of the simulated candidates that are simulated once more, in full.
    pub check: Option<f64>,
}

/// What became of a sweep.
#[derive(Debug)]
pub struct Explored {
    /// What was found; none of a shard, or of a sweep that was stopped.
    pub results: Option<Results>,
    /// What was done.
    pub tally: Tally,
    /// What was planned, where it is known beforehand.
    pub planned: Option<u64>,
    /// The user stopped it.
    pub stopped: bool,
    /// Candidates that were simulated once more.
    pub checked: Option<Checked>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Candidates that were simulated once more, in full: every ray traced by the clocked board.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checked {
    /// Candidates.
    pub n: u64,
    /// Runs of theirs, one a workload.
    pub runs: u64,
    /// Of these, pruned ones: their bound held and the front dominates them.
    pub pruned: u64,
    /// What was not as it should be.
    pub faults: Vec<String>,
}

/// Why a sweep has no results.
#[derive(Debug, thiserror::Error)]
pub enum ExploreError {
    /// The sweep.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// The store.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The shards.
    #[error(transparent)]
    Merge(#[from] MergeError),
    /// Flags that do not go together, or with what is there.
    #[error("{0}")]
    Usage(String),
    /// The folder.
    #[error("{path}: {what}", path = .path.display())]
    Folder {
        /// Which.
        path: PathBuf,
        /// Why not.
        what: String,
    },
}

/// Runs a sweep.
///
/// # Errors
/// A store, scene, shard or search that cannot be used.
pub fn run(
    space: &Space,
    options: &Options,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(&Tally),
) -> Result<Explored, ExploreError> {
    let mut plan = strategy::plan(space).map_err(ExploreError::Usage)?;
    if plan.is_none() && (options.shard.is_some() || !options.merge.is_empty()) {
        let what = "a search that depends on its answers cannot be cut into shards: expected strategy grid, random or sobol";
        return Err(ExploreError::Usage(what.to_owned()));
    }
    if options.limits.time.is_some() && (options.shard.is_some() || !options.merge.is_empty()) {
        let what = "a shard that ends by time is not all of its part: expected no `minutes` with shards";
        return Err(ExploreError::Usage(what.to_owned()));
    }
    // Scenes and shards are looked at before anything is made.
    let workloads = Workloads::of(space)?;
    let mut warnings = Vec::new();
    let space_hash =
        hash_of(&(&space.text, &space.base, &space.search, options.limits.sample.map(f64::to_bits)));
    let plan_hash = hash_of(&plan);
    let parts = match (options.merge.as_slice(), &plan) {
        ([], _) | (_, None) => Vec::new(),
        (folders, Some(ordinals)) => {
            shard::parts(folders, Whole { space: &space_hash, plan: &plan_hash, ordinals })?
        }
    };
    let mut store = open(options, &space_hash, &mut warnings)?;
    store.set_meta(key::SPACE, &space_hash)?;
    store.set_meta(key::VERSION, &version())?;
    store.set_meta(key::PLAN, &plan_hash)?;
    store.forget_meta(key::COMPLETE)?;
    for part in &parts {
        store.take_evaluations(part)?;
    }
    if let (Some(shard), Some(ordinals)) = (options.shard, &mut plan) {
        store.set_meta(key::SHARD, &shard.to_string())?;
        *ordinals = shard.part(ordinals);
    }
    if let (Some(ordinals), Some(_)) = (&mut plan, options.limits.time) {
        // What there is time for is spread over the space.
        ordinals.sort_by_key(|ordinal| mix(mix(space.search.seed).wrapping_add(*ordinal)));
    }
    let planned = plan.as_ref().map(|ordinals| ordinals.len() as u64);

    let mut sweep = Sweep::new(space, workloads, &mut store, options.limits, stop, progress);
    strategy::run(&mut sweep, plan.as_deref())?;
    let tally = sweep.tally();
    if !options.merge.is_empty() && tally.evaluated > 0 {
        let what = format!("{} points were in no shard, though all are complete", tally.evaluated);
        return Err(ExploreError::Usage(what));
    }
    let mut explored =
        Explored { results: None, tally, planned, stopped: sweep.is_stopped(), checked: None, warnings };
    if explored.stopped {
        return Ok(explored);
    }
    if let Some(share) = options.check {
        explored.checked = Some(check(&mut sweep, share)?);
    }
    let settings = sweep.settings().to_vec();
    let outcomes = sweep.into_outcomes();
    store.set_meta(key::COMPLETE, "yes")?;
    if options.shard.is_none() {
        explored.results = Some(collect::results(space, &outcomes, &store, &settings)?);
    }
    Ok(explored)
}

/// Opens the store of a sweep's folder.
fn open(options: &Options, space_hash: &str, warnings: &mut Vec<String>) -> Result<Store, ExploreError> {
    let folder = &options.folder;
    std::fs::create_dir_all(folder).map_err(|e| ExploreError::Folder {
        path: folder.clone(),
        what: format!("cannot make this folder: {e}"),
    })?;
    let file = folder.join(STORE_FILE);
    let is_there = file.exists();
    if is_there && !options.resume {
        return Err(ExploreError::Folder {
            path: folder.clone(),
            what: format!(
                "has a sweep ({STORE_FILE}) already: expected --resume, which goes on with it, or another folder"
            ),
        });
    }
    let store = Store::open(&file)?;
    if !is_there {
        return Ok(store);
    }
    let wanted = options.shard.map(|s| s.to_string());
    let found = store.meta(key::SHARD)?;
    if wanted != found {
        let name =
            |shard: &Option<String>| shard.as_ref().map_or("a whole sweep".into(), |s| format!("shard {s}"));
        let what = format!("the store is of {}, expected {}", name(&found), name(&wanted));
        return Err(ExploreError::Folder { path: folder.clone(), what });
    }
    if store.meta(key::SPACE)?.as_deref() != Some(space_hash) {
        let n = store.n_evaluations()?;
        warnings.push(format!(
            "{}: the space or its search has changed; of {n} evaluations in the store those that it still asks for are used",
            folder.display()
        ));
        store.forget_points()?;
    }
    Ok(store)
}

/// Simulates a share of the candidates once more: simulated ones must count the same in every counter of every block;
/// pruned ones take at least their bound's cycles, and are dominated.
fn check(sweep: &mut Sweep<'_>, share: f64) -> Result<Checked, ExploreError> {
    let mut checked = Checked::default();
    let seed = mix(sweep.space().search.seed ^ 0x00c0_ffee);
    let outcomes = sweep.outcomes().clone();
    let chosen = |wanted: &dyn Fn(&Outcome) -> bool| -> Vec<u64> {
        let mut all: Vec<u64> =
            outcomes.iter().filter(|(_, o)| wanted(o)).map(|(ordinal, _)| *ordinal).collect();
        let n = (all.len() as f64 * share).ceil() as usize;
        all.sort_by_key(|ordinal| mix(seed.wrapping_add(*ordinal)));
        all.truncate(n);
        all.sort_unstable();
        all
    };
    let is_whole = |o: &Outcome| matches!(o, Outcome::Known { extent: Extent::Whole, .. });
    let front: Vec<Vec<f64>> = outcomes.keys().filter_map(|o| sweep.known(*o, Extent::Whole)).collect();
    for ordinal in chosen(&is_whole) {
        sweep.check_simulated(ordinal, &mut checked)?;
    }
    for ordinal in chosen(&|o| *o == Outcome::Pruned) {
        checked.pruned += 1;
        let known = sweep.check_pruned(ordinal, &mut checked)?;
        if known.is_some_and(|objectives| !front.iter().any(|point| dominates(point, &objectives))) {
            checked.faults.push(format!("point {ordinal} was pruned and is not dominated"));
        }
    }
    Ok(checked)
}

impl Sweep<'_> {
    /// Compares a candidate's kept counts with those of boards that trace every ray.
    fn check_simulated(&mut self, ordinal: u64, checked: &mut Checked) -> Result<(), ExploreError> {
        let Ok(candidate) = self.space().candidate(ordinal) else { return Ok(()) };
        checked.n += 1;
        for (workload, full) in self.simulate_in_full(&candidate.spec).into_iter().enumerate() {
            checked.runs += 1;
            let hash = evaluation_hash(&candidate.spec, &self.settings()[workload], Extent::Whole);
            let kept = self.store().evaluation(&hash)?;
            match (full, kept) {
                (Ok(full), Some(Ok(kept))) if full == kept.statistics => {}
                (Ok(full), Some(Ok(kept))) => checked.faults.push(format!(
                    "point {ordinal}: {} cycles in full, {} from the record, or another counter differs",
                    full.cycles, kept.statistics.cycles
                )),
                (full, kept) => checked.faults.push(format!(
                    "point {ordinal}: {} in full, {} from the record",
                    full.map_or_else(|e| e, |_| "runs".to_owned()),
                    kept.map_or("nothing".to_owned(), |k| k.map_or_else(|e| e, |_| "runs".to_owned()))
                )),
            }
        }
        Ok(())
    }

    /// Simulates a pruned candidate; its objectives.
    fn check_pruned(
        &mut self,
        ordinal: u64,
        checked: &mut Checked,
    ) -> Result<Option<Vec<f64>>, ExploreError> {
        let Ok(candidate) = self.space().candidate(ordinal) else { return Ok(None) };
        checked.n += 1;
        let mut counted = Vec::new();
        for (workload, full) in self.simulate_in_full(&candidate.spec).into_iter().enumerate() {
            checked.runs += 1;
            let job = Job { spec: candidate.spec.clone(), workload, extent: Extent::Whole };
            let bound = self.fewest_cycles(&job);
            match (full, bound) {
                (Ok(full), Ok(bound)) => {
                    if bound > full.cycles {
                        let cycles = full.cycles;
                        checked.faults.push(format!("point {ordinal}: {cycles} cycles, bound {bound}"));
                    }
                    counted.push(super::evaluate::Counted::whole(full));
                }
                // A candidate that fails is on no front.
                _ => return Ok(None),
            }
        }
        Ok(self.objectives_of(&candidate, &counted))
    }
}
