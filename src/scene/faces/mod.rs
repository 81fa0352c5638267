//! Many small planar faces as one surface: what meshes from other software become.
//!
//! ```text
//! RawFaces (points, polygons, normals as a file has them)
//!   --weld.. build.rs--> faces of 3 or 4 corners, none degenerate, none twice
//!   --join.rs--> pairs of triangles that form a parallelogram are one quad
//!   --smooth.rs--> FaceSet: faces share a point where, and only where, they continue each other
//! ```
//! Positions are f64 metres. Faces that meet at a crease have points of their own at the same, bitwise equal, place.

use std::fmt;

use glam::DVec3;

mod build;
mod join;
mod polygon;
mod smooth;

pub(crate) use build::{Faults, RawFaces};

/// Most faces that one scene may import, after polygons are cut into triangles and quads.
pub const MAX_FACES: usize = 4_000_000;

/// No corner: the fourth of a triangle.
const NONE: u32 = u32::MAX;

/// A surface of planar faces: triangles and convex quads.
///
/// Memory: 16 B a face, and 24 B a point; a closed smooth mesh of quads has as many points as faces, one of triangles
/// half as many, one without smooth normals up to four times as many.
#[derive(Clone, PartialEq)]
pub struct FaceSet {
    points: Vec<DVec3>,
    faces: Vec<[u32; 4]>,
    area_m2: f64,
    counts: FaceCounts,
}

/// What became of a file's polygons on their way into a [`FaceSet`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceCounts {
    /// Polygons of the file.
    pub n_polygons: usize,
    /// Dropped: corners on one line or on one point.
    pub n_degenerate: usize,
    /// Dropped: a second face of the same corners.
    pub n_doubled: usize,
    /// Polygons that were cut: over four corners, concave, or not planar.
    pub n_cut: usize,
    /// Pairs of triangles that became one parallelogram.
    pub n_joined: usize,
    /// Points of the file that lay on another one.
    pub n_welded: usize,
}

impl std::ops::AddAssign for FaceCounts {
    fn add_assign(&mut self, o: FaceCounts) {
        self.n_polygons += o.n_polygons;
        self.n_degenerate += o.n_degenerate;
        self.n_doubled += o.n_doubled;
        self.n_cut += o.n_cut;
        self.n_joined += o.n_joined;
        self.n_welded += o.n_welded;
    }
}

impl FaceSet {
    /// Number of faces.
    pub fn n_faces(&self) -> usize {
        self.faces.len()
    }

    /// Points (m): one per place and smooth continuation.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Indices of a face's corners in [`FaceSet::points`], 3 or 4, counter-clockwise seen from its front.
    pub fn face(&self, index: usize) -> &[u32] {
        corners(&self.faces[index])
    }

    /// All faces, as [`FaceSet::face`].
    pub fn faces(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.faces.iter().map(corners)
    }

    /// Area of one side of all faces (m^2).
    pub fn area_m2(&self) -> f64 {
        self.area_m2
    }

    /// What became of the file's polygons.
    pub fn counts(&self) -> FaceCounts {
        self.counts
    }

    /// Memory that it holds (bytes).
    pub fn memory_bytes(&self) -> usize {
        self.points.capacity() * size_of::<DVec3>() + self.faces.capacity() * size_of::<[u32; 4]>()
    }
}

impl fmt::Debug for FaceSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "FaceSet {{ {} faces, {} points, {} m^2 }}",
            self.faces.len(),
            self.points.len(),
            self.area_m2
        )
    }
}

fn corners(face: &[u32; 4]) -> &[u32] {
    if face[3] == NONE { &face[..3] } else { face }
}

/// Twice the area, along the front normal (m^2), of a planar face.
fn area_vector(p: impl Fn(u32) -> DVec3, face: &[u32; 4]) -> DVec3 {
    let [a, b, c, d] = *face;
    if d == NONE { (p(b) - p(a)).cross(p(c) - p(a)) } else { (p(c) - p(a)).cross(p(d) - p(b)) }
}

#[cfg(test)]
pub(crate) mod tests;
