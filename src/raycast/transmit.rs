//! How much light passes along rays: nothing through what blocks, a slab's transmittance through thin glass.
//!
//! ```text
//! Query --any_hits--> free: 1 | blocked --only where a scene has panes--closest_hits--> pane: x T, on behind it | else 0
//! ```
//! T = transmission x (1 - R) / (1 + R), mean over the polarisations (`geom::optics`), straight on. A pane is a surface with
//! transmission that is no sphere: spheres are closed, bend light, and block here. Up to [`MAX_PANES`] panes, then nothing.
//! In a scene without panes not one ray more is cast.
//! Not modelled: light that a pane reflects, which arrives elsewhere.

use glam::DVec3;

use super::{CastError, Purpose, Query, RayCaster, RayHit};
use crate::geom::Ray;
use crate::geom::optics::slab_transmittance;
use crate::mesh::{Mesh, PatchId};
use crate::scene::{Scene, Shape, Surface};
use crate::units::Rgb;

/// Most panes that a ray passes.
pub const MAX_PANES: usize = 8;

/// A patch of thin glass.
#[derive(Clone, Copy, Debug)]
struct Pane {
    normal: DVec3,
    ior: f64,
    transmission: Rgb,
}

/// The thin glass of a scene, by cast patch.
#[derive(Clone, Debug, Default)]
pub struct Panes {
    /// Empty when no patch is one.
    of_patch: Vec<Option<Pane>>,
}

/// A ray on its way through panes.
struct Passing {
    index: usize,
    ray: Ray,
    share: Rgb,
}

/// Whether a surface is thin glass.
pub fn is_pane(scene: &Scene, surface: &Surface) -> bool {
    !scene.material(surface).transmission.is_black() && !matches!(surface.shape, Shape::Sphere { .. })
}

impl Panes {
    /// The panes of a scene.
    pub fn of(scene: &Scene, mesh: &Mesh) -> Panes {
        if !scene.surfaces.iter().any(|surface| is_pane(scene, surface)) {
            return Panes::default();
        }
        let of_patch = mesh.patches[..mesh.n_cast_patches].iter().map(|patch| {
            let surface = &scene.surfaces[patch.surface.0 as usize];
            let material = scene.material(surface);
            is_pane(scene, surface).then_some(Pane {
                normal: patch.normal,
                ior: material.ior,
                transmission: material.transmission,
            })
        });
        Panes { of_patch: of_patch.collect() }
    }

    /// There are none: what is blocked is dark.
    pub fn is_empty(&self) -> bool {
        self.of_patch.is_empty()
    }

    /// Whether a cast patch is one: what it blocks is not dark.
    pub fn contains(&self, patch: PatchId) -> bool {
        self.pane(patch).is_some()
    }

    fn pane(&self, patch: PatchId) -> Option<Pane> {
        self.of_patch.get(patch.0 as usize).copied().flatten()
    }

    /// Share of the light that passes along each ray of `query`, 1 where nothing is in its range.
    ///
    /// # Errors
    /// As [`RayCaster::any_hits`].
    pub fn transmitted(
        &self,
        caster: &mut dyn RayCaster,
        purpose: Purpose,
        query: Query<'_>,
    ) -> Result<Vec<Rgb>, CastError> {
        let blocked = caster.any_hits(purpose, query)?;
        let mut shares: Vec<Rgb> =
            blocked.iter().map(|blocked| if *blocked { Rgb::BLACK } else { Rgb::WHITE }).collect();
        for (i, share) in self.behind_panes(caster, purpose, query, &blocked)? {
            shares[i] = share;
        }
        Ok(shares)
    }

    /// The rays of `query` that are `blocked` by nothing but panes, and what passes of each; none in a scene without panes.
    ///
    /// # Errors
    /// As [`RayCaster::closest_hits`].
    pub fn behind_panes(
        &self,
        caster: &mut dyn RayCaster,
        purpose: Purpose,
        query: Query<'_>,
        blocked: &[bool],
    ) -> Result<Vec<(usize, Rgb)>, CastError> {
        let mut arrived = Vec::new();
        if self.is_empty() {
            return Ok(arrived);
        }
        let offset_m = caster.surface_offset_m();
        let mut passing = Vec::new();
        for_each_ray(query, |index, ray| {
            if blocked[index] {
                passing.push(Passing { index, ray, share: Rgb::WHITE });
            }
        });
        for panes_passed in 0..=MAX_PANES {
            if passing.is_empty() {
                break;
            }
            let rays: Vec<Ray> = passing.iter().map(|p| p.ray).collect();
            let hits = caster.closest_hits(purpose, Query::Rays(&rays))?;
            let mut next = Vec::new();
            for (p, hit) in passing.into_iter().zip(hits) {
                match hit {
                    None => arrived.push((p.index, p.share)),
                    Some(hit) if panes_passed < MAX_PANES => match self.behind(p, hit, offset_m) {
                        Behind::Dark => {}
                        Behind::There(index, share) => arrived.push((index, share)),
                        Behind::OnItsWay(p) => next.push(p),
                    },
                    Some(_) => {}
                }
            }
            passing = next;
        }
        Ok(arrived)
    }

    /// Transmittance of the pane that a ray hit; `None` when it is none.
    pub fn transmittance(&self, ray: &Ray, hit: RayHit) -> Option<Rgb> {
        let pane = self.pane(hit.patch)?;
        let cos = pane.normal.dot(ray.dir.normalize()).abs();
        Some(pane.transmission * slab_transmittance(cos, pane.ior))
    }

    /// What becomes of a ray behind what it hit.
    fn behind(&self, p: Passing, hit: RayHit, offset_m: f64) -> Behind {
        let Some(transmittance) = self.transmittance(&p.ray, hit) else { return Behind::Dark };
        let share = p.share * transmittance;
        if share.is_black() {
            return Behind::Dark;
        }
        let along = p.ray.dir.normalize();
        let normal = self.pane(hit.patch).map_or(along, |pane| pane.normal);
        let lift = if normal.dot(along) < 0.0 { -offset_m } else { offset_m };
        let origin = p.ray.at(hit.t) + lift * normal;
        let ray = if p.ray.t_max.is_finite() {
            let target = p.ray.at(p.ray.t_max);
            // Nothing fits between, and coarse words have no direction for it.
            if (target - origin).length() <= 2.0 * offset_m || (target - origin).dot(along) <= 0.0 {
                return Behind::There(p.index, share);
            }
            Ray::to_point(origin, target)
        } else {
            Ray::unbounded(origin, p.ray.dir)
        };
        Behind::OnItsWay(Passing { ray, share, ..p })
    }
}

enum Behind {
    Dark,
    There(usize, Rgb),
    OnItsWay(Passing),
}

/// Every ray of a query with its number.
fn for_each_ray(query: Query<'_>, mut each: impl FnMut(usize, Ray)) {
    match query {
        Query::Rays(rays) => rays.iter().enumerate().for_each(|(i, ray)| each(i, *ray)),
        Query::Bundles(bundles) => {
            let mut index = 0;
            for bundle in bundles {
                bundle.for_each_ray(|ray| {
                    each(index, ray);
                    index += 1;
                });
            }
        }
    }
}
