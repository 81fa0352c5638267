//! Non-restoring division: one quotient bit a row, r rows a cycle.
//!
//! ```text
//! num = [ remainder | digits ]   shift left as one register; by the remainder's sign subtract or add den;
//!                                the new sign, inverted, is the quotient bit and fills the place that became free
//! cycle 1: range check, load    ceil((T+3)/r) cycles: r rows each    then: correction    then: rounding
//! ```
//! With R the remainder, -den <= R < den: R' = 2R + next bit of num - den when R >= 0, + den when R < 0, which keeps
//! the invariant, since 2R + bit lies in [0, 2 den) or in [-2 den, 0). After the last row R is the remainder of the
//! floor or, when negative, short of it by den: one addition corrects it, and the quotient bits stand.
//! The range check makes num >> rows < den, so that loading keeps the invariant too. The range of T + 3 bits is
//! filled up with leading zero bits to a whole number of cycles.
//! Source: Ercegovac, Lang 1994 (Division and square root, digit-recurrence algorithms), non-restoring radix 2; a
//! radix of 2^r is r such rows in series, not a recurrence with larger digits.
//! Not modelled: redundant (carry-save) remainders, skipping over leading zeros.

use super::format::wire;
use super::{Divided, DividerForm, DividerFormat, DivisionError, check_parameter, clock_to_the_end};
use crate::fixed::WireWidth;

/// Cycles besides those of the rows: range check, correction, rounding.
const OTHER_CYCLES: u32 = 3;

/// The unit: its parameters and wiring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NonRestoring {
    format: DividerFormat,
    radix_log2: u32,
    form: DividerForm,
}

/// What happens in the next cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Check,
    Rows { cycles_left: u32 },
    Correct,
    Round,
    Done(Option<u64>),
}

/// The unit's state between two cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NonRestoringRegisters {
    phase: Phase,
    num: u128,
    den: u128,
    remainder: i128,
    digits: u128,
}

impl NonRestoring {
    /// A unit that does `radix_log2` rows a cycle, 1 to 4.
    ///
    /// # Errors
    /// A radix outside its range.
    pub fn new(format: DividerFormat, radix_log2: u32, form: DividerForm) -> Result<Self, DivisionError> {
        check_parameter("radix_log2", radix_log2, 1, 4)?;
        Ok(NonRestoring { format, radix_log2, form })
    }

    /// Cycles in which rows work.
    fn row_cycles(&self) -> u32 {
        self.format.quotient_bits().div_ceil(self.radix_log2)
    }

    /// Rows of a division: T + 3, filled up to whole cycles.
    fn n_rows(&self) -> u32 {
        self.row_cycles() * self.radix_log2
    }

    /// ceil((T+3) / r) + 3 cycles.
    pub fn latency_cycles(&self) -> u32 {
        self.row_cycles() + OTHER_CYCLES
    }

    /// The latency, or 1 when unrolled.
    pub fn initiation_interval_cycles(&self) -> u32 {
        self.form.initiation_interval_cycles(self.latency_cycles())
    }

    /// Takes the operands.
    ///
    /// # Errors
    /// An operand wider than its register.
    pub fn start(&self, num: u128, den: u128) -> Result<NonRestoringRegisters, DivisionError> {
        self.format.check_operands(num, den)?;
        Ok(NonRestoringRegisters { phase: Phase::Check, num, den, remainder: 0, digits: 0 })
    }

    /// One cycle.
    pub fn step(&self, s: &mut NonRestoringRegisters) {
        s.phase = match s.phase {
            Phase::Check if self.format.is_out_of_range(s.num, s.den) => Phase::Done(None),
            Phase::Check => {
                s.remainder = (s.num >> self.n_rows()).cast_signed();
                s.digits = s.num & self.digit_mask();
                Phase::Rows { cycles_left: self.row_cycles() }
            }
            Phase::Rows { cycles_left } => {
                for _ in 0..self.radix_log2 {
                    self.row(s);
                }
                if cycles_left > 1 { Phase::Rows { cycles_left: cycles_left - 1 } } else { Phase::Correct }
            }
            Phase::Correct => {
                if s.remainder < 0 {
                    s.remainder += s.den.cast_signed();
                }
                Phase::Round
            }
            Phase::Round => {
                Phase::Done(u64::try_from(self.format.rounded(s.digits, s.remainder, s.den)).ok())
            }
            Phase::Done(quotient) => Phase::Done(quotient),
        };
    }

    /// One row: an adder-subtractor.
    fn row(&self, s: &mut NonRestoringRegisters) {
        let next_bit = s.digits >> (self.n_rows() - 1);
        let shifted = 2 * s.remainder + next_bit.cast_signed();
        let den = s.den.cast_signed();
        s.remainder = if s.remainder < 0 { shifted + den } else { shifted - den };
        s.digits = ((2 * s.digits) & self.digit_mask()) + u128::from(s.remainder >= 0);
    }

    /// Ones in every place of the digit register.
    fn digit_mask(&self) -> u128 {
        (1 << self.n_rows()) - 1
    }

    /// num / den, rounded once: [`NonRestoring::start`], then [`NonRestoring::step`] to the end.
    ///
    /// # Errors
    /// An operand wider than its register.
    pub fn divide(&self, num: u128, den: u128) -> Result<Divided, DivisionError> {
        let quotient = |registers: &NonRestoringRegisters| match registers.phase {
            Phase::Done(quotient) => Some(quotient),
            _ => None,
        };
        Ok(clock_to_the_end(self.start(num, den)?, |registers| self.step(registers), quotient))
    }

    /// Width and largest magnitude of each wire.
    pub fn width_table(&self) -> Vec<WireWidth> {
        vec![
            self.format.range_wire(),
            wire("div_remainder", 0, true, self.format.den_max),
            wire("div_shifted_remainder", 0, true, 2 * self.format.den_max),
            wire("div_digits", self.format.t_frac_bits, false, self.digit_mask()),
        ]
    }
}

#[cfg(test)]
impl NonRestoringRegisters {
    /// The registers by the names of the width table.
    pub(super) fn values(&self) -> Vec<(&'static str, i128)> {
        vec![("div_remainder", self.remainder), ("div_digits", self.digits.cast_signed())]
    }

    pub(super) fn is_done(&self) -> bool {
        matches!(self.phase, Phase::Done(_))
    }
}
