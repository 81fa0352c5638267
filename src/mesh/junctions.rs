//! T-junctions: border edges of the cast geometry with another border's vertex on them.
//!
//! ```text
//! edges that only one cast patch has --hash of their ends--> how many have a foreign end strictly inside
//! ```
//! Not modelled: edges that merely lie on another edge without a vertex in it, or that float above one.

use std::collections::HashMap;

use crate::geom::DVec3;

/// An edge of one cast patch that no other cast patch has.
pub(super) struct BorderEdge {
    /// Welded ids of its ends, the smaller first.
    pub(super) ids: [u32; 2],
    /// Its ends in winding order (m).
    pub(super) ends: [DVec3; 2],
    /// The first end has the smaller id.
    pub(super) low_first: bool,
}

/// Edges with an end of another border edge on them, farther than `tolerance_m` from their own ends.
pub(super) fn count_t_junctions(border: &[BorderEdge], tolerance_m: f64) -> usize {
    if border.is_empty() {
        return 0;
    }
    let total: f64 = border.iter().map(|e| e.ends[0].distance(e.ends[1])).sum();
    let cell_m = (total / border.len() as f64).max(64.0 * tolerance_m);
    let cell = |p: DVec3| (p / cell_m).to_array().map(|c| c.floor() as i64);
    let mut ends: HashMap<[i64; 3], Vec<(u32, DVec3)>> = HashMap::new();
    let mut seen = std::collections::HashSet::new();
    for edge in border {
        let (first, second) = if edge.low_first { (0, 1) } else { (1, 0) };
        for (id, end) in [(edge.ids[first], edge.ends[0]), (edge.ids[second], edge.ends[1])] {
            if seen.insert(id) {
                ends.entry(cell(end)).or_default().push((id, end));
            }
        }
    }
    let hangs = |edge: &&BorderEdge| {
        let [a, b] = edge.ends;
        let length = a.distance(b);
        let along = (b - a) / length.max(f64::MIN_POSITIVE);
        let on = |p: DVec3| {
            let t = (p - a).dot(along);
            t > tolerance_m && t < length - tolerance_m && (p - a - t * along).length() <= tolerance_m
        };
        // Stations half a cell apart see every cell within reach of the edge.
        let n_stations = (2.0 * length / cell_m).ceil() as u64;
        (0..=n_stations).any(|k| {
            let [x, y, z] = cell(a + along * (0.5 * cell_m * k as f64).min(length));
            (0..27).any(|i| {
                let near = [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1];
                ends.get(&near).is_some_and(|list| list.iter().any(|&(_, p)| on(p)))
            })
        })
    };
    border.iter().filter(hangs).count()
}
