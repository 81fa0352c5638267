//! Irradiance between the vertices: constant, bilinear, bicubic Hermite.

use crate::mesh::{Mesh, SurfacePoint};
use crate::units::Rgb;

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
#[derive(Clone, Debug)]
pub struct Reconstruction {}

impl Reconstruction {
    /// Prepares `method` from values at the vertices and means of the elements (indices as in `mesh`).
    pub fn new(mesh: &Mesh, method: Method, vertex_values: &[Rgb], element_means: &[Rgb]) -> Reconstruction {
        let _ = (mesh, method, vertex_values, element_means);
        todo!()
    }

    /// The value at a place.
    pub fn evaluate(&self, mesh: &Mesh, at: SurfacePoint) -> Rgb {
        let _ = (mesh, at);
        todo!()
    }
}
