//! What a sweep found, from its outcomes and its store.
//!
//! ```text
//! outcome, candidate, counts of its workloads --> Row: metrics, counters, stalls by kind, limit, costs, board file
//! ```

use std::collections::BTreeMap;

use rtl_model::statistics::BoardStatistics;

use super::evaluate::Extent;
use super::metric::METRICS;
use super::results::{AxisColumn, KindStalls, MetricColumn, Results, Row, Status};
use super::space::{Candidate, Clock, Impossible, Space, Strategy};
use super::store::{Store, StoreError, evaluation_hash, version};
use super::sweep::Outcome;
use crate::recorded::Setting;
use crate::report::bounds::Bounds;
use crate::report::groups::kind;

/// The results of a sweep, in the order of ordinals.
///
/// # Errors
/// When the store fails.
pub fn results(
    space: &Space,
    outcomes: &BTreeMap<u64, Outcome>,
    store: &Store,
    settings: &[Vec<Setting>],
) -> Result<Results, StoreError> {
    let mut rows = Vec::new();
    let mut impossible = Vec::new();
    let mut counters: Vec<String> = Vec::new();
    let mut counted: Vec<Vec<(String, u64)>> = Vec::new();
    for (&ordinal, outcome) in outcomes {
        if let Outcome::Impossible(reason) = outcome {
            impossible.push(Impossible { ordinal, reason: reason.clone() });
            continue;
        }
        // It was a candidate when it was asked for.
        let Ok(candidate) = space.candidate(ordinal) else { continue };
        let mut half_width = None;
        let mut all = BoardStatistics::default();
        let (status, metrics) = match outcome {
            Outcome::Known { extent, metrics } => {
                for settings in settings {
                    let hash = evaluation_hash(&candidate.spec, settings, *extent);
                    if let Some(Ok(counted)) = store.evaluation(&hash)? {
                        all = all.plus(&counted.statistics);
                        // Independent workloads: variances add.
                        half_width = counted
                            .half_width_cycles
                            .map(|w| half_width.map_or(w, |before: f64| before.hypot(w)))
                            .or(half_width);
                    }
                }
                let status = match extent {
                    Extent::Whole => Status::Simulated,
                    Extent::Rung(_) => Status::Shortened,
                    Extent::Sample { .. } => Status::Sampled,
                };
                (status, metrics.clone())
            }
            Outcome::Failed(error) => (Status::Failed(error.clone()), vec![None; METRICS.len()]),
            Outcome::Pruned | Outcome::Impossible(_) => {
                (Status::Pruned, super::evaluate::values(&candidate, &[], None))
            }
        };
        let named = if all.commands > 0 { named_counters(&all) } else { Vec::new() };
        for (name, _) in &named {
            if !counters.contains(name) {
                counters.push(name.clone());
            }
        }
        counted.push(named);
        rows.push(row(space, candidate, status, metrics, half_width, &all));
    }
    for (row, named) in rows.iter_mut().zip(&counted) {
        if !named.is_empty() {
            let of = |name: &String| named.iter().find(|(n, _)| n == name).map_or(0, |(_, count)| *count);
            row.counters = counters.iter().map(of).collect();
        }
    }
    let known: Vec<usize> =
        (0..METRICS.len()).filter(|i| rows.iter().any(|row: &Row| row.metrics[*i].is_some())).collect();
    for row in &mut rows {
        row.metrics = known.iter().map(|i| row.metrics[*i]).collect();
    }
    let column = |i: &usize| {
        let metric = &METRICS[*i];
        let objective = space.objectives.iter().find(|o| o.metric.name == metric.name);
        MetricColumn {
            name: metric.name.to_owned(),
            unit: metric.unit.to_owned(),
            what: metric.what.to_owned(),
            goal: objective.map_or(metric.goal, |o| o.goal),
            is_objective: objective.is_some(),
        }
    };
    Ok(Results {
        name: space.name.clone(),
        question: space.question.clone(),
        space_file: space.file.display().to_string(),
        technology: space.technology.name.to_owned(),
        version: version(),
        workloads: space
            .workloads
            .iter()
            .map(|w| {
                let rays = super::evaluate::WorkloadSetup::new(w).rays_name();
                let scene = w.scene.display();
                format!("{}: {rays} rays of {scene}, {} x {}, seed {}", w.name, w.width, w.height, w.seed)
            })
            .collect(),
        search: search(space),
        base: toml::to_string(&space.base).unwrap_or_else(|e| panic!("a board has a TOML form: {e}")),
        axes: space
            .axes
            .iter()
            .map(|axis| AxisColumn { name: axis.name.clone(), values: axis.values.clone() })
            .collect(),
        metrics: known.iter().map(column).collect(),
        counters,
        rows,
        impossible,
        n_combinations: space.n_combinations(),
    })
}

