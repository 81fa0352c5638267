//! A quad as two triangles, for the methods that know triangles only.
//!
//! ```text
//! 3-------2     (s,t) --> x, bilinear --> weights in 0 1 2 or in 0 2 3 of the point below x in the quad's plane
//! |   . ' |     with k = x_st = p (x_1 - x_0) + q (x_3 - x_0):
//! | '     |         x - x_0 = (s + p s t) (x_1 - x_0) + (t + q s t) (x_3 - x_0)
//! 0-------1     so p and q are all that weights need
//! ```
//! The diagonal is the casters' (0 2). Weights of the world point, not of (s,t): on a quad that is no parallelogram the
//! point at s = t does not lie on the diagonal, and a linear field would not stay one. On the edges both agree.

use super::derivatives::Node;
use super::field::world_gradient;
use super::pieces::{EdgeMiddle, QuadSurface, TriangleOrdinates, TriangleSurface, triangle_at_edge};
use crate::geom::DVec3;
use crate::units::Rgb;

/// Quads under the triangles' surface `T`.
#[derive(Debug)]
pub(super) struct SplitQuad<T>(std::marker::PhantomData<fn() -> T>);

/// Corners of the two triangles.
const HALVES: [[usize; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

#[derive(Clone, Debug)]
pub(super) struct Halves {
    ordinates: [TriangleOrdinates; 2],
    /// p and q above; 0 on parallelograms.
    bend: [f64; 2],
}

impl Halves {
    /// Which triangle (s,t) lies in, and its weights there.
    fn locate(&self, s: f64, t: f64) -> (usize, [f64; 3]) {
        let [p, q] = self.bend;
        let (a, b) = (s + p * s * t, t + q * s * t);
        // Corner 2 stands at (1 + p, 1 + q); a strictly convex quad has both above 0.
        let second = b / (1.0 + q);
        let first = a - second * (1.0 + p);
        if first >= 0.0 {
            return (0, [1.0 - first - second, first, second]);
        }
        let second = a / (1.0 + p);
        let third = b - second * (1.0 + q);
        (1, [1.0 - second - third, second, third])
    }
}

fn bend(x: &[DVec3; 4]) -> [f64; 2] {
    let (u, v) = (x[1] - x[0], x[3] - x[0]);
    let twist = x[0] - x[1] + x[2] - x[3];
    let normal = u.cross(v);
    let square = normal.length_squared();
    if square == 0.0 {
        return [0.0; 2];
    }
    [twist.dot(v.cross(normal)) / square, twist.dot(normal.cross(u)) / square]
}

impl<T: TriangleSurface> QuadSurface for SplitQuad<T> {
    type Coefficients = Halves;

    fn coefficients(nodes: &[Node; 4], limited: bool) -> Halves {
        Halves {
            ordinates: HALVES.map(|h| T::ordinates(&h.map(|k| nodes[k]), limited)),
            bend: bend(&nodes.each_ref().map(|n| n.position)),
        }
    }

    fn value(c: &Halves, s: f64, t: f64) -> Rgb {
        let (half, weights) = c.locate(s, t);
        T::value(&c.ordinates[half], weights)
    }

    fn gradient(c: &Halves, x: &[DVec3; 4], s: f64, t: f64) -> [Rgb; 3] {
        let (half, weights) = c.locate(s, t);
        let x = HALVES[half].map(|k| x[k]);
        world_gradient([x[1] - x[0], x[2] - x[0]], T::slopes(&c.ordinates[half], weights))
    }

    fn at_edge(nodes: &[Node; 4], edge: usize) -> EdgeMiddle {
        // Edges 0 1, 1 2 of the first triangle; 2 3, 3 0 are the second's last two.
        let (half, edge) = [(0, 0), (0, 1), (1, 1), (1, 2)][edge];
        triangle_at_edge::<T>(&HALVES[half].map(|k| nodes[k]), edge)
    }
}
