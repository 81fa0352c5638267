//! The JSON reports, one struct a subcommand; field names are the contract (`"schema": "radeng/<name>/1"`).
//!
//! ```text
//! Scene, Mesh, Solution, Timings, board statistics --> SceneFacts, SolveFacts, BoardReport --> one report
//! ```
//! Whatever a result depends on (scene path, resolved options and board) is written in, so that it can be made
//! again.

use std::path::PathBuf;

use glam::DVec3;
use rtl_model::fixed::Formats;
use serde::Serialize;

use super::{BoardReport, KindReport, ObservedReport, RecordedReport, ScaledPicture, Timings};
use crate::image::{Difference, MachBands, ResolvedExposure};
use crate::mesh::Mesh;
use crate::radiosity::refine::RefineReport;
use crate::radiosity::summary::{SurfaceSummary, Totals, totals};
use crate::radiosity::{
    EarlierWork, EnergyAccount, ErrorEstimate, ReciprocityError, RowSumError, Solution, SolveOptions,
};
use crate::raycast::board::WarmUp;
use crate::render::path::PathOptions;
use crate::render::{DirectCounts, RenderOptions};
use crate::scene::Scene;
use crate::units::{Irradiance, Rgb};
use crate::vectors::{Check, Vectors};

/// Size of a scene and its mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneFacts {
    /// The scene file.
    pub path: PathBuf,
    /// Surfaces.
    pub n_surfaces: usize,
    /// Materials.
    pub n_materials: usize,
    /// Lights without area.
    pub n_lights: usize,
    /// Elements, all sides.
    pub n_elements: usize,
    /// Mesh vertices.
    pub n_vertices: usize,
    /// Patches, all sides.
    pub n_patches: usize,
    /// Patches that casters know.
    pub n_cast_patches: usize,
    /// Edges with a hanging vertex.
    pub n_t_junctions: usize,
}

impl SceneFacts {
    /// The facts of a scene and its mesh.
    pub fn new(scene: &Scene, mesh: &Mesh) -> SceneFacts {
        SceneFacts {
            path: scene.path.clone(),
            n_surfaces: scene.surfaces.len(),
            n_materials: scene.materials.len(),
            n_lights: scene.lights.len(),
            n_elements: mesh.elements.len(),
            n_vertices: mesh.vertices.len(),
            n_patches: mesh.patches.len(),
            n_cast_patches: mesh.n_cast_patches,
            n_t_junctions: mesh.n_t_junctions,
        }
    }
}

/// What pass 1 found, at the top level of `solve` and `render` reports.
#[derive(Clone, Debug, Serialize)]
pub struct PassOneReport {
    /// How the solution came to be.
    pub pass_1: PassOneFacts,
    /// How the mesh was refined, where it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refinement: Option<RefineReport>,
    /// Where the power went (W).
    pub account: EnergyAccount,
    /// Row-sum error of the form factors, before any correction.
    pub row_sum_error: RowSumError,
    /// How far A_i F_ij is from A_j F_ji.
    pub reciprocity: ReciprocityError,
    /// Per surface, in file order.
    pub surfaces: Vec<SurfaceSummary>,
    /// Sums over the surfaces.
    pub totals: Totals,
}

/// How a solution came to be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassOneFacts {
    /// Options, of this run or of the one that wrote the file.
    pub options: SolveOptions,
    /// The file that it was read from, when it was not computed.
    pub loaded_from: Option<PathBuf>,
    /// Shots taken.
    pub n_shots: usize,
    /// Patches that shot.
    pub n_shooters: usize,
    /// Visibility rays cast.
    pub n_rays: u64,
    /// By a dense linear solve.
    pub exact: bool,
    /// The solves before, when it went on from a solution in another light.
    pub earlier: Option<EarlierWork>,
    /// How good stochastic shooting is; none when all power was shot by kernel.
    pub error_estimate: Option<ErrorEstimate>,
}

impl PassOneReport {
    /// The report of a solution that was computed with `options`, now or before it was read from `loaded_from`.
    pub fn new(
        solution: &Solution,
        options: SolveOptions,
        loaded_from: Option<PathBuf>,
        surfaces: Vec<SurfaceSummary>,
    ) -> PassOneReport {
        PassOneReport {
            pass_1: PassOneFacts {
                options,
                loaded_from,
                n_shots: solution.n_shots,
                n_shooters: solution.n_shooters,
                n_rays: solution.n_rays,
                exact: solution.exact,
                earlier: solution.earlier,
                error_estimate: solution.error_estimate.clone(),
            },
            refinement: None,
            account: solution.account,
            row_sum_error: solution.row_sum_error,
            reciprocity: solution.reciprocity,
            totals: totals(&surfaces),
            surfaces,
        }
    }

    /// The same of a refined mesh.
    pub fn refined(self, refinement: Option<RefineReport>) -> PassOneReport {
        PassOneReport { refinement, ..self }
    }
}

/// A picture file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureFact {
    /// Where.
    pub path: PathBuf,
    /// Its exposure; linear files have none.
    pub exposure: Option<ResolvedExposure>,
}

