//! The shipped scenes: each loads without a warning; closed ones are watertight and wound inward.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use radiosity_engine::scene::{Scene, Shape};

/// Every scene file of the repository, with the name of its folder; `spaces` has design spaces.
fn shipped() -> Vec<(String, PathBuf)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut found: Vec<_> = std::fs::read_dir(root)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir() && !path.ends_with("spaces"))
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), path.join("scene.toml")))
        .collect();
    found.sort();
    found
}

fn load(name: &str) -> Scene {
    let (_, path) = shipped().into_iter().find(|(n, _)| n == name).unwrap();
    Scene::load(&path).unwrap()
}

/// Corners of planar surfaces.
fn polygons(scene: &Scene) -> Vec<(String, Vec<DVec3>)> {
    scene
        .surfaces
        .iter()
        .filter_map(|s| match s.shape {
            Shape::Quad(v) => Some((s.name.clone(), v.to_vec())),
            Shape::Triangle(v) => Some((s.name.clone(), v.to_vec())),
            _ => None,
        })
        .collect()
}

/// Six times the volume enclosed, positive when fronts look outward; and twice the vector area, 0 when closed.
fn volume_and_area(polygons: &[(String, Vec<DVec3>)]) -> (f64, DVec3) {
    let mut volume = 0.0;
    let mut area = DVec3::ZERO;
    for (_, p) in polygons {
        for i in 1..p.len() - 1 {
            volume += p[0].dot(p[i].cross(p[i + 1]));
            area += (p[i] - p[0]).cross(p[i + 1] - p[0]);
        }
    }
    (volume, area)
}

#[test]
fn shipped_scenes_all_load_with_a_camera_and_without_warnings() {
    let all = shipped();
    assert!(all.len() >= 10, "{all:?}");
    for (name, path) in all {
        let scene = Scene::load(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
        assert!(scene.camera.is_some(), "{name}");
    }
}

#[test]
fn closed_rooms_enclose_their_volume_with_fronts_inward() {
    let rooms = [
        ("lit-cube", 1.0),
        ("furnace", 1.0),
        ("point-room", 64.0),
        ("sphere-room", 4.0 * 5.0 * 2.8),
        ("mirror-glass", 4.0 * 5.0 * 2.8),
    ];
    for (name, volume) in rooms {
        let room: Vec<_> =
            polygons(&load(name)).into_iter().filter(|(surface, _)| !surface.starts_with("box")).collect();
        let (six_volumes, area) = volume_and_area(&room);
        assert!((six_volumes + 6.0 * volume).abs() < 1e-9, "{name}: {six_volumes}");
        assert!(area.length() < 1e-9, "{name} is open: {area}");
    }
}

/// Every edge of a polygon lies on the opposite way along the edges of others: counted by pieces between corners.
#[test]
fn closed_rooms_have_every_edge_twice_once_each_way() {
    for name in ["lit-cube", "furnace", "point-room", "sphere-room", "mirror-glass"] {
        let room: Vec<_> =
            polygons(&load(name)).into_iter().filter(|(surface, _)| !surface.starts_with("box")).collect();
        let corners: Vec<DVec3> = room.iter().flat_map(|(_, p)| p.iter().copied()).collect();
        let key = |p: DVec3| p.to_array().map(|c| (c + 0.0).to_bits());
        let mut balance: HashMap<_, i32> = HashMap::new();
        let mut n_pieces = 0;
        for (_, p) in &room {
            for i in 0..p.len() {
                let (a, b) = (p[i], p[(i + 1) % p.len()]);
                // Corners of others on this edge cut it; coordinates are equal exactly, so no tolerance.
                let mut on: Vec<DVec3> = corners
                    .iter()
                    .copied()
                    .filter(|&c| (c - a).cross(b - a) == DVec3::ZERO && (c - a).dot(c - b) <= 0.0)
                    .collect();
                on.sort_by(|p, q| (*p - a).length().total_cmp(&(*q - a).length()));
                on.dedup();
                for piece in on.windows(2) {
                    let (from, to) = (key(piece[0]), key(piece[1]));
                    *balance.entry(if from < to { (from, to) } else { (to, from) }).or_default() +=
                        if from < to { 1 } else { -1 };
                    n_pieces += 1;
                }
            }
        }
        assert!(n_pieces >= 24, "{name}");
        let open = balance.values().filter(|n| **n != 0).count();
        assert_eq!(open, 0, "{name}: {open} of {} pieces of edges are open", balance.len());
    }
}

#[test]
fn cornell_box_has_its_measured_areas_and_is_open_in_front_only() {
    let scene = load("cornell-box");
    let area = |name: &str| scene.surfaces[scene.surface_named(name).unwrap().0 as usize].shape.area_m2();
    assert!((area("lamp") - 1.3 * 1.05).abs() < 1e-12);
    assert!((area("green") - 5.592 * 5.488).abs() < 1e-12);
    assert!((area("floor") - 0.5 * (5.528 + 5.496) * 5.592).abs() < 1e-12);
    let is_wall = |name: &str| !name.starts_with("short") && !name.starts_with("tall");
    let walls: Vec<_> = polygons(&scene).into_iter().filter(|(name, _)| is_wall(name)).collect();
    // What is missing of a closed surface is the front, a trapezoid at z = 0 that looks along -z.
    let (_, twice_area) = volume_and_area(&walls);
    let front = 0.5 * (5.528 + 5.56) * 5.488;
    assert!((twice_area / 2.0 - DVec3::new(0.0, 0.0, -front)).length() < 1e-9, "{twice_area}");
    let blocks: Vec<_> = polygons(&scene).into_iter().filter(|(name, _)| !is_wall(name)).collect();
    assert_eq!(blocks.len(), 10);
    // Open at the bottom, which lies in y = 0 and adds nothing to the volume: outward means positive.
    assert!(volume_and_area(&blocks).0 > 6.0 * 5.0);
}

#[test]
fn emitters_of_the_shipped_scenes_have_the_exitance_that_their_unit_means() {
    let lumens = |name: &str, surface: &str| {
        let scene = load(name);
        let s = &scene.surfaces[scene.surface_named(surface).unwrap().0 as usize];
        179.0 * s.exitance.luminance() * s.shape.area_m2()
    };
    assert!((lumens("sphere-room", "lamp") - 6000.0).abs() < 1e-8);
    let area = 1.2 * 1.2;
    assert!((lumens("mirror-glass", "lamp") - 5000.0 * std::f64::consts::PI * area).abs() < 1e-8);
}

#[test]
fn scenes_readme_lists_every_scene_with_its_number_of_surfaces_and_its_example_loads() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    for (name, path) in shipped() {
        let row = readme.lines().find(|l| l.starts_with(&format!("| `{name}` |")));
        let cells: Vec<_> = row.unwrap_or_else(|| panic!("{name} is not listed")).split('|').collect();
        let n_surfaces = Scene::load(&path).unwrap().surfaces.len();
        assert_eq!(cells[3].trim(), n_surfaces.to_string(), "{name}");
    }
    let example = readme.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let scene = Scene::parse(example, Path::new("example.toml")).unwrap();
    assert!(scene.warnings.is_empty() && scene.surfaces.len() == 2);
}
