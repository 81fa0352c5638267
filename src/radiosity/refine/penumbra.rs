//! Borders of the penumbras of area lights: where an emitter begins to be hidden, and where it is hidden whole.
//!
//! ```text
//! emitter's corner x silhouette edge    --plane through both (VE)--> segment on a receiving patch
//! emitter's edge x corner of silhouettes --plane through both (EV)--> segment on a receiving patch
//! segment --rays from both sides to the corners, and (EV) to where the plane meets the emitter's edge-->
//!      all are seen on one side, not on the other | none is seen on one side, some on the other --> kept
//! ```
//! Irradiance continues across such a line, its gradient may break: C0. Events inside a penumbra, where the visible part
//! changes its number of corners, change the second derivative only and are left out.
//!
//! Source: Nishita, Nakamae 1983; Heckbert 1992; Lischinski, Tampieri, Greenberg 1992.
//! Not modelled: curved and imported emitters, events of three edges (EEE: curved lines), all but the strongest emitters.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::lines::{ByPatch, MAX_PAIRS, beside, bordered};
use super::silhouette::{CastEdge, Facet, Segment, shadow_of};
use super::visibility::light_at;
use crate::geom::Ray;
use crate::mesh::Mesh;
use crate::radiosity::lights;
use crate::raycast::{CastError, Purpose, Query, RayCaster};
use crate::scene::{Light, Scene, Shape};

/// Emitters that are looked at, strongest first.
const MAX_EMITTERS: usize = 4;
/// Segments of one emitter that are looked at: some ten seconds of rays.
const MAX_SEGMENTS: usize = 200_000;
/// Places along a segment that are tried.
const N_PROBES: u32 = 4;
/// How far inside the emitter's corners rays end, over its size: less than what the tries' distance from a line hides.
const INSET_SHARE: f64 = 1e-4;

/// What was found.
pub(super) struct Found {
    pub(super) by_patch: ByPatch,
    pub(super) n_rays: u64,
    pub(super) n_emitters_skipped: u64,
}

/// A planar emitter.
struct Emitter {
    corners: Vec<DVec3>,
    normal: DVec3,
    two_sided: bool,
    size_m: f64,
}

/// A line that may be a border.
struct Event {
    patch: u32,
    segment: Segment,
    /// Of an EV event.
    turn: Option<Turn>,
}

/// An edge of the emitter, and the corner of silhouettes past which it shines.
#[derive(Clone, Copy)]
struct Turn {
    edge: [DVec3; 2],
    corner: DVec3,
}

pub(super) fn find(
    scene: &Scene,
    mesh: &Mesh,
    edges: &[CastEdge],
    caster: &mut dyn RayCaster,
) -> Result<Found, CastError> {
    let mut found = Found { by_patch: ByPatch::new(), n_rays: 0, n_emitters_skipped: 0 };
    for emitter in strongest(scene, &mut found.n_emitters_skipped) {
        let events = match emitter.events(mesh, edges) {
            Some(events) if events.len() <= MAX_SEGMENTS => events,
            _ => {
                found.n_emitters_skipped += 1;
                continue;
            }
        };
        emitter.keep_borders(mesh, events, &mut found, caster)?;
    }
    Ok(found)
}

