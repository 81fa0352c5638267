//! Results for tests: bare ones, and sweeps of a made-up board that behaves plausibly.
//!
//! ```text
//! axes --crude model: paths, bounds, a fixed scatter by hash--> rows with metrics, stalls, area, board files
//! ```
//! None of these numbers is of a board.

use rtl_model::spec::{BoardSpec, Partition};

use super::{AxisColumn, KindStalls, MetricColumn, Results, Row, Status};
use crate::explore::metric::Metric;
use crate::explore::space::Impossible;
use crate::explore::value::Value;
use crate::sampling::{hash, unit_pair};

/// Axes with values 0, 1, ... and metrics by name, without rows.
pub(in crate::explore) fn bare(axes: &[(&str, usize)], metrics: &[&str]) -> Results {
    let axes: Vec<AxisColumn> = axes
        .iter()
        .map(|(name, n)| AxisColumn {
            name: (*name).to_owned(),
            values: (0..*n as i64).map(Value::Integer).collect(),
        })
        .collect();
    let n_combinations = axes.iter().map(|a| a.values.len() as u64).product();
    Results {
        name: "bare".to_owned(),
        question: "What is bare?".to_owned(),
        space_file: "bare.toml".to_owned(),
        technology: "osu-0.35um".to_owned(),
        version: "0.1.0".to_owned(),
        workloads: vec!["cornell-box, primary rays, 128 x 128".to_owned()],
        search: "full grid".to_owned(),
        base: String::new(),
        axes,
        metrics: metrics.iter().map(|name| metric(name, false)).collect(),
        counters: Vec::new(),
        rows: Vec::new(),
        impossible: Vec::new(),
        n_combinations,
    }
}

fn metric(name: &str, is_objective: bool) -> MetricColumn {
    let m = Metric::named(name).unwrap_or_else(|| panic!("no metric {name}"));
    MetricColumn {
        name: m.name.to_owned(),
        unit: m.unit.to_owned(),
        what: m.what.to_owned(),
        goal: m.goal,
        is_objective,
    }
}

/// A simulated row without anything besides.
pub(in crate::explore) fn bare_row(ordinal: u64, values: Vec<Value>, metrics: &[f64]) -> Row {
    Row {
        ordinal,
        status: Status::Simulated,
        values,
        metrics: metrics.iter().map(|x| Some(*x)).collect(),
        half_width_cycles: None,
        counters: Vec::new(),
        stalls: Vec::new(),
        limit: None,
        critical_block: String::new(),
        area: Vec::new(),
        board: String::new(),
        command: String::new(),
    }
}

/// Depth of the ICU alone, 30 values.
pub(in crate::explore) fn depths() -> Results {
    let depths = (1..=30).map(|d| Value::Integer(2 * d)).collect();
    sweep("How deep should the intersection pipeline be?", vec![("icu.depth", depths)], false)
}

/// Five axes, 10,000 combinations, of which some are pruned, sampled, failed, shortened or impossible.
pub(in crate::explore) fn large() -> Results {
    let whole = |values: &[i64]| values.iter().map(|v| Value::Integer(*v)).collect::<Vec<_>>();
    let axes = vec![
        ("icu.depth", whole(&[2, 4, 6, 8, 12, 16, 20, 24, 32, 40])),
        ("ctu.contexts", whole(&[1, 2, 3, 4, 6, 8, 12, 16, 24, 32])),
        ("clusters.ctus_per_icu", whole(&[1, 2, 3, 4, 5, 6, 7, 8, 9, 10])),
        ("patch_cache.bytes", whole(&[1024, 2048, 4096, 8192, 16384])),
        ("partition", ["grid", "shells"].map(|t| Value::Text(t.to_owned())).to_vec()),
    ];
    sweep("Where does the area of the whole board go best?", axes, true)
}

const METRICS: [&str; 11] = [
    "cycles",
    "seconds",
    "cycles_per_ray",
    "rays_per_second",
    "icu_utilisation",
    "power_w",
    "rays_per_second_per_mm2",
    "clock_mhz",
    "critical_path_ns",
    "area_mm2",
    "gates",
];

fn sweep(question: &str, axes: Vec<(&str, Vec<Value>)>, with_accidents: bool) -> Results {
    let base = BoardSpec::preset("delft-1992").expect("a preset");
    let objectives: &[&str] = if with_accidents {
        &["seconds", "area_mm2", "power_w"]
    } else {
        &["rays_per_second_per_mm2", "seconds", "area_mm2"]
    };
    let mut results = bare(&[], &[]);
    results.question = question.to_owned();
    results.name = "synthetic".to_owned();
    results.space_file = "scenes/spaces/synthetic.toml".to_owned();
    results.base = toml::to_string(&base).expect("a board");
    results.axes =
        axes.into_iter().map(|(name, values)| AxisColumn { name: name.to_owned(), values }).collect();
    results.metrics = METRICS.iter().map(|name| metric(name, objectives.contains(name))).collect();
    results.counters = ["rays", "tests", "steps", "dram_lines"].map(str::to_owned).to_vec();
    results.n_combinations = results.axes.iter().map(|a| a.values.len() as u64).product();
    for ordinal in 0..results.n_combinations {
        let mut rest = ordinal;
        let mut values: Vec<Value> = Vec::new();
        for axis in results.axes.iter().rev() {
            let n = axis.values.len() as u64;
            values.push(axis.values[(rest % n) as usize].clone());
            rest /= n;
        }
        values.reverse();
        if with_accidents && ordinal % 41 == 7 {
            let reason =
                if ordinal % 2 == 0 { "one 16 KiB macro a module" } else { "fifos.ctu_icu = 8: too few" };
            results.impossible.push(Impossible { ordinal, reason: reason.to_owned() });
            continue;
        }
        let row = row(&results.axes, &base, ordinal, values);
        results.rows.push(if with_accidents { accident(row) } else { row });
    }
    results
}

