use std::sync::atomic::AtomicBool;

use super::*;
use crate::explore::results::pareto::front;
use crate::explore::test_spaces::space;

const AXES: &str =
    "\"icu.depth\" = [2, 22, 60]\n\"clusters.count\" = [1, 2, 4]\n\"icu.initiation_interval\" = [1, 2, 8]";

struct Run {
    outcomes: BTreeMap<u64, Outcome>,
    tally: Tally,
}

fn run(space: &Space, store: &mut Store, limits: Limits, stop_after: u64) -> Run {
    let stop = AtomicBool::new(false);
    let progress = &mut |tally: &Tally| {
        if tally.evaluated >= stop_after {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let mut sweep = Sweep::new(space, Workloads::of(space).unwrap(), store, limits, &stop, progress);
    let all: Vec<u64> = (0..space.n_combinations()).collect();
    let whole = sweep.whole();
    sweep.evaluate(&all, whole).unwrap();
    Run { tally: sweep.tally(), outcomes: sweep.into_outcomes() }
}

fn store(dir: &tempfile::TempDir) -> Store {
    Store::open(&dir.path().join("s.sqlite")).unwrap()
}

#[test]
fn sweep_run_again_finds_everything_in_its_store() {
    let space = space(AXES, "");
    let dir = tempfile::tempdir().unwrap();
    let first = run(&space, &mut store(&dir), Limits::default(), u64::MAX);
    assert_eq!((first.tally.evaluated, first.tally.found), (27, 0));
    let second = run(&space, &mut store(&dir), Limits::default(), u64::MAX);
    assert_eq!((second.tally.evaluated, second.tally.found), (0, 27));
    assert_eq!(first.outcomes, second.outcomes);
    assert_eq!(store(&dir).points().unwrap().len(), 27);
}

#[test]
fn sweep_with_a_wider_axis_evaluates_only_what_is_new() {
    let dir = tempfile::tempdir().unwrap();
    run(&space(AXES, ""), &mut store(&dir), Limits::default(), u64::MAX);
    let wider = space(&AXES.replace("[1, 2, 4]", "[1, 2, 4, 8]"), "");
    let again = run(&wider, &mut store(&dir), Limits::default(), u64::MAX);
    assert_eq!((again.tally.evaluated, again.tally.found), (9, 27));
}

#[test]
fn sweep_that_is_stopped_goes_on_where_it_was() {
    let axes = "\"icu.depth\" = { from = 2, to = 101, step = 1 }\n\"clusters.count\" = [1, 2]";
    let space = space(axes, "");
    let (dir, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let cut = run(&space, &mut store(&dir), Limits::default(), 1);
    let done = cut.tally.evaluated;
    assert!(done > 0 && done < 200, "{done}");
    let rest = run(&space, &mut store(&dir), Limits::default(), u64::MAX);
    assert_eq!(rest.tally.evaluated + rest.tally.found, 200);
    assert!(rest.tally.found >= cut.outcomes.len() as u64);
    let whole = run(&space, &mut store(&other), Limits::default(), u64::MAX);
    assert_eq!(rest.outcomes, whole.outcomes);
}

#[test]
fn sweep_goes_on_past_candidates_that_fail_or_cannot_be_built() {
    // A grid that does not fit 4 KiB fails; a third module with two bundle slots cannot be built.
    let axes = "\"dram.bytes\" = [4096, 16777216]\n\"clusters.modules\" = [1, 3]";
    let space = space(axes, "[set]\ngrid_log2 = \"4\"\n\"clusters.bundle_slots\" = \"2\"\n");
    let dir = tempfile::tempdir().unwrap();
    let mut store = store(&dir);
    let done = run(&space, &mut store, Limits::default(), u64::MAX);
    assert_eq!((done.tally.failed, done.tally.impossible, done.tally.evaluated), (1, 2, 2));
    assert!(matches!(&done.outcomes[&0], Outcome::Failed(e) if e.contains("patch memory")));
    assert!(matches!(&done.outcomes[&1], Outcome::Impossible(e) if e.contains("clusters.bundle_slots = 2")));
    assert!(matches!(&done.outcomes[&2], Outcome::Known { .. }));
    let points = store.points().unwrap();
    assert_eq!(
        points.iter().map(|p| p.status.as_str()).collect::<Vec<_>>(),
        ["failed", "impossible", "simulated", "impossible"]
    );
}

#[test]
fn sweep_that_prunes_has_the_front_of_one_that_does_not() {
    let axes = "\"icu.depth\" = [2, 22, 60]\n\"clusters.count\" = [1, 2, 4]\n\"icu.initiation_interval\" = [1, 30, 100, 300]";
    let space = space(axes, "");
    let (dir, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let pruned = run(&space, &mut store(&dir), Limits { prune: true, ..Limits::default() }, u64::MAX);
    let whole = run(&space, &mut store(&other), Limits::default(), u64::MAX);
    assert!(pruned.tally.pruned == 0, "all fit one batch: nothing is known yet");
    let members = |run: &Run| -> Vec<u64> {
        let known: Vec<(u64, Vec<f64>)> = run
            .outcomes
            .iter()
            .filter_map(|(ordinal, outcome)| match outcome {
                Outcome::Known { metrics, .. } => Some((*ordinal, minimised(&space.objectives, metrics)?)),
                _ => None,
            })
            .collect();
        let points: Vec<Vec<f64>> = known.iter().map(|(_, o)| o.clone()).collect();
        front(&points).into_iter().map(|i| known[i].0).collect()
    };
    assert_eq!(members(&pruned), members(&whole));
}

#[test]
fn sweep_of_several_batches_prunes_what_is_dominated() {
    let axes = "\"icu.depth\" = { from = 4, to = 52, step = 4 }\n\"clusters.count\" = [1, 4]\n\
                \"icu.initiation_interval\" = [1, 4, 100, 200, 300, 400, 500, 600, 700]";
    let space = space(axes, "");
    let (dir, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let pruned = run(&space, &mut store(&dir), Limits { prune: true, ..Limits::default() }, u64::MAX);
    let whole = run(&space, &mut store(&other), Limits::default(), u64::MAX);
    assert!(pruned.tally.pruned > 20, "{:?}", pruned.tally);
    let objectives = |ordinal: u64| match &whole.outcomes[&ordinal] {
        Outcome::Known { metrics, .. } => minimised(&space.objectives, metrics).unwrap(),
        other => panic!("{other:?}"),
    };
    for (ordinal, outcome) in &pruned.outcomes {
        match outcome {
            Outcome::Pruned => {
                let own = objectives(*ordinal);
                assert!(
                    (0..space.n_combinations()).any(|other| dominates(&objectives(other), &own)),
                    "{ordinal}"
                );
            }
            known => assert_eq!(known, &whole.outcomes[ordinal]),
        }
    }
}

#[test]
fn sweep_of_word_lengths_measures_each_once_for_all_timings() {
    let axes = "frac_bits = [8, 20]\n\"icu.depth\" = [4, 22]";
    let sections =
        "[set]\n\"formats.coord_frac_bits\" = \"frac_bits\"\n\"formats.dir_frac_bits\" = \"frac_bits\"\n";
    let mut space = space(axes, sections);
    space.objectives = ["misclassified", "image_rmse"]
        .map(|name| {
            let metric = crate::explore::metric::Metric::named(name).unwrap();
            crate::explore::space::Objective { metric, goal: metric.goal }
        })
        .to_vec();
    let dir = tempfile::tempdir().unwrap();
    let mut store = store(&dir);
    let done = run(&space, &mut store, Limits::default(), u64::MAX);
    let of = |ordinal: u64| match &done.outcomes[&ordinal] {
        Outcome::Known { metrics, .. } => minimised(&space.objectives, metrics).unwrap(),
        other => panic!("{other:?}"),
    };
    assert_eq!(of(0), of(1), "timing does not matter");
    assert_eq!(of(2), of(3));
    assert!(of(0)[0] > 10.0 * of(2)[0] && of(0)[0] < 0.2, "{:?} {:?}", of(0), of(2));
    assert!(of(0)[1] > of(2)[1], "{:?} {:?}", of(0), of(2));
}
