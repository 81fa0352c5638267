//! Limits against counts by hand, and against the cycles that boards of many shapes took.

use proptest::prelude::*;
use rtl_model::board::{Board, Work};
use rtl_model::datapath::PatchWords;
use rtl_model::datapath::bundle::BundleWords;
use rtl_model::functional::{CanonicalCounters, LowResolutionWork};
use rtl_model::memory_image::MemoryImage;
use rtl_model::sim::BlockAccount;
use rtl_model::spec::{MemoryLevels, Partition, Scheduling};

use super::*;

/// Cycles of work and of starvation.
fn block(name: &str, work: u64, starved: u64) -> BlockAccount {
    BlockAccount { block: name.to_owned(), cycles: [work, 0, 0, 0, 0, 0, starved, 0, 0, 0] }
}

#[test]
fn limits_of_known_counts_are_those_by_hand() {
    let mut spec = BoardSpec { clock_mhz: 20.0, ..BoardSpec::default() };
    (spec.clusters.count, spec.clusters.modules, spec.clusters.ctus_per_icu) = (2, 1, 2);
    (spec.ctu.initiation_interval, spec.icu.initiation_interval) = (3, 2);
    spec.bus.clock_mhz = 10.0;
    (spec.bus.dma_setup_cycles, spec.bus.interrupt_cycles, spec.dispatch.host_cycles_per_command) =
        (5, 10, 85);
    let statistics = BoardStatistics {
        cycles: 1000,
        commands: 2,
        canonical: CanonicalCounters {
            rays: 70,
            tests: 101,
            low_resolution: LowResolutionWork { rays: 3, tests: 10, ..LowResolutionWork::default() },
            ..CanonicalCounters::default()
        },
        bus_down_cycles: 30,
        bus_up_cycles: 50,
        dram_busy_cycles: 400,
        blocks: vec![
            block("cluster0.bundle_generator", 41, 959),
            block("cluster0.module0.shell_tracker", 300, 700),
            block("cluster0.module0.ctu0", 40, 960),
            block("cluster0.module0.ctu1", 41, 959),
            block("cluster0.module0.patch_loader", 250, 750),
            block("cluster0.module0.icu", 150, 850),
            block("cluster1.bundle_generator", 34, 966),
            block("cluster1.module0.shell_tracker", 500, 500),
            block("cluster1.module0.ctu0", 10, 990),
            block("cluster1.module0.ctu1", 10, 990),
            block("cluster1.module0.patch_loader", 150, 850),
            block("cluster1.module0.icu", 72, 928),
        ],
        ..BoardStatistics::default()
    };
    let bounds = Bounds::new(&spec, &statistics);
    let of = |resource| bounds.of(resource).unwrap().cycles;
    // Bus edges come every second cycle: 29 x 2 + 1, 49 x 2 + 1, 79 x 2 + 1.
    assert_eq!([of(Resource::HostBusDown), of(Resource::HostBusUp), of(Resource::HostBus)], [59, 99, 159]);
    assert_eq!([of(Resource::Commands), of(Resource::Host)], [200, 359]);
    assert_eq!(of(Resource::Dram), 400);
    // 101 steps by 4 CTUs, 26 of the fullest: 25 x 3 + 1. As dealt 41: 40 x 3 + 1.
    assert_eq!([of(Resource::Ctus), of(Resource::CtusAsDealt)], [76, 121]);
    // 111 tests by 2 ICUs, 56 of the fuller: 55 x 2 + 1.
    assert_eq!([of(Resource::Icus), of(Resource::IcusAsDealt)], [111, 150]);
    assert_eq!([of(Resource::BundleGenerators), of(Resource::BundleGeneratorsAsDealt)], [37, 41]);
    assert_eq!([of(Resource::PatchLoadersAsDealt), of(Resource::ShellTrackersAsDealt)], [250, 500]);
    let tightest = bounds.tightest().unwrap();
    assert_eq!((tightest.resource, tightest.cycles), (Resource::ShellTrackersAsDealt, 500));
    assert_eq!(tightest.busiest.as_deref(), Some("cluster1.module0.shell_tracker"));
    assert!((tightest.share - 0.5).abs() < 1e-12);
    assert!(bounds.limits.windows(2).all(|w| w[0].cycles >= w[1].cycles));
}

