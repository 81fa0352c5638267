//! Progressive refinement: the patch with most unshot power shoots until little is left, or the rest is shot
//! stochastically.
//!
//! ```text
//! lights --direct--> E, unshot E
//! steps of large scenes: parts of emitting surfaces (`emitters.rs`) --row--> direct E
//! step: patch with most unshot power --row of form factors--> E, unshot E of every element and vertex --> account
//! past `max_shooters`, or where rays are cheaper: steps of `stochastic/`
//! ```
//! Unshot radiosity of patch j: area mean over its elements of (M not yet shot + rho x E not yet shot). What M carries
//! counts as direct, the rest as indirect. Source: Cohen, Chen, Wallace, Greenberg 1988.
//!
//! Rows are cast once and kept (`max_row_bytes`); a row that does not fit is cast again, the same rays, so the
//! result does not depend on the memory (the number of rays cast does). Parallel over receivers, each written by one
//! task: same bits for any number of threads. Not modelled: the ambient term (display only).

use rayon::prelude::*;

use super::casting::ROWS_PER_QUERY;
use super::deposit::{add_light, add_row, add_variance, shoot};
use super::emitters::{self, Emitter};
use super::form_factors::Row;
use super::light_shots::{self, LightShot};
use super::receivers::Receivers;
use super::row_cache::RowCache;
use super::rows::{self, RowStore};
use super::shooter::ShooterId;
use super::state::{State, magnitude};
use super::stochastic::{self, Stochastic};
use super::{Aids, FormFactorMethod, Solution, SolveError, SolveOptions, SolvePhase, SolveProgress};
use super::{Start, UnshotRadiosity, diagnostics, relight};
use crate::mesh::{Mesh, PatchId};
use crate::raycast::RayCaster;
use crate::raycast::transmit::Panes;
use crate::scene::{Light, Scene};
use crate::units::Rgb;

/// Reflectance and what is neither reflected nor absorbed, of one patch.
#[derive(Clone, Copy)]
pub(super) struct PatchOptics {
    pub reflectance: Rgb,
    /// Specular and transmitted share.
    pub passed: Rgb,
}

pub(super) fn run(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    start: Start<'_>,
    Aids { mut checkpoint, rows: row_cache }: Aids<'_>,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<Solution, SolveError> {
    let offset_m = caster.surface_offset_m();
    let mut solver = Solver { row_cache, ..Solver::new(scene, mesh, options, offset_m) };
    let resumed =
        checkpoint.as_mut().map_or(Ok(None), |c| c.resume(scene, mesh, options, start, offset_m))?;
    let mut state = match (resumed, start) {
        (Some(state), _) => {
            progress(SolveProgress { resumed: true, ..solver.progress(&state) });
            state
        }
        (None, Start::Anew) => solver.begin(caster)?,
        (None, Start::From(stored)) => relight::begin(&mut solver, stored, caster)?,
    };
    while solver.step(&mut state, caster)? {
        progress(solver.progress(&state));
        if let Some(checkpoint) = &mut checkpoint {
            checkpoint.after_step(&state)?;
        }
    }
    solver.finish(state, caster)
}

/// What a solve needs beside its [`State`]: all of it follows from scene, mesh and options.
pub(super) struct Solver<'a> {
    pub scene: &'a Scene,
    pub mesh: &'a Mesh,
    pub options: &'a SolveOptions,
    pub offset_m: f64,
    optics: Vec<PatchOptics>,
    pub panes: Panes,
    pub exitance: Vec<Rgb>,
    /// Patches that emit.
    pub n_emitting: usize,
    /// Of scenes that will end stochastically.
    pub emitters: Vec<Emitter>,
    /// While there are kernel shots.
    pub receivers: Option<Receivers>,
    rows: RowStore,
    /// Rows of earlier solves; those of this one go there, too.
    pub row_cache: Option<&'a mut RowCache>,
    stochastic: Option<Stochastic<'a>>,
}

