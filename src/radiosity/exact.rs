//! The exact solution of small scenes, through a dense linear solve: the cross-check of progressive refinement.
//!
//! ```text
//! rows of all patches that emit or reflect --area means--> F (n x n) --LU of 1 - rho F, a channel at a time--> B
//! every patch shoots B once --rows--> E of elements and vertices, account
//! ```
//! The unknown is the radiosity of every patch, in the discretisation that progressive refinement has: shooters are
//! patches of uniform radiosity, receivers are elements, B_i = M_i + rho_i (H_i + sum_j F_ij B_j), where F_ij is the area
//! mean over the elements of i of their factors to j and H_i that of the irradiance from lights without area. The same rows
//! on both ways, so the two answers differ by what progressive refinement left unshot, and by rounding.
//! Memory: 24 n^2 bytes for F, the matrix and its factors, and the rows, 4 bytes a non-zero factor.

use faer::Mat;
use faer::prelude::*;

use super::shooting::{Solver, deposit};
use super::{Solution, SolveError, SolveOptions, SolveProgress};
use crate::mesh::{Mesh, PatchId};
use crate::raycast::RayCaster;
use crate::scene::Scene;
use crate::units::Rgb;

/// Patches at most: 0.6 GB of matrices, about 3 s of factoring a channel on two cores, and all their rows.
pub const MAX_PATCHES: usize = 5000;
/// Rows that are cast between two reports of progress.
const ROWS_AT_ONCE: usize = 16;

/// Memory that the matrices of `n` patches take (bytes).
fn matrix_bytes(n: usize) -> u64 {
    24 * (n as u64) * (n as u64)
}

/// Solves a small scene exactly.
///
/// # Errors
/// More than [`MAX_PATCHES`] patches; a caster that fails.
pub(super) fn run(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<Solution, SolveError> {
    let n_patches = mesh.patches.len();
    if n_patches > MAX_PATCHES {
        let (bytes, limit) = (matrix_bytes(n_patches), MAX_PATCHES);
        return Err(SolveError::TooManyForExact { n_patches, limit, bytes });
    }
    let options = SolveOptions { max_row_bytes: u64::MAX, ..*options };
    let mut solver = Solver::new(scene, mesh, &options, caster.surface_offset_m());
    let mut state = solver.begin(caster)?;
    let active: Vec<PatchId> = (0..n_patches as u32)
        .map(PatchId)
        .filter(|p| !(solver.exitance(*p).is_black() && solver.reflectance(*p).is_black()))
        .collect();
    for chunk in active.chunks(ROWS_AT_ONCE) {
        solver.cast_and_keep(&mut state, chunk, caster)?;
        let cast = state.known.len() as f64 / active.len() as f64;
        progress(SolveProgress { unshot_share: 1.0 - cast, ..solver.progress(&state) });
    }
    let radiosity = radiosities(mesh, &solver, &active, |p| state.unshot_irradiance(mesh, p))?;
    for (patch, b) in active.iter().zip(radiosity) {
        let exitance = solver.exitance(*patch);
        let Some(row) = solver.row(*patch) else { continue };
        deposit(mesh, &mut state, *patch, exitance, b - exitance, row);
    }
    state.unshot_exitance.fill(Rgb::BLACK);
    for element in &mut state.elements {
        element.unshot = Rgb::BLACK;
    }
    solver.measure_unshot(&mut state);
    Ok(Solution { exact: true, ..solver.finish(state, caster)? })
}

/// B of the patches `active`; all others are black. `from_lights`: irradiance of a patch by lights without area (W/m^2).
fn radiosities(
    mesh: &Mesh,
    solver: &Solver,
    active: &[PatchId],
    from_lights: impl Fn(usize) -> Rgb,
) -> Result<Vec<Rgb>, SolveError> {
    let n = active.len();
    let mut place = vec![usize::MAX; mesh.patches.len()];
    for (i, patch) in active.iter().enumerate() {
        place[patch.0 as usize] = i;
    }
    let mut factors = Mat::<f64>::zeros(n, n);
    for (j, patch) in active.iter().enumerate() {
        let Some(row) = solver.row(*patch) else { continue };
        row.elements.for_each(|e, factor| {
            let element = &mesh.elements[e];
            let i = place[element.patch.0 as usize];
            if i != usize::MAX {
                let area_m2 = mesh.patches[element.patch.0 as usize].area_m2;
                factors[(i, j)] += element.area_m2 * factor / area_m2;
            }
        });
    }
    let mut solved = [Vec::new(), Vec::new(), Vec::new()];
    for c in 0..3 {
        let rho = |i: usize| solver.reflectance(active[i]).0[c];
        let same = (0..c).find(|&d| (0..n).all(|i| solver.reflectance(active[i]).0[d] == rho(i)));
        let matrix = Mat::<f64>::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - rho(i) * factors[(i, j)]);
        let _ = same;
        let right = Mat::<f64>::from_fn(n, 1, |i, _| {
            let patch = active[i];
            solver.exitance(patch).0[c] + rho(i) * from_lights(patch.0 as usize).0[c]
        });
        let x = matrix.partial_piv_lu().solve(&right);
        solved[c] = (0..n).map(|i| x[(i, 0)]).collect();
    }
    Ok((0..n).map(|i| Rgb([solved[0][i], solved[1][i], solved[2][i]])).collect())
}

#[cfg(test)]
#[path = "exact_tests.rs"]
mod tests;
