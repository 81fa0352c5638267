//! What was seen inside a run: lives of rays by phase, roots of stalls, utilisation over time, chosen rays cycle by cycle.
//!
//! ```text
//! trace::Observed --> ObservedReport (JSON, in `simulate` and `trace`) --observed_text.rs--> lines for the terminal
//! ```
//! All cycles are those in which the board is clocked: a report's account also counts the host's side of interrupts.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rtl_model::observe::{Intervals, Kind, LifeSums, Lives, Places, Roots};
use rtl_model::sim::{Cause, Phase};
use serde::Serialize;

use super::Timings;
use super::si::share;
use crate::trace::{Chosen, Observed};

/// Cycles by phase, the names as keys.
pub(super) type Phases = BTreeMap<&'static str, u64>;

/// What was seen inside a run.
#[derive(Clone, Debug, Serialize)]
pub struct ObservedReport {
    /// Events told.
    pub events: u64,
    /// Cycles in which the board was clocked.
    pub clocked_cycles: u64,
    /// Commands.
    pub commands: usize,
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Lives of all rays.
    pub lives: Option<LivesReport>,
    /// Where stalls for want of room come from.
    pub stall_roots: Option<Vec<StallReport>>,
    /// Utilisation over time.
    pub intervals: Option<IntervalsReport>,
    /// The rays that were asked for.
    pub rays: Vec<RayReport>,
}

/// Lives of rays.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LivesReport {
    /// Of all rays but the next.
    #[serde(flatten)]
    pub rays: LifeReport,
    /// Of the rays of low-resolution casts, where there were any.
    pub low_resolution: Option<LifeReport>,
}

/// Lives, summed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LifeReport {
    /// Rays.
    pub rays: u64,
    /// Cycles of all lives by phase.
    pub cycles_by_phase: Phases,
    /// Their sum.
    pub ray_cycles: u64,
    /// Cycles of the shortest life.
    pub shortest: Option<u64>,
    /// Cycles of the median life.
    pub median: Option<u64>,
    /// Cycles of the longest life.
    pub longest: Option<u64>,
}

/// Where one block's stalls for want of room come from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StallReport {
    /// The block.
    pub block: String,
    /// What it is.
    pub kind: Kind,
    /// Cycles in which its output was full.
    pub output_full: u64,
    /// Whose they are; they sum to `output_full`.
    pub roots: Vec<RootReport>,
}

/// A root of stalls.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RootReport {
    /// The block that is waited for.
    pub block: String,
    /// What it is.
    pub kind: Kind,
    /// What it does or waits for itself.
    pub cause: Cause,
    /// Cycles.
    pub cycles: u64,
}

/// Utilisation over time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntervalsReport {
    /// Cycles of an interval.
    pub cycles: u64,
    /// The intervals in order.
    pub intervals: Vec<IntervalReport>,
}

/// An interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntervalReport {
    /// Its first cycle.
    pub from: u64,
    /// By kind of block.
    pub kinds: BTreeMap<Kind, KindReport>,
}

/// What the blocks of a kind did in an interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KindReport {
    /// Share of their cycles with work.
    pub work: f64,
    /// The cause of most of their cycles.
    pub leads: Option<Cause>,
    /// Block-cycles by cause, those without any left out; fill and drain are among starved and idle.
    pub cycles: BTreeMap<Cause, u64>,
}

/// The life of one ray.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RayReport {
    /// Its pixel, where that was asked for.
    pub pixel: Option<[u32; 2]>,
    /// Which of the pixel's rays it is.
    pub sample: Option<u32>,
    /// Its command, from 0.
    pub command: u32,
    /// Its number in the command.
    pub ray: u32,
    /// Its bundle in the command.
    pub bundle: u32,
    /// Its place in the bundle.
    pub index: u8,
    /// Its cluster.
    pub cluster: u8,
    /// Its bundle's slot there.
    pub slot: u8,
    /// The cycle of its birth.
    pub born: u64,
    /// The cycle in which its bundle's last entry left the cluster.
    pub died: Option<u64>,
    /// Cycles by phase.
    pub cycles_by_phase: Phases,
    /// Phases in turn, each with its first cycle.
    pub spans: Vec<(u64, &'static str)>,
}

