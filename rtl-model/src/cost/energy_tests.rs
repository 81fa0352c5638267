use super::*;
use crate::cost::Technology;
use crate::functional::{CanonicalCounters, LowResolutionWork};
use crate::sim::BlockAccount;
use crate::statistics::LevelStatistics;

fn cost() -> Cost {
    Cost::of(&BoardSpec::default(), Technology::named("osu-0.35um").unwrap())
}

fn account(name: &str, work: u64) -> BlockAccount {
    BlockAccount { block: name.to_owned(), cycles: [work, 0, 0, 0, 0, 0, 0, 0, 0, 0] }
}

fn level(name: &str, accesses: u64) -> LevelStatistics {
    LevelStatistics { level: name.to_owned(), accesses, ..LevelStatistics::default() }
}

#[test]
fn energy_of_known_counts_is_that_of_the_count_by_hand() {
    let cost = cost();
    let spec = BoardSpec { clock_mhz: 10.0, ..BoardSpec::default() };
    let low_resolution = LowResolutionWork { tests: 2, ..LowResolutionWork::default() };
    let counted = BoardStatistics {
        cycles: 1000,
        canonical: CanonicalCounters { tests: 5, low_resolution, ..CanonicalCounters::default() },
        memory: vec![level("patch_cache", 11), level("cluster_buffer", 13)],
        blocks: vec![
            account("cluster0.module0.ctu0", 3),
            account("cluster0.module0.ctu1", 4),
            account("cluster1.bundle_generator", 6),
        ],
        ..BoardStatistics::default()
    };
    let pj = |name: &str| cost.blocks.iter().find(|b| b.block == name).unwrap().event_pj;
    let events = 7.0 * pj("icu")
        + 7.0 * pj("ctu")
        + 6.0 * pj("bundle_generator")
        + 11.0 * pj("patch_cache")
        + 13.0 * pj("cluster_buffer")
        + 13.0 * pj("links");
    // 1000 cycles at 10 MHz are 100 us.
    let expected = (events + 1000.0 * cost.clock_pj) * 1e-12 + cost.leakage_w * 100e-6;
    let energy = cost.energy_j(&spec, &counted);
    assert!((energy / expected - 1.0).abs() < 1e-12, "{energy} J, {expected} by hand");
}

#[test]
fn energy_grows_with_every_count_and_is_0_for_nothing() {
    let (cost, spec) = (cost(), BoardSpec::default());
    let energy = |counted: &BoardStatistics| cost.energy_j(&spec, counted);
    assert_eq!(energy(&BoardStatistics::default()), 0.0);
    let cycles = BoardStatistics { cycles: 10, ..BoardStatistics::default() };
    let tests = CanonicalCounters { tests: 1, ..CanonicalCounters::default() };
    let more = BoardStatistics { canonical: tests, ..cycles.clone() };
    let most = BoardStatistics { memory: vec![level("mask_cache", 1)], ..more.clone() };
    assert!(0.0 < energy(&cycles) && energy(&cycles) < energy(&more) && energy(&more) < energy(&most));
    // A slower clock: the same switching, longer leakage.
    let slow = BoardSpec { clock_mhz: 1.0, ..BoardSpec::default() };
    assert!(cost.energy_j(&slow, &cycles) > energy(&cycles));
}
