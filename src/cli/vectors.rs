//! `radeng simulate --rays VECTORS`: test vectors through the clocked board, without scene and renderer.

use std::io::Read;
use std::path::Path;

use super::args::SimulateArgs;
use super::plan::DEFAULT_BOARD;
use super::{CliError, Outcome, plan};
use crate::image::OutputFiles;
use crate::report::{self, BoardReport, SimulateReport, Timings, VectorsReport};
use crate::vectors::{self, MAX_FILE_BYTES, Vectors, VectorsFormat};

/// A file's bytes; `expected` says what it should be.
pub(super) fn read_bytes(path: &Path, expected: &str) -> Result<Vec<u8>, CliError> {
    let fault = |what: String| CliError::Read { path: path.to_owned(), what };
    if path.is_dir() {
        return Err(fault(format!("is a directory, expected {expected}")));
    }
    let file = std::fs::File::open(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => fault(format!("no such file, expected {expected}")),
        _ => fault(format!("cannot be read: {e}")),
    })?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| fault(format!("cannot be read: {e}")))?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(fault(format!("is longer than {MAX_FILE_BYTES} bytes, the most that is read")));
    }
    Ok(bytes)
}

/// Flags of `simulate` that mean nothing without a scene.
fn check_flags(args: &SimulateArgs) -> Result<(), CliError> {
    let unused = [("--elements", args.elements.is_some()), ("--dense-visibility", args.dense_visibility)];
    match unused.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(CliError::Usage(format!("{flag} has no use without SCENE"))),
        None => Ok(()),
    }
}

/// Runs the vectors of `path`.
pub(super) fn run(args: &SimulateArgs, path: &Path) -> Result<Outcome, CliError> {
    check_flags(args)?;
    plan::check_outputs(
        [],
        &[(args.report.as_deref(), "json")],
        &[Some(path), Some(Path::new(&args.board))],
    )?;
    let board = plan::resolve_board(&args.board)?;
    let mut timings = Timings::default();
    let bytes = timings.measure("read", || read_bytes(path, "test vectors"))?;
    if VectorsFormat::sniff(&bytes).is_none() {
        return Err(CliError::Usage(format!(
            "{}: no test vectors (their first record is 'vectors,1'); rays in metres need the scene that they are \
             cast in: radeng simulate SCENE --rays {0}",
            path.display()
        )));
    }
    let read = timings.measure("parse", || Vectors::from_bytes(&bytes));
    drop(bytes);
    let vectors = read.map_err(|source| CliError::Vectors { path: path.to_owned(), source })?;
    let check = timings.measure("run", || vectors::check(&vectors, &board));
    let check = check.map_err(|source| CliError::Check { path: path.to_owned(), source })?;
    let mut warnings = Vec::new();
    if vectors.formats != board.formats {
        warnings.push(format!(
            "{}: the vectors' number formats replace those of board {}: {}",
            path.display(),
            board.name,
            report::verify_text::formats_text(&vectors.formats)
        ));
    }
    let report = SimulateReport {
        schema: SimulateReport::SCHEMA,
        scene: None,
        workload: "vectors",
        rays_file: Some(path.to_owned()),
        vectors: Some(VectorsReport::new(&vectors, &check)),
        options: None,
        solve_options: None,
        board: BoardReport::of_total(&check.spec, &check.statistics),
        timings,
        warnings,
    };
    if let Some(path) = &args.report {
        let mut files = OutputFiles::new();
        files.stage(path, report::to_json(&report));
        files.commit()?;
    }
    let mut text = report::terminal::simulate_summary(&report);
    if let Some(wrong) = &check.first_wrong {
        text.push_str(&report::side_by_side::wrong_text(&vectors, wrong));
    }
    if !check.passed() {
        let board =
            if args.board == DEFAULT_BOARD { String::new() } else { format!(" --board {}", args.board) };
        text.push_str(&format!("\nagain      radeng simulate --rays {}{board}\n", path.display()));
    }
    Ok(Outcome { text, warnings: report.warnings, check_failed: !check.passed() })
}
