//! Test vectors: patches, rays and expected answers in the board's words, for this board and for others' RTL.
//!
//! ```text
//! Vectors <--csv_write.rs, csv_read.rs--> text, one record a line, `#` starts a comment
//!         <--binary.rs------------------> the packed records of rtl_model::packet, little-endian, with a CRC
//!         --check.rs: clocked board, functional model, oracle--> which expectations hold
//!         <--workload.rs, reference.rs---- rays of a verification, with the oracle's answers and wires
//! ```
//! Both files hold the same: reading one and writing the other loses nothing. What a reader refuses it names with
//! place, field, value and what was expected ([`VectorsError`]).
//!
//! # Words
//! F, D, T: fraction bits of coordinates, directions and t; K: fraction bits that edge normals keep of their 2F. A
//! coordinate word c means c 2^-F in [-1, 1), a direction word d means d 2^-D with |d| < 2^D, not all three 0, a t word
//! means t 2^-T, at most 4 2^T. Ids lie in 0 to 2^28 - 1, each once. A triangle is the corners 0, 1, 2; a quad the
//! triangles 0, 1, 2 and 0, 2, 3. The nearest hit has the smallest (t, id).
//!
//! With K = 2F no answer depends on the board's grid. With K < 2F a rounded edge may lie outside the cells that list
//! its patch, so an answer is over the patches that the cells on the ray's way list: a file says which grid that was.
//!
//! # Text (.csv)
//! UTF-8, with or without byte order mark; a record a line, fields separated by commas, blanks around them ignored; from
//! `#` to the end of the line is a comment. All values are whole numbers in decimal.
//!
//! | record | fields | |
//! |---|---|---|
//! | `vectors` | 1 | version; the first record |
//! | `formats` | F, D, T, K or `full`, `nearest-even` or `half-away` or `floor` | the second record |
//! | `grid` | G | log2 of the cells a side, 1 to 7; at most once, before those below |
//! | `patch` | id, `triangle` or `quad`, x0, y0, z0, x1 ... z2 (triangle) or z3 (quad) | 3 or 4 corners |
//! | `ray` | `nearest`, ox, oy, oz, dx, dy, dz, t_max, answer | answer: none, or `miss`, or t, patch id, `front` or `back` |
//! | `ray` | `any`, ox, oy, oz, dx, dy, dz, t_max, answer | answer: none, or `miss`, or `hit` |
//! | `test` | ray, patch id, `miss`, `-`, wires | number of the ray from 0; 40 wires of a triangle, 48 of a quad |
//! | `test` | ray, patch id, t, `front` or `back`, wires | both stand before the test |
//! | `end` | patches, rays, tests | how many there are; the last record, nothing follows |
//!
//! Wires, in order (`wires.rs`): corners relative to the origin a0 to a3, edge normals c01 c12 c02 c23 c30 (x y z each),
//! edge tests e01 e12 e02 e23 e30, then of each triangle inside, n (x y z), den, num, den_shifted, num_shifted. A
//! triangle has edge 20 in the place of 02, zeros for 23 and 30, and a3 = a2.
//!
//! # Packed (.rvec)
//! Little-endian 32-bit words; P, R, H: bytes of the patch, ray and hit records of `rtl_model::packet`
//! (fields from bit 0 up, padded with zeros to whole words; 44, 24 and 8 at F = D = T = 24).
//!
//! | byte | |
//! |---|---|
//! | 0 | magic, the bytes `RVEC` |
//! | 4 | version, 1 |
//! | 8, 12, 16 | F, D, T |
//! | 20 | K; `0xFFFF_FFFF`: full |
//! | 24 | rounding: 0 nearest-even, 1 half-away, 2 floor |
//! | 28, 32, 36 | number of patches p, of rays r, of tests |
//! | 40 | G; 0: none |
//! | 44 | p patch records of P bytes: 12 corner words of F + 1 bits, id 28 bits, triangle 1 bit |
//! | 44 + p P | r rays of R + 4 + H bytes |
//! | 44 + p P + r (R + 4 + H) | the tests |
//! | length - 4 | CRC-32 (IEEE) of all bytes before it |
//!
//! | byte of a ray | |
//! |---|---|
//! | 0 | ray record: origin 3 words of F + 1 bits, direction 3 of D + 1, t_max T + 3, tag 15: its number mod 2^15 |
//! | R | control: bit 0 any hit, bit 1 an answer is expected, bit 2 answer of an any-hit ray is a hit |
//! | R + 4 | hit record, of a nearest-hit ray with an expected answer: t T + 3 bits, id 28, back 1, valid 1; else zeros |
//!
//! | byte of a test | |
//! |---|---|
//! | 0, 4 | number of the ray, number of the patch in the file, from 0 |
//! | 8 | hit record |
//! | 8 + H | 40 wires of a triangle, 48 of a quad, 16 bytes each, two's complement: 640 or 768 bytes |

