//! Surfaces cut into patches (what the board sees and what shoots) and elements (what receives and is drawn).
//!
//! ```text
//! Scene --> surfaces --> patches (2 x 2 elements each) --> quad / triangle elements
//!                        vertices shared where surfaces continue each other; neighbours and continuity per edge
//! ```
//! A patch is one-sided. A two-sided surface has a second set of patches, its backs, wound the other way:
//! `Patch::twin` leads from one side to the other. Casters know the fronts only, ids `0..n_cast_patches`.
//! Element geometry lies exactly in its patch (curved surfaces are faceted by patches), so a ray that leaves an
//! element never starts behind the patch that the casters know.
//!
//! Not modelled yet: adaptive subdivision.

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::geom::weld;
use crate::raycast::{CastPatch, Facing};
use crate::scene::{Scene, SurfaceId};

mod build;
mod faces;
mod inverse;
mod junctions;
mod plan;
mod split;
mod tessellate;

#[cfg(test)]
pub(crate) mod tests;

/// Abscissae of the two-point Gauss rule on [0, 1]: (1 -+ 1/sqrt 3) / 2.
const GAUSS_2: (f64, f64) = (0.211_324_865_405_187_1, 0.788_675_134_594_812_9);

/// Index into [`Mesh::vertices`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VertexId(pub u32);

/// Index into [`Mesh::elements`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ElementId(pub u32);

/// Index into [`Mesh::patches`]; for fronts also the id that casters use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
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
    /// Edges with a hanging vertex on them (gaps of up to one fixed-point step are possible there).
    pub n_t_junctions: usize,
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
    /// From the vertex to the mean of its elements' centroids (m): the way in from a border.
    pub inward: DVec3,
}

/// How reconstruction may join two elements across an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// Value and gradient continue.
    C1,
    /// The value continues, the gradient may break.
    C0,
    /// Nothing continues (border, crease).
    Broken,
}

/// Corners of a patch or element: 3 or 4 vertices, counter-clockwise seen from the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corners {
    /// A triangle.
    Triangle([VertexId; 3]),
    /// A quadrilateral; (s,t) runs (0,0), (1,0), (1,1), (0,1).
    Quad([VertexId; 4]),
}

/// One element: a quad or triangle with one mean irradiance.
///
/// Quarters of a quad patch stand row by row, s fastest: element `2 (t half) + (s half)`. Those of a triangle patch:
/// at corners 0, 1, 2, then the middle one.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    /// Its corners.
    pub corners: Corners,
    /// The patch that it is a quarter of.
    pub patch: PatchId,
    /// Area (m^2), that of its planar (or bilinear) facet.
    pub area_m2: f64,
    /// Unit front normal.
    pub normal: DVec3,
    /// Neighbour across edge i (corner i to corner i + 1), when there is one of the same continuity group.
    pub neighbours: [Option<ElementId>; 4],
    /// Continuity across edge i.
    pub continuity: [Continuity; 4],
}

/// One patch: 2 x 2 elements, one side of a surface, and (fronts) one record of the board's patch memory.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Its corners.
    pub corners: Corners,
    /// The surface it belongs to.
    pub surface: SurfaceId,
    /// Which side of that surface this patch is.
    pub side: Facing,
    /// Its elements.
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
        let (quarter, st) = match patch.corners {
            Corners::Triangle(v) => {
                let DVec2 { x: s, y: t } = 2.0 * inverse::triangle_st(&v.map(|v| self.at(v)), point);
                // In the order of the split: at corners 0, 1, 2, then the middle, which is upside down.
                if s + t <= 1.0 {
                    (0, DVec2::new(s, t))
                } else if s >= 1.0 {
                    (1, DVec2::new(s - 1.0, t))
                } else if t >= 1.0 {
                    (2, DVec2::new(s, t - 1.0))
                } else {
                    (3, DVec2::new(1.0 - s, 1.0 - t))
                }
            }
            Corners::Quad(v) => {
                let st = 2.0 * inverse::quad_st(&v.map(|v| self.at(v)), point);
                let half = DVec2::new(f64::from(st.x > 1.0), f64::from(st.y > 1.0));
                (2 * half.y as u32 + half.x as u32, st - half)
            }
        };
        SurfacePoint { element: ElementId(patch.elements.start + quarter), st }
    }

    /// World position of a place on the mesh (m).
    pub fn position(&self, at: SurfacePoint) -> DVec3 {
        let DVec2 { x: s, y: t } = at.st;
        match self.elements[at.element.0 as usize].corners {
            Corners::Triangle([a, b, c]) => (1.0 - s - t) * self.at(a) + s * self.at(b) + t * self.at(c),
            Corners::Quad([a, b, c, d]) => {
                (1.0 - t) * ((1.0 - s) * self.at(a) + s * self.at(b))
                    + t * ((1.0 - s) * self.at(d) + s * self.at(c))
            }
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
            + self.vertex_element_starts.capacity() * size_of::<u32>()
            + self.vertex_elements.capacity() * size_of::<ElementId>()
    }

    fn at(&self, vertex: VertexId) -> DVec3 {
        self.vertices[vertex.0 as usize].position
    }

    /// The elements around a vertex.
    pub fn elements_around(&self, vertex: VertexId) -> &[ElementId] {
        let v = vertex.0 as usize;
        &self.vertex_elements
            [self.vertex_element_starts[v] as usize..self.vertex_element_starts[v + 1] as usize]
    }
}
