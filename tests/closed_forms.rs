//! The shipped scenes against their closed forms and independently computed values, through the library's main path.

use std::path::{Path, PathBuf};

use glam::DVec3;
use radiosity_engine::frame::{CasterChoice, FrameOptions, PassOne, Solved, probe_scene, solve_scene};
use radiosity_engine::radiosity::summary::{SurfaceSummary, summarise};
use radiosity_engine::radiosity::{ProbePoint, SolveOptions};
use radiosity_engine::units::Rgb;

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml")
}

fn options() -> FrameOptions {
    FrameOptions {
        adaptive: None,
        elements: None,
        caster: CasterChoice::Software,
        pass_1: PassOne::Solve(SolveOptions::default()),
    }
}

fn solved(name: &str) -> (Solved, Vec<SurfaceSummary>) {
    let solved = solve_scene(&scene(name), &options(), &mut |_| {}).unwrap();
    let surfaces = summarise(&solved.scene, &solved.mesh, &solved.solution);
    assert!(!surfaces.is_empty());
    (solved, surfaces)
}

fn assert_within(value: f64, expected: f64, share: f64, what: &str) {
    assert!((value - expected).abs() <= share * expected.abs(), "{what}: {value}, expected {expected}");
}

fn sum(surfaces: &[SurfaceSummary], of: impl Fn(&SurfaceSummary) -> Rgb) -> f64 {
    surfaces.iter().map(|s| of(s).0[1]).sum()
}

#[test]
fn furnace_has_radiosity_one_on_every_wall_and_row_sums_of_one() {
    let (solved, surfaces) = solved("furnace");
    for s in &surfaces {
        for b in s.mean_radiosity_w_m2.0 {
            assert_within(b, 1.0, 0.002, &s.name);
        }
    }
    assert!(
        solved.solution.row_sum_error.mean < 0.001 && solved.solution.row_sum_error.max < 0.005,
        "{:?}",
        solved.solution.row_sum_error
    );
}

#[test]
fn squares_receive_their_view_factor_of_the_emitted_power() {
    for (name, view_factor) in [("parallel-squares", 0.199_824_895_7), ("corner-squares", 0.200_043_776_1)] {
        let (_, surfaces) = solved(name);
        let emitted = sum(&surfaces, |s| s.emitted_w);
        let incident = sum(&surfaces, |s| s.incident_w);
        assert_within(incident / emitted, view_factor, 0.002, name);
    }
}

#[test]
fn point_light_in_a_closed_room_gives_its_power_over_one_minus_rho() {
    let (_, surfaces) = solved("point-room");
    // I = 10 W/sr, rho = 0.5.
    let expected = 4.0 * std::f64::consts::PI * 10.0 / (1.0 - 0.5);
    assert_within(sum(&surfaces, |s| s.incident_w), expected, 0.005, "incident power");
}

#[test]
fn lit_cube_has_the_independently_computed_irradiance() {
    let text = std::fs::read_to_string(scene("lit-cube")).unwrap();
    let at = |at: [f64; 3], normal: [f64; 3]| ProbePoint {
        at: DVec3::from_array(at),
        normal: DVec3::from_array(normal),
    };
    let points = [
        at([0.5, 0.5, 0.0], [0.0, 0.0, 1.0]),
        at([0.0, 0.5, 0.5], [1.0, 0.0, 0.0]),
        at([0.125, 0.5, 1.0], [0.0, 0.0, -1.0]),
    ];
    for (rho, expected) in [(0.5, [0.04238, 0.04314, 0.01786]), (0.8, [0.08377, 0.08488, 0.06160])] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        assert!(text.contains("reflectance = 0.5"));
        std::fs::write(&path, text.replace("reflectance = 0.5", &format!("reflectance = {rho}"))).unwrap();
        let probed = probe_scene(&path, &options(), &points, false, &mut |_| {}).unwrap();
        for (e, expected) in probed.irradiance.iter().zip(expected) {
            // 0.3 % at less unshot power than by default: `validation`.
            assert_within(e.0.0[1], expected, 0.005, &format!("rho {rho}"));
        }
    }
}
