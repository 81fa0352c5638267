//! Tests of the first test: sound against the exact test at every width, equal to its specification in i128.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::{TestCaseResult, TestRunner};

use super::*;
use crate::datapath::ray_patch::{self, taps};
use crate::datapath::test_support::{formats, patch, ray, widths};

/// Widths that the board offers.
const WIDTHS: std::ops::RangeInclusive<u32> = 4..=24;

/// How often each answer came up, over pairs and widths.
#[derive(Default)]
struct Tally {
    pairs: Cell<u32>,
    miss: Cell<u32>,
    inside: Cell<u32>,
    undecided: Cell<u32>,
}

impl Tally {
    /// At least 10^5 pairs, and enough of each answer.
    fn assert_covers(&self, least: u32) {
        let Tally { pairs, miss, inside, undecided } = self;
        assert!(pairs.get() >= 100_000, "{} pairs", pairs.get());
        for (what, count) in [("miss", miss), ("inside", inside), ("undecided", undecided)] {
            assert!(count.get() >= least, "{what}: {}", count.get());
        }
    }
}

/// The line meets a triangle of the patch, says the exact unit.
fn exactly_inside(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> bool {
    taps(formats, ray, patch).triangles.iter().flatten().any(|t| t.inside)
}

/// Never a wrong answer, at a third of the widths, another third for the next pair.
fn assert_sound(tally: &Tally, formats: &Formats, ray: &RayWords, patch: &PatchWords) -> TestCaseResult {
    let hit = ray_patch::intersect(formats, ray, patch);
    let inside = exactly_inside(formats, ray, patch);
    for bits in WIDTHS.skip(crate::fixed::index(tally.pairs.get() % 3)).step_by(3) {
        let count = match first_test(formats, bits, ray, patch) {
            FirstTest::Miss => {
                prop_assert_eq!(hit, None, "{} bits, {:?}, {:?}", bits, ray, patch);
                &tally.miss
            }
            FirstTest::Inside => {
                prop_assert!(inside, "{bits} bits, {ray:?}, {patch:?}");
                &tally.inside
            }
            FirstTest::Undecided => &tally.undecided,
        };
        count.set(count.get() + 1);
        prop_assert_eq!(intersect(formats, bits, ray, patch), hit, "{} bits", bits);
    }
    tally.pairs.set(tally.pairs.get() + 1);
    Ok(())
}

/// A direction along `toward`, its largest component in [2^(D-1), 2^D): exact when it fits, else cut.
fn along(formats: &Formats, toward: [i64; 3]) -> Option<[i32; 3]> {
    let most = toward.iter().map(|w| w.abs()).max().filter(|m| *m > 0)?;
    let used = 64 - most.leading_zeros();
    let (up, down) = (formats.dir_frac_bits.saturating_sub(used), used.saturating_sub(formats.dir_frac_bits));
    Some(toward.map(|w| i32::try_from((w << up) / (1 << down)).unwrap()))
}

/// Rays from `ray`'s origin at a point of each side of the patch, `share` of the way, and one step beside it.
fn aimed(
    formats: &Formats,
    ray: &RayWords,
    patch: &PatchWords,
    share: i64,
    beside: [i64; 3],
) -> Vec<RayWords> {
    let mut rays = vec![*ray];
    let a = differences(ray, patch);
    for i in 0..4 {
        for j in i..4 {
            let point = [0, 1, 2].map(|k| a[i][k] * 16 + (a[j][k] - a[i][k]) * share);
            // Whole points stay exact.
            let point = if point.iter().all(|w| w % 16 == 0) { point.map(|w| w / 16) } else { point };
            for step in [[0; 3], beside] {
                let toward = [0, 1, 2].map(|k| point[k] + step[k]);
                rays.extend(along(formats, toward).map(|dir| RayWords { dir, ..*ray }));
            }
        }
    }
    rays
}

/// Patches that are hard: slivers, points, lines, cube corners, mesh-like ones, next to the usual ones; a triangle's
/// fourth corner is anything.
fn hard_patch(f: u32) -> impl Strategy<Value = PatchWords> {
    let one = 1_i32 << f;
    let small = move |most: i32| [-most..=most, -most..=most, -most..=most];
    let sizes = prop_oneof![Just(0), Just(1), Just(3), Just((one >> 5).max(4)), Just(one >> 2)];
    (patch(f), sizes.prop_flat_map(move |most| [small(most), small(most), small(most)]), 0..6).prop_map(
        move |(patch, offsets, kind)| {
            let mut corners = patch.corners;
            match kind {
                // All near the first corner.
                0 | 1 => {
                    for (corner, offset) in corners[1..].iter_mut().zip(offsets) {
                        *corner = [0, 1, 2].map(|k| (patch.corners[0][k] + offset[k]).clamp(-one, one - 1));
                    }
                }
                // Two long edges, nearly one.
                2 => {
                    corners[2] = [0, 1, 2].map(|k| (corners[1][k] + offsets[0][k]).clamp(-one, one - 1));
                    corners[3] = [0, 1, 2].map(|k| (corners[0][k] + offsets[1][k]).clamp(-one, one - 1));
                }
                // Corners of the cube.
                3 => {
                    corners = corners.map(|corner| corner.map(|w| if w < 0 { -one } else { one - 1 }));
                }
                // A line.
                4 => corners[1] = [0, 1, 2].map(|k| i32::midpoint(corners[0][k], corners[2][k])),
                _ => {}
            }
            PatchWords { corners, ..patch }
        },
    )
}

/// Any rounding of the products.
fn roundings(formats: Formats) -> impl Strategy<Value = Formats> {
    let modes = prop_oneof![Just(Rounding::NearestEven), Just(Rounding::HalfAway), Just(Rounding::Floor)];
    (modes, 4..=2 * formats.coord_frac_bits).prop_map(move |(rounding, keep)| Formats {
        rounding,
        cross_keep_bits: Some(keep),
        ..formats
    })
}

/// Runs `check` on `cases` values; failing ones are shrunk and printed.
fn for_all<S: Strategy>(cases: u32, strategy: S, check: impl Fn(S::Value) -> TestCaseResult) {
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    if let Err(failure) = TestRunner::new(config).run(&strategy, check) {
        panic!("{failure}");
    }
}

#[test]
fn first_test_random_and_aimed_rays_is_never_wrong() {
    let tally = Tally::default();
    let strategy = widths().prop_flat_map(|(f, d, t)| {
        (Just(formats(f, d, t)), patch(f), prop::collection::vec((ray(f, d, t), 0_i64..=16), 26))
    });
    for_all(2000, strategy, |(formats, patch, rays)| {
        for (ray, share) in &rays {
            assert_sound(&tally, &formats, ray, &patch)?;
            // Toward a point of the diagonal: half of the quads are met there.
            let a = differences(ray, &patch);
            let inner = [0, 1, 2].map(|k| a[0][k] * (16 - share) + a[2][k] * share);
            if let Some(dir) = along(&formats, inner) {
                assert_sound(&tally, &formats, &RayWords { dir, ..*ray }, &patch)?;
            }
        }
        Ok(())
    });
    tally.assert_covers(10_000);
}

#[test]
fn first_test_hard_patches_aimed_at_corners_and_edges_is_never_wrong() {
    let tally = Tally::default();
    let step = || [-1_i64..=1, -1_i64..=1, -1_i64..=1];
    let strategy = widths().prop_flat_map(move |(f, d, t)| {
        (Just(formats(f, d, t)), hard_patch(f), prop::collection::vec((ray(f, d, t), 0_i64..=16, step()), 4))
    });
    for_all(1600, strategy, |(formats, patch, rays)| {
        for (ray, share, beside) in &rays {
            for ray in aimed(&formats, ray, &patch, *share, *beside) {
                assert_sound(&tally, &formats, &ray, &patch)?;
            }
        }
        Ok(())
    });
    tally.assert_covers(10_000);
}

#[test]
fn first_test_rounded_products_is_never_wrong() {
    let tally = Tally::default();
    let strategy = widths().prop_flat_map(|(f, d, t)| {
        let rays = prop::collection::vec((ray(f, d, t), 0_i64..=16), 4);
        (roundings(formats(f, d, t)), hard_patch(f), rays)
    });
    for_all(1600, strategy, |(formats, patch, rays)| {
        for (ray, share) in &rays {
            for ray in aimed(&formats, ray, &patch, *share, [1, -1, 1]) {
                assert_sound(&tally, &formats, &ray, &patch)?;
            }
        }
        Ok(())
    });
    tally.assert_covers(10_000);
}

#[test]
fn first_test_every_tiny_triangle_at_one_to_four_bits_is_never_wrong() {
    let formats = formats(8, 8, 8);
    let place = |n: i32| [n % 3, n / 3 % 3, n / 9].map(|digit| [-5, 1, 6][digit as usize]);
    let (mut cases, mut decided) = (0, 0);
    for n in 0..27 * 27 * 27 {
        let corners = [place(n % 27), place(n / 27 % 27), place(n / 729)];
        let patch = PatchWords {
            corners: [corners[0], corners[1], corners[2], corners[2]],
            is_triangle: true,
            id: 7,
        };
        for m in (0..27).filter(|m| *m != 13) {
            let dir = [m % 3, m / 3 % 3, m / 9].map(|digit| [-5, 0, 3][digit as usize]);
            let ray = RayWords { origin: [0; 3], dir, t_max: formats.t_limit() };
            let hit = ray_patch::intersect(&formats, &ray, &patch);
            let inside = exactly_inside(&formats, &ray, &patch);
            for bits in 1..=4 {
                let answer = first_test(&formats, bits, &ray, &patch);
                match answer {
                    FirstTest::Miss => assert_eq!(hit, None, "{bits} {ray:?} {patch:?}"),
                    FirstTest::Inside => assert!(inside, "{bits} {ray:?} {patch:?}"),
                    FirstTest::Undecided => assert!(bits < 3, "words of 3 bits fit: {ray:?} {patch:?}"),
                }
                if bits >= 3 {
                    assert_eq!(narrow_inside(&formats, bits, &ray, &patch), inside);
                }
                cases += 1;
                decided += u32::from(bits < 3 && answer != FirstTest::Undecided);
            }
        }
    }
    assert_eq!(cases, 27 * 27 * 27 * 26 * 4);
    assert!(decided > 100_000, "{decided}");
}

#[test]
fn first_test_behind_the_origin_on_one_axis_is_missed_without_products() {
    let formats = formats(24, 24, 24);
    // The line meets the quad's middle, far behind the origin.
    let half = 1 << 22;
    let corners = [[-half, -half, -9], [half, -half, -9], [half, half, -9], [-half, half, -9]];
    let patch = PatchWords { corners, is_triangle: false, id: 0 };
    let ray = RayWords { origin: [3, 5, -8], dir: [0, 0, 1 << 23], t_max: formats.t_limit() };
    assert_eq!(first_test(&formats, 12, &ray, &patch), FirstTest::Miss);
    assert!(narrow_inside(&formats, 12, &ray, &patch));
    let turned = RayWords { dir: [0, 0, -(1 << 23)], ..ray };
    assert_eq!(first_test(&formats, 12, &turned, &patch), FirstTest::Inside);
    // One corner in the origin's plane: not behind, the edges decide.
    let on_plane = RayWords { origin: [3, 5, -9], ..ray };
    assert_eq!(first_test(&formats, 12, &on_plane, &patch), FirstTest::Inside);
    // Rounded products: the rule rests.
    let rounded = Formats { cross_keep_bits: Some(40), ..formats };
    assert_eq!(first_test(&rounded, 12, &ray, &patch), FirstTest::Inside);
}

#[path = "first_test_bound_tests.rs"]
mod bound;
