//! Silhouettes of the cast patches, and what a point's rays through them draw on a receiving patch.
//!
//! ```text
//! patches --ends bit for bit--> edges with the patches on them --seen from a light--> silhouette edges
//! light, edge, receiving patch --central or parallel projection, clipped--> segment in the patch's plane
//! ```
//! An edge is a silhouette where only one patch has it, or where of two that share it one faces the light and the other
//! does not.

use std::collections::HashMap;

use crate::geom::DVec3;
use crate::mesh::Mesh;
use crate::radiosity::lights;
use crate::scene::Light;

/// An edge is on a line when its ends are within this share of its length.
pub(super) const ON_LINE_SHARE: f64 = 1e-6;

/// A line on a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    pub(super) ends: [DVec3; 2],
    /// Luminance of the light's unoccluded irradiance in its middle (W/m^2).
    pub(super) step: f64,
}

/// A receiving patch: its corners, counter-clockwise about its normal.
pub(super) struct Facet {
    corners: Vec<DVec3>,
    normal: DVec3,
    /// Its longer side (m).
    pub(super) size_m: f64,
}

impl Facet {
    pub(super) fn of(mesh: &Mesh, patch: u32) -> Facet {
        let patch = &mesh.patches[patch as usize];
        let corners = mesh.polygon(&patch.corners);
        let size_m = corners[0].distance(corners[2]).max(corners[0].distance(corners[1]));
        Facet { corners, normal: patch.normal, size_m }
    }

    /// How high a point is over its plane (m).
    pub(super) fn height(&self, x: DVec3) -> f64 {
        (x - self.corners[0]).dot(self.normal)
    }

    /// The part of a segment of its plane that lies in it, where that is more than a point.
    pub(super) fn clip(&self, ends: [DVec3; 2]) -> Option<[DVec3; 2]> {
        clipped(ends, &self.corners, self.normal).filter(|[a, b]| a.distance(*b) > 1e-6 * self.size_m)
    }
}

/// An edge of the cast patches, with the normals of those that have it.
pub(super) struct CastEdge {
    pub(super) ends: [DVec3; 2],
    /// A point and the normal of each patch.
    sides: Vec<(DVec3, DVec3)>,
}

impl CastEdge {
    pub(super) fn is_silhouette(&self, light: &Light) -> bool {
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

pub(super) fn cast_edges(mesh: &Mesh) -> Vec<CastEdge> {
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

/// Where the shadow of an edge crosses a patch: a segment in its plane.
pub(super) fn shadow_of(light: &Light, edge: [DVec3; 2], facet: &Facet) -> Option<Segment> {
    let height = |x: DVec3| facet.height(x);
    let (normal, size) = (facet.normal, facet.size_m);
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
    let ends = facet.clip([a, b])?;
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

/// A segment runs through the inside of a convex polygon.
pub(super) fn crosses(segment: &Segment, corners: &[DVec3], normal: DVec3) -> bool {
    let size = corners[0].distance(corners[2 % corners.len()]);
    let Some([a, b]) = clipped(segment.ends, corners, normal) else { return false };
    let middle = 0.5 * (a + b);
    let inside = |k: usize| {
        let edge = corners[(k + 1) % corners.len()] - corners[k];
        (middle - corners[k]).dot(normal.cross(edge).normalize_or_zero()) > ON_LINE_SHARE * size
    };
    a.distance(b) > 1e-3 * size && (0..corners.len()).all(inside)
}
