//! `radeng simulate`: a workload through the emulated board, and the account of its cycles. Test vectors, which need
//! no scene, are in `vectors.rs`.

use std::path::Path;

use super::args::{ReconstructArg, SimulateArgs, WorkloadArg};
use super::progress::Bars;
use super::rays::read_rays;
use super::{CliError, Outcome, plan, render, vectors};
use crate::frame::{self, Workload};
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
        &[(args.report.as_deref(), "json")],
        &[Some(scene), args.rays.as_deref(), Some(Path::new(&args.board))],
    )?;
    let board = plan::resolve_board(&args.board)?;
    let picture = plan::resolve_picture(&args.picture, ReconstructArg::Hermite, args.seed);
    let solve = plan::resolve_solve(args.seed, args.dense_visibility);
    let (workload, name) = match &args.rays {
        Some(path) => (Workload::Rays(read_rays(path)?), "rays"),
        None => match args.workload.unwrap_or(WorkloadArg::Primary) {
            WorkloadArg::Primary => (Workload::Primary, "primary"),
            WorkloadArg::Radiosity => (Workload::Radiosity, "radiosity"),
            WorkloadArg::Shadow => (Workload::Shadow, "shadow"),
            WorkloadArg::All => (Workload::All, "all"),
        },
    };

    let mut bars = Bars::new(solve.unshot_share, render::n_camera_rays(&picture));
    let show = &mut |p| bars.show(p);
    let run = frame::simulate_scene(scene, args.elements, &board, &workload, &solve, &picture, None, show)?;
    bars.finish();

    let report = SimulateReport {
        schema: SimulateReport::SCHEMA,
        scene: Some(SceneFacts::new(&run.scene, &run.mesh)),
        workload: name,
        rays_file: args.rays.clone(),
        vectors: None,
        options: Some(picture),
        solve_options: Some(solve),
        board: BoardReport::new(&board, &run.board),
        timings: run.timings,
        warnings: run.warnings,
    };
    if let Some(path) = &args.report {
        let mut files = OutputFiles::new();
        files.stage(path, report::to_json(&report));
        files.commit()?;
    }
    let text = report::terminal::simulate_summary(&report);
    Ok(Outcome { text, warnings: report.warnings, check_failed: false })
}
