//! The datapath's wires beside the oracle's: the first that differs, or all of them for a report.
//!
//! ```text
//! datapath::ray_patch::Taps, oracle::Wires -> (wire, board, oracle) one by one
//! ```

use std::fmt;

use super::ray_patch::Wires;
use crate::datapath::ray_patch::Taps;

/// Name of a wire of a test: vertices, edges in the order of [`Wires::c`], triangles and axes from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WireName {
    /// Corner relative to the origin: vertex, axis.
    A(usize, usize),
    /// Edge normal: edge, axis.
    C(usize, usize),
    /// Edge value.
    E(usize),
    /// 1 when the patch has this triangle, else 0.
    Present(usize),
    /// 1 when the ray's line meets the triangle, else 0.
    Inside(usize),
    /// Face normal: triangle, axis.
    N(usize, usize),
    /// Sum of the edge values of a triangle.
    Den(usize),
    /// a_0 . n of a triangle.
    Num(usize),
    /// Dividend of a triangle.
    NumShifted(usize),
    /// Divisor of a triangle.
    DenShifted(usize),
}

impl fmt::Display for WireName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const AXES: [&str; 3] = ["x", "y", "z"];
        match *self {
            WireName::A(vertex, axis) => write!(f, "a[{vertex}].{}", AXES[axis % 3]),
            WireName::C(edge, axis) => write!(f, "c[{edge}].{}", AXES[axis % 3]),
            WireName::E(edge) => write!(f, "e[{edge}]"),
            WireName::Present(triangle) => write!(f, "triangle[{triangle}]"),
            WireName::Inside(triangle) => write!(f, "triangle[{triangle}].inside"),
            WireName::N(triangle, axis) => write!(f, "triangle[{triangle}].n.{}", AXES[axis % 3]),
            WireName::Den(triangle) => write!(f, "triangle[{triangle}].den"),
            WireName::Num(triangle) => write!(f, "triangle[{triangle}].num"),
            WireName::NumShifted(triangle) => write!(f, "triangle[{triangle}].num_shifted"),
            WireName::DenShifted(triangle) => write!(f, "triangle[{triangle}].den_shifted"),
        }
    }
}

/// A wire's value on the board and in the oracle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WireDifference {
    /// Which wire.
    pub wire: WireName,
    /// The datapath's value.
    pub board: i128,
    /// The oracle's value.
    pub oracle: i128,
}

impl fmt::Display for WireDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = if self.board == self.oracle { "" } else { "   <- differs" };
        write!(f, "{:<24} board {:>40} oracle {:>40}{mark}", self.wire.to_string(), self.board, self.oracle)
    }
}

impl Wires {
    /// The first wire, in the order of the data flow, whose value on the board is another.
    pub fn difference(&self, board: &Taps) -> Option<WireDifference> {
        let mut first = None;
        self.visit(board, |values| {
            if values.board != values.oracle && first.is_none() {
                first = Some(values);
            }
        });
        first
    }

    /// All wires of the test, equal or not, in the order of the data flow.
    pub fn side_by_side(&self, board: &Taps) -> Vec<WireDifference> {
        let mut all = Vec::new();
        self.visit(board, |values| all.push(values));
        all
    }

    fn visit(&self, board: &Taps, mut each: impl FnMut(WireDifference)) {
        let mut show = |wire, board, oracle| each(WireDifference { wire, board, oracle });
        for (i, (ours, theirs)) in self.a.iter().zip(&board.a).enumerate() {
            for k in 0..3 {
                show(WireName::A(i, k), i128::from(theirs[k]), i128::from(ours[k]));
            }
        }
        for (i, (ours, theirs)) in self.c.iter().zip(&board.c).enumerate() {
            for k in 0..3 {
                show(WireName::C(i, k), i128::from(theirs[k]), ours[k]);
            }
        }
        for (i, (ours, theirs)) in self.e.iter().zip(&board.e).enumerate() {
            show(WireName::E(i), *theirs, *ours);
        }
        for (i, (ours, theirs)) in self.triangles.iter().zip(&board.triangles).enumerate() {
            show(WireName::Present(i), i128::from(theirs.is_some()), i128::from(ours.is_some()));
            let (Some(ours), Some(theirs)) = (ours, theirs) else {
                continue;
            };
            show(WireName::Inside(i), i128::from(theirs.inside), i128::from(ours.inside));
            for k in 0..3 {
                show(WireName::N(i, k), i128::from(theirs.n[k]), ours.n[k]);
            }
            show(WireName::Den(i), theirs.den, ours.den);
            show(WireName::Num(i), theirs.num, ours.num);
            show(WireName::NumShifted(i), theirs.num_shifted, ours.num_shifted);
            show(WireName::DenShifted(i), theirs.den_shifted, ours.den_shifted);
        }
    }
}

#[cfg(test)]
#[path = "wire_values_tests.rs"]
mod tests;
