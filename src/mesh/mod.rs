//! Surfaces cut into patches (what the board sees and what shoots) and elements (what receives and is drawn).
//!
//! ```text
//! Scene --> surfaces --> patches (a quadtree each) --> quad / triangle elements
//!                        vertices shared where surfaces continue each other; neighbours and continuity per edge
//! ```
//! A patch is one-sided. A two-sided surface has a second set of patches, its backs, wound the other way:
//! `Patch::twin` leads from one side to the other. Casters know the fronts only, ids `0..n_cast_patches`.
//! Element geometry lies exactly in its patch (curved surfaces are faceted by patches), so a ray that leaves an
//! element never starts behind the patch that the casters know. Patches never change: a [`Subdivision`] says how each
//! is cut, 2 x 2 at first (an imported face that is small already stays whole), and the same scene meshed by another
//! one has the same patches, so that a caster made before a refinement serves after it.
//!
//! An edge inside a continuity group may be flagged C0 or C-1 ([`Discontinuity`]): a C-1 line parts the vertices on it.
//!
//! Balance is 2:1: over an edge lie at most two elements. Where two lie, the vertex between them hangs on the edge
//! of the coarse one ([`Hanging`]): only the fine ones have it as a corner.

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::geom::weld;
use crate::raycast::{CastPatch, Facing};
use crate::scene::{Scene, SurfaceId};

mod build;
mod discontinuity;
mod faces;
mod grading;
mod inverse;
mod junctions;
mod locator;
mod nodes;
mod plan;
mod split;
mod subdivision;
mod tessellate;

#[cfg(test)]
pub(crate) mod tests;

pub use crate::scene::Continuity;
pub use discontinuity::Discontinuity;
pub(crate) use locator::Locator;
pub use subdivision::{MAX_LEVEL, Place, Subdivision, SubdivisionError};

/// Abscissae of the two-point Gauss rule on [0, 1]: (1 -+ 1/sqrt 3) / 2.
const GAUSS_2: (f64, f64) = (0.211_324_865_405_187_1, 0.788_675_134_594_812_9);

/// Index into [`Mesh::vertices`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VertexId(pub u32);

/// Index into [`Mesh::elements`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ElementId(pub u32);

/// Index into [`Mesh::patches`]; for fronts also the id that casters use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct PatchId(pub u32);

/// The whole mesh.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Vertices; one per position and continuity group, so surfaces that break share none.
    pub vertices: Vec<Vertex>,
    /// Elements, grouped by patch: those of patch p are `patches[p].elements`.
    pub elements: Vec<Element>,
    /// Patches: fronts first (`0..n_cast_patches`), then the backs of two-sided surfaces.
    pub patches: Vec<Patch>,
    /// Per scene surface, its patches.
    pub surfaces: Vec<SurfacePatches>,
    /// How many patches the casters know.
    pub n_cast_patches: usize,
    /// Edges of the cast geometry with another patch's corner on them (gaps of up to one fixed-point step are possible
    /// there).
    pub n_t_junctions: usize,
    /// Vertices on the middle of a coarser element's edge, coarse to fine: what one takes from its coarse edge never
    /// depends on a later one.
    pub hanging: Vec<Hanging>,
    /// Edges inside continuity groups across which less continues, as asked for.
    discontinuities: Vec<Discontinuity>,
    /// Vertices on one side of a broken line, in rising order.
    line_vertices: Vec<VertexId>,
    /// Compressed rows: elements around vertex v are `around[starts[v]..starts[v + 1]]`.
    vertex_element_starts: Vec<u32>,
    vertex_elements: Vec<ElementId>,
}

/// A mesh vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position (m).
    pub position: DVec3,
    /// Unit normal of the surface here (mean over its continuity group).
    pub normal: DVec3,
    /// From the vertex to the mean of its elements' centroids (m): the way in from a border or a line.
    pub inward: DVec3,
}

/// Corners of a patch or element: 3 or 4 vertices, counter-clockwise seen from the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corners {
    /// A triangle.
    Triangle([VertexId; 3]),
    /// A quadrilateral; (s,t) runs (0,0), (1,0), (1,1), (0,1).
    Quad([VertexId; 4]),
}

/// A vertex in the middle of an edge that only the finer side has split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hanging {
    /// The vertex.
    pub vertex: VertexId,
    /// The element whose edge it lies on.
    pub coarse: ElementId,
    /// Which edge of it.
    pub edge: u8,
    /// Ends of that edge, in the coarse element's winding order.
    pub ends: [VertexId; 2],
    /// The elements across, at the first end and at the second.
    pub fine: [ElementId; 2],
}

