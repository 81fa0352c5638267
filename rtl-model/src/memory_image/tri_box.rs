//! Does a triangle touch a closed cube? Exact, in integers.
//!
//! ```text
//! triangle, cube [p, p + h]^3 -> 13 separating axes: 3 of the cube, the triangle's normal, 9 edge x axis -> touches
//! ```
//! Two convex polytopes are disjoint exactly when one of these axes separates them strictly. Source: Akenine-Moeller
//! 2001, without its division by half sizes. A degenerate triangle (a segment, a point) is tested right as well: the
//! axes that vanish separate nothing, and those of a segment are among the rest.

/// A triangle with the projections that do not depend on the cube.
#[derive(Clone, Debug)]
pub(super) struct TriangleAxes {
    /// Closed bounding box.
    pub(super) low: [i64; 3],
    /// Its other corner.
    pub(super) high: [i64; 3],
    /// (v1 - v0) x (v2 - v0), under 2^(2F+2).
    normal: [i64; 3],
    /// normal . v0, under 2^(3F+4).
    offset: i128,
    /// Edge x axis projections.
    edges: [EdgeAxis; 9],
}

/// An axis e x unit(k): it has two components, at k + 1 and k + 2.
#[derive(Clone, Copy, Debug, Default)]
struct EdgeAxis {
    places: [usize; 2],
    words: [i64; 2],
    low: i64,
    high: i64,
}

impl TriangleAxes {
    /// Prepares a triangle of coordinate words.
    pub(super) fn new(corners: [[i32; 3]; 3]) -> TriangleAxes {
        let v = corners.map(|corner| corner.map(i64::from));
        let edge = |i: usize, j: usize| [0, 1, 2].map(|k| v[j][k] - v[i][k]);
        let (p, q) = (edge(0, 1), edge(0, 2));
        let normal = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let mut edges = [EdgeAxis::default(); 9];
        for (slot, axis) in edges.iter_mut().enumerate() {
            let (direction, k) = ([p, q, edge(1, 2)][slot / 3], slot % 3);
            let places = [(k + 1) % 3, (k + 2) % 3];
            // e x unit(k) = e[k+2] unit(k+1) - e[k+1] unit(k+2)
            let words = [direction[places[1]], -direction[places[0]]];
            let at = v.map(|corner| words[0] * corner[places[0]] + words[1] * corner[places[1]]);
            *axis = EdgeAxis {
                places,
                words,
                low: at[0].min(at[1]).min(at[2]),
                high: at[0].max(at[1]).max(at[2]),
            };
        }
        TriangleAxes {
            low: [0, 1, 2].map(|k| v[0][k].min(v[1][k]).min(v[2][k])),
            high: [0, 1, 2].map(|k| v[0][k].max(v[1][k]).max(v[2][k])),
            normal,
            offset: (0..3).map(|k| i128::from(normal[k]) * i128::from(v[0][k])).sum(),
            edges,
        }
    }

    /// True when the triangle and the closed cube [corner, corner + side]^3 have a point in common.
    pub(super) fn touches(&self, corner: [i64; 3], side: i64) -> bool {
        if (0..3).any(|k| self.high[k] < corner[k] || self.low[k] > corner[k] + side) {
            return false;
        }
        let (mut at, mut below, mut above) = (0_i128, 0_i128, 0_i128);
        for (word, low) in self.normal.into_iter().zip(corner) {
            let reach = i128::from(word) * i128::from(side);
            at += i128::from(word) * i128::from(low);
            below += reach.min(0);
            above += reach.max(0);
        }
        if self.offset < at + below || self.offset > at + above {
            return false;
        }
        self.edges.iter().all(|axis| {
            let at = axis.words[0] * corner[axis.places[0]] + axis.words[1] * corner[axis.places[1]];
            let reach = axis.words.map(|word| word * side);
            let below = reach[0].min(0) + reach[1].min(0);
            let above = reach[0].max(0) + reach[1].max(0);
            axis.high >= at + below && axis.low <= at + above
        })
    }
}

#[cfg(test)]
#[path = "tri_box_tests.rs"]
mod tests;
