//! The bundle generator's table: 64 x 64 cosine-distributed directions about +z.
//!
//! ```text
//! (u, v) = (k, l) / 64 in the unit square -> concentric disk -> lifted to the hemisphere -> words of D fraction bits
//! ```
//! Entries stand at k/64, not at (k + 1/2)/64: the centres of 1, 2, 4 ... 32 strata are then entries exactly. Entry 0
//! would lie on the rim, along the surface, and is no such centre; it stands at 1/128, the first centre of 64 strata.
//! All 64 places together lean by 1/128 of the square to one corner: who moves strata through them all turns the frame by
//! quarters, too, which map the square onto itself.
//! Concentric map (Shirley, Chiu 1997), computed with one portable mathematics library, so that the table has the same
//! bits on every machine. Largest word: 2^D (1.0).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::OnceLock;

use crate::fixed::{index, round_to_word};

/// log2 of the side of the table.
pub const HEMISPHERE_LOG2: u32 = 6;

/// Direction words of the table's D up to 28, one table a width.
static TABLES: [OnceLock<Vec<[i32; 3]>>; 29] = [const { OnceLock::new() }; 29];

/// Entry (column, row) of the table for D direction bits (at most 28), column and row under 64.
pub(super) fn entry(dir_frac_bits: u32, column: u32, row: u32) -> [i32; 3] {
    let table = TABLES[index(dir_frac_bits.min(28))].get_or_init(|| build(dir_frac_bits.min(28)));
    table[index(row << HEMISPHERE_LOG2 | column)]
}

fn build(dir_frac_bits: u32) -> Vec<[i32; 3]> {
    let side = 1_u32 << HEMISPHERE_LOG2;
    let one = f64::from(1_u32 << dir_frac_bits);
    let at = |place: u32| f64::from(place).max(0.5) / f64::from(side);
    let words = |row, column| cosine_direction(at(column), at(row)).map(|x| round_to_word(x * one));
    (0..side).flat_map(|row| (0..side).map(move |column| words(row, column))).collect()
}

/// Unit square to a cosine-distributed unit direction about +z.
pub(super) fn cosine_direction(u: f64, v: f64) -> [f64; 3] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0, 1.0];
    }
    let (r, phi) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)) };
    [r * libm::cos(phi), r * libm::sin(phi), libm::sqrt((1.0 - r * r).max(0.0))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_every_entry_is_a_unit_vector_to_rounding() {
        for d in [8_u32, 24, 28] {
            let one = f64::from(1_u32 << d);
            for place in 0..64 * 64 {
                let words = entry(d, place % 64, place / 64).map(f64::from);
                let length = words.iter().map(|w| w * w).sum::<f64>().sqrt() / one;
                assert!((length - 1.0).abs() < 1.0 / one, "D = {d}, entry {place}: length {length}");
                assert!(words[2] > 0.0);
            }
        }
    }

    #[test]
    fn table_mean_of_cosine_distribution_is_two_thirds() {
        // The mean of cos over a cosine-distributed hemisphere is the integral of 2 c^2 dc = 2/3. 32 x 32 strata, the
        // midpoint rule, against a square root at the rim: error of order 32^-1.5 = 6e-3.
        let centres = || (0..1024).map(|p| entry(24, 2 * (p % 32) + 1, 2 * (p / 32) + 1));
        let mean = centres().map(|w| f64::from(w[2])).sum::<f64>() / 1024.0 / f64::from(1 << 24);
        assert!((mean - 2.0 / 3.0).abs() < 6e-3, "{mean}");
        for k in 0..2 {
            let side: i64 = centres().map(|w| i64::from(w[k])).sum();
            assert!(side.abs() < 1024, "tangential mean {side} steps");
        }
    }
}
