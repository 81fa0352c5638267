//! Irradiance between the vertices: six methods behind one trait.
//!
//! ```text
//! values at vertices --nodes.rs: a node per vertex and group of elements that C0 edges enclose
//!    --rules/: gradients, c0.rs: one slope along a C0 edge, rules/: second derivatives--> derivatives per node
//!    --limiter.rs (hermite-limited)--hanging.rs: T-vertices follow their coarse edge--pieces.rs--> coefficients per element
//! element, (s,t) --trait Field: constant.rs | bilinear.rs | pieces.rs--> irradiance, gradient
//!                                                          quad: bicubic.rs or two triangles (split_quad.rs)
//!                                                          triangle: clough_tocher.rs or powell_sabin.rs
//! ```
//! | method | quads | triangles | coefficients an element |
//! |---|---|---|---|
//! | `constant` | mean | mean | 24 bytes |
//! | `bilinear` | bilinear | linear | 24 bytes a vertex |
//! | `quadratic` | two Powell-Sabin triangles | Powell-Sabin | 592, 288 bytes |
//! | `cubic-triangle` | two Clough-Tocher triangles | Clough-Tocher | 592, 288 bytes |
//! | `hermite`, `hermite-limited` | bicubic Hermite | Clough-Tocher | 384, 288 bytes |
//!
//! Elements find their coefficients by 4 bytes more. Coefficients are computed once, about 1 us an element with the fits, and
//! forgotten with the reconstruction; a value then costs 2.4 times a bilinear one (`benches/reconstruction.rs`).
//!
//! Continuity: C1 across edges between parallelograms with straight grid lines and between coplanar triangles; elsewhere
//! values meet and gradients may jump. C0 edges keep the value and the slope along them, and nothing else. Where vertices
//! are not shared (creases, C-1 edges) nothing continues. Hanging vertices leave no cracks in any method but `constant`.
//!
//! Cubics overshoot: [`Reconstruction::evaluate`] clamps at zero, [`Reconstruction::evaluate_unclamped`] does not.
//!
//! Source: Foley, van Dam et al. 1990, section 11.2; Bastos et al. 1992; Clough, Tocher 1965; Powell, Sabin 1977;
//! Salesin, Lischinski, DeRose 1992 (cubic triangles with chosen discontinuities); Fritsch, Carlson 1980.
//! Not modelled: the visibility of single sources as a sign of kinks; the limiter looks at luminance only.

use std::sync::Arc;

use crate::mesh::{Mesh, SurfacePoint, VertexId};
use crate::units::Rgb;

mod bicubic;
mod bilinear;
mod c0;
mod clough_tocher;
mod constant;
mod derivatives;
mod field;
mod hanging;
mod kinks;
mod least_squares;
mod limiter;
mod method;
pub mod metrics;
mod nodes;
mod pieces;
mod powell_sabin;
mod rules;
mod split_quad;

#[cfg(test)]
mod tests;

use bicubic::Bicubic;
use clough_tocher::CloughTocher;
use field::Field;
use nodes::Nodal;
use pieces::{Pieces, QuadSurface, TriangleSurface};
use powell_sabin::PowellSabin;
use split_quad::SplitQuad;

pub use method::{GradientRule, Method, ReconstructOptions, TwistRule};

/// A reconstructed irradiance field over a mesh (W/m^2).
///
/// Memory: see [`Reconstruction::memory_bytes`] and the table of this module.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    field: Arc<dyn Field>,
    /// Rising.
    limited: Vec<VertexId>,
}

/// Exact derivatives of a field, per vertex of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct GivenDerivatives<'a> {
    /// World gradients (W/m^3): d/dx, d/dy, d/dz.
    pub gradients: &'a [[Rgb; 3]],
    /// World Hessians (W/m^4), symmetric; without, the twist rule of the options applies to the given gradients.
    pub hessians: Option<&'a [[[Rgb; 3]; 3]]>,
}

