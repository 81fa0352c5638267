//! Faults of a scene file, each with its place.

use std::path::PathBuf;

/// A fault of a scene file.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {message}", path = path.display())]
pub struct SceneError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong: the value and what was expected.
    pub message: String,
}
