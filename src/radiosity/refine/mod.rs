//! Adaptive meshing: elements are split where that makes the stored irradiance better, until it is good enough.
//!
//! ```text
//! rounds, a level each:  mesh + trial splits --loose solve--> E at new vertices --gain.rs, visibility.rs, lines.rs-->
//!                        what each split changes --select.rs: largest gain per element first--> mesh, trial splits ...
//! then:                  splits that are worth it --2:1 balance--> mesh --solve--> Solution
//! ```
//! A split is tried before it is made: a loose solve (few shots) with the element split measures what bilinear
//! interpolation was wrong by. What a split is worth is the fall of the integral of the squared error, luminance over the
//! mean of its surface, for three elements more. So cells grow smaller toward room edges, where E = a + c d^0.68, along
//! shadow borders, and under whatever else bends E. Patches, and with them casters, stay as they are: only receivers
//! are refined.
//!
//! The first mesh has one element a patch, so where light is even the refined mesh is coarser than the uniform one of the
//! same patches, 2 x 2 elements each. Depth counts from the uniform mesh's elements. Limits bound both depth and number,
//! and [`RefineReport`] says what they cut off. Where the limit of depth leaves more than the wanted error, as along shadow
//! borders, refinement elsewhere stops near the least error that there is. Not modelled: lines inserted as element edges,
//! sources finer than a patch.
//!
//! Source: Cohen, Greenberg, Immel, Brock 1986 (adaptive subdivision); Lischinski, Tampieri, Greenberg 1992
//! (discontinuity lines); Breiman, Friedman, Olshen, Stone 1984 (pruning by gain per leaf).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::mesh::{Mesh, Place};
use crate::radiosity::{Solution, SolveError, SolveOptions, SolveProgress, solve};
use crate::raycast::RayCaster;
use crate::scene::{MAX_ELEMENTS, Scene};

mod gain;
mod lines;
mod penumbra;
mod select;
mod silhouette;
mod visibility;
#[cfg(test)]
mod tests;

pub use lines::{LineReport, flag_shadow_lines};
use select::Splits;

/// How a mesh is refined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RefineOptions {
    /// Most elements, over the number of the uniform mesh.
    pub max_growth: f64,
    /// Most splits of an element of the uniform mesh, one inside the other.
    pub max_depth: u32,
    /// Stop where the estimated error of interpolation is under this: relative L2 over all surfaces, luminance over the
    /// surface's mean.
    pub wanted_error: f64,
    /// Unshot share at which a trial solve stops.
    pub trial_unshot_share: f64,
}

impl Default for RefineOptions {
    fn default() -> Self {
        RefineOptions { max_growth: 4.0, max_depth: 3, wanted_error: 0.01, trial_unshot_share: 0.03 }
    }
}

/// What refinement did and what its limits cut off.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RefineReport {
    /// Elements of the uniform mesh of the same patches.
    pub n_uniform: u64,
    /// Elements of the final mesh.
    pub n_elements: u64,
    /// Of these, elements that only the balance of 2:1 asked for.
    pub n_for_balance: u64,
    /// Most elements that the limit allows.
    pub n_limit: u64,
    /// Most splits inside each other.
    pub max_depth: u32,
    /// The error that was wanted.
    pub wanted_error: f64,
    /// Estimated error of interpolation of the final mesh; that of the shots is not in it.
    pub estimated_error: f64,
    /// Splits that the wanted error asks for and the limit on the number of elements cut off.
    pub n_cut_by_count: u64,
    /// Elements at the limit of depth that a further split would have been worth.
    pub n_cut_by_depth: u64,
    /// Elements of the trial meshes, a round each.
    pub trials: Vec<u64>,
    /// Rays cast for it, trial solves and visibility; the final solve's are in its [`Solution`].
    pub n_rays: u64,
    /// Shadow lines of lights without area.
    pub lines: LineReport,
}

