//! Division: rows of the ICU's chain, or a named unit with cycles of its own.
//!
//! ```text
//! in-pipeline     range check | T + 3 rows, each an adder-subtractor as wide as the divisor | correction | rounding, range test
//! non-restoring   the same, r rows a cycle            newton   check | shift | table | multiplications / M | correction | rounding
//! ```
//! A serial unit has r rows or one multiplier and one set of registers; an unrolled one rows or multipliers for every
//! cycle, and registers behind each. A serial multiplier's M cycles are one path with M cycles of time, an unrolled one
//! is cut into M stages. Tables are counted as memory. Cycles and widths: `fixed/division/`.

use crate::fixed::division::{DividerForm, DividerFormat};
use crate::spec::DivisionUnit;

use super::design::{Block, Design};
use super::hardware::{Hardware, levels};
use super::icu::tag_bits;
use super::operators::Operator;
use super::pipeline::Pipeline;

/// Bits of the words of a Newton unit beyond the T fraction bits: `fixed/division/newton.rs`.
const NEWTON_WORD_BITS: u64 = 7;
/// Guard bits of its dividend: the same.
const NEWTON_GUARD_BITS: u64 = 4;

/// Widths of a division.
struct Widths {
    num: u64,
    den: u64,
    /// Quotient, T + 3.
    quotient: u64,
    /// den (2L + 1), which num is compared with.
    range: u64,
    tags: u64,
}

impl Widths {
    fn of(design: &Design<'_>) -> Widths {
        // Magnitudes: without sign.
        let den = design.wire("den_shifted") - 1;
        let quotient = design.t;
        Widths {
            num: design.wire("num_shifted") - 1,
            den,
            quotient,
            range: den + quotient,
            tags: tag_bits(design),
        }
    }

    /// Remainder, with its sign, divisor and digits.
    fn row_bits(&self) -> u64 {
        2 * self.den + 1 + self.quotient
    }
}

/// The operators of a division beside its rows.
struct Steps {
    check: Operator,
    row: Operator,
    correction: Operator,
    rounding: Operator,
}

impl Steps {
    fn of(design: &Design<'_>, widths: &Widths) -> Steps {
        let timing = design.timing;
        let remainder = widths.den + 1;
        Steps {
            check: timing.adder(widths.range).then(timing.comparator(widths.range)),
            row: timing.adder_subtractor(remainder).undivided(),
            correction: timing.adder(remainder),
            rounding: timing
                .comparator(remainder)
                .then(timing.magnitude(widths.quotient))
                .then(timing.comparator(design.t)),
        }
    }
}

/// The rows of a division without a stated unit, at the end of the ICU's chain.
pub(super) fn in_pipeline(design: &Design<'_>, pipeline: &mut Pipeline<'_>) {
    let widths = Widths::of(design);
    let steps = Steps::of(design, &widths);
    let Widths { num, den, quotient, tags, .. } = widths;
    pipeline.phase("range check", vec![(steps.check, 1)], num + den + tags);
    pipeline.rows("rows of the division", &steps.row, quotient, den + quotient + tags);
    pipeline.phase("correction", vec![(steps.correction, 1)], den + quotient + tags);
    pipeline.phase("rounding and range test", vec![(steps.rounding, 1)], quotient + tags);
}

/// The named unit of every ICU.
pub(super) fn block(design: &Design<'_>) -> Block {
    match design.spec.division.unit {
        DivisionUnit::Newton => newton(design),
        _ => non_restoring(design),
    }
}

