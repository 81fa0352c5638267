//! No ray escapes from a closed mesh: full products at every width and rounding mode, and what rounded products lose.
//! The argument is in the header of `datapath/ray_patch.rs`.

mod meshes;

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use rtl_model::datapath::bundle::BundleWords;
use rtl_model::datapath::ray_patch::{intersect, taps};
use rtl_model::fixed::{Formats, Rounding};
use rtl_model::functional::trace;
use rtl_model::memory_image::MemoryImage;

use meshes::Mesh;
use meshes::inside::{is_inside, origin};
use meshes::leaks::{Aim, casts, escaped};
use meshes::random::Random;
use meshes::rays::{Target, aimed, direction_words, exact};

const MODES: [Rounding; 3] = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor];

/// Formats of every width and mode with full products, and a seed.
fn cases() -> impl Strategy<Value = (Formats, u64)> {
    // Both ends of the ranges more often than their share.
    let width = || prop_oneof![1 => Just(8_u32), 1 => Just(28_u32), 4 => 8_u32..=28];
    (width(), width(), 8_u32..=32, 0_usize..3, any::<u64>()).prop_map(|(f, d, t, mode, seed)| {
        let formats = Formats {
            coord_frac_bits: f,
            dir_frac_bits: d,
            t_frac_bits: t,
            cross_keep_bits: None,
            rounding: MODES[mode],
        };
        (formats, seed)
    })
}

/// Runs a property over random formats and seeds; the failing case is printed by the runner.
fn check(n_cases: u32, test: impl Fn(Formats, u64) -> Result<(), TestCaseError>) {
    let config = Config { cases: n_cases, failure_persistence: None, ..Config::default() };
    let outcome = TestRunner::new(config).run(&cases(), |(formats, seed)| test(formats, seed));
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
}

fn add(counter: &Cell<usize>, n: usize) {
    counter.set(counter.get() + n);
}

#[test]
fn intersect_aimed_rays_from_inside_any_closed_mesh_all_hit() {
    let (rays, targets) = (Cell::new(0), Cell::new([0_usize; 3]));
    check(700, |formats, seed| {
        let random = &mut Random::new(seed);
        let mesh = Mesh::any(formats.coord_frac_bits, 1, random);
        for _ in 0..6 {
            let Some(origin) = origin(&mesh, random) else { continue };
            for k in 0..30 {
                let target = Target::ALL[k % 3];
                let Some(ray) = aimed(&formats, &mesh, origin, target, random) else { continue };
                let hit = mesh.patches.iter().any(|patch| intersect(&formats, &ray, patch).is_some());
                prop_assert!(hit, "{target:?} {ray:?} escapes from {mesh:?}");
                add(&rays, 1);
                let mut counts = targets.get();
                counts[k % 3] += 1;
                targets.set(counts);
            }
        }
        Ok(())
    });
    assert!(rays.get() >= 100_000, "only {} rays", rays.get());
    assert!(targets.get().iter().all(|n| *n > 30_000), "{targets:?}");
}

#[test]
fn intersect_rays_exactly_through_corners_and_edges_all_hit() {
    let (rays, through_edge, through_corner) = (Cell::new(0), Cell::new(0), Cell::new(0));
    check(900, |formats, seed| {
        let random = &mut Random::new(seed);
        let f = formats.coord_frac_bits;
        let snap = [1, 2, 3, 15, 16][random.below(if f < 12 { 3 } else { 5 })];
        let mesh = Mesh::any(f, snap, random);
        for _ in 0..40 {
            let Some(base) = origin(&mesh, random) else { continue };
            for k in 0..5 {
                let target = Target::ALL[k % 2];
                let Some(ray) = exact(&formats, &mesh, base, target, random) else { continue };
                let mut zeros = 0;
                let mut hit = false;
                for patch in mesh.patches.iter().filter(|patch| intersect(&formats, &ray, patch).is_some()) {
                    hit = true;
                    let wires = taps(&formats, &ray, patch);
                    let edges = if patch.is_triangle { 3 } else { 5 };
                    zeros = zeros.max(wires.e[..edges].iter().filter(|e| **e == 0).count());
                }
                prop_assert!(hit, "{target:?} {ray:?} escapes from {mesh:?}");
                add(&rays, 1);
                add(&through_edge, usize::from(zeros > 0));
                add(&through_corner, usize::from(zeros > 1));
            }
        }
        Ok(())
    });
    let (rays, edge, corner) = (rays.get(), through_edge.get(), through_corner.get());
    assert!(rays >= 100_000, "only {rays} rays");
    assert!(edge == rays && corner > rays / 2, "{edge} and {corner} of {rays} rays");
}

