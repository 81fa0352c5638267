//! Division by a reciprocal: table, Newton-Raphson, estimate, back-multiplication, correction.
//!
//! ```text
//! den --lzc, shift--> d in [1/2, 1) --table--> x_0 --n times x (2 - d x)--> x_n
//! num --same shift--> N ------------------------------------------------- N x_n, to nearest --> q
//!                                                        num - q den --> remainder; below 0: q - 1, + den
//! ```
//! Widths: d, x and the factor 2 - d x have W = T + 7 fraction bits, N has 4, all truncated: at most 41 bits at T = 32,
//! so a product fits 82. Error bound: `newton_bound`; parameters that it does not cover are refused.
//! Timing with a multiplication of M cycles: range check and leading-zero count 1, shift 1, table 1, two dependent
//! multiplications an iteration 2nM, estimate M, back-multiplication P M, correction 1, rounding 1:
//! (2n + 1 + P) M + 5 cycles. q den is longer than the multiplier of (W+2) x (W+2) bits: the serial form takes
//! P = ceil(bits of den / (W+2)) passes, the unrolled one has as many multipliers side by side, P = 1.
//! In the serial form the multiplier is not pipelined; in the unrolled one each multiplication is M stages.
//! Source: Flynn 1970 (On division by functional iteration). Not modelled: shorter words in early iterations, the
//! early start of the next division while the multiplier is free.

use super::format::{bit_length, wire};
use super::newton_bound::check_guarantee;
use super::{
    Divided, DividerForm, DividerFormat, DivisionError, ERROR_FRAC_BITS, check_parameter, clock_to_the_end,
    reciprocal_table, table_error_bound,
};
use crate::fixed::WireWidth;

/// Bits of the words beyond those of the quotient, and fraction bits of the dividend's.
pub(super) const GUARD_BITS: u32 = 4;
/// Largest table: its entries' fraction bits, 14, are fewer than the words', 15 or more.
pub(super) const MAX_TABLE_BITS: u32 = 12;
/// Most iterations: with 1 table bit enough for 32 fraction bits.
pub(super) const MAX_ITERATIONS: u32 = 5;
/// Cycles besides those of the multiplications: check, shift, table, correction, rounding.
const OTHER_CYCLES: u32 = 5;

/// W, fraction bits of the divisor, the reciprocal and the factor.
pub(super) fn word_frac_bits(t_frac_bits: u32) -> u32 {
    t_frac_bits + 3 + GUARD_BITS
}

/// What can be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NewtonParameters {
    /// Index bits of the reciprocal table, 1..=12.
    pub table_bits: u32,
    /// Newton-Raphson iterations, 0..=5.
    pub iterations: u32,
    /// M, cycles of a multiplication, 1..=16.
    pub multiplier_cycles: u32,
}

impl NewtonParameters {
    /// Checks the ranges, not the error bound.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn validate(&self) -> Result<(), DivisionError> {
        check_parameter("table_bits", self.table_bits, 1, MAX_TABLE_BITS)?;
        check_parameter("iterations", self.iterations, 0, MAX_ITERATIONS)?;
        check_parameter("multiplier_cycles", self.multiplier_cycles, 1, 16)
    }
}

/// The unit: its parameters and table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Newton {
    format: DividerFormat,
    parameters: NewtonParameters,
    form: DividerForm,
    table: Vec<u128>,
}

/// What happens in the next cycle, or when the multiplication under way is ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Check,
    Normalise,
    LookUp,
    /// 2 - d x.
    Factor {
        iterations_left: u32,
    },
    /// x (2 - d x).
    Improve {
        iterations_left: u32,
    },
    Estimate,
    /// q times a part of den.
    BackMultiply {
        pass: u32,
    },
    Correct,
    Round,
    Done(Option<u64>),
}

/// The unit's state between two cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NewtonRegisters {
    phase: Phase,
    /// Cycles that the multiplication under way still needs.
    busy_cycles: u32,
    num: u128,
    den: u128,
    divisor: u128,
    dividend: u128,
    reciprocal: u128,
    factor: u128,
    quotient: u128,
    remainder: i128,
}

