//! Quick runs: formulas, identities and bounds, and that boards of an experiment answer alike.

use super::amdahl::Times;
use super::*;

#[test]
fn experiments_have_names_of_their_own() {
    let mut names: Vec<&str> = EXPERIMENTS.iter().map(|e| e.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), EXPERIMENTS.len());
}

#[test]
fn icu_with_the_timing_of_the_published_chip_has_its_rate() {
    let points = subdivision::points(Extent::Quick).unwrap();
    for (unit, us) in subdivision::PUBLISHED_US {
        let own = || points.iter().filter(|p| p.unit == unit);
        assert!(own().count() > 1);
        let best = own().map(|p| p.tests_per_second()).fold(0.0, f64::max);
        // Set-up, the last rays and the interrupt keep it under the limit.
        assert!((0.99e6 / us..=1e6 / us).contains(&best), "{unit:?}: {best} tests/s");
        assert!(own().all(|p| p.cycles_per_test() == 25.0 * us), "{unit:?}");
    }
}

#[test]
fn queue_with_bernoulli_arrivals_waits_as_the_formula_says_within_four_sigma() {
    for (rho, service) in [(0.3, 2), (0.7, 2), (0.5, 4), (0.8, 8), (0.6, 22)] {
        let w = queueing::wait(rho, service, 1_000_000);
        assert!(w.customers > 10_000 && w.error > 0.0 && w.error < 0.1 * w.formula);
        let sigma = (w.mean - w.formula) / w.error;
        assert!(sigma.abs() < 4.0, "rho {rho}, D {service}: {} not {} ({sigma} sigma)", w.mean, w.formula);
    }
}

#[test]
fn queue_with_a_service_of_one_cycle_never_waits() {
    let w = queueing::wait(0.95, 1, 200_000);
    assert_eq!((w.longest, w.mean, w.formula), (0, 0.0, 0.0));
    assert!(w.customers > 180_000);
}

#[test]
fn tandem_passes_what_its_slowest_stage_passes_wherever_it_stands() {
    for services in [[5, 1, 2], [1, 5, 2], [1, 2, 5]] {
        for depth in [1, 2, 16] {
            let rate = queueing::tandem(&services, depth, 20_000);
            assert!((rate - 0.2).abs() < 0.001, "{services:?}, depth {depth}: {rate}");
        }
    }
    assert_eq!(queueing::tandem(&[1, 1], 2, 4000), 1.0);
    assert_eq!(queueing::tandem(&[1, 1], 1, 4000), 0.5);
}

#[test]
fn every_fifo_of_a_board_obeys_littles_identity() {
    let links = queueing::board_links(Extent::Quick).unwrap();
    let busy = links.iter().filter(|l| l.tokens > 0).count();
    assert!(busy > 30, "{busy} of {} FIFOs were used", links.len());
    for link in &links {
        assert_eq!(link.bin_tokens, 1, "{}", link.link);
        assert_eq!(link.sojourn_cycles, queueing::occupancy(link), "{}", link.link);
    }
}

#[test]
fn speed_up_never_exceeds_amdahls_bound_and_reaches_it_with_a_slow_host() {
    let (times, n_rays) = amdahl::times(Extent::Quick).unwrap();
    assert!(n_rays > 1000);
    assert!(times.share() > 0.05 && times.share() < 1.0, "{times:?}");
    for slowdown in [1.0, 10.0, 1e3, 1e6] {
        assert!(times.speed_up(slowdown) <= times.bound(), "{times:?}");
    }
    assert!(times.speed_up(1e9) > 0.999 * times.bound());
    // By hand: half of 2 s is ray casting, which the board does in 1 s.
    let even = Times { host: 2.0, cast: 1.0, board: 1.0 };
    assert_eq!((even.speed_up(1.0), even.bound()), (1.0, 2.0));
    assert_eq!(even.speed_up(10.0), 20.0 / 11.0);
}

