//! What every method answers: value and gradient at a place on the mesh.

use std::fmt::Debug;

use crate::geom::DVec3;
use crate::mesh::{Corners, Mesh, SurfacePoint};
use crate::units::Rgb;

/// A field over a mesh.
pub(super) trait Field: Debug + Send + Sync {
    /// The value (W/m^2), not clamped.
    fn value(&self, mesh: &Mesh, at: SurfacePoint) -> Rgb;

    /// The world gradient (W/m^3), tangential to the element.
    fn gradient(&self, mesh: &Mesh, at: SurfacePoint) -> [Rgb; 3];

    /// Memory held (bytes).
    fn memory_bytes(&self) -> usize;
}

/// The vector in the plane of `x_s` and `x_t` whose products with them are `f_s` and `f_t`, channel by channel; zero where
/// they span no plane.
pub(super) fn world_gradient([x_s, x_t]: [DVec3; 2], [f_s, f_t]: [Rgb; 2]) -> [Rgb; 3] {
    let normal = x_s.cross(x_t);
    let square = normal.length_squared();
    if square == 0.0 {
        return [Rgb::BLACK; 3];
    }
    let (a, b) = (x_t.cross(normal) / square, normal.cross(x_s) / square);
    [f_s * a.x + f_t * b.x, f_s * a.y + f_t * b.y, f_s * a.z + f_t * b.z]
}

/// x_s and x_t at (s,t) of a bilinear quad.
pub(super) fn quad_tangents(x: &[DVec3; 4], s: f64, t: f64) -> [DVec3; 2] {
    [(1.0 - t) * (x[1] - x[0]) + t * (x[2] - x[3]), (1.0 - s) * (x[3] - x[0]) + s * (x[2] - x[1])]
}

/// Corner positions (m); of a triangle the last one twice.
pub(super) fn corner_positions(mesh: &Mesh, corners: &Corners) -> [DVec3; 4] {
    let at = |v: crate::mesh::VertexId| mesh.vertices[v.0 as usize].position;
    match *corners {
        Corners::Triangle([a, b, c]) => [a, b, c, c].map(at),
        Corners::Quad(v) => v.map(at),
    }
}
