//! Where faces continue each other: they share points there, and have their own where they break.
//!
//! ```text
//! drafts --edge table--> pairs across an edge --rule, 40 degrees--> sets of corners --one point a set--> points, faces
//! ```
//! Two faces continue each other across an edge when they run along it in opposite directions, their normals differ by
//! under 40 degrees, and they lie in one plane, or have the file's word for it: one smooth group, or the same shading
//! normals at both ends.

use glam::DVec3;

use super::build::{Draft, Shading};
use super::{NONE, area_vector};
use crate::geom::weld::DisjointSets;

/// cos 40 degrees: as for smooth groups of surfaces.
const COS_SMOOTH: f64 = 0.766_044_443_118_978;

/// Faces whose normals differ by under 0.1 degrees lie in one plane: single precision turns small faces that much.
const COS_FLAT: f64 = 0.999_998_476_9;

/// Shading normals closer than 1 degree are one.
const COS_SAME_NORMAL: f64 = 0.999_847_695;

/// What tells smooth edges from creases.
pub(super) struct Smoothness<'a> {
    pub(super) places: &'a [DVec3],
    pub(super) normals: &'a [DVec3],
    pub(super) rule: Shading,
}

/// Edge `edge` (corner edge to corner edge + 1) of a face, listed under its two places.
#[derive(Clone, Copy)]
pub(super) struct EdgeUse {
    low: u32,
    high: u32,
    pub(super) face: u32,
    pub(super) edge: u32,
}

/// All edges of all faces, those of the same places together.
pub(super) fn edge_table(drafts: &[Draft]) -> Vec<EdgeUse> {
    let mut table = Vec::with_capacity(4 * drafts.len());
    for (f, draft) in drafts.iter().enumerate() {
        let n = draft.n_corners();
        for e in 0..n {
            let (a, b) = (draft.places[e], draft.places[(e + 1) % n]);
            table.push(EdgeUse { low: a.min(b), high: a.max(b), face: f as u32, edge: e as u32 });
        }
    }
    table.sort_unstable_by_key(|u| (u.low, u.high, u.face, u.edge));
    table
}

/// Groups of one edge.
pub(super) fn by_edge(table: &[EdgeUse]) -> impl Iterator<Item = &[EdgeUse]> {
    table.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
}

impl Smoothness<'_> {
    pub(super) fn normal(&self, draft: &Draft) -> DVec3 {
        area_vector(|i| self.places[i as usize], &draft.places).normalize_or_zero()
    }

    /// The cosine between the faces' normals when `b` continues `a` across their common edge.
    pub(super) fn across(&self, drafts: &[Draft], a: EdgeUse, b: EdgeUse) -> Option<f64> {
        let (f, g) = (&drafts[a.face as usize], &drafts[b.face as usize]);
        let (n, m) = (f.n_corners(), g.n_corners());
        let (a0, a1) = (a.edge as usize, (a.edge as usize + 1) % n);
        let (b0, b1) = (b.edge as usize, (b.edge as usize + 1) % m);
        if a.face == b.face || f.places[a0] != g.places[b1] {
            return None;
        }
        let cos = self.normal(f).dot(self.normal(g));
        let told = match self.rule {
            Shading::Flat => false,
            Shading::Group(_) => f.group != 0 && f.group == g.group,
            Shading::Normals => {
                self.same_normal(f.normals[a0], g.normals[b1])
                    && self.same_normal(f.normals[a1], g.normals[b0])
            }
        };
        (cos > COS_FLAT || told && cos > COS_SMOOTH).then_some(cos)
    }

    fn same_normal(&self, a: u32, b: u32) -> bool {
        if a == b {
            return a != NONE;
        }
        let at = |i: u32| self.normals.get(i as usize).copied().unwrap_or_default();
        let (a, b) = (at(a), at(b));
        a.dot(b) >= COS_SAME_NORMAL * (a.length_squared() * b.length_squared()).sqrt()
            && a.length_squared() > 0.0
    }
}

/// Points, and the faces' corners as indices into them.
pub(super) fn split_at_creases(drafts: &[Draft], smoothness: &Smoothness<'_>) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let mut sets = DisjointSets::new(4 * drafts.len());
    let table = edge_table(drafts);
    for group in by_edge(&table) {
        let mut taken = [false; 8];
        for (k, &a) in group.iter().enumerate().take(taken.len()) {
            if taken[k] {
                continue;
            }
            let best = (k + 1..group.len().min(taken.len()))
                .filter(|&j| !taken[j])
                .filter_map(|j| smoothness.across(drafts, a, group[j]).map(|cos| (cos, j)))
                .reduce(|best, next| if next.0 > best.0 { next } else { best });
            let Some((_, j)) = best else { continue };
            taken[j] = true;
            let b = group[j];
            let corner = |u: EdgeUse, step: u32| {
                let n = drafts[u.face as usize].n_corners() as u32;
                4 * u.face + (u.edge + step) % n
            };
            sets.union(corner(a, 0), corner(b, 1));
            sets.union(corner(a, 1), corner(b, 0));
        }
    }
    drop(table);
    let mut number = vec![NONE; 4 * drafts.len()];
    let mut points = Vec::new();
    let mut faces = Vec::with_capacity(drafts.len());
    for (f, draft) in drafts.iter().enumerate() {
        let mut face = [NONE; 4];
        for (k, slot) in face.iter_mut().enumerate().take(draft.n_corners()) {
            let root = sets.find((4 * f + k) as u32) as usize;
            if number[root] == NONE {
                number[root] = points.len() as u32;
                points.push(smoothness.places[draft.places[k] as usize]);
            }
            *slot = number[root];
        }
        faces.push(face);
    }
    points.shrink_to_fit();
    (points, faces)
}
