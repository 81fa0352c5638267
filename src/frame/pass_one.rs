//! How pass 1 comes about: solved, solved with a plan, or read from a file.
//!
//! ```text
//! PassOne::Solve --------------------> radiosity::solve
//!          Planned: checkpoint, start -> radiosity::solve_on | solve_exactly
//!          Load ---------------------> solution_file::load
//! ```

use std::path::PathBuf;

use super::{FrameError, Progress};
use crate::mesh::Mesh;
use crate::radiosity::checkpoint::Keeper;
use crate::radiosity::{self, Solution, SolveOptions, Start, solution_file};
use crate::raycast::RayCaster;
use crate::report::Timings;
use crate::scene::Scene;

/// How pass 1 comes about.
#[derive(Clone, Debug, PartialEq)]
pub enum PassOne {
    /// It is computed.
    Solve(SolveOptions),
    /// It is computed, with something special about it.
    Planned(Box<SolvePlan>),
    /// It is read from a file that `solve` wrote, for the same scene and mesh.
    Load(PathBuf),
}

/// A solve with something special about it.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvePlan {
    /// How it is run.
    pub options: SolveOptions,
    /// By a dense linear solve instead of progressive refinement.
    pub exact: bool,
    /// A solution file of the same geometry in another light that it goes on from. Sampling is then as it was for that
    /// file, whatever `options` say.
    pub continue_from: Option<PathBuf>,
    /// Where its state is kept.
    pub checkpoint: Option<Keeper>,
    /// What the answers to rays depend on, in words, for the checkpoint.
    pub caster: String,
}

impl SolvePlan {
    /// Nothing special.
    pub fn new(options: SolveOptions) -> SolvePlan {
        SolvePlan { options, exact: false, continue_from: None, checkpoint: None, caster: String::new() }
    }
}

pub(super) fn pass_1(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    how: &PassOne,
    timings: &mut Timings,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Solution, SolveOptions), FrameError> {
    timings.measure("pass 1", || match how {
        PassOne::Load(file) => Ok(solution_file::load(file, scene, mesh)?),
        PassOne::Solve(options) => {
            let progress = &mut |p| progress(Progress::Solve(p));
            let solution = radiosity::solve(scene, mesh, caster, options, progress)?;
            Ok((solution, *options))
        }
        PassOne::Planned(plan) => planned(scene, mesh, caster, plan, progress),
    })
}

fn planned(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    plan: &SolvePlan,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Solution, SolveOptions), FrameError> {
    let progress = &mut |p| progress(Progress::Solve(p));
    let mut options = plan.options;
    if plan.exact {
        return Ok((radiosity::solve_exactly(scene, mesh, caster, &options, progress)?, options));
    }
    let stored = match &plan.continue_from {
        None => None,
        Some(file) => Some(solution_file::load_of_geometry(file, scene, mesh)?),
    };
    let start = match &stored {
        None => Start::Anew,
        Some(stored) => {
            options = SolveOptions {
                unshot_share: options.unshot_share,
                max_shots: options.max_shots,
                max_row_bytes: options.max_row_bytes,
                ..stored.options
            };
            Start::From(stored)
        }
    };
    let mut checkpoint = match &plan.checkpoint {
        None => None,
        Some(keeper) => Some(keeper.open(plan.caster.clone()).map_err(radiosity::SolveError::from)?),
    };
    let solution = radiosity::solve_on(scene, mesh, caster, &options, start, checkpoint.as_mut(), progress)?;
    if let (Some(keeper), Some(checkpoint)) = (&plan.checkpoint, checkpoint) {
        keeper.put_back(checkpoint);
    }
    Ok((solution, options))
}
