//! The explicit ray record: origin, direction, t_max, tag.
//!
//! ```text
//! bit 0            3 (F+1)            3 (F+1) + 3 (D+1)   + T+3
//! | ox oy oz, F+1 each | dx dy dz, D+1 each | t_max, T+3 | tag, 15 | 0 ...
//! ```
//! Worked example, F = D = T = 8, o = (1, 0, 0), d = (0, 0, -255), t_max = 1024 (4.0), tag 3: dz fills bits 45..54 with
//! 0x101, t_max stands at bit 54, tag at bit 65: words 0x0000_0001, 0x0020_2000, 0x0000_0007 (bit 64 is t_max's top).

use super::fields::{FieldReader, FieldWriter};
use super::{PacketError, TAG_BITS, padded_bytes};
use crate::datapath::RayWords;
use crate::fixed::Formats;

fn ray_bits(formats: &Formats) -> u32 {
    3 * (formats.coord_frac_bits + 1) + 3 * (formats.dir_frac_bits + 1) + formats.t_frac_bits + 3 + TAG_BITS
}

/// Bytes of an explicit ray: 24 at the default formats.
pub fn ray_bytes(formats: &Formats) -> u32 {
    padded_bytes(ray_bits(formats))
}

/// Packs a ray; of the tag the low [`TAG_BITS`] bits.
pub fn pack_ray(formats: &Formats, ray: &RayWords, tag: u16) -> Vec<u32> {
    let mut record = FieldWriter::default();
    record.vector(ray.origin, formats.coord_frac_bits + 1);
    record.vector(ray.dir, formats.dir_frac_bits + 1);
    record.unsigned(ray.t_max, formats.t_frac_bits + 3);
    record.unsigned(u64::from(tag), TAG_BITS);
    record.finish()
}

/// Unpacks a ray and its tag.
///
/// # Errors
/// [`PacketError::Short`].
pub fn unpack_ray(formats: &Formats, words: &[u32]) -> Result<(RayWords, u16), PacketError> {
    let mut record = FieldReader::new("ray", words, ray_bits(formats))?;
    let ray = RayWords {
        origin: record.vector(formats.coord_frac_bits + 1),
        dir: record.vector(formats.dir_frac_bits + 1),
        t_max: record.unsigned(formats.t_frac_bits + 3),
    };
    Ok((ray, u16::try_from(record.word(TAG_BITS)).unwrap_or(0)))
}
