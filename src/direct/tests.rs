//! Direct light against closed forms, with and without occluders, on the software and the quantised caster.

use std::path::PathBuf;

use glam::DVec3;
use rtl_model::fixed::Formats;

use super::*;
use crate::radiosity::kernel::point_to_polygon;
use crate::raycast::functional::FunctionalCaster;
use crate::raycast::null::NullCaster;
use crate::raycast::software::SoftwareCaster;
use crate::scene::{Light, Material, MaterialId, Meshing, Surface};

fn surface(name: &str, shape: Shape, exitance: f64, two_sided: bool) -> Surface {
    Surface {
        name: name.to_string(),
        material: MaterialId(0),
        shape,
        two_sided,
        smooth_group: 0,
        exitance: Rgb::splat(exitance),
    }
}

fn scene(surfaces: Vec<Surface>, lights: Vec<Light>) -> Scene {
    Scene {
        path: PathBuf::new(),
        camera: None,
        materials: vec![Material {
            name: "grey".to_string(),
            reflectance: Rgb::splat(0.5),
            specular: Rgb::BLACK,
            transmission: Rgb::BLACK,
            ior: 1.5,
        }],
        surfaces,
        lights,
        continuity: Vec::new(),
        meshing: Meshing::default(),
        warnings: Vec::new(),
    }
}

/// A horizontal rectangle that looks down.
fn ceiling(x: [f64; 2], y: [f64; 2], z: f64) -> [DVec3; 4] {
    [
        DVec3::new(x[0], y[0], z),
        DVec3::new(x[0], y[1], z),
        DVec3::new(x[1], y[1], z),
        DVec3::new(x[1], y[0], z),
    ]
}

fn up(key: u64) -> ShadePoint {
    ShadePoint { position: DVec3::ZERO, normal: DVec3::Z, geometric_normal: DVec3::Z, key }
}

/// Irradiance on points by all sources with full sampling.
fn gather(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    points: &[ShadePoint],
    strata: u32,
    seed: u64,
) -> Vec<Rgb> {
    let options = DirectOptions::full(strata);
    let mut direct = DirectLight::new(scene, mesh, caster.surface_offset_m(), options, seed);
    let points: Vec<LitPoint> = points.iter().map(|p| LitPoint::from(*p)).collect();
    direct.gather(caster, &points).unwrap()
}

/// Irradiance on points by both casters.
fn gathered(scene: &Scene, points: &[ShadePoint], strata: u32, seed: u64) -> [Vec<Rgb>; 2] {
    let mesh = Mesh::build(scene);
    let patches = mesh.cast_patches();
    let extra: Vec<DVec3> = points.iter().map(|p| p.position).chain([DVec3::splat(3.0)]).collect();
    let mut software = SoftwareCaster::new(patches.clone());
    let mut board = FunctionalCaster::new(&Formats::default(), None, &patches, &extra).unwrap();
    let casters: [&mut dyn RayCaster; 2] = [&mut software, &mut board];
    casters.map(|caster| gather(scene, &mesh, caster, points, strata, seed))
}

#[test]
fn gather_under_the_corner_of_a_free_lamp_is_the_formula_for_any_seed() {
    let lamp = surface("lamp", Shape::Quad(ceiling([0.0, 1.0], [0.0, 1.0], 1.0)), 2.0, false);
    let scene = scene(vec![lamp], Vec::new());
    for seed in 0..5 {
        for e in gathered(&scene, &[up(seed), up(seed + 9)], 3, seed).concat() {
            assert!((e.0[1] - 2.0 * 0.138_531_606_0).abs() < 1e-9, "{e:?}");
        }
    }
}

#[test]
fn gather_behind_a_one_sided_lamp_is_black_and_behind_a_two_sided_one_is_not() {
    let floor_lamp = ceiling([-1.0, 1.0], [-1.0, 1.0], 1.0).map(|p| DVec3::new(p.y, p.x, p.z));
    for (two_sided, lit) in [(false, false), (true, true)] {
        let scene = scene(vec![surface("lamp", Shape::Quad(floor_lamp), 1.0, two_sided)], Vec::new());
        for e in gathered(&scene, &[up(0)], 2, 1).concat() {
            assert_eq!(!e.is_black(), lit);
        }
    }
}

