//! A dense solution inside the elements of a coarse mesh: the reference where no closed form is known.
//!
//! ```text
//! scene --mesh--> coarse --every element split n times--> dense --solve--> E at its vertices, bilinear between
//! ```
//! Both meshes have the same patches, so sources are equally coarse in both, and vertices of the coarse mesh are vertices of
//! the dense one: what differs is interpolation alone. At 2^n parts an element's edge, n >= 3, the places that the metrics
//! look at on quads are vertices of the dense mesh as well. Visibility is cast by rays, so its noise is in the reference.

use crate::experiments::ExperimentError;
use crate::mesh::{Mesh, SurfacePoint};
use crate::radiosity::{SolveOptions, solve};
use crate::raycast::software::SoftwareCaster;
use crate::reconstruct::metrics::Reference;
use crate::reconstruct::{Method, Reconstruction};
use crate::scene::Scene;
use crate::units::Rgb;

/// How dense.
#[derive(Clone, Copy, Debug)]
pub struct Dense {
    /// Splits of every element.
    pub splits: u32,
    /// A visibility ray from every point to every shooter, not one an element to those that only reflect.
    pub dense_visibility: bool,
}

/// A dense solution.
pub struct Nested {
    mesh: Mesh,
    field: Reconstruction,
    splits: u32,
}

impl Nested {
    /// Meshes the scene, and solves it with every element split as often as `dense` says.
    ///
    /// # Errors
    /// A caster that fails.
    pub fn new(scene: &Scene, dense: Dense) -> Result<(Mesh, Nested), ExperimentError> {
        let Dense { splits, dense_visibility } = dense;
        let coarse = Mesh::build(scene);
        let mut mesh = coarse.clone();
        for _ in 0..splits {
            let finer = mesh.subdivision().split(&vec![true; mesh.elements.len()]);
            mesh = Mesh::build_with(scene, &finer).map_err(|e| ExperimentError::Scene(e.to_string()))?;
        }
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let options = SolveOptions { dense_visibility, ..SolveOptions::default() };
        let solution = solve(scene, &mesh, &mut caster, &options, &mut |_| {})?;
        let values: Vec<Rgb> = solution.vertex_irradiance.iter().map(|e| e.total()).collect();
        let field = Reconstruction::new(&mesh, Method::Bilinear, &values, &[]);
        Ok((coarse, Nested { mesh, field, splits }))
    }
}

impl Reference for Nested {
    fn luminance(&self, mesh: &Mesh, at: SurfacePoint) -> f64 {
        let patch = mesh.elements[at.element.0 as usize].patch;
        let place = self.mesh.locate(patch, mesh.position(at));
        self.field.evaluate(&self.mesh, place).luminance()
    }

    fn step(&self) -> f64 {
        0.5_f64.powi(self.splits as i32)
    }
}
