//! `radeng compare`: how two EXR pictures differ.

use std::path::Path;

use super::args::CompareArgs;
use super::{CliError, Outcome, plan};
use crate::image::exr::read_exr;
use crate::image::{Film, OutputFiles, difference};
use crate::report::{self, CompareReport};

pub(super) fn run(args: &CompareArgs) -> Result<Outcome, CliError> {
    if let Some(t) = args.threshold.filter(|t| !(t.is_finite() && *t >= 0.0)) {
        return Err(CliError::Usage(format!("--threshold {t}: expected a share of the mean, 0 or more")));
    }
    plan::check_outputs([], &[(args.report.as_deref(), "json")], &[Some(&args.a), Some(&args.b)])?;
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
    if let Some(path) = &args.report {
        let mut files = OutputFiles::new();
        files.stage(path, report::to_json(&report));
        files.commit()?;
    }
    let text = report::terminal::compare_summary(&report);
    Ok(Outcome { text, warnings: Vec::new(), check_failed: !passed })
}

fn read(path: &Path) -> Result<Film, CliError> {
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("exr")) {
        return Err(CliError::Usage(format!(
            "{}: only .exr pictures are compared: they hold the linear values, other formats are rounded and exposed",
            path.display()
        )));
    }
    Ok(read_exr(path)?)
}
