//! Rays a second at the clock over the board's parameters, one panel each.
//!
//! ```text
//! Cornell box: camera rays, rays of pass 1 --> default board with one parameter changed --> rays a second at 25 MHz
//! ```

use rayon::prelude::*;
use rtl_model::spec::{BoardSpec, Partition, ShellGrowth};

use super::load::{Load, Run, Stage};
use super::plot::{Mark, Panel, Scale, Series};
use super::table::{Cell, Table, digits, row};
use super::{Check, ExperimentError, Extent, Findings, board};

/// A parameter that is changed.
struct Sweep {
    /// Its name, with unit.
    name: &'static str,
    values: &'static [u32],
    /// Few values of both ends, for quick runs.
    few: [u32; 2],
    /// Partitions, or growths of shells, that are tried.
    variants: &'static [Variant],
    set: fn(&mut BoardSpec, u32),
}

/// A board that a parameter is changed on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Variant {
    Default,
    Grid,
    Shells,
    Fixed,
    Doubling,
}

impl Variant {
    fn name(self) -> &'static str {
        match self {
            Variant::Default => "shells+static",
            Variant::Grid => "grid",
            Variant::Shells => "shells",
            Variant::Fixed => "fixed shells",
            Variant::Doubling => "doubling shells",
        }
    }

    fn apply(self, spec: &mut BoardSpec) {
        match self {
            Variant::Default => {}
            Variant::Grid => spec.partition = Partition::Grid,
            Variant::Shells => spec.partition = Partition::Shells,
            Variant::Fixed => spec.shells.growth = ShellGrowth::Fixed,
            Variant::Doubling => spec.shells.growth = ShellGrowth::Double,
        }
    }
}

const BOTH: &[Variant] = &[Variant::Default, Variant::Grid];
const SHELLS: &[Variant] = &[Variant::Default];
const GROWTHS: &[Variant] = &[Variant::Fixed, Variant::Doubling];
const PARTITIONS: [Variant; 3] = [Variant::Grid, Variant::Shells, Variant::Default];

const SWEEPS: [Sweep; 8] = [
    Sweep {
        name: "icu.depth (cycles)",
        values: &[1, 8, 22, 64, 128],
        few: [1, 128],
        variants: BOTH,
        set: |b, v| b.icu.depth = v,
    },
    Sweep {
        name: "fifos.ctu_icu (entries)",
        values: &[1, 2, 4, 16, 64],
        few: [1, 64],
        variants: BOTH,
        set: |b, v| b.fifos.ctu_icu = v,
    },
    Sweep {
        name: "clusters.ctus_per_icu",
        values: &[1, 2, 4, 8, 16],
        few: [1, 16],
        variants: BOTH,
        set: |b, v| b.clusters.ctus_per_icu = v,
    },
    Sweep {
        name: "ctu.contexts (rays)",
        values: &[1, 2, 4, 16, 64],
        few: [1, 64],
        variants: &[Variant::Grid],
        set: |b, v| b.ctu.contexts = v,
    },
    Sweep {
        name: "clusters.bundle_slots",
        values: &[1, 2, 4, 8, 16],
        few: [1, 16],
        variants: SHELLS,
        set: |b, v| b.clusters.bundle_slots = v,
    },
    Sweep {
        name: "patch_cache.bytes (B)",
        values: &[1024, 2048, 4096, 8192, 16384, 65536],
        few: [1024, 65536],
        variants: BOTH,
        set: |b, v| b.patch_cache.bytes = v,
    },
    Sweep {
        name: "shells.cells (of the first shell)",
        values: &[1, 2, 3, 4, 8, 16],
        few: [1, 16],
        variants: GROWTHS,
        set: |b, v| b.shells.cells = v,
    },
    Sweep {
        name: "shells.entries",
        values: &[4, 8, 16, 32, 64, 128, 256],
        few: [4, 256],
        variants: SHELLS,
        set: |b, v| b.shells.entries = v,
    },
];