impl Newton {
    /// A unit whose quotient is exact.
    ///
    /// # Errors
    /// A parameter outside its range, or an estimate that may be one unit or more off.
    pub fn new(
        format: DividerFormat,
        parameters: NewtonParameters,
        form: DividerForm,
    ) -> Result<Self, DivisionError> {
        parameters.validate()?;
        check_guarantee(format.t_frac_bits, parameters)?;
        Ok(Self::without_guarantee(format, parameters, form))
    }

    /// The unit whatever its error bound.
    pub(super) fn without_guarantee(
        format: DividerFormat,
        parameters: NewtonParameters,
        form: DividerForm,
    ) -> Self {
        Newton { format, parameters, form, table: reciprocal_table(parameters.table_bits) }
    }

    fn frac_bits(&self) -> u32 {
        word_frac_bits(self.format.t_frac_bits)
    }

    /// Bits of each factor of the multiplier.
    fn multiplier_bits(&self) -> u32 {
        self.frac_bits() + 2
    }

    /// Parts of den that the back-multiplication takes.
    fn n_parts(&self) -> u32 {
        self.format.den_bits().div_ceil(self.multiplier_bits())
    }

    /// P: how often a back-multiplication waits for the multiplier.
    fn n_passes(&self) -> u32 {
        match self.form {
            DividerForm::Serial => self.n_parts(),
            DividerForm::Unrolled => 1,
        }
    }

    /// (2n + 1 + P) M + 5 cycles.
    pub fn latency_cycles(&self) -> u32 {
        let multiplications = 2 * self.parameters.iterations + 1 + self.n_passes();
        multiplications * self.parameters.multiplier_cycles + OTHER_CYCLES
    }

    /// The latency, or 1 when unrolled.
    pub fn initiation_interval_cycles(&self) -> u32 {
        self.form.initiation_interval_cycles(self.latency_cycles())
    }

    /// Takes the operands.
    ///
    /// # Errors
    /// An operand wider than its register.
    pub fn start(&self, num: u128, den: u128) -> Result<NewtonRegisters, DivisionError> {
        self.format.check_operands(num, den)?;
        Ok(NewtonRegisters {
            phase: Phase::Check,
            busy_cycles: 0,
            num,
            den,
            divisor: 0,
            dividend: 0,
            reciprocal: 0,
            factor: 0,
            quotient: 0,
            remainder: 0,
        })
    }

    /// One cycle.
    pub fn step(&self, s: &mut NewtonRegisters) {
        if s.busy_cycles > 0 {
            s.busy_cycles -= 1;
            return;
        }
        let w = self.frac_bits();
        s.phase = match s.phase {
            Phase::Check if self.format.is_out_of_range(s.num, s.den) => Phase::Done(None),
            Phase::Check => Phase::Normalise,
            Phase::Normalise => {
                let den_bits = bit_length(s.den);
                s.divisor = scaled(s.den, w, den_bits);
                s.dividend = scaled(s.num, GUARD_BITS, den_bits);
                Phase::LookUp
            }
            Phase::LookUp => {
                s.reciprocal = self.first_reciprocal(s.divisor);
                self.next_iteration(self.parameters.iterations)
            }
            Phase::Factor { iterations_left } => {
                s.factor = (2 << w) - ((s.divisor * s.reciprocal) >> w);
                Phase::Improve { iterations_left }
            }
            Phase::Improve { iterations_left } => {
                s.reciprocal = (s.reciprocal * s.factor) >> w;
                self.next_iteration(iterations_left - 1)
            }
            Phase::Estimate => {
                let half = 1 << (w + GUARD_BITS - 1);
                s.quotient = (s.dividend * s.reciprocal + half) >> (w + GUARD_BITS);
                s.remainder = s.num.cast_signed();
                Phase::BackMultiply { pass: 0 }
            }
            Phase::BackMultiply { pass } => {
                let parts = match self.form {
                    DividerForm::Serial => pass..pass + 1,
                    DividerForm::Unrolled => 0..self.n_parts(),
                };
                for part in parts {
                    s.remainder -= self.partial_product(s, part);
                }
                if pass + 1 < self.n_passes() {
                    Phase::BackMultiply { pass: pass + 1 }
                } else {
                    Phase::Correct
                }
            }
            Phase::Correct => {
                if s.remainder < 0 {
                    s.quotient -= 1;
                    s.remainder += s.den.cast_signed();
                }
                Phase::Round
            }
            Phase::Round => {
                Phase::Done(u64::try_from(self.format.rounded(s.quotient, s.remainder, s.den)).ok())
            }
            Phase::Done(quotient) => Phase::Done(quotient),
        };
        s.busy_cycles = match s.phase {
            Phase::Factor { .. } | Phase::Improve { .. } | Phase::Estimate | Phase::BackMultiply { .. } => {
                self.parameters.multiplier_cycles - 1
            }
            _ => 0,
        };
    }