impl<'a> Solver<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        mesh: &'a Mesh,
        options: &'a SolveOptions,
        offset_m: f64,
    ) -> Solver<'a> {
        let optics = mesh.patches.iter().map(|p| {
            let material = scene.material(&scene.surfaces[p.surface.0 as usize]);
            PatchOptics {
                reflectance: material.reflectance,
                passed: material.specular + material.transmission,
            }
        });
        let exitance: Vec<Rgb> =
            mesh.patches.iter().map(|p| scene.surfaces[p.surface.0 as usize].exitance).collect();
        Solver {
            scene,
            mesh,
            options,
            offset_m,
            optics: optics.collect(),
            panes: Panes::of(scene, mesh),
            n_emitting: exitance.iter().filter(|m| !m.is_black()).count(),
            exitance,
            emitters: match options.form_factors {
                FormFactorMethod::Vertex if is_large(mesh, options) => emitters::of(scene, mesh),
                _ => Vec::new(),
            },
            receivers: None,
            rows: RowStore::default(),
            row_cache: None,
            stochastic: None,
        }
    }

    /// The state before the first step: lights without area have shone, nothing was shot.
    pub(super) fn begin(&mut self, caster: &mut dyn RayCaster) -> Result<State, SolveError> {
        let mut state = State::new(self.scene, self.mesh);
        for light in &self.scene.lights {
            let shot = self.light_shot(light, caster)?;
            add_light(&mut state, &shot, 1.0);
        }
        self.measure_unshot(&mut state);
        Ok(state)
    }

    /// What a light without area does.
    pub(super) fn light_shot(
        &mut self,
        light: &Light,
        caster: &mut dyn RayCaster,
    ) -> Result<LightShot, SolveError> {
        let receivers = self.receivers.get_or_insert_with(|| Receivers::of(self.mesh, self.offset_m));
        Ok(light_shots::shoot(self.mesh, receivers, light, &self.panes, caster)?)
    }

    pub(super) fn reflectance(&self, patch: PatchId) -> Rgb {
        self.optics[patch.0 as usize].reflectance
    }

    /// One shot, or one chunk of stochastic rays; false, and nothing done, when the solve is over.
    pub(super) fn step(&mut self, state: &mut State, caster: &mut dyn RayCaster) -> Result<bool, SolveError> {
        if state.stochastic.is_none() {
            let emitted = magnitude(state.account.emitted_w);
            // A surface is not left with some of its parts shot: what is unshot is known by patch.
            let may_shoot = state.n_shots < self.options.max_shots || self.is_inside_emitter(state);
            if may_shoot && self.shoot_emitters(state, caster)? {
                return Ok(true);
            }
            if state.n_shots >= self.options.max_shots
                || state.unshot_power_w() <= self.options.unshot_share * emitted
            {
                return Ok(false);
            }
            let Some(patch) = strongest(state) else { return Ok(false) };
            // Bundles shoot what elements received: the rest of a change of reflectance goes first.
            let left_over = state.unshot_reflected.iter().position(|b| !b.is_black());
            let turns = self.turns_stochastic(state, patch);
            if !turns || left_over.is_some() {
                let patch = left_over.filter(|_| turns).map_or(patch, |p| PatchId(p as u32));
                self.shoot_strongest(state, patch, caster)?;
                return Ok(true);
            }
            self.measure_reciprocity(state, caster)?;
            self.receivers = None;
            self.rows.clear();
            state.stochastic = Some(stochastic::plan(self.mesh, &self.optics, self.options, state));
        }
        let stochastic = self.stochastic.get_or_insert_with(|| {
            let reflectance = self.optics.iter().map(|o| o.reflectance).collect();
            Stochastic::new(self.mesh, reflectance, self.offset_m, self.panes.clone())
        });
        stochastic.step(state, self.options, caster)
    }

    pub(super) fn progress(&self, state: &State) -> SolveProgress {
        let emitted = magnitude(state.account.emitted_w);
        let share = |w: f64| if emitted > 0.0 { w / emitted } else { 0.0 };
        let (phase, unshot_w) = match &state.stochastic {
            None => (SolvePhase::Shots, state.unshot_power_w()),
            Some(s) => (SolvePhase::Stochastic { done: s.done_share() }, s.unshot_power_w()),
        };
        SolveProgress {
            phase,
            n_shots: state.n_shots,
            n_rays: state.n_rays,
            unshot_share: share(unshot_w),
            resumed: false,
        }
    }

    /// True when the next shot would be by a patch without a row and there have been enough of those: past
    /// `max_shooters`, or where, in a scene that will get there, rays move the same power at the same error for less.
    fn turns_stochastic(&self, state: &State, patch: PatchId) -> bool {
        if self.options.form_factors == FormFactorMethod::Hemisphere {
            return true;
        }
        is_large(self.mesh, self.options)
            && !state.known.contains_key(&patch.0)
            && (state.known.len() >= self.options.max_shooters
                || stochastic::is_cheaper(self.mesh, &self.optics, self.options, state, patch))
    }

    fn need_receivers(&mut self) {
        if self.receivers.is_none() {
            self.receivers = Some(Receivers::of(self.mesh, self.offset_m));
        }
    }

    fn shoot_strongest(
        &mut self,
        state: &mut State,
        patch: PatchId,
        caster: &mut dyn RayCaster,
    ) -> Result<(), SolveError> {
        self.need_receivers();
        if self.rows.get(patch).is_none() && state.kept.patches.contains(&patch.0) {
            let (mut batch, _) = self.cast_rows(&[ShooterId::Patch(patch)], caster)?;
            self.rows.restore(patch, batch.swap_remove(0).0);
        }
        if let Some(row) = self.rows.get(patch) {
            shoot(self.mesh, &self.optics, state, patch, row);
        } else {
            let patches = self.strongest_without_row(state);
            let shooters: Vec<ShooterId> = patches.iter().copied().map(ShooterId::Patch).collect();
            let (mut batch, n_rays) = self.cast_rows(&shooters, caster)?;
            state.n_rays += n_rays;
            for (patch, (row, stray)) in patches.iter().zip(&batch) {
                self.rows.keep(state, self.mesh, *patch, row, *stray, self.options.max_row_bytes);
            }
            let (row, _) = batch.swap_remove(0);
            shoot(self.mesh, &self.optics, state, patch, &row);
        }
        self.measure_unshot(state);
        Ok(())
    }

    /// Casts rows and keeps them, whatever memory they take.
    #[cfg(feature = "exact")]
    pub(super) fn cast_and_keep(
        &mut self,
        state: &mut State,
        patches: &[PatchId],
        caster: &mut dyn RayCaster,
    ) -> Result<(), SolveError> {
        self.need_receivers();
        let shooters: Vec<ShooterId> = patches.iter().map(|p| ShooterId::Patch(*p)).collect();
        let (batch, n_rays) = self.cast_rows(&shooters, caster)?;
        state.n_rays += n_rays;
        for (patch, (row, stray)) in patches.iter().zip(&batch) {
            self.rows.keep(state, self.mesh, *patch, row, *stray, u64::MAX);
        }
        Ok(())
    }

    /// A row at hand.
    #[cfg(feature = "exact")]
    pub(super) fn row(&self, patch: PatchId) -> Option<&Row> {
        self.rows.get(patch)
    }

    /// True when some parts of an emitting surface have shot, and others have not.
    fn is_inside_emitter(&self, state: &State) -> bool {
        let last = (state.n_emitters as usize).checked_sub(1);
        last.and_then(|e| self.emitters.get(e)).is_some_and(|emitter| !emitter.is_last)
    }

    /// Shoots the next parts of emitting surfaces, as many as are cast in one query; false when there are none left.
    pub(super) fn shoot_emitters(
        &mut self,
        state: &mut State,
        caster: &mut dyn RayCaster,
    ) -> Result<bool, SolveError> {
        let n = self.emitters.len();
        let unshot = |e: &usize| !state.unshot_exitance[self.emitters[*e].patches.0 as usize].is_black();
        let Some(first) = (state.n_emitters as usize..n).find(unshot) else {
            state.n_emitters = n as u32;
            return Ok(false);
        };
        let last = (first..n).find(|e| !unshot(e)).unwrap_or(n);
        self.need_receivers();
        let last = (first + self.rows_per_query()).min(last);
        let shooters: Vec<ShooterId> = (first..last).map(|e| ShooterId::Emitter(e as u32)).collect();
        let (batch, n_rays) = self.cast_rows(&shooters, caster)?;
        state.n_rays += n_rays;
        for (e, (row, stray)) in (first..last).zip(&batch) {
            let Emitter { area_m2, patches, is_last, .. } = self.emitters[e];
            // All patches of the surface have the same.
            let exitance = state.unshot_exitance[patches.0 as usize];
            add_row(state, exitance, Rgb::BLACK, row);
            add_variance(state, 0.0, exitance.sum(), row);
            let power_w = exitance * area_m2;
            state.account.lost_w += power_w * stray.lost;
            state.account.back_w += power_w * stray.back;
            state
                .known
                .insert((self.mesh.patches.len() + e) as u32, rows::known(self.mesh, area_m2, row, *stray));
            state.n_shots += 1;
            if is_last {
                for p in patches.0..patches.1 {
                    state.unshot_exitance[p as usize] = Rgb::BLACK;
                }
            }
        }
        state.n_emitters = last as u32;
        self.measure_unshot(state);
        Ok(true)
    }

    pub(super) fn measure_unshot(&self, state: &mut State) {
        let this = &*state;
        let unshot_w = (0..self.mesh.patches.len())
            .into_par_iter()
            .with_min_len(512)
            .map(|p| {
                let reflected = this.unshot_reflected[p] + self.newly_reflected(this, p);
                (this.unshot_exitance[p] + reflected) * self.mesh.patches[p].area_m2
            })
            .collect();
        state.unshot_w = unshot_w;
    }

    /// What a patch has to shoot of what its elements received (W/m^2).
    fn newly_reflected(&self, state: &State, patch: usize) -> Rgb {
        self.optics[patch].reflectance * state.unshot_irradiance(self.mesh, patch)
    }

    /// Compares the rows that are kept, before they are given up; those that are not at hand are cast again.
    fn measure_reciprocity(
        &mut self,
        state: &mut State,
        caster: &mut dyn RayCaster,
    ) -> Result<(), SolveError> {
        let power_w = |patch: &u32| magnitude(state.shot_w[*patch as usize]);
        let mut patches: Vec<u32> = state.kept.patches.iter().copied().filter(|p| power_w(p) > 0.0).collect();
        patches.sort_by(|a, b| power_w(b).total_cmp(&power_w(a)).then(a.cmp(b)));
        patches.truncate(diagnostics::MAX_ROWS);
        let missing = patches.iter().map(|p| PatchId(*p)).filter(|p| self.rows.get(*p).is_none());
        let missing: Vec<PatchId> = missing.collect();
        if !missing.is_empty() {
            self.need_receivers();
        }
        for batch in missing.chunks(ROWS_PER_QUERY) {
            let shooters: Vec<ShooterId> = batch.iter().copied().map(ShooterId::Patch).collect();
            let (rows, _) = self.cast_rows(&shooters, caster)?;
            for (patch, (row, _)) in batch.iter().zip(rows) {
                self.rows.restore(*patch, row);
            }
        }
        let rows = patches.iter().filter_map(|p| Some((PatchId(*p), self.rows.get(PatchId(*p))?)));
        state.reciprocity = Some(diagnostics::reciprocity(self.mesh, &rows.collect::<Vec<_>>()));
        Ok(())
    }

    /// The solution of a state, converged or not.
    pub(super) fn finish(
        mut self,
        mut state: State,
        caster: &mut dyn RayCaster,
    ) -> Result<Solution, SolveError> {
        if state.reciprocity.is_none() {
            self.measure_reciprocity(&mut state, caster)?;
        }
        let error = match state.stochastic.take() {
            Some(s) => {
                let error = s.finish(self.mesh, self.scene.surfaces.len(), &mut state);
                self.measure_unshot(&mut state);
                Some(error)
            }
            None => None,
        };
        let mut account = state.account;
        for (patch, known) in &state.known {
            // Parts of emitting surfaces are in the account already.
            let Some(power_w) = state.shot_w.get(*patch as usize).copied() else { continue };
            account.lost_w += power_w * known.stray.lost;
            account.back_w += power_w * known.stray.back;
        }
        for (element, e) in self.mesh.elements.iter().zip(&state.elements) {
            let optics = &self.optics[element.patch.0 as usize];
            let incident_w = e.irradiance.total() * element.area_m2;
            account.specular_w += optics.passed * incident_w;
            account.absorbed_w += (Rgb::WHITE - optics.reflectance - optics.passed) * incident_w;
        }
        account.unshot_w = state.unshot_w.iter().copied().sum();
        account.residual_w = account.emitted_w
            - account.absorbed_w
            - account.unshot_w
            - account.lost_w
            - account.specular_w
            - account.back_w;
        let unshot = (0..self.mesh.patches.len()).map(|p| UnshotRadiosity {
            emitted: state.unshot_exitance[p],
            reflected: state.unshot_reflected[p] + self.newly_reflected(&state, p),
        });
        Ok(Solution {
            unshot: unshot.collect(),
            element_irradiance: state.elements.iter().map(|e| e.irradiance).collect(),
            row_sum_error: state.row_sum_error(),
            vertex_irradiance: state.vertices,
            account,
            n_shots: state.n_shots,
            n_shooters: state.shot_w.iter().filter(|w| !w.is_black()).count() + state.n_emitters as usize,
            n_rays: state.n_rays,
            reciprocity: state.reciprocity.unwrap_or_default(),
            error_estimate: relight::combined(state.earlier_error, error),
            shooters: state.known.iter().map(|(patch, known)| known.record(*patch)).collect(),
            earlier: state.earlier,
            exact: false,
        })
    }
}

/// True for scenes that will end stochastically, if they do not end before.
pub(super) fn is_large(mesh: &Mesh, options: &SolveOptions) -> bool {
    mesh.patches.len() > options.max_shooters
}

/// The patch with most unshot power, the first of equals; `None` when nothing is left.
fn strongest(state: &State) -> Option<PatchId> {
    let mut best = (0.0, None);
    for (p, w) in state.unshot_w.iter().enumerate() {
        if magnitude(*w) > best.0 {
            best = (magnitude(*w), Some(PatchId(p as u32)));
        }
    }
    best.1
}
