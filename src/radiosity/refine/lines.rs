//! Discontinuity lines of lights without area: where the shadow of an edge falls, computed, not sampled.
//!
//! ```text
//! light x silhouette edge of the cast patches --projected on the plane of a receiving patch, clipped to it--> segments
//! segment in an element --rays to both sides of it--> a border of light and shadow: split the element, flag an edge
//! ```
//! An edge is a silhouette where only one patch has it, or where of two that share it one faces the light and the other
//! does not. Irradiance steps across such a line: C-1. Elements that one crosses are split to the limit of depth before
//! any other; in the final mesh the edges on a line, or the nearest one of a crossed element that runs along it, are
//! [`Continuity::Broken`].
//!
//! Source: Campbell, Fussell 1990; Heckbert 1992; Lischinski, Tampieri, Greenberg 1992.
//! Not modelled: lines of area lights (their penumbras change over a width, which the other criteria see), borders of
//! spots' cones, elements cut along a line.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Node, gain};
use crate::geom::Ray;
use crate::mesh::{Continuity, Corners, ElementId, Mesh, Place};
use crate::radiosity::lights;
use crate::raycast::{CastError, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster};
use crate::scene::{Light, Scene};

/// Silhouette edges x patches that are looked through at most: minutes beyond.
const MAX_PAIRS: usize = 200_000_000;
/// Places along a segment that are tried for light on one side only.
const N_PROBES: u32 = 5;
/// How far beside a line the tries stand, over the size of the patch.
const PROBE_SHARE: f64 = 2e-3;
/// An edge is on a line when its ends are within this share of its length.
const ON_LINE_SHARE: f64 = 1e-6;
/// Cosine of the largest angle between a line and an edge that stands for it: 45 degrees.
const COS_ALONG: f64 = 0.707;
/// Gain of a split of a crossed element over H^2 x area: more than any that is measured.
const GAIN_PER_STEP: f64 = 1.0;

/// What was found of discontinuity lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LineReport {
    /// Segments on receiving patches with light on one side and shadow on the other.
    pub n_segments: u64,
    /// Element edges of the final mesh that stand for one: continuity C-1.
    pub n_flagged_edges: u64,
    /// There were too many edges and patches to look for lines.
    pub skipped: bool,
}

/// A border of shadow on a patch.
#[derive(Clone, Copy, Debug)]
struct Segment {
    ends: [DVec3; 2],
    /// Luminance of the light's unoccluded irradiance in its middle (W/m^2).
    step: f64,
}

/// The lines of a scene.
pub(super) struct Lines {
    by_patch: BTreeMap<u32, Vec<Segment>>,
    pub(super) n_rays: u64,
    skipped: bool,
}

/// Finds the shadow lines of a scene's lights without area and flags the edges of `mesh` that stand for them.
///
/// # Errors
/// When the caster fails.
pub fn flag_shadow_lines(
    scene: &Scene,
    mesh: &mut Mesh,
    caster: &mut dyn RayCaster,
) -> Result<LineReport, CastError> {
    let lines = find(scene, mesh, caster)?;
    let n_flagged_edges = lines.flag(mesh);
    Ok(LineReport { n_flagged_edges, ..lines.report() })
}

pub(super) fn find(scene: &Scene, mesh: &Mesh, caster: &mut dyn RayCaster) -> Result<Lines, CastError> {
    let mut lines = Lines { by_patch: BTreeMap::new(), n_rays: 0, skipped: false };
    if scene.lights.is_empty() {
        return Ok(lines);
    }
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
    Ok(lines)
}

/// An edge of the cast patches, with the normals of those that have it.
struct CastEdge {
    ends: [DVec3; 2],
    /// A point and the normal of each patch.
    sides: Vec<(DVec3, DVec3)>,
}

impl CastEdge {
    fn is_silhouette(&self, light: &Light) -> bool {
        let faces = |&(point, normal): &(DVec3, DVec3)| match *light {
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                (position - point).dot(normal) > 0.0
            }
            Light::Directional { direction, .. } => -direction.dot(normal) > 0.0,
        };
        let n_facing = self.sides.iter().filter(|side| faces(side)).count();
        self.sides.len() == 1 || (n_facing > 0 && n_facing < self.sides.len())
    }
}

fn cast_edges(mesh: &Mesh) -> Vec<CastEdge> {
    let mut edges: Vec<CastEdge> = Vec::new();
    let mut by_ends: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    for patch in &mesh.patches[..mesh.n_cast_patches] {
        let corners = mesh.polygon(&patch.corners);
        for k in 0..corners.len() {
            let ends = [corners[k], corners[(k + 1) % corners.len()]];
            // Patches share corners bit for bit.
            let mut key = ends.map(|p| (p + DVec3::ZERO).to_array().map(f64::to_bits));
            key.sort_unstable();
            let at = *by_ends.entry(key).or_insert_with(|| {
                edges.push(CastEdge { ends, sides: Vec::new() });
                edges.len() - 1
            });
            edges[at].sides.push((corners[0], patch.normal));
        }
    }
    edges
}

