//! Memory of the host for a mesh, its solution and a solve: what one element, vertex and patch take.
//!
//! ```text
//! sizes of the records --> PerRecord (bytes each) x numbers of records --> bytes; rows of form factors by their bound
//! ```
//! Sizes are those of the types that hold the records. Not in it: the caster's, what a query holds for a moment, slack of
//! growing vectors.

use super::receivers::Receiver;
use super::row::SparseRow;
use super::shooting::PatchOptics;
use super::state::ElementState;
use super::stochastic;
use super::{SolveOptions, SplitIrradiance};
use crate::mesh::{Corners, Element, ElementId, Mesh, Patch, Vertex};
use crate::units::Rgb;

/// Bytes that one record of each kind takes, means over a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerRecord {
    /// An element.
    pub element_bytes: f64,
    /// A vertex.
    pub vertex_bytes: f64,
    /// A patch, its elements and vertices not in it.
    pub patch_bytes: f64,
}

/// What a mesh, a solution of it, and a solve take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HostMemory {
    /// Mesh.
    pub mesh: PerRecord,
    /// Solution.
    pub solution: PerRecord,
    /// While kernel shots last, beside both: state and receivers.
    pub solve: PerRecord,
    /// While bundles shoot what kernel shots leave, instead: these are over and have given theirs back.
    pub stochastic: PerRecord,
    /// A row of form factors, for a patch that every receiver sees.
    pub row_bytes: u64,
    /// All rows that a solve may keep: those of all patches, or its limit.
    pub max_row_bytes: u64,
    n: [usize; 3],
}

impl HostMemory {
    /// Of `mesh`, and of a solve with `options`.
    pub fn of(mesh: &Mesh, options: &SolveOptions) -> HostMemory {
        let (elements, vertices, patches) = (mesh.elements.len(), mesh.vertices.len(), mesh.patches.len());
        let mean = |bytes: usize, n: usize| bytes as f64 / n.max(1) as f64;
        let size = |n: usize| n as f64;
        // Elements around a vertex: a number for each corner, and where those of a vertex start.
        let corners: usize = mesh.elements.iter().map(|e| e.corners.vertices().len()).sum();
        let points: usize = mesh
            .elements
            .iter()
            .map(|e| match e.corners {
                Corners::Triangle(_) => 3,
                Corners::Quad(_) => 4,
            })
            .sum();
        let row_bytes = SparseRow::max_bytes(elements) + SparseRow::max_bytes(vertices);
        HostMemory {
            mesh: PerRecord {
                element_bytes: size(size_of::<Element>()) + mean(corners * size_of::<ElementId>(), elements),
                vertex_bytes: size(size_of::<Vertex>() + size_of::<u32>()),
                patch_bytes: size(size_of::<Patch>()),
            },
            solution: PerRecord {
                element_bytes: size(size_of::<SplitIrradiance>()),
                vertex_bytes: size(size_of::<SplitIrradiance>()),
                patch_bytes: 0.0,
            },
            solve: PerRecord {
                element_bytes: size(size_of::<ElementState>() + size_of::<u32>())
                    + mean(points * size_of::<Receiver>(), elements),
                vertex_bytes: size(size_of::<SplitIrradiance>() + size_of::<Receiver>()),
                // Exitance, unshot exitance, unshot and shot power.
                patch_bytes: size(size_of::<PatchOptics>() + 4 * size_of::<Rgb>()),
            },
            stochastic: PerRecord {
                element_bytes: size(size_of::<ElementState>()) + stochastic::bytes_per_element() as f64,
                vertex_bytes: size(size_of::<SplitIrradiance>()) + stochastic::bytes_per_vertex() as f64,
                patch_bytes: size(size_of::<PatchOptics>() + 4 * size_of::<Rgb>())
                    + stochastic::bytes_per_patch() as f64,
            },
            row_bytes,
            max_row_bytes: options.max_row_bytes.min(row_bytes.saturating_mul(patches as u64)),
            n: [elements, vertices, patches],
        }
    }

    /// All records of one of its parts.
    pub fn total_bytes(&self, part: PerRecord) -> u64 {
        let [elements, vertices, patches] = self.n.map(|n| n as f64);
        (elements * part.element_bytes + vertices * part.vertex_bytes + patches * part.patch_bytes) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::{room, scene};
    use crate::scene::MeshTarget;

    #[test]
    fn memory_of_a_mesh_by_record_is_what_the_mesh_holds() {
        let scene = scene(room(4.0, 3.0, 2.0), MeshTarget::Elements(3000));
        let mesh = Mesh::build(&scene);
        let memory = HostMemory::of(&mesh, &SolveOptions::default());
        let (by_record, held) = (memory.total_bytes(memory.mesh) as f64, mesh.memory_bytes() as f64);
        // The mesh's vectors may have room to grow.
        assert!(by_record <= 1.001 * held && by_record > 0.5 * held, "{by_record} of {held}");
        let n_records = (mesh.elements.len() + mesh.vertices.len()) as u64;
        assert_eq!(memory.total_bytes(memory.solution), 48 * n_records);
    }

    #[test]
    fn rows_of_few_patches_are_bound_by_their_size_and_those_of_many_by_the_limit() {
        let scene = scene(room(4.0, 3.0, 2.0), MeshTarget::Elements(600));
        let mesh = Mesh::build(&scene);
        let of = |max_row_bytes| {
            HostMemory::of(&mesh, &SolveOptions { max_row_bytes, ..SolveOptions::default() }).max_row_bytes
        };
        let row = HostMemory::of(&mesh, &SolveOptions::default()).row_bytes;
        let n = (mesh.elements.len() + mesh.vertices.len()) as f64;
        // Four bytes a factor, and an eighth and a sixteenth of a byte for its place.
        assert!((row as f64 / (n * 4.1875) - 1.0).abs() < 0.05, "{row}");
        assert_eq!(of(u64::MAX), row * mesh.patches.len() as u64);
        assert_eq!(of(1000), 1000);
    }
}
