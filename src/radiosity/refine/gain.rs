//! What a split changes: the hierarchical surplus of the irradiance at the vertices that it adds.
//!
//! ```text
//! trial solve --> Y at the corners of a node and of its quarters --> surplus = Y - bilinear (linear) interpolation
//!             --> gain = integral of surplus^2 over the node, over the squared mean of its surface
//! ```
//! The surplus is zero at the node's corners and (bi)linear on each quarter, so the integral is exact: the mass matrix
//! of the quarter. Of a quadratic it is 0.64 of the fall of the squared error.

use crate::mesh::{Corners, Mesh, PatchId, Place, VertexId};
use crate::radiosity::Solution;
use crate::scene::Scene;

/// Of a quadratic, squared error of interpolation over the integral of the squared surplus: (1 / 120) / (1 / 192).
pub(super) const ERROR_PER_GAIN: f64 = 1.6;

/// Corners of a quad's quarters in halves of its (s,t), quarter by quarter.
const QUAD: [[(u8, u8); 4]; 4] = [
    [(0, 0), (1, 0), (1, 1), (0, 1)],
    [(1, 0), (2, 0), (2, 1), (1, 1)],
    [(0, 1), (1, 1), (1, 2), (0, 2)],
    [(1, 1), (2, 1), (2, 2), (1, 2)],
];
/// Corners of a triangle's quarters in halves of the weights of its corners 1 and 2.
const TRIANGLE: [[(u8, u8); 3]; 4] =
    [[(0, 0), (1, 0), (0, 1)], [(1, 0), (2, 0), (1, 1)], [(0, 1), (1, 1), (0, 2)], [(1, 1), (0, 1), (1, 0)]];

/// Area mean of the luminance of irradiance on each surface (W/m^2, luminance-weighted).
pub(super) fn mean_luminance(scene: &Scene, mesh: &Mesh, solution: &Solution) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); scene.surfaces.len()];
    for (element, e) in mesh.elements.iter().zip(&solution.element_irradiance) {
        let (sum, area) = &mut sums[mesh.patches[element.patch.0 as usize].surface.0 as usize];
        *sum += e.total().luminance() * element.area_m2;
        *area += element.area_m2;
    }
    sums.into_iter().map(|(sum, area)| if area > 0.0 { sum / area } else { 0.0 }).collect()
}

/// Luminance at the vertices of a trial mesh.
pub(super) struct Field<'a> {
    mesh: &'a Mesh,
    luminance: Vec<f64>,
    surfaces: &'a [f64],
}

impl<'a> Field<'a> {
    pub(super) fn new(mesh: &'a Mesh, solution: &Solution, surfaces: &'a [f64]) -> Field<'a> {
        let luminance = solution.vertex_irradiance.iter().map(|e| e.total().luminance()).collect();
        Field { mesh, luminance, surfaces }
    }

    /// What splitting a node of the quadtree of `patch` changes (m^2); it is split in the trial mesh.
    pub(super) fn gain(&self, patch: u32, place: Place) -> f64 {
        let of_patch = &self.mesh.patches[patch as usize];
        let mean = self.surfaces[of_patch.surface.0 as usize];
        if mean <= 0.0 {
            return 0.0;
        }
        let at = |v: VertexId| self.luminance[v.0 as usize] / mean;
        let quarters = (0..4).map(|k| place.quarter(k));
        match of_patch.corners {
            Corners::Quad(_) => {
                let f = [0, 1, 2, 3].map(|j| at(self.mesh.corner_of(PatchId(patch), place, j)));
                let of = |(quarter, places): (Place, [(u8, u8); 4])| {
                    let v = [0, 1, 2, 3].map(|j| self.mesh.corner_of(PatchId(patch), quarter, j));
                    let surplus: [f64; 4] = std::array::from_fn(|j| {
                        let (s, t) = (0.5 * f64::from(places[j].0), 0.5 * f64::from(places[j].1));
                        let low = f[0] * (1.0 - s) + f[1] * s;
                        let high = f[3] * (1.0 - s) + f[2] * s;
                        at(v[j]) - (low * (1.0 - t) + high * t)
                    });
                    self.area_m2(&v) * mean_square_quad(surplus)
                };
                quarters.zip(QUAD).map(of).sum()
            }
            Corners::Triangle(_) => {
                let f = [0, 1, 2].map(|j| at(self.mesh.corner_of(PatchId(patch), place, j)));
                let of = |(quarter, places): (Place, [(u8, u8); 3])| {
                    let v = [0, 1, 2].map(|j| self.mesh.corner_of(PatchId(patch), quarter, j));
                    let surplus: [f64; 3] = std::array::from_fn(|j| {
                        let (s, t) = (0.5 * f64::from(places[j].0), 0.5 * f64::from(places[j].1));
                        at(v[j]) - (f[0] * (1.0 - s - t) + f[1] * s + f[2] * t)
                    });
                    self.area_m2(&v) * mean_square_triangle(surplus)
                };
                quarters.zip(TRIANGLE).map(of).sum()
            }
        }
    }

    fn area_m2(&self, corners: &[VertexId]) -> f64 {
        let p = |k: usize| self.mesh.vertices[corners[k].0 as usize].position;
        let cross = match corners.len() {
            3 => (p(1) - p(0)).cross(p(2) - p(0)),
            _ => (p(2) - p(0)).cross(p(3) - p(1)),
        };
        0.5 * cross.length()
    }
}

/// Mean of the square of a bilinear function of these corner values.
fn mean_square_quad(f: [f64; 4]) -> f64 {
    let squares: f64 = f.iter().map(|x| x * x).sum();
    let adjacent: f64 = (0..4).map(|k| f[k] * f[(k + 1) % 4]).sum();
    let opposite = f[0] * f[2] + f[1] * f[3];
    (4.0 * squares + 4.0 * adjacent + 2.0 * opposite) / 36.0
}

/// Mean of the square of a linear function of these corner values.
fn mean_square_triangle([a, b, c]: [f64; 3]) -> f64 {
    (a * a + b * b + c * c + a * b + b * c + c * a) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_squares_equal_the_integrals_term_by_term() {
        assert!((mean_square_quad([3.0; 4]) - 9.0).abs() < 1e-14);
        assert!((mean_square_triangle([3.0; 3]) - 9.0).abs() < 1e-14);
        // s t on the unit square: 1 / 9; s: 1 / 3; the hat of one corner of a triangle: 1 / 6.
        assert!((mean_square_quad([0.0, 0.0, 1.0, 0.0]) - 1.0 / 9.0).abs() < 1e-14);
        assert!((mean_square_quad([0.0, 1.0, 1.0, 0.0]) - 1.0 / 3.0).abs() < 1e-14);
        assert!((mean_square_triangle([1.0, 0.0, 0.0]) - 1.0 / 6.0).abs() < 1e-14);
    }
}
