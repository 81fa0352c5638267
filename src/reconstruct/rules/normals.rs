//! Gradients from normals of the radiosity surface (u, v, B) over the tangent plane, channel by channel.
//!
//! ```text
//! seed-edge-normals   edges at the vertex --> n_e = (-s d, 1) / sqrt(1 + s^2), s = dB / length along the unit vector d
//! facet-normals       facets around       --> n_f = (-g, 1) / sqrt(1 + |g|^2), g the facet's gradient
//!                     mean normal n       --> the plane normal to it: gradient = -n_uv / n_B
//! ```
//! `seed-edge-normals` is the 1992 paper read literally ("the mean of the normals of the edges that meet in the vertex"). An
//! edge's normal is normal to the edge and lies in the vertical plane through it, so it knows the gradient's share along the
//! edge only. For a linear field of gradient g, with s_e = g . d_e,
//! ```text
//!   gradient = sum_e (g . d_e) d_e / sqrt(1 + s_e^2)  /  sum_e 1 / sqrt(1 + s_e^2)
//! ```
//! - Small slopes: the mean of d d^T times g. Over a star of equal angles (3 edges or more; also a corner's two at a right
//!   angle) that mean is half the identity: **half the gradient**. At the border of a grid (two edges along it, one across)
//!   it is 2/3 of the slope along the border and 1/3 of the slope across.
//! - Large slopes: every term with a slope is bounded, s / sqrt(1 + s^2) < 1: with g along one axis of a grid the result is
//!   s / (1 + sqrt(1 + s^2)), never above 1 whatever the slope is. **It depends on the unit of radiosity**: the same room in
//!   mW/m^2, or in mm, has other tangents.
//!
//! `facet-normals` is exact for linear fields; elsewhere its weights depend on the unit as well. At a border it is the
//! gradient half an element inside.
//!
//! Source: Bastos et al. 1992; facet normals as Gouraud 1971 averages them.

use super::super::nodes::Nodal;
use super::lifted;
use crate::units::Rgb;

/// Sums of normals, a channel each: (n_u, n_v, n_B).
#[derive(Default)]
struct NormalSum([[f64; 3]; 3]);

impl NormalSum {
    /// Adds (-a_c, -b_c, 1) / length for each channel c.
    fn add(&mut self, a: Rgb, b: Rgb) {
        for (c, sum) in self.0.iter_mut().enumerate() {
            let normal = [-a.0[c], -b.0[c], 1.0];
            let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
            sum.iter_mut().zip(normal).for_each(|(s, n)| *s += n / length);
        }
    }

    /// The gradient of the plane normal to it.
    fn gradient(&self) -> [Rgb; 2] {
        [0, 1].map(|k| Rgb(self.0.map(|n| if n[2] > 0.0 { -n[k] / n[2] } else { 0.0 })))
    }
}

/// The mean of the edges' normals.
pub(super) fn seed_edge_normals(nodal: &Nodal<'_>, node: usize) -> [Rgb; 2] {
    let mut neighbours = Vec::new();
    nodal.table.edge_neighbours(nodal.mesh, node, &mut neighbours);
    let mut sum = NormalSum::default();
    for other in neighbours {
        let ([u, v], rise) = lifted(nodal, node, other);
        let square = u * u + v * v;
        if square > 0.0 {
            sum.add(rise * (u / square), rise * (v / square));
        }
    }
    sum.gradient()
}

/// The mean of the facets' normals; a quad's facet is spanned by its diagonals.
pub(super) fn facet_normals(nodal: &Nodal<'_>, node: usize) -> [Rgb; 2] {
    let mut sum = NormalSum::default();
    for &element in nodal.table.elements(node) {
        let n = nodal.mesh.elements[element.0 as usize].corners.vertices().len();
        let p: Vec<_> = (0..n).map(|k| lifted(nodal, node, nodal.table.at(element, k))).collect();
        let between = |a: usize, b: usize| {
            let ((x, f), (y, g)) = (p[a], p[b]);
            ([y[0] - x[0], y[1] - x[1]], g - f)
        };
        let (([au, av], a), ([bu, bv], b)) =
            if n == 4 { (between(0, 2), between(1, 3)) } else { (between(0, 1), between(0, 2)) };
        let det = au * bv - av * bu;
        if det != 0.0 {
            sum.add((a * bv - b * av) / det, (b * au - a * bu) / det);
        }
    }
    sum.gradient()
}
