//! Path tracing against closed forms: free lamps of all shapes, lights, a furnace, panes, a mirror; threads, casters, shares.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;
use proptest::prelude::*;
use radiosity_engine::mesh::Mesh;
use radiosity_engine::radiosity::ProbePoint;
use radiosity_engine::radiosity::kernel::point_to_polygon;
use radiosity_engine::raycast::RayCaster;
use radiosity_engine::raycast::functional::FunctionalCaster;
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::render::Transport;
use radiosity_engine::render::path::{PathIrradiance, PathOptions, irradiance};
use radiosity_engine::scene::Scene;
use rtl_model::fixed::Formats;

const MATERIALS: &str = "
version = 1
[materials.black]
reflectance = 0.0
[materials.lamp]
reflectance = 0.0
emission = [4.0, 2.0, 1.0]
[materials.mirror]
reflectance = 0.0
specular = 0.75
[materials.pane]
reflectance = 0.0
transmission = [0.9, 0.6, 0.3]
ior = 1.52
[materials.half]
reflectance = 0.5
emission = 0.5
";
/// Exitance of the lamp.
const M: [f64; 3] = [4.0, 2.0, 1.0];

fn scene(surfaces: &str) -> (Scene, Mesh) {
    let scene = Scene::parse(&format!("{MATERIALS}{surfaces}"), Path::new("test.toml")).unwrap();
    let mesh = Mesh::build(&scene);
    (scene, mesh)
}

fn quad(name: &str, material: &str, corners: [DVec3; 4], two_sided: bool) -> String {
    let corners = corners.map(|c| format!("[{:?}, {:?}, {:?}]", c.x, c.y, c.z)).join(", ");
    format!(
        "[[surface]]\nname = \"{name}\"\nmaterial = \"{material}\"\nquad = [{corners}]\ntwo_sided = {two_sided}\n"
    )
}

/// A horizontal rectangle that looks down.
fn ceiling(x: [f64; 2], y: [f64; 2], z: f64) -> [DVec3; 4] {
    [[x[0], y[0]], [x[0], y[1]], [x[1], y[1]], [x[1], y[0]]].map(|[x, y]| DVec3::new(x, y, z))
}

fn up(x: f64, y: f64, z: f64) -> ProbePoint {
    ProbePoint { at: DVec3::new(x, y, z), normal: DVec3::Z }
}

fn options(n_paths: u32) -> PathOptions {
    PathOptions { transport: Transport::Full, n_paths, max_depth: 6, seed: 1 }
}

fn found(surfaces: &str, points: &[ProbePoint], options: PathOptions) -> Vec<PathIrradiance> {
    let (scene, mesh) = scene(surfaces);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    irradiance(&scene, &mesh, &mut caster, points, options).unwrap()
}

/// Within four standard errors and rounding, and the error itself under `most` of the value.
fn assert_is(found: &PathIrradiance, want: [f64; 3], most: f64) {
    for ((mean, error), want) in found.mean.0.into_iter().zip(found.standard_error.0).zip(want) {
        assert!((mean - want).abs() <= 4.0 * error + 1e-6 * want, "{mean} +- {error}, not {want}");
        assert!(error <= most * want, "{mean} +- {error}: an error under {most} was expected");
    }
}

#[test]
fn irradiance_of_a_free_lamp_is_lamberts_formula_near_and_far() {
    let lamp = ceiling([0.0, 1.0], [0.0, 1.0], 1.0);
    let text = quad("lamp", "lamp", lamp, false);
    let wall = ProbePoint { at: DVec3::new(-1e-3, 0.5, 0.999), normal: DVec3::X };
    let points = [up(0.0, 0.0, 0.0), up(0.5, 0.5, 0.99), up(-3.0, 2.0, -1.0), up(0.01, 0.01, 0.9), wall];
    let found = found(&text, &points, options(20_000));
    assert_eq!(found.len(), points.len());
    for (point, found) in points.iter().zip(&found) {
        let f = point_to_polygon(point.at, point.normal, &lamp);
        assert!(f > 0.0);
        assert_is(found, M.map(|m| m * f), 0.01);
    }
    let from_behind = [up(0.5, 0.5, 2.0), ProbePoint { at: DVec3::new(0.5, 0.5, 2.0), normal: DVec3::NEG_Z }];
    for dark in self::found(&text, &from_behind, options(100)) {
        assert_eq!(dark.mean.0, [0.0; 3]);
    }
}

