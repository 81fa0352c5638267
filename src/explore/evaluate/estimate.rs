//! Fewest cycles of a board, from canonical work alone: no board is run.
//!
//! ```text
//! command: set-up + interrupt + the host's own cycles + max(bus, steps, low-resolution part + bundles' part)
//!   part:  max(tests / ICUs, cells / CTUs, rays / bundle generators), each unit one thing an interval
//!   bus:   beats + an arbitration a full burst, down and up, at the bus clock
//! ```
//! Commands follow each other, and a low-resolution cast ends before the bundles of its command begin, so their bounds add
//! up. Within a part all resources work at once, so the slowest bounds it. Formulas of units and bus are those of
//! `report::bounds`. Not counted, so the bound is one: latencies, misses, imbalance, the wait at the end of each cell or
//! shell.

use rtl_model::functional::LowResolutionWork;
use rtl_model::sim::Cause;
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;

use crate::report::bounds::{bus, units};
use crate::report::groups::kind;

/// What a command comes to on any board of its canonical board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CommandWork {
    /// Rays, those of the low-resolution cast not counted.
    pub rays: u64,
    /// Cells that they enter.
    pub cells: u64,
    /// Tests with patches.
    pub tests: u64,
    /// Steps of CTUs, the low-resolution cast's counted.
    pub steps: u64,
    /// What its low-resolution cast does.
    pub low: LowResolutionWork,
    /// Bytes from the host.
    pub down_bytes: u64,
    /// Bytes to the host.
    pub up_bytes: u64,
}

impl CommandWork {
    /// As counted in a run of the command.
    pub(super) fn counted(counted: &BoardStatistics) -> CommandWork {
        let ctus = counted.blocks.iter().filter(|b| kind(&b.block) == "ctu");
        CommandWork {
            rays: counted.canonical.rays,
            cells: counted.canonical.cells,
            tests: counted.canonical.tests,
            // A CTU works in exactly the cycles in which a step goes in.
            steps: ctus.map(|b| b.of(Cause::Work)).sum(),
            low: counted.canonical.low_resolution,
            down_bytes: counted.bus_down_bytes,
            up_bytes: counted.bus_up_bytes,
        }
    }

    fn fewest_cycles(&self, spec: &BoardSpec) -> u64 {
        let clusters = u64::from(spec.clusters.count);
        let icus = clusters * u64::from(spec.clusters.modules);
        let ctus = icus * u64::from(spec.clusters.ctus_per_icu);
        let (test, step) =
            (u64::from(spec.icu_timing().initiation_interval), u64::from(spec.ctu.initiation_interval));
        let part = |rays, cells, tests| {
            units(tests, icus, test).max(units(cells, ctus, step)).max(units(rays, clusters, 1))
        };
        let low = part(self.low.rays, self.low.cells, self.low.tests);
        let board = low + part(self.rays, self.cells, self.tests);
        let (word, burst) = (u64::from(spec.bus.width_bits / 8), u64::from(spec.bus.burst_bytes));
        let arbitration = u64::from(spec.bus.arbitration_cycles);
        let transfer = |bytes: u64| bytes.div_ceil(word) + bytes.div_ceil(burst) * arbitration;
        let host = bus(spec, transfer(self.down_bytes) + transfer(self.up_bytes));
        let after = spec.bus.interrupt_cycles + spec.dispatch.host_cycles_per_command;
        spec.bus.dma_setup_cycles + after + board.max(host).max(units(self.steps, ctus, step))
    }
}

/// Fewest cycles in which a board can do `work`.
pub fn fewest_cycles(spec: &BoardSpec, work: &[CommandWork]) -> u64 {
    work.iter().map(|command| command.fewest_cycles(spec)).sum()
}