/// One element: a quad or triangle with one mean irradiance.
///
/// Elements of a patch stand in the order of its quadtree. Quarters of a quad stand row by row, s fastest: quarter
/// `2 (t half) + (s half)`. Those of a triangle: at corners 0, 1, 2, then the middle one.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    /// Its corners.
    pub corners: Corners,
    /// The patch that it is a part of.
    pub patch: PatchId,
    /// Where in the quadtree of that patch.
    pub place: Place,
    /// Area (m^2), that of its planar (or bilinear) facet.
    pub area_m2: f64,
    /// Unit front normal.
    pub normal: DVec3,
    /// Neighbour across edge i (corner i to corner i + 1), when there is one of the same continuity group; of two, the
    /// one at corner i ([`Mesh::neighbours_across`] gives both).
    pub neighbours: [Option<ElementId>; 4],
    /// Continuity across edge i.
    pub continuity: [Continuity; 4],
}

/// One patch: some elements, one side of a surface, and (fronts) one record of the board's patch memory.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Its corners.
    pub corners: Corners,
    /// The surface it belongs to.
    pub surface: SurfaceId,
    /// Which side of that surface this patch is.
    pub side: Facing,
    /// Its elements, the leaves of its quadtree.
    pub elements: Range<u32>,
    /// Area (m^2), the sum of its elements'.
    pub area_m2: f64,
    /// Unit normal of this side.
    pub normal: DVec3,
    /// The same patch seen from the other side, for two-sided surfaces.
    pub twin: Option<PatchId>,
}

/// The patches of one surface.
#[derive(Clone, Debug)]
pub struct SurfacePatches {
    /// Front patches.
    pub front: Range<u32>,
    /// Back patches; empty unless two-sided.
    pub back: Range<u32>,
}

/// A place on the mesh: an element and (s,t) in it.
///
/// Quads: bilinear (s,t) in `[0,1]^2`. Triangles: weights (1 - s - t, s, t) of corners 0, 1, 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The element.
    pub element: ElementId,
    /// Its local coordinates.
    pub st: DVec2,
}

/// The quadrature points of an element: 4 Gauss points of a quad, 3 interior points of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Quadrature {
    points: [(DVec3, f64); 4],
    n: usize,
}

impl Quadrature {
    /// Points (m) and weights (m^2); the weights sum to the element's area.
    pub fn points(&self) -> &[(DVec3, f64)] {
        &self.points[..self.n]
    }
}

impl Corners {
    /// The vertices, 3 or 4.
    pub fn vertices(&self) -> &[VertexId] {
        match self {
            Corners::Triangle(v) => v,
            Corners::Quad(v) => v,
        }
    }
}

impl Mesh {
    /// Meshes a scene uniformly by its `meshing` keys.
    ///
    /// Wishes beyond four times [`crate::scene::MAX_ELEMENTS`] are met more coarsely; loaders refuse them before,
    /// by [`Mesh::planned_elements`].
    pub fn build(scene: &Scene) -> Mesh {
        build::build(scene)
    }

    /// Meshes a scene with the patches of [`Mesh::build`], each cut as `subdivision` says and further where the balance
    /// of 2:1 needs it, and parted where it says that less continues. `build_with(scene, &mesh.subdivision())` is `mesh`
    /// again, bit for bit.
    ///
    /// # Errors
    /// When the subdivision is damaged or not one of this scene's patches.
    pub fn build_with(scene: &Scene, subdivision: &Subdivision) -> Result<Mesh, SubdivisionError> {
        build::build_with(scene, subdivision)
    }

    /// How the patches are cut, and where less continues.
    pub fn subdivision(&self) -> Subdivision {
        // An element is the first of each node above it that it begins.
        let mut next = self.elements.iter().peekable();
        Subdivision::new(self.patches.len() as u32, |patch, place| {
            let leaf = next.peek().is_some_and(|e| e.patch.0 == patch && e.place == place);
            if leaf {
                next.next();
            }
            !leaf
        })
        .with_discontinuities(self.discontinuities.clone())
    }

    /// Entries of `scene.continuity` whose surfaces share no edge along which they could join: the same ends, and both
    /// fronts (or backs) on one side.
    pub fn continuity_without_edge(scene: &Scene) -> Vec<usize> {
        build::apart(scene)
    }

    /// How many elements the scene's `meshing` keys ask for, backs included, without building anything.
    pub fn planned_elements(scene: &Scene) -> u64 {
        plan::n_elements(scene, &plan::plan(scene))
    }

