//! The bicubic Hermite patch over a bilinear quad.
//!
//! ```text
//! 4 nodes (x, f, g, H) --> G_H, once --(s,t)--> B = S M_H G_H M_H^T T^T
//!        | f00  f01  ft00  ft01  |
//! G_H =  | f10  f11  ft10  ft11  |     index: s first, then t
//!        | fs00 fs01 fst00 fst01 |
//!        | fs10 fs11 fst10 fst11 |
//! ```
//! f_s = g . x_s, f_t = g . x_t, f_st = x_s^T H x_t + g . x_st. With g and H those of a quadratic field, B is that field on
//! any planar convex quad: in (s,t) it is biquadratic.
//!
//! Source: Foley, van Dam et al. 1990, section 11.3.1; Bastos et al. 1992, equations 1-5.

use super::derivatives::Node;
use super::field::{quad_tangents, world_gradient};
use super::pieces::{EdgeMiddle, QuadSurface};
use crate::geom::DVec3;
use crate::units::Rgb;

/// The method's surface over quads.
#[derive(Debug)]
pub(super) struct Bicubic;

/// G_H.
type Geometry = [[Rgb; 4]; 4];

/// S M_H: weights of value at 0, value at 1, slope at 0, slope at 1.
fn hermite_weights(s: f64) -> [f64; 4] {
    let r = 1.0 - s;
    [r * r * (1.0 + 2.0 * s), s * s * (1.0 + 2.0 * r), s * r * r, -s * s * r]
}

/// Derivatives of [`hermite_weights`].
fn hermite_slopes(s: f64) -> [f64; 4] {
    let r = 1.0 - s;
    [-6.0 * s * r, 6.0 * s * r, r * (r - 2.0 * s), s * (s - 2.0 * r)]
}

/// Corners in (s,t), in the winding order of the nodes.
pub(super) const CORNERS: [(usize, usize); 4] = [(0, 0), (1, 0), (1, 1), (0, 1)];

/// x_s, x_t and x_st at a corner.
pub(super) fn corner_tangents(x: &[DVec3; 4], (i, j): (usize, usize)) -> [DVec3; 3] {
    let [x_s, x_t] = quad_tangents(x, i as f64, j as f64);
    [x_s, x_t, x[0] - x[1] + x[2] - x[3]]
}

fn geometry(nodes: &[Node; 4]) -> Geometry {
    let x = nodes.each_ref().map(|n| n.position);
    let mut g = [[Rgb::BLACK; 4]; 4];
    for (node, (i, j)) in nodes.iter().zip(CORNERS) {
        let [x_s, x_t, x_st] = corner_tangents(&x, (i, j));
        g[i][j] = node.value;
        g[2 + i][j] = node.slope(x_s);
        g[i][2 + j] = node.slope(x_t);
        g[2 + i][2 + j] = node.second(x_s, x_t) + node.slope(x_st);
    }
    g
}

fn weighted(g: &Geometry, ws: [f64; 4], wt: [f64; 4]) -> Rgb {
    let mut sum = Rgb::BLACK;
    for (row, w) in g.iter().zip(ws) {
        sum += (row[0] * wt[0] + row[1] * wt[1] + row[2] * wt[2] + row[3] * wt[3]) * w;
    }
    sum
}

impl QuadSurface for Bicubic {
    type Coefficients = Geometry;

    fn coefficients(nodes: &[Node; 4], _: bool) -> Geometry {
        geometry(nodes)
    }

    fn value(g: &Geometry, s: f64, t: f64) -> Rgb {
        weighted(g, hermite_weights(s), hermite_weights(t))
    }

    fn gradient(g: &Geometry, x: &[DVec3; 4], s: f64, t: f64) -> [Rgb; 3] {
        let f_s = weighted(g, hermite_slopes(s), hermite_weights(t));
        let f_t = weighted(g, hermite_weights(s), hermite_slopes(t));
        world_gradient(quad_tangents(x, s, t), [f_s, f_t])
    }

    fn at_edge(nodes: &[Node; 4], edge: usize) -> EdgeMiddle {
        let (s, t) = [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)][edge];
        let x = nodes.each_ref().map(|n| n.position);
        let [x_s, x_t] = quad_tangents(&x, s, t);
        let x_st = x[0] - x[1] + x[2] - x[3];
        let g = geometry(nodes);
        let f_s = (x_s, weighted(&g, hermite_slopes(s), hermite_weights(t)));
        let f_t = (x_t, weighted(&g, hermite_weights(s), hermite_slopes(t)));
        let f_st = weighted(&g, hermite_slopes(s), hermite_slopes(t));
        let (along, across) = if edge.is_multiple_of(2) { (f_s, f_t) } else { (f_t, f_s) };
        EdgeMiddle { value: Bicubic::value(&g, s, t), along, across, twist: Some((x_st, f_st)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hermite_weights_equal_the_matrix_form() {
        // Rows of M_H for the powers s^3, s^2, s, 1.
        let m = [[2., -2., 1., 1.], [-3., 3., -2., -1.], [0., 0., 1., 0.], [1., 0., 0., 0.]];
        for k in 0..=10 {
            let s = f64::from(k) / 10.0;
            let powers = [s * s * s, s * s, s, 1.0];
            for (c, w) in hermite_weights(s).into_iter().enumerate() {
                let expected: f64 = (0..4).map(|r| powers[r] * m[r][c]).sum();
                assert!((w - expected).abs() < 1e-15, "s {s}, column {c}: {w} vs {expected}");
                let powers = [3.0 * s * s, 2.0 * s, 1.0, 0.0];
                let expected: f64 = (0..4).map(|r| powers[r] * m[r][c]).sum();
                let w = hermite_slopes(s)[c];
                assert!((w - expected).abs() < 1e-14, "slope at {s}, column {c}: {w} vs {expected}");
            }
        }
    }
}
