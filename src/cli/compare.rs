//! `radeng compare`: how two EXR pictures, or two reports of runs on the board, differ.

use std::path::Path;

use super::args::CompareArgs;
use super::{CliError, Outcome, plan};
use crate::image::exr::read_exr;
use crate::image::{Film, OutputFiles, difference};
use crate::report::{self, CompareReport, RunComparison, RunReport};

pub(super) fn run(args: &CompareArgs) -> Result<Outcome, CliError> {
    let reports = [&args.a, &args.b].map(|path| has_extension(path, "json"));
    if let Some(t) = args.threshold.filter(|t| !(t.is_finite() && *t >= 0.0)) {
        let of = if reports == [true; 2] { "a share of each counter" } else { "a share of the mean" };
        return Err(CliError::Usage(format!("--threshold {t}: expected {of}, 0 or more")));
    }
    plan::check_outputs([], &[(args.report.as_deref(), "json")], &[Some(&args.a), Some(&args.b)])?;
    match reports {
        [true, true] => compare_reports(args),
        [false, false] => compare_pictures(args),
        _ => Err(CliError::Usage(format!(
            "{} and {}: a picture and a report; expected two .exr pictures or two .json reports",
            args.a.display(),
            args.b.display()
        ))),
    }
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

fn compare_pictures(args: &CompareArgs) -> Result<Outcome, CliError> {
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let difference = difference(&a, &b, args.threshold)?;
    let passed = difference.n_over_threshold == 0;
    let report = CompareReport {
        schema: CompareReport::SCHEMA,
        a: args.a.clone(),
        b: args.b.clone(),
        difference,
        passed,
    };
    write(args, || report::to_json(&report))?;
    let text = report::terminal::compare_summary(&report);
    Ok(Outcome { text, warnings: Vec::new(), check_failed: !passed })
}

fn compare_reports(args: &CompareArgs) -> Result<Outcome, CliError> {
    let (a, b) = (read_report(&args.a)?, read_report(&args.b)?);
    let comparison = RunComparison::new([&args.a, &args.b], &a, &b, args.threshold)
        .map_err(|what| CliError::Read { path: args.b.clone(), what })?;
    write(args, || report::to_json(&comparison))?;
    let text = report::compare_runs_text::compare_runs_summary(&comparison);
    Ok(Outcome { text, warnings: Vec::new(), check_failed: !comparison.passed })
}

fn write(args: &CompareArgs, json: impl FnOnce() -> Vec<u8>) -> Result<(), CliError> {
    if let Some(path) = &args.report {
        let mut files = OutputFiles::new();
        files.stage(path, json());
        files.commit()?;
    }
    Ok(())
}

fn read_report(path: &Path) -> Result<RunReport, CliError> {
    let fault = |what| CliError::Read { path: path.to_owned(), what };
    RunReport::parse(&plan::read_text(path, "a JSON report").map_err(fault)?).map_err(fault)
}

fn read(path: &Path) -> Result<Film, CliError> {
    if !has_extension(path, "exr") {
        return Err(CliError::Usage(format!(
            "{}: only .exr pictures are compared: they hold the linear values, other formats are rounded and exposed",
            path.display()
        )));
    }
    Ok(read_exr(path)?)
}
