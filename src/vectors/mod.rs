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
        let first = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
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
        if bytes.starts_with(binary::MAGIC) {
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