mod binary;
mod build;
mod check;
mod csv_read;
mod csv_write;
mod error;
mod reference;
mod wires;
mod workload;

use std::path::Path;

use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::oracle::Wires;

pub use binary::{from_binary, to_binary};
pub use check::{Answers, Check, CheckError, Wrong, check};
pub use csv_read::from_csv;
pub use csv_write::{rounding_name, side, to_csv};
pub use error::{Fault, Place, VectorsError};
pub use reference::{of_mismatch, sample};
pub use wires::{board_wires, wire_names, wire_values};
pub use workload::spread;

/// Most patches of a file.
pub const MAX_PATCHES: usize = 1 << 22;
/// Most rays of a file.
pub const MAX_RAYS: usize = 1 << 24;
/// Most single tests of a file.
pub const MAX_TESTS: usize = 1 << 20;
/// Most rays that vectors of a workload hold.
pub const MAX_SAMPLE: usize = 10_000;
/// UTF-8's mark that some editors put before text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Largest file (bytes).
pub const MAX_FILE_BYTES: u64 = 4 << 30;

/// What a ray is expected to answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Of a nearest-hit ray.
    Nearest(Option<HitWords>),
    /// Of an any-hit ray.
    Any(bool),
}

/// A ray with its mode and its expected answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RayVector {
    /// Its words.
    pub words: RayWords,
    /// It asks for any hit, not for the nearest.
    pub any_hit: bool,
    /// The answer, where the file has one; of the ray's mode.
    pub expected: Option<Expected>,
}

/// One ray x patch test with its wires, for the RTL of the intersection unit alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TestVector {
    /// Place of the ray in [`Vectors::rays`].
    pub ray: usize,
    /// Place of the patch in [`Vectors::patches`].
    pub patch: usize,
    /// The answer; t_max is the ray's.
    pub hit: Option<HitWords>,
    /// Every wire.
    pub wires: Wires,
}

/// A file of test vectors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vectors {
    /// The formats of all words.
    pub formats: Formats,
    /// Log2 of the cells a side of the grid that the answers were made with, 1 to 7; none where it does not matter.
    pub grid_log2: Option<u32>,
    /// The scene; ids are unique, in whatever order.
    pub patches: Vec<PatchWords>,
    /// The rays.
    pub rays: Vec<RayVector>,
    /// Single tests.
    pub tests: Vec<TestVector>,
}

/// How vectors are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VectorsFormat {
    /// Text.
    Csv,
    /// Packed records.
    Binary,
}

impl VectorsFormat {
    /// The format that a path's extension names: `.csv` or `.rvec`.
    pub fn of(path: &Path) -> Option<VectorsFormat> {
        let extension = path.extension()?;
        if extension.eq_ignore_ascii_case("csv") {
            Some(VectorsFormat::Csv)
        } else if extension.eq_ignore_ascii_case("rvec") {
            Some(VectorsFormat::Binary)
        } else {
            None
        }
    }

    /// The format in which `bytes` are vectors, by their first record; `None` when they are none.
    pub fn sniff(bytes: &[u8]) -> Option<VectorsFormat> {
        if bytes.starts_with(binary::MAGIC) {
            return Some(VectorsFormat::Binary);
        }
        let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
        let first = text.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
        let first = first.into_iter().find(|line| !line.is_empty() && line[0] != b'#')?;
        let name = first.split(|b| *b == b',').next().unwrap_or(first);
        (name.trim_ascii() == b"vectors").then_some(VectorsFormat::Csv)
    }
}

impl Vectors {
    /// The file's bytes.
    pub fn to_bytes(&self, format: VectorsFormat) -> Vec<u8> {
        match format {
            VectorsFormat::Csv => to_csv(self).into_bytes(),
            VectorsFormat::Binary => to_binary(self),
        }
    }

    /// Vectors from a file's bytes, whichever of the two formats it is.
    ///
    /// # Errors
    /// The first fault.
    pub fn from_bytes(bytes: &[u8]) -> Result<Vectors, VectorsError> {
        if bytes.is_empty() || bytes.starts_with(binary::MAGIC) {
            return from_binary(bytes);
        }
        match std::str::from_utf8(bytes) {
            Ok(text) => from_csv(text),
            Err(e) => Err(Fault::new(
                "the file",
                "no UTF-8 text",
                "CSV text, or a binary file that starts with RVEC",
            )
            .at(Place::Byte(e.valid_up_to() as u64))),
        }
    }

    /// Counts as people read them: `12 patches, 100 rays, 0 tests`.
    pub fn summary(&self) -> String {
        format!("{} patches, {} rays, {} tests", self.patches.len(), self.rays.len(), self.tests.len())
    }
}

#[cfg(test)]
mod tests;
