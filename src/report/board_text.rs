//! The board's part of the summaries: its figures, its bounds, and where its blocks' cycles went.
//!
//! ```text
//! BoardReport --> board_lines: a line a subject    block_kinds_table: a row a kind of block    all_blocks_table: a row a block
//! ```
//! Everything fits a screen of 100 columns and 40 lines, but for the table of all blocks.

use std::fmt::Write as _;

use rtl_model::sim::Cause;
use rtl_model::statistics::LevelStatistics;

use super::BoardReport;
use super::bounds::Resource;
use super::groups::{Group, kind, short};
use super::si::{bytes, count, percent, share, si};
use super::terminal::{line, purpose_name, wrapped};

/// Queues that are named.
const LINKS: usize = 3;
/// Kinds of energy that are named.
const ENERGIES: usize = 4;

/// The figures of a run on the board.
pub(super) fn board_lines(out: &mut String, b: &BoardReport) {
    let t = &b.total;
    let clock = si(b.spec.clock_mhz * 1e6, "Hz");
    let plural = if t.commands == 1 { "command" } else { "commands" };
    line(
        out,
        "board",
        format_args!(
            "{}, emulated: {} = {} at {clock}, {}",
            b.spec.name,
            count(t.cycles, "cycles"),
            si(t.seconds_at_clock, "s"),
            count(t.commands, plural)
        ),
    );
    line(
        out,
        "  rays",
        format_args!(
            "{}, {} hit, {} at the board clock",
            count(t.rays, "rays"),
            percent(share(t.hits, t.rays)),
            si(t.rays_per_second_at_clock, "rays/s")
        ),
    );
    line(
        out,
        "  tests",
        format_args!(
            "{} in {}, {:.3} tests/cycle, ICU utilisation {}",
            count(t.tests, "tests"),
            count(t.cells, "cells"),
            t.tests_per_cycle,
            percent(t.icu_utilisation)
        ),
    );
    let low = &t.low_resolution;
    if low.rays + t.rebalances > 0 {
        let first = format!("{}, {} before", count(low.rays, "rays"), count(low.tests, "tests"));
        let times = if t.rebalances == 1 { "once" } else { &format!("{} times", t.rebalances) };
        let again = format!("the partition was cut anew {times}");
        let text = match (low.rays, t.rebalances) {
            (_, 0) => format!("{first} the bundles were dealt"),
            (0, _) => again,
            _ => format!("{first} the bundles were dealt; {again}"),
        };
        line(out, "  low res", text);
    }
    let bus = b.bounds.of(Resource::HostBus).map_or(0.0, |l| l.share);
    line(
        out,
        "  bus",
        format_args!(
            "{} down, {} up; busy in {} of the cycles",
            bytes(t.bus_down_bytes),
            bytes(t.bus_up_bytes),
            percent(bus)
        ),
    );
    memory_lines(out, b);
    bound_lines(out, b);
    energy_line(out, b);
    let links = b.fullest_links(LINKS);
    if !links.is_empty() {
        let mut each: Vec<String> =
            links.iter().map(|l| format!("{} {}", short(&l.counted.link), percent(l.full_share))).collect();
        each[0].push_str(" of the cycles");
        each[0].insert_str(0, "full: ");
        wrapped(out, "  queues", &each, ", ");
    }
    purpose_lines(out, b);
}

/// A row for each purpose that rays were cast for: what it asked for and took, its bytes on the bus (down, up), and how full
/// its bundles were; rays that came one by one make none.
fn purpose_lines(out: &mut String, b: &BoardReport) {
    if b.by_purpose.is_empty() {
        return;
    }
    let plain = |n: u64| count(n, "").trim_end().to_owned();
    let row = |cells: [&str; 10]| {
        let [name, bundles, rays, tests, cycles, time, down, up, mean, full] = cells;
        format!(
            "{name:<12} {bundles:>7} {rays:>7} {tests:>7} {cycles:>7} {time:>8} {down:>8} {up:>8} {mean:>8} {full:>6}"
        )
    };
    let head = ["", "bundles", "rays", "tests", "cycles", "at clock", "down", "up", "a bundle", "full"];
    line(out, "  purpose", row(head));
    for p in &b.by_purpose {
        let c = &p.counts;
        let occupancy = &c.bundle_occupancy;
        let (mean, full) = match occupancy.counted.units {
            0 => ("explicit".to_owned(), String::new()),
            _ => (format!("{:.1}", occupancy.mean_rays), percent(occupancy.full_share)),
        };
        let cells = [
            plain(c.bundles),
            plain(c.rays),
            plain(c.tests),
            plain(c.cycles),
            si(c.seconds_at_clock, "s"),
            bytes(c.bus_down_bytes),
            bytes(c.bus_up_bytes),
        ];
        let [bundles, rays, tests, cycles, time, down, up] = cells.each_ref().map(String::as_str);
        let name = purpose_name(p.purpose);
        line(out, "", row([name, bundles, rays, tests, cycles, time, down, up, &mean, &full]));
    }
}

