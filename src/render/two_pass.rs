//! Shading by stored and sampled light: `two-pass`, `full-radiosity`, `whitted`.
//!
//! ```text
//! wave: paths + hits --surfaces.rs--diffuse--> stored light R, sources to sample --direct/--> D
//!                         |--mirror, glass--> explicit rays: the next wave
//! seen += weight (M + rho (R + D)) / pi
//! ```
//! `two-pass`: R and D as `direct/selection.rs` says. `full-radiosity`: R of all light that pass 1 stored, no D. `whitted`: a
//! constant ambient term for R, D of every source.
//! Waves: all camera rays, then all their specular children, and so on to the depth limit; each wave is one query for hits
//! and a few for shadows.
//! Source: Jansen, Kok 1992 (two-pass method); Whitted 1980 (specular recursion).

use rayon::prelude::*;

use super::shader::{CameraRay, Seen, Shader};
use super::surfaces::{MIN_WEIGHT, Outcome, Path, Surfaces};
use super::{DirectCounts, RenderOptions};
use crate::direct::{DirectLight, LitPoint, Selection, StoredLight};
use crate::mesh::{Mesh, SurfacePoint};
use crate::radiosity::{Solution, ambient};
use crate::raycast::{CastError, Purpose, Query, RayCaster, RayHit};
use crate::reconstruct::Reconstruction;
use crate::scene::Scene;
use crate::units::{Radiosity, Rgb};

/// What is stored and what sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Split {
    /// As `direct/selection.rs` says.
    Selected,
    /// All is stored.
    AllStored,
    /// All direct light is sampled, an ambient term stands for the rest.
    Ambient,
}

/// Light that is not sampled.
enum Stored {
    /// The indirect light, and some of the direct.
    Selected(Box<Selection>),
    /// All light, from the solution.
    All(Reconstruction),
    /// The same everywhere (W/m^2).
    Ambient(Rgb),
}

/// The shader.
pub(super) struct TwoPass<'a> {
    surfaces: Surfaces<'a>,
    stored: Stored,
    /// Sources that shadow rays go to; none when all light is stored.
    direct: Option<DirectLight>,
    max_depth: u32,
    /// Also tell the irradiance on surfaces that are seen first.
    irradiance: bool,
}

impl<'a> TwoPass<'a> {
    /// Chooses sources where that is a part of it.
    ///
    /// # Errors
    /// When the caster fails.
    pub fn new(
        scene: &'a Scene,
        mesh: &'a Mesh,
        solution: &Solution,
        caster: &mut dyn RayCaster,
        options: &RenderOptions,
        split: Split,
    ) -> Result<TwoPass<'a>, CastError> {
        let offset_m = caster.surface_offset_m();
        let mut direct = DirectLight::new(scene, mesh, offset_m, options.direct, options.seed);
        let reconstruct = options.reconstruction();
        let (stored, direct) = match split {
            Split::Selected => {
                let selection = Selection::new(&mut direct, mesh, solution, caster, reconstruct)?;
                (Stored::Selected(Box::new(selection)), Some(direct))
            }
            Split::AllStored => {
                let vertex: Vec<Rgb> = solution.vertex_irradiance.iter().map(|e| e.total()).collect();
                let element: Vec<Rgb> = solution.element_irradiance.iter().map(|e| e.total()).collect();
                (Stored::All(Reconstruction::new(mesh, reconstruct, &vertex, &element)), None)
            }
            Split::Ambient => (Stored::Ambient(ambient::of_emission(scene, mesh)), Some(direct)),
        };
        let surfaces = Surfaces { scene, mesh, offset_m, min_weight: MIN_WEIGHT };
        Ok(TwoPass { surfaces, stored, direct, max_depth: options.max_depth, irradiance: options.irradiance })
    }

    fn stored(&self, at: SurfacePoint) -> StoredLight {
        match &self.stored {
            Stored::Selected(selection) => selection.at(self.surfaces.mesh, at),
            Stored::All(field) => {
                let e = field.evaluate_unclamped(self.surfaces.mesh, at);
                let irradiance = e.map(|e| e.max(0.0));
                let expected = irradiance.luminance();
                StoredLight {
                    irradiance,
                    clamped: e.min_channel() < 0.0,
                    expected,
                    sampled: Some(Vec::new()),
                }
            }
            Stored::Ambient(e) => {
                StoredLight { irradiance: *e, clamped: false, expected: e.luminance(), sampled: None }
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
            let this = &*self;
            let outcomes: Vec<(Outcome, Option<StoredLight>)> = paths
                .par_iter()
                .zip(&hits)
                .map(|(path, hit)| {
                    let outcome = this.surfaces.meet(path, *hit, always);
                    let stored = outcome.diffuse.map(|d| this.stored(d.at));
                    (outcome, stored)
                })
                .collect();
            let mesh = self.surfaces.mesh;
            let points: Vec<LitPoint> = outcomes
                .iter()
                .filter_map(|(outcome, stored)| {
                    let (diffuse, stored) = (outcome.diffuse?, stored.as_ref()?);
                    Some(LitPoint {
                        point: diffuse.point,
                        region: Some(mesh.elements[diffuse.at.element.0 as usize].patch),
                        expected: stored.expected,
                        sampled: stored.sampled.clone(),
                    })
                })
                .collect();
            let direct = match &mut self.direct {
                Some(direct) => direct.gather(caster, &points)?,
                None => vec![Rgb::BLACK; points.len()],
            };
            let mut direct = direct.into_iter();
            let mut next = Vec::new();
            for (path, (outcome, stored)) in paths.iter().zip(outcomes) {
                let seen = &mut seen[path.camera_ray];
                let mut radiosity = outcome.exitance;
                if let (Some(diffuse), Some(stored)) = (outcome.diffuse, stored) {
                    let irradiance = direct.next().unwrap_or(Rgb::BLACK) + stored.irradiance;
                    radiosity += diffuse.reflectance * irradiance;
                    seen.clamped |= stored.clamped;
                    if always {
                        seen.irradiance = Some(irradiance);
                        seen.sampled_sources = stored.n_sampled();
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
            Stored::Selected(selection) => selection.limited_vertices(),
            Stored::All(field) => field.limited_vertices(),
            Stored::Ambient(_) => 0,
        }
    }

    fn direct(&self) -> Option<DirectCounts> {
        let direct = self.direct.as_ref()?;
        let selection = match &self.stored {
            Stored::Selected(selection) => Some(selection.counts()),
            Stored::All(_) | Stored::Ambient(_) => None,
        };
        let before = selection.map(|s| s.shadow).unwrap_or_default();
        Some(DirectCounts { selection, shadow: direct.counts().since(before) })
    }
}
