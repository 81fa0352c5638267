//! `radeng solve`: pass 1, the solution's file, report, summary.

use std::path::Path;

use super::args::SolveArgs;
use super::progress::Bars;
use super::render::{board_report, clocked, loaded_from};
use super::{CliError, Outcome, plan};
use crate::frame::{self, FrameOptions, PassOne, SolvePlan, Solved};
use crate::image::OutputFiles;
use crate::radiosity::summary::summarise;
use crate::radiosity::{SolveOptions, solution_file};
use crate::report::{self, PassOneReport, SceneFacts, SolveReport};

pub(super) fn run(args: &SolveArgs) -> Result<Outcome, CliError> {
    if !(args.unshot > 0.0 && args.unshot < 1.0) {
        return Err(CliError::Usage(format!("--unshot {}: expected a share between 0 and 1", args.unshot)));
    }
    plan::check_outputs(
        [],
        &[(Some(&args.output), "radsol"), (args.report.as_deref(), "json"), (args.rows.as_deref(), "radrow")],
        &[Some(&args.scene), args.continue_from.as_deref(), args.cast.board.as_deref().map(Path::new)],
    )?;
    let mut options = plan::resolve_frame(&args.cast, None)?;
    options.pass_1 = PassOne::Planned(Box::new(solve_plan(args, options.pass_1, options.caster.identity())));

    let mut bars = Bars::new(args.unshot, 0);
    let solved = frame::solve_scene(&args.scene, &options, &mut |p| bars.show(p))?;
    bars.finish();

    let report = document(&solved, &options);
    let mut files = OutputFiles::new();
    if let Some(path) = &args.report {
        files.stage(path, report::to_json(&report));
    }
    files.commit_with(|| -> Result<(), CliError> {
        let Solved { scene, mesh, solution, solve_options, .. } = &solved;
        Ok(solution_file::save(&args.output, scene, mesh, solve_options, solution)?)
    })?;
    let text = report::terminal::solve_summary(&report);
    let mut warnings = report.warnings;
    warnings.extend(plan::finish_pass_1(&options));
    Ok(Outcome { text, warnings, ..Outcome::default() })
}

/// Pass 1 as the flags of `solve` want it.
fn solve_plan(args: &SolveArgs, pass_1: PassOne, caster: String) -> SolvePlan {
    let plan = match pass_1 {
        PassOne::Planned(plan) => *plan,
        PassOne::Solve(options) => SolvePlan::new(options),
        PassOne::Load(_) => unreachable!("solve has no --solution"),
    };
    let max_shots = args.max_shots.map_or(plan.options.max_shots, |n| n as usize);
    let options = SolveOptions { unshot_share: args.unshot, max_shots, ..plan.options };
    SolvePlan {
        options,
        exact: args.exact,
        continue_from: args.continue_from.clone(),
        rows: args.rows.clone(),
        caster,
        ..plan
    }
}

fn document(solved: &Solved, options: &FrameOptions) -> SolveReport {
    SolveReport {
        schema: SolveReport::SCHEMA,
        scene: SceneFacts::new(&solved.scene, &solved.mesh),
        caster: solved.caster,
        pass_1: PassOneReport::new(
            &solved.solution,
            solved.solve_options,
            loaded_from(&options.pass_1),
            summarise(&solved.scene, &solved.mesh, &solved.solution),
        )
        .refined(solved.refinement.clone()),
        rays_by_kind: report::kinds::by_kind(&solved.meter),
        board: board_report(options, solved.board.as_ref(), &solved.links),
        timings: clocked(&solved.timings, &solved.meter, solved.caster),
        warnings: solved.warnings.clone(),
    }
}