impl Reconstruction {
    /// Prepares a method from values at the vertices and means of the elements (indices as in `mesh`).
    ///
    /// # Panics
    /// When the values that the method needs are not one per vertex (`constant`: one per element).
    pub fn new(
        mesh: &Mesh,
        options: impl Into<ReconstructOptions>,
        vertex_values: &[Rgb],
        element_means: &[Rgb],
    ) -> Reconstruction {
        Reconstruction::build(mesh, options.into(), vertex_values, element_means, None)
    }

    /// As [`Reconstruction::new`], with gradients, and Hessians if given, that are known instead of estimated. Methods that
    /// use none ignore them.
    ///
    /// # Panics
    /// When values, gradients or Hessians are not one per vertex; for `constant`, which has no use for vertices.
    pub fn with_derivatives(
        mesh: &Mesh,
        options: impl Into<ReconstructOptions>,
        vertex_values: &[Rgb],
        given: GivenDerivatives<'_>,
    ) -> Reconstruction {
        check_count("gradients", given.gradients.len(), mesh.vertices.len());
        if let Some(hessians) = given.hessians {
            check_count("Hessians", hessians.len(), mesh.vertices.len());
        }
        Reconstruction::build(mesh, options.into(), vertex_values, &[], Some(given))
    }

    fn build(
        mesh: &Mesh,
        options: ReconstructOptions,
        vertex_values: &[Rgb],
        element_means: &[Rgb],
        given: Option<GivenDerivatives<'_>>,
    ) -> Reconstruction {
        match options.method {
            Method::Constant => check_count("element means", element_means.len(), mesh.elements.len()),
            _ => check_count("vertex values", vertex_values.len(), mesh.vertices.len()),
        }
        let unlimited = |field: Arc<dyn Field>| Reconstruction { field, limited: Vec::new() };
        let nodal = || Nodal::new(mesh, vertex_values, &options, given);
        match options.method {
            Method::Constant => unlimited(Arc::new(constant::Constant::new(element_means))),
            Method::Bilinear => unlimited(Arc::new(bilinear::Bilinear::new(mesh, vertex_values))),
            Method::Quadratic => unlimited(joined::<SplitQuad<PowellSabin>, PowellSabin>(nodal())),
            Method::CubicTriangle => unlimited(joined::<SplitQuad<CloughTocher>, CloughTocher>(nodal())),
            Method::Hermite => unlimited(joined::<Bicubic, CloughTocher>(nodal())),
            Method::HermiteLimited => {
                let mut nodal = nodal();
                let limited = limiter::limit::<Bicubic, CloughTocher>(&mut nodal);
                Reconstruction { field: joined::<Bicubic, CloughTocher>(nodal), limited }
            }
        }
    }

    /// The value at a place, at least 0 in every channel.
    pub fn evaluate(&self, mesh: &Mesh, at: SurfacePoint) -> Rgb {
        self.evaluate_unclamped(mesh, at).map(|c| c.max(0.0))
    }

    /// The value as the formulas give it, negative where a cubic overshoots.
    pub fn evaluate_unclamped(&self, mesh: &Mesh, at: SurfacePoint) -> Rgb {
        self.field.value(mesh, at)
    }

    /// The world gradient of the unclamped value (W/m^3: d/dx, d/dy, d/dz), tangential to the element.
    ///
    /// On an edge inside an element (the diagonal of a split quad, the seams of a triangle) that of one side.
    pub fn gradient(&self, mesh: &Mesh, at: SurfacePoint) -> [Rgb; 3] {
        self.field.gradient(mesh, at)
    }

    /// Vertices whose derivatives the limiter made smaller; 0 for methods without one.
    pub fn limited_vertices(&self) -> usize {
        self.limited.len()
    }

    /// Which ones, rising.
    pub fn limited(&self) -> &[VertexId] {
        &self.limited
    }

    /// Memory that the coefficients hold (bytes).
    pub fn memory_bytes(&self) -> usize {
        self.field.memory_bytes()
    }
}

fn joined<Q: QuadSurface, T: TriangleSurface>(mut nodal: Nodal<'_>) -> Arc<dyn Field> {
    hanging::follow::<Q, T>(&mut nodal);
    Arc::new(Pieces::<Q, T>::new(&nodal))
}

fn check_count(what: &str, given: usize, needed: usize) {
    assert!(given == needed, "reconstruction needs {needed} {what}, got {given}");
}
