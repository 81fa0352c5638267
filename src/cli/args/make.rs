//! `radeng generate` and `radeng experiment` as typed: scenes and studies.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::common::{seed, whole};

/// Largest count of any kind of generated scene; each kind has its own.
const MAX_COUNT: i64 = 100_000;

/// What to generate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KindArg {
    /// Two-sided parallelograms of random place, size and orientation in a closed room; up to 100,000
    RandomPatches,
    /// A room with tables, chairs, shelves and cupboards under ceiling lamps; up to 1,000 pieces
    FurnishedRoom,
    /// The same room under a lattice of many small ceiling lamps; up to 1,000 lamps
    ManyLamps,
    /// Random segments of the unit square, extruded along z: rays in the middle plane see two dimensions; up to 10,000
    #[value(name = "segments-2d")]
    Segments2d,
}

/// `radeng generate`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng generate random-patches --count 500 -o patches.toml
  radeng generate furnished-room --count 12 --seed 3 -o room.toml && radeng render room.toml
  radeng generate segments-2d --count 100 -o flat.toml --force

Equal kind, count and seed make equal bytes. The file's first lines name the command that makes it again.")]
pub struct GenerateArgs {
    /// What to make
    #[arg(value_enum)]
    pub kind: KindArg,
    /// How many patches, pieces of furniture, lamps or segments
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(MAX_COUNT))]
    pub count: u32,
    /// Seed of everything that is random
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = seed)]
    pub seed: u64,
    /// Scene file to write
    #[arg(short, long = "output", value_name = "FILE.toml")]
    pub output: PathBuf,
    /// Replace the file when there is one
    #[arg(long)]
    pub force: bool,
}

/// `radeng experiment`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng experiment hierarchy                     the table on stdout, docs/board/hierarchy.svg and .csv
  radeng experiment all                           all of them, and docs/board.md: minutes
  radeng experiment all --quick -o /tmp/board     small scenes and few points: seconds

  subdivision   a published intersection chip as the ICU: tests a second
  queueing      Geo/D/1, tandems, Little's identity on the board's FIFOs
  amdahl        the share of ray casting in a software render, and the speed-up that it allows
  shells-2d     1990: patch transfers of shells and of the grid in two dimensions
  balance       1991: the low-resolution partition, its gain and its cost
  hierarchy     1992: hierarchical memory and pseudo-dynamic scheduling
  descriptors   bundle descriptors against explicit rays on the bus
  throughput    rays a second over the board's parameters

and of the host, which `all` leaves out:

  validation      pass 1: view factors, furnaces, energy, the lit cube, CIE 171 against closed forms: docs/validation.md
  adaptive        refined against uniform meshes: elements for the same error: docs/adaptive.md
  reconstruction  methods and gradient rules: errors, Mach bands, overshoot, pictures: docs/reconstruction.md
  two-pass        what source selection, coherence and adaptive shadows save at equal error: docs/two-pass.md

The same command writes the same bytes, but for `amdahl` and the times of `reconstruction`, which measure wall time.
Exit status 1 when a check that an experiment makes of itself fails.")]
pub struct ExperimentArgs {
    /// Which experiment; `all` of the board; or of the host `validation`, `adaptive`,
    /// `reconstruction` or `two-pass`
    pub name: String,
    /// Folder for plots (.svg), rows (.csv) and pictures (.png), made when missing; of `all` and of those of the
    /// host, the document stands beside it as DIR.md [default: docs/board, of the host's docs/NAME]
    #[arg(short, long = "output", value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Small scenes and few points
    #[arg(long)]
    pub quick: bool,
}
