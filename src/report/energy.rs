//! Energy of a run: what was counted, times what each event costs.
//!
//! ```text
//! BoardSpec (`energy`), BoardStatistics --> Energy: events x pJ by kind, total, a ray, mean power = total / seconds at the clock
//! ```
//! The costs are parameters and ASSUMED: an order of magnitude for CMOS of the time. They compare boards with each other;
//! they are no statement about a historical chip. Not modelled: the host, the bus's own drivers beyond a cost a byte,
//! supply and refresh.

use rtl_model::sim::Cause;
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;
use serde::Serialize;

use super::groups::kind;

/// Energy of one kind of event.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnergyItem {
    /// Which: `tests`, `steps`, `caches`, `buffer`, `dram_lines`, `dram_rows`, `bus`, `block_cycles`.
    pub kind: &'static str,
    /// How many.
    pub events: u64,
    /// What each costs (pJ), as the board's `energy` says.
    pub pj_each: f64,
    /// Together (J).
    pub joules: f64,
}

/// The energy of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Energy {
    /// What the figures rest on.
    pub basis: &'static str,
    /// By kind of event.
    pub by_kind: Vec<EnergyItem>,
    /// Sum (J).
    pub total_joules: f64,
    /// Sum over the rays asked for (nJ); 0 without rays.
    pub nj_per_ray: f64,
    /// Sum over the time at the board's clock (W); 0 without cycles.
    pub mean_watts: f64,
}

/// Of every report with figures from [`Energy`].
pub const BASIS: &str = "ASSUMED costs an event ([energy] of the board), an order of magnitude";

impl Energy {
    /// The energy of a board of `spec` that counted `s`.
    pub fn new(spec: &BoardSpec, s: &BoardStatistics) -> Energy {
        let cost = &spec.energy;
        let canonical = &s.canonical;
        let level = |name: &str| s.memory.iter().find(move |l| l.level == name);
        let accesses = |name: &str| level(name).map_or(0, |l| l.accesses);
        let caches = ["patch_cache", "list_cache", "mask_cache"].map(accesses).iter().sum();
        let steps = s.blocks.iter().filter(|b| kind(&b.block) == "ctu").map(|b| b.of(Cause::Work)).sum();
        let by_kind: Vec<EnergyItem> = [
            ("tests", canonical.tests + canonical.low_resolution.tests, cost.test_pj),
            ("steps", steps, cost.step_pj),
            ("caches", caches, cost.cache_pj),
            ("buffer", accesses("cluster_buffer"), cost.buffer_pj),
            ("dram_lines", accesses("dram"), cost.dram_line_pj),
            ("dram_rows", level("dram").map_or(0, |l| l.misses), cost.dram_row_pj),
            ("bus", s.bus_down_bytes + s.bus_up_bytes, cost.bus_byte_pj),
            ("block_cycles", s.cycles * s.blocks.len() as u64, cost.block_cycle_pj),
        ]
        .into_iter()
        .map(|(kind, events, pj_each)| {
            let joules = events as f64 * pj_each * 1e-12;
            EnergyItem { kind, events, pj_each, joules }
        })
        .collect();
        let total_joules: f64 = by_kind.iter().map(|item| item.joules).sum();
        let over = |joules: f64, n: f64| if n > 0.0 { joules / n } else { 0.0 };
        Energy {
            basis: BASIS,
            by_kind,
            total_joules,
            nj_per_ray: over(total_joules * 1e9, canonical.rays as f64),
            mean_watts: over(total_joules * spec.clock_mhz * 1e6, s.cycles as f64),
        }
    }

    /// The share of a kind in the total, in [0, 1].
    pub fn share(&self, item: &EnergyItem) -> f64 {
        if self.total_joules > 0.0 { item.joules / self.total_joules } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtl_model::functional::{CanonicalCounters, LowResolutionWork};
    use rtl_model::sim::BlockAccount;
    use rtl_model::spec::EnergySpec;
    use rtl_model::statistics::LevelStatistics;

    fn block(name: &str, work: u64, starved: u64) -> BlockAccount {
        BlockAccount { block: name.to_owned(), cycles: [work, 0, 0, 0, 0, 0, starved, 0, 0, 0] }
    }

    fn level(name: &str, accesses: u64, misses: u64) -> LevelStatistics {
        LevelStatistics { level: name.to_owned(), accesses, misses, bytes: 64 * misses, written_bytes: 0 }
    }

    /// Every kind has a count and a cost of its own, so that a mix-up shows.
    fn counted() -> (BoardSpec, BoardStatistics) {
        let mut spec = BoardSpec { clock_mhz: 10.0, ..BoardSpec::default() };
        spec.energy = EnergySpec {
            test_pj: 1.0,
            step_pj: 10.0,
            cache_pj: 100.0,
            buffer_pj: 1e3,
            dram_line_pj: 1e4,
            dram_row_pj: 1e5,
            bus_byte_pj: 1e6,
            block_cycle_pj: 1e7,
        };
        let statistics = BoardStatistics {
            cycles: 100,
            canonical: CanonicalCounters {
                rays: 4,
                tests: 5,
                low_resolution: LowResolutionWork { tests: 2, ..LowResolutionWork::default() },
                ..CanonicalCounters::default()
            },
            bus_down_bytes: 3,
            bus_up_bytes: 5,
            memory: vec![
                level("patch_cache", 1, 1),
                level("list_cache", 2, 1),
                level("mask_cache", 3, 1),
                level("cluster_buffer", 4, 2),
                level("dram", 3, 2),
            ],
            blocks: vec![
                block("dram", 50, 50),
                block("cluster0.module0.ctu0", 8, 92),
                block("cluster0.module0.ctu1", 1, 99),
                block("cluster0.module0.icu", 7, 93),
            ],
            ..BoardStatistics::default()
        };
        (spec, statistics)
    }

    #[test]
    fn energy_of_known_counts_is_that_of_the_count_by_hand() {
        let (spec, statistics) = counted();
        let energy = Energy::new(&spec, &statistics);
        let events: Vec<_> = energy.by_kind.iter().map(|item| (item.kind, item.events)).collect();
        let expected = [
            ("tests", 7),
            ("steps", 9),
            ("caches", 6),
            ("buffer", 4),
            ("dram_lines", 3),
            ("dram_rows", 2),
            ("bus", 8),
            ("block_cycles", 400),
        ];
        assert_eq!(events, expected);
        // 7 + 90 + 600 + 4e3 + 3e4 + 2e5 + 8e6 + 4e9 pJ.
        let joules = 4_008_234_697e-12;
        assert!((energy.total_joules - joules).abs() < 1e-15, "{energy:?}");
        assert!((energy.nj_per_ray - joules * 1e9 / 4.0).abs() < 1e-6);
        // 100 cycles at 10 MHz are 10 us.
        assert!((energy.mean_watts - joules / 10e-6).abs() < 1e-9);
        assert!((energy.share(&energy.by_kind[7]) - 4e9 / 4_008_234_697.0).abs() < 1e-12);
        assert!(energy.basis.contains("ASSUMED"));
    }

    #[test]
    fn energy_of_a_board_that_did_nothing_is_0() {
        let energy = Energy::new(&BoardSpec::default(), &BoardStatistics::default());
        assert_eq!((energy.total_joules, energy.nj_per_ray, energy.mean_watts), (0.0, 0.0, 0.0));
        assert_eq!(energy.share(&energy.by_kind[0]), 0.0);
    }
}
