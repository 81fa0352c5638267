//! Visibility change toward the strong sources: a shadow border in an element that no vertex needs to have seen.
//!
//! ```text
//! candidates x sources --rays from source points to the quarters' centres--> visible share at each, v
//!             --> step H = unoccluded irradiance x (largest v - smallest v) --> gain = (H / mean)^2 area / 24
//! ```
//! A step of H that crosses an element leaves a squared error of about H^2 area / 12 behind, a split halves it.
//! Sources: emitting surfaces and lights without area, the strongest few by power.

use glam::DVec3;
use rayon::prelude::*;

use super::Node;
use crate::mesh::{Corners, Mesh, PatchId, SurfacePoint};
use crate::radiosity::kernel::Source;
use crate::radiosity::lights;
use crate::raycast::{CastError, RayCaster};
use crate::scene::{Light, Scene};
use crate::units::Rgb;

/// Sources that are looked at.
const MAX_SOURCES: usize = 8;
/// Points of an emitting surface that are looked at.
const POINTS_PER_SOURCE: usize = 4;
/// Gain of a split over H^2 x area.
const GAIN_PER_STEP: f64 = 1.0 / 24.0;

/// What the splits of nodes are worth by visibility alone.
pub(super) struct Changes {
    /// Gain of each node (m^2).
    pub(super) gains: Vec<f64>,
    pub(super) n_rays: u64,
}

enum Strong<'a> {
    /// An emitting side: its polygons, luminance of its exitance, points to look from, lifted off it.
    Area {
        polygons: Vec<Source>,
        exitance: f64,
        points: Vec<DVec3>,
    },
    Light(&'a Light),
}

impl Strong<'_> {
    /// Luminance of the unoccluded irradiance.
    fn unoccluded(&self, point: DVec3, normal: DVec3) -> f64 {
        match self {
            Strong::Area { polygons, exitance, .. } => {
                exitance * polygons.iter().map(|p| p.form_factor(point, normal)).sum::<f64>()
            }
            Strong::Light(light) => lights::irradiance(light, point, normal).luminance(),
        }
    }
}

pub(super) fn changes(
    scene: &Scene,
    mesh: &Mesh,
    surfaces: &[f64],
    candidates: &[Node],
    caster: &mut dyn RayCaster,
) -> Result<Changes, CastError> {
    let offset_m = caster.surface_offset_m();
    // Centres of the elements of each candidate, with normals.
    let mut starts = vec![0];
    let mut points: Vec<(DVec3, DVec3)> = Vec::new();
    for &(patch, place) in candidates {
        points.extend(mesh.elements_in(PatchId(patch), place).map(|element| {
            let st = match mesh.elements[element.0 as usize].corners {
                Corners::Triangle(_) => glam::DVec2::splat(1.0 / 3.0),
                Corners::Quad(_) => glam::DVec2::splat(0.5),
            };
            (mesh.position(SurfacePoint { element, st }), mesh.elements[element.0 as usize].normal)
        }));
        starts.push(points.len());
    }
    let mut changes = Changes { gains: vec![0.0; candidates.len()], n_rays: 0 };
    for source in strongest(scene, mesh, offset_m) {
        let unoccluded: Vec<f64> =
            points.par_iter().with_min_len(256).map(|&(p, n)| source.unoccluded(p, n)).collect();
        let lit: Vec<usize> = (0..points.len()).filter(|&i| unoccluded[i] > 0.0).collect();
        let target = |i: usize| points[i].0 + offset_m * points[i].1;
        let (mut n_visible, mut n_looks) = (vec![0_u32; points.len()], 0_u32);
        let targets: Vec<DVec3> = lit.iter().map(|&i| target(i)).collect();
        let lights = match &source {
            Strong::Area { points, .. } => points.iter().map(|&p| light_at(p)).collect(),
            Strong::Light(light) => vec![**light],
        };
        for light in &lights {
            let blocked = lights::blocked(light, &targets, caster)?;
            lit.iter().zip(blocked).for_each(|(&i, blocked)| n_visible[i] += u32::from(!blocked));
            n_looks += 1;
        }
        changes.n_rays += lit.len() as u64 * u64::from(n_looks);
        for (c, &(patch, place)) in candidates.iter().enumerate() {
            let (mut low, mut high, mut most) = (f64::INFINITY, 0.0_f64, 0.0_f64);
            for i in (starts[c]..starts[c + 1]).filter(|&i| unoccluded[i] > 0.0) {
                let share = f64::from(n_visible[i]) / f64::from(n_looks.max(1));
                (low, high, most) = (low.min(share), high.max(share), most.max(unoccluded[i]));
            }
            let mean = surfaces[mesh.patches[patch as usize].surface.0 as usize];
            if high > low && mean > 0.0 {
                let step = most * (high - low) / mean;
                let area_m2: f64 = mesh
                    .elements_in(PatchId(patch), place)
                    .map(|element| mesh.elements[element.0 as usize].area_m2)
                    .sum();
                changes.gains[c] += GAIN_PER_STEP * step * step * area_m2;
            }
        }
    }
    Ok(changes)
}

/// A light at a point of a source: only what it is seen from counts.
pub(super) fn light_at(position: DVec3) -> Light {
    Light::Point { position, intensity: Rgb::WHITE }
}

/// The strongest sources, strongest first; a directional light counts by its irradiance on the whole scene.
fn strongest<'a>(scene: &'a Scene, mesh: &Mesh, offset_m: f64) -> Vec<Strong<'a>> {
    let mut sources: Vec<(f64, Strong<'a>)> = Vec::new();
    for (surface, patches) in scene.surfaces.iter().zip(&mesh.surfaces) {
        let exitance = surface.exitance.luminance();
        if exitance <= 0.0 {
            continue;
        }
        for range in [patches.front.clone(), patches.back.clone()] {
            let n = range.len();
            if n == 0 {
                continue;
            }
            let own = &mesh.patches[range.start as usize..range.end as usize];
            let centre = |patch: &crate::mesh::Patch| {
                let corners = mesh.polygon(&patch.corners);
                corners.iter().sum::<DVec3>() / corners.len() as f64 + offset_m * patch.normal
            };
            // Few patches: their corners' way in as well; many: some of them.
            let mut points: Vec<DVec3> = Vec::new();
            if n < POINTS_PER_SOURCE {
                for patch in own {
                    let middle = centre(patch);
                    let lift = offset_m * patch.normal;
                    points.extend(mesh.polygon(&patch.corners).iter().map(|c| middle.lerp(*c + lift, 0.5)));
                }
            } else {
                let step = |k: usize| (2 * k + 1) * n / (2 * POINTS_PER_SOURCE);
                points.extend((0..POINTS_PER_SOURCE).map(|k| centre(&own[step(k)])));
            }
            let area_m2: f64 = own.iter().map(|p| p.area_m2).sum();
            let polygons = own.iter().map(|p| Source::new(&mesh.polygon(&p.corners))).collect();
            sources.push((exitance * area_m2, Strong::Area { polygons, exitance, points }));
        }
    }
    for light in &scene.lights {
        let power = match light {
            Light::Directional { irradiance, .. } => irradiance.luminance() * mesh.total_area_m2(),
            _ => lights::power_w(light).map_or(0.0, |p| p.luminance()),
        };
        sources.push((power, Strong::Light(light)));
    }
    sources.sort_by(|a, b| b.0.total_cmp(&a.0));
    sources.into_iter().take(MAX_SOURCES).map(|(_, source)| source).collect()
}
