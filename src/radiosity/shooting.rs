//! Progressive refinement: the patch with most unshot power shoots until little is left.
//!
//! ```text
//! lights --direct--> E, unshot E
//! loop: patch with most unshot power --row of form factors--> E, unshot E of every element and vertex --> account
//! ```
//! Unshot radiosity of patch j: area mean over its elements of (M not yet shot + rho x E not yet shot). What M carries
//! counts as direct, the rest as indirect. Source: Cohen, Chen, Wallace, Greenberg 1988.
//!
//! Rows are cast once and kept (`max_row_bytes`); a row that does not fit is cast again, the same rays, so the
//! result does not depend on the memory (the number of rays cast does). Parallel over receivers, each written by one task: same bits for any
//! number of threads. Not modelled: the ambient term (display only).

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::form_factors::{Aim, FormFactors, Row, StrayShares};
use super::light_shots::{self, LightShot};
use super::receivers::Receivers;
use super::row::ROW_BLOCK;
use super::{EnergyAccount, RowSumError, Solution, SolveError, SolveOptions, SolveProgress, SplitIrradiance};
use crate::mesh::{Mesh, PatchId};
use crate::raycast::RayCaster;
use crate::scene::Scene;
use crate::units::Rgb;

/// Emitting patches are looked at with all strata from everywhere when there are at most this many; among more, the
/// errors of single ones average out, and rays would be spent fourfold.
const MAX_FULL_SHOOTERS: usize = 256;
/// Rows that are cast in one query, while there is memory to keep them: a command of the board is worth its set-up then,
/// and its clusters get equal shares. What is cast ahead and never shoots is at most this many rows.
const ROWS_PER_QUERY: usize = 16;
/// Blocks of receivers that one task updates.
const BLOCKS_PER_TASK: usize = 32;

/// Reflectance and what is neither reflected nor absorbed, of one patch.
#[derive(Clone, Copy)]
struct PatchOptics {
    reflectance: Rgb,
    /// Specular and transmitted share.
    passed: Rgb,
}

/// An element while power is shot.
#[derive(Clone, Copy, Default)]
struct ElementState {
    irradiance: SplitIrradiance,
    unshot: Rgb,
}

