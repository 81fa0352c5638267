//! Intersection Computation Unit: one ray x patch test every `initiation_interval` cycles, out after `depth`.
//!
//! ```text
//! TestToken (ray context, patch record) --> [ pipeline, depth cycles ] --> TestResult
//! ```
//! The arithmetic is `datapath::ray_patch`, whatever the timing. Stalls as a whole when the result FIFO is full (output
//! full). The unit works in the `initiation_interval` cycles from each test on, whether a token waits or not; beyond
//! them it is starved while a test is inside and idle with none.
//! Source: the ICU of the 1990-92 board papers; depth and interval ASSUMED (a fully pipelined fixed-point unit).

use crate::datapath::ray_patch::intersect;
use crate::functional::CanonicalCounters;
use crate::memory_image::MemoryImage;
use crate::sim::{Activity, Cause, Cycle, Fifo, Pipe};
use crate::spec::IcuSpec;

use super::{Ctu, TestResult, TestToken};

/// The unit.
#[derive(Clone, Debug)]
pub struct Icu {
    pipe: Pipe<TestResult>,
    initiation_interval: u32,
    cooldown: u32,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct IcuIo<'a> {
    /// The patch records.
    pub image: &'a MemoryImage,
    /// The CTUs of the module, whose context registers hold the rays.
    pub ctus: &'a [Ctu],
    /// From the patch loader.
    pub tests: &'a mut Fifo<TestToken>,
    /// To the reducer.
    pub results: &'a mut Fifo<TestResult>,
    /// Canonical counts.
    pub counters: &'a mut CanonicalCounters,
}

impl Icu {
    /// An idle unit.
    pub fn new(spec: &IcuSpec) -> Self {
        Icu { pipe: Pipe::new(spec.depth), initiation_interval: spec.initiation_interval, cooldown: 0 }
    }

    /// True when no test is inside.
    pub fn is_quiet(&self) -> bool {
        self.pipe.is_empty()
    }

    /// One cycle.
    #[inline]
    pub fn tick(&mut self, now: Cycle, io: IcuIo<'_>) -> Activity {
        if self.pipe.is_empty() && io.tests.front(now).is_none() {
            self.cooldown = self.cooldown.saturating_sub(1);
            return if self.cooldown > 0 { Activity::Work } else { Activity::Idle };
        }
        if let Some(&result) = self.pipe.head() {
            if !io.results.can_push(now) {
                return Activity::Stall(Cause::OutputFull);
            }
            io.results.push(now, result);
        }
        self.cooldown = self.cooldown.saturating_sub(1);
        if self.cooldown > 0 {
            self.pipe.step(None);
            return Activity::Work;
        }
        let input = io.tests.pop(now).map(|TestToken { context, patch, fresh }| {
            io.counters.tests += 1;
            let ray = io.ctus[usize::from(context.ctu)].ray(context.context);
            TestResult { context, hit: intersect(&io.image.formats, ray, io.image.patch_ref(patch)), fresh }
        });
        self.pipe.step(input);
        if input.is_some() {
            self.cooldown = self.initiation_interval;
            Activity::Work
        } else {
            Activity::Stall(Cause::Starved)
        }
    }
}
