//! The board against `functional`, over random boards; its account; its timing, cycle by cycle.

use proptest::prelude::*;

use super::*;
use crate::datapath::PatchWords;
use crate::datapath::test_support::{formats, widths};
use crate::fixed::Formats;
use crate::fixed::division::DividerForm;
use crate::functional;
use crate::sim::Cause;
use crate::spec::{
    ClusterBufferSpec, ClusterSpec, DispatchSpec, DivisionSpec, DivisionUnit, DramSpec, ListCacheSpec,
    MaskCacheSpec, MemoryLevels, Partition, PatchCacheSpec, PatchLayout, Scheduling, ShellGrowth, ShellSpec,
};

#[path = "board_replay_tests.rs"]
mod replay;

/// A small deterministic generator: 31 random bits a call.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn bits(&mut self) -> i64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33).cast_signed()
    }

    pub(crate) fn below(&mut self, n: i64) -> i64 {
        self.bits() % n
    }

    /// A coordinate word in the middle part of the cube.
    fn coordinate(&mut self, f: u32) -> i32 {
        (self.below(2 << f) - (1 << f)) as i32 / 10 * 9
    }

    fn point(&mut self, f: u32) -> [i32; 3] {
        [self.coordinate(f), self.coordinate(f), self.coordinate(f)]
    }
}

pub(crate) fn random_patches(random: &mut Random, formats: &Formats, n: u32) -> Vec<PatchWords> {
    let f = formats.coord_frac_bits;
    (0..n)
        .map(|id| {
            let base = random.point(f);
            let mut near = || {
                base.map(|c| {
                    (c + (random.below(1 << f) as i32 - (1 << (f - 1))) / 2).clamp(-(1 << f), (1 << f) - 1)
                })
            };
            let corners = [near(), near(), near(), near()];
            let is_triangle = id % 3 == 0;
            PatchWords {
                corners: if is_triangle { [corners[0], corners[1], corners[2], corners[2]] } else { corners },
                is_triangle,
                id,
            }
        })
        .collect()
}

pub(crate) fn random_bundles(
    random: &mut Random,
    formats: &Formats,
    n: usize,
    most_rays: i64,
) -> Vec<BundleWords> {
    (0..n)
        .map(|_| {
            let apex = random.point(formats.coord_frac_bits);
            let n_points = 1 + random.below(most_rays) as usize;
            BundleWords::Targets {
                apex,
                points: (0..n_points).map(|_| random.point(formats.coord_frac_bits)).collect(),
            }
        })
        .filter(|b| b.validate(formats).is_ok())
        .collect()
}

pub(crate) fn rays_of(formats: &Formats, bundles: &[BundleWords]) -> Vec<RayWords> {
    bundles.iter().flat_map(|b| (0..b.n_rays()).map(|i| b.ray(formats, i))).collect()
}

/// Division units that serve every width, and the division within the pipeline.
fn any_division() -> impl Strategy<Value = DivisionSpec> {
    let units = [DivisionUnit::InPipeline, DivisionUnit::NonRestoring, DivisionUnit::Newton];
    let forms = [DividerForm::Serial, DividerForm::Unrolled];
    (0_usize..3, 0_usize..2, 1u32..5, (9u32..13, 2u32..4, 1u32..4)).prop_map(
        move |(unit, form, radix_log2, (table_bits, iterations, multiplier_cycles))| DivisionSpec {
            unit: units[unit],
            radix_log2,
            form: forms[form],
            table_bits,
            iterations,
            multiplier_cycles,
        },
    )
}

/// Partitions, with shells of every make.
fn any_partition() -> impl Strategy<Value = (Partition, ShellSpec, DispatchSpec)> {
    let partitions = [Partition::Grid, Partition::Shells, Partition::ShellsStatic];
    let shells = (1u32..5, any::<bool>(), prop_oneof![1u32..5, Just(64)], any::<bool>());
    let dispatch = (1u32..4, 1u32..5, 1.0..3.0, 0u32..40);
    (0_usize..3, shells, dispatch).prop_map(move |(partition, s, d)| {
        let partition = partitions[partition];
        let growth = if s.1 { ShellGrowth::Double } else { ShellGrowth::Fixed };
        let prefetch = s.3 && partition.is_shells();
        let shells = ShellSpec { cells: s.0, growth, entries: s.2, prefetch };
        let dispatch = DispatchSpec {
            low_resolution_every: d.0,
            low_resolution_min_bundles: d.1,
            rebalance_threshold: d.2,
            rebalance_cycles: d.3,
            ..DispatchSpec::default()
        };
        (partition, shells, dispatch)
    })
}

