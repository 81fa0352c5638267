//! `radeng compare` and `radeng info` as typed: looking at what is there.

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;
use rtl_model::cost::Technology;

use super::common::whole;
use crate::scene::MAX_ELEMENTS;

/// `radeng compare`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng compare software.exr board.exr
  radeng compare before.exr after.exr --threshold 0.05      exit status 1 when a pixel differs by more than 5 %
  radeng compare right.exr bilinear.exr --bands bands.png   second differences of both: Mach bands are lines in it
  radeng compare before.json after.json                     which counters of two runs on the board changed
  radeng compare before.json after.json --threshold 0       exit status 1 when any counter changed

Pictures: a pixel's difference is that of its worst channel; shares are of A's mean luminance. An eye sees a Mach band \
    where the slope of luminance breaks: `creases` are the second differences of A and of B, `new bands` those of B - A, \
    without the borders of objects, where A has over 1 % of its mean luminance.

Reports: two of simulate, two of render or two of solve, with a board. Canonical work comes first: rays, cells, tests \
    and hits depend on scene, rays, formats, grid, partition and shells alone; where they changed, what of these differs \
    is named.")]
pub struct CompareArgs {
    /// The reference (.exr, or .json)
    pub a: PathBuf,
    /// What is compared with it, of the same kind
    pub b: PathBuf,
    /// Exit with status 1 when a pixel differs by more than this share of A's mean luminance, or a counter by more than
    /// this share of its value in A
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
    /// Write a picture of the second differences of A (left) and B (right), each over its mean luminance: grey where there
    /// is none, white along a bright Mach band, black along a dark one
    #[arg(long, value_name = "FILE.png")]
    pub bands: Option<PathBuf>,
    /// Second difference that --bands shows white or black (share of the mean luminance per square of a pixel) [default:
    /// the 99th percentile of what B adds to A, else of both, borders left out]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, requires = "bands")]
    pub band_scale: Option<f64>,
    /// Write a JSON report (radeng/compare/1, of reports radeng/compare-runs/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

/// `radeng info`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng info scenes/cornell-box/scene.toml
  radeng info delft-1992          every parameter of the board with its source: [S] published, [C] computed, [I] ours
  radeng info delft-1992 --technology ecp5      its costs on an FPGA instead of standard cells (docs/cost-model.md)")]
pub struct InfoArgs {
    /// A scene file, a board file, or the name of a board preset (delft-1992, minimal)
    pub what: PathBuf,
    /// Wanted number of mesh elements, instead of the scene's `meshing` keys
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(MAX_ELEMENTS.into()))]
    pub elements: Option<u32>,
    /// Technology of a board's costs: gates, registers, memory, longest path, area by block [default: osu-0.35um]
    #[arg(long, value_name = "NAME", value_parser = technology())]
    pub technology: Option<String>,
}

/// The names of the technologies that boards are costed in.
fn technology() -> PossibleValuesParser {
    PossibleValuesParser::new(Technology::all().iter().map(|t| t.name))
}