#[test]
fn irradiance_of_curved_and_two_sided_lamps_is_the_formula_over_their_patches() {
    let shapes = [
        ("sphere = { center = [0.0, 0.0, 2.0], radius = 0.5 }", false),
        ("cylinder = { base = [-0.5, 0.2, 1.0], top = [0.7, 0.0, 1.3], radius = 0.2 }", false),
        ("disk = { center = [0.3, 0.0, 1.0], normal = [0.2, 0.0, -1.0], radius = 0.4 }", false),
        ("triangle = [[-0.5, 0.0, 1.0], [0.5, -0.6, 1.2], [0.4, 0.9, 0.7]]", true),
        ("triangle = [[0.4, 0.9, 0.7], [0.5, -0.6, 1.2], [-0.5, 0.0, 1.0]]", true),
    ];
    for (shape, two_sided) in shapes {
        let text =
            format!("[[surface]]\nname = \"lamp\"\nmaterial = \"lamp\"\n{shape}\ntwo_sided = {two_sided}\n");
        let (_, mesh) = scene(&text);
        let points = [up(0.0, 0.0, 0.0), up(0.6, 0.3, 0.2)];
        let found = found(&text, &points, options(20_000));
        for (point, found) in points.iter().zip(&found) {
            // A convex shape does not hide itself: every patch that faces the point is seen.
            let polygons = mesh.patches.iter().map(|p| mesh.polygon(&p.corners));
            let f: f64 = polygons.map(|p| point_to_polygon(point.at, point.normal, &p)).sum();
            assert!(f > 0.01, "{shape}");
            assert_is(found, M.map(|m| m * f), 0.01);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Two lamps side by side: the choice among them, the areas and the weights of both techniques.
    #[test]
    fn irradiance_of_any_two_lamps_is_the_sum_of_their_formulas(
        x in 0.01..1.5f64, y in prop::array::uniform2(-1.5..1.5f64), size in prop::array::uniform2(0.05..0.8f64),
        height in 0.05..2.0f64, tilt in -0.9..0.9f64,
    ) {
        let left = ceiling([-x - size[0], -x], [y[0], y[0] + size[1]], height);
        let right = ceiling([x, x + size[1]], [y[1], y[1] + size[0]], height);
        let normal = DVec3::new(tilt, 0.3 * tilt, 1.0).normalize();
        let point = ProbePoint { at: DVec3::new(0.1, -0.2, 0.0), normal };
        let text = quad("left", "lamp", left, false) + &quad("right", "lamp", right, false);
        let f: f64 = [left, right].iter().map(|lamp| point_to_polygon(point.at, normal, lamp)).sum();
        let found = found(&text, &[point], options(4000))[0];
        let (mean, error) = (found.mean.0[0], found.standard_error.0[0]);
        prop_assert!((mean - 4.0 * f).abs() <= 5.0 * error + 1e-6 * f, "{mean} +- {error}, not {}", 4.0 * f);
        prop_assert!(error <= 0.05 * mean, "{mean} +- {error}");
    }
}

#[test]
fn irradiance_of_lights_without_area_is_their_formula_without_noise_and_black_in_shadow() {
    let lights = "
[[light]]
kind = \"point\"
position = [0.0, 0.0, 2.0]
intensity = 8.0
[[light]]
kind = \"directional\"
direction = [0.0, 0.0, -1.0]
irradiance = 0.25
";
    let roof = |z| quad("roof", "black", ceiling([-1.0, 1.0], [-1.0, 1.0], z), false);
    for (height, want) in [(2.5, 2.0), (1.0, 0.0)] {
        let e = found(&format!("{}{lights}", roof(height)), &[up(0.0, 0.0, 0.0)], options(4000))[0];
        // Chance chooses the light: the noise is that choice's.
        assert_is(&e, [want; 3], 0.01);
    }
    let sun = &lights[lights.rfind("[[light]]").unwrap()..];
    let e = found(&format!("{}{sun}", roof(-1.0)), &[up(0.0, 0.0, 0.0)], options(10))[0];
    assert_eq!((e.mean.0, e.standard_error.0), ([0.25; 3], [0.0; 3]));
}

fn room(material: &str) -> String {
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let walls = [
        [p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.)],
        [p(0., 0., 1.), p(0., 1., 1.), p(1., 1., 1.), p(1., 0., 1.)],
        [p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 1.), p(0., 0., 1.)],
        [p(1., 0., 0.), p(1., 0., 1.), p(1., 1., 1.), p(1., 1., 0.)],
        [p(0., 0., 0.), p(0., 0., 1.), p(1., 0., 1.), p(1., 0., 0.)],
        [p(0., 1., 0.), p(1., 1., 0.), p(1., 1., 1.), p(0., 1., 1.)],
    ];
    (0..6).map(|i| quad(&format!("wall {i}"), material, walls[i], false)).collect()
}

