//! Looks up what blocks ask for.
//!
//! ```text
//! bundle(slot, job): the job's streams --> the slot     step, wanted, test: the item at a cursor
//! ```
//! Steps have a cursor per ray; verdicts, tests and hits one per lane (a ray in grid partition, the bundle in shells).
//! A record that does not fit the board gives harmless answers and is found out: at its end a job must have been used up.

use crate::answers::{Answers, At, Step};
use crate::blocks::Job;
use crate::datapath::{HitWords, RayWords};
use crate::memory_image::MemoryImage;
use crate::spec::BoardSpec;

use super::stream::{Limits, Streams};
use super::{RecordError, RecordedCommand};

/// The answers of a recorded command.
#[derive(Clone, Debug)]
pub struct Replay<'a> {
    command: &'a RecordedCommand,
    limits: Limits,
    n_slots: usize,
    /// By cluster and slot.
    slots: Vec<Slot<'a>>,
    fault: Option<RecordError>,
}

#[derive(Clone, Debug, Default)]
struct Slot<'a> {
    job: Option<Job>,
    /// Something was asked for that there is not.
    ran_out: bool,
    streams: Streams<'a>,
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
        if slot.ran_out || !slot.streams.are_used_up() {
            let (job, low_resolution) = (job.index as usize, job.low_resolution);
            let what = "the answers are not those";
            self.fault.get_or_insert(RecordError { what, job, low_resolution });
        }
    }

    #[inline]
    fn slot(&mut self, at: At) -> (&mut Slot<'a>, usize) {
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
        (slot.job, slot.ran_out) = (Some(*job), false);
        if let Err(what) = slot.streams.open(jobs.streams(index), job.n_rays as usize, &self.limits) {
            self.fault.get_or_insert(RecordError { what, job: index, low_resolution });
        }
    }

    /// No ray: words that nobody looks at.
    #[inline]
    fn ray(&mut self, _: At, _: impl FnOnce() -> RayWords) -> RayWords {
        RayWords { origin: [0; 3], dir: [0; 3], t_max: 0 }
    }

    #[inline]
    fn step(&mut self, at: At, _: impl FnOnce() -> Step) -> Step {
        let (slot, _) = self.slot(at);
        slot.streams.step(usize::from(at.ray.index)).unwrap_or_else(|| {
            slot.ran_out = true;
            Step::End
        })
    }

    #[inline]
    fn wanted(&mut self, at: At, _: impl FnOnce() -> u64) -> u64 {
        let per_ray = self.limits.per_ray;
        let (slot, lane) = self.slot(at);
        let wanted = if per_ray { slot.streams.verdict(lane) } else { slot.streams.mask(lane) };
        wanted.unwrap_or_else(|| {
            slot.ran_out = true;
            0
        })
    }

    #[inline]
    fn test(&mut self, at: At, _: impl FnOnce() -> Option<HitWords>) -> Option<HitWords> {
        let (slot, lane) = self.slot(at);
        slot.streams.test(lane).unwrap_or_else(|| {
            slot.ran_out = true;
            None
        })
    }
}
