//! Shading by stored and sampled light: `two-pass`, `full-radiosity`, `whitted`.
//!
//! ```text
//! wave: paths + hits --surfaces.rs--diffuse--> ShadePoints --direct/--> D ; reconstruct/ --> R
//!                         |--mirror, glass--> explicit rays: the next wave
//! seen += weight (M + rho (D + R)) / pi
//! ```
//! `two-pass`: D of every source, R of the stored indirect light. `full-radiosity`: no D, R of all stored light. `whitted`: D
//! of every source, a constant ambient term for R.
//! Waves: all camera rays, then all their specular children, and so on to the depth limit; each wave is one query for hits
//! and a few for shadows.
//! Source: Jansen, Kok 1992 (two-pass method); Whitted 1980 (specular recursion).

use rayon::prelude::*;

use super::shader::{CameraRay, Seen, Shader};
use super::surfaces::{Outcome, Path, Surfaces};
use crate::direct::{DirectLight, ShadePoint};
use crate::mesh::SurfacePoint;
use crate::raycast::{CastError, Purpose, Query, RayCaster, RayHit};
use crate::reconstruct::Reconstruction;
use crate::units::{Radiosity, Rgb};

/// Light that is not sampled.
pub(super) enum Stored {
    /// Reconstructed from the solution.
    Field(Reconstruction),
    /// The same everywhere (W/m^2).
    Ambient(Rgb),
}

/// The shader.
pub(super) struct TwoPass<'a> {
    pub surfaces: Surfaces<'a>,
    pub stored: Stored,
    /// Sources that shadow rays go to; none when all light is stored.
    pub direct: Option<DirectLight>,
    /// Shadow rays a source: n x n strata.
    pub shadow_strata: u32,
    pub max_depth: u32,
    pub seed: u64,
    /// Also tell the irradiance on surfaces that are seen first.
    pub irradiance: bool,
}

impl TwoPass<'_> {
    /// Stored irradiance at a point, and whether it had to be clamped at 0.
    fn stored(&self, at: SurfacePoint) -> (Rgb, bool) {
        match &self.stored {
            Stored::Ambient(e) => (*e, false),
            Stored::Field(field) => {
                let e = field.evaluate_unclamped(self.surfaces.mesh, at);
                (e.map(|e| e.max(0.0)), e.min_channel() < 0.0)
            }
        }
    }
}

impl Shader for TwoPass<'_> {
    fn see(
        &mut self,
        caster: &mut dyn RayCaster,
        rays: &[CameraRay],
        mut hits: Vec<Option<RayHit>>,
    ) -> Result<Vec<Seen>, CastError> {
        let mut seen = vec![Seen::default(); rays.len()];
        let mut paths: Vec<Path> = rays.iter().enumerate().map(|(i, ray)| Path::camera(i, ray)).collect();
        for depth in 0..=self.max_depth {
            let always = self.irradiance && depth == 0;
            let outcomes: Vec<(Outcome, (Rgb, bool))> = paths
                .par_iter()
                .zip(&hits)
                .map(|(path, hit)| {
                    let outcome = self.surfaces.meet(path, *hit, always);
                    (outcome, outcome.diffuse.map_or((Rgb::BLACK, false), |d| self.stored(d.at)))
                })
                .collect();
            let points: Vec<ShadePoint> =
                outcomes.iter().filter_map(|(o, _)| o.diffuse.map(|d| d.point)).collect();
            let direct = match &self.direct {
                Some(direct) => direct.gather(caster, &points, self.shadow_strata, self.seed)?,
                None => vec![Rgb::BLACK; points.len()],
            };
            let mut direct = direct.into_iter();
            let mut next = Vec::new();
            for (path, (outcome, (stored, clamped))) in paths.iter().zip(outcomes) {
                let seen = &mut seen[path.camera_ray];
                let mut radiosity = outcome.exitance;
                if let Some(diffuse) = outcome.diffuse {
                    let irradiance = direct.next().unwrap_or(Rgb::BLACK) + stored;
                    radiosity += diffuse.reflectance * irradiance;
                    seen.clamped |= clamped;
                    if always {
                        seen.irradiance = Some(irradiance);
                    }
                }
                seen.radiance.0 += path.weight * Radiosity(radiosity).radiance().0;
                if depth == 0 {
                    seen.emits = !outcome.exitance.is_black();
                    seen.back = outcome.back;
                }
                next.extend(outcome.children.into_iter().flatten());
            }
            if next.is_empty() || depth == self.max_depth {
                break;
            }
            let rays: Vec<_> = next.iter().map(|p| p.ray).collect();
            hits = caster.closest_hits(Purpose::Specular, Query::Rays(&rays))?;
            paths = next;
        }
        Ok(seen)
    }

    fn limited_vertices(&self) -> usize {
        match &self.stored {
            Stored::Field(field) => field.limited_vertices(),
            Stored::Ambient(_) => 0,
        }
    }
}
