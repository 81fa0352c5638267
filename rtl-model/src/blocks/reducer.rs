//! Nearest-hit reducer: keeps the nearest hit of every ray of its module and tells whoever waits.
//!
//! ```text
//! TestResult --> [ best (t, patch id) per ray ] --Reduced--> wire to the CTU (grid) or shell tracker (shells)
//! ```
//! The smallest (t, patch id) wins, so the answer never depends on the order of tests.
//! Timing: one result a cycle, told in the same cycle, seen in the next. No stall.
//! Source: 1990-92 board papers; timing ASSUMED.

use crate::sim::{Activity, Cycle, Fifo, Observer, Phase, Wires};

use super::{RayStore, Reduced, Run, TestResult};

/// The block; the best hits are in the cluster's [`RayStore`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Reducer;

/// The ports of a cycle.
#[derive(Debug)]
pub struct ReducerIo<'a> {
    /// From the ICU.
    pub results: &'a mut Fifo<TestResult>,
    /// The best hits.
    pub store: &'a mut RayStore,
    /// To the CTUs of the module (grid), or its tracker, reader 0 (shells).
    pub reduced: &'a mut Wires<Reduced>,
}

impl Reducer {
    /// One cycle.
    #[inline]
    pub fn tick<A, O: Observer>(
        &mut self,
        now: Cycle,
        io: ReducerIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        let Some(TestResult { ray, context, hit }) = io.results.take(now, run.observer) else {
            return Activity::Idle;
        };
        let best = io.store.reduce(ray, hit);
        run.observer.ray(now, run.block, ray, Phase::Reducing, Phase::Away);
        // In shells the context is 0, and so is the reader.
        io.reduced.set(
            now,
            usize::from(context.ctu),
            Reduced { context: context.context, slot: ray.slot, best },
        );
        Activity::Work
    }
}