/// Refines a mesh of `scene` for its light and solves it: the mesh, its solution, what was done.
///
/// # Errors
/// [`SolveError`] when the caster fails.
pub fn solve_adaptive(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    refine_options: &RefineOptions,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<(Mesh, Solution, RefineReport), SolveError> {
    let (refined, report) = refine(scene, mesh, caster, options, refine_options, progress)?;
    let solution = solve(scene, &refined, caster, options, progress)?;
    Ok((refined, solution, report))
}

/// Refines a mesh of `scene` for its light.
///
/// `mesh` is the uniform mesh; the caster is of its patches, which are those of the refined mesh, too. `options` are
/// those of the solve that follows. Same bits for any number of threads.
///
/// # Errors
/// [`SolveError`] when the caster fails.
pub fn refine(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &SolveOptions,
    refine: &RefineOptions,
    progress: &mut dyn FnMut(SolveProgress),
) -> Result<(Mesh, RefineReport), SolveError> {
    let limit = (mesh.elements.len() as f64 * refine.max_growth.max(1.0)) as u64;
    let limit = limit.min(2 * u64::from(MAX_ELEMENTS)).max(mesh.elements.len() as u64);
    let trial_options =
        SolveOptions { unshot_share: options.unshot_share.max(refine.trial_unshot_share), ..*options };
    let mut report = RefineReport {
        n_uniform: mesh.elements.len() as u64,
        n_limit: limit,
        max_depth: refine.max_depth,
        wanted_error: refine.wanted_error,
        ..RefineReport::default()
    };
    let lines = lines::find(scene, mesh, caster)?;
    report.n_rays += lines.n_rays;
    let total_area_m2 = mesh.total_area_m2();
    let wanted = refine.wanted_error * refine.wanted_error * total_area_m2;
    let mut splits = Splits::new(mesh, refine.max_depth);
    for _ in 0..splits.max_depth() {
        let candidates = splits.candidates(limit, wanted);
        if candidates.is_empty() {
            break;
        }
        let trial = splits.mesh(scene, &candidates);
        report.trials.push(trial.elements.len() as u64);
        let loose = solve(scene, &trial, caster, &trial_options, progress)?;
        report.n_rays += loose.n_rays;
        let surfaces = gain::mean_luminance(scene, &trial, &loose);
        let field = gain::Field::new(&trial, &loose, &surfaces);
        let seen = visibility::changes(scene, &trial, &surfaces, &candidates, caster)?;
        report.n_rays += seen.n_rays;
        for (&(patch, place), seen) in candidates.iter().zip(&seen.gains) {
            let on_line = lines.gain(&trial, &surfaces, (patch, place));
            splits.measured(patch, place, field.gain(patch, place).max(*seen).max(on_line));
        }
    }
    let chosen = splits.choose(limit, wanted);
    let mut final_mesh = splits.mesh(scene, &chosen.nodes);
    // The balance costs elements that the choice does not know: choose fewer until the limit is met.
    let mut chosen = chosen;
    let mut budget = limit;
    for _ in 0..8 {
        let n = final_mesh.elements.len() as u64;
        if n <= limit || chosen.nodes.is_empty() {
            break;
        }
        budget = budget.saturating_sub(n - limit);
        chosen = splits.choose(budget, wanted);
        final_mesh = splits.mesh(scene, &chosen.nodes);
    }
    report.n_elements = final_mesh.elements.len() as u64;
    report.n_for_balance = report.n_elements - mesh.patches.len() as u64 - 3 * chosen.nodes.len() as u64;
    report.estimated_error = (chosen.squared_error / total_area_m2).sqrt();
    report.n_cut_by_count = chosen.n_cut_by_count;
    report.n_cut_by_depth = chosen.n_cut_by_depth;
    report.lines = lines.flag(scene, &mut final_mesh);
    Ok((final_mesh, report))
}

/// A node of a patch's quadtree.
type Node = (u32, Place);

/// Per node, something.
type ByNode<T> = BTreeMap<Node, T>;

impl Splits {
    /// The mesh with these splits and those above them.
    fn mesh(&self, scene: &Scene, nodes: &[Node]) -> Mesh {
        let subdivision = self.subdivision(nodes);
        // The patches are those of the scene: only a bug makes other ones.
        Mesh::build_with(scene, &subdivision).unwrap_or_else(|fault| panic!("a refined mesh {fault}"))
    }
}
