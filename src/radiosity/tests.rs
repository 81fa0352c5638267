//! Pass 1 against closed forms and laws, on scenes built in code and with the software caster.

use glam::DVec3;

use super::*;
use crate::mesh::Mesh;
use crate::raycast::software::SoftwareCaster;
use crate::scene::{Light, Material, MaterialId, MeshTarget, Meshing, Shape, Surface};

/// A material of grey reflectance.
pub(super) fn grey(name: &str, reflectance: f64) -> Material {
    Material {
        name: name.into(),
        reflectance: Rgb::splat(reflectance),
        specular: Rgb::BLACK,
        transmission: Rgb::BLACK,
        ior: 1.5,
    }
}

pub(super) fn quad(name: &str, material: u32, corners: [DVec3; 4], exitance: f64) -> Surface {
    Surface {
        name: name.into(),
        material: MaterialId(material),
        shape: Shape::Quad(corners),
        two_sided: false,
        smooth_group: 0,
        exitance: Rgb::splat(exitance),
    }
}

pub(super) fn scene(
    materials: Vec<Material>,
    surfaces: Vec<Surface>,
    lights: Vec<Light>,
    elements: u32,
) -> Scene {
    Scene {
        path: "code".into(),
        camera: None,
        materials,
        surfaces,
        lights,
        continuity: Vec::new(),
        meshing: Meshing { target: MeshTarget::Elements(elements), ..Meshing::default() },
        warnings: Vec::new(),
    }
}

/// Walls of the box 0..size, fronts inside; every wall of material 0 and exitance `exitance`.
pub(super) fn room(size: DVec3, exitance: f64) -> Vec<Surface> {
    let v = |i: usize| size * DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
    let walls = [
        ("floor", [0, 1, 3, 2]),
        ("ceiling", [4, 6, 7, 5]),
        ("south", [0, 4, 5, 1]),
        ("north", [2, 3, 7, 6]),
        ("west", [0, 2, 6, 4]),
        ("east", [1, 5, 7, 3]),
    ];
    walls.map(|(name, w)| quad(name, 0, w.map(v), exitance)).to_vec()
}

struct Solved {
    scene: Scene,
    mesh: Mesh,
    caster: SoftwareCaster,
    solution: Solution,
}

fn solved(scene: Scene, options: &SolveOptions) -> Solved {
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let solution =
        solve(&scene, &mesh, &mut caster, options, &mut |_| {}).expect("the software caster does not fail");
    Solved { scene, mesh, caster, solution }
}

fn tight() -> SolveOptions {
    SolveOptions { unshot_share: 1e-6, ..SolveOptions::default() }
}

#[test]
fn solve_of_a_furnace_gives_radiosity_one_everywhere_and_row_sums_of_one() {
    let s =
        solved(scene(vec![grey("half", 0.5)], room(DVec3::new(1.0, 2.0, 1.5), 0.5), vec![], 400), &tight());
    let mut worst: f64 = 0.0;
    for surface in summary::summarise(&s.scene, &s.mesh, &s.solution) {
        worst = worst.max((surface.mean_radiosity_w_m2.0[1] - 1.0).abs());
    }
    assert!(worst < 2e-3, "{worst}");
    assert!(s.solution.vertex_irradiance.iter().all(|e| e.total().is_finite()));
    assert!(s.solution.row_sum_error.max < 5e-3, "{:?}", s.solution.row_sum_error);
    let worst_vertex =
        s.solution.vertex_irradiance.iter().map(|e| (e.total().0[0] - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst_vertex < 5e-3, "{worst_vertex}");
}

fn incident_w(s: &Solved, surface: &str) -> f64 {
    let table = summary::summarise(&s.scene, &s.mesh, &s.solution);
    table.iter().find(|row| row.name == surface).expect("the surface exists").incident_w.0[0]
}

/// A unit square that emits 1 W/m^2 at z = 0, facing up, and a black receiver.
fn two_squares(receiver: [DVec3; 4], elements: u32) -> Solved {
    let v = DVec3::new;
    let emitter = quad("emitter", 0, [v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)], 1.0);
    solved(
        scene(vec![grey("black", 0.0)], vec![emitter, quad("receiver", 0, receiver, 0.0)], vec![], elements),
        &tight(),
    )
}

