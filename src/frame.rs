//! The main path: one function a product, one call an arrow of the flow. Start reading here.
//!
//! ```text
//! render_frame:   Scene::load -> Mesh::build -> caster -> [radiosity::solve] -> render::render -> Frame (film)
//! solve_scene:    Scene::load -> Mesh::build -> caster -> radiosity::solve -> Solved
//! probe_scene:    ... -> radiosity::solve -> radiosity::probe -> Probed
//! probe_by_paths: Scene::load -> Mesh::build -> caster -> render::path::irradiance -> Probed
//! probe_grid:     ... -> Grid -> radiosity::solve -> radiosity::probe_many -> GridProbed
//! simulate_scene: ... -> the rays of a workload through the board -> Simulated
//! verify_scene:   both passes, recorded -> those rays through board, oracle and software -> Verified
//! inspect_scene:  Scene::load -> Mesh::build -> one look through the camera -> Inspected
//! ```
//! Every ray goes through the one port, [`crate::raycast::RayCaster`]. Options and outcomes are typed; nothing here
//! prints or writes a file. Results do not depend on wall time; [`Timings`] only tell it.

use std::path::Path;

use rtl_model::sim::FifoStatistics;
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;

use crate::geom::{DVec3, Ray};
use crate::mesh::Mesh;
use crate::radiosity::refine::RefineReport;
use crate::radiosity::{self, ProbePoint, Solution, SolveOptions, SolveProgress};
use crate::raycast::board::{BoardCaster, CommandSink, WarmUp};
use crate::raycast::metered::Meter;
use crate::raycast::null::NullCaster;
use crate::raycast::quantize::Quantizer;
use crate::raycast::{CastError, Purpose, Query, RayCaster};
use crate::reconstruct::{Method, Reconstruction};
use crate::render::path::PathOptions;
use crate::render::{self, RenderOptions, Rendering};
use crate::report::Timings;
use crate::scene::{Camera, Light, MAX_ELEMENTS, MeshTarget, Scene};
use crate::units::{Irradiance, Rgb};

mod caster;
mod error;
mod grid;
mod pass_one;
mod recorded;
mod verify;
mod warnings;

pub use caster::{Caster, CasterChoice, RoutedCaster};
pub use error::FrameError;
pub use grid::{GridFault, GridOptions, GridPointsHidden, GridProbed, probe_grid};
pub use pass_one::{PassOne, SolvePlan};
use pass_one::{Passed, pass_1, pass_1_refined};
pub use recorded::{
    SharedWork, Simulation, record_scene, replay_scene, sample_scene, share_commands, share_work,
    workload_settings,
};
pub use verify::{Verified, verify_scene};

/// What every product needs.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameOptions {
    /// Wanted elements, instead of the scene file's `[meshing]`.
    pub elements: Option<u32>,
    /// Refine the mesh, or not, instead of the scene file's `[meshing]`.
    pub adaptive: Option<bool>,
    /// Who answers the rays.
    pub caster: CasterChoice,
    /// Pass 1.
    pub pass_1: PassOne,
}

/// How far a run is.
#[derive(Clone, Copy, Debug)]
pub enum Progress {
    /// Pass 1.
    Solve(SolveProgress),
    /// Pass 2, or whatever else has a known end: the share that is done.
    Render(f64),
    /// Points of a grid: the share that is done.
    Probe(f64),
}

/// What the board counted, by purpose of the rays.
pub type StatisticsByPurpose = Vec<(Purpose, BoardStatistics)>;

