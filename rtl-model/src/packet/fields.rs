//! Fields written one after another from bit 0 of word 0 upward, and read back in the same order.

use bitvec::field::BitField;
use bitvec::prelude::{BitSlice, BitVec, Lsb0};
use bitvec::view::BitView;

use super::PacketError;
use crate::fixed::index;

/// Appends fields to a record.
#[derive(Debug, Default)]
pub(super) struct FieldWriter {
    bits: BitVec<u32, Lsb0>,
}

impl FieldWriter {
    /// The low `width` bits of `value`, `width` at most 64.
    pub(super) fn unsigned(&mut self, value: u64, width: u32) {
        let start = self.bits.len();
        self.bits.resize(start + index(width), false);
        self.bits[start..].store_le(value);
    }

    /// Two's complement in `width` bits.
    pub(super) fn signed(&mut self, value: i64, width: u32) {
        self.unsigned(value.cast_unsigned(), width);
    }

    /// Three signed words.
    pub(super) fn vector(&mut self, words: [i32; 3], width: u32) {
        for word in words {
            self.signed(i64::from(word), width);
        }
    }

    /// The record, padded with zeros to whole words.
    pub(super) fn finish(mut self) -> Vec<u32> {
        let padded = self.bits.len().next_multiple_of(32);
        self.bits.resize(padded, false);
        self.bits.into_vec()
    }
}

/// Takes fields off a record.
#[derive(Debug)]
pub(super) struct FieldReader<'a> {
    bits: &'a BitSlice<u32, Lsb0>,
    at: usize,
}

impl<'a> FieldReader<'a> {
    /// A record of `bits` bits at the start of `words`.
    ///
    /// # Errors
    /// [`PacketError::Short`].
    pub(super) fn new(record: &'static str, words: &'a [u32], bits: u32) -> Result<Self, PacketError> {
        let expected = index(bits.div_ceil(32));
        if words.len() < expected {
            return Err(PacketError::Short { record, found: words.len(), expected });
        }
        Ok(FieldReader { bits: words.view_bits(), at: 0 })
    }

    /// The next field, `width` in 1..=64, within the record's bits.
    pub(super) fn unsigned(&mut self, width: u32) -> u64 {
        let start = self.at;
        self.at += index(width);
        self.bits[start..self.at].load_le()
    }

    /// The next field as two's complement.
    pub(super) fn signed(&mut self, width: u32) -> i64 {
        let unused = 64 - width;
        (self.unsigned(width) << unused).cast_signed() >> unused
    }

    /// A field of at most 32 bits.
    pub(super) fn word(&mut self, width: u32) -> u32 {
        let low = self.unsigned(width) & u64::from(u32::MAX);
        u32::try_from(low).unwrap_or(u32::MAX)
    }

    /// A single bit.
    pub(super) fn bit(&mut self) -> bool {
        self.unsigned(1) != 0
    }

    /// Three signed words of at most 32 bits.
    pub(super) fn vector(&mut self, width: u32) -> [i32; 3] {
        [(); 3].map(|()| i32::try_from(self.signed(width.min(32))).unwrap_or(0))
    }
}
