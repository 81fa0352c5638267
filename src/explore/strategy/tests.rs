use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

use super::*;
use crate::explore::evaluate::Extent;
use crate::explore::results::pareto::{Ranges, front};
use crate::explore::store::Store;
use crate::explore::sweep::{Limits, Outcome, Workloads};
use crate::explore::test_spaces::space;

/// Three axes of timing, 6 x 6 x 5 combinations, some of them impossible.
const AXES: &str = "\"icu.depth\" = [2, 6, 12, 22, 40, 60]\n\"clusters.count\" = [1, 2, 3, 4, 6, 8]\n\
                    \"patch_cache.bytes\" = [0, 512, 1024, 2048, 4096]";
const CONSTRAINT: &str = "[[constraint]]\nrequire = \"clusters.count * patch_cache.bytes <= 24576\"\n";

fn with(search: &str) -> Space {
    space(AXES, &format!("{CONSTRAINT}[search]\n{search}"))
}

/// Runs a search; what became of all that it asked for.
fn searched(space: &Space) -> Vec<(u64, Outcome)> {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(&dir.path().join("s.sqlite")).unwrap();
    let (stop, progress) = (AtomicBool::new(false), &mut |_: &_| {});
    let mut sweep =
        Sweep::new(space, Workloads::of(space).unwrap(), &mut store, Limits::default(), &stop, progress);
    let plan = plan(space).unwrap();
    run(&mut sweep, plan.as_deref()).unwrap();
    sweep.into_outcomes().into_iter().collect()
}

fn evaluated(outcomes: &[(u64, Outcome)]) -> Vec<Vec<f64>> {
    let seconds = crate::explore::metric::METRICS.iter().position(|m| m.name == "seconds").unwrap();
    let area = crate::explore::metric::METRICS.iter().position(|m| m.name == "area_mm2").unwrap();
    let objectives = |outcome: &Outcome| match outcome {
        Outcome::Known { extent: Extent::Whole, metrics } => Some(vec![metrics[seconds]?, metrics[area]?]),
        _ => None,
    };
    outcomes.iter().filter_map(|(_, outcome)| objectives(outcome)).collect()
}

#[test]
fn plan_of_a_grid_is_every_combination_and_samples_are_possible_and_distinct() {
    let grid = with("strategy = \"grid\"");
    assert_eq!(plan(&grid).unwrap(), Some((0..180).collect()));
    for strategy in ["random", "sobol"] {
        let sampled = |seed: u64, points: u64| {
            let space = with(&format!("strategy = \"{strategy}\"\nseed = {seed}\npoints = {points}"));
            plan(&space).unwrap().unwrap()
        };
        let sample = sampled(1, 40);
        assert_eq!(sample.len(), 40);
        assert_eq!(sample.iter().collect::<BTreeSet<_>>().len(), 40, "{strategy}");
        assert!(sample.iter().all(|ordinal| grid.candidate(*ordinal).is_ok()));
        assert_eq!(sample, sampled(1, 40));
        assert_eq!(sample[..20], sampled(1, 20)[..], "a longer sample goes on with a shorter one");
        assert_ne!(sample, sampled(2, 40));
        // All that there are, and no more.
        let possible = (0..180).filter(|ordinal| grid.candidate(*ordinal).is_ok()).count();
        assert!(possible < 180);
        assert_eq!(sampled(3, 1000).len(), possible, "{strategy}");
    }
}

#[test]
fn plan_of_a_sobol_sample_has_each_value_of_an_axis_about_equally_often() {
    let space = with("strategy = \"sobol\"\npoints = 36\nseed = 5");
    let plan = plan(&space).unwrap().unwrap();
    for value in 0..6 {
        let n = plan.iter().filter(|ordinal| space.choice(**ordinal)[0] == value).count();
        assert!((4..=8).contains(&n), "value {value}: {n} of 36");
    }
}

