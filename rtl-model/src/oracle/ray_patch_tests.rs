//! Tests of the oracle of ray x patch: closed forms, predicates against expansions, the quotient against its definition.

use proptest::prelude::*;

use super::*;
use crate::datapath::test_support::{formats, patch, ray, widths};

const MODES: [Rounding; 3] = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor];

#[test]
fn intersect_square_ahead_has_the_distance_of_the_plane() {
    let formats = formats(8, 8, 8);
    let corners = [[-100, -100, 64], [100, -100, 64], [100, 100, 64], [-100, 100, 64]];
    let patch = PatchWords { corners, is_triangle: false, id: 5 };
    let up = RayWords { origin: [10, -20, 0], dir: [0, 0, 128], t_max: 4 << 8 };
    // A quarter of the half cube at half a unit of length a unit of t.
    let hit = HitWords { t: 128, patch: 5, facing: Facing::Back };
    assert_eq!(intersect(&formats, &up, &patch), Some(hit));
    assert_eq!(intersect(&formats, &RayWords { t_max: 128, ..up }, &patch), Some(hit));
    assert_eq!(intersect(&formats, &RayWords { t_max: 127, ..up }, &patch), None);
    assert_eq!(intersect(&formats, &RayWords { dir: [0, 0, -128], ..up }, &patch), None);
    let down = RayWords { origin: [10, -20, 128], dir: [0, 0, -128], ..up };
    assert_eq!(intersect(&formats, &down, &patch), Some(HitWords { facing: Facing::Front, ..hit }));
    // Beside it, at its corner, in its plane.
    assert_eq!(intersect(&formats, &RayWords { origin: [101, 0, 0], ..up }, &patch), None);
    assert_eq!(intersect(&formats, &RayWords { origin: [100, 100, 0], ..up }, &patch), Some(hit));
    assert_eq!(intersect(&formats, &RayWords { origin: [0, 0, 64], dir: [128, 0, 0], ..up }, &patch), None);
}

