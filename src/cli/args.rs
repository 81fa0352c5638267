//! The command line as typed. What it means is worked out in `plan.rs`.

use std::path::PathBuf;

use clap::builder::RangedI64ValueParser;
use clap::{Args, Parser, Subcommand, ValueEnum};

use super::look::LookArgs;
use crate::image::Exposure;
use crate::image::exposure::ExposureError;
use crate::scene::MAX_ELEMENTS;

/// Widest and highest picture.
const MAX_SIDE: i64 = 32_768;
/// Most threads of the host.
const MAX_THREADS: i64 = 1024;
/// Most rays of a verification.
const MAX_RAYS: i64 = 100_000_000;
/// Largest count of any kind of generated scene; each kind has its own.
const MAX_COUNT: i64 = 100_000;

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
    /// Ask the board a question: queues, balance, memory, bus, throughput, as a table and a plot
    Experiment(ExperimentArgs),
}

/// Who answers the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CasterArg {
    /// The software ray caster, all threads
    Software,
    /// The emulated board, cycle by cycle
    Board,
}

/// Reconstruction of the stored irradiance between mesh vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReconstructArg {
    /// The element's mean
    Constant,
    /// Bilinear between the vertices
    Bilinear,
    /// Bicubic Hermite: no Mach bands at element edges
    Hermite,
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
    /// Seed of every sampling pattern
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = seed)]
    pub seed: u64,
    /// In pass 1, cast a visibility ray from every quadrature point and vertex to every shooter: four times the rays,
    /// less noise in indirect light
    #[arg(long)]
    pub dense_visibility: bool,
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
    /// Camera rays per pixel, 1 to 16
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = whole(16))]
    pub samples: u32,
    /// Shadow rays per point and light surface: N x N, 1 to 8
    #[arg(long, value_name = "N", default_value_t = 4, allow_negative_numbers = true, value_parser = whole(8))]
    pub shadow_strata: u32,
}

/// A whole number from 1 to `max`.
fn whole(max: i64) -> RangedI64ValueParser<u32> {
    RangedI64ValueParser::new().range(1..=max)
}

/// A whole number from 0 to `max`.
fn from_zero(max: i64) -> RangedI64ValueParser<u32> {
    RangedI64ValueParser::new().range(0..=max)
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("expected a whole number in 0..={}", u64::MAX))
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share: &f64| *share > 0.0 && *share <= 1.0);
    share.ok_or_else(|| "expected a number over 0 and up to 1, such as 0.1".to_owned())
}

fn exposure(text: &str) -> Result<Exposure, ExposureError> {
    text.parse()
}

/// `radeng render`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng render scenes/cornell-box/scene.toml --caster board
  radeng render scene.toml --width 512 --height 512 --samples 4 -o view.png -o view.exr
  radeng render scene.toml --solution scene.radsol --exposure 1.5 -o brighter.png")]