/// A point of a sweep.
struct Point {
    sweep: usize,
    variant: Variant,
    load: usize,
    value: u32,
    run: Run,
}

pub(super) fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let stage = Stage::cornell_box(extent.pick(1200, 300))?;
    let side = extent.pick(128, 64);
    let loads: [(&str, Load); 2] =
        [("camera", stage.primary(side, side)?), ("pass 1", stage.radiosity(extent.pick(25_000, 4000))?)];
    let mut cases = Vec::new();
    for (s, sweep) in SWEEPS.iter().enumerate() {
        for &variant in sweep.variants {
            for load in 0..loads.len() {
                let values = extent.pick(sweep.values, &sweep.few[..]);
                cases.extend(values.iter().map(|v| (s, variant, load, *v)));
            }
        }
    }
    let points: Vec<Point> = cases
        .into_par_iter()
        .map(|(sweep, variant, load, value)| {
            let spec = board(|b| {
                variant.apply(b);
                (SWEEPS[sweep].set)(b, value);
            });
            Ok(Point { sweep, variant, load, value, run: loads[load].1.run(&spec)? })
        })
        .collect::<Result<_, ExperimentError>>()?;
    let is_same = loads.iter().enumerate().all(|(load, _)| {
        let mut own = points.iter().filter(|p| p.load == load).map(|p| &p.run.answers);
        own.next().is_none_or(|first| own.all(|answers| answers == first))
    });

    let partitions = partitions(&loads)?;
    let clock = board(|_| {});
    let rate = |p: &Point| 1e-3 * p.run.rays_per_second(&clock);
    let columns = ["parameter", "value", "default", "rays", "partition", "krays/s", "ICU utilisation (%)"];
    let mut table = Table::new("Throughput at 25 MHz", &columns);
    let (mut panels, mut says) = (Vec::new(), Vec::new());
    for (s, sweep) in SWEEPS.iter().enumerate() {
        let mut panel =
            Panel::new(sweep.name, (sweep.name, Scale::Log), ("krays/s", Scale::Linear { from_zero: true }));
        let mut said = Vec::new();
        for (load, (rays, _)) in loads.iter().enumerate() {
            for (v, &variant) in sweep.variants.iter().enumerate() {
                let own =
                    || points.iter().filter(move |p| (p.sweep, p.load, p.variant) == (s, load, variant));
                let xy = own().map(|p| (f64::from(p.value), rate(p)));
                let name = format!("{rays}, {}", variant.name());
                panel.series.push(Series::new(name.as_str(), Mark::Line, 1 + 2 * load + v, xy));
                for p in own() {
                    let default = match is_default(sweep, p.value) {
                        true => Cell::from("yes"),
                        false => Cell::from(""),
                    };
                    let mut row = row![sweep.name, p.value];
                    row.push(default);
                    let utilisation = 100.0 * p.run.statistics.icu_utilisation();
                    row.extend(row![*rays, variant.name(), rate(p), utilisation]);
                    table.push(row);
                }
                let best = own().max_by(|a, b| rate(a).total_cmp(&rate(b)));
                let worst = own().min_by(|a, b| rate(a).total_cmp(&rate(b)));
                if let (Some(best), Some(worst)) = (best, worst) {
                    said.push(format!(
                        "{name}: {:.0} krays/s at {}, {} times those at {}",
                        rate(best),
                        best.value,
                        digits(rate(best) / rate(worst)),
                        worst.value,
                    ));
                }
            }
        }
        says.push(format!("{}, best and worst. {}.", sweep.name, said.join("; ")));
        panels.push(panel);
    }
    let spread = |s: usize| {
        let of = |load: usize, variant: Variant| {
            let own = || {
                points.iter().filter(move |p| (p.sweep, p.load, p.variant) == (s, load, variant)).map(rate)
            };
            own().fold(0.0, f64::max) / own().fold(f64::INFINITY, f64::min)
        };
        let variants = SWEEPS[s].variants.iter();
        variants.flat_map(|v| [of(0, *v), of(1, *v)]).fold(0.0, f64::max)
    };
    let mut order: Vec<usize> = (0..SWEEPS.len()).collect();
    order.sort_by(|a, b| spread(*b).total_cmp(&spread(*a)));
    let ranked: Vec<String> =
        order.iter().map(|s| format!("{} ({} times)", SWEEPS[*s].name, digits(spread(*s)))).collect();
    for (load, (rays, _)) in loads.iter().enumerate() {
        let rate = |v: usize| 1e-3 * partitions[load][v].rays_per_second(&clock);
        let lines = |level: &str| {
            let of = |v: usize| partitions[load][v].lines_per_ray(level);
            digits(of(2) / of(0))
        };
        let ratio = rate(2) / rate(0);
        says.push(format!(
            "{rays}: with nothing else changed shells+static run at {:.0} krays/s and the grid at {:.0}, {} times: {}. Their \
             modules take {} times the grid's patch lines; the DRAM reads {} times the lines, and writes {} lines of tested \
             masks a ray.",
            rate(2),
            rate(0),
            digits(ratio),
            if ratio > 1.0 { "as the papers have it" } else { "against the papers, whose point shells are" },
            lines("patch_cache"),
            lines("dram"),
            digits(partitions[load][2].written_lines_per_ray("dram")),
        ));
    }
    says.push(format!("By what the range tried is worth at most, best over worst: {}.", ranked.join(", ")));
    Ok(Findings {
        question: "Which parameters of the board is its throughput sensitive to?".to_owned(),
        method: format!(
            "Cornell box of {} elements: {} camera rays and {} rays of the first queries of pass 1. The default board with one parameter \
             changed at a time; contexts in grid partition, bundle slots and shells in shells+static, the others in both. Rays a \
             second at 25 MHz, bus and interrupts included.",
            extent.pick(1200, 300),
            loads[0].1.n_rays(),
            loads[1].1.n_rays()
        ),
        tables: vec![table, partition_table(&loads, &partitions)],
        panels,
        pictures: Vec::new(),
        says,
        checks: vec![Check::new(is_same, "every board answers every ray alike")],
    })
}

