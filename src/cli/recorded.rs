//! `radeng simulate --record | --replay | --sample`: the workload run whole, from its record, or in part.
//!
//! ```text
//! arguments --frame: simulate_scene | record_scene | replay_scene | sample_scene--> what the board counted, RecordedReport
//!                                        `--w.radtrace, staged with the other files
//! ```

use std::path::Path;

use super::CliError;
use super::args::SimulateArgs;
use crate::frame::{self, Progress, SimulateOptions, Simulated, Simulation};
use crate::image::OutputFiles;
use crate::raycast::board::CommandSink;
use crate::recorded;
use crate::report::RecordedReport;

/// Runs a workload as the flags ask.
pub(super) fn simulate(
    args: &SimulateArgs,
    scene: &Path,
    options: &SimulateOptions,
    files: &mut OutputFiles,
    watch: Option<&mut dyn CommandSink>,
    show: &mut dyn FnMut(Progress),
) -> Result<(Simulated, Option<RecordedReport>), CliError> {
    let SimulateOptions { elements, board, workload, solve, picture, .. } = options;
    let simulation = &Simulation { scene, elements: *elements, board, workload, solve, picture };
    if let Some(path) = &args.record {
        let (run, record) = frame::record_scene(simulation, show)?;
        let bytes = recorded::to_bytes(&record);
        let report = RecordedReport::recorded(path, &record, bytes.len());
        files.stage(path, bytes);
        return Ok((run, Some(report)));
    }
    if let Some(path) = &args.replay {
        let (run, record) = frame::replay_scene(simulation, path, show)?;
        return Ok((run, Some(RecordedReport::replayed(path, &record))));
    }
    if let Some(share) = args.sample {
        let (run, estimate) = frame::sample_scene(simulation, share, args.seed, show)?;
        return Ok((run, Some(RecordedReport::Sampled(estimate))));
    }
    Ok((frame::simulate_scene(scene, options, watch, show)?, None))
}

/// The flags of this file that were given: they have no use without a scene.
pub(super) fn given(args: &SimulateArgs) -> Vec<&'static str> {
    ["record", "replay", "sample"].into_iter().filter(|id| args.given.has(id)).collect()
}
