//! Pass 1: irradiance everywhere by progressive refinement, form factors through the port.
//!
//! ```text
//! Mesh --shots: kernel (polygon formula) x visibility (port)--> E_mean per element, E_vertex per vertex, account
//! ```
//! B = M + rho E. E is kept apart as direct (straight from an emitter or light) and indirect (the rest).
//!
//! Memory: see [`memory`]. Form-factor rows of patches that shot take 4 bytes a non-zero factor plus 0.2 bytes a receiver,
//! up to [`SolveOptions::max_row_bytes`].

pub use kernel::Kernel;
use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;
use crate::raycast::{CastError, RayCaster};
use crate::scene::Scene;
use crate::units::Rgb;

pub mod ambient;
mod casting;
pub mod checkpoint;
mod deposit;
mod diagnostics;
#[cfg(feature = "exact")]
mod exact;
mod emitters;
mod form_factors;
pub mod kernel;
mod light_shots;
pub mod lighting;
pub mod lights;
pub mod memory;
mod near_field;
mod probe;
mod receivers;
pub mod refine;
mod relight;
mod row;
pub mod row_cache;
mod rows;
mod shooter;
mod shooting;
pub mod solution_file;
mod state;
mod stochastic;
mod stray;
pub mod summary;
#[cfg(test)]
mod tests;

use checkpoint::{Checkpoint, CheckpointError};
pub use diagnostics::ReciprocityError;
pub(crate) use receivers::Receiver;
use row_cache::{RowCache, RowFileError};
use solution_file::Stored;

/// Irradiance kept in two parts (W/m^2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SplitIrradiance {
    /// Straight from emitters and lights.
    pub direct: Rgb,
    /// After at least one reflection.
    pub indirect: Rgb,
}

impl SplitIrradiance {
    /// All of it.
    pub fn total(&self) -> Rgb {
        self.direct + self.indirect
    }
}

/// Where the emitted power went (W per channel).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyAccount {
    /// Power of all emitters and lights.
    pub emitted_w: Rgb,
    /// Absorbed by diffuse surfaces.
    pub absorbed_w: Rgb,
    /// Not shot when the solver stopped.
    pub unshot_w: Rgb,
    /// Left through openings.
    pub lost_w: Rgb,
    /// Arrived on mirrors and glass and not followed (their specular and transmitted share).
    pub specular_w: Rgb,
    /// Arrived on backs of one-sided surfaces.
    pub back_w: Rgb,
    /// emitted - all of the above: the error of the method.
    pub residual_w: Rgb,
}

/// How pass 1 is run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolveOptions {
    /// Stop when unshot power is under this share of the emitted power.
    pub unshot_share: f64,
    /// Stop after this many shots.
    pub max_shots: usize,
    /// Seed of every sampling pattern.
    pub seed: u64,
    /// Cast a visibility ray from every quadrature point and vertex to every shooter; without, one ray an element does
    /// for shooters that do not emit: a quarter of the rays, for 0.2 % RMSE of the Cornell box picture.
    pub dense_visibility: bool,
    /// Form factor of a point to a patch, before visibility.
    #[serde(default)]
    pub kernel: Kernel,
    /// Memory for form-factor rows (bytes); patches whose rows do not fit cast them anew for every shot.
    pub max_row_bytes: u64,
    /// How power is shot.
    pub form_factors: FormFactorMethod,
    /// Patches that shoot by kernel at most; with more patches than this, the rest of the power is shot stochastically,
    /// from the moment on that it takes fewer rays.
    pub max_shooters: usize,
    /// Standard error that stochastic rays are counted for: RMS over the elements, relative to the mean irradiance, kernel
    /// shots' share of it included.
    pub wanted_error: f64,
}

/// How power is shot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FormFactorMethod {
    /// Kernel from each shooter to the points of each receiver, times the visible share: no noise.
    #[default]
    Vertex,
    /// Cosine-distributed bundles of rays from the shooters, emitters included: the board's native job; noise, with an
    /// estimate of it.
    Hemisphere,
}

