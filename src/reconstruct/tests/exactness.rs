//! What must come out exactly: values at vertices, constants, linear, quadratic and bicubic fields.

use proptest::prelude::*;

use super::*;

#[test]
fn every_method_of_a_constant_is_that_constant() {
    for (name, mesh) in planar_meshes() {
        for method in Method::ALL {
            let error = worst(&mesh, method, &|_| 0.7);
            assert!(error < 1e-12, "{method:?} on {name}: {error:e}");
        }
    }
}

#[test]
fn every_method_but_constant_reproduces_linear_fields_on_any_mesh() {
    for (name, mesh) in planar_meshes() {
        for method in Method::ALL.into_iter().filter(|m| *m != Method::Constant) {
            for gradients in [GradientRule::LeastSquares, GradientRule::FacetNormals] {
                for twists in TwistRule::ALL {
                    let options = ReconstructOptions { method, gradients, twists };
                    let error = worst(&mesh, options, &|x| 3.0 + 0.8 * x.x - 1.3 * x.y);
                    assert!(error < 1e-12, "{options:?} on {name}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn linear_fields_stay_linear_over_hanging_vertices() {
    let (a, b, c, d) = (v(0., 0., 0.), v(1.1, -0.1, 0.), v(1.3, 1.0, 0.), v(0.4, 0.45, 0.));
    let mesh = refined(smooth([Shape::Quad([a, b, c, d]), Shape::Triangle([c, v(0., 1.2, 0.), d])]), 24, 3);
    assert!(mesh.hanging.len() > 20);
    for method in SMOOTH {
        let error = worst(&mesh, method, &|x| 3.0 + 0.8 * x.x - 1.3 * x.y);
        assert!(error < 1e-12, "{method:?}: {error:e}");
    }
}

fn quadratic(x: f64, y: f64) -> (f64, [f64; 2], [f64; 3]) {
    let f = 3.0 + 0.8 * x - 1.3 * y + 0.6 * x * x - 0.9 * x * y + 1.7 * y * y;
    (f, [0.8 + 1.2 * x - 0.9 * y, -1.3 - 0.9 * x + 3.4 * y], [1.2, -0.9, 3.4])
}

#[test]
fn smooth_methods_reproduce_quadratic_fields_on_regular_meshes() {
    let f = |x: DVec3| quadratic(x.x, x.y).0;
    for (name, mesh) in planar_meshes().into_iter().take(4) {
        for method in SMOOTH {
            for twists in [TwistRule::Fit, TwistRule::Adini] {
                let options = ReconstructOptions { method, twists, ..ReconstructOptions::default() };
                let error = worst(&mesh, options, &f);
                assert!(error < 1e-12, "{options:?} on {name}: {error:e}");
            }
        }
    }
}

#[test]
fn smooth_methods_reproduce_quadratic_fields_on_any_mesh_from_exact_derivatives() {
    for (name, mesh) in planar_meshes() {
        for method in SMOOTH {
            let error = worst_of(&mesh, &known(&mesh, method, &quadratic, true), &|x| quadratic(x.x, x.y).0);
            assert!(error < 1e-12, "{method:?} on {name}: {error:e}");
        }
    }
}

#[test]
fn hermite_reproduces_quadratic_fields_on_any_planar_mesh() {
    for (name, mesh) in planar_meshes() {
        // Five neighbours cannot carry the five unknowns of a quadratic on a triangle of four elements.
        if name == "coarsest triangles" {
            continue;
        }
        let error = worst(&mesh, Method::Hermite, &|x| quadratic(x.x, x.y).0);
        assert!(error < 1e-10, "{name}: {error:e}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn hermite_of_any_bicubic_from_exact_gradients_and_twists_is_exact(
        k in prop::array::uniform16(-1.0..1.0f64), n in 1..6u32
    ) {
        let f = |x: f64, y: f64| {
            let power = |x: f64, p: usize, d: usize| match d {
                _ if p < d => 0.0,
                0 => x.powi(p as i32),
                1 => p as f64 * x.powi(p as i32 - 1),
                _ => (p * (p - 1)) as f64 * x.powi(p as i32 - 2),
            };
            let sum = |dx: usize, dy: usize| -> f64 {
                (0..16).map(|i| k[i] * power(x, i / 4, dx) * power(y, i % 4, dy)).sum()
            };
            (sum(0, 0), [sum(1, 0), sum(0, 1)], [sum(2, 0), sum(1, 1), sum(0, 2)])
        };
        // Twice as many elements along x, so that lengths of both directions differ.
        let mesh = mesh_of(
            [Shape::Quad([v(0., 0., 0.), v(2., 0., 0.), v(2., 1., 0.), v(0., 1., 0.)])], 2 * n * n);
        let error = worst_of(&mesh, &known(&mesh, Method::Hermite, &f, true), &|x| f(x.x, x.y).0);
        let largest: f64 = places(&mesh).into_iter()
            .map(|at| { let x = mesh.position(at); f(x.x, x.y).0.abs() }).fold(1.0, f64::max);
        prop_assert!(error < 1e-12 * largest, "{:e} of {}", error, largest);
        // Without the twists it is another surface.
        let options = ReconstructOptions { twists: TwistRule::Zero, ..Method::Hermite.into() };
        let without = worst_of(&mesh, &known(&mesh, options, &f, false), &|x| f(x.x, x.y).0);
        prop_assert!(without > 1e-6, "{:e}", without);
    }

    #[test]
    fn hermite_of_any_quadratic_on_any_convex_quad_is_exact(
        corner in prop::array::uniform2(0.5..1.5f64), lift in prop::array::uniform2(-1.0..1.0f64),
        k in prop::array::uniform6(-1.0..1.0f64), n in 4..60u32
    ) {
        prop_assume!(corner[0] + corner[1] > 1.2);
        // A tilted plane: z = lift . (x, y).
        let on = |x: f64, y: f64| v(x, y, lift[0] * x + lift[1] * y);
        let quad = Shape::Quad([on(0., 0.), on(1., 0.), on(corner[0], corner[1]), on(0., 1.)]);
        let mesh = mesh_of([quad], n);
        let f = |x: DVec3| {
            k[0] + k[1] * x.x + k[2] * x.y + k[3] * x.x * x.x + k[4] * x.x * x.y + k[5] * x.y * x.y
        };
        for method in [Method::Hermite, Method::Quadratic, Method::CubicTriangle] {
            let error = worst(&mesh, method, &f);
            prop_assert!(error < 1e-10, "{:?}: {:e}", method, error);
        }
    }
}

#[test]
fn vertex_values_are_met_exactly() {
    let f = |x: DVec3| 2.0 + (3.0 * x.x).sin() * (2.0 * x.y).cos();
    for (name, mesh) in planar_meshes() {
        for method in Method::ALL.into_iter().filter(|m| *m != Method::Constant) {
            let r = sampled(&mesh, method, &f);
            for (e, element) in (0..).map(ElementId).zip(&mesh.elements) {
                for (k, id) in element.corners.vertices().iter().enumerate() {
                    let got = r.evaluate(&mesh, on_edge(&mesh, (e, k), 0.0));
                    assert_eq!(got, rgb(f(mesh.vertices[id.0 as usize].position)), "{method:?} on {name}");
                }
            }
        }
    }
}
