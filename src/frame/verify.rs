//! The product `verify`: the rays of both passes through board, oracle and software.
//!
//! ```text
//! Scene::load -> Mesh::build -> solve, render (software, recorded) -> verify::verify -> Verification
//!                            -> solve, render by software | by the board's arithmetic -> difference of the pictures
//! ```
//! The recorded run is software's, with the board's surface offset: rays start where they would with the board, and a
//! run takes a fraction of the board's time. What the board would have answered does not steer it; of secondary rays
//! only their starts depend on answers. The compared pictures are those of `render` with either caster, each with its
//! own offset.

use std::path::Path;

use rtl_model::board::Board;
use rtl_model::datapath::RayWords;
use rtl_model::memory_image::MemoryImage;
use rtl_model::spec::BoardSpec;

use super::{FrameError, Progress, load_and_mesh, start_points, warnings};
use crate::image::{Difference, difference};
use crate::mesh::Mesh;
use crate::radiosity::{self, EnergyAccount};
use crate::raycast::functional::FunctionalCaster;
use crate::raycast::quantize::Quantizer;
use crate::raycast::recording::RecordingCaster;
use crate::raycast::software::SoftwareCaster;
use crate::raycast::{CastError, RayCaster};
use crate::render::{self, Rendering};
use crate::report::Timings;
use crate::scene::Scene;
use crate::vectors::{self, MAX_SAMPLE};
use crate::verify::{self, Case, Verification, VerifyOptions};

