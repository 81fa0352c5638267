//! Pass 1: irradiance everywhere by progressive refinement, form factors through the port.
//!
//! ```text
//! Mesh --shots: kernel (polygon formula) x visibility (port)--> E_mean per element, E_vertex per vertex, account
//! ```
//! B = M + rho E. E is kept apart as direct (straight from an emitter or light) and indirect (the rest).
//!
//! Memory: per element and per vertex about 100 and 50 bytes; form-factor rows of patches that shot, 4 bytes a
//! non-zero factor plus 0.2 bytes a receiver, up to [`SolveOptions::max_row_bytes`].

use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;
use crate::raycast::{CastError, RayCaster};
use crate::scene::Scene;
use crate::units::Rgb;

mod form_factors;
pub mod kernel;
mod light_shots;
pub mod lights;
mod near_field;
mod probe;
mod receivers;
mod row;
mod shooting;
pub mod solution_file;
pub mod summary;
#[cfg(test)]
mod tests;

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
    /// Memory for form-factor rows (bytes); patches whose rows do not fit cast them anew for every shot.
    pub max_row_bytes: u64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        SolveOptions {
            unshot_share: 2e-4,
            max_shots: 1_000_000,
            seed: 1,
            dense_visibility: false,
            max_row_bytes: 2 << 30,
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

/// Progress of a solve.
#[derive(Clone, Copy, Debug)]
pub struct SolveProgress {
    /// Shots so far.
    pub n_shots: usize,
    /// Unshot power over emitted power.
    pub unshot_share: f64,
}

/// Why pass 1 failed.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The caster failed.
    #[error(transparent)]
    Cast(#[from] CastError),
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
    shooting::run(scene, mesh, caster, options, progress)
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
    probe::run(scene, mesh, solution, caster, points)
}
