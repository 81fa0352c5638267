//! How far a quotient estimate by Newton-Raphson can be from num / den: proved, in integers.
//!
//! ```text
//! T, table bits m, iterations n --> |1 - d x_n| --> |estimate - num / den| < 1 ? accepted : refused
//! ```
//! Words: W = T + 7 fraction bits for divisor, reciprocal and factor, 4 for the dividend; u = 2^-W. d is the
//! divisor's word (the true divisor lies in [d, d + u)), x_k the reciprocal, e_k a bound of |1 - d x_k|.
//! 1. x_0 comes from the table: e_0 by [`table_error_bound`].
//! 2. An iteration truncates twice, by tau_1 and tau_2 in [0, u): x' = x (2 - d x + tau_1) - tau_2. With
//!    r = 1 - d x: 1 - d x' = r^2 - (1 - r) tau_1 + d tau_2, hence `e_{k+1} = e_k^2 + (1 + e_k) u`.
//! 3. The true divisor is up to u longer, and x <= 2 (1 + e), so |1 - true x| <= e' = e_n + 2 (1 + e_n) u.
//! 4. The dividend's word drops less than 2^-4 of num 2^-b, the quotient is under L + 1 = 2^(T+2) + 1:
//!    the product is off by at most E = (L + 1) e' + 2 (1 + e_n) 2^-4.
//! 5. Rounding it to an integer adds 1/2: |estimate - num / den| <= E + 1/2, accepted when under 1. Then the floor is
//!    the estimate or one less, and the sign of the remainder says which.
//!
//! The bound is not loose: with every divisor word of T = 8 tried, the largest |1 - d x_n| is at least 0.45 of e_n,
//! and at T = 24 the refused 12 table bits with 1 iteration (E + 1/2 = 2.28) do give wrong quotients.
//!
//! Every step is computed in units of 2^-62 and rounded up. Fewest table bits that are accepted, by T and iterations:
//!
//! | T | 0 | 1 | 2 | 3 | 4 | 5 |
//! |---|---|---|---|---|---|---|
//! | 8 | 12 | 6 | 3 | 1 | 1 | 1 |
//! | 16 | - | 10 | 5 | 2 | 1 | 1 |
//! | 24 | - | - | 7 | 3 | 1 | 1 |
//! | 32 | - | - | 9 | 4 | 2 | 1 |
//!
//! Source: Flynn 1970 (On division by functional iteration) for the iteration; the bound is derived here.

use super::newton::{GUARD_BITS, MAX_ITERATIONS, MAX_TABLE_BITS, NewtonParameters, word_frac_bits};
use super::{DivisionError, ERROR_FRAC_BITS, table_error_bound};

const ONE: u128 = 1 << ERROR_FRAC_BITS;

/// e_n, the bound of |1 - d x_n| after `iterations` of W = `t_frac_bits` + 7 fraction bits, in units of 2^-62.
pub fn reciprocal_bound(t_frac_bits: u32, table_bits: u32, iterations: u32) -> u128 {
    let unit = ONE >> word_frac_bits(t_frac_bits);
    (0..iterations).fold(table_error_bound(table_bits), |e, _| (e * e + (ONE + e) * unit).div_ceil(ONE))
}

/// The bound of |estimate - num / den|.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QuotientBound {
    /// In units of 2^-62.
    pub words: u128,
}

impl QuotientBound {
    /// E + 1/2 of these parameters, whose ranges the caller has checked.
    pub fn of(t_frac_bits: u32, table_bits: u32, iterations: u32) -> Self {
        let error = reciprocal_bound(t_frac_bits, table_bits, iterations);
        let largest_reciprocal = 2 * (ONE + error);
        let with_divisor = error + largest_reciprocal.div_ceil(1 << word_frac_bits(t_frac_bits));
        let quotient = (4_u128 << t_frac_bits) + 1;
        let words = quotient * with_divisor + largest_reciprocal.div_ceil(1 << GUARD_BITS) + ONE / 2;
        QuotientBound { words }
    }

    /// The correction by one unit always suffices.
    pub fn is_guaranteed(self) -> bool {
        self.words < ONE
    }

    /// The bound as a number.
    pub fn units(self) -> f64 {
        self.words as f64 / ONE as f64
    }
}

/// Refuses parameters whose bound is not under one unit, with the bound and what would do.
pub(super) fn check_guarantee(t_frac_bits: u32, p: NewtonParameters) -> Result<(), DivisionError> {
    let bound = QuotientBound::of(t_frac_bits, p.table_bits, p.iterations);
    if bound.is_guaranteed() {
        return Ok(());
    }
    let guaranteed = |m, n| QuotientBound::of(t_frac_bits, m, n).is_guaranteed();
    let larger_table = (1..=MAX_TABLE_BITS).find(|m| guaranteed(*m, p.iterations));
    let more_iterations = (0..=MAX_ITERATIONS).find(|n| guaranteed(p.table_bits, *n));
    let remedies = [
        larger_table.map(|m| format!("table_bits = {m}")),
        more_iterations.map(|n| format!("iterations = {n}")),
    ];
    Err(DivisionError::NotGuaranteed {
        table_bits: p.table_bits,
        iterations: p.iterations,
        t_frac_bits,
        units: bound.units(),
        remedy: remedies.into_iter().flatten().collect::<Vec<_>>().join(" or "),
    })
}
