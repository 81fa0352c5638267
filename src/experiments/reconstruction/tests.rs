//! References against closed forms and other computations, and the targets at 8 x 8 elements a wall.

use std::sync::LazyLock;

use super::lit_cube::Wall;
use super::*;
use crate::experiments::validation::lit_cube::reference;
use crate::geom::DVec3;
use crate::reconstruct::metrics::vertex_values;

static CUBE: LazyLock<LitCube> = LazyLock::new(|| LitCube::new(RHO));

#[test]
fn lit_cube_of_the_integral_is_the_one_computed_apart_within_their_accuracy() {
    let mut n = 0;
    for r in reference().iter().filter(|r| r.rho == RHO) {
        let wall = match r.wall {
            "floor" => Wall::Floor,
            "side" => Wall::Side(0),
            _ => Wall::Ceiling,
        };
        let total = CUBE.irradiance(wall, r.u, r.v, Light::Total);
        assert!((total / r.total - 1.0).abs() < 2e-3, "{r:?}: {total}");
        let direct = CUBE.irradiance(wall, r.u, r.v, Light::Direct);
        // The file has six decimals.
        assert!((direct - r.direct).abs() < 1e-6, "{r:?}: {direct}");
        n += 1;
    }
    assert!(n > 600, "{n} points");
}

#[test]
fn lit_cube_absorbs_what_its_lamp_emits() {
    // Means from the midpoints of cells that are finer toward the edges.
    let n = 24;
    let line = |k: u32| 0.5 - 0.5 * (std::f64::consts::PI * f64::from(k) / f64::from(n)).cos();
    let power = |wall: Wall, lamp: bool| {
        let mut sum = 0.0;
        for j in 0..n {
            for i in 0..n {
                let (u, v) = (0.5 * (line(i) + line(i + 1)), 0.5 * (line(j) + line(j + 1)));
                let in_lamp = [u, v].iter().all(|x| (0.35..=0.65).contains(x));
                if wall == Wall::Ceiling && in_lamp != lamp {
                    continue;
                }
                sum += (line(i + 1) - line(i))
                    * (line(j + 1) - line(j))
                    * CUBE.irradiance(wall, u, v, Light::Total);
            }
        }
        sum
    };
    let diffuse = power(Wall::Floor, false) + 4.0 * power(Wall::Side(0), false) + power(Wall::Ceiling, false);
    let absorbed = (1.0 - RHO) * diffuse + power(Wall::Ceiling, true);
    assert!((absorbed / 0.09 - 1.0).abs() < 2e-3, "{absorbed}");
}

#[test]
fn targets_of_the_lit_cube_hold_at_eight_elements_a_wall() {
    let runs = scenes::cube_runs(&CUBE, Extent::Quick).unwrap();
    let checks = targets::cube_checks(stated(&runs).unwrap());
    assert!(checks.len() > 8);
    for check in &checks {
        assert!(check.holds, "{}", check.what);
    }
    let case = scenes::cube_case(&CUBE, STATED, 1.0, Light::Total).unwrap();
    assert_eq!(limited_on(&case), 0);
}

#[test]
fn graded_lit_cube_halves_the_error_of_indirect_light() {
    let rows = scenes::graded(&CUBE, &[8], &[way(HERMITE)]).unwrap();
    let checks = targets::graded_checks(&rows);
    assert_eq!(checks.len(), 1);
    for check in checks {
        assert!(check.holds, "{}", check.what);
    }
}

#[test]
fn limited_hermite_does_not_overshoot_at_the_shadow_of_a_point_light() {
    for run in POINT_SHADOW.runs(Extent::Quick).unwrap() {
        if run.mesh.ends_with(scenes::LINES) {
            // Chosen discontinuities do it without a limiter.
            assert!(run.by(HERMITE).all.negative_share == 0.0, "{:?}", run.by(HERMITE).all);
            continue;
        }
        let check = targets::overshoot_check(&run);
        assert!(check.holds, "{}", check.what);
        // What the limiter is for.
        assert!(run.by(HERMITE).all.overshoot > 0.05 && run.by(LIMITED).n_limited > 0);
    }
}

