//! Patches of all surfaces assembled into one mesh: shared vertices, neighbours, normals.
//!
//! ```text
//! Scene, grids --tessellate, fronts then backs--> patches --edge table--> pairs of patch edges
//!              --union of corners across smooth joins--> vertices --quadtrees, 2:1 balance--> elements
//! ```
//! Two patch edges are one when their ends are the same points and they run in opposite directions; they join when
//! they belong to one surface side, or to the same side of two surfaces of one non-zero smooth group whose normals
//! there differ by under 40 degrees, or that the scene joins by hand (`[[continuity]]`, which may also part them).
//! Vertices of joined edges are shared; other surfaces have their own vertices at the same, bitwise equal, position.

use std::collections::{HashMap, HashSet};

use super::grading::{Grading, gradings};
use super::junctions::{BorderEdge, count_t_junctions};
use super::plan::{Grid, plan_bounded, weld_tolerance_m};
use super::split::{NONE, Pieces, facet, split};
use super::subdivision::{Subdivision, SubdivisionError};
use super::tessellate::{tessellate, true_normal};
use super::weld::{DisjointSets, Welder};
use super::{
    Continuity, Corners, Element, ElementId, Mesh, Patch, PatchId, Place, SurfacePatches, Vertex, VertexId,
};
use crate::geom::DVec3;
use crate::raycast::Facing;
use crate::scene::{MeshTarget, Meshing, Scene, SurfaceContinuity, SurfaceId};

/// Patches on one edge that are tried as a continuation: a file may put a hundred thousand on it.
const MAX_FAN: usize = 64;

/// Surfaces of one smooth group continue each other below this angle: cos 40 degrees.
const COS_SMOOTH: f64 = 0.766_044_443_118_978;

/// Patches whose corners are still private to their surface side.
struct Draft {
    /// Positions of provisional vertices (m), corners first, then midpoints and centres.
    points: Vec<DVec3>,
    /// Welded position of each corner.
    position_ids: Vec<u32>,
    patches: Vec<Patch>,
    /// Patches that are one element until something splits them.
    whole: Vec<bool>,
    surfaces: Vec<SurfacePatches>,
    n_cast_patches: usize,
    /// Per surface.
    gradings: Vec<Grading>,
}

/// One side of one patch edge in the edge table.
struct EdgeRecord {
    low: u32,
    high: u32,
    patch: u32,
    edge: u32,
}

pub(super) fn build(scene: &Scene) -> Mesh {
    let draft = draft(scene, &plan_bounded(scene));
    let initial = draft.initial();
    // What was just made has one tree a patch.
    assemble(scene, draft, initial).unwrap_or_else(|fault| panic!("an initial subdivision {fault}"))
}

pub(super) fn build_with(scene: &Scene, subdivision: &Subdivision) -> Result<Mesh, SubdivisionError> {
    assemble(scene, draft(scene, &plan_bounded(scene)), subdivision.clone())
}

fn assemble(scene: &Scene, draft: Draft, mut subdivision: Subdivision) -> Result<Mesh, SubdivisionError> {
    let (found, expected) = (subdivision.n_patches(), draft.patches.len() as u32);
    if found != expected {
        return Err(SubdivisionError::Patches { found, expected });
    }
    let mut sets = DisjointSets::new(draft.points.len());
    let by_hand = ByHand::of(scene);
    let (across, n_t_junctions) = pair_edges(scene, &by_hand, &draft, &mut sets);
    let Draft { points, patches: uncut, surfaces, n_cast_patches, .. } = draft;
    let (patches, pieces) = loop {
        let mut patches = uncut.clone();
        let leaves = subdivision.leaves()?;
        let pieces = split(points.clone(), &mut patches, &across, &mut sets, &leaves);
        if pieces.too_coarse.is_empty() {
            break (patches, pieces);
        }
        if !subdivision.discontinuities().is_empty() {
            return Err(SubdivisionError::Unbalanced);
        }
        // A split may make the next neighbour too coarse: rounds until none is, at most one a level.
        let mut flags = vec![false; pieces.elements.len()];
        pieces.too_coarse.iter().for_each(|e| flags[e.0 as usize] = true);
        subdivision = subdivision.split(&flags);
    };
    let Pieces { mut vertices, elements, hanging, .. } = pieces;
    let (vertex_element_starts, vertex_elements) = rows_around(&vertices, &elements);
    finish_vertices(scene, &patches, &elements, &mut vertices);
    let mut mesh = Mesh {
        vertices,
        elements,
        patches,
        surfaces,
        n_cast_patches,
        n_t_junctions,
        hanging,
        discontinuities: Vec::new(),
        line_vertices: Vec::new(),
        vertex_element_starts,
        vertex_elements,
    };
    by_hand.flag_kinks(&mut mesh);
    mesh.part(subdivision.discontinuities())?;
    Ok(mesh)
}