impl Default for SolveOptions {
    fn default() -> Self {
        SolveOptions {
            unshot_share: 2e-4,
            max_shots: 1_000_000,
            seed: 1,
            dense_visibility: false,
            kernel: Kernel::Polygon,
            max_row_bytes: 1 << 30,
            form_factors: FormFactorMethod::Vertex,
            max_shooters: 2000,
            wanted_error: 0.02,
        }
    }
}

/// A pass-1 solution of one mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    /// E_mean per element, from its quadrature points: powers and shots are taken from these.
    pub element_irradiance: Vec<SplitIrradiance>,
    /// E_vertex per vertex: for reconstruction only.
    pub vertex_irradiance: Vec<SplitIrradiance>,
    /// Where the power went.
    pub account: EnergyAccount,
    /// Shots taken.
    pub n_shots: usize,
    /// Distinct patches that shot (their form factors were cast once and kept).
    pub n_shooters: usize,
    /// Visibility rays cast.
    pub n_rays: u64,
    /// Row-sum error of the form factors before any correction; see [`RowSumError`].
    pub row_sum_error: RowSumError,
    /// How far the form factors are from reciprocity; see [`ReciprocityError`].
    pub reciprocity: ReciprocityError,
    /// How good stochastic shooting is; `None` when all power was shot by kernel.
    pub error_estimate: Option<ErrorEstimate>,
    /// What every patch has still to shoot: a solve goes on from here.
    pub unshot: Vec<UnshotRadiosity>,
    /// Patches whose form factors were cast, by patch.
    pub shooters: Vec<ShooterRecord>,
    /// The solves that this one went on from.
    pub earlier: Option<EarlierWork>,
    /// By a dense linear solve.
    pub exact: bool,
}

impl Solution {
    /// No light anywhere, and nothing done for it.
    pub fn dark(mesh: &Mesh) -> Solution {
        Solution {
            element_irradiance: vec![SplitIrradiance::default(); mesh.elements.len()],
            vertex_irradiance: vec![SplitIrradiance::default(); mesh.vertices.len()],
            account: EnergyAccount::default(),
            n_shots: 0,
            n_shooters: 0,
            n_rays: 0,
            row_sum_error: RowSumError::default(),
            reciprocity: ReciprocityError::default(),
            error_estimate: None,
            unshot: vec![UnshotRadiosity::default(); mesh.patches.len()],
            shooters: Vec::new(),
            earlier: None,
            exact: false,
        }
    }
}

/// Radiosity that a patch has not shot yet (W/m^2). Negative where a change took light away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnshotRadiosity {
    /// Of what it emits.
    pub emitted: Rgb,
    /// Of what it reflects.
    pub reflected: Rgb,
}

/// What is known of a patch whose form factors were cast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShooterRecord {
    /// Its index; parts of emitting surfaces count on from the last patch.
    pub patch: u32,
    /// Its area (m^2).
    pub area_m2: f64,
    /// Share of its power that leaves through openings.
    pub lost: f64,
    /// Share that falls on backs of one-sided surfaces.
    pub back: f64,
    /// Sum of its row, these shares included; see [`RowSumError`].
    pub row_sum: f64,
}

/// Work of earlier solves that a solution went on from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EarlierWork {
    /// Solves.
    pub n_solves: u32,
    /// Their shots.
    pub n_shots: u64,
    /// Their rays.
    pub n_rays: u64,
}

/// Standard error of `E_mean`: of stochastic shooting from the spread of independent rounds, of the visibility that kernel
/// shots saw from second looks at a sample of it.
///
/// Not in it: what errors of kernel shots become when they are reflected, and what was left unshot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorEstimate {
    /// RMS over the elements, relative to the mean irradiance, both by area; sums of the channels.
    pub relative_rms: f64,
    /// The same over each surface alone, surfaces in scene order; 0 where nothing arrived.
    pub surfaces: Vec<f64>,
    /// Rounds that the rays were shot in.
    pub n_rounds: u32,
    /// Rays of these rounds.
    pub n_rays: u64,
}

/// How far the form factors' row sums are from one, before any correction.
///
/// Row j = a patch that shot, F_ji = A_i F_ij / A_j to every element i; in a closed scene rows sum to 1. In an
/// open scene the share that left through openings and onto backs, measured by hemisphere rays, is added first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RowSumError {
    /// Largest |1 - sum| over the rows.
    pub max: f64,
    /// Area-weighted mean of |1 - sum|.
    pub mean: f64,
}

