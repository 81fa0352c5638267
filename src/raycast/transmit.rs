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

use super::{CastError, Facing, Purpose, Query, RayCaster, RayHit};
use crate::geom::Ray;
use crate::geom::optics::slab_transmittance;
use crate::mesh::{Mesh, PatchId};
use crate::sampling::mix;
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
    is_two_sided: bool,
}

/// The thin glass of a scene, by cast patch.
#[derive(Clone, Debug, Default)]
pub struct Panes {
    /// Empty when no patch is one.
    of_patch: Vec<Option<Pane>>,
}

/// A ray behind the panes that it passed.
#[derive(Clone, Copy, Debug)]
pub struct Passed {
    /// Which ray of the query.
    pub index: usize,
    /// Share of its light that passed.
    pub share: Rgb,
    /// The last pane was met on the back of a one-sided surface, where no element counts light.
    pub by_back: bool,
    /// Its part behind the last pane.
    pub ray: Ray,
    /// What it met there; `None`: nothing up to its end.
    pub hit: Option<RayHit>,
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
                is_two_sided: patch.twin.is_some(),
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

    /// A hash of where panes are and what they pass: what was cast through others is of no use.
    pub fn hash(&self) -> u64 {
        let pane = |pane: &Pane| {
            let Rgb(t) = pane.transmission;
            t.iter().chain([&pane.ior]).fold(0, |h, x| mix(h ^ x.to_bits()))
        };
        self.of_patch.iter().fold(0, |h, p| mix(h).wrapping_add(p.as_ref().map_or(0, pane)))
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
        for passed in self.behind_panes(caster, purpose, query, &blocked)? {
            shares[passed.index] = passed.share;
        }
        Ok(shares)
    }

    /// The rays of `query` that are `blocked` by nothing but panes, in order; none in a scene without panes.
    ///
    /// # Errors
    /// As [`RayCaster::closest_hits`].
    pub fn behind_panes(
        &self,
        caster: &mut dyn RayCaster,
        purpose: Purpose,
        query: Query<'_>,
        blocked: &[bool],
    ) -> Result<Vec<Passed>, CastError> {
        if self.is_empty() {
            return Ok(Vec::new());
        }
        let (mut places, mut rays) = (Vec::new(), Vec::new());
        for_each_ray(query, |index, ray| {
            if blocked[index] {
                places.push(index);
                rays.push(ray);
            }
        });
        if rays.is_empty() {
            return Ok(Vec::new());
        }
        let hits = caster.closest_hits(purpose, Query::Rays(&rays))?;
        let mut passed = self.beyond(caster, purpose, Query::Rays(&rays), &hits)?;
        passed.retain(|p| p.hit.is_none());
        passed.iter_mut().for_each(|p| p.index = places[p.index]);
        Ok(passed)
    }

    /// The rays of `query`, whose nearest hits are `hits`, that met panes first: followed through them, in order.
    ///
    /// # Errors
    /// As [`RayCaster::closest_hits`].
    pub fn beyond(
        &self,
        caster: &mut dyn RayCaster,
        purpose: Purpose,
        query: Query<'_>,
        hits: &[Option<RayHit>],
    ) -> Result<Vec<Passed>, CastError> {
        let mut ended = Vec::new();
        if self.is_empty() {
            return Ok(ended);
        }
        let offset_m = caster.surface_offset_m();
        let mut passing = Vec::new();
        for_each_ray(query, |index, ray| {
            let before = Passed { index, share: Rgb::WHITE, by_back: false, ray, hit: hits[index] };
            match self.behind(&before, offset_m) {
                Behind::End(there) => ended.push(there),
                Behind::OnItsWay(p) => passing.push(p),
                Behind::NoPane => {}
            }
        });
        for _ in 1..MAX_PANES {
            if passing.is_empty() {
                break;
            }
            self.cast(caster, purpose, &mut passing)?;
            let mut next = Vec::new();
            for p in passing {
                match self.behind(&p, offset_m) {
                    Behind::End(there) => ended.push(there),
                    Behind::OnItsWay(p) => next.push(p),
                    Behind::NoPane => ended.push(p),
                }
            }
            passing = next;
        }
        self.cast(caster, purpose, &mut passing)?;
        ended.extend(passing);
        ended.retain(|p| !p.share.is_black());
        ended.sort_unstable_by_key(|p| p.index);
        Ok(ended)
    }

    fn cast(
        &self,
        caster: &mut dyn RayCaster,
        purpose: Purpose,
        passing: &mut [Passed],
    ) -> Result<(), CastError> {
        if passing.is_empty() {
            return Ok(());
        }
        let rays: Vec<Ray> = passing.iter().map(|p| p.ray).collect();
        let hits = caster.closest_hits(purpose, Query::Rays(&rays))?;
        passing.iter_mut().zip(hits).for_each(|(p, hit)| p.hit = hit);
        Ok(())
    }

    /// Transmittance of the pane that a ray hit; `None` when it is none.
    pub fn transmittance(&self, ray: &Ray, hit: RayHit) -> Option<Rgb> {
        let pane = self.pane(hit.patch)?;
        let cos = pane.normal.dot(ray.dir.normalize()).abs();
        Some(pane.transmission * slab_transmittance(cos, pane.ior))
    }

    /// What becomes of a ray behind what it hit.
    fn behind(&self, p: &Passed, offset_m: f64) -> Behind {
        let Some(hit) = p.hit else { return Behind::NoPane };
        let Some((pane, transmittance)) = self.pane(hit.patch).zip(self.transmittance(&p.ray, hit)) else {
            return Behind::NoPane;
        };
        let along = p.ray.dir.normalize();
        let lift = if pane.normal.dot(along) < 0.0 { -offset_m } else { offset_m };
        let origin = p.ray.at(hit.t) + lift * pane.normal;
        let passed = Passed {
            share: p.share * transmittance,
            by_back: hit.facing == Facing::Back && !pane.is_two_sided,
            hit: None,
            ..*p
        };
        if !p.ray.t_max.is_finite() {
            return Behind::OnItsWay(Passed { ray: Ray::unbounded(origin, p.ray.dir), ..passed });
        }
        let target = p.ray.at(p.ray.t_max);
        // Nothing fits between, and coarse words have no direction for it.
        if (target - origin).length() <= 2.0 * offset_m || (target - origin).dot(along) <= 0.0 {
            return Behind::End(passed);
        }
        Behind::OnItsWay(Passed { ray: Ray::to_point(origin, target), ..passed })
    }
}

enum Behind {
    NoPane,
    End(Passed),
    OnItsWay(Passed),
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
