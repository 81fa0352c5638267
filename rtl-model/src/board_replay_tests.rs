//! A record of any board, replayed on any other: every counter is that of the full run.

use super::*;
use crate::record::{RecordKey, RecordedCommand};
use crate::sim::FifoStatistics;

/// `timing` with everything of `spec` that answers depend on. The layout of records is part of the image.
fn other_timing(spec: &BoardSpec, timing: &BoardSpec) -> BoardSpec {
    let mut other = timing.clone();
    other.formats = spec.formats;
    other.partition = spec.partition;
    other.shells =
        ShellSpec { prefetch: timing.shells.prefetch && spec.partition.is_shells(), ..spec.shells };
    other.dispatch.low_resolution_every = spec.dispatch.low_resolution_every;
    other.dispatch.low_resolution_min_bundles = spec.dispatch.low_resolution_min_bundles;
    other.dram.layout = spec.dram.layout;
    other.clusters.bundle_slots = other.clusters.bundle_slots.max(other.clusters.modules);
    other
}

/// Everything that a board counts.
fn counts(board: &Board) -> (BoardStatistics, Vec<FifoStatistics>) {
    (board.statistics(), board.link_statistics())
}

fn assert_replay_equals_full_run(
    spec: &BoardSpec,
    timings: &[BoardSpec],
    seed: u64,
) -> Result<(), TestCaseError> {
    let mut random = Random(seed);
    let n_patches = 1 + random.below(60) as u32;
    let patches = random_patches(&mut random, &spec.formats, n_patches);
    let image = image_of(spec, &patches, 1 + random.below(4) as u32);
    let (n_bundles, most_rays) = [(6, 20), (2, 64)][random.below(2) as usize];
    let bundles = random_bundles(&mut random, &spec.formats, n_bundles, most_rays);
    let rays = rays_of(&spec.formats, &bundles);
    prop_assert!(!rays.is_empty());
    let (by_bundle, by_ray) = (Work::Bundles(&bundles), Work::Rays(&rays));
    let commands = [(false, by_bundle), (true, by_bundle), (false, by_ray), (true, by_ray)];

    let mut recording = Board::new(spec, image.clone()).unwrap();
    let mut live = Board::new(spec, image.clone()).unwrap();
    let mut recorded: Vec<RecordedCommand> = Vec::new();
    for (any_hit, work) in commands {
        recorded.push(if any_hit {
            let (hits, command) = recording.record_any(work).unwrap();
            prop_assert_eq!(hits, live.trace_any(work).unwrap());
            command
        } else {
            let (hits, command) = recording.record_nearest(work).unwrap();
            prop_assert_eq!(hits, live.trace_nearest(work).unwrap());
            command
        });
    }
    prop_assert_eq!(counts(&recording), counts(&live), "recording changes nothing");
    let key = RecordKey::of(spec, &image);
    for timing in timings {
        let timing = other_timing(spec, timing);
        prop_assert_eq!(key.difference(&RecordKey::of(&timing, &image)), None);
        let mut full = Board::new(&timing, image.clone()).unwrap();
        let mut replay = Board::new(&timing, image.clone()).unwrap();
        for ((any_hit, work), command) in commands.iter().zip(&recorded) {
            command.check(&timing, &image).unwrap();
            let replayed = replay.replay_with(command, &mut Silent);
            let replayed = replayed.map_err(|error| TestCaseError::fail(error.to_string()))?;
            if *any_hit {
                prop_assert_eq!(replayed.hit_bits(), full.trace_any(*work).unwrap());
            } else {
                prop_assert_eq!(replayed.nearest_hits(), full.trace_nearest(*work).unwrap());
            }
            prop_assert_eq!(counts(&replay), counts(&full));
        }
        prop_assert!(full.statistics().canonical.tests > 0 || full.statistics().canonical.cells > 0);
        // Another timing makes the same record.
        let mut again = Board::new(&timing, image.clone()).unwrap();
        for ((any_hit, work), command) in commands.iter().zip(&recorded) {
            let other = if *any_hit {
                again.record_any(*work).unwrap().1
            } else {
                again.record_nearest(*work).unwrap().1
            };
            prop_assert_eq!(&other, command);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn replay_on_any_timing_counts_what_the_full_run_counts(
        spec in any_spec(),
        timings in proptest::collection::vec(any_spec(), 3),
        seed: u64,
    ) {
        assert_replay_equals_full_run(&spec, &timings, seed)?;
    }
}

#[test]
#[ignore = "long: 3,000 random boards, each replayed on 8 others"]
fn replay_of_three_thousand_random_boards_on_eight_others_counts_what_the_full_run_counts() {
    let mut runner =
        proptest::test_runner::TestRunner::new(ProptestConfig { cases: 3000, ..Default::default() });
    let timings = proptest::collection::vec(any_spec(), 8);
    runner
        .run(&(any_spec(), timings, any::<u64>()), |(spec, timings, seed)| {
            assert_replay_equals_full_run(&spec, &timings, seed)
        })
        .unwrap();
}

/// A small scene, a record of nearest hits of its bundles.
fn recorded(partition: Partition) -> (BoardSpec, MemoryImage, RecordedCommand) {
    let mut spec = BoardSpec { partition, ..BoardSpec::default() };
    spec.dispatch.low_resolution_min_bundles = 1;
    let (image, bundles) = small_scene(&spec);
    let mut board = Board::new(&spec, image.clone()).unwrap();
    let (_, command) = board.record_nearest(Work::Bundles(&bundles)).unwrap();
    (spec, image, command)
}

#[test]
fn replay_of_a_record_in_another_scene_is_found_out() {
    for partition in [Partition::Grid, Partition::ShellsStatic] {
        let (spec, image, command) = recorded(partition);
        let mut elsewhere = Random(99);
        let patches = random_patches(&mut elsewhere, &spec.formats, 50);
        let other_scene = MemoryImage::build(&spec.formats, &patches, Some(3));
        let error = Board::new(&spec, other_scene).unwrap().replay(&command).unwrap_err();
        assert!(error.to_string().contains("does not fit the board: "), "{error}");
        Board::new(&spec, image).unwrap().replay(&command).unwrap();
    }
}

#[test]
fn record_key_names_what_differs_with_both_values() {
    let (spec, image, _) = recorded(Partition::ShellsStatic);
    let key = RecordKey::of(&spec, &image);
    let differs = |change: &dyn Fn(&mut BoardSpec), image: &MemoryImage| {
        let mut other = spec.clone();
        change(&mut other);
        let difference = key.difference(&RecordKey::of(&other, image));
        difference.map(|d| format!("{}: {} / {}", d.what, d.recorded, d.given))
    };
    assert_eq!(differs(&|_| (), &image), None);
    let timing = |spec: &mut BoardSpec| {
        spec.clusters.count = 1;
        spec.shells.prefetch = true;
        spec.dispatch.rebalance_cycles = 9;
        spec.scheduling = Scheduling::Static;
    };
    assert_eq!(differs(&timing, &image), None);
    type Change<'a> = &'a dyn Fn(&mut BoardSpec);
    let cases: [(Change<'_>, &str); 4] = [
        (&|s| s.formats.t_frac_bits = 20, "number formats: coord 24, dir 24, t 24 bits"),
        (&|s| s.partition = Partition::Grid, "partition: shells+static / grid"),
        (&|s| s.shells.cells = 7, "shells: cells = "),
        (&|s| s.dispatch.low_resolution_every = 3, "low-resolution cast: dispatch.low_resolution_every = "),
    ];
    for (change, expected) in cases {
        let found = differs(change, &image).unwrap();
        assert!(found.starts_with(expected), "{found}");
    }
    let patches = random_patches(&mut Random(7), &spec.formats, 50);
    let finer = MemoryImage::build(&spec.formats, &patches, Some(4));
    assert_eq!(differs(&|_| (), &finer).unwrap(), "grid: 8 x 8 x 8 cells / 16 x 16 x 16 cells");
    let other = MemoryImage::build(&spec.formats, &patches[..49], Some(3));
    assert!(differs(&|_| (), &other).unwrap().starts_with("scene (hash of the memory image): "));
}

/// Bytes of a record, one after the other made wrong.
#[test]
fn record_with_any_byte_of_its_streams_changed_is_refused_or_replayed_without_a_panic() {
    for partition in [Partition::Grid, Partition::Shells] {
        let (spec, image, command) = recorded(partition);
        let n = command.stream_bytes();
        assert!(n > 1000);
        let (mut refused, mut unfit) = (0, 0);
        for step in 0..400 {
            let mut damaged = command.clone();
            damaged.flip(step * (n - 1) / 399, (step * 37 % 255 + 1) as u8);
            if damaged.check(&spec, &image).is_err() {
                refused += 1;
                continue;
            }
            match Board::new(&spec, image.clone()).unwrap().replay(&damaged) {
                Ok(()) => {}
                Err(BoardError::Record(_)) => unfit += 1,
                Err(other) => panic!("{other}"),
            }
        }
        // The others changed a t or a patch, which a replay only passes on.
        assert!(refused > 20 && unfit > 20, "{refused} refused, {unfit} found not to fit");
    }
}