/// Where the shadow of an edge crosses patch `p`: a segment in its plane.
fn shadow_of(light: &Light, edge: [DVec3; 2], mesh: &Mesh, p: u32) -> Option<Segment> {
    let patch = &mesh.patches[p as usize];
    let corners = mesh.polygon(&patch.corners);
    let normal = patch.normal;
    let height = |x: DVec3| (x - corners[0]).dot(normal);
    let size = corners[0].distance(corners[2]).max(corners[0].distance(corners[1]));
    // Only what is over the plane throws a shadow on it.
    let slack = 1e-9 * size;
    let [mut a, mut b] = edge;
    let (ha, hb) = (height(a), height(b));
    if ha.max(hb) <= slack {
        return None;
    }
    let cut = |inside: DVec3, hi: f64, outside: DVec3, ho: f64| inside.lerp(outside, hi / (hi - ho));
    if ha < 0.0 {
        a = cut(b, hb, a, ha);
    }
    if hb < 0.0 {
        b = cut(a, ha, b, hb);
    }
    let (a, b) = match *light {
        Light::Directional { direction, .. } => {
            let down = direction.dot(normal);
            if down >= -1e-9 {
                return None;
            }
            let drop = |x: DVec3| x - direction * (height(x) / down);
            (drop(a), drop(b))
        }
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let hl = height(position);
            if hl <= slack {
                return None;
            }
            // Only what is under the light; a point at its height throws its shadow to infinity.
            let top = hl * (1.0 - 1e-6);
            let (ha, hb) = (height(a), height(b));
            if ha.min(hb) >= top {
                return None;
            }
            let level = |low: DVec3, hlow: f64, x: DVec3, hx: f64| {
                if hx > top { low.lerp(x, (top - hlow) / (hx - hlow)) } else { x }
            };
            let (a, b) = (level(b, hb, a, ha), level(a, ha, b, hb));
            let drop = |x: DVec3| position + (x - position) * (hl / (hl - height(x)));
            (drop(a), drop(b))
        }
    };
    let ends = clipped([a, b], &corners, normal)?;
    if ends[0].distance(ends[1]) <= 1e-6 * size {
        return None;
    }
    let step = lights::irradiance(light, 0.5 * (ends[0] + ends[1]), normal).luminance();
    (step > 0.0).then_some(Segment { ends, step })
}

