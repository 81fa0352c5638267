//! What a solve holds in memory, mesh and caster aside.
//!
//! ```text
//! sizes of the solver's records --> bytes an element, a vertex, a patch, while patches shoot and while bundles do
//! ```
//! The two phases do not overlap: what only kernel shots need is given back before bundles begin. Rows of form factors
//! come on top of the first, up to [`SolveOptions::max_row_bytes`].

use serde::Serialize;

use super::SolveOptions;
use super::SplitIrradiance;
use super::receivers::Receiver;
use super::shooting::PatchOptics;
use super::state::ElementState;
use super::stochastic;
use crate::mesh::{Corners, Mesh};
use crate::units::Rgb;

/// Bytes per record, while patches shoot by kernel and while bundles shoot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PhaseBytes {
    /// Kernel shots, rows aside; of a quad's element with its four quadrature points.
    pub shots: u64,
    /// Stochastic shooting.
    pub stochastic: u64,
}

/// Memory of a solve (bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SolverMemory {
    /// An element.
    pub per_element: PhaseBytes,
    /// A vertex.
    pub per_vertex: PhaseBytes,
    /// A patch.
    pub per_patch: PhaseBytes,
    /// All of the mesh, in the phase that takes more, rows aside.
    pub total: u64,
    /// Rows of form factors at most.
    pub rows: u64,
}

/// What solving `mesh` takes.
pub fn of(mesh: &Mesh, options: &SolveOptions) -> SolverMemory {
    // A receiver's kernel value and strata, while its questions are asked; a ray's target in the mean.
    const PLAN: usize = size_of::<f64>() + 2 * size_of::<u8>();
    let receiver = size_of::<Receiver>() + PLAN;
    let irradiance = size_of::<SplitIrradiance>();
    let state = size_of::<ElementState>();
    let phase =
        |shots: usize, stochastic: usize| PhaseBytes { shots: shots as u64, stochastic: stochastic as u64 };
    let per_element = phase(state + 4 * receiver + size_of::<u32>(), state + stochastic::bytes_per_element());
    let per_vertex = phase(irradiance + receiver, irradiance + stochastic::bytes_per_vertex());
    // Optics and exitance; unshot exitance, unshot and shot power.
    let patch = size_of::<PatchOptics>() + 4 * size_of::<Rgb>();
    let per_patch = phase(patch, patch + size_of::<Rgb>());
    let n_triangles = mesh.elements.iter().filter(|e| matches!(e.corners, Corners::Triangle(_))).count();
    let all = |of: fn(&PhaseBytes) -> u64| {
        of(&per_element) * mesh.elements.len() as u64
            + of(&per_vertex) * mesh.vertices.len() as u64
            + of(&per_patch) * mesh.patches.len() as u64
    };
    let shots = all(|p| p.shots) - (n_triangles * receiver) as u64;
    let stochastic = if mesh.patches.len() > options.max_shooters { all(|p| p.stochastic) } else { 0 };
    SolverMemory {
        per_element,
        per_vertex,
        per_patch,
        total: shots.max(stochastic),
        rows: options.max_row_bytes,
    }
}
