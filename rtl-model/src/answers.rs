//! Where the blocks get the datapath's answers from: computed as they are needed, computed and recorded, or looked up.
//!
//! ```text
//! block --At, how to compute it--> trait Answers --> ray | step | wanted rays | hit
//!                                    Live: computes      record/: Recorder computes and keeps, Replay looks up
//! ```
//! Static dispatch: with [`Live`] nothing is left of it. The answers to one bundle (in grid partition: to one ray) are
//! asked for in an order that no timing changes, which is what makes a record replayable.

use crate::blocks::Job;
use crate::datapath::cell_step::Cell;
use crate::datapath::{HitWords, RayWords};
use crate::sim::RayRef;

/// Who asks: a ray of a bundle in a cluster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct At {
    /// Cluster.
    pub cluster: u8,
    /// Slot and ray; where a whole bundle asks, its ray 0.
    pub ray: RayRef,
}

/// What a CTU finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The ray enters this cell.
    Enter(Cell),
    /// In shells: this, the next cell, is in a shell to come.
    Park(Cell),
    /// The ray leaves the grid, or nothing nearer can come.
    End,
}

/// A source of answers. `live` computes what is asked for.
pub trait Answers {
    /// A slot of a cluster takes a bundle: what follows for it is about this job.
    fn bundle(&mut self, at: At, job: &Job);

    /// A ray of a bundle that the generator expands.
    fn ray(&mut self, at: At, live: impl FnOnce() -> RayWords) -> RayWords;

    /// A CTU's step.
    fn step(&mut self, at: At, live: impl FnOnce() -> Step) -> Step;

    /// The rays that a list entry is to be tested with, a bit each; in grid partition bit 0 is the ray that asks.
    fn wanted(&mut self, at: At, live: impl FnOnce() -> u64) -> u64;

    /// A test.
    fn test(&mut self, at: At, live: impl FnOnce() -> Option<HitWords>) -> Option<HitWords>;
}

/// Computes everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Live;

impl Answers for Live {
    #[inline]
    fn bundle(&mut self, _: At, _: &Job) {}

    #[inline]
    fn ray(&mut self, _: At, live: impl FnOnce() -> RayWords) -> RayWords {
        live()
    }

    #[inline]
    fn step(&mut self, _: At, live: impl FnOnce() -> Step) -> Step {
        live()
    }

    #[inline]
    fn wanted(&mut self, _: At, live: impl FnOnce() -> u64) -> u64 {
        live()
    }

    #[inline]
    fn test(&mut self, _: At, live: impl FnOnce() -> Option<HitWords>) -> Option<HitWords> {
        live()
    }
}
