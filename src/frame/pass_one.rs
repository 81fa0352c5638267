//! How pass 1 comes about: solved, solved with a plan, or read from a file.
//!
//! ```text
//! PassOne::Solve --------------------> radiosity::solve
//!          Planned: checkpoint, start -> radiosity::solve_on | solve_exactly
//!          Load ---------------------> solution_file::load
//! adaptive meshing: refine::refine before a solve; a solution's file brings its subdivision along, with its discontinuities
//! ```

use std::path::PathBuf;

use super::{FrameError, Progress};
use crate::mesh::Mesh;
use crate::radiosity::checkpoint::{Checkpoint, Keeper};
use crate::radiosity::refine::{self, RefineOptions, RefineReport};
use crate::radiosity::row_cache::RowCache;
use crate::radiosity::{self, Aids, Solution, SolveError, SolveOptions, Start, solution_file};
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
    /// Where rows of form factors are kept for other solves of the same mesh.
    pub rows: Option<PathBuf>,
    /// What the answers to rays depend on, in words, for checkpoint and rows.
    pub caster: String,
}

impl SolvePlan {
    /// Nothing special.
    pub fn new(options: SolveOptions) -> SolvePlan {
        SolvePlan {
            options,
            exact: false,
            continue_from: None,
            checkpoint: None,
            rows: None,
            caster: String::new(),
        }
    }
}

/// Pass 1 with the mesh that it came about on.
pub(super) struct Passed {
    pub(super) mesh: Mesh,
    pub(super) solution: Solution,
    pub(super) options: SolveOptions,
    /// What was refined, where `mesh` was for this run.
    pub(super) refinement: Option<RefineReport>,
}

/// Pass 1 on the patches of `mesh`: refined first where the scene wants it, or cut as the solution's file or the checkpoint
/// says.
pub(super) fn pass_1_refined(
    scene: &Scene,
    mut mesh: Mesh,
    caster: &mut dyn RayCaster,
    how: &PassOne,
    timings: &mut Timings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Passed, FrameError> {
    let mut refinement = None;
    let (file, options, keeper) = match how {
        PassOne::Load(file) => (Some(file), None, None),
        PassOne::Solve(options) => (None, Some(options), None),
        PassOne::Planned(plan) => {
            let keeper = plan.checkpoint.as_ref().map(|keeper| (keeper, plan.caster.clone()));
            (plan.continue_from.as_ref(), Some(&plan.options), keeper)
        }
    };
    let mut checkpoint = match keeper {
        None => None,
        Some((keeper, caster)) => Some(keeper.open(caster).map_err(SolveError::from)?),
    };
    let found = match (file, &checkpoint) {
        (Some(file), _) => timings.measure("mesh", || solution_file::remeshed(file, scene, &mesh))?,
        (None, Some(checkpoint)) if scene.meshing.adaptive => {
            checkpoint.remeshed(scene, &mesh).map_err(SolveError::from)?
        }
        (None, _) => None,
    };
    if let Some(remeshed) = found {
        mesh = remeshed;
    } else if let (None, Some(options), true) = (file, options, scene.meshing.adaptive) {
        let progress = &mut |p| progress(Progress::Solve(p));
        let refined = timings.measure("refinement", || {
            refine::refine(scene, &mesh, caster, options, &RefineOptions::default(), progress)
        })?;
        (mesh, refinement) = (refined.0, Some(refined.1));
    }
    let (solution, options) = match how {
        PassOne::Planned(plan) => timings.measure("pass 1", || {
            let done = planned(scene, &mesh, caster, plan, checkpoint.as_mut(), progress)?;
            if let (Some(keeper), Some(checkpoint)) = (&plan.checkpoint, checkpoint.take()) {
                keeper.put_back(checkpoint);
            }
            Ok::<_, FrameError>(done)
        })?,
        PassOne::Load(_) | PassOne::Solve(_) => pass_1(scene, &mesh, caster, how, timings, progress)?,
    };
    Ok(Passed { mesh, solution, options, refinement })
}

/// Pass 1 on a mesh as it is; nothing is kept.
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
        PassOne::Planned(plan) => planned(scene, mesh, caster, plan, None, progress),
    })
}

fn planned(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    plan: &SolvePlan,
    checkpoint: Option<&mut Checkpoint>,
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
            // Sampling is as it was.
            options = SolveOptions {
                unshot_share: options.unshot_share,
                max_shots: options.max_shots,
                max_row_bytes: options.max_row_bytes,
                ..stored.options
            };
            Start::From(stored)
        }
    };
    let offset_m = caster.surface_offset_m();
    let open = |path: &PathBuf| RowCache::open(path, scene, mesh, &options, plan.caster.clone(), offset_m);
    let mut rows = plan.rows.as_ref().map(open).transpose().map_err(SolveError::from)?;
    let aids = Aids { checkpoint, rows: rows.as_mut() };
    let solution = radiosity::solve_on(scene, mesh, caster, &options, start, aids, progress)?;
    if let Some(rows) = rows {
        rows.write().map_err(SolveError::from)?;
    }
    Ok((solution, options))
}
