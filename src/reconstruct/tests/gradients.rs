//! The answered gradient, and the rules that gradients at vertices come from.

use super::*;

fn field(x: DVec3) -> f64 {
    2.0 + (3.0 * x.x).sin() * (2.0 * x.y).cos() + 0.3 * x.z
}

/// World gradient of channel `c`.
fn gradient_of(mesh: &Mesh, r: &Reconstruction, at: SurfacePoint, c: usize) -> DVec3 {
    let [x, y, z] = r.gradient(mesh, at).map(|g| g.0[c]);
    v(x, y, z)
}

#[test]
fn gradient_is_the_slope_of_the_value_and_tangential_in_every_method() {
    let cylinder = Shape::Cylinder { base: v(0., 0., 0.), top: v(0., 0., 1.), radius: 0.4, inward: false };
    let mut meshes = planar_meshes();
    meshes.push(("cylinder", mesh_of([cylinder], 60)));
    for (name, mesh) in meshes {
        for method in Method::ALL {
            let r = sampled(&mesh, method, &field);
            for (e, element) in (0..).map(ElementId).zip(&mesh.elements) {
                // Away from seams of triangles, which central differences would straddle.
                for (s, t) in [(0.13, 0.22), (0.21, 0.34), (0.52, 0.12), (0.12, 0.61), (0.17, 0.19)] {
                    let at = SurfacePoint { element: e, st: DVec2::new(s, t) };
                    let got = gradient_of(&mesh, &r, at, 0);
                    assert!(got.dot(element.normal).abs() < 1e-9, "{method:?} on {name}");
                    for step in [DVec2::X, DVec2::Y].map(|d| 1e-6 * d) {
                        let [a, b] = [-1.0, 1.0].map(|k| SurfacePoint { element: e, st: at.st + k * step });
                        let along = mesh.position(b) - mesh.position(a);
                        let rise = (r.evaluate_unclamped(&mesh, b) - r.evaluate_unclamped(&mesh, a)).0[0];
                        let error = (got.dot(along) - rise).abs() / along.length();
                        assert!(error < 1e-7, "{method:?} on {name} at {s} {t}: {error:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn gradient_has_no_jump_inside_an_element() {
    for (name, mesh) in planar_meshes() {
        for method in [Method::Quadratic, Method::CubicTriangle, Method::Hermite] {
            let r = sampled(&mesh, method, &field);
            let element = ElementId(mesh.elements.len() as u32 / 2);
            let triangle = matches!(mesh.elements[element.0 as usize].corners, Corners::Triangle(_));
            // Largest change from place to place along lines through all parts: a jump does not shrink with the steps.
            let largest_step = |n: u32| {
                let lines = [(0.03, 0.11, 0.9, 0.05), (0.05, 0.93, 0.4, 0.02), (0.02, 0.5, 0.47, 0.51)];
                let steps = lines.iter().flat_map(|&(s0, t0, s1, t1)| {
                    let end = if triangle { (s1, t1) } else { (s1, 1.0 - t1) };
                    let at = move |k: u32| {
                        let w = f64::from(k) / f64::from(n);
                        DVec2::new(s0, t0).lerp(DVec2::new(end.0, end.1), w)
                    };
                    (0..n).map(move |k| [at(k), at(k + 1)])
                });
                steps
                    .map(|st| st.map(|st| gradient_of(&mesh, &r, SurfacePoint { element, st }, 0)))
                    .map(|[a, b]| (a - b).length())
                    .fold(0.0, f64::max)
            };
            let (coarse, fine) = (largest_step(100), largest_step(1600));
            assert!(fine < 0.12 * coarse, "{method:?} on {name}: {coarse:e}, then {fine:e}");
        }
    }
}

/// Where corner (0, 0) of some element stands on the interior vertex nearest to the middle.
fn middle_corner(mesh: &Mesh) -> SurfacePoint {
    let (e, _) = (0..)
        .map(ElementId)
        .zip(&mesh.elements)
        .find(|(_, element)| {
            let x = mesh.vertices[element.corners.vertices()[0].0 as usize].position;
            (x - v(0.5, 0.5, 0.)).length() < 1e-9
        })
        .expect("a vertex in the middle");
    on_edge(mesh, (e, 0), 0.0)
}

fn at_middle(rule: GradientRule, f: &dyn Fn(DVec3) -> f64) -> DVec3 {
    let mesh = square(8);
    let options = ReconstructOptions { gradients: rule, ..Method::Hermite.into() };
    gradient_of(&mesh, &sampled(&mesh, options, f), middle_corner(&mesh), 0)
}

#[test]
fn seed_edge_normals_of_small_slopes_are_half_the_gradient() {
    let got = at_middle(GradientRule::SeedEdgeNormals, &|x| 1e-5 * (3.0 * x.x - 4.0 * x.y));
    assert!((got - 0.5e-5 * v(3., -4., 0.)).length() < 1e-13, "{got}");
}

#[test]
fn seed_edge_normals_depend_on_the_unit_of_radiosity() {
    // s / (1 + sqrt(1 + s^2)), never above 1, and neither for the other channels, which are 2 and 1/2 times the first.
    for scale in [0.1, 1.0, 10.0, 1e4] {
        let s = 2.0 * scale;
        let got = at_middle(GradientRule::SeedEdgeNormals, &|x| s * x.x);
        let expected = s / (1.0 + s.hypot(1.0));
        assert!((got - v(expected, 0., 0.)).length() < 1e-9 * expected.max(1.0), "{scale}: {got}");
        assert!(got.length() < 1.0);
    }
    // Both slopes at once: g_x / sqrt(1 + g_x^2) / (1 / sqrt(1 + g_x^2) + 1 / sqrt(1 + g_y^2)).
    let got = at_middle(GradientRule::SeedEdgeNormals, &|x| 2.0 * x.x + 0.5 * x.y);
    let (a, b) = (1.0 / 2.0_f64.hypot(1.0), 1.0 / 0.5_f64.hypot(1.0));
    assert!((got - v(2.0 * a / (a + b), 0.5 * b / (a + b), 0.)).length() < 1e-12, "{got}");
}

#[test]
fn seed_edge_normals_at_a_border_are_two_thirds_along_it_and_one_third_across() {
    let mesh = square(8);
    let options = ReconstructOptions { gradients: GradientRule::SeedEdgeNormals, ..Method::Hermite.into() };
    let r = sampled(&mesh, options, &|x| 1e-5 * (3.0 * x.x - 4.0 * x.y));
    let (mut seen, mut corners) = (0, 0);
    for (e, element) in (0..).map(ElementId).zip(&mesh.elements) {
        let x = mesh.vertices[element.corners.vertices()[0].0 as usize].position;
        let got = gradient_of(&mesh, &r, on_edge(&mesh, (e, 0), 0.0), 0) / 1e-5;
        if x.y == 0.0 && x.x > 0.1 && x.x < 0.9 {
            assert!((got - v(2.0, -4.0 / 3.0, 0.)).length() < 1e-8, "{x}: {got}");
            seen += 1;
        }
        if x.y == 0.0 && x.x == 0.0 {
            assert!((got - v(1.5, -2.0, 0.)).length() < 1e-8, "{x}: {got}");
            corners += 1;
        }
    }
    assert!(seen >= 3 && corners == 1);
}

#[test]
fn facet_normals_smooth_and_zero_flattens() {
    // The central difference of x^3, smoothed: facets' slopes at x +- h/2 are their secants.
    let h = 0.125;
    let got = at_middle(GradientRule::FacetNormals, &|x| 1e-5 * x.x.powi(3));
    let secant = ((0.5_f64 + h).powi(3) - (0.5_f64 - h).powi(3)) / (2.0 * h);
    assert!((got / 1e-5 - v(secant, 0., 0.)).length() < 1e-8, "{got}");
    assert_eq!(at_middle(GradientRule::Zero, &field), DVec3::ZERO);
    let got = at_middle(GradientRule::LeastSquares, &|x| x.x * x.x - x.y);
    assert!((got - v(1., -1., 0.)).length() < 1e-12);
}

#[test]
fn rules_answer_on_every_mesh_and_zero_has_no_twist() {
    for (name, mesh) in planar_meshes() {
        for gradients in GradientRule::ALL {
            for twists in TwistRule::ALL {
                let options = ReconstructOptions { method: Method::Hermite, gradients, twists };
                let r = sampled(&mesh, options, &field);
                let error = worst_of(&mesh, &r, &field);
                assert!(error < 1.0, "{options:?} on {name}: {error}");
                assert!(largest_gap(&mesh, &r) < 1e-12, "{options:?} on {name}");
            }
        }
    }
    let (mesh, zero) = (square(4), GradientRule::Zero);
    let [a, b] = [TwistRule::Zero, TwistRule::Fit].map(|twists| {
        let options = ReconstructOptions { gradients: zero, twists, ..Method::Hermite.into() };
        sampled(&mesh, options, &field)
    });
    for at in places(&mesh) {
        assert_eq!(a.evaluate(&mesh, at), b.evaluate(&mesh, at));
    }
}
