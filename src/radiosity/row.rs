//! A row of form factors, stored sparsely: one bit per receiver and an f32 per receiver that sees the shooter.
//!
//! ```text
//! F(receiver <- patch), mostly 0 --> mask words + packed values --> (receiver, F) again, 64 receivers at a time
//! ```
//! Memory: n/8 + n/16 bytes for n receivers, and 4 bytes per factor that is not 0. Values are rounded to f32 before
//! their first use, so a stored row and a recomputed one are the same.

use serde::{Deserialize, Serialize};

/// Form factors to one kind of receiver.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct SparseRow {
    masks: Vec<u64>,
    /// Where the values of each mask word start.
    starts: Vec<u32>,
    values: Vec<f32>,
}

/// Receivers that share a mask word.
pub(super) const ROW_BLOCK: usize = 64;

impl SparseRow {
    /// Packs a dense row.
    pub(super) fn pack(dense: &[f32]) -> SparseRow {
        let mut row = SparseRow::default();
        for block in dense.chunks(ROW_BLOCK) {
            row.starts.push(row.values.len() as u32);
            let mut mask = 0u64;
            for (bit, &value) in block.iter().enumerate() {
                if value != 0.0 {
                    mask |= 1 << bit;
                    row.values.push(value);
                }
            }
            row.masks.push(mask);
        }
        row.values.shrink_to_fit();
        row
    }

    /// Calls `each(place in the block, factor)` for the factors of block `block` that are not 0, in order.
    #[inline]
    pub(super) fn for_block(&self, block: usize, mut each: impl FnMut(usize, f64)) {
        let mut mask = self.masks[block];
        let mut at = self.starts[block] as usize;
        while mask != 0 {
            each(mask.trailing_zeros() as usize, f64::from(self.values[at]));
            mask &= mask - 1;
            at += 1;
        }
    }

    /// Calls `each(receiver, factor)` for the factors that are not 0, in order.
    pub(super) fn for_each(&self, mut each: impl FnMut(usize, f64)) {
        for block in 0..self.masks.len() {
            self.for_block(block, |place, factor| each(block * ROW_BLOCK + place, factor));
        }
    }

    /// Sum over receivers of weight x factor.
    pub(super) fn weighted_sum(&self, weight: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        self.for_each(|receiver, factor| sum += weight(receiver) * factor);
        sum
    }

    /// True for what [`SparseRow::pack`] makes of form factors to `n` receivers.
    pub(super) fn is_sound(&self, n: usize) -> bool {
        let mut n_values = 0;
        let in_order = self.masks.iter().zip(&self.starts).all(|(mask, start)| {
            let fits = *start as usize == n_values;
            n_values += mask.count_ones() as usize;
            fits
        });
        let past_the_end = match (self.masks.last(), n % ROW_BLOCK) {
            (Some(mask), rest) if rest != 0 => mask >> rest,
            _ => 0,
        };
        in_order
            && past_the_end == 0
            && self.masks.len() == n.div_ceil(ROW_BLOCK)
            && self.starts.len() == self.masks.len()
            && self.values.len() == n_values
            && self.values.iter().all(|f| f.is_finite() && *f >= 0.0)
    }

    /// Heap memory (bytes) of a row of `n` receivers that all see the shooter.
    pub(super) fn max_bytes(n: usize) -> u64 {
        (12 * n.div_ceil(ROW_BLOCK) + 4 * n) as u64
    }

    /// Heap memory (bytes).
    pub(super) fn n_bytes(&self) -> u64 {
        (12 * self.masks.len() + 4 * self.values.len()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn row_packed_and_read_back_is_the_dense_row(
            dense in prop::collection::vec(prop_oneof![Just(0.0f32), 0.0f32..1.0], 0..300)
        ) {
            let row = SparseRow::pack(&dense);
            let mut back = vec![0.0f32; dense.len()];
            for block in 0..dense.len().div_ceil(ROW_BLOCK) {
                row.for_block(block, |place, factor| back[block * ROW_BLOCK + place] = factor as f32);
            }
            prop_assert_eq!(&back, &dense);
            prop_assert!(row.is_sound(dense.len()));
            prop_assert!(!row.is_sound(dense.len() + ROW_BLOCK));
            let sum: f64 = dense.iter().enumerate().map(|(i, f)| i as f64 * f64::from(*f)).sum();
            prop_assert!((row.weighted_sum(|i| i as f64) - sum).abs() <= 1e-9 * (1.0 + sum));
            let n = dense.iter().filter(|f| **f != 0.0).count();
            prop_assert_eq!(row.n_bytes(), (12 * dense.len().div_ceil(64) + 4 * n) as u64);
        }
    }
}
