//! THE SEAM of pass 2: who knows what light a camera ray sees, and how it finds out, is a [`Shader`].
//!
//! ```text
//! mod.rs: camera rays, their first hits --a wave--> trait Shader: two_pass.rs --Seen, one a ray--> mod.rs: film
//! ```
//! Contract: `seen[i]` belongs to `rays[i]`; it depends on the ray, its pixel, sample and seed alone, never on which other
//! rays are in the wave, on the number of threads or on earlier waves.

use super::DirectCounts;
use crate::geom::Ray;
use crate::raycast::{CastError, RayCaster, RayHit};
use crate::sampling::mix;
use crate::scene::SurfaceId;
use crate::units::{Radiance, Rgb};

/// A ray from the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraRay {
    pub ray: Ray,
    /// Index into the film.
    pub pixel: usize,
    /// Which of the pixel's rays.
    pub sample: u32,
}

impl CameraRay {
    /// Names it for sampling patterns.
    pub fn key(&self) -> u64 {
        mix((self.pixel as u64) << 5 | u64::from(self.sample))
    }
}

/// What a camera ray sees.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    pub radiance: Radiance,
    /// Irradiance on the surface that it meets first, where that was asked for and there is one (W/m^2).
    pub irradiance: Option<Rgb>,
    /// Sources that are sampled there, each by its weight.
    pub sampled_sources: f64,
    /// The surface that it meets first emits.
    pub emits: bool,
    /// It meets the black back of a one-sided surface first.
    pub back: Option<SurfaceId>,
    /// Reconstructed light was negative somewhere and was made 0.
    pub clamped: bool,
}

/// Finds out what camera rays see.
pub(super) trait Shader {
    /// What `rays`, whose first hits are `hits`, see.
    ///
    /// # Errors
    /// When the caster fails.
    fn see(
        &mut self,
        caster: &mut dyn RayCaster,
        rays: &[CameraRay],
        hits: Vec<Option<RayHit>>,
    ) -> Result<Vec<Seen>, CastError>;

    /// Vertices whose derivatives the limiter of the reconstruction made smaller.
    fn limited_vertices(&self) -> usize {
        0
    }

    /// What direct light took so far, where it is sampled.
    fn direct(&self) -> Option<DirectCounts> {
        None
    }

    /// Share of the light seen so far that came by paths that the two-pass method does not model, where that is known.
    fn missed_share(&self) -> Option<f64> {
        None
    }
}
