//! Tests of expansions: sums, products and rounding against i128, exhaustively on small values, at random on wide ones.

use proptest::prelude::*;

use super::*;

const ALL: [Rounding; 3] = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor];

/// A term m 2^s with |m| < 2^53, as f64 and as an integer.
fn term(m: i64, s: u32) -> (f64, i128) {
    (m as f64 * power_of_two(s.cast_signed()), i128::from(m) << s)
}

/// Smallest first, no zeros, and each part under the lowest set bit of the next one.
fn assert_does_not_overlap(parts: &[f64]) {
    for pair in parts.windows(2) {
        let next = pair[1] as i128;
        assert!(pair[0] != 0.0 && (pair[0].abs() as u128) < 1 << next.trailing_zeros(), "{parts:?}");
    }
}

#[test]
fn add_all_triples_of_small_terms_at_far_scales_equals_i128() {
    let scales = [0, 1, 52, 53, 54, 60];
    let terms: Vec<(f64, i128)> =
        scales.iter().flat_map(|s| [-3, -2, -1, 0, 1, 2, 3, (1 << 53) - 1].map(|m| term(m, *s))).collect();
    let mut cases = 0;
    for x in &terms {
        for y in &terms {
            for z in &terms {
                let mut sum = Expansion::<3>::ZERO;
                [x, y, z].iter().for_each(|t| sum.add(t.0));
                let exact = x.1 + y.1 + z.1;
                assert_eq!(sum.to_i128(), exact);
                assert_eq!(sum.sign(), exact.cmp(&0));
                assert_eq!(sum.compress::<3>().to_i128(), exact);
                assert_does_not_overlap(sum.parts());
                cases += 1;
            }
        }
    }
    assert_eq!(cases, 48 * 48 * 48);
}

fn wide_term() -> impl Strategy<Value = (i64, u32)> {
    // Short words far apart, and words of 53 bits that overlap.
    prop_oneof![(-4_i64..=4, 0_u32..46), (-(1_i64 << 53)..=1 << 53, 0_u32..46)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn add_twelve_wide_terms_equals_i128(terms in prop::collection::vec(wide_term(), 1..=12)) {
        let (mut sum, mut exact) = (Expansion::<12>::ZERO, 0);
        for (m, s) in terms {
            let (x, integer) = term(m, s);
            sum.add(x);
            exact += integer;
        }
        prop_assert_eq!(sum.to_i128(), exact);
        prop_assert_eq!(sum.sign(), exact.cmp(&0));
        assert_does_not_overlap(sum.parts());
        let two: Expansion<2> = sum.compress();
        prop_assert_eq!(two.to_i128(), exact);
        // The estimate is the value to 52 bits.
        let error = (two.estimate() as i128 - exact).unsigned_abs();
        prop_assert!(error <= exact.unsigned_abs() >> 52, "{} off {}", error, exact);
    }

    #[test]
    fn add_scaled_of_wide_pairs_equals_i128(
        terms in prop::collection::vec((-(1_i128 << 90)..1 << 90, -(1_i64 << 34)..=1 << 34), 1..=3),
    ) {
        let (mut sum, mut exact) = (Expansion::<12>::ZERO, 0);
        for (wide, factor) in terms {
            // 90 bits in two parts.
            let mut pair = Expansion::<2>::ZERO;
            let high = wide >> 45 << 45;
            pair.add((wide - high) as f64);
            pair.add(high as f64);
            prop_assert_eq!(pair.to_i128(), wide);
            sum.add_scaled(&pair, factor as f64);
            exact += wide * i128::from(factor);
        }
        prop_assert_eq!(sum.to_i128(), exact);
        prop_assert_eq!(sum.scaled(-1.0).to_i128(), -exact);
    }

    #[test]
    fn rounded_wide_words_equals_the_definition_in_i128(
        word in -(1_i128 << 58)..=1 << 58, shift in 0_u32..=52, tie in any::<bool>(),
    ) {
        // Half of the words at a tie.
        let word = if tie && shift > 0 { (word >> shift << shift) + (1 << (shift - 1)) } else { word };
        for rounding in ALL {
            prop_assert_eq!(rounded(word, shift, rounding), defined(word, shift, rounding));
        }
    }
}

/// word / 2^shift by the expansion.
fn rounded(word: i128, shift: u32, rounding: Rounding) -> i128 {
    let mut exact = Expansion::<2>::ZERO;
    let high = word >> 30 << 30;
    exact.add((word - high) as f64);
    exact.add(high as f64);
    exact.scaled(power_of_two(-shift.cast_signed())).rounded(rounding).to_i128()
}

/// word / 2^shift by the definition: the candidate with the smallest error; at a tie, the mode's.
fn defined(word: i128, shift: u32, rounding: Rounding) -> i128 {
    let unit = 1_i128 << shift;
    let floor = word.div_euclid(unit);
    let error = |candidate: i128| (candidate * unit - word).abs();
    match rounding {
        Rounding::Floor => floor,
        _ if error(floor) < error(floor + 1) => floor,
        _ if error(floor) > error(floor + 1) => floor + 1,
        Rounding::NearestEven => floor + floor.rem_euclid(2),
        Rounding::HalfAway => {
            if floor.abs() > (floor + 1).abs() {
                floor
            } else {
                floor + 1
            }
        }
    }
}

#[test]
fn rounded_small_words_at_every_shift_equals_the_definition() {
    let mut ties = 0;
    for word in -600_i128..=600 {
        for shift in 0..11 {
            for rounding in ALL {
                assert_eq!(rounded(word, shift, rounding), defined(word, shift, rounding), "{word} {shift}");
            }
            ties += u32::from(shift > 0 && word.rem_euclid(1 << shift) == 1 << (shift - 1));
        }
    }
    assert!(ties > 1_000, "{ties}");
}

#[test]
fn rounded_ties_go_where_the_mode_says() {
    let cases =
        [(5, 2, 3, 2), (7, 4, 4, 3), (-5, -2, -3, -3), (-7, -4, -4, -4), (1, 0, 1, 0), (-1, 0, -1, -1)];
    for (halves, even, away, floor) in cases {
        let modes = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor];
        assert_eq!(modes.map(|mode| rounded(halves, 1, mode)), [even, away, floor], "{halves}/2");
    }
}

#[test]
fn two_product_of_30_bit_words_keeps_all_60_bits() {
    let (x, y) = ((1_i64 << 29) + 1, (1_i64 << 29) + 3);
    let (product, rest) = two_product(x as f64, y as f64);
    assert!(rest != 0.0);
    assert_eq!(product as i128 + rest as i128, i128::from(x) * i128::from(y));
}

#[test]
fn power_of_two_at_both_ends_is_exact() {
    for (exponent, value) in [(0, 1.0), (-1, 0.5), (10, 1024.0), (-52, f64::EPSILON)] {
        assert_eq!(power_of_two(exponent), value);
    }
    assert_eq!(power_of_two(64) as u128, 1 << 64);
}