#[test]
fn solve_of_parallel_squares_gives_their_view_factor() {
    let v = DVec3::new;
    let s = two_squares([v(0., 0., 1.), v(0., 1., 1.), v(1., 1., 1.), v(1., 0., 1.)], 400);
    let f = incident_w(&s, "receiver");
    assert!((f / 0.1998248957 - 1.0).abs() < 2e-4, "{f}");
    // 256 hemisphere rays a shooter measure what is lost; what they miss by is the residual.
    let account = &s.solution.account;
    assert!((account.lost_w.0[0] - 0.8).abs() < 0.005, "{account:?}");
    assert!(account.residual_w.0[0].abs() < 0.005, "{account:?}");
    assert_eq!(account.back_w, Rgb::BLACK);
}

#[test]
fn solve_of_corner_squares_gives_their_view_factor() {
    let v = DVec3::new;
    let s = two_squares([v(0., 0., 0.), v(0., 1., 0.), v(0., 1., 1.), v(0., 0., 1.)], 400);
    let f = incident_w(&s, "receiver");
    assert!((f / 0.2000437761 - 1.0).abs() < 2e-3, "{f}");
}

#[test]
fn solve_with_a_receiver_turned_away_puts_its_light_on_the_back() {
    let v = DVec3::new;
    let s = two_squares([v(0., 0., 1.), v(1., 0., 1.), v(1., 1., 1.), v(0., 1., 1.)], 100);
    let account = &s.solution.account;
    assert_eq!(incident_w(&s, "receiver"), 0.0);
    assert!((account.back_w.0[0] - 0.2).abs() < 0.005, "{account:?}");
    assert!(account.residual_w.0[0].abs() < 1e-12, "{account:?}");
}

#[test]
fn solve_of_point_light_in_a_closed_room_gives_its_power_over_one_minus_rho() {
    let light = Light::Point { position: DVec3::new(1.1, 0.8, 1.3), intensity: Rgb([10.0, 5.0, 1.0]) };
    let s =
        solved(scene(vec![grey("half", 0.6)], room(DVec3::new(2., 2., 2.), 0.0), vec![light], 600), &tight());
    let total = summary::totals(&summary::summarise(&s.scene, &s.mesh, &s.solution));
    for c in 0..3 {
        let expected = 4.0 * std::f64::consts::PI * [10.0, 5.0, 1.0][c] / 0.4;
        assert!((total.incident_w.0[c] / expected - 1.0).abs() < 5e-3, "{:?} {expected}", total.incident_w);
    }
    let account = s.solution.account;
    assert_eq!((account.lost_w, account.back_w), (Rgb::BLACK, Rgb::BLACK));
    assert!(account.residual_w.0[0].abs() < 5e-3 * account.emitted_w.0[0], "{account:?}");
}

#[test]
fn solve_with_a_spot_and_a_sun_accounts_for_their_power() {
    let down = -DVec3::Z;
    let spot = Light::Spot {
        position: DVec3::new(1., 1., 1.9),
        direction: down,
        intensity: Rgb::splat(10.0),
        inner_deg: 15.0,
        outer_deg: 30.0,
    };
    let sun = Light::Directional { direction: DVec3::new(0.6, 0., -0.8), irradiance: Rgb::splat(3.0) };
    // Without a ceiling the sun shines in: through the opening, 4 m^2 at cosine 0.8.
    let mut walls = room(DVec3::splat(2.0), 0.0);
    walls.remove(1);
    let s = solved(scene(vec![grey("dark", 0.2)], walls, vec![spot, sun], 800), &tight());
    let account = s.solution.account;
    let spot_w = lights::power_w(&spot).expect("a spot has power").0[0];
    assert!((account.emitted_w.0[0] / (spot_w + 3.0 * 4.0 * 0.8) - 1.0).abs() < 0.02, "{account:?}");
    assert!(account.lost_w.0[0] > 0.3, "{account:?}");
    assert!(account.residual_w.0[0].abs() < 0.01 * account.emitted_w.0[0], "{account:?}");
}

/// The 1992 reconstruction paper's test: a unit cube, a lamp of exitance 1 flush in its ceiling.
pub(super) fn lit_cube(rho: f64, elements: u32) -> Scene {
    let v = DVec3::new;
    let mut surfaces = room(DVec3::ONE, 0.0);
    surfaces.remove(1);
    let cuts = [0.0, 0.35, 0.65, 1.0];
    for i in 0..3 {
        for j in 0..3 {
            let (x0, x1, y0, y1) = (cuts[i], cuts[i + 1], cuts[j], cuts[j + 1]);
            let corners = [v(x0, y0, 1.), v(x0, y1, 1.), v(x1, y1, 1.), v(x1, y0, 1.)];
            let lamp = i == 1 && j == 1;
            let exitance = if lamp { 1.0 } else { 0.0 };
            let mut part = quad(&format!("ceiling {i}{j}"), u32::from(lamp), corners, exitance);
            part.smooth_group = u32::from(!lamp);
            surfaces.push(part);
        }
    }
    scene(vec![grey("wall", rho), grey("lamp", 0.0)], surfaces, vec![], elements)
}

