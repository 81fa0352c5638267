//! What is asked of the board, one experiment a question: `radeng experiment NAME`.
//!
//! ```text
//! EXPERIMENTS[name] --run(Extent)--> Findings: tables, panels, sentences, checks --terminal text | SVG, CSV | board.md
//!                        load.rs: rays recorded once, run on many boards
//! ```
//! Every sentence of "what it says" is made from the numbers of the same run. Results are the same bytes on any run,
//! but for the wall times of `amdahl`, which say so. Sources of the questions: in each experiment's file.

use rtl_model::board::BoardError;
use rtl_model::spec::{BoardSpec, SpecError};

use crate::plot::{self, Panel};
use crate::radiosity::SolveError;
use crate::raycast::CastError;
use crate::scene::SceneError;

pub mod adaptive;
mod amdahl;
mod balance;
mod descriptors;
mod document;
mod hierarchy;
pub mod load;
mod queueing;
pub mod reconstruction;
mod shells_2d;
mod subdivision;
pub mod table;
#[cfg(test)]
mod tests;
mod throughput;
pub mod two_pass;
mod validation;

pub use document::{document, host_document, terminal_text};
use table::Table;

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// What the documentation shows.
    Full,
    /// Small scenes and few points: seconds.
    Quick,
}

impl Extent {
    /// One value or the other.
    pub fn pick<T>(self, full: T, quick: T) -> T {
        match self {
            Extent::Full => full,
            Extent::Quick => quick,
        }
    }
}

/// An experiment.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// Its name on the command line and of its files.
    pub name: &'static str,
    /// What it is about.
    pub title: &'static str,
    run: fn(Extent) -> Result<Findings, ExperimentError>,
}

impl Experiment {
    /// Runs it.
    ///
    /// # Errors
    /// A board that gives up or answers otherwise than it should.
    pub fn run(&self, extent: Extent) -> Result<Findings, ExperimentError> {
        (self.run)(extent)
    }
}

/// All experiments, in the order of the document.
pub const EXPERIMENTS: [Experiment; 8] = [
    Experiment {
        name: "subdivision",
        title: "A published intersection chip as the ICU",
        run: subdivision::run,
    },
    Experiment { name: "queueing", title: "Queues against their formulas", run: queueing::run },
    Experiment { name: "amdahl", title: "What a faster ray caster can gain", run: amdahl::run },
    Experiment {
        name: "shells-2d",
        title: "1990: shells against the grid in two dimensions",
        run: shells_2d::run,
    },
    Experiment { name: "balance", title: "1991: the low-resolution partition", run: balance::run },
    Experiment {
        name: "hierarchy",
        title: "1992: hierarchical memory and pseudo-dynamic scheduling",
        run: hierarchy::run,
    },
    Experiment {
        name: "descriptors",
        title: "Bundle descriptors against explicit rays on the bus",
        run: descriptors::run,
    },
    Experiment { name: "throughput", title: "Throughput over the board's parameters", run: throughput::run },
];

/// Pass 1 against closed forms: no question to the board, and a document of its own.
pub const VALIDATION: Experiment =
    Experiment { name: "validation", title: "Pass 1 against closed forms", run: validation::run };

/// What an experiment found.
#[derive(Clone, Debug)]
pub struct Findings {
    /// What was asked.
    pub question: String,
    /// What was run.
    pub method: String,
    /// Its numbers.
    pub tables: Vec<Table>,
    /// Its plots.
    pub panels: Vec<Panel>,
    /// Its pictures, in rows of those that belong side by side.
    pub pictures: Vec<Vec<Picture>>,
    /// What the numbers say, a sentence or two each.
    pub says: Vec<String>,
    /// What must hold.
    pub checks: Vec<Check>,
}

/// A picture as a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Its name, beside the plot.
    pub file: String,
    /// What it shows.
    pub title: String,
    /// PNG.
    pub bytes: Vec<u8>,
}

/// Something that must hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// What.
    pub what: String,
    /// It held.
    pub holds: bool,
}

impl Check {
    /// A check.
    pub fn new(holds: bool, what: impl Into<String>) -> Check {
        Check { what: what.into(), holds }
    }
}

/// Why an experiment failed.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// A scene that cannot be made, or has no board numbers.
    #[error("the experiment's scene: {0}")]
    Scene(String),
    /// A fault in a scene's text.
    #[error(transparent)]
    Text(#[from] Box<SceneError>),
    /// A caster.
    #[error(transparent)]
    Cast(#[from] CastError),
    /// Pass 1.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// A specification.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// Two boards disagree about the same rays.
    #[error("board {point} of the experiment answers otherwise than its first")]
    Answers {
        /// Index of the board.
        point: usize,
    },
    /// A thread pool that could not be made.
    #[error("cannot start a thread: {0}")]
    Threads(String),
}

/// The default board with changes.
fn board(change: impl FnOnce(&mut BoardSpec)) -> BoardSpec {
    let mut spec = BoardSpec::preset("delft-1992").unwrap_or_default();
    change(&mut spec);
    spec
}