    /// The geometry that casters get: fronts, id = index.
    pub fn cast_patches(&self) -> Vec<CastPatch> {
        let cast = |patch: &Patch| match patch.corners {
            Corners::Triangle([a, b, c]) => {
                CastPatch { corners: [a, b, c, c].map(|v| self.at(v)), is_triangle: true }
            }
            Corners::Quad(v) => CastPatch { corners: v.map(|v| self.at(v)), is_triangle: false },
        };
        self.patches[..self.n_cast_patches].iter().map(cast).collect()
    }

    /// The one-sided patch that a caster's hit means; `None` when the back of a one-sided surface was hit.
    pub fn patch_of_hit(&self, patch: PatchId, facing: Facing) -> Option<PatchId> {
        match facing {
            Facing::Front => Some(patch),
            Facing::Back => self.patches[patch.0 as usize].twin,
        }
    }

    /// Where on patch `patch` the point lies (nearest (s,t), clamped to the patch), and in which element.
    pub fn locate(&self, patch: PatchId, point: DVec3) -> SurfacePoint {
        let patch = &self.patches[patch.0 as usize];
        let st = match patch.corners {
            Corners::Triangle(v) => inverse::triangle_st(&v.map(|v| self.at(v)), point),
            Corners::Quad(v) => inverse::quad_st(&v.map(|v| self.at(v)), point),
        };
        self.locate_st(patch, st)
    }

    /// The element of a patch at (s,t) of the patch, and (s,t) there.
    fn locate_st(&self, patch: &Patch, mut st: DVec2) -> SurfacePoint {
        let mut place = Place::ROOT;
        let own = &self.elements[patch.elements.start as usize..patch.elements.end as usize];
        let (mut first, mut n) = (0, own.len());
        // One node of the quadtree after another, with the elements in it, down to a single one.
        while n > 1 {
            let quarter;
            (quarter, st) = quarter_of(matches!(patch.corners, Corners::Triangle(_)), st);
            place = place.quarter(quarter);
            let rest = &own[first..first + n];
            first += rest.partition_point(|e| e.place < place);
            n = own[first..].partition_point(|e| e.place.at_level(place.level()) == place);
        }
        SurfacePoint { element: ElementId(patch.elements.start + first as u32), st }
    }

    /// Where (s,t) of quarter `quarter` of a patch lies (m): the patch's own quarters, whatever its elements are.
    pub(crate) fn quarter_position(&self, patch: PatchId, quarter: u32, st: DVec2) -> DVec3 {
        let mid = |a: DVec3, b: DVec3| 0.5 * (a + b);
        match self.patches[patch.0 as usize].corners {
            Corners::Triangle(v) => {
                let [a, b, c] = v.map(|v| self.at(v));
                let (m0, m1, m2) = (mid(a, b), mid(b, c), mid(c, a));
                let [a, b, c] = [[a, m0, m2], [m0, b, m1], [m2, m1, c], [m1, m2, m0]][quarter as usize % 4];
                barycentric([a, b, c], st)
            }
            Corners::Quad(v) => {
                let [a, b, c, d] = v.map(|v| self.at(v));
                let z = 0.25 * [a, b, c, d].iter().fold(DVec3::ZERO, |s, v| s + *v);
                let m = [mid(a, b), mid(b, c), mid(c, d), mid(d, a)];
                let quarters =
                    [[a, m[0], z, m[3]], [m[0], b, m[1], z], [m[3], z, m[2], d], [z, m[1], c, m[2]]];
                bilinear(quarters[quarter as usize % 4], st)
            }
        }
    }

    /// Where an element's edge is split by the other side: the hanging vertex on it.
    pub fn hanging_on(&self, element: ElementId, edge: usize) -> Option<&Hanging> {
        let key =
            |h: &Hanging| (self.elements[h.coarse.0 as usize].place.level(), h.coarse, usize::from(h.edge));
        let level = self.elements[element.0 as usize].place.level();
        let at = self.hanging.binary_search_by_key(&(level, element, edge), key).ok()?;
        self.hanging.get(at)
    }

    /// All elements across an edge, in the order in which the element walks along it: none, one, or two finer ones.
    pub fn neighbours_across(&self, element: ElementId, edge: usize) -> impl Iterator<Item = ElementId> {
        let second = self.hanging_on(element, edge).map(|h| h.fine[1]);
        self.elements[element.0 as usize].neighbours[edge].into_iter().chain(second)
    }

    /// World position of a place on the mesh (m).
    pub fn position(&self, at: SurfacePoint) -> DVec3 {
        match self.elements[at.element.0 as usize].corners {
            Corners::Triangle(v) => barycentric(v.map(|v| self.at(v)), at.st),
            Corners::Quad(v) => bilinear(v.map(|v| self.at(v)), at.st),
        }
    }

    /// Corner positions of an element or patch (m).
    pub fn polygon(&self, corners: &Corners) -> Vec<DVec3> {
        corners.vertices().iter().map(|v| self.vertices[v.0 as usize].position).collect()
    }

