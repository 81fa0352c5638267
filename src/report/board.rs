//! What the emulated board did: totals, throughput, memory levels, the closed stall table, the same by purpose.
//!
//! ```text
//! BoardSpec, [(Purpose, BoardStatistics)] --> BoardReport        total = sum over the purposes
//! seconds_at_clock = cycles / clock        icu_utilisation = work cycles of all ICUs / (cycles * ICUs)
//! ```

use rtl_model::sim::{BlockAccount, Cause};
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::{BoardStatistics, LevelStatistics};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::si;
use crate::raycast::Purpose;

/// The board's part of a report.
#[derive(Clone, Debug, Serialize)]
pub struct BoardReport {
    /// The specification, resolved: what it takes to make the result again.
    pub spec: BoardSpec,
    /// Everything the board did.
    #[serde(flatten)]
    pub total: Counts,
    /// Bytes delivered and fetches missed, level by level from the ICU outward.
    pub levels: Vec<LevelStatistics>,
    /// The stall table of every block.
    pub blocks: Vec<BlockReport>,
    /// The same counts for each purpose that rays were cast for.
    pub by_purpose: Vec<PurposeReport>,
}

/// Counts and what follows from them at the board's clock.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Counts {
    /// Board clock cycles.
    pub cycles: u64,
    /// Cycles over the clock frequency (s).
    pub seconds_at_clock: f64,
    /// Bundles traced.
    pub bundles: u64,
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
    /// Bytes from host to board.
    pub bus_down_bytes: u64,
    /// Bytes from board to host.
    pub bus_up_bytes: u64,
    /// Rays per second of board time.
    pub rays_per_second_at_clock: f64,
    /// Tests per cycle of the whole board.
    pub tests_per_cycle: f64,
    /// Share of cycles in which an ICU worked, mean over the ICUs.
    pub icu_utilisation: f64,
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

/// The causes that keep a block from work that it holds. `starved`, `idle`, `fill`, `drain` are no stalls: there
/// the block holds nothing.
const STALLS: [Cause; 5] = [Cause::OutputFull, Cause::Resource, Cause::CacheMiss, Cause::Memory, Cause::Bus];

impl CauseTable {
    /// Cycles of one cause.
    pub fn of(&self, cause: Cause) -> u64 {
        Cause::ALL.iter().zip(&self.0).filter(|(c, _)| **c == cause).map(|(_, n)| n).sum()
    }

    /// Cycles of all causes.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Cycles in which the block held work and could not go on.
    pub fn stalled(&self) -> u64 {
        STALLS.iter().map(|c| self.of(*c)).sum()
    }

    /// The stall with most cycles; `None` when there was none.
    pub fn leading_stall(&self) -> Option<(Cause, u64)> {
        // The first of equals: causes stand in order of precedence.
        let all = STALLS.iter().map(|c| (*c, self.of(*c)));
        all.reduce(|best, next| if next.1 > best.1 { next } else { best }).filter(|(_, n)| *n > 0)
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
        let icus = || s.blocks.iter().filter(|b| is_icu(b));
        let icu_work: u64 = icus().map(|b| CauseTable(b.cycles).of(Cause::Work)).sum();
        Counts {
            cycles: s.cycles,
            seconds_at_clock: seconds,
            bundles: s.canonical.bundles,
            rays: s.canonical.rays,
            cells: s.canonical.cells,
            list_entries: s.canonical.list_entries,
            tests: s.canonical.tests,
            hits: s.canonical.hits,
            bus_down_bytes: s.bus_down_bytes,
            bus_up_bytes: s.bus_up_bytes,
            rays_per_second_at_clock: if seconds > 0.0 { s.canonical.rays as f64 / seconds } else { 0.0 },
            tests_per_cycle: si::share(s.canonical.tests, s.cycles),
            icu_utilisation: si::share(icu_work, s.cycles * icus().count() as u64),
        }
    }
}

fn is_icu(block: &BlockAccount) -> bool {
    block
        .block
        .rsplit('.')
        .next()
        .is_some_and(|name| name.trim_end_matches(|c: char| c.is_ascii_digit()) == "icu")
}

impl BoardReport {
    /// The report of a board of `spec` that counted `by_purpose`.
    pub fn new(spec: &BoardSpec, by_purpose: &[(Purpose, BoardStatistics)]) -> BoardReport {
        let sum = total(by_purpose);
        BoardReport {
            spec: spec.clone(),
            total: Counts::new(spec, &sum),
            blocks: sum
                .blocks
                .iter()
                .map(|b| BlockReport { block: b.block.clone(), cycles: CauseTable(b.cycles) })
                .collect(),
            levels: sum.memory,
            by_purpose: by_purpose
                .iter()
                .map(|(purpose, s)| PurposeReport { purpose: *purpose, counts: Counts::new(spec, s) })
                .collect(),
        }
    }

    /// The report of a board that counted `statistics` for no purpose of a renderer.
    pub fn of_total(spec: &BoardSpec, statistics: &BoardStatistics) -> BoardReport {
        let mut report = BoardReport::new(spec, &[(Purpose::Primary, statistics.clone())]);
        report.by_purpose.clear();
        report
    }

    /// The block with the largest share of work.
    pub fn busiest(&self) -> Option<&BlockReport> {
        first_max(&self.blocks, |b| b.cycles.of(Cause::Work))
    }

    /// The block that most often held work and could not go on.
    pub fn most_stalled(&self) -> Option<&BlockReport> {
        first_max(&self.blocks, |b| b.cycles.stalled()).filter(|b| b.cycles.stalled() > 0)
    }
}

/// The first of the items with the largest key.
fn first_max<T>(items: &[T], key: impl Fn(&T) -> u64) -> Option<&T> {
    items.iter().reduce(|best, next| if key(next) > key(best) { next } else { best })
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
        BoardReport::new(&spec, &[(Purpose::Primary, statistics)])
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
    fn busiest_works_most_and_most_stalled_holds_work_longest() {
        let r = report();
        assert_eq!(r.busiest().unwrap().block, "cluster0.module0.icu");
        // 950 starved cycles of the bus are no stall.
        let stalled = r.most_stalled().unwrap();
        assert_eq!(stalled.block, "cluster0.module0.ctu0");
        assert_eq!(stalled.cycles.leading_stall(), Some((Cause::OutputFull, 350)));
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
    }

    #[test]
    fn board_report_without_work_has_no_rates_and_no_stalled_block() {
        let r = BoardReport::new(&BoardSpec::default(), &[]);
        assert_eq!((r.total.cycles, r.total.rays_per_second_at_clock), (0, 0.0));
        assert!(r.busiest().is_none() && r.most_stalled().is_none());
    }
}