fn non_restoring(design: &Design<'_>) -> Block {
    let division = &design.spec.division;
    let widths = Widths::of(design);
    let Steps { check, row, correction, rounding } = Steps::of(design, &widths);
    let radix_log2 = u64::from(division.radix_log2);
    let cycles = widths.quotient.div_ceil(radix_log2);
    let n_rows = cycles * radix_log2;
    let (operands, result) = (widths.num + widths.den, widths.quotient + 1);
    let others = check.hardware + correction.hardware + rounding.hardware;
    let hardware = match division.form {
        DividerForm::Serial => {
            let load = Hardware::multiplexer(widths.row_bits(), 2);
            others
                + row.hardware.times(radix_log2)
                + load
                + Hardware::held(widths.row_bits() + widths.num + widths.tags)
        }
        DividerForm::Unrolled => {
            let stages = cycles + 1;
            let registers = operands + stages * widths.row_bits() + result + (stages + 2) * widths.tags;
            others + row.hardware.times(n_rows) + Hardware::registers(registers)
        }
    };
    let work = others + row.hardware.times(n_rows);
    let paths = [
        (row.total_ns() * radix_log2 as f64, "rows of the division".to_owned()),
        (check.total_ns(), "range check".to_owned()),
        (correction.total_ns(), "correction".to_owned()),
        (rounding.total_ns(), "rounding and range test".to_owned()),
    ];
    Block::new("division", design.modules(), hardware, paths, design.logic_pj(&work))
}

fn newton(design: &Design<'_>) -> Block {
    let (timing, division) = (design.timing, &design.spec.division);
    let widths = Widths::of(design);
    let Steps { check, correction, rounding, .. } = Steps::of(design, &widths);
    let fraction = u64::from(design.spec.formats.t_frac_bits) + NEWTON_WORD_BITS;
    let word = fraction + 2;
    let iterations = u64::from(division.iterations);
    let table_words = 1_u64 << division.table_bits;
    let table_bits = u64::from(division.table_bits) + 2;
    let n_parts = u64::from(DividerFormat::of(&design.spec.formats).den_bits()).div_ceil(word);
    let n_products = 2 * iterations + 1 + n_parts;
    let multiplier = timing.sum_of_products(1, word, word, 2 * word);
    let m_cycles = division.multiplier_cycles;
    let normalise =
        timing.shifter(widths.den, levels(widths.den)).then(timing.shifter(widths.num, levels(widths.den)));
    let zeros = timing.any(widths.den);
    let back = timing.adder(widths.den + 1);
    let others = [&check, &normalise, &zeros, &back, &correction, &rounding]
        .map(|op| op.hardware)
        .into_iter()
        .sum::<Hardware>()
        + Hardware::memory(table_words, table_bits);
    let operands = widths.num + widths.den;
    // Divisor, dividend, reciprocal, factor or quotient.
    let words = 3 * word + widths.quotient + NEWTON_GUARD_BITS;
    let mut chain = Pipeline::new(timing, 1, 2 * word);
    chain.phase("multiplication", vec![(multiplier.clone(), 1)], 0);
    let (hardware, multiplication_ns) = match division.form {
        DividerForm::Serial => {
            let choices = Hardware::multiplexer(2 * word, 4);
            let held = Hardware::held(operands + words + widths.den + 1 + widths.tags);
            (others + multiplier.hardware + choices + held, multiplier.total_ns() / f64::from(m_cycles))
        }
        DividerForm::Unrolled => {
            let cut = chain.cut(m_cycles);
            let cycles = (2 * iterations + 2) * u64::from(m_cycles) + 5;
            let registers = n_products * cut.register_bits + cycles * (operands + words + widths.tags);
            (others + multiplier.hardware.times(n_products) + Hardware::registers(registers), cut.longest_ns)
        }
    };
    let work = others + multiplier.hardware.times(n_products);
    // Half of the two shifters in a row: they work side by side.
    let paths = [
        (multiplication_ns, "multiplication".to_owned()),
        (check.total_ns().max(zeros.total_ns()), "range check".to_owned()),
        (normalise.total_ns() / 2.0, "shift".to_owned()),
        (timing.array_ns(table_words, table_bits), "table of reciprocals".to_owned()),
        (back.total_ns().max(correction.total_ns()), "correction".to_owned()),
        (rounding.total_ns(), "rounding and range test".to_owned()),
    ];
    let event_pj = design.logic_pj(&work) + design.access_pj(table_words, table_bits);
    Block::new("division", design.modules(), hardware, paths, event_pj)
}
