//! Discontinuity lines: where light stops or starts to be hidden, computed, not sampled.
//!
//! ```text
//! light x silhouette edge of the cast patches --projected on the plane of a receiving patch, clipped to it--> segments
//! segment --rays to both sides of it--> a border of light and shadow --> C-1        area lights: penumbra.rs --> C0
//! segments x elements of the final mesh --on an edge, or the nearest along it--> discontinuities of the mesh
//! ```
//! Irradiance of a light without area steps across such a line: C-1. Elements that one crosses are split to the limit of
//! depth before any other. In the final mesh the edges on a line, or the nearest one of a crossed element that runs along
//! it, are flagged.
//!
//! Source: Campbell, Fussell 1990; Heckbert 1992; Lischinski, Tampieri, Greenberg 1992.
//! Not modelled: borders of spots' cones, elements cut along a line.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::silhouette::{ON_LINE_SHARE, Segment, cast_edges, crosses, shadow_of};
use super::{Node, penumbra};
use crate::geom::Ray;
use crate::mesh::{Continuity, Discontinuity, ElementId, Mesh, PatchId};
use crate::raycast::{CastError, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster};
use crate::scene::{Light, Scene};

/// Silhouette edges x patches that are looked through at most: minutes beyond.
pub(super) const MAX_PAIRS: usize = 200_000_000;
/// Places along a segment that are tried for light on one side only.
const N_PROBES: u32 = 5;
/// How far beside a line the tries stand, over the size of the patch.
const PROBE_SHARE: f64 = 2e-3;
/// Cosine of the largest angle between a line and an edge that stands for it: 45 degrees.
const COS_ALONG: f64 = 0.707;
/// Gain of a split of a crossed element over H^2 x area: more than any that is measured.
const GAIN_PER_STEP: f64 = 1.0;

/// What was found of discontinuity lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LineReport {
    /// Segments on receiving patches with light on one side and shadow on the other.
    pub n_segments: u64,
    /// Element edges of the final mesh that stand for one: continuity C-1.
    pub n_flagged_edges: u64,
    /// There were too many edges and patches to look for lines of some light without area.
    pub skipped: bool,
    /// Segments on receiving patches where a penumbra of an area light begins or ends.
    pub n_penumbra_segments: u64,
    /// Element edges of the final mesh that stand for one and for no shadow line: continuity C0.
    pub n_c0_edges: u64,
    /// Emitting surfaces whose penumbras were not looked for: weaker ones, curved ones, too many edges and patches.
    pub n_emitters_skipped: u64,
}

/// Segments, patch by patch.
pub(super) type ByPatch = BTreeMap<u32, Vec<Segment>>;

/// The lines of a scene.
pub(super) struct Lines {
    /// Steps.
    shadows: ByPatch,
    penumbras: ByPatch,
    pub(super) n_rays: u64,
    skipped: bool,
    n_emitters_skipped: u64,
}

/// Finds the discontinuity lines of a scene and flags the edges of `mesh` that stand for them: shadow lines of lights
/// without area C-1, which gives each side its own vertices, borders of penumbras C0. What the mesh was told of
/// discontinuities before is replaced.
///
/// # Errors
/// When the caster fails.
pub fn flag_shadow_lines(
    scene: &Scene,
    mesh: &mut Mesh,
    caster: &mut dyn RayCaster,
) -> Result<LineReport, CastError> {
    let lines = find(scene, mesh, caster)?;
    Ok(lines.flag(scene, mesh))
}

pub(super) fn find(scene: &Scene, mesh: &Mesh, caster: &mut dyn RayCaster) -> Result<Lines, CastError> {
    let mut lines = Lines {
        shadows: ByPatch::new(),
        penumbras: ByPatch::new(),
        n_rays: 0,
        skipped: false,
        n_emitters_skipped: 0,
    };
    let edges = cast_edges(mesh);
    for light in &scene.lights {
        let silhouettes: Vec<[DVec3; 2]> =
            edges.iter().filter(|edge| edge.is_silhouette(light)).map(|edge| edge.ends).collect();
        if silhouettes.len().saturating_mul(mesh.patches.len()) > MAX_PAIRS {
            lines.skipped = true;
            continue;
        }
        let found: Vec<(u32, Segment)> = (0..mesh.patches.len() as u32)
            .into_par_iter()
            .flat_map_iter(|p| {
                let on_patch = |edge: &[DVec3; 2]| shadow_of(light, *edge, mesh, p).map(|s| (p, s));
                silhouettes.iter().filter_map(on_patch).collect::<Vec<_>>()
            })
            .collect();
        lines.keep_borders(light, mesh, found, caster)?;
    }
    let found = penumbra::find(scene, mesh, &edges, caster)?;
    lines.penumbras = found.by_patch;
    lines.n_rays += found.n_rays;
    lines.n_emitters_skipped = found.n_emitters_skipped;
    Ok(lines)
}

