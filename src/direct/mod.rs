//! Direct light of pass 2: shadow rays from shaded points to every emitter and light.
//!
//! ```text
//! ShadePoint x source --kernel (polygon formula)--> unoccluded E --any_hits of a bundle--> visible share --> E
//! ```
//! E = sum over sources of M F V, with F the exact form factor and V = sum_k w_k v_k / sum_k w_k over stratified
//! samples k of the source, w_k = cos cos' / r^2: no noise where nothing occludes. A source is one emitting side of
//! a surface, or a light. Points are worked on in wavefronts: one query of the caster per chunk.
//! Source: Kok, Jansen 1992 (area-light sampling, here uniform strata); Lambert 1760.
//!
//! Not modelled yet: adaptive sampling, shadow coherence. An any-hit answer is one bit, so glass, thin or closed,
//! blocks shadow rays as any surface does.

mod source;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::Mesh;

use crate::raycast::{CastError, Facing, Purpose, Query, RayBundle, RayCaster};
use crate::scene::{Scene, Shape};
use crate::units::Rgb;
use source::{Area, Source, Target};

/// Shaded points per query: bounds the bundles held at once.
const POINTS_PER_CHUNK: usize = 2048;

/// Largest n of n x n strata: a bundle's rays.
pub const MAX_STRATA: u32 = 8;

/// A point that wants to know its direct irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadePoint {
    /// Where, on a surface (m).
    pub position: DVec3,
    /// Unit normal that light is received with.
    pub normal: DVec3,
    /// Unit normal of the surface that casters know, same side: rays start lifted along it.
    pub geometric_normal: DVec3,
    /// Names the point for its sampling pattern: equal keys, equal patterns.
    pub key: u64,
}

/// The sources of a scene, ready for gathering.
#[derive(Clone, Debug)]
pub struct DirectLight {
    sources: Vec<Source>,
    offset_m: f64,
}

/// One bundle in flight: whose it is and how its answers count.
struct Pending {
    point: usize,
    unoccluded: Rgb,
    bundle: Option<RayBundle>,
    /// Per ray of the bundle.
    weights: Vec<f64>,
    /// Weight of samples too near to be occluded.
    near_weight: f64,
}

impl DirectLight {
    /// Collects every emitting side and light; `offset_m` is the caster's surface offset.
    pub fn new(scene: &Scene, mesh: &Mesh, offset_m: f64) -> DirectLight {
        let mut sources = Vec::new();
        for (surface, patches) in scene.surfaces.iter().zip(&mesh.surfaces) {
            if surface.exitance.is_black() {
                continue;
            }
            let whole: Option<&[DVec3]> = match &surface.shape {
                Shape::Quad(corners) => Some(corners),
                Shape::Triangle(corners) => Some(corners),
                _ => None,
            };
            let sides = if surface.two_sided { &[Facing::Front, Facing::Back][..] } else { &[Facing::Front] };
            for side in sides {
                let areas = match (whole, side) {
                    (None, side) if matches!(surface.shape, Shape::Faces(_)) => {
                        face_areas(&surface.shape, *side)
                    }
                    (Some(corners), Facing::Front) => vec![Area::new(corners)],
                    (Some(corners), Facing::Back) => {
                        vec![Area::new(&corners.iter().rev().copied().collect::<Vec<_>>())]
                    }
                    (None, side) => {
                        let range = if *side == Facing::Front { &patches.front } else { &patches.back };
                        let patches = &mesh.patches[range.start as usize..range.end as usize];
                        patches.iter().map(|p| Area::new(&mesh.polygon(&p.corners))).collect()
                    }
                };
                sources.push(Source::Areas { areas, exitance: surface.exitance });
            }
        }
        sources.extend(scene.lights.iter().map(|&light| Source::Light(light)));
        DirectLight { sources, offset_m }
    }

    /// How many sources.
    pub fn n_sources(&self) -> usize {
        self.sources.len()
    }

    /// Direct irradiance (W/m^2) at every point, with `strata` x `strata` (at most 8 x 8) samples of each area source.
    ///
    /// # Errors
    /// When the caster fails.
    pub fn gather(
        &self,
        caster: &mut dyn RayCaster,
        points: &[ShadePoint],
        strata: u32,
        seed: u64,
    ) -> Result<Vec<Rgb>, CastError> {
        let strata = strata.clamp(1, MAX_STRATA);
        let mut irradiance = vec![Rgb::BLACK; points.len()];
        for (chunk, sums) in points.chunks(POINTS_PER_CHUNK).zip(irradiance.chunks_mut(POINTS_PER_CHUNK)) {
            let pending: Vec<Vec<Pending>> = chunk
                .par_iter()
                .enumerate()
                .map(|(i, point)| {
                    let of = |(s, source): (usize, &Source)| self.aim(i, point, s, source, strata, seed);
                    self.sources.iter().enumerate().filter_map(of).collect()
                })
                .collect();
            let mut pending: Vec<Pending> = pending.into_iter().flatten().collect();
            let bundles: Vec<RayBundle> = pending.iter_mut().filter_map(|p| p.bundle.take()).collect();
            let blocked = caster.any_hits(Purpose::Shadow, Query::Bundles(&bundles))?;
            let mut answers = blocked.iter();
            for p in &pending {
                let mut visible = p.near_weight;
                let mut all = p.near_weight;
                for &weight in &p.weights {
                    all += weight;
                    if answers.next() == Some(&false) {
                        visible += weight;
                    }
                }
                if all > 0.0 {
                    sums[p.point] += p.unoccluded * (visible / all);
                }
            }
        }
        Ok(irradiance)
    }

