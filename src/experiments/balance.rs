//! What the low-resolution partition of 1991 does to the balance between clusters, and what it costs.
//!
//! ```text
//! scenes' rays --> shells (equal numbers of rays) | shells+static, a centre ray every 1, 4, 16 bundles | ideal
//!     --> max/mean of the clusters' ICU work, cycles, cycles of the cast
//! ```
//! Scheduling is static: once dealt, bundles stay. `ideal` deals at no cost, and is a bound of balance only.
//! Source: Shen, Laarakker, Deprettere 1991.

use rayon::prelude::*;
use rtl_model::spec::{Partition, Scheduling};

use super::load::{Load, Run, Stage, same_answers};
use super::plot::{Mark, Panel, Scale, Series};
use super::table::{Table, digits, row};
use super::{Check, ExperimentError, Extent, Findings, board};
use crate::generate::Kind;

/// How bundles are dealt: name, and a centre ray for every so many bundles.
const DEALS: [(&str, Option<u32>); 5] = [
    ("shells: equal rays", None),
    ("cast, every bundle", Some(1)),
    ("cast, every 4th", Some(4)),
    ("cast, every 16th", Some(16)),
    ("ideal", None),
];

/// Rays with a name, all deals.
pub(super) struct Case {
    name: &'static str,
    n_rays: usize,
    n_patches: usize,
    pub(super) runs: Vec<Run>,
}

pub(super) fn cases(extent: Extent) -> Result<Vec<Case>, ExperimentError> {
    let box_elements = extent.pick(1200, 300);
    let cornell = Stage::cornell_box(box_elements)?;
    let room = Stage::generated(Kind::FurnishedRoom, extent.pick(12, 1), extent.pick(None, Some(100)))?;
    let random = Stage::generated(Kind::RandomPatches, extent.pick(500, 30), extent.pick(None, Some(100)))?;
    let side = extent.pick(192, 64);
    let n_rays = extent.pick(50_000, 12_000);
    let loads: Vec<(&'static str, Load)> = vec![
        ("Cornell box, camera", cornell.primary(side, side)?),
        ("Cornell box, pass 1", cornell.radiosity(n_rays)?),
        ("furnished room, pass 1", room.radiosity(n_rays)?),
        ("furnished room, camera", room.primary(side, side)?),
        ("random patches, pass 1", random.radiosity(n_rays)?),
        ("random patches, camera", random.primary(side, side)?),
    ];
    let specs = DEALS.map(|(name, every)| {
        board(|b| {
            b.partition = if every.is_some() { Partition::ShellsStatic } else { Partition::Shells };
            b.scheduling = if name == "ideal" { Scheduling::Ideal } else { Scheduling::Static };
            b.dispatch.low_resolution_every = every.unwrap_or(1);
        })
    });
    let mut cases = Vec::new();
    for (name, load) in &loads {
        let runs: Vec<Run> =
            specs.par_iter().map(|spec| load.run_watched(spec)).collect::<Result<_, ExperimentError>>()?;
        same_answers(&runs)?;
        cases.push(Case { name, n_rays: load.n_rays(), n_patches: load.n_patches(), runs });
    }
    Ok(cases)
}

/// How much faster the second of two numbers of cycles is, in percent.
pub(super) fn gain(before: u64, after: u64) -> f64 {
    100.0 * (before as f64 / after as f64 - 1.0)
}