/// What a scene says by hand of the continuity between its surfaces.
struct ByHand(HashMap<[SurfaceId; 2], Continuity>);

impl ByHand {
    fn of(scene: &Scene) -> ByHand {
        ByHand(scene.continuity.iter().map(|c| (c.between, c.continuity)).collect())
    }

    fn between(&self, a: SurfaceId, b: SurfaceId) -> Option<Continuity> {
        if self.0.is_empty() { None } else { self.0.get(&[a.min(b), a.max(b)]).copied() }
    }

    /// C0 across the edges of elements where two surfaces are said to meet so.
    fn flag_kinks(&self, mesh: &mut Mesh) {
        if !self.0.values().any(|c| *c == Continuity::C0) {
            return;
        }
        let surfaces: Vec<SurfaceId> =
            mesh.elements.iter().map(|e| mesh.patches[e.patch.0 as usize].surface).collect();
        for (element, own) in mesh.elements.iter_mut().zip(&surfaces) {
            for (other, continuity) in element.neighbours.iter().zip(&mut element.continuity) {
                let Some(other) = other.map(|e| surfaces[e.0 as usize]) else { continue };
                if other != *own && self.between(*own, other) == Some(Continuity::C0) {
                    *continuity = Continuity::C0;
                }
            }
        }
    }
}

/// Pairs of `scene.continuity` whose surfaces share no edge that could join them.
pub(super) fn apart(scene: &Scene) -> Vec<usize> {
    let joined = |c: &SurfaceContinuity| SurfaceContinuity { continuity: Continuity::C1, ..*c };
    // Edges that are one are so however finely they are cut.
    let meshing = Meshing { target: MeshTarget::Elements(1), ..scene.meshing };
    let scene =
        &Scene { continuity: scene.continuity.iter().map(joined).collect(), meshing, ..scene.clone() };
    let draft = draft(scene, &plan_bounded(scene));
    let mut sets = DisjointSets::new(draft.points.len());
    let (across, _) = pair_edges(scene, &ByHand::of(scene), &draft, &mut sets);
    let surface = |slot: usize| draft.patches[slot / 4].surface;
    let meet: HashSet<[SurfaceId; 2]> = (0..across.len())
        .filter(|&slot| across[slot] != NONE)
        .map(|slot| (surface(slot), surface(across[slot] as usize)))
        .map(|(a, b)| [a.min(b), a.max(b)])
        .collect();
    (0..scene.continuity.len()).filter(|&i| !meet.contains(&scene.continuity[i].between)).collect()
}

fn draft(scene: &Scene, grids: &[Grid]) -> Draft {
    let mut welder = Welder::new(weld_tolerance_m(scene));
    let mut draft = Draft {
        points: Vec::new(),
        position_ids: Vec::new(),
        patches: Vec::new(),
        whole: Vec::new(),
        surfaces: Vec::with_capacity(scene.surfaces.len()),
        n_cast_patches: 0,
        gradings: gradings(scene),
    };
    for i in 0..grids.len() {
        let front = draft.add_side(scene, grids, i, Facing::Front, &mut welder);
        draft.surfaces.push(SurfacePatches { front, back: 0..0 });
    }
    draft.n_cast_patches = draft.patches.len();
    for i in (0..grids.len()).filter(|&i| scene.surfaces[i].two_sided) {
        let back = draft.add_side(scene, grids, i, Facing::Back, &mut welder);
        let front = draft.surfaces[i].front.clone();
        for (f, b) in front.zip(back.clone()) {
            draft.patches[f as usize].twin = Some(PatchId(b));
            draft.patches[b as usize].twin = Some(PatchId(f));
        }
        draft.surfaces[i].back = back;
    }
    draft
}

