//! The product `simulate` with a record of its work in place of rays, or with a sample of them.
//!
//! ```text
//! record:  host run --rays--> board, recording --> Simulated, WorkRecord
//! replay:  WorkRecord --checked against scene, board and settings--> board, looking up --> Simulated
//! ```
//! A replay casts no ray and does no host work, but for workloads whose rays depend on no answer (`primary` and rays of a
//! file): their rays are made once more, and must be those of the record.

use std::path::Path;

use rtl_model::memory_image::MemoryImage;
use rtl_model::record::{RecordKey, hash_work};
use rtl_model::spec::BoardSpec;

use super::{
    FrameError, HostRun, Progress, Simulated, Workload, camera_of, cast_workload, load_and_mesh,
    start_points, warn_of_lights,
};
use crate::mesh::Mesh;
use crate::radiosity::SolveOptions;
use crate::radiosity::solution_file::fingerprint;
use crate::raycast::RayCaster;
use crate::raycast::board::BoardCaster;
use crate::raycast::commands::{CastCommand, CommandCaster};
use crate::raycast::null::NullCaster;
use crate::raycast::quantize::Quantizer;
use crate::raycast::software::SoftwareCaster;
use crate::recorded::sample::{self, SampleEstimate};
use crate::recorded::{self, OtherWork, RecordFileError, Setting, WorkRecord};
use crate::render::RenderOptions;
use crate::report::Timings;
use crate::report::si::vector;
use crate::scene::Scene;

use super::caster::Caster;

/// What is simulated.
#[derive(Clone, Copy, Debug)]
pub struct Simulation<'a> {
    /// The scene file.
    pub scene: &'a Path,
    /// Wanted elements, instead of the scene file's `[meshing]`.
    pub elements: Option<u32>,
    /// The board.
    pub board: &'a BoardSpec,
    /// Its rays.
    pub workload: &'a Workload,
    /// Pass 1.
    pub solve: &'a SolveOptions,
    /// The picture.
    pub picture: &'a RenderOptions,
}

