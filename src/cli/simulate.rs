//! `radeng simulate`: a workload through the emulated board, and the account of its cycles. Test vectors, which need
//! no scene, are in `vectors.rs`; records and samples of the work in `recorded.rs`.

use std::path::Path;

use super::args::{ReconstructArg, SimulateArgs, WorkloadArg};
use super::progress::Bars;
use super::rays::read_rays;
use super::{CliError, Outcome, plan, recorded, render, vectors};
use crate::frame::{Simulation, Workload};
use crate::image::OutputFiles;
use crate::report::{self, BoardReport, SceneFacts, SimulateReport};

pub(super) fn run(args: &SimulateArgs) -> Result<Outcome, CliError> {
    let scene = match (&args.scene, &args.rays) {
        (Some(scene), _) => scene,
        (None, Some(path)) => return vectors::run(args, path),
        (None, None) => {
            return Err(CliError::Usage("expected SCENE, or --rays with test vectors".to_owned()));
        }
    };
    plan::check_outputs(
        [],
        &[(args.report.as_deref(), "json"), (args.record.as_deref(), "radtrace")],
        &[Some(scene), args.rays.as_deref(), Some(Path::new(&args.board)), args.replay.as_deref()],
    )?;
    let board = plan::resolve_board(&args.board)?;
    let picture = plan::resolve_picture(&args.picture, ReconstructArg::Hermite, args.seed);
    let solve = plan::resolve_solve(args.seed, args.dense_visibility);
    let workload = match &args.rays {
        Some(path) => Workload::Rays(read_rays(path)?),
        None => match args.workload.unwrap_or(WorkloadArg::Primary) {
            WorkloadArg::Primary => Workload::Primary,
            WorkloadArg::Radiosity => Workload::Radiosity,
            WorkloadArg::Shadow => Workload::Shadow,
            WorkloadArg::All => Workload::All,
        },
    };

    let mut bars = Bars::new(solve.unshot_share, render::n_camera_rays(&picture));
    let show = &mut |p| bars.show(p);
    let simulation = Simulation {
        scene,
        elements: args.elements,
        board: &board,
        workload: &workload,
        solve: &solve,
        picture: &picture,
    };
    let mut files = OutputFiles::new();
    let (run, recorded) = recorded::simulate(args, &simulation, &mut files, show)?;
    bars.finish();

    let report = SimulateReport {
        schema: SimulateReport::SCHEMA,
        scene: Some(SceneFacts::new(&run.scene, &run.mesh)),
        workload: workload.name(),
        rays_file: args.rays.clone(),
        vectors: None,
        options: Some(picture),
        solve_options: Some(solve),
        board: BoardReport::new(&board, &run.board),
        recorded,
        timings: run.timings,
        warnings: run.warnings,
    };
    if let Some(path) = &args.report {
        files.stage(path, report::to_json(&report));
    }
    files.commit()?;
    let mut text = report::terminal::simulate_summary(&report);
    text.extend(report.recorded.as_ref().map(|recorded| recorded.lines(board.clock_mhz)));
    Ok(Outcome { text, warnings: report.warnings, check_failed: false })
}