/// Camera rays that first met the black back of a surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BackHits {
    /// The surface.
    pub surface: String,
    /// Rays.
    pub rays: u64,
}

/// `render --report`.
#[derive(Clone, Debug, Serialize)]
pub struct RenderReport {
    /// [`RenderReport::SCHEMA`].
    pub schema: &'static str,
    /// The scene.
    pub scene: SceneFacts,
    /// Which caster answered the rays.
    pub caster: &'static str,
    /// Options of pass 2.
    pub options: RenderOptions,
    /// Files written.
    pub pictures: Vec<PictureFact>,
    /// Ambient irradiance that was added to the stored light for the picture (W/m^2), in no account; null when none was.
    pub ambient_w_m2: Option<Rgb>,
    /// False-colour pictures written.
    pub false_colour: Vec<ScaledPicture>,
    /// Mean luminance of the picture (W/m^2/sr).
    pub mean_luminance_w_m2_sr: f64,
    /// The same as the eye takes it (cd/m^2).
    pub mean_luminance_cd_m2: f64,
    /// Camera rays.
    pub n_camera_rays: u64,
    /// Which sources were stored and sampled, and what shadow rays that took.
    pub direct: Option<DirectCounts>,
    /// The same a pixel shown, mean.
    pub mean_rays_per_pixel: f64,
    /// Pixels that the filter's lobes made negative and that were made 0.
    pub negative_pixels: u64,
    /// What was done of the picture, when it was stopped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partial: Option<PartialReport>,
    /// What `--quality` meant, when it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quality: Option<QualityReport>,
    /// Rays by what they were cast for.
    pub rays_by_kind: Vec<KindReport>,
    /// Vertices whose derivatives the limiter of the reconstruction made smaller; 0 for methods without one.
    pub limited_vertices: usize,
    /// Pixels in which reconstructed light came out negative somewhere and was made 0.
    pub clamped_pixels: u64,
    /// Camera rays that first met a back, for each surface with any.
    pub back_hits: Vec<BackHits>,
    /// Of `path`: share of the light that came by paths that the two-pass method does not model; in the picture with full
    /// transport, dropped with that of two-pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_not_two_pass: Option<f64>,
    /// Pass 1, where the method needs one.
    #[serde(flatten)]
    pub pass_1: Option<PassOneReport>,
    /// The board's work, when a board was emulated.
    pub board: Option<BoardReport>,
    /// Wall times.
    pub timings: Timings,
    /// Warnings, as shown.
    pub warnings: Vec<String>,
}

impl RenderReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/render/1";
}

/// A picture that was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PartialReport {
    /// Share of pass 2 that was done.
    pub done: f64,
    /// Pixels without a ray: black.
    pub unrendered_pixels: u64,
}

/// What one knob meant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct QualityReport {
    /// `draft`, `normal` or `high`.
    pub name: &'static str,
    /// Wanted elements; none where the scene's file or a solution's says.
    pub elements: Option<u32>,
    /// Camera rays of every pixel.
    pub samples: u32,
    /// Most camera rays of a pixel.
    pub max_samples: u32,
    /// Difference of tones that calls for more than `samples`; none where all pixels have as many.
    pub contrast: Option<f64>,
    /// Shadow rays: n x n strata at most.
    pub shadow_strata: u32,
    /// Share of the light at a point that they may leave in doubt.
    pub shadow_error: f64,
}

/// `solve --report`.
#[derive(Clone, Debug, Serialize)]
pub struct SolveReport {
    /// [`SolveReport::SCHEMA`].
    pub schema: &'static str,
    /// The scene.
    pub scene: SceneFacts,
    /// Which caster answered the rays.
    pub caster: &'static str,
    /// Pass 1.
    #[serde(flatten)]
    pub pass_1: PassOneReport,
    /// Rays by what they were cast for.
    pub rays_by_kind: Vec<KindReport>,
    /// The board's work, when a board was emulated.
    pub board: Option<BoardReport>,
    /// Wall times.
    pub timings: Timings,
    /// Warnings, as shown.
    pub warnings: Vec<String>,
}

impl SolveReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/solve/1";
}

/// `simulate --report`.
#[derive(Clone, Debug, Serialize)]
pub struct SimulateReport {
    /// [`SimulateReport::SCHEMA`].
    pub schema: &'static str,
    /// The scene; none for test vectors.
    pub scene: Option<SceneFacts>,
    /// What was traced: `primary`, `radiosity`, `shadow`, `all`, `rays` or `vectors`.
    pub workload: &'static str,
    /// The file with explicit rays or test vectors.
    pub rays_file: Option<PathBuf>,
    /// What became of the test vectors' expectations.
    pub vectors: Option<VectorsReport>,
    /// What was left out of all counts, when it was asked for.
    pub warm_up: Option<WarmUpReport>,
    /// Options of the picture whose rays these are; none for test vectors.
    pub options: Option<RenderOptions>,
    /// Options of pass 1; none for test vectors.
    pub solve_options: Option<SolveOptions>,
    /// The board's work.
    #[serde(flatten)]
    pub board: BoardReport,
    /// What was seen inside the run, where it was looked at.
    pub observed: Option<ObservedReport>,
    /// How it was run, when not simply from its rays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded: Option<RecordedReport>,
    /// Wall times of the emulation.
    pub timings: Timings,
    /// Warnings, as shown.
    pub warnings: Vec<String>,
}

