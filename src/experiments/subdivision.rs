//! A published chip as the ICU: Pulleyblank and Kapenga's subdivision of bicubic patches, and other units beside it.
//!
//! ```text
//! camera rays --> board of one cluster, one CTU with 1, 2, 4... contexts, ICU of each kind --> tests a second
//! ```
//! Expected at saturation: clock / interval, 25 MHz / 375 = 66.7 k/s (15 us a test) and 25 MHz / 3500 = 7.14 k/s (140 us).
//! Source: Pulleyblank, Kapenga 1987, "The feasibility of a VLSI chip for ray tracing bicubic patches".

use rayon::prelude::*;
use rtl_model::sim::Cause;
use rtl_model::spec::{BoardSpec, IcuUnit, Partition, Scheduling};

use super::load::{Load, Run, Stage};
use super::plot::{Mark, Panel, Scale, Series};
use super::table::{Table, digits, row};
use super::{Check, ExperimentError, Extent, Findings, board};

/// Units, their names, and the side of the picture (pixels) that keeps them busy for long enough.
const UNITS: [(IcuUnit, &str, u32); 5] = [
    (IcuUnit::FixedPipelined, "fixed-pipelined", 96),
    (IcuUnit::CordicUnfolded, "cordic-unfolded", 96),
    (IcuUnit::CordicSerial, "cordic-serial", 48),
    (IcuUnit::SubdivisionFast, "subdivision-fast", 24),
    (IcuUnit::SubdivisionSlow, "subdivision-slow", 16),
];

/// Published times of a test (us).
pub(super) const PUBLISHED_US: [(IcuUnit, f64); 2] =
    [(IcuUnit::SubdivisionFast, 15.0), (IcuUnit::SubdivisionSlow, 140.0)];

/// A unit on a board with so many ray contexts.
pub(super) struct Point {
    pub(super) unit: IcuUnit,
    name: &'static str,
    contexts: u32,
    spec: BoardSpec,
    run: Run,
}

impl Point {
    /// Tests a second over the whole run.
    pub(super) fn tests_per_second(&self) -> f64 {
        self.run.statistics.canonical.tests as f64 / self.run.seconds(&self.spec)
    }

    /// Tests a second of an ICU that never waits.
    fn peak(&self) -> f64 {
        1e6 * self.spec.clock_mhz / f64::from(self.spec.icu_timing().initiation_interval)
    }

    /// Cycles of ICU work a test.
    pub(super) fn cycles_per_test(&self) -> f64 {
        let icus = self.run.statistics.blocks.iter().filter(|b| b.block.ends_with(".icu"));
        let work: u64 = icus.map(|b| b.of(Cause::Work)).sum();
        work as f64 / self.run.statistics.canonical.tests as f64
    }

    /// The busiest block but the ICU, and its share of the cycles.
    fn busiest_other(&self) -> String {
        let others = self.run.statistics.blocks.iter().filter(|b| !b.block.ends_with(".icu"));
        others.max_by_key(|b| b.of(Cause::Work)).map_or(String::new(), |b| {
            let share = 100.0 * b.of(Cause::Work) as f64 / b.total() as f64;
            format!("{}, which works in {share:.0} % of the cycles", b.block)
        })
    }
}

/// Every unit with every number of contexts.
pub(super) fn points(extent: Extent) -> Result<Vec<Point>, ExperimentError> {
    let stage = Stage::cornell_box(600)?;
    let contexts: &[u32] = extent.pick(&[1, 2, 4, 8, 16, 32, 64], &[1, 4, 16]);
    let loads: Vec<Load> = UNITS
        .iter()
        .map(|(.., side)| stage.primary(*side, extent.pick(*side, side / 2)))
        .collect::<Result<_, _>>()?;
    let cases: Vec<(usize, u32)> =
        (0..UNITS.len()).flat_map(|u| contexts.iter().map(move |c| (u, *c))).collect();
    let run = |(u, contexts): (usize, u32)| {
        let (unit, name, _) = UNITS[u];
        let spec = board(|b| {
            b.partition = Partition::Grid;
            b.scheduling = Scheduling::Static;
            b.clusters.count = 1;
            b.clusters.ctus_per_icu = 1;
            b.ctu.contexts = contexts;
            b.icu.unit = unit;
        });
        Ok(Point { unit, name, contexts, run: loads[u].run(&spec)?, spec })
    };
    cases.into_par_iter().map(run).collect()
}

