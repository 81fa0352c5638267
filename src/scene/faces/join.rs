//! Pairs of triangles that form a planar parallelogram become one quad: a lamp stays one rectangle, a wall one grid.
//!
//! ```text
//! common edge p q, far corners r, s:  r + s = p + q, one plane, no crease --most rectangular first--> quad
//! ```
//! Light of a rectangle cut into two triangles is sampled worse, and twice as many faces cost twice as much.

use glam::DVec3;

use super::build::Draft;
use super::smooth::{EdgeUse, Smoothness, by_edge, edge_table};
use super::{FaceCounts, NONE, polygon};

/// How far r + s may be from p + q, over the common edge's length.
const SKEW: f64 = 1e-6;
/// Likewise over the largest coordinate: single precision.
const SINGLE_PRECISION: f64 = 4.8e-7;

/// Joins what can be joined; each triangle goes into one quad at most.
pub(super) fn parallelograms(drafts: &mut Vec<Draft>, smoothness: &Smoothness<'_>, counts: &mut FaceCounts) {
    let mut pairs = candidates(drafts, smoothness);
    // Of a strip's triangles the pairs across the diagonal come first. The order of equals is the file's.
    pairs.sort_by(|a, b| a.lack.total_cmp(&b.lack));
    let mut gone = vec![false; drafts.len()];
    let mut joined = vec![false; drafts.len()];
    for pair in pairs {
        let (f, g) = (pair.a.face as usize, pair.b.face as usize);
        if gone[f] || gone[g] || joined[f] || joined[g] {
            continue;
        }
        let (keep, other) = if f < g { (pair.a, pair.b) } else { (pair.b, pair.a) };
        drafts[keep.face as usize] =
            quad(&drafts[keep.face as usize], keep, &drafts[other.face as usize], other);
        joined[keep.face as usize] = true;
        gone[other.face as usize] = true;
        counts.n_joined += 1;
    }
    let mut index = 0;
    drafts.retain(|_| {
        index += 1;
        !gone[index - 1]
    });
}

struct Pair {
    a: EdgeUse,
    b: EdgeUse,
    /// 0 for a rectangle: |cosine| of the angle between its sides, in steps that rounding does not cross.
    lack: f64,
}

fn candidates(drafts: &[Draft], smoothness: &Smoothness<'_>) -> Vec<Pair> {
    let table = edge_table(drafts);
    let mut pairs = Vec::new();
    for group in by_edge(&table) {
        let &[a, b] = group else { continue };
        let (f, g) = (&drafts[a.face as usize], &drafts[b.face as usize]);
        if f.n_corners() != 3 || g.n_corners() != 3 {
            continue;
        }
        let places = quad(f, a, g, b).places;
        let v: [DVec3; 4] = places.map(|i| smoothness.places[i as usize]);
        let reach = v.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let size = v[0].distance(v[2]).max(v[1].distance(v[3]));
        let limit = (SKEW * size).max((SINGLE_PRECISION * reach).min(1e-3 * size));
        if (v[0] + v[2] - v[1] - v[3]).length() > limit || !polygon::is_planar_convex(v) {
            continue;
        }
        if smoothness.across(drafts, a, b).is_none() || f.group != g.group {
            continue;
        }
        let (u, w) = ((v[1] - v[0]).normalize_or_zero(), (v[3] - v[0]).normalize_or_zero());
        let lack = (u.dot(w).abs() * 1e4).round();
        pairs.push(Pair { a, b, lack });
    }
    pairs
}

/// The quad of two triangles: the far corner of `f`, the edge's first end, the far corner of `g`, its other end.
fn quad(f: &Draft, a: EdgeUse, g: &Draft, b: EdgeUse) -> Draft {
    let (ea, eb) = (a.edge as usize, b.edge as usize);
    let of = |f_values: &[u32; 4], g_values: &[u32; 4]| {
        [f_values[(ea + 2) % 3], f_values[ea], g_values[(eb + 2) % 3], f_values[(ea + 1) % 3]]
    };
    let normals = of(&f.normals, &g.normals);
    debug_assert!(f.places[3] == NONE && g.places[3] == NONE);
    Draft { places: of(&f.places, &g.places), normals, group: f.group }
}