/// Bytes brought into each level and the share of look-ups that hit; what masks write back shows at the DRAM.
fn memory_lines(out: &mut String, b: &BoardReport) {
    let hits = |l: &LevelStatistics| percent(1.0 - share(l.misses, l.accesses));
    let items: Vec<String> = b
        .levels
        .iter()
        .map(|l| match l.level.as_str() {
            "dram" => {
                let masks = if l.written_bytes > 0 { " masks" } else { "" };
                let (read, written) = (bytes(l.bytes), bytes(l.written_bytes));
                format!("DRAM {read} read, {written}{masks} written, {} in open rows", hits(l))
            }
            name => {
                let name = name.trim_end_matches("_cache").trim_start_matches("cluster_");
                format!("{name} {}, {} hit", bytes(l.bytes), hits(l))
            }
        })
        .collect();
    wrapped(out, "  memory", &items, "; ");
}

fn bound_lines(out: &mut String, b: &BoardReport) {
    if let Some(limit) = b.bounds.tightest() {
        let at = limit.busiest.as_ref().map(|name| format!(" ({})", place(name))).unwrap_or_default();
        line(
            out,
            "  bound",
            format_args!(
                "{} by the {}{at}: {} of those taken",
                count(limit.cycles, "cycles"),
                limit.resource.name(),
                percent(limit.share)
            ),
        );
    }
    let Some(icus) = b.bounds.of(Resource::Icus).filter(|l| l.cycles > 0) else { return };
    let dealt = b.bounds.of(Resource::IcusAsDealt).map_or(0.0, |l| l.share);
    line(
        out,
        "",
        format_args!(
            "{} by the ICUs: {} of what they allow is reached ({} as dealt)",
            count(icus.cycles, "cycles"),
            percent(icus.share),
            percent(dealt)
        ),
    );
    if !b.bounds.icus.reason.is_empty() {
        line(out, "", format_args!("the rest: {}", b.bounds.icus.reason));
    }
}

fn energy_line(out: &mut String, b: &BoardReport) {
    let e = &b.energy;
    if e.total_joules == 0.0 {
        return;
    }
    let mut kinds: Vec<_> = e.by_kind.iter().filter(|item| item.joules > 0.0).collect();
    kinds.sort_by(|x, y| y.joules.total_cmp(&x.joules));
    let kinds = kinds
        .iter()
        .take(ENERGIES)
        .map(|item| format!("{} {}", item.kind.replace('_', " "), percent(e.share(item))));
    let items = [
        format!(
            "{}, {} a ray, {} (ASSUMED costs)",
            si(e.total_joules, "J"),
            si(e.nj_per_ray * 1e-9, "J"),
            si(e.mean_watts, "W")
        ),
        kinds.collect::<Vec<_>>().join(", "),
    ];
    wrapped(out, "  energy", &items, ": ");
}

/// Where a block is: its name in short, without its kind where there is one of that kind in a place.
fn place(block: &str) -> String {
    let name = short(block);
    match name.rsplit_once('.') {
        Some((place, _)) if kind(block) != "ctu" => place.to_owned(),
        _ => name,
    }
}

/// Columns of the tables: what stands above, and the causes that it sums. What is no stall of a block's own comes last.
const KINDS_COLUMNS: [(&str, &[Cause]); 8] = [
    ("work", &[Cause::Work]),
    ("out full", &[Cause::OutputFull]),
    ("resource", &[Cause::Resource]),
    ("miss", &[Cause::CacheMiss]),
    ("memory", &[Cause::Memory]),
    ("bus", &[Cause::Bus]),
    ("starved", &[Cause::Starved]),
    ("idle", &[Cause::Idle, Cause::Fill, Cause::Drain]),
];

/// A row for each kind of block, causes that take a thousandth of any kind's cycles in columns.
pub(super) fn block_kinds_table(out: &mut String, b: &BoardReport) {
    let groups = Group::of(&b.blocks);
    if groups.is_empty() {
        return;
    }
    let of = |g: &Group, causes: &[Cause]| causes.iter().map(|c| g.share(*c)).sum::<f64>();
    let columns: Vec<_> = KINDS_COLUMNS
        .into_iter()
        .filter(|(_, causes)| groups.iter().any(|g| of(g, causes) >= 0.0005))
        .collect();
    let width = |name: &str| name.len().max(5);
    let _ = write!(out, "\n{:<16} {:>3}", "% of the cycles", "n");
    for (name, _) in &columns {
        let _ = write!(out, " {name:>w$}", w = width(name));
    }
    out.push_str("  least work\n");
    for g in &groups {
        let _ = write!(out, "{:<16} {:>3}", g.kind, g.n);
        for (name, causes) in &columns {
            let share = of(g, causes);
            // Nothing where there is nothing: the eye finds the rest.
            let cell = if share == 0.0 { String::new() } else { format!("{:.1}", 100.0 * share) };
            let _ = write!(out, " {cell:>w$}", w = width(name));
        }
        if let Some((block, work)) = &g.least_work {
            let _ = write!(out, " {:>6.1} {}", 100.0 * work, place(block));
        }
        out.push('\n');
    }
    out.push('\n');
}

