//! A design space: a base board, axes, expressions, constraints, workloads, objectives, a search.
//!
//! ```text
//! space.toml --raw--> tables --axes, assignments (expressions), goals--> Space --constraints: has it candidates?--> Space
//! ordinal --candidate--> choice -> values -> expressions -> BoardSpec, Cost, clock          (resolve: in which order)
//!             `--constraint or impossible board--> Impossible
//! ```
//! Format: version 1, scenes/spaces/README.md. Faults show the line, as those of scenes do.

use std::ops::Range;
use std::path::{Path, PathBuf};

use rtl_model::cost::{Cost, Technology};
use rtl_model::spec::BoardSpec;
use serde::Serialize;

use super::metric::{Goal, Metric};
use super::value::Value;

mod assignments;
mod axes;
mod constraints;
mod expressions;
mod faults;
mod goals;
mod listing;
mod load;
mod parameters;
mod raw;
mod resolve;

pub use listing::ImpossibleList;

/// A space that cannot be: file, line, column, what is wrong; a terminal shows the line.
pub use crate::scene::SceneError as SpaceError;

/// A design space as read and checked.
#[derive(Clone, Debug)]
pub struct Space {
    /// The file.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
    /// Its name: the file's, without extension.
    pub name: String,
    /// The question that it asks, for titles.
    pub question: String,
    /// What every candidate differs from.
    pub base: BoardSpec,
    /// What costs are reckoned in.
    pub technology: &'static Technology,
    /// Where a candidate's clock comes from.
    pub clock: Clock,
    /// What changes; not empty, no axis is.
    pub axes: Vec<Axis>,
    /// What candidates are driven with; not empty.
    pub workloads: Vec<SpaceWorkload>,
    /// What is better; not empty.
    pub objectives: Vec<Objective>,
    /// How candidates are chosen.
    pub search: Search,
    /// How a choice becomes a board.
    plan: resolve::Plan,
    /// Where the first axis stands.
    first_axis: Range<usize>,
}

/// Where a candidate's clock comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// `clock_mhz` of its board.
    Board,
    /// The fastest that its critical path allows.
    Derived,
}

/// What changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// A board parameter (`icu.depth`) or a variable of the space's expressions.
    pub name: String,
    /// Its values, in the file's order, all different.
    pub values: Vec<Value>,
}

/// What candidates are driven with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpaceWorkload {
    /// Its name in results.
    pub name: String,
    /// The scene file, found from where the process is.
    pub scene: PathBuf,
    /// Which rays.
    pub rays: WorkloadRays,
    /// Wanted elements, instead of the scene's.
    pub elements: Option<u32>,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Seed of the sampling patterns.
    pub seed: u64,
}

/// Which rays drive the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WorkloadRays {
    /// Camera rays.
    Primary,
    /// Pass 1.
    Radiosity,
    /// Shadow rays of pass 2.
    Shadow,
    /// Both passes.
    All,
}

/// What is better.
#[derive(Clone, Debug, PartialEq)]
pub struct Objective {
    /// Which metric.
    pub metric: &'static Metric,
    /// Which direction, maybe against the metric's own.
    pub goal: Goal,
}

/// How candidates are chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Search {
    /// Which way.
    pub strategy: Strategy,
    /// Seed of every choice.
    pub seed: u64,
    /// Most candidates that are evaluated.
    pub points: Option<u64>,
    /// Most minutes; the batch that is running then is finished.
    pub minutes: Option<f64>,
}

/// A way to choose candidates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// All of them.
    Grid,
    /// A uniform sample without repetition.
    Random,
    /// Points of an Owen-scrambled Sobol sequence.
    Sobol,
    /// All, or `points` random ones, on short workloads first; the best go on to longer ones.
    Halving {
        /// Steps, the last with the whole workload, 2..=8.
        rungs: u32,
        /// Share that goes on, over 0 and under 1.
        keep: f64,
    },
    /// NSGA-II: `points` evaluations in generations.
    Nsga2 {
        /// Candidates a generation, 4..=1000.
        population: u32,
    },
}

/// A candidate: a board that can be built.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Its place in the full grid of the axes, the last axis fastest.
    pub ordinal: u64,
    /// Which value of each axis.
    pub choice: Vec<usize>,
    /// The board, its clock resolved.
    pub spec: BoardSpec,
    /// What it costs.
    pub cost: Cost,
}

/// Why a combination is no candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Impossible {
    /// Its place in the full grid.
    pub ordinal: u64,
    /// The constraint that it breaks, or what the board says.
    pub reason: String,
}

impl Space {
    /// Reads and checks a space.
    ///
    /// # Errors
    /// The first thing that is wrong, with file and line.
    pub fn load(file: &Path) -> Result<Space, SpaceError> {
        load::load(file)
    }

    /// A space from its text; `file` is for messages, and where scenes are looked for from.
    ///
    /// # Errors
    /// The first thing that is wrong, with file and line.
    pub fn parse(text: &str, file: &Path) -> Result<Space, SpaceError> {
        load::parse(text, file)
    }

    /// Combinations of the axes' values, impossible ones included.
    pub fn n_combinations(&self) -> u64 {
        self.axes.iter().map(|a| a.values.len() as u64).product()
    }

    /// Which value of each axis combination `ordinal` has.
    pub fn choice(&self, ordinal: u64) -> Vec<usize> {
        let mut rest = ordinal;
        let mut choice = vec![0; self.axes.len()];
        for (place, axis) in choice.iter_mut().zip(&self.axes).rev() {
            let n = axis.values.len() as u64;
            (*place, rest) = ((rest % n) as usize, rest / n);
        }
        choice
    }

    /// The ordinal of a choice.
    pub fn ordinal(&self, choice: &[usize]) -> u64 {
        choice
            .iter()
            .zip(&self.axes)
            .fold(0, |sum, (place, axis)| sum * axis.values.len() as u64 + *place as u64)
    }

    /// Combination `ordinal` as a board.
    ///
    /// # Errors
    /// Why it cannot be built.
    pub fn candidate(&self, ordinal: u64) -> Result<Candidate, Impossible> {
        let choice = self.choice(ordinal);
        match self.plan.build(&self.axes, &choice, |_, holds| holds) {
            Ok((spec, cost)) => Ok(Candidate { ordinal, choice, spec, cost }),
            Err(refusal) => Err(Impossible { ordinal, reason: refusal.reason() }),
        }
    }

    /// The values of a choice, axis by axis.
    pub fn values(&self, choice: &[usize]) -> Vec<Value> {
        self.axes.iter().zip(choice).map(|(axis, place)| axis.values[*place].clone()).collect()
    }

    /// The values of a combination, with their axes' names.
    pub fn in_words(&self, ordinal: u64) -> String {
        let values = self.values(&self.choice(ordinal));
        let words: Vec<String> =
            self.axes.iter().zip(values).map(|(axis, value)| format!("{} = {value}", axis.name)).collect();
        words.join(", ")
    }
}