#[test]
fn irradiance_inside_a_half_grey_furnace_is_one_in_the_middle_and_in_corners() {
    let ball = "[[surface]]\nname = \"ball\"\nmaterial = \"half\"\nsphere = { center = [0.3, 0.3, 0.4], radius = 0.25 }\nsmooth_group = 1\n";
    let points = [up(0.5, 0.5, 0.0), up(1e-4, 1e-4, 0.0), up(0.7, 0.9, 0.5)];
    for text in [room("half"), format!("{}{ball}", room("half"))] {
        for e in found(&text, &points, options(20_000)) {
            // Facets shade each other where smooth normals say otherwise: up to 0.2 % under the ball.
            let (mean, error) = (e.mean.0[1], e.standard_error.0[1]);
            assert!((mean - 1.0).abs() <= 4.0 * error + 2e-3, "{mean} +- {error}");
            assert!(error < 5e-3, "{error}");
        }
    }
}

#[test]
fn irradiance_behind_a_pane_is_that_of_the_light_times_the_slabs_transmittance() {
    let light =
        |x: f64| format!("[[light]]\nkind = \"point\"\nposition = [{x:?}, 0.0, 2.0]\nintensity = 8.0\n");
    let square = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| DVec3::new(x, y, 1.0));
    let turned = [square[3], square[2], square[1], square[0]];
    for (degrees, slab) in [(0.0_f64, 0.918_32), (45.0, 0.902_53), (60.0, 0.843_47)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let light = light(2.0 * sin / cos);
        let free = 8.0 * cos.powi(3) / 4.0;
        for corners in [square, turned] {
            let text = format!("{}{light}", quad("pane", "pane", corners, false));
            let e = found(&text, &[up(0.0, 0.0, 0.0)], options(1))[0].mean;
            for (c, transmission) in [0.9, 0.6, 0.3].into_iter().enumerate() {
                let share = e.0[c] / free / transmission;
                assert!((share - slab).abs() < 5e-6, "{degrees} degrees, channel {c}: {share}, not {slab}");
            }
        }
        // Two panes: the square of it. Nine: one more than are followed, and closed glass: dark.
        let shifted = |by: f64| square.map(|p| p - by * DVec3::Z);
        let panes = |n: usize| -> String {
            (0..n).map(|i| quad(&format!("pane {i}"), "pane", shifted(0.1 * i as f64), false)).collect()
        };
        let two = found(&format!("{}{light}", panes(2)), &[up(0.0, 0.0, 0.0)], options(1))[0].mean.0[0];
        assert!((two / free / 0.81 - slab * slab).abs() < 2e-5, "{two}");
        let eight = found(&format!("{}{light}", panes(8)), &[up(0.0, 0.0, 0.0)], options(1))[0].mean.0[0];
        assert!((eight / free / (0.9 * slab).powi(8) - 1.0).abs() < 1e-4);
    }
    let ball = "[[surface]]\nname = \"ball\"\nmaterial = \"pane\"\nsphere = { center = [0.0, 0.0, 1.0], radius = 0.3 }\n";
    let dark = found(&format!("{ball}{}", light(0.0)), &[up(0.0, 0.0, 0.0)], options(1))[0];
    assert_eq!(dark.mean.0, [0.0; 3]);
}