/// A rendered picture with everything that led to it.
#[derive(Debug)]
pub struct Frame {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// Pass 1, where the method of the picture needs one.
    pub solution: Option<Solution>,
    /// The options that pass 1 was run with, here or when its file was written.
    pub solve_options: Option<SolveOptions>,
    /// What was refined, where the mesh was in this run.
    pub refinement: Option<RefineReport>,
    /// Ambient irradiance that was added to the stored light for the picture (W/m^2).
    pub ambient: Option<Rgb>,
    /// Pass 2: the film.
    pub rendering: Rendering,
    /// Name of the caster.
    pub caster: &'static str,
    /// Rays by purpose, and the time that they took.
    pub meter: Meter,
    /// What the board counted, when it was the caster.
    pub board: Option<StatisticsByPurpose>,
    /// What its queues counted.
    pub links: Vec<FifoStatistics>,
    /// Wall times.
    pub timings: Timings,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A pass-1 solution with what led to it.
#[derive(Debug)]
pub struct Solved {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// The solution.
    pub solution: Solution,
    /// The options that it was solved with.
    pub solve_options: SolveOptions,
    /// What was refined, where the mesh was.
    pub refinement: Option<RefineReport>,
    /// Name of the caster.
    pub caster: &'static str,
    /// Rays by purpose, and the time that they took.
    pub meter: Meter,
    /// What the board counted, when it was the caster.
    pub board: Option<StatisticsByPurpose>,
    /// What its queues counted.
    pub links: Vec<FifoStatistics>,
    /// Wall times.
    pub timings: Timings,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Irradiance at points.
#[derive(Debug)]
pub struct Probed {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// Name of the caster.
    pub caster: &'static str,
    /// Rays by purpose, and the time that they took.
    pub meter: Meter,
    /// One value a point, in the order of the points.
    pub irradiance: Vec<Irradiance>,
    /// Its standard error, where it was found by chance.
    pub standard_error: Option<Vec<Irradiance>>,
    /// Wall times.
    pub timings: Timings,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Which rays drive the board.
#[derive(Clone, Debug, PartialEq)]
pub enum Workload {
    /// Camera rays only; needs no pass 1.
    Primary,
    /// Pass 1 only: the visibility of the form factors.
    Radiosity,
    /// Pass 2's shadow rays; pass 1 and camera rays are done in software.
    Shadow,
    /// Both passes, every ray.
    All,
    /// These rays, nearest hits.
    Rays(Vec<Ray>),
}

/// What the board did with a workload.
#[derive(Debug)]
pub struct Simulated {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// What the board counted.
    pub board: StatisticsByPurpose,
    /// What its queues counted.
    pub links: Vec<FifoStatistics>,
    /// What was left out of these counts.
    pub warm_up: Option<WarmUp>,
    /// Wall times.
    pub timings: Timings,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A scene as `info` shows it.
#[derive(Debug)]
pub struct Inspected {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// Its patch memory on the board; why there is none where the board cannot take the scene.
    pub board_image: Result<BoardImage, CastError>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Size of a scene in a board's patch memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardImage {
    /// Bytes in all: cell headers, cell lists, patch records.
    pub size_bytes: u64,
    /// Bytes of one patch's record.
    pub record_bytes: u64,
    /// Cells along each side of the grid.
    pub cells_per_side: u32,
}

/// Renders a scene file: both passes, or the second alone where its method needs no first.
///
/// # Errors
/// A fault of the scene, no camera, a solution of another mesh, a caster that fails.
pub fn render_frame(
    path: &Path,
    options: &FrameOptions,
    picture: &RenderOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Frame, FrameError> {
    render_frame_until(path, options, picture, progress, &mut || false)
}

/// As [`render_frame`], until `stop` says true: it is asked before every wave of pass 2.
///
/// # Errors
/// As [`render_frame`].
pub fn render_frame_until(
    path: &Path,
    options: &FrameOptions,
    picture: &RenderOptions,
    progress: &mut dyn FnMut(Progress),
    stop: &mut dyn FnMut() -> bool,
) -> Result<Frame, FrameError> {
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(path, options.elements, options.adaptive, &mut timings)?;
    let camera = camera_of(&scene)?;
    let mut caster = timings.measure("caster", || make_caster(&options.caster, &scene, &mesh, &[]))?;
    warn_of_lights(&mut scene, &mesh, &mut caster);
    let mut warnings = scene.warnings.clone();
    let mut meter = Meter::default();
    let mut port = meter.around(caster.port());
    let (mesh, solution, solve_options, refinement) = if picture.method.needs_pass_1() {
        let passed = pass_1_refined(&scene, mesh, &mut port, &options.pass_1, &mut timings, progress)?;
        warnings.extend(warnings::open_account(&passed.solution.account));
        (passed.mesh, Some(passed.solution), Some(passed.options), passed.refinement)
    } else {
        (mesh, None, None, None)
    };
    let solved = solution.as_ref().filter(|_| picture.ambient);
    let ambient = solved.map(|solution| radiosity::ambient::irradiance(&scene, &mesh, solution));
    let shown = solved.zip(ambient).map(|(solution, e)| radiosity::ambient::added(solution, e));
    let dark = solution.is_none().then(|| Solution::dark(&mesh));
    let rendering = timings.measure("pass 2", || {
        let progress = &mut |share| progress(Progress::Render(share));
        let lit = shown.as_ref().or(solution.as_ref()).or(dark.as_ref());
        let lit = lit.expect("a solution, or a dark one where there is none");
        render::render_until(&scene, &camera, &mesh, lit, &mut port, picture, progress, stop)
    })?;
    warnings.extend(warnings::back_faces(&scene, &rendering));
    Ok(Frame {
        caster: caster.name(),
        meter,
        board: caster.statistics(),
        links: caster.link_statistics(),
        scene,
        mesh,
        solution,
        solve_options,
        refinement,
        ambient,
        rendering,
        timings,
        warnings,
    })
}

/// Solves a scene file: pass 1 only.
///
/// # Errors
/// A fault of the scene, a caster that fails.
pub fn solve_scene(
    path: &Path,
    options: &FrameOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Solved, FrameError> {
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(path, options.elements, options.adaptive, &mut timings)?;
    let mut caster = timings.measure("caster", || make_caster(&options.caster, &scene, &mesh, &[]))?;
    warn_of_lights(&mut scene, &mesh, &mut caster);
    let mut meter = Meter::default();
    let mut port = meter.around(caster.port());
    let passed = pass_1_refined(&scene, mesh, &mut port, &options.pass_1, &mut timings, progress)?;
    let Passed { mesh, solution, options: solve_options, refinement } = passed;
    let mut warnings = scene.warnings.clone();
    warnings.extend(warnings::open_account(&solution.account));
    Ok(Solved {
        caster: caster.name(),
        meter,
        board: caster.statistics(),
        links: caster.link_statistics(),
        scene,
        mesh,
        solution,
        solve_options,
        refinement,
        timings,
        warnings,
    })
}

/// Irradiance at points of a solved scene: direct light integrated there and indirect gathered, or (`interpolated`)
/// the values that pass 1 stored on the surface at each point.
///
/// # Errors
/// As [`solve_scene`]; `interpolated` also when no surface lies at a point, or only one that turns its back to the
/// point's normal.
pub fn probe_scene(
    path: &Path,
    options: &FrameOptions,
    points: &[ProbePoint],
    interpolated: bool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Probed, FrameError> {
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(path, options.elements, options.adaptive, &mut timings)?;
    let mut starts: Vec<DVec3> = points.iter().map(|p| p.at).collect();
    let reach_m = if interpolated { reach_m(&options.caster, &scene, &mesh, &starts) } else { 0.0 };
    starts.extend(points.iter().map(|p| p.at + reach_m * p.normal));
    let mut caster = timings.measure("caster", || make_caster(&options.caster, &scene, &mesh, &starts))?;
    warn_of_lights(&mut scene, &mesh, &mut caster);
    let mut meter = Meter::default();
    let mut port = meter.around(caster.port());
    let passed = pass_1_refined(&scene, mesh, &mut port, &options.pass_1, &mut timings, progress)?;
    let Passed { mesh, solution, .. } = passed;
    let irradiance = timings.measure("probe", || {
        if interpolated {
            return stored_irradiance(&scene, &mesh, &solution, &mut port, points, reach_m);
        }
        let parts = radiosity::probe(&scene, &mesh, &solution, &mut port, points)?;
        Ok(parts.iter().map(|e| Irradiance(e.total())).collect())
    })?;
    let mut warnings = scene.warnings.clone();
    warnings.extend(warnings::open_account(&solution.account));
    let caster = caster.name();
    Ok(Probed { caster, meter, scene, mesh, irradiance, standard_error: None, timings, warnings })
}

/// Irradiance at points by path tracing: no pass 1.
///
/// # Errors
/// A fault of the scene, a caster that fails.
pub fn probe_by_paths(
    path: &Path,
    options: &FrameOptions,
    points: &[ProbePoint],
    how: PathOptions,
) -> Result<Probed, FrameError> {
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(path, options.elements, options.adaptive, &mut timings)?;
    let starts: Vec<DVec3> = points.iter().map(|p| p.at).collect();
    let mut caster = timings.measure("caster", || make_caster(&options.caster, &scene, &mesh, &starts))?;
    warn_of_lights(&mut scene, &mesh, &mut caster);
    let mut meter = Meter::default();
    let mut port = meter.around(caster.port());
    let found =
        timings.measure("probe", || render::path::irradiance(&scene, &mesh, &mut port, points, how))?;
    let irradiance = found.iter().map(|e| Irradiance(e.mean)).collect();
    let standard_error = Some(found.iter().map(|e| Irradiance(e.standard_error)).collect());
    let warnings = scene.warnings.clone();
    let caster = caster.name();
    Ok(Probed { caster, meter, scene, mesh, irradiance, standard_error, timings, warnings })
}

/// What a board is driven with.
#[derive(Clone, Debug)]
pub struct SimulateOptions {
    /// Wanted elements, instead of the scene file's `[meshing]`.
    pub elements: Option<u32>,
    /// The board.
    pub board: BoardSpec,
    /// Which rays.
    pub workload: Workload,
    /// Leave commands out of all counts, up to the first that ends at or after this cycle; 0: none.
    pub warm_up_cycles: u64,
    /// Pass 1, where it runs.
    pub solve: SolveOptions,
    /// The picture whose rays these are.
    pub picture: RenderOptions,
}

/// Drives the board with the rays of a workload; `watch`, if any, is told every event of it.
///
/// # Errors
/// As [`render_frame`]; no camera only where camera rays are asked for; a warm-up that leaves nothing to count; when the
/// watch wants no more.
pub fn simulate_scene(
    path: &Path,
    options: &SimulateOptions,
    watch: Option<&mut dyn CommandSink>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Simulated, FrameError> {
    let SimulateOptions { elements, board, workload, warm_up_cycles, solve, picture } = options;
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(path, *elements, Some(false), &mut timings)?;
    let mut emulated = timings.measure("board", || {
        BoardCaster::new(board, &mesh.cast_patches(), &start_points(&scene, &workload.origins()))
    })?;
    emulated.warm_up(*warm_up_cycles);
    let offset_m = emulated.surface_offset_m();
    scene.warnings.extend(warnings::lights_on_surfaces(&scene, &mesh, offset_m));
    let host = HostRun { scene: &scene, mesh: &mesh, workload, solve, picture };
    let warnings = match watch {
        Some(sink) => cast_workload(&host, &mut emulated.observed(sink)?, &mut timings, progress)?,
        None => cast_workload(&host, &mut emulated, &mut timings, progress)?,
    };
    let counted = emulated.statistics();
    let warm_up = if *warm_up_cycles > 0 {
        let all = emulated.board().statistics();
        match emulated.warmed_up().filter(|_| !counted.is_empty()) {
            Some(warm_up) => Some(warm_up.clone()),
            None => {
                let (cycles, commands) = (all.cycles, all.commands);
                return Err(FrameError::AllWarmUp { asked: *warm_up_cycles, cycles, commands });
            }
        }
    } else {
        None
    };
    let links = emulated.link_statistics();
    Ok(Simulated { board: counted, links, warm_up, scene, mesh, timings, warnings })
}

impl Workload {
    /// Its name, as on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Workload::Primary => "primary",
            Workload::Radiosity => "radiosity",
            Workload::Shadow => "shadow",
            Workload::All => "all",
            Workload::Rays(_) => "rays",
        }
    }

    /// Where its own rays start (m); those of the others start on surfaces, at the eye and at lights.
    fn origins(&self) -> Vec<DVec3> {
        match self {
            Workload::Rays(rays) => rays.iter().map(|r| r.origin).collect(),
            _ => Vec::new(),
        }
    }
}

/// A host's run of a workload.
struct HostRun<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    workload: &'a Workload,
    solve: &'a SolveOptions,
    picture: &'a RenderOptions,
}

/// Casts the rays of a workload with `emulated`, in the order that the host casts them in; what the user should know.
fn cast_workload(
    host: &HostRun<'_>,
    emulated: &mut dyn RayCaster,
    run: &mut Timings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<String>, FrameError> {
    let HostRun { scene, mesh, workload, solve, picture } = *host;
    let mut warnings = scene.warnings.clone();
    let pass_1_options = PassOne::Solve(*solve);
    match workload {
        Workload::Rays(rays) => {
            run.measure("trace", || emulated.closest_hits(Purpose::Primary, Query::Rays(rays)))?;
        }
        Workload::Radiosity => {
            let (solution, _) = pass_1(scene, mesh, emulated, &pass_1_options, run, progress)?;
            warnings.extend(warnings::open_account(&solution.account));
        }
        Workload::Primary => {
            let camera = camera_of(scene)?;
            let mut nothing = NullCaster;
            let mut routed = RoutedCaster::new(Purpose::Primary, emulated, &mut nothing);
            let look = &mut |share| progress(Progress::Render(share));
            let rendering =
                run.measure("trace", || look_through(scene, &camera, mesh, &mut routed, picture, look))?;
            warnings.extend(warnings::back_faces(scene, &rendering));
        }
        Workload::Shadow => {
            let camera = camera_of(scene)?;
            let mut software = make_caster(&CasterChoice::Software, scene, mesh, &workload.origins())?;
            let (solution, _) = pass_1(scene, mesh, software.port(), &pass_1_options, run, progress)?;
            let mut routed = RoutedCaster::new(Purpose::Shadow, emulated, software.port());
            let pass_2 = &mut |share| progress(Progress::Render(share));
            let rendering = run.measure("pass 2", || {
                render::render(scene, &camera, mesh, &solution, &mut routed, picture, pass_2)
            })?;
            warnings.extend(warnings::open_account(&solution.account));
            warnings.extend(warnings::back_faces(scene, &rendering));
        }
        Workload::All => {
            let camera = camera_of(scene)?;
            let (solution, _) = pass_1(scene, mesh, emulated, &pass_1_options, run, progress)?;
            let pass_2 = &mut |share| progress(Progress::Render(share));
            let rendering = run.measure("pass 2", || {
                render::render(scene, &camera, mesh, &solution, emulated, picture, pass_2)
            })?;
            warnings.extend(warnings::open_account(&solution.account));
            warnings.extend(warnings::back_faces(scene, &rendering));
        }
    }
    Ok(warnings)
}

/// Loads and meshes a scene, looks at it once through its camera, for warnings, and makes its patch memory for `board`.
///
/// # Errors
/// A fault of the scene. A scene that the board cannot take is none.
pub fn inspect_scene(path: &Path, elements: Option<u32>, board: &BoardSpec) -> Result<Inspected, FrameError> {
    let (mut scene, mesh) = load_and_mesh(path, elements, None, &mut Timings::default())?;
    let mut software = make_caster(&CasterChoice::Software, &scene, &mesh, &[])?;
    warn_of_lights(&mut scene, &mesh, &mut software);
    let mut warnings = scene.warnings.clone();
    if let Some(camera) = scene.camera {
        let mut nothing = NullCaster;
        let mut routed = RoutedCaster::new(Purpose::Primary, software.port(), &mut nothing);
        let picture = RenderOptions { width: 64, height: 64, ..RenderOptions::default() };
        let look = look_through(&scene, &camera, &mesh, &mut routed, &picture, &mut |_| {})?;
        warnings.extend(warnings::back_faces(&scene, &look));
    }
    let board_image = BoardCaster::new(board, &mesh.cast_patches(), &start_points(&scene, &[]));
    let board_image = board_image.map(|caster| {
        let image = caster.board().image();
        BoardImage {
            size_bytes: image.size_bytes() as u64,
            record_bytes: u64::from(rtl_model::memory::LINE_BYTES),
            cells_per_side: 1 << image.grid.log2_cells,
        }
    });
    Ok(Inspected { scene, mesh, board_image, warnings })
}

fn load_and_mesh(
    path: &Path,
    elements: Option<u32>,
    adaptive: Option<bool>,
    timings: &mut Timings,
) -> Result<(Scene, Mesh), FrameError> {
    let mut scene = timings.measure("load", || Scene::load(path))?;
    if let Some(adaptive) = adaptive {
        scene.meshing.adaptive = adaptive;
    }
    if let Some(n) = elements {
        scene.meshing.target = MeshTarget::Elements(n);
    }
    let n = Mesh::planned_elements(&scene);
    let limit = 2 * u64::from(MAX_ELEMENTS);
    if n > limit {
        return Err(FrameError::TooManyElements { path: scene.path, n, limit });
    }
    scene.warnings.extend(warnings::more_elements(scene.meshing.target, n));
    let mesh = timings.measure("mesh", || Mesh::build(&scene));
    scene.warnings.extend(warnings::t_junctions(&scene, &mesh));
    Ok((scene, mesh))
}

fn camera_of(scene: &Scene) -> Result<Camera, FrameError> {
    scene.camera.ok_or_else(|| FrameError::NoCamera { path: scene.path.clone() })
}

/// A caster for the scene; `points` are places outside the surfaces where rays start.
fn make_caster(
    choice: &CasterChoice,
    scene: &Scene,
    mesh: &Mesh,
    points: &[DVec3],
) -> Result<Caster, FrameError> {
    Ok(Caster::new(choice, mesh.cast_patches(), &start_points(scene, points))?)
}

/// Eye, lights and `points`: where rays start or end outside the surfaces.
fn start_points(scene: &Scene, points: &[DVec3]) -> Vec<DVec3> {
    let lights = scene.lights.iter().filter_map(|light| match light {
        Light::Point { position, .. } | Light::Spot { position, .. } => Some(*position),
        Light::Directional { .. } => None,
    });
    let eye = scene.camera.iter().map(|camera| camera.eye);
    eye.chain(lights).chain(points.iter().copied()).collect()
}

fn warn_of_lights(scene: &mut Scene, mesh: &Mesh, caster: &mut Caster) {
    let warnings = warnings::lights_on_surfaces(scene, mesh, caster.port().surface_offset_m());
    scene.warnings.extend(warnings);
}

/// Pass 2 over a scene without stored light: the camera rays are exactly those of a picture.
fn look_through(
    scene: &Scene,
    camera: &Camera,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    picture: &RenderOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Rendering, FrameError> {
    let dark = Solution::dark(mesh);
    let picture = RenderOptions { reconstruct: Method::Constant, ..picture.clone() };
    Ok(render::render(scene, camera, mesh, &dark, caster, &picture, progress)?)
}

/// How far (m) from a surface a point still counts as on it: a thousandth of the scene, and on the board well over
/// the surface offset, known before the caster is made because the lifted points go into its cube.
fn reach_m(choice: &CasterChoice, scene: &Scene, mesh: &Mesh, points: &[DVec3]) -> f64 {
    let size = crate::geom::Aabb::around(mesh.vertices.iter().map(|v| v.position)).size().max_element();
    let offset_m = match choice {
        CasterChoice::Software => 0.0,
        // What the board cannot take is refused when the caster is made.
        CasterChoice::Board(spec) => {
            let starts = start_points(scene, points);
            Quantizer::new(&spec.formats, &mesh.cast_patches(), &starts).map_or(0.0, |q| q.surface_offset_m())
        }
    };
    // The lift may double the cube and with it the offset.
    (1e-3 * size).max(8.0 * offset_m)
}

/// The irradiance that pass 1 stored where each point lies on a surface, bilinear between vertices.
fn stored_irradiance(
    scene: &Scene,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
    reach_m: f64,
) -> Result<Vec<Irradiance>, FrameError> {
    let vertex: Vec<Rgb> = solution.vertex_irradiance.iter().map(|e| e.total()).collect();
    let element: Vec<Rgb> = solution.element_irradiance.iter().map(|e| e.total()).collect();
    let field = Reconstruction::new(mesh, Method::Bilinear, &vertex, &element);
    let reach = reach_m.max(4.0 * caster.surface_offset_m());
    let rays: Vec<Ray> = points
        .iter()
        .map(|p| Ray {
            t_max: 2.0,
            ..Ray::unbounded(p.at + reach * p.normal, DVec3::ZERO - reach * p.normal)
        })
        .collect();
    let hits = caster.closest_hits(Purpose::Probe, Query::Rays(&rays))?;
    let mut values = Vec::with_capacity(points.len());
    for ((point, ray), hit) in points.iter().zip(&rays).zip(hits) {
        let off_surface = FrameError::OffSurface { at: point.at, reach_m: reach };
        let hit = hit.ok_or(off_surface)?;
        let Some(patch) = mesh.patch_of_hit(hit.patch, hit.facing) else {
            let surface = mesh.patches[hit.patch.0 as usize].surface;
            let surface = scene.surfaces[surface.0 as usize].name.clone();
            return Err(FrameError::BlackBack { at: point.at, normal: point.normal, surface });
        };
        values.push(Irradiance(field.evaluate(mesh, mesh.locate(patch, ray.at(hit.t)))));
    }
    Ok(values)
}
