//! `radeng render` and `radeng solve` as typed.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::common::{CastArgs, PictureArgs, from_zero};
use super::false_colour::{FalseColourArg, ScaleArgs, false_colour};
use super::film::FilmArgs;
use super::path::PathArgs;
use crate::cli::given::Given;
use crate::image::Exposure;
use crate::image::exposure::ExposureError;

/// Reconstruction of the stored irradiance between mesh vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReconstructArg {
    /// The element's mean
    Constant,
    /// Bilinear between the vertices
    Bilinear,
    /// Quadratics on triangles of twelve parts (Powell-Sabin); quads as two triangles
    Quadratic,
    /// Cubics on triangles of three parts (Clough-Tocher); quads as two triangles
    CubicTriangle,
    /// Bicubic Hermite on quads, cubics on triangles: no Mach bands at element edges
    Hermite,
    /// The same, limited at kinks so that it does not overshoot them
    HermiteLimited,
}

/// Gradients at the vertices, for the methods from `quadratic` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GradientsArg {
    /// The mean of the edges' normals, as the 1992 paper says: half the gradient, and not the same in other units
    SeedEdgeNormals,
    /// The mean of the facets' normals
    FacetNormals,
    /// A quadratic fitted to the vertices around
    LeastSquares,
    /// None: flat at every vertex
    Zero,
}

/// Twists of bicubic patches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TwistsArg {
    /// No second derivatives
    Zero,
    /// From the gradients around (Adini)
    Adini,
    /// From the quadratic fitted to the vertices around
    Fit,
}

/// Which light a picture shows stored, which sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// Lamps that matter by shadow rays, all other light stored
    TwoPass,
    /// All light stored by pass 1
    FullRadiosity,
    /// Direct light by shadow rays, a constant ambient term for the rest; no pass 1
    Whitted,
    /// Path tracing, unbiased; no pass 1
    Path,
}

fn exposure(text: &str) -> Result<Exposure, ExposureError> {
    text.parse()
}

/// `radeng render`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng render scenes/cornell-box/scene.toml --caster board
  radeng render scene.toml --width 512 --height 512 --samples 1..16 -o view.png -o view.exr
  radeng render scene.toml --quality draft --width 1024 --height 1024 --region 400,300,200,200 -o detail.png
  radeng render scene.toml --solution scene.radsol --exposure 1.5 -o brighter.png
  radeng render scene.toml --false-colour illuminance=lux.png --scale 0,500
  radeng render scene.toml -o view.png --false-colour luminance --scale-kind log
  radeng render scene.toml --solution scene.radsol --reconstruct bilinear -o bands.png
  radeng render scene.toml --method path --paths 256 -o reference.exr
  radeng render model.glb -o model.png

