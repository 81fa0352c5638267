//! Photometry against closed forms, from scene text to lux: mean illuminance, lamps overhead, grids, pictures.

use std::f64::consts::PI;
use std::path::PathBuf;

use glam::DVec3;
use radiosity_engine::frame::{
    CasterChoice, FrameOptions, GridOptions, PassOne, probe_grid, probe_scene, render_frame, solve_scene,
};
use radiosity_engine::photometry::{GridPlace, GridSpec, GridSummary};
use radiosity_engine::radiosity::summary::{summarise, totals};
use radiosity_engine::radiosity::{ProbePoint, SolveOptions};
use radiosity_engine::render::RenderOptions;
use radiosity_engine::units::Radiance;
use tempfile::TempDir;

/// A scene file in a folder of its own.
struct SceneFile {
    _folder: TempDir,
    path: PathBuf,
}

fn scene_file(text: &str) -> SceneFile {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    SceneFile { _folder: folder, path }
}

/// A cube of 4 m with a point light of 10 klm in its middle, and a camera under the ceiling that looks at the floor.
fn cube(reflectance: f64, elements: u32) -> SceneFile {
    let mut text = format!(
        "version = 1\n[camera]\neye = [2, 2, 3.9]\ntarget = [2, 2, 0]\nup = [0, 1, 0]\nfov_y_deg = 40\n\
         [materials.wall]\nreflectance = {reflectance}\n[meshing]\nelements = {elements}\n\
         [[light]]\nkind = \"point\"\nposition = [2, 2, 2]\nintensity_cd = {}\n",
        10_000.0 / (4.0 * PI)
    );
    let walls = [
        ("floor", "[0,0,0],[4,0,0],[4,4,0],[0,4,0]"),
        ("ceiling", "[0,0,4],[0,4,4],[4,4,4],[4,0,4]"),
        ("south", "[0,0,0],[0,0,4],[4,0,4],[4,0,0]"),
        ("north", "[0,4,0],[4,4,0],[4,4,4],[0,4,4]"),
        ("west", "[0,0,0],[0,4,0],[0,4,4],[0,0,4]"),
        ("east", "[4,0,0],[4,0,4],[4,4,4],[4,4,0]"),
    ];
    for (name, corners) in walls {
        text += &format!("[[surface]]\nname = \"{name}\"\nmaterial = \"wall\"\nquad = [{corners}]\n");
    }
    scene_file(&text)
}

fn options() -> FrameOptions {
    FrameOptions {
        adaptive: None,
        elements: None,
        caster: CasterChoice::Software,
        pass_1: PassOne::Solve(SolveOptions::default()),
    }
}

fn on_floor(spec: impl FnOnce(GridSpec) -> GridSpec) -> GridOptions {
    let place = GridPlace::Surface("floor".to_owned());
    let plain = GridSpec { place, n: None, normal: None, border_m: 0.0, height_m: 0.0 };
    GridOptions { spec: spec(plain), skip_hidden: false, interpolated: false }
}

fn assert_within(value: f64, expected: f64, share: f64, what: &str) {
    assert!((value - expected).abs() <= share * expected.abs(), "{what}: {value}, expected {expected}");
}

#[test]
fn ten_kilolumens_in_a_cube_of_four_metres_give_the_closed_mean_illuminance() {
    // Phi / (A (1 - rho)), A = 96 m^2.
    for (rho, lux) in [(0.0, 104.17), (0.2, 130.21), (0.5, 208.33), (0.8, 520.83)] {
        let scene = cube(rho, 600);
        let solved = solve_scene(&scene.path, &options(), &mut |_| {}).unwrap();
        let all = totals(&summarise(&solved.scene, &solved.mesh, &solved.solution));
        assert_within(all.illuminance_lx.mean, lux, 0.003, &format!("rho {rho}"));
        assert_within(all.illuminance_lx.mean, 10_000.0 / 96.0 / (1.0 - rho), 0.003, &format!("rho {rho}"));
        assert!(all.illuminance_lx.min < lux && lux < all.illuminance_lx.max, "{all:?}");
    }
}

