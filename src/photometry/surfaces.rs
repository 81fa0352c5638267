//! Grids on surfaces, in the surfaces' own (s,t), on the facets that casters know of them.
//!
//! ```text
//! quad      bilinear from corner 0, s to corner 1, t to corner 3
//! triangle  a quad whose first edge has shrunk to corner 0: t = (share of the way to the opposite side)^2, s along that side
//! disk      s = angle / 2 pi, t = (r / R)^2
//! sphere    s = azimuth / 2 pi, t = (1 + height / R) / 2
//! tube      s = angle / 2 pi, t along the axis
//! (s,t) --> point of the true surface --nearest facet--> point that is measured at, with the true normal
//! ```
//! Equal cells of all but skew quads have equal areas.

use std::f64::consts::{PI, TAU};

use super::grid::{Grid, GridError, GridSpec, Place, lay};
use crate::geom::{DVec3, tangent_frame};
use crate::mesh::{Mesh, PatchId};
use crate::scene::{Shape, Surface, SurfaceId};

/// Cell centres on the front of `surface`.
pub(super) fn lay_on(
    spec: &GridSpec,
    mesh: &Mesh,
    surface: &Surface,
    id: SurfaceId,
) -> Result<Grid, GridError> {
    let facets = Facets::of(mesh, id);
    let area_m2 = surface.shape.area_m2();
    if spec.border_m > 0.0 && !matches!(surface.shape, Shape::Quad(_)) {
        return Err(GridError::NoBorder { name: surface.name.clone() });
    }
    let lay = |size_m, place: &Place<'_>| {
        lay(spec, size_m, &|s, t| {
            let (at, normal, area_m2) = place(s, t);
            (facets.nearest(mesh, at), normal, area_m2)
        })
    };
    match surface.shape {
        Shape::Faces(_) => Err(GridError::Faces { name: surface.name.clone() }),
        Shape::Quad([a, b, c, d]) => {
            let mean = |x: DVec3, y: DVec3| 0.5 * (x.length() + y.length());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            lay([mean(b - a, c - d), mean(d - a, c - b)], &|s, t| {
                let along_s = (b - a).lerp(c - d, t);
                let along_t = (d - a).lerp(c - b, s);
                let at = (a + s * (b - a)).lerp(d + s * (c - d), t);
                (at, normal, along_s.cross(along_t).length())
            })
        }
        Shape::Triangle([a, b, c]) => {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            // Mean lengths: half the side opposite corner 0 across, the way from it to that side along.
            let size_m = [0.5 * (c - b).length(), (0.5 * (b + c) - a).length()];
            lay(size_m, &|s, t| (a + t.sqrt() * (b.lerp(c, s) - a), normal, area_m2))
        }
        Shape::Disk { center, normal, radius } => {
            let (x, y) = tangent_frame(normal);
            lay([PI * radius, radius], &|s, t| {
                let (sin, cos) = (TAU * s).sin_cos();
                (center + t.sqrt() * radius * (cos * x + sin * y), normal, area_m2)
            })
        }
        Shape::Sphere { center, radius, inward } => {
            // The mean width of a sphere's strips is pi/4 of its equator.
            lay([0.25 * PI * TAU * radius, PI * radius], &|s, t| {
                let (sin, cos) = (TAU * s).sin_cos();
                let z = 2.0 * t - 1.0;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let out = DVec3::new(r * cos, r * sin, z);
                (center + radius * out, if inward { -out } else { out }, area_m2)
            })
        }
        Shape::Cylinder { base, top, radius, inward } => {
            let axis = (top - base).normalize_or_zero();
            let (x, y) = tangent_frame(axis);
            lay([TAU * radius, (top - base).length()], &|s, t| {
                let (sin, cos) = (TAU * s).sin_cos();
                let out = cos * x + sin * y;
                (base.lerp(top, t) + radius * out, if inward { -out } else { out }, area_m2)
            })
        }
    }
}

/// The facets that casters know of a surface: points of a curved one lie on them, not on the true surface.
struct Facets {
    /// Patch, middle and largest distance of a corner from it (m).
    patches: Vec<(PatchId, DVec3, f64)>,
}

impl Facets {
    fn of(mesh: &Mesh, surface: SurfaceId) -> Facets {
        let patches = mesh.surfaces[surface.0 as usize].front.clone().map(|p| {
            let corners = mesh.polygon(&mesh.patches[p as usize].corners);
            let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let radius = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
            (PatchId(p), middle, radius)
        });
        Facets { patches: patches.collect() }
    }

    /// The nearest point of the facets; `point` itself where there are none.
    fn nearest(&self, mesh: &Mesh, point: DVec3) -> DVec3 {
        let mut best = (f64::INFINITY, point);
        for &(patch, middle, radius) in &self.patches {
            if middle.distance(point) - radius >= best.0 {
                continue;
            }
            let at = mesh.position(mesh.locate(patch, point));
            let distance = at.distance(point);
            if distance < best.0 {
                best = (distance, at);
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::GridPlace;
    use crate::photometry::grid::tests::{grid, spec};

    #[test]
    fn grids_on_surfaces_of_each_shape_cover_their_area_and_lie_on_their_facets() {
        let center = DVec3::new(2.0, 2.0, 1.0);
        let area = |g: &Grid| g.points.iter().map(|p| p.area_m2).sum::<f64>();
        let of = |name: &str| grid(&spec(GridPlace::Surface(name.to_owned()))).unwrap();
        let (ball, dome, lamp) = (of("ball"), of("dome"), of("lamp"));
        let near =
            |value: f64, expected: f64| assert!((value - expected).abs() < 1e-9, "{value}, {expected}");
        near(area(&ball), 4.0 * PI * 0.25);
        near(area(&dome), 4.0 * PI * 0.36);
        near(area(&lamp), PI * 0.04);
        near(area(&of("column")), TAU * 0.2 * 3.0);
        near(area(&of("sail")), 0.5);
        near(area(&of("floor")), 20.0);
        for p in &ball.points {
            // Facets lie inside the sphere, by their sagitta at most, but for their corners, up to 0.4 % outside.
            let r = p.at.distance(center);
            assert!(r <= 0.5 * 1.004 && r > 0.45, "{r}");
            assert!((p.at - center).normalize().dot(p.normal) > 0.99);
        }
        assert!(dome.points.iter().all(|p| (center - p.at).dot(p.normal) > 0.0));
        assert!(lamp.points.iter().all(|p| p.normal == DVec3::NEG_Z && p.at.distance(center) < 0.2));
        let sail = of("sail");
        assert!(sail.points.iter().all(|p| p.at.x > 1.0 && p.at.y > 1.0 && p.at.x + p.at.y < 3.0));
    }
}
