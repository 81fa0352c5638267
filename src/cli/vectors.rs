//! `radeng simulate --rays VECTORS`: test vectors through the clocked board, without scene and renderer.

use std::io::Read;
use std::path::Path;

use rtl_model::fixed::Formats;
use rtl_model::spec::BoardSpec;

use super::args::SimulateArgs;
use super::{CliError, Outcome, plan, recorded, vectors_text};
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
    let of_scenes = [
        "elements",
        "seed",
        "dense_visibility",
        "form_factors",
        "kernel",
        "max_shooters",
        "wanted_error",
        "width",
        "height",
        "samples",
        "shadow_strata",
        "shadow_sampling",
        "shadow_error",
        "shadow_coherence",
        "tau",
        "warm_up",
        "trace",
        "account",
        "interval",
        "pixel",
        "ray",
        "wave",
        "perfetto",
        "window",
        "force",
    ];
    let unused = of_scenes.into_iter().filter(|id| args.given.has(id)).chain(recorded::given(args));
    let unused: Vec<String> = unused.map(|id| format!("--{}", id.replace('_', "-"))).collect();
    match unused.as_slice() {
        [] => Ok(()),
        [flag] => Err(CliError::Usage(format!("{flag} has no use without SCENE"))),
        flags => Err(CliError::Usage(format!("{} have no use without SCENE", flags.join(", ")))),
    }
}

/// Not one bit of any answer differs: K written out in full is `full`.
fn same_formats(a: &Formats, b: &Formats) -> bool {
    let whole =
        |f: &Formats| Formats { cross_keep_bits: f.cross_keep_bits.filter(|_| f.cross_drop() > 0), ..*f };
    whole(a) == whole(b)
}

/// What of the board the file replaces, to be told.
fn replacements(path: &Path, vectors: &Vectors, board: &BoardSpec) -> Vec<String> {
    let (path, name) = (path.display(), &board.name);
    let mut warnings = Vec::new();
    if !same_formats(&vectors.formats, &board.formats) {
        warnings.push(format!(
            "{path}: the vectors' number formats replace those of board {name}: {}",
            report::verify_text::formats_text(&vectors.formats)
        ));
    }
    let grids = vectors.grid_log2.zip(board.grid_log2);
    if let Some((file, own)) = grids.filter(|(file, own)| file != own) {
        warnings.push(format!(
            "{path}: the vectors' grid of 2^{file} cells a side replaces that of board {name}, 2^{own}"
        ));
    }
    warnings
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
    // An empty file, and a packed one with another magic, are refused by the reader.
    let is_packed = VectorsFormat::of(path) == Some(VectorsFormat::Binary);
    let is_known = VectorsFormat::sniff(&bytes).is_some();
    if !(is_known || is_packed || bytes.is_empty()) {
        return Err(CliError::Usage(format!(
            "{}: no test vectors (their first record is 'vectors,1'); rays in metres need the scene that they are \
             cast in: radeng simulate SCENE --rays {0}",
            path.display()
        )));
    }
    let read = timings.measure("parse", || match is_known {
        true => Vectors::from_bytes(&bytes),
        false => vectors::from_binary(&bytes),
    });
    drop(bytes);
    let vectors = read.map_err(|source| CliError::Vectors { path: path.to_owned(), source })?;
    let check = timings.measure("run", || vectors::check(&vectors, &board));
    let check = check.map_err(|source| CliError::Check { path: path.to_owned(), source })?;
    let warnings = replacements(path, &vectors, &board);
    let report = SimulateReport {
        schema: SimulateReport::SCHEMA,
        scene: None,
        workload: "vectors",
        rays_file: Some(path.to_owned()),
        observed: None,
        vectors: Some(VectorsReport::new(&vectors, &check)),
        warm_up: None,
        options: None,
        solve_options: None,
        board: BoardReport::of_total(&check.spec, &check.statistics, &check.links),
        recorded: None,
        timings,
        warnings,
    };
    if let Some(path) = &args.report {
        let mut files = OutputFiles::new();
        files.stage(path, report::to_json(&report));
        files.commit()?;
    }
    let mut text = vectors_text::verdict(path, &vectors, &check, &board);
    if let Some(wrong) = &check.first_wrong {
        text.push_str(&report::side_by_side::wrong_text(&vectors, wrong));
    }
    if !check.passed() {
        text.push_str(&vectors_text::again(path, &args.board));
    }
    text.push('\n');
    text.push_str(&report::terminal::simulate_summary(&report, args.all_blocks));
    Ok(Outcome { text, warnings: report.warnings, check_failed: !check.passed(), ..Outcome::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_with_all_bits_written_out_are_those_that_are_full() {
        let full = Formats { cross_keep_bits: None, ..Formats::default() };
        let kept = |bits| Formats { cross_keep_bits: Some(bits), ..full };
        assert!(same_formats(&full, &kept(2 * full.coord_frac_bits)));
        assert!(!same_formats(&full, &kept(2 * full.coord_frac_bits - 1)));
        assert!(same_formats(&kept(20), &kept(20)) && !same_formats(&kept(20), &kept(21)));
        assert!(!same_formats(&full, &Formats { t_frac_bits: full.t_frac_bits - 1, ..full }));
    }
}
