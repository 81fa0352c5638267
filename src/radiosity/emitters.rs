//! Emitting surfaces of many patches, cut into few polygons of their own: the kernel is exact for any size of source.
//!
//! ```text
//! Scene, Mesh --quads that emit, of more than 36 patches--> about 36 polygons each, near squares --> shots
//! ```
//! A finely meshed lamp has thousands of patches of the same exitance, each of which would need a shot over the whole
//! scene. Each polygon is looked at by one ray an element, so that 36 of them sample a penumbra.
//! Not modelled: triangles, disks and curved surfaces, whose patches shoot one by one.

use glam::DVec3;

use crate::mesh::{Mesh, Patch};
use crate::scene::{Scene, Shape, SurfaceId};

/// Polygons that a surface is cut into, about.
const N_POLYGONS: f64 = 36.0;
/// Surfaces of at most so many patches are left as they are.
const MAX_PATCHES: usize = 36;

/// A part of an emitting surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emitter {
    pub surface: SurfaceId,
    /// Corners (m), counter-clockwise seen from the side that shines.
    pub corners: [DVec3; 4],
    /// Unit normal of that side.
    pub normal: DVec3,
    pub area_m2: f64,
    /// Patches of the whole side: first, and one past the last.
    pub patches: (u32, u32),
    /// The last part of its side.
    pub is_last: bool,
}

/// The parts of all surfaces that are worth cutting, in scene order.
pub(super) fn of(scene: &Scene, mesh: &Mesh) -> Vec<Emitter> {
    let mut emitters = Vec::new();
    for (s, (surface, patches)) in scene.surfaces.iter().zip(&mesh.surfaces).enumerate() {
        let Shape::Quad(corners) = surface.shape else { continue };
        for side in [&patches.front, &patches.back] {
            if surface.exitance.is_black() || side.len() <= MAX_PATCHES {
                continue;
            }
            let Patch { normal, .. } = mesh.patches[side.start as usize];
            cut(SurfaceId(s as u32), corners, normal, (side.start, side.end), &mut emitters);
        }
    }
    emitters
}

/// Cuts the side of a quad that looks along `normal`.
fn cut(surface: SurfaceId, quad: [DVec3; 4], normal: DVec3, patches: (u32, u32), out: &mut Vec<Emitter>) {
    let [a, b, c, d] = quad;
    let facing = (c - a).cross(d - b).dot(normal) > 0.0;
    let [a, b, c, d] = if facing { quad } else { [a, d, c, b] };
    let (along_s, along_t) = ((b - a).length() + (c - d).length(), (d - a).length() + (c - b).length());
    let n_s = (N_POLYGONS * along_s / along_t).sqrt().round().clamp(1.0, N_POLYGONS);
    let n_t = (N_POLYGONS / n_s).ceil();
    let at = |i: u32, j: u32| {
        let (s, t) = (f64::from(i) / n_s, f64::from(j) / n_t);
        (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * d + s * c)
    };
    for j in 0..n_t as u32 {
        for i in 0..n_s as u32 {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let area_m2 = 0.5 * (corners[2] - corners[0]).cross(corners[3] - corners[1]).length();
            out.push(Emitter { surface, corners, normal, area_m2, patches, is_last: false });
        }
    }
    if let Some(last) = out.last_mut() {
        last.is_last = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cut_of_a_long_quad_covers_it_with_near_squares_that_face_the_asked_side() {
        let v = DVec3::new;
        let quad = [v(0., 0., 1.), v(6., 0., 1.), v(6., 1., 1.), v(0., 1., 1.)];
        for normal in [DVec3::Z, -DVec3::Z] {
            let mut parts = Vec::new();
            cut(SurfaceId(3), quad, normal, (5, 99), &mut parts);
            let total: f64 = parts.iter().map(|p| p.area_m2).sum();
            assert!((total - 6.0).abs() < 1e-12, "{total}");
            assert!((30..=48).contains(&parts.len()), "{}", parts.len());
            for (k, part) in parts.iter().enumerate() {
                let [a, b, c, d] = part.corners;
                assert!((c - a).cross(d - b).dot(normal) > 0.0);
                let ratio = (b - a).length() / (d - a).length();
                assert!((0.5..=2.0).contains(&ratio), "{ratio}");
                assert_eq!((part.is_last, part.patches), (k + 1 == parts.len(), (5, 99)));
            }
        }
    }
}
