//! One surface cut into planar patches; curved ones into facets whose areas sum to that of the true surface.
//!
//! ```text
//! Shape, Grid --> corner points + patches as indices into them, counter-clockwise seen from the front
//! ```
//! Quads are bilinear grids, even or graded toward their borders (`[meshing] edge_grading`), triangles similar triangles; sphere, cylinder and disk are latitude-longitude grids
//! whose quads are isosceles trapezoids, hence planar. Disks and cylinders on one axis line, however directed, use
//! one frame and one factor, so that a disk that closes a cylinder of its radius meets it corner to corner.
//!
//! Facets between points of the true surface lack area (a 32-gon 0.64 % of its disk), and with it power. So corners are
//! moved out until the area is right:
//! - disk: radius x sqrt(a / sin a), a = 2 pi / n around: its n-gon has exactly the disk's area;
//! - cylinder: the same factor, for rims to meet: a^2/24 too much, 0.07 % at the least count of 48;
//! - sphere: all rings but the poles, which stay, so that a sphere may stand on a floor: exactly the sphere's area, with
//!   corners 0.4 % of the radius outside of it at the least count.
//!
//! Why area: of a convex body the mean projected area over all directions is a quarter of its area (Cauchy 1832), so
//! mean form factors are right together with the power, and casters, kernels and the energy account all see one closed
//! polyhedron: furnaces stay exact. Normals of vertices are those of the true surface ([`true_normal`]).

use std::f64::consts::{PI, TAU};

use super::grading::Grading;
use super::plan::Grid;
use super::{Corners, VertexId, faces};
use crate::geom::{DVec3, tangent_frame};
use crate::scene::Shape;

/// Corner points of patches (m), and the patches.
#[derive(Default)]
pub(super) struct Tessellation {
    pub(super) points: Vec<DVec3>,
    pub(super) patches: Vec<Corners>,
    /// Per patch, true for one that stays a single element instead of 2 x 2, as a face that is no larger than the wanted
    /// element should; empty: none does. [`Grid::n_elements`] must count alike.
    pub(super) whole: Vec<bool>,
}

/// Cuts a shape by its grid (a grid of another kind gives nothing), quads as `grading` says.
pub(super) fn tessellate(shape: &Shape, grid: &Grid, grading: &Grading) -> Tessellation {
    match (shape, grid) {
        (Shape::Quad(v), &Grid::Quad { s, t }) => quad(*v, s as u32, t as u32, grading),
        (Shape::Triangle(v), &Grid::Triangle { n }) => triangle(*v, n as u32),
        (&Shape::Disk { center, normal, radius }, &Grid::Disk { around, rings }) => {
            disk(center, normal, radius, around as u32, rings as u32)
        }
        (&Shape::Sphere { center, radius, inward }, &Grid::Sphere { around, rows }) => {
            oriented(sphere(center, radius, around as u32, rows as u32), inward)
        }
        (&Shape::Cylinder { base, top, radius, inward }, &Grid::Cylinder { around, rows }) => {
            oriented(cylinder(base, top, radius, around as u32, rows as u32), inward)
        }
        (Shape::Faces(set), Grid::Faces(grid)) => faces::cut(set, grid),
        _ => Tessellation::default(),
    }
}

/// The true unit normal of a curved surface's front at (or near) a point of it; `None` for flat ones.
pub(super) fn true_normal(shape: &Shape, point: DVec3) -> Option<DVec3> {
    let (out, inward) = match *shape {
        Shape::Sphere { center, inward, .. } => (point - center, inward),
        Shape::Cylinder { base, top, inward, .. } => {
            let axis = (top - base).try_normalize()?;
            ((point - base).reject_from_normalized(axis), inward)
        }
        _ => return None,
    };
    let out = out.try_normalize()?;
    Some(if inward { -out } else { out })
}