/// What a solve is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SolvePhase {
    /// Patches shoot by kernel.
    Shots,
    /// The rest is shot by hemisphere bundles, in several rounds that each begin anew.
    Stochastic {
        /// How much of the planned rounds is done, 0 to 1.
        done: f64,
    },
}

/// Progress of a solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveProgress {
    /// What it is doing.
    pub phase: SolvePhase,
    /// Shots by kernel so far.
    pub n_shots: usize,
    /// Rays so far.
    pub n_rays: u64,
    /// Unshot power over emitted power; of the running round, when stochastic.
    pub unshot_share: f64,
    /// The solve just went on from a checkpoint.
    pub resumed: bool,
}

/// Why pass 1 failed.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The caster failed.
    #[error(transparent)]
    Cast(#[from] CastError),
    /// The scene is too large for an exact solve.
    #[error(
        "the exact solve takes at most {limit} patches, the mesh has {n_patches}: its matrices alone would take {:.1} GB; \
         use fewer elements, or progressive refinement, without --exact", *bytes as f64 * 1e-9
    )]
    TooManyForExact {
        /// Patches of the mesh.
        n_patches: usize,
        /// Patches at most.
        limit: usize,
        /// Memory that the matrices would take.
        bytes: u64,
    },
    /// This program was built without the exact solve.
    #[error("the exact solve is not in this program: it was built without the feature 'exact'")]
    NoExact,
    /// A checkpoint.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A file of form factors.
    #[error(transparent)]
    Rows(#[from] RowFileError),
}

/// Where a solve begins.
#[derive(Clone, Copy, Debug)]
pub enum Start<'a> {
    /// With nothing shot.
    Anew,
    /// With a solution of the same mesh in another light: only what changed is shot.
    From(&'a Stored),
}

/// Runs pass 1.
///
/// # Errors
/// [`SolveError`] when the caster fails.
pub fn solve(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<Solution, SolveError> {
    shooting::run(scene, mesh, caster, options, Start::Anew, Aids::default(), progress)
}

/// Files that a solve is helped by.
#[derive(Debug, Default)]
pub struct Aids<'a> {
    /// It goes on from where this says that it got to, and keeps its state there now and then.
    pub checkpoint: Option<&'a mut Checkpoint>,
    /// Rows of form factors that are here are not cast; those that are cast go here.
    pub rows: Option<&'a mut RowCache>,
}

/// Runs pass 1 from `start`.
///
/// # Errors
/// [`SolveError`] when the caster fails, the checkpoint is of another solve, or the solve was asked to stop.
pub fn solve_on(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    start: Start<'_>,
    aids: Aids<'_>,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<Solution, SolveError> {
    shooting::run(scene, mesh, caster, options, start, aids, progress)
}

/// Solves a small scene exactly, by a dense linear solve over its patches.
///
/// # Errors
/// [`SolveError`] when there are too many patches, or the caster fails.
pub fn solve_exactly(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<Solution, SolveError> {
    #[cfg(feature = "exact")]
    return exact::run(scene, mesh, caster, options, progress);
    #[cfg(not(feature = "exact"))]
    {
        let _ = (scene, mesh, caster, options, progress);
        Err(SolveError::NoExact)
    }
}

/// Irradiance at a free point, direct light integrated there and indirect gathered from `E_mean`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbePoint {
    /// Where (m).
    pub at: glam::DVec3,
    /// Unit normal of the receiver.
    pub normal: glam::DVec3,
}

/// Irradiance at points.
///
/// # Errors
/// When the caster fails.
pub fn probe(
    scene: &Scene,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
) -> Result<Vec<SplitIrradiance>, SolveError> {
    probe::run(scene, mesh, solution, caster, points, &mut |_| {})
}

/// As [`probe`], of many points: `progress` gets the share of them that is done.
///
/// # Errors
/// When the caster fails.
pub fn probe_many(
    scene: &Scene,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<SplitIrradiance>, SolveError> {
    probe::run(scene, mesh, solution, caster, points, progress)
}
