//! Thin glass: light goes through it in both passes, and the energy account stays closed.
//!
//! ```text
//! lamp | half of a room | pane | other half, lit through the pane alone
//! ```

use std::path::Path;

use glam::DVec3;
use radiosity_engine::mesh::Mesh;
use radiosity_engine::radiosity::{FormFactorMethod, ProbePoint, Solution, SolveOptions, probe, solve};
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::render::path::{PathOptions, irradiance};
use radiosity_engine::render::{RenderMethod, RenderOptions, Rendering, Transport, render};
use radiosity_engine::scene::{Camera, Scene};

/// Two cubes of 1 m side by side along x, between them a pane or nothing; the lamp is a part of the wall x = 0. `open`: no
/// wall at x = 2.
fn rooms(pane: Option<(&str, bool)>, open: bool, light: &str) -> Scene {
    let quad = |name: &str, material: &str, corners: [[f64; 3]; 4], two_sided: bool| {
        format!(
            "[[surface]]\nname = \"{name}\"\nmaterial = \"{material}\"\nquad = {corners:?}\ntwo_sided = {two_sided}\n"
        )
    };
    let mut text = "
version = 1
[meshing]
elements = 800
[materials.grey]
reflectance = 0.5
[materials.lamp]
reflectance = 0.0
emission = 10.0
"
    .to_string();
    if let Some((transmission, two_sided)) = pane {
        text += &format!("[materials.pane]\nreflectance = 0.0\ntransmission = {transmission}\nior = 1.52\n");
        text += &quad("pane", "pane", [[1., 0., 0.], [1., 1., 0.], [1., 1., 1.], [1., 0., 1.]], two_sided);
    }
    text += &quad("floor", "grey", [[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]], false);
    text += &quad("ceiling", "grey", [[0., 0., 1.], [0., 1., 1.], [2., 1., 1.], [2., 0., 1.]], false);
    text += &quad("front", "grey", [[0., 0., 0.], [0., 0., 1.], [2., 0., 1.], [2., 0., 0.]], false);
    text += &quad("back", "grey", [[0., 1., 0.], [2., 1., 0.], [2., 1., 1.], [0., 1., 1.]], false);
    text += &quad("near", "grey", [[0., 0., 0.], [0., 1., 0.], [0., 1., 1.], [0., 0., 1.]], false);
    if light.is_empty() {
        text += &quad(
            "lamp",
            "lamp",
            [[1e-3, 0.3, 0.3], [1e-3, 0.7, 0.3], [1e-3, 0.7, 0.7], [1e-3, 0.3, 0.7]],
            false,
        );
    }
    if !open {
        text += &quad("far", "grey", [[2., 0., 0.], [2., 0., 1.], [2., 1., 1.], [2., 1., 0.]], false);
    }
    Scene::parse(&(text + light), Path::new("rooms.toml")).unwrap()
}

const POINT_LIGHT: &str = "[[light]]\nkind = \"point\"\nposition = [0.3, 0.5, 0.6]\nintensity = 1.0\n";

fn solved(scene: &Scene, options: &SolveOptions) -> (Mesh, Solution, SoftwareCaster) {
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let solution = solve(scene, &mesh, &mut caster, options, &mut |_| {}).unwrap();
    (mesh, solution, caster)
}

#[test]
fn account_of_rooms_with_a_pane_between_closes_however_power_is_shot() {
    let hemisphere = SolveOptions { form_factors: FormFactorMethod::Hemisphere, ..SolveOptions::default() };
    let cases = ["", POINT_LIGHT].into_iter().flat_map(|light| {
        let of_light = [SolveOptions::default(), hemisphere].into_iter().flat_map(move |options| {
            [(true, false), (true, true), (false, false)].map(|(two_sided, open)| (options, two_sided, open))
        });
        of_light.map(move |(options, two_sided, open)| (light, options, two_sided, open))
    });
    for (light, options, two_sided, open) in cases {
        let (_, solution, _) = solved(&rooms(Some(("0.9", two_sided)), open, light), &options);
        let a = solution.account;
        let share = |w: radiosity_engine::units::Rgb| w.0[1] / a.emitted_w.0[1];
        let case = format!("{light} {two_sided} {open} {:?}: {a:?}", options.form_factors);
        // What the pane reflects and takes is left on it, where it has no elements on its back.
        let (on_elements, on_backs) = (share(a.specular_w), share(a.back_w));
        assert!((0.01..0.3).contains(&(on_elements + on_backs)) && on_elements > 0.0, "{case}");
        assert_eq!(on_backs > 0.005, !two_sided, "{case}");
        assert_eq!(share(a.lost_w) > 0.01, open, "{case}");
        // What meets backs is measured by a few dozen rays a shooter, what passes on from there by all its form factors.
        let most = if two_sided { 0.01 } else { 0.02 };
        assert!(share(a.residual_w).abs() < most, "{case}");
        if options.form_factors == FormFactorMethod::Vertex {
            assert!(solution.row_sum_error.mean < 0.03, "{:?}", solution.row_sum_error);
        }
    }
}

