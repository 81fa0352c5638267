//! The Powell-Sabin quadratic triangle of twelve parts.
//!
//! ```text
//!             k              m: middles of the edges, C: centroid, q_i: middle of m_ij m_ki
//!            /|\             parts at corner i: (i, m_ij, q_i), (i, q_i, m_ki); inside: (C, m_ij, q_i), ...
//!       m_ki--+--m_jk        12 numbers fix it: 3 values, 6 ordinates f + g . edge / 4 next to the corners, 3 between
//!        / \ C| / \          m and C, which hold the slope across the middle of the edge; the rest are means:
//!       i---m_ij---j           m_ij  = (ij + ji) / 2               between m_ij and q_i: (ij + 3 C_ij) / 4
//!                              i-q_i = (ij + ik) / 2               q_i, C and between: means of their neighbours
//! ```
//! Two quadratics on each edge, joined C1 in its middle; the slope across is the mean of the slopes at the edge's ends, so
//! linear along it. Reproduces quadratics from exact gradients; C1 between coplanar triangles.
//!
//! Why twelve parts and not Powell and Sabin's six, or Cendes and Wong's choice of centres for them: the six need the line
//! between the centres of two neighbours to cross their edge, and the point where it does as a knot. On a curved surface
//! there is no such line, and a hanging vertex is a second knot on the edge. The middle is a knot that both sides know
//! without each other, and the one where a hanging vertex stands.
//!
//! Source: Powell, Sabin 1977, "Piecewise quadratic approximations on triangles", section 3; Cendes, Wong 1987.

use super::clough_tocher::{along, middle};
use super::derivatives::Node;
use super::pieces::{TriangleOrdinates, TriangleSurface};
use crate::units::Rgb;

/// The method's surface over triangles.
#[derive(Debug)]
pub(super) struct PowellSabin;

/// One of the twelve quadratics: ordinates at its corners a, b, c and between bc, ca, ab; weights there.
struct Part {
    corners: [Rgb; 3],
    between: [Rgb; 3],
    weights: [f64; 3],
    /// How its weights change with those of the triangle's corners (i, j, k).
    changes: [[f64; 3]; 3],
    /// i, j, k.
    order: [usize; 3],
}

impl PowellSabin {
    fn part(o: &TriangleOrdinates, w: [f64; 3]) -> Part {
        // Corners by falling weight.
        let mut order = [0, 1, 2];
        if w[order[1]] > w[order[0]] {
            order.swap(0, 1);
        }
        if w[order[2]] > w[order[1]] {
            order.swap(1, 2);
        }
        if w[order[1]] > w[order[0]] {
            order.swap(0, 1);
        }
        let [i, j, k] = order;
        let mean = |a: Rgb, b: Rgb| (a + b) * 0.5;
        let (ij, ji, ik) = (o[along(i, j)], o[along(j, i)], o[along(i, k)]);
        let m_ij = mean(ij, ji);
        let (c_ij, c_jk, c_ki) = (o[middle(i, j)], o[middle(j, k)], o[middle(k, i)]);
        // Between the middles and q_i.
        let near = |ij: Rgb, c: Rgb| (ij + c * 3.0) * 0.25;
        let (mq, mq_k) = (near(ij, c_ij), near(ik, c_ki));
        let q = mean(mq, mq_k);
        let (a, b, c) = (2.0 * (w[j] - w[k]), w[i], w[k]);
        if b >= 0.5 {
            // (i, m_ij, q_i)
            return Part {
                corners: [o[i], m_ij, q],
                between: [mq, mean(ij, ik), ij],
                weights: [1.0 - a - 4.0 * c, a, 4.0 * c],
                changes: [[1.0, 0.0, 0.0], [-1.0, 2.0, 0.0], [-1.0, -2.0, 4.0]],
                order,
            };
        }
        // (C, m_ij, q_i)
        let center = (c_ij + c_jk + c_ki) * (1.0 / 3.0);
        let to_q = 4.0 * (w[i] - w[j]);
        Part {
            corners: [center, m_ij, q],
            between: [mq, mean(c_ij, c_ki), c_ij],
            weights: [1.0 - a - to_q, a, to_q],
            changes: [[-3.0, 0.0, 4.0], [3.0, 2.0, -4.0], [3.0, -2.0, 0.0]],
            order,
        }
    }
}

impl TriangleSurface for PowellSabin {
    fn ordinates(nodes: &[Node; 3], _: bool) -> TriangleOrdinates {
        let x = nodes.each_ref().map(|n| n.position);
        let center = (x[0] + x[1] + x[2]) / 3.0;
        let mut o = [Rgb::BLACK; 12];
        for (a, node) in nodes.iter().enumerate() {
            o[a] = node.value;
            for b in [(a + 1) % 3, (a + 2) % 3] {
                o[along(a, b)] = node.value + node.slope(x[b] - x[a]) * 0.25;
            }
        }
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let edge = x[b] - x[a];
            let slopes = [nodes[a].slope(edge), nodes[b].slope(edge)];
            let (value, slope) = PowellSabin::edge_curve([nodes[a].value, nodes[b].value], slopes);
            let to_center = center - 0.5 * (x[a] + x[b]);
            let foot = to_center.dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE);
            let across = to_center - foot * edge;
            let across = (nodes[a].slope(across) + nodes[b].slope(across)) * 0.5;
            o[middle(a, b)] = value + (slope * foot + across) * 0.5;
        }
        o
    }

    fn value(o: &TriangleOrdinates, weights: [f64; 3]) -> Rgb {
        let Part { corners: [a, b, c], between: [bc, ca, ab], weights: [u, v, w], .. } =
            PowellSabin::part(o, weights);
        a * (u * u) + b * (v * v) + c * (w * w) + bc * (2.0 * v * w) + ca * (2.0 * w * u) + ab * (2.0 * u * v)
    }

    fn slopes(o: &TriangleOrdinates, weights: [f64; 3]) -> [Rgb; 2] {
        let part = PowellSabin::part(o, weights);
        let Part { corners: [a, b, c], between: [bc, ca, ab], weights: [u, v, w], changes, order } = part;
        let steps = [a * u + ab * v + ca * w, ab * u + b * v + bc * w, ca * u + bc * v + c * w];
        // Along the weight of each of i, j, k; their sum is that of moving nowhere.
        let along_weight = changes.map(|d| (steps[0] * d[0] + steps[1] * d[1] + steps[2] * d[2]) * 2.0);
        let of = |corner: usize| along_weight[order.iter().position(|o| *o == corner).unwrap_or(0)];
        [of(1) - of(0), of(2) - of(0)]
    }

    fn edge_curve([a, b]: [Rgb; 2], [at_a, at_b]: [Rgb; 2]) -> (Rgb, Rgb) {
        ((a + b) * 0.5 + (at_a - at_b) * 0.125, (b - a) * 2.0 - (at_a + at_b) * 0.5)
    }
}
