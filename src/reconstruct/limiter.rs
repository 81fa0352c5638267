//! The limiter of `hermite-limited`: smaller derivatives where a cubic would overshoot a kink.
//!
//! ```text
//! kinks.rs: kinked vertices --> they and those fitted to them, each with one factor for gradient and Hessian:
//!   the largest of 0..1 with which every Bezier ordinate near the vertex lies between the corners of its element
//!     quad:     f + f_s/3, f + f_t/3, f + f_s/3 + f_t/3 + f_st/9     triangle: f + slope/3 along both edges
//! ```
//! Along an edge between the lowest and the highest corner f + f_s/3 <= f_1 is Fritsch and Carlson's box, slope <= 3 times
//! the secant; with the inner ordinates in it too, the convex hull keeps a limited element between its corners whatever the
//! data are. All elements around such a vertex count, since they share its gradient. The factor is that of
//! luminance and scales all channels, so hues do not shift. The ordinates in the middle of a limited Clough-Tocher triangle
//! depend on two vertices; they are clamped instead, which gives up C1 across its edges.
//!
//! A hanging vertex has its coarse element's derivatives, so where it makes an element leave its range, the factors of the
//! coarse edge's ends become smaller, in rounds; in the last ones 0.
//!
//! Source: Fritsch, Carlson 1980, "Monotone piecewise cubic interpolation".

use rayon::prelude::*;

use super::bicubic::{CORNERS, corner_tangents};
use super::derivatives::{Derivatives, Node};
use super::hanging;
use super::kinks::kinked_nodes;
use super::nodes::Nodal;
use super::pieces::{QuadSurface, TriangleSurface};
use super::rules::stencil;
use crate::mesh::{Continuity, Corners, Element, ElementId, Mesh, VertexId};

/// Ordinates may leave the range by this share of the largest value: rounding in the fits.
const TOLERANCE: f64 = 1e-12;

/// Rounds in which ends of edges with hanging vertices get smaller factors; in the later half they become 0.
const ROUNDS: u32 = 8;
/// Factors this close to 1 are 1.
const ENOUGH: f64 = 1.0 - 1e-12;

/// Limits the derivatives; the vertices at which it made them smaller.
pub(super) fn limit<Q: QuadSurface, T: TriangleSurface>(nodal: &mut Nodal<'_>) -> Vec<VertexId> {
    let mesh = nodal.mesh;
    let held = held_vertices(nodal);
    let all_held = |e: &Element| e.corners.vertices().iter().all(|v| held[v.0 as usize]);
    nodal.limited = mesh.elements.iter().map(all_held).collect();
    let mut factors: Vec<f64> = (0..mesh.vertices.len() as u32)
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
    let fitted = (nodal.values.clone(), nodal.derivatives.clone());
    scale(nodal, &fitted.1, &factors);
    let ends = HangingEnds::new(mesh);
    let beside: Vec<ElementId> = (0..)
        .map(ElementId)
        .zip(&mesh.elements)
        .filter(|(e, element)| {
            nodal.limited[e.0 as usize] && element.corners.vertices().iter().any(|v| ends.hangs(*v))
        })
        .map(|(e, _)| e)
        .collect();
    for round in 0..ROUNDS {
        if beside.is_empty() {
            break;
        }
        hanging::follow::<Q, T>(nodal);
        let too_long: Vec<(VertexId, f64)> = beside
            .iter()
            .flat_map(|e| mesh.elements[e.0 as usize].corners.vertices().iter().map(|v| (*e, *v)))
            .map(|(e, v)| (v, element_factor(nodal, e, v)))
            .filter(|(_, factor)| *factor < ENOUGH)
            .collect();
        nodal.values.clone_from(&fitted.0);
        if too_long.is_empty() {
            break;
        }
        let before = factors.clone();
        for (vertex, factor) in too_long {
            let factor = if 2 * round < ROUNDS { factor } else { 0.0 };
            ends.for_each_end(vertex, &mut |v| {
                let v = v.0 as usize;
                factors[v] = factors[v].min(factor * before[v]);
            });
        }
        scale(nodal, &fitted.1, &factors);
    }
    (0..).map(VertexId).zip(factors).filter(|(_, factor)| *factor < ENOUGH).map(|(v, _)| v).collect()
}

/// Vertices that are kinked, or whose derivatives were fitted to one that is.
fn held_vertices(nodal: &Nodal<'_>) -> Vec<bool> {
    let kinked = kinked_nodes(nodal);
    (0..nodal.mesh.vertices.len() as u32)
        .into_par_iter()
        .with_min_len(256)
        .map_init(Vec::new, |ring, v| {
            nodal.table.of_vertex(VertexId(v)).any(|node| {
                stencil(nodal, node, ring);
                kinked[node] || ring.iter().any(|n| kinked[*n])
            })
        })
        .collect()
}

/// Derivatives from `fitted`, each vertex's nodes by its factor.
fn scale(nodal: &mut Nodal<'_>, fitted: &[Derivatives], factors: &[f64]) {
    for (node, fitted) in fitted.iter().enumerate() {
        nodal.derivatives[node] = fitted.scaled(factors[nodal.table.vertex(node).0 as usize]);
    }
}

/// Whose derivatives a hanging vertex has in truth.
struct HangingEnds(Vec<Option<[VertexId; 2]>>);

impl HangingEnds {
    fn new(mesh: &Mesh) -> HangingEnds {
        let mut ends = vec![None; mesh.vertices.len()];
        for h in &mesh.hanging {
            if mesh.elements[h.coarse.0 as usize].continuity[usize::from(h.edge)] != Continuity::Broken {
                ends[h.vertex.0 as usize] = Some(h.ends);
            }
        }
        HangingEnds(ends)
    }

    fn hangs(&self, vertex: VertexId) -> bool {
        self.0[vertex.0 as usize].is_some()
    }

    /// The vertex, or the ends of its coarse edge, or of theirs.
    fn for_each_end(&self, vertex: VertexId, act: &mut impl FnMut(VertexId)) {
        match self.0[vertex.0 as usize] {
            Some(ends) => ends.into_iter().for_each(|end| self.for_each_end(end, act)),
            None => act(vertex),
        }
    }
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