/// `trace --report`.
#[derive(Clone, Debug, Serialize)]
pub struct TraceReport {
    /// [`TraceReport::SCHEMA`].
    pub schema: &'static str,
    /// The event log.
    pub log: PathBuf,
    /// Name of the board's specification.
    pub board: String,
    /// Its clock (MHz).
    pub clock_mhz: f64,
    /// What was traced.
    pub workload: String,
    /// The scene file.
    pub scene: Option<PathBuf>,
    /// What was seen.
    pub observed: ObservedReport,
    /// Wall times.
    pub timings: Timings,
}

impl TraceReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/trace/1";
}

pub(super) fn phases(cycles: &[u64; 7]) -> Phases {
    Phase::LIFE.iter().map(|phase| phase.name()).zip(cycles.iter().copied()).collect()
}

impl LifeReport {
    fn new(sums: &LifeSums) -> LifeReport {
        LifeReport {
            rays: sums.rays,
            cycles_by_phase: phases(&sums.cycles),
            ray_cycles: sums.total(),
            shortest: sums.shortest(),
            median: sums.median(),
            longest: sums.longest(),
        }
    }
}

impl RayReport {
    fn new(chosen: &Chosen) -> Option<RayReport> {
        let life = chosen.life.as_ref()?;
        Some(RayReport {
            pixel: chosen.pixel.map(|(pixel, _)| pixel),
            sample: chosen.pixel.map(|(_, sample)| sample),
            command: life.command,
            ray: life.ray,
            bundle: life.bundle,
            index: life.index,
            cluster: life.cluster,
            slot: life.slot,
            born: life.born,
            died: life.died,
            cycles_by_phase: phases(&life.cycles),
            spans: life.spans.iter().map(|(cycle, phase)| (*cycle, phase.name())).collect(),
        })
    }
}

fn stall_reports(roots: &Roots, places: &Places) -> Vec<StallReport> {
    let mut stalls: Vec<StallReport> = Vec::new();
    // Roots come block by block.
    for (block, root, cycles) in roots.cycles() {
        let place = &places.blocks[usize::from(block)];
        if stalls.last().is_none_or(|stall| stall.block != place.name) {
            let (block, kind) = (place.name.clone(), place.kind);
            stalls.push(StallReport { block, kind, output_full: 0, roots: Vec::new() });
        }
        if let Some(stall) = stalls.last_mut() {
            let place = &places.blocks[usize::from(root.block)];
            let (block, kind) = (place.name.clone(), place.kind);
            stall.output_full += cycles;
            stall.roots.push(RootReport { block, kind, cause: root.cause, cycles });
        }
    }
    stalls.iter_mut().for_each(|stall| stall.roots.sort_by_key(|root| std::cmp::Reverse(root.cycles)));
    stalls
}

fn intervals_report(intervals: &Intervals) -> IntervalsReport {
    let length = intervals.length();
    let of_kind = |interval: &rtl_model::observe::Interval, kind: Kind| {
        let cycles = Cause::ALL.into_iter().map(|cause| (cause, interval.of(kind, cause)));
        KindReport {
            work: share(interval.of(kind, Cause::Work), interval.total(kind)),
            leads: interval.leading(kind),
            cycles: cycles.filter(|(_, n)| *n > 0).collect(),
        }
    };
    let report = (0..).zip(intervals.intervals()).map(|(i, interval)| {
        let present = Kind::ALL.into_iter().filter(|kind| interval.total(*kind) > 0);
        let kinds = present.map(|kind| (kind, of_kind(interval, kind))).collect();
        IntervalReport { from: i * length, kinds }
    });
    IntervalsReport { cycles: length, intervals: report.collect() }
}

impl ObservedReport {
    /// The report of what was seen.
    pub fn new(seen: &Observed) -> ObservedReport {
        let lives = |lives: &Lives| LivesReport {
            rays: LifeReport::new(lives.rays()),
            low_resolution: Some(LifeReport::new(lives.low_resolution())).filter(|life| life.rays > 0),
        };
        ObservedReport {
            events: seen.n_events,
            clocked_cycles: seen.n_cycles,
            commands: seen.commands.len(),
            files: seen.files.clone(),
            lives: seen.lives.as_ref().filter(|_| seen.account).map(lives),
            stall_roots: seen.roots.as_ref().map(|roots| stall_reports(roots, &seen.places)),
            intervals: seen.intervals.as_ref().map(intervals_report),
            rays: seen.chosen.iter().filter_map(RayReport::new).collect(),
        }
    }
}
