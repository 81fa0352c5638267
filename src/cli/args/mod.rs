//! The command line as typed, one file a group of subcommands. What it means is worked out in `plan.rs`.

use clap::{Parser, Subcommand};

mod common;
mod direct;
#[cfg(feature = "explore")]
mod explore;
mod false_colour;
mod film;
mod keep;
mod make;
mod path;
mod probe;
mod render;
mod show;
mod simulate;
mod verify;

pub use common::{CastArgs, CasterArg, FormFactorsArg, KernelArg, PassOneArgs, PictureArgs, SwitchArg};
#[cfg(feature = "explore")]
pub use explore::{ExploreArgs, StrategyArg};
pub use false_colour::{ColourMapArg, FalseColourArg, Range, ScaleArgs, ScaleKindArg};
pub use film::{FilmArgs, FilterArg, QualityArg, SamplesArg};
pub use keep::CheckpointArgs;
pub use make::{ExperimentArgs, GenerateArgs, KindArg};
pub use path::{PathArgs, TransportArg};
pub use probe::{ProbeArgs, ProbeMethodArg};
pub use render::{GradientsArg, MethodArg, ReconstructArg, RenderArgs, SolveArgs, TwistsArg};
pub use show::{CompareArgs, InfoArgs};
pub use simulate::{SimulateArgs, TraceArgs, WorkloadArg};
pub use verify::VerifyArgs;

use common::whole;

/// Most threads of the host.
const MAX_THREADS: i64 = 1024;

/// A two-pass radiosity renderer whose rays are cast in software or by an emulated board of 1990-92.
#[derive(Debug, Parser)]
#[command(
    name = "radeng",
    version,
    after_help = "Examples:
  radeng render scenes/cornell-box/scene.toml --caster board
  radeng simulate scenes/cornell-box/scene.toml --workload primary --report r.json
  radeng simulate scenes/cornell-box/scene.toml --trace run.radlog && radeng trace run.radlog --pixel 128,200
  radeng verify scenes/cornell-box/scene.toml --rays 200000
  radeng info delft-1992
  radeng explore scenes/spaces/pipeline-depth.toml -o out

Lengths are in metres, radiometric quantities in W/m^2 per linear RGB channel.
Numbers go to stdout, progress and warnings to stderr.
Exit status: 0 fine, 1 a check failed (verify, simulate of vectors, compare), 2 a bad input, named."
)]
pub struct CommandLine {
    /// Threads of the host [default: one a processor]; results do not depend on it
    #[arg(long, global = true, value_name = "N", allow_negative_numbers = true, value_parser = whole(MAX_THREADS))]
    pub threads: Option<u32>,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a picture of a scene: radiosity solution, then the view of its camera
    Render(RenderArgs),
    /// Solve the radiosity of a scene (pass 1 only) and keep the solution in a file
    Solve(SolveArgs),
    /// Measure irradiance and illuminance at points of a scene; runs pass 1 first unless --solution is given
    Probe(ProbeArgs),
    /// Drive the emulated board with a workload and account for its cycles
    Simulate(SimulateArgs),
    /// Look again, without simulating, at a run that `simulate --trace` recorded
    Trace(TraceArgs),
    /// Check the board bit for bit against a floating-point oracle, and measure it against software
    Verify(VerifyArgs),
    /// Compare two EXR pictures, or two reports of runs on the board: what differs, and by how much
    Compare(CompareArgs),
    /// Show a scene or a board, resolved, with sizes and memory
    Info(InfoArgs),
    /// Make a scene file for an experiment: random patches, a furnished room, a two-dimensional world
    Generate(GenerateArgs),
    /// Sweep a design space: which boards are worth building, and why
    #[cfg(feature = "explore")]
    Explore(ExploreArgs),
    /// Ask the board a question: queues, balance, memory, bus, throughput, as a table and a plot
    Experiment(ExperimentArgs),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Exposure;
    use clap::CommandFactory;

    #[test]
    fn command_line_definition_is_consistent() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn command_line_with_negative_coordinates_and_stops_parses() {
        let parse = |args: &[&str]| CommandLine::try_parse_from(args).map(|c| c.command);
        let probe = parse(&["radeng", "probe", "s.toml", "--at", "-1,0,0", "--normal", "0,-1,0"]).unwrap();
        assert!(matches!(probe, Command::Probe(p) if p.at == ["-1,0,0"] && p.normal == ["0,-1,0"]));
        let render = parse(&["radeng", "render", "s.toml", "--exposure", "-2"]).unwrap();
        assert!(matches!(render, Command::Render(r) if r.exposure == Exposure::Ev(-2.0)));
    }

    #[test]
    fn command_line_outside_a_range_is_refused() {
        let cases = [
            ("--samples", "17", "1..=16"),
            ("--samples", "0", "1..=16"),
            ("--width", "0", "1..=32768"),
            ("--height", "-1", "1..=32768"),
            ("--shadow-strata", "9", "1..=8"),
            ("--elements", "-5", "1..=4000000"),
            ("--threads", "0", "1..=1024"),
            ("--threads", "1025", "1..=1024"),
            ("--threads", "-1", "1..=1024"),
            ("--seed", "-1", "0..=18446744073709551615"),
        ];
        for (flag, value, range) in cases {
            let error = CommandLine::try_parse_from(["radeng", "render", "s.toml", flag, value]).unwrap_err();
            let text = error.to_string();
            assert!(text.contains(range) && text.contains(flag) && !text.contains("-- -"), "{text}");
        }
        let largest = ["radeng", "render", "s.toml", "--seed", "18446744073709551615", "--threads", "1024"];
        assert!(CommandLine::try_parse_from(largest).is_ok());
    }
}