pub(super) fn run(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<Solution, SolveError> {
    let offset_m = caster.surface_offset_m();
    let receivers = Receivers::of(mesh, offset_m);
    let factors = FormFactors {
        mesh,
        receivers: &receivers,
        seed: options.seed,
        offset_m,
        dense: options.dense_visibility,
    };
    let mut state = State::new(scene, mesh, &receivers);
    for light in &scene.lights {
        state.add_light(&light_shots::shoot(mesh, &receivers, light, caster)?);
    }
    let n_emitters = state.unshot_exitance.iter().filter(|m| !m.is_black()).count();
    let mut rows = RowStore::new(options.max_row_bytes);
    let emitted = state.account.emitted_w.sum();
    let is_full = |exitance: &[Rgb], patch: PatchId| {
        n_emitters <= MAX_FULL_SHOOTERS && !exitance[patch.0 as usize].is_black()
    };
    while state.n_shots < options.max_shots {
        let unshot = state.unshot_power_w();
        if unshot <= options.unshot_share * emitted {
            break;
        }
        let Some(patch) = state.strongest() else { break };
        let cast;
        let row = match rows.rows.get(&patch) {
            Some(row) => row,
            None => {
                let batch: Vec<(PatchId, bool)> = state
                    .strongest_without_row(&rows)
                    .into_iter()
                    .map(|patch| (patch, is_full(&state.exitance, patch)))
                    .collect();
                let (strays, n_stray_rays) = factors.stray_shares(&batch, caster)?;
                let aims: Vec<Aim> = strays.iter().map(|(_, aim)| *aim).collect();
                let mut batch_rows = factors.rows(&aims, caster)?;
                state.n_rays += n_stray_rays + batch_rows.iter().map(|(_, n_rays)| n_rays).sum::<u64>();
                for ((stray, aim), (row, _)) in strays.iter().zip(&batch_rows) {
                    rows.keep(mesh, aim.patch, row, *stray);
                }
                cast = batch_rows.swap_remove(0).0;
                &cast
            }
        };
        state.shoot(patch, row);
        progress(SolveProgress { n_shots: state.n_shots, unshot_share: state.unshot_power_w() / emitted });
    }
    Ok(state.finish(&rows))
}

/// What is known of a patch whose row was cast.
#[derive(Clone, Copy)]
struct Known {
    stray: StrayShares,
    area_m2: f64,
    row_sum: f64,
}

/// Rows kept, up to a bound of memory, and the record of every shooter.
struct RowStore {
    max_bytes: u64,
    n_bytes: u64,
    full: bool,
    rows: BTreeMap<PatchId, Row>,
    known: BTreeMap<PatchId, Known>,
}

impl RowStore {
    fn new(max_bytes: u64) -> RowStore {
        RowStore { max_bytes, n_bytes: 0, full: false, rows: BTreeMap::new(), known: BTreeMap::new() }
    }

    fn keep(&mut self, mesh: &Mesh, patch: PatchId, row: &Row, stray: StrayShares) {
        self.known.entry(patch).or_insert_with(|| {
            let area_m2 = mesh.patches[patch.0 as usize].area_m2;
            let arrived = row.elements.weighted_sum(|e| mesh.elements[e].area_m2);
            Known { stray, area_m2, row_sum: arrived / area_m2 + stray.lost + stray.back }
        });
        if self.n_bytes + row.n_bytes() <= self.max_bytes {
            self.n_bytes += row.n_bytes();
            self.rows.insert(patch, row.clone());
        } else {
            self.full = true;
        }
    }

    /// True once a row did not fit.
    fn is_full(&self) -> bool {
        self.full
    }

    fn row_sum_error(&self) -> RowSumError {
        let (mut max, mut sum, mut area) = (0.0_f64, 0.0, 0.0);
        for known in self.known.values() {
            let error = (known.row_sum - 1.0).abs();
            // A NaN must show, which `f64::max` would hide.
            max = if error <= max { max } else { error };
            sum += known.area_m2 * error;
            area += known.area_m2;
        }
        RowSumError { max, mean: if area > 0.0 { sum / area } else { 0.0 } }
    }
}

/// Everything that changes while power is shot.
struct State<'a> {
    mesh: &'a Mesh,
    optics: Vec<PatchOptics>,
    exitance: Vec<Rgb>,
    unshot_exitance: Vec<Rgb>,
    elements: Vec<ElementState>,
    vertices: Vec<SplitIrradiance>,
    /// Unshot power of every patch (W).
    unshot_w: Vec<Rgb>,
    /// Power that every patch has shot (W).
    shot_w: Vec<Rgb>,
    account: EnergyAccount,
    n_shots: usize,
    n_rays: u64,
}

