//! Everything that changes while power is shot: plain data, so that a solve can stop between any two steps and go on.
//!
//! ```text
//! Scene, Mesh --> State --Solver::step--> State --Solver::step--> ... --Solver::finish--> Solution
//! ```
//! What is not in here follows from scene, mesh and options: receivers, optics, and the rows of form factors, which are
//! cast again, the same rays, when they are not at hand. Rays count once for each time that a row comes about in an
//! uninterrupted solve: [`KeptRows`] tells which rows it would still hold.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::SplitIrradiance;
use super::stochastic::StochasticState;
use super::stray::StrayShares;
use super::{EarlierWork, EnergyAccount, ErrorEstimate, ReciprocityError, RowSumError, ShooterRecord};
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::units::Rgb;

/// An element while power is shot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ElementState {
    pub irradiance: SplitIrradiance,
    /// Irradiance whose reflection was not shot yet (W/m^2).
    pub unshot: Rgb,
}

/// What is known of a patch whose row was cast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Known {
    pub stray: StrayShares,
    pub area_m2: f64,
    pub row_sum: f64,
}

impl Known {
    pub(super) fn record(&self, patch: u32) -> ShooterRecord {
        let StrayShares { lost, back } = self.stray;
        ShooterRecord { patch, area_m2: self.area_m2, lost, back, row_sum: self.row_sum }
    }

    pub(super) fn of(record: &ShooterRecord) -> Known {
        Known {
            stray: StrayShares { lost: record.lost, back: record.back },
            area_m2: record.area_m2,
            row_sum: record.row_sum,
        }
    }
}

/// Which rows are kept in memory.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct KeptRows {
    /// Patches whose rows are kept.
    pub patches: BTreeSet<u32>,
    pub n_bytes: u64,
    /// A row did not fit.
    pub full: bool,
}

/// The state of a solve.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct State {
    /// Exitance of every patch that was not shot yet (W/m^2).
    pub unshot_exitance: Vec<Rgb>,
    /// Radiosity by reflection that a patch has to shoot beside what its elements have not shot yet (W/m^2): what is left
    /// over from a change of reflectance to zero.
    pub unshot_reflected: Vec<Rgb>,
    pub elements: Vec<ElementState>,
    pub vertices: Vec<SplitIrradiance>,
    /// Unshot power of every patch (W).
    pub unshot_w: Vec<Rgb>,
    /// Power that every patch has shot by kernel (W).
    pub shot_w: Vec<Rgb>,
    /// Emitted, and what lights without area and stochastic shots lost; the rest is filled in at the end.
    pub account: EnergyAccount,
    pub n_shots: usize,
    pub n_rays: u64,
    /// The record of every shooter, by patch; parts of emitting surfaces count on from the last patch.
    pub known: BTreeMap<u32, Known>,
    pub kept: KeptRows,
    /// Measured when the rows are given up.
    pub reciprocity: Option<ReciprocityError>,
    /// The solves that this one goes on from, and the error that they had.
    pub earlier: Option<EarlierWork>,
    pub earlier_error: Option<ErrorEstimate>,
    /// Parts of emitting surfaces that have shot.
    pub n_emitters: u32,
    /// Of every surface: sum over its elements of area x variance of the irradiance that kernel shots brought (all
    /// channels, (W/m^2)^2 m^2), as far as visibility was sampled.
    pub kernel_variance: Vec<f64>,
    /// Once kernel shots are over.
    pub stochastic: Option<StochasticState>,
}

impl State {
    pub(super) fn new(scene: &Scene, mesh: &Mesh) -> State {
        let exitance: Vec<Rgb> =
            mesh.patches.iter().map(|p| scene.surfaces[p.surface.0 as usize].exitance).collect();
        let emitted_w = mesh.patches.iter().zip(&exitance).map(|(p, m)| *m * p.area_m2).sum();
        State {
            unshot_exitance: exitance,
            unshot_reflected: vec![Rgb::BLACK; mesh.patches.len()],
            elements: vec![ElementState::default(); mesh.elements.len()],
            vertices: vec![SplitIrradiance::default(); mesh.vertices.len()],
            unshot_w: vec![Rgb::BLACK; mesh.patches.len()],
            shot_w: vec![Rgb::BLACK; mesh.patches.len()],
            account: EnergyAccount { emitted_w, ..EnergyAccount::default() },
            n_shots: 0,
            n_rays: 0,
            known: BTreeMap::new(),
            kept: KeptRows::default(),
            reciprocity: None,
            earlier: None,
            earlier_error: None,
            n_emitters: 0,
            kernel_variance: vec![0.0; scene.surfaces.len()],
            stochastic: None,
        }
    }

    /// True when the lists are as long as those of the mesh.
    pub(super) fn fits(&self, mesh: &Mesh) -> bool {
        let of_patches =
            [&self.unshot_exitance, &self.unshot_reflected, &self.unshot_w, &self.shot_w].map(Vec::len);
        of_patches == [mesh.patches.len(); 4]
            && self.elements.len() == mesh.elements.len()
            && self.vertices.len() == mesh.vertices.len()
            && self.kernel_variance.len() == mesh.surfaces.len()
            && self.kept.patches.iter().all(|p| (*p as usize) < mesh.patches.len())
    }

    /// Size of the lists (bytes) while patches shoot.
    pub(super) fn n_bytes(mesh: &Mesh) -> u64 {
        let of = |n: usize, bytes: usize| (n * bytes) as u64;
        of(mesh.patches.len(), 4 * size_of::<Rgb>())
            + of(mesh.elements.len(), size_of::<ElementState>())
            + of(mesh.vertices.len(), size_of::<SplitIrradiance>())
    }

    /// Unshot power of all patches and channels (W), whatever its sign.
    pub(super) fn unshot_power_w(&self) -> f64 {
        self.unshot_w.iter().map(|w| magnitude(*w)).sum()
    }

    /// Area mean of the unshot irradiance over a patch (W/m^2).
    pub(super) fn unshot_irradiance(&self, mesh: &Mesh, patch: usize) -> Rgb {
        let p = &mesh.patches[patch];
        let sum: Rgb = p
            .elements
            .clone()
            .map(|e| self.elements[e as usize].unshot * mesh.elements[e as usize].area_m2)
            .sum();
        if p.area_m2 > 0.0 { sum / p.area_m2 } else { Rgb::BLACK }
    }

    pub(super) fn row_sum_error(&self) -> RowSumError {
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

/// Sum of the channels' magnitudes: what shooters are ranked by. Power may be negative when a solution goes on after a
/// change that took light away.
pub(super) fn magnitude(w: Rgb) -> f64 {
    w.0[0].abs() + w.0[1].abs() + w.0[2].abs()
}