fn row(
    space: &Space,
    candidate: Candidate,
    status: Status,
    metrics: Vec<Option<f64>>,
    half_width_cycles: Option<f64>,
    all: &BoardStatistics,
) -> Row {
    let Candidate { ordinal, choice, spec, cost } = candidate;
    let limit = (all.commands > 0)
        .then(|| Bounds::new(&spec, all))
        .and_then(|bounds| bounds.tightest().map(|l| (l.resource.name().to_owned(), l.share)));
    let area = cost
        .blocks
        .iter()
        .map(|block| (block.block.to_owned(), block.area_mm2.unwrap_or(block.gates)))
        .collect();
    Row {
        ordinal,
        status,
        values: space.axes.iter().zip(&choice).map(|(axis, place)| axis.values[*place].clone()).collect(),
        metrics,
        half_width_cycles,
        counters: Vec::new(),
        stalls: stalls(all),
        limit,
        critical_block: cost.critical_block.to_owned(),
        area,
        board: toml::to_string(&spec).unwrap_or_else(|e| panic!("a board has a TOML form: {e}")),
        command: format!("radeng explore {} --point {ordinal}", space.file.display()),
    }
}

/// The causes of all blocks, by kind, in the order in which the kinds first come.
fn stalls(all: &BoardStatistics) -> Vec<KindStalls> {
    let mut stalls: Vec<KindStalls> = Vec::new();
    for block in &all.blocks {
        let which = kind(&block.block);
        match stalls.iter_mut().find(|s| s.kind == which) {
            Some(sum) => sum.cycles.iter_mut().zip(block.cycles).for_each(|(sum, n)| *sum += n),
            None => stalls.push(KindStalls { kind: which.to_owned(), cycles: block.cycles }),
        }
    }
    stalls
}

/// Every counter but the blocks' accounts, by name.
fn named_counters(all: &BoardStatistics) -> Vec<(String, u64)> {
    let (canonical, low) = (&all.canonical, &all.canonical.low_resolution);
    let mut named: Vec<(String, u64)> = [
        ("commands", all.commands),
        ("bundles", canonical.bundles),
        ("rays", canonical.rays),
        ("cells", canonical.cells),
        ("list_entries", canonical.list_entries),
        ("tests", canonical.tests),
        ("hits", canonical.hits),
        ("low_resolution_rays", low.rays),
        ("low_resolution_cells", low.cells),
        ("low_resolution_list_entries", low.list_entries),
        ("low_resolution_tests", low.tests),
        ("bus_down_bytes", all.bus_down_bytes),
        ("bus_up_bytes", all.bus_up_bytes),
        ("bus_down_cycles", all.bus_down_cycles),
        ("bus_up_cycles", all.bus_up_cycles),
        ("dram_busy_cycles", all.dram_busy_cycles),
        ("rebalances", all.rebalances),
    ]
    .map(|(name, count)| (name.to_owned(), count))
    .to_vec();
    for level in &all.memory {
        for (what, count) in [
            ("accesses", level.accesses),
            ("misses", level.misses),
            ("bytes", level.bytes),
            ("written_bytes", level.written_bytes),
        ] {
            named.push((format!("{}_{what}", level.level), count));
        }
    }
    named
}

/// How candidates are chosen, in words.
fn search(space: &Space) -> String {
    let search = &space.search;
    let points = search.points.map_or("all".to_owned(), |n| n.to_string());
    let way = match search.strategy {
        Strategy::Grid => "full grid".to_owned(),
        Strategy::Random => format!("{points} random combinations, seed {}", search.seed),
        Strategy::Sobol => format!("{points} points of a Sobol sequence, seed {}", search.seed),
        Strategy::Halving { rungs, keep } => format!(
            "successive halving of {points} combinations in {rungs} rungs, share {keep} goes on, seed {}",
            search.seed
        ),
        Strategy::Nsga2 { population } => {
            format!("NSGA-II, {points} combinations, population {population}, seed {}", search.seed)
        }
    };
    match space.clock {
        Clock::Derived => format!("{way}; clock from the critical path"),
        Clock::Board => way,
    }
}
