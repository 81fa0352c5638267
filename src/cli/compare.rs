//! `radeng compare`: how two EXR pictures differ, their Mach bands among it, or two reports of runs on the board, differ.

use std::path::Path;

use super::args::CompareArgs;
use super::{CliError, Outcome, plan};
use crate::image::exr::read_exr;
use crate::image::{Film, OutputFiles, crease_map, difference, encode_crease_maps, mach_bands};
use crate::report::{self, CompareReport, RunComparison, RunReport};

pub(super) fn run(args: &CompareArgs) -> Result<Outcome, CliError> {
    let reports = [&args.a, &args.b].map(|path| has_extension(path, "json"));
    if let Some(t) = args.threshold.filter(|t| !(t.is_finite() && *t >= 0.0)) {
        let of = if reports == [true; 2] { "a share of each counter" } else { "a share of the mean" };
        return Err(CliError::Usage(format!("--threshold {t}: expected {of}, 0 or more")));
    }
    if let Some(scale) = args.band_scale.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(CliError::Usage(format!("--band-scale {scale}: expected a share of the mean, over 0")));
    }
    if args.bands.is_some() && reports == [true; 2] {
        return Err(CliError::Usage("--bands: only pictures have Mach bands, these are reports".to_owned()));
    }
    let outputs = [(args.bands.as_deref(), "png"), (args.report.as_deref(), "json")];
    plan::check_outputs([], &outputs, &[Some(&args.a), Some(&args.b)])?;
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
    let bands = mach_bands(&a, &b);
    let mut files = OutputFiles::new();
    let mut band_scale = None;
    if let Some(path) = &args.bands {
        let maps = [crease_map(&a), crease_map(&b)];
        let own = || maps[0].scale().max(maps[1].scale());
        let added = bands.map(|b| b.p99_added).filter(|p| *p > 0.0);
        let scale = args.band_scale.or(added).unwrap_or_else(own);
        files.stage(path, encode_crease_maps(&[&maps[0], &maps[1]], scale)?);
        band_scale = Some(scale);
    }
    let report = CompareReport {
        schema: CompareReport::SCHEMA,
        a: args.a.clone(),
        b: args.b.clone(),
        difference,
        mach_bands: bands,
        band_scale,
        passed,
    };
    if let Some(path) = &args.report {
        files.stage(path, report::to_json(&report));
    }
    files.commit()?;
    let text = report::terminal::compare_summary(&report);
    Ok(Outcome { text, warnings: Vec::new(), check_failed: !passed, ..Outcome::default() })
}

fn compare_reports(args: &CompareArgs) -> Result<Outcome, CliError> {
    let (a, b) = (read_report(&args.a)?, read_report(&args.b)?);
    let comparison = RunComparison::new([&args.a, &args.b], &a, &b, args.threshold)
        .map_err(|what| CliError::Read { path: args.b.clone(), what })?;
    if let Some(path) = &args.report {
        let mut files = OutputFiles::new();
        files.stage(path, report::to_json(&comparison));
        files.commit()?;
    }
    let text = report::compare_runs_text::compare_runs_summary(&comparison);
    Ok(Outcome { text, warnings: Vec::new(), check_failed: !comparison.passed, ..Outcome::default() })
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