/// The strongest planar emitters by power; how many others there are is added to `n_skipped`.
fn strongest(scene: &Scene, n_skipped: &mut u64) -> Vec<Emitter> {
    let mut emitters: Vec<(f64, Option<Emitter>)> = Vec::new();
    for surface in scene.surfaces.iter().filter(|s| s.exitance.luminance() > 0.0) {
        let corners = match &surface.shape {
            Shape::Quad(v) => v.to_vec(),
            Shape::Triangle(v) => v.to_vec(),
            _ => Vec::new(),
        };
        let power = surface.exitance.luminance() * surface.shape.area_m2();
        let emitter = (!corners.is_empty()).then(|| Emitter {
            normal: (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero(),
            size_m: corners[0].distance(corners[2]),
            two_sided: surface.two_sided,
            corners,
        });
        emitters.push((power, emitter));
    }
    emitters.sort_by(|a, b| b.0.total_cmp(&a.0));
    let n = emitters.len();
    let kept: Vec<Emitter> =
        emitters.into_iter().filter_map(|(_, emitter)| emitter).take(MAX_EMITTERS).collect();
    *n_skipped += (n - kept.len()) as u64;
    kept
}

impl Emitter {
    /// All segments that may be borders; `None` where there are too many edges and patches.
    fn events(&self, mesh: &Mesh, edges: &[CastEdge]) -> Option<Vec<Event>> {
        let lights: Vec<Light> = self.corners.iter().map(|&corner| light_at(corner)).collect();
        let silhouettes: Vec<&CastEdge> =
            edges.iter().filter(|edge| lights.iter().any(|light| edge.is_silhouette(light))).collect();
        let corners = corners_of(&silhouettes);
        let per_patch = lights.len() * (silhouettes.len() + corners.len());
        if per_patch.saturating_mul(mesh.patches.len()) > MAX_PAIRS {
            return None;
        }
        let of_patch = |p: u32| {
            let facet = Facet::of(mesh, p);
            let mut events = Vec::new();
            for light in &lights {
                let seen = silhouettes.iter().filter(|edge| edge.is_silhouette(light));
                events.extend(
                    seen.filter_map(|edge| shadow_of(light, edge.ends, &facet)).map(|segment| Event {
                        patch: p,
                        segment,
                        turn: None,
                    }),
                );
            }
            for (k, &a) in self.corners.iter().enumerate() {
                let b = self.corners[(k + 1) % self.corners.len()];
                let turns = corners.iter().map(|&corner| Turn { edge: [a, b], corner });
                events.extend(turns.filter_map(|turn| {
                    let segment = turn.shadow_on(&facet)?;
                    Some(Event { patch: p, segment, turn: Some(turn) })
                }));
            }
            events
        };
        Some((0..mesh.patches.len() as u32).into_par_iter().flat_map_iter(of_patch).collect())
    }

    /// Keeps the segments that are borders of a penumbra, somewhere along them.
    fn keep_borders(
        &self,
        mesh: &Mesh,
        events: Vec<Event>,
        found: &mut Found,
        caster: &mut dyn RayCaster,
    ) -> Result<(), CastError> {
        if events.is_empty() {
            return Ok(());
        }
        let offset_m = caster.surface_offset_m();
        let places: Vec<DVec3> =
            events.iter().flat_map(|e| beside(mesh, e.patch, e.segment.ends, N_PROBES, offset_m)).collect();
        let centre = self.corners.iter().sum::<DVec3>() / self.corners.len() as f64;
        let inset = INSET_SHARE * self.size_m;
        let aim = |point: DVec3, side: f64| {
            point + inset * (centre - point).normalize_or_zero() + side * offset_m * self.normal
        };
        // In front of the emitter, or behind one that has two sides; elsewhere it is dark.
        let sides: Vec<f64> = places
            .iter()
            .map(|x| match (x - centre).dot(self.normal) {
                h if h > offset_m => 1.0,
                h if h < -offset_m && self.two_sided => -1.0,
                _ => 0.0,
            })
            .collect();
        let mut seen = vec![0_u32; places.len()];
        let n_corners = self.corners.len();
        for (c, &corner) in self.corners.iter().enumerate() {
            for side in [1.0, -1.0] {
                let looking: Vec<usize> = (0..places.len()).filter(|&i| sides[i] == side).collect();
                let targets: Vec<DVec3> = looking.iter().map(|&i| places[i]).collect();
                let blocked = lights::blocked(&light_at(aim(corner, side)), &targets, caster)?;
                found.n_rays += looking.len() as u64;
                looking.iter().zip(blocked).for_each(|(&i, blocked)| seen[i] |= u32::from(!blocked) << c);
            }
        }
        // Where the plane through the silhouettes' corner meets the emitter's edge; VE events see their corner already.
        let per_event = 2 * N_PROBES as usize;
        let mut looking = Vec::new();
        let mut rays = Vec::new();
        for (i, &place) in places.iter().enumerate() {
            let event = &events[i / per_event];
            let Some(turn) = event.turn else {
                seen[i] |= 1 << n_corners;
                continue;
            };
            if sides[i] != 0.0 {
                let share = (f64::from((i % per_event / 2) as u32) + 0.5) / f64::from(N_PROBES);
                let [a, b] = event.segment.ends;
                let target = aim(turn.seen_from(a.lerp(b, share)), sides[i]);
                rays.push(Ray { t_max: 1.0, ..Ray::unbounded(place, target - place) });
                looking.push(i);
            }
        }
        if !rays.is_empty() {
            let blocked = caster.any_hits(Purpose::FormFactor, Query::Rays(&rays))?;
            found.n_rays += rays.len() as u64;
            looking.iter().zip(blocked).for_each(|(&i, blocked)| seen[i] |= u32::from(!blocked) << n_corners);
        }
        let all = (1_u32 << (n_corners + 1)) - 1;
        for (event, seen) in events.iter().zip(seen.chunks(per_event)) {
            // Of a VE event the last bit is always set.
            let none = if event.turn.is_some() { 0 } else { 1 << n_corners };
            let border = |k: usize| {
                let (left, right) = (seen[2 * k], seen[2 * k + 1]);
                (left == all) != (right == all) || (left == none) != (right == none)
            };
            if let Some(kept) = bordered(event.segment, N_PROBES, border) {
                found.by_patch.entry(event.patch).or_default().push(kept);
            }
        }
        Ok(())
    }
}

impl Turn {
    /// Where the plane through both meets a patch.
    fn shadow_on(&self, facet: &Facet) -> Option<Segment> {
        let (low, above) = (facet.height(self.corner), self.edge.map(|end| facet.height(end)));
        // The corner over the patch, the whole edge over the corner.
        if low <= 1e-9 * facet.size_m || above.iter().any(|h| low >= h * (1.0 - 1e-6)) {
            return None;
        }
        let drop = |k: usize| self.edge[k] + (self.corner - self.edge[k]) * (above[k] / (above[k] - low));
        Some(Segment { ends: facet.clip([drop(0), drop(1)])?, step: 0.0 })
    }

    /// Where on the edge lies what a place on its shadow sees past the corner.
    fn seen_from(&self, place: DVec3) -> DVec3 {
        let [a, b] = self.edge;
        let (along, past) = (b - a, self.corner - place);
        // Both lines are in one plane: where they meet.
        let out = along.cross(past);
        let share = (place - a).cross(past).dot(out) / out.length_squared();
        if share.is_finite() { a.lerp(b, share.clamp(0.0, 1.0)) } else { a }
    }
}

/// Ends of silhouette edges at which the silhouette turns or ends: where two go straight on, nothing happens.
fn corners_of(silhouettes: &[&CastEdge]) -> Vec<DVec3> {
    let mut at: HashMap<[u64; 3], Vec<DVec3>> = HashMap::new();
    let mut order = Vec::new();
    for edge in silhouettes {
        let [a, b] = edge.ends;
        for (end, other) in [(a, b), (b, a)] {
            let away = at.entry((end + DVec3::ZERO).to_array().map(f64::to_bits)).or_default();
            if away.is_empty() {
                order.push(end);
            }
            away.push((other - end).normalize_or_zero());
        }
    }
    let turns = |end: &DVec3| match at[&(*end + DVec3::ZERO).to_array().map(f64::to_bits)][..] {
        [a, b] => a.dot(b) > -1.0 + 1e-9,
        _ => true,
    };
    order.into_iter().filter(turns).collect()
}
