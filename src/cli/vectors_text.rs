//! The verdict on test vectors as text: what the file holds, what of it holds, and how to run it again.
//!
//! ```text
//! Vectors, Check, BoardSpec --> vectors, formats, grid; then one line that says passed, agree or FAILED
//! ```

use std::fmt::Write as _;
use std::path::Path;

use rtl_model::spec::BoardSpec;

use super::plan::DEFAULT_BOARD;
use crate::report::verify_text::formats_text;
use crate::vectors::{Check, Vectors};

/// What the file holds, and whether it holds true.
pub(super) fn verdict(path: &Path, vectors: &Vectors, check: &Check, board: &BoardSpec) -> String {
    let mut out = String::new();
    let mut line = |label: &str, text: &str| {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{label:<11}{text}");
    };
    line("vectors", &path.display().to_string());
    line(
        "",
        &format!(
            "{} patches, {} rays of which {} with an expected answer, {} single tests",
            vectors.patches.len(),
            check.n_rays,
            check.n_expected,
            check.n_tests
        ),
    );
    line("", &formats_text(&vectors.formats));
    let whose = match vectors.grid_log2 {
        Some(_) => "the file's".to_owned(),
        None => format!("that of board {}", board.name),
    };
    line("", &format!("grid of 2^{} cells a side, {whose}", check.grid_log2));
    let (label, told) = outcome(check);
    line(label, &told);
    if check.n_rays_wrong == 0 && check.n_expected > 0 {
        line("", &agreement(check));
    }
    out
}

/// One line: its label and what it says.
fn outcome(check: &Check) -> (&'static str, String) {
    let holding = |wrong: u64, all: u64, what: &str| match wrong {
        0 => format!("{all} of {all} {what} hold"),
        1 => format!("1 of {all} {what} does not hold"),
        n => format!("{n} of {all} {what} do not hold"),
    };
    let rays = holding(check.n_rays_wrong, check.n_rays, "rays");
    let tests = holding(check.n_tests_wrong, check.n_tests, "single tests");
    let both = match (check.n_rays, check.n_tests) {
        (0, _) => tests,
        (_, 0) => rays,
        _ => format!("{rays}, {tests}"),
    };
    let n_expected = check.n_expected;
    match (check.passed(), n_expected + check.n_tests) {
        (false, _) => ("FAILED", both),
        (true, 0) => ("agree", format!("0 of 0 expected: no answer to compare with; {}", agreement(check))),
        (true, _) => ("passed", format!("{both}; {n_expected} of {n_expected} expected answers")),
    }
}

fn agreement(check: &Check) -> String {
    format!("clocked board, functional model and oracle agree on {0} of {0} rays", check.n_rays)
}

/// The command that runs them again.
pub(super) fn again(path: &Path, board: &str) -> String {
    let board = if board == DEFAULT_BOARD { String::new() } else { format!(" --board {board}") };
    format!("\nagain      radeng simulate --rays {}{board}\n", path.display())
}
