//! Refined meshes: shadow lines where geometry puts them, limits, the same bits for any number of threads.

use glam::DVec3;

use super::*;
use crate::mesh::tests::{check, room, scene, surface};
use crate::mesh::{Continuity, ElementId};
use crate::raycast::software::SoftwareCaster;
use crate::scene::{Light, MeshTarget, Shape, Surface};
use crate::units::Rgb;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A room of 4 x 4 x 2 m with a plate of 1 x 1 m halfway between a lamp point at its ceiling's middle and the floor: its
/// shadow is 2 x 2 m.
fn plate_room(elements: u32) -> Scene {
    let mut surfaces = room(4.0, 4.0, 2.0);
    let corners = [v(1.5, 1.5, 0.95), v(2.5, 1.5, 0.95), v(2.5, 2.5, 0.95), v(1.5, 2.5, 0.95)];
    surfaces.push(Surface { two_sided: true, ..surface("plate", Shape::Quad(corners)) });
    let light = Light::Point { position: v(2.0, 2.0, 1.9), intensity: Rgb::splat(10.0) };
    Scene { lights: vec![light], ..scene(surfaces, MeshTarget::Elements(elements)) }
}

fn refined(scene: &Scene, options: &RefineOptions) -> (Mesh, RefineReport) {
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let solve_options = SolveOptions { unshot_share: 0.02, ..SolveOptions::default() };
    refine(scene, &mesh, &mut caster, &solve_options, options, &mut |_| {}).unwrap()
}

#[test]
fn shadow_of_a_plate_is_found_as_lines_and_elements_on_them_are_as_deep_as_allowed() {
    let scene = plate_room(700);
    let options = RefineOptions { max_depth: 2, wanted_error: 0.05, ..RefineOptions::default() };
    let (mesh, report) = refined(&scene, &options);
    check_areas(&mesh, &scene);
    assert!(report.lines.n_segments > 0 && report.lines.n_flagged_edges > 0, "{report:?}");
    assert!(report.n_elements <= report.n_limit);
    // The shadow's border: |x - 2| = 1 with |y - 2| < 1, and the other way round.
    let on_border = |p: DVec3| (p.x - 2.0).abs().max((p.y - 2.0).abs()) - 1.0;
    let (front, _) = mesh.surface_elements(crate::scene::SurfaceId(0));
    let (mut n_crossed, mut n_flagged) = (0, 0);
    for e in front {
        let element = &mesh.elements[e as usize];
        let corners = mesh.polygon(&element.corners);
        let sides: Vec<f64> = corners.iter().map(|p| on_border(*p)).collect();
        let (low, high) =
            (sides.iter().copied().fold(f64::MAX, f64::min), sides.iter().copied().fold(f64::MIN, f64::max));
        if low < -1e-3 && high > 1e-3 {
            assert_eq!(element.place.level(), 3, "an element over the border at {:?}", corners[0]);
            n_crossed += 1;
        }
        for k in 0..4 {
            let broken = element.continuity[k] == Continuity::Broken && element.neighbours[k].is_some();
            if broken {
                let size = corners[0].distance(corners[2]);
                let middle = 0.5 * (corners[k] + corners[(k + 1) % 4]);
                assert!(on_border(middle).abs() <= size, "a flag far off the line, at {middle}");
                n_flagged += 1;
            }
        }
    }
    assert!(n_crossed + n_flagged > 20, "{n_crossed} crossed, {n_flagged} flagged");
}

fn check_areas(mesh: &Mesh, scene: &Scene) {
    let sides = |s: &Surface| if s.two_sided { 2.0 } else { 1.0 };
    let area: f64 = scene.surfaces.iter().map(|s| sides(s) * s.shape.area_m2()).sum();
    assert!((mesh.total_area_m2() - area).abs() < 1e-9 * area);
}

#[test]
fn line_that_runs_on_element_edges_flags_exactly_those() {
    // 0.25 m elements: the shadow's border at 1 and 3 m lies on edges of them.
    let scene = plate_room(700);
    let mut surfaces = scene.surfaces.clone();
    surfaces.truncate(7);
    let scene = Scene {
        surfaces,
        meshing: crate::scene::Meshing {
            target: MeshTarget::MaxElementM(0.25),
            adaptive: true,
            ..crate::scene::Meshing::default()
        },
        ..scene
    };
    let mut mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let report = flag_shadow_lines(&scene, &mut mesh, &mut caster).unwrap();
    let (front, _) = mesh.surface_elements(crate::scene::SurfaceId(0));
    let mut n = 0;
    for e in front {
        let element = &mesh.elements[e as usize];
        let corners = mesh.polygon(&element.corners);
        for k in 0..4 {
            let middle = 0.5 * (corners[k] + corners[(k + 1) % 4]);
            let on_line = ((middle.x - 2.0).abs().max((middle.y - 2.0).abs()) - 1.0).abs() < 1e-9;
            if element.neighbours[k].is_some() {
                assert_eq!(element.continuity[k] == Continuity::Broken, on_line, "edge at {middle}");
                n += u32::from(on_line);
            }
            if let (Some(other), true) = (element.neighbours[k], on_line) {
                assert!(mesh.neighbours_across(other, (k + 2) % 4).any(|x| x == ElementId(e)));
            }
        }
    }
    // Four sides of eight edges, seen from both sides.
    assert_eq!(n, 64);
    assert!(report.n_flagged_edges >= 32 && !report.skipped);
}

#[test]
fn refinement_has_the_same_bits_for_any_number_of_threads_and_keeps_its_limits() {
    let mut scene = plate_room(300);
    scene.surfaces[1].exitance = Rgb::splat(5.0);
    let run = |threads: usize, options: &RefineOptions| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| refined(&scene, options))
    };
    let options =
        RefineOptions { wanted_error: 1e-4, max_depth: 2, max_growth: 1.5, ..RefineOptions::default() };
    let (one, report) = run(1, &options);
    let (three, again) = run(3, &options);
    assert_eq!(one.subdivision(), three.subdivision());
    assert_eq!(report, again);
    check_areas(&one, &scene);
    assert!(report.n_elements <= report.n_limit, "{report:?}");
    assert!(report.n_cut_by_count > 0, "such an error takes more elements: {report:?}");
    assert!(one.elements.iter().all(|e| e.place.level() <= 3));
    assert_eq!(one.cast_patches(), Mesh::build(&scene).cast_patches());
    // A looser wish takes no more elements; none takes one a patch.
    let (loose, _) = run(2, &RefineOptions { wanted_error: 0.2, ..options });
    assert!(loose.elements.len() <= one.elements.len());
    let (none, _) = run(2, &RefineOptions { wanted_error: 1e3, ..options });
    assert_eq!(none.elements.len(), none.patches.len());
}

#[test]
fn refined_mesh_of_an_evenly_lit_furnace_stays_coarse() {
    let mut surfaces = room(1.0, 1.0, 1.0);
    surfaces.iter_mut().for_each(|s| s.exitance = Rgb::splat(1.0));
    let scene = scene(surfaces, MeshTarget::Elements(600));
    let (mesh, report) = refined(&scene, &RefineOptions::default());
    check(&mesh);
    assert_eq!(mesh.elements.len(), mesh.patches.len(), "{report:?}");
}