/// Boards that differ in everything that is timing, of all partitions.
pub(crate) fn any_spec() -> impl Strategy<Value = BoardSpec> {
    let structure = (1u32..5, 1u32..4, 1u32..5, 1u32..4, 1u32..9);
    let timing = (1u32..4, 1u32..7, 1u32..3, 1u32..30);
    let fifos = (1u32..6, 1u32..6, 1u32..41, 1u32..4);
    let memory = (0u32..3, 0u32..5, 0u32..5, 1u32..4, 0u32..3, 1u32..5);
    let bus = (0u32..4, 0u32..3, 0u32..6, 0u32..4);
    let dram = (3u32..10, 1u32..6, 1u32..20, 0u32..9, 0u32..9);
    let others = (widths(), any_division(), any_partition(), any::<bool>(), 0u32..5);
    (structure, timing, fifos, memory, bus, dram, others).prop_map(|(s, t, f, m, b, d, others)| {
        let (w, division, (partition, shells, dispatch), by_cell, mask_log2) = others;
        let scheduling = [Scheduling::Static, Scheduling::PseudoDynamic, Scheduling::Ideal][m.4 as usize];
        let mut spec = BoardSpec { partition, shells, dispatch, scheduling, ..BoardSpec::default() };
        spec.clusters.count = s.0;
        spec.clusters.modules = s.1;
        spec.clusters.ctus_per_icu = s.2;
        spec.clusters.bundle_slots = if partition.is_shells() { s.3.max(s.1) } else { s.3 };
        spec.ctu.contexts = s.4;
        spec.ctu.initiation_interval = t.0;
        spec.ctu.depth = t.1;
        spec.icu.initiation_interval = t.2;
        spec.icu.depth = t.3;
        spec.division = division;
        spec.fifos.ctu_icu = f.0;
        spec.fifos.icu_reducer = f.1;
        spec.fifos.results = f.2;
        spec.fifos.commands = f.3;
        spec.memory = [MemoryLevels::None, MemoryLevels::OneLevel, MemoryLevels::Hierarchical][m.0 as usize];
        let bytes = |log: u32| if log == 0 { 0 } else { 64 << log };
        spec.patch_cache = PatchCacheSpec { bytes: bytes(m.1), ways: 2, miss_registers: m.3 };
        spec.list_cache = ListCacheSpec { bytes: bytes(m.2), ways: 1, miss_registers: m.3 };
        spec.mask_cache = MaskCacheSpec { bytes: bytes(mask_log2), ways: 1, miss_registers: m.3 };
        spec.cluster_buffer =
            ClusterBufferSpec { bytes: bytes(m.1 + 1), ways: 2, cycles: m.5, miss_registers: m.3 };
        spec.loader.slots = m.5;
        spec.loader.stations = 1 + d.3 % 4;
        spec.bus.clock_mhz = [10.0, 25.0, 66.0, 2000.0][b.0 as usize];
        spec.bus.width_bits = [8, 32, 128][b.1 as usize];
        spec.bus.arbitration_cycles = b.2;
        spec.bus.burst_bytes = [16, 32, 64, 256][b.3 as usize];
        spec.dram.width_bits = 1 << d.0;
        spec.dram.banks = d.1;
        spec.dram.row_bytes = 64 * d.2;
        spec.dram.row_hit_cycles = d.3;
        spec.dram.row_miss_cycles = d.4;
        spec.dram.layout = if by_cell { PatchLayout::ByCell } else { PatchLayout::ById };
        spec.formats = formats(w.0, w.1, w.2);
        spec
    })
}

/// The image that a board of `spec` holds, with a grid of its own.
pub(crate) fn image_of(spec: &BoardSpec, patches: &[PatchWords], grid: u32) -> MemoryImage {
    MemoryImage::build_laid_out(&spec.formats, patches, Some(grid), u64::MAX, spec.dram.layout)
}

