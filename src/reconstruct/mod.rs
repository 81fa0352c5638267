//! Irradiance between the vertices: constant, bilinear, bicubic Hermite.
//!
//! ```text
//! values at vertices --derivatives.rs: least-squares fit--> gradient, Hessian per vertex
//! element, (s,t) --> quad: bicubic.rs | triangle: clough_tocher.rs --> irradiance, never negative
//! ```
//! Quads: B(s,t) = S M_H G_H M_H^T T^T, with f_s = g . x_s, f_t = g . x_t and the twist x_s^T H x_t + g . x_st at
//! each corner; x is the element's bilinear geometry. Triangles: the cubic Clough-Tocher element. Vertices are shared
//! exactly where surfaces continue each other, so values break at creases by themselves.
//! C1 across edges between parallelograms with straight grid lines and between coplanar triangles; elsewhere values
//! meet and gradients may jump. A hanging vertex follows its coarse element (`hanging.rs`): no cracks. Given exact derivatives, quadratic fields are reproduced on any planar mesh.
//!
//! Cubics overshoot: what falls below zero is clamped at the very end of [`Reconstruction::evaluate`], uncounted.
//!
//! Source: Foley, van Dam et al. 1990, section 11.2; Bastos et al. 1992; Clough, Tocher 1965.
//! Not modelled: the limiter, tangent rules other than least squares, edges of [`crate::mesh::Continuity::C0`].

use crate::mesh::{Corners, Mesh, SurfacePoint};
use crate::units::Rgb;

mod bicubic;
mod clough_tocher;
mod derivatives;
mod hanging;
mod least_squares;

#[cfg(test)]
mod tests;

use derivatives::Derivatives;

/// How irradiance is reconstructed inside elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The element's mean.
    Constant,
    /// Bilinear on quads, linear on triangles.
    Bilinear,
    /// Bicubic Hermite on quads, Clough-Tocher on triangles.
    Hermite,
}

/// A reconstructed irradiance field over a mesh (W/m^2).
///
/// Memory: `constant` 24 bytes an element, `bilinear` 24 bytes a vertex, `hermite` 144 bytes a vertex.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    field: Field,
}

#[derive(Clone, Debug)]
enum Field {
    /// Per element.
    Constant(Vec<Rgb>),
    /// Per vertex.
    Bilinear(Vec<Rgb>),
    /// Per vertex.
    Hermite { values: Vec<Rgb>, derivatives: Vec<Derivatives> },
}

impl Reconstruction {
    /// Prepares `method` from values at the vertices and means of the elements (indices as in `mesh`).
    ///
    /// # Panics
    /// When the values that the method needs are not one per vertex (`constant`: one per element).
    pub fn new(mesh: &Mesh, method: Method, vertex_values: &[Rgb], element_means: &[Rgb]) -> Reconstruction {
        let (given, needed) = match method {
            Method::Constant => (element_means.len(), mesh.elements.len()),
            Method::Bilinear | Method::Hermite => (vertex_values.len(), mesh.vertices.len()),
        };
        assert!(given == needed, "{method:?} reconstruction of {needed} values got {given}");
        let field = match method {
            Method::Constant => Field::Constant(element_means.to_vec()),
            Method::Bilinear => {
                let mut values = vertex_values.to_vec();
                hanging::follow_bilinear(mesh, &mut values);
                Field::Bilinear(values)
            }
            Method::Hermite => {
                let mut values = vertex_values.to_vec();
                let mut derivatives = derivatives::fit_all(mesh, vertex_values);
                hanging::follow_hermite(mesh, &mut values, &mut derivatives);
                Field::Hermite { values, derivatives }
            }
        };
        Reconstruction { field }
    }

    /// The value at a place, at least 0 in every channel.
    pub fn evaluate(&self, mesh: &Mesh, at: SurfacePoint) -> Rgb {
        self.evaluate_unclamped(mesh, at).map(|c| c.max(0.0))
    }

    /// The value as the formulas give it, negative where a cubic overshoots.
    pub fn evaluate_unclamped(&self, mesh: &Mesh, at: SurfacePoint) -> Rgb {
        let (s, t) = (at.st.x, at.st.y);
        match &self.field {
            Field::Constant(means) => means[at.element.0 as usize],
            Field::Bilinear(values) => match mesh.elements[at.element.0 as usize].corners {
                Corners::Triangle(v) => {
                    let [a, b, c] = v.map(|v| values[v.0 as usize]);
                    a * (1.0 - s - t) + b * s + c * t
                }
                Corners::Quad(v) => {
                    let [a, b, c, d] = v.map(|v| values[v.0 as usize]);
                    (a * (1.0 - s) + b * s) * (1.0 - t) + (d * (1.0 - s) + c * s) * t
                }
            },
            Field::Hermite { values, derivatives } => {
                let node = |v: crate::mesh::VertexId| {
                    let vertex = &mesh.vertices[v.0 as usize];
                    derivatives[v.0 as usize].node(vertex, values[v.0 as usize])
                };
                match mesh.elements[at.element.0 as usize].corners {
                    Corners::Triangle(v) => clough_tocher::evaluate(&v.map(node), s, t),
                    Corners::Quad(v) => bicubic::evaluate(&v.map(node), s, t),
                }
            }
        }
    }
}
