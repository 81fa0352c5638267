//! Models from other software, end to end: the same room as TOML, OBJ, glTF and GLB; closed forms; hostile files.

use std::path::{Path, PathBuf};

use radiosity_engine::direct::{DirectLight, DirectOptions, LitPoint, ShadePoint};
use radiosity_engine::frame::{self, CasterChoice, FrameOptions, PassOne, Solved};
use radiosity_engine::geom::DVec3;
use radiosity_engine::mesh::Mesh;
use radiosity_engine::radiosity::SolveOptions;
use radiosity_engine::radiosity::summary::summarise;
use radiosity_engine::raycast::RayCaster;
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::scene::{Light, Scene, Shape};

#[path = "common/models.rs"]
mod models;

use models::{Hostile, Room, hostile};

fn solve(path: &Path, elements: u32) -> Solved {
    let options = FrameOptions {
        adaptive: None,
        elements: Some(elements),
        caster: CasterChoice::Software,
        pass_1: PassOne::Solve(SolveOptions { unshot_share: 1e-6, ..SolveOptions::default() }),
    };
    frame::solve_scene(path, &options, &mut |_| {}).unwrap()
}

/// Incident power by kind of surface: walls, lamp (W, green).
fn incident(solved: &Solved) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for s in summarise(&solved.scene, &solved.mesh, &solved.solution) {
        sums[usize::from(s.name.contains("lamp"))] += s.incident_w.0[1];
    }
    sums
}

#[test]
fn room_as_toml_obj_gltf_and_glb_solves_to_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let paths = Room::default().write(folder.path());
    let solved: Vec<Solved> = paths.iter().map(|p| solve(p, 400)).collect();
    let expected = incident(&solved[0]);
    assert!(expected.iter().all(|w| *w > 0.0), "{expected:?}");
    for (solved, path) in solved.iter().zip(&paths) {
        assert_eq!(solved.mesh.elements.len(), 432, "{}", path.display());
        let found = incident(solved);
        for (a, b) in found.iter().zip(expected) {
            // glTF holds emission in single precision.
            assert!((a - b).abs() < 1e-6 * b, "{}: {found:?} is not {expected:?}", path.display());
        }
    }
}

#[test]
fn furnace_of_an_imported_box_is_uniform_at_m_over_one_minus_rho() {
    // Reflectance 0.5 and exitance 0.5 everywhere: B = 1, E = 1, in a box of 2 x 3 x 4 m with fronts inward.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("furnace.obj");
    std::fs::write(folder.path().join("f.mtl"), "newmtl f\nKd 0.5 0.5 0.5\nKe 0.5 0.5 0.5\n").unwrap();
    let text = "mtllib f.mtl\nv 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nv 0 0 4\nv 2 0 4\nv 2 3 4\nv 0 3 4\nusemtl f\n\
                f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
    std::fs::write(&path, text).unwrap();
    let solved = solve(&path, 800);
    let scene = &solved.scene;
    assert_eq!((scene.surfaces.len(), scene.lights.len()), (1, 0));
    assert!((scene.surfaces[0].shape.area_m2() - 52.0).abs() < 1e-12);
    let (front, back) = solved.mesh.surface_elements(scene.surface_named("furnace").unwrap());
    for e in front {
        let irradiance = solved.solution.element_irradiance[e as usize].total().0[0];
        assert!((irradiance - 1.0).abs() < 0.01, "element {e}: {irradiance}");
    }
    for e in back {
        assert_eq!(solved.solution.element_irradiance[e as usize].total().0[0], 0.0);
    }
}

#[test]
fn lamp_of_two_triangles_gives_the_direct_light_of_the_quad() {
    let folder = tempfile::tempdir().unwrap();
    let [toml, obj, ..] = &Room::default().write(folder.path())[..] else { panic!("files") };
    let light = |path: &PathBuf| {
        let scene = Scene::load(path).unwrap();
        let mesh = Mesh::build(&scene);
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let options = DirectOptions::full(4);
        let mut direct = DirectLight::new(&scene, &mesh, caster.surface_offset_m(), options, 1);
        let up = DVec3::Z;
        let points: Vec<LitPoint> = (0..25_u64)
            .map(|k| ShadePoint {
                position: DVec3::new(0.1 + 0.2 * (k % 5) as f64, 0.1 + 0.2 * (k / 5) as f64, 1e-9),
                normal: up,
                geometric_normal: up,
                key: k,
            })
            .map(LitPoint::from)
            .collect();
        direct.gather(&mut caster, &points).unwrap()
    };
    for (a, b) in light(toml).iter().zip(light(obj)) {
        assert!((a.0[0] - b.0[0]).abs() < 1e-12 && a.0[0] > 0.0, "{a:?} {b:?}");
    }
}

