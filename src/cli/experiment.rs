//! `radeng experiment`: a question to the board, its numbers as a table, a plot and rows; all of them as a document. Those of the
//! host (validation of pass 1, adaptive meshing, reconstruction, the savings of pass 2) have a document each.

use std::path::{Path, PathBuf};

use super::args::ExperimentArgs;
use super::{CliError, Outcome};
use crate::experiments::{self, EXPERIMENTS, Experiment, Extent, Findings, VALIDATION};
use crate::image::files::check_targets;
use crate::image::{OutputError, OutputFiles};
use crate::plot;

/// The name that stands for all experiments.
pub(super) const ALL: &str = "all";

pub(super) fn run(args: &ExperimentArgs) -> Result<Outcome, CliError> {
    // Those of the board, and of the host, which `all` leaves out.
    let host = [
        experiments::adaptive::EXPERIMENT,
        experiments::reconstruction::EXPERIMENT,
        experiments::two_pass::EXPERIMENT,
        VALIDATION,
    ];
    // Those of the host have a document each.
    let of_host = host.iter().find(|e| args.name == e.name).map(|e| e.name);
    let of_board = EXPERIMENTS.into_iter().filter(|e| args.name == ALL || args.name == e.name);
    let chosen: Vec<Experiment> = of_board.chain(host.into_iter().filter(|e| args.name == e.name)).collect();
    if chosen.is_empty() {
        let names: Vec<&str> = EXPERIMENTS.iter().chain(&host).map(|e| e.name).collect();
        return Err(CliError::Usage(format!("'{}' is none of {}, {ALL}", args.name, names.join(", "))));
    }
    let default = || PathBuf::from("docs").join(of_host.unwrap_or("board"));
    let folder = &args.output.clone().unwrap_or_else(default);
    std::fs::create_dir_all(folder).map_err(|e| OutputError::Target {
        path: folder.clone(),
        what: format!("cannot make this folder: {e}"),
    })?;
    let document = (args.name == ALL || of_host.is_some()).then(|| document_of(folder)).transpose()?;
    let plots: Vec<PathBuf> = chosen.iter().map(|e| folder.join(format!("{}.svg", e.name))).collect();
    check_targets(plots.iter().map(PathBuf::as_path).chain(document.as_deref()))?;

    let extent = if args.quick { Extent::Quick } else { Extent::Full };
    let mut all: Vec<(Experiment, Findings)> = Vec::new();
    for experiment in chosen {
        all.push((experiment, experiment.run(extent)?));
    }
    let mut files = OutputFiles::new();
    let mut outcome = Outcome::default();
    for ((experiment, findings), path) in all.iter().zip(&plots) {
        let title = format!("{}: {}", experiment.name, experiment.title);
        files.stage(path, plot::svg(&title, &findings.panels).map_err(CliError::Plot)?.into_bytes());
        for (i, table) in findings.tables.iter().enumerate() {
            // The first table is the experiment's own; others are told apart by their titles.
            let key = if i == 0 { String::new() } else { format!("-{}", table.key()) };
            files.stage(&folder.join(format!("{}{key}.csv", experiment.name)), table.csv().into_bytes());
        }
        for picture in findings.pictures.iter().flatten() {
            files.stage(&folder.join(&picture.file), picture.bytes.clone());
        }
        outcome.text += &(experiments::terminal_text(experiment, findings) + "\n");
        outcome.check_failed |= findings.checks.iter().any(|check| !check.holds);
    }
    if let Some(path) = &document {
        let name = folder.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let text = match of_host {
            Some(host) => experiments::host_document(host, &all[0].1, extent, &name),
            None => experiments::document(&all, extent, &name),
        };
        files.stage(path, text.into_bytes());
        outcome.text += &format!("document   {}\n", path.display());
    }
    files.commit()?;
    outcome.text += &format!("plots      {}/*.svg, rows *.csv\n", folder.display());
    Ok(outcome)
}

/// The document of a folder stands beside it, under its name: `docs/board.md` of `docs/board`.
fn document_of(folder: &Path) -> Result<PathBuf, CliError> {
    match folder.file_name() {
        Some(name) => Ok(folder.with_file_name(format!("{}.md", name.to_string_lossy()))),
        None => {
            Err(CliError::Usage(format!("-o {}: expected a folder with a name of its own", folder.display())))
        }
    }
}
