//! Elements' surfaces with their coefficients: the field of every method that has derivatives.
//!
//! ```text
//! nodes at the corners --QuadSurface / TriangleSurface--> coefficients, once --(s,t)--> value, gradient
//! ```
//! A method is a choice of both surfaces. Those of two elements join because both follow from the nodes on their edge.

use std::fmt::Debug;

use rayon::prelude::*;

use super::derivatives::Node;
use super::field::{Field, corner_positions, world_gradient};
use super::nodes::Nodal;
use crate::geom::DVec3;
use crate::mesh::{Corners, ElementId, Mesh, SurfacePoint};
use crate::units::Rgb;

/// Twelve numbers that fix a surface over a triangle: values at corners 0, 1, 2; ordinates next to them along the edges
/// 01, 10, 12, 21, 20, 02; one for each of the edges 01, 12, 20 that holds the slope across its middle.
pub(super) type TriangleOrdinates = [Rgb; 12];

/// The surface over a quad.
pub(super) trait QuadSurface: Debug + Send + Sync + 'static {
    /// What is kept per element.
    type Coefficients: Clone + Debug + Send + Sync;

    /// From the nodes at (0,0), (1,0), (1,1), (0,1); `limited`: never out of the corners' range, per channel, in what the
    /// limiter of the nodes leaves open.
    fn coefficients(nodes: &[Node; 4], limited: bool) -> Self::Coefficients;

    /// The value at (s,t).
    fn value(c: &Self::Coefficients, s: f64, t: f64) -> Rgb;

    /// The world gradient at (s,t) over the quad with these corners.
    fn gradient(c: &Self::Coefficients, x: &[DVec3; 4], s: f64, t: f64) -> [Rgb; 3];

    /// At the middle of an edge.
    fn at_edge(nodes: &[Node; 4], edge: usize) -> EdgeMiddle;
}

/// The surface over a triangle. Its slope across an edge is linear along the edge.
pub(super) trait TriangleSurface: Debug + Send + Sync + 'static {
    /// From the nodes at the corners; `limited` as for quads.
    fn ordinates(nodes: &[Node; 3], limited: bool) -> TriangleOrdinates;

    /// The value at weights of the corners.
    fn value(o: &TriangleOrdinates, weights: [f64; 3]) -> Rgb;

    /// Derivatives along the weights of corners 1 and 2, each at the cost of that of corner 0.
    fn slopes(o: &TriangleOrdinates, weights: [f64; 3]) -> [Rgb; 2];

    /// Value and slope in the middle of an edge, from the values and slopes at its ends (slopes a whole edge length).
    fn edge_curve(values: [Rgb; 2], slopes: [Rgb; 2]) -> (Rgb, Rgb);
}

/// A surface at the middle of one of its edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeMiddle {
    pub(super) value: Rgb,
    /// A direction along the edge and the slope along it.
    pub(super) along: (DVec3, Rgb),
    /// One that leads away from the edge.
    pub(super) across: (DVec3, Rgb),
    /// x_st and the twist f_st, of bicubics.
    pub(super) twist: Option<(DVec3, Rgb)>,
}

/// What the surface `T` over a triangle is at the middle of its edge `edge`.
pub(super) fn triangle_at_edge<T: TriangleSurface>(nodes: &[Node; 3], edge: usize) -> EdgeMiddle {
    let (a, b, c) = (&nodes[edge], &nodes[(edge + 1) % 3], &nodes[(edge + 2) % 3]);
    let along = b.position - a.position;
    let (value, slope) = T::edge_curve([a.value, b.value], [a.slope(along), b.slope(along)]);
    let across = (c.position - a.position).reject_from(along);
    let mean = (a.slope(across) + b.slope(across)) * 0.5;
    EdgeMiddle { value, along: (along, slope), across: (across, mean), twist: None }
}

/// All elements' coefficients.
#[derive(Debug)]
pub(super) struct Pieces<Q: QuadSurface, T: TriangleSurface> {
    /// Per element: twice its place among its kind, odd for triangles.
    places: Vec<u32>,
    quads: Vec<Q::Coefficients>,
    triangles: Vec<TriangleOrdinates>,
    surface: std::marker::PhantomData<fn() -> T>,
}

impl<Q: QuadSurface, T: TriangleSurface> Pieces<Q, T> {
    pub(super) fn new(nodal: &Nodal<'_>) -> Pieces<Q, T> {
        let elements = &nodal.mesh.elements;
        let (mut n_quads, mut n_triangles) = (0, 0);
        let mut place = |corners: &Corners| {
            let (n, odd) = match corners {
                Corners::Quad(_) => (&mut n_quads, 0),
                Corners::Triangle(_) => (&mut n_triangles, 1),
            };
            *n += 1;
            2 * (*n - 1) + odd
        };
        let places = elements.iter().map(|e| place(&e.corners)).collect();
        let limited = |e: usize| nodal.limited.get(e) == Some(&true);
        let of_kind = |e: &usize, quad: bool| matches!(elements[*e].corners, Corners::Quad(_)) == quad;
        let all = || (0..elements.len()).into_par_iter().with_min_len(256);
        let quads = all()
            .filter(|e| of_kind(e, true))
            .map(|e| Q::coefficients(&nodal.corners(ElementId(e as u32)), limited(e)))
            .collect();
        let triangles = all()
            .filter(|e| of_kind(e, false))
            .map(|e| {
                let [a, b, c, _] = nodal.corners(ElementId(e as u32));
                T::ordinates(&[a, b, c], limited(e))
            })
            .collect();
        Pieces { places, quads, triangles, surface: std::marker::PhantomData }
    }
}

impl<Q: QuadSurface, T: TriangleSurface> Field for Pieces<Q, T> {
    fn value(&self, _: &Mesh, at: SurfacePoint) -> Rgb {
        let (s, t) = (at.st.x, at.st.y);
        let place = self.places[at.element.0 as usize];
        match place % 2 {
            0 => Q::value(&self.quads[place as usize / 2], s, t),
            _ => T::value(&self.triangles[place as usize / 2], [1.0 - s - t, s, t]),
        }
    }

    fn gradient(&self, mesh: &Mesh, at: SurfacePoint) -> [Rgb; 3] {
        let (s, t) = (at.st.x, at.st.y);
        let place = self.places[at.element.0 as usize];
        let x = corner_positions(mesh, &mesh.elements[at.element.0 as usize].corners);
        match place % 2 {
            0 => Q::gradient(&self.quads[place as usize / 2], &x, s, t),
            _ => {
                let slopes = T::slopes(&self.triangles[place as usize / 2], [1.0 - s - t, s, t]);
                world_gradient([x[1] - x[0], x[2] - x[0]], slopes)
            }
        }
    }

    fn memory_bytes(&self) -> usize {
        self.places.capacity() * size_of::<u32>()
            + self.quads.capacity() * size_of::<Q::Coefficients>()
            + self.triangles.capacity() * size_of::<TriangleOrdinates>()
    }
}
