//! Nodes of the quadtrees of patches: which elements one holds, the vertices at its corners; centroids of elements.

use crate::geom::DVec3;

use super::{Corners, ElementId, Mesh, PatchId, Place, VertexId};

impl Mesh {
    /// The elements of the node `place` of a patch's quadtree: one, where it is an element itself.
    pub(crate) fn elements_in(
        &self,
        patch: PatchId,
        place: Place,
    ) -> impl ExactSizeIterator<Item = ElementId> + use<> {
        let range = self.patches[patch.0 as usize].elements.clone();
        let own = &self.elements[range.start as usize..range.end as usize];
        let first = own.partition_point(|e| e.place < place);
        let n = own[first..].partition_point(|e| e.place.at_level(place.level()) == place);
        let first = range.start as usize + first;
        (first..first + n).map(|e| ElementId(e as u32))
    }

    /// Corner `j` of a node: that of the element in this corner of it.
    pub(crate) fn corner_of(&self, patch: PatchId, mut place: Place, j: usize) -> VertexId {
        // Quarters of a quad stand row by row.
        let quarter = match self.patches[patch.0 as usize].corners {
            Corners::Quad(_) => [0, 1, 3, 2][j],
            Corners::Triangle(_) => j as u32,
        };
        loop {
            let mut elements = self.elements_in(patch, place);
            match (elements.len(), elements.next()) {
                (2.., _) => place = place.quarter(quarter),
                (_, Some(only)) => return self.elements[only.0 as usize].corners.vertices()[j],
                (_, None) => unreachable!("a node without elements"),
            }
        }
    }

    /// Mean of the corners of an element (m).
    pub fn centroid(&self, element: ElementId) -> DVec3 {
        let corners = self.elements[element.0 as usize].corners;
        let ids = corners.vertices();
        ids.iter().map(|v| self.vertices[v.0 as usize].position).sum::<DVec3>() / ids.len() as f64
    }
}