/// Recorded work with the patch memory that it ran on: all that boards with one canonical board
/// ([`BoardSpec::canonical`]) have in common.
#[derive(Clone, Debug)]
pub struct SharedWork {
    /// The patch memory.
    pub image: MemoryImage,
    /// The work.
    pub record: WorkRecord,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A scene in both worlds, before any ray.
struct Loaded {
    scene: Scene,
    mesh: Mesh,
    caster: BoardCaster,
    timings: Timings,
}

fn load(run: &Simulation<'_>) -> Result<Loaded, FrameError> {
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(run.scene, run.elements, Some(false), &mut timings)?;
    let points = start_points(&scene, &run.workload.origins());
    let caster = timings.measure("board", || BoardCaster::new(run.board, &mesh.cast_patches(), &points))?;
    let mut caster = Caster::Board(Box::new(caster));
    warn_of_lights(&mut scene, &mesh, &mut caster);
    match caster {
        Caster::Board(caster) => Ok(Loaded { scene, mesh, caster: *caster, timings }),
        Caster::Software(_) => unreachable!("a board was made"),
    }
}

/// Drives the board with the rays of a workload, and records what its datapath answers.
///
/// # Errors
/// As [`super::simulate_scene`].
pub fn record_scene(
    run: &Simulation<'_>,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Simulated, WorkRecord), FrameError> {
    let (Loaded { scene, mesh, caster, timings }, record, warnings) = record_loaded(run, progress)?;
    Ok((
        Simulated {
            board: caster.statistics(),
            links: caster.link_statistics(),
            warm_up: None,
            scene,
            mesh,
            timings,
            warnings,
        },
        record,
    ))
}

/// Records a workload, and keeps the patch memory for boards to come.
///
/// # Errors
/// As [`super::simulate_scene`].
pub fn share_work(run: &Simulation<'_>) -> Result<SharedWork, FrameError> {
    let (loaded, record, warnings) = record_loaded(run, &mut |_| {})?;
    Ok(SharedWork { image: loaded.caster.board().image().clone(), record, warnings })
}

/// The commands of a workload, whose rays may depend on a run in software, and the patch memory.
///
/// # Errors
/// As [`super::simulate_scene`].
pub fn share_commands(run: &Simulation<'_>) -> Result<(MemoryImage, Vec<CastCommand>), FrameError> {
    let Loaded { scene, mesh, caster, .. } = load(run)?;
    let Simulation { workload, solve, picture, .. } = *run;
    let host = HostRun { scene: &scene, mesh: &mesh, workload, solve, picture };
    let commands = software_commands(&host, caster.quantizer())?;
    Ok((caster.board().image().clone(), commands))
}

/// What a workload's rays depend on, in words.
///
/// # Errors
/// A fault of the scene; no camera where there are camera rays.
pub fn workload_settings(run: &Simulation<'_>) -> Result<Vec<Setting>, FrameError> {
    let (scene, mesh) = load_and_mesh(run.scene, run.elements, Some(false), &mut Timings::default())?;
    let Simulation { workload, solve, picture, .. } = *run;
    if !matches!(workload, Workload::Radiosity | Workload::Rays(_)) {
        camera_of(&scene)?;
    }
    Ok(settings(&HostRun { scene: &scene, mesh: &mesh, workload, solve, picture }))
}

fn record_loaded(
    run: &Simulation<'_>,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Loaded, WorkRecord, Vec<String>), FrameError> {
    let mut loaded = load(run)?;
    let Loaded { scene, mesh, caster, timings } = &mut loaded;
    caster.record();
    let Simulation { workload, solve, picture, .. } = *run;
    let host = HostRun { scene, mesh, workload, solve, picture };
    let warnings = cast_workload(&host, caster, timings, progress)?;
    let key = RecordKey::of(run.board, caster.board().image());
    let record = WorkRecord { settings: settings(&host), key, commands: caster.take_recorded() };
    Ok((loaded, record, warnings))
}

/// Drives the board with the record in the file `path`, which must be one of this work.
///
/// # Errors
/// A record that cannot be read, or one of other work; a fault of the scene.
pub fn replay_scene(
    run: &Simulation<'_>,
    path: &Path,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Simulated, WorkRecord), FrameError> {
    let record = recorded::load(path)?;
    let Loaded { scene, mesh, mut caster, mut timings } = load(run)?;
    let Simulation { workload, solve, picture, .. } = *run;
    let host = HostRun { scene: &scene, mesh: &mesh, workload, solve, picture };
    let other = |source| RecordFileError::Other { path: path.to_path_buf(), source };
    let key = RecordKey::of(run.board, caster.board().image());
    record.check(&settings(&host), &key).map_err(other)?;
    for (i, (_, command)) in record.commands.iter().enumerate() {
        let checked = command.check(run.board, caster.board().image());
        checked.map_err(|error| recorded::fault(path, format!("command {i}: {error}")))?;
    }
    if !answers_matter(workload) {
        let commands = timings.measure("rays", || commands(&host, caster.quantizer(), &mut NullCaster))?;
        check_bundles(&record, &commands, run.board).map_err(other)?;
    }
    timings.measure("trace", || {
        caster.replay(&record.commands, &mut |share| progress(Progress::Render(share)))
    })?;
    let warnings = scene.warnings.clone();
    Ok((
        Simulated {
            board: caster.statistics(),
            links: caster.link_statistics(),
            warm_up: None,
            scene,
            mesh,
            timings,
            warnings,
        },
        record,
    ))
}

/// Drives the board with a share of a workload's commands, and estimates the cycles of all of them. Rays that depend on
/// answers are those of a run in software, with the board's surface offset.
///
/// # Errors
/// As [`super::simulate_scene`].
pub fn sample_scene(
    run: &Simulation<'_>,
    share: f64,
    seed: u64,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Simulated, SampleEstimate), FrameError> {
    let Loaded { scene, mesh, mut caster, mut timings } = load(run)?;
    let Simulation { workload, solve, picture, .. } = *run;
    let host = HostRun { scene: &scene, mesh: &mesh, workload, solve, picture };
    let commands = timings.measure("rays", || software_commands(&host, caster.quantizer()))?;
    let show = &mut |done| progress(Progress::Render(done));
    let (by_purpose, estimate) =
        timings.measure("sample", || sample::run(caster.board_mut(), &commands, share, seed, show))?;
    let warnings = scene.warnings.clone();
    Ok((
        Simulated {
            board: by_purpose,
            links: caster.link_statistics(),
            warm_up: None,
            scene,
            mesh,
            timings,
            warnings,
        },
        estimate,
    ))
}

/// The commands of a run in software, where its rays depend on answers at all.
fn software_commands(host: &HostRun<'_>, quantizer: &Quantizer) -> Result<Vec<CastCommand>, FrameError> {
    if answers_matter(host.workload) {
        commands(host, quantizer, &mut SoftwareCaster::new(host.mesh.cast_patches()))
    } else {
        commands(host, quantizer, &mut NullCaster)
    }
}

/// Some rays of the workload depend on what others hit.
fn answers_matter(workload: &Workload) -> bool {
    !matches!(workload, Workload::Primary | Workload::Rays(_))
}

/// The commands that the board gets in a run in which `answers` answers.
fn commands(
    host: &HostRun<'_>,
    quantizer: &Quantizer,
    answers: &mut dyn RayCaster,
) -> Result<Vec<CastCommand>, FrameError> {
    let mut caster = CommandCaster::new(answers, quantizer);
    cast_workload(host, &mut caster, &mut Timings::default(), &mut |_| {})?;
    Ok(caster.into_commands())
}

/// Checks that the rays of a record are these.
fn check_bundles(record: &WorkRecord, commands: &[CastCommand], board: &BoardSpec) -> Result<(), OtherWork> {
    let differ = |what: String, recorded: String, given: String| Err(OtherWork { what, recorded, given });
    let (n, wanted) = (record.commands.len(), commands.len());
    if n != wanted {
        return differ("number of commands".to_owned(), n.to_string(), wanted.to_string());
    }
    for (i, ((_, recorded), command)) in record.commands.iter().zip(commands).enumerate() {
        let mode = |any_hit: bool| if any_hit { "any hit" } else { "nearest hit" }.to_owned();
        if recorded.any_hit() != command.any_hit {
            return differ(format!("mode of command {i}"), mode(recorded.any_hit()), mode(command.any_hit));
        }
        let hash = hash_work(&board.formats, command.words.work());
        if recorded.work_hash() != hash {
            let what = format!("bundles of command {i} (hash)");
            return differ(what, format!("{:016x}", recorded.work_hash()), format!("{hash:016x}"));
        }
    }
    Ok(())
}

/// What the rays of a workload depend on, in words.
fn settings(host: &HostRun<'_>) -> Vec<Setting> {
    let HostRun { scene, mesh, workload, solve, picture } = *host;
    let mut settings = Vec::new();
    let mut put = |name: &str, value: String| settings.push(Setting { name: name.to_owned(), value });
    put("workload", workload.name().to_owned());
    put("scene and mesh (hash)", format!("{:016x}", fingerprint(scene, mesh)));
    let looks = matches!(workload, Workload::Primary | Workload::Shadow | Workload::All);
    let solves = matches!(workload, Workload::Radiosity | Workload::Shadow | Workload::All);
    if let (true, Some(camera)) = (looks, &scene.camera) {
        let (eye, target, up) = (vector(camera.eye), vector(camera.target), vector(camera.up));
        let fov = camera.fov_y_deg;
        put("camera", format!("eye {eye} m, target {target} m, up {up}, fov_y_deg = {fov}"));
        let RenderOptions { width, height, samples, .. } = picture;
        let plural = if *samples == 1 { "" } else { "s" };
        put("picture", format!("{width} x {height}, {samples} sample{plural} a pixel"));
    }
    if looks && solves {
        let RenderOptions { direct, max_depth, seed, .. } = picture;
        put("shadow rays", format!("{direct:?}, depth = {max_depth}, seed = {seed}"));
    }
    if solves {
        let SolveOptions {
            unshot_share,
            max_shots,
            seed,
            dense_visibility,
            kernel,
            max_row_bytes,
            form_factors,
            max_shooters,
            wanted_error,
        } = solve;
        put(
            "pass 1",
            format!(
                "unshot_share = {unshot_share}, max_shots = {max_shots}, seed = {seed}, dense_visibility = \
                 {dense_visibility}, kernel = {kernel:?}, max_row_bytes = {max_row_bytes}, form_factors = {form_factors:?}, max_shooters = \
                 {max_shooters}, wanted_error = {wanted_error}"
            ),
        );
    }
    settings
}
