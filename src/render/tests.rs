//! Pass 2 against what must be seen: a furnace, a mirror image, panes and balls of glass.

use std::path::PathBuf;

use glam::DVec3;

use super::*;
use crate::radiosity::SplitIrradiance;
use crate::raycast::software::SoftwareCaster;
use crate::scene::{Material, MaterialId, Meshing, Shape, Surface};
use crate::units::Rgb;

fn material(reflectance: f64, specular: f64, transmission: f64, ior: f64) -> Material {
    Material {
        name: format!("{reflectance}-{specular}-{transmission}-{ior}"),
        reflectance: Rgb::splat(reflectance),
        specular: Rgb::splat(specular),
        transmission: Rgb::splat(transmission),
        ior,
    }
}

fn surface(name: &str, material: u32, shape: Shape, exitance: f64) -> Surface {
    Surface {
        name: name.to_string(),
        material: MaterialId(material),
        shape,
        two_sided: false,
        smooth_group: 0,
        exitance: Rgb::splat(exitance),
    }
}

fn scene(materials: Vec<Material>, surfaces: Vec<Surface>) -> Scene {
    Scene {
        path: PathBuf::new(),
        camera: None,
        materials,
        surfaces,
        lights: Vec::new(),
        continuity: Vec::new(),
        meshing: Meshing::default(),
        warnings: Vec::new(),
    }
}

/// The inside of a box, fronts inward.
fn room(low: DVec3, high: DVec3) -> [[DVec3; 4]; 6] {
    let p = |x: u8, y: u8, z: u8| {
        let pick = |k: u8, a: f64, b: f64| if k == 0 { a } else { b };
        DVec3::new(pick(x, low.x, high.x), pick(y, low.y, high.y), pick(z, low.z, high.z))
    };
    [
        [p(0, 0, 0), p(1, 0, 0), p(1, 1, 0), p(0, 1, 0)],
        [p(0, 0, 1), p(0, 1, 1), p(1, 1, 1), p(1, 0, 1)],
        [p(0, 0, 0), p(0, 1, 0), p(0, 1, 1), p(0, 0, 1)],
        [p(1, 0, 0), p(1, 0, 1), p(1, 1, 1), p(1, 1, 0)],
        [p(0, 0, 0), p(0, 0, 1), p(1, 0, 1), p(1, 0, 0)],
        [p(0, 1, 0), p(1, 1, 0), p(1, 1, 1), p(0, 1, 1)],
    ]
}

/// A solution that stores the same indirect irradiance everywhere.
fn uniform(mesh: &Mesh, indirect: f64) -> Solution {
    let e = SplitIrradiance { direct: Rgb::BLACK, indirect: Rgb::splat(indirect) };
    Solution {
        element_irradiance: vec![e; mesh.elements.len()],
        vertex_irradiance: vec![e; mesh.vertices.len()],
        ..Solution::dark(mesh)
    }
}

fn look(eye: DVec3, target: DVec3, fov_y_deg: f64) -> Camera {
    let up = if (target - eye).normalize().z.abs() > 0.9 { DVec3::Y } else { DVec3::Z };
    Camera { eye, target, up, fov_y_deg }
}

fn rendered(scene: &Scene, camera: &Camera, indirect: f64, options: &RenderOptions) -> Rendering {
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let solution = uniform(&mesh, indirect);
    let mut last = 0.0;
    let picture = render(scene, camera, &mesh, &solution, &mut caster, options, &mut |f| {
        assert!(f > last && f <= 1.0);
        last = f;
    });
    assert_eq!(last, 1.0);
    picture.unwrap()
}

fn small() -> RenderOptions {
    RenderOptions {
        width: 20,
        height: 13,
        direct: DirectOptions::full(2),
        reconstruct: Method::Bilinear,
        ..Default::default()
    }
}

/// The radiance that a single ray sees.
fn seen(scene: &Scene, eye: DVec3, target: DVec3) -> f64 {
    let options = RenderOptions { width: 1, height: 1, ..small() };
    rendered(scene, &look(eye, target, 10.0), 0.0, &options).film.pixels[0].0[0]
}

