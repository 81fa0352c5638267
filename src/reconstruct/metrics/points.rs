//! Points of elements: value, gradient and range of the reference, and what a reconstruction makes of them.
//!
//! ```text
//! quad: 4 x 4 midpoints | triangle: centroids of 16 parts --reference--> value, gradient by central differences in (s,t)
//! ```

use glam::DVec2;
use rayon::prelude::*;

use super::{Metrics, Reference, luminance_gradient};
use crate::geom::DVec3;
use crate::mesh::{Corners, ElementId, Mesh, SurfacePoint};
use crate::reconstruct::Reconstruction;

/// Parts of an element's edge.
const PARTS: u32 = 4;

/// A point where the reference is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct ElementPoint {
    pub(super) at: SurfacePoint,
    pub(super) group: usize,
    area_m2: f64,
    /// Mean of its group (W/m^2).
    pub(super) mean: f64,
    /// Value over the mean.
    value: f64,
    /// Gradient over the mean (1/m).
    gradient: DVec3,
    /// Range of the reference over the element and those around it, over the mean.
    range: [f64; 2],
}

/// (s,t) of a corner.
pub(super) fn corner_st(n_corners: usize, corner: usize) -> DVec2 {
    match (n_corners, corner) {
        (_, 0) => DVec2::ZERO,
        (_, 1) => DVec2::X,
        (3, _) => DVec2::Y,
        (_, 2) => DVec2::ONE,
        _ => DVec2::Y,
    }
}

/// dx/ds, dx/dt at a place (m).
pub(super) fn tangents(mesh: &Mesh, at: SurfacePoint) -> [DVec3; 2] {
    let x = |v: crate::mesh::VertexId| mesh.vertices[v.0 as usize].position;
    match mesh.elements[at.element.0 as usize].corners {
        Corners::Triangle([a, b, c]) => [x(b) - x(a), x(c) - x(a)],
        Corners::Quad(v) => {
            let [a, b, c, d] = v.map(x);
            let (s, t) = (at.st.x, at.st.y);
            [(1.0 - t) * (b - a) + t * (c - d), (1.0 - s) * (d - a) + s * (c - b)]
        }
    }
}

/// The vectors p, q of the plane of a, b with p . a = q . b = 1 and p . b = q . a = 0; `None` where a and b span none.
pub(super) fn dual([a, b]: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let normal = a.cross(b);
    let square = normal.length_squared();
    (square > 0.0).then(|| [b.cross(normal) / square, normal.cross(a) / square])
}

/// Places on an element, each with its area (m^2).
pub(super) fn places(mesh: &Mesh, element: ElementId) -> Vec<(SurfacePoint, f64)> {
    let n = f64::from(PARTS);
    let cells = (0..PARTS).flat_map(|j| (0..PARTS).map(move |i| (f64::from(i), f64::from(j))));
    let e = &mesh.elements[element.0 as usize];
    let at = |s: f64, t: f64| SurfacePoint { element, st: DVec2::new(s / n, t / n) };
    if matches!(e.corners, Corners::Triangle(_)) {
        let third = 1.0 / 3.0;
        let parts = cells.flat_map(|(i, j)| {
            let upright = (i + j < n).then(|| at(i + third, j + third));
            let inverted = (i + j + 1.0 < n).then(|| at(i + 2.0 * third, j + 2.0 * third));
            [upright, inverted].into_iter().flatten()
        });
        return parts.map(|at| (at, e.area_m2 / (n * n))).collect();
    }
    let cell = |(i, j)| {
        let at = at(i + 0.5, j + 0.5);
        let [x_s, x_t] = tangents(mesh, at);
        (at, x_s.cross(x_t).length() / (n * n))
    };
    cells.map(cell).collect()
}

/// The reference's gradient along the surface (W/m^3).
fn gradient(mesh: &Mesh, at: SurfacePoint, reference: &impl Reference) -> DVec3 {
    let Some([p, q]) = dual(tangents(mesh, at)) else { return DVec3::ZERO };
    let (s, t) = (at.st.x, at.st.y);
    let room = match mesh.elements[at.element.0 as usize].corners {
        Corners::Triangle(_) => s.min(t).min(1.0 - s - t),
        Corners::Quad(_) => s.min(t).min(1.0 - s).min(1.0 - t),
    };
    let step = reference.step().min(room);
    let along = |d: DVec2| {
        let value = |st: DVec2| reference.luminance(mesh, SurfacePoint { st, ..at });
        (value(at.st + step * d) - value(at.st - step * d)) / (2.0 * step)
    };
    along(DVec2::X) * p + along(DVec2::Y) * q
}

