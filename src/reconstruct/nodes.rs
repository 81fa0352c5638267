//! Nodes: a vertex as the elements of one continuity group see it.
//!
//! ```text
//!   E0 | E1        a C0 edge through v: E0, E2 and E1, E3 are two groups, so v has two nodes of one value
//!   ---v---        no C0 edge: one node; C0 edges that end in v: one node, its elements are joined around the end
//!   E2 | E3
//! ```
//! Groups are joined by C1 edges only. A step has a vertex on each side in the mesh; here it has nothing to do.

use std::ops::Range;

use super::derivatives::{Derivatives, Node};
use super::{GivenDerivatives, ReconstructOptions, c0, rules};
use crate::geom::tangent_frame;
use crate::mesh::{Continuity, Corners, ElementId, Mesh, VertexId};
use crate::units::Rgb;

/// Which nodes there are, and which node each corner of each element has.
#[derive(Debug)]
pub(super) struct NodeTable {
    /// Nodes of vertex v: `first[v]..first[v + 1]`.
    first: Vec<u32>,
    /// The vertex of each node.
    vertices: Vec<VertexId>,
    /// Per element and corner.
    of_corner: Vec<[u32; 4]>,
    /// Compressed rows: elements of node n are `elements[starts[n]..starts[n + 1]]`.
    starts: Vec<u32>,
    elements: Vec<ElementId>,
}

impl NodeTable {
    pub(super) fn new(mesh: &Mesh) -> NodeTable {
        let n_vertices = mesh.vertices.len();
        let mut table = NodeTable {
            first: Vec::with_capacity(n_vertices + 1),
            vertices: Vec::with_capacity(n_vertices),
            of_corner: vec![[0; 4]; mesh.elements.len()],
            starts: vec![0],
            elements: Vec::new(),
        };
        let mut groups = Groups::default();
        for v in 0..n_vertices as u32 {
            table.first.push(table.vertices.len() as u32);
            let vertex = VertexId(v);
            groups.find(mesh, vertex);
            for group in 0..groups.n_groups {
                let node = table.vertices.len() as u32;
                table.vertices.push(vertex);
                for (k, &element) in mesh.elements_around(vertex).iter().enumerate() {
                    if groups.of[k] == group {
                        table.elements.push(element);
                        let ids = mesh.elements[element.0 as usize].corners.vertices();
                        for (c, id) in ids.iter().enumerate() {
                            if *id == vertex {
                                table.of_corner[element.0 as usize][c] = node;
                            }
                        }
                    }
                }
                table.starts.push(table.elements.len() as u32);
            }
        }
        table.first.push(table.vertices.len() as u32);
        table
    }

    /// How many.
    pub(super) fn len(&self) -> usize {
        self.vertices.len()
    }

    /// The nodes of a vertex; none for a vertex without elements.
    pub(super) fn of_vertex(&self, vertex: VertexId) -> Range<usize> {
        self.first[vertex.0 as usize] as usize..self.first[vertex.0 as usize + 1] as usize
    }

    /// The node that an element has at a corner.
    pub(super) fn at(&self, element: ElementId, corner: usize) -> usize {
        self.of_corner[element.0 as usize][corner] as usize
    }

    /// Where a node stands.
    pub(super) fn vertex(&self, node: usize) -> VertexId {
        self.vertices[node]
    }

    /// The elements that share a node.
    pub(super) fn elements(&self, node: usize) -> &[ElementId] {
        &self.elements[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// The nodes at the other ends of a node's element edges, each vertex once.
    pub(super) fn edge_neighbours(&self, mesh: &Mesh, node: usize, out: &mut Vec<usize>) {
        out.clear();
        for &element in self.elements(node) {
            let n = mesh.elements[element.0 as usize].corners.vertices().len();
            let Some(c) = (0..n).find(|c| self.at(element, *c) == node) else { continue };
            for corner in [(c + 1) % n, (c + n - 1) % n] {
                let other = self.at(element, corner);
                if other != node && out.iter().all(|o| self.vertex(*o) != self.vertex(other)) {
                    out.push(other);
                }
            }
        }
    }
}

/// The groups of the elements around one vertex.
#[derive(Default)]
struct Groups {
    /// Of each element around, in the mesh's order.
    of: Vec<usize>,
    n_groups: usize,
}

impl Groups {
    fn find(&mut self, mesh: &Mesh, vertex: VertexId) {
        let around = mesh.elements_around(vertex);
        self.of.clear();
        self.of.extend(0..around.len());
        for (k, &element) in around.iter().enumerate() {
            let element = &mesh.elements[element.0 as usize];
            for edge in edges_at(&element.corners, vertex) {
                let Some(other) = element.neighbours[edge] else { continue };
                if element.continuity[edge] != Continuity::C1 {
                    continue;
                }
                if let Some(other) = around.iter().position(|e| *e == other) {
                    let (a, b) = (self.of[k], self.of[other]);
                    self.of.iter_mut().filter(|g| **g == a.max(b)).for_each(|g| *g = a.min(b));
                }
            }
        }
        // Numbers without gaps, in order of first appearance: a group's number is that of its first element.
        self.n_groups = 0;
        for k in 0..self.of.len() {
            if self.of[k] == k {
                self.of[k..].iter_mut().filter(|g| **g == k).for_each(|g| *g = self.n_groups);
                self.n_groups += 1;
            }
        }
    }
}

/// The two edges of an element that meet in a corner.
pub(super) fn edges_at(corners: &Corners, vertex: VertexId) -> impl Iterator<Item = usize> {
    let ids = corners.vertices();
    let n = ids.len();
    let corner = ids.iter().position(|v| *v == vertex);
    corner.into_iter().flat_map(move |c| [c, (c + n - 1) % n])
}

/// Values per vertex and derivatives per node.
#[derive(Debug)]
pub(super) struct Nodal<'m> {
    pub(super) mesh: &'m Mesh,
    pub(super) table: NodeTable,
    pub(super) values: Vec<Rgb>,
    pub(super) derivatives: Vec<Derivatives>,
    /// Elements that must stay between their corners; empty: none.
    pub(super) limited: Vec<bool>,
}

impl<'m> Nodal<'m> {
    /// Derivatives by the rules of `options`, or as given.
    pub(super) fn new(
        mesh: &'m Mesh,
        values: &[Rgb],
        options: &ReconstructOptions,
        given: Option<GivenDerivatives<'_>>,
    ) -> Nodal<'m> {
        let table = NodeTable::new(mesh);
        let derivatives = vec![Derivatives::default(); table.len()];
        let mut nodal = Nodal { mesh, table, values: values.to_vec(), derivatives, limited: Vec::new() };
        match given {
            Some(given) => rules::take(&mut nodal, given, options.twists),
            None => {
                rules::estimate_gradients(&mut nodal, options);
                c0::agree(&mut nodal);
                rules::estimate_hessians(&mut nodal, options);
            }
        }
        nodal
    }

    /// A node with all that belongs to it.
    pub(super) fn node(&self, node: usize) -> Node {
        let v = self.table.vertex(node).0 as usize;
        let vertex = &self.mesh.vertices[v];
        Node {
            position: vertex.position,
            value: self.values[v],
            frame: tangent_frame(vertex.normal),
            derivatives: self.derivatives[node],
        }
    }

    /// The corners of an element; of a triangle the last one twice.
    pub(super) fn corners(&self, element: ElementId) -> [Node; 4] {
        let n = self.mesh.elements[element.0 as usize].corners.vertices().len();
        std::array::from_fn(|k| self.node(self.table.at(element, k.min(n - 1))))
    }
}
