//! Mirrors and glass in pictures of one pixel, against the laws: image position, Snell, Fresnel, total reflection, slabs,
//! limits of depth and weight. By `two-pass` (no stored light) and by `path`, which must see the same.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;
use radiosity_engine::mesh::Mesh;
use radiosity_engine::radiosity::Solution;
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::reconstruct::Method;
use radiosity_engine::render::{RenderMethod, RenderOptions, Transport, render};
use radiosity_engine::scene::{Camera, Scene};

/// The lamp's radiance is 1.
const MATERIALS: &str = "
version = 1
[meshing]
elements = 4000
[materials.black]
reflectance = 0.0
[materials.lamp]
reflectance = 0.0
emission = 3.141592653589793
[materials.mirror]
reflectance = 0.0
specular = 0.75
[materials.glass]
reflectance = 0.0
transmission = 0.9
ior = 1.52
[materials.shining_mirror]
reflectance = 0.0
specular = 0.5
emission = 3.141592653589793
[materials.faint_mirror]
reflectance = 0.0
specular = 0.01
emission = 3.141592653589793
";

fn options() -> RenderOptions {
    RenderOptions { width: 1, height: 1, reconstruct: Method::Constant, paths: 4, ..RenderOptions::default() }
}

/// Radiance along one ray.
fn seen_with(surfaces: &str, eye: DVec3, toward: DVec3, options: &RenderOptions) -> f64 {
    let scene = Scene::parse(&format!("{MATERIALS}{surfaces}"), Path::new("test.toml")).unwrap();
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let up = if toward.normalize().y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
    let camera = Camera { eye, target: eye + toward, up, fov_y_deg: 1.0 };
    let dark = Solution::dark(&mesh);
    let picture = render(&scene, &camera, &mesh, &dark, &mut caster, options, &mut |_| {}).unwrap();
    picture.film.pixels[0].0[1]
}

/// By recursion.
fn seen(surfaces: &str, eye: DVec3, toward: DVec3) -> f64 {
    seen_with(surfaces, eye, toward, &options())
}

/// The mean of many paths.
fn traced(surfaces: &str, eye: DVec3, toward: DVec3, paths: u32, transport: Transport) -> f64 {
    let options = RenderOptions { method: RenderMethod::Path, paths, transport, ..options() };
    seen_with(surfaces, eye, toward, &options)
}

fn surface(name: &str, material: &str, shape: &str) -> String {
    format!("[[surface]]\nname = \"{name}\"\nmaterial = \"{material}\"\n{shape}\n")
}

fn disk(name: &str, material: &str, center: DVec3, normal: DVec3, radius: f64) -> String {
    let v = |v: DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
    let shape = format!("disk = {{ center = {}, normal = {}, radius = {radius:?} }}", v(center), v(normal));
    surface(name, material, &shape)
}

/// A ball of glass of radius 1 about the origin, finely cut.
fn ball() -> String {
    surface("ball", "glass", "sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\nsmooth_group = 1")
}

fn fresnel(cos: f64, eta: f64) -> f64 {
    let out = (1.0 - eta * eta * (1.0 - cos * cos)).sqrt();
    let s = ((eta * cos - out) / (eta * cos + out)).powi(2);
    let p = ((cos - eta * out) / (cos + eta * out)).powi(2);
    0.5 * (s + p)
}

#[test]
fn mirror_image_of_a_lamp_stands_as_far_behind_the_mirror() {
    let mirror = disk("mirror", "mirror", DVec3::ZERO, DVec3::Z, 9.0);
    let at = DVec3::new(0.8, -0.4, 1.5);
    let text = mirror + &disk("lamp", "lamp", at, DVec3::NEG_Z, 0.1);
    let eye = DVec3::new(-1.0, 0.3, 0.7);
    let image = DVec3::new(at.x, at.y, -at.z);
    for (off, want) in [(0.0, 0.75), (0.09, 0.75), (-0.09, 0.75), (0.11, 0.0), (-0.11, 0.0)] {
        let toward = image + off * DVec3::X - eye;
        assert!((seen(&text, eye, toward) - want).abs() < 1e-9, "{off} m beside the image");
        assert!((traced(&text, eye, toward, 100, Transport::TwoPass) - want).abs() < 0.2, "{off}, by path");
    }
}

#[test]
fn ray_into_a_ball_of_glass_is_bent_by_snells_law() {
    // A small lamp in the ball, where the refracted ray must pass; what is seen of it lost R at the surface.
    for degrees in [0.0_f64, 20.0, 45.0, 70.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Onto (0, 0, 1), whose normal is z.
        let d = DVec3::new(sin, 0.0, -cos);
        let sin_in = sin / 1.52;
        let inside = DVec3::new(sin_in, 0.0, -(1.0 - sin_in * sin_in).sqrt());
        let depth = 0.9;
        let lamp = |off: f64| {
            let side = DVec3::new(-inside.z, 0.0, inside.x);
            let center = DVec3::Z + depth * inside + off * side;
            ball() + &disk("lamp", "lamp", center, -inside, 0.02)
        };
        let eye = DVec3::Z - 2.0 * d;
        let want = 0.9 * (1.0 - fresnel(cos, 1.0 / 1.52));
        let center = seen(&lamp(0.0), eye, d);
        assert!((center - want).abs() < 2e-3, "{degrees} degrees: {center}, not {want}");
        for off in [-0.03, 0.03] {
            // Past it, a reflection inside the ball may bring a little; the lamp is not where the ray goes.
            let beside = seen(&lamp(off), eye, d);
            assert!(beside < 0.2 * want, "{degrees} degrees, {off} m beside: {beside}");
        }
    }
}

