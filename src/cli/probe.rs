//! `radeng probe`: irradiance and illuminance at points, as a table or JSON; of grids also as a picture and CSV.

use std::path::Path;

use super::args::ProbeArgs;
use super::progress::Bars;
use super::render::clocked;
use super::{CliError, Outcome, method, plan};
use crate::frame::{self, GridOptions, GridProbed};
use crate::geom::DVec3;
use crate::image::OutputFiles;
use crate::image::false_colour::{FalseColour, Field, Quantity};
use crate::photometry::{GridPlace, GridSpec};
use crate::radiosity::{ProbePoint, SolveOptions};
use crate::report::{self, GridReport, ProbeReport, ProbedPoint, ScaledPicture, SceneFacts};

pub(super) fn run(args: &ProbeArgs) -> Result<Outcome, CliError> {
    match grid_spec(args)? {
        Some(spec) => run_grid(args, spec),
        None => run_points(args),
    }
}

fn run_points(args: &ProbeArgs) -> Result<Outcome, CliError> {
    refuse_flags_of_grids(args)?;
    let points = points(args)?;
    plan::check_outputs(
        [],
        &[(args.report.as_deref(), "json")],
        &[Some(&args.scene), args.solution.as_deref(), args.cast.board.as_deref().map(Path::new)],
    )?;
    let by_paths = method::resolve_probe(args)?;
    let options = plan::resolve_frame(&args.cast, args.solution.as_deref())?;

    let mut bars = Bars::new(SolveOptions::default().unshot_share, 0);
    let show = &mut |p| bars.show(p);
    let probed = match by_paths {
        Some(how) => frame::probe_by_paths(&args.scene, &options, &points, how)?,
        None => frame::probe_scene(&args.scene, &options, &points, args.interpolated, show)?,
    };
    bars.finish();

    let error = |i: usize| probed.standard_error.as_ref().map(|errors| errors[i].0);
    let values = points.iter().zip(&probed.irradiance).enumerate();
    let report = ProbeReport {
        schema: ProbeReport::SCHEMA,
        scene: SceneFacts::new(&probed.scene, &probed.mesh),
        caster: probed.caster,
        interpolated: args.interpolated,
        by_paths,
        points: values
            .map(|(i, (p, e))| ProbedPoint::new(p.at, p.normal, *e).with_standard_error(error(i)))
            .collect(),
        rays_by_kind: report::kinds::by_kind(&probed.meter),
        timings: clocked(&probed.timings, &probed.meter, probed.caster),
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
    let mut warnings = probed.warnings;
    warnings.extend(plan::finish_pass_1(&options));
    Ok(Outcome { text, warnings, ..Outcome::default() })
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
            Ok(ProbePoint { at, normal: direction(normal)? })
        })
        .collect()
}

/// Cells of a picture are magnified to about this width or height (pixels).
const PICTURE_SIDE: u32 = 640;

/// The wanted grid, if any.
fn grid_spec(args: &ProbeArgs) -> Result<Option<GridSpec>, CliError> {
    let edge = |flag: &str, text: &Option<String>| plan::parse_point(flag, text.as_deref().unwrap_or(""));
    let place = match (&args.grid, &args.surface) {
        (Some(corner), _) => GridPlace::Plane {
            corner: plan::parse_point("--grid", corner.strip_prefix("corner=").unwrap_or(corner))?,
            edge_u: edge("--edge-u", &args.edge_u)?,
            edge_v: edge("--edge-v", &args.edge_v)?,
        },
        (None, Some(name)) => GridPlace::Surface(name.clone()),
        (None, None) => return Ok(None),
    };
    let normal = match &args.normal[..] {
        [] => None,
        [text] => Some(direction(text)?),
        more => {
            let what = format!("{} --normal: a grid has one normal, or its own", more.len());
            return Err(CliError::Usage(what));
        }
    };
    let (border_m, height_m) = (args.border.unwrap_or(0.0), args.height.unwrap_or(0.0));
    Ok(Some(GridSpec { place, n: args.n, normal, border_m, height_m }))
}

fn refuse_flags_of_grids(args: &ProbeArgs) -> Result<(), CliError> {
    let given = [
        ("--n", args.n.is_some()),
        ("--border", args.border.is_some()),
        ("--height", args.height.is_some()),
        ("--skip-hidden", args.skip_hidden),
        ("--csv", args.csv.is_some()),
        ("--output", args.output.is_some()),
        ("--scale", args.scale.resolve() != Ok(FalseColour::default())),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(CliError::Usage(format!("{flag} has no use without --grid or --surface"))),
        None => Ok(()),
    }
}

fn run_grid(args: &ProbeArgs, spec: GridSpec) -> Result<Outcome, CliError> {
    method::resolve_probe(args)?;
    let look = args.scale.resolve().map_err(CliError::Usage)?;
    plan::check_outputs(
        [],
        &[(args.output.as_deref(), "png"), (args.csv.as_deref(), "csv"), (args.report.as_deref(), "json")],
        &[Some(&args.scene), args.solution.as_deref(), args.cast.board.as_deref().map(Path::new)],
    )?;
    let options = plan::resolve_frame(&args.cast, args.solution.as_deref())?;
    let wanted =
        GridOptions { spec: spec.clone(), skip_hidden: args.skip_hidden, interpolated: args.interpolated };

    let mut bars = Bars::new(SolveOptions::default().unshot_share, 0);
    let probed = frame::probe_grid(&args.scene, &options, &wanted, &mut |p| bars.show(p))?;
    bars.finish();

    let mut files = OutputFiles::new();
    let picture = match &args.output {
        Some(path) => {
            let (bytes, scale) = picture(&probed).encode_png(look)?;
            files.stage(path, bytes);
            Some(ScaledPicture::new(path, Quantity::Illuminance, scale, look.colours))
        }
        None => None,
    };
    let report = GridReport::new(probed, &spec, args.interpolated, picture);
    if let Some(path) = &args.csv {
        files.stage(path, report.csv().into_bytes());
    }
    if let Some(path) = &args.report {
        files.stage(path, report::to_json(&report));
    }
    files.commit()?;
    let text = if args.json {
        String::from_utf8_lossy(&report::to_json(&report)).into_owned()
    } else {
        report::grid::grid_text(&report)
    };
    let mut warnings = report.warnings;
    warnings.extend(plan::finish_pass_1(&options));
    Ok(Outcome { text, warnings, ..Outcome::default() })
}

/// A block a cell, in the proportions of the area.
fn picture(probed: &GridProbed) -> Field {
    let grid = &probed.grid;
    let [n_u, n_v] = grid.n;
    let field = Field::illuminance(n_u as usize, n_v as usize, &probed.values);
    let longest_m = grid.size_m[0].max(grid.size_m[1]);
    let side = |k: usize| {
        let pixels = f64::from(PICTURE_SIDE) * grid.size_m[k] / longest_m / f64::from(grid.n[k]);
        (pixels.round() as usize).max(1)
    };
    field.magnified([side(0), side(1)])
}

fn direction(text: &str) -> Result<DVec3, CliError> {
    plan::parse_vector("--normal", text)?
        .try_normalize()
        .ok_or_else(|| CliError::Usage(format!("--normal '{text}': expected a direction, not zero")))
}