impl<'a> State<'a> {
    fn new(scene: &Scene, mesh: &'a Mesh, receivers: &Receivers) -> State<'a> {
        let surface = |p: &crate::mesh::Patch| &scene.surfaces[p.surface.0 as usize];
        let optics = mesh.patches.iter().map(|p| {
            let material = scene.material(surface(p));
            PatchOptics {
                reflectance: material.reflectance,
                passed: material.specular + material.transmission,
            }
        });
        let exitance: Vec<Rgb> = mesh.patches.iter().map(|p| surface(p).exitance).collect();
        let emitted_w = mesh.patches.iter().zip(&exitance).map(|(p, m)| *m * p.area_m2).sum();
        let mut state = State {
            mesh,
            optics: optics.collect(),
            unshot_exitance: exitance.clone(),
            exitance,
            elements: vec![ElementState::default(); receivers.n_elements()],
            vertices: vec![SplitIrradiance::default(); mesh.vertices.len()],
            unshot_w: Vec::new(),
            shot_w: vec![Rgb::BLACK; mesh.patches.len()],
            account: EnergyAccount { emitted_w, ..EnergyAccount::default() },
            n_shots: 0,
            n_rays: 0,
        };
        state.measure_unshot();
        state
    }

    fn add_light(&mut self, shot: &LightShot) {
        for (element, e) in self.elements.iter_mut().zip(&shot.elements) {
            element.irradiance.direct += *e;
            element.unshot += *e;
        }
        for (vertex, e) in self.vertices.iter_mut().zip(&shot.vertices) {
            vertex.direct += *e;
        }
        self.account.emitted_w += shot.power_w;
        self.account.lost_w += shot.power_w * shot.stray.lost;
        self.account.back_w += shot.power_w * shot.stray.back;
        self.n_rays += shot.n_rays;
        self.measure_unshot();
    }

    /// Area mean of the unshot irradiance over a patch (W/m^2).
    fn unshot_irradiance(&self, patch: usize) -> Rgb {
        let p = &self.mesh.patches[patch];
        let sum: Rgb = p
            .elements
            .clone()
            .map(|e| self.elements[e as usize].unshot * self.mesh.elements[e as usize].area_m2)
            .sum();
        if p.area_m2 > 0.0 { sum / p.area_m2 } else { Rgb::BLACK }
    }

    fn measure_unshot(&mut self) {
        let this = &*self;
        self.unshot_w = (0..this.mesh.patches.len())
            .into_par_iter()
            .with_min_len(512)
            .map(|p| {
                let reflected = this.optics[p].reflectance * this.unshot_irradiance(p);
                (this.unshot_exitance[p] + reflected) * this.mesh.patches[p].area_m2
            })
            .collect();
    }

    /// Unshot power of all patches and channels (W).
    fn unshot_power_w(&self) -> f64 {
        self.unshot_w.iter().map(|w| w.sum()).sum()
    }

    /// The patch with most unshot power, the first of equals; `None` when nothing is left.
    fn strongest(&self) -> Option<PatchId> {
        let mut best = (0.0, None);
        for (p, w) in self.unshot_w.iter().enumerate() {
            if w.sum() > best.0 {
                best = (w.sum(), Some(PatchId(p as u32)));
            }
        }
        best.1
    }

    /// The patches with most unshot power that have no row yet, strongest first: theirs are cast next, in one query.
    fn strongest_without_row(&self, rows: &RowStore) -> Vec<PatchId> {
        let mut patches: Vec<(f64, PatchId)> = (0..)
            .map(PatchId)
            .zip(&self.unshot_w)
            .map(|(patch, w)| (w.sum(), patch))
            .filter(|(power_w, patch)| *power_w > 0.0 && !rows.rows.contains_key(patch))
            .collect();
        patches.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        patches.truncate(if rows.is_full() { 1 } else { ROWS_PER_QUERY });
        patches.into_iter().map(|(_, patch)| patch).collect()
    }

    fn shoot(&mut self, patch: PatchId, row: &Row) {
        let p = patch.0 as usize;
        let direct = std::mem::take(&mut self.unshot_exitance[p]);
        let indirect = self.optics[p].reflectance * self.unshot_irradiance(p);
        let total = direct + indirect;
        for e in self.mesh.patches[p].elements.clone() {
            self.elements[e as usize].unshot = Rgb::BLACK;
        }
        let per_task = BLOCKS_PER_TASK * ROW_BLOCK;
        self.elements.par_chunks_mut(per_task).enumerate().for_each(|(task, chunk)| {
            for (b, block) in chunk.chunks_mut(ROW_BLOCK).enumerate() {
                row.elements.for_block(task * BLOCKS_PER_TASK + b, |place, f| {
                    let element = &mut block[place];
                    element.irradiance.direct += direct * f;
                    element.irradiance.indirect += indirect * f;
                    element.unshot += total * f;
                });
            }
        });
        self.vertices.par_chunks_mut(per_task).enumerate().for_each(|(task, chunk)| {
            for (b, block) in chunk.chunks_mut(ROW_BLOCK).enumerate() {
                row.vertices.for_block(task * BLOCKS_PER_TASK + b, |place, f| {
                    block[place].direct += direct * f;
                    block[place].indirect += indirect * f;
                });
            }
        });
        self.shot_w[p] += total * self.mesh.patches[p].area_m2;
        self.n_shots += 1;
        self.measure_unshot();
    }

    fn finish(mut self, rows: &RowStore) -> Solution {
        let account = &mut self.account;
        for (patch, known) in &rows.known {
            let power_w = self.shot_w[patch.0 as usize];
            account.lost_w += power_w * known.stray.lost;
            account.back_w += power_w * known.stray.back;
        }
        for (element, state) in self.mesh.elements.iter().zip(&self.elements) {
            let optics = &self.optics[element.patch.0 as usize];
            let incident_w = state.irradiance.total() * element.area_m2;
            account.specular_w += optics.passed * incident_w;
            account.absorbed_w += (Rgb::WHITE - optics.reflectance - optics.passed) * incident_w;
        }
        account.unshot_w = self.unshot_w.iter().copied().sum();
        account.residual_w = account.emitted_w
            - account.absorbed_w
            - account.unshot_w
            - account.lost_w
            - account.specular_w
            - account.back_w;
        Solution {
            element_irradiance: self.elements.iter().map(|e| e.irradiance).collect(),
            vertex_irradiance: self.vertices,
            account: self.account,
            n_shots: self.n_shots,
            n_shooters: self.shot_w.iter().filter(|w| !w.is_black()).count(),
            n_rays: self.n_rays,
            row_sum_error: rows.row_sum_error(),
        }
    }
}
