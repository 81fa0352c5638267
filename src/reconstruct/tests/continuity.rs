//! Where surfaces join: value gaps and jumps of the slope.

use proptest::prelude::*;

use super::*;

fn bent(x: DVec3) -> f64 {
    2.0 + (3.0 * x.x).sin() * (2.0 * x.y).cos() + (x.x * x.y - 0.3).abs()
}

fn wavy(x: DVec3) -> f64 {
    2.0 + (2.5 * x.x + 0.4).sin() * (2.0 * x.y).cos()
}

#[test]
fn slopes_of_smooth_methods_continue_across_parallelograms_and_among_triangles() {
    for (name, mesh) in planar_meshes() {
        let quads = ["square", "coarsest", "sheared", "graded"].contains(&name);
        let triangles = ["triangles", "coarsest triangles"].contains(&name);
        for method in [Method::Quadratic, Method::CubicTriangle, Method::Hermite] {
            // Split quads are triangles.
            if quads || triangles || method != Method::Hermite {
                let (jump, largest) = largest_jump(&mesh, &sampled(&mesh, method, &bent));
                assert!(jump < 1e-9 * largest, "{method:?} on {name}: {jump:e} of {largest}");
            }
        }
        // The measure is able to see a jump: bilinear surfaces have kinks.
        let (jump, largest) = largest_jump(&mesh, &sampled(&mesh, Method::Bilinear, &bent));
        assert!(jump > 1e-2 * largest, "{name}: {jump:e}");
    }
}

/// Meshes on which C1 is not promised: bent quads, valence 3 and 5, quads beside triangles, T-vertices, bent surfaces.
fn hard_meshes() -> Vec<(&'static str, Mesh)> {
    let at = |k: f64, r: f64| {
        let (s, c) = (std::f64::consts::TAU * k).sin_cos();
        v(0.5 + r * c, 0.5 + r * s, 0.)
    };
    let star = |n: u32| {
        let n_f = f64::from(n);
        let quad = move |k: u32| {
            let k = f64::from(k);
            let (a, b) = (at((k - 0.5) / n_f, 0.55), at((k + 0.5) / n_f, 0.55));
            Shape::Quad([at(0., 0.), a, at(k / n_f, 0.8), b])
        };
        (0..n).map(quad).collect::<Vec<_>>()
    };
    let trapezoid = Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(0.8, 0.9, 0.), v(0.15, 0.75, 0.)]);
    let beside = [
        Shape::Quad([v(0., 0., 0.), v(0.6, 0., 0.), v(0.6, 1., 0.), v(0., 1., 0.)]),
        Shape::Triangle([v(0.6, 0., 0.), v(1.3, 0.4, 0.), v(0.6, 1., 0.)]),
    ];
    let sheared = Shape::Quad([v(0., 0., 0.), v(1., 0.2, 0.), v(1.3, 1.0, 0.), v(0.3, 0.8, 0.)]);
    // Inner vertices of a grid moved by up to a fifth of a cell.
    let moved = |i: u32, j: u32| {
        let by = |k: u64| (crate::sampling::hash(11, u64::from(i * 16 + j), k) % 1000) as f64 / 1000.0 - 0.5;
        let free = |i: u32| if i == 0 || i == 6 { 0.0 } else { 0.4 };
        v((f64::from(i) + free(i) * by(1)) / 6.0, (f64::from(j) + free(j) * by(2)) / 6.0, 0.)
    };
    let cell = |i, j| Shape::Quad([moved(i, j), moved(i + 1, j), moved(i + 1, j + 1), moved(i, j + 1)]);
    let jittered: Vec<_> = (0..36).map(|k| cell(k % 6, k / 6)).collect();
    let cylinder = Shape::Cylinder { base: v(0., 0., 0.), top: v(0., 0., 1.), radius: 0.4, inward: false };
    let sphere = Shape::Sphere { center: DVec3::ZERO, radius: 0.6, inward: false };
    vec![
        ("bent quads", mesh_of(jittered.clone(), 140)),
        ("hanging, bent quads", refined(smooth(jittered), 140, 6)),
        ("cylinder", mesh_of([cylinder], 200)),
        ("sphere", mesh_of([sphere], 300)),
        ("trapezoid", mesh_of([trapezoid.clone()], 100)),
        ("valence 3", mesh_of(star(3), 190)),
        ("valence 5", mesh_of(star(5), 240)),
        ("quad beside triangle", mesh_of(beside.clone(), 120)),
        ("hanging, parallelogram", refined(smooth([sheared]), 64, 3)),
        ("hanging, trapezoid", refined(smooth([trapezoid]), 64, 4)),
        ("hanging, mixed", refined(smooth(beside), 64, 5)),
    ]
}

#[test]
fn smooth_methods_leave_no_gap_and_a_tenth_of_the_bilinear_jump_on_any_mesh() {
    for (name, mesh) in hard_meshes() {
        let bilinear = largest_jump(&mesh, &sampled(&mesh, Method::Bilinear, &wavy)).0;
        for method in SMOOTH {
            let r = sampled(&mesh, method, &wavy);
            let (jump, gap) = (largest_jump(&mesh, &r).0, largest_gap(&mesh, &r));
            println!("{name}, {}: jump {:.2e} of bilinear's, gap {gap:.1e}", method.name(), jump / bilinear);
            assert!(gap < 1e-12, "{method:?} on {name}: gap {gap:e}");
            assert!(jump < 0.1 * bilinear, "{method:?} on {name}: {jump:e} against {bilinear:e}");
        }
    }
}