#[test]
fn probe_in_the_lit_cube_gives_the_reference_values() {
    let point = |at: [f64; 3], normal: DVec3| ProbePoint { at: DVec3::from(at), normal };
    let points = [
        point([0.5, 0.5, 0.0], DVec3::Z),
        point([0.0, 0.5, 0.5], DVec3::X),
        point([0.125, 0.5, 1.0], -DVec3::Z),
    ];
    for (rho, expected) in [(0.5, [0.04238, 0.04314, 0.01786]), (0.8, [0.08377, 0.08488, 0.06160])] {
        let mut s = solved(lit_cube(rho, 1000), &SolveOptions::default());
        let e = probe(&s.scene, &s.mesh, &s.solution, &mut s.caster, &points).expect("software");
        for (e, expected) in e.iter().zip(expected) {
            let got = e.total().0[1];
            assert!((got / expected - 1.0).abs() < 1e-2, "rho {rho}: {got}, {expected} expected");
        }
        assert_eq!(e[2].direct, Rgb::BLACK);
        assert!((s.solution.account.residual_w.0[0] / 0.09).abs() < 2e-3, "{:?}", s.solution.account);
        assert!(s.solution.row_sum_error.max < 5e-3, "{:?}", s.solution.row_sum_error);
    }
}

/// A room with a two-sided, half-mirror board in it, a lamp that touches nothing, a light and a hole.
pub(super) fn cluttered() -> Scene {
    let v = DVec3::new;
    let mut surfaces = room(DVec3::ONE, 0.0);
    surfaces.remove(3);
    let mut board =
        quad("board", 1, [v(0.2, 0.2, 0.5), v(0.8, 0.2, 0.5), v(0.8, 0.8, 0.6), v(0.2, 0.8, 0.6)], 0.0);
    board.two_sided = true;
    surfaces.push(board);
    surfaces.push(quad(
        "lamp",
        2,
        [v(0.4, 0.4, 0.9), v(0.4, 0.6, 0.9), v(0.6, 0.6, 0.9), v(0.6, 0.4, 0.9)],
        5.0,
    ));
    let mut mirror = grey("half mirror", 0.3);
    mirror.specular = Rgb([0.2, 0.3, 0.4]);
    let mut red = grey("red", 0.5);
    red.reflectance = Rgb([0.7, 0.2, 0.1]);
    let light = Light::Point { position: v(0.3, 0.3, 0.2), intensity: Rgb([0.1, 0.2, 0.3]) };
    scene(vec![red, mirror, grey("black", 0.0)], surfaces, vec![light], 500)
}

#[test]
fn account_of_a_cluttered_open_room_closes_channel_by_channel() {
    let s = solved(cluttered(), &SolveOptions::default());
    let a = s.solution.account;
    let sum = a.absorbed_w + a.unshot_w + a.lost_w + a.specular_w + a.back_w + a.residual_w;
    for c in 0..3 {
        assert!((sum.0[c] / a.emitted_w.0[c] - 1.0).abs() < 1e-12);
        assert!(a.lost_w.0[c] > 0.02 && a.specular_w.0[c] > 0.002 && a.back_w.0[c] > 0.0, "{a:?}");
        assert!(a.residual_w.0[c].abs() < 0.02 * a.emitted_w.0[c], "{a:?}");
    }
    assert!(a.unshot_w.sum() <= 2e-4 * a.emitted_w.sum());
    assert!(s.solution.n_shots >= s.solution.n_shooters && s.solution.n_shooters > 50);
}

#[test]
fn solve_gives_the_same_bits_for_one_and_for_two_threads() {
    let in_pool = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool can be built");
        pool.install(|| solved(cluttered(), &SolveOptions::default()).solution)
    };
    assert_eq!(in_pool(1), in_pool(2));
}

#[test]
fn solve_without_memory_for_rows_gives_the_same_bits_at_more_rays() {
    let options = SolveOptions { unshot_share: 5e-3, ..SolveOptions::default() };
    let kept = solved(cluttered(), &options).solution;
    let cast_anew = solved(cluttered(), &SolveOptions { max_row_bytes: 0, ..options }).solution;
    assert!(cast_anew.n_rays > kept.n_rays && kept.n_shots > kept.n_shooters);
    // Reciprocity is told of rows that are kept.
    assert_eq!(cast_anew.reciprocity.n_pairs, 0);
    assert_eq!(Solution { n_rays: kept.n_rays, reciprocity: kept.reciprocity, ..cast_anew }, kept);
}