#[test]
fn render_inside_a_half_grey_furnace_shows_one_over_pi_in_every_pixel() {
    let walls = room(DVec3::ZERO, DVec3::ONE);
    let surfaces: Vec<_> =
        (0..6).map(|i| surface(&format!("wall {i}"), 0, Shape::Quad(walls[i]), 0.5)).collect();
    let scene = scene(vec![material(0.5, 0.0, 0.0, 1.0)], surfaces);
    // E = 1 of which 0.5 straight from the walls' own emission: D is gathered, the rest stored.
    let camera = look(DVec3::new(0.2, 0.3, 0.4), DVec3::new(0.9, 0.8, 0.7), 90.0);
    for samples in [1, 4] {
        let picture = rendered(&scene, &camera, 0.5, &RenderOptions { samples, ..small() });
        assert_eq!(picture.n_camera_rays, 20 * 13 * u64::from(samples));
        assert_eq!(picture.film.pixels.len(), 20 * 13);
        for l in &picture.film.pixels {
            assert!((l.0[0] * std::f64::consts::PI - 1.0).abs() < 1e-6, "{l:?}");
        }
        assert!(picture.film.emitter.iter().all(|e| *e));
        assert_eq!(picture.back_hits, vec![0; 6]);
    }
}

#[test]
fn render_of_a_back_is_black_and_counted() {
    let quad = [
        DVec3::new(-9.0, -9.0, 0.0),
        DVec3::new(9.0, -9.0, 0.0),
        DVec3::new(9.0, 9.0, 0.0),
        DVec3::new(-9.0, 9.0, 0.0),
    ];
    let scene = scene(vec![material(0.5, 0.0, 0.0, 1.0)], vec![surface("floor", 0, Shape::Quad(quad), 1.0)]);
    let from = |z: f64| rendered(&scene, &look(DVec3::new(0.0, 0.0, z), DVec3::ZERO, 40.0), 1.0, &small());
    let (front, back) = (from(2.0), from(-2.0));
    assert_eq!((front.back_hits[0], back.back_hits[0]), (0, 20 * 13));
    assert!(back.film.pixels.iter().all(|l| l.is_black()));
    assert!(!back.film.emitter.contains(&true));
    assert!(front.film.pixels.iter().all(|l| (l.0[1] * std::f64::consts::PI - 1.5).abs() < 1e-9));
}

/// A mirror in the plane z = 0 and a small lamp above it that looks down.
fn mirror_scene(specular: f64) -> (Scene, DVec3) {
    let big = [
        DVec3::new(-9.0, -9.0, 0.0),
        DVec3::new(9.0, -9.0, 0.0),
        DVec3::new(9.0, 9.0, 0.0),
        DVec3::new(-9.0, 9.0, 0.0),
    ];
    let lamp_at = DVec3::new(1.0, 0.5, 2.0);
    let lamp = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)]
        .map(|(x, y)| lamp_at + 0.1 * DVec3::new(x, y, 0.0));
    let surfaces =
        vec![surface("mirror", 0, Shape::Quad(big), 0.0), surface("lamp", 1, Shape::Quad(lamp), 3.0)];
    (scene(vec![material(0.0, specular, 0.0, 1.0), material(0.0, 0.0, 0.0, 1.0)], surfaces), lamp_at)
}

#[test]
fn mirror_shows_the_lamp_at_its_mirror_image_dimmed_by_the_reflectance() {
    let (scene, lamp) = mirror_scene(0.75);
    let eye = DVec3::new(-1.5, 0.2, 1.0);
    let image = DVec3::new(lamp.x, lamp.y, -lamp.z);
    let want = 0.75 * 3.0 / std::f64::consts::PI;
    assert!((seen(&scene, eye, image) - want).abs() < 1e-12);
    assert!((seen(&scene, eye, image + DVec3::new(0.099, 0.0, 0.0)) - want).abs() < 1e-12);
    assert_eq!(seen(&scene, eye, image + DVec3::new(0.101, 0.0, 0.0)), 0.0);
    let options = RenderOptions { width: 1, height: 1, max_depth: 0, ..small() };
    let flat = rendered(&scene, &look(eye, image, 10.0), 0.0, &options);
    assert_eq!(flat.film.pixels[0], Rgb::BLACK, "no recursion at depth 0");
    assert_eq!(flat.film.emitter, [false], "an emitter seen in a mirror is not seen directly");
}

