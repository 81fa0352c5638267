//! Looks up what blocks ask for.
//!
//! ```text
//! bundle(slot, job): the job's streams --decoded--> arrays of the slot     step, wanted, test: next item of its array
//! ```
//! Steps have a cursor per ray; verdicts, tests and hits one per lane (a ray in grid partition, the bundle in shells).
//! A record that does not fit the board gives harmless answers and is found out: at its end a job must have been used up.

use crate::answers::{Answers, At, Step};
use crate::blocks::Job;
use crate::datapath::{HitWords, RayWords};
use crate::memory_image::MemoryImage;
use crate::packet::MAX_BUNDLE_RAYS;
use crate::spec::BoardSpec;

use super::stream::{Decoded, Limits, Starts};
use super::{RecordError, RecordedCommand};

/// The answers of a recorded command.
#[derive(Clone, Debug)]
pub struct Replay<'a> {
    command: &'a RecordedCommand,
    limits: Limits,
    n_slots: usize,
    /// By cluster and slot.
    slots: Vec<Slot>,
    fault: Option<RecordError>,
}

#[derive(Clone, Debug)]
struct Slot {
    job: Option<Job>,
    streams: Decoded,
    /// The next item of each ray or lane.
    steps: Starts,
    wanted: Starts,
    tests: Starts,
    hits: Starts,
}

impl Default for Slot {
    fn default() -> Self {
        let none = [0; MAX_BUNDLE_RAYS + 1];
        Slot { job: None, streams: Decoded::default(), steps: none, wanted: none, tests: none, hits: none }
    }
}

impl Slot {
    /// Every item was asked for, and none beyond.
    fn is_used_up(&self) -> bool {
        let streams = &self.streams;
        let (rays, lanes) = (streams.n_rays, streams.n_lanes);
        self.steps[..rays] == streams.steps_at[1..=rays]
            && self.wanted[..lanes] == streams.wanted_at[1..=lanes]
            && self.tests[..lanes] == streams.tests_at[1..=lanes]
            && self.hits[..lanes] == streams.hits_at[1..=lanes]
    }
}

impl<'a> Replay<'a> {
    /// Of a command on a board of `spec` with this image.
    pub fn new(spec: &BoardSpec, image: &MemoryImage, command: &'a RecordedCommand) -> Self {
        let n_slots = spec.clusters.bundle_slots as usize;
        Replay {
            command,
            limits: Limits { per_ray: !spec.partition.is_shells(), grid: image.grid },
            n_slots,
            slots: vec![Slot::default(); spec.clusters.count as usize * n_slots],
            fault: None,
        }
    }

    /// The end of the command.
    ///
    /// # Errors
    /// A job that was not answered by its record.
    pub fn finish(mut self) -> Result<(), RecordError> {
        (0..self.slots.len()).for_each(|slot| self.check(slot));
        self.fault.map_or(Ok(()), Err)
    }

    fn check(&mut self, slot: usize) {
        let slot = &mut self.slots[slot];
        let Some(job) = slot.job.take() else { return };
        if !slot.is_used_up() {
            let (job, low_resolution) = (job.index as usize, job.low_resolution);
            let what = "the answers are not those";
            self.fault.get_or_insert(RecordError { what, job, low_resolution });
        }
    }

    #[inline]
    fn slot(&mut self, at: At) -> (&mut Slot, usize) {
        let lane = if self.limits.per_ray { usize::from(at.ray.index) } else { 0 };
        (&mut self.slots[usize::from(at.cluster) * self.n_slots + usize::from(at.ray.slot)], lane)
    }
}

impl Answers for Replay<'_> {
    fn bundle(&mut self, at: At, job: &Job) {
        let slot = usize::from(at.cluster) * self.n_slots + usize::from(at.ray.slot);
        self.check(slot);
        let (index, low_resolution) = (job.index as usize, job.low_resolution);
        let jobs = if low_resolution { &self.command.cast } else { &self.command.bundles };
        let slot = &mut self.slots[slot];
        slot.job = Some(*job);
        if let Err(what) = slot.streams.read(jobs.streams(index), job.n_rays as usize, &self.limits) {
            self.fault.get_or_insert(RecordError { what, job: index, low_resolution });
        }
        slot.steps = slot.streams.steps_at;
        slot.wanted = slot.streams.wanted_at;
        slot.tests = slot.streams.tests_at;
        slot.hits = slot.streams.hits_at;
    }

    /// No ray: words that nobody looks at.
    #[inline]
    fn ray(&mut self, _: At, _: impl FnOnce() -> RayWords) -> RayWords {
        RayWords { origin: [0; 3], dir: [0; 3], t_max: 0 }
    }

    #[inline]
    fn step(&mut self, at: At, _: impl FnOnce() -> Step) -> Step {
        let (slot, _) = self.slot(at);
        let next = &mut slot.steps[usize::from(at.ray.index)];
        let step = slot.streams.steps.get(*next as usize).map_or(Step::End, |word| word.step());
        *next += 1;
        step
    }

    #[inline]
    fn wanted(&mut self, at: At, _: impl FnOnce() -> u64) -> u64 {
        let (slot, lane) = self.slot(at);
        let next = &mut slot.wanted[lane];
        let wanted = slot.streams.wanted.get(*next as usize).copied().unwrap_or(0);
        *next += 1;
        wanted
    }

    #[inline]
    fn test(&mut self, at: At, _: impl FnOnce() -> Option<HitWords>) -> Option<HitWords> {
        let (slot, lane) = self.slot(at);
        let next = &mut slot.tests[lane];
        let word = slot.streams.tests.get((*next / 64) as usize).copied().unwrap_or(0);
        let is_hit = word >> (*next % 64) & 1 == 1;
        *next += 1;
        if !is_hit {
            return None;
        }
        let next = &mut slot.hits[lane];
        let hit = slot.streams.hits.get(*next as usize).copied();
        *next += 1;
        hit
    }
}