impl Draft {
    /// 2 x 2 elements a patch, one where the tessellation says so.
    fn initial(&self) -> Subdivision {
        let n = self.patches.len() as u32;
        Subdivision::new(n, |patch, place| place == Place::ROOT && !self.whole[patch as usize])
    }

    fn add_side(
        &mut self,
        scene: &Scene,
        grids: &[Grid],
        i: usize,
        side: Facing,
        welder: &mut Welder,
    ) -> std::ops::Range<u32> {
        let cut = tessellate(&scene.surfaces[i].shape, &grids[i], &self.gradings[i]);
        let base = self.points.len() as u32;
        for point in cut.points {
            let (id, at) = welder.weld(point);
            self.position_ids.push(id);
            self.points.push(at);
        }
        let start = self.patches.len() as u32;
        for (k, corners) in cut.patches.into_iter().enumerate() {
            self.whole.push(cut.whole.get(k) == Some(&true));
            let corners = if side == Facing::Back { corners.flipped() } else { corners };
            let corners = corners.map(|v| VertexId(v.0 + base));
            let (normal, area_m2) = facet(&self.points, &corners);
            self.patches.push(Patch {
                corners,
                surface: SurfaceId(i as u32),
                side,
                elements: 0..0,
                area_m2,
                normal,
                twin: None,
            });
        }
        start..self.patches.len() as u32
    }
}

impl Corners {
    pub(super) fn map(self, f: impl Fn(VertexId) -> VertexId) -> Corners {
        match self {
            Corners::Triangle(v) => Corners::Triangle(v.map(f)),
            Corners::Quad(v) => Corners::Quad(v.map(f)),
        }
    }

    /// Ends of edge `i`, in winding order.
    pub(crate) fn edge(&self, i: usize) -> (VertexId, VertexId) {
        let v = self.vertices();
        (v[i], v[(i + 1) % v.len()])
    }
}

/// Finds what lies across each patch edge; joins the corners of smooth pairs; counts T-junctions of the rest.
///
/// Entry `4 p + e` is `4 q + f` of the patch edge across, or `NONE`.
fn pair_edges(scene: &Scene, by_hand: &ByHand, draft: &Draft, sets: &mut DisjointSets) -> (Vec<u32>, usize) {
    let patches = &draft.patches;
    let mut table = Vec::with_capacity(4 * patches.len());
    for (p, patch) in patches.iter().enumerate() {
        for e in 0..patch.corners.vertices().len() {
            let (a, b) = patch.corners.edge(e);
            let (a, b) = (draft.position_ids[a.0 as usize], draft.position_ids[b.0 as usize]);
            table.push(EdgeRecord { low: a.min(b), high: a.max(b), patch: p as u32, edge: e as u32 });
        }
    }
    table.sort_unstable_by_key(|r| (r.low, r.high, r.patch, r.edge));

    let mut across = vec![NONE; 4 * patches.len()];
    let mut border = Vec::new();
    for group in table.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high)) {
        for (k, a) in group.iter().enumerate() {
            let slot_a = (4 * a.patch + a.edge) as usize;
            if across[slot_a] != NONE {
                continue;
            }
            let free = |b: &&EdgeRecord| across[(4 * b.patch + b.edge) as usize] == NONE;
            let best = group[k + 1..]
                .iter()
                .take(MAX_FAN)
                .filter(free)
                .filter_map(|b| smoothness(scene, by_hand, draft, a, b).map(|c| (c, b)))
                .reduce(|best, next| if next.0 > best.0 { next } else { best });
            let Some((_, b)) = best else { continue };
            across[slot_a] = 4 * b.patch + b.edge;
            across[(4 * b.patch + b.edge) as usize] = slot_a as u32;
            let (a0, a1) = patches[a.patch as usize].corners.edge(a.edge as usize);
            let (b0, b1) = patches[b.patch as usize].corners.edge(b.edge as usize);
            sets.union(a0.0, b1.0);
            sets.union(a1.0, b0.0);
        }
        let mut fronts = group.iter().filter(|r| (r.patch as usize) < draft.n_cast_patches);
        if let (Some(only), None) = (fronts.next(), fronts.next()) {
            let (a, b) = patches[only.patch as usize].corners.edge(only.edge as usize);
            border.push(BorderEdge {
                ids: [only.low, only.high],
                ends: [a, b].map(|v| draft.points[v.0 as usize]),
                low_first: draft.position_ids[a.0 as usize] == only.low,
            });
        }
    }
    (across, count_t_junctions(&border, weld_tolerance_m(scene)))
}