/// How far beside a line on a patch tries stand (m).
fn beside_m(mesh: &Mesh, patch: u32, offset_m: f64) -> f64 {
    (PROBE_SHARE * mesh.patches[patch as usize].area_m2.sqrt()).max(4.0 * offset_m)
}

/// Places on both sides of a segment, left and right in turn, `n` of each, lifted off the patch.
pub(super) fn beside(
    mesh: &Mesh,
    patch: u32,
    [a, b]: [DVec3; 2],
    n: u32,
    offset_m: f64,
) -> impl Iterator<Item = DVec3> + use<> {
    let normal = mesh.patches[patch as usize].normal;
    let aside = normal.cross(b - a).normalize_or_zero() * beside_m(mesh, patch, offset_m);
    (0..n).flat_map(move |k| {
        let at = a.lerp(b, (f64::from(k) + 0.5) / f64::from(n)) + offset_m * normal;
        [at + aside, at - aside]
    })
}

/// The part of a segment from the first to the last of its `n` stretches that is a border; `None` where none is.
pub(super) fn bordered(segment: Segment, n: u32, border: impl Fn(usize) -> bool) -> Option<Segment> {
    let first = (0..n).find(|k| border(*k as usize))?;
    let last = (0..n).rfind(|k| border(*k as usize))?;
    let [a, b] = segment.ends;
    let share = |k: u32| f64::from(k) / f64::from(n);
    Some(Segment { ends: [a.lerp(b, share(first)), a.lerp(b, share(last + 1))], ..segment })
}

impl Lines {
    /// Keeps the segments that have light on one side only, somewhere along them.
    fn keep_borders(
        &mut self,
        light: &Light,
        mesh: &Mesh,
        found: Vec<(u32, Segment)>,
        caster: &mut dyn RayCaster,
    ) -> Result<(), CastError> {
        let offset_m = caster.surface_offset_m();
        let targets: Vec<DVec3> =
            found.iter().flat_map(|(p, s)| beside(mesh, *p, s.ends, N_PROBES, offset_m)).collect();
        if targets.is_empty() {
            return Ok(());
        }
        let blocked = match *light {
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                let bundle =
                    |points: &[DVec3]| RayBundle::Targets { apex: position, points: points.to_vec() };
                let bundles: Vec<RayBundle> = targets.chunks(MAX_BUNDLE_RAYS).map(bundle).collect();
                caster.any_hits(Purpose::FormFactor, Query::Bundles(&bundles))?
            }
            Light::Directional { direction, .. } => {
                let rays: Vec<Ray> =
                    targets.iter().map(|t| Ray::unbounded(*t, DVec3::ZERO - direction)).collect();
                caster.any_hits(Purpose::FormFactor, Query::Rays(&rays))?
            }
        };
        self.n_rays += targets.len() as u64;
        for ((p, segment), tries) in found.into_iter().zip(blocked.chunks(2 * N_PROBES as usize)) {
            let kept = bordered(segment, N_PROBES, |k| tries[2 * k] != tries[2 * k + 1]);
            self.shadows.entry(p).or_default().extend(kept);
        }
        Ok(())
    }

    pub(super) fn report(&self) -> LineReport {
        let n = |lines: &ByPatch| lines.values().map(|s| s.len() as u64).sum();
        LineReport {
            n_segments: n(&self.shadows),
            skipped: self.skipped,
            n_penumbra_segments: n(&self.penumbras),
            n_emitters_skipped: self.n_emitters_skipped,
            ..LineReport::default()
        }
    }

    /// What a split of a node is worth for the steps that cross it (m^2).
    pub(super) fn gain(&self, mesh: &Mesh, surfaces: &[f64], (patch, place): Node) -> f64 {
        let Some(segments) = self.shadows.get(&patch) else { return 0.0 };
        let mean = surfaces[mesh.patches[patch as usize].surface.0 as usize];
        if mean <= 0.0 {
            return 0.0;
        }
        let normal = mesh.patches[patch as usize].normal;
        let mut largest = 0.0_f64;
        let mut area_m2 = 0.0;
        for element in mesh.elements_in(PatchId(patch), place) {
            let element = &mesh.elements[element.0 as usize];
            area_m2 += element.area_m2;
            let corners = mesh.polygon(&element.corners);
            // Along an edge is not across.
            for segment in segments.iter().filter(|s| crosses(s, &corners, normal)) {
                largest = largest.max(segment.step);
            }
        }
        GAIN_PER_STEP * (largest / mean).powi(2) * area_m2
    }

    /// Flags the edges that stand for lines; what was found and how many.
    pub(super) fn flag(&self, scene: &Scene, mesh: &mut Mesh) -> LineReport {
        let plain = mesh.subdivision().with_discontinuities(Vec::new());
        if !mesh.discontinuities().is_empty() {
            *mesh = rebuilt(scene, plain.clone());
        }
        let broken = standing_for(&self.shadows, mesh);
        let c0: BTreeSet<_> = &standing_for(&self.penumbras, mesh) - &broken;
        let report = LineReport {
            n_flagged_edges: broken.len() as u64,
            n_c0_edges: c0.len() as u64,
            ..self.report()
        };
        if broken.is_empty() && c0.is_empty() {
            return report;
        }
        let of = |continuity| {
            move |(element, edge): (ElementId, usize)| Discontinuity {
                element: element.0,
                edge: edge as u8,
                continuity,
            }
        };
        let mut list: Vec<Discontinuity> = broken.into_iter().map(of(Continuity::Broken)).collect();
        list.extend(c0.into_iter().map(of(Continuity::C0)));
        list.sort_unstable();
        *mesh = rebuilt(scene, plain.with_discontinuities(list));
        report
    }
}

