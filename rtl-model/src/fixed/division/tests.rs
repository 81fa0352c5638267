//! The division units against `Rounding::divide`, their timing, their widths.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::*;
use crate::datapath::test_support::{formats, widths};
use crate::fixed::{Formats, Rounding};

pub(super) const MODES: [Rounding; 3] = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor];
pub(super) const FORMS: [DividerForm; 2] = [DividerForm::Serial, DividerForm::Unrolled];

/// A divider for quotients up to 4 * 2^T and small divisors: every operand can be tried.
pub(super) fn small(t_frac_bits: u32, den_max: u128, rounding: Rounding) -> DividerFormat {
    DividerFormat { t_frac_bits, num_max: den_max * ((4 << t_frac_bits) + 2), den_max, rounding }
}

pub(super) fn parameters(table_bits: u32, iterations: u32) -> NewtonParameters {
    NewtonParameters { table_bits, iterations, multiplier_cycles: 1 }
}

/// What a divider must answer.
pub(super) fn expected(format: &DividerFormat, num: u128, den: u128) -> Option<u64> {
    let quotient = format.rounding.divide(num.cast_signed(), den.cast_signed());
    u64::try_from(quotient).ok().filter(|q| u128::from(*q) <= format.limit())
}

/// Every num up to two quotients over the limit and every den of six bits.
fn assert_exhaustive(format: DividerFormat, unit: &Divider) -> usize {
    let mut divisions = 0;
    for den in 1..=format.den_max {
        for num in 0..=den * (format.limit() + 2) {
            let divided = unit.divide(num, den).unwrap();
            assert_eq!(divided.quotient, expected(&format, num, den), "{num} / {den} by {unit:?}");
            divisions += 1;
        }
    }
    divisions
}

#[test]
fn non_restoring_every_small_operand_equals_rounding_divide() {
    let mut divisions = 0;
    for mode in MODES {
        for radix_log2 in 1..=4 {
            let format = small(2, 63, mode);
            let unit = NonRestoring::new(format, radix_log2, DividerForm::Serial).unwrap();
            divisions += assert_exhaustive(format, &Divider::NonRestoring(unit));
        }
    }
    assert_eq!(divisions, 12 * (63 + 18 * 63 * 32));
}

#[test]
fn newton_every_small_operand_equals_rounding_divide() {
    let mut units = 0;
    for mode in MODES {
        for (table_bits, iterations) in [(1, 2), (2, 1), (3, 1), (5, 0), (6, 1), (1, 5)] {
            let format = small(2, 63, mode);
            for form in FORMS {
                let Ok(unit) = Newton::new(format, parameters(table_bits, iterations), form) else {
                    continue;
                };
                assert!(assert_exhaustive(format, &Divider::Newton(unit)) > 30_000);
                units += 1;
            }
        }
    }
    assert!(units > 20, "{units} units tried");
}

/// How the raw numbers of a case become a division.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    den: u32,
    quotient: u32,
    rest: u32,
    raw: [u128; 3],
}

pub(super) fn shape() -> impl Strategy<Value = Shape> {
    (0u32..10, 0u32..9, 0u32..8, any::<[u128; 3]>()).prop_map(|(den, quotient, rest, raw)| Shape {
        den,
        quotient,
        rest,
        raw,
    })
}

/// Divisors of every length, powers of two and their neighbours, ends of a reciprocal table's intervals; quotients of
/// every size, at and around the limit; remainders at 0, at exact ties and a unit beside them; the largest operands.
pub(super) fn operands(format: &DividerFormat, shape: &Shape) -> (u128, u128) {
    let [a, b, c] = shape.raw;
    let power = 1_u128 << (a % u128::from(format.den_bits()));
    let random = (b % power) + power;
    let low_ones = (power >> 12).saturating_sub(1);
    let den = match shape.den {
        0 => 1,
        1 => power,
        2 => power + 1,
        3 => power - 1,
        4 => format.den_max,
        5 => format.den_max - a % 4,
        6 => random | low_ones,
        7 => random & !low_ones,
        _ => random,
    };
    let den = den.clamp(1, format.den_max);
    let limit = format.limit();
    let quotient = match shape.quotient {
        0 => 0,
        1 => limit,
        2 => limit + 1,
        3 => limit - 1,
        4 => limit - c % 64,
        5 => 1 << (c % u128::from(format.quotient_bits())),
        _ => c % (limit + 2),
    };
    let den = if (quotient + 1) * den > format.num_max { format.num_max / (quotient + 1) } else { den };
    let rest = match shape.rest {
        0 => 0,
        1 => 1,
        2 => den - 1,
        3 => den / 2,
        4 => den / 2 + 1,
        5 => (den / 2).saturating_sub(1),
        _ => b % den,
    };
    let num = quotient * den + rest % den;
    match c % 97 {
        0 => (format.num_max, den),
        1 => (b % (format.num_max + 1), den),
        _ => (num, den),
    }
}

