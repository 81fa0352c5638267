//! What ends a command with exit status 2.

use std::path::PathBuf;

use crate::experiments::ExperimentError;
use crate::frame::FrameError;
use crate::image::exr::ReadError;
use crate::image::{DifferenceError, OutputError};
use crate::radiosity::SolveError;
use crate::radiosity::checkpoint::CheckpointError;
use crate::radiosity::solution_file::SolutionFileError;
use crate::scene::SceneError;
use crate::trace::TraceError;
use crate::vectors::{CheckError, VectorsError};

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
    /// A file of test vectors.
    #[error("{path}{source}", path = path.display())]
    Vectors {
        /// The file.
        path: PathBuf,
        /// Where and what.
        source: VectorsError,
    },
    /// Test vectors that a board cannot run.
    #[error("{path}: {source}", path = path.display())]
    Check {
        /// The file.
        path: PathBuf,
        /// Why.
        source: CheckError,
    },
    /// A design space.
    #[cfg(feature = "explore")]
    #[error(transparent)]
    Space(Box<crate::explore::space::SpaceError>),
    /// A sweep.
    #[cfg(feature = "explore")]
    #[error(transparent)]
    Explore(#[from] crate::explore::run::ExploreError),
    /// Results of a sweep that cannot be written.
    #[cfg(feature = "explore")]
    #[error(transparent)]
    Results(#[from] crate::explore::results::ResultsError),
    /// An experiment.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// A run that cannot be watched.
    #[error(transparent)]
    Watch(#[from] TraceError),
    /// An event log.
    #[error("{path}: {source}", path = path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TraceError,
    },
    /// A plot that cannot be drawn.
    #[error("the plot cannot be drawn: {0}")]
    Plot(String),
    /// An input file that cannot be read.
    #[error("{path}: {what}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        what: String,
    },
    /// The threads could not be started.
    #[error("cannot start {n} threads: {what}")]
    Threads {
        /// How many.
        n: u32,
        /// What the system said.
        what: String,
    },
}

impl CliError {
    /// Exit status: 130 where the user stopped a solve that is kept, else 2.
    pub fn status(&self) -> u8 {
        match self {
            CliError::Frame(FrameError::Solve(SolveError::Checkpoint(CheckpointError::Stopped {
                ..
            }))) => 130,
            _ => 2,
        }
    }

    /// The error as the terminal shows it: a fault in the text of a scene or space with the line that it is in, all
    /// others in one line.
    pub fn terminal_text(self) -> String {
        match self {
            CliError::Frame(FrameError::Scene(error)) if error.place.is_some() => with_its_line(*error),
            #[cfg(feature = "explore")]
            CliError::Space(error) if error.place.is_some() => with_its_line(*error),
            other => format!("error: {}", other.to_string().split_whitespace().collect::<Vec<_>>().join(" ")),
        }
    }
}

/// A fault with the line of the file.
fn with_its_line(error: SceneError) -> String {
    // Lines stay whole: names and paths must not break at their hyphens.
    let handler = miette::MietteHandlerOpts::new().wrap_lines(false);
    // A second hook is refused, and the first is this one.
    let _ = miette::set_hook(Box::new(move |_| Box::new(handler.clone().build())));
    format!("{:?}", miette::Report::new(error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_outside_a_scene_text_is_one_line_however_long() {
        let what = format!("{}\n  delft-1992", "long ".repeat(60));
        let text = CliError::Board { name: "x".to_owned(), what }.terminal_text();
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(text.starts_with("error: board 'x': long") && text.ends_with("delft-1992"), "{text}");
    }
}
