//! `radeng simulate` and `radeng trace` as typed.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::common::{PassOneArgs, PictureArgs, seed, share, whole};
use crate::cli::given::Given;
use crate::cli::look::LookArgs;
use crate::cli::plan::DEFAULT_BOARD;
use crate::scene::MAX_ELEMENTS;

/// Which rays drive the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WorkloadArg {
    /// Camera rays of one picture; needs no pass 1
    Primary,
    /// Pass 1: the visibility of the form factors
    Radiosity,
    /// Pass 2's shadow rays; all else is cast in software
    Shadow,
    /// Every ray of both passes
    All,
}

/// `radeng simulate`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng simulate scenes/cornell-box/scene.toml --workload primary --width 256 --height 256
  radeng simulate scene.toml --warm-up 50000 --report warm.json
  radeng simulate scene.toml --board my-board.toml --workload all --report run.json
  radeng simulate scene.toml --record w.radtrace       and then, the same counts faster, on any clusters and caches:
  radeng simulate scene.toml --board my-board.toml --replay w.radtrace
  radeng simulate scene.toml --width 1024 --height 1024 --sample 0.1    a tenth of the commands, and an error bar
  radeng simulate scene.toml --rays rays.csv           rays in metres through a scene
  radeng simulate --rays vectors.csv --board minimal   test vectors: no scene, no renderer
  radeng simulate scene.toml --account --interval 10000            phases of rays, roots of stalls, work over time
  radeng simulate scene.toml --pixel 100,80                        a pixel's rays, cycle by cycle
  radeng simulate scene.toml --trace run.radlog --window 0..50000 --wave run.fst --perfetto run.json

With SCENE a rays file has one ray a line: ox,oy,oz,dx,dy,dz[,t_max], origin in metres, t_max in lengths of \
    the direction. Empty lines and lines that start with # are skipped.

Without SCENE it holds test vectors (.csv or .rvec): patches, rays, expected answers and single tests in the \
    board's words. The board takes the file's number formats and its grid; the clocked board, the functional model and the \
    oracle must agree with each other and with the file: exit status 1 otherwise, with the first wrong answer \
    and all its wires. `radeng verify --vectors` writes such files; their first lines say what each column is.")]
pub struct SimulateArgs {
    /// What was typed: without SCENE some flags have no use.
    #[command(flatten)]
    pub given: Given,
    /// The scene file (TOML); none for test vectors
    #[arg(required_unless_present = "rays")]
    pub scene: Option<PathBuf>,
    /// Board to emulate: a preset (delft-1992, minimal) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_BOARD)]
    pub board: String,
    /// Which rays drive the board [default: primary]
    #[arg(long, value_enum, conflicts_with = "rays")]
    pub workload: Option<WorkloadArg>,
    /// Trace the rays of this file instead of a workload
    #[arg(long, value_name = "FILE")]
    pub rays: Option<PathBuf>,
    /// Wanted number of mesh elements, instead of the scene's `meshing` keys
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(MAX_ELEMENTS.into()))]
    pub elements: Option<u32>,
    /// Seed of every sampling pattern
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = seed)]
    pub seed: u64,
    /// How pass 1 is run.
    #[command(flatten)]
    pub pass_1: PassOneArgs,
    /// The picture whose rays these are.
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Count only what comes after the first command that ends at or after board cycle N: whole commands are left out of
    /// every count and of the queues' histograms, caches and open rows stay as they left them
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub warm_up: Option<u64>,
    /// Print the causes of every block, not of each kind of block
    #[arg(long)]
    pub all_blocks: bool,
    /// Record the board's work: what its cells, lists and tests came to, for --replay
    #[arg(long, value_name = "FILE.radtrace", conflicts_with_all = ["warm_up", "trace", "wave", "perfetto", "account", "interval", "pixel", "ray"])]
    pub record: Option<PathBuf>,
    /// Run the board on recorded work instead of rays: the same cycles and counts, for any clusters, caches, depths,
    /// memory, bus and scheduling. Scene, formats, grid, partition and workload must be those of the record
    #[arg(long, value_name = "FILE.radtrace", conflicts_with_all = ["record", "warm_up", "trace", "wave", "perfetto", "account", "interval", "pixel", "ray"])]
    pub replay: Option<PathBuf>,
    /// Run only this share (over 0, up to 1) of the board's commands, chosen by --seed, and estimate the cycles of all
    /// of them, with a 95 % interval
    #[arg(long, value_name = "SHARE", conflicts_with_all = ["record", "replay", "warm_up", "trace", "wave", "perfetto", "account", "interval", "pixel", "ray"], allow_negative_numbers = true, value_parser = share)]
    pub sample: Option<f64>,
    /// Write a JSON report (radeng/simulate/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Write every event of the run, 8 bytes each, for `radeng trace`
    #[arg(long, value_name = "FILE.radlog", help_heading = "Looking inside")]
    pub trace: Option<PathBuf>,
    /// What is to be seen of the run.
    #[command(flatten)]
    pub look: LookArgs,
}

/// `radeng trace`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng simulate scene.toml --trace run.radlog
  radeng trace run.radlog                                     phases of rays, roots of stalls
  radeng trace run.radlog --window 20000..30000 --wave w.fst --perfetto p.json
  radeng trace run.radlog --pixel 100,80 --report pixel.json  from a pixel to its rays to their cycles

The log knows the picture and what each command was for. Cycles are those in which the board is clocked: the \
    host's side of interrupts is not among them.")]
pub struct TraceArgs {
    /// The event log (.radlog)
    #[arg(value_name = "LOG")]
    pub log: PathBuf,
    /// What is to be seen of the run.
    #[command(flatten)]
    pub look: LookArgs,
    /// Write a JSON report (radeng/trace/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}