#[test]
fn trace_through_the_cells_finds_the_nearest_hit_of_every_ray_from_inside() {
    let rays = Cell::new(0);
    check(150, |formats, seed| {
        let random = &mut Random::new(seed);
        let mesh = Mesh::any(formats.coord_frac_bits, 1, random);
        let grid = 1 + u32::try_from(random.below(4)).unwrap();
        let image = MemoryImage::build(&formats, &mesh.patches, Some(grid));
        for k in 0..30 {
            let Some(base) = origin(&mesh, random) else { continue };
            let ray = match k % 4 {
                0 => exact(&formats, &mesh, base, Target::Vertex, random),
                1 => aimed(&formats, &mesh, base, Target::Edge, random),
                2 => aimed(&formats, &mesh, base, Target::Vertex, random),
                _ => aimed(&formats, &mesh, base, Target::Anywhere, random),
            };
            let Some(ray) = ray else { continue };
            let hits = mesh.patches.iter().filter_map(|patch| intersect(&formats, &ray, patch));
            let nearest = hits.min_by_key(|hit| (hit.t, hit.patch));
            prop_assert!(nearest.is_some());
            prop_assert_eq!(trace(&image, &ray, false).hit, nearest, "{:?} in {:?}", ray, mesh);
            prop_assert!(trace(&image, &ray, true).hit.is_some());
            add(&rays, 1);
        }
        Ok(())
    });
    assert!(rays.get() > 2_500, "only {} rays", rays.get());
}

/// Escaped rays of the same casts for every mode, at K kept bits.
fn leaks_by_mode(formats: &Formats, keep: u32, casts: &[meshes::leaks::Cast]) -> [usize; 3] {
    MODES.map(|rounding| escaped(&Formats { rounding, cross_keep_bits: Some(keep), ..*formats }, casts))
}

#[test]
fn intersect_rounded_edge_normals_leak_by_mode_as_published() {
    let formats = Formats { coord_frac_bits: 12, dir_frac_bits: 16, ..Formats::default() };
    let random = &mut Random::new(1992);
    let n_rays = 1500;
    let at_corners = casts(&formats, Aim::Exact, Target::Vertex, n_rays, random);
    let at_edges = casts(&formats, Aim::Exact, Target::Edge, n_rays, random);
    let near_corners = casts(&formats, Aim::Rounded, Target::Vertex, n_rays, random);
    for casts in [&at_corners, &at_edges, &near_corners] {
        assert_eq!(casts.iter().map(|cast| cast.rays.len()).sum::<usize>(), n_rays);
        assert_eq!(leaks_by_mode(&formats, 24, casts), [0; 3], "full products");
    }
    for keep in [22, 20, 16, 12] {
        let [even, away, floor] = leaks_by_mode(&formats, keep, &at_corners);
        // The fan around a corner opens in every mode, most of all where the sides of an edge disagree too.
        assert!(even > 0 && away > 0, "K = {keep}: {even}, {away}");
        assert!(floor > even + n_rays / 50 && floor > away, "K = {keep}: {even}, {away}, {floor}");
        // Rounding that is odd keeps the two sides of an edge together: what is left is lost near corners.
        let [even, away, floor] = leaks_by_mode(&formats, keep, &at_edges);
        assert!(even <= n_rays / 500 && away <= n_rays / 500, "K = {keep}: {even}, {away}");
        assert!(floor > n_rays / 50, "K = {keep}: {floor}");
    }
}

#[test]
fn direction_words_of_targets_are_the_board_s_own() {
    let random = &mut Random::new(7);
    let mut cases = 0;
    for _ in 0..2_000 {
        let (f, d) = (random.integer(8, 28), random.integer(8, 28));
        let formats = Formats { coord_frac_bits: f as u32, dir_frac_bits: d as u32, ..Formats::default() };
        let cube = 1_i64 << f;
        let [apex, point] = [(); 2].map(|()| [(); 3].map(|()| random.integer(-cube, cube - 1) as i32));
        if apex != point {
            let bundle = BundleWords::Targets { apex, points: vec![point] };
            let raw = [0, 1, 2].map(|k| i64::from(point[k]) - i64::from(apex[k]));
            assert_eq!(direction_words(raw, formats.dir_frac_bits), Some(bundle.ray(&formats, 0).dir));
            cases += 1;
        }
    }
    assert!(cases > 1_900);
    assert_eq!(direction_words([0; 3], 8), None);
}

#[test]
fn is_inside_box_corners_faces_and_middle_are_told_apart() {
    let random = &mut Random::new(3);
    let cube = |n: usize| [0, 1, 2].map(|k| if n >> k & 1 == 1 { 40.0 / 256.0 } else { -40.0 / 256.0 });
    let faces = vec![[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let surface =
        meshes::surfaces::Surface { vertices: (0..8).map(cube).collect(), faces, cores: vec![[0.0; 3]] };
    let mesh = Mesh::new(&surface, 8, 1, meshes::Faces::Mixed, random);
    for inside in [[0, 0, 0], [39, 39, -39], [-39, 1, 2]] {
        assert!(is_inside(&mesh, inside, random), "{inside:?}");
    }
    for outside in [[41, 0, 0], [40, 0, 0], [40, 40, 40], [40, 40, 3], [0, 200, 0], [-41, -41, -41]] {
        assert!(!is_inside(&mesh, outside, random), "{outside:?}");
    }
}
