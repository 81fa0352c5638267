//! The table of first reciprocals: m index bits in, m + 2 fraction bits out.
//!
//! ```text
//! divisor 0.1 i_{m-1} .. i_0 xxx  in [1/2, 1) --> entry i, about 1 / divisor, in (1, 2)
//! ```
//! Entry i serves the interval c -+ h with c = 1/2 + (i + 1/2) 2^-(m+1) and h = 2^-(m+2). The relative error
//! 1 - d y is linear in d, so its largest magnitude over the interval is at one of the ends, and it is least where both
//! ends have the same: y = 1/c, which leaves h / c. Rounding y to m + 2 fraction bits adds at most
//! d 2^-(m+3) < 2^-(m+3). As c >= 1/2 + h:
//!
//! ```text
//! |1 - d y| <= h / (1/2 + h) + 2^-(m+3) = 1 / (2^(m+1) + 1) + 2^-(m+3)
//! ```
//! Source: Das Sarma, Matula 1994 (Measuring the accuracy of ROM reciprocal tables): the rounded reciprocal of the
//! midpoint. Not modelled: bipartite or interpolated tables.

use super::ERROR_FRAC_BITS;

/// Fraction bits of an entry beyond the index bits.
pub(super) const EXTRA_FRAC_BITS: u32 = 2;

/// The 2^`table_bits` entries, words of `table_bits` + 2 fraction bits; `table_bits` up to 30.
///
/// 1/c = 2^(m+2) / (2^(m+1) + 2i + 1), so that the entry is 2^(2m+4) over an odd number, to nearest: never a tie.
pub fn reciprocal_table(table_bits: u32) -> Vec<u128> {
    let entry_frac_bits = table_bits + EXTRA_FRAC_BITS;
    let numerator = 1_u128 << (entry_frac_bits + table_bits + 2);
    let first = (1_u128 << (table_bits + 1)) + 1;
    (0..1_u128 << table_bits).map(|i| first + 2 * i).map(|odd| (numerator + odd / 2) / odd).collect()
}

/// What an entry's relative error cannot exceed, in units of 2^-62, rounded up; `table_bits` up to 30.
pub fn table_error_bound(table_bits: u32) -> u128 {
    let one = 1_u128 << ERROR_FRAC_BITS;
    one.div_ceil((1 << (table_bits + 1)) + 1) + (one >> (table_bits + EXTRA_FRAC_BITS + 1))
}
