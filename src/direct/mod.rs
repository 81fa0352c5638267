//! Direct light of pass 2: which sources are sampled at a point, by which shadow rays, and which are stored.
//!
//! ```text
//! selection.rs  mesh vertices --shadow rays--> e_j, visible shares --> classes SAMPLE | STORED by patch, weights w_j
//! point --selection.rs--> sum (1 - w_j) R[e_j], sources with w_j > 0 --sampler.rs--> sum w_j D_j
//! D_j = unoccluded E (polygon formula) x visible share (cells.rs: adaptive; occluders.rs: coherence)
//! ```
//! D_j = M F V, with F the exact form factor and V = sum_k w_k v_k / sum_k w_k over samples k of the source, w_k =
//! cos cos' / r^2: no noise where nothing occludes. A source is one emitting side of a surface, or a light. Points are worked
//! on in wavefronts: one query of the caster per chunk and round.
//! Source: Kok, Jansen 1991 (source selection), 1992 (area-light sampling); Kok, Jansen, Woodward 1991 (shadow coherence);
//! Lambert 1760.

mod cells;
mod occluders;
mod sampler;
mod selection;
mod source;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::mesh::{Mesh, PatchId};
use crate::raycast::transmit::Panes;
use crate::raycast::{CastError, Facing, Purpose, RayCaster};
use crate::scene::{Scene, Shape};
use crate::units::Rgb;
use cells::{Fineness, MAX_LEVEL};
use occluders::Occluders;
pub use sampler::ShadowCounts;
use sampler::{Ask, Pattern, Sampler};
pub use selection::{PatchClasses, Selection, SelectionCounts, StoredLight};
use source::{Area, Source};

/// Shadow rays of a query, about: bounds what is held at once.
const RAYS_PER_CHUNK: usize = 1 << 18;

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

/// A point with what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct LitPoint {
    /// The point.
    pub point: ShadePoint,
    /// The patch that it lies on: its region for shadow coherence.
    pub region: Option<PatchId>,
    /// Luminance of the irradiance that is expected there (W/m^2): what errors are measured by.
    pub expected: f64,
    /// Sources to sample; without, all of them, wholly.
    pub sampled: Option<Vec<SampledSource>>,
}

impl From<ShadePoint> for LitPoint {
    /// All sources are sampled; nothing is known of the point.
    fn from(point: ShadePoint) -> LitPoint {
        LitPoint { point, region: None, expected: 0.0, sampled: None }
    }
}

/// A source that is sampled at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledSource {
    source: u32,
    /// Share of its light that is sampled, 0 to 1.
    weight: f64,
    /// What is to be expected.
    outlook: Outlook,
}

/// What is known of a source's visibility around a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Outlook {
    /// All points of the patch and of its neighbours see all of it, or none.
    settled: Option<bool>,
    /// All corners of the element see all of it, or none.
    likely: Option<bool>,
    /// Parts of it, on a grid of 4 x 4, that some corners of the element see and others do not.
    doubtful: u16,
}

/// How the visible share of an area source is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShadowSampling {
    /// The corners of an area, more where they disagree, fewer where all around say what to expect.
    #[default]
    Adaptive,
    /// The same number everywhere.
    Full,
}

/// How direct light is found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirectOptions {
    /// Shadow rays a point and area source at most: n x n strata, n up to [`MAX_STRATA`]; adaptive sampling rounds n down to
    /// a power of two.
    pub shadow_strata: u32,
    /// Which of them are taken.
    pub shadow_sampling: ShadowSampling,
    /// Error of a source's visible share that adaptive sampling leaves, in its part of the irradiance at the point.
    pub shadow_error: f64,
    /// Try the last occluder first.
    pub shadow_coherence: bool,
    /// tau: sources are sampled until the rest has less than this share of the light that could arrive; 0: all are sampled,
    /// 1: none.
    pub stored_share: f64,
}

impl Default for DirectOptions {
    fn default() -> Self {
        DirectOptions {
            shadow_strata: 8,
            shadow_sampling: ShadowSampling::Adaptive,
            shadow_error: 0.01,
            shadow_coherence: true,
            stored_share: 0.02,
        }
    }
}

impl DirectOptions {
    /// n x n strata of every source at every point, nothing saved.
    pub fn full(shadow_strata: u32) -> DirectOptions {
        DirectOptions {
            shadow_strata,
            shadow_sampling: ShadowSampling::Full,
            shadow_coherence: false,
            stored_share: 0.0,
            ..DirectOptions::default()
        }
    }
}

/// The sources of a scene, ready for gathering.
#[derive(Clone, Debug)]
pub struct DirectLight {
    sources: Vec<Source>,
    options: DirectOptions,
    sampler: Sampler,
}

