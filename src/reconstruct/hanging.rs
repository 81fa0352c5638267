//! Hanging vertices follow the coarse element whose edge they lie on: no cracks.
//!
//! ```text
//! a------T------b   coarse edge a b; value and derivatives of the coarse element's surface at T, so that each fine edge
//!        |          is the half of the coarse edge's curve
//!  fine  |  fine
//! ```
//! A curve is fixed by value and slope at both ends (a cubic; two quadratics with their knot at T), and a and b keep theirs,
//! so the halves coincide. The slope across the edge and the twist are the coarse element's too: among parallelograms of one
//! grid and coplanar triangles the surface stays C1 over a hanging edge. Over a C0 edge T keeps its own slope across. Coarse
//! to fine, so that an end that hangs itself is settled before.
//! The value that the solver measured at T is used for the fits of its neighbours' derivatives only.

use super::c0;
use super::nodes::Nodal;
use super::pieces::{EdgeMiddle, QuadSurface, TriangleSurface, triangle_at_edge};
use crate::geom::DVec3;
use crate::mesh::{Continuity, Corners};
use crate::units::Rgb;

pub(super) fn follow<Q: QuadSurface, T: TriangleSurface>(nodal: &mut Nodal<'_>) {
    let mesh = nodal.mesh;
    for hanging in &mesh.hanging {
        let coarse = &mesh.elements[hanging.coarse.0 as usize];
        let edge = usize::from(hanging.edge);
        let continuity = coarse.continuity[edge];
        if continuity == Continuity::Broken {
            continue;
        }
        let nodes = nodal.corners(hanging.coarse);
        let middle = match coarse.corners {
            Corners::Quad(_) => Q::at_edge(&nodes, edge),
            Corners::Triangle(_) => triangle_at_edge::<T>(&[nodes[0], nodes[1], nodes[2]], edge),
        };
        nodal.values[hanging.vertex.0 as usize] = middle.value;
        if continuity == Continuity::C0 {
            c0::agree_with(nodal, hanging.vertex, middle.along);
            continue;
        }
        for node in nodal.table.of_vertex(hanging.vertex) {
            follow_smoothly(nodal, node, &middle);
        }
    }
}

fn follow_smoothly(nodal: &mut Nodal<'_>, node: usize, middle: &EdgeMiddle) {
    let EdgeMiddle { along, across, twist, .. } = *middle;
    let old = nodal.node(node);
    let derivatives = old.derivatives;
    // A facet that stands on the vertex's tangent plane spans it no more: the edge alone then.
    let upright = (DVec3::cross(old.frame.0, old.frame.1).cross(along.0), Rgb::BLACK);
    let followed = derivatives
        .follow(old.frame, along, across)
        .or_else(|| derivatives.follow(old.frame, along, upright))
        .unwrap_or(derivatives);
    nodal.derivatives[node] = followed;
    if let Some((x_st, f_st)) = twist {
        let new = nodal.node(node);
        let has = new.second(along.0, across.0) + new.slope(x_st);
        nodal.derivatives[node] = followed.twisted(new.frame, along.0, across.0, f_st - has);
    }
}