pub(super) fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let cases = cases(extent)?;
    let columns = [
        "rays of",
        "dealt by",
        "max/mean ICU work",
        "cycles",
        "speed-up (%)",
        "of these the cast (cycles)",
        "cast rays",
        "cast tests (% of all)",
    ];
    let mut table = Table::new("Balance and its cost, static scheduling", &columns);
    let names: Vec<String> = cases.iter().map(|c| c.name.replacen(", ", ",\n", 1)).collect();
    let scale = || Scale::Names(names.clone());
    let from_zero = || Scale::Linear { from_zero: true };
    let mut balance = Panel::new(
        "By how much the busiest cluster's ICU works longer than the mean",
        ("", scale()),
        ("max/mean - 1 (%)", from_zero()),
    );
    let mut cycles =
        Panel::new("Cycles a ray, the cast included", ("", scale()), ("cycles a ray", from_zero()));
    for (d, (deal, _)) in DEALS.iter().enumerate() {
        let bars = |f: &dyn Fn(&Run) -> f64| -> Vec<(f64, f64)> {
            cases.iter().enumerate().map(|(i, c)| (i as f64, f(&c.runs[d]))).collect()
        };
        balance.series.push(Series::new(*deal, Mark::Bars, d, bars(&|run| 100.0 * (run.imbalance() - 1.0))));
        cycles.series.push(Series::new(*deal, Mark::Bars, d, bars(&Run::cycles_per_ray)));
    }
    for c in &cases {
        for ((deal, _), run) in DEALS.iter().zip(&c.runs) {
            let s = &run.statistics;
            let cast = &s.canonical.low_resolution;
            table.push(row![
                c.name,
                *deal,
                run.imbalance(),
                s.cycles,
                gain(c.runs[0].statistics.cycles, s.cycles),
                run.cast_cycles,
                cast.rays,
                100.0 * cast.tests as f64 / (cast.tests + s.canonical.tests) as f64,
            ]);
        }
    }
    let mut says = Vec::new();
    for c in &cases {
        let (plain, cast) = (&c.runs[0], &c.runs[1]);
        let best = (1..4).min_by_key(|&d| c.runs[d].statistics.cycles).unwrap_or(1);
        let net = gain(plain.statistics.cycles, c.runs[best].statistics.cycles);
        let without = c.runs[best].statistics.cycles - c.runs[best].cast_cycles;
        says.push(format!(
            "{}: a cast of every bundle takes max/mean from {} to {}. Best of the three in cycles is \"{}\": {} of {} %; the cast \
             itself takes {} % of the cycles, and were it free, the speed-up would be {} %.",
            c.name,
            digits(plain.imbalance()),
            digits(cast.imbalance()),
            DEALS[best].0,
            if net > 0.0 { "a speed-up" } else { "a loss" },
            digits(net.abs()),
            digits(100.0 * c.runs[best].cast_cycles as f64 / c.runs[best].statistics.cycles as f64),
            digits(gain(plain.statistics.cycles, without)),
        ));
    }
    let better = cases.iter().filter(|c| c.runs[1].imbalance() < c.runs[0].imbalance()).count();
    let pays = cases.iter().filter(|c| c.runs[1].statistics.cycles < c.runs[0].statistics.cycles).count();
    says.push(format!(
        "The claim of 1991 is balance: a cast of every bundle improves it in {better} of {} cases. In cycles it pays for itself \
         in {pays}.",
        cases.len()
    ));
    let ideal = cases.iter().filter(|c| c.runs[4].statistics.cycles > c.runs[0].statistics.cycles).count();
    says.push(format!(
        "`ideal` deals the next bundle to the first cluster with room; it needs more cycles than ranges of equal rays in {ideal} \
         of {} cases: what it gains in balance it may lose in what neighbouring bundles share in a cluster's buffer.",
        cases.len()
    ));
    let about: Vec<String> =
        cases.iter().map(|c| format!("{}: {} rays, {} patches", c.name, c.n_rays, c.n_patches)).collect();
    Ok(Findings {
        question: "The paper of 1991 casts one ray a bundle first, at low resolution, and deals bundles so that clusters get equal \
                   estimated work. How much better is the balance, and is it worth the cast?"
            .to_owned(),
        method: format!(
            "The default board (four clusters) with static scheduling: bundles dealt in ranges of equal rays (partition shells), \
             or of equal estimates from a centre ray of every 1st, 4th, 16th bundle (shells+static); `ideal` scheduling beside \
             them. ICU work includes the cast's own. {}.",
            about.join("; ")
        ),
        tables: vec![table],
        panels: vec![balance, cycles],
        pictures: Vec::new(),
        says,
        checks: vec![Check::new(true, "all boards answer every ray alike (the run stops otherwise)")],
    })
}
