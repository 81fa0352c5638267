//! Checks of shapes: no zero areas, quads planar and convex.
//!
//! Lengths are compared with the longest edge, so that a check does not depend on the unit of length.

use glam::DVec3;

use super::super::Shape;

/// Largest distance of a quad's fourth corner from the plane of the other three, over its longest edge.
pub(super) const MAX_NON_PLANARITY: f64 = 1e-6;

/// Smallest height of a corner's triangle over its longest edge: below it three points are one line.
const MIN_HEIGHT: f64 = 1e-9;

/// A fault of a shape; its caller knows where it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct GeometryFault {
    /// Value and expectation.
    pub(super) message: String,
    /// What to write instead.
    pub(super) help: Option<&'static str>,
}

fn fault<T>(message: impl Into<String>) -> Result<T, GeometryFault> {
    Err(GeometryFault { message: message.into(), help: None })
}

/// A planar convex quad.
pub(super) fn quad(v: [DVec3; 4]) -> Result<Shape, GeometryFault> {
    let edge = |i: usize| v[(i + 1) % 4] - v[i % 4];
    let size = (0..4).map(|i| edge(i).length()).fold(0.0, f64::max);
    if let Some(i) = (0..4).find(|&i| edge(i).length() <= MIN_HEIGHT * size) {
        return fault(format!(
            "corners {} and {} of the quad are one point, {}: expected four corners (zero area)",
            i + 1,
            (i + 1) % 4 + 1,
            v[i]
        ));
    }
    // Normal at each corner, twice the area of the triangle that it spans with its neighbours.
    let corner = [0, 1, 2, 3].map(|i| edge(i + 3).cross(edge(i)));
    let largest = (0..4).max_by(|&a, &b| corner[a].length().total_cmp(&corner[b].length())).unwrap_or(0);
    let Some(normal) = corner[largest].try_normalize().filter(|_| height(corner[largest], size) > MIN_HEIGHT)
    else {
        return fault("the corners of the quad lie on one line: zero area");
    };
    let off_plane = (v[(largest + 2) % 4] - v[largest]).dot(normal).abs() / size;
    if off_plane > MAX_NON_PLANARITY {
        return Err(GeometryFault {
            message: format!(
                "quad is not planar: its fourth corner is {off_plane:.3e} of its size ({:.3} %) off the plane \
                 of the others, expected at most {MAX_NON_PLANARITY:e}",
                100.0 * off_plane
            ),
            help: Some("write it as two triangles in one smooth_group"),
        });
    }
    let turn = corner.map(|c| c.dot(normal) / (size * size));
    let n_inward = turn.iter().filter(|t| **t < -MIN_HEIGHT).count();
    let at = |test: fn(f64) -> bool| turn.iter().position(|t| test(*t)).unwrap_or(0);
    match n_inward {
        0 if turn.iter().all(|t| *t > MIN_HEIGHT) => Ok(Shape::Quad(v)),
        0 => {
            let i = at(|t| t <= MIN_HEIGHT);
            fault(format!(
                "corner {} of the quad, {}, lies on the line between its neighbours, expected a triangle",
                i + 1,
                v[i]
            ))
        }
        // Of a concave quad one corner turns the other way; of a crossed one two do.
        2 => fault("edges of the quad cross each other, expected corners in order around it"),
        _ => {
            let odd = if n_inward == 1 { at(|t| t < -MIN_HEIGHT) } else { at(|t| t > MIN_HEIGHT) };
            Err(GeometryFault {
                message: format!("quad is concave at corner {}, {}, expected a convex one", odd + 1, v[odd]),
                help: Some("write it as two triangles that share the diagonal at that corner"),
            })
        }
    }
}

/// A triangle with an area.
pub(super) fn triangle(v: [DVec3; 3]) -> Result<Shape, GeometryFault> {
    let size = (0..3).map(|i| (v[(i + 1) % 3] - v[i]).length()).fold(0.0, f64::max);
    if height((v[1] - v[0]).cross(v[2] - v[0]), size) > MIN_HEIGHT {
        return Ok(Shape::Triangle(v));
    }
    fault("the corners of the triangle lie on one line: zero area")
}

/// A disk with a direction.
pub(super) fn disk(center: DVec3, normal: DVec3, radius: f64) -> Result<Shape, GeometryFault> {
    let Some(unit) = normal.try_normalize() else {
        return fault(format!("disk normal {normal} has no direction"));
    };
    curved(Shape::Disk { center, normal: unit, radius })
}

/// A sphere.
pub(super) fn sphere(center: DVec3, radius: f64, inward: bool) -> Result<Shape, GeometryFault> {
    curved(Shape::Sphere { center, radius, inward })
}

/// An open tube with a length.
pub(super) fn cylinder(base: DVec3, top: DVec3, radius: f64, inward: bool) -> Result<Shape, GeometryFault> {
    if (top - base).try_normalize().is_none() {
        return fault(format!("cylinder top {top} is its base, expected another point (zero area)"));
    }
    curved(Shape::Cylinder { base, top, radius, inward })
}

/// A radius can be so small that its square is 0.
fn curved(shape: Shape) -> Result<Shape, GeometryFault> {
    if shape.area_m2() >= f64::MIN_POSITIVE { Ok(shape) } else { fault("zero area: the radius is too small") }
}

/// Height over `size` of the triangle whose doubled area vector is `cross`; 0 when that underflows.
fn height(cross: DVec3, size: f64) -> f64 {
    let h = cross.length() / (size * size);
    if h.is_finite() { h } else { 0.0 }
}