#[test]
fn gather_under_a_half_blocked_lamp_is_the_formula_of_the_visible_half() {
    // The blocker halves every line of sight at x < 0 exactly: it ends over the point, half way up.
    let lamp = ceiling([-1.0, 1.0], [-1.0, 1.0], 2.0);
    let blocker = ceiling([-3.0, 0.0], [-3.0, 3.0], 1.0);
    let parts =
        [surface("lamp", Shape::Quad(lamp), 1.0, false), surface("b", Shape::Quad(blocker), 0.0, false)];
    let want = point_to_polygon(DVec3::ZERO, DVec3::Z, &ceiling([0.0, 1.0], [-1.0, 1.0], 2.0));
    let scene = scene(parts.to_vec(), Vec::new());
    let points: Vec<_> = (0..64).map(up).collect();
    for e in gathered(&scene, &points, 8, 5) {
        // All samples of a point share their place in the stratum, so an edge along strata shifts each estimate by
        // up to half a stratum of eight; the mean is right.
        assert_eq!(e.len(), points.len());
        let worst = e.iter().map(|e| (e.0[0] / want - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 0.0625, "{worst}");
        let mean = e.iter().map(|e| e.0[0]).sum::<f64>() / e.len() as f64;
        assert!((mean / want - 1.0).abs() < 0.01, "{mean}, not {want}");
    }
}

#[test]
fn gather_of_triangles_and_skew_quads_half_blocked_converges_to_the_visible_half() {
    let blocker = surface("b", Shape::Quad(ceiling([-3.0, 0.0], [-3.0, 3.0], 1.0)), 0.0, false);
    let p = |x, y| DVec3::new(x, y, 2.0);
    // Mirror-symmetric about x = 0, so that half of the light comes from each side.
    let triangle = Shape::Triangle([p(-1.0, -1.0), p(0.0, 1.0), p(1.0, -1.0)]);
    let skew = Shape::Quad([p(-1.0, -1.0), p(-0.5, 1.0), p(0.5, 1.0), p(1.0, -1.0)]);
    for shape in [triangle, skew] {
        let lamp = surface("lamp", shape, 1.0, false);
        let points: Vec<_> = (0..400).map(up).collect();
        let free = gathered(&scene(vec![lamp.clone()], Vec::new()), &points[..1], 8, 3);
        let half = gathered(&scene(vec![lamp, blocker.clone()], Vec::new()), &points, 8, 3);
        for (free, half) in free.iter().zip(half) {
            let mean = half.iter().copied().sum::<Rgb>() / half.len() as f64;
            assert!((mean.0[0] / free[0].0[0] - 0.5).abs() < 0.005, "{mean:?} of {free:?}");
        }
    }
}

#[test]
fn gather_under_a_sphere_is_exitance_times_the_square_of_its_sine_up_to_facets() {
    let ball = Shape::Sphere { center: DVec3::new(0.0, 0.0, 2.0), radius: 0.5, inward: false };
    let scene = scene(vec![surface("ball", ball, 3.0, false)], Vec::new());
    let want = 3.0 * (0.5_f64 / 2.0).powi(2);
    let by_seed: Vec<_> = (0..3).map(|seed| gathered(&scene, &[up(seed)], 4, seed)).collect();
    for e in by_seed.iter().flatten().flatten() {
        assert!((e.0[2] / want - 1.0).abs() < 0.01, "{e:?}, not {want}");
    }
    assert_eq!(by_seed[0], by_seed[2], "no noise where nothing occludes");
}

#[test]
fn gather_under_lights_is_their_formula_and_black_behind_an_occluder() {
    let lights = vec![
        Light::Point { position: DVec3::new(0.0, 0.0, 2.0), intensity: Rgb::splat(8.0) },
        Light::Directional { direction: DVec3::NEG_Z, irradiance: Rgb::splat(0.25) },
    ];
    let roof = |z| surface("roof", Shape::Quad(ceiling([-1.0, 1.0], [-1.0, 1.0], z)), 0.0, false);
    for (height, want) in [(2.5, 2.0), (1.0, 0.0), (-1.0, 2.25)] {
        let scene = scene(vec![roof(height)], lights.clone());
        for e in gathered(&scene, &[up(0)], 1, 1).concat() {
            assert!((e.0[0] - want).abs() < 1e-12, "roof at {height}: {e:?}");
        }
    }
}

#[test]
fn gather_of_many_points_answers_each_as_if_alone() {
    let lamp = surface("lamp", Shape::Quad(ceiling([-1.0, 1.0], [-1.0, 1.0], 2.0)), 1.0, false);
    let block = surface("b", Shape::Quad(ceiling([-0.2, 0.4], [-0.3, 0.3], 1.0)), 0.0, false);
    let scene = scene(vec![lamp, block], Vec::new());
    let points: Vec<_> = (0..3000u32)
        .map(|k| {
            let position = DVec3::new(f64::from(k % 60) / 30.0 - 1.0, f64::from(k / 60) / 25.0 - 1.0, 0.0);
            ShadePoint { position, ..up(k.into()) }
        })
        .collect();
    let [software, board] = gathered(&scene, &points, 4, 7);
    let [alone, _] = gathered(&scene, &points[2500..2501], 4, 7);
    assert_eq!(software[2500], alone[0]);
    let lit = software.iter().filter(|e| e.0[0] > 0.0).count();
    assert!(lit > 2900, "{lit}");
    let differ = software.iter().zip(&board).filter(|(a, b)| (a.0[0] - b.0[0]).abs() > 1e-9).count();
    let first =
        software.iter().zip(&board).position(|(a, b)| a != b).map(|i| (software[i], board[i], points[i]));
    assert!(differ < 20, "{differ} points differ: shadow edges only; {first:?}");
}

#[test]
fn null_caster_sees_every_source() {
    let lamp = surface("lamp", Shape::Quad(ceiling([0.0, 1.0], [0.0, 1.0], 1.0)), 1.0, false);
    let roof = surface("roof", Shape::Quad(ceiling([-2.0, 2.0], [-2.0, 2.0], 0.5)), 0.0, false);
    let scene = scene(vec![lamp, roof], Vec::new());
    let mesh = Mesh::build(&scene);
    let e = gather(&scene, &mesh, &mut NullCaster, &[up(1)], 2, 1);
    assert!((e[0].0[0] - 0.138_531_606_0).abs() < 1e-9);
}

/// A lamp of a quad and one of a disk over a floor, a table between: full light, penumbrae, umbra.
fn shaded_room() -> Scene {
    let disk = Shape::Disk { center: DVec3::new(0.6, 0.2, 2.0), normal: DVec3::NEG_Z, radius: 0.3 };
    let parts = vec![
        surface("panel", Shape::Quad(ceiling([-0.6, 0.2], [-0.4, 0.4], 1.9)), 3.0, false),
        surface("disk", disk, 5.0, false),
        surface("table", Shape::Quad(ceiling([-0.5, 0.5], [-0.3, 0.5], 1.0)), 0.0, true),
    ];
    let lights = vec![
        Light::Point { position: DVec3::new(0.0, -0.8, 1.5), intensity: Rgb::splat(1.0) },
        Light::Directional { direction: DVec3::new(0.5, 0.1, -1.0).normalize(), irradiance: Rgb::splat(0.8) },
    ];
    let mut scene = scene(parts, lights);
    // Emitters fine enough that a probe's strata leave little of a penumbra to chance.
    scene.meshing.target = crate::scene::MeshTarget::Elements(4000);
    scene
}

/// The probe looks at each element of an emitter, the renderer at the whole emitter: two codes, one light.
#[test]
fn gather_and_probe_give_one_direct_light_within_the_sampling_error_of_gather() {
    use crate::radiosity::{ProbePoint, Solution, probe};
    let scene = shaded_room();
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let dark = Solution::dark(&mesh);
    let (mut n_penumbra, mut n_umbra) = (0, 0);
    for k in 0..81u32 {
        let position = DVec3::new(f64::from(k % 9) * 0.25 - 1.0, f64::from(k / 9) * 0.25 - 1.0, 0.0);
        let points: Vec<ShadePoint> =
            (0..64).map(|key| ShadePoint { position, key: key + 1000 * u64::from(k), ..up(0) }).collect();
        let samples = gather(&scene, &mesh, &mut caster, &points, MAX_STRATA, 7);
        let n = samples.len() as f64;
        let mean = samples.iter().map(|e| e.0[1]).sum::<f64>() / n;
        let variance = samples.iter().map(|e| (e.0[1] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n).sqrt();
        let point = ProbePoint { at: position, normal: DVec3::Z };
        let probed = probe(&scene, &mesh, &dark, &mut caster, &[point]).unwrap()[0];
        assert_eq!(probed.indirect, Rgb::BLACK);
        let e = probed.direct.0[1];
        // The probe's own error in a penumbra: some of its hundreds of rays may fall on the other side.
        assert!((e - mean).abs() <= 5.0 * error + 2e-3 * mean + 1e-9, "{position}: {e}, {mean} +- {error}");
        n_penumbra += u32::from(error > 1e-4 * mean);
        n_umbra += u32::from(mean < 1.0);
    }
    assert!(n_penumbra > 10 && n_umbra > 3, "{n_penumbra} in a penumbra, {n_umbra} dark");
}

/// Irradiance on points of the floor with `options`, and the rays that it took.
fn sampled(
    scene: &Scene,
    caster: &mut dyn RayCaster,
    options: DirectOptions,
    seed: u64,
) -> (Vec<Rgb>, ShadowCounts) {
    let mesh = Mesh::build(scene);
    let mut direct = DirectLight::new(scene, &mesh, caster.surface_offset_m(), options, seed);
    let points: Vec<LitPoint> = (0..400_u64)
        .map(|k| {
            let position = DVec3::new((k % 20) as f64 * 0.1 - 0.95, (k / 20) as f64 * 0.1 - 0.95, 0.0);
            let region = Some(PatchId((k / 50) as u32));
            LitPoint { region, expected: 1.0, ..LitPoint::from(ShadePoint { position, ..up(k) }) }
        })
        .collect();
    let e = direct.gather(caster, &points).unwrap();
    (e, direct.counts())
}

#[test]
fn adaptive_sampling_comes_near_full_sampling_with_a_fraction_of_its_rays() {
    let scene = shaded_room();
    let mut caster = SoftwareCaster::new(Mesh::build(&scene).cast_patches());
    let full = DirectOptions::full(8);
    let adaptive = DirectOptions { shadow_sampling: ShadowSampling::Adaptive, shadow_error: 0.0, ..full };
    let n_seeds = 8;
    let (mut square, mut sum, mut all, mut few) = (0.0, 0.0, 0, 0);
    for seed in 0..n_seeds {
        let (reference, counts) = sampled(&scene, &mut caster, full, seed);
        let (e, fewer) = sampled(&scene, &mut caster, adaptive, seed + 50);
        all += counts.rays;
        few += fewer.rays;
        for (e, reference) in e.iter().zip(&reference) {
            square += (e.0[0] - reference.0[0]).powi(2) / (400 * n_seeds) as f64;
            sum += (e.0[0] - reference.0[0]) / (400 * n_seeds) as f64;
        }
    }
    assert!(few * 2 < all, "{few} of {all}");
    // Of irradiances about 1.
    assert!(square.sqrt() < 0.03 && sum.abs() < 0.003, "RMS {}, mean {sum}", square.sqrt());
}

/// Irradiance under a rectangular lamp behind a half-plane: Lambert's formula on the visible polygon.
#[test]
fn adaptive_penumbra_behind_a_half_plane_has_the_profile_of_the_visible_polygon() {
    let lamp = [[-0.5, 0.5], [-0.5, 0.5]];
    let blocker = ceiling([-9.0, 0.0], [-9.0, 9.0], 1.0);
    let parts = [
        surface("lamp", Shape::Quad(ceiling(lamp[0], lamp[1], 2.0)), 1.0, false),
        surface("b", Shape::Quad(blocker), 0.0, true),
    ];
    let scene = scene(parts.to_vec(), Vec::new());
    let mesh = Mesh::build(&scene);
    let options = DirectOptions { shadow_strata: 8, shadow_error: 0.0, ..DirectOptions::default() };
    for k in 0..13 {
        let x = -0.6 + 0.1 * f64::from(k);
        // Seen from (x, 0, 0) the blocker's edge stands at -x in the lamp's plane.
        let want = if -x >= 0.5 {
            0.0
        } else {
            let visible = ceiling([(-x).max(-0.5), 0.5], lamp[1], 2.0);
            point_to_polygon(DVec3::new(x, 0.0, 0.0), DVec3::Z, &visible)
        };
        let points: Vec<LitPoint> = (0..64)
            .map(|key| {
                let point = ShadePoint { position: DVec3::new(x, 0.0, 0.0), ..up(key) };
                LitPoint { expected: 0.1, ..LitPoint::from(point) }
            })
            .collect();
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let mut direct = DirectLight::new(&scene, &mesh, caster.surface_offset_m(), options, 3);
        let e = direct.gather(&mut caster, &points).unwrap();
        let mean = e.iter().map(|e| e.0[0]).sum::<f64>() / e.len() as f64;
        let all = point_to_polygon(DVec3::ZERO, DVec3::Z, &ceiling(lamp[0], lamp[1], 2.0));
        assert!((mean - want).abs() < 0.02 * all, "x = {x}: {mean}, not {want}");
        let worst = e.iter().map(|e| (e.0[0] - want).abs()).fold(0.0, f64::max);
        assert!(worst < 0.12 * all, "x = {x}: off by {worst} of {all}");
    }
}

#[test]
fn coherence_leaves_rays_out_and_changes_no_value_with_either_caster() {
    let scene = shaded_room();
    let patches = Mesh::build(&scene).cast_patches();
    let extra = [DVec3::splat(-1.5), DVec3::splat(2.5)];
    let mut software = SoftwareCaster::new(patches.clone());
    let mut board = FunctionalCaster::new(&Formats::default(), None, &patches, &extra).unwrap();
    let casters: [&mut dyn RayCaster; 2] = [&mut software, &mut board];
    for caster in casters {
        for way in [ShadowSampling::Full, ShadowSampling::Adaptive] {
            let off = DirectOptions { shadow_sampling: way, ..DirectOptions::full(4) };
            let on = DirectOptions { shadow_coherence: true, ..off };
            let (plain, all) = sampled(&scene, caster, off, 1);
            let (coherent, fewer) = sampled(&scene, caster, on, 1);
            assert_eq!(plain, coherent);
            assert_eq!((all.known_blocked, all.occluder_tests), (0, 0));
            assert!(fewer.known_blocked > 0, "{fewer:?} {all:?}");
            assert_eq!(fewer.rays - fewer.seeking_rays + fewer.known_blocked, all.rays);
        }
    }
}

/// A room with two lamps and a table, solved.
fn lit_room() -> (Scene, Mesh, crate::radiosity::Solution) {
    let mut scene = shaded_room();
    scene.surfaces.push(surface(
        "floor",
        Shape::Quad(ceiling([-1.0, 1.0], [-1.0, 1.0], 0.0).map(|p| DVec3::new(p.y, p.x, 0.0))),
        0.0,
        false,
    ));
    scene.meshing.target = crate::scene::MeshTarget::Elements(1500);
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let options = crate::radiosity::SolveOptions { unshot_share: 0.05, ..Default::default() };
    let solution = crate::radiosity::solve(&scene, &mesh, &mut caster, &options, &mut |_| {}).unwrap();
    (scene, mesh, solution)
}

/// Stored plus sampled light at random points of a mesh, and the mean number of sampled sources.
fn two_parts(
    (scene, mesh, solution): &(Scene, Mesh, crate::radiosity::Solution),
    stored_share: f64,
    reconstruct: crate::reconstruct::Method,
) -> (Vec<Rgb>, f64) {
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let options = DirectOptions { stored_share, ..DirectOptions::full(8) };
    let mut direct = DirectLight::new(scene, mesh, caster.surface_offset_m(), options, 1);
    let selection = Selection::new(&mut direct, mesh, solution, &mut caster, reconstruct.into()).unwrap();
    let floor = scene.surface_named("floor").unwrap();
    let elements = mesh.surface_elements(floor).0;
    let (mut lit, mut stored, mut n_sampled) = (Vec::new(), Vec::new(), 0.0);
    for k in 0..800_u64 {
        let [s, t] = crate::sampling::unit_pair(crate::sampling::hash(5, k, 0));
        let n = u64::from(elements.end - elements.start);
        let element = crate::mesh::ElementId(elements.start + (crate::sampling::hash(6, k, 0) % n) as u32);
        let at = crate::mesh::SurfacePoint { element, st: glam::DVec2::new(s, t) };
        let light = selection.at(mesh, at);
        n_sampled += light.n_sampled() / 800.0;
        let point = ShadePoint { position: mesh.position(at), ..up(k) };
        lit.push(LitPoint { point, region: None, expected: light.expected, sampled: light.sampled.clone() });
        stored.push(light.irradiance);
    }
    let sampled = direct.gather(&mut caster, &lit).unwrap();
    (stored.iter().zip(sampled).map(|(a, b)| *a + b).collect(), n_sampled)
}

#[test]
fn stored_and_sampled_light_sum_to_the_same_total_for_any_tau() {
    let room = lit_room();
    let method = crate::reconstruct::Method::Hermite;
    let (reference, n_all) = two_parts(&room, 0.0, method);
    assert!((n_all - 4.0).abs() < 1e-9, "two areas and two lights without area, not {n_all}");
    let mean = |e: &[Rgb]| e.iter().map(|e| e.luminance()).sum::<f64>() / e.len() as f64;
    let mut last = n_all;
    for (tau, wanted_rms) in [(0.02, 0.02), (0.1, 0.05), (0.5, 0.1), (1.0, 0.12)] {
        let (e, n) = two_parts(&room, tau, method);
        assert!(n < last, "tau {tau}: {n} sources sampled, {last} before");
        last = n;
        assert!(
            (mean(&e) / mean(&reference) - 1.0).abs() < 0.01,
            "tau {tau}: {} {}",
            mean(&e),
            mean(&reference)
        );
        let square: f64 =
            e.iter().zip(&reference).map(|(a, b)| (a.luminance() - b.luminance()).powi(2)).sum();
        let rms = (square / e.len() as f64).sqrt() / mean(&reference);
        assert!(rms < wanted_rms, "tau {tau}: RMS {rms}");
    }
    assert_eq!(last, 0.0, "tau 1 samples nothing");
}

#[test]
fn light_is_continuous_across_borders_of_classes() {
    let room = lit_room();
    let (scene, mesh, solution) = &room;
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let options = DirectOptions { stored_share: 0.1, ..DirectOptions::full(8) };
    let mut direct = DirectLight::new(scene, mesh, caster.surface_offset_m(), options, 1);
    let method = crate::reconstruct::Method::Hermite;
    let selection = Selection::new(&mut direct, mesh, solution, &mut caster, method.into()).unwrap();
    let floor = scene.surface_named("floor").unwrap();
    let (mut n_borders, mut worst) = (0, 0.0_f64);
    for e in mesh.surface_elements(floor).0 {
        let element = crate::mesh::ElementId(e);
        let [Some(beside), ..] = [mesh.elements[e as usize].neighbours[1]] else { continue };
        // Edge 1 of a quad is s = 1; on a regular grid the neighbour's point is s = 0.
        let here = crate::mesh::SurfacePoint { element, st: glam::DVec2::new(1.0, 0.4) };
        let there = crate::mesh::SurfacePoint { element: beside, st: glam::DVec2::new(0.0, 0.4) };
        if (mesh.position(here) - mesh.position(there)).length() > 1e-9 {
            continue;
        }
        let (a, b) = (selection.at(mesh, here), selection.at(mesh, there));
        let inside = |element| {
            let middle = crate::mesh::SurfacePoint { element, st: glam::DVec2::splat(0.5) };
            selection.at(mesh, middle).sampled.map_or(0, |s| s.len())
        };
        n_borders += u32::from(inside(element) != inside(beside));
        let gap = (a.irradiance - b.irradiance).luminance().abs() / a.expected;
        worst = worst.max(gap).max((a.n_sampled() - b.n_sampled()).abs());
    }
    assert!(n_borders > 5, "{n_borders} borders between patches that sample other sources");
    assert!(worst < 1e-9, "a gap of {worst}");
}

/// A slab of n = 1.52 passes .91832 of what falls on it straight, .84347 at 60 degrees; twice the square of that.
#[test]
fn light_through_panes_is_dimmed_by_the_slabs_transmittance() {
    let pane = |name: &str, z: f64| Surface {
        material: MaterialId(1),
        ..surface(name, Shape::Quad(ceiling([-9.0, 9.0], [-9.0, 9.0], z)), 0.0, true)
    };
    let glass = Material {
        name: "glass".to_string(),
        reflectance: Rgb::BLACK,
        specular: Rgb::BLACK,
        transmission: Rgb([0.9, 0.8, 0.0]),
        ior: 1.52,
    };
    for (x, cosine, transmittance) in [(0.0, 1.0, 0.918_32), (2.0 * 3f64.sqrt(), 0.5, 0.843_47)] {
        let position = DVec3::new(x, 0.0, 2.0);
        let distance = position.length();
        let free = cosine / (distance * distance);
        for n_panes in 1..3 {
            let panes = [pane("pane", 0.5), pane("another", 1.0)];
            let mut scene =
                scene(panes[..n_panes].to_vec(), vec![Light::Point { position, intensity: Rgb::WHITE }]);
            scene.materials.push(glass.clone());
            for e in gathered(&scene, &[up(1)], 2, 1).concat() {
                let through = |t: f64| free * (t * transmittance).powi(n_panes as i32);
                let want = [through(0.9), through(0.8), 0.0];
                for (e, want) in e.0.iter().zip(want) {
                    assert!((e - want).abs() < 2e-5 * free, "{n_panes} panes, x = {x}: {e}, not {want}");
                }
            }
        }
    }
}
