//! Irradiance at free points: direct light integrated at the point, indirect gathered from `E_mean`.
//!
//! ```text
//! point, normal --kernel to every patch that shines; F <= 10^-3: one ray to it, its mean radiosity
//!                 else, and of emitters: kernel to its elements, rays to strata of each --> sum F v M      (direct)
//!                                                                                           sum F v rho E  (indirect)
//! ```
//! F by the exact kernel, v the share of its rays that arrive: of an element one a stratum of an r x r grid, r growing
//! with F. Every emitting surface is seen by at least 16 rays. Strata below the horizon are passed over.
//! Points are worked on in parallel, the rays of many in one query: a point's value never depends on the others.
//! Not modelled: light through mirrors and glass.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::form_factors::inside;
use super::kernel::Source;
use super::{ProbePoint, Solution, SolveError, SplitIrradiance, lights};
use crate::geom::Ray;
use crate::mesh::{Corners, ElementId, Mesh, Patch, PatchId, SurfacePoint, VertexId};
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

/// Rays of one query at most, so that targets and answers never take more than a few dozen megabytes; but a point's at
/// least.
const RAYS_PER_QUERY: usize = 1 << 20;
/// Points of one query at most: the caller hears of each query.
const POINTS_PER_QUERY: usize = 256;

/// A patch with a shining element.
struct ShiningPatch {
    patch: PatchId,
    /// The patch as one source and its mean radiosity of reflected light; none for emitters, whose elements are always
    /// seen one by one.
    whole: Option<(Source, Rgb)>,
    elements: Vec<Shining>,
}

/// An element as a probe sees it.
struct Shining {
    element: ElementId,
    source: Source,
    exitance: Rgb,
    reflected: Rgb,
    /// Least strata along each side.
    min_side: u32,
}

/// What a probe gets from one element or light before visibility.
struct Gathered {
    direct: Rgb,
    indirect: Rgb,
    rays: Range<usize>,
}

/// What a point asks the caster.
struct Plan {
    gathered: Vec<Gathered>,
    /// Rays to elements and lights at a place.
    bundles: Vec<RayBundle>,
    n_targets: usize,
    /// Rays to lights infinitely far, and what each brings.
    far_rays: Vec<Ray>,
    far: Vec<Rgb>,
}

/// What all points see.
struct View<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    shining: Vec<ShiningPatch>,
    offset_m: f64,
}

