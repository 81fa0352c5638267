//! Where the values bend more sharply than a smooth field does at this density.
//!
//! ```text
//! a2---a---v---b     second difference at v along a line of edges:
//!                    D = 2 (l_a (f_b - f_v) + l_b (f_a - f_v)) / (l_a + l_b), f_a - 2 f_v + f_b where l_a = l_b
//! kinked: |D_v| over 5 % of the largest of the three, and under 1/8 of it both at a and at a2 (where there is one);
//!         or |D_v| over 3/4 of it, whatever is beside: light and dark side by side
//! ```
//! No kink by the first of these where D is of one sign and not small at v, at b and at the vertex after b: a kink between
//! two vertices bends those two, a crest of a smooth field more.
//!
//! Luminance. Two in a row at a and a2, because D of a smooth field passes through 0 at an inflection, but does not stay
//! there. Lines go on through a vertex over the edge most opposite; they never cross a C0 edge, whose kink is known already.
//!
//! Not used: visibility of single sources, which a solution does not keep.

use rayon::prelude::*;

use super::nodes::Nodal;
use crate::geom::DVec3;

/// Smallest second difference of a kink, over the largest value of the three.
const MIN_BEND: f64 = 0.05;
/// Second difference that no smooth field has, over the same.
const SHARP: f64 = 0.75;
/// How much smaller it is beside a kink.
const MIN_CHANGE: f64 = 8.0;
/// Edges that go on: cosine between them.
const STRAIGHT: f64 = -0.8;

/// Per node.
pub(super) fn kinked_nodes(nodal: &Nodal<'_>) -> Vec<bool> {
    (0..nodal.table.len())
        .into_par_iter()
        .with_min_len(256)
        .map_init(Vec::new, |neighbours, node| {
            nodal.table.edge_neighbours(nodal.mesh, node, neighbours);
            neighbours.iter().any(|a| kinked_toward(nodal, node, *a))
        })
        .collect()
}

fn kinked_toward(nodal: &Nodal<'_>, node: usize, a: usize) -> bool {
    let Some(Bend { difference, largest, next }) = bend(nodal, node, a) else { return false };
    if difference.abs() <= MIN_BEND * largest {
        return false;
    }
    if difference.abs() > SHARP * largest {
        return true;
    }
    let small = |d: f64| MIN_CHANGE * d.abs() < difference.abs();
    let alike = |b: &Bend| b.difference * difference > 0.0 && !small(b.difference);
    let second = bend(nodal, next, node).filter(alike);
    if second.and_then(|b| bend(nodal, b.next, next)).is_some_and(|third| alike(&third)) {
        return false;
    }
    let Some(beside) = bend(nodal, a, node) else { return false };
    small(beside.difference) && bend(nodal, beside.next, a).is_none_or(|b| small(b.difference))
}

/// The second difference at a node along the line that comes from `from`.
struct Bend {
    difference: f64,
    /// Largest of the three values.
    largest: f64,
    /// The node that the line goes on to.
    next: usize,
}

fn bend(nodal: &Nodal<'_>, node: usize, from: usize) -> Option<Bend> {
    let at = |n: usize| nodal.mesh.vertices[nodal.table.vertex(n).0 as usize].position;
    let luminance = |n: usize| nodal.values[nodal.table.vertex(n).0 as usize].luminance();
    let mut neighbours = Vec::new();
    nodal.table.edge_neighbours(nodal.mesh, node, &mut neighbours);
    let back = at(from) - at(node);
    let cos = |n: usize| {
        let forth: DVec3 = at(n) - at(node);
        forth.dot(back) / (forth.length() * back.length())
    };
    let next = neighbours.into_iter().reduce(|a, b| if cos(b) < cos(a) { b } else { a })?;
    if cos(next) > STRAIGHT {
        return None;
    }
    let (l_a, l_b) = (back.length(), (at(next) - at(node)).length());
    let [f_a, f, f_b] = [from, node, next].map(luminance);
    let difference = 2.0 * (l_a * (f_b - f) + l_b * (f_a - f)) / (l_a + l_b);
    Some(Bend { difference, largest: f_a.abs().max(f.abs()).max(f_b.abs()), next })
}
