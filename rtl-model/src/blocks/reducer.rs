//! Nearest-hit reducer: keeps the nearest hit of every ray of its module and tells the CTUs.
//!
//! ```text
//! TestResult --> [ best (t, patch id) per context ] --Reduced--> wire to the CTU        one result a cycle, no stall
//! ```
//! The smallest (t, patch id) wins, so the answer never depends on the order of tests.
//! Source: 1990-92 board papers; timing ASSUMED.

use crate::datapath::HitWords;
use crate::sim::{Activity, Cycle, Fifo, Wires};

use super::{Reduced, TestResult};

/// The block.
#[derive(Clone, Debug)]
pub struct Reducer {
    best: Vec<Option<HitWords>>,
    contexts_per_ctu: usize,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct ReducerIo<'a> {
    /// From the ICU.
    pub results: &'a mut Fifo<TestResult>,
    /// To the CTUs of the module.
    pub reduced: &'a mut Wires<Reduced>,
}

impl Reducer {
    /// For `n_ctus` CTUs of `contexts` contexts each.
    pub fn new(n_ctus: u32, contexts: u32) -> Self {
        Reducer { best: vec![None; (n_ctus * contexts) as usize], contexts_per_ctu: contexts as usize }
    }

    /// One cycle.
    #[inline]
    pub fn tick(&mut self, now: Cycle, io: ReducerIo<'_>) -> Activity {
        let Some(TestResult { context, hit, fresh }) = io.results.pop(now) else { return Activity::Idle };
        let best = &mut self.best[context.index(self.contexts_per_ctu)];
        let before = if fresh { None } else { *best };
        *best = HitWords::nearer(before, hit);
        io.reduced.set(now, usize::from(context.ctu), Reduced { context: context.context, best: *best });
        Activity::Work
    }
}
