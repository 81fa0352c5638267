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

use crate::raycast::{CastPatch, Facing};
use crate::scene::{Scene, SurfaceId};

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
/// Quads: bilinear (s,t) in [0,1]^2. Triangles: weights (1 - s - t, s, t) of corners 0, 1, 2.
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
    pub fn build(scene: &Scene) -> Mesh {
        let _ = scene;
        todo!()
    }

    /// The geometry that casters get: fronts, id = index.
    pub fn cast_patches(&self) -> Vec<CastPatch> {
        todo!()
    }

    /// The one-sided patch that a caster's hit means; `None` when the back of a one-sided surface was hit.
    pub fn patch_of_hit(&self, patch: PatchId, facing: Facing) -> Option<PatchId> {
        let _ = (patch, facing);
        todo!()
    }

    /// Where on patch `patch` the point lies (nearest (s,t), clamped to the patch), and in which element.
    pub fn locate(&self, patch: PatchId, point: DVec3) -> SurfacePoint {
        let _ = (patch, point);
        todo!()
    }

    /// World position of a place on the mesh (m).
    pub fn position(&self, at: SurfacePoint) -> DVec3 {
        let _ = at;
        todo!()
    }

    /// Corner positions of an element or patch (m).
    pub fn polygon(&self, corners: &Corners) -> Vec<DVec3> {
        corners.vertices().iter().map(|v| self.vertices[v.0 as usize].position).collect()
    }

    /// Quadrature points of an element.
    pub fn quadrature(&self, element: ElementId) -> Quadrature {
        let _ = element;
        todo!()
    }

    /// The elements around a vertex.
    pub fn elements_around(&self, vertex: VertexId) -> &[ElementId] {
        let v = vertex.0 as usize;
        &self.vertex_elements
            [self.vertex_element_starts[v] as usize..self.vertex_element_starts[v + 1] as usize]
    }
}