    /// Quadrature points of an element: exact for cubics in (s,t) on parallelograms, for quadratics on triangles.
    pub fn quadrature(&self, element: ElementId) -> Quadrature {
        let Element { corners, area_m2, .. } = self.elements[element.0 as usize];
        let mut points = [(DVec3::ZERO, 0.0); 4];
        let place = |s: f64, t: f64| self.position(SurfacePoint { element, st: DVec2::new(s, t) });
        match corners {
            Corners::Triangle(_) => {
                let (near, far) = (1.0 / 6.0, 2.0 / 3.0);
                for (point, (s, t)) in points.iter_mut().zip([(near, near), (far, near), (near, far)]) {
                    *point = (place(s, t), area_m2 / 3.0);
                }
                Quadrature { points, n: 3 }
            }
            Corners::Quad(v) => {
                let [a, b, c, d] = v.map(|v| self.at(v));
                let normal = (c - a).cross(d - b).normalize_or_zero();
                let (low, high) = GAUSS_2;
                for (point, (s, t)) in
                    points.iter_mut().zip([(low, low), (high, low), (low, high), (high, high)])
                {
                    let x_s = (1.0 - t) * (b - a) + t * (c - d);
                    let x_t = (1.0 - s) * (d - a) + s * (c - b);
                    *point = (place(s, t), 0.25 * x_s.cross(x_t).dot(normal));
                }
                Quadrature { points, n: 4 }
            }
        }
    }

    /// Sum of the elements' areas (m^2), each side of two-sided surfaces by itself.
    pub fn total_area_m2(&self) -> f64 {
        self.elements.iter().map(|e| e.area_m2).sum()
    }

    /// Elements of a surface: those of its front, those of its back (empty unless two-sided).
    pub fn surface_elements(&self, surface: SurfaceId) -> (Range<u32>, Range<u32>) {
        let of = |patches: &Range<u32>| match self.patches.get(patches.start as usize..patches.end as usize) {
            Some([first, .., last]) => first.elements.start..last.elements.end,
            Some([only]) => only.elements.clone(),
            _ => 0..0,
        };
        let SurfacePatches { front, back } = &self.surfaces[surface.0 as usize];
        (of(front), of(back))
    }

    /// Memory that the mesh holds (bytes).
    pub fn memory_bytes(&self) -> usize {
        self.vertices.capacity() * size_of::<Vertex>()
            + self.elements.capacity() * size_of::<Element>()
            + self.patches.capacity() * size_of::<Patch>()
            + self.surfaces.capacity() * size_of::<SurfacePatches>()
            + self.hanging.capacity() * size_of::<Hanging>()
            + self.discontinuities.capacity() * size_of::<Discontinuity>()
            + self.line_vertices.capacity() * size_of::<VertexId>()
            + self.vertex_element_starts.capacity() * size_of::<u32>()
            + self.vertex_elements.capacity() * size_of::<ElementId>()
    }

    fn at(&self, vertex: VertexId) -> DVec3 {
        self.vertices[vertex.0 as usize].position
    }

    /// The elements that have a vertex as a corner; of a hanging one, the fine ones.
    pub fn elements_around(&self, vertex: VertexId) -> &[ElementId] {
        let v = vertex.0 as usize;
        &self.vertex_elements
            [self.vertex_element_starts[v] as usize..self.vertex_element_starts[v + 1] as usize]
    }
}

fn barycentric([a, b, c]: [DVec3; 3], DVec2 { x: s, y: t }: DVec2) -> DVec3 {
    (1.0 - s - t) * a + s * b + t * c
}

fn bilinear([a, b, c, d]: [DVec3; 4], DVec2 { x: s, y: t }: DVec2) -> DVec3 {
    (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * d + s * c)
}

/// Which quarter of a triangle or quad (s,t) lies in, and (s,t) of that quarter.
fn quarter_of(is_triangle: bool, st: DVec2) -> (u32, DVec2) {
    let DVec2 { x: s, y: t } = 2.0 * st;
    match is_triangle {
        // In the order of the split: at corners 0, 1, 2, then the middle, which is upside down.
        true if s + t <= 1.0 => (0, DVec2::new(s, t)),
        true if s >= 1.0 => (1, DVec2::new(s - 1.0, t)),
        true if t >= 1.0 => (2, DVec2::new(s, t - 1.0)),
        true => (3, DVec2::new(1.0 - s, 1.0 - t)),
        false => {
            let half = DVec2::new(f64::from(s > 1.0), f64::from(t > 1.0));
            (2 * half.y as u32 + half.x as u32, DVec2::new(s, t) - half)
        }
    }
}
