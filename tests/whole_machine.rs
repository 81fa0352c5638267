//! A scene file through the whole machine: one picture, one count of work, whatever the board's timing.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use proptest::prelude::*;
use radiosity_engine::direct::DirectOptions;
use radiosity_engine::frame::{CasterChoice, Frame, FrameOptions, PassOne, render_frame};
use radiosity_engine::image::difference;
use radiosity_engine::radiosity::{SolveOptions, solve};
use radiosity_engine::raycast::functional::FunctionalCaster;
use radiosity_engine::render::{RenderOptions, render};
use rtl_model::functional::CanonicalCounters;
use rtl_model::spec::{BoardSpec, MemoryLevels, Partition, PatchLayout, Scheduling};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml")
}

fn picture() -> RenderOptions {
    RenderOptions { width: 20, height: 16, direct: DirectOptions::full(2), ..RenderOptions::default() }
}

/// A small picture of a coarse mesh, both passes.
fn small_frame(name: &str, caster: CasterChoice) -> Frame {
    let solve = SolveOptions { unshot_share: 0.1, ..SolveOptions::default() };
    let options = FrameOptions { elements: Some(60), adaptive: None, caster, pass_1: PassOne::Solve(solve) };
    render_frame(&scene(name), &options, &picture(), &mut |_| {}).unwrap()
}

fn on_board(name: &str, spec: BoardSpec) -> (Frame, CanonicalCounters) {
    let frame = small_frame(name, CasterChoice::Board(Box::new(spec)));
    let by_purpose = frame.board.as_ref().expect("the board was the caster");
    assert!(by_purpose.len() >= 3, "camera, form-factor and shadow rays");
    let mut canonical = CanonicalCounters::default();
    for (purpose, counted) in by_purpose {
        assert!(counted.cycles > 0 && !counted.blocks.is_empty(), "{purpose:?}");
        for block in &counted.blocks {
            assert_eq!(block.total(), counted.cycles, "{purpose:?}: account of {}", block.block);
        }
        canonical = canonical.combine(&counted.canonical, |a, b| a + b);
    }
    (frame, canonical)
}

const PARTITIONS: [Partition; 3] = [Partition::Grid, Partition::Shells, Partition::ShellsStatic];

/// `spec` in a partition, with a low-resolution cast before every command of this small frame that has a few bundles.
fn in_partition(spec: BoardSpec, partition: Partition) -> BoardSpec {
    let mut spec = BoardSpec { partition, ..spec };
    spec.dispatch.low_resolution_every = 2;
    spec.dispatch.low_resolution_min_bundles = 4;
    spec
}

