//! Closed forms that pass 1 is measured against, written apart from the solver: they share no code with it.
//!
//! ```text
//! lengths (m) --formula--> view factor, form factor of a point, visible share
//! ```
//! Source: Howell, Menguc, Daun, Siegel, A Catalog of Radiation Heat Transfer Configuration Factors; Ehlert, Smith 1993
//! (rectangles in general position); Lambert 1760 (point to polygon). Each is checked against an integral or another form in
//! the tests of this folder.

use std::f64::consts::{PI, TAU};

use crate::geom::DVec3;

/// A side of a rectangle along one axis: from, to (m).
pub type Span = [f64; 2];

/// Sum of `g` over the 16 combinations of corners, each with its sign.
fn over_corners(a: [Span; 2], b: [Span; 2], g: impl Fn(f64, f64, f64, f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for corner in 0..16_usize {
        let [i, j, k, l] = [corner & 1, corner >> 1 & 1, corner >> 2 & 1, corner >> 3];
        let sign = if (i + j + k + l) % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * g(a[0][i], a[1][j], b[0][k], b[1][l]);
    }
    sum
}

/// View factor between parallel rectangles at a distance: `a` and `b` are their spans along two axes. Source: Ehlert, Smith.
pub fn parallel_rectangles(a: [Span; 2], b: [Span; 2], distance: f64) -> f64 {
    let z2 = distance * distance;
    let g = |x: f64, y: f64, xi: f64, eta: f64| {
        let (dx, dy) = (x - xi, y - eta);
        let (px, py) = ((dx * dx + z2).sqrt(), (dy * dy + z2).sqrt());
        (dy * px * (dy / px).atan() + dx * py * (dx / py).atan() - 0.5 * z2 * (dx * dx + dy * dy + z2).ln())
            / TAU
    };
    over_corners(a, b, g) / area(a)
}

/// View factor from a rectangle in the plane z = 0 (spans: x, y) to one in the plane x = 0 (spans: z, y). Source: Ehlert,
/// Smith.
pub fn perpendicular_rectangles(a: [Span; 2], b: [Span; 2]) -> f64 {
    let g = |x: f64, y: f64, xi: f64, eta: f64| {
        let (c2, dy) = (x * x + xi * xi, y - eta);
        let (c, r2) = (c2.sqrt(), c2 + dy * dy);
        let log = if r2 > 0.0 { (c2 - dy * dy) * r2.ln() } else { 0.0 };
        let arc = if c > 0.0 { dy * c * (dy / c).atan() } else { 0.0 };
        (arc - 0.25 * log) / TAU
    };
    over_corners(a, b, g) / area(a)
}

fn area([s, t]: [Span; 2]) -> f64 {
    (s[1] - s[0]) * (t[1] - t[0])
}

/// From a disk of radius `r1` to a coaxial one of radius `r2` at distance `h`. Howell C-41.
pub fn coaxial_disks(r1: f64, r2: f64, h: f64) -> f64 {
    let (r1, r2) = (r1 / h, r2 / h);
    let x = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
    0.5 * (x - (x * x - 4.0 * (r2 / r1).powi(2)).sqrt())
}

/// From a sphere to the rectangle `a` x `b` at distance `d` from its centre, one corner on the axis: the solid angle over
/// 4 pi, whatever the radius.
pub fn sphere_to_rectangle(a: f64, b: f64, d: f64) -> f64 {
    let (d1, d2) = (d / a, d / b);
    (1.0 / (d1 * d1 + d2 * d2 + d1 * d1 * d2 * d2).sqrt()).atan() / (4.0 * PI)
}

/// From the inside of a cylinder to one of the disks that close it: all that leaves a disk and misses the other meets it.
pub fn cylinder_to_base(r: f64, h: f64) -> f64 {
    PI * r * r / (TAU * r * h) * (1.0 - coaxial_disks(r, r, h))
}

/// Form factor of a point to a parallel rectangle `distance` away, spans measured from the point's foot.
pub fn point_to_parallel(x: Span, y: Span, distance: f64) -> f64 {
    let corner = |a: f64, b: f64| {
        let (a, b) = (a / distance, b / distance);
        let part = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
        (part(a, b) + part(b, a)) / TAU
    };
    corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0])
}

/// Form factor of a point to a rectangle that stands on its horizon or above, at right angles to the receiver's plane and
/// `distance` away: spans along the plane (measured from the foot) and upwards.
pub fn point_to_perpendicular(along: Span, up: Span, distance: f64) -> f64 {
    let corner = |w: f64, h: f64| {
        let s = h.hypot(distance);
        ((w / distance).atan() - distance / s * (w / s).atan()) / TAU
    };
    corner(along[1], up[1]) - corner(along[0], up[1]) - corner(along[1], up[0]) + corner(along[0], up[0])
}

/// Form factor of a point to a parallel disk over it. Howell B-12.
pub fn point_to_disk(r: f64, h: f64) -> f64 {
    r * r / (r * r + h * h)
}

/// Lambert's formula, for a polygon wholly above the horizon, counter-clockwise seen from the point.
fn lambert(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let r: Vec<DVec3> = polygon.iter().map(|v| *v - point).collect();
    let edge = |k: usize| {
        let (a, b) = (r[k], r[(k + 1) % r.len()]);
        let cross = a.cross(b);
        -cross.length().atan2(a.dot(b)) * normal.dot(cross.normalize_or_zero())
    };
    (0..r.len()).map(edge).sum::<f64>() / TAU
}

/// Form factor of a point to what a convex blocker leaves of a convex polygon, both wholly above the horizon and
/// counter-clockwise seen from the point, the blocker nearer: the polygon's less that of the part of the blocker that lies
/// before it.
pub fn visible_polygon(point: DVec3, normal: DVec3, polygon: &[DVec3], blocker: &[DVec3]) -> f64 {
    let mut part = blocker.to_vec();
    for k in 0..polygon.len() {
        let (a, b) = (polygon[k] - point, polygon[(k + 1) % polygon.len()] - point);
        // Counter-clockwise seen from the point: the inside lies where this is negative.
        let side = a.cross(b);
        part = clipped(&part, |v| -(v - point).dot(side));
    }
    let hidden = if part.len() < 3 { 0.0 } else { lambert(point, normal, &part) };
    lambert(point, normal, polygon) - hidden
}

/// The part of a convex polygon where `height` is not negative (Sutherland, Hodgman 1974).
fn clipped(polygon: &[DVec3], height: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut out = Vec::new();
    for k in 0..polygon.len() {
        let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            out.push(a);
        }
        if (ha >= 0.0) != (hb >= 0.0) {
            out.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    out
}

/// Mean of a function over the rectangle of two spans: midpoints of `n` x `n` cells.
pub fn mean_over(x: Span, y: Span, n: u32, f: impl Fn(f64, f64) -> f64) -> f64 {
    let at = |span: Span, i: u32| span[0] + (span[1] - span[0]) * (f64::from(i) + 0.5) / f64::from(n);
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    cells.map(|(i, j)| f(at(x, i), at(y, j))).sum::<f64>() / f64::from(n * n)
}