fn assert_board_equals_functional(spec: &BoardSpec, seed: u64) -> Result<(), TestCaseError> {
    let mut random = Random(seed);
    let n_patches = 1 + random.below(60) as u32;
    let patches = random_patches(&mut random, &spec.formats, n_patches);
    let image = image_of(spec, &patches, 1 + random.below(4) as u32);
    let (n_bundles, most_rays) = [(6, 20), (2, 64)][random.below(2) as usize];
    let bundles = random_bundles(&mut random, &spec.formats, n_bundles, most_rays);
    let rays = rays_of(&spec.formats, &bundles);
    prop_assert!(!rays.is_empty());
    let mut board = Board::new(spec, image.clone()).unwrap();
    for (any_hit, work) in [
        (false, Work::Bundles(&bundles)),
        (true, Work::Bundles(&bundles)),
        (false, Work::Rays(&rays)),
        (true, Work::Rays(&rays)),
    ] {
        let before = board.statistics();
        let (expected_hits, expected) = functional::trace_command(spec, &image, work, any_hit);
        if any_hit {
            let hits = board.trace_any(work).unwrap();
            prop_assert_eq!(hits, expected_hits.iter().map(Option::is_some).collect::<Vec<_>>());
        } else {
            let hits = board.trace_nearest(work).unwrap();
            prop_assert_eq!(&hits, &expected_hits);
            // Every partition answers as each ray by itself.
            let alone: Vec<_> = rays.iter().map(|ray| functional::trace(&image, ray, false).hit).collect();
            prop_assert_eq!(&hits, &alone);
        }
        prop_assert!(board.is_quiet());
        let counted = board.statistics().since(&before);
        prop_assert_eq!(counted.canonical, expected);
        let level = |name: &str| counted.memory.iter().find(|l| l.level == name);
        let (patch, list) = (level("patch_cache").unwrap(), level("list_cache").unwrap());
        let mask = level("mask_cache").cloned().unwrap_or_default();
        prop_assert_eq!(level("mask_cache").is_some(), spec.partition.is_shells());
        let dram = level("dram").unwrap();
        prop_assert!(before.cycles > 0 || dram.bytes > 0 || counted.canonical.tests == 0, "cold caches");
        prop_assert_eq!(dram.written_bytes, mask.written_bytes);
        prop_assert_eq!(level("cluster_buffer").is_some(), spec.memory == MemoryLevels::Hierarchical);
        if let Some(buffer) = level("cluster_buffer") {
            prop_assert_eq!(buffer.bytes, dram.bytes);
            prop_assert_eq!(buffer.accesses * 64, patch.bytes + list.bytes + mask.bytes);
        }
        prop_assert!(counted.cycles > 0 && !counted.blocks.is_empty());
        prop_assert_eq!(counted.commands, 1);
        for block in &counted.blocks {
            prop_assert_eq!(block.total(), counted.cycles, "account of {} is not closed", &block.block);
        }
    }
    let mut awake = Board::new(spec, image).unwrap();
    awake.never_sleep();
    awake.trace_nearest(Work::Bundles(&bundles)).unwrap();
    awake.trace_any(Work::Bundles(&bundles)).unwrap();
    awake.trace_nearest(Work::Rays(&rays)).unwrap();
    awake.trace_any(Work::Rays(&rays)).unwrap();
    prop_assert_eq!(awake.statistics(), board.statistics(), "skipping quiet clusters changes nothing");
    prop_assert_eq!(awake.link_statistics(), board.link_statistics());
    let after = 4 * (spec.bus.interrupt_cycles + spec.dispatch.host_cycles_per_command);
    let ticks = board.statistics().cycles - after;
    for link in board.link_statistics() {
        prop_assert_eq!(link.total_cycles(), ticks, "{}", &link.link);
        if link.bin_tokens == 1 {
            let occupancy: u64 = (0..).zip(&link.cycles_by_occupancy).map(|(n, cycles)| n * cycles).sum();
            prop_assert_eq!(occupancy, link.sojourn_cycles, "Little's law on {}", &link.link);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// Answers and canonical counters are those of `functional` for every timing choice; every account closes.
    #[test]
    fn board_of_any_timing_equals_functional_and_closes_its_account(spec in any_spec(), seed: u64) {
        assert_board_equals_functional(&spec, seed)?;
    }
}

#[test]
#[ignore = "long: 10,000 random boards"]
fn board_of_ten_thousand_random_timings_equals_functional() {
    let mut runner =
        proptest::test_runner::TestRunner::new(ProptestConfig { cases: 10_000, ..Default::default() });
    runner
        .run(&(any_spec(), any::<u64>()), |(spec, seed)| assert_board_equals_functional(&spec, seed))
        .unwrap();
}

/// The largest board that its ranges allow, at the shortest latencies, with the widest result records.
#[test]
fn board_at_the_limits_of_its_specification_equals_functional() {
    let mut spec = BoardSpec { formats: formats(28, 28, 32), ..BoardSpec::default() };
    spec.clusters = ClusterSpec { count: 16, modules: 4, ctus_per_icu: 16, bundle_slots: 16 };
    spec.ctu.contexts = 64;
    spec.loader.slots = 32;
    spec.loader.stations = 32;
    spec.patch_cache.miss_registers = 16;
    spec.list_cache.miss_registers = 16;
    spec.cluster_buffer = ClusterBufferSpec { bytes: 0, ways: 16, cycles: 1, miss_registers: 64 };
    spec.dram = DramSpec { width_bits: 512, row_hit_cycles: 0, row_miss_cycles: 0, ..spec.dram };
    spec.bus.clock_mhz = 1000.0 * spec.clock_mhz;
    spec.bus.arbitration_cycles = 0;
    for partition in [Partition::Grid, Partition::ShellsStatic] {
        spec.partition = partition;
        for seed in 0..2 {
            assert_board_equals_functional(&spec, seed).unwrap();
        }
    }
}

fn small_scene(spec: &BoardSpec) -> (MemoryImage, Vec<BundleWords>) {
    let mut random = Random(7);
    let patches = random_patches(&mut random, &spec.formats, 50);
    (MemoryImage::build(&spec.formats, &patches, Some(3)), random_bundles(&mut random, &spec.formats, 30, 20))
}

#[test]
fn board_with_blocks_ticked_in_any_order_counts_the_same() {
    for partition in [Partition::Grid, Partition::ShellsStatic] {
        let mut spec = BoardSpec { partition, ..BoardSpec::default() };
        spec.clusters.modules = 2;
        spec.dispatch.low_resolution_min_bundles = 1;
        spec.shells.entries = 4;
        spec.shells.prefetch = partition.is_shells();
        spec.mask_cache.bytes = 256;
        assert_any_tick_order_counts_the_same(&spec);
    }
}

fn assert_any_tick_order_counts_the_same(spec: &BoardSpec) {
    let (image, bundles) = small_scene(spec);
    let mut statistics = Vec::new();
    for seed in 0..8 {
        let mut board = Board::new(spec, image.clone()).unwrap();
        if seed > 0 {
            board.permute_ticks(seed * 1000);
        }
        board.trace_nearest(Work::Bundles(&bundles)).unwrap();
        board.trace_any(Work::Bundles(&bundles)).unwrap();
        statistics.push(board.statistics());
    }
    assert!(statistics[0].cycles > 500);
    for other in &statistics[1..] {
        assert_eq!(other, &statistics[0]);
    }
}

#[test]
fn board_command_without_rays_takes_no_cycle() {
    let spec = BoardSpec::default();
    let (image, _) = small_scene(&spec);
    let mut board = Board::new(&spec, image).unwrap();
    assert!(board.trace_nearest(Work::Rays(&[])).unwrap().is_empty());
    assert!(board.trace_any(Work::Bundles(&[])).unwrap().is_empty());
    assert_eq!(board.statistics().cycles, 0);
}

#[test]
fn board_refuses_a_scene_larger_than_its_memory_with_both_sizes() {
    let mut spec = BoardSpec::default();
    let (image, _) = small_scene(&spec);
    spec.dram.bytes = 4096;
    let message = Board::new(&spec, image.clone()).unwrap_err().to_string();
    let needed = image.size_bytes() as u64 + spec.mask_bytes(image.n_patches);
    assert_eq!(needed - image.size_bytes() as u64, 16 * 13 * 64, "four slots in four clusters, 50 patches");
    assert!(message.contains("4096") && message.contains(&needed.to_string()), "{message}");
}

#[test]
fn board_refuses_an_image_of_other_formats() {
    let spec = BoardSpec::default();
    let (image, _) = small_scene(&spec);
    let mut other = spec.clone();
    other.formats.dir_frac_bits = 20;
    assert!(matches!(Board::new(&other, image), Err(BoardError::Formats)));
}

#[test]
fn board_refuses_a_ray_outside_its_words_with_index_value_and_limit() {
    let spec = BoardSpec::default();
    let (image, _) = small_scene(&spec);
    let mut board = Board::new(&spec, image).unwrap();
    let one = 1 << 24; // F = D = T = 24
    let good = RayWords { origin: [-one, 0, one - 1], dir: [one - 1, 1 - one, 0], t_max: 4 << 24 };
    let cases = [
        (RayWords { origin: [0, one, 0], ..good }, "ray 1: origin = 16777216; -16777216 to 16777215"),
        (RayWords { origin: [0, 0, -one - 1], ..good }, "ray 1: origin = -16777217; -16777216 to 16777215"),
        (RayWords { dir: [-one, 1, 1], ..good }, "ray 1: dir = -16777216; -16777215 to 16777215"),
        (RayWords { dir: [0; 3], ..good }, "ray 1: dir = [0, 0, 0]"),
        (RayWords { t_max: (4 << 24) + 1, ..good }, "ray 1: t_max = 67108865; 0 to 67108864"),
        (RayWords { t_max: u64::MAX, ..good }, "ray 1: t_max = 18446744073709551615; 0 to 67108864"),
    ];
    for (bad, expected) in cases {
        let message = board.trace_nearest(Work::Rays(&[good, bad])).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    assert_eq!(board.statistics().cycles, 0, "a refused command takes no cycle");
    assert_eq!(board.trace_nearest(Work::Rays(&[good])).unwrap().len(), 1);
}

#[test]
fn board_after_a_watchdog_has_named_every_block_and_takes_no_more_commands() {
    let spec = BoardSpec::default();
    let (image, bundles) = small_scene(&spec);
    let mut board = Board::new(&spec, image).unwrap();
    board.spec.watchdog_cycles = 10; // less than the DMA's set-up, as no valid specification has it
    let message = board.trace_nearest(Work::Bundles(&bundles)).unwrap_err().to_string();
    assert!(message.starts_with("no progress for 11 cycles"), "{message}");
    assert!(message.contains("host_link bus"), "{message}");
    let blocks = board.statistics().blocks;
    assert_eq!(blocks.len(), 3 + 4 * 11);
    for block in blocks {
        assert!(message.contains(&format!("{} ", block.block)), "{} is not in {message}", block.block);
    }
    let cycles = board.statistics().cycles;
    assert_eq!(board.trace_any(Work::Bundles(&bundles)).unwrap_err().to_string(), message);
    assert_eq!(board.statistics().cycles, cycles);
}

/// One ray, one patch that fills a cell of a 2 x 2 x 2 grid, minimal board: the cycles that rtl-model/README.md lists.
#[test]
fn minimal_board_with_one_ray_and_one_patch_takes_the_cycles_counted_by_hand() {
    let spec = BoardSpec::preset("minimal").unwrap();
    let h = 1 << (spec.formats.coord_frac_bits - 1); // 0.5
    let q = h / 2;
    // A quad in the plane z = 0.5 inside cell (1, 1, 1), facing -z.
    let corners = [[q, q, h], [q, h, h], [h, h, h], [h, q, h]];
    let image =
        MemoryImage::build(&spec.formats, &[PatchWords { corners, is_triangle: false, id: 0 }], Some(1));
    let mut board = Board::new(&spec, image).unwrap();
    let origin = [q + q / 2, q + q / 2, q];
    let ray = RayWords { origin, dir: [0, 0, h], t_max: spec.formats.t_limit() };
    let hits = board.trace_nearest(Work::Rays(&[ray])).unwrap();
    assert_eq!(hits[0].map(|hit| (hit.patch, hit.t)), Some((0, 1 << (spec.formats.t_frac_bits - 1))));
    let statistics = board.statistics();
    let canonical = CanonicalCounters {
        rays: 1,
        cells: 1,
        list_entries: 1,
        tests: 1,
        hits: 1,
        ..CanonicalCounters::default()
    };
    assert_eq!(statistics.canonical, canonical);
    let statistics = board.statistics();
    let by_hand: u64 = WORKED_EXAMPLE.iter().map(|(_, cycles)| cycles).sum();
    assert_eq!(statistics.cycles, by_hand);
    let (rows, total) = readme_worked_example();
    assert_eq!(rows, WORKED_EXAMPLE.map(|(_, cycles)| cycles), "the README's table");
    assert_eq!(total, Some(by_hand), "the README's sum");
    for (block, work) in
        [("host_link", 8), ("dram", 48), ("icu", 1), ("reducer", 1), ("ctu0", 2), ("generator", 2)]
    {
        let account = statistics.blocks.iter().find(|b| b.block.ends_with(block)).unwrap();
        assert_eq!(account.of(Cause::Work), work, "{block}");
    }
    assert_eq!((statistics.bus_down_bytes, statistics.bus_up_bytes), (24, 8));
}

/// The first column of the README's table: its rows, and the sum in bold.
fn readme_worked_example() -> (Vec<u64>, Option<u64>) {
    let readme = include_str!("../README.md");
    let (_, table) = readme.split_once("|---:|---|---|").unwrap();
    let first = |row: &'static str| row.strip_prefix('|').and_then(|r| r.split('|').next()).map(str::trim);
    let column: Vec<_> = table.lines().skip(1).map_while(first).collect();
    let total = column.iter().find_map(|c| c.strip_prefix("**")?.strip_suffix("**")?.parse().ok());
    (column.iter().filter_map(|c| c.parse().ok()).collect(), total)
}

/// Every cycle of the worked example, as rtl-model/README.md lists them.
const WORKED_EXAMPLE: [(&str, u64); 22] = [
    ("DMA set-up", 50),
    ("bus arbitration for the ray", 4),
    ("24 bytes of ray, 4 a cycle", 6),
    ("bundle generator takes the job", 1),
    ("bundle generator sends the ray", 1),
    ("CTU takes the ray", 1),
    ("CTU: enter the first cell", 4),
    ("CTU sends the cell request", 1),
    ("patch loader takes it", 1),
    ("header: list cache misses, cluster buffer passes on", 2),
    ("header: DRAM row miss and 16 words, cluster buffer passes back", 6 + 16 + 1),
    ("list: list cache misses, cluster buffer passes on", 2),
    ("list: DRAM and back", 6 + 16 + 1),
    ("patch loader: one list entry past the mailbox", 1),
    ("record: patch cache misses, cluster buffer passes on", 2),
    ("record: DRAM and back", 6 + 16 + 1),
    ("patch loader sends the test", 1),
    ("ICU", 22 + 1),
    ("reducer", 1),
    ("CTU: nothing nearer can come, sends the result", 4 + 1),
    ("result merge takes it, sends it on; bus arbitration; 8 bytes", 2 + 4 + 2),
    ("interrupt", 500),
];

/// The presets' cycles for three commands on one scene: timing changes of a preset are to be seen, not to slip.
#[test]
fn presets_on_the_small_scene_take_their_cycles() {
    for (name, cycles) in [("delft-1992", 17_993), ("minimal", 353_171)] {
        let spec = BoardSpec::preset(name).unwrap();
        let (image, bundles) = small_scene(&spec);
        let mut board = Board::new(&spec, image).unwrap();
        board.trace_nearest(Work::Bundles(&bundles)).unwrap();
        board.trace_any(Work::Bundles(&bundles)).unwrap();
        board.trace_nearest(Work::Rays(&rays_of(&spec.formats, &bundles))).unwrap();
        assert_eq!(board.statistics().cycles, cycles, "{name}");
    }
}
