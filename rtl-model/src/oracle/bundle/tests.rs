//! Tests of the bundle oracle: the table's distance from rounding ties, exact sums against i128, worked rays.

use super::*;

/// Every place of the table and every width: neither this computation nor another good one can round to another word.
#[test]
fn table_entry_every_width_is_far_from_a_rounding_tie() {
    // Each component comes from at most ten operations on values of at most 1, each off by at most 2^-53 of them (an
    // ulp for tan and for the angle): under 2^-49 together; so is any other computation of that kind.
    let error = 2.0_f64.powi(-49);
    let (mut checked, mut closest) = (0, f64::INFINITY);
    for place in 0..64 * 64 {
        let direction = concentric(f64::from(place % 64), f64::from(place / 64));
        for d in 8..=28 {
            for component in direction {
                let word = libm::scalbn(component, d);
                let from_tie = (word - word.floor() - 0.5).abs();
                assert!(from_tie > (2.0 * libm::scalbn(error, d)).max(1e-9), "{place} D = {d}: {word}");
                closest = from_tie.min(closest);
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 4096 * 21 * 3);
    assert!(closest < 1e-3, "{closest}: some of 258,048 values must be near a tie");
}

/// The same words from integers alone: z^2 64^2 = 64^2 - r^2, so a word w is right when (2 w - 1)^2 64^2 <
/// 4 (64^2 - r^2) 2^(2D) < (2 w + 1)^2 64^2; and x^2 + y^2 = r^2 to the rounding of x and y.
#[test]
fn table_entry_heights_are_the_rounded_roots_in_integers() {
    for d in [8_u32, 17, 28] {
        for place in 0..64 * 64_i128 {
            let [x, y, z] = table_entry(bits(d), (place % 64) as f64, (place / 64) as f64).map(|x| x as i128);
            let at = |place: i128| (2 * place).max(1) - 64;
            let r = at(place % 64).abs().max(at(place / 64).abs());
            let exact = 4 * ((64 * 64 - r * r) << (2 * d));
            let bound = |odd: i128| odd * odd * 64 * 64;
            assert!(bound(2 * z - 1) < exact && exact < bound(2 * z + 1), "D = {d} place {place}: {z}");
            // (x +- 1/2)^2 + (y +- 1/2)^2 differs from r^2 by at most |x| + |y| + 1/2, with words of r in 64ths.
            let miss = ((x * x + y * y) * 64 * 64 - ((r * r) << (2 * d))).abs();
            assert!(miss <= (x.abs() + y.abs() + 1) * 64 * 64, "D = {d} place {place}: {x} {y}");
            assert!(x * at(place % 64) >= 0 && y * at(place / 64) >= 0, "D = {d} place {place}: quadrant");
        }
    }
}

#[test]
fn concentric_map_on_axes_diagonals_and_centre_has_its_closed_form() {
    let near = |p: [f64; 3], q: [f64; 3]| p.iter().zip(q).all(|(a, b)| (a - b).abs() < 1e-15);
    assert_eq!(concentric(32.0, 32.0), [0.0, 0.0, 1.0]);
    let (half, root) = (0.5, 0.75_f64.sqrt());
    assert!(near(concentric(48.0, 32.0), [half, 0.0, root]));
    assert!(near(concentric(16.0, 32.0), [-half, 0.0, root]));
    assert!(near(concentric(32.0, 48.0), [0.0, half, root]));
    assert!(near(concentric(32.0, 16.0), [0.0, -half, root]));
    let diagonal = half * 0.5_f64.sqrt();
    for (column, row) in [(48.0, 48.0), (16.0, 48.0), (48.0, 16.0), (16.0, 16.0)] {
        let sign = |place: f64| (place - 32.0).signum();
        assert!(near(concentric(column, row), [sign(column) * diagonal, sign(row) * diagonal, root]));
    }
    // At 3/8 and 1/8 of the half side: r = 3/8, a twelfth of a half turn from x.
    let turn = std::f64::consts::PI / 12.0;
    let expected = [0.375 * turn.cos(), 0.375 * turn.sin(), (1.0_f64 - 0.375 * 0.375).sqrt()];
    assert!(near(concentric(44.0, 36.0), expected));
    // Place 0 stands at 1/128: 63/64 of the half side.
    assert!(near(concentric(0.0, 32.0), [-63.0 / 64.0, 0.0, (1.0_f64 - (63.0_f64 / 64.0).powi(2)).sqrt()]));
}

#[test]
fn table_place_strata_of_powers_of_two_stand_at_their_centres() {
    assert_eq!(table_place(0.5, 1), 32.0);
    assert_eq!([0.5, 1.5].map(|place| table_place(place, 2)), [16.0, 48.0]);
    assert_eq!([0.5, 31.5].map(|place| table_place(place, 32)), [1.0, 63.0]);
    assert_eq!([0.5, 63.5].map(|place| table_place(place, 64)), [0.0, 63.0]);
    // Three strata: centres 64/6 = 10.67, 32, 53.33.
    assert_eq!([0.5, 1.5, 2.5].map(|place| table_place(place, 3)), [10.0, 32.0, 53.0]);
}

/// Sums, lengths and rounding of whole numbers around 2^57 and their ties, against i128.
#[test]
fn direction_words_of_long_sums_equal_the_integers() {
    let mut checked = 0;
    let p = [(1 << 28) - 1, 1 << 28, 3, -(1 << 27) - 1];
    let q = [1 << 28, (1 << 28) - 1, -1, 5, 0, (1 << 27) + 1];
    let triples = |words: &[i64], n: usize| {
        let at = |place: usize| words[place % words.len()];
        [at(n), at(n / words.len()), at(n / words.len() / words.len())]
    };
    for left in 0..p.len().pow(3) {
        for right in 0..q.len().pow(3) {
            let (p, q) = (triples(&p, left), triples(&q, right));
            let exact: i128 = (0..3).map(|k| i128::from(p[k]) * i128::from(q[k])).sum();
            let sum = sum_of_products(p.map(|w| w as f64), q.map(|w| w as f64));
            assert_eq!(sum.0 as i128 + sum.1 as i128, exact, "{p:?} . {q:?}");
            let length = i128::BITS - exact.unsigned_abs().leading_zeros();
            assert_eq!(bit_length(sum), length.cast_signed(), "{exact}");
            for d in [8_u32, 20, 28] {
                let Some(drop) = length.checked_sub(d).filter(|drop| *drop > 0) else { continue };
                let (floor, rest) = (exact >> drop, exact - (exact >> drop << drop));
                let half = 1_i128 << (drop - 1);
                let nearest = floor + i128::from(rest > half || (rest == half && floor & 1 == 1));
                let scaled = |part: f64| libm::scalbn(part, -drop.cast_signed());
                assert_eq!(round((scaled(sum.0), scaled(sum.1))) as i128, nearest, "{exact} / 2^{drop}");
                checked += 1;
            }
        }
    }
    assert!(checked > 10_000, "{checked}");
}

#[test]
fn bit_length_just_below_a_power_of_two_sees_the_lost_part() {
    let power = libm::scalbn(1.0, 57);
    assert_eq!(bit_length((power, -1.0)), 57);
    assert_eq!(bit_length((power, 0.0)), 58);
    assert_eq!(bit_length((-power, 1.0)), 57);
    assert_eq!(bit_length((0.0, 0.0)), 0);
    // 2^57 - 1 is 1.0 in 28 bits: one more bit of length.
    assert_eq!(
        direction_words([(power, -1.0), (0.0, 0.0), (-power, 0.0)], 28),
        ([1 << 27, 0, -(1 << 27)], 58)
    );
    assert_eq!(direction_words([(power, -1.0), (0.0, 0.0), (0.0, 0.0)], 28), ([1 << 27, 0, 0], 58));
}

#[test]
fn ray_worked_examples_of_every_kind() {
    let formats = Formats { coord_frac_bits: 8, dir_frac_bits: 8, t_frac_bits: 8, ..Formats::default() };
    let apex = [0; 3];
    let tile = |corner| BundleWords::Tile { apex, corner, step_u: [0; 3], step_v: [0; 3], n: 1, m: 1 };
    // 1 - 2^-16 rounds to 1.0 in 8 bits, no word: half of it, scale 1.
    let one = RayWords { origin: apex, dir: [128, 0, 0], t_max: 1024 };
    assert_eq!(scaled_ray(&formats, &tile([(1 << 16) - 1, 0, 256]), 0), (one, 1));
    // A tie: 257 / 2 = 128.5, to even; -3 / 2 = -1.5, to even.
    assert_eq!(ray(&formats, &tile([257, -3, 0]), 0).dir, [128, -2, 0]);
    // 3 steps away: direction 3/4, t_max 4/256; at 2^-8 of a t step it would be under one.
    let targets = BundleWords::Targets { apex, points: vec![[0, 3, 0], [0, 0, -256]] };
    assert_eq!(
        scaled_ray(&formats, &targets, 0),
        (RayWords { origin: apex, dir: [0, 192, 0], t_max: 4 }, -6)
    );
    // 1.0 away needs 9 bits: direction 1/2, t_max 2.
    assert_eq!(ray(&formats, &targets, 1), RayWords { origin: apex, dir: [0, 0, -128], t_max: 512 });
    let coarse = Formats { coord_frac_bits: 20, ..formats };
    assert_eq!(ray(&coarse, &targets, 0).t_max, 1);
    // The middle of a 4 x 4 square around z = 64, one step above it in y by half a step of jitter, tie to even.
    let vertices = [[-2, -2, 64], [2, -2, 64], [-2, 3, 64]];
    let fan = BundleWords::Fan { apex, vertices, n: 1, m: 1, jitter: [2048, 2048] };
    assert_eq!(ray(&formats, &fan, 0), RayWords { origin: apex, dir: [0, 0, 128], t_max: 128 });
    let frame = [[256, 0, 0], [0, 256, 0], [0, 0, 256]];
    let up = BundleWords::Hemisphere { apex, frame, n: 1, m: 1, jitter: [32; 2] };
    assert_eq!(scaled_ray(&formats, &up, 0), (RayWords { origin: apex, dir: [0, 0, 128], t_max: 1024 }, 1));
}
