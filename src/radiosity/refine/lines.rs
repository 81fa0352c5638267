//! Discontinuity lines: where light stops or starts to be hidden, computed, not sampled.
//!
//! ```text
//! light x silhouette edge of the cast patches --projected on the plane of a receiving patch, clipped to it--> segments
//! segment --rays to both sides of it--> a border of light and shadow --> C-1        area lights: penumbra.rs --> C0
//! segments x pairs of neighbours in the final mesh --between their centroids--> discontinuities of the mesh
//! ```
//! Irradiance of a light without area steps across such a line: C-1. Elements that one crosses are split to the limit of
//! depth before any other. In the final mesh the edges between elements whose centroids it parts are flagged.
//!
//! Source: Campbell, Fussell 1990; Heckbert 1992; Lischinski, Tampieri, Greenberg 1992.
//! Not modelled: borders of spots' cones, elements cut along a line.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::silhouette::{Facet, ON_LINE_SHARE, Segment, cast_edges, crosses, shadow_of};
use super::{Node, penumbra};
use crate::mesh::{Continuity, Discontinuity, ElementId, Mesh, PatchId};
use crate::radiosity::lights;
use crate::raycast::{CastError, RayCaster};
use crate::scene::{Light, Scene};

/// Silhouette edges x patches that are looked through at most: minutes beyond.
pub(super) const MAX_PAIRS: usize = 200_000_000;
/// Places along a segment that are tried for light on one side only.
const N_PROBES: u32 = 5;
/// How far beside a line the tries stand, over the size of the patch.
const PROBE_SHARE: f64 = 2e-3;
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
                let facet = Facet::of(mesh, p);
                let on_patch = |edge: &[DVec3; 2]| shadow_of(light, *edge, &facet).map(|s| (p, s));
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
        let blocked = lights::blocked(light, &targets, caster)?;
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
        let report =
            LineReport { n_flagged_edges: broken.len() as u64, n_c0_edges: c0.len() as u64, ..self.report() };
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

/// Edges inside continuity groups that stand for lines, each once: the lowest of its sides. The lines are drawn between the
/// elements: an edge stands for one that runs between the centroids of the elements on its sides, so edges of a line that
/// runs on hang together, whatever its direction, and most of an element is on the side that it is taken to.
fn standing_for(lines: &ByPatch, mesh: &Mesh) -> BTreeSet<(ElementId, usize)> {
    let mut flagged = BTreeSet::new();
    for &p in lines.keys() {
        for e in mesh.patches[p as usize].elements.clone().map(ElementId) {
            let here = mesh.centroid(e);
            for k in 0..mesh.elements[e.0 as usize].corners.vertices().len() {
                for other in mesh.neighbours_across(e, k) {
                    let there = mesh.centroid(other);
                    let beyond = mesh.elements[other.0 as usize].patch.0;
                    let own = [Some(p), (beyond != p).then_some(beyond)];
                    let between = own.into_iter().flatten().any(|p| {
                        let normal = mesh.patches[p as usize].normal;
                        lines.get(&p).into_iter().flatten().any(|s| parts(s, normal, here, there))
                    });
                    if between {
                        flagged.extend(mesh.sides_of_edge(e, k).into_iter().min());
                    }
                }
            }
        }
    }
    flagged
}

/// A segment of a plane with this normal runs between two points. One that is on it counts to its right.
fn parts(segment: &Segment, normal: DVec3, a: DVec3, b: DVec3) -> bool {
    let [start, end] = segment.ends;
    let length = start.distance(end);
    let along = (end - start) / length;
    let left = normal.cross(along);
    let apart = ON_LINE_SHARE * a.distance(b);
    let (da, db) = ((a - start).dot(left), (b - start).dot(left));
    if (da > apart) == (db > apart) {
        return false;
    }
    let at = (a.lerp(b, da / (da - db)) - start).dot(along);
    // Pieces of a line on neighbouring patches meet end to end.
    at >= -apart && at <= length + apart
}