pub(super) fn any_formats() -> impl Strategy<Value = Formats> {
    (widths(), prop::sample::select(MODES.to_vec()), prop::option::of(4u32..=16))
        .prop_map(|(w, rounding, keep)| Formats { rounding, cross_keep_bits: keep, ..formats(w.0, w.1, w.2) })
}

const DIVISIONS_A_CASE: usize = 128;

/// Runs 1000 cases of 128 divisions each on units of this kind.
fn assert_equals_rounding_divide(units: impl Strategy<Value = (DividerFormat, Divider)>) {
    let (divisions, ties, at_limit, refused, zeros) =
        (Cell::new(0_u32), Cell::new(0_u32), Cell::new(0_u32), Cell::new(0_u32), Cell::new(0_u32));
    let config = ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() };
    let cases = (units, prop::collection::vec(shape(), DIVISIONS_A_CASE));
    let result = TestRunner::new(config).run(&cases, |((format, unit), shapes)| {
        for shape in &shapes {
            let (num, den) = operands(&format, shape);
            let divided = unit.divide(num, den).unwrap();
            prop_assert_eq!(divided.quotient, expected(&format, num, den), "{} / {}", num, den);
            let cycles = if divided.quotient.is_some() { unit.latency_cycles() } else { 1 };
            prop_assert_eq!(divided.cycles, cycles);
            let count = |counter: &Cell<u32>, is: bool| counter.set(counter.get() + u32::from(is));
            count(&divisions, true);
            count(&ties, 2 * (num % den) == den && divided.quotient.is_some());
            count(&at_limit, divided.quotient.map(u128::from) == Some(format.limit()));
            count(&refused, divided.quotient.is_none());
            count(&zeros, num == 0);
        }
        Ok(())
    });
    result.unwrap();
    assert!(divisions.get() >= 100_000, "{} divisions", divisions.get());
    for (what, count) in
        [("ties", ties), ("at the limit", at_limit), ("refused", refused), ("num = 0", zeros)]
    {
        assert!(count.get() > 500, "{what}: {} cases", count.get());
    }
}

#[test]
fn non_restoring_adversarial_operands_at_full_widths_equal_rounding_divide() {
    assert_equals_rounding_divide((any_formats(), 1u32..=4, prop::sample::select(FORMS.to_vec())).prop_map(
        |(formats, radix_log2, form)| {
            let format = DividerFormat::of(&formats);
            (format, Divider::NonRestoring(NonRestoring::new(format, radix_log2, form).unwrap()))
        },
    ));
}

#[test]
fn newton_adversarial_operands_at_full_widths_equal_rounding_divide() {
    let form = prop::sample::select(FORMS.to_vec());
    assert_equals_rounding_divide((any_formats(), 1u32..=12, 0u32..2, 1u32..4, form).prop_map(
        |(formats, table_bits, more, multiplier_cycles, form)| {
            let format = DividerFormat::of(&formats);
            // The fewest iterations that are accepted, where the estimate is worst, or one more.
            let unit = (0..=5)
                .filter_map(|n| {
                    let parameters =
                        NewtonParameters { multiplier_cycles, ..parameters(table_bits, (n + more).min(5)) };
                    Newton::new(format, parameters, form).ok()
                })
                .next();
            (format, Divider::Newton(unit.expect("five iterations do for every width")))
        },
    ));
}

#[test]
fn divider_format_of_every_width_holds_the_datapath_operands_and_fits_128_bits() {
    let mut tried = 0;
    for (f, d, t) in [(8, 8, 8), (28, 8, 8), (8, 28, 32), (24, 24, 24), (28, 28, 32), (28, 8, 32), (8, 8, 32)]
    {
        for rounding in MODES {
            let formats = Formats { rounding, ..formats(f, d, t) };
            let format = DividerFormat::of(&formats);
            let (side, dir) = ((1_u128 << (f + 1)) - 1, (1_u128 << d) - 1);
            let (up, down) = formats.t_shifts();
            assert_eq!(format.num_max, (2 * side * side * side) << up);
            assert_eq!(format.den_max, (3 * side * side * dir) << down);
            assert_eq!((format.t_frac_bits, format.rounding), (t, rounding));
            // The longest of all intermediate values: the range check's, and a divisor before its shift.
            assert!(format.range_wire().bits < 127);
            assert!(format.den_bits() + t + 7 <= 128 && format.num_max.leading_zeros() >= 4);
            tried += 1;
        }
    }
    assert_eq!(tried, 21);
}

