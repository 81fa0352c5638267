//! Options that several subcommands share, and the parsers of their values.

use clap::builder::RangedI64ValueParser;
use clap::{Args, ValueEnum};

use super::direct::DirectArgs;
use super::film::{SamplesArg, samples};
use super::keep::CheckpointArgs;
use crate::scene::MAX_ELEMENTS;

/// Widest and highest picture.
const MAX_SIDE: i64 = 32_768;

/// Who answers the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CasterArg {
    /// The software ray caster, all threads
    Software,
    /// The emulated board, cycle by cycle
    Board,
}

/// How power is shot in pass 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FormFactorsArg {
    /// Exact kernel from each shooter to points of each receiver, times the visible share
    Vertex,
    /// Cosine-distributed bundles of rays from the shooters, emitters too; comes with an error estimate
    Hemisphere,
}

/// Form factor of a point to a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KernelArg {
    /// Lambert's polygon formula, exact
    Polygon,
    /// Wallace's disc form, the patch subdivided until its error is under 0.1 %; for comparison on small scenes: 60 to 400
    /// times slower
    Disc,
}

/// How pass 1 is run.
#[derive(Clone, Debug, Default, Args)]
pub struct PassOneArgs {
    /// In pass 1, cast a visibility ray from every quadrature point and vertex to every shooter: four times the rays,
    /// less noise in indirect light
    #[arg(long)]
    pub dense_visibility: bool,
    /// Kernel of pass 1 [default: polygon]
    #[arg(long, value_enum, value_name = "KERNEL")]
    pub kernel: Option<KernelArg>,
    /// How power is shot in pass 1 [default: vertex]
    #[arg(long, value_enum, value_name = "METHOD")]
    pub form_factors: Option<FormFactorsArg>,
    /// Patches that shoot by kernel in pass 1; of scenes with more, the rest is shot by bundles of rays [default: 2000]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = from_zero(MAX_ELEMENTS.into()))]
    pub max_shooters: Option<u32>,
    /// Standard error of what bundles shoot: RMS over the elements as a share of the mean irradiance [default: 0.02]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = error_share)]
    pub wanted_error: Option<f64>,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SwitchArg {
    /// On
    On,
    /// Off
    Off,
}

/// Options of everything that casts rays.
#[derive(Debug, Args)]
pub struct CastArgs {
    /// Who answers the rays [default: software, or board where --board is given]
    #[arg(long, value_enum)]
    pub caster: Option<CasterArg>,
    /// Board to emulate: a preset (delft-1992, minimal) or a TOML file [default: delft-1992]
    #[arg(long, value_name = "NAME|FILE")]
    pub board: Option<String>,
    /// Wanted number of mesh elements, instead of the scene's `meshing` keys
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(MAX_ELEMENTS.into()))]
    pub elements: Option<u32>,
    /// Refine the mesh where light changes, up to four times the elements, or not, instead of the scene's `meshing` key
    #[arg(long, value_enum, value_name = "on|off", hide_possible_values = true)]
    pub adaptive: Option<SwitchArg>,
    /// Seed of every sampling pattern
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = seed)]
    pub seed: u64,
    /// How pass 1 is run.
    #[command(flatten)]
    pub pass_1: PassOneArgs,
    /// Where its state is kept.
    #[command(flatten)]
    pub keep: CheckpointArgs,
}

/// Size and sampling of a picture.
#[derive(Debug, Args)]
pub struct PictureArgs {
    /// Columns (pixels)
    #[arg(long, value_name = "PIXELS", default_value_t = 256, allow_negative_numbers = true, value_parser = whole(MAX_SIDE))]
    pub width: u32,
    /// Rows (pixels)
    #[arg(long, value_name = "PIXELS", default_value_t = 256, allow_negative_numbers = true, value_parser = whole(MAX_SIDE))]
    pub height: u32,
    /// Camera rays per pixel, 1 to 16; MIN..MAX (render only): more than MIN where contrast and edges want them
    #[arg(long, value_name = "N|MIN..MAX", default_value = "1", allow_hyphen_values = true, value_parser = samples)]
    pub samples: SamplesArg,
    /// Its direct light.
    #[command(flatten)]
    pub direct: DirectArgs,
}

/// A whole number from 1 to `max`.
pub(super) fn whole(max: i64) -> RangedI64ValueParser<u32> {
    RangedI64ValueParser::new().range(1..=max)
}

/// A whole number from 0 to `max`.
pub(super) fn from_zero(max: i64) -> RangedI64ValueParser<u32> {
    RangedI64ValueParser::new().range(0..=max)
}

pub(super) fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("expected a whole number in 0..={}", u64::MAX))
}

pub(super) fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share: &f64| *share > 0.0 && *share <= 1.0);
    share.ok_or_else(|| "expected a number over 0 and up to 1, such as 0.1".to_owned())
}

fn error_share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share: &f64| (1e-4..=1.0).contains(share));
    share.ok_or_else(|| "expected a number from 0.0001 to 1, such as 0.02".to_owned())
}