    /// The table's entry for the index bits below the divisor's leading 1, as a word.
    fn first_reciprocal(&self, divisor: u128) -> u128 {
        let (w, m) = (self.frac_bits(), self.parameters.table_bits);
        let leading_one = 1 << m;
        let place = (divisor >> (w - 1 - m)) - leading_one;
        let entry = usize::try_from(place).ok().and_then(|i| self.table.get(i)).copied().unwrap_or(0);
        entry << (w - m - super::reciprocal_table::EXTRA_FRAC_BITS)
    }

    fn next_iteration(&self, iterations_left: u32) -> Phase {
        if iterations_left == 0 { Phase::Estimate } else { Phase::Factor { iterations_left } }
    }

    /// q times part `part` of den, in its place.
    fn partial_product(&self, s: &NewtonRegisters, part: u32) -> i128 {
        let low = part * self.multiplier_bits();
        let word = (s.den >> low) & ((1 << self.multiplier_bits()) - 1);
        ((s.quotient * word) << low).cast_signed()
    }

    /// num / den, rounded once: [`Newton::start`], then [`Newton::step`] to the end.
    ///
    /// # Errors
    /// An operand wider than its register.
    pub fn divide(&self, num: u128, den: u128) -> Result<Divided, DivisionError> {
        let quotient = |registers: &NewtonRegisters| match registers.phase {
            Phase::Done(quotient) => Some(quotient),
            _ => None,
        };
        Ok(clock_to_the_end(self.start(num, den)?, |registers| self.step(registers), quotient))
    }

    /// Width and largest magnitude of each wire.
    ///
    /// With r, tau_1 of `newton_bound`: d x' is largest, 1 + u + u^2/4, at r = -u/2, so the word of x stays under
    /// 2^(W+1) + 3; the factor is 1 + r + tau_1, and no r is larger than the table's.
    pub fn width_table(&self) -> Vec<WireWidth> {
        let (w, format) = (self.frac_bits(), &self.format);
        let error = table_error_bound(self.parameters.table_bits);
        let factor_max = (1 << w) + (error >> (ERROR_FRAC_BITS - w)) + 1;
        let dividend_max = ((format.limit() + 1) << GUARD_BITS) - 1;
        let (one, reciprocal_max) = (1 << w, (2 << w) + 2);
        vec![
            format.range_wire(),
            wire("div_divisor", w, false, one - 1),
            wire("div_dividend", GUARD_BITS, false, dividend_max),
            wire("div_reciprocal", w, false, reciprocal_max),
            wire("div_factor", w, false, factor_max),
            wire("div_quotient", format.t_frac_bits, false, format.limit() + 1),
            wire("div_remainder", 0, true, format.num_max.max(format.den_max)),
        ]
    }
}

/// value 2^(frac_bits - scale_bits), truncated.
fn scaled(value: u128, frac_bits: u32, scale_bits: u32) -> u128 {
    (value << frac_bits) >> scale_bits
}

#[cfg(test)]
impl NewtonRegisters {
    /// The registers by the names of the width table.
    pub(super) fn values(&self) -> Vec<(&'static str, i128)> {
        vec![
            ("div_divisor", self.divisor.cast_signed()),
            ("div_dividend", self.dividend.cast_signed()),
            ("div_reciprocal", self.reciprocal.cast_signed()),
            ("div_factor", self.factor.cast_signed()),
            ("div_quotient", self.quotient.cast_signed()),
            ("div_remainder", self.remainder),
        ]
    }

    pub(super) fn is_done(&self) -> bool {
        matches!(self.phase, Phase::Done(_))
    }
}
