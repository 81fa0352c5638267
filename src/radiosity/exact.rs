//! The exact solution of small scenes, through a dense linear solve: the cross-check of progressive refinement.
//!
//! ```text
//! rows of all patches that emit or reflect --area means--> F (n x n) --LU of 1 - rho F, a channel at a time, or those of one rho--> B
//! every patch shoots B once --rows--> E of elements and vertices, account
//! ```
//! The unknown is the radiosity of every patch, in the discretisation that progressive refinement has: shooters are
//! patches of uniform radiosity, receivers are elements (and large emitters shoot in their parts first, as always), B_i = M_i + rho_i (H_i + sum_j F_ij B_j), where F_ij is the area
//! mean over the elements of i of their factors to j and H_i that of the irradiance from lights without area. The same rows
//! on both ways, so the two answers differ by what progressive refinement left unshot, and by rounding.
//! Memory: 24 n^2 bytes for F, the matrix and its factors, and the rows, 4 bytes a non-zero factor.

use faer::Mat;
use faer::prelude::*;

use super::deposit::deposit;
use super::shooting::Solver;
use super::state::State;
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
    while solver.shoot_emitters(&mut state, caster)? {}
    // Of what shoots by patches.
    let exitance = |state: &State, patch: PatchId| state.unshot_exitance[patch.0 as usize];
    let active: Vec<PatchId> = (0..n_patches as u32)
        .map(PatchId)
        .filter(|p| !(exitance(&state, *p).is_black() && solver.reflectance(*p).is_black()))
        .collect();
    for chunk in active.chunks(ROWS_AT_ONCE) {
        solver.cast_and_keep(&mut state, chunk, caster)?;
        let cast = state.kept.patches.len() as f64 / active.len() as f64;
        progress(SolveProgress { unshot_share: 1.0 - cast, ..solver.progress(&state) });
    }
    let radiosity = radiosities(mesh, &solver, &state, &active);
    for (patch, b) in active.iter().zip(radiosity) {
        let exitance = exitance(&state, *patch);
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

/// B of the patches `active`; all others are black. What lights and large emitters sent waits in `state` to be reflected.
fn radiosities(mesh: &Mesh, solver: &Solver, state: &State, active: &[PatchId]) -> Vec<Rgb> {
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
    let received: Vec<Rgb> = active.iter().map(|p| state.unshot_irradiance(mesh, p.0 as usize)).collect();
    let mut radiosity = vec![Rgb::BLACK; n];
    let rho = |i: usize, c: usize| solver.reflectance(active[i]).0[c];
    let same = |c: usize, d: usize| (0..n).all(|i| rho(i, c) == rho(i, d));
    for c in 0..3 {
        // Channels of one reflectance are solved with one factoring.
        if (0..c).any(|earlier| same(earlier, c)) {
            continue;
        }
        let alike: Vec<usize> = (c..3).filter(|d| same(c, *d)).collect();
        let matrix =
            Mat::<f64>::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - rho(i, c) * factors[(i, j)]);
        let right = Mat::<f64>::from_fn(n, alike.len(), |i, k| {
            state.unshot_exitance[active[i].0 as usize].0[alike[k]] + rho(i, c) * received[i].0[alike[k]]
        });
        let solution = matrix.partial_piv_lu().solve(&right);
        for (i, b) in radiosity.iter_mut().enumerate() {
            alike.iter().enumerate().for_each(|(k, d)| b.0[*d] = solution[(i, k)]);
        }
    }
    radiosity
}

#[cfg(test)]
#[path = "exact_tests.rs"]
mod tests;