#[test]
fn wires_of_a_unit_triangle_are_those_worked_by_hand() {
    let formats = formats(8, 8, 8);
    let corners = [[1, 0, 2], [0, 1, 2], [0, 0, 2], [0, 0, 2]];
    let patch = PatchWords { corners, is_triangle: true, id: 0 };
    let ray = RayWords { origin: [0, 0, 1], dir: [0, 0, 200], t_max: 1024 };
    let wires = wires(&formats, &ray, &patch);
    assert_eq!(wires.a, [[1, 0, 1], [0, 1, 1], [0, 0, 1], [0, 0, 1]]);
    assert_eq!(wires.c, [[-1, -1, 1], [1, 0, 0], [0, 1, 0], [0; 3], [0; 3]]);
    assert_eq!(wires.e, [200, 0, 0, 0, 0]);
    let triangle =
        TriangleWires { inside: true, n: [0, 0, 1], den: 200, num: 1, num_shifted: 256, den_shifted: 200 };
    assert_eq!(wires.triangles, [Some(triangle), None]);
    // 256/200 = 1.28.
    assert_eq!(intersect(&formats, &ray, &patch).map(|hit| hit.t), Some(1));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1_500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn orientation_with_full_products_equals_the_sign_of_the_expansion(
        (formats, patch, rays) in widths().prop_flat_map(|(f, d, t)| {
            (Just(formats(f, d, t)), patch(f), prop::collection::vec(ray(f, d, t), 8))
        })
    ) {
        for mut ray in rays {
            for corner in 0..4 {
                // From anywhere, and along lines through the corners: exact zeros.
                if corner > 0 {
                    ray.origin = patch.corners[corner];
                }
                let test = Test::new(&formats, &ray, &patch);
                for edge in QUAD.iter().flatten().chain(&TRIANGLE) {
                    let forward = Edge { backward: false, ..*edge };
                    let expansion = test.along(&test.normal(&forward), test.dir).sign();
                    prop_assert_eq!(test.orientation(&forward), expansion);
                    prop_assert_eq!(test.side(edge), test.along(&test.normal(edge), test.dir).sign());
                }
            }
        }
    }

    #[test]
    fn intersect_hits_only_what_the_wires_have_inside(
        (formats, patch, rays) in (widths(), 0_usize..3, 0.0_f64..1.0).prop_flat_map(|((f, d, t), mode, share)| {
            let keep = 4 + (share * f64::from(2 * f - 4)) as u32;
            let formats = Formats {
                rounding: MODES[mode],
                cross_keep_bits: (share < 0.7).then_some(keep),
                ..formats(f, d, t)
            };
            (Just(formats), patch(f), prop::collection::vec(ray(f, d, t), 8))
        })
    ) {
        for ray in rays {
            let test = Test::new(&formats, &ray, &patch);
            let wires = wires(&formats, &ray, &patch);
            let loops: &[[Edge; 3]] = if patch.is_triangle { &[TRIANGLE] } else { &QUAD };
            for (triangle, edges) in wires.triangles.iter().flatten().zip(loops) {
                prop_assert_eq!(triangle.inside, test.contains(edges));
                for edge in edges {
                    let sign = test.along(&test.normal(edge), test.dir).sign();
                    prop_assert!(test.clear_side(edge).is_none_or(|clear| clear == sign));
                }
                // The face's den is the sum of the edge values.
                let sum = edges.iter().map(|edge| test.along(&test.normal(edge), test.dir).to_i128()).sum::<i128>();
                prop_assert_eq!(triangle.den, sum);
                prop_assert!(triangle.den != 0 || !triangle.inside);
            }
            let inside = wires.triangles.iter().flatten().any(|triangle| triangle.inside);
            prop_assert!(inside || intersect(&formats, &ray, &patch).is_none());
        }
    }

    #[test]
    fn rounded_quotient_of_wide_words_equals_its_definition(
        (den, q) in prop_oneof![
            (1_i128..20, 0_i128..=1 << 34),
            (1_i128..1 << 69, 0_i128..=1 << 34),
            (1_i128..1 << 88, 0_i128..1 << 15),
        ],
        at in 0_usize..6,
        near in -2_i128..=2,
    ) {
        // Next to a whole quotient, to a tie, and anywhere between.
        let num = (q * den + [0, den / 2, den / 2, den / 3, (den + 1) / 2, den - 1][at] + near).max(0);
        for mode in MODES {
            prop_assert_eq!(rounded_quotient(&wire(num), &wire(den), mode), Some(defined(num, den, mode)));
        }
    }
}

/// An integer under 2^105.
fn wire(value: i128) -> Wire {
    let mut sum = Wire::ZERO;
    let high = value >> 52 << 52;
    sum.add((value - high) as f64);
    sum.add(high as f64);
    assert_eq!(sum.to_i128(), value);
    sum
}

/// The integer next to num/den; at a tie, the mode's.
fn defined(num: i128, den: i128, mode: Rounding) -> u64 {
    let (floor, rest) = (num / den, num % den);
    let (down, up) = (rest, den - rest);
    let up = match mode {
        Rounding::Floor => false,
        _ if down != up => up < down,
        Rounding::HalfAway => true,
        Rounding::NearestEven => floor % 2 == 1,
    };
    u64::try_from(floor + i128::from(up)).unwrap()
}

#[test]
fn rounded_quotient_small_words_equals_its_definition() {
    let mut ties = 0;
    for num in 0..400 {
        for den in 1..40 {
            for mode in MODES {
                let quotient = rounded_quotient(&wire(num), &wire(den), mode);
                assert_eq!(quotient, Some(defined(num, den, mode)), "{num}/{den} {mode:?}");
            }
            ties += u32::from(2 * (num % den) == den);
        }
    }
    assert!(ties > 200, "{ties}");
}

#[test]
fn rounded_quotient_far_over_every_t_word_is_none() {
    assert_eq!(rounded_quotient(&wire((1 << 41) + 1), &wire(1), Rounding::NearestEven), None);
    assert_eq!(rounded_quotient(&wire((1 << 34) + 1), &wire(1), Rounding::NearestEven), Some((1 << 34) + 1));
}