#[test]
fn glass_at_normal_incidence_reflects_the_square_of_the_index_step() {
    // A black disk in the ball takes what goes in; the lamp stands behind the eye.
    let text = ball()
        + &disk("stop", "black", DVec3::ZERO, DVec3::Z, 0.9)
        + &disk("lamp", "lamp", 9.0 * DVec3::Z, DVec3::NEG_Z, 3.0);
    let want = 0.9 * (0.52_f64 / 2.52).powi(2);
    let (eye, toward) = (3.0 * DVec3::Z, DVec3::NEG_Z);
    let by_recursion = seen(&text, eye, toward);
    assert!((by_recursion / want - 1.0).abs() < 1e-3, "{by_recursion}, not {want}");
    let by_paths = traced(&text, eye, toward, 40_000, Transport::Full);
    assert!((by_paths / want - 1.0).abs() < 0.1, "{by_paths}, not {want}");
}

#[test]
fn glass_beyond_the_critical_angle_reflects_all_and_lets_nothing_out() {
    // The eye is in the ball and looks at its side. A bright sphere around: what leaves the ball sees it.
    let around =
        surface("around", "lamp", "sphere = { center = [0.0, 0.0, 0.0], radius = 4.0, inward = true }");
    let text = ball() + &around;
    for (distance, is_total) in [(0.3_f64, false), (0.5, false), (0.63, false), (0.69, true), (0.9, true)] {
        // sin i = distance / radius on a chord at that distance from the middle; critical: 1 / 1.52 = 0.658.
        let one = RenderOptions { max_depth: 1, ..options() };
        let l = seen_with(&text, DVec3::new(distance, 0.0, 0.0), DVec3::Y, &one);
        if is_total {
            assert_eq!(l, 0.0, "at {distance}");
        } else {
            let want = 0.9 * (1.0 - fresnel((1.0 - distance * distance).sqrt(), 1.52));
            assert!((l - want).abs() < 0.01, "at {distance}: {l}, not {want}");
        }
    }
    // What is reflected: a lamp in the ball on the mirrored chord, at the full 0.9.
    let distance: f64 = 0.8;
    let half = (1.0 - distance * distance).sqrt();
    let hit = DVec3::new(distance, half, 0.0);
    let mirrored = DVec3::Y - 2.0 * DVec3::Y.dot(hit) * hit;
    let lamp = disk("lamp", "lamp", hit + half * mirrored, -mirrored, 0.05);
    let l = seen(&(ball() + &lamp), DVec3::new(distance, 0.0, 0.0), DVec3::Y);
    assert!((l - 0.9).abs() < 1e-9, "{l}");
}

#[test]
fn pane_passes_the_slabs_transmittance_at_three_angles_and_reflects_the_rest() {
    let pane = disk("pane", "glass", DVec3::ZERO, DVec3::Z, 5.0);
    let behind = pane.clone() + &disk("lamp", "lamp", -5.0 * DVec3::Z, DVec3::Z, 50.0);
    let before = pane + &disk("lamp", "lamp", 5.0 * DVec3::Z, DVec3::NEG_Z, 50.0);
    for (degrees, slab) in [(0.0_f64, 0.918_32), (45.0, 0.902_53), (60.0, 0.843_47)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let d = DVec3::new(sin, 0.0, -cos);
        let (through, back) = (seen(&behind, -d, d), seen(&before, -d, d));
        assert!((through - 0.9 * slab).abs() < 5e-6, "{degrees} degrees: {through}");
        assert!((back - 0.9 * (1.0 - slab)).abs() < 5e-6, "{degrees} degrees, reflected: {back}");
        let by_paths = traced(&behind, -d, d, 10_000, Transport::Full);
        assert!((by_paths - 0.9 * slab).abs() < 0.02, "{degrees} degrees, by path: {by_paths}");
    }
}

#[test]
fn mirrors_that_face_each_other_are_followed_to_the_limits_of_depth_and_weight() {
    let hall = |material| {
        disk("below", material, DVec3::ZERO, DVec3::Z, 9.0)
            + &disk("above", material, DVec3::Z, DVec3::NEG_Z, 9.0)
    };
    let (eye, d) = (0.5 * DVec3::Z, DVec3::new(0.1, 0.0, -1.0));
    for max_depth in [0_u32, 1, 3, 6] {
        let options = RenderOptions { max_depth, ..options() };
        let want: f64 = (0..=max_depth).map(|k| 0.5_f64.powi(k as i32)).sum();
        let l = seen_with(&hall("shining_mirror"), eye, d, &options);
        assert!((l - want).abs() < 1e-9, "depth {max_depth}: {l}, not {want}");
        let path = RenderOptions {
            method: RenderMethod::Path,
            transport: Transport::TwoPass,
            paths: 40_000,
            ..options
        };
        let l = seen_with(&hall("shining_mirror"), eye, d, &path);
        assert!((l - want).abs() < 0.06, "depth {max_depth}, by path: {l}, not {want}");
    }
    // 0.01^2 of the pixel is under the limit of a thousandth.
    assert!((seen(&hall("faint_mirror"), eye, d) - 1.01).abs() < 1e-9);
    // Unbiased path tracing has no limits.
    let all = traced(&hall("shining_mirror"), eye, d, 10_000, Transport::Full);
    assert!((all - 2.0).abs() < 0.06, "{all}");
    assert!((MATERIALS.matches(&format!("{PI}")).count()) == 3, "lamps of radiance 1");
}
