//! Energy of a run on the board's chips.
//!
//! ```text
//! BoardStatistics --events by kind--> events x pJ + cycles x clock of all registers + leakage x time
//! ```
//! | block | event |
//! |---|---|
//! | icu, division | a test, those of low-resolution casts too |
//! | caches, cluster_buffer | a look-up |
//! | dram (its controller) | a line |
//! | links | a cycle in which any block works: a token written and read |
//! | all others | a cycle of work of the block |
//!
//! ASSUMED: no clock gating, so all registers are clocked in every cycle; a share `activity` of the gates that work on an
//! event switch. Left out: the DRAM's chips, the bus's drivers, pads, the host.

use super::Cost;
use crate::sim::Cause;
use crate::spec::BoardSpec;
use crate::statistics::BoardStatistics;

impl Cost {
    /// Energy (J) that the board's chips take for what was counted, at the clock of `spec`.
    pub fn energy_j(&self, spec: &BoardSpec, counted: &BoardStatistics) -> f64 {
        let events: f64 = self.blocks.iter().map(|b| events(b.block, counted) as f64 * b.event_pj).sum();
        let cycles = counted.cycles as f64;
        let seconds = cycles / (spec.clock_mhz * 1e6);
        (events + cycles * self.clock_pj) * 1e-12 + self.leakage_w * seconds
    }
}

/// Events of all blocks of a kind.
fn events(kind: &str, counted: &BoardStatistics) -> u64 {
    let work = |of: &dyn Fn(&str) -> bool| -> u64 {
        counted.blocks.iter().filter(|b| of(&b.block)).map(|b| b.of(Cause::Work)).sum()
    };
    match kind {
        "icu" | "division" => counted.canonical.tests + counted.canonical.low_resolution.tests,
        "patch_cache" | "list_cache" | "mask_cache" | "cluster_buffer" | "dram" => {
            counted.memory.iter().filter(|level| level.level == kind).map(|level| level.accesses).sum()
        }
        "links" => work(&|_| true),
        _ => work(&|name| kind_of(name) == kind),
    }
}

/// The last part of a block's name without its number.
fn kind_of(name: &str) -> &str {
    let last = name.rsplit('.').next().unwrap_or(name);
    last.trim_end_matches(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
#[path = "energy_tests.rs"]
mod tests;
