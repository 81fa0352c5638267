//! Points that no lamp can be meant to light: inside a solid, or behind a wall.
//!
//! ```text
//! point, normal --ray back along the normal, 4 x 4 cosine-distributed rays--> nearest hits
//!   the surface at the point shows its black back there  -> behind it
//!   no ray meets a front, at least half meet black backs -> inside or behind the nearest of those
//! ```
//! Not modelled: insides of solids made of two-sided surfaces, which have none.

use crate::geom::{DVec3, Ray};
use crate::mesh::Mesh;
use crate::radiosity::ProbePoint;
use crate::raycast::{CastError, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::scene::SurfaceId;

/// Rays about the normal along each axis of the square.
const SIDE: u32 = 4;

/// For each point the surface that it lies behind or inside of; `reach_m` (m): how far off a surface a point still
/// counts as on it.
///
/// # Errors
/// When the caster fails.
pub fn hidden_behind(
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
    reach_m: f64,
) -> Result<Vec<Option<SurfaceId>>, CastError> {
    let offset_m = caster.surface_offset_m();
    let reach = reach_m.max(4.0 * offset_m);
    let toward: Vec<Ray> = points
        .iter()
        .map(|p| Ray {
            t_max: 2.0,
            ..Ray::unbounded(p.at + reach * p.normal, DVec3::ZERO - reach * p.normal)
        })
        .collect();
    let around: Vec<RayBundle> = points
        .iter()
        .map(|p| RayBundle::Hemisphere {
            apex: p.at + offset_m * p.normal,
            normal: p.normal,
            spin: 0.5,
            n: SIDE,
            m: SIDE,
            jitter: [0.5; 2],
        })
        .collect();
    let at = caster.closest_hits(Purpose::Probe, Query::Rays(&toward))?;
    let seen = caster.closest_hits(Purpose::Probe, Query::Bundles(&around))?;
    let back = |hit: &RayHit| match mesh.patch_of_hit(hit.patch, hit.facing) {
        Some(_) => None,
        None => Some(mesh.patches[hit.patch.0 as usize].surface),
    };
    let n_rays = (SIDE * SIDE) as usize;
    let judged = at.iter().zip(seen.chunks(n_rays)).map(|(at, seen)| {
        let on_back = at.as_ref().and_then(back);
        let hits: Vec<&RayHit> = seen.iter().flatten().collect();
        let shut_in = 2 * hits.len() >= n_rays && hits.iter().all(|hit| back(hit).is_some());
        let nearest = || hits.iter().min_by(|a, b| a.t.total_cmp(&b.t)).and_then(|hit| back(hit));
        on_back.or_else(|| shut_in.then(nearest).flatten())
    });
    Ok(judged.collect())
}
