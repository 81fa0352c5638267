//! The limiter of `hermite-limited`: smaller derivatives where a cubic would overshoot a kink.
//!
//! ```text
//! kinks.rs: kinked vertices --> elements with one --> their vertices, each with one factor for gradient and Hessian:
//!   the largest of 0..1 with which every Bezier ordinate near the vertex lies between the corners of its element
//!     quad:     f + f_s/3, f + f_t/3, f + f_s/3 + f_t/3 + f_st/9     triangle: f + slope/3 along both edges
//! ```
//! Along an edge between the lowest and the highest corner f + f_s/3 <= f_1 is Fritsch and Carlson's box, slope <= 3 times
//! the secant; with the inner ordinates in it too, the convex hull keeps a limited element between its corners whatever the
//! data are. All elements around a vertex of a kinked element count, since they share its gradient. The factor is that of
//! luminance and scales all channels, so hues do not shift. The ordinates in the middle of a limited Clough-Tocher triangle
//! depend on two vertices; they are clamped instead, which gives up C1 across its edges.
//!
//! Hanging vertices follow the limited coarse element afterwards; a fine element may leave its own corners' range there, not
//! that of the coarse one's.
//!
//! Source: Fritsch, Carlson 1980, "Monotone piecewise cubic interpolation".

use rayon::prelude::*;

use super::bicubic::{CORNERS, corner_tangents};
use super::derivatives::Node;
use super::kinks::kinked_nodes;
use super::nodes::Nodal;
use crate::mesh::{Corners, Element, ElementId, VertexId};

/// Ordinates may leave the range by this share of the largest value: rounding in the fits.
const TOLERANCE: f64 = 1e-12;

/// Limits the derivatives; the vertices at which it made them smaller.
pub(super) fn limit(nodal: &mut Nodal<'_>) -> Vec<VertexId> {
    let mesh = nodal.mesh;
    let kinked = kinked_nodes(nodal);
    let mut held = vec![false; mesh.vertices.len()];
    for element in &mesh.elements {
        let ids = element.corners.vertices();
        if ids.iter().any(|v| nodal.table.of_vertex(*v).any(|n| kinked[n])) {
            ids.iter().for_each(|v| held[v.0 as usize] = true);
        }
    }
    let factors: Vec<f64> = (0..mesh.vertices.len() as u32)
        .into_par_iter()
        .with_min_len(256)
        .map(|v| {
            if !held[v as usize] {
                return 1.0;
            }
            mesh.elements_around(VertexId(v))
                .iter()
                .map(|e| element_factor(nodal, *e, VertexId(v)))
                .fold(1.0, f64::min)
        })
        .collect();
    let all_held = |e: &Element| e.corners.vertices().iter().all(|v| held[v.0 as usize]);
    nodal.limited = mesh.elements.iter().map(all_held).collect();
    let mut smaller = Vec::new();
    for (vertex, factor) in (0..).map(VertexId).zip(factors).filter(|(_, factor)| *factor < 1.0) {
        for node in nodal.table.of_vertex(vertex) {
            nodal.derivatives[node] = nodal.derivatives[node].scaled(factor);
        }
        smaller.push(vertex);
    }
    smaller
}

/// The largest factor of a vertex's derivatives that one of its elements allows.
fn element_factor(nodal: &Nodal<'_>, element: ElementId, vertex: VertexId) -> f64 {
    let corners = &nodal.mesh.elements[element.0 as usize].corners;
    let ids = corners.vertices();
    let nodes = nodal.corners(element);
    let luminance = nodes.each_ref().map(|n| n.value.luminance());
    let low = luminance.iter().copied().fold(f64::INFINITY, f64::min);
    let high = luminance.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let tolerance = TOLERANCE * low.abs().max(high.abs());
    let mut factor = 1.0_f64;
    for corner in (0..ids.len()).filter(|c| ids[*c] == vertex) {
        let value = luminance[corner];
        let rises = match corners {
            Corners::Quad(_) => quad_rises(&nodes, corner),
            Corners::Triangle(_) => triangle_rises(&nodes, corner),
        };
        for rise in rises.into_iter().filter(|rise| rise.abs() > tolerance) {
            let room = if rise > 0.0 { high - value } else { value - low };
            factor = factor.min(room / rise.abs());
        }
    }
    factor
}

/// Ordinates next to a corner less its value, in luminance.
fn quad_rises(nodes: &[Node; 4], corner: usize) -> [f64; 3] {
    let x = nodes.each_ref().map(|n| n.position);
    let node = &nodes[corner];
    let (i, j) = CORNERS[corner];
    let [x_s, x_t, x_st] = corner_tangents(&x, (i, j));
    let (inward_s, inward_t) = (1.0 - 2.0 * i as f64, 1.0 - 2.0 * j as f64);
    let s = node.slope(x_s).luminance() * inward_s / 3.0;
    let t = node.slope(x_t).luminance() * inward_t / 3.0;
    let twist = (node.second(x_s, x_t) + node.slope(x_st)).luminance() * inward_s * inward_t / 9.0;
    [s, t, s + t + twist]
}

fn triangle_rises(nodes: &[Node; 4], corner: usize) -> [f64; 3] {
    let node = &nodes[corner];
    let rise = |to: usize| node.slope(nodes[to].position - node.position).luminance() / 3.0;
    [rise((corner + 1) % 3), rise((corner + 2) % 3), 0.0]
}
