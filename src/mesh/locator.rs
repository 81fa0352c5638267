//! Where hits lie, for passes of many million: a cache line a patch instead of its corners and elements.
//!
//! ```text
//! patch, point p --(s,t) = (a . p + a0, b . p + b0)--> quarter --> element, (s,t) there
//! ```
//! Of parallelograms and triangles that are cut once or not at all; all others go through [`Mesh::locate`], of which the
//! answers are those of this one but for rounding.

use glam::DVec2;

use super::{Corners, ElementId, Mesh, Patch, PatchId, SurfacePoint, quarter_of};
use crate::geom::DVec3;

/// Square of the bend over that of the shorter side, up to which a quad counts as a parallelogram.
const BEND_SHARE: f64 = 1e-24;

/// (s,t) of a patch as affine functions of the place.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Affine {
    a: DVec3,
    a0: f64,
    b: DVec3,
    b0: f64,
}

/// A patch that is simple enough.
#[derive(Clone, Copy, Debug)]
struct Simple {
    first: u32,
    is_cut: bool,
    is_triangle: bool,
}

/// Answers [`Mesh::locate`] from 72 bytes a patch.
#[derive(Clone, Debug)]
pub(crate) struct Locator {
    affine: Vec<Affine>,
    simple: Vec<Option<Simple>>,
}

impl Locator {
    pub(crate) fn new(mesh: &Mesh) -> Locator {
        let (affine, simple) = mesh.patches.iter().map(|patch| cell(mesh, patch)).unzip();
        Locator { affine, simple }
    }

    pub(crate) const fn bytes_per_patch() -> usize {
        size_of::<Affine>() + size_of::<Option<Simple>>()
    }

    /// Where on the patch the point lies; a point outside is moved to the border.
    pub(crate) fn locate(&self, mesh: &Mesh, patch: PatchId, point: DVec3) -> SurfacePoint {
        let Some(Simple { first, is_cut, is_triangle }) = self.simple[patch.0 as usize] else {
            return mesh.locate(patch, point);
        };
        let Affine { a, a0, b, b0 } = self.affine[patch.0 as usize];
        let st = DVec2::new(a.dot(point) + a0, b.dot(point) + b0).clamp(DVec2::ZERO, DVec2::ONE);
        if is_triangle && st.x + st.y > 1.0 {
            return mesh.locate(patch, point);
        }
        if !is_cut {
            return SurfacePoint { element: ElementId(first), st };
        }
        let (quarter, st) = quarter_of(is_triangle, st);
        SurfacePoint { element: ElementId(first + quarter), st }
    }
}

fn cell(mesh: &Mesh, patch: &Patch) -> (Affine, Option<Simple>) {
    let (origin, x, y, bend) = match patch.corners {
        Corners::Triangle(v) => {
            let [o, p, q] = v.map(|v| mesh.at(v));
            (o, p - o, q - o, DVec3::ZERO)
        }
        Corners::Quad(v) => {
            let [o, p, r, q] = v.map(|v| mesh.at(v));
            (o, p - o, q - o, o - p + r - q)
        }
    };
    // Dual vectors of the plane.
    let n = x.cross(y);
    let (a, b) = (y.cross(n) / n.length_squared(), n.cross(x) / n.length_squared());
    let affine = Affine { a, a0: -a.dot(origin), b, b0: -b.dot(origin) };
    let n_elements = patch.elements.len();
    let own = &mesh.elements[patch.elements.start as usize..patch.elements.end as usize];
    let is_even = n_elements == 1 || (n_elements == 4 && own.iter().all(|e| e.place.level() == 1));
    let is_flat = bend.length_squared() <= BEND_SHARE * x.length_squared().min(y.length_squared());
    let simple = Simple {
        first: patch.elements.start,
        is_cut: n_elements == 4,
        is_triangle: matches!(patch.corners, Corners::Triangle(_)),
    };
    (affine, (is_even && is_flat && a.is_finite() && b.is_finite()).then_some(simple))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::{scene, surface};
    use crate::scene::{MeshTarget, Shape};

    #[test]
    fn locator_answers_as_the_mesh_does() {
        let v = DVec3::new;
        let shapes = [
            Shape::Quad([v(0.3, 0., 0.), v(2., 0.5, 0.1), v(2.2, 1.5, 0.9), v(0.5, 1.0, 0.8)]),
            Shape::Quad([v(0., 0., 3.), v(1., 0., 3.), v(2., 1.5, 3.), v(0., 1., 3.)]),
            Shape::Triangle([v(0., 0., 5.), v(1., 0.2, 5.5), v(0.1, 1., 4.0)]),
        ];
        let surfaces = shapes.into_iter().enumerate().map(|(i, s)| surface(&format!("s{i}"), s)).collect();
        let mesh = Mesh::build(&scene(surfaces, MeshTarget::Elements(200)));
        let locator = Locator::new(&mesh);
        let n_simple = locator.simple.iter().flatten().count();
        assert!(n_simple > mesh.patches.len() / 2 && n_simple < mesh.patches.len(), "{n_simple}");
        let mut n = 0;
        for (e, element) in mesh.elements.iter().enumerate() {
            for st in [[0.2, 0.3], [0.6, 0.1], [0.05, 0.9], [0.3, 0.6]] {
                let at = SurfacePoint { element: ElementId(e as u32), st: DVec2::from_array(st) };
                let found = locator.locate(&mesh, element.patch, mesh.position(at));
                assert_eq!(found.element, at.element, "{st:?}");
                assert!((found.st - at.st).length() < 1e-9, "{found:?} {at:?}");
                n += 1;
            }
        }
        assert!(n >= 400);
        // Outside, as where a hit was rounded.
        for (p, patch) in mesh.patches.iter().enumerate() {
            let corner = mesh.polygon(&patch.corners)[0];
            let centre =
                mesh.polygon(&patch.corners).iter().sum::<DVec3>() / patch.corners.vertices().len() as f64;
            let point = corner + 1e-7 * (corner - centre);
            let (found, expected) =
                (locator.locate(&mesh, PatchId(p as u32), point), mesh.locate(PatchId(p as u32), point));
            assert_eq!(found.element, expected.element);
            assert!((found.st - expected.st).length() < 1e-6, "{found:?} {expected:?}");
        }
    }
}
