//! Cutting of face sets: areas, sizes, edges that meet, counts told beforehand.

use std::path::PathBuf;
use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::mesh::Mesh;
use crate::scene::faces::tests::{raw, set};
use crate::scene::{Material, MaterialId, Meshing, Scene, Shape, Surface};
use crate::units::Rgb;

fn scene(sets: Vec<FaceSet>, target: MeshTarget) -> Scene {
    let surface = |(i, set)| Surface {
        name: format!("set {i}"),
        material: MaterialId(0),
        shape: Shape::Faces(Arc::new(set)),
        two_sided: false,
        smooth_group: 0,
        exitance: Rgb::BLACK,
    };
    Scene {
        path: PathBuf::from("test"),
        camera: None,
        materials: vec![Material {
            name: "m".to_owned(),
            reflectance: Rgb::splat(0.5),
            specular: Rgb::BLACK,
            transmission: Rgb::BLACK,
            ior: 1.5,
        }],
        surfaces: sets.into_iter().enumerate().map(surface).collect(),
        lights: Vec::new(),
        continuity: Vec::new(),
        meshing: Meshing { target, ..Meshing::default() },
        warnings: Vec::new(),
    }
}

fn longest_edge(mesh: &Mesh) -> f64 {
    let edges = mesh.elements.iter().flat_map(|e| {
        let p = mesh.polygon(&e.corners);
        (0..p.len()).map(|i| p[i].distance(p[(i + 1) % p.len()])).collect::<Vec<_>>()
    });
    edges.fold(0.0, f64::max)
}

/// What must hold of every mesh.
fn check(scene: &Scene) -> Mesh {
    let mesh = Mesh::build(scene);
    let area: f64 = scene.surfaces.iter().map(|s| s.shape.area_m2()).sum();
    assert!((mesh.total_area_m2() - area).abs() < 1e-9 * area, "{} {area}", mesh.total_area_m2());
    assert_eq!(mesh.n_t_junctions, 0);
    assert_eq!(Mesh::planned_elements(scene), mesh.elements.len() as u64);
    assert!(mesh.elements.iter().all(|e| e.area_m2 > 0.0));
    mesh
}

/// A closed surface of triangles: a bumpy octahedron whose corners are pulled about.
fn bumpy(pulls: &[f64; 6]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let points = axes.iter().zip(pulls).map(|(a, k)| *a * *k).collect();
    let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    (points, faces.to_vec())
}

proptest! {
    #[test]
    fn triangles_of_any_sizes_are_cut_without_t_junctions_to_elements_no_longer_than_asked(
        pulls in proptest::array::uniform6(0.2..8.0f64), size in 0.15..2.0f64
    ) {
        let (points, faces) = bumpy(&pulls);
        let polygons: Vec<&[u32]> = faces.iter().map(|f| &f[..]).collect();
        let mesh = check(&scene(vec![set(&raw(&points, &polygons))], MeshTarget::MaxElementM(size)));
        prop_assert!(longest_edge(&mesh) <= size * (1.0 + 1e-9), "{} {size}", longest_edge(&mesh));
    }

    #[test]
    fn faces_of_several_sets_meet_along_their_common_edges(
        pulls in proptest::array::uniform6(0.2..8.0f64), n in 20u32..3000, split in 1usize..8
    ) {
        let (points, faces) = bumpy(&pulls);
        let polygons: Vec<&[u32]> = faces.iter().map(|f| &f[..]).collect();
        let sets = [&polygons[..split], &polygons[split..]].map(|part| set(&raw(&points, part)));
        check(&scene(sets.to_vec(), MeshTarget::Elements(n)));
    }
}

#[test]
fn slivers_of_quads_take_about_the_elements_that_are_wanted_not_their_length_squared() {
    let p = DVec3::new;
    // One corner of a unit cube is 65,535 m away; a parallelogram of two long sides and hardly an area.
    let pulled = [p(0., 0., 0.), p(1., 0., 0.), p(65535., 1., 0.), p(0., 1., 0.)];
    let skewed = [p(0., 0., 0.), p(1000., 0., 0.), p(2000., 1., 0.), p(1000., 1., 0.)];
    for corners in [pulled, skewed] {
        for n in [1, 60, 1000] {
            let mesh = check(&scene(vec![set(&raw(&corners, &[&[0, 1, 2, 3]]))], MeshTarget::Elements(n)));
            assert!(mesh.elements.len() <= 8 * (n as usize + 1), "{n}: {}", mesh.elements.len());
        }
    }
}

#[test]
fn small_faces_are_one_element_each_and_large_ones_two_by_two_a_patch() {
    let n = 8_u32;
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let points: Vec<DVec3> =
        (0..=n).flat_map(|j| (0..=n).map(move |i| DVec3::new(f64::from(i), f64::from(j), 0.0))).collect();
    let quads: Vec<[u32; 4]> = (0..n * n)
        .map(|k| (k % n, k / n))
        .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        .collect();
    let polygons: Vec<&[u32]> = quads.iter().map(|q| &q[..]).collect();
    let grid = set(&raw(&points, &polygons));
    let mesh = |elements| check(&scene(vec![grid.clone()], MeshTarget::Elements(elements)));
    for elements in [1, 64] {
        let mesh = mesh(elements);
        assert_eq!((mesh.elements.len(), mesh.patches.len(), mesh.vertices.len()), (64, 64, 81));
    }
    assert_eq!(mesh(256).elements.len(), 256);
    assert_eq!((mesh(1024).elements.len(), mesh(1024).patches.len()), (1024, 256));
}

#[test]
fn quad_face_is_meshed_as_the_quad_of_a_scene_file() {
    let p = DVec3::new;
    let corners = [p(0.1, 0.0, 0.0), p(3.0, 0.2, 0.0), p(3.4, 2.0, 0.0), p(0.3, 1.7, 0.0)];
    for n in [4, 30, 200] {
        let faces = scene(vec![set(&raw(&corners, &[&[0, 1, 2, 3]]))], MeshTarget::Elements(n));
        let mut quad = faces.clone();
        quad.surfaces[0].shape = Shape::Quad(corners);
        let (a, b) = (Mesh::build(&faces), Mesh::build(&quad));
        assert_eq!(a.elements.len(), b.elements.len());
        let close =
            |v: &crate::mesh::Vertex| b.vertices.iter().any(|w| w.position.distance(v.position) < 1e-12);
        assert!(a.vertices.iter().all(close));
    }
}