/// Blocks of which ICU and loader have these causes: work, output full, resource, cache miss, memory, bus, starved,
/// idle, fill, drain.
fn waits(icu: [u64; 10], loader: [u64; 10], front: &str, front_cycles: [u64; 10]) -> IcuWaits {
    let account = |block: &str, cycles| BlockAccount { block: block.to_owned(), cycles };
    let statistics = BoardStatistics {
        cycles: 100,
        dram_busy_cycles: 80,
        blocks: vec![
            account(front, front_cycles),
            account("cluster0.module0.patch_loader", loader),
            account("cluster0.module0.icu", icu),
        ],
        ..BoardStatistics::default()
    };
    IcuWaits::new(&statistics, 0.25)
}

#[test]
fn reason_of_starved_icus_is_what_their_loaders_wait_for() {
    let starved = [60, 0, 0, 0, 0, 0, 30, 5, 3, 2];
    let tracker = "cluster0.module0.shell_tracker";
    let w = waits(starved, [20, 30, 5, 25, 0, 0, 20, 0, 0, 0], tracker, [0; 10]);
    assert_eq!(w.reason, "starved; loaders wait for lines from the patch memory (DRAM busy 80.0 %)");
    assert!((w.work - 0.6).abs() < 1e-12);
    let names: Vec<_> = w.waits.iter().map(|w| (w.what.as_str(), (w.share * 100.0).round())).collect();
    let expected = [
        ("starved", 30.0),
        ("no bundle in their clusters", 5.0),
        ("outside the first to the last test of a command", 5.0),
    ];
    assert_eq!(names, expected);
    let shares: Vec<_> = w.loader_waits.iter().map(|w| (w.share * 100.0).round()).collect();
    assert_eq!(shares, [25.0, 20.0, 5.0]);

    let hungry = [20, 30, 5, 15, 0, 0, 30, 0, 0, 0];
    let w = waits(starved, hungry, tracker, [70, 0, 10, 0, 0, 0, 20, 0, 0, 0]);
    assert_eq!(w.reason, "starved; loaders wait for lists from the shell trackers (at work in 70.0 %)");
    let w = waits(starved, hungry, tracker, [10, 0, 60, 0, 0, 0, 30, 0, 0, 0]);
    assert!(w.reason.ends_with("(tables full in 60.0 %)"), "{}", w.reason);
    let w = waits(starved, hungry, "cluster0.module0.ctu0", [10, 0, 20, 0, 0, 0, 70, 0, 0, 0]);
    assert!(w.reason.ends_with("lists from the CTUs (waiting in 70.0 %)"), "{}", w.reason);
    let w = waits(starved, [20, 30, 35, 15, 0, 0, 0, 0, 0, 0], tracker, [0; 10]);
    assert!(w.reason.contains("a free miss register"), "{}", w.reason);
}

#[test]
fn reason_of_icus_that_do_not_starve_is_their_own() {
    let reason = |icu| waits(icu, [100, 0, 0, 0, 0, 0, 0, 0, 0, 0], "cluster0.module0.ctu0", [0; 10]).reason;
    assert_eq!(reason([40, 50, 0, 0, 0, 0, 10, 0, 0, 0]), "no room at the reducers");
    assert_eq!(
        reason([40, 0, 0, 0, 0, 0, 10, 50, 0, 0]),
        "no bundle in their clusters (host bus and commands: 25.0 %)"
    );
    let outside = reason([40, 0, 0, 0, 0, 0, 10, 0, 20, 30]);
    assert!(outside.starts_with("outside the first to the last test of a command (host"), "{outside}");
    assert_eq!(reason([100, 0, 0, 0, 0, 0, 0, 0, 0, 0]), "");
    assert_eq!(
        reason([40, 0, 0, 0, 0, 0, 60, 0, 0, 0]),
        "starved; lists are short, and the loaders work on each"
    );
}

/// A small deterministic generator.
struct Random(u64);

impl Random {
    fn below(&mut self, n: i32) -> i32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n.unsigned_abs() as u64) as i32
    }

    fn point(&mut self, f: u32) -> [i32; 3] {
        [0; 3].map(|_: i32| (self.below(2 << f) - (1 << f)) / 10 * 9)
    }
}

fn triangles(random: &mut Random, f: u32, n: u32) -> Vec<PatchWords> {
    let near = |random: &mut Random, base: [i32; 3]| {
        base.map(|c| (c + random.below(1 << (f - 1))).clamp(-(1 << f), (1 << f) - 1))
    };
    let triangle = |id| {
        let base = random.point(f);
        let [a, b, c] = [0; 3].map(|_: i32| near(random, base));
        PatchWords { corners: [a, b, c, c], is_triangle: true, id }
    };
    (0..n).map(triangle).collect()
}

