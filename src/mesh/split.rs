//! Patches split into elements, linked edge by edge.
//!
//! ```text
//! d---m2---c        c          edge i runs from corner i to corner i + 1 and has its middle in m_i; quarters of a
//! | 2 | 3  |        |\         quad stand row by row, those of a triangle at corners 0, 1, 2, then the middle one
//! m3--+---m1       m2-m1       upside down; quarters are split again where the subdivision says so
//! | 0 | 1  |        |\|\
//! a---m0---b        a-m0-b
//! ```
//! Every edge is one [`EdgeNode`] for whoever lies on its two sides; who splits first gives it a middle and two
//! halves. An element on one side of an edge that has a middle is the coarse side of a hanging vertex. Middles are
//! means of two ends, the same bits from both sides.

use super::subdivision::Place;
use super::weld::DisjointSets;
use super::{Continuity, Corners, Element, ElementId, Hanging, Patch, PatchId, Vertex, VertexId};
use crate::geom::DVec3;

/// Nothing lies across, or no number yet.
pub(super) const NONE: u32 = u32::MAX;

/// Unit normal and area (m^2) of a planar polygon of 3 or 4 corners.
pub(super) fn facet(points: &[DVec3], corners: &Corners) -> (DVec3, f64) {
    let p = |v: VertexId| points[v.0 as usize];
    let cross = match *corners {
        Corners::Triangle([a, b, c]) => (p(b) - p(a)).cross(p(c) - p(a)),
        Corners::Quad([a, b, c, d]) => (p(c) - p(a)).cross(p(d) - p(b)),
    };
    (cross.normalize_or(DVec3::Z), 0.5 * cross.length())
}

/// One edge, or part of one, of the quadtrees.
#[derive(Clone, Copy)]
struct EdgeNode {
    /// Provisional vertex in its middle.
    middle: u32,
    /// The halves at its start and at its end.
    halves: [u32; 2],
    /// `4 element + edge` of the elements that have this whole edge: the one that runs along it, the one against.
    sides: [u32; 2],
}

impl EdgeNode {
    const NEW: EdgeNode = EdgeNode { middle: NONE, halves: [NONE; 2], sides: [NONE; 2] };
}

/// An edge as one side walks it.
#[derive(Clone, Copy)]
struct EdgeUse {
    node: u32,
    against: bool,
}

/// A node of a quadtree while it is split; triangles use three of four.
#[derive(Clone, Copy)]
struct Cell {
    corners: [u32; 4],
    edges: [EdgeUse; 4],
    n: usize,
}

/// Elements and what belongs to them.
pub(super) struct Pieces {
    pub(super) vertices: Vec<Vertex>,
    pub(super) elements: Vec<Element>,
    /// Coarse to fine.
    pub(super) hanging: Vec<Hanging>,
    /// Elements with more than one vertex on an edge: they must be split for a mesh of 2:1 balance.
    pub(super) too_coarse: Vec<ElementId>,
}

struct Splitter<'a> {
    points: Vec<DVec3>,
    n_corners: usize,
    sets: &'a mut DisjointSets,
    /// Final number of each provisional vertex.
    numbers: Vec<u32>,
    nodes: Vec<EdgeNode>,
    vertices: Vec<Vertex>,
    elements: Vec<Element>,
}

/// Splits patches into the elements of `leaves` and numbers the vertices in the order of first use.
///
/// `across[4 p + e]` is the patch edge (as `4 q + f`) that edge e of patch p continues in.
pub(super) fn split(
    points: Vec<DVec3>,
    patches: &mut [Patch],
    across: &[u32],
    sets: &mut DisjointSets,
    leaves: &[(u32, Place)],
) -> Pieces {
    let n_corners = points.len();
    let mut splitter = Splitter {
        numbers: vec![NONE; n_corners],
        n_corners,
        points,
        sets,
        nodes: Vec::with_capacity(2 * leaves.len()),
        vertices: Vec::new(),
        elements: Vec::with_capacity(leaves.len()),
    };
    let mut patch_edges = vec![NONE; across.len()];
    let mut leaves = leaves;
    for (p, patch) in patches.iter_mut().enumerate() {
        let ids = patch.corners.vertices();
        let mut cell =
            Cell { corners: [NONE; 4], edges: [EdgeUse { node: NONE, against: false }; 4], n: ids.len() };
        for (e, v) in ids.iter().enumerate() {
            cell.corners[e] = v.0;
            let slot = 4 * p + e;
            let shared = if across[slot] == NONE { NONE } else { patch_edges[across[slot] as usize] };
            let node = if shared == NONE { splitter.new_edge() } else { shared };
            patch_edges[slot] = node;
            // Edges that continue each other run in opposite directions.
            cell.edges[e] = EdgeUse { node, against: shared != NONE };
        }
        let n = leaves.iter().take_while(|leaf| leaf.0 as usize == p).count();
        let (own, rest) = leaves.split_at(n);
        leaves = rest;
        let start = splitter.elements.len();
        splitter.cut(
            patch,
            PatchId(p as u32),
            cell,
            Place::ROOT,
            &mut own.iter().map(|leaf| leaf.1).peekable(),
        );
        patch.corners = splitter.numbered(&cell);
        patch.elements = start as u32..splitter.elements.len() as u32;
        patch.area_m2 = splitter.elements[start..].iter().map(|e| e.area_m2).fold(0.0, |sum, a| sum + a);
    }
    splitter.link()
}