fn wider(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Points of the elements that count, and the mean of each group (W/m^2).
pub(super) fn sample(
    mesh: &Mesh,
    group: &(impl Fn(ElementId) -> Option<usize> + Sync),
    reference: &impl Reference,
) -> (Vec<ElementPoint>, Vec<f64>) {
    // (place, area, value, gradient) of an element's points, and its range, corners included.
    let of = |e: u32| {
        let element = ElementId(e);
        group(element)?;
        let n_corners = mesh.elements[e as usize].corners.vertices().len();
        let corner = |k| SurfacePoint { element, st: corner_st(n_corners, k) };
        let at_corner = |k| reference.luminance(mesh, corner(k));
        let range =
            (0..n_corners).map(at_corner).fold([f64::INFINITY, f64::NEG_INFINITY], |r, y| wider(r, [y; 2]));
        let value = |(at, area): (SurfacePoint, f64)| {
            (at, area, reference.luminance(mesh, at), gradient(mesh, at, reference))
        };
        let points: Vec<_> = places(mesh, element).into_iter().map(value).collect();
        let range = points.iter().fold(range, |r, p| wider(r, [p.2; 2]));
        Some((points, range))
    };
    let sampled: Vec<_> = (0..mesh.elements.len() as u32).into_par_iter().map(of).collect();

    let mut sums: Vec<(f64, f64)> = Vec::new();
    for (e, found) in (0..).zip(&sampled) {
        let (Some((points, _)), Some(group)) = (found, group(ElementId(e))) else { continue };
        sums.resize(sums.len().max(group + 1), (0.0, 0.0));
        for (_, area, value, _) in points {
            sums[group].0 += area * value;
            sums[group].1 += area;
        }
    }
    let means: Vec<f64> = sums.iter().map(|(sum, area)| sum / area.max(f64::MIN_POSITIVE)).collect();

    let mut out = Vec::new();
    for (e, found) in (0..).zip(&sampled) {
        let (Some((points, own)), Some(group)) = (found, group(ElementId(e))) else { continue };
        let mean = means[group];
        if mean <= 0.0 {
            continue;
        }
        let vertices = mesh.elements[e as usize].corners.vertices();
        let around = vertices.iter().flat_map(|v| mesh.elements_around(*v));
        let ranges = around.filter_map(|n| sampled[n.0 as usize].as_ref().map(|(_, range)| *range));
        let range = ranges.fold(*own, wider).map(|y| y / mean);
        out.extend(points.iter().map(|&(at, area_m2, value, gradient)| ElementPoint {
            at,
            group,
            area_m2,
            mean,
            value: value / mean,
            gradient: gradient / mean,
            range,
        }));
    }
    (out, means)
}

/// The metrics that need no edges.
pub(super) fn measure(points: &[ElementPoint], mesh: &Mesh, field: &Reconstruction) -> Metrics {
    let at = |p: &ElementPoint| {
        let value = field.evaluate_unclamped(mesh, p.at).luminance() / p.mean;
        (value, luminance_gradient(field.gradient(mesh, p.at)) / p.mean)
    };
    let found: Vec<(f64, DVec3)> = points.par_iter().map(at).collect();
    let (mut area, mut squares, mut power, mut drift, mut negative) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut slopes, mut slope_errors) = (0.0, 0.0);
    let mut m = Metrics::default();
    for (p, (value, gradient)) in points.iter().zip(found) {
        let error = value - p.value;
        area += p.area_m2;
        squares += p.area_m2 * error * error;
        power += p.area_m2 * p.value;
        drift += p.area_m2 * error;
        negative += if value < 0.0 { p.area_m2 } else { 0.0 };
        slopes += p.area_m2 * p.gradient.length_squared();
        slope_errors += p.area_m2 * (gradient - p.gradient).length_squared();
        m.linf = m.linf.max(error.abs());
        m.overshoot = m.overshoot.max(p.range[0] - value).max(value - p.range[1]);
    }
    let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
    m.l2 = share(squares, area).sqrt();
    m.h1 = share(slope_errors, slopes).sqrt();
    m.negative_share = share(negative, area);
    m.energy_drift = share(drift, power);
    m
}
