//! What ends a command with exit status 2.

use std::path::PathBuf;

use crate::frame::FrameError;
use crate::image::exr::ReadError;
use crate::image::{DifferenceError, OutputError};
use crate::radiosity::solution_file::SolutionFileError;

/// A bad input, named.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The scene, a solution or a caster.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// An output file.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A picture to read.
    #[error(transparent)]
    Picture(#[from] ReadError),
    /// Pictures that cannot be compared.
    #[error(transparent)]
    Difference(#[from] DifferenceError),
    /// Writing a solution.
    #[error(transparent)]
    Solution(#[from] SolutionFileError),
    /// Flags that do not go together, or a value that its flag cannot take.
    #[error("{0}")]
    Usage(String),
    /// A board that is no preset and no readable board file.
    #[error("board '{name}': {what}")]
    Board {
        /// As typed.
        name: String,
        /// What is wrong.
        what: String,
    },
    /// A rays file.
    #[error("{path}:{line}: {what}", path = path.display())]
    Rays {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The value and what was expected.
        what: String,
    },
    /// An input file that cannot be read.
    #[error("{path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The threads could not be started.
    #[error("cannot start {n} threads: {what}")]
    Threads {
        /// How many.
        n: usize,
        /// What the system said.
        what: String,
    },
}

impl CliError {
    /// The error as the terminal shows it: faults of a scene file with the line that they are in.
    pub fn into_report(self) -> miette::Report {
        match self {
            CliError::Frame(FrameError::Scene(error)) => miette::Report::new(*error),
            other => miette::Report::msg(other),
        }
    }
}