/// The part of a segment in a convex polygon of its plane.
fn clipped([a, b]: [DVec3; 2], corners: &[DVec3], normal: DVec3) -> Option<[DVec3; 2]> {
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for k in 0..corners.len() {
        let edge = corners[(k + 1) % corners.len()] - corners[k];
        let inward = normal.cross(edge);
        let (da, db) = ((a - corners[k]).dot(inward), (b - corners[k]).dot(inward));
        if da < 0.0 && db < 0.0 {
            return None;
        }
        if da < 0.0 {
            low = low.max(da / (da - db));
        } else if db < 0.0 {
            high = high.min(da / (da - db));
        }
    }
    (low < high).then(|| [a.lerp(b, low), a.lerp(b, high)])
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
        let mut targets = Vec::with_capacity(found.len() * 2 * N_PROBES as usize);
        for (p, Segment { ends: [a, b], .. }) in &found {
            let patch = &mesh.patches[*p as usize];
            let beside = patch.normal.cross(*b - *a).normalize_or_zero()
                * (PROBE_SHARE * patch.area_m2.sqrt()).max(4.0 * offset_m);
            for k in 0..N_PROBES {
                let at = a.lerp(*b, (f64::from(k) + 0.5) / f64::from(N_PROBES)) + offset_m * patch.normal;
                targets.extend([at + beside, at - beside]);
            }
        }
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
            let border = |k: usize| tries[2 * k] != tries[2 * k + 1];
            let n = N_PROBES as usize;
            // From the first to the last place that is a border.
            let (Some(first), Some(last)) = ((0..n).find(|k| border(*k)), (0..n).rfind(|k| border(*k)))
            else {
                continue;
            };
            let [a, b] = segment.ends;
            let share = |k: usize| k as f64 / n as f64;
            let ends = [a.lerp(b, share(first)), a.lerp(b, share(last + 1))];
            self.by_patch.entry(p).or_default().push(Segment { ends, ..segment });
        }
        Ok(())
    }

    pub(super) fn report(&self) -> LineReport {
        let n_segments = self.by_patch.values().map(|s| s.len() as u64).sum();
        LineReport { n_segments, n_flagged_edges: 0, skipped: self.skipped }
    }

    /// What a split of a node is worth for the lines that cross it (m^2).
    pub(super) fn gain(&self, scene: &Scene, mesh: &Mesh, surfaces: &[f64], patch: u32, place: Place) -> f64 {
        let Some(segments) = self.by_patch.get(&patch) else { return 0.0 };
        let surface = mesh.patches[patch as usize].surface.0 as usize;
        let mean = surfaces[surface];
        debug_assert!(surface < scene.surfaces.len());
        if mean <= 0.0 {
            return 0.0;
        }
        let node: Node = (patch, place);
        let normal = mesh.patches[patch as usize].normal;
        let mut largest = 0.0_f64;
        let mut area_m2 = 0.0;
        for element in gain::ids_of(mesh, node.0, node.1) {
            let element = &mesh.elements[element.0 as usize];
            area_m2 += element.area_m2;
            let corners = mesh.polygon(&element.corners);
            for segment in segments {
                // Along an edge is not across.
                if crosses(segment, &corners, normal) {
                    largest = largest.max(segment.step);
                }
            }
        }
        GAIN_PER_STEP * (largest / mean).powi(2) * area_m2
    }

    /// Flags the edges that stand for lines; how many.
    pub(super) fn flag(&self, mesh: &mut Mesh) -> u64 {
        let mut flagged: BTreeSet<(ElementId, usize)> = BTreeSet::new();
        for (&p, segments) in &self.by_patch {
            let normal = mesh.patches[p as usize].normal;
            for e in mesh.patches[p as usize].elements.clone() {
                let corners = mesh.polygon(&mesh.elements[e as usize].corners);
                let n = corners.len();
                for segment in segments {
                    let along = (segment.ends[1] - segment.ends[0]).normalize_or_zero();
                    let distance = |x: DVec3| (x - segment.ends[0]).reject_from(along).length();
                    let crossed = crosses(segment, &corners, normal);
                    let mut nearest: Option<(f64, usize)> = None;
                    for k in 0..n {
                        let (a, b) = (corners[k], corners[(k + 1) % n]);
                        let length = a.distance(b);
                        let on_line = distance(a).max(distance(b)) <= ON_LINE_SHARE * length;
                        let at = |x: DVec3| (x - segment.ends[0]).dot(along);
                        let (from, to) = (at(a).min(at(b)), at(a).max(at(b)));
                        let overlap =
                            to.min(segment.ends[0].distance(segment.ends[1])) - from.max(0.0) > 0.25 * length;
                        if on_line && overlap {
                            flagged.insert((ElementId(e), k));
                        } else if crossed && ((b - a) / length).dot(along).abs() > COS_ALONG {
                            let far = distance(0.5 * (a + b));
                            if nearest.is_none_or(|(best, _)| far < best) {
                                nearest = Some((far, k));
                            }
                        }
                    }
                    if let Some((_, k)) = nearest {
                        flagged.insert((ElementId(e), k));
                    }
                }
            }
        }
        let n = flagged.len() as u64;
        for (element, edge) in flagged {
            mesh.set_continuity(element, edge, Continuity::Broken);
        }
        n
    }
}

/// A segment runs through the inside of a convex polygon.
fn crosses(segment: &Segment, corners: &[DVec3], normal: DVec3) -> bool {
    let size = corners[0].distance(corners[2 % corners.len()]);
    let Some([a, b]) = clipped(segment.ends, corners, normal) else { return false };
    let middle = 0.5 * (a + b);
    let inside = |k: usize| {
        let edge = corners[(k + 1) % corners.len()] - corners[k];
        (middle - corners[k]).dot(normal.cross(edge).normalize_or_zero()) > ON_LINE_SHARE * size
    };
    a.distance(b) > 1e-3 * size && (0..corners.len()).all(inside)
}

impl Mesh {
    /// Sets the continuity over an edge, as all elements along it see it.
    fn set_continuity(&mut self, element: ElementId, edge: usize, continuity: Continuity) {
        let across: Vec<ElementId> = self.neighbours_across(element, edge).collect();
        self.elements[element.0 as usize].continuity[edge] = continuity;
        for other in across {
            let n = match self.elements[other.0 as usize].corners {
                Corners::Triangle(_) => 3,
                Corners::Quad(_) => 4,
            };
            let back = (0..n).find(|&k| self.neighbours_across(other, k).any(|e| e == element));
            // From a half of a coarse edge only this half is known to break, but the coarse side has one flag.
            if let Some(back) = back {
                self.elements[other.0 as usize].continuity[back] = continuity;
            }
        }
    }
}
