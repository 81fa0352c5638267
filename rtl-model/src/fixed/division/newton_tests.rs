//! The reciprocal table and the error bound of the Newton unit against measured errors.

use super::tests::{MODES, expected, parameters, small};
use super::*;
use crate::datapath::test_support::formats;
use crate::fixed::Formats;

const ONE: f64 = (1_u128 << ERROR_FRAC_BITS) as f64;

/// Largest |1 - d y| of entry word `y` over the closed interval of entry `i`, times 2^(2m + 3).
fn largest_error(m: u32, i: usize, y: u128) -> i128 {
    // Ends of the interval have m + 1 fraction bits, y has m + 2.
    let one = 1_i128 << (2 * m + 3);
    let low = (1_i128 << m) + i as i128;
    let y = y.cast_signed();
    (one - low * y).abs().max((one - (low + 1) * y).abs())
}

#[test]
fn reciprocal_table_of_one_and_two_bits_is_that_of_the_hand_computation() {
    // 2^6 / 5, / 7 and 2^8 / 9, / 11, / 13, / 15.
    assert_eq!(reciprocal_table(1), [13, 9]);
    assert_eq!(reciprocal_table(2), [28, 23, 20, 17]);
}

#[test]
fn reciprocal_table_entries_have_the_least_error_of_all_words_and_keep_the_bound() {
    for m in 1..=12 {
        let table = reciprocal_table(m);
        assert_eq!(table.len(), 1 << m);
        let mut worst = 0;
        for (i, y) in table.iter().enumerate() {
            let error = largest_error(m, i, *y);
            for other in [y - 1, y + 1] {
                assert!(error <= largest_error(m, i, other), "entry {i} of {m} bits: {y}, better {other}");
            }
            worst = worst.max(error);
        }
        let (worst, bound) =
            (worst as f64 / (1_u128 << (2 * m + 3)) as f64, table_error_bound(m) as f64 / ONE);
        assert!(worst <= bound && worst > 0.75 * bound, "{m} bits: {worst} of {bound}");
        let closed = 1.0 / (f64::from(1 << (m + 1)) + 1.0) + 1.0 / f64::from(1 << (m + 3));
        assert!((bound / closed - 1.0).abs() < 1e-14, "{m} bits: {bound}, closed form {closed}");
    }
    // Rounded up: 1/5 is no multiple of 2^-62, 1/16 is.
    assert_eq!(table_error_bound(1), (1_u128 << 62) / 5 + 1 + (1 << 58));
}

#[test]
fn reciprocal_bound_holds_for_every_divisor_word_and_is_not_loose() {
    // T = 8: divisor words of 15 bits, all of them.
    let (format, w) = (small(8, (1 << 15) - 1, MODES[0]), 15);
    for (table_bits, iterations) in
        [(1, 0), (1, 1), (1, 2), (1, 3), (1, 4), (2, 1), (3, 2), (5, 1), (8, 1), (12, 0)]
    {
        let mut worst = 0_i128;
        let unit =
            Newton::without_guarantee(format, parameters(table_bits, iterations), DividerForm::Unrolled);
        for d in 1_u128 << (w - 1)..1 << w {
            let mut registers = unit.start(0, d).unwrap();
            while !registers.is_done() {
                unit.step(&mut registers);
            }
            let x = registers.values()[2].1;
            worst = worst.max(((1_i128 << (2 * w)) - d.cast_signed() * x).abs());
        }
        let (worst, bound) = (
            worst as f64 / (1_u64 << (2 * w)) as f64,
            reciprocal_bound(8, table_bits, iterations) as f64 / ONE,
        );
        assert!(worst <= bound && worst > 0.45 * bound, "{table_bits}, {iterations}: {worst} of {bound}");
    }
}

/// The formulas of the module header in f64.
fn bounds_in_f64(t: u32, m: u32, n: u32) -> (f64, f64) {
    let unit = 0.5_f64.powi((t + 7).cast_signed());
    let mut e = 1.0 / (f64::from(1 << (m + 1)) + 1.0) + 0.5_f64.powi((m + 3).cast_signed());
    for _ in 0..n {
        e = e * e + (1.0 + e) * unit;
    }
    let limit = 4.0 * 2_f64.powi(t.cast_signed());
    let of_quotient = (limit + 1.0) * (e + 2.0 * (1.0 + e) * unit) + 2.0 * (1.0 + e) / 16.0 + 0.5;
    (e, of_quotient)
}