/// A row for each block, a column for each cause that any block has.
pub(super) fn all_blocks_table(out: &mut String, b: &BoardReport) {
    let _ = writeln!(out, "\nshare of the cycles by cause, per block");
    let name_width = b.blocks.iter().map(|b| b.block.len()).max().unwrap_or(0).max(5);
    let causes: Vec<Cause> =
        Cause::ALL.into_iter().filter(|c| b.blocks.iter().any(|b| b.cycles.of(*c) > 0)).collect();
    let _ = write!(out, "{:<name_width$}", "block");
    for cause in &causes {
        let _ = write!(out, " {:>11}", cause.name());
    }
    out.push('\n');
    for block in &b.blocks {
        let _ = write!(out, "{:<name_width$}", block.block);
        for cause in &causes {
            let s = share(block.cycles.of(*cause), block.cycles.total());
            let _ = write!(out, " {:>9.1} %", 100.0 * s);
        }
        out.push('\n');
    }
    out.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raycast::Purpose;
    use crate::report::terminal::WIDTH;
    use rtl_model::functional::{CanonicalCounters, LowResolutionWork};
    use rtl_model::sim::BlockAccount;
    use rtl_model::spec::BoardSpec;
    use rtl_model::statistics::BoardStatistics;

    fn report(rebalances: u64, low_rays: u64) -> BoardReport {
        // Work, output full, resource, cache miss, memory, bus, starved, idle, fill, drain.
        let block = |name: &str, cycles| BlockAccount { block: name.to_owned(), cycles };
        let level = |level: &str, bytes, written_bytes| LevelStatistics {
            level: level.to_owned(),
            accesses: 10,
            misses: 4,
            bytes,
            written_bytes,
        };
        let low_resolution = LowResolutionWork { rays: low_rays, tests: 7, ..LowResolutionWork::default() };
        let statistics = BoardStatistics {
            cycles: 1000,
            commands: 1,
            canonical: CanonicalCounters {
                rays: 100,
                tests: 900,
                low_resolution,
                ..CanonicalCounters::default()
            },
            rebalances,
            bus_down_cycles: 10,
            memory: vec![level("mask_cache", 128, 64), level("dram", 2048, 64)],
            blocks: vec![
                block("dram", [250, 0, 0, 0, 50, 0, 600, 0, 40, 60]),
                block("cluster0.module0.ctu0", [500, 0, 100, 0, 0, 0, 300, 0, 50, 50]),
                block("cluster1.module0.ctu0", [400, 0, 300, 0, 0, 0, 200, 0, 50, 50]),
                block("cluster0.module0.icu", [500, 0, 0, 0, 0, 0, 400, 0, 50, 50]),
                block("cluster1.module0.icu", [400, 0, 0, 0, 0, 0, 500, 0, 50, 50]),
            ],
            ..BoardStatistics::default()
        };
        BoardReport::new(&BoardSpec::default(), &[(Purpose::Primary, statistics)], &[])
    }

    #[test]
    fn table_of_kinds_has_a_row_a_kind_and_no_column_without_cycles() {
        let mut table = String::new();
        block_kinds_table(&mut table, &report(0, 0));
        let expected = "
% of the cycles    n  work resource memory starved  idle  least work
dram               1  25.0             5.0    60.0  10.0
ctu                2  45.0     20.0           25.0  10.0   40.0 c1.m0.ctu0
icu                2  45.0                    45.0  10.0   40.0 c1.m0

";
        assert_eq!(table, expected);
    }

    #[test]
    fn table_of_all_blocks_has_a_row_a_block_and_no_column_without_cycles() {
        let mut table = String::new();
        all_blocks_table(&mut table, &report(0, 0));
        assert_eq!(table.trim_end().lines().count(), 1 + 1 + 1 + 5, "{table}");
        assert!(table.contains("resource") && !table.contains("bus") && !table.contains("output"), "{table}");
    }

    #[test]
    fn lines_of_the_board_tell_of_low_resolution_memory_and_bounds() {
        let text = |rebalances, rays| {
            let mut out = String::new();
            board_lines(&mut out, &report(rebalances, rays));
            assert!(out.lines().all(|l| l.len() <= WIDTH), "{out}");
            out
        };
        assert!(!text(0, 0).contains("low res"));
        assert!(text(0, 3).contains("3 rays, 7 tests before the bundles were dealt\n"));
        assert!(text(1, 0).contains("low res  the partition was cut anew once\n"));
        assert!(text(2, 3).contains("dealt; the partition was cut anew 2 times\n"));
        for part in [
            "mask 128 B, 60.0 % hit; DRAM 2.00 KiB read, 64 B masks written, 60.0 % in open rows",
            "bound    560 cycles by the host bus and commands: 56.0 % of those taken",
            "227 cycles by the ICUs: 22.7 % of what they allow is reached (50.0 % as dealt)",
            "the rest: starved; lists are short",
            "(ASSUMED costs)",
        ] {
            assert!(text(0, 0).contains(part), "'{part}' is missing in\n{}", text(0, 0));
        }
    }
}
