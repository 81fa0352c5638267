//! `least-squares`: a quadratic through the vertex, fitted to the vertices around.
//!
//! ```text
//! vertex ring (own group) --project on the tangent plane--> f_i - f_0 = g . d + d^T H d / 2 --> g, H
//! ```
//! A full quadratic fit to differences, so the vertex's own value is met exactly; each squared residual is weighted
//! by 1 / length^2. The ring is the vertices of the elements around; where it has under 6 the next ring comes in.
//! Linear where the ring cannot carry a quadratic, zero along directions that it does not see at all.
//!
//! Source: Bastos et al. 1992 for the patch that these derivatives feed; the fit is ours.

use rayon::prelude::*;

use super::super::derivatives::{Derivatives, in_frame};
use super::super::least_squares::LeastSquares;
use super::super::nodes::Nodal;
use crate::geom::tangent_frame;
use crate::units::Rgb;

/// Fewest neighbours that a quadratic fit starts from: one more than its five unknowns.
const MIN_RING: usize = 6;

#[derive(Default)]
struct Scratch {
    ring: Vec<usize>,
    system: LeastSquares,
}

/// Fits at every node; the answer doesn't depend on the number of threads.
pub(super) fn fit_all(nodal: &Nodal<'_>) -> Vec<Derivatives> {
    (0..nodal.table.len())
        .into_par_iter()
        .with_min_len(256)
        .map_init(Scratch::default, |scratch, node| fit(nodal, node, scratch))
        .collect()
}

/// Nodes of the elements around `of` whose vertex is not yet in `ring`.
fn add_ring(nodal: &Nodal<'_>, of: usize, center: usize, ring: &mut Vec<usize>) {
    let table = &nodal.table;
    for &element in table.elements(of) {
        for corner in 0..nodal.mesh.elements[element.0 as usize].corners.vertices().len() {
            let node = table.at(element, corner);
            let vertex = table.vertex(node);
            if vertex != table.vertex(center) && ring.iter().all(|n| table.vertex(*n) != vertex) {
                ring.push(node);
            }
        }
    }
}

/// The nodes that a fit at `center` looks at.
pub(in super::super) fn stencil(nodal: &Nodal<'_>, center: usize, ring: &mut Vec<usize>) {
    ring.clear();
    add_ring(nodal, center, center, ring);
    if ring.len() < MIN_RING {
        for k in 0..ring.len() {
            add_ring(nodal, ring[k], center, ring);
        }
    }
}

fn fit(nodal: &Nodal<'_>, center: usize, scratch: &mut Scratch) -> Derivatives {
    let Scratch { ring, system } = scratch;
    stencil(nodal, center, ring);
    let vertex_of = |node: usize| nodal.table.vertex(node).0 as usize;
    let vertex = &nodal.mesh.vertices[vertex_of(center)];
    let frame = tangent_frame(vertex.normal);
    let value = nodal.values[vertex_of(center)];
    let offset = |node: usize| nodal.mesh.vertices[vertex_of(node)].position - vertex.position;
    // Lengths in units of the ring's size, so that all columns are of one order.
    let scale = ring.iter().map(|n| offset(*n).length()).fold(0.0, f64::max);
    if scale == 0.0 {
        return Derivatives::default();
    }
    system.clear();
    for &node in ring.iter() {
        let d = offset(node) / scale;
        let length = d.length();
        if length == 0.0 {
            continue;
        }
        let [u, w] = in_frame(frame, d);
        let columns = [u, w, 0.5 * u * u, u * w, 0.5 * w * w];
        system.push(columns.map(|c| c / length), ((nodal.values[vertex_of(node)] - value) / length).0);
    }
    let x = system.solve::<5>().or_else(|| system.solve::<2>()).unwrap_or_default();
    let (first, second) = (1.0 / scale, 1.0 / (scale * scale));
    let of = |k: usize| Rgb(x[k]);
    Derivatives {
        gradient: [of(0) * first, of(1) * first],
        hessian: [of(2) * second, of(3) * second, of(4) * second],
    }
}
