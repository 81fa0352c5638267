//! Computes what blocks ask for, and keeps it.
//!
//! ```text
//! bundle(slot, job): the slot's streams of the job before are packed; step, wanted, test: computed, appended to the slot's
//! end of the command: RecordedCommand
//! ```

use crate::answers::{Answers, At, Step};
use crate::blocks::Job;
use crate::datapath::{HitWords, RayWords};
use crate::spec::BoardSpec;

use super::stream::Answered;
use super::{RecordedCommand, RecordedJob, RecordedJobs};

/// Live answers, kept.
#[derive(Clone, Debug)]
pub struct Recorder {
    per_ray: bool,
    n_slots: usize,
    /// By cluster and slot.
    slots: Vec<Slot>,
    bundles: Packed,
    cast: Packed,
}

#[derive(Clone, Debug, Default)]
struct Slot {
    job: Option<Job>,
    answered: Answered,
}

/// Packed jobs, by their index: jobs end in an order that depends on timing.
#[derive(Clone, Debug, Default)]
struct Packed(Vec<(RecordedJob, Vec<u8>)>);

impl Packed {
    fn put(&mut self, job: &Job, bytes: Vec<u8>) {
        let at = job.index as usize;
        if self.0.len() <= at {
            self.0.resize_with(at + 1, Default::default);
        }
        let recorded = RecordedJob { n_rays: job.n_rays as u8, descriptor_bytes: job.bytes, end: 0 };
        self.0[at] = (recorded, bytes);
    }

    fn into_jobs(self) -> RecordedJobs {
        let mut jobs = RecordedJobs::default();
        for (job, bytes) in self.0 {
            jobs.bytes.extend(bytes);
            jobs.jobs.push(RecordedJob { end: jobs.bytes.len() as u64, ..job });
        }
        jobs
    }
}

impl Recorder {
    /// For one command on a board of `spec`.
    pub fn new(spec: &BoardSpec) -> Self {
        let n_slots = spec.clusters.bundle_slots as usize;
        Recorder {
            per_ray: !spec.partition.is_shells(),
            n_slots,
            slots: vec![Slot::default(); spec.clusters.count as usize * n_slots],
            bundles: Packed::default(),
            cast: Packed::default(),
        }
    }

    /// The command, when all its jobs have ended.
    pub fn finish(mut self, any_hit: bool, explicit: bool, work: u64) -> RecordedCommand {
        (0..self.slots.len()).for_each(|slot| self.pack(slot));
        let (bundles, cast) = (self.bundles.into_jobs(), self.cast.into_jobs());
        RecordedCommand { any_hit, explicit, work, bundles, cast }
    }

    fn pack(&mut self, slot: usize) {
        let Slot { job, answered } = &mut self.slots[slot];
        let Some(job) = job.take() else { return };
        let bytes = answered.to_bytes(self.per_ray);
        if job.low_resolution { &mut self.cast } else { &mut self.bundles }.put(&job, bytes);
    }

    fn slot(&mut self, at: At) -> usize {
        usize::from(at.cluster) * self.n_slots + usize::from(at.ray.slot)
    }

    fn lane(&self, at: At) -> usize {
        if self.per_ray { usize::from(at.ray.index) } else { 0 }
    }
}

impl Answers for Recorder {
    fn bundle(&mut self, at: At, job: &Job) {
        let slot = self.slot(at);
        self.pack(slot);
        let per_ray = self.per_ray;
        let slot = &mut self.slots[slot];
        slot.job = Some(*job);
        slot.answered.start(job.n_rays as usize, per_ray);
    }

    fn ray(&mut self, _: At, live: impl FnOnce() -> RayWords) -> RayWords {
        live()
    }

    fn step(&mut self, at: At, live: impl FnOnce() -> Step) -> Step {
        let (step, slot) = (live(), self.slot(at));
        self.slots[slot].answered.steps[usize::from(at.ray.index)].push(step);
        step
    }

    fn wanted(&mut self, at: At, live: impl FnOnce() -> u64) -> u64 {
        let (wanted, slot, lane) = (live(), self.slot(at), self.lane(at));
        self.slots[slot].answered.lanes[lane].wanted.push(wanted);
        wanted
    }

    fn test(&mut self, at: At, live: impl FnOnce() -> Option<HitWords>) -> Option<HitWords> {
        let (hit, slot, lane) = (live(), self.slot(at), self.lane(at));
        self.slots[slot].answered.lanes[lane].tests.push(hit);
        hit
    }
}