#[test]
fn slopes_continue_over_hanging_edges_of_parallelograms_and_of_coplanar_triangles() {
    let quad = [v(0., 0., 0.), v(2., 0.3, 0.), v(2.4, 1.3, 0.), v(0.4, 1., 0.)];
    let halves = [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]];
    for (name, shapes) in
        [("quads", vec![Shape::Quad(quad)]), ("triangles", halves.map(Shape::Triangle).to_vec())]
    {
        let mesh = refined(smooth(shapes), 64, 3);
        assert!(mesh.hanging.len() > 20);
        for method in [Method::Quadratic, Method::CubicTriangle, Method::Hermite] {
            let (jump, largest) = largest_jump(&mesh, &sampled(&mesh, method, &bent));
            assert!(jump < 1e-9 * largest, "{method:?} on {name}: {jump:e} of {largest}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn hanging_vertices_leave_no_gap_in_any_method(seed: u64, kind in 0..4usize) {
        let (o, a, b, c) = (v(0.4, 0.45, 0.), v(0., 0., 0.), v(1.1, -0.1, 0.), v(1.3, 1.0, 0.));
        let (d, e) = (v(-0.1, 1.2, 0.), v(0.7, 1.4, 0.));
        let shapes = [
            vec![Shape::Quad([a, b, c, o]), Shape::Quad([o, c, e, d]), Shape::Triangle([a, o, d])],
            vec![Shape::Triangle([a, b, o]), Shape::Triangle([b, c, o]), Shape::Triangle([o, c, d])],
            vec![Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)]),
                 Shape::Quad([v(1., 0., 0.), v(2., 0., 0.4), v(2., 1., 0.4), v(1., 1., 0.)])],
            vec![Shape::Cylinder { base: v(0., 0., 0.), top: v(0., 0., 1.), radius: 0.4, inward: false }],
        ][kind].clone();
        let mesh = refined(smooth(shapes), 24, seed);
        crate::mesh::tests::check(&mesh);
        let f = |x: DVec3| (4.0 * x.x + 1.0).sin() + x.y * x.z + 3.0 + (5.0 * x.y).cos();
        for method in Method::ALL.into_iter().filter(|m| *m != Method::Constant) {
            let r = sampled(&mesh, method, &f);
            let gap = largest_gap(&mesh, &r);
            prop_assert!(gap < 1e-12, "{:?}: {}", method, gap);
            let error = |at: SurfacePoint| (r.evaluate(&mesh, at).0[0] - f(mesh.position(at))).abs();
            prop_assert!(places(&mesh).into_iter().map(error).fold(0.0, f64::max) < 2.0);
        }
    }
}

/// Two surfaces that share an edge and nothing else: each vertex on it stands there twice.
fn step_meshes() -> Vec<(&'static str, Mesh)> {
    let half = |x0: f64, x1: f64| Shape::Quad([v(x0, 0., 0.), v(x1, 0., 0.), v(x1, 1., 0.), v(x0, 1., 0.)]);
    let wall = Shape::Quad([v(1., 0., 0.), v(1., 0., 1.), v(1., 1., 1.), v(1., 1., 0.)]);
    let tri = |x: f64| Shape::Triangle([v(1., 0., 0.), v(x, 0.5, 0.), v(1., 1., 0.)]);
    let flipped = Shape::Triangle([v(1., 0., 0.), v(1., 1., 0.), v(0.1, 0.5, 0.)]);
    let make = |shapes: Vec<Shape>, group: u32| {
        let mut surfaces = smooth(shapes);
        surfaces.iter_mut().for_each(|s| s.smooth_group = group);
        Mesh::build(&crate::mesh::tests::scene(surfaces, MeshTarget::Elements(60)))
    };
    vec![
        ("coplanar quads", make(vec![half(0., 1.), half(1., 2.)], 0)),
        ("coplanar triangles", make(vec![flipped, tri(1.8)], 0)),
        ("a crease", make(vec![half(0., 1.), wall], 1)),
    ]
}

#[test]
fn a_step_across_vertices_that_are_not_shared_stays_a_step_in_every_method() {
    for (name, mesh) in step_meshes() {
        let first = |e: ElementId| mesh.patches[mesh.elements[e.0 as usize].patch.0 as usize].surface.0 == 0;
        let mut values = vec![Rgb::BLACK; mesh.vertices.len()];
        for (e, element) in (0..).map(ElementId).zip(&mesh.elements) {
            let value = if first(e) { 1.0 } else { 5.0 };
            element.corners.vertices().iter().for_each(|v| values[v.0 as usize] = Rgb::splat(value));
        }
        let means: Vec<Rgb> = (0..mesh.elements.len() as u32)
            .map(|e| Rgb::splat(if first(ElementId(e)) { 1. } else { 5. }))
            .collect();
        for method in Method::ALL {
            let r = Reconstruction::new(&mesh, method, &values, &means);
            for at in places(&mesh) {
                let expected = if first(at.element) { 1.0 } else { 5.0 };
                let got = r.evaluate(&mesh, at).0[0];
                assert!((got - expected).abs() < 1e-12, "{method:?} on {name}: {got} for {expected}");
            }
        }
    }
}

#[test]
fn evaluate_of_an_overshoot_is_clamped_at_zero() {
    let mesh = square(8);
    let step = |x: DVec3| if x.x > 0.5 { 1.0 } else { 0.0 };
    let r = sampled(&mesh, Method::Hermite, &step);
    let lowest = |clamped: bool| {
        let value = |at| if clamped { r.evaluate(&mesh, at) } else { r.evaluate_unclamped(&mesh, at) };
        places(&mesh).into_iter().map(|at| value(at).min_channel()).fold(f64::INFINITY, f64::min)
    };
    assert!(lowest(false) < -0.01);
    assert_eq!(lowest(true), 0.0);
}
