//! The cubic Clough-Tocher triangle: three cubics that meet in the centroid.
//!
//! ```text
//!            2          Bezier ordinates of the cubic on edge 0-1 (C the centroid):
//!           /|\           corners          f0, f1
//!          / | \          along the edge   f + g . (edge) / 3
//!         /  C  \         towards C        f + g . (C - corner) / 3
//!        / /   \ \        middle           so that the slope across the edge is linear along it
//!       0---------1     those next to C and C itself: means, which make the three cubics C1
//! ```
//! 12 degrees of freedom: 3 values, 6 gradient components, 3 slopes across the middles of the edges, here the mean
//! of the slopes at the edge's ends. With exact gradients it reproduces quadratics (not cubics: their slope across
//! an edge is not linear). C1 between coplanar triangles, since both sides see one slope across the edge.
//!
//! Source: Clough, Tocher 1965; Bezier form as in Alfeld 1984, "A trivariate Clough-Tocher scheme".

use super::derivatives::Node;
use crate::units::Rgb;

/// The value at weights (1 - s - t, s, t) of the corners.
pub(super) fn evaluate(nodes: &[Node; 3], s: f64, t: f64) -> Rgb {
    let weights = [1.0 - s - t, s, t];
    // The cubic is that of the edge opposite the smallest weight.
    let far = (0..3).reduce(|a, b| if weights[b] < weights[a] { b } else { a }).unwrap_or(0);
    let (i, j) = ((far + 1) % 3, (far + 2) % 3);
    let x = nodes.each_ref().map(|n| n.position);
    let center = (x[0] + x[1] + x[2]) / 3.0;

    let along = |a: usize, b: usize| nodes[a].value + nodes[a].slope(x[b] - x[a]) / 3.0;
    let inward = |a: usize| nodes[a].value + nodes[a].slope(center - x[a]) / 3.0;
    // Of edge a-b: the ordinate that makes the slope towards C, taken across the edge, linear along it.
    let middle = |a: usize, b: usize| {
        let edge = x[b] - x[a];
        let foot = (center - x[a]).dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE);
        let (ab, ba) = (along(a, b), along(b, a));
        let at_a = inward(a) - nodes[a].value * (1.0 - foot) - ab * foot;
        let at_b = inward(b) - ba * (1.0 - foot) - nodes[b].value * foot;
        (at_a + at_b) * 0.5 + ab * (1.0 - foot) + ba * foot
    };
    let (m_ij, m_jk, m_ki) = (middle(i, j), middle(j, far), middle(far, i));
    let near_center = |a: usize, one: Rgb, other: Rgb| (inward(a) + one + other) / 3.0;
    let (c_i, c_j, c_k) =
        (near_center(i, m_ij, m_ki), near_center(j, m_ij, m_jk), near_center(far, m_jk, m_ki));

    let (u, v, w) = (weights[i] - weights[far], weights[j] - weights[far], 3.0 * weights[far]);
    nodes[i].value * (u * u * u)
        + nodes[j].value * (v * v * v)
        + along(i, j) * (3.0 * u * u * v)
        + along(j, i) * (3.0 * u * v * v)
        + inward(i) * (3.0 * u * u * w)
        + inward(j) * (3.0 * v * v * w)
        + m_ij * (6.0 * u * v * w)
        + c_i * (3.0 * u * w * w)
        + c_j * (3.0 * v * w * w)
        + (c_i + c_j + c_k) / 3.0 * (w * w * w)
}
