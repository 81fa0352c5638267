//! The cubic Clough-Tocher triangle: three cubics that meet in the centroid.
//!
//! ```text
//!            2          Bezier ordinates of the cubic on edge 0-1 (C the centroid):
//!           /|\           corners          f0, f1
//!          / | \          along the edge   f + g . (edge) / 3
//!         /  C  \         towards C        f + g . (C - corner) / 3, the mean of f and those along two edges
//!        / /   \ \        middle           so that the slope across the edge is linear along it
//!       0---------1     those next to C and C itself: means, which make the three cubics C1
//! ```
//! 12 degrees of freedom: 3 values, 6 gradient components, 3 slopes across the middles of the edges, here the mean
//! of the slopes at the edge's ends. With exact gradients it reproduces quadratics (not cubics: their slope across
//! an edge is not linear). C1 between coplanar triangles, since both sides see one slope across the edge; over a C0 edge
//! each side has its own, as in Salesin, Lischinski, DeRose.
//!
//! Source: Clough, Tocher 1965; Bezier form as in Alfeld 1984, "A trivariate Clough-Tocher scheme"; Salesin, Lischinski,
//! DeRose 1992, "Reconstructing illumination functions with selected discontinuities".

use super::derivatives::Node;
use super::pieces::{TriangleOrdinates, TriangleSurface};
use crate::units::Rgb;

/// The method's surface over triangles.
#[derive(Debug)]
pub(super) struct CloughTocher;

/// Place of the ordinate at corner `a` along the edge to `b` among the twelve.
pub(super) fn along(a: usize, b: usize) -> usize {
    3 + 2 * if (a + 1) % 3 == b { a } else { b } + usize::from((b + 1) % 3 == a)
}

/// Place of the ordinate of the edge between `a` and `b`.
pub(super) fn middle(a: usize, b: usize) -> usize {
    9 + if (a + 1) % 3 == b { a } else { b }
}

impl CloughTocher {
    /// The ten ordinates of the cubic at these weights, in the order of powers below, the weights in its own triangle and
    /// its corners (i, j, far).
    fn cubic(o: &TriangleOrdinates, weights: [f64; 3]) -> ([Rgb; 10], [f64; 3], [usize; 3]) {
        // The cubic is that of the edge opposite the smallest weight.
        let far = (0..3).reduce(|a, b| if weights[b] < weights[a] { b } else { a }).unwrap_or(0);
        let (i, j) = ((far + 1) % 3, (far + 2) % 3);
        let inward = |a: usize| (o[a] + o[along(a, (a + 1) % 3)] + o[along(a, (a + 2) % 3)]) * (1.0 / 3.0);
        let (in_i, in_j, in_far) = (inward(i), inward(j), inward(far));
        let (m_ij, m_jk, m_ki) = (o[middle(i, j)], o[middle(j, far)], o[middle(far, i)]);
        let (c_i, c_j, c_far) = (
            (in_i + m_ij + m_ki) * (1.0 / 3.0),
            (in_j + m_ij + m_jk) * (1.0 / 3.0),
            (in_far + m_jk + m_ki) * (1.0 / 3.0),
        );
        let center = (c_i + c_j + c_far) * (1.0 / 3.0);
        let ordinates = [o[i], o[j], o[along(i, j)], o[along(j, i)], in_i, in_j, m_ij, c_i, c_j, center];
        let own = [weights[i] - weights[far], weights[j] - weights[far], 3.0 * weights[far]];
        (ordinates, own, [i, j, far])
    }
}

impl TriangleSurface for CloughTocher {
    fn ordinates(nodes: &[Node; 3], limited: bool) -> TriangleOrdinates {
        let x = nodes.each_ref().map(|n| n.position);
        let center = (x[0] + x[1] + x[2]) / 3.0;
        let mut o = [Rgb::BLACK; 12];
        for (a, node) in nodes.iter().enumerate() {
            o[a] = node.value;
            for b in [(a + 1) % 3, (a + 2) % 3] {
                o[along(a, b)] = node.value + node.slope(x[b] - x[a]) / 3.0;
            }
        }
        // Of edge a-b: the ordinate that makes the slope towards C, taken across the edge, linear along it.
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let edge = x[b] - x[a];
            let foot = (center - x[a]).dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE);
            let (ab, ba) = (o[along(a, b)], o[along(b, a)]);
            let inward = |a: usize| nodes[a].value + nodes[a].slope(center - x[a]) / 3.0;
            let at_a = inward(a) - nodes[a].value * (1.0 - foot) - ab * foot;
            let at_b = inward(b) - ba * (1.0 - foot) - nodes[b].value * foot;
            o[middle(a, b)] = (at_a + at_b) * 0.5 + ab * (1.0 - foot) + ba * foot;
        }
        if limited {
            // Convex hull: with every ordinate between the corners' values, so is the surface. Gives up C1 here only.
            let low: [f64; 3] =
                std::array::from_fn(|c| o[..3].iter().map(|f| f.0[c]).fold(f64::INFINITY, f64::min));
            let high: [f64; 3] =
                std::array::from_fn(|c| o[..3].iter().map(|f| f.0[c]).fold(f64::NEG_INFINITY, f64::max));
            for m in &mut o[9..] {
                *m = Rgb(std::array::from_fn(|c| m.0[c].max(low[c]).min(high[c])));
            }
        }
        o
    }

    fn value(o: &TriangleOrdinates, weights: [f64; 3]) -> Rgb {
        let (p, [u, v, w], _) = CloughTocher::cubic(o, weights);
        p[0] * (u * u * u)
            + p[1] * (v * v * v)
            + p[2] * (3.0 * u * u * v)
            + p[3] * (3.0 * u * v * v)
            + p[4] * (3.0 * u * u * w)
            + p[5] * (3.0 * v * v * w)
            + p[6] * (6.0 * u * v * w)
            + p[7] * (3.0 * u * w * w)
            + p[8] * (3.0 * v * w * w)
            + p[9] * (w * w * w)
    }

    fn slopes(o: &TriangleOrdinates, weights: [f64; 3]) -> [Rgb; 2] {
        let (p, [u, v, w], [i, j, far]) = CloughTocher::cubic(o, weights);
        // The quadratics that the last step of de Casteljau's scheme mixes.
        let quadratic = |uu: usize, vv: usize, ww: usize, uv: usize, uw: usize, vw: usize| {
            p[uu] * (u * u)
                + p[vv] * (v * v)
                + p[ww] * (w * w)
                + p[uv] * (2.0 * u * v)
                + p[uw] * (2.0 * u * w)
                + p[vw] * (2.0 * v * w)
        };
        let of_u = quadratic(0, 3, 7, 2, 4, 6);
        let of_v = quadratic(2, 1, 8, 3, 6, 5);
        let of_w = quadratic(4, 5, 9, 6, 7, 8);
        [1, 2].map(|corner| {
            // How the weights in the cubic's own triangle change.
            let change = |k: usize| f64::from(k == corner) - f64::from(k == 0);
            let d_far = change(far);
            (of_u * (change(i) - d_far) + of_v * (change(j) - d_far) + of_w * (3.0 * d_far)) * 3.0
        })
    }

    fn edge_curve([a, b]: [Rgb; 2], [at_a, at_b]: [Rgb; 2]) -> (Rgb, Rgb) {
        ((a + b) * 0.5 + (at_a - at_b) * 0.125, (b - a) * 1.5 - (at_a + at_b) * 0.25)
    }
}
