//! Latency, interval and wires of the division units: formulas against the cycles and registers of their steps.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::tests::{FORMS, any_formats, operands, parameters, shape};
use super::*;
use crate::datapath::test_support::formats;
use crate::fixed::{Formats, Rounding};

#[test]
fn non_restoring_latency_is_the_cycles_of_its_steps_and_its_formula() {
    let mut tried = 0;
    for t in 8..=32 {
        for radix_log2 in 1..=4 {
            for form in FORMS {
                let format = DividerFormat::of(&formats(24, 24, t));
                let unit = NonRestoring::new(format, radix_log2, form).unwrap();
                let latency = unit.divide(5 << t, 3).unwrap().cycles;
                assert_eq!(latency, 3 + (t + 3).div_ceil(radix_log2));
                assert_eq!(unit.latency_cycles(), latency);
                let interval = if form == DividerForm::Serial { latency } else { 1 };
                let unit = Divider::NonRestoring(unit);
                assert_eq!((unit.latency_cycles(), unit.initiation_interval_cycles()), (latency, interval));
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 25 * 4 * 2);
}

#[test]
fn newton_latency_is_the_cycles_of_its_steps_and_its_formula() {
    let mut tried = 0;
    // Divisors of 76, 28 and 88 bits, multipliers of T + 9: passes of the serial back-multiplication.
    for (format, passes) in [((24, 24, 24), 3), ((8, 8, 24), 1), ((28, 28, 32), 3), ((28, 28, 8), 6)] {
        let format = DividerFormat::of(&formats(format.0, format.1, format.2));
        for iterations in 3..=5 {
            for multiplier_cycles in [1, 2, 3, 16] {
                for (form, passes) in [(DividerForm::Serial, passes), (DividerForm::Unrolled, 1)] {
                    let parameters = NewtonParameters { table_bits: 4, iterations, multiplier_cycles };
                    let unit = Newton::new(format, parameters, form).unwrap();
                    let latency = unit.divide(5 << format.t_frac_bits, 3).unwrap().cycles;
                    assert_eq!(
                        latency,
                        5 + (2 * iterations + 1 + passes) * multiplier_cycles,
                        "{parameters:?}"
                    );
                    assert_eq!(unit.latency_cycles(), latency);
                    let interval = if form == DividerForm::Serial { latency } else { 1 };
                    let unit = Divider::Newton(unit);
                    assert_eq!(
                        (unit.latency_cycles(), unit.initiation_interval_cycles()),
                        (latency, interval)
                    );
                    tried += 1;
                }
            }
        }
    }
    assert_eq!(tried, 4 * 3 * 4 * 2);
}

#[test]
fn dividers_at_the_default_formats_have_the_latencies_of_the_module_table() {
    let format = DividerFormat::of(&Formats::default());
    let recurrence =
        |radix_log2| FORMS.map(|f| NonRestoring::new(format, radix_log2, f).unwrap().latency_cycles());
    assert_eq!([1, 2, 3, 4].map(recurrence), [[30, 30], [17, 17], [12, 12], [10, 10]]);
    let newton = |table_bits, iterations, multiplier_cycles| {
        let parameters = NewtonParameters { table_bits, iterations, multiplier_cycles };
        FORMS.map(|form| Newton::new(format, parameters, form).unwrap().latency_cycles())
    };
    assert_eq!([newton(8, 2, 1), newton(8, 2, 2), newton(3, 3, 1)], [[13, 11], [21, 17], [15, 13]]);
}

/// Registers of every cycle of a division, by name.
fn values_by_cycle(unit: &Divider, num: u128, den: u128) -> Vec<(&'static str, i128)> {
    let mut seen = Vec::new();
    match unit {
        Divider::NonRestoring(unit) => {
            let mut registers = unit.start(num, den).unwrap();
            while !registers.is_done() {
                unit.step(&mut registers);
                seen.extend(registers.values());
            }
        }
        Divider::Newton(unit) => {
            let mut registers = unit.start(num, den).unwrap();
            while !registers.is_done() {
                unit.step(&mut registers);
                seen.extend(registers.values());
            }
        }
    }
    seen
}

#[test]
fn dividers_registers_stay_in_their_widths_in_every_cycle() {
    let config = ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() };
    let cases = (any_formats(), 1u32..=4, 3u32..=12, prop::collection::vec(shape(), 40));
    let n_values = Cell::new(0_usize);
    let result = TestRunner::new(config).run(&cases, |(formats, radix_log2, table_bits, shapes)| {
        let format = DividerFormat::of(&formats);
        for form in FORMS {
            let units = [
                Divider::NonRestoring(NonRestoring::new(format, radix_log2, form).unwrap()),
                Divider::Newton(Newton::new(format, parameters(table_bits, 4), form).unwrap()),
            ];
            for unit in &units {
                let table = unit.width_table();
                for shape in &shapes {
                    let (num, den) = operands(&format, shape);
                    for (name, value) in values_by_cycle(unit, num, den) {
                        let wire = table.iter().find(|w| w.wire == name).expect(name);
                        prop_assert!(value.abs() <= wire.max_magnitude, "{} = {} of {:?}", name, value, wire);
                        n_values.set(n_values.get() + 1);
                    }
                }
            }
        }
        Ok(())
    });
    result.unwrap();
    assert!(n_values.get() > 500_000, "{}", n_values.get());
}

/// The rows of a unit's width table as (name, bits, fraction bits, largest magnitude).
fn rows(table: &[WireWidth]) -> Vec<(&'static str, u32, u32, i128)> {
    table.iter().map(|w| (w.wire, w.bits, w.frac_bits, w.max_magnitude)).collect()
}

#[test]
fn dividers_width_tables_at_the_default_formats_are_those_of_their_docs() {
    let format = DividerFormat::of(&Formats::default());
    let den = 3 * ((1_i128 << 25) - 1).pow(2) * ((1 << 24) - 1);
    let num = (2 * ((1_i128 << 25) - 1).pow(3)) << 24;
    let four = 1_i128 << 26;
    let range = ("div_range", 103, 0, den * (2 * four + 1));
    let unit = Divider::NonRestoring(NonRestoring::new(format, 2, DividerForm::Serial).unwrap());
    let digits = ("div_digits", 28, 24, (1 << 28) - 1);
    let expected =
        vec![range, ("div_remainder", 77, 0, den), ("div_shifted_remainder", 78, 0, 2 * den), digits];
    assert_eq!(rows(&unit.width_table()), expected);
    let unit = Divider::Newton(Newton::new(format, parameters(8, 2), DividerForm::Serial).unwrap());
    // 1 + e_0 = 1 + 1/513 + 2^-11 in words of 31 fraction bits.
    let factor = (1_i128 << 31) + ((1 << 31) / 513 + (1 << 20)) + 1;
    let expected = vec![
        range,
        ("div_divisor", 31, 31, (1 << 31) - 1),
        ("div_dividend", 31, 4, (four + 1) * 16 - 1),
        ("div_reciprocal", 33, 31, (1 << 32) + 2),
        ("div_factor", 32, 31, factor),
        ("div_quotient", 27, 24, four + 1),
        ("div_remainder", 101, 0, num),
    ];
    assert_eq!(rows(&unit.width_table()), expected);
    let floor = DividerFormat { rounding: Rounding::Floor, ..format };
    assert_eq!(rows(&[floor.range_wire()]), [("div_range", 102, 0, den * (four + 1))]);
}
