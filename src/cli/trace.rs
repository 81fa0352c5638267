//! `radeng trace`: a recorded run looked at again, without simulating it.

use super::args::TraceArgs;
use super::{CliError, Outcome, plan};
use crate::image::{OutputError, OutputFiles};
use crate::report::observed_text::trace_summary;
use crate::report::{self, ObservedReport, Timings, TraceReport};
use crate::trace::{Pending, Reader, TraceError, replay};

pub(super) fn run(args: &TraceArgs) -> Result<Outcome, CliError> {
    let [wave, slices] = args.look.outputs();
    plan::check_outputs([], &[(args.report.as_deref(), "json"), wave, slices], &[Some(&args.log)])?;
    let mut options = args.look.resolve(None)?;
    // With nothing asked for, what a log tells at a glance.
    options.account |= !options.is_on();
    let fault = |source| CliError::Log { path: args.log.clone(), source };
    let log = Reader::open(&args.log).map_err(|e| fault(TraceError::from(e)))?;
    let header = log.header().clone();
    let mut timings = Timings::default();
    let (seen, files) = timings.measure("trace", || replay(log, options)).map_err(fault)?;
    let report = TraceReport {
        schema: TraceReport::SCHEMA,
        log: args.log.clone(),
        board: header.board,
        clock_mhz: header.clock_mhz,
        workload: header.workload,
        scene: header.scene,
        observed: ObservedReport::new(&seen),
        timings,
    };
    let mut staged = OutputFiles::new();
    if let Some(path) = &args.report {
        staged.stage(path, report::to_json(&report));
    }
    put_in_place(staged, files)?;
    Ok(Outcome { text: trace_summary(&report), ..Outcome::default() })
}

/// Puts a run's files in place, after the staged ones are written.
///
/// # Errors
/// The first file that cannot be.
pub(super) fn put_in_place(staged: OutputFiles, files: Vec<Pending>) -> Result<(), CliError> {
    staged.commit_with(|| {
        for (path, file) in files {
            file.commit().map_err(|source| OutputError::Io { path, source })?;
        }
        Ok(())
    })
}
