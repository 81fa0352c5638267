use crate::mesh::Mesh;
use crate::radiosity::solution_file::{load_of_geometry, save};
use crate::radiosity::tests::{grey, lit_cube, room, scene};
use crate::radiosity::{Aids, Solution, SolveOptions, Start, solve, solve_on};
use crate::raycast::software::SoftwareCaster;
use crate::scene::{Light, Scene};
use crate::units::Rgb;
use glam::DVec3;

fn tight() -> SolveOptions {
    SolveOptions { unshot_share: 1e-7, ..SolveOptions::default() }
}

fn solved(scene: &Scene, options: &SolveOptions) -> Solution {
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    solve(scene, &mesh, &mut caster, options, &mut |_| {}).unwrap()
}

/// Solves `old`, writes the solution, reads it for `new` and goes on from it.
fn relit(old: &Scene, new: &Scene, options: &SolveOptions) -> Solution {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.radsol");
    let mesh = Mesh::build(old);
    save(&path, old, &mesh, options, &solved(old, options)).unwrap();
    let stored = load_of_geometry(&path, new, &mesh).unwrap();
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    solve_on(new, &mesh, &mut caster, options, Start::From(&stored), Aids::default(), &mut |_| {}).unwrap()
}

/// Largest difference of an element's irradiance over the mean irradiance.
fn difference(a: &Solution, b: &Solution) -> f64 {
    assert_eq!(a.element_irradiance.len(), b.element_irradiance.len());
    let all = || b.element_irradiance.iter().map(|e| e.total().sum());
    let mean = all().sum::<f64>() / all().count() as f64;
    let pairs = a.element_irradiance.iter().zip(&b.element_irradiance);
    let part = |a: Rgb, b: Rgb| (a - b).0.iter().map(|c| c.abs()).fold(0.0, f64::max);
    pairs.map(|(a, b)| part(a.direct, b.direct).max(part(a.indirect, b.indirect)) / mean).fold(0.0, f64::max)
}

fn assert_same_account(a: &Solution, b: &Solution) {
    let of = |s: &Solution| {
        let a = s.account;
        [a.emitted_w, a.absorbed_w, a.lost_w, a.specular_w, a.back_w, a.residual_w]
    };
    for (i, (x, y)) in of(a).into_iter().zip(of(b)).enumerate() {
        for c in 0..3 {
            let scale = b.account.emitted_w.0[c];
            assert!((x.0[c] - y.0[c]).abs() < 1e-5 * scale, "part {i}: {x:?} {y:?}, {:?}", a.account);
        }
    }
}

#[test]
fn furnace_with_other_emission_and_reflectance_ends_at_its_closed_form() {
    let furnace =
        |m: f64, rho: f64| scene(vec![grey("half", rho)], room(DVec3::new(1.0, 2.0, 1.5), m), vec![], 300);
    let old = furnace(0.5, 0.5);
    for (m, rho) in [(0.6, 0.5), (0.4, 0.5), (0.5, 0.6), (0.5, 0.3), (0.7, 0.0)] {
        let new = furnace(m, rho);
        let (on, anew) = (relit(&old, &new, &tight()), solved(&new, &tight()));
        for e in &on.element_irradiance {
            assert!((e.total().0[1] * (1.0 - rho) / m - 1.0).abs() < 5e-3, "M {m} rho {rho}: {e:?}");
        }
        assert!(difference(&on, &anew) < 2e-6, "M {m} rho {rho}: {}", difference(&on, &anew));
        assert_same_account(&on, &anew);
        assert_eq!(on.earlier.map(|e| e.n_solves), Some(1), "M {m} rho {rho}");
    }
}

#[test]
fn lit_cube_made_brighter_or_darker_ends_as_anew_in_fewer_shots() {
    let options = SolveOptions::default();
    for (then, now) in [(0.5, 0.8), (0.8, 0.5), (0.5, 0.55)] {
        let (old, new) = (lit_cube(then, 300), lit_cube(now, 300));
        let (on, anew) = (relit(&old, &new, &tight()), solved(&new, &tight()));
        assert!(difference(&on, &anew) < 1e-5, "{then} -> {now}: {}", difference(&on, &anew));
        assert_same_account(&on, &anew);
        let (on, anew) = (relit(&old, &new, &options), solved(&new, &options));
        assert!(difference(&on, &anew) < 3e-3, "{then} -> {now}: {}", difference(&on, &anew));
        // From 0.8 to 0.5 more light goes than the lamp gives: that is solved anew.
        let fewer = if on.earlier.is_some() { on.n_shots < anew.n_shots } else { (then, now) == (0.8, 0.5) };
        assert!(fewer, "{then} -> {now}: {} shots, anew {}", on.n_shots, anew.n_shots);
    }
}