    /// The bundle from one point to one source; `None` when nothing can arrive.
    fn aim(
        &self,
        index: usize,
        point: &ShadePoint,
        source_index: usize,
        source: &Source,
        strata: u32,
        seed: u64,
    ) -> Option<Pending> {
        let apex = point.position + self.offset_m * point.geometric_normal;
        let jitter = source::jitter(seed, point.key, source_index as u64);
        let aimed = |unoccluded, targets: Vec<Target>| {
            let (mut points, mut weights, mut near_weight) = (Vec::new(), Vec::new(), 0.0);
            for t in targets {
                // A target within the offset of the apex has nothing between, and no direction in coarse words.
                if (t.position - apex).length() > 2.0 * self.offset_m {
                    points.push(t.position);
                    weights.push(t.weight);
                } else {
                    near_weight += t.weight;
                }
            }
            let bundle = (!points.is_empty()).then_some(RayBundle::Targets { apex, points });
            Pending { point: index, unoccluded, bundle, weights, near_weight }
        };
        match source {
            Source::Light(light) => {
                let unoccluded = crate::radiosity::lights::irradiance(light, point.position, point.normal);
                if unoccluded.is_black() {
                    return None;
                }
                Some(match source::light_direction(light) {
                    Some(toward) => {
                        let step = DVec3::ZERO;
                        let bundle =
                            RayBundle::Tile { apex, corner: toward, step_u: step, step_v: step, n: 1, m: 1 };
                        let (bundle, weights) = (Some(bundle), vec![1.0]);
                        Pending { point: index, unoccluded, bundle, weights, near_weight: 0.0 }
                    }
                    None => {
                        let position = crate::radiosity::lights::position(light)?;
                        aimed(unoccluded, vec![Target { position, weight: 1.0 }])
                    }
                })
            }
            Source::Areas { areas, exitance } => {
                let kernels: Vec<f64> =
                    areas.iter().map(|a| a.source.form_factor(point.position, point.normal)).collect();
                let form_factor: f64 = kernels.iter().sum();
                if form_factor <= 0.0 {
                    return None;
                }
                let unoccluded = *exitance * form_factor;
                let [area] = &areas[..] else {
                    let n = (strata * strata) as usize;
                    let targets = source::spread(areas, &kernels, n, jitter, self.offset_m);
                    return Some(aimed(unoccluded, targets));
                };
                let mut targets = area.strata(strata, jitter, self.offset_m);
                for t in &mut targets {
                    let on_source = t.position - self.offset_m * area.normal;
                    t.weight *= area.weight(point.position, point.normal, on_source);
                }
                if targets.iter().all(|t| t.weight <= 0.0) {
                    let centre = area.source.centre_above_horizon(point.position, point.normal)?;
                    let position = centre + self.offset_m * area.normal;
                    return Some(aimed(unoccluded, vec![Target { position, weight: 1.0 }]));
                }
                let near = |t: &Target| (t.position - apex).length() <= 2.0 * self.offset_m;
                let fan = area.fan(apex, strata, jitter, self.offset_m);
                Some(match fan {
                    Some(bundle) if !targets.iter().any(near) => Pending {
                        point: index,
                        unoccluded,
                        bundle: Some(bundle),
                        weights: targets.iter().map(|t| t.weight).collect(),
                        near_weight: 0.0,
                    },
                    _ => aimed(unoccluded, targets),
                })
            }
        }
    }
}

/// The faces of a face set as they are seen from one side.
fn face_areas(shape: &Shape, side: Facing) -> Vec<Area> {
    let Shape::Faces(set) = shape else { return Vec::new() };
    let area = |face: &[u32]| {
        let mut corners: Vec<DVec3> = face.iter().map(|&c| set.points()[c as usize]).collect();
        if side == Facing::Back {
            corners.reverse();
        }
        Area::new(&corners)
    };
    set.faces().map(area).collect()
}

#[cfg(test)]
mod tests;
