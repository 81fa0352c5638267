//! Edges inside surfaces across which less continues: flags on both sides, and vertices of each side's own.
//!
//! ```text
//! discontinuities --C0--> flags of both sides; one vertex, one value
//!                 --C-1-> no neighbours; elements around a vertex that no unbroken edge connects --> a vertex each
//!
//!      c | d        a b c d share the vertex in the middle: with the line up to it unbroken below, it is a dead end of
//!     ---+---       the line and stays one vertex; with the line through it a c | b d get one each, at the same place
//!      a | b
//! ```
//! A coarse edge is flagged with both of its finer neighbours, or not at all: it has one cubic. Where it breaks, its
//! hanging vertex hangs no more. New vertices come after all others, in the order of the vertices that they are split
//! from and of their first elements; the first group keeps the old one. Normals stay joint: the surface goes on, the
//! light does not.

use std::collections::{BTreeSet, HashMap};

use serde::{Deserialize, Serialize};

use super::build::rows_around;
use super::weld::DisjointSets;
use super::{Continuity, Corners, ElementId, Mesh, Place, SubdivisionError, VertexId};
use crate::geom::DVec3;

/// Less than C1 across an edge of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Discontinuity {
    /// Index of the element.
    pub element: u32,
    /// Which edge of it.
    pub edge: u8,
    /// C0 or broken.
    pub continuity: Continuity,
}

impl Mesh {
    /// All that see an edge: the element with it, and those across; for part of a coarse edge, all along that. Only this
    /// one where nothing continues.
    pub fn sides_of_edge(&self, element: ElementId, edge: usize) -> Vec<(ElementId, usize)> {
        if let Some(hanging) = self.hanging_on(element, edge) {
            let fine = hanging.fine.map(|fine| (fine, self.edge_toward(fine, element)));
            return std::iter::once((element, edge))
                .chain(fine.into_iter().filter_map(|(fine, k)| Some((fine, k?))))
                .collect();
        }
        let own = (element, edge);
        let Some(other) = self.elements[element.0 as usize].neighbours[edge] else { return vec![own] };
        match self.edge_toward(other, element) {
            Some(back) if self.hanging_on(other, back).is_some() => self.sides_of_edge(other, back),
            Some(back) => vec![own, (other, back)],
            None => vec![own],
        }
    }

    /// The edge of `element` that `other` lies across.
    fn edge_toward(&self, element: ElementId, other: ElementId) -> Option<usize> {
        let n = self.elements[element.0 as usize].corners.vertices().len();
        (0..n).find(|&k| self.neighbours_across(element, k).any(|e| e == other))
    }

    /// Less than C1 across edges inside continuity groups, as [`Mesh::build_with`] was told.
    pub fn discontinuities(&self) -> &[Discontinuity] {
        &self.discontinuities
    }

    /// Vertices that a broken line parts from others at their place, or from the coarse edge that they would hang on; in
    /// rising order. Not the ends of lines.
    pub fn line_vertices(&self) -> &[VertexId] {
        &self.line_vertices
    }

    /// Lets less continue across some edges of a mesh that has none such yet.
    pub(super) fn part(&mut self, list: &[Discontinuity]) -> Result<(), SubdivisionError> {
        for d in list {
            let n = self.elements.get(d.element as usize).map_or(0, |e| e.corners.vertices().len());
            if usize::from(d.edge) >= n || d.continuity == Continuity::C1 {
                return Err(SubdivisionError::Edge { element: d.element, edge: d.edge });
            }
        }
        if list.is_empty() {
            return Ok(());
        }
        self.discontinuities = list.to_vec();
        let of = |continuity| list.iter().filter(move |d| d.continuity == continuity);
        let place = |d: &Discontinuity| (ElementId(d.element), usize::from(d.edge));
        let mut broken = BTreeSet::new();
        for d in of(Continuity::Broken) {
            let (element, edge) = place(d);
            // Borders are broken already.
            let sides = self.sides_of_edge(element, edge);
            if sides.len() > 1 {
                broken.extend(sides);
            }
        }
        for d in of(Continuity::C0) {
            let (element, edge) = place(d);
            let sides = self.sides_of_edge(element, edge);
            if sides.len() > 1 {
                sides.into_iter().for_each(|(e, k)| {
                    self.elements[e.0 as usize].continuity[k] = Continuity::C0;
                });
            }
        }
        // Ends of broken edges; what hung on them is on the line too, on its fine side alone.
        let mut touched = BTreeSet::new();
        let mut freed = BTreeSet::new();
        for &(element, edge) in &broken {
            let (a, b) = self.elements[element.0 as usize].corners.edge(edge);
            touched.extend([a, b]);
            freed.extend(self.hanging_on(element, edge).map(|h| h.vertex));
        }
        for &(element, edge) in &broken {
            let element = &mut self.elements[element.0 as usize];
            (element.continuity[edge], element.neighbours[edge]) = (Continuity::Broken, None);
        }
        self.hanging.retain(|h| !broken.contains(&(h.coarse, usize::from(h.edge))));
        touched.extend(&freed);
        self.split_vertices(&touched, &freed);
        Ok(())
    }

