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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_vector() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0f64, -1.0..1.0, -1.0..1.0].prop_map(DVec3::from_array)
    }

    /// Four points in order around a circle, in any plane, place and size: planar and convex.
    fn convex_quad() -> impl Strategy<Value = [DVec3; 4]> {
        let angles = [0.1..1.4f64, 1.7..3.0, 3.3..4.5, 4.8..6.1];
        (angles, any_vector(), any_vector(), -3i32..3).prop_filter_map(
            "a frame",
            |(angles, normal, shift, power)| {
                let (u, v) = crate::geom::tangent_frame(normal.try_normalize()?);
                let size = 10f64.powi(power);
                Some(angles.map(|a| size * (shift + a.cos() * u + a.sin() * v)))
            },
        )
    }

    proptest! {
        #[test]
        fn quad_of_points_around_a_circle_is_accepted_either_way_round(v in convex_quad()) {
            prop_assert_eq!(quad(v), Ok(Shape::Quad(v)));
            let reversed = [v[3], v[2], v[1], v[0]];
            prop_assert_eq!(quad(reversed), Ok(Shape::Quad(reversed)));
        }

        #[test]
        fn quad_with_swapped_corners_crosses_itself(v in convex_quad(), which in 0usize..4) {
            let mut crossed = v;
            crossed.swap(which, (which + 1) % 4);
            let fault = quad(crossed).unwrap_err();
            prop_assert!(fault.message.contains("cross each other"), "{}", fault.message);
        }

        #[test]
        fn quad_with_a_corner_pushed_beyond_the_diagonal_is_concave_there(
            v in convex_quad(), which in 0usize..4, share in 0.05..0.8f64
        ) {
            // From the diagonal's middle towards the opposite corner: inside the other triangle.
            let (previous, next, opposite) = (v[(which + 3) % 4], v[(which + 1) % 4], v[(which + 2) % 4]);
            let middle = 0.5 * (previous + next);
            let mut dented = v;
            dented[which] = middle + share * (opposite - middle);
            let fault = quad(dented).unwrap_err();
            prop_assert!(
                fault.message.contains(&format!("concave at corner {}", which + 1)), "{}", fault.message
            );
        }

        #[test]
        fn quad_with_a_lifted_corner_is_refused_above_the_tolerance_and_accepted_below(
            v in convex_quad(), which in 0usize..4
        ) {
            let size = (0..4).map(|i| (v[(i + 1) % 4] - v[i]).length()).fold(0.0, f64::max);
            let normal = (v[2] - v[0]).cross(v[3] - v[1]).normalize();
            let lifted = |by: f64| {
                let mut lifted = v;
                lifted[which] += by * size * normal;
                quad(lifted)
            };
            // The distance of a corner from the plane of three others is within a factor of the lift.
            prop_assert!(lifted(1e-9).is_ok());
            let fault = lifted(1e-3).unwrap_err();
            prop_assert!(fault.message.contains("not planar"), "{}", fault.message);
        }

        #[test]
        fn triangle_of_three_points_on_a_line_has_no_area(a in any_vector(), d in any_vector(), k in 0.1..5.0f64) {
            prop_assume!(d.length() > 0.1);
            prop_assert!(triangle([a, a + d, a + k * d]).is_err());
            let aside = d.any_orthogonal_vector();
            prop_assert!(triangle([a, a + d, a + 0.5 * d + 1e-3 * aside]).is_ok());
        }
    }

    #[test]
    fn quad_of_the_measured_red_wall_is_off_its_plane_by_0_57_percent() {
        let p = DVec3::new;
        let wall = [p(552.8, 0., 0.), p(549.6, 0., 559.2), p(556., 548.8, 559.2), p(556., 548.8, 0.)];
        let fault = quad(wall).unwrap_err();
        assert!(fault.message.contains("0.57"), "{}", fault.message);
        assert!(fault.help.is_some_and(|h| h.contains("two triangles")));
    }

    #[test]
    fn disk_normal_of_any_length_becomes_unit() {
        let Ok(Shape::Disk { normal, .. }) = disk(DVec3::ZERO, DVec3::new(0.0, 0.0, -1e-9), 1.0) else {
            panic!("a disk");
        };
        assert!((normal - DVec3::NEG_Z).length() < 1e-15);
    }
}
