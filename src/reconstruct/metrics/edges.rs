//! Points of C1 edges: breaks of the slope, and second differences across, which show as Mach bands.
//!
//! ```text
//!        element a          from(+d), into a along its inward conormal n_a
//! ----------x-----------    x: 4 points an edge        d = min(width of a, width of b) / 8
//!        element b          from(-d), into b along n_b
//! jump = |g_a . n_a + g_b . n_b| h      band: (y(+d) - 2 y(0) + y(-d)) / d
//! ```
//! Conormals lie in each element's own plane, so that smooth curved surfaces have no break of their facets' making. Over a
//! hanging vertex the fine element is a. Points whose neighbours at distance d lie outside a or b (sheared corners) are left out.

use glam::DVec2;
use rayon::prelude::*;

use super::points::{corner_st, dual, tangents};
use super::{Reference, luminance_gradient};
use crate::geom::DVec3;
use crate::mesh::{Continuity, ElementId, Mesh, SurfacePoint};
use crate::reconstruct::Reconstruction;

/// Points an edge.
const POINTS: u32 = 4;
/// Distance of the second difference, as a share of an element's width.
const DISTANCE_SHARE: f64 = 1.0 / 8.0;
/// How far beyond an element (s,t) may lie by rounding.
const ROUNDING: f64 = 1e-9;

/// A point of a C1 edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgePoint {
    pub(super) group: usize,
    /// On the edge: as a place of a, as one of b.
    pub(super) on: [SurfacePoint; 2],
    /// At the distance: in a, in b.
    pub(super) off: [SurfacePoint; 2],
    /// Unit, along the surface, into a and into b.
    inward: [DVec3; 2],
    width_m: f64,
    pub(super) distance_m: f64,
    /// Mean of its group (W/m^2).
    pub(super) mean: f64,
    /// The reference's second difference over the distance, over the mean (1/m).
    second: f64,
}

/// An edge of element a that b lies across, and how a's edge maps to b's: `b = from + along x (1 - t)`.
struct Shared {
    b: ElementId,
    edge_b: usize,
    from: f64,
    along: f64,
}

/// What lies across edge `edge` of a where a is the finer side, or the first of two equals.
fn shared(mesh: &Mesh, a: ElementId, edge: usize) -> Option<Shared> {
    let element = &mesh.elements[a.0 as usize];
    if element.continuity[edge] != Continuity::C1 || mesh.hanging_on(a, edge).is_some() {
        return None;
    }
    let b = element.neighbours[edge]?;
    let corners = mesh.elements[b.0 as usize].corners;
    let own = element.corners.edge(edge);
    for edge_b in 0..corners.vertices().len() {
        if corners.edge(edge_b) == (own.1, own.0) {
            return (a < b).then_some(Shared { b, edge_b, from: 0.0, along: 1.0 });
        }
        if let Some(hanging) = mesh.hanging_on(b, edge_b)
            && let Some(half) = hanging.fine.iter().position(|f| *f == a)
        {
            return Some(Shared { b, edge_b, from: 0.5 * half as f64, along: 0.5 });
        }
    }
    None
}

/// The place at `t` of an edge.
fn on_edge(mesh: &Mesh, element: ElementId, edge: usize, t: f64) -> SurfacePoint {
    let n = mesh.elements[element.0 as usize].corners.vertices().len();
    let st = corner_st(n, edge).lerp(corner_st(n, (edge + 1) % n), t);
    SurfacePoint { element, st }
}

/// Length of an edge (m) and the element's width there.
fn width_m(mesh: &Mesh, element: ElementId, edge: usize) -> f64 {
    let e = &mesh.elements[element.0 as usize];
    let (a, b) = e.corners.edge(edge);
    let length = mesh.vertices[a.0 as usize].position.distance(mesh.vertices[b.0 as usize].position);
    let whole = if e.corners.vertices().len() == 3 { 2.0 } else { 1.0 };
    whole * e.area_m2 / length.max(f64::MIN_POSITIVE)
}