/// The smallest board's frame in a partition, which all others are held against.
fn reference(partition: usize) -> &'static (Frame, CanonicalCounters) {
    static REFERENCES: [OnceLock<(Frame, CanonicalCounters)>; 3] = [const { OnceLock::new() }; 3];
    REFERENCES[partition].get_or_init(|| {
        let minimal = BoardSpec::preset("minimal").unwrap();
        on_board("cornell-box", in_partition(minimal, PARTITIONS[partition]))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// Clusters, queues, caches, contexts, memory and its layout, pipelines, prefetch, bus and scheduling change cycles,
    /// and nothing else.
    #[test]
    fn picture_and_canonical_counters_are_the_same_for_every_timing(
        partition in 0usize..3,
        shape in (prop::sample::select(vec![1u32, 2, 4]), 1u32..3, 1u32..5),
        spare_slots in 0u32..5,
        contexts in 1u32..20,
        depths in (1u32..5, 1u32..5, 1u32..5, 1u32..3),
        cache_log2 in (0u32..7, 0u32..7, 0u32..7),
        levels in 0usize..3,
        pipes in (1u32..4, 1u32..30, 1u32..3, 1u32..6, 1u32..9),
        bus_mhz in prop::sample::select(vec![10.0, 25.0, 200.0]),
        scheduling in 0usize..3,
        rebalance in (1.0f64..2.0, 0u32..600),
        (by_cell, prefetch) in any::<(bool, bool)>(),
    ) {
        let (reference, reference_work) = reference(partition);
        let mut spec = in_partition(BoardSpec::default(), PARTITIONS[partition]);
        let c = &mut spec.clusters;
        (c.count, c.modules, c.ctus_per_icu) = shape;
        // In shells a bundle is one module's.
        c.bundle_slots = c.modules + spare_slots;
        spec.ctu.contexts = contexts;
        (spec.fifos.ctu_icu, spec.fifos.icu_reducer, spec.fifos.results, spec.fifos.commands) = depths;
        let bytes = |log2: u32| if log2 == 0 { 0 } else { 256 << log2 };
        spec.patch_cache.bytes = bytes(cache_log2.0);
        spec.list_cache.bytes = bytes(cache_log2.1);
        spec.mask_cache.bytes = bytes(cache_log2.2);
        spec.memory = [MemoryLevels::None, MemoryLevels::OneLevel, MemoryLevels::Hierarchical][levels];
        (spec.icu.initiation_interval, spec.icu.depth, spec.ctu.initiation_interval, spec.ctu.depth, spec.loader.slots) =
            pipes;
        spec.bus.clock_mhz = bus_mhz;
        spec.scheduling = [Scheduling::Static, Scheduling::PseudoDynamic, Scheduling::Ideal][scheduling];
        (spec.dispatch.rebalance_threshold, spec.dispatch.rebalance_cycles) = rebalance;
        spec.dram.layout = if by_cell { PatchLayout::ByCell } else { PatchLayout::ById };
        spec.shells.prefetch = prefetch && PARTITIONS[partition].is_shells();
        let (frame, work) = on_board("cornell-box", spec);
        prop_assert_eq!(&work, reference_work);
        prop_assert!(frame.rendering.film == reference.rendering.film, "another picture");
        prop_assert_eq!(&frame.solution, &reference.solution);
    }
}

#[test]
fn picture_is_the_same_in_all_partitions_and_the_work_is_not() {
    let (grid, grid_work) = reference(0);
    for partition in [1, 2] {
        let (shells, work) = reference(partition);
        assert!(shells.rendering.film == grid.rendering.film, "{:?}", PARTITIONS[partition]);
        assert_eq!(shells.solution, grid.solution, "{:?}", PARTITIONS[partition]);
        assert_eq!((work.rays, work.hits, work.bundles), (grid_work.rays, grid_work.hits, grid_work.bundles));
        assert_ne!(work.tests, grid_work.tests, "a bundle's rays share what they test");
    }
    let low_resolution = |partition: usize| reference(partition).1.low_resolution;
    assert_eq!(low_resolution(0), low_resolution(1));
    assert!(low_resolution(1).rays == 0 && low_resolution(2).rays > 10, "{:?}", low_resolution(2));
}

#[test]
fn board_without_time_renders_the_same_picture_with_the_same_work() {
    for (i, partition) in PARTITIONS.into_iter().enumerate() {
        let (reference, reference_work) = reference(i);
        let spec = in_partition(BoardSpec::preset("minimal").unwrap(), partition);
        let camera = reference.scene.camera.unwrap();
        let patches = reference.mesh.cast_patches();
        let mut caster = FunctionalCaster::for_board(&spec, &patches, &[camera.eye]).unwrap();
        let (scene, mesh) = (&reference.scene, &reference.mesh);
        let solution =
            solve(scene, mesh, &mut caster, &reference.solve_options.unwrap(), &mut |_| {}).unwrap();
        assert_eq!(Some(&solution), reference.solution.as_ref());
        let rendering =
            render(scene, &camera, mesh, &solution, &mut caster, &picture(), &mut |_| {}).unwrap();
        assert_eq!(rendering.film, reference.rendering.film);
        assert_eq!(&caster.counters(), reference_work, "{partition:?}");
        assert!(reference_work.tests > 1000 && reference_work.hits > 100, "{reference_work:?}");
    }
}

#[test]
fn board_and_software_pictures_differ_at_shadow_edges_only() {
    for name in ["cornell-box", "sphere-room", "mirror-glass"] {
        let software = small_frame(name, CasterChoice::Software).rendering.film;
        let board = on_board(name, BoardSpec::default()).0.rendering.film;
        assert!(
            software.pixels.iter().all(|p| p.is_finite()) && software.pixels.iter().any(|p| !p.is_black())
        );
        let d = difference(&software, &board, None).unwrap();
        // One of four shadow rays of a point that decides otherwise moves a pixel by up to a quarter of its direct light.
        assert!(d.n_not_finite == 0 && d.n_over_1_percent * 40 < d.n_pixels, "{name}: {d:?}");
        assert!(d.rmse_relative < 0.02 && d.max_relative < 0.5, "{name}: {d:?}");
    }
}

#[test]
fn minimal_board_renders_the_same_picture_in_more_cycles() {
    let (fast, _) = on_board("cornell-box", BoardSpec::preset("delft-1992").unwrap());
    let (slow, _) = reference(0);
    assert_eq!(fast.rendering.film, slow.rendering.film);
    let cycles = |f: &Frame| f.board.iter().flatten().map(|(_, s)| s.cycles).sum::<u64>();
    assert!(cycles(slow) > 3 * cycles(&fast), "{} and {}", cycles(slow), cycles(&fast));
}