impl Corners {
    /// The same corners seen from the other side.
    pub(super) fn flipped(self) -> Corners {
        match self {
            Corners::Triangle([a, b, c]) => Corners::Triangle([a, c, b]),
            Corners::Quad([a, b, c, d]) => Corners::Quad([a, d, c, b]),
        }
    }
}

fn oriented(mut cut: Tessellation, flip: bool) -> Tessellation {
    if flip {
        cut.patches.iter_mut().for_each(|p| *p = p.flipped());
    }
    cut
}

fn quad(v: [DVec3; 4], n: u32, m: u32, grading: &Grading) -> Tessellation {
    let mut points = Vec::with_capacity((n as usize + 1) * (m as usize + 1));
    for j in 0..=m {
        let t = grading.place(1, j, m);
        for i in 0..=n {
            let s = grading.place(0, i, n);
            points.push((1.0 - t) * ((1.0 - s) * v[0] + s * v[1]) + t * ((1.0 - s) * v[3] + s * v[2]));
        }
    }
    let at = |i: u32, j: u32| VertexId(j * (n + 1) + i);
    let patches = (0..m)
        .flat_map(|j| (0..n).map(move |i| (i, j)))
        .map(|(i, j)| Corners::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]))
        .collect();
    Tessellation { points, patches, whole: Vec::new() }
}

