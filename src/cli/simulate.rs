//! `radeng simulate`: a workload through the emulated board, and the account of its cycles. Test vectors, which need
//! no scene, are in `vectors.rs`; records and samples of the work in `recorded.rs`.

use std::path::Path;

use rtl_model::spec::BoardSpec;

use super::args::{SimulateArgs, WorkloadArg};
use super::progress::Bars;
use super::rays::read_rays;
use super::{CliError, Outcome, film, plan, recorded, render, trace, vectors};
use crate::frame::{SimulateOptions, Workload};
use crate::image::OutputFiles;
use crate::raycast::board::CommandSink;
use crate::reconstruct::ReconstructOptions;
use crate::render::RenderOptions;
use crate::report::{self, BoardReport, ObservedReport, SceneFacts, SimulateReport, WarmUpReport};
use crate::trace::{About, Picture, Watch};

pub(super) fn run(args: &SimulateArgs) -> Result<Outcome, CliError> {
    let scene = match (&args.scene, &args.rays) {
        (Some(scene), _) => scene,
        (None, Some(path)) => return vectors::run(args, path),
        (None, None) => {
            return Err(CliError::Usage("expected SCENE, or --rays with test vectors".to_owned()));
        }
    };
    let [wave, slices] = args.look.outputs();
    plan::check_outputs(
        [],
        &[
            (args.report.as_deref(), "json"),
            (args.trace.as_deref(), "radlog"),
            wave,
            slices,
            (args.record.as_deref(), "radtrace"),
        ],
        &[Some(scene), args.rays.as_deref(), Some(Path::new(&args.board)), args.replay.as_deref()],
    )?;
    let board = plan::resolve_board(&args.board)?;
    film::fixed_samples(&args.picture, "the board is driven with the same rays whatever they see")?;
    let picture = plan::resolve_picture(&args.picture, ReconstructOptions::default(), args.seed);
    let solve = plan::resolve_solve(args.seed, &args.pass_1);
    let workload = match &args.rays {
        Some(path) => Workload::Rays(read_rays(path)?),
        None => match args.workload.unwrap_or(WorkloadArg::Primary) {
            WorkloadArg::Primary => Workload::Primary,
            WorkloadArg::Radiosity => Workload::Radiosity,
            WorkloadArg::Shadow => Workload::Shadow,
            WorkloadArg::All => Workload::All,
        },
    };

    let mut watch = watch(args, &board, scene, workload.name(), &picture)?;
    let sink = watch.as_mut().map(|watch| watch as &mut dyn CommandSink);
    let mut bars = Bars::new(solve.unshot_share, render::n_camera_rays(&picture));
    let show = &mut |p| bars.show(p);
    let options = SimulateOptions {
        elements: args.elements,
        board,
        workload,
        warm_up_cycles: args.warm_up.unwrap_or(0),
        solve,
        picture,
    };
    let mut files = OutputFiles::new();
    let (run, recorded) = recorded::simulate(args, scene, &options, &mut files, sink, show)?;
    bars.finish();
    let (seen, written) = watch.map(Watch::finish).transpose()?.unzip();

    let report = SimulateReport {
        schema: SimulateReport::SCHEMA,
        scene: Some(SceneFacts::new(&run.scene, &run.mesh)),
        workload: options.workload.name(),
        rays_file: args.rays.clone(),
        vectors: None,
        warm_up: run.warm_up.as_ref().map(WarmUpReport::new),
        options: Some(options.picture),
        solve_options: Some(options.solve),
        board: BoardReport::new(&options.board, &run.board, &run.links),
        observed: seen.as_ref().map(ObservedReport::new),
        recorded,
        timings: run.timings,
        warnings: run.warnings,
    };
    if let Some(path) = &args.report {
        files.stage(path, report::to_json(&report));
    }
    trace::put_in_place(files, written.unwrap_or_default())?;
    let mut text = report::terminal::simulate_summary(&report, args.all_blocks);
    text.extend(report.recorded.as_ref().map(|recorded| recorded.lines(options.board.clock_mhz)));
    Ok(Outcome { text, warnings: report.warnings, ..Outcome::default() })
}

/// A watch over the run, where one is asked for.
fn watch(
    args: &SimulateArgs,
    board: &BoardSpec,
    scene: &Path,
    workload: &str,
    picture: &RenderOptions,
) -> Result<Option<Watch>, CliError> {
    let options = args.look.resolve(args.trace.clone())?;
    if !options.is_on() {
        return Ok(None);
    }
    let &RenderOptions { width, height, samples, .. } = picture;
    let has_camera_rays = matches!(workload, "primary" | "all");
    let about = About {
        board: board.name.clone(),
        clock_mhz: board.clock_mhz,
        workload: workload.to_owned(),
        scene: Some(scene.to_owned()),
        picture: has_camera_rays.then_some(Picture { width, height, samples }),
    };
    Ok(Some(Watch::new(options, about)?))
}
