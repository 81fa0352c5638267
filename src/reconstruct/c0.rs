//! One slope along every C0 edge: what both sides of it must agree on, or the surface would tear open there.
//!
//! ```text
//!   A | B     gradients of the groups A, B around v, each from its own side;
//!   --v--     for every C0 edge d between two of them: g_A . d = g_B . d
//!   C | B     --> the nearest gradients (least change, all groups together) that obey all of it
//! ```
//! An edge's curve is fixed by the values and the slopes along it at its ends, in every method. Rows g_A . d - g_B . d = 0
//! are made orthonormal one after another, and the gradients projected on what they leave open: never longer than before,
//! whatever the angles between the edges are. A group between two edges that run straight on keeps its slope across.

use super::derivatives::in_frame;
use super::nodes::{Nodal, edges_at};
use crate::geom::{DVec3, tangent_frame};
use crate::mesh::{Continuity, VertexId};
use crate::units::Rgb;

/// Rows shorter than this after the others are taken out are said already.
const MIN_ROW: f64 = 1e-14;

/// coefficients . gradients = right, over the gradients of one vertex's nodes: two components each.
struct Row {
    coefficients: Vec<f64>,
    right: Rgb,
}

/// Makes the groups around every vertex agree.
pub(super) fn agree(nodal: &mut Nodal<'_>) {
    for v in 0..nodal.mesh.vertices.len() as u32 {
        if nodal.table.of_vertex(VertexId(v)).len() > 1 {
            let rows = edge_rows(nodal, VertexId(v));
            satisfy(nodal, VertexId(v), rows);
        }
    }
}

/// The same at one vertex, where in addition the slope along `along` is known in every group.
pub(super) fn agree_with(nodal: &mut Nodal<'_>, vertex: VertexId, (along, slope): (DVec3, Rgb)) {
    let n = nodal.table.of_vertex(vertex).len();
    let [u, v] = in_frame(tangent_frame(nodal.mesh.vertices[vertex.0 as usize].normal), along);
    let length = u.hypot(v);
    if length == 0.0 {
        return;
    }
    let mut rows: Vec<Row> = (0..n)
        .map(|k| {
            let mut coefficients = vec![0.0; 2 * n];
            (coefficients[2 * k], coefficients[2 * k + 1]) = (u / length, v / length);
            Row { coefficients, right: slope / length }
        })
        .collect();
    rows.extend(edge_rows(nodal, vertex));
    satisfy(nodal, vertex, rows);
}

fn edge_rows(nodal: &Nodal<'_>, vertex: VertexId) -> Vec<Row> {
    let (mesh, table) = (nodal.mesh, &nodal.table);
    let nodes = table.of_vertex(vertex);
    let frame = tangent_frame(mesh.vertices[vertex.0 as usize].normal);
    let around = mesh.elements_around(vertex);
    let node_of = |element: crate::mesh::ElementId| {
        let ids = mesh.elements[element.0 as usize].corners.vertices();
        ids.iter().position(|v| *v == vertex).map(|c| table.at(element, c) - nodes.start)
    };
    let mut rows = Vec::new();
    for &id in around {
        let element = &mesh.elements[id.0 as usize];
        for edge in edges_at(&element.corners, vertex) {
            let Some(other) = element.neighbours[edge] else { continue };
            if element.continuity[edge] != Continuity::C0 || !around.contains(&other) {
                continue;
            }
            let (Some(a), Some(b)) = (node_of(id), node_of(other)) else { continue };
            let ids = element.corners.vertices();
            let (from, to) = (ids[edge], ids[(edge + 1) % ids.len()]);
            let end = if from == vertex { to } else { from };
            let at = |v: VertexId| mesh.vertices[v.0 as usize].position;
            let [u, v] = in_frame(frame, at(end) - at(vertex));
            let length = u.hypot(v);
            if a == b || length == 0.0 {
                continue;
            }
            let mut coefficients = vec![0.0; 2 * nodes.len()];
            for (k, sign) in [(a, 1.0), (b, -1.0)] {
                (coefficients[2 * k], coefficients[2 * k + 1]) = (sign * u / length, sign * v / length);
            }
            rows.push(Row { coefficients, right: Rgb::BLACK });
        }
    }
    rows
}

/// Moves the gradients of a vertex's nodes to the nearest ones that obey the rows.
fn satisfy(nodal: &mut Nodal<'_>, vertex: VertexId, rows: Vec<Row>) {
    let nodes = nodal.table.of_vertex(vertex);
    let gradients = &mut nodal.derivatives[nodes];
    let mut basis: Vec<Row> = Vec::new();
    for mut row in rows {
        // Twice, so that what rounding left of the earlier ones goes as well.
        for _ in 0..2 {
            for q in &basis {
                let dot: f64 = q.coefficients.iter().zip(&row.coefficients).map(|(a, b)| a * b).sum();
                row.coefficients.iter_mut().zip(&q.coefficients).for_each(|(a, b)| *a -= dot * b);
                row.right -= q.right * dot;
            }
        }
        let length = row.coefficients.iter().map(|c| c * c).sum::<f64>().sqrt();
        if length < MIN_ROW {
            continue;
        }
        row.coefficients.iter_mut().for_each(|c| *c /= length);
        row.right = row.right / length;
        let mut missing = row.right;
        for (k, c) in row.coefficients.iter().enumerate() {
            missing -= gradients[k / 2].gradient[k % 2] * *c;
        }
        for (k, c) in row.coefficients.iter().enumerate() {
            gradients[k / 2].gradient[k % 2] += missing * *c;
        }
        basis.push(row);
    }
}
