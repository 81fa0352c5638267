//! The patch record: four corners, id, flags; one record a 64-byte line of the patch memory.
//!
//! ```text
//! bit 0                                        12 (F+1)   12 (F+1) + 28   12 (F+1) + 29
//! | x0 y0 z0 x1 y1 z1 x2 y2 z2 x3 y3 z3, F+1 each | id      | is_triangle    | 0 ...
//! ```
//! Worked example, F = 8, corners (1,2,3) (-1,0,0) (0,0,0) (0,0,0), triangle, id 5: fields of 9 bits, so bit 0 of x0,
//! bit 10 of y0 and bits 18, 19 of z0 are set, x1 = -1 fills bits 27..36: word 0 = 0xF80C_0401, word 1 = 0x0000_000F;
//! id 5 stands at bit 108 and is_triangle at bit 136: word 3 = 0x0000_5000, word 4 = 0x0000_0100.

use super::fields::{FieldReader, FieldWriter};
use super::{PATCH_ID_BITS, PacketError, padded_bytes};
use crate::datapath::PatchWords;
use crate::fixed::Formats;

/// Words from one patch record to the next: a 64-byte line.
pub const PATCH_LINE_WORDS: u32 = crate::memory::LINE_WORDS;

fn patch_bits(formats: &Formats) -> u32 {
    12 * (formats.coord_frac_bits + 1) + PATCH_ID_BITS + 1
}

/// Bytes of a patch record: 44 at the default formats, at most 48.
pub fn patch_bytes(formats: &Formats) -> u32 {
    padded_bytes(patch_bits(formats))
}

/// Packs a patch.
pub fn pack_patch(formats: &Formats, patch: &PatchWords) -> Vec<u32> {
    let mut record = FieldWriter::default();
    for corner in patch.corners {
        record.vector(corner, formats.coord_frac_bits + 1);
    }
    record.unsigned(u64::from(patch.id), PATCH_ID_BITS);
    record.unsigned(u64::from(patch.is_triangle), 1);
    record.finish()
}

/// Unpacks a patch.
///
/// # Errors
/// [`PacketError::Short`].
pub fn unpack_patch(formats: &Formats, words: &[u32]) -> Result<PatchWords, PacketError> {
    let mut record = FieldReader::new("patch", words, patch_bits(formats))?;
    let corners = [(); 4].map(|()| record.vector(formats.coord_frac_bits + 1));
    let id = record.word(PATCH_ID_BITS);
    Ok(PatchWords { corners, id, is_triangle: record.bit() })
}