/// A verified scene.
#[derive(Debug)]
pub struct Verified {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// What was found.
    pub verification: Verification,
    /// Scene space to words.
    pub quantizer: Quantizer,
    /// The board's patch memory.
    pub image: MemoryImage,
    /// Some of the verified rays, spread evenly: words, and whether any hit was asked for.
    pub sample: Vec<(RayWords, bool)>,
    /// Wall times.
    pub timings: Timings,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Recorded rays per verified one: a purpose that is thinned keeps at least half as many, so enough for all quotas.
const RECORDED_PER_RAY: u64 = 3;
/// Rays that are recorded in any case, so that a small number still comes from all over the run.
const MIN_RECORDED: u64 = 1 << 14;

/// Verifies a scene file's workload against the oracle and software. Without camera: pass 1 alone, and no picture.
///
/// # Errors
/// A fault of the scene, one that the board cannot take, a caster that fails. A mismatch is none.
pub fn verify_scene(
    path: &Path,
    elements: Option<u32>,
    board: &BoardSpec,
    options: &VerifyOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Verified, FrameError> {
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(path, elements, Some(false), &mut timings)?;
    let patches = mesh.cast_patches();
    let points = start_points(&scene, &[]);
    let spec = board.clone().comparable_by_ray();
    let mut functional =
        timings.measure("board", || FunctionalCaster::for_board(&spec, &patches, &points))?;
    let clocked = Board::new(&spec, functional.image().clone());
    let clocked = clocked.map_err(|error| CastError::Board(error.to_string()))?;
    let offset_m = functional.quantizer().surface_offset_m();
    let about_lights = warnings::lights_on_surfaces(&scene, &mesh, offset_m);
    scene.warnings.extend(about_lights);

    let mut software = timings.measure("software caster", || SoftwareCaster::new(patches.clone()));
    let cap = options.n_rays.saturating_mul(RECORDED_PER_RAY).max(MIN_RECORDED);
    let mut recorder = RecordingCaster::new(&mut software, offset_m, cap);
    let (account, recorded) =
        timings.measure("recorded run", || both_passes(&scene, &mesh, &mut recorder, options, progress))?;
    let workload = verify::chosen(recorder.into_recordings(), options.n_rays);

    let quantizer = *functional.quantizer();
    let sample = vectors::spread(&quantizer, &workload, MAX_SAMPLE)?;
    let case = Case { patches: &patches, quantizer: &quantizer, board: clocked, workload };
    let told = &mut |share| progress(Progress::Render(share));
    let mut verification = verify::verify(case, options, &mut timings, told)?;
    if options.compare_image {
        let (_, by_software) = timings
            .measure("software picture", || both_passes(&scene, &mesh, &mut software, options, progress))?;
        let (_, by_board) = timings
            .measure("board picture", || both_passes(&scene, &mesh, &mut functional, options, progress))?;
        verification.image = by_software.zip(by_board).and_then(|(a, b)| compare(&a, &b));
    }
    let mut warnings = scene.warnings.clone();
    warnings.extend(warnings::open_account(&account));
    warnings.extend(recorded.and_then(|rendering| warnings::back_faces(&scene, &rendering)));
    let image = functional.image().clone();
    Ok(Verified { scene, mesh, verification, quantizer, image, sample, timings, warnings })
}

/// Pass 1, and where there is a camera pass 2.
fn both_passes(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    options: &VerifyOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<(EnergyAccount, Option<Rendering>), FrameError> {
    let pass_1 = &mut |p| progress(Progress::Solve(p));
    let solution = radiosity::solve(scene, mesh, caster, &options.solve, pass_1)?;
    let Some(camera) = &scene.camera else { return Ok((solution.account, None)) };
    let pass_2 = &mut |share| progress(Progress::Render(share));
    let rendering = render::render(scene, camera, mesh, &solution, caster, &options.picture, pass_2)?;
    Ok((solution.account, Some(rendering)))
}

/// The pictures are of one size, so there is a difference.
fn compare(a: &Rendering, b: &Rendering) -> Option<Difference> {
    difference(&a.film, &b.film, None).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::SolveOptions;
    use crate::raycast::Purpose;
    use crate::render::RenderOptions;

    fn verified(scene: &str, n_rays: u64, compare_image: bool) -> Verified {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene).join("scene.toml");
        let options = VerifyOptions {
            n_rays,
            n_clocked: 300,
            first_test_bits: vec![8, 12],
            solve: SolveOptions { unshot_share: 0.05, ..SolveOptions::default() },
            picture: RenderOptions {
                width: 24,
                height: 24,
                direct: crate::direct::DirectOptions::full(2),
                ..RenderOptions::default()
            },
            compare_image,
        };
        let mut told = 0;
        let board = BoardSpec::preset("minimal").unwrap();
        let verified = verify_scene(&path, Some(100), &board, &options, &mut |_| told += 1).unwrap();
        assert!(told > 0);
        verified
    }

    /// What must hold on every scene.
    fn check(found: &Verification) {
        assert_eq!(found.n_mismatches, 0, "{:?}", found.first_mismatch);
        assert_eq!(found.misclassified.unexplained, 0, "{:?}", found.first_unexplained);
        assert!(
            found.t_error.n > 100 && found.t_error.max_of_bound.is_some_and(|share| share <= 1.0),
            "{:?}",
            found.t_error
        );
        assert!(found.first_test.iter().all(|share| share.wrong == 0 && share.saved > 0));
        assert!(found.n_wire_tests > 1000 && found.n_clocked >= 300);
        assert!(found.wires.iter().all(|wire| wire.seen <= Some(wire.max_magnitude)));
        assert!(found.passed());
    }

    #[test]
    fn verify_mirrors_and_glass_covers_every_purpose_and_passes() {
        let result = verified("mirror-glass", 4000, true);
        let found = &result.verification;
        check(found);
        assert_eq!(found.n_rays(), 4000);
        let purposes: Vec<Purpose> = found.rays.iter().map(|r| r.purpose).collect();
        assert_eq!(purposes, [Purpose::Primary, Purpose::FormFactor, Purpose::Shadow, Purpose::Specular]);
        assert_eq!(found.rays[0].cast, 24 * 24);
        assert!(found.wires.iter().all(|wire| wire.seen.is_some() == wire.observed), "{:?}", found.wires);
        assert!(found.rays.iter().all(|r| r.verified > 0 && r.verified <= r.cast));
        let image = found.image.unwrap();
        assert!(image.rmse_relative < 1e-2 && image.n_pixels == 576, "{image:?}");
        assert!(result.timings.total_seconds > 0.0);
    }

    #[test]
    fn verify_a_room_with_a_point_light_passes_without_comparing_pictures() {
        let result = verified("point-room", 1000, false);
        check(&result.verification);
        assert!(result.verification.image.is_none());
    }

    #[test]
    fn verify_a_scene_too_large_for_the_board_is_refused() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/point-room/scene.toml");
        let mut board = BoardSpec::preset("minimal").unwrap();
        board.dram.bytes = 4096;
        let options = VerifyOptions {
            n_rays: 10,
            n_clocked: 0,
            first_test_bits: Vec::new(),
            solve: SolveOptions::default(),
            picture: RenderOptions::default(),
            compare_image: false,
        };
        let error = verify_scene(&path, Some(1000), &board, &options, &mut |_| {}).unwrap_err();
        assert!(error.to_string().contains("patch memory"), "{error}");
    }
}
