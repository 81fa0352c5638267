//! Division units: t = num / den, rounded once to a t word, as hardware does it, a cycle per call.
//!
//! ```text
//! |num|, |den| --> range check --> NonRestoring | Newton --> floor, exact remainder --> rounding --> t word
//!                      |
//!                      +--> over 4.0, or den = 0: no hit
//! ```
//! Every unit answers exactly as [`Rounding::divide`](super::Rounding::divide) does, in every rounding mode, or is
//! refused when it is made. Operands are magnitudes: the ICU has already refused a num / den below 0 by its sign.
//! Timing: operands taken in cycle c leave as a quotient in cycle c + latency; the next can be taken in cycle
//! c + initiation interval. A serial unit is one state machine, so its interval is its latency; an unrolled one
//! repeats the hardware for each cycle, so its interval is 1.
//!
//! Latency in cycles at the default formats (T = 24, 27 quotient bits, a 76-bit divisor), computed by the formulas in
//! [`NonRestoring::latency_cycles`] and [`Newton::latency_cycles`]:
//!
//! | unit | serial = its interval | unrolled, interval 1 |
//! |---|---|---|
//! | non-restoring, radix 2 | 30 | 30 |
//! | non-restoring, radix 4 | 17 | 17 |
//! | non-restoring, radix 8 | 12 | 12 |
//! | non-restoring, radix 16 | 10 | 10 |
//! | newton, 8 table bits, 2 iterations, 1-cycle multiplier | 13 | 11 |
//! | newton, 8 table bits, 2 iterations, 2-cycle multiplier | 21 | 17 |
//! | newton, 3 table bits, 3 iterations, 1-cycle multiplier | 15 | 13 |
//!
//! Not modelled: what a radix or a multiplier does to the clock period; an early exit (a quotient out of range, or a
//! test without a hit, occupies the unit as long as any other: the ICU keeps its order).

mod format;
mod newton;
mod newton_bound;
mod non_restoring;
mod reciprocal_table;

pub use format::DividerFormat;
pub use newton::{Newton, NewtonParameters, NewtonRegisters};
pub use newton_bound::{QuotientBound, reciprocal_bound};
pub use non_restoring::{NonRestoring, NonRestoringRegisters};
pub use reciprocal_table::{reciprocal_table, table_error_bound};

use serde::{Deserialize, Serialize};

use super::WireWidth;

/// Units of error bounds: 2^-62.
pub const ERROR_FRAC_BITS: u32 = 62;

/// Clocks a unit's registers to the end of a division. `quotient` is `Some` once they hold the answer.
fn clock_to_the_end<R>(
    mut registers: R,
    step: impl Fn(&mut R),
    quotient: impl Fn(&R) -> Option<Option<u64>>,
) -> Divided {
    let mut cycles = 0;
    loop {
        if let Some(quotient) = quotient(&registers) {
            return Divided { quotient, cycles };
        }
        step(&mut registers);
        cycles += 1;
    }
}

/// How a unit's cycles map to hardware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DividerForm {
    /// One row or multiplier, used again and again; one division at a time.
    Serial,
    /// Hardware of its own for each cycle; a division every cycle.
    #[default]
    Unrolled,
}

impl DividerForm {
    /// Cycles between two divisions of a unit with this latency.
    pub fn initiation_interval_cycles(self, latency_cycles: u32) -> u32 {
        match self {
            DividerForm::Serial => latency_cycles,
            DividerForm::Unrolled => 1,
        }
    }
}

/// What a division gave, and how long it took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Divided {
    /// The rounded quotient; `None` when it is over the limit or the divisor is 0: no hit.
    pub quotient: Option<u64>,
    /// Cycles that the unit worked on it: its latency, or 1 for `None`.
    pub cycles: u32,
}

/// A division that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DivisionError {
    /// A parameter of a unit outside its range.
    #[error("{name} = {value}: expected {min} to {max}")]
    Parameter {
        /// Which parameter.
        name: &'static str,
        /// Its value.
        value: u32,
        /// Smallest allowed.
        min: u32,
        /// Largest allowed.
        max: u32,
    },
    /// A reciprocal too coarse for a correction by one unit.
    #[error(
        "table_bits = {table_bits} with iterations = {iterations}: a quotient estimate may be {units:.4} units off at \
         t_frac_bits = {t_frac_bits}, expected under 1: {remedy}"
    )]
    NotGuaranteed {
        /// Index bits of the table.
        table_bits: u32,
        /// Newton-Raphson iterations.
        iterations: u32,
        /// Fraction bits of the quotient.
        t_frac_bits: u32,
        /// The proved bound of |estimate - num / den|.
        units: f64,
        /// What would do.
        remedy: String,
    },
    /// An operand wider than its register.
    #[error("{name} = {value}: expected at most {max}")]
    Operand {
        /// Which operand.
        name: &'static str,
        /// Its value.
        value: u128,
        /// Its wire's largest magnitude.
        max: u128,
    },
}

/// Refuses a parameter outside `min..=max`.
fn check_parameter(name: &'static str, value: u32, min: u32, max: u32) -> Result<(), DivisionError> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(DivisionError::Parameter { name, value, min, max })
    }
}

/// A division unit of an ICU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Divider {
    /// Digit recurrence.
    NonRestoring(NonRestoring),
    /// Reciprocal table and Newton-Raphson.
    Newton(Newton),
}

impl Divider {
    /// num / den, rounded once.
    ///
    /// # Errors
    /// An operand wider than its register.
    pub fn divide(&self, num: u128, den: u128) -> Result<Divided, DivisionError> {
        match self {
            Divider::NonRestoring(unit) => unit.divide(num, den),
            Divider::Newton(unit) => unit.divide(num, den),
        }
    }

    /// Cycles from operands to quotient.
    pub fn latency_cycles(&self) -> u32 {
        match self {
            Divider::NonRestoring(unit) => unit.latency_cycles(),
            Divider::Newton(unit) => unit.latency_cycles(),
        }
    }

    /// Cycles from operands to the next operands.
    pub fn initiation_interval_cycles(&self) -> u32 {
        match self {
            Divider::NonRestoring(unit) => unit.initiation_interval_cycles(),
            Divider::Newton(unit) => unit.initiation_interval_cycles(),
        }
    }

    /// Width and largest magnitude of the unit's own wires and registers; its operands are `num_shifted` and
    /// `den_shifted` of [`Formats::width_table`](super::Formats::width_table) without sign.
    pub fn width_table(&self) -> Vec<WireWidth> {
        match self {
            Divider::NonRestoring(unit) => unit.width_table(),
            Divider::Newton(unit) => unit.width_table(),
        }
    }
}

#[cfg(test)]
mod newton_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod timing_tests;
