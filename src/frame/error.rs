//! Why a product could not be made.

use std::path::PathBuf;

use glam::DVec3;

use crate::radiosity::SolveError;
use crate::radiosity::solution_file::SolutionFileError;
use crate::raycast::CastError;
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
    /// A stored value was asked for where no surface is.
    #[error(
        "no surface within {reach_m} m of the point {}, {}, {} along its normal: stored values exist on surfaces only",
        at.x, at.y, at.z
    )]
    OffSurface {
        /// The point (m).
        at: DVec3,
        /// How far it was looked for (m).
        reach_m: f64,
    },
}

impl From<SceneError> for FrameError {
    fn from(error: SceneError) -> FrameError {
        FrameError::Scene(Box::new(error))
    }
}