impl Splitter<'_> {
    fn new_edge(&mut self) -> u32 {
        self.nodes.push(EdgeNode::NEW);
        self.nodes.len() as u32 - 1
    }

    fn new_point(&mut self, at: DVec3) -> u32 {
        self.points.push(at);
        self.numbers.push(NONE);
        self.points.len() as u32 - 1
    }

    /// The middle of an edge, made when it has none.
    fn middle(&mut self, edge: EdgeUse, a: u32, b: u32) -> u32 {
        if self.nodes[edge.node as usize].middle == NONE {
            let at = 0.5 * (self.points[a as usize] + self.points[b as usize]);
            let middle = self.new_point(at);
            let halves = [self.new_edge(), self.new_edge()];
            let node = &mut self.nodes[edge.node as usize];
            (node.middle, node.halves) = (middle, halves);
        }
        self.nodes[edge.node as usize].middle
    }

    /// The half of a split edge that its user comes to first (0) or second (1).
    fn half(&self, edge: EdgeUse, which: usize) -> EdgeUse {
        let halves = self.nodes[edge.node as usize].halves;
        EdgeUse { node: halves[which ^ usize::from(edge.against)], ..edge }
    }

    fn cut(
        &mut self,
        patch: &Patch,
        id: PatchId,
        cell: Cell,
        place: Place,
        leaves: &mut std::iter::Peekable<impl Iterator<Item = Place>>,
    ) {
        if leaves.next_if_eq(&place).is_some() {
            return self.element(patch, id, cell, place);
        }
        if leaves.peek().is_none_or(|leaf| leaf.at_level(place.level()) != place) {
            return;
        }
        let quarters = if cell.n == 4 { self.quad_quarters(&cell) } else { self.triangle_quarters(&cell) };
        for (k, quarter) in (0..).zip(quarters) {
            self.cut(patch, id, quarter, place.quarter(k), leaves);
        }
    }

    fn middles(&mut self, cell: &Cell) -> [u32; 4] {
        let mut middles = [NONE; 4];
        for (e, middle) in middles.iter_mut().enumerate().take(cell.n) {
            *middle = self.middle(cell.edges[e], cell.corners[e], cell.corners[(e + 1) % cell.n]);
        }
        middles
    }

    fn quad_quarters(&mut self, cell: &Cell) -> [Cell; 4] {
        let [a, b, c, d] = cell.corners;
        let m = self.middles(cell);
        let sum = [a, b, c, d].iter().fold(DVec3::ZERO, |s, v| s + self.points[*v as usize]);
        let z = self.new_point(0.25 * sum);
        // Inner edges run from the middles to the centre.
        let along: [EdgeUse; 4] = std::array::from_fn(|_| EdgeUse { node: self.new_edge(), against: false });
        let back = along.map(|edge| EdgeUse { against: true, ..edge });
        let h = |e: usize, which| self.half(cell.edges[e], which);
        [
            ([a, m[0], z, m[3]], [h(0, 0), along[0], back[3], h(3, 1)]),
            ([m[0], b, m[1], z], [h(0, 1), h(1, 0), along[1], back[0]]),
            ([m[3], z, m[2], d], [along[3], back[2], h(2, 1), h(3, 0)]),
            ([z, m[1], c, m[2]], [back[1], h(1, 1), h(2, 0), along[2]]),
        ]
        .map(|(corners, edges)| Cell { corners, edges, n: 4 })
    }

    fn triangle_quarters(&mut self, cell: &Cell) -> [Cell; 4] {
        let [a, b, c, _] = cell.corners;
        let m = self.middles(cell);
        // Inner edges run as the corner quarters walk them.
        let along: [EdgeUse; 3] = std::array::from_fn(|_| EdgeUse { node: self.new_edge(), against: false });
        let back = along.map(|edge| EdgeUse { against: true, ..edge });
        let h = |e: usize, which| self.half(cell.edges[e], which);
        let unused = EdgeUse { node: NONE, against: false };
        [
            ([a, m[0], m[2]], [h(0, 0), along[0], h(2, 1)]),
            ([m[0], b, m[1]], [h(0, 1), h(1, 0), along[1]]),
            ([m[2], m[1], c], [along[2], h(1, 1), h(2, 0)]),
            ([m[1], m[2], m[0]], [back[2], back[0], back[1]]),
        ]
        .map(|([a, b, c], [e0, e1, e2])| Cell {
            corners: [a, b, c, NONE],
            edges: [e0, e1, e2, unused],
            n: 3,
        })
    }

    fn element(&mut self, patch: &Patch, id: PatchId, cell: Cell, place: Place) {
        let provisional = cell.as_corners(|v| v);
        let area_m2 = facet(&self.points, &provisional).1;
        let number = self.elements.len() as u32;
        for (e, edge) in cell.edges.iter().enumerate().take(cell.n) {
            self.nodes[edge.node as usize].sides[usize::from(edge.against)] = 4 * number + e as u32;
        }
        let corners = self.numbered(&cell);
        self.elements.push(Element {
            corners,
            patch: id,
            place,
            area_m2,
            normal: patch.normal,
            neighbours: [None; 4],
            continuity: [Continuity::Broken; 4],
        });
    }

    /// The final numbers of the corners of a cell.
    fn numbered(&mut self, cell: &Cell) -> Corners {
        cell.as_corners(|v| self.number(v))
    }

    fn number(&mut self, v: u32) -> u32 {
        let root = if (v as usize) < self.n_corners { self.sets.find(v) } else { v };
        let slot = &mut self.numbers[root as usize];
        if *slot == NONE {
            *slot = self.vertices.len() as u32;
            let position = self.points[root as usize];
            self.vertices.push(Vertex { position, normal: DVec3::ZERO, inward: DVec3::ZERO });
        }
        *slot
    }

    /// Neighbours over every edge; hanging vertices.
    fn link(self) -> Pieces {
        let Splitter { nodes, vertices, mut elements, numbers, .. } = self;
        let (mut hanging, mut too_coarse) = (Vec::new(), Vec::new());
        let place = |side: u32| (ElementId(side / 4), (side % 4) as usize);
        for node in &nodes {
            match node.sides {
                [NONE, NONE] => {}
                [a, b] if a != NONE && b != NONE => {
                    join(&mut elements, place(a), place(b).0);
                    join(&mut elements, place(b), place(a).0);
                }
                [a, _] if node.middle != NONE => {
                    // The coarse side walks the halves in its own direction.
                    let against = usize::from(a == NONE);
                    let coarse = place(node.sides[against]);
                    let fine = [against, 1 - against]
                        .map(|half| nodes[node.halves[half] as usize].sides[1 - against]);
                    if fine.contains(&NONE) {
                        too_coarse.push(coarse.0);
                        continue;
                    }
                    let fine = fine.map(place);
                    join(&mut elements, coarse, fine[0].0);
                    fine.iter().for_each(|fine| join(&mut elements, *fine, coarse.0));
                    let (a, b) = elements[coarse.0.0 as usize].corners.edge(coarse.1);
                    hanging.push(Hanging {
                        vertex: VertexId(numbers[node.middle as usize]),
                        coarse: coarse.0,
                        edge: coarse.1 as u8,
                        ends: [a, b],
                        fine: fine.map(|fine| fine.0),
                    });
                }
                _ => {}
            }
        }
        hanging.sort_unstable_by_key(|h: &Hanging| {
            (elements[h.coarse.0 as usize].place.level(), h.coarse, h.edge)
        });
        too_coarse.sort_unstable();
        too_coarse.dedup();
        Pieces { vertices, elements, hanging, too_coarse }
    }
}

impl Cell {
    fn as_corners(&self, mut of: impl FnMut(u32) -> u32) -> Corners {
        let [a, b, c, d] = self.corners;
        match self.n {
            3 => Corners::Triangle([a, b, c].map(|v| VertexId(of(v)))),
            _ => Corners::Quad([a, b, c, d].map(|v| VertexId(of(v)))),
        }
    }
}

fn join(elements: &mut [Element], (element, edge): (ElementId, usize), other: ElementId) {
    let element = &mut elements[element.0 as usize];
    element.neighbours[edge] = Some(other);
    element.continuity[edge] = Continuity::C1;
}