#[test]
fn lights_added_moved_and_taken_away_end_as_anew() {
    let light = |x: f64| Light::Point { position: DVec3::new(x, 0.8, 1.3), intensity: Rgb([10.0, 5.0, 1.0]) };
    let sun = Light::Directional { direction: -DVec3::Z, irradiance: Rgb::splat(0.5) };
    let of = |lights: Vec<Light>| {
        let mut walls = room(DVec3::splat(2.0), 0.0);
        walls.remove(1);
        walls[2].exitance = Rgb::splat(8.0);
        scene(vec![grey("half", 0.6)], walls, lights, 300)
    };
    let old = of(vec![light(1.1), sun]);
    for lights in [vec![light(1.2), sun], vec![light(1.1)], vec![light(1.1), sun, light(0.5)], vec![]] {
        let new = of(lights);
        let (on, anew) = (relit(&old, &new, &tight()), solved(&new, &tight()));
        assert!(difference(&on, &anew) < 1e-5, "{} lights: {}", new.lights.len(), difference(&on, &anew));
        assert_same_account(&on, &anew);
    }
}

#[test]
fn lamps_put_out_and_lit_walls_painted_black_are_solved_anew() {
    let furnace = |m: f64, rho: f64| scene(vec![grey("grey", rho)], room(DVec3::ONE, m), vec![], 100);
    let old = furnace(0.5, 0.9);
    for (m, rho) in [(0.0, 0.9), (0.5, 0.1)] {
        let new = furnace(m, rho);
        let (on, anew) = (relit(&old, &new, &tight()), solved(&new, &tight()));
        assert!(on == anew || (m > 0.0 && Solution { n_rays: anew.n_rays, ..on.clone() } == anew), "M {m}");
        assert!(on.earlier.is_none(), "M {m}");
    }
}

#[test]
fn light_that_is_dimmed_or_recoloured_as_a_whole_takes_no_shot() {
    let of = |k: Rgb| {
        let light =
            Light::Point { position: DVec3::new(1.1, 0.8, 1.3), intensity: Rgb([10.0, 5.0, 1.0]) * k };
        let sun = Light::Directional { direction: -DVec3::Z, irradiance: Rgb::splat(0.5) * k };
        let mut walls = room(DVec3::splat(2.0), 0.0);
        walls.remove(1);
        walls[2].exitance = Rgb::splat(8.0) * k;
        walls[3].exitance = Rgb([1.0, 0.0, 2.0]) * k;
        scene(vec![grey("half", 0.6)], walls, vec![light, sun], 300)
    };
    let old = of(Rgb::splat(1.0));
    for k in [Rgb::splat(0.01), Rgb::splat(300.0), Rgb([1.0, 0.7, 0.3])] {
        let new = of(k);
        let (on, anew) = (relit(&old, &new, &tight()), solved(&new, &tight()));
        assert_eq!(on.n_shots, 0, "{k:?}");
        assert!(difference(&on, &anew) < 1e-6, "{k:?}: {}", difference(&on, &anew));
        assert_same_account(&on, &anew);
    }
}

#[test]
fn one_lamp_of_several_dimmed_leaves_the_rest_as_it_was() {
    let of = |m: f64| {
        let mut walls = room(DVec3::splat(2.0), 0.0);
        for (wall, m) in walls.iter_mut().zip([1.0, 3.0, m, 2.0]) {
            wall.exitance = Rgb::splat(m);
        }
        scene(vec![grey("half", 0.6)], walls, vec![], 300)
    };
    let options = SolveOptions::default();
    let (old, new) = (of(2.0), of(1.0));
    let (on, anew) = (relit(&old, &new, &tight()), solved(&new, &tight()));
    assert!(difference(&on, &anew) < 1e-5, "{}", difference(&on, &anew));
    let (on, anew) = (relit(&old, &new, &options), solved(&new, &options));
    assert!(on.n_shots < anew.n_shots, "{} shots, anew {}", on.n_shots, anew.n_shots);
}

#[test]
fn relighting_twice_counts_the_solves_and_their_shots() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.radsol");
    let of = |m: f64| scene(vec![grey("half", 0.5)], room(DVec3::ONE, m), vec![], 100);
    let options = SolveOptions::default();
    let first = of(0.5);
    let mesh = Mesh::build(&first);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let mut solution = solved(&first, &options);
    let mut scene = first;
    let mut n_shots = 0;
    for (i, m) in [0.51, 0.52].into_iter().enumerate() {
        n_shots += solution.n_shots as u64;
        save(&path, &scene, &mesh, &options, &solution).unwrap();
        scene = of(m);
        let stored = load_of_geometry(&path, &scene, &mesh).unwrap();
        let start = Start::From(&stored);
        solution =
            solve_on(&scene, &mesh, &mut caster, &options, start, Aids::default(), &mut |_| {}).unwrap();
        let earlier = solution.earlier.unwrap();
        assert_eq!((earlier.n_solves, earlier.n_shots), (i as u32 + 1, n_shots));
    }
}
