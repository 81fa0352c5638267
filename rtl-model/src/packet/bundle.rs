//! Bundle descriptors: a header, the apex, and the parameters of one of four kinds.
//!
//! ```text
//! bit 0  2      3    9    15    30               30 + 3 (F+1)
//! | kind | any | n-1 | m-1 | tag | apex, F+1 each | parameters
//! ```
//! | kind | parameters | bits | bytes at default |
//! |---|---|---|---|
//! | 0 tile | corner, step u, step v: 9 (D + guard + 2) | 30 + 3 (F+1) + 9 (D+10) | 52 |
//! | 1 fan | three vertices: 9 (F+1); jitter: 2 x 12 | 54 + 12 (F+1) | 48 |
//! | 2 hemisphere | frame: 9 (D+2), as its words reach 2^D; jitter: 2 x 6 | 42 + 3 (F+1) + 9 (D+2) | 44 |
//! | 3 targets | n-1 = points - 1, m-1 = 0; points: 3 (F+1) each | 30 + 3 (F+1) (points + 1) | 16 + 9.375 a point |
//!
//! Worked example, F = D = 8, targets, apex (1, 0, 0), one point (0, 1, 0), nearest, tag 1: kind 3, tag at bit 15,
//! apex x at bit 30, the point's y at bit 66: words 0x4000_8003, 0, 0x0000_0004.

use super::fields::{FieldReader, FieldWriter};
use super::{MAX_BUNDLE_RAYS, PacketError, TAG_BITS, padded_bytes};
use crate::datapath::bundle::{BundleWords, HEMISPHERE_LOG2, JITTER_BITS, STEP_GUARD_BITS};
use crate::fixed::{Formats, index, word_count};

/// Bits of the header without the apex.
const HEADER_BITS: u32 = 2 + 1 + 6 + 6 + TAG_BITS;

/// A descriptor with what the bus adds to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BundlePacket {
    /// The descriptor.
    pub bundle: BundleWords,
    /// Any hit instead of the nearest.
    pub any_hit: bool,
    /// Returned with the answers; 15 bits.
    pub tag: u16,
}

/// Width of a word of tile directions.
fn tile_word(formats: &Formats) -> u32 {
    formats.dir_frac_bits + STEP_GUARD_BITS + 2
}

fn bundle_bits(formats: &Formats, kind: u64, n_points: u32) -> u32 {
    let coordinate = formats.coord_frac_bits + 1;
    let parameters = match kind {
        0 => 9 * tile_word(formats),
        1 => 9 * coordinate + 2 * JITTER_BITS,
        2 => 9 * (formats.dir_frac_bits + 2) + 2 * HEMISPHERE_LOG2,
        _ => 3 * coordinate * n_points,
    };
    HEADER_BITS + 3 * coordinate + parameters
}

fn kind_and_size(bundle: &BundleWords) -> (u64, u32, u32) {
    match bundle {
        BundleWords::Tile { n, m, .. } => (0, *n, *m),
        BundleWords::Fan { n, m, .. } => (1, *n, *m),
        BundleWords::Hemisphere { n, m, .. } => (2, *n, *m),
        BundleWords::Targets { points, .. } => (3, word_count(points.len()), 1),
    }
}

/// Bytes of a descriptor on the bus.
pub fn bundle_bytes(bundle: &BundleWords, formats: &Formats) -> u32 {
    let (kind, n, _) = kind_and_size(bundle);
    padded_bytes(bundle_bits(formats, kind, n))
}

/// Packs a valid descriptor.
pub fn pack_bundle(formats: &Formats, packet: &BundlePacket) -> Vec<u32> {
    let coordinate = formats.coord_frac_bits + 1;
    let (kind, n, m) = kind_and_size(&packet.bundle);
    let mut record = FieldWriter::default();
    record.unsigned(kind, 2);
    record.unsigned(u64::from(packet.any_hit), 1);
    record.unsigned(u64::from(n.saturating_sub(1)), 6);
    record.unsigned(u64::from(m.saturating_sub(1)), 6);
    record.unsigned(u64::from(packet.tag), TAG_BITS);
    record.vector(packet.bundle.apex(), coordinate);
    match &packet.bundle {
        BundleWords::Tile { corner, step_u, step_v, .. } => {
            for word in [corner, step_u, step_v].into_iter().flatten() {
                record.signed(*word, tile_word(formats));
            }
        }
        BundleWords::Fan { vertices, jitter, .. } => {
            vertices.iter().for_each(|v| record.vector(*v, coordinate));
            jitter.iter().for_each(|j| record.unsigned(u64::from(*j), JITTER_BITS));
        }
        BundleWords::Hemisphere { frame, jitter, .. } => {
            frame.iter().for_each(|axis| record.vector(*axis, formats.dir_frac_bits + 2));
            jitter.iter().for_each(|j| record.unsigned(u64::from(*j), HEMISPHERE_LOG2));
        }
        BundleWords::Targets { points, .. } => {
            points.iter().for_each(|point| record.vector(*point, coordinate));
        }
    }
    record.finish()
}

/// Unpacks a descriptor.
///
/// # Errors
/// Too few words, or more than 64 rays.
pub fn unpack_bundle(formats: &Formats, words: &[u32]) -> Result<BundlePacket, PacketError> {
    let coordinate = formats.coord_frac_bits + 1;
    let mut header = FieldReader::new("bundle", words, HEADER_BITS)?;
    let kind = header.unsigned(2);
    header.bit();
    let n = header.word(6) + 1;
    let mut record = FieldReader::new("bundle", words, bundle_bits(formats, kind, n))?;
    record.unsigned(2);
    let any_hit = record.bit();
    let (n, m) = (record.word(6) + 1, record.word(6) + 1);
    if index(n * m) > MAX_BUNDLE_RAYS {
        let value = u64::from(n * m);
        return Err(PacketError::Field { record: "bundle", field: "n * m", value, expected: "1 to 64" });
    }
    let tag = u16::try_from(record.unsigned(TAG_BITS)).unwrap_or(0);
    let apex = record.vector(coordinate);
    let bundle = match kind {
        0 => {
            let [corner, step_u, step_v] =
                [(); 3].map(|()| [(); 3].map(|()| record.signed(tile_word(formats))));
            BundleWords::Tile { apex, corner, step_u, step_v, n, m }
        }
        1 => BundleWords::Fan {
            apex,
            vertices: [(); 3].map(|()| record.vector(coordinate)),
            n,
            m,
            jitter: [(); 2].map(|()| record.word(JITTER_BITS)),
        },
        2 => {
            let frame = [(); 3].map(|()| record.vector(formats.dir_frac_bits + 2));
            let jitter = [(); 2].map(|()| record.word(HEMISPHERE_LOG2));
            BundleWords::Hemisphere { apex, frame, n, m, jitter }
        }
        _ => {
            let points = (0..n).map(|_| record.vector(coordinate)).collect();
            BundleWords::Targets { apex, points }
        }
    };
    Ok(BundlePacket { bundle, any_hit, tag })
}
