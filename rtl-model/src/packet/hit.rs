//! What goes back to the host: a nearest-hit record a ray, or one bit a ray.
//!
//! ```text
//! bit 0   T+3     T+31      T+32     T+33
//! | t, T+3 | id, 28 | facing | valid | 0 ...        facing: 0 front, 1 back; a miss is all zeros
//! ```
//! Worked example, T = 24, t = 1.0 (2^24), patch 5, back: bit 24, 5 at bit 27, facing at bit 55, valid at bit 56:
//! words 0x2900_0000, 0x0180_0000.

use super::fields::{FieldReader, FieldWriter};
use super::{PATCH_ID_BITS, PacketError, padded_bytes};
use crate::datapath::{Facing, HitWords};
use crate::fixed::{Formats, index, word_count};

fn hit_bits(formats: &Formats) -> u32 {
    formats.t_frac_bits + 3 + PATCH_ID_BITS + 2
}

/// Bytes of a nearest-hit record: 8 at the default formats, 12 where T > 31.
pub fn hit_bytes(formats: &Formats) -> u32 {
    padded_bytes(hit_bits(formats))
}

/// Packs what a nearest-hit ray found.
pub fn pack_hit(formats: &Formats, hit: Option<HitWords>) -> Vec<u32> {
    let mut record = FieldWriter::default();
    let (t, patch, back) = hit.map_or((0, 0, false), |h| (h.t, h.patch, h.facing == Facing::Back));
    record.unsigned(t, formats.t_frac_bits + 3);
    record.unsigned(u64::from(patch), PATCH_ID_BITS);
    record.unsigned(u64::from(back), 1);
    record.unsigned(u64::from(hit.is_some()), 1);
    record.finish()
}

/// Unpacks a nearest-hit record.
///
/// # Errors
/// [`PacketError::Short`].
pub fn unpack_hit(formats: &Formats, words: &[u32]) -> Result<Option<HitWords>, PacketError> {
    let mut record = FieldReader::new("hit", words, hit_bits(formats))?;
    let t = record.unsigned(formats.t_frac_bits + 3);
    let patch = record.word(PATCH_ID_BITS);
    let facing = if record.bit() { Facing::Back } else { Facing::Front };
    Ok(record.bit().then_some(HitWords { t, patch, facing }))
}

/// Bytes of the any-hit bits of so many rays.
pub fn any_hit_bytes(n_rays: usize) -> u32 {
    padded_bytes(word_count(n_rays))
}

/// Packs any-hit answers, ray 0 in bit 0 of word 0.
pub fn pack_any_hits(hits: &[bool]) -> Vec<u32> {
    let mut record = FieldWriter::default();
    for hit in hits {
        record.unsigned(u64::from(*hit), 1);
    }
    record.finish()
}

/// Unpacks the answers of `n_rays` rays.
///
/// # Errors
/// [`PacketError::Short`].
pub fn unpack_any_hits(n_rays: usize, words: &[u32]) -> Result<Vec<bool>, PacketError> {
    let mut record = FieldReader::new("any-hit", words, word_count(n_rays))?;
    Ok((0..index(word_count(n_rays))).map(|_| record.bit()).collect())
}
