//! Where irradiance is measured: the quadrature points of every element, then every vertex.
//!
//! ```text
//! Mesh, surface offset --> receivers 0..n_gauss (elements in order), n_gauss.. (vertices in order)
//! ```
//! Each has a point for the kernel and a target for rays, lifted off the surface along its normal. A vertex is
//! moved into its surface a little first, so that on a concave edge it stands in front of both walls.

use glam::DVec3;

use super::near_field::Extent;
use crate::mesh::{Element, ElementId, Mesh, Vertex};

/// Share of the way in from a border at which a vertex is evaluated.
const VERTEX_INSET_SHARE: f64 = 1e-6;
/// Rays to a vertex end at least this many surface offsets inside the border, so that the wall beyond, from which
/// the ray may start lifted by one offset, never answers.
const VERTEX_INSET_OFFSETS: f64 = 8.0;
/// But at most this share of the way in.
const VERTEX_INSET_MAX_SHARE: f64 = 0.25;

/// A place that receives light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    /// Where the kernel is evaluated (m).
    pub point: DVec3,
    /// Where rays end (m).
    pub target: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Share of its element's area; 1 for vertices.
    pub weight: f64,
    /// Element or vertex index.
    pub owner: u32,
    /// Which quadrature point of its element; 0 for vertices.
    pub slot: u8,
}

impl Receiver {
    /// Vertex `v`.
    pub(crate) fn of_vertex(vertex: &Vertex, v: u32, offset_m: f64) -> Receiver {
        let inward = way_in(vertex);
        let length = inward.length();
        let inset = (VERTEX_INSET_SHARE * length)
            .max(VERTEX_INSET_OFFSETS * offset_m)
            .min(VERTEX_INSET_MAX_SHARE * length);
        Receiver {
            point: vertex.position + VERTEX_INSET_SHARE * inward,
            target: vertex.position + inset * inward.normalize_or_zero() + offset_m * vertex.normal,
            normal: vertex.normal,
            weight: 1.0,
            owner: v,
            slot: 0,
        }
    }
}

/// All receivers of a mesh.
#[derive(Clone, Debug)]
pub(super) struct Receivers {
    /// Quadrature points, element after element, then vertices.
    pub all: Vec<Receiver>,
    /// Quadrature points of element e: `element_starts[e]..element_starts[e + 1]`; the last entry is their number.
    pub element_starts: Vec<u32>,
    /// Where each element lies and how large it is.
    pub extents: Vec<Extent>,
}

impl Receivers {
    pub(super) fn of(mesh: &Mesh, offset_m: f64) -> Receivers {
        let mut all = Vec::with_capacity(4 * mesh.elements.len() + mesh.vertices.len());
        let mut element_starts = Vec::with_capacity(mesh.elements.len() + 1);
        for (e, element) in mesh.elements.iter().enumerate() {
            element_starts.push(all.len() as u32);
            let quadrature = mesh.quadrature(ElementId(e as u32));
            let total: f64 = quadrature.points().iter().map(|(_, w)| w).sum();
            for (slot, &(point, weight)) in quadrature.points().iter().enumerate() {
                all.push(Receiver {
                    point,
                    target: point + offset_m * element.normal,
                    normal: element.normal,
                    // An element without area receives nothing.
                    weight: if total > 0.0 { weight / total } else { 0.0 },
                    owner: e as u32,
                    slot: slot as u8,
                });
            }
        }
        element_starts.push(all.len() as u32);
        for (v, vertex) in mesh.vertices.iter().enumerate() {
            all.push(Receiver::of_vertex(vertex, v as u32, offset_m));
        }
        let extent = |e: &Element| Extent::of(&mesh.polygon(&e.corners));
        let extents = mesh.elements.iter().map(extent).collect();
        Receivers { all, element_starts, extents }
    }

    /// How many quadrature points; vertices follow.
    pub(super) fn n_gauss(&self) -> usize {
        self.element_starts.last().map_or(0, |n| *n as usize)
    }

    /// The quadrature points of an element.
    pub(super) fn points_of(&self, element: usize) -> std::ops::Range<usize> {
        self.element_starts[element] as usize..self.element_starts[element + 1] as usize
    }

    pub(super) fn n_elements(&self) -> usize {
        self.element_starts.len() - 1
    }
}

/// The way in from a border, never below the tangent plane: on a convex surface the centroids around a vertex lie
/// under it, and a target there would be buried.
fn way_in(vertex: &Vertex) -> DVec3 {
    vertex.inward - vertex.normal * vertex.inward.dot(vertex.normal).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn way_in_of_a_convex_vertex_stays_in_the_tangent_plane() {
        let vertex = Vertex { position: DVec3::ZERO, normal: DVec3::Z, inward: DVec3::new(0.1, 0.0, -0.02) };
        assert_eq!(way_in(&vertex), DVec3::new(0.1, 0.0, 0.0));
        let concave = Vertex { inward: DVec3::new(0.1, 0.0, 0.02), ..vertex };
        assert_eq!(way_in(&concave), concave.inward);
    }
}