/// Unit, in the element's plane, away from its edge at `at`.
fn inward(mesh: &Mesh, at: SurfacePoint, edge: usize) -> DVec3 {
    let [x_s, x_t] = tangents(mesh, at);
    let (a, b) = mesh.elements[at.element.0 as usize].corners.edge(edge);
    let along = mesh.vertices[b.0 as usize].position - mesh.vertices[a.0 as usize].position;
    x_s.cross(x_t).cross(along).normalize_or_zero()
}

/// The place at `distance_m` along `inward`; `None` outside the element.
fn off_edge(mesh: &Mesh, at: SurfacePoint, inward: DVec3, distance_m: f64) -> Option<SurfacePoint> {
    let [p, q] = dual(tangents(mesh, at))?;
    let st = at.st + distance_m * DVec2::new(p.dot(inward), q.dot(inward));
    let is_triangle = mesh.elements[at.element.0 as usize].corners.vertices().len() == 3;
    let inside = st.min_element() >= -ROUNDING
        && if is_triangle { st.x + st.y <= 1.0 + ROUNDING } else { st.max_element() <= 1.0 + ROUNDING };
    inside.then_some(SurfacePoint { st, ..at })
}

/// Points of the C1 edges between elements that count.
pub(super) fn sample(
    mesh: &Mesh,
    group: &(impl Fn(ElementId) -> Option<usize> + Sync),
    means: &[f64],
    reference: &impl Reference,
) -> Vec<EdgePoint> {
    let of = |e: u32| {
        let a = ElementId(e);
        let mut found = Vec::new();
        let Some(own) = group(a).filter(|g| means[*g] > 0.0) else { return found };
        let mean = means[own];
        for edge in 0..mesh.elements[e as usize].corners.vertices().len() {
            let Some(Shared { b, edge_b, from, along }) = shared(mesh, a, edge) else { continue };
            if group(b).is_none() {
                continue;
            }
            let width_m = width_m(mesh, a, edge).min(width_m(mesh, b, edge_b));
            let distance_m = DISTANCE_SHARE * width_m;
            for k in 0..POINTS {
                let t = (f64::from(k) + 0.5) / f64::from(POINTS);
                let on = [on_edge(mesh, a, edge, t), on_edge(mesh, b, edge_b, from + along * (1.0 - t))];
                let inward = [inward(mesh, on[0], edge), inward(mesh, on[1], edge_b)];
                let off = |side: usize| off_edge(mesh, on[side], inward[side], distance_m);
                let (Some(in_a), Some(in_b)) = (off(0), off(1)) else { continue };
                let y = |at| reference.luminance(mesh, at) / mean;
                let second = (y(in_a) - 2.0 * y(on[0]) + y(in_b)) / distance_m;
                let off = [in_a, in_b];
                found.push(EdgePoint { group: own, on, off, inward, width_m, distance_m, mean, second });
            }
        }
        found
    };
    (0..mesh.elements.len() as u32).into_par_iter().flat_map_iter(of).collect()
}

/// `jump` and `band`.
pub(super) fn measure(edges: &[EdgePoint], mesh: &Mesh, field: &Reconstruction) -> (f64, f64) {
    let at = |p: &EdgePoint| {
        let y = |at| field.evaluate_unclamped(mesh, at).luminance() / p.mean;
        let slope =
            |side: usize| luminance_gradient(field.gradient(mesh, p.on[side])).dot(p.inward[side]) / p.mean;
        let second = (y(p.off[0]) - 2.0 * y(p.on[0]) + y(p.off[1])) / p.distance_m;
        ((slope(0) + slope(1)).abs() * p.width_m, (second - p.second).powi(2))
    };
    let found: Vec<(f64, f64)> = edges.par_iter().map(at).collect();
    let jump = found.iter().map(|f| f.0).fold(0.0, f64::max);
    let squares: f64 = found.iter().map(|f| f.1).sum();
    (jump, if found.is_empty() { 0.0 } else { (squares / found.len() as f64).sqrt() })
}
