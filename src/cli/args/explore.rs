//! `radeng explore` as typed.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::common::{seed, share, whole};
use crate::explore::shard::Shard;

/// How candidates are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StrategyArg {
    /// All combinations
    Grid,
    /// A uniform sample without repetition
    Random,
    /// Points of a scrambled Sobol sequence
    Sobol,
    /// All or some on short workloads, the better ones on longer ones
    Halving,
    /// A population that moves toward the front
    Nsga2,
}

/// `radeng explore`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng explore scenes/spaces/pipeline-depth.toml -o out            the sweep; then open out/page.html
  radeng explore space.toml -o out --resume                          go on after Ctrl-C, a kill, or a wider axis
  radeng explore space.toml -o out --strategy nsga2 --points 200     a search instead of the full grid
  radeng explore space.toml -o out --sample 0.1                      a first look: error bars, a tenth of the time
  radeng explore space.toml -o out --prune --check 0.01              leave out what cannot win; prove 1 % of it
  radeng explore space.toml --point 17 --save-board b.toml           one candidate, in full, and its board file
  radeng explore space.toml -o part3 --shard 3/8                     an eighth of it, on this machine
  radeng explore space.toml -o out --merge part1 part2 ...           and all eighths together

-o DIR gets sweep.sqlite (the store, whole at any moment), results.parquet and results.csv (a row a candidate), \
    page.html (everything to look at, one file) and charts/. scenes/spaces/README.md describes space files, docs/explore.md \
    is a tutorial, docs/slurm.md tells how to use many machines.")]
pub struct ExploreArgs {
    /// The design space (TOML)
    pub space: PathBuf,
    /// Folder of the sweep, made if need be
    #[arg(short, long = "output", value_name = "DIR", required_unless_present = "point")]
    pub output: Option<PathBuf>,
    /// Go on with the sweep that is in the folder; nothing that it knows is run again
    #[arg(long)]
    pub resume: bool,
    /// Choose candidates in this way, instead of the space's
    #[arg(long, value_enum)]
    pub strategy: Option<StrategyArg>,
    /// Evaluate at most N candidates (random, sobol, halving, nsga2)
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(10_000_000))]
    pub points: Option<u32>,
    /// Begin nothing after this many minutes; results hold what was done
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = minutes)]
    pub minutes: Option<f64>,
    /// Seed of every choice, instead of the space's
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    pub seed: Option<u64>,
    /// Run only this share (over 0, up to 1) of each workload's commands; cycles get error bars
    #[arg(long, value_name = "SHARE", value_parser = share, conflicts_with_all = ["prune", "check"])]
    pub sample: Option<f64>,
    /// Leave out candidates whose bounds are dominated: none of them can be on the front
    #[arg(long, conflicts_with_all = ["shard", "merge"])]
    pub prune: bool,
    /// Simulate this share of the candidates once more, every ray traced: all counters must be equal; exit status 1 otherwise
    #[arg(long, value_name = "SHARE", value_parser = share, conflicts_with = "shard")]
    pub check: Option<f64>,
    /// Only part I of N; parts are put together by --merge
    #[arg(long, value_name = "I/N", conflicts_with_all = ["merge", "minutes"])]
    pub shard: Option<Shard>,
    /// Put the shards in these folders together: each must be there once, and be finished
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "minutes")]
    pub merge: Vec<PathBuf>,
    /// Simulate one candidate in full, without any store, and show it
    #[arg(long, value_name = "ORDINAL", conflicts_with_all = ["output", "resume", "strategy", "points", "minutes", "seed", "sample", "prune", "check", "shard", "merge"])]
    pub point: Option<u64>,
    /// With --point: write its board file
    #[arg(long, value_name = "FILE.toml", requires = "point")]
    pub save_board: Option<PathBuf>,
}

fn minutes(text: &str) -> Result<f64, String> {
    let minutes = text.parse().ok().filter(|minutes: &f64| *minutes > 0.0 && *minutes <= 1e6);
    minutes.ok_or_else(|| "expected a number over 0 and up to 1000000, such as 2.5".to_owned())
}
