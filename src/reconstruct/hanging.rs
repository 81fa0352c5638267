//! Hanging vertices follow the coarse element whose edge they lie on: no cracks.
//!
//! ```text
//! a------T------b   coarse edge a b; bilinear: f(T) = (f(a) + f(b)) / 2
//!        |          Hermite: value and derivatives of the coarse element's surface at T, so that each fine edge is the
//!  fine  |  fine    half of the coarse edge's cubic
//! ```
//! A cubic is fixed by value and slope at both ends, and a and b keep theirs, so the halves coincide. The slope across
//! the edge and the twist are the coarse element's too: among parallelograms of one grid and coplanar triangles the
//! surface stays C1 over a hanging edge. Coarse to fine, so that an end that hangs itself is settled before.
//! The value that the solver measured at T is used for the fits of its neighbours' derivatives only.

use super::bicubic;
use super::derivatives::{Derivatives, Node};
use crate::geom::DVec3;
use crate::mesh::{Corners, Hanging, Mesh, VertexId};
use crate::units::Rgb;

pub(super) fn follow_bilinear(mesh: &Mesh, values: &mut [Rgb]) {
    for Hanging { vertex, ends: [a, b], .. } in &mesh.hanging {
        values[vertex.0 as usize] = (values[a.0 as usize] + values[b.0 as usize]) * 0.5;
    }
}

pub(super) fn follow_hermite(mesh: &Mesh, values: &mut [Rgb], derivatives: &mut [Derivatives]) {
    for hanging in &mesh.hanging {
        let node = |v: VertexId| {
            let v = v.0 as usize;
            derivatives[v].node(&mesh.vertices[v], values[v])
        };
        let edge = usize::from(hanging.edge);
        let (value, slopes) = match mesh.elements[hanging.coarse.0 as usize].corners {
            Corners::Quad(v) => at_quad_edge(&v.map(node), edge),
            Corners::Triangle(v) => at_triangle_edge(&v.map(node), edge),
        };
        let v = hanging.vertex.0 as usize;
        let frame = crate::geom::tangent_frame(mesh.vertices[v].normal);
        values[v] = value;
        let Slopes { along, across, twist } = slopes;
        let old = derivatives[v];
        // A facet that stands on the vertex's tangent plane spans it no more: the edge alone then.
        let upright = (DVec3::cross(frame.0, frame.1).cross(along.0), Rgb::BLACK);
        let followed = old.follow(frame, along, across).or_else(|| old.follow(frame, along, upright));
        let mut new = followed.unwrap_or(old);
        if let Some((x_st, f_st)) = twist {
            let node = new.node(&mesh.vertices[v], value);
            let has = node.second(along.0, across.0) + node.slope(x_st);
            new = new.twisted(frame, along.0, across.0, f_st - has);
        }
        derivatives[v] = new;
    }
}

/// Directions on the coarse element at the middle of its edge, and the slopes along them.
struct Slopes {
    along: (DVec3, Rgb),
    across: (DVec3, Rgb),
    /// x_st and the twist f_st, of quads.
    twist: Option<(DVec3, Rgb)>,
}

fn at_quad_edge(nodes: &[Node; 4], edge: usize) -> (Rgb, Slopes) {
    let (s, t) = [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)][edge];
    let x = nodes.each_ref().map(|n| n.position);
    let x_s = (1.0 - t) * (x[1] - x[0]) + t * (x[2] - x[3]);
    let x_t = (1.0 - s) * (x[3] - x[0]) + s * (x[2] - x[1]);
    let x_st = x[0] - x[1] + x[2] - x[3];
    let [f_s, f_t, f_st] = bicubic::slopes(nodes, s, t);
    let (along, across) =
        if edge.is_multiple_of(2) { ((x_s, f_s), (x_t, f_t)) } else { ((x_t, f_t), (x_s, f_s)) };
    (bicubic::evaluate(nodes, s, t), Slopes { along, across, twist: Some((x_st, f_st)) })
}

fn at_triangle_edge(nodes: &[Node; 3], edge: usize) -> (Rgb, Slopes) {
    let (a, b, c) = (&nodes[edge], &nodes[(edge + 1) % 3], &nodes[(edge + 2) % 3]);
    let along = b.position - a.position;
    let (at_a, at_b) = (a.slope(along), b.slope(along));
    let value = (a.value + b.value) * 0.5 + (at_a - at_b) * 0.125;
    let slope = (b.value - a.value) * 1.5 - (at_a + at_b) * 0.25;
    // The slope across an edge is linear along it.
    let across = (c.position - a.position).reject_from(along);
    let mean = (a.slope(across) + b.slope(across)) * 0.5;
    (value, Slopes { along: (along, slope), across: (across, mean), twist: None })
}
