//! `radeng probe`: irradiance and illuminance at points, as a table or JSON.

use std::path::Path;

use super::args::ProbeArgs;
use super::progress::Bars;
use super::{CliError, Outcome, plan};
use crate::frame;
use crate::image::OutputFiles;
use crate::radiosity::{ProbePoint, SolveOptions};
use crate::report::{self, ProbeReport, ProbedPoint, SceneFacts};

pub(super) fn run(args: &ProbeArgs) -> Result<Outcome, CliError> {
    let points = points(args)?;
    plan::check_outputs(
        [],
        &[(args.report.as_deref(), "json")],
        &[Some(&args.scene), args.solution.as_deref(), args.cast.board.as_deref().map(Path::new)],
    )?;
    let options = plan::resolve_frame(&args.cast, args.solution.as_deref())?;

    let mut bars = Bars::new(SolveOptions::default().unshot_share, 0);
    let show = &mut |p| bars.show(p);
    let probed = frame::probe_scene(&args.scene, &options, &points, args.interpolated, show)?;
    bars.finish();

    let values = points.iter().zip(&probed.irradiance);
    let report = ProbeReport {
        schema: ProbeReport::SCHEMA,
        scene: SceneFacts::new(&probed.scene, &probed.mesh),
        caster: probed.caster,
        interpolated: args.interpolated,
        points: values.map(|(p, e)| ProbedPoint::new(p.at, p.normal, *e)).collect(),
        timings: probed.timings,
    };
    if let Some(path) = &args.report {
        let mut files = OutputFiles::new();
        files.stage(path, report::to_json(&report));
        files.commit()?;
    }
    let text = if args.json {
        String::from_utf8_lossy(&report::to_json(&report.points)).into_owned()
    } else {
        report::terminal::probe_table(&report.points)
    };
    Ok(Outcome { text, warnings: probed.warnings, check_failed: false })
}

fn points(args: &ProbeArgs) -> Result<Vec<ProbePoint>, CliError> {
    if args.at.len() != args.normal.len() {
        return Err(CliError::Usage(format!(
            "{} --at and {} --normal: each point needs its normal",
            args.at.len(),
            args.normal.len()
        )));
    }
    let pairs = args.at.iter().zip(&args.normal);
    pairs
        .map(|(at, normal)| {
            let at = plan::parse_point("--at", at)?;
            let direction = plan::parse_vector("--normal", normal)?;
            match direction.try_normalize() {
                Some(normal) => Ok(ProbePoint { at, normal }),
                None => Err(CliError::Usage(format!("--normal '{normal}': expected a direction, not zero"))),
            }
        })
        .collect()
}