#[test]
fn solve_at_another_scale_gives_the_same_radiosity() {
    let size = DVec3::new(1.0, 1.5, 0.8);
    let of = |k: f64| {
        let mut s = scene(vec![grey("half", 0.4)], room(size * k, 0.0), vec![], 300);
        s.surfaces[2].exitance = Rgb::WHITE;
        solved(s, &SolveOptions::default()).solution
    };
    let (small, large) = (of(1.0), of(1024.0));
    assert_eq!(small.element_irradiance.len(), large.element_irradiance.len());
    for (a, b) in small.element_irradiance.iter().zip(&large.element_irradiance) {
        assert!((a.total().0[0] - b.total().0[0]).abs() < 1e-5 * a.total().0[0], "{a:?} {b:?}");
    }
}

#[test]
fn solve_of_a_dark_scene_ends_at_once_with_zeros() {
    let s =
        solved(scene(vec![grey("half", 0.5)], room(DVec3::ONE, 0.0), vec![], 100), &SolveOptions::default());
    assert_eq!((s.solution.n_shots, s.solution.n_rays), (0, 0));
    assert!(s.solution.element_irradiance.iter().all(|e| e.total().is_black()));
}

#[test]
fn solve_stops_after_max_shots_and_reports_progress_that_never_ends_above_its_start() {
    let scene = lit_cube(0.5, 300);
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let options = SolveOptions { max_shots: 20, ..SolveOptions::default() };
    let mut shares = Vec::new();
    let solution =
        solve(&scene, &mesh, &mut caster, &options, &mut |p| shares.push((p.n_shots, p.unshot_share)))
            .expect("software");
    assert_eq!((solution.n_shots, shares.len()), (20, 20));
    assert!(shares.windows(2).all(|w| w[1].0 == w[0].0 + 1 && w[1].1 <= w[0].1 + 1e-6), "{shares:?}");
}

#[test]
fn solve_inside_an_inward_sphere_gives_the_uniform_closed_form() {
    let ball = Surface {
        name: "ball".into(),
        material: MaterialId(0),
        shape: Shape::Sphere { center: DVec3::new(0.3, -0.2, 5.0), radius: 2.0, inward: true },
        two_sided: false,
        smooth_group: 1,
        exitance: Rgb::splat(0.6),
    };
    let s = solved(scene(vec![grey("grey", 0.4)], vec![ball], vec![], 800), &tight());
    for e in &s.solution.element_irradiance {
        assert!((e.total().0[0] - 1.0).abs() < 5e-3, "{e:?}");
    }
    for (v, e) in s.mesh.vertices.iter().zip(&s.solution.vertex_irradiance) {
        assert!((e.total().0[0] - 1.0).abs() < 2e-2, "{v:?} {e:?}");
    }
}

#[test]
fn solution_file_of_another_scene_is_refused_and_of_this_scene_read_back() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.radsol");
    let options = SolveOptions { max_shots: 5, ..SolveOptions::default() };
    let s = solved(lit_cube(0.5, 100), &options);
    solution_file::save(&path, &s.scene, &s.mesh, &options, &s.solution).expect("saved");
    let (back, used) = solution_file::load(&path, &s.scene, &s.mesh).expect("loaded");
    assert_eq!((back, used), (s.solution.clone(), options));
    let refusal = |other: Scene| {
        solution_file::load(&path, &other, &Mesh::build(&other)).expect_err("another scene").to_string()
    };
    let text = refusal(lit_cube(0.6, 100));
    assert!(text.contains("reflectance [0.5, 0.5, 0.5] of surface 'floor', the scene has [0.6,"), "{text}");
    assert!(text.contains("--continue-from"), "{text}");
    let mut lit = lit_cube(0.5, 100);
    lit.lights.push(Light::Directional { direction: DVec3::Z, irradiance: Rgb::WHITE });
    let text = refusal(lit);
    assert!(text.contains("another light 1 of 0, the scene has 1"), "{text}");
    let text = refusal(lit_cube(0.5, 400));
    assert!(text.contains("another geometry") && text.contains("patches, the scene has"), "{text}");
    let mut moved = lit_cube(0.5, 100);
    moved.surfaces.swap(1, 3);
    let text = refusal(moved);
    assert!(text.contains("positions of its vertices"), "{text}");
    let missing = solution_file::load(&dir.path().join("b.radsol"), &s.scene, &s.mesh).expect_err("missing");
    assert!(missing.to_string().contains("b.radsol: No such file"), "{missing}");
    let nowhere = dir.path().join("no/such/folder/c.radsol");
    assert!(solution_file::save(&nowhere, &s.scene, &s.mesh, &options, &s.solution).is_err());
    assert_eq!(std::fs::read_dir(dir.path()).expect("the folder").count(), 1);
}