/// A lamp behind a pane or ball of glass.
fn behind(glass: Shape, transmission: f64) -> Scene {
    let lamp = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)]
        .map(|(x, y)| DVec3::new(50.0 * x, 50.0 * y, 5.0));
    let materials = vec![material(0.0, 0.0, transmission, 1.52), material(0.0, 0.0, 0.0, 1.0)];
    scene(
        materials,
        vec![surface("glass", 0, glass, 0.0), surface("lamp", 1, Shape::Quad(lamp), std::f64::consts::PI)],
    )
}

#[test]
fn pane_of_glass_passes_the_slabs_transmittance_from_both_sides() {
    let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 1.0));
    let turned = [square[3], square[2], square[1], square[0]];
    for quad in [square, turned] {
        let scene = behind(Shape::Quad(quad), 0.9);
        let straight = seen(&scene, DVec3::ZERO, DVec3::Z);
        assert!((straight - 0.9 * 0.918_32).abs() < 1e-5, "{straight}");
        // At 60 degrees: through (0.6, 0, 1) from x = 0.6 - tan 60.
        let x = 0.6 - 3f64.sqrt();
        let slanted = seen(&scene, DVec3::new(x, 0.0, 0.0), DVec3::new(0.6, 0.0, 1.0));
        assert!((slanted - 0.9 * 0.843_47).abs() < 1e-5, "{slanted}");
    }
}

#[test]
fn ball_of_glass_passes_two_interfaces_straight_through_its_middle() {
    let ball = Shape::Sphere { center: DVec3::new(0.0, 0.0, 2.0), radius: 0.5, inward: false };
    // Share 1 of the transmission: in, out; inner reflections go back and forth and add R^2 T^2 + ...
    let scene = behind(ball, 1.0 - 1e-9);
    let through = seen(&scene, DVec3::ZERO, DVec3::Z);
    let r = (0.52_f64 / 2.52).powi(2);
    let want = (1.0 - r).powi(2) * (1.0 + r * r);
    assert!((through - want).abs() < 2e-3, "{through}, not {want}");
    let beside = seen(&scene, DVec3::ZERO, DVec3::new(0.6, 0.0, 2.0));
    assert!((beside - 1.0).abs() < 1e-12);
}

#[test]
fn render_with_one_and_three_threads_gives_the_same_bits() {
    let walls = room(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 2.0));
    let mut surfaces: Vec<_> = (0..6)
        .map(|i| {
            surface(
                &format!("wall {i}"),
                u32::from(i == 2),
                Shape::Quad(walls[i]),
                if i == 1 { 1.0 } else { 0.0 },
            )
        })
        .collect();
    surfaces.push(surface(
        "ball",
        2,
        Shape::Sphere { center: DVec3::new(0.2, 0.1, 0.5), radius: 0.3, inward: false },
        0.0,
    ));
    let materials =
        vec![material(0.5, 0.0, 0.0, 1.0), material(0.1, 0.8, 0.0, 1.0), material(0.0, 0.0, 0.9, 1.5)];
    let scene = scene(materials, surfaces);
    let camera = look(DVec3::new(0.8, -0.9, 1.2), DVec3::new(0.0, 0.2, 0.6), 80.0);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rendered(&scene, &camera, 0.3, &RenderOptions { samples: 2, ..small() }).film)
    };
    let one = run(1);
    assert!(one.pixels.iter().all(|l| l.is_finite() && l.min_channel() >= 0.0));
    assert!(one.pixels.iter().filter(|l| l.is_black()).count() < 5, "nothing black that should be lit");
    assert_eq!(one, run(3));
}
