//! `radeng`: parse, run, print, exit status.
//!
//! Status 0: fine; 1: a check failed (`verify`, `simulate` of vectors, `compare --threshold`); 2: a bad input, named on stderr;
//! 130: stopped by Ctrl-C, with a checkpoint or the picture so far.

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use radiosity_engine::cli::{self, CommandLine};

fn main() -> ExitCode {
    let line = CommandLine::parse();
    match cli::run(&line) {
        Ok(outcome) => {
            for warning in &outcome.warnings {
                eprintln!("warning: {warning}");
            }
            // A reader that stopped listening (`| head`) is no failure of the run.
            let _ = std::io::stdout().write_all(outcome.text.as_bytes());
            match (outcome.stopped, outcome.check_failed) {
                (true, _) => ExitCode::from(130),
                (false, true) => ExitCode::from(1),
                (false, false) => ExitCode::SUCCESS,
            }
        }
        Err(error) => {
            let status = error.status();
            eprintln!("{}", error.terminal_text());
            ExitCode::from(status)
        }
    }
}