#[test]
fn probe_agrees_with_the_element_means_of_an_occluded_room() {
    let mut s = solved(cluttered(), &SolveOptions::default());
    let floor = s.mesh.surfaces[0].front.clone();
    let (mut worst, mut n) = (0.0_f64, 0);
    for p in floor.step_by(3) {
        for e in s.mesh.patches[p as usize].elements.clone() {
            let id = crate::mesh::ElementId(e);
            let points: Vec<ProbePoint> = s
                .mesh
                .quadrature(id)
                .points()
                .iter()
                .map(|(at, _)| ProbePoint { at: *at, normal: DVec3::Z })
                .collect();
            let probed = probe(&s.scene, &s.mesh, &s.solution, &mut s.caster, &points).expect("software");
            let mean = probed.iter().map(|e| e.indirect.0[0]).sum::<f64>() / probed.len() as f64;
            let stored = s.solution.element_irradiance[e as usize].indirect.0[0];
            worst = worst.max((mean / stored - 1.0).abs());
            n += 1;
        }
    }
    assert!(n > 0 && worst < 0.08, "{worst}");
}

#[test]
fn probes_of_many_points_are_those_of_one_by_one_for_any_number_of_threads() {
    let mut scene = cluttered();
    scene.lights = vec![
        Light::Directional {
            direction: DVec3::new(0.3, 0.2, -1.0).normalize(),
            irradiance: Rgb([3.0, 2.0, 1.0]),
        },
        Light::Point { position: DVec3::new(0.9, 0.4, 0.8), intensity: Rgb::splat(0.7) },
    ];
    let mut s = solved(scene, &SolveOptions { unshot_share: 0.05, ..SolveOptions::default() });
    // More than one query's worth.
    let points: Vec<ProbePoint> = (0..700u32)
        .map(|k| {
            let at = DVec3::new(0.05 + 0.001 * f64::from(k), 0.1 + f64::from(k % 9) * 0.1, 0.3);
            let tilt = f64::from(k % 7) - 3.0;
            ProbePoint { at, normal: DVec3::new(0.2 * tilt, 0.1, 1.0).normalize() }
        })
        .collect();
    let mut shares = Vec::new();
    let many =
        probe_many(&s.scene, &s.mesh, &s.solution, &mut s.caster, &points, &mut |f| shares.push(f)).unwrap();
    assert!(
        shares.len() > 1 && shares.windows(2).all(|w| w[0] < w[1]) && shares.last() == Some(&1.0),
        "{shares:?}"
    );
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let threads = one.install(|| probe(&s.scene, &s.mesh, &s.solution, &mut s.caster, &points).unwrap());
    assert_eq!(many, threads);
    for k in [0, 1, 255, 256, 257, 699] {
        let alone = probe(&s.scene, &s.mesh, &s.solution, &mut s.caster, &points[k..=k]).unwrap();
        assert_eq!(alone[0], many[k], "point {k}");
    }
    assert!(many.iter().any(|e| e.direct != many[0].direct), "all points see the same");
}

#[test]
fn illuminance_of_surfaces_runs_from_their_darkest_to_their_brightest_element() {
    let s = solved(lit_cube(0.5, 600), &tight());
    let table = summary::summarise(&s.scene, &s.mesh, &s.solution);
    let all = summary::totals(&table);
    for row in &table {
        let lx = row.illuminance_lx;
        assert!(lx.min > 0.0 && lx.min <= lx.mean && lx.mean <= lx.max, "{row:?}");
        let mean = row.incident_w.luminance() * crate::photometry::LUMENS_PER_WATT / row.area_m2;
        assert!((lx.mean - mean).abs() < 1e-9 * mean, "{row:?}");
        assert!(all.illuminance_lx.min <= lx.min && all.illuminance_lx.max >= lx.max, "{all:?}");
    }
    let elements = s.solution.element_irradiance.iter().map(|e| e.total().luminance() * 179.0);
    let brightest = elements.fold(0.0, f64::max);
    assert!((all.illuminance_lx.max - brightest).abs() < 1e-9 * brightest);
}
