//! `radeng verify` as typed.

use std::path::PathBuf;

use clap::Args;
use clap::builder::RangedI64ValueParser;

use super::common::{PassOneArgs, PictureArgs, from_zero, seed, whole};
use crate::cli::plan::DEFAULT_BOARD;
use crate::scene::MAX_ELEMENTS;

/// Most rays of a verification.
const MAX_RAYS: i64 = 100_000_000;

/// `radeng verify`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng verify scenes/cornell-box/scene.toml --board delft-1992
  radeng verify scene.toml --rays 100000 --no-image --report r.json
  radeng verify scene.toml --sweep coord_frac_bits=8..28 --rays 100000 --plot widths.svg
  radeng verify scene.toml --sweep frac_bits=8..28:4 --first-test 6,8,10
  radeng verify scene.toml --vectors out.csv && radeng simulate --rays out.csv

The rays of both passes (camera, form factors, shadows, specular) are cast in software, and a share of each \
    kind goes through board and oracle: every answer, and every wire of a sample of tests, must be equal bit for \
    bit. On the first difference the exit status is 1, all wires are printed side by side, and the case is \
    written as test vectors with the command that replays it.

What differs from the software caster, which rounds nothing, is measured: misclassified rays by cause, error of \
    t, unused bits of each wire, error of the picture, and what a first test of fewer bits would save.")]
pub struct VerifyArgs {
    /// The scene file (TOML), or a model file (.obj, .gltf, .glb)
    pub scene: PathBuf,
    /// Board to verify: a preset (delft-1992, minimal) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_BOARD)]
    pub board: String,
    /// Rays to verify, in equal shares of each kind as far as the scene casts them
    #[arg(long, value_name = "N", default_value_t = 1_000_000, allow_negative_numbers = true, value_parser = whole(MAX_RAYS))]
    pub rays: u32,
    /// Of these, rays that also go through the clocked board
    #[arg(long, value_name = "N", default_value_t = 20_000, allow_negative_numbers = true, value_parser = from_zero(MAX_RAYS))]
    pub clocked: u32,
    /// Widths of the dual-precision first test to try (bits, 4 to 24)
    #[arg(
        long,
        value_name = "BITS,...",
        default_value = "6,8,10,12,16",
        value_delimiter = ',',
        allow_negative_numbers = true,
        value_parser = RangedI64ValueParser::<u32>::new().range(4..=24)
    )]
    pub first_test: Vec<u32>,
    /// Do not render and compare pictures
    #[arg(long)]
    pub no_image: bool,
    /// Compare pictures in a sweep too
    #[arg(long, requires = "sweep", conflicts_with = "no_image")]
    pub image: bool,
    /// Verify once for each value of a word length and print the table by width: coord_frac_bits, dir_frac_bits,
    /// t_frac_bits, cross_keep_bits, or frac_bits (the first three together)
    #[arg(long, value_name = "NAME=FROM..TO[:STEP]")]
    pub sweep: Option<String>,
    /// Plot the sweep
    #[arg(long, value_name = "FILE.svg", requires = "sweep")]
    pub plot: Option<PathBuf>,
    /// Write test vectors: all patches, some of the rays with the oracle's answers, some tests with all wires
    #[arg(long, value_name = "FILE.csv|FILE.rvec", conflicts_with = "sweep")]
    pub vectors: Option<PathBuf>,
    /// Rays in the test vectors
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "vectors", allow_negative_numbers = true, value_parser = whole(crate::vectors::MAX_SAMPLE as i64))]
    pub vector_rays: u32,
    /// Where the first mismatch goes as test vectors, written only when there is one
    /// [default: radeng-mismatch.csv]
    #[arg(long, value_name = "FILE.csv|FILE.rvec")]
    pub mismatch: Option<PathBuf>,
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
    /// Write a JSON report (radeng/verify/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}