fn any_board() -> impl Strategy<Value = BoardSpec> {
    let partition = prop::sample::select(vec![Partition::Grid, Partition::Shells, Partition::ShellsStatic]);
    let shape = (1u32..4, 1u32..3, 1u32..4, 0u32..4);
    // Long intervals, so that a limit that is an interval too high cannot hide behind latencies.
    let intervals = (
        prop::sample::select(vec![1u32, 3, 250]),
        1u32..30,
        prop::sample::select(vec![1u32, 2, 39, 400]),
        1u32..20,
    );
    let bus = (
        prop::sample::select(vec![0.7, 10.0, 25.0, 33.3, 2500.0]),
        0u32..6,
        prop::sample::select(vec![0u64, 50]),
        prop::sample::select(vec![0u64, 500]),
        prop::sample::select(vec![0u64, 1000]),
    );
    let memory =
        prop::sample::select(vec![MemoryLevels::None, MemoryLevels::OneLevel, MemoryLevels::Hierarchical]);
    let scheduling =
        prop::sample::select(vec![Scheduling::Static, Scheduling::PseudoDynamic, Scheduling::Ideal]);
    (partition, shape, intervals, bus, (memory, scheduling, 1u32..3)).prop_map(
        |(partition, shape, intervals, bus, (memory, scheduling, depth))| {
            let mut spec = BoardSpec { partition, memory, scheduling, ..BoardSpec::default() };
            let c = &mut spec.clusters;
            // In shells a bundle is one module's.
            (c.count, c.modules, c.ctus_per_icu, c.bundle_slots) =
                (shape.0, shape.1, shape.2, shape.1 + shape.3);
            (spec.ctu.initiation_interval, spec.ctu.depth) = (intervals.0, intervals.1);
            (spec.icu.initiation_interval, spec.icu.depth) = (intervals.2, intervals.3);
            spec.bus.clock_mhz = bus.0;
            spec.bus.arbitration_cycles = bus.1;
            (spec.bus.dma_setup_cycles, spec.bus.interrupt_cycles) = (bus.2, bus.3);
            spec.dispatch.host_cycles_per_command = bus.4;
            spec.dispatch.low_resolution_min_bundles = 1;
            (spec.fifos.ctu_icu, spec.fifos.icu_reducer) = (depth, depth);
            spec
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Whatever the board: no resource needs more cycles than were taken, in a command of one ray or of many, since
    /// the board's making or since a command before.
    #[test]
    fn limits_never_exceed_the_cycles_taken(spec in any_board(), seed: u64, n_bundles in 1usize..8) {
        let mut random = Random(seed);
        let f = spec.formats.coord_frac_bits;
        let image = MemoryImage::for_board(&spec, &triangles(&mut random, f, 40));
        let mut board = Board::new(&spec, image).unwrap();
        let bundles: Vec<_> = (0..n_bundles)
            .map(|_| {
                let apex = random.point(f);
                let n = 1 + random.below(12);
                BundleWords::Targets { apex, points: (0..n).map(|_| random.point(f)).collect() }
            })
            .filter(|b| b.validate(&spec.formats).is_ok())
            .collect();
        let one_ray = [bundles.first().map(|b| b.ray(&spec.formats, 0))].into_iter().flatten().collect::<Vec<_>>();
        let mut before = board.statistics();
        for work in [Work::Bundles(&bundles), Work::Rays(&one_ray), Work::Bundles(&bundles), Work::Rays(&one_ray)] {
            board.trace_nearest(work).unwrap();
            let now = board.statistics();
            for counted in [now.since(&before), now.clone()] {
                prop_assert!(bundles.is_empty() || counted.cycles > 0);
                let bounds = Bounds::new(&spec, &counted);
                prop_assert!(bounds.limits.len() >= 12, "{} limits", bounds.limits.len());
                for limit in &bounds.limits {
                    prop_assert!(
                        limit.cycles <= counted.cycles,
                        "{:?}: {} of {} cycles", limit.resource, limit.cycles, counted.cycles
                    );
                }
                let of = |resource| bounds.of(resource).map_or(0, |l| l.cycles);
                prop_assert!(of(Resource::CtusAsDealt) >= of(Resource::Ctus));
                prop_assert!(of(Resource::BundleGeneratorsAsDealt) >= of(Resource::BundleGenerators));
                // The unit's work of its last test may be counted when the next command runs.
                let late = u64::from(spec.icu_timing().initiation_interval);
                prop_assert!(of(Resource::IcusAsDealt) + late > of(Resource::Icus));
            }
            before = now;
        }
    }
}