#[test]
fn gltf_lights_camera_and_emission_have_their_stated_units() {
    let folder = tempfile::tempdir().unwrap();
    let paths = Room { bulb: true, ..Room::default() }.write(folder.path());
    let scene = Scene::load(&paths[3]).unwrap();
    let Light::Point { position, intensity } = scene.lights[0] else { panic!("{:?}", scene.lights) };
    // 1790 cd are 10 W/sr; the node stands at (0.5, 0.5, 0.5) and is turned, which moves no point.
    assert!((position - DVec3::splat(0.5)).length() < 1e-6);
    assert!((intensity.0[0] - 10.0).abs() < 1e-6 && (intensity.0[1] - 5.0).abs() < 1e-6);
    let camera = scene.camera.unwrap();
    assert!((camera.eye - DVec3::new(0.5, 0.1, 0.5)).length() < 1e-6);
    assert!(((camera.target - camera.eye) - DVec3::Y).length() < 1e-6, "{camera:?}");
    assert!((camera.fov_y_deg - 60.0).abs() < 1e-4);
    // L in cd/m^2, M = pi L / 179.
    let lamp = &scene.surfaces[scene.surface_named("room/lamp").unwrap().0 as usize];
    assert!((lamp.exitance.0[0] - 4.0).abs() < 1e-6, "{:?}", lamp.exitance);
}

#[test]
fn mirrored_nodes_turn_their_faces_so_that_fronts_stay_fronts() {
    let folder = tempfile::tempdir().unwrap();
    let area_vector = |room: &Room| {
        let path = &room.write(folder.path())[2];
        let scene = Scene::load(path).unwrap();
        let Shape::Faces(set) = &scene.surfaces[0].shape else { panic!("faces") };
        // Six times the volume that the fronts enclose: negative, they look inwards.
        set.faces()
            .map(|f| {
                let p = |k: usize| set.points()[f[k] as usize] - DVec3::splat(0.5);
                let half = |a, b, c| p(a).dot(p(b).cross(p(c)));
                half(0, 1, 2) + if f.len() == 4 { half(0, 2, 3) } else { 0.0 }
            })
            .sum::<f64>()
    };
    let plain = area_vector(&Room::default());
    let mirrored = area_vector(&Room { mirrored: true, ..Room::default() });
    assert!(plain < -4.9 && (plain - mirrored).abs() < 1e-5, "{plain} {mirrored}");
}

#[test]
fn model_alone_gets_a_camera_and_light_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bare.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        .unwrap();
    let scene = Scene::load(&path).unwrap();
    assert!(scene.camera.is_some() && scene.lights.len() == 2);
    let all = scene.warnings.join("\n");
    for words in ["no camera in the file", "nothing in the file emits light", "grey (reflectance 0.6)"] {
        assert!(all.contains(words), "{all}");
    }
    assert_eq!(scene.materials[0].reflectance.0, [0.6; 3]);
}

#[test]
fn hostile_models_are_refused_by_name() {
    let cases = hostile();
    assert!(cases.len() > 50, "{}", cases.len());
    let mut wrong = Vec::new();
    for Hostile { name, file, bytes, words } in &cases {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(file);
        std::fs::write(&path, bytes).unwrap();
        if file.ends_with(".mtl") {
            std::fs::write(
                folder.path().join("m.obj"),
                format!("mtllib {file}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            )
            .unwrap();
        }
        let load = if file.ends_with(".mtl") { folder.path().join("m.obj") } else { path };
        match Scene::load(&load) {
            Ok(_) => wrong.push(format!("{name}: accepted")),
            Err(e) => {
                let shown = e.to_string();
                if !shown.contains(file) || shown.contains('\n') || !words.iter().all(|w| shown.contains(w)) {
                    wrong.push(format!("{name}: expected {words:?}, is {shown}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}
