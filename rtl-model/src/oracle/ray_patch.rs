//! Ray x patch in f64: the oracle of the ICU.

use crate::datapath::{HitWords, PatchWords, RayWords};
use crate::fixed::Formats;

/// The wires of a test, each the exact sum of its expansion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wires {
    /// Corners relative to the origin.
    pub a: [[i64; 3]; 4],
    /// Rounded normals of the edges 01, 12, 02, 23, 30 (for a triangle 01, 12, 20 and zeros).
    pub c: [[i128; 3]; 5],
    /// Their edge values.
    pub e: [i128; 5],
    /// The triangles v0 v1 v2 and, of a quad, v0 v2 v3.
    pub triangles: [Option<TriangleWires>; 2],
}

/// The wires of one triangle of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleWires {
    /// The ray's line meets the triangle.
    pub inside: bool,
    /// Face normal.
    pub n: [i128; 3],
    /// Sum of the edge values.
    pub den: i128,
    /// a_0 . n.
    pub num: i128,
}

/// Tests one ray with one patch.
pub fn intersect(_formats: &Formats, _ray: &RayWords, _patch: &PatchWords) -> Option<HitWords> {
    todo!()
}

/// The wires of a test.
pub fn wires(_formats: &Formats, _ray: &RayWords, _patch: &PatchWords) -> Wires {
    todo!()
}
