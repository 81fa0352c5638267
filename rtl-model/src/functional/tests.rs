//! Tests of the functional model: against brute force over all patches.

use proptest::prelude::*;

use super::*;
use crate::datapath::test_support::{formats, numbered, patch, ray, widths};
use crate::datapath::{Facing, PatchWords};
use crate::fixed::{Formats, Rounding};

/// Every patch, no grid.
fn brute_force(image: &MemoryImage, ray: &RayWords) -> Option<HitWords> {
    (0..image.n_patches)
        .fold(None, |best, patch| HitWords::nearer(best, intersect(&image.formats, ray, &image.patch(patch))))
}

fn scene() -> impl Strategy<Value = (Formats, Vec<PatchWords>, Vec<RayWords>, Option<u32>)> {
    let modes = prop_oneof![Just(Rounding::NearestEven), Just(Rounding::HalfAway), Just(Rounding::Floor)];
    (widths(), modes).prop_flat_map(|((f, d, t), rounding)| {
        let grid = prop_oneof![Just(None), Just(Some(1)), Just(Some(3)), Just(Some(5))];
        (
            Just(Formats { rounding, ..formats(f, d, t) }),
            prop::collection::vec(patch(f), 1..24),
            prop::collection::vec(ray(f, d, t), 24),
            grid,
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn trace_random_and_adversarial_scenes_equals_brute_force((formats, patches, rays, grid) in scene()) {
        let image = MemoryImage::build(&formats, &numbered(patches), grid);
        for ray in &rays {
            let nearest = trace(&image, ray, false);
            let expected = brute_force(&image, ray);
            prop_assert_eq!(nearest.hit, expected, "{:?} {:?}", formats, ray);
            let any = trace(&image, ray, true);
            prop_assert_eq!(any.hit.is_some(), expected.is_some());
            prop_assert!(any.cells <= nearest.cells && any.tests <= nearest.tests);
            prop_assert!(nearest.tests <= nearest.list_entries);
        }
    }

    /// Walls one to three steps from the planes of a 2^3 grid, met by steep and grazing rays: the rounded t of a wall
    /// and of the plane in front of or behind it are equal or neighbours, where a wrong termination rule slips.
    #[test]
    fn trace_walls_within_three_steps_of_cell_planes_ends_neither_early_nor_wrong(
        (t, rounding) in (8_u32..=10, prop_oneof![Just(Rounding::NearestEven), Just(Rounding::Floor)]),
        offsets in prop::collection::vec((0_i32..8, -3_i32..=3, -3_i32..=3, -3_i32..=3), 6),
        rays in prop::collection::vec(ray(10, 10, 10), 24),
    ) {
        let formats = Formats { rounding, ..formats(10, 10, t) };
        let one = 1_i32 << 10;
        let wall = |&(plane, a, b, c): &(i32, i32, i32, i32)| {
            let x = |off: i32| ((plane << 8) - one + off).clamp(-one, one - 1);
            let corners = [[x(a), -one, -one], [x(b), one - 1, -one], [x(c), one - 1, one - 1], [x(a), -one, one - 1]];
            PatchWords { corners, is_triangle: false, id: 0 }
        };
        let image = MemoryImage::build(&formats, &numbered(offsets.iter().map(wall).collect()), Some(3));
        for ray in &rays {
            let ray = RayWords { t_max: ray.t_max.min(formats.t_limit()), ..*ray };
            prop_assert_eq!(trace(&image, &ray, false).hit, brute_force(&image, &ray), "{:?}", ray);
        }
    }
}

/// One quad at z = 1/2 in a grid of 2 cells a side; a ray from (-1/2, -1/2, -1/2) straight up.
#[test]
fn trace_one_quad_straight_ahead_counts_by_hand() {
    let formats = formats(8, 8, 8);
    let corners = [[-200, -200, 128], [-200, 0, 128], [0, 0, 128], [0, -200, 128]];
    let image = MemoryImage::build(&formats, &[PatchWords { corners, is_triangle: false, id: 0 }], Some(1));
    let ray = RayWords { origin: [-128, -128, -128], dir: [0, 0, 255], t_max: formats.t_limit() };
    let done = trace(&image, &ray, false);
    // num/den = 256/255 in coordinate over direction words: t = 256 * 2^8 / 255 = 257.0 to nearest.
    let hit = HitWords { t: 257, patch: 0, facing: Facing::Front };
    assert_eq!(done, RayTrace { hit: Some(hit), cells: 2, list_entries: 1, tests: 1 });

    let short = RayWords { t_max: 256, ..ray };
    assert_eq!(trace(&image, &short, false), RayTrace { hit: None, cells: 2, list_entries: 1, tests: 1 });
    let shorter = RayWords { t_max: 127, ..ray };
    assert_eq!(trace(&image, &shorter, false), RayTrace { hit: None, cells: 1, list_entries: 0, tests: 0 });
}

#[test]
fn trace_empty_scene_walks_to_the_end_of_the_grid() {
    let formats = formats(8, 8, 8);
    let image = MemoryImage::build(&formats, &[], Some(3));
    let ray = RayWords { origin: [-256; 3], dir: [255, 0, 0], t_max: formats.t_limit() };
    assert_eq!(trace(&image, &ray, false), RayTrace { hit: None, cells: 8, list_entries: 0, tests: 0 });
    assert_eq!(trace(&image, &ray, true).cells, 8);
}

#[test]
fn count_two_rays_sums_their_work() {
    let mut counters = CanonicalCounters::default();
    let hit = Some(HitWords { t: 1, patch: 0, facing: Facing::Back });
    counters.count(&RayTrace { hit, cells: 3, list_entries: 5, tests: 4 });
    counters.count(&RayTrace { hit: None, cells: 2, list_entries: 1, tests: 1 });
    let expected = CanonicalCounters {
        rays: 2,
        cells: 5,
        list_entries: 6,
        tests: 5,
        hits: 1,
        ..CanonicalCounters::default()
    };
    assert_eq!(counters, expected);
}

/// A ray to the plane between two cells, all distances, speeds and limits around every rounding of t: it enters the
/// second cell exactly when the plane's rounded t is at most its limit. One step of t is one distance over speed.
#[test]
fn trace_limit_at_every_rounding_of_the_plane_enters_the_next_cell_only_when_it_may_matter() {
    let (mut ends, mut steps) = (0, 0);
    for rounding in [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor] {
        let formats = Formats { rounding, ..formats(16, 8, 8) };
        let image = MemoryImage::build(&formats, &[], Some(1));
        for speed in [128, 129, 150, 192, 255] {
            for distance in 0..6 * speed {
                let t = f64::from(distance) / f64::from(speed);
                let t = match rounding {
                    Rounding::NearestEven => t.round_ties_even(),
                    Rounding::HalfAway => t.round(),
                    Rounding::Floor => t.floor(),
                };
                for t_max in 0..8_u64 {
                    let ray = RayWords { origin: [-distance, 99, 99], dir: [speed, 0, 0], t_max };
                    // On the plane itself the half-open cell of the origin is already the second one.
                    let enters = distance > 0 && t <= t_max as f64;
                    let cells = trace(&image, &ray, false).cells;
                    assert_eq!(cells, 1 + u32::from(enters), "{rounding:?} {distance}/{speed} {t_max}");
                    *(if enters { &mut steps } else { &mut ends }) += 1;
                }
            }
        }
    }
    assert!(ends > 10_000 && steps > 10_000, "{ends} ended, {steps} stepped on");
}

/// Two walls beside a cell plane whose t round to one word: the smaller id wins, be it in the cell behind.
#[test]
fn trace_two_walls_of_one_t_on_both_sides_of_a_plane_answers_the_smaller_id() {
    let wall = |x: i32, id| {
        let corners = [[x, -500, -500], [x, 500, -500], [x, 500, 500], [x, -500, 500]];
        PatchWords { corners, is_triangle: false, id }
    };
    // t = x / 128: 1.25 and 1.375 with the plane at 1.3125 between them.
    let ray = RayWords { origin: [-168, 0, 0], dir: [128, 0, 0], t_max: 1024 };
    for (rounding, t) in [(Rounding::NearestEven, 1), (Rounding::HalfAway, 1), (Rounding::Floor, 1)] {
        let formats = Formats { rounding, ..formats(16, 8, 8) };
        for (front, behind) in [(0, 1), (1, 0)] {
            let patches = [wall(-8, front), wall(8, behind)];
            let image = MemoryImage::build(&formats, &patches, Some(1));
            let hit = trace(&image, &ray, false);
            assert_eq!(hit.hit.map(|h| (h.t, h.patch)), Some((t, 0)), "{rounding:?} {front} {behind}");
            assert_eq!((hit.cells, hit.tests), (2, 2));
        }
    }
}

/// A wall in the first of two cells, and one that slants through both and is met behind the plane.
#[test]
fn trace_wall_in_the_first_cell_ends_there_and_any_hit_ends_with_whatever_it_found() {
    let formats = formats(8, 8, 8);
    let ray = RayWords { origin: [-128, 0, 0], dir: [255, 0, 0], t_max: formats.t_limit() };
    let slanted = |at: i32, lean: i32, id| {
        let corners = [[at, -50, -50], [at - lean, 50, -50], [at - lean, 50, 50], [at, -50, 50]];
        PatchWords { corners, is_triangle: false, id }
    };
    let work = |patches: &[PatchWords], any_hit| {
        let done = trace(&MemoryImage::build(&formats, patches, Some(1)), &ray, any_hit);
        (done.hit.map(|hit| hit.patch), done.cells, done.list_entries, done.tests)
    };
    let near = slanted(-64, 0, 7);
    assert_eq!(work(&[near], false), (Some(7), 1, 1, 1));
    assert_eq!(work(&[near], true), (Some(7), 1, 1, 1));
    // Through x = -30 to 50, met at x = 10: listed in both cells, tested once.
    let both = slanted(50, 80, 8);
    assert_eq!(work(&[both], false), (Some(8), 2, 2, 1));
    assert_eq!(work(&[both], true), (Some(8), 1, 1, 1));
    // Another one before that in the second cell; the any-hit ray never sees it.
    assert_eq!(work(&[both, slanted(5, 0, 9)], false), (Some(9), 2, 3, 2));
    assert_eq!(work(&[both, slanted(5, 0, 9)], true), (Some(8), 1, 1, 1));
}

#[path = "oracle_tests.rs"]
mod oracle;