fn accident(mut row: Row) -> Row {
    let known = |row: &mut Row, names: &[&str]| {
        for (name, value) in METRICS.iter().zip(&mut row.metrics) {
            *value = value.filter(|_| names.contains(name));
        }
    };
    let cost = ["clock_mhz", "critical_path_ns", "area_mm2", "gates"];
    match row.ordinal % 100 {
        n if n < 30 => {
            row.status = Status::Pruned;
            known(&mut row, &cost);
        }
        50 => {
            row.status = Status::Failed("no progress in 100000 cycles, 3 rays open <watchdog>".to_owned());
            known(&mut row, &cost);
        }
        60..70 => {
            row.status = Status::Sampled;
            row.half_width_cycles = row.metrics[0].map(|c| 0.01 * c);
            return row;
        }
        80 => row.status = Status::Shortened,
        _ => return row,
    }
    if row.status != Status::Shortened {
        (row.counters, row.stalls, row.limit) = (Vec::new(), Vec::new(), None);
    }
    row
}

fn row(axes: &[AxisColumn], base: &BoardSpec, ordinal: u64, values: Vec<Value>) -> Row {
    let mut spec = base.clone();
    for (axis, value) in axes.iter().zip(&values) {
        let number = value.number().unwrap_or(0.0) as u32;
        match axis.name.as_str() {
            "icu.depth" => spec.icu.depth = number,
            "ctu.contexts" => spec.ctu.contexts = number,
            "clusters.ctus_per_icu" => spec.clusters.ctus_per_icu = number,
            "patch_cache.bytes" => spec.patch_cache.bytes = number,
            "partition" if *value == Value::Text("grid".to_owned()) => spec.partition = Partition::Grid,
            "partition" => spec.partition = Partition::Shells,
            other => panic!("no axis {other}"),
        }
    }
    let scatter = |k| 1.0 + 0.02 * (unit_pair(hash(1, ordinal, k))[0] - 0.5);
    let depth = f64::from(spec.icu.depth);
    let (contexts, ctus) = (f64::from(spec.ctu.contexts), f64::from(spec.clusters.ctus_per_icu));
    let kib = f64::from(spec.patch_cache.bytes) / 1024.0;
    let is_grid = spec.partition == Partition::Grid;
    let paths = [("icu", 150.0 / depth + 1.8), ("patch_cache", 5.5 + 0.9 * kib.log2()), ("ctu", 6.8)];
    let (block, path) = paths.into_iter().fold(("", 0.0), |a, b| if b.1 > a.1 { b } else { a });
    spec.clock_mhz = (1e3 / path * 100.0).floor() / 100.0;
    let rays = 16_384.0;
    let tests = rays * if is_grid { 9.0 } else { 7.5 };
    let steps = rays * 14.0;
    let misses = tests * 0.25 / kib;
    let bounds = [
        ("ICUs", tests / 4.0),
        ("CTUs", steps / (4.0 * ctus) * (1.0 + 3.0 / contexts)),
        ("DRAM", misses * 6.0 * spec.clock_mhz / 25.0),
    ];
    let (limit, bound) = bounds.into_iter().fold(("", 0.0), |a, b| if b.1 > a.1 { b } else { a });
    let cycles =
        ((bound * 1.06 + 60.0 * depth + 0.1 * bounds.iter().map(|b| b.1).sum::<f64>()) * scatter(1)).round();
    let area = [
        ("icu", 4.0 * (3.1 + 0.045 * depth)),
        ("ctu", 4.0 * ctus * (0.3 + 0.02 * contexts)),
        ("patch_cache", 4.0 * 0.35 * kib),
        ("bundle_generator", 1.2),
    ];
    let area_mm2: f64 = area.iter().map(|a| a.1).sum();
    let seconds = cycles / (1e6 * spec.clock_mhz);
    let metrics = [
        cycles,
        seconds,
        cycles / rays,
        rays / seconds,
        tests / 4.0 / cycles,
        0.004 * area_mm2 * spec.clock_mhz * 0.1 + tests * 2e-9 / seconds,
        rays / seconds / area_mm2,
        spec.clock_mhz,
        path,
        area_mm2,
        9000.0 * area_mm2,
    ];
    let icu = |share: f64| (4.0 * cycles * share) as u64;
    let work = (tests / 4.0 / cycles).min(1.0);
    let starved = 0.8 * (1.0 - work);
    let mut stall =
        [icu(work), icu(0.02 * (1.0 - work)), 0, 0, 0, 0, icu(starved), 0, icu(0.05 * (1.0 - work)), 0];
    stall[7] = 4 * cycles as u64 - stall.iter().sum::<u64>();
    let mut ctu = [0; 10];
    ctu[0] = (cycles * 0.6) as u64;
    ctu[2] = cycles as u64 - ctu[0];
    Row {
        ordinal,
        status: Status::Simulated,
        metrics: metrics.iter().map(|x| Some(*x)).collect(),
        half_width_cycles: None,
        counters: [rays, tests, steps, misses].map(|n| n as u64).to_vec(),
        stalls: vec![
            KindStalls { kind: "icu".to_owned(), cycles: stall },
            KindStalls { kind: "ctu".to_owned(), cycles: ctu },
        ],
        limit: Some((limit.to_owned(), bound / cycles)),
        critical_block: block.to_owned(),
        area: area.map(|(name, mm2)| (name.to_owned(), mm2)).to_vec(),
        board: toml::to_string(&spec).expect("a board"),
        command: format!("radeng explore scenes/spaces/synthetic.toml --point {ordinal}"),
        values,
    }
}