pub(super) fn run(
    scene: &Scene,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<SplitIrradiance>, SolveError> {
    let shining = shining(scene, mesh, solution);
    let view = View { scene, mesh, offset_m: caster.surface_offset_m(), shining };
    let per_query = (RAYS_PER_QUERY / view.shining.len().max(1)).clamp(1, POINTS_PER_QUERY);
    let mut values = Vec::with_capacity(points.len());
    for chunk in points.chunks(per_query) {
        let plans: Vec<Plan> = chunk.par_iter().map(|point| view.plan(point)).collect();
        values.extend(answered(&plans, caster)?);
        progress(values.len() as f64 / points.len() as f64);
    }
    Ok(values)
}

fn shining(scene: &Scene, mesh: &Mesh, solution: &Solution) -> Vec<ShiningPatch> {
    let n_elements_of: Vec<usize> = mesh
        .surfaces
        .iter()
        .map(|s| s.front.clone().map(|p| mesh.patches[p as usize].elements.len()).sum())
        .collect();
    let of_patch = |(p, patch): (usize, &Patch)| {
        let surface = &scene.surfaces[patch.surface.0 as usize];
        let exitance = surface.exitance;
        let reflectance = scene.material(surface).reflectance;
        let mut min_side = 1;
        if !exitance.is_black() {
            let n_elements = n_elements_of[patch.surface.0 as usize];
            while n_elements * ((min_side * min_side) as usize) < MIN_RAYS_PER_EMITTER {
                min_side += 1;
            }
        }
        let mut reflected_w = Rgb::BLACK;
        let mut elements = Vec::new();
        for e in patch.elements.clone() {
            let element = &mesh.elements[e as usize];
            let reflected = reflectance * solution.element_irradiance[e as usize].total();
            reflected_w += reflected * element.area_m2;
            if !(exitance.is_black() && reflected.is_black()) {
                let source = Source::new(&mesh.polygon(&element.corners));
                elements.push(Shining { element: ElementId(e), source, exitance, reflected, min_side });
            }
        }
        let whole = (exitance.is_black() && patch.area_m2 > 0.0)
            .then(|| (Source::new(&mesh.polygon(&patch.corners)), reflected_w / patch.area_m2));
        let shines = !elements.is_empty();
        shines.then_some(ShiningPatch { patch: PatchId(p as u32), whole, elements })
    };
    mesh.patches.par_iter().enumerate().filter_map(of_patch).collect()
}

impl View<'_> {
    /// What shines on `point`, and the rays that tell whether it arrives.
    fn plan(&self, point: &ProbePoint) -> Plan {
        let View { scene, mesh, offset_m, .. } = *self;
        let normal = point.normal.normalize_or_zero();
        let apex = point.at + offset_m * normal;
        let mut gathered: Vec<Gathered> = Vec::new();
        let mut targets: Vec<DVec3> = Vec::new();
        for patch in &self.shining {
            if let Some((source, reflected)) = &patch.whole {
                let factor = source.form_factor(point.at, normal);
                if factor <= 0.0 {
                    continue;
                }
                if factor <= FACTOR_PER_RAY {
                    let start = targets.len();
                    let target = patch_target(mesh, patch.patch, source, apex, offset_m);
                    if (target - apex).dot(normal) > 0.0 {
                        targets.push(target);
                    } else {
                        let middle = source.centre_above_horizon(point.at, normal);
                        targets.extend(middle.map(|m| m + offset_m * source.normal()));
                    }
                    gathered.push(Gathered {
                        direct: Rgb::BLACK,
                        indirect: *reflected * factor,
                        rays: start..targets.len(),
                    });
                    continue;
                }
            }
            for shining in &patch.elements {
                let factor = shining.source.form_factor(point.at, normal);
                if factor <= 0.0 {
                    continue;
                }
                let start = targets.len();
                let side = ((factor / FACTOR_PER_RAY).sqrt().ceil() as u32)
                    .clamp(shining.min_side, MAX_STRATA_SIDE.max(shining.min_side));
                aim(mesh, shining.element, side, apex, normal, offset_m, &mut targets);
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
        let (mut far_rays, mut far) = (Vec::new(), Vec::new());
        for light in &scene.lights {
            let direct = lights::irradiance(light, point.at, normal);
            if direct.is_black() {
                continue;
            }
            if let Light::Directional { direction, .. } = light {
                far_rays.push(Ray::unbounded(apex, DVec3::ZERO - *direction));
                far.push(direct);
            } else if let Some(position) = lights::position(light) {
                targets.push(position);
                let rays = targets.len() - 1..targets.len();
                gathered.push(Gathered { direct, indirect: Rgb::BLACK, rays });
            }
        }
        let bundles = targets
            .chunks(MAX_BUNDLE_RAYS)
            .map(|points| RayBundle::Targets { apex, points: points.to_vec() })
            .collect();
        Plan { gathered, bundles, n_targets: targets.len(), far_rays, far }
    }
}

/// Sums of what arrives, from one query for all bundles and one for all rays to lights infinitely far.
fn answered(plans: &[Plan], caster: &mut dyn RayCaster) -> Result<Vec<SplitIrradiance>, SolveError> {
    let bundles: Vec<RayBundle> = plans.iter().flat_map(|plan| plan.bundles.iter().cloned()).collect();
    let far_rays: Vec<Ray> = plans.iter().flat_map(|plan| plan.far_rays.iter().copied()).collect();
    let blocked = match bundles.is_empty() {
        true => Vec::new(),
        false => caster.any_hits(Purpose::Probe, Query::Bundles(&bundles))?,
    };
    let far_blocked = match far_rays.is_empty() {
        true => Vec::new(),
        false => caster.any_hits(Purpose::Probe, Query::Rays(&far_rays))?,
    };
    let (mut blocked, mut far_blocked) = (&blocked[..], &far_blocked[..]);
    let sums = plans.iter().map(|plan| {
        let (mine, rest) = blocked.split_at(plan.n_targets);
        let (mine_far, rest_far) = far_blocked.split_at(plan.far.len());
        (blocked, far_blocked) = (rest, rest_far);
        let mut sum = SplitIrradiance::default();
        for g in &plan.gathered {
            let n_visible = mine[g.rays.clone()].iter().filter(|b| !**b).count();
            if n_visible > 0 {
                let share = n_visible as f64 / g.rays.len() as f64;
                sum.direct += g.direct * share;
                sum.indirect += g.indirect * share;
            }
        }
        sum.direct += plan.far.iter().zip(mine_far).filter(|(_, blocked)| !**blocked).map(|(e, _)| *e).sum();
        sum
    });
    Ok(sums.collect())
}

/// Where a small patch is looked at: anywhere on it, lifted off.
fn patch_target(mesh: &Mesh, patch: PatchId, source: &Source, apex: DVec3, offset_m: f64) -> DVec3 {
    // Another place for every point, so that a shadow's edge on the patch does not show as a step in a grid.
    let from = apex.to_array().iter().fold(SEED, |h, x| hash(h, x.to_bits(), 0));
    let [s, t] = unit_pair(hash(from, u64::from(patch.0), 0)).map(|c| 0.02 + 0.96 * c);
    let at = |v: VertexId| mesh.vertices[v.0 as usize].position;
    let place = match mesh.patches[patch.0 as usize].corners {
        Corners::Triangle([a, b, c]) => {
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            (1.0 - s - t) * at(a) + s * at(b) + t * at(c)
        }
        Corners::Quad([a, b, c, d]) => at(a).lerp(at(b), s).lerp(at(d).lerp(at(c), s), t),
    };
    place + offset_m * source.normal()
}

/// Adds targets on `element`, one a stratum of `side` x `side`, lifted off it, where above the horizon.
fn aim(
    mesh: &Mesh,
    element: ElementId,
    side: u32,
    apex: DVec3,
    normal: DVec3,
    offset_m: f64,
    out: &mut Vec<DVec3>,
) {
    let lift = offset_m * mesh.elements[element.0 as usize].normal;
    for stratum in 0..side * side {
        let [u, v] = unit_pair(hash(SEED, u64::from(element.0), u64::from(stratum)));
        let st = [
            (f64::from(stratum % side) + u) / f64::from(side),
            (f64::from(stratum / side) + v) / f64::from(side),
        ];
        let st = inside(mesh, element, st.map(|c| 0.02 + 0.96 * c));
        let target = mesh.position(SurfacePoint { element, st }) + lift;
        if (target - apex).dot(normal) > 0.0 {
            out.push(target);
        }
    }
}
