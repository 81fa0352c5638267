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
    frame: (DVec3, DVec3),
    derivatives: Derivatives,
}

impl Derivatives {
    pub(super) fn node(&self, vertex: &Vertex, value: Rgb) -> Node {
        let frame = tangent_frame(vertex.normal);
        Node { position: vertex.position, value, frame, derivatives: *self }
    }
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
