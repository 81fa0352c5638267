//! What the emulated board did: totals, throughput, limits, energy, memory levels, queues, the closed stall table, the
//! same by purpose.
//!
//! ```text
//! BoardSpec, [(Purpose, BoardStatistics)], [FifoStatistics] --> BoardReport        total = sum over the purposes
//! seconds_at_clock = cycles / clock        icu_utilisation = work cycles of all ICUs / (cycles * ICUs)
//! ```

use rtl_model::functional::LowResolutionWork;
use rtl_model::occupancy::UnitOccupancy;
use rtl_model::sim::{BlockAccount, Cause, FifoStatistics};
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::{BoardStatistics, LevelStatistics};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::bounds::Bounds;
use super::energy::Energy;
use super::groups::kind;
use super::si;
use crate::raycast::{MAX_BUNDLE_RAYS, Purpose};

/// The board's part of a report.
#[derive(Clone, Debug, Serialize)]
pub struct BoardReport {
    /// The specification, resolved: what it takes to make the result again.
    pub spec: BoardSpec,
    /// Everything the board did.
    #[serde(flatten)]
    pub total: Counts,
    /// How few cycles each resource could have done with, and what kept the board from the tightest.
    pub bounds: Bounds,
    /// Energy by ASSUMED costs.
    pub energy: Energy,
    /// Bytes delivered and fetches missed, level by level from the ICU outward.
    pub levels: Vec<LevelStatistics>,
    /// The stall table of every block.
    pub blocks: Vec<BlockReport>,
    /// What every queue counted; cycles on the host's side of interrupts are none of theirs.
    pub links: Vec<LinkReport>,
    /// The same counts for each purpose that rays were cast for.
    pub by_purpose: Vec<PurposeReport>,
}

/// Counts and what follows from them at the board's clock.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Counts {
    /// Board clock cycles.
    pub cycles: u64,
    /// Commands that the host gave.
    pub commands: u64,
    /// Cycles over the clock frequency (s).
    pub seconds_at_clock: f64,
    /// Bundles traced.
    pub bundles: u64,
    /// How full they were.
    pub bundle_occupancy: OccupancyReport,
    /// How full the units were that rays without a bundle were cut into.
    pub explicit_occupancy: OccupancyReport,
    /// Rays traced.
    pub rays: u64,
    /// Grid cells entered.
    pub cells: u64,
    /// Cell-list entries read.
    pub list_entries: u64,
    /// Ray x patch tests.
    pub tests: u64,
    /// Rays that hit.
    pub hits: u64,
    /// The low-resolution cast that finds the static partition; none of it is in the counts above.
    pub low_resolution: LowResolutionWork,
    /// Times that the partition was cut anew.
    pub rebalances: u64,
    /// Bytes from host to board.
    pub bus_down_bytes: u64,
    /// Bytes from board to host.
    pub bus_up_bytes: u64,
    /// Bus cycles of transfers from host to board, their arbitration included.
    pub bus_down_cycles: u64,
    /// Bus cycles of transfers from board to host, their arbitration included.
    pub bus_up_cycles: u64,
    /// Cycles in which the DRAM was occupied.
    pub dram_busy_cycles: u64,
    /// Rays per second of board time.
    pub rays_per_second_at_clock: f64,
    /// Tests per cycle of the whole board.
    pub tests_per_cycle: f64,
    /// Share of cycles in which an ICU worked, mean over the ICUs.
    pub icu_utilisation: f64,
}

/// How full units of up to 64 rays were.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OccupancyReport {
    /// Units, their rays, full ones, and units by eighths of 64 rays.
    #[serde(flatten)]
    pub counted: UnitOccupancy,
    /// Rays a unit.
    pub mean_rays: f64,
    /// The same as a share of 64.
    pub mean_share: f64,
    /// Share of units with 64 rays.
    pub full_share: f64,
}

impl OccupancyReport {
    fn new(counted: &UnitOccupancy) -> OccupancyReport {
        let mean_rays = counted.mean_rays();
        OccupancyReport {
            counted: *counted,
            mean_rays,
            mean_share: mean_rays / MAX_BUNDLE_RAYS as f64,
            full_share: si::share(counted.full, counted.units),
        }
    }
}

/// One purpose's share of the work.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PurposeReport {
    /// What the rays were cast for.
    pub purpose: Purpose,
    /// What it took.
    #[serde(flatten)]
    pub counts: Counts,
}

/// What one queue counted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LinkReport {
    /// Counts.
    #[serde(flatten)]
    pub counted: FifoStatistics,
    /// Mean number of tokens inside.
    pub mean_occupancy: f64,
    /// Share of the cycles at whose end it was full (of a deep one: in its last bin).
    pub full_share: f64,
}