#[test]
fn irradiance_behind_a_pane_is_what_path_tracing_of_the_same_transport_finds() {
    let points: Vec<ProbePoint> = [(1.9, 0.5, 0.0), (1.2, 0.8, 0.0), (0.5, 0.2, 0.0)]
        .map(|(x, y, z)| ProbePoint { at: DVec3::new(x, y, z), normal: DVec3::Z })
        .to_vec();
    for light in ["", POINT_LIGHT] {
        let scene = rooms(Some(("0.9", true)), false, light);
        let (mesh, solution, mut caster) = solved(&scene, &SolveOptions::default());
        let stored = probe(&scene, &mesh, &solution, &mut caster, &points).unwrap();
        let how = PathOptions { transport: Transport::TwoPass, n_paths: 40_000, max_depth: 6, seed: 1 };
        let traced = irradiance(&scene, &mesh, &mut caster, &points, how).unwrap();
        for ((point, a), b) in points.iter().zip(stored).zip(traced) {
            let (a, b, error) = (a.total().0[1], b.mean.0[1], b.standard_error.0[1]);
            assert!((a - b).abs() < 0.02 * b + 3.0 * error, "{}: {a}, {b} +- {error}", point.at);
        }
    }
}

#[test]
fn rooms_without_panes_cast_no_ray_more() {
    let (_, solution, _) = solved(&rooms(None, false, POINT_LIGHT), &SolveOptions::default());
    assert_eq!(solution.account.specular_w.0, [0.0; 3]);
    // The other room is bright where nothing stands between, dimmer behind glass, dark behind what passes nothing.
    let far = |pane: Option<(&str, bool)>| {
        let (mesh, solution, _) = solved(&rooms(pane, false, ""), &SolveOptions::default());
        let of_far = mesh.surfaces.last().unwrap().front.clone();
        let elements = mesh.patches[of_far.start as usize].elements.start
            ..mesh.patches[of_far.end as usize - 1].elements.end;
        let power_w =
            |e: u32| solution.element_irradiance[e as usize].total().0[1] * mesh.elements[e as usize].area_m2;
        elements.map(power_w).sum::<f64>()
    };
    let (free, half, dark) = (far(None), far(Some(("0.5", true))), far(Some(("0.0", true))));
    assert!((0.3..0.5).contains(&(half / free)), "{half} of {free}");
    // But for elements of the floor that stand on both sides.
    assert!(dark < 0.03 * free, "{dark} of {free}");
}

fn picture(scene: &Scene, eye: DVec3, target: DVec3, options: &RenderOptions) -> Rendering {
    let (mesh, solution, mut caster) = match options.method.needs_pass_1() {
        true => solved(scene, &SolveOptions::default()),
        false => {
            let mesh = Mesh::build(scene);
            let (dark, caster) = (Solution::dark(&mesh), SoftwareCaster::new(mesh.cast_patches()));
            (mesh, dark, caster)
        }
    };
    let camera = Camera { eye, target, up: DVec3::Y, fov_y_deg: 50.0 };
    render(scene, &camera, &mesh, &solution, &mut caster, options, &mut |_| {}).unwrap()
}

#[test]
fn shadow_rays_of_pass_2_bring_the_slabs_transmittance_of_a_light() {
    // Onto the floor at z = 0, from a light 2 m above it, at three angles.
    for (degrees, slab) in [(0.0_f64, 0.918_32), (45.0, 0.902_53), (60.0, 0.843_47)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let text = format!(
            "
version = 1
[materials.black]
reflectance = 0.0
[materials.pane]
reflectance = 0.0
transmission = [0.9, 0.6, 0.3]
ior = 1.52
[[surface]]
name = \"floor\"
material = \"black\"
quad = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]
[[surface]]
name = \"pane\"
material = \"pane\"
quad = [[-9, -9, 1.5], [9, -9, 1.5], [9, 9, 1.5], [-9, 9, 1.5]]
[[light]]
kind = \"point\"
position = [{}, 0.0, 2.0]
intensity = 8.0
",
            2.0 * sin / cos
        );
        let scene = Scene::parse(&text, Path::new("pane.toml")).unwrap();
        let (method, irradiance) = (RenderMethod::Whitted, true);
        let options = RenderOptions { method, irradiance, width: 1, height: 1, ..RenderOptions::default() };
        let seen = picture(&scene, DVec3::Z, DVec3::ZERO, &options).irradiance.unwrap()[0].unwrap();
        let free = 8.0 * cos.powi(3) / 4.0;
        for (c, transmission) in [0.9, 0.6, 0.3].into_iter().enumerate() {
            let share = seen.0.0[c] / free / transmission;
            assert!((share - slab).abs() < 5e-6, "{degrees} degrees, channel {c}: {share}, not {slab}");
        }
    }
}

#[test]
fn picture_of_a_room_behind_a_pane_is_that_of_path_tracing_of_the_same_transport() {
    for light in ["", POINT_LIGHT] {
        let scene = rooms(Some(("0.9", true)), false, light);
        let seen = |method| {
            let transport = Transport::TwoPass;
            let size =
                RenderOptions { width: 24, height: 24, samples: 4, paths: 64, ..RenderOptions::default() };
            let options = RenderOptions { method, transport, ..size };
            let (eye, target) = (DVec3::new(1.05, 0.5, 0.5), DVec3::new(2.0, 0.4, 0.4));
            picture(&scene, eye, target, &options).film.mean_luminance()
        };
        let (a, b) = (seen(RenderMethod::TwoPass), seen(RenderMethod::Path));
        assert!((a / b - 1.0).abs() < 0.015, "{light}: {a}, {b}");
    }
}
