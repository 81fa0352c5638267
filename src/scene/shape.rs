//! Shapes: their areas, of the true surface, not of the facets that it is meshed into; the polygons among them.

use std::f64::consts::PI;

use glam::DVec3;

use super::Shape;

impl Shape {
    /// The corners of a plane polygon; none of round and many-faced shapes.
    pub fn polygon(&self) -> Option<&[DVec3]> {
        match self {
            Shape::Quad(corners) => Some(corners),
            Shape::Triangle(corners) => Some(corners),
            _ => None,
        }
    }

    /// Area of one side (m^2).
    pub fn area_m2(&self) -> f64 {
        match self {
            // Planar: half the cross product of the diagonals.
            Shape::Quad(v) => 0.5 * (v[2] - v[0]).cross(v[3] - v[1]).length(),
            Shape::Triangle(v) => 0.5 * (v[1] - v[0]).cross(v[2] - v[0]).length(),
            Shape::Disk { radius, .. } => PI * radius * radius,
            Shape::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Shape::Cylinder { base, top, radius, .. } => 2.0 * PI * radius * (*top - *base).length(),
            Shape::Faces(faces) => faces.area_m2(),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn area_of_each_shape_is_its_closed_form() {
        let p = DVec3::new;
        let cases = [
            (Shape::Quad([p(0., 0., 0.), p(3., 0., 0.), p(2., 2., 0.), p(1., 2., 0.)]), 4.0),
            (Shape::Triangle([p(0., 0., 1.), p(3., 0., 1.), p(0., 4., 1.)]), 6.0),
            (Shape::Disk { center: p(1., 1., 1.), normal: DVec3::Z, radius: 2.0 }, 4.0 * PI),
            (Shape::Sphere { center: p(1., 1., 1.), radius: 0.5, inward: true }, PI),
            (Shape::Cylinder { base: p(0., 0., 0.), top: p(0., 3., 4.), radius: 0.1, inward: false }, PI),
        ];
        for (shape, area) in cases {
            assert!((shape.area_m2() - area).abs() < 1e-12 * area, "{shape:?}: {}", shape.area_m2());
        }
    }
}
