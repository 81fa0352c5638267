//! Refined meshes: shadow lines where geometry puts them, limits, the same bits for any number of threads.

use glam::DVec3;

use super::*;
use crate::mesh::Continuity;
use crate::mesh::tests::{check, room, scene, surface};
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
        for d in mesh.discontinuities().iter().filter(|d| d.element == e) {
            let k = usize::from(d.edge);
            assert_eq!((d.continuity, element.continuity[k]), (Continuity::Broken, Continuity::Broken));
            let size = corners[0].distance(corners[2]);
            let middle = 0.5 * (corners[k] + corners[(k + 1) % 4]);
            assert!(on_border(middle).abs() <= size, "a flag far off the line, at {middle}");
            n_flagged += 1;
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
    let whole = mesh.clone();
    let report = flag_shadow_lines(&scene, &mut mesh, &mut caster).unwrap();
    let (front, _) = mesh.surface_elements(crate::scene::SurfaceId(0));
    let mut n = 0;
    for e in front {
        let element = &mesh.elements[e as usize];
        let corners = mesh.polygon(&element.corners);
        for k in 0..4 {
            let middle = 0.5 * (corners[k] + corners[(k + 1) % 4]);
            let on_line = ((middle.x - 2.0).abs().max((middle.y - 2.0).abs()) - 1.0).abs() < 1e-9;
            if whole.elements[e as usize].neighbours[k].is_some() {
                assert_eq!(element.continuity[k] == Continuity::Broken, on_line, "edge at {middle}");
                assert_eq!(element.neighbours[k].is_none(), on_line, "edge at {middle}");
                n += u32::from(on_line);
            }
        }
    }
    // Four sides of eight edges, seen from both sides.
    assert_eq!(n, 64);
    assert!(report.n_flagged_edges >= 32 && !report.skipped);
    // Flagging again is the same.
    let first = mesh.subdivision();
    assert_eq!(flag_shadow_lines(&scene, &mut mesh, &mut caster).unwrap(), report);
    assert_eq!(mesh.subdivision(), first);
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
        RefineOptions { wanted_error: 1e-4, max_depth: 4, max_growth: 1.0, ..RefineOptions::default() };
    let (one, report) = run(1, &options);
    let (three, again) = run(3, &options);
    assert_eq!(one.subdivision(), three.subdivision());
    assert_eq!(report, again);
    check_areas(&one, &scene);
    assert!(report.n_elements <= report.n_limit, "{report:?}");
    assert!(report.n_cut_by_count > 0, "such an error takes more elements: {report:?}");
    assert!(one.elements.iter().all(|e| e.place.level() <= 5));
    assert_eq!(one.cast_patches(), Mesh::build(&scene).cast_patches());
    // No wish takes one element a patch, a tighter one never fewer than a looser, all within their limits.
    let wishes = [1e3, 0.3, 0.1, 0.03, 0.01];
    let by_wish = wishes.map(|wanted_error| {
        let (mesh, report) =
            run(2, &RefineOptions { wanted_error, max_depth: 2, max_growth: 4.0, ..options });
        let is_cut = report.n_cut_by_count + report.n_cut_by_depth > 0;
        assert!(report.estimated_error <= wanted_error || is_cut, "{report:?}");
        mesh.elements.len()
    });
    assert!(by_wish.is_sorted() && by_wish[0] < by_wish[4], "{by_wish:?}");
    assert_eq!(by_wish[0], one.patches.len());
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

/// Direct irradiance at the vertices on shadow lines, over what a point light gives there unoccluded: with its vertex.
fn shares_on_lines(scene: &Scene, mesh: &Mesh) -> Vec<(crate::mesh::VertexId, f64)> {
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let options = SolveOptions { unshot_share: 0.5, ..SolveOptions::default() };
    let solution = solve(scene, mesh, &mut caster, &options, &mut |_| {}).unwrap();
    mesh.line_vertices()
        .iter()
        .map(|v| {
            let vertex = &mesh.vertices[v.0 as usize];
            let whole: f64 = scene
                .lights
                .iter()
                .map(|light| {
                    crate::radiosity::lights::irradiance(light, vertex.position, vertex.normal).luminance()
                })
                .sum();
            (*v, solution.vertex_irradiance[v.0 as usize].direct.luminance() / whole)
        })
        .collect()
}

/// A line at 30 degrees to the element edges: a plate that is turned.
#[test]
fn edges_that_stand_for_an_oblique_shadow_line_part_the_whole_of_the_shadow_from_the_rest() {
    let mut scene = plate_room(700);
    let (s, c) = (30.0_f64.to_radians().sin(), 30.0_f64.to_radians().cos());
    let turned = |x: f64, y: f64| v(2.0 + 0.5 * (c * x - s * y), 2.0 + 0.5 * (s * x + c * y), 0.95);
    scene.surfaces[6].shape =
        Shape::Quad([turned(-1., -1.), turned(1., -1.), turned(1., 1.), turned(-1., 1.)]);
    scene.meshing.target = MeshTarget::MaxElementM(0.125);
    let mut mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    flag_shadow_lines(&scene, &mut mesh, &mut caster).unwrap();
    check(&mesh);
    let (front, _) = mesh.surface_elements(crate::scene::SurfaceId(0));
    let middle = mesh.elements.iter().position(|e| {
        let corners = mesh.polygon(&e.corners);
        corners.iter().all(|p| p.z == 0.0 && (*p - v(2.0, 2.0, 0.0)).length() < 0.2)
    });
    // Over unbroken edges from the middle of the shadow: all of it, nothing else.
    let mut reached = vec![middle.expect("an element in the middle") as u32];
    let mut next = 0;
    while next < reached.len() {
        let neighbours = mesh.elements[reached[next] as usize].neighbours;
        next += 1;
        for other in neighbours.into_iter().flatten().map(|e| e.0) {
            if !reached.contains(&other) {
                reached.push(other);
            }
        }
    }
    for e in front {
        let corners = mesh.polygon(&mesh.elements[e as usize].corners);
        let at = corners.iter().sum::<DVec3>() / 4.0 - v(2.0, 2.0, 0.0);
        let (x, y) = (c * at.x + s * at.y, c * at.y - s * at.x);
        let dark = x.abs().max(y.abs()) < 1.0;
        assert_eq!(reached.contains(&e), dark, "element at {at}");
    }
    for (v, share) in shares_on_lines(&scene, &mesh) {
        let dark = reached.contains(&mesh.elements_around(v)[0].0);
        let right = if dark { 0.0 } else { 1.0 };
        assert!((share - right).abs() < 1e-5, "{share} at {}", mesh.vertices[v.0 as usize].position);
    }
}

#[test]
fn step_of_a_point_lights_shadow_stays_a_step_on_and_off_the_element_edges() {
    // Shadow of 2 x 2 m: on the edges of 0.25 m elements, and 3 cm beside those of 0.25 m elements that begin elsewhere.
    for shift in [0.0, 0.03, -0.05] {
        let mut scene = plate_room(700);
        let corners = [v(1.5, 1.5, 0.95), v(2.5, 1.5, 0.95), v(2.5, 2.5, 0.95), v(1.5, 2.5, 0.95)];
        scene.surfaces[6].shape = Shape::Quad(corners.map(|c| c + 0.5 * v(shift, shift, 0.0)));
        scene.meshing.target = MeshTarget::MaxElementM(0.25);
        let mut mesh = Mesh::build(&scene);
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        flag_shadow_lines(&scene, &mut mesh, &mut caster).unwrap();
        let shares = shares_on_lines(&scene, &mesh);
        // Four sides of eight edges on the floor, two vertices each.
        assert_eq!(shares.len(), 64, "shifted by {shift}");
        for (v, share) in shares {
            let vertex = &mesh.vertices[v.0 as usize];
            let inside =
                mesh.centroid(mesh.elements_around(v)[0]) - DVec3::new(2.0 + shift, 2.0 + shift, 0.0);
            let dark = inside.x.abs().max(inside.y.abs()) < 1.0;
            let right = if dark { 0.0 } else { 1.0 };
            assert!((share - right).abs() < 1e-5, "{share} at {} of {shift}", vertex.position);
        }
    }
}

#[test]
fn step_of_a_refined_mesh_is_one_at_every_vertex_on_its_line_whatever_hangs_there() {
    let mut scene = plate_room(700);
    let corners = [v(1.5, 1.5, 0.95), v(2.5, 1.5, 0.95), v(2.5, 2.5, 0.95), v(1.5, 2.5, 0.95)];
    scene.surfaces[6].shape = Shape::Quad(corners.map(|c| c + v(0.007, 0.007, 0.0)));
    let options = RefineOptions { max_depth: 2, wanted_error: 0.05, ..RefineOptions::default() };
    let (mesh, _) = refined(&scene, &options);
    let shares = shares_on_lines(&scene, &mesh);
    assert!(shares.len() > 100, "{}", shares.len());
    for (v, share) in shares {
        let inside = mesh.centroid(mesh.elements_around(v)[0]) - DVec3::new(2.014, 2.014, 0.0);
        let right = if inside.x.abs().max(inside.y.abs()) < 1.0 { 0.0 } else { 1.0 };
        assert!((share - right).abs() < 1e-5, "{share} at {}", mesh.vertices[v.0 as usize].position);
    }
}

/// A room of 4 x 4 x 2 m, a lamp of 1 x 1 m in the middle of its ceiling and a plate of 1 x 1 m halfway up under it: on the
/// floor umbra to 0.5 m from the middle, penumbra to 1.5 m.
fn lamp_room() -> Scene {
    let mut surfaces = room(4.0, 4.0, 2.0);
    let square = |z: f64| [v(1.5, 1.5, z), v(1.5, 2.5, z), v(2.5, 2.5, z), v(2.5, 1.5, z)];
    surfaces.push(Surface { two_sided: true, ..surface("plate", Shape::Quad(square(1.0))) });
    surfaces.push(Surface { exitance: Rgb::splat(9.0), ..surface("lamp", Shape::Quad(square(1.999))) });
    scene(surfaces, MeshTarget::MaxElementM(0.25))
}

#[test]
fn border_of_a_penumbra_is_flagged_c0_where_planes_through_lamp_and_plate_meet_the_floor() {
    let scene = lamp_room();
    let mut mesh = Mesh::build(&scene);
    let whole = mesh.clone();
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let report = flag_shadow_lines(&scene, &mut mesh, &mut caster).unwrap();
    assert!(report.n_penumbra_segments > 0 && report.n_emitters_skipped == 0, "{report:?}");
    assert_eq!((report.n_segments, report.n_flagged_edges), (0, 0));
    assert_eq!(mesh.vertices, whole.vertices);
    let (front, _) = mesh.surface_elements(crate::scene::SurfaceId(0));
    let mut n = 0;
    for d in mesh.discontinuities().iter().filter(|d| front.contains(&d.element)) {
        assert_eq!(d.continuity, Continuity::C0);
        let corners = mesh.polygon(&mesh.elements[d.element as usize].corners);
        let k = usize::from(d.edge);
        let middle = 0.5 * (corners[k] + corners[(k + 1) % 4]) - v(2.0, 2.0, 0.0);
        let out = middle.x.abs().max(middle.y.abs());
        assert!((out - 1.5).abs().min((out - 0.5).abs()) < 1e-9, "an edge at {middle}");
        n += 1;
    }
    // Squares of 3 x 3 m and of 1 x 1 m in edges of 0.25 m.
    assert_eq!(n, 48 + 16);
}
