//! Why a product could not be made.

use std::path::PathBuf;

use glam::DVec3;

use crate::radiosity::SolveError;
use crate::radiosity::solution_file::SolutionFileError;
use crate::raycast::CastError;
use crate::recorded::RecordFileError;
use crate::report::si::vector;
use crate::scene::SceneError;

/// Why a product could not be made.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The scene file has a fault.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// The scene file has no camera, and the product needs one.
    #[error("{path}: the scene has no [camera], which this needs", path = path.display())]
    NoCamera {
        /// The scene file.
        path: PathBuf,
    },
    /// A stored solution cannot be used.
    #[error(transparent)]
    Solution(#[from] SolutionFileError),
    /// Pass 1 failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A caster failed.
    #[error(transparent)]
    Cast(#[from] CastError),
    /// A record that cannot be read, or is one of other work.
    #[error(transparent)]
    Record(#[from] RecordFileError),
    /// A stored value was asked for where no surface is.
    #[error(
        "no surface within {reach_m} m of the point {} along its normal: stored values exist on surfaces only",
        vector(*at)
    )]
    OffSurface {
        /// The point (m).
        at: DVec3,
        /// How far it was looked for (m).
        reach_m: f64,
    },
    /// A stored value was asked for on the back of a one-sided surface.
    #[error(
        "the point {} with normal {} lies on the back of surface '{surface}', which stores nothing: \
         is the normal turned round?",
        vector(*at),
        vector(*normal)
    )]
    BlackBack {
        /// The point (m).
        at: DVec3,
        /// Its unit normal.
        normal: DVec3,
        /// The surface.
        surface: String,
    },
    /// A grid that cannot be measured on.
    #[error(transparent)]
    Grid(Box<super::GridFault>),
    /// Everything was warm-up.
    #[error(
        "--warm-up {asked}: the whole workload takes {cycles} cycles in {commands} commands, and counting begins after \
         the command in which the warm-up ends: nothing is left to count"
    )]
    AllWarmUp {
        /// Cycles that were asked for.
        asked: u64,
        /// Cycles of the whole workload.
        cycles: u64,
        /// Its commands.
        commands: u64,
    },
    /// The mesh would be absurdly large.
    #[error(
        "{path}: the mesh would have {n} elements, at most {limit} are possible: ask for fewer or larger elements, \
         or describe curved surfaces and slivers more coarsely",
        path = path.display()
    )]
    TooManyElements {
        /// The scene file.
        path: PathBuf,
        /// Planned elements.
        n: u64,
        /// The most that are possible.
        limit: u64,
    },
}

impl From<SceneError> for FrameError {
    fn from(error: SceneError) -> FrameError {
        FrameError::Scene(Box::new(error))
    }
}