pub(super) fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let points = points(extent)?;
    let columns =
        ["unit", "contexts", "interval (cycles)", "tests/s", "of the unit's peak (%)", "tests", "cycles"];
    let mut table = Table::new("Tests a second of one ICU", &columns);
    let mut rates = Panel::new(
        "Tests a second of one ICU, one CTU",
        ("ray contexts", Scale::Log),
        ("ktests/s", Scale::Log),
    );
    let mut shares = Panel::new(
        "The same as a share of what the unit can do",
        ("ray contexts", Scale::Log),
        ("% of peak", Scale::Linear { from_zero: true }),
    );
    for (colour, (unit, name, _)) in UNITS.iter().enumerate() {
        let own = || points.iter().filter(|p| p.unit == *unit);
        let x = |p: &Point| f64::from(p.contexts);
        rates.series.push(Series::new(
            *name,
            Mark::Line,
            colour,
            own().map(|p| (x(p), 1e-3 * p.tests_per_second())),
        ));
        let share = |p: &Point| 100.0 * p.tests_per_second() / p.peak();
        shares.series.push(Series::new(*name, Mark::Line, colour, own().map(|p| (x(p), share(p)))));
        for p in own() {
            table.push(row![
                p.name,
                p.contexts,
                p.spec.icu_timing().initiation_interval,
                p.tests_per_second(),
                share(p),
                p.run.statistics.canonical.tests,
                p.run.statistics.cycles,
            ]);
        }
    }
    let (mut says, mut checks) = (Vec::new(), Vec::new());
    for (unit, us) in PUBLISHED_US {
        let expected = 1e6 / us;
        let Some(best) = best_of(&points, unit) else { continue };
        let rate = best.tests_per_second();
        let enough = points.iter().find(|p| p.unit == unit && p.tests_per_second() > 0.99 * expected);
        says.push(format!(
            "{}: {} tests/s at best, where {us} us a test make {}; {}.",
            best.name,
            digits(rate),
            digits(expected),
            match enough {
                Some(p) => format!("ray contexts that reach 99 % of it: {}", p.contexts),
                None => "no number of contexts reaches 99 % of it".to_owned(),
            },
        ));
        checks.push(Check::new(
            (rate / expected - 1.0).abs() < 0.01,
            format!("{} at its best is within 1 % of the published {} tests/s", best.name, digits(expected)),
        ));
    }
    for (unit, ..) in [UNITS[0], UNITS[1], UNITS[2]] {
        let Some(best) = best_of(&points, unit) else { continue };
        says.push(format!(
            "{}: {} tests/s with {} contexts, {} % of its peak; with one context {} %. At its best the busiest other block is {}.",
            best.name,
            digits(best.tests_per_second()),
            best.contexts,
            digits(100.0 * best.tests_per_second() / best.peak()),
            points
                .iter()
                .find(|p| p.unit == unit)
                .map_or(String::new(), |p| digits(100.0 * p.tests_per_second() / p.peak())),
            best.busiest_other(),
        ));
    }
    if let (Some(fixed), Some(fast)) =
        (best_of(&points, IcuUnit::FixedPipelined), best_of(&points, IcuUnit::SubdivisionFast))
    {
        says.push(format!(
            "One fixed-point pipeline tests as many rays as {:.0} chips of 1987 in their best case; the chip tests a \
             bicubic patch, the pipeline a flat one.",
            fixed.tests_per_second() / fast.tests_per_second(),
        ));
    }
    checks.push(Check::new(
        points.iter().all(|p| p.cycles_per_test() == f64::from(p.spec.icu_timing().initiation_interval)),
        "in every run the ICU works exactly its interval a test",
    ));
    Ok(Findings {
        question: "Pulleyblank and Kapenga's chip tests a ray against a bicubic patch in 15 us at best and 140 us at worst. \
                   Does the board with such an ICU come out at the same rate, and how many rays must wait for that?"
            .to_owned(),
        method: "Camera rays of the Cornell box (600 elements) on a board with one cluster, one module and one CTU, grid \
                 partition, 25 MHz; the ICU's unit and the CTU's ray contexts change. Tests a second are all tests over the \
                 whole run, set-up and interrupt included."
            .to_owned(),
        tables: vec![table],
        panels: vec![rates, shares],
        pictures: Vec::new(),
        says,
        checks,
    })
}

/// The fastest point of a unit.
fn best_of(points: &[Point], unit: IcuUnit) -> Option<&Point> {
    let own = points.iter().filter(|p| p.unit == unit);
    own.max_by(|a, b| a.tests_per_second().total_cmp(&b.tests_per_second()))
}