#[test]
fn bounds_are_those_of_the_formulas_rounded_up() {
    let mut tried = 0;
    for t in [8, 16, 24, 32] {
        for m in 1..=12 {
            for n in 0..=5 {
                let (e, of_quotient) = bounds_in_f64(t, m, n);
                let bound = QuotientBound::of(t, m, n);
                assert!((reciprocal_bound(t, m, n) as f64 / ONE / e - 1.0).abs() < 1e-6, "{t} {m} {n}");
                assert!((bound.units() / of_quotient - 1.0).abs() < 1e-6, "{t} {m} {n}");
                assert_eq!(bound.is_guaranteed(), of_quotient < 1.0, "{t} {m} {n}");
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 4 * 12 * 6);
    assert!(
        !QuotientBound { words: 1 << 62 }.is_guaranteed()
            && QuotientBound { words: (1 << 62) - 1 }.is_guaranteed()
    );
    assert!((QuotientBound { words: 3 << 60 }.units() - 0.75).abs() < f64::EPSILON);
}

#[test]
fn fewest_table_bits_accepted_are_those_of_the_module_table() {
    let fewest = |t, n| (1..=12).find(|m| QuotientBound::of(t, *m, n).is_guaranteed());
    let row = |t| [0, 1, 2, 3, 4, 5].map(|n| fewest(t, n));
    assert_eq!(row(8), [Some(12), Some(6), Some(3), Some(1), Some(1), Some(1)]);
    assert_eq!(row(16), [None, Some(10), Some(5), Some(2), Some(1), Some(1)]);
    assert_eq!(row(24), [None, None, Some(7), Some(3), Some(1), Some(1)]);
    assert_eq!(row(32), [None, None, Some(9), Some(4), Some(2), Some(1)]);
}

#[test]
fn newton_refusal_states_the_bound_and_what_would_do() {
    let refused = |t, m, n| {
        let format = DividerFormat::of(&formats(24, 24, t));
        Newton::new(format, parameters(m, n), DividerForm::Serial).expect_err("refused").to_string()
    };
    let text = refused(32, 8, 2);
    let bound = format!("{:.4} units", bounds_in_f64(32, 8, 2).1);
    assert!(text.contains(&bound) && bound.starts_with("1.3253"), "{text}, expected {bound}");
    assert!(
        text.contains("table_bits = 8 with iterations = 2") && text.contains("t_frac_bits = 32"),
        "{text}"
    );
    assert!(text.ends_with("expected under 1: table_bits = 9 or iterations = 3"), "{text}");
    // Without iterations no table of 12 bits is enough for 24.
    assert!(refused(24, 8, 0).ends_with("expected under 1: iterations = 2"));
}

/// Divisors at both ends of table intervals, as long as a quotient at the limit allows.
fn interval_ends(format: &DividerFormat, m: u32) -> Vec<u128> {
    let places = (0..1_u128 << m).step_by(1 << m.saturating_sub(5));
    let shift = (format.num_max / (format.limit() + 2)).ilog2() - 1 - m;
    places.flat_map(|i| [((1 << m) + i) << shift, (((1 << m) + i + 1) << shift) - 1]).collect()
}

#[test]
fn newton_refused_parameters_give_wrong_quotients_without_the_refusal() {
    let mut tried = 0;
    for (t, m, n) in
        [(24, 8, 1), (24, 12, 1), (24, 5, 2), (24, 2, 3), (32, 8, 1), (32, 7, 2), (32, 6, 2), (32, 3, 3)]
    {
        let format = DividerFormat::of(&formats(24, 24, t));
        assert!(Newton::new(format, parameters(m, n), DividerForm::Unrolled).is_err(), "{t} {m} {n}");
        let unit = Newton::without_guarantee(format, parameters(m, n), DividerForm::Unrolled);
        let mut wrong = 0;
        for den in interval_ends(&format, m) {
            for rest in [0, 1, den / 2, den - 1] {
                let num = (format.limit() - 1) * den + rest;
                wrong += u32::from(unit.divide(num, den).unwrap().quotient != expected(&format, num, den));
            }
        }
        assert!(wrong > 0, "T = {t}, {m} table bits, {n} iterations: bound {:?}", QuotientBound::of(t, m, n));
        tried += 1;
    }
    assert_eq!(tried, 8);
}

#[test]
fn newton_least_accepted_parameters_are_exact_at_the_ends_of_table_intervals() {
    let mut divisions = 0;
    for (t, m, n) in
        [(8, 12, 0), (8, 6, 1), (16, 10, 1), (24, 7, 2), (24, 3, 3), (24, 1, 4), (32, 9, 2), (32, 4, 3)]
    {
        let format = DividerFormat::of(&Formats { t_frac_bits: t, ..Formats::default() });
        let unit = Newton::new(format, parameters(m, n), DividerForm::Serial).unwrap();
        for den in interval_ends(&format, m) {
            for quotient in [format.limit(), format.limit() - 1, format.limit() / 2 + 1] {
                for rest in [0, 1, den / 2, den - 1] {
                    let num = quotient * den + rest;
                    assert_eq!(
                        unit.divide(num, den).unwrap().quotient,
                        expected(&format, num, den),
                        "{num} / {den}"
                    );
                    divisions += 1;
                }
            }
        }
    }
    assert!(divisions > 4000, "{divisions}");
}