#[test]
fn dividers_at_the_largest_operands_of_every_width_equal_rounding_divide() {
    let mut tried = 0;
    for (f, d, t) in [(8, 8, 8), (28, 8, 8), (8, 28, 32), (24, 24, 24), (28, 28, 32), (28, 8, 32)] {
        for rounding in MODES {
            let format = DividerFormat::of(&Formats { rounding, ..formats(f, d, t) });
            let DividerFormat { num_max, den_max, .. } = format;
            let newton = Newton::new(format, parameters(9, 2), DividerForm::Serial).unwrap();
            let recurrence = NonRestoring::new(format, 3, DividerForm::Serial).unwrap();
            for unit in [Divider::Newton(newton), Divider::NonRestoring(recurrence)] {
                for (num, den) in
                    [(num_max, den_max), (num_max, 1), (1, den_max), (num_max, num_max.min(den_max) / 2)]
                {
                    let quotient = unit.divide(num, den).unwrap().quotient;
                    assert_eq!(quotient, expected(&format, num, den), "{num} / {den} by {unit:?}");
                    tried += 1;
                }
                assert_eq!(
                    unit.divide(num_max + 1, 1),
                    Err(DivisionError::Operand { name: "num", value: num_max + 1, max: num_max })
                );
                assert_eq!(
                    unit.divide(1, den_max + 1),
                    Err(DivisionError::Operand { name: "den", value: den_max + 1, max: den_max })
                );
            }
        }
    }
    assert_eq!(tried, 6 * 3 * 2 * 4);
}

#[test]
fn dividers_divisor_zero_is_no_hit_and_dividend_zero_is_zero_at_full_latency() {
    for rounding in MODES {
        let format = DividerFormat::of(&Formats { rounding, ..Formats::default() });
        let newton = Newton::new(format, parameters(8, 2), DividerForm::Serial).unwrap();
        let recurrence = NonRestoring::new(format, 1, DividerForm::Serial).unwrap();
        for unit in [Divider::Newton(newton), Divider::NonRestoring(recurrence)] {
            for num in [0, 1, format.num_max] {
                assert_eq!(unit.divide(num, 0), Ok(Divided { quotient: None, cycles: 1 }));
            }
            for den in [1, 2, 3, format.den_max] {
                let cycles = unit.latency_cycles();
                assert_eq!(unit.divide(0, den), Ok(Divided { quotient: Some(0), cycles }));
            }
        }
    }
}

#[test]
fn dividers_quotients_around_the_limit_are_refused_exactly_when_they_round_over_it() {
    // 4.0 = 16 at T = 2; num / 10 in tenths around 16.5 and 17.
    for (mode, last_accepted) in [(MODES[0], 165), (MODES[1], 164), (MODES[2], 169)] {
        let format = small(2, 10, mode);
        let newton = Newton::new(format, parameters(3, 2), DividerForm::Serial).unwrap();
        let recurrence = NonRestoring::new(format, 2, DividerForm::Serial).unwrap();
        for unit in [Divider::Newton(newton), Divider::NonRestoring(recurrence)] {
            for num in 160..=175 {
                let quotient = (num <= last_accepted).then_some(16);
                assert_eq!(unit.divide(num, 10).unwrap().quotient, quotient, "{num} / 10, {mode:?}");
            }
        }
    }
}

#[test]
fn dividers_parameters_outside_their_ranges_are_refused_by_name() {
    let format = DividerFormat::of(&Formats::default());
    let serial = DividerForm::Serial;
    let parameter = |name, value, min, max| DivisionError::Parameter { name, value, min, max };
    for radix_log2 in [0, 5] {
        let error = parameter("radix_log2", radix_log2, 1, 4);
        assert_eq!(NonRestoring::new(format, radix_log2, serial), Err(error));
    }
    let good = parameters(8, 2);
    let cases = [
        (NewtonParameters { table_bits: 0, ..good }, parameter("table_bits", 0, 1, 12)),
        (NewtonParameters { table_bits: 13, ..good }, parameter("table_bits", 13, 1, 12)),
        (NewtonParameters { iterations: 6, ..good }, parameter("iterations", 6, 0, 5)),
        (NewtonParameters { multiplier_cycles: 0, ..good }, parameter("multiplier_cycles", 0, 1, 16)),
        (NewtonParameters { multiplier_cycles: 17, ..good }, parameter("multiplier_cycles", 17, 1, 16)),
    ];
    for (parameters, error) in cases {
        assert_eq!(Newton::new(format, parameters, serial), Err(error));
    }
}
