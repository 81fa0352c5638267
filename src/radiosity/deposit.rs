//! What a shot adds: irradiance everywhere, the shooter's power, the variance of what visibility rays saw.
//!
//! ```text
//! radiosity of a patch, its Row --> E, unshot E of elements and vertices; shot power; kernel_variance
//! ```
//! Parallel over receivers, each written by one task: same bits for any number of threads.

use rayon::prelude::*;

use super::form_factors::Row;
use super::light_shots::LightShot;
use super::row::ROW_BLOCK;
use super::shooting::PatchOptics;
use super::state::State;
use crate::mesh::{Mesh, PatchId};
use crate::units::Rgb;

/// Blocks of receivers that one task updates.
const BLOCKS_PER_TASK: usize = 32;

/// Adds what a light does, `share` times.
pub(super) fn add_light(state: &mut State, shot: &LightShot, share: f64) {
    for (element, e) in state.elements.iter_mut().zip(&shot.elements) {
        element.irradiance.direct += *e * share;
        element.unshot += *e * share;
    }
    for (vertex, e) in state.vertices.iter_mut().zip(&shot.vertices) {
        vertex.direct += *e * share;
    }
    let power_w = shot.power_w * share;
    state.account.emitted_w += power_w;
    state.account.lost_w += power_w * shot.stray.lost;
    state.account.back_w += power_w * shot.stray.back;
    let [fronts_w, backs_w] = shot.passed_w;
    state.account.specular_w -= fronts_w * share;
    state.account.back_w -= backs_w * share;
    state.n_rays += shot.n_rays;
}

/// A patch shoots all that it has not shot yet.
pub(super) fn shoot(mesh: &Mesh, optics: &[PatchOptics], state: &mut State, patch: PatchId, row: &Row) {
    let p = patch.0 as usize;
    let direct = std::mem::take(&mut state.unshot_exitance[p]);
    let left_over = std::mem::take(&mut state.unshot_reflected[p]);
    let indirect = left_over + optics[p].reflectance * state.unshot_irradiance(mesh, p);
    for e in mesh.patches[p].elements.clone() {
        state.elements[e as usize].unshot = Rgb::BLACK;
    }
    deposit(mesh, state, patch, direct, indirect, row);
}

/// Radiosity `direct` and `indirect` (W/m^2) of a patch arrives everywhere.
pub(super) fn deposit(mesh: &Mesh, state: &mut State, patch: PatchId, direct: Rgb, indirect: Rgb, row: &Row) {
    add_row(state, direct, indirect, row);
    let (shot_w, area_m2) = (&mut state.shot_w[patch.0 as usize], mesh.patches[patch.0 as usize].area_m2);
    let before = if area_m2 > 0.0 { shot_w.sum() / area_m2 } else { 0.0 };
    *shot_w += (direct + indirect) * area_m2;
    add_variance(state, before, (direct + indirect).sum(), row);
    state.n_shots += 1;
}

/// What `more` radiosity, by the same rays as what its shooter has shot `before` (W/m^2, sums of the channels), adds to
/// the variance.
pub(super) fn add_variance(state: &mut State, before: f64, more: f64, row: &Row) {
    let squares = (before + more).powi(2) - before * before;
    for (surface, spread) in &row.spread {
        state.kernel_variance[*surface as usize] += squares * spread;
    }
}

/// What a shooter of these radiosities (W/m^2) adds everywhere.
pub(super) fn add_row(state: &mut State, direct: Rgb, indirect: Rgb, row: &Row) {
    let total = direct + indirect;
    pass_on(state, total, row.passed_m2);
    let per_task = BLOCKS_PER_TASK * ROW_BLOCK;
    state.elements.par_chunks_mut(per_task).enumerate().for_each(|(task, chunk)| {
        for (b, block) in chunk.chunks_mut(ROW_BLOCK).enumerate() {
            row.elements.for_block(task * BLOCKS_PER_TASK + b, |place, f| {
                let element = &mut block[place];
                element.irradiance.direct += direct * f;
                element.irradiance.indirect += indirect * f;
                element.unshot += total * f;
            });
        }
    });
    state.vertices.par_chunks_mut(per_task).enumerate().for_each(|(task, chunk)| {
        for (b, block) in chunk.chunks_mut(ROW_BLOCK).enumerate() {
            row.vertices.for_block(task * BLOCKS_PER_TASK + b, |place, f| {
                block[place].direct += direct * f;
                block[place].indirect += indirect * f;
            });
        }
    });
}

/// Power that panes passed on (W, as `per` x `passed`: where elements count it, and on backs), which is counted where it arrives, is not left on them.
fn pass_on(state: &mut State, per: Rgb, passed: [f64; 2]) {
    state.account.specular_w -= per * passed[0];
    state.account.back_w -= per * passed[1];
}