/// How well patch edge `b` continues patch edge `a` (2 inside a surface, 1.5 by hand, else the cosine between the
/// normals), or `None` where the surface breaks.
fn smoothness(scene: &Scene, by_hand: &ByHand, draft: &Draft, a: &EdgeRecord, b: &EdgeRecord) -> Option<f64> {
    let (p, q) = (&draft.patches[a.patch as usize], &draft.patches[b.patch as usize]);
    if a.patch == b.patch || p.side != q.side {
        return None;
    }
    let (a0, a1) = p.corners.edge(a.edge as usize);
    let (b0, b1) = q.corners.edge(b.edge as usize);
    if p.surface == q.surface {
        return (a0 == b1 && a1 == b0).then_some(2.0);
    }
    let at = |v: VertexId| draft.position_ids[v.0 as usize];
    if at(a0) != at(b1) || at(a1) != at(b0) {
        return None;
    }
    let group = scene.surfaces[p.surface.0 as usize].smooth_group;
    let cos = p.normal.dot(q.normal);
    match by_hand.between(p.surface, q.surface) {
        Some(Continuity::Broken) => None,
        // Before all that only smooth groups join.
        Some(Continuity::C1 | Continuity::C0) => Some(1.5),
        None => {
            let same = group != 0 && group == scene.surfaces[q.surface.0 as usize].smooth_group;
            (same && cos > COS_SMOOTH).then_some(cos)
        }
    }
}

/// Compressed rows of the elements around each vertex, in rising order.
pub(super) fn rows_around(vertices: &[Vertex], elements: &[Element]) -> (Vec<u32>, Vec<ElementId>) {
    let mut starts = vec![0_u32; vertices.len() + 1];
    for v in elements.iter().flat_map(|e| e.corners.vertices()) {
        starts[v.0 as usize + 1] += 1;
    }
    for i in 0..vertices.len() {
        starts[i + 1] += starts[i];
    }
    let mut around = vec![ElementId(0); starts[vertices.len()] as usize];
    let mut fill = starts.clone();
    for (i, element) in elements.iter().enumerate() {
        for v in element.corners.vertices() {
            around[fill[v.0 as usize] as usize] = ElementId(i as u32);
            fill[v.0 as usize] += 1;
        }
    }
    (starts, around)
}

/// Normals weighted by corner angle (true normals on curved surfaces) and the way inwards.
fn finish_vertices(scene: &Scene, patches: &[Patch], elements: &[Element], vertices: &mut [Vertex]) {
    let mut n_around = vec![0_u32; vertices.len()];
    for element in elements {
        let patch = &patches[element.patch.0 as usize];
        let shape = &scene.surfaces[patch.surface.0 as usize].shape;
        let flip = if patch.side == Facing::Back { -1.0 } else { 1.0 };
        let ids = element.corners.vertices();
        let n = ids.len();
        let at = |i: usize| ids[i % n].0 as usize;
        let mut p = [DVec3::ZERO; 4];
        for i in 0..n {
            p[i] = vertices[at(i)].position;
        }
        let centroid = p[..n].iter().copied().sum::<DVec3>() / n as f64;
        for i in 0..n {
            let (back, forth) = (p[(i + n - 1) % n] - p[i], p[(i + 1) % n] - p[i]);
            let angle = back.cross(forth).length().atan2(back.dot(forth));
            let normal = true_normal(shape, p[i]).map_or(element.normal, |t| flip * t);
            let vertex = &mut vertices[at(i)];
            vertex.normal += angle * normal;
            vertex.inward += centroid;
            n_around[at(i)] += 1;
        }
    }
    for (vertex, n) in vertices.iter_mut().zip(n_around) {
        vertex.normal = vertex.normal.normalize_or(DVec3::Z);
        vertex.inward = vertex.inward / f64::from(n) - vertex.position;
    }
}
