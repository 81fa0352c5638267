//! What a sweep found, ready to be looked at.
//!
//! ```text
//! store --> Results --> pareto, sensitivity --> charts (SVG, PNG), page.html, terminal summary
//!              `------> Parquet, CSV
//! ```
//! Nothing here simulates; the same results give the same files, byte for byte.

use std::path::Path;

use serde::Serialize;

use self::curve::curves;
use self::pareto::Front;
use self::sensitivity::sensitivity;
use super::metric::Goal;
use super::space::Impossible;
use super::value::Value;
use crate::image::{OutputError, OutputFiles};
use crate::plot::{png, svg_of};

mod charts;
mod columns;
mod csv;
mod curve;
mod page;
pub mod pareto;
mod parquet_file;
pub mod sensitivity;
#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;
mod text;
mod words;

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
    /// The whole board file that all candidates differ from.
    pub base: String,
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
    /// Area by kind of block (mm2; FPGA: NAND2 equivalents).
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

/// Results that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// A folder that cannot be made.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A chart that cannot be drawn.
    #[error("the chart {name} cannot be drawn: {what}")]
    Chart {
        /// Its name.
        name: String,
        /// What the plotting library says.
        what: String,
    },
    /// Rows that cannot be encoded.
    #[error("the rows cannot be written as Parquet: {0}")]
    Parquet(#[from] ::parquet::errors::ParquetError),
}

/// Stages `results.parquet`, `results.csv`, `results-columns.csv`, `impossible.csv` (where there are such), `page.html`
/// and `charts/` in a folder, which is made; gives the terminal's summary.
///
/// # Errors
/// A folder that cannot be made, a chart or rows that cannot be encoded: then nothing is staged.
pub fn write(results: &Results, folder: &Path, files: &mut OutputFiles) -> Result<String, ResultsError> {
    let charts_folder = folder.join("charts");
    std::fs::create_dir_all(&charts_folder).map_err(|e| OutputError::Target {
        path: charts_folder.clone(),
        what: format!("cannot make this folder: {e}"),
    })?;
    let front = Front::of(results);
    let curves = curves(results, &front);
    let effects = sensitivity(results);
    let columns = columns::columns(results, &front);
    let mut staged = vec![
        ("results.parquet".to_owned(), parquet_file::bytes(results, &columns)?),
        ("results.csv".to_owned(), csv::rows(&columns, results.rows.len()).into_bytes()),
        ("results-columns.csv".to_owned(), csv::meanings(&columns).into_bytes()),
        ("page.html".to_owned(), page::page(results, &front, &curves, &effects).into_bytes()),
    ];
    if !results.impossible.is_empty() {
        staged.push(("impossible.csv".to_owned(), csv::impossible(results).into_bytes()));
    }
    let charts = charts::charts(results, &front, &curves, &effects);
    for chart in &charts {
        let fault = |what| ResultsError::Chart { name: chart.name.clone(), what };
        staged.push((
            format!("charts/{}.svg", chart.name),
            svg_of(&chart.drawing).map_err(fault)?.into_bytes(),
        ));
        staged.push((format!("charts/{}.png", chart.name), png(&chart.drawing).map_err(fault)?));
    }
    let place = |name: &str| folder.join(name).display().to_string();
    let mut written = vec![
        format!("{} (for a browser: everything)", place("page.html")),
        format!(
            "{}, results.csv ({} rows; results-columns.csv: what each column is)",
            place("results.parquet"),
            results.rows.len()
        ),
    ];
    if !results.impossible.is_empty() {
        written.push(format!("{} ({} combinations)", place("impossible.csv"), results.impossible.len()));
    }
    if !charts.is_empty() {
        let names: Vec<&str> = charts.iter().map(|c| c.name.as_str()).collect();
        written.push(format!("{} (each also .png): {}", place("charts/*.svg"), names.join(", ")));
    }
    for (name, bytes) in staged {
        files.stage(&folder.join(name), bytes);
    }
    Ok(text::summary(results, &front, &curves, &written))
}
