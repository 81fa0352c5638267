//! Test vectors: patches, rays and expected answers in the board's words, for this board and for others' RTL.
//!
//! ```text
//! Vectors <--csv.rs--> text, one record a line        Vectors <--binary.rs--> the packed records of rtl_model::packet
//! ```

use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::oracle::Wires;

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
    /// The answer, where the file has one.
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
    /// The scene.
    pub patches: Vec<PatchWords>,
    /// The rays.
    pub rays: Vec<RayVector>,
    /// Single tests.
    pub tests: Vec<TestVector>,
}