impl LinkReport {
    fn new(counted: &FifoStatistics) -> LinkReport {
        LinkReport {
            counted: counted.clone(),
            mean_occupancy: counted.mean_occupancy(),
            full_share: counted.full_share(),
        }
    }
}

/// The closed account of one block, by name of the cause.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlockReport {
    /// Hierarchical name.
    pub block: String,
    /// Cycles by cause; they sum to the cycles of the run.
    pub cycles: CauseTable,
}

/// Cycles by cause; a JSON object `{"work": n, "output_full": n, ...}`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CauseTable(pub [u64; 10]);

impl Serialize for CauseTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (cause, cycles) in Cause::ALL.iter().zip(&self.0) {
            map.serialize_entry(cause, cycles)?;
        }
        map.end()
    }
}

impl CauseTable {
    /// Cycles of one cause.
    pub fn of(&self, cause: Cause) -> u64 {
        Cause::ALL.iter().zip(&self.0).filter(|(c, _)| **c == cause).map(|(_, n)| n).sum()
    }

    /// Cycles of all causes.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }
}

/// Sums the statistics of the same board over the purposes.
pub fn total(by_purpose: &[(Purpose, BoardStatistics)]) -> BoardStatistics {
    by_purpose.iter().map(|(_, s)| s.clone()).reduce(|sum, s| sum.plus(&s)).unwrap_or_default()
}

impl Counts {
    /// The counts of `statistics` at the clock of `spec`.
    pub fn new(spec: &BoardSpec, statistics: &BoardStatistics) -> Counts {
        let s = statistics;
        let seconds = if spec.clock_mhz > 0.0 { s.cycles as f64 / (spec.clock_mhz * 1e6) } else { 0.0 };
        let icus = || s.blocks.iter().filter(|b: &&BlockAccount| kind(&b.block) == "icu");
        let icu_work: u64 = icus().map(|b| CauseTable(b.cycles).of(Cause::Work)).sum();
        Counts {
            cycles: s.cycles,
            commands: s.commands,
            seconds_at_clock: seconds,
            bundles: s.canonical.bundles,
            bundle_occupancy: OccupancyReport::new(&s.bundles),
            explicit_occupancy: OccupancyReport::new(&s.explicit),
            rays: s.canonical.rays,
            cells: s.canonical.cells,
            list_entries: s.canonical.list_entries,
            tests: s.canonical.tests,
            hits: s.canonical.hits,
            low_resolution: s.canonical.low_resolution,
            rebalances: s.rebalances,
            bus_down_bytes: s.bus_down_bytes,
            bus_up_bytes: s.bus_up_bytes,
            bus_down_cycles: s.bus_down_cycles,
            bus_up_cycles: s.bus_up_cycles,
            dram_busy_cycles: s.dram_busy_cycles,
            rays_per_second_at_clock: if seconds > 0.0 { s.canonical.rays as f64 / seconds } else { 0.0 },
            tests_per_cycle: si::share(s.canonical.tests, s.cycles),
            icu_utilisation: si::share(icu_work, s.cycles * icus().count() as u64),
        }
    }
}

impl BoardReport {
    /// The report of a board of `spec` that counted `by_purpose`, in its queues `links`.
    pub fn new(
        spec: &BoardSpec,
        by_purpose: &[(Purpose, BoardStatistics)],
        links: &[FifoStatistics],
    ) -> BoardReport {
        let sum = total(by_purpose);
        BoardReport {
            spec: spec.clone(),
            total: Counts::new(spec, &sum),
            bounds: Bounds::new(spec, &sum),
            energy: Energy::new(spec, &sum),
            blocks: sum
                .blocks
                .iter()
                .map(|b| BlockReport { block: b.block.clone(), cycles: CauseTable(b.cycles) })
                .collect(),
            links: links.iter().map(LinkReport::new).collect(),
            levels: sum.memory,
            by_purpose: by_purpose
                .iter()
                .map(|(purpose, s)| PurposeReport { purpose: *purpose, counts: Counts::new(spec, s) })
                .collect(),
        }
    }

    /// The report of a board that counted `statistics` for no purpose of a renderer.
    pub fn of_total(spec: &BoardSpec, statistics: &BoardStatistics, links: &[FifoStatistics]) -> BoardReport {
        let mut report = BoardReport::new(spec, &[(Purpose::Primary, statistics.clone())], links);
        report.by_purpose.clear();
        report
    }

