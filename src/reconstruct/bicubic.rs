//! The bicubic Hermite patch over a bilinear quad.
//!
//! ```text
//! 4 nodes (x, f, g, H), (s,t) --> B = S M_H G_H M_H^T T^T
//!        | f00  f01  ft00  ft01  |
//! G_H =  | f10  f11  ft10  ft11  |     index: s first, then t
//!        | fs00 fs01 fst00 fst01 |
//!        | fs10 fs11 fst10 fst11 |
//! ```
//! With g and H those of a quadratic field, B is that field on any planar convex quad: in (s,t) it is biquadratic.
//!
//! Source: Foley, van Dam et al. 1990, section 11.3.1.

use super::derivatives::Node;
use crate::units::Rgb;

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

/// The value at (s,t) of the quad whose corners stand at (0,0), (1,0), (1,1), (0,1).
pub(super) fn evaluate(nodes: &[Node; 4], s: f64, t: f64) -> Rgb {
    weighted(nodes, hermite_weights(s), hermite_weights(t))
}

/// d/ds, d/dt and the twist d2/dsdt at (s,t).
pub(super) fn slopes(nodes: &[Node; 4], s: f64, t: f64) -> [Rgb; 3] {
    let (ws, wt) = (hermite_weights(s), hermite_weights(t));
    let (ds, dt) = (hermite_slopes(s), hermite_slopes(t));
    [weighted(nodes, ds, wt), weighted(nodes, ws, dt), weighted(nodes, ds, dt)]
}

fn weighted(nodes: &[Node; 4], ws: [f64; 4], wt: [f64; 4]) -> Rgb {
    let x = nodes.each_ref().map(|n| n.position);
    let x_st = x[0] - x[1] + x[2] - x[3];
    let mut sum = Rgb::BLACK;
    for (node, (i, j)) in nodes.iter().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
        let x_s = if j == 0 { x[1] - x[0] } else { x[2] - x[3] };
        let x_t = if i == 0 { x[3] - x[0] } else { x[2] - x[1] };
        let twist = node.second(x_s, x_t) + node.slope(x_st);
        sum += node.value * (ws[i] * wt[j])
            + node.slope(x_s) * (ws[2 + i] * wt[j])
            + node.slope(x_t) * (ws[i] * wt[2 + j])
            + twist * (ws[2 + i] * wt[2 + j]);
    }
    sum
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
