//! Pass 2: camera bundles, shading, specular recursion.

use crate::image::Film;
use crate::mesh::Mesh;
use crate::radiosity::Solution;
use crate::raycast::{CastError, RayCaster};
use crate::reconstruct::Method;
use crate::scene::{Camera, Scene};

/// How pass 2 is run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderOptions {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Camera rays per pixel, 1..=16 (stratified; 1 = the pixel's centre).
    pub samples: u32,
    /// Shadow rays per shaded point and area source: n x n strata.
    pub shadow_strata: u32,
    /// Specular recursion depth.
    pub max_depth: u32,
    /// Reconstruction of the stored indirect irradiance.
    pub reconstruct: Method,
    /// Seed of every sampling pattern.
    pub seed: u64,
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions {
            width: 256,
            height: 256,
            samples: 1,
            shadow_strata: 4,
            max_depth: 6,
            reconstruct: Method::Hermite,
            seed: 1,
        }
    }
}

/// A rendered picture and what is worth telling about it.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture.
    pub film: Film,
    /// Camera rays that first met the black back of a one-sided surface, per scene surface.
    pub back_hits: Vec<u64>,
    /// Camera rays in all.
    pub n_camera_rays: u64,
}

/// Renders a solved scene.
///
/// # Errors
/// When the caster fails.
pub fn render(
    scene: &Scene,
    camera: &Camera,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    options: &RenderOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Rendering, CastError> {
    let _ = (scene, camera, mesh, solution, caster, options, progress);
    todo!()
}
