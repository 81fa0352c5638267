//! Where hits lie, for passes of many million: one cache line a patch instead of its corners and elements.
//!
//! ```text
//! patch, point p --q = p - o, (x,y) = (a . q, b . q)--> s + s t d_x = x, t + s t d_y = y --> quarter --> element, (s,t) there
//! ```
//! Of patches that are cut once or not at all; all others go through [`Mesh::locate`], of which the answers are those of
//! this one but for rounding: a, b and d are f32, so (s,t) are off by 1e-7 times the patch's slenderness.

use glam::{DVec2, Vec2, Vec3};

use super::{Corners, ElementId, Mesh, Patch, PatchId, SurfacePoint, inverse, quarter_of};
use crate::geom::DVec3;
use crate::huge_pages::move_table;

/// A quad that is bent by less of its edges is a parallelogram: as little as what f32 rounds.
const LEAST_BEND: f32 = 1.0 / (1 << 24) as f32;

/// (s,t) of a patch from the place.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Cell {
    /// The first corner (m).
    origin: DVec3,
    /// Dual vectors of its edges, in its plane (1/m).
    a: Vec3,
    b: Vec3,
    /// What a quad is bent by, in its edges.
    bend: Vec2,
    /// The first element.
    first: u32,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Quad,
    CutQuad,
    Triangle,
    CutTriangle,
    /// Cut further, or without an area: [`Mesh::locate`] knows.
    Other,
}

/// Answers [`Mesh::locate`] from 64 bytes a patch.
#[derive(Clone, Debug)]
pub(crate) struct Locator {
    cells: Vec<Cell>,
}

impl Locator {
    pub(crate) fn new(mesh: &Mesh) -> Locator {
        let cells: Vec<Cell> = mesh.patches.iter().map(|patch| Cell::of(mesh, patch)).collect();
        move_table(&cells);
        Locator { cells }
    }

    pub(crate) const fn bytes_per_patch() -> usize {
        size_of::<Cell>()
    }

    /// Where on the patch the point lies; a point outside is moved to the border.
    pub(crate) fn locate(&self, mesh: &Mesh, patch: PatchId, point: DVec3) -> SurfacePoint {
        let cell = &self.cells[patch.0 as usize];
        let q = point - cell.origin;
        let flat = DVec2::new(cell.a.as_dvec3().dot(q), cell.b.as_dvec3().dot(q));
        let is_triangle = matches!(cell.kind, Kind::Triangle | Kind::CutTriangle);
        let st = match cell.kind {
            Kind::Other => return mesh.locate(patch, point),
            _ if cell.bend == Vec2::ZERO => flat.clamp(DVec2::ZERO, DVec2::ONE),
            _ => inverse::bilinear_st(flat, [DVec2::X, DVec2::Y, cell.bend.as_dvec2()]),
        };
        if is_triangle && st.x + st.y > 1.0 {
            return mesh.locate(patch, point);
        }
        if matches!(cell.kind, Kind::Quad | Kind::Triangle) {
            return SurfacePoint { element: ElementId(cell.first), st };
        }
        let (quarter, st) = quarter_of(is_triangle, st);
        SurfacePoint { element: ElementId(cell.first + quarter), st }
    }
}

impl Cell {
    fn of(mesh: &Mesh, patch: &Patch) -> Cell {
        let (origin, x, y, bend, normal) = match patch.corners {
            Corners::Triangle(v) => {
                let [o, p, q] = v.map(|v| mesh.at(v));
                (o, p - o, q - o, DVec3::ZERO, (p - o).cross(q - o))
            }
            Corners::Quad(v) => {
                let [o, p, r, q] = v.map(|v| mesh.at(v));
                // The plane that both diagonals are parallel to.
                (o, p - o, q - o, o - p + r - q, (r - o).cross(q - p))
            }
        };
        let (a, b) = (y.cross(normal), normal.cross(x));
        let (a, b) = (a / x.dot(a), b / y.dot(b));
        let bend = DVec2::new(a.dot(bend), b.dot(bend)).as_vec2();
        let bend = if bend.length() <= LEAST_BEND { Vec2::ZERO } else { bend };
        let (a, b) = (a.as_vec3(), b.as_vec3());
        let own = &mesh.elements[patch.elements.start as usize..patch.elements.end as usize];
        let is_cut_once = own.len() == 4 && own.iter().all(|e| e.place.level() == 1);
        let kind = match patch.corners {
            _ if !(a.is_finite() && b.is_finite() && bend.is_finite()) => Kind::Other,
            Corners::Quad(_) if own.len() == 1 => Kind::Quad,
            Corners::Quad(_) if is_cut_once => Kind::CutQuad,
            Corners::Triangle(_) if own.len() == 1 => Kind::Triangle,
            Corners::Triangle(_) if is_cut_once => Kind::CutTriangle,
            _ => Kind::Other,
        };
        Cell { origin, a, b, bend, first: patch.elements.start, kind }
    }
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
        let kinds = |kind: Kind| locator.cells.iter().filter(|c| c.kind == kind).count();
        assert!(kinds(Kind::CutQuad) > 20 && kinds(Kind::CutTriangle) > 5, "{:?}", locator.cells);
        assert!(locator.cells.iter().any(|c| c.bend != Vec2::ZERO));
        let mut n = 0;
        for (e, element) in mesh.elements.iter().enumerate() {
            for st in [[0.2, 0.3], [0.6, 0.1], [0.05, 0.9], [0.3, 0.6]] {
                let at = SurfacePoint { element: ElementId(e as u32), st: DVec2::from_array(st) };
                let found = locator.locate(&mesh, element.patch, mesh.position(at));
                assert_eq!(found.element, at.element, "{st:?}");
                assert!((found.st - at.st).length() < 1e-6, "{found:?} {at:?}");
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