#[test]
fn shells_and_grid_in_two_dimensions_answer_alike_and_without_cache_move_more() {
    for point in shells_2d::points(Extent::Quick).unwrap() {
        let hits: Vec<u64> = point.runs.iter().map(|r| r.statistics.canonical.hits).collect();
        assert!(hits[0] > 0 && hits.iter().all(|h| *h == hits[0]), "{hits:?}");
        let lines: Vec<f64> = point.runs.iter().map(|r| r.lines_per_ray("patch_cache")).collect();
        assert!(lines.iter().all(|l| *l > 0.0));
        assert!(lines[2] >= lines[0] && lines[3] >= lines[1], "{} segments: {lines:?}", point.n_segments);
    }
}

#[test]
fn boards_of_balance_and_hierarchy_do_the_same_work() {
    for runs in balance::cases(Extent::Quick).unwrap().into_iter().map(|c| c.runs) {
        let tests: Vec<u64> = runs.iter().map(|r| r.statistics.canonical.tests).collect();
        assert!(tests[0] > 0 && tests.iter().all(|t| *t == tests[0]), "{tests:?}");
        assert!(runs.iter().all(|r| r.imbalance() >= 1.0 && r.answers == runs[0].answers));
        let cast = |r: &load::Run| (r.statistics.canonical.low_resolution.rays, r.cast_cycles);
        assert_eq!(cast(&runs[0]), (0, 0));
        assert!(cast(&runs[1]).0 > cast(&runs[2]).0 && cast(&runs[2]).0 > cast(&runs[3]).0);
        assert!(runs[1..4].iter().all(|r| r.cast_cycles > 0 && r.cast_cycles < r.statistics.cycles));
    }
    for runs in hierarchy::cases(Extent::Quick).unwrap().into_iter().map(|c| c.runs) {
        assert_eq!(runs.len(), 6);
        assert!(runs.iter().all(|r| r.answers == runs[0].answers));
        assert!(runs.iter().all(|r| r.statistics.canonical == runs[0].statistics.canonical));
    }
}

#[test]
fn answers_that_differ_are_an_error() {
    let stage = load::Stage::cornell_box(100).unwrap();
    let (a, b) = (stage.primary(16, 16).unwrap(), stage.primary(16, 8).unwrap());
    let spec = board(|_| {});
    let runs = [a.run(&spec).unwrap(), a.run(&spec).unwrap(), b.run(&spec).unwrap()];
    assert!(load::same_answers(&runs[..2]).is_ok());
    assert!(matches!(load::same_answers(&runs), Err(ExperimentError::Answers { point: 2 })));
}

#[test]
fn descriptors_send_less_down_and_the_same_up() {
    for case in descriptors::cases(Extent::Quick).unwrap() {
        for (bundled, single) in case.descriptors.iter().zip(&case.explicit) {
            let ([down, up], [down_each, up_each]) =
                (descriptors::bytes(bundled), descriptors::bytes(single));
            // 24 bytes a ray; a descriptor of 64 rays under 1.
            assert!(down < 1.0 && down_each >= 24.0, "{down} and {down_each}");
            assert_eq!(up, up_each);
        }
    }
}

#[test]
fn document_names_every_experiment_with_its_plot_table_and_checks() {
    let findings = queueing::run(Extent::Quick).unwrap();
    assert!(findings.checks.iter().all(|c| c.holds), "{:?}", findings.checks);
    let all = [(EXPERIMENTS[1], findings.clone())];
    let text = document(&all, Extent::Quick, "board");
    for part in [
        "## queueing",
        "(board/queueing.svg)",
        "| Geo/D/1".trim_start_matches("| "),
        "**What it says.**",
        "- holds: ",
    ] {
        assert!(text.contains(part), "{part} is missing in\n{text}");
    }
    assert_eq!(text, document(&all, Extent::Quick, "board"));
    let again = queueing::run(Extent::Quick).unwrap();
    assert_eq!(terminal_text(&EXPERIMENTS[1], &findings), terminal_text(&EXPERIMENTS[1], &again));
}