#[test]
fn grid_on_a_wall_of_the_cube_has_the_closed_mean_and_the_extremes_where_symmetry_puts_them() {
    let scene = cube(0.5, 600);
    let wanted = on_floor(|spec| GridSpec { n: Some([15, 15]), ..spec });
    let probed = probe_grid(&scene.path, &options(), &wanted, &mut |_| {}).unwrap();
    let s = GridSummary::new(probed.values.iter().zip(&probed.grid.points).map(|(e, p)| (*e, p.area_m2)))
        .unwrap();
    assert_eq!(s.n_points, 225);
    assert_within(s.mean_lx, 10_000.0 / 96.0 / 0.5, 0.005, "mean");
    // The middle is the brightest, the corners are the darkest.
    assert_eq!(s.max_at, 112);
    assert!([0, 14, 210, 224].contains(&s.min_at), "{s:?}");
    assert_within(s.u0.unwrap(), s.min_lx / s.mean_lx, 1e-12, "U0");
    assert_within(s.ud.unwrap(), s.min_lx / s.max_lx, 1e-12, "Ud");
}

#[test]
fn direct_illuminance_of_the_cube_is_that_of_the_inverse_square_law_at_every_grid_point() {
    let scene = cube(0.0, 150);
    let wanted = on_floor(|spec| GridSpec { height_m: 0.8, border_m: 0.5, ..spec });
    let probed = probe_grid(&scene.path, &options(), &wanted, &mut |_| {}).unwrap();
    assert_eq!(probed.grid.n, [7, 7]);
    for (point, e) in probed.grid.points.iter().zip(&probed.values) {
        assert!((point.at.z - 0.8).abs() < 1e-12);
        let r = DVec3::new(2.0, 2.0, 2.0) - point.at;
        let lux = 10_000.0 / (4.0 * PI) * r.z / r.length().powi(3);
        assert_within(e.unwrap().illuminance_lx(), lux, 1e-9, "inverse square");
    }
}

#[test]
fn disk_lamp_overhead_gives_pi_l_sine_squared() {
    let text = "version = 1\n[materials.floor]\nreflectance = 0\n[materials.lamp]\nreflectance = 0\n\
                luminance_cd_m2 = 1000\n[meshing]\nelements = 3000\n\
                [[surface]]\nname = \"floor\"\nmaterial = \"floor\"\nquad = [[-1,-1,0],[1,-1,0],[1,1,0],[-1,1,0]]\n\
                [[surface]]\nname = \"lamp\"\nmaterial = \"lamp\"\n\
                disk = { center = [0,0,2], normal = [0,0,-1], radius = 0.5 }\n";
    let scene = scene_file(text);
    let at = |z: f64| ProbePoint { at: DVec3::new(0.0, 0.0, z), normal: DVec3::Z };
    let heights = [0.0, 1.0, 1.5];
    let points = heights.map(at);
    let probed = probe_scene(&scene.path, &options(), &points, false, &mut |_| {}).unwrap();
    for (z, e) in heights.iter().zip(&probed.irradiance) {
        let sine_squared = 0.25 / (0.25 + (2.0 - z).powi(2));
        assert_within(e.illuminance_lx(), PI * 1000.0 * sine_squared, 0.003, &format!("z = {z}"));
    }
}

/// Where the centre of a pixel of the cube's picture lies on the floor (m), if it does.
fn seen_on_the_floor(x: usize, y: usize, side: usize) -> Option<DVec3> {
    let pixel = 2.0 * 20f64.to_radians().tan() / side as f64;
    let centre = side as f64 / 2.0;
    let (dx, dy) = ((x as f64 + 0.5 - centre) * pixel, (centre - y as f64 - 0.5) * pixel);
    let at = DVec3::new(2.0 + 3.9 * dx, 2.0 + 3.9 * dy, 0.0);
    (at.x.clamp(0.0, 4.0) == at.x && at.y.clamp(0.0, 4.0) == at.y).then_some(at)
}