impl DirectLight {
    /// Collects every emitting side and light; `offset_m` is the caster's surface offset.
    pub fn new(scene: &Scene, mesh: &Mesh, offset_m: f64, options: DirectOptions, seed: u64) -> DirectLight {
        let options = DirectOptions { shadow_strata: options.shadow_strata.clamp(1, MAX_STRATA), ..options };
        let mut sources = Vec::new();
        for (surface, patches) in scene.surfaces.iter().zip(&mesh.surfaces) {
            if surface.exitance.is_black() {
                continue;
            }
            let whole = surface.shape.polygon();
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
        let occluders = options.shadow_coherence.then(Occluders::default);
        let panes = Panes::of(scene, mesh);
        let counts = ShadowCounts::default();
        let purpose = Purpose::Shadow;
        let sampler = Sampler { seed, offset_m, purpose, panes, occluders, counts };
        DirectLight { sources, options, sampler }
    }

    /// How many sources.
    pub fn n_sources(&self) -> usize {
        self.sources.len()
    }

    /// What shadow rays were cast so far.
    pub fn counts(&self) -> ShadowCounts {
        self.sampler.counts
    }

    /// Sampled direct irradiance (W/m^2) at every point.
    ///
    /// # Errors
    /// When the caster fails.
    pub fn gather(&mut self, caster: &mut dyn RayCaster, points: &[LitPoint]) -> Result<Vec<Rgb>, CastError> {
        let (sources, options, offset_m) = (&self.sources, &self.options, self.sampler.offset_m);
        let mut irradiance = vec![Rgb::BLACK; points.len()];
        let rays_per_point = sources.len().max(1) * options.shadow_strata.pow(2) as usize;
        let points_per_chunk = (RAYS_PER_CHUNK / rays_per_point).clamp(64, 1 << 14);
        for (chunk, sums) in points.chunks(points_per_chunk).zip(irradiance.chunks_mut(points_per_chunk)) {
            let asks: Vec<Vec<(usize, Rgb, Ask<'_>)>> = chunk
                .par_iter()
                .enumerate()
                .map(|(i, lit)| {
                    let all = |s: usize| SampledSource {
                        source: s as u32,
                        weight: 1.0,
                        outlook: Outlook::default(),
                    };
                    let ask = |s: SampledSource| {
                        let (unoccluded, ask) = ask(sources, options, offset_m, lit, s)?;
                        Some((i, unoccluded, ask))
                    };
                    match &lit.sampled {
                        Some(some) => some.iter().copied().filter_map(ask).collect(),
                        None => (0..sources.len()).map(all).filter_map(ask).collect(),
                    }
                })
                .collect();
            let asks: Vec<_> = asks.into_iter().flatten().collect();
            let queries: Vec<Ask<'_>> = asks.iter().map(|(_, _, ask)| *ask).collect();
            let sampled = self.sampler.cast(caster, &queries)?;
            for ((i, unoccluded, _), sampled) in asks.iter().zip(sampled) {
                sums[*i] += *unoccluded * sampled.share;
            }
        }
        Ok(irradiance)
    }
}

/// The question that a point has about a source, and what it receives from all of it; `None` when nothing can arrive.
fn ask<'a>(
    sources: &'a [Source],
    options: &DirectOptions,
    offset_m: f64,
    lit: &LitPoint,
    of: SampledSource,
) -> Option<(Rgb, Ask<'a>)> {
    let source = &sources[of.source as usize];
    let ShadePoint { position, normal, geometric_normal, key } = lit.point;
    let unoccluded = source.unoccluded(position, normal) * of.weight;
    if unoccluded.is_black() {
        return None;
    }
    let ask = Ask {
        source,
        source_index: of.source,
        position,
        normal,
        apex: position + offset_m * geometric_normal,
        key,
        region: lit.region,
        pattern: pattern(options, unoccluded.luminance(), lit.expected, of.outlook),
    };
    Some((unoccluded, ask))
}

/// Sources that all around see wholly are taken for visible without a ray, where they give less than so many times the error
/// that may be left: a shadow between the points of a patch would not be noticed.
const TRUSTED: f64 = 10.0;

/// The samples of a source from which `luminance` arrives when all of it is visible, where `expected` does in all.
fn pattern(options: &DirectOptions, luminance: f64, expected: f64, outlook: Outlook) -> Pattern {
    if options.shadow_sampling == ShadowSampling::Full {
        return Pattern::Full(options.shadow_strata);
    }
    if outlook.settled == Some(true) && luminance <= TRUSTED * options.shadow_error * expected {
        return Pattern::Visible;
    }
    let least_share = options.shadow_error * expected / luminance;
    let max_level = (options.shadow_strata.ilog2() as u8).min(MAX_LEVEL);
    // One ray is good enough, whatever it says, where little is at stake.
    let one_will_do = least_share >= 1.0 || max_level == 0;
    let expected = outlook.settled.or(one_will_do.then_some(true));
    let likely = outlook.likely;
    let how = Fineness { max_level, least_share, doubtful: outlook.doubtful };
    Pattern::Adaptive { expected, likely, how }
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