pub struct RenderArgs {
    /// The scene file (TOML)
    pub scene: PathBuf,
    /// Picture to write, by extension: .exr (linear, W/m^2/sr) or .png (sRGB); may be given several times
    /// [default: the scene's name, as .png and .exr, in the current directory]
    #[arg(short, long = "output", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// How rays are cast.
    #[command(flatten)]
    pub cast: CastArgs,
    /// The picture.
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Reconstruction of the stored indirect light between mesh vertices
    #[arg(long, value_enum, default_value = "hermite")]
    pub reconstruct: ReconstructArg,
    /// Exposure of .png files: 'auto', or stops (display-linear = radiance x 2^EV)
    #[arg(long, value_name = "auto|EV", default_value = "auto", value_parser = exposure, allow_hyphen_values = true)]
    pub exposure: Exposure,
    /// Use this solution, as `solve` wrote it for the same scene and mesh, instead of pass 1
    #[arg(long, value_name = "FILE.radsol")]
    pub solution: Option<PathBuf>,
    /// Write a JSON report (radeng/render/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

/// `radeng solve`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng solve scenes/furnace/scene.toml -o furnace.radsol --report furnace.json
  radeng render scenes/furnace/scene.toml --solution furnace.radsol")]
pub struct SolveArgs {
    /// The scene file (TOML)
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
    /// Write a JSON report (radeng/solve/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

/// `radeng probe`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng probe scenes/lit-cube/scene.toml --at 0.5,0.5,0 --normal 0,0,1
  radeng probe scene.toml --at 1,2,0 --normal 0,0,1 --at 3,2,0 --normal 0,0,1 --json")]
pub struct ProbeArgs {
    /// The scene file (TOML)
    pub scene: PathBuf,
    /// A point (m); repeat for more, each with its --normal
    #[arg(long, value_name = "X,Y,Z", required = true, allow_hyphen_values = true)]
    pub at: Vec<String>,
    /// The receiver's normal at the point, any length
    #[arg(long, value_name = "X,Y,Z", required = true, allow_hyphen_values = true)]
    pub normal: Vec<String>,
    /// How rays are cast.
    #[command(flatten)]
    pub cast: CastArgs,
    /// The value that pass 1 stored on the surface there, instead of light integrated at the point
    #[arg(long)]
    pub interpolated: bool,
    /// Use this solution, as `solve` wrote it for the same scene and mesh, instead of running pass 1
    #[arg(long, value_name = "FILE.radsol")]
    pub solution: Option<PathBuf>,
    /// Print a JSON list of {at, normal, irradiance_w_m2, illuminance_lx} instead of the table
    #[arg(long)]
    pub json: bool,
    /// Write a JSON report (radeng/probe/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

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
    pub given: super::given::Given,
    /// The scene file (TOML); none for test vectors
    #[arg(required_unless_present = "rays")]
    pub scene: Option<PathBuf>,
    /// Board to emulate: a preset (delft-1992, minimal) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = super::plan::DEFAULT_BOARD)]
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
    /// In pass 1, cast a visibility ray from every quadrature point and vertex to every shooter: four times the rays,
    /// less noise in indirect light
    #[arg(long)]
    pub dense_visibility: bool,
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
    /// The scene file (TOML)
    pub scene: PathBuf,
    /// Board to verify: a preset (delft-1992, minimal) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = super::plan::DEFAULT_BOARD)]
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
    /// In pass 1, cast a visibility ray from every quadrature point and vertex to every shooter
    #[arg(long)]
    pub dense_visibility: bool,
    /// The picture whose rays these are.
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Write a JSON report (radeng/verify/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

/// `radeng compare`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng compare software.exr board.exr
  radeng compare before.exr after.exr --threshold 0.05      exit status 1 when a pixel differs by more than 5 %
  radeng compare before.json after.json                     which counters of two runs on the board changed
  radeng compare before.json after.json --threshold 0       exit status 1 when any counter changed

Pictures: a pixel's difference is that of its worst channel; shares are of A's mean luminance.

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
    /// Write a JSON report (radeng/compare/1, of reports radeng/compare-runs/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

/// `radeng info`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng info scenes/cornell-box/scene.toml
  radeng info delft-1992          every parameter of the board with its source: [S] published, [C] computed, [I] ours")]
pub struct InfoArgs {
    /// A scene file, a board file, or the name of a board preset (delft-1992, minimal)
    pub what: PathBuf,
    /// Wanted number of mesh elements, instead of the scene's `meshing` keys
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(MAX_ELEMENTS.into()))]
    pub elements: Option<u32>,
}

/// What to generate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KindArg {
    /// Two-sided parallelograms of random place, size and orientation in a closed room; up to 100,000
    RandomPatches,
    /// A room with tables, chairs, shelves and cupboards under ceiling lamps; up to 1,000 pieces
    FurnishedRoom,
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
    /// How many patches, pieces of furniture or segments
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

The same command writes the same bytes, but for `amdahl`, which measures wall time.
Exit status 1 when a check that an experiment makes of itself fails.")]
pub struct ExperimentArgs {
    /// Which experiment; `all` of the board; or `validation` of pass 1 against closed forms
    pub name: String,
    /// Folder for plots (.svg) and rows (.csv), made when missing; of `all` and `validation`, the document stands beside
    /// it as DIR.md [default: docs/board, of `validation` docs/validation]
    #[arg(short, long = "output", value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Small scenes and few points
    #[arg(long)]
    pub quick: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
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