/// A run a load and partition.
fn partitions(loads: &[(&str, Load)]) -> Result<Vec<Vec<Run>>, ExperimentError> {
    let specs = PARTITIONS.map(|partition| board(|b| partition.apply(b)));
    loads.iter().map(|(_, load)| load.run_all(&specs)).collect()
}

fn partition_table(loads: &[(&str, Load)], runs: &[Vec<Run>]) -> Table {
    let columns = [
        "rays",
        "partition",
        "krays/s",
        "ICU utilisation (%)",
        "tests/ray",
        "patch lines/ray",
        "list lines/ray",
        "mask lines/ray",
        "DRAM lines/ray",
        "DRAM lines written/ray",
        "DRAM busy (%)",
    ];
    let mut table = Table::new("Partitions, all else as by default", &columns);
    let clock = board(|_| {});
    for ((rays, _), runs) in loads.iter().zip(runs) {
        for (partition, run) in PARTITIONS.iter().zip(runs) {
            let s = &run.statistics;
            table.push(row![
                *rays,
                partition.name(),
                1e-3 * run.rays_per_second(&clock),
                100.0 * s.icu_utilisation(),
                s.canonical.tests as f64 / s.canonical.rays as f64,
                run.lines_per_ray("patch_cache"),
                run.lines_per_ray("list_cache"),
                run.lines_per_ray("mask_cache"),
                run.lines_per_ray("dram"),
                run.written_lines_per_ray("dram"),
                100.0 * s.dram_busy_cycles as f64 / s.cycles as f64,
            ]);
        }
    }
    table
}

/// The default board has this value.
fn is_default(sweep: &Sweep, value: u32) -> bool {
    let default = board(|_| {});
    let mut changed = default.clone();
    (sweep.set)(&mut changed, value);
    changed == default
}