/// A mesh of the scene's own patches, with discontinuities on its own edges: only a bug makes other ones.
fn rebuilt(scene: &Scene, subdivision: crate::mesh::Subdivision) -> Mesh {
    Mesh::build_with(scene, &subdivision).unwrap_or_else(|fault| panic!("a flagged mesh: {fault}"))
}

/// Edges inside continuity groups that stand for lines, each once: the lowest of its sides.
fn standing_for(lines: &ByPatch, mesh: &Mesh) -> BTreeSet<(ElementId, usize)> {
    let mut flagged = BTreeSet::new();
    for (&p, segments) in lines {
        let normal = mesh.patches[p as usize].normal;
        for e in mesh.patches[p as usize].elements.clone() {
            let corners = mesh.polygon(&mesh.elements[e as usize].corners);
            for segment in segments {
                for k in edges_along(segment, &corners, normal) {
                    let sides = mesh.sides_of_edge(ElementId(e), k);
                    if sides.len() > 1 {
                        flagged.extend(sides.into_iter().min());
                    }
                }
            }
        }
    }
    flagged
}

/// Edges of an element on a line, or the nearest along it where it crosses the element.
fn edges_along(segment: &Segment, corners: &[DVec3], normal: DVec3) -> Vec<usize> {
    let n = corners.len();
    let [start, end] = segment.ends;
    let along = (end - start).normalize_or_zero();
    let distance = |x: DVec3| (x - start).reject_from(along).length();
    let at = |x: DVec3| (x - start).dot(along);
    let crossed = crosses(segment, corners, normal);
    let mut edges = Vec::new();
    let mut nearest: Option<(f64, usize)> = None;
    for k in 0..n {
        let (a, b) = (corners[k], corners[(k + 1) % n]);
        let length = a.distance(b);
        let on_line = distance(a).max(distance(b)) <= ON_LINE_SHARE * length;
        let (from, to) = (at(a).min(at(b)), at(a).max(at(b)));
        let overlap = to.min(start.distance(end)) - from.max(0.0) > 0.25 * length;
        if on_line && overlap {
            edges.push(k);
        } else if crossed && ((b - a) / length).dot(along).abs() > COS_ALONG {
            let far = distance(0.5 * (a + b));
            if nearest.is_none_or(|(best, _)| far < best) {
                nearest = Some((far, k));
            }
        }
    }
    edges.extend(nearest.map(|(_, k)| k));
    edges
}