impl SimulateReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/simulate/1";
}

/// The commands before the counting: whole ones, from the first on, until the wanted cycles were over. Caches, open DRAM
/// rows and masks keep what these left; all that is counted begins after the last of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct WarmUpReport {
    /// Cycles that were asked for.
    pub asked_cycles: u64,
    /// Cycles left out: up to the end of the command in which the asked ones were over.
    pub cycles: u64,
    /// Commands left out.
    pub commands: u64,
    /// Rays left out.
    pub rays: u64,
    /// Tests left out.
    pub tests: u64,
}

impl WarmUpReport {
    /// The report of a warm-up.
    pub fn new(warm_up: &WarmUp) -> WarmUpReport {
        let excluded = &warm_up.excluded;
        WarmUpReport {
            asked_cycles: warm_up.asked_cycles,
            cycles: excluded.cycles,
            commands: excluded.commands,
            rays: excluded.canonical.rays,
            tests: excluded.canonical.tests,
        }
    }
}

/// How many of a file's expectations hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VectorsReport {
    /// Number formats of the file, which the board takes.
    pub formats: Formats,
    /// Patches.
    pub n_patches: usize,
    /// Rays run.
    pub n_rays: u64,
    /// Rays of which the file expects an answer.
    pub n_expected: u64,
    /// Rays on which file, clocked board, functional model and oracle do not all agree.
    pub n_rays_wrong: u64,
    /// Single tests run.
    pub n_tests: u64,
    /// Tests on which file, datapath and oracle do not all agree.
    pub n_tests_wrong: u64,
    /// Nothing is wrong.
    pub passed: bool,
}

impl VectorsReport {
    /// The report of a check of `vectors`.
    pub fn new(vectors: &Vectors, check: &Check) -> VectorsReport {
        VectorsReport {
            formats: vectors.formats,
            n_patches: vectors.patches.len(),
            n_rays: check.n_rays,
            n_expected: check.n_expected,
            n_rays_wrong: check.n_rays_wrong,
            n_tests: check.n_tests,
            n_tests_wrong: check.n_tests_wrong,
            passed: check.passed(),
        }
    }
}

/// One probed point, as in `probe --json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProbedPoint {
    /// Where (m).
    pub at: DVec3,
    /// Unit normal of the receiver.
    pub normal: DVec3,
    /// Irradiance (W/m^2).
    pub irradiance_w_m2: Rgb,
    /// Illuminance (lx).
    pub illuminance_lx: f64,
    /// Standard error of the irradiance (W/m^2), where it was found by chance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub standard_error_w_m2: Option<Rgb>,
}

impl ProbedPoint {
    /// A point with its irradiance.
    pub fn new(at: DVec3, normal: DVec3, irradiance: Irradiance) -> ProbedPoint {
        ProbedPoint {
            at,
            normal,
            irradiance_w_m2: irradiance.0,
            illuminance_lx: irradiance.illuminance_lx(),
            standard_error_w_m2: None,
        }
    }

    /// The same, found by chance.
    pub fn with_standard_error(self, error: Option<Rgb>) -> ProbedPoint {
        ProbedPoint { standard_error_w_m2: error, ..self }
    }
}

/// `probe --report`.
#[derive(Clone, Debug, Serialize)]
pub struct ProbeReport {
    /// [`ProbeReport::SCHEMA`].
    pub schema: &'static str,
    /// The scene.
    pub scene: SceneFacts,
    /// Which caster answered the rays.
    pub caster: &'static str,
    /// True when the values are those stored on the mesh, not integrated at the points.
    pub interpolated: bool,
    /// How paths were traced, when the points were probed by path tracing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_paths: Option<PathOptions>,
    /// The points in the order in which they were asked for.
    pub points: Vec<ProbedPoint>,
    /// Rays by what they were cast for.
    pub rays_by_kind: Vec<KindReport>,
    /// Wall times.
    pub timings: Timings,
}

impl ProbeReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/probe/1";
}

/// `compare --report`.
#[derive(Clone, Debug, Serialize)]
pub struct CompareReport {
    /// [`CompareReport::SCHEMA`].
    pub schema: &'static str,
    /// The reference.
    pub a: PathBuf,
    /// What is compared with it.
    pub b: PathBuf,
    /// The difference.
    #[serde(flatten)]
    pub difference: Difference,
    /// Second differences; `null` for pictures without an inner pixel and for a dark reference.
    pub mach_bands: Option<MachBands>,
    /// Magnitude of a second difference that the map shows white or black, when one was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_scale: Option<f64>,
    /// False when a threshold was given and a pixel exceeds it.
    pub passed: bool,
}

impl CompareReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/compare/1";
}
