//! Gradient and Hessian of irradiance at every vertex, by the `least-squares` rule.
//!
//! ```text
//! vertex ring (own continuity group) --project on the tangent plane--> f_i - f_0 = g . d + d^T H d / 2 --> g, H
//! ```
//! A full quadratic fit to differences, so the vertex's own value is met exactly; each squared residual is weighted
//! by 1 / length^2. The ring is the vertices of the elements around; where it has under 6 the next ring comes in.
//! Linear where the ring cannot carry a quadratic, zero along directions that it does not see at all.
//!
//! Source: Bastos et al. 1992 for the patch that these derivatives feed.

use rayon::prelude::*;

use super::least_squares::LeastSquares;
use crate::geom::{DVec3, tangent_frame};
use crate::mesh::{Mesh, Vertex, VertexId};
use crate::units::Rgb;

/// Fewest neighbours that a quadratic fit starts from: one more than its five unknowns.
const MIN_RING: usize = 6;

/// First and second derivatives per channel in the tangent frame of the vertex normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Derivatives {
    /// d/du, d/dv (W/m^3).
    gradient: [Rgb; 2],
    /// d2/du2, d2/dudv, d2/dv2 (W/m^4).
    hessian: [Rgb; 3],
}

/// What an element needs to know of one corner.
pub(super) struct Node {
    pub(super) position: DVec3,
    pub(super) value: Rgb,
    pub(super) frame: (DVec3, DVec3),
    derivatives: Derivatives,
}

impl Derivatives {
    pub(super) fn node(&self, vertex: &Vertex, value: Rgb) -> Node {
        let frame = tangent_frame(vertex.normal);
        Node { position: vertex.position, value, frame, derivatives: *self }
    }
}

impl Derivatives {
    /// The same with another gradient, and a Hessian that takes `twist` more from (a, b): those of the plane (u, v) of
    /// the vertex's frame in which g . a = along_a and g . b = along_b; `None` when a and b do not span it.
    pub(super) fn follow(
        &self,
        frame: (DVec3, DVec3),
        (a, along_a): (DVec3, Rgb),
        (b, along_b): (DVec3, Rgb),
    ) -> Option<Derivatives> {
        let [p, q] = dual(frame, a, b)?;
        let gradient = [0, 1].map(|k| along_a * p[k] + along_b * q[k]);
        Some(Derivatives { gradient, ..*self })
    }

    /// The same with the Hessian changed so that a^T H b grows by `twist`, and neither a^T H a nor b^T H b changes.
    pub(super) fn twisted(&self, frame: (DVec3, DVec3), a: DVec3, b: DVec3, twist: Rgb) -> Derivatives {
        let Some([p, q]) = dual(frame, a, b) else { return *self };
        let part = [2.0 * p[0] * q[0], p[0] * q[1] + p[1] * q[0], 2.0 * p[1] * q[1]];
        let mut hessian = self.hessian;
        hessian.iter_mut().zip(part).for_each(|(h, part)| *h += twist * part);
        Derivatives { hessian, ..*self }
    }
}

/// Vectors p, q of the frame's plane with p . a = q . b = 1 and p . b = q . a = 0.
fn dual(frame: (DVec3, DVec3), a: DVec3, b: DVec3) -> Option<[[f64; 2]; 2]> {
    let (au, av) = (a.dot(frame.0), a.dot(frame.1));
    let (bu, bv) = (b.dot(frame.0), b.dot(frame.1));
    let det = au * bv - av * bu;
    let spans = det.abs() > 1e-9 * a.length() * b.length();
    spans.then(|| [[bv / det, -bu / det], [-av / det, au / det]])
}

impl Node {
    /// g . d
    pub(super) fn slope(&self, d: DVec3) -> Rgb {
        let [u, v] = self.derivatives.gradient;
        u * d.dot(self.frame.0) + v * d.dot(self.frame.1)
    }

    /// a^T H b
    pub(super) fn second(&self, a: DVec3, b: DVec3) -> Rgb {
        let (au, av) = (a.dot(self.frame.0), a.dot(self.frame.1));
        let (bu, bv) = (b.dot(self.frame.0), b.dot(self.frame.1));
        let [uu, uv, vv] = self.derivatives.hessian;
        uu * (au * bu) + uv * (au * bv + av * bu) + vv * (av * bv)
    }
}

/// Fits every vertex; the answer doesn't depend on the number of threads.
pub(super) fn fit_all(mesh: &Mesh, values: &[Rgb]) -> Vec<Derivatives> {
    (0..mesh.vertices.len() as u32)
        .into_par_iter()
        .with_min_len(256)
        .map_init(Scratch::default, |scratch, v| fit(mesh, values, VertexId(v), scratch))
        .collect()
}

#[derive(Default)]
struct Scratch {
    ring: Vec<VertexId>,
    system: LeastSquares,
}

/// Vertices of the elements around `of` that are not yet in `ring`.
fn add_ring(mesh: &Mesh, of: VertexId, center: VertexId, ring: &mut Vec<VertexId>) {
    for element in mesh.elements_around(of) {
        for &v in mesh.elements[element.0 as usize].corners.vertices() {
            if v != center && !ring.contains(&v) {
                ring.push(v);
            }
        }
    }
}

fn fit(mesh: &Mesh, values: &[Rgb], center: VertexId, scratch: &mut Scratch) -> Derivatives {
    let Scratch { ring, system } = scratch;
    ring.clear();
    add_ring(mesh, center, center, ring);
    if ring.len() < MIN_RING {
        for k in 0..ring.len() {
            add_ring(mesh, ring[k], center, ring);
        }
    }
    let vertex = &mesh.vertices[center.0 as usize];
    let frame = tangent_frame(vertex.normal);
    let value = values[center.0 as usize];
    let offset = |v: VertexId| mesh.vertices[v.0 as usize].position - vertex.position;
    // Lengths in units of the ring's size, so that all columns are of one order.
    let scale = ring.iter().map(|&v| offset(v).length()).fold(0.0, f64::max);
    if scale == 0.0 {
        return Derivatives::default();
    }
    system.clear();
    for &v in ring.iter() {
        let d = offset(v) / scale;
        let length = d.length();
        if length == 0.0 {
            continue;
        }
        let (u, w) = (d.dot(frame.0), d.dot(frame.1));
        let columns = [u, w, 0.5 * u * u, u * w, 0.5 * w * w];
        system.push(columns.map(|c| c / length), ((values[v.0 as usize] - value) / length).0);
    }
    let x = system.solve::<5>().or_else(|| system.solve::<2>()).unwrap_or_default();
    let (first, second) = (1.0 / scale, 1.0 / (scale * scale));
    let of = |k: usize| Rgb(x[k]);
    Derivatives {
        gradient: [of(0) * first, of(1) * first],
        hessian: [of(2) * second, of(3) * second, of(4) * second],
    }
}