    /// The queues that are full most often, one of each kind, at most `n`; none that never was.
    pub fn fullest_links(&self, n: usize) -> Vec<&LinkReport> {
        let mut links: Vec<&LinkReport> = self.links.iter().filter(|l| l.full_share > 0.0).collect();
        links.sort_by(|a, b| b.full_share.total_cmp(&a.full_share));
        let mut seen = std::collections::BTreeSet::new();
        links.retain(|l| seen.insert(kind(&l.counted.link)));
        links.truncate(n);
        links
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtl_model::functional::CanonicalCounters;

    fn block(name: &str, work: u64, full: u64, miss: u64, starved: u64) -> BlockAccount {
        BlockAccount { block: name.to_owned(), cycles: [work, full, 0, miss, 0, 0, starved, 0, 0, 0] }
    }

    fn report() -> BoardReport {
        let spec = BoardSpec { name: "test".to_owned(), clock_mhz: 25.0, ..BoardSpec::default() };
        let statistics = BoardStatistics {
            cycles: 1000,
            canonical: CanonicalCounters { rays: 100, tests: 900, ..CanonicalCounters::default() },
            blocks: vec![
                block("bus", 50, 0, 0, 950),
                block("cluster0.module0.ctu0", 400, 350, 50, 200),
                block("cluster0.module0.icu", 600, 0, 400, 0),
                block("cluster1.module0.icu", 300, 10, 0, 690),
            ],
            ..BoardStatistics::default()
        };
        let link = |name: &str, cycles_by_occupancy: [u64; 3]| FifoStatistics {
            link: name.to_owned(),
            depth: 2,
            tokens: 5,
            sojourn_cycles: cycles_by_occupancy[1] + 2 * cycles_by_occupancy[2],
            cycles_by_occupancy: cycles_by_occupancy.to_vec(),
            bin_tokens: 1,
        };
        let links = [
            link("fetches", [500, 500, 0]),
            link("cluster0.module0.jobs", [500, 400, 100]),
            link("cluster1.module0.jobs", [500, 200, 300]),
            link("cluster1.results", [700, 100, 200]),
        ];
        BoardReport::new(&spec, &[(Purpose::Primary, statistics)], &links)
    }

    #[test]
    fn board_report_of_known_counts_derives_rates_from_the_clock() {
        let total = report().total;
        assert!((total.seconds_at_clock - 40e-6).abs() < 1e-18);
        assert!((total.rays_per_second_at_clock - 2.5e6).abs() < 1e-3);
        assert!((total.tests_per_cycle - 0.9).abs() < 1e-12);
        assert!((total.icu_utilisation - 0.45).abs() < 1e-12);
    }

    #[test]
    fn fullest_links_are_one_of_each_kind_and_never_one_that_was_not_full() {
        let r = report();
        let fullest = |n| -> Vec<(String, f64)> {
            r.fullest_links(n).iter().map(|l| (l.counted.link.clone(), l.full_share)).collect()
        };
        let both = [("cluster1.module0.jobs".to_owned(), 0.3), ("cluster1.results".to_owned(), 0.2)];
        assert_eq!(fullest(9), both);
        assert_eq!(fullest(1), both[..1]);
        assert!((r.links[1].mean_occupancy - 0.6).abs() < 1e-12);
    }

    #[test]
    fn stall_table_in_json_names_every_cause_and_sums_to_the_cycles() {
        let json = serde_json::to_value(report()).unwrap();
        assert_eq!(json["cycles"], 1000);
        let blocks = json["blocks"].as_array().unwrap();
        assert_eq!(blocks.len(), 4);
        for block in blocks {
            let causes = block["cycles"].as_object().unwrap();
            assert_eq!(causes.len(), Cause::ALL.len());
            assert_eq!(causes.values().map(|v| v.as_u64().unwrap()).sum::<u64>(), 1000);
        }
        assert_eq!(blocks[1]["cycles"]["output_full"], 350);
        assert_eq!(json["by_purpose"][0]["purpose"], "primary");
        assert_eq!(json["links"][2]["cycles_by_occupancy"], serde_json::json!([500, 200, 300]));
        assert_eq!(json["links"][2]["link"], "cluster1.module0.jobs");
        assert_eq!(json["bounds"]["limits"][0]["resource"], "icus_as_dealt");
        assert!(json["energy"]["nj_per_ray"].as_f64().unwrap() > 0.0);
    }

    #[test]
    fn board_report_without_work_has_no_rates_and_no_limit() {
        let r = BoardReport::new(&BoardSpec::default(), &[], &[]);
        assert_eq!((r.total.cycles, r.total.rays_per_second_at_clock), (0, 0.0));
        assert!(r.bounds.tightest().is_none() && r.fullest_links(3).is_empty());
    }
}