#[test]
fn pictures_of_illuminance_and_luminance_have_the_probes_values() {
    const SIDE: usize = 24;
    let scene = cube(0.5, 1350);
    let picture = RenderOptions {
        width: SIDE as u32,
        height: SIDE as u32,
        irradiance: true,
        ..RenderOptions::default()
    };
    let frame = render_frame(&scene.path, &options(), &picture, &mut |_| {}).unwrap();
    let irradiance = frame.rendering.irradiance.as_ref().unwrap();
    let places =
        (0..SIDE * SIDE).step_by(7).filter_map(|k| Some((k, seen_on_the_floor(k % SIDE, k / SIDE, SIDE)?)));
    let places: Vec<(usize, DVec3)> = places.collect();
    assert!(places.len() > 50, "{} pixels", places.len());
    let points: Vec<_> = places.iter().map(|(_, at)| ProbePoint { at: *at, normal: DVec3::Z }).collect();
    let probed = probe_scene(&scene.path, &options(), &points, false, &mut |_| {}).unwrap();
    for ((k, at), e) in places.iter().zip(&probed.irradiance) {
        let lux = e.illuminance_lx();
        // The indirect half is reconstructed between vertices.
        assert_within(irradiance[*k].unwrap().illuminance_lx(), lux, 0.005, &format!("lx at {at}"));
        let seen = Radiance(frame.rendering.film.pixels[*k]).luminance_cd_m2();
        assert_within(seen, 0.5 * lux / PI, 0.005, &format!("cd/m^2 at {at}"));
    }
    // Asking for it changes no pixel.
    let plain = RenderOptions { irradiance: false, ..picture };
    let again = render_frame(&scene.path, &options(), &plain, &mut |_| {}).unwrap();
    assert!(again.rendering.irradiance.is_none());
    assert_eq!(again.rendering.film.pixels, frame.rendering.film.pixels);
}

#[test]
fn grid_behind_or_inside_surfaces_is_refused_or_left_out_by_name() {
    let text = std::fs::read_to_string(cube(0.5, 150).path).unwrap();
    // A cupboard of four walls and a top, fronts outside.
    let boxed = text
        + "[[surface]]\nname = \"top\"\nmaterial = \"wall\"\nquad = [[1,1,2],[2,1,2],[2,2,2],[1,2,2]]\n\
           [[surface]]\nname = \"front\"\nmaterial = \"wall\"\nquad = [[1,1,0],[2,1,0],[2,1,2],[1,1,2]]\n\
           [[surface]]\nname = \"right\"\nmaterial = \"wall\"\nquad = [[2,1,0],[2,2,0],[2,2,2],[2,1,2]]\n\
           [[surface]]\nname = \"back\"\nmaterial = \"wall\"\nquad = [[2,2,0],[1,2,0],[1,2,2],[2,2,2]]\n\
           [[surface]]\nname = \"left\"\nmaterial = \"wall\"\nquad = [[1,2,0],[1,1,0],[1,1,2],[1,2,2]]\n";
    let scene = scene_file(&boxed);
    let mut wanted = on_floor(|spec| GridSpec { n: Some([8, 8]), height_m: 0.8, ..spec });
    let e = probe_grid(&scene.path, &options(), &wanted, &mut |_| {}).unwrap_err().to_string();
    assert!(
        e.starts_with("4 of 64 grid points lie inside or behind surfaces, the first at 1.25, 1.25, 0.8"),
        "{e}"
    );
    wanted.skip_hidden = true;
    let probed = probe_grid(&scene.path, &options(), &wanted, &mut |_| {}).unwrap();
    let hidden: Vec<usize> = (0..64).filter(|k| probed.values[*k].is_none()).collect();
    assert_eq!(hidden, [18, 19, 26, 27]);
    assert!(probed.warnings.iter().any(|w| w.contains("4 of 64")), "{:?}", probed.warnings);
    // The other way round all points look out of the room.
    let turned = on_floor(|spec| GridSpec { normal: Some(DVec3::NEG_Z), ..spec });
    let e = probe_grid(&scene.path, &options(), &turned, &mut |_| {}).unwrap_err().to_string();
    assert!(e.contains("64 of 64") && e.contains("behind 'floor'") && e.contains("turned round?"), "{e}");
}