A model file without a camera gets one that frames it, one without light gets light; both are told.")]
pub struct RenderArgs {
    /// What was typed: it wins over --quality, and some methods have no use for some flags.
    #[command(flatten)]
    pub given: Given,
    /// The scene file (TOML), or a model file (.obj, .gltf, .glb)
    pub scene: PathBuf,
    /// Picture to write, by extension: .exr or .hdr (linear, W/m^2/sr) or .png (sRGB); may be given several times
    /// [default: the scene's name, as .png and .exr, in the current directory]
    #[arg(short, long = "output", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// How rays are cast.
    #[command(flatten)]
    pub cast: CastArgs,
    /// The picture.
    #[command(flatten)]
    pub picture: PictureArgs,
    /// How its rays become pixels.
    #[command(flatten)]
    pub film: FilmArgs,
    /// Which light is stored, which is sampled
    #[arg(long, value_enum, value_name = "METHOD", default_value = "two-pass")]
    pub method: MethodArg,
    /// Path tracing.
    #[command(flatten)]
    pub path: PathArgs,
    /// Reconstruction of the stored light between mesh vertices
    #[arg(
        long,
        value_enum,
        value_name = "METHOD",
        default_value = "hermite",
        help_heading = "Reconstruction"
    )]
    pub reconstruct: ReconstructArg,
    /// Gradients at the vertices, of quadratic and the methods after it [default: least-squares]
    #[arg(long, value_enum, value_name = "RULE", help_heading = "Reconstruction")]
    pub gradients: Option<GradientsArg>,
    /// Twists of the bicubic patches of hermite and hermite-limited [default: fit]
    #[arg(long, value_enum, value_name = "RULE", help_heading = "Reconstruction")]
    pub twists: Option<TwistsArg>,
    /// Exposure of .png files: 'auto', or stops (display-linear = radiance x 2^EV)
    #[arg(long, value_name = "auto|EV", default_value = "auto", value_parser = exposure, allow_hyphen_values = true)]
    pub exposure: Exposure,
    /// Also write, or without -o only, a picture of the luminance that is seen (cd/m^2) or of the illuminance on the
    /// surfaces that are seen first (lx) or of the number of sources that two-pass samples there, in the colours of a scale that
    /// stands beside it; may be given several times
    /// [default name: the scene's with the quantity's behind it, .png]
    #[arg(long, value_name = "luminance|illuminance|sources[=FILE.png]", value_parser = false_colour, help_heading = "False colour")]
    pub false_colour: Vec<FalseColourArg>,
    /// Its scale.
    #[command(flatten)]
    pub scale: ScaleArgs,
    /// Use this solution, as `solve` wrote it for the same scene and mesh, instead of pass 1
    #[arg(long, value_name = "FILE.radsol")]
    pub solution: Option<PathBuf>,
    /// Add the ambient term to the stored light: an estimate of what pass 1 left unshot, for pictures of unfinished
    /// solutions; the energy account is not touched
    #[arg(long)]
    pub ambient: bool,
    /// Write a JSON report (radeng/render/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

/// `radeng solve`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng solve scenes/furnace/scene.toml -o furnace.radsol --report furnace.json
  radeng render scenes/furnace/scene.toml --solution furnace.radsol
  radeng solve big.toml -o big.radsol --checkpoint big.state     killed or stopped by Ctrl-C, the same command goes on
  radeng solve dimmed.toml -o dimmed.radsol --continue-from scene.radsol
  radeng solve scene.toml -o scene.radsol --rows scene.radrow    the next solve of these surfaces, painted otherwise, is quick
  radeng solve scene.toml -o early.radsol --max-shots 50 && radeng render scene.toml --solution early.radsol --ambient
  radeng solve scene.toml -o exact.radsol --elements 2000 --exact")]
pub struct SolveArgs {
    /// The scene file (TOML), or a model file (.obj, .gltf, .glb)
    pub scene: PathBuf,
    /// Solution file to write
    #[arg(short, long = "output", value_name = "FILE.radsol")]
    pub output: PathBuf,
    /// How rays are cast.
    #[command(flatten)]
    pub cast: CastArgs,
    /// Stop when the unshot power is under this share of the emitted power
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, default_value_t = crate::radiosity::SolveOptions::default().unshot_share)]
    pub unshot: f64,
    /// Stop after this many shots, converged or not
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = from_zero(1_000_000_000), conflicts_with = "exact")]
    pub max_shots: Option<u32>,
    /// Go on from a solution of the same geometry and mesh whose emission, reflectances or lights were others: only the
    /// change is shot. Sampling is as it was for that solution
    #[arg(long, value_name = "FILE.radsol", conflicts_with_all = ["exact", "seed", "dense_visibility", "kernel", "form_factors", "max_shooters", "wanted_error"])]
    pub continue_from: Option<PathBuf>,
    /// Keep the form factors in this file, and cast no rays for those that it has: solves of the same mesh with other
    /// emission, reflectances or lights then take a part of the time. Same result
    #[arg(long, value_name = "FILE.radrow", conflicts_with = "exact")]
    pub rows: Option<PathBuf>,
    /// Solve the radiosity equation of the patches by a dense linear solve, as a check of progressive refinement; at most
    /// 5000 patches (0.6 GB of matrices, and 4 bytes for every form factor that is not 0)
    #[arg(long, conflicts_with_all = ["checkpoint", "unshot", "form_factors", "max_shooters", "wanted_error"])]
    pub exact: bool,
    /// Write a JSON report (radeng/solve/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}