#[test]
fn shadows_are_those_of_many_points_of_the_lamp() {
    let (scene, shadow) = PENUMBRA.scene(0.5, 1.0).unwrap();
    let lamp = scene.surfaces.iter().find(|s| s.name == "lamp").unwrap();
    let crate::scene::Shape::Quad(v) = lamp.shape else { panic!("a quad") };
    let blocked = |x: DVec3, y: DVec3| {
        let at = x + (y - x) * ((1.35 - x.z) / (y.z - x.z));
        x.z < 1.35 && (1.4..=2.6).contains(&at.x) && (1.5..=2.7).contains(&at.y)
    };
    let n = 160;
    let (mut dark, mut half, mut lit) = (0, 0, 0);
    for (x, normal) in [
        (DVec3::new(2.0, 2.1, 0.0), DVec3::Z),
        (DVec3::new(1.13, 2.0, 0.0), DVec3::Z),
        (DVec3::new(0.7, 1.2, 0.0), DVec3::Z),
        (DVec3::new(2.9, 3.0, 0.0), DVec3::Z),
        (DVec3::new(0.0, 2.0, 0.2), DVec3::X),
        (DVec3::new(2.2, 4.0, 2.0), -DVec3::Y),
    ] {
        let (mut sum, mut seen) = (0.0, 0);
        for k in 0..n * n {
            let (s, t) = ((f64::from(k % n) + 0.5) / f64::from(n), (f64::from(k / n) + 0.5) / f64::from(n));
            let y = v[0] + s * (v[1] - v[0]) + t * (v[3] - v[0]);
            let r = y - x;
            if !blocked(x, y) {
                seen += 1;
                sum += normal.dot(r).max(0.0) * r.z / (std::f64::consts::PI * r.length_squared().powi(2));
            }
        }
        let expected = 20.0 * 0.64 * sum / f64::from(n * n);
        let got = shadow.irradiance(x, normal);
        assert!((got - expected).abs() < 2e-2 * expected + 1e-9, "{x}: {got}, by points {expected}");
        dark += u32::from(seen == 0);
        lit += u32::from(seen == n * n);
        half += u32::from(seen > 0 && seen < n * n);
    }
    assert!(dark > 0 && half > 1 && lit > 1, "{dark} dark, {half} half lit, {lit} lit");
}

#[test]
fn point_shadow_is_dark_behind_its_square_and_by_the_square_of_the_distance_elsewhere() {
    let (_, shadow) = POINT_SHADOW.scene(0.5, 1.0).unwrap();
    let light = DVec3::new(2.05, 2.13, 2.6);
    assert_eq!(shadow.irradiance(DVec3::new(2.0, 2.0, 0.0), DVec3::Z), 0.0);
    for (x, n) in [(DVec3::new(0.3, 0.4, 0.0), DVec3::Z), (DVec3::new(0.0, 2.0, 2.9), DVec3::X)] {
        let r = light - x;
        let expected = 10.0 * n.dot(r) / r.length().powi(3);
        assert!((shadow.irradiance(x, n) - expected).abs() < 1e-12, "{x}");
    }
    // Just inside and outside its edge: the square's x = 1.4 at 1.5 m as seen from the light falls on 0.5136.
    let edge = 2.05 - (2.05 - 1.4) * 2.6 / 1.1;
    for (x, dark) in [(edge + 1e-6, true), (edge - 1e-6, false)] {
        assert_eq!(shadow.irradiance(DVec3::new(x, 2.1, 0.0), DVec3::Z) == 0.0, dark, "{x}");
    }
}

#[test]
fn nested_reference_has_the_dense_solution_at_the_coarse_vertices() {
    let scene = scenes::cube_scene(2, 1.0).unwrap();
    let (mesh, nested) =
        nested::Nested::new(&scene, nested::Dense { splits: 2, dense_visibility: true }).unwrap();
    // By the integral, at vertices away from edges: sources of 1/2 m are coarse.
    let (by_solving, by_integral) =
        (vertex_values(&mesh, &nested), vertex_values(&mesh, &CUBE.light(Light::Total)));
    let mut n = 0;
    for ((v, a), b) in mesh.vertices.iter().zip(by_solving).zip(by_integral) {
        let inner = v.position.to_array().iter().filter(|x| (0.2..0.8).contains(*x)).count() == 2;
        if inner && v.normal.z > -0.5 {
            assert!((a.luminance() / b.luminance() - 1.0).abs() < 0.05, "{}: {a:?} {b:?}", v.position);
            n += 1;
        }
    }
    assert!(n >= 5, "{n} vertices");
}

#[test]
fn literal_rule_returns_what_the_mean_of_unit_normals_has() {
    for r in literal::returned().unwrap() {
        let p = r.slope;
        let expected = 1.0 / (1.0 + (1.0 + p * p).sqrt());
        assert!((r.shares[0] - expected).abs() < 1e-9, "{r:?}, expected {expected}");
        assert!((r.shares[1] - 1.0).abs() < 1e-9 && (r.shares[2] - 1.0).abs() < 1e-9, "{r:?}");
        assert_eq!(r.shares[3], 0.0);
    }
}

#[test]
fn picture_of_bilinear_shows_creases_that_hermite_has_not() {
    let case = scenes::cube_case(&CUBE, STATED, 1.0, Light::Total).unwrap();
    let (rows, shown) = cube_pictures(&CUBE, &case, 192, Extent::Quick).unwrap();
    assert!(rows.len() == 2 && rows.iter().all(|row| row.len() == 4));
    let added = |name: &str| shown.iter().find(|s| s.way == name).and_then(|s| s.bands).unwrap().rms_added;
    assert!(added(BILINEAR) > 1.5 * added(HERMITE), "{} {}", added(BILINEAR), added(HERMITE));
    assert_eq!(added("reference"), 0.0);
}
