//! `[[mesh]]`: the order of the transform, names, materials, lights, faults.

use std::path::PathBuf;

use super::*;
use crate::geom::Aabb;
use crate::scene::{Scene, Shape};

/// A box of 1 x 2 x 3 units with a corner at the origin, its bottom of another material.
pub(crate) const BOX_OBJ: &str = "mtllib box.mtl\no crate\n\
    v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 3\nv 1 0 3\nv 1 2 3\nv 0 2 3\n\
    usemtl wood\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nusemtl felt\nf 4 3 2 1\n";

const BOX_MTL: &str = "newmtl wood\nKd 0.5 0.4 0.3\nnewmtl felt\nKd 0.1 0.5 0.1\nKe 1 2 3\n";

/// A folder with the box, and a scene of these lines.
pub(crate) fn scene_file(lines: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("box.obj"), BOX_OBJ).unwrap();
    std::fs::write(folder.path().join("box.mtl"), BOX_MTL).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, format!("version = 1\n{lines}")).unwrap();
    (folder, path)
}

fn around(scene: &Scene) -> Aabb {
    let points = scene.surfaces.iter().flat_map(|s| match &s.shape {
        Shape::Faces(set) => set.points().to_vec(),
        _ => panic!("{}", s.name),
    });
    Aabb::around(points)
}

fn assert_near(a: DVec3, b: DVec3) {
    assert!((a - b).length() < 1e-12, "{a} is not {b}");
}

#[test]
fn mesh_is_scaled_then_turned_about_x_y_z_then_moved() {
    let keys = "unit = \"cm\"\nscale = 50.0\nrotate_deg = [90, 0, 90]\ntranslate = [10, 20, 30]\n";
    let (_folder, path) = scene_file(&format!("[[mesh]]\nfile = \"box.obj\"\n{keys}"));
    let around = around(&Scene::load(&path).unwrap());
    // (x, y, z) / 2 --90 about x--> (x, -z, y) --90 about z--> (z, x, y).
    assert_near(around.min, DVec3::new(10.0, 20.0, 30.0));
    assert_near(around.max, DVec3::new(11.5, 20.5, 31.0));
    let (_folder, path) =
        scene_file("[[mesh]]\nfile = \"box.obj\"\nunit = \"in\"\nrotate_deg = [0, 30, 0]\n");
    let around = self::around(&Scene::load(&path).unwrap());
    let (s, c) = 30_f64.to_radians().sin_cos();
    assert_near(around.max, 0.0254 * DVec3::new(c + 3.0 * s, 2.0, 3.0 * c));
    assert_near(around.min, 0.0254 * DVec3::new(0.0, 0.0, -s));
}

#[test]
fn mesh_brings_its_materials_under_its_name_and_one_surface_for_each() {
    let (_folder, path) = scene_file("[[mesh]]\nfile = \"box.obj\"\n[[mesh]]\nfile = \"box.obj\"\n");
    let scene = Scene::load(&path).unwrap();
    let names: Vec<&str> = scene.surfaces.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["box/crate/wood", "box/crate/felt", "box/crate/wood #2", "box/crate/felt #2"]);
    let felt = &scene.surfaces[1];
    assert_eq!(scene.material(felt).reflectance.0, [0.1, 0.5, 0.1]);
    assert_eq!(scene.material(felt).name, "box/felt");
    assert_eq!(felt.exitance.0, [1.0, 2.0, 3.0]);
    assert!(felt.two_sided);
    assert!((felt.shape.area_m2() - 2.0).abs() < 1e-12);
    assert!((scene.surfaces[0].shape.area_m2() - 20.0).abs() < 1e-12);
}

#[test]
fn mesh_with_a_material_of_the_scene_wears_it_and_shares_its_power_among_its_faces() {
    let (folder, path) =
        scene_file("[materials.lamp]\npower_w = 44.0\n[[mesh]]\nfile = \"box.obj\"\nmaterial = \"lamp\"\n");
    let scene = Scene::load(&path).unwrap();
    assert_eq!(scene.materials.len(), 1);
    // The power is of each surface, both sides: 44 W / (2 x 20 m^2).
    assert!((scene.surfaces[0].exitance.0[0] - 1.1).abs() < 1e-12);
    // What its own materials lack is not missed.
    std::fs::remove_file(folder.path().join("box.mtl")).unwrap();
    assert_eq!(Scene::load(&path).unwrap().warnings, Vec::<String>::new());
}

#[test]
fn mesh_faults_are_placed_in_the_scene_and_those_of_its_file_there() {
    let faults = [
        (
            "file = \"box.obj\"\nmaterial = \"wod\"\n[materials.wood]\n",
            "scene.toml:4:12: ",
            "did you mean \"wood\"",
        ),
        ("file = \"../box.obj\"\n", "scene.toml:3:8: ", "outside the scene's folder"),
        ("file = \"/etc/passwd\"\n", "scene.toml:3:8: ", "outside the scene's folder"),
        ("file = \"http://x.org/a.obj\"\n", "scene.toml:3:8: ", "outside the scene's folder"),
        ("file = \"lamp.ies\"\n", "scene.toml:3:8: ", "IES photometric files are not read"),
        ("file = \"box.stl\"\n", "scene.toml:3:8: ", "expected .obj, .gltf or .glb"),
        ("file = \"none.glb\"\n", "scene.toml:3:8: ", "no such mesh file"),
        ("file = \"box.obj\"\nunit = \"ft\"\n", "scene.toml:4:8: ", "unknown variant"),
        ("file = \"box.obj\"\nscale = 0\n", "scene.toml:4:9: ", "a length over 0"),
        ("file = \"bad.obj\"\n", "bad.obj:2:1: ", "point 9 of 1 (a [[mesh]] of "),
        ("file = \"box.obj\"\nscale = 1e6\n", "box.obj: ", "expected coordinates within +-1e6 m"),
    ];
    for (keys, place, words) in faults {
        let (folder, path) = scene_file(&format!("[[mesh]]\n{keys}"));
        std::fs::write(folder.path().join("bad.obj"), "v 0 0 0\nf 1 9 1\n").unwrap();
        let shown = Scene::load(&path).unwrap_err().to_string();
        assert!(shown.contains(place) && shown.contains(words), "{keys}: {shown}");
    }
}

#[test]
fn turned_by_quarter_turns_is_exact() {
    assert_eq!(Placement::turned(DVec3::new(90.0, -90.0, 450.0)) * DVec3::new(1.0, 2.0, 3.0), {
        // About x: (1, -3, 2); about y by -90: (-2, -3, 1); about z by 90: (3, -2, 1).
        DVec3::new(3.0, -2.0, 1.0)
    });
}