fn triangle(v: [DVec3; 3], n: u32) -> Tessellation {
    let side = f64::from(n);
    let mut points = Vec::new();
    let mut row_starts = Vec::new();
    for j in 0..=n {
        row_starts.push(points.len() as u32);
        for i in 0..=n - j {
            let (a, b, c) = (f64::from(n - i - j), f64::from(i), f64::from(j));
            points.push(a / side * v[0] + b / side * v[1] + c / side * v[2]);
        }
    }
    let at = |i: u32, j: u32| VertexId(row_starts[j as usize] + i);
    let mut patches = Vec::with_capacity(n as usize * n as usize);
    for j in 0..n {
        for i in 0..n - j {
            patches.push(Corners::Triangle([at(i, j), at(i + 1, j), at(i, j + 1)]));
            if i + 1 < n - j {
                patches.push(Corners::Triangle([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
            }
        }
    }
    Tessellation { points, patches, whole: Vec::new() }
}

/// One of `axis` and `-axis`, and whether it is `-axis`; noise in a component does not change the choice.
fn canonical_axis(axis: DVec3) -> (DVec3, bool) {
    let clean = DVec3::from_array(axis.to_array().map(|c| if c.abs() < 1e-9 { 0.0 } else { c }));
    let negative = [clean.z, clean.y, clean.x].into_iter().find(|&c| c != 0.0).is_some_and(|c| c < 0.0);
    // Adding zero turns a negative zero, which would choose another frame, into a positive one.
    ((if negative { -clean } else { clean }) + DVec3::ZERO, negative)
}

/// `around` points of the circle about `center` in the plane of the frame.
fn ring(center: DVec3, frame: (DVec3, DVec3), radius: f64, around: u32) -> impl Iterator<Item = DVec3> {
    (0..around).map(move |j| {
        let (sin, cos) = (TAU * f64::from(j) / f64::from(around)).sin_cos();
        center + radius * (cos * frame.0 + sin * frame.1)
    })
}

/// What the radius of `around` points is multiplied with, so that their polygon has the circle's area.
fn equal_area(around: u32) -> f64 {
    let angle = TAU / f64::from(around);
    (angle / angle.sin()).sqrt()
}

fn disk(center: DVec3, normal: DVec3, radius: f64, around: u32, rings: u32) -> Tessellation {
    let (axis, flip) = canonical_axis(normal);
    let frame = tangent_frame(axis);
    let mut points = vec![center];
    let rim = radius * equal_area(around);
    for k in 1..=rings {
        points.extend(ring(center, frame, rim * (f64::from(k) / f64::from(rings)), around));
    }
    let at = |k: u32, j: u32| VertexId(1 + (k - 1) * around + j % around);
    let mut patches: Vec<Corners> =
        (0..around).map(|j| Corners::Triangle([VertexId(0), at(1, j), at(1, j + 1)])).collect();
    for k in 1..rings {
        patches.extend(
            (0..around).map(|j| Corners::Quad([at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1)])),
        );
    }
    oriented(Tessellation { points, patches, whole: Vec::new() }, flip)
}

/// What all rings of a sphere but its poles are multiplied with, so that its facets have the sphere's area.
fn equal_area_sphere(around: u32, rows: u32) -> f64 {
    let half = PI / f64::from(around);
    // Ring k as (distance from the axis, height); the area of the facets between two rings.
    let point = |k: u32, out: f64| {
        let (sin, cos) = (PI * f64::from(k) / f64::from(rows)).sin_cos();
        let out = if k == 0 { 1.0 } else { out };
        (out * sin, out * cos)
    };
    let area = |out: f64| {
        // By symmetry the northern half twice, and of an odd count the middle row once.
        let row = |k: u32| {
            let ((r0, z0), (r1, z1)) = (point(k, out), point(k + 1, out));
            let slant = ((r1 - r0) * half.cos()).hypot(z1 - z0);
            f64::from(around) * half.sin() * (r0 + r1) * slant
        };
        let whole: f64 = (0..rows / 2).map(row).sum();
        2.0 * whole + if rows % 2 == 1 { row(rows / 2) } else { 0.0 }
    };
    // The poles' share is small: each step gains three digits.
    (0..12).fold(1.0, |out, _| out * (4.0 * PI / area(out)).sqrt())
}

fn sphere(center: DVec3, radius: f64, around: u32, rows: u32) -> Tessellation {
    let frame = (DVec3::X, DVec3::Y);
    let out = radius * equal_area_sphere(around, rows);
    let mut points = vec![center + radius * DVec3::Z];
    for k in 1..rows {
        let (sin, cos) = (PI * f64::from(k) / f64::from(rows)).sin_cos();
        points.extend(ring(center + out * cos * DVec3::Z, frame, out * sin, around));
    }
    points.push(center - radius * DVec3::Z);
    let at = |k: u32, j: u32| VertexId(1 + (k - 1) * around + j % around);
    let (north, south) = (VertexId(0), VertexId(1 + (rows - 1) * around));
    let mut patches: Vec<Corners> =
        (0..around).map(|j| Corners::Triangle([at(1, j), at(1, j + 1), north])).collect();
    for k in 1..rows - 1 {
        patches.extend(
            (0..around).map(|j| Corners::Quad([at(k + 1, j), at(k + 1, j + 1), at(k, j + 1), at(k, j)])),
        );
    }
    patches.extend((0..around).map(|j| Corners::Triangle([at(rows - 1, j + 1), at(rows - 1, j), south])));
    Tessellation { points, patches, whole: Vec::new() }
}

fn cylinder(base: DVec3, top: DVec3, radius: f64, around: u32, rows: u32) -> Tessellation {
    let (axis, swap) = canonical_axis((top - base).normalize_or(DVec3::Z));
    let frame = tangent_frame(axis.normalize_or(DVec3::Z));
    let (low, high) = if swap { (top, base) } else { (base, top) };
    let radius = radius * equal_area(around);
    let mut points = Vec::new();
    for k in 0..=rows {
        let z = f64::from(k) / f64::from(rows);
        points.extend(ring((1.0 - z) * low + z * high, frame, radius, around));
    }
    let at = |k: u32, j: u32| VertexId(k * around + j % around);
    let patches = (0..rows)
        .flat_map(|k| (0..around).map(move |j| (k, j)))
        .map(|(k, j)| Corners::Quad([at(k, j), at(k, j + 1), at(k + 1, j + 1), at(k + 1, j)]))
        .collect();
    Tessellation { points, patches, whole: Vec::new() }
}