    /// Gives each group of elements around these vertices its own one. Those `freed` have a line on one side of all their
    /// elements.
    fn split_vertices(&mut self, touched: &BTreeSet<VertexId>, freed: &BTreeSet<VertexId>) {
        let hangs: HashMap<VertexId, [ElementId; 2]> =
            self.hanging.iter().map(|h| (h.vertex, h.fine)).collect();
        let mut moved: Vec<(ElementId, VertexId)> = Vec::new();
        for &vertex in touched {
            let groups = self.groups_around(vertex, hangs.get(&vertex));
            let [first, others @ ..] = &groups[..] else { continue };
            if others.is_empty() {
                self.line_vertices.extend(freed.get(&vertex));
                continue;
            }
            let old = self.vertices[vertex.0 as usize];
            self.vertices[vertex.0 as usize].inward = self.way_into(first, old.position);
            self.line_vertices.push(vertex);
            for group in others {
                let new = VertexId(self.vertices.len() as u32);
                let inward = self.way_into(group, old.position);
                self.vertices.push(super::Vertex { inward, ..old });
                self.line_vertices.push(new);
                for &e in group {
                    let corners = &mut self.elements[e.0 as usize].corners;
                    *corners = corners.map(|v| if v == vertex { new } else { v });
                    moved.push((e, new));
                }
            }
        }
        self.line_vertices.sort_unstable();
        let Mesh { hanging, elements, vertices, .. } = self;
        let at = |v: VertexId| vertices[v.0 as usize].position;
        for h in hanging.iter_mut() {
            let (a, b) = elements[h.coarse.0 as usize].corners.edge(h.edge.into());
            h.ends = [a, b];
            let corners = elements[h.fine[0].0 as usize].corners;
            h.vertex = *corners.vertices().iter().find(|v| at(**v) == at(h.vertex)).unwrap_or(&h.vertex);
        }
        let patches: BTreeSet<_> = moved.iter().map(|(e, _)| self.elements[e.0 as usize].patch).collect();
        for p in patches {
            let own = |j: usize| self.corner_of(p, Place::ROOT, j);
            self.patches[p.0 as usize].corners = match self.patches[p.0 as usize].corners {
                Corners::Triangle(_) => Corners::Triangle([0, 1, 2].map(own)),
                Corners::Quad(_) => Corners::Quad([0, 1, 2, 3].map(own)),
            };
        }
        (self.vertex_element_starts, self.vertex_elements) = rows_around(&self.vertices, &self.elements);
    }

    /// The elements around a vertex in groups that unbroken edges, or the coarse element that it hangs on, connect; each
    /// in rising order, by their first.
    fn groups_around(&self, vertex: VertexId, hangs: Option<&[ElementId; 2]>) -> Vec<Vec<ElementId>> {
        let around = self.elements_around(vertex);
        let mut sets = DisjointSets::new(around.len());
        let index = |e: ElementId| around.iter().position(|a| *a == e).map(|i| i as u32);
        for (i, e) in around.iter().enumerate() {
            let element = &self.elements[e.0 as usize];
            for k in 0..element.corners.vertices().len() {
                let (a, b) = element.corners.edge(k);
                if a == vertex || b == vertex {
                    let across = self.neighbours_across(*e, k);
                    across.filter_map(index).for_each(|j| sets.union(i as u32, j));
                }
            }
        }
        if let Some((a, b)) = hangs.and_then(|[a, b]| Some((index(*a)?, index(*b)?))) {
            sets.union(a, b);
        }
        let mut groups: Vec<(u32, Vec<ElementId>)> = Vec::new();
        for (i, e) in around.iter().enumerate() {
            let root = sets.find(i as u32);
            match groups.iter_mut().find(|group| group.0 == root) {
                Some(group) => group.1.push(*e),
                None => groups.push((root, vec![*e])),
            }
        }
        groups.into_iter().map(|group| group.1).collect()
    }

    /// From a point to the mean of the centroids of some elements (m).
    fn way_into(&self, elements: &[ElementId], from: DVec3) -> DVec3 {
        elements.iter().map(|e| self.centroid(*e)).sum::<DVec3>() / elements.len() as f64 - from
    }
}

#[cfg(test)]
mod tests;
