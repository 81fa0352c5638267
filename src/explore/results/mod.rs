//! What a sweep found, ready to be looked at.
//!
//! ```text
//! store --> Results --> pareto, sensitivity --> charts (SVG, PNG), page.html, terminal summary
//!              `------> Parquet, CSV
//! ```
//! Nothing here simulates; the same results give the same files, byte for byte.

use serde::Serialize;

use super::metric::Goal;
use super::space::Impossible;
use super::value::Value;

/// A sweep as found in its store.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results {
    /// Name of the space.
    pub name: String,
    /// The question that it asks.
    pub question: String,
    /// The space's file as typed, for commands.
    pub space_file: String,
    /// Technology of the costs.
    pub technology: String,
    /// Version of the program that simulated.
    pub version: String,
    /// Scene, rays and size of each workload, in words.
    pub workloads: Vec<String>,
    /// How candidates were chosen, in words with the seed.
    pub search: String,
    /// What changed.
    pub axes: Vec<AxisColumn>,
    /// Every metric that is known of some row, in the order of `metric::METRICS`.
    pub metrics: Vec<MetricColumn>,
    /// Names of the counters, in one order for all rows.
    pub counters: Vec<String>,
    /// Candidates in the order of their ordinals.
    pub rows: Vec<Row>,
    /// Combinations that were asked for and cannot be built.
    pub impossible: Vec<Impossible>,
    /// Combinations of the axes.
    pub n_combinations: u64,
}

/// An axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisColumn {
    /// Parameter or variable.
    pub name: String,
    /// Its values, in the file's order.
    pub values: Vec<Value>,
}

/// A metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricColumn {
    /// Its name.
    pub name: String,
    /// Its unit; empty: a pure number.
    pub unit: String,
    /// In a few words.
    pub what: String,
    /// Which direction is better.
    pub goal: Goal,
    /// It is an objective of the space: the front is reckoned in these.
    pub is_objective: bool,
}

/// What became of a candidate.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// All workloads ran whole.
    Simulated,
    /// Its cycles are estimated from a sample; `Row::half_width_cycles` is set.
    Sampled,
    /// It ran on a shortened workload and was not kept.
    Shortened,
    /// Its bounds are dominated: it was not run.
    Pruned,
    /// It ran into an error.
    Failed(String),
}

/// A candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its place in the full grid.
    pub ordinal: u64,
    /// What became of it.
    pub status: Status,
    /// Value of each axis.
    pub values: Vec<Value>,
    /// Of each metric; `None` where it is not known.
    pub metrics: Vec<Option<f64>>,
    /// Half the 95 % interval of `cycles`, where they are estimated.
    pub half_width_cycles: Option<f64>,
    /// Of each counter; empty where it was not run.
    pub counters: Vec<u64>,
    /// Cycles by cause (the order of `rtl_model::sim::Cause::ALL`) of each kind of block.
    pub stalls: Vec<KindStalls>,
    /// What limits it, as `report::bounds` says: resource, and its share of the cycles.
    pub limit: Option<(String, f64)>,
    /// The block with the longest path.
    pub critical_block: String,
    /// Area by kind of block (mm2; FPGA: LUTs).
    pub area: Vec<(String, f64)>,
    /// The whole board file.
    pub board: String,
    /// The command that runs it again.
    pub command: String,
}

/// Cycles of all blocks of a kind by cause.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct KindStalls {
    /// The kind.
    pub kind: String,
    /// By cause.
    pub cycles: [u64; 10],
}