#[test]
fn plan_without_points_or_of_a_vast_grid_is_refused() {
    let mut space = with("strategy = \"random\"\npoints = 10");
    space.search.points = None;
    for strategy in [Strategy::Random, Strategy::Sobol, Strategy::Nsga2 { population: 8 }] {
        space.search.strategy = strategy;
        assert!(plan(&space).unwrap_err().contains("--points"), "{strategy:?}");
        space.search.minutes = Some(1.0);
        assert!(plan(&space).is_ok(), "{strategy:?}");
        space.search.minutes = None;
    }
    let many: Vec<String> = (1..=4096).map(|n| n.to_string()).collect();
    let axes = format!("\"icu.depth\" = [{0}]\n\"fifos.results\" = [{0}]", many.join(","));
    let vast = super::super::test_spaces::space(&axes, "");
    assert!(plan(&vast).unwrap_err().contains("16777216 combinations"));
}

/// Costs alone, of which the full grid's front is known without running anything.
fn cost_space(search: &str) -> Space {
    let axes = "\"icu.depth\" = { from = 2, to = 60, step = 2 }\n\"ctu.depth\" = { from = 1, to = 8, step = 1 }\n\
                \"clusters.ctus_per_icu\" = [1, 2, 4, 8, 16]\n\"fifos.results\" = [16, 64, 256]";
    let mut space = space(axes, &format!("[search]\n{search}"));
    space.objectives = ["area_mm2", "critical_path_ns"]
        .map(|name| {
            let metric = crate::explore::metric::Metric::named(name).unwrap();
            crate::explore::space::Objective { metric, goal: metric.goal }
        })
        .to_vec();
    space
}

fn costs(space: &Space, ordinals: impl Iterator<Item = u64>) -> Vec<Vec<f64>> {
    let cost =
        |ordinal| space.candidate(ordinal).map(|c| vec![c.cost.area_mm2.unwrap(), c.cost.critical_path_ns]);
    ordinals.map(|ordinal| cost(ordinal).unwrap()).collect()
}

#[test]
fn nsga2_with_a_twentieth_of_the_points_finds_nearly_all_hypervolume_and_more_than_chance() {
    let all = cost_space("");
    let grid = costs(&all, 0..all.n_combinations());
    let ranges = Ranges::of(&grid);
    let whole = ranges.hypervolume(&grid);
    let points = grid.len() / 20;
    let mean = |strategy: &str| {
        let shares = (1..=3).map(|seed| {
            let space = cost_space(&format!("strategy = \"{strategy}\"\npoints = {points}\nseed = {seed}"));
            let asked = searched(&space).into_iter().map(|(ordinal, _)| ordinal);
            let found = costs(&space, asked);
            assert!(found.len() <= points, "{}", found.len());
            ranges.hypervolume(&found) / whole
        });
        shares.sum::<f64>() / 3.0
    };
    let (nsga2, chance) = (mean("nsga2"), mean("random"));
    assert!(nsga2 > 0.97, "{nsga2}, by chance {chance}");
    assert!(1.0 - nsga2 < 0.5 * (1.0 - chance), "{nsga2}, by chance {chance}");
}

#[test]
fn nsga2_with_one_seed_asks_for_the_same_candidates_on_any_threads() {
    let space = with("strategy = \"nsga2\"\npoints = 30\npopulation = 8\nseed = 9");
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| searched(&space))
    };
    let first = on(1);
    assert_eq!(first.iter().filter(|(_, o)| matches!(o, Outcome::Known { .. })).count(), 30);
    assert_eq!(first, on(2));
}

#[test]
fn halving_runs_its_last_rung_whole_on_the_share_that_is_kept_and_finds_the_best() {
    let space = with("strategy = \"halving\"\npoints = 64\nrungs = 3\nkeep = 0.5");
    let outcomes = searched(&space);
    let n = |wanted: Extent| {
        outcomes
            .iter()
            .filter(|(_, o)| matches!(o, Outcome::Known { extent, .. } if *extent == wanted))
            .count()
    };
    assert_eq!((n(Extent::Rung(2)), n(Extent::Rung(1)), n(Extent::Whole)), (32, 16, 16));
    // Of the candidates that it began with, those on their true front are mostly among the last.
    let mut all = space.clone();
    all.search.strategy = Strategy::Random;
    let all = evaluated(&searched(&all));
    let best = front(&all);
    let kept = evaluated(&outcomes);
    let among = best.iter().filter(|i| kept.contains(&all[**i])).count();
    assert!(among * 2 > best.len(), "{among} of {}", best.len());
}
