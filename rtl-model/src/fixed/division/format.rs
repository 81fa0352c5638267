//! What every divider knows of its operands: their widths, the range of the quotient, its rounding.
//!
//! ```text
//! Formats --> T, largest num and den, rounding --> range check, rounding decision
//! ```
//! With L = 2^(T+2), the word of t = 4.0, a quotient is out of range when it rounds to more than L:
//!
//! | mode | out of range | why |
//! |---|---|---|
//! | nearest, ties to even | 2 num > den (2L + 1) | L is even, so L + 1/2 rounds down to it |
//! | nearest, ties away | 2 num >= den (2L + 1) | L + 1/2 rounds up |
//! | floor | num >= den (L + 1) | |
//!
//! In hardware: den beside its own copy, shifted by a constant, one addition, one comparison. The check makes the
//! quotient fit T + 3 bits. den = 0 has no quotient and is out of range (inside a triangle den is never 0); num = 0
//! gives 0, in as many cycles as any other.

use std::cmp::Ordering;

use super::DivisionError;
use crate::fixed::{Formats, Rounding, WireWidth};

/// Operands and quotient of a divider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DividerFormat {
    /// T, fraction bits of the quotient.
    pub t_frac_bits: u32,
    /// Largest |num|.
    pub num_max: u128,
    /// Largest |den|.
    pub den_max: u128,
    /// Rounding of the quotient.
    pub rounding: Rounding,
}

impl DividerFormat {
    /// The divider's end of the width table.
    pub fn of(formats: &Formats) -> Self {
        let wires = formats.width_table();
        let largest = |name| {
            let of_name = wires.iter().filter(|w| w.wire == name);
            of_name.map(|w| w.max_magnitude.unsigned_abs()).max().unwrap_or(0)
        };
        DividerFormat {
            t_frac_bits: formats.t_frac_bits,
            num_max: largest("num_shifted"),
            den_max: largest("den_shifted"),
            rounding: formats.rounding,
        }
    }

    /// L, the largest quotient: 4.0.
    pub fn limit(&self) -> u128 {
        4 << self.t_frac_bits
    }

    /// Bits of the quotient: T + 3.
    pub fn quotient_bits(&self) -> u32 {
        self.t_frac_bits + 3
    }

    /// Bits of |den|.
    pub fn den_bits(&self) -> u32 {
        bit_length(self.den_max)
    }

    /// Refuses operands that are wider than their registers.
    pub(super) fn check_operands(&self, num: u128, den: u128) -> Result<(), DivisionError> {
        for (name, value, max) in [("num", num, self.num_max), ("den", den, self.den_max)] {
            if value > max {
                return Err(DivisionError::Operand { name, value, max });
            }
        }
        Ok(())
    }

    /// True when num / den rounds to more than 4.0, or when `den` is 0.
    pub(super) fn is_out_of_range(&self, num: u128, den: u128) -> bool {
        den == 0
            || match self.rounding {
                Rounding::NearestEven => 2 * num > den * (2 * self.limit() + 1),
                Rounding::HalfAway => 2 * num >= den * (2 * self.limit() + 1),
                Rounding::Floor => num >= den * (self.limit() + 1),
            }
    }

    /// The rounding decision, from the floor of the quotient and the exact remainder in 0..den.
    pub(super) fn rounded(&self, floor: u128, remainder: i128, den: u128) -> u128 {
        let half = (2 * remainder).cmp(&den.cast_signed());
        let up = match self.rounding {
            Rounding::NearestEven => half == Ordering::Greater || half == Ordering::Equal && floor % 2 == 1,
            Rounding::HalfAway => half != Ordering::Less,
            Rounding::Floor => false,
        };
        floor + u128::from(up)
    }

    /// The wire that the range check compares with num (with 2 num unless the mode is floor).
    pub(super) fn range_wire(&self) -> WireWidth {
        let times = match self.rounding {
            Rounding::Floor => self.limit() + 1,
            _ => 2 * self.limit() + 1,
        };
        wire("div_range", 0, false, self.den_max * times)
    }
}

/// Bits of an unsigned value.
pub(super) fn bit_length(value: u128) -> u32 {
    u128::BITS - value.leading_zeros()
}

/// A row of a divider's width table, as wide as its largest magnitude needs.
pub(super) fn wire(name: &'static str, frac_bits: u32, is_signed: bool, max_magnitude: u128) -> WireWidth {
    WireWidth {
        wire: name,
        bits: bit_length(max_magnitude) + u32::from(is_signed),
        frac_bits,
        max_magnitude: max_magnitude.cast_signed(),
    }
}