#[test]
fn irradiance_of_a_lamp_behind_a_pane_adds_up_over_shadow_rays_and_bounces() {
    // A pane as large as the view: what a bounce finds through it and what shadow rays find must make up the whole.
    let lamp = quad("lamp", "lamp", ceiling([-0.5, 0.5], [-0.5, 0.5], 0.2), false);
    let pane = |n| quad("pane", "pane", ceiling([-50.0, 50.0], [-50.0, 50.0], 0.1), n);
    let e = found(&format!("{lamp}{}", pane(false)), &[up(0.0, 0.0, 0.0)], options(40_000))[0];
    // By strips of the lamp's angle: E = M int T(theta) cos cos' / (pi r^2) dA.
    let (mut want, n) = (0.0, 400);
    for i in 0..n {
        for j in 0..n {
            let (x, y) =
                ((f64::from(i) + 0.5) / f64::from(n) - 0.5, (f64::from(j) + 0.5) / f64::from(n) - 0.5);
            let r2 = x * x + y * y + 0.04;
            let cos = 0.2 / r2.sqrt();
            want += slab(cos, 1.52) * cos * cos / (PI * r2) / f64::from(n * n);
        }
    }
    assert_is(&e, [4.0 * 0.9 * want, 2.0 * 0.6 * want, 0.3 * want], 0.01);
}

/// (1 - R) / (1 + R), mean over the polarisations; Born, Wolf 1999, 1.5.2 and 7.6.1.
fn slab(cos: f64, n: f64) -> f64 {
    let out = (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
    let s = ((cos - n * out) / (cos + n * out)).powi(2);
    let p = ((n * cos - out) / (n * cos + out)).powi(2);
    0.5 * ((1.0 - s) / (1.0 + s) + (1.0 - p) / (1.0 + p))
}

#[test]
fn mirror_adds_the_image_of_a_lamp_to_full_transport_and_nothing_to_that_of_two_pass() {
    // The lamp looks down at a mirror in the plane z = 0; the point beside it looks down, too.
    let lamp = ceiling([0.2, 0.7], [0.0, 0.6], 0.8);
    let floor = ceiling([-50.0, 50.0], [-50.0, 50.0], 0.0).map(|p| DVec3::new(p.y, p.x, p.z));
    let text = quad("lamp", "lamp", lamp, false) + &quad("floor", "mirror", floor, false);
    let point = ProbePoint { at: DVec3::new(-0.3, 0.1, 0.8), normal: DVec3::NEG_Z };
    let image = lamp.map(|p| DVec3::new(p.x, p.y, -p.z));
    let image = [image[3], image[2], image[1], image[0]];
    let f = point_to_polygon(point.at, point.normal, &image);
    assert!(f > 0.01);
    let full = found(&text, &[point], options(40_000))[0];
    assert_is(&full, M.map(|m| 0.75 * m * f), 0.05);
    let options = PathOptions { transport: Transport::TwoPass, ..options(1000) };
    assert_eq!(found(&text, &[point], options)[0].mean.0, [0.0; 3]);
}

#[test]
fn irradiance_has_the_same_bits_for_any_number_of_threads_and_points() {
    let text = room("half") + &quad("pane", "pane", ceiling([0.2, 0.8], [0.2, 0.8], 0.5), false);
    let points: Vec<ProbePoint> = (0..50).map(|i| up(f64::from(i) / 50.0, 0.3, 0.1)).collect();
    let run = |threads, points: &[ProbePoint]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| found(&text, points, options(3000)))
    };
    let one = run(1, &points);
    assert_eq!(one, run(3, &points));
    // 3000 paths of one point are one wave, of fifty points two.
    assert_eq!(one[17..18], run(2, &points[17..18]));
}

#[test]
fn irradiance_by_the_quantised_caster_is_that_by_the_software_caster_within_the_noise() {
    let text = room("half") + &quad("block", "mirror", ceiling([0.2, 0.8], [0.2, 0.8], 0.5), true);
    let points = [up(0.5, 0.5, 0.0), up(0.5, 0.5, 0.6), up(0.1, 0.1, 0.7)];
    let (scene, mesh) = scene(&text);
    let patches = mesh.cast_patches();
    let starts = points.map(|p| p.at);
    let mut software = SoftwareCaster::new(patches.clone());
    let mut board = FunctionalCaster::new(&Formats::default(), None, &patches, &starts).unwrap();
    let casters: [&mut dyn RayCaster; 2] = [&mut software, &mut board];
    let [a, b] = casters.map(|c| irradiance(&scene, &mesh, c, &points, options(4000)).unwrap());
    for (a, b) in a.iter().zip(&b) {
        let error = a.standard_error.0[0].hypot(b.standard_error.0[0]);
        assert!(error > 0.0);
        // The same walks, but for the few that pass an edge: far closer than two runs of chance.
        assert!((a.mean.0[0] - b.mean.0[0]).abs() <= 0.5 * error, "{a:?} {b:?}");
    }
}
