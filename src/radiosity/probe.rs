//! Irradiance at free points: direct light integrated at the point, indirect gathered from `E_mean`.
//!
//! ```text
//! point, normal --kernel to every element that shines, rays from the point to strata of it--> sum F v M  (direct)
//!                                                                                    sum F v rho E  (indirect)
//! ```
//! F by the exact kernel per element, v the share of its rays that arrive: one a stratum of an r x r grid, r growing
//! with F. Every emitting surface is seen by at least 16 rays. Strata below the horizon are passed over.
//! Not modelled: light through mirrors and glass.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::form_factors::inside;
use super::kernel::Source;
use super::{ProbePoint, Solution, SolveError, SplitIrradiance, lights};
use crate::geom::Ray;
use crate::mesh::{ElementId, Mesh, SurfacePoint};
use crate::raycast::{MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster};
use crate::sampling::{hash, unit_pair};
use crate::scene::{Light, Scene};
use crate::units::Rgb;

/// Rays that see each emitting surface at least.
const MIN_RAYS_PER_EMITTER: usize = 16;
/// An element of a larger form factor is seen by r x r rays, F <= r^2 x this.
const FACTOR_PER_RAY: f64 = 1e-3;
/// But at most this many by this many.
const MAX_STRATA_SIDE: u32 = 8;
/// Probe strata are the same in every run: their own seed.
const SEED: u64 = 0x70726f6265;

/// An element as a probe sees it.
struct Shining {
    source: Source,
    exitance: Rgb,
    reflected: Rgb,
    /// Least strata along each side.
    min_side: u32,
}

/// What a probe gets from one element before visibility.
struct Gathered {
    direct: Rgb,
    indirect: Rgb,
    rays: Range<usize>,
}

pub(super) fn run(
    scene: &Scene,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
) -> Result<Vec<SplitIrradiance>, SolveError> {
    let shining = shining(scene, mesh, solution);
    points.iter().map(|point| at(scene, mesh, &shining, caster, point)).collect()
}

fn shining(scene: &Scene, mesh: &Mesh, solution: &Solution) -> Vec<Option<Shining>> {
    let n_elements_of: Vec<usize> = mesh
        .surfaces
        .iter()
        .map(|s| s.front.clone().map(|p| mesh.patches[p as usize].elements.len()).sum())
        .collect();
    mesh.elements
        .par_iter()
        .zip(&solution.element_irradiance)
        .map(|(element, e)| {
            let surface_id = mesh.patches[element.patch.0 as usize].surface.0 as usize;
            let surface = &scene.surfaces[surface_id];
            let reflected = scene.material(surface).reflectance * e.total();
            if surface.exitance.is_black() && reflected.is_black() {
                return None;
            }
            let mut min_side = 1;
            if !surface.exitance.is_black() {
                while n_elements_of[surface_id] * ((min_side * min_side) as usize) < MIN_RAYS_PER_EMITTER {
                    min_side += 1;
                }
            }
            let source = Source::new(&mesh.polygon(&element.corners));
            Some(Shining { source, exitance: surface.exitance, reflected, min_side })
        })
        .collect()
}

fn at(
    scene: &Scene,
    mesh: &Mesh,
    shining: &[Option<Shining>],
    caster: &mut dyn RayCaster,
    point: &ProbePoint,
) -> Result<SplitIrradiance, SolveError> {
    let offset_m = caster.surface_offset_m();
    let normal = point.normal.normalize_or_zero();
    let apex = point.at + offset_m * normal;
    let mut gathered: Vec<Gathered> = Vec::new();
    let mut targets: Vec<DVec3> = Vec::new();
    for (e, shining) in shining.iter().enumerate() {
        let Some(shining) = shining else { continue };
        let factor = shining.source.form_factor(point.at, normal);
        if factor > 0.0 {
            let start = targets.len();
            let side = ((factor / FACTOR_PER_RAY).sqrt().ceil() as u32)
                .clamp(shining.min_side, MAX_STRATA_SIDE.max(shining.min_side));
            aim(mesh, e as u32, side, apex, normal, offset_m, &mut targets);
            if targets.len() == start {
                let middle = shining.source.centre_above_horizon(point.at, normal);
                targets.extend(middle.map(|m| m + offset_m * shining.source.normal()));
            }
            gathered.push(Gathered {
                direct: shining.exitance * factor,
                indirect: shining.reflected * factor,
                rays: start..targets.len(),
            });
        }
    }
    for light in &scene.lights {
        let direct = lights::irradiance(light, point.at, normal);
        if let (Some(position), false) = (lights::position(light), direct.is_black()) {
            targets.push(position);
            let rays = targets.len() - 1..targets.len();
            gathered.push(Gathered { direct, indirect: Rgb::BLACK, rays });
        }
    }
    let bundles: Vec<RayBundle> = targets
        .chunks(MAX_BUNDLE_RAYS)
        .map(|points| RayBundle::Targets { apex, points: points.to_vec() })
        .collect();
    let blocked = match bundles.is_empty() {
        true => Vec::new(),
        false => caster.any_hits(Purpose::Probe, Query::Bundles(&bundles))?,
    };
    let mut sum = SplitIrradiance::default();
    for g in &gathered {
        let n = g.rays.len();
        let n_visible = blocked[g.rays.clone()].iter().filter(|b| !**b).count();
        if n_visible > 0 {
            let share = n_visible as f64 / n as f64;
            sum.direct += g.direct * share;
            sum.indirect += g.indirect * share;
        }
    }
    sum.direct += directional(scene, caster, apex, normal)?;
    Ok(sum)
}

/// Adds targets on `element`, one a stratum of `side` x `side`, lifted off it, where above the horizon.
fn aim(
    mesh: &Mesh,
    element: u32,
    side: u32,
    apex: DVec3,
    normal: DVec3,
    offset_m: f64,
    out: &mut Vec<DVec3>,
) {
    let lift = offset_m * mesh.elements[element as usize].normal;
    for stratum in 0..side * side {
        let [u, v] = unit_pair(hash(SEED, u64::from(element), u64::from(stratum)));
        let st = [
            (f64::from(stratum % side) + u) / f64::from(side),
            (f64::from(stratum / side) + v) / f64::from(side),
        ];
        let st = inside(mesh, ElementId(element), st.map(|c| 0.02 + 0.96 * c));
        let target = mesh.position(SurfacePoint { element: ElementId(element), st }) + lift;
        if (target - apex).dot(normal) > 0.0 {
            out.push(target);
        }
    }
}

/// Direct irradiance of the directional lights (W/m^2).
fn directional(
    scene: &Scene,
    caster: &mut dyn RayCaster,
    apex: DVec3,
    normal: DVec3,
) -> Result<Rgb, SolveError> {
    let mut candidates = Vec::new();
    let mut rays = Vec::new();
    for light in &scene.lights {
        let irradiance = lights::irradiance(light, apex, normal);
        if let (Light::Directional { direction, .. }, false) = (light, irradiance.is_black()) {
            candidates.push(irradiance);
            rays.push(Ray::unbounded(apex, DVec3::ZERO - *direction));
        }
    }
    if rays.is_empty() {
        return Ok(Rgb::BLACK);
    }
    let blocked = caster.any_hits(Purpose::Probe, Query::Rays(&rays))?;
    Ok(candidates.iter().zip(blocked).filter(|(_, blocked)| !blocked).map(|(e, _)| *e).sum())
}
