//! Tests of reconstruction: reproduction of polynomials, continuity, convergence.

use std::f64::consts::PI;

use glam::DVec2;
use proptest::prelude::*;

use super::*;
use crate::geom::DVec3;
use crate::mesh::{Continuity, Corners, ElementId};
use crate::scene::{MeshTarget, Scene, Shape, Surface};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Surfaces of one smooth group.
fn smooth(shapes: impl IntoIterator<Item = Shape>) -> Vec<Surface> {
    let make =
        |(i, shape)| Surface { smooth_group: 1, ..crate::mesh::tests::surface(&format!("s{i}"), shape) };
    shapes.into_iter().enumerate().map(make).collect()
}

fn mesh_of(shapes: impl IntoIterator<Item = Shape>, elements: u32) -> Mesh {
    let scene: Scene = crate::mesh::tests::scene(smooth(shapes), MeshTarget::Elements(elements));
    Mesh::build(&scene)
}

/// The unit square with n x n elements.
fn square(n: u32) -> Mesh {
    mesh_of([Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)])], n * n)
}

fn sampled(mesh: &Mesh, method: Method, f: &dyn Fn(DVec3) -> f64) -> Reconstruction {
    let rgb = |x: DVec3| Rgb([f(x), 2.0 * f(x), 0.5 * f(x)]);
    let values: Vec<Rgb> = mesh.vertices.iter().map(|v| rgb(v.position)).collect();
    let means: Vec<Rgb> = (0..mesh.elements.len())
        .map(|e| {
            let q = mesh.quadrature(ElementId(e as u32));
            q.points().iter().map(|&(x, w)| rgb(x) * w).sum::<Rgb>() / mesh.elements[e].area_m2
        })
        .collect();
    Reconstruction::new(mesh, method, &values, &means)
}

/// Places in every element: inside, on edges, at corners.
fn places(mesh: &Mesh) -> Vec<SurfacePoint> {
    let mut all = Vec::new();
    for (e, element) in mesh.elements.iter().enumerate() {
        for (s, t) in
            [(0., 0.), (1., 0.), (0., 1.), (0.5, 0.), (0.2, 0.3), (0.1, 0.85), (0.7, 0.1), (0.8, 0.9)]
        {
            if matches!(element.corners, Corners::Quad(_)) || s + t <= 1.0 {
                all.push(SurfacePoint { element: ElementId(e as u32), st: DVec2::new(s, t) });
            }
        }
    }
    assert!(!all.is_empty());
    all
}

/// Largest |reconstruction - f| over the mesh, all channels.
fn worst(mesh: &Mesh, method: Method, f: &dyn Fn(DVec3) -> f64) -> f64 {
    let r = sampled(mesh, method, f);
    let error = |at: SurfacePoint| {
        let exact = f(mesh.position(at));
        let got = r.evaluate_unclamped(mesh, at);
        (got - Rgb([exact, 2.0 * exact, 0.5 * exact])).map(f64::abs).max_channel()
    };
    places(mesh).into_iter().map(error).fold(0.0, f64::max)
}

/// A fan of quads and triangles over a bent outline: nothing regular about it.
fn irregular() -> Vec<(&'static str, Mesh)> {
    let (o, a, b, c) = (v(0.4, 0.45, 0.), v(0., 0., 0.), v(1.1, -0.1, 0.), v(1.3, 1.0, 0.));
    let (d, e) = (v(-0.1, 1.2, 0.), v(0.7, 1.4, 0.));
    let quads = [Shape::Quad([a, b, c, o]), Shape::Quad([o, c, e, d]), Shape::Triangle([a, o, d])];
    let triangles = [
        Shape::Triangle([a, b, o]),
        Shape::Triangle([b, c, o]),
        Shape::Triangle([c, d, o]),
        Shape::Triangle([d, a, o]),
    ];
    let graded = [0.0, 0.05, 0.2, 0.6, 1.0]
        .windows(2)
        .map(|w| Shape::Quad([v(w[0], 0., 0.), v(w[1], 0., 0.), v(w[1], 1., 0.), v(w[0], 1., 0.)]))
        .collect::<Vec<_>>();
    let sheared = [Shape::Quad([v(0., 0., 0.), v(1., 0.2, 0.), v(1.7, 1.0, 0.), v(0.7, 0.8, 0.)])];
    let trapezoid = [Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(0.7, 0.9, 0.), v(0.2, 0.6, 0.)])];
    vec![
        ("square", square(8)),
        ("coarsest", square(2)),
        ("graded", mesh_of(graded, 150)),
        ("sheared", mesh_of(sheared, 60)),
        ("trapezoid", mesh_of(trapezoid, 60)),
        ("quads and a triangle", mesh_of(quads, 80)),
        ("triangles", mesh_of(triangles, 80)),
        ("coarsest triangles", mesh_of([Shape::Triangle([a, b, c])], 1)),
    ]
}

#[test]
fn every_method_of_a_constant_is_that_constant() {
    for (name, mesh) in irregular() {
        for method in [Method::Constant, Method::Bilinear, Method::Hermite] {
            let error = worst(&mesh, method, &|_| 0.7);
            assert!(error < 1e-12, "{method:?} on {name}: {error:e}");
        }
    }
}

#[test]
fn bilinear_and_hermite_reproduce_linear_fields_on_any_mesh() {
    for (name, mesh) in irregular() {
        for method in [Method::Bilinear, Method::Hermite] {
            let error = worst(&mesh, method, &|x| 3.0 + 0.8 * x.x - 1.3 * x.y);
            assert!(error < 1e-12, "{method:?} on {name}: {error:e}");
        }
    }
}

#[test]
fn hermite_reproduces_quadratic_fields_on_any_planar_mesh() {
    let f = |x: DVec3| 3.0 + 0.8 * x.x - 1.3 * x.y + 0.6 * x.x * x.x - 0.9 * x.x * x.y + 1.7 * x.y * x.y;
    for (name, mesh) in irregular() {
        // Five neighbours cannot carry the five unknowns of a quadratic on a triangle of four elements.
        if name == "coarsest triangles" {
            continue;
        }
        let error = worst(&mesh, Method::Hermite, &f);
        assert!(error < 1e-10, "{name}: {error:e}");
    }
}

#[test]
fn hermite_meets_vertex_values_exactly() {
    let f = |x: DVec3| 2.0 + (3.0 * x.x).sin() * (2.0 * x.y).cos();
    for (name, mesh) in irregular() {
        let r = sampled(&mesh, Method::Hermite, &f);
        for (e, element) in mesh.elements.iter().enumerate() {
            let at = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)];
            let at =
                if matches!(element.corners, Corners::Quad(_)) { at } else { [at[0], at[1], at[3], at[3]] };
            for (&id, (s, t)) in element.corners.vertices().iter().zip(at) {
                let got =
                    r.evaluate(&mesh, SurfacePoint { element: ElementId(e as u32), st: DVec2::new(s, t) });
                let exact = f(mesh.vertices[id.0 as usize].position);
                assert!((got.0[0] - exact).abs() < 1e-14, "{name}");
            }
        }
    }
}

/// Slope (per metre) into parallelogram or triangle `e` at its edge `k`, `along` of the way, along the edge's inner
/// normal.
fn inner_slope(mesh: &Mesh, r: &Reconstruction, e: usize, k: usize, along: f64) -> f64 {
    let element = &mesh.elements[e];
    let p = mesh.polygon(&element.corners);
    let n = p.len();
    let foot = p[k].lerp(p[(k + 1) % n], along);
    let inner = element.normal.cross(p[(k + 1) % n] - p[k]).normalize();
    let (x_s, x_t) = (p[1] - p[0], p[n - 1] - p[0]);
    let area = x_s.cross(x_t);
    let st_of = |d: DVec3| DVec2::new(d.cross(x_t).dot(area), x_s.cross(d).dot(area)) / area.length_squared();
    let st = st_of(foot - p[0]);
    // Exact for cubics; the step is short enough to stay in the cubic next to a triangle's edge.
    let slope = |step: DVec2| {
        let value = |i: f64| {
            let at = SurfacePoint { element: ElementId(e as u32), st: st + i * step };
            r.evaluate_unclamped(mesh, at).0[0]
        };
        (-11.0 * value(0.0) + 18.0 * value(1.0) - 9.0 * value(2.0) + 2.0 * value(3.0)) / 6.0
    };
    let inner_st = st_of(inner);
    match element.corners {
        Corners::Triangle(_) => {
            let h = 0.004 * element.area_m2.sqrt();
            slope(h * inner_st) / h
        }
        // A bicubic is a cubic along s and along t only.
        Corners::Quad(_) => {
            (inner_st.x * slope(0.25 * DVec2::X) + inner_st.y * slope(0.25 * DVec2::Y)) / 0.25
        }
    }
}

/// Largest jump of the slope across C1 edges over the largest slope.
fn relative_jump(mesh: &Mesh, f: &dyn Fn(DVec3) -> f64) -> f64 {
    let r = sampled(mesh, Method::Hermite, f);
    let (mut jump, mut largest, mut n) = (0.0_f64, 0.0_f64, 0);
    for (e, element) in mesh.elements.iter().enumerate() {
        for k in 0..element.corners.vertices().len() {
            let (Some(other), Continuity::C1) = (element.neighbours[k], element.continuity[k]) else {
                continue;
            };
            if mesh.hanging_on(ElementId(e as u32), k).is_some() {
                continue;
            }
            let back = mesh.elements[other.0 as usize].neighbours;
            let m = back.iter().position(|b| *b == Some(ElementId(e as u32)));
            let Some(m) = m.filter(|m| mesh.hanging_on(other, *m).is_none()) else { continue };
            for along in [0.3, 0.5, 0.6] {
                let (here, there) = (
                    inner_slope(mesh, &r, e, k, along),
                    inner_slope(mesh, &r, other.0 as usize, m, 1.0 - along),
                );
                jump = jump.max((here + there).abs());
                largest = largest.max(here.abs());
                n += 1;
            }
        }
    }
    assert!(n >= 18);
    jump / largest
}

#[test]
fn hermite_is_c1_across_parallelograms_and_across_coplanar_triangles() {
    let f = |x: DVec3| 2.0 + (3.0 * x.x).sin() * (2.0 * x.y).cos() + (x.x * x.y - 0.3).abs();
    for (name, mesh) in irregular() {
        if ["square", "sheared", "graded", "triangles", "coarsest triangles"].contains(&name) {
            let jump = relative_jump(&mesh, &f);
            assert!(jump < 1e-9, "{name}: {jump:e}");
        }
    }
    // The measure is able to see a jump: bilinear patches have kinks.
    let mesh = square(4);
    let kinks = sampled(&mesh, Method::Bilinear, &f);
    let here = inner_slope(&mesh, &kinks, 0, 1, 0.5);
    let there = inner_slope(&mesh, &kinks, 1, 3, 0.5);
    assert!((here + there).abs() > 1e-2);
}

/// L2 error over the surface by a 5 x 5 midpoint rule in each element.
fn l2(mesh: &Mesh, method: Method, f: &dyn Fn(DVec3) -> f64) -> f64 {
    let r = sampled(mesh, method, f);
    let mut sum = 0.0;
    for (e, element) in mesh.elements.iter().enumerate() {
        for k in 0..25 {
            let st = DVec2::new(0.1 + 0.2 * f64::from(k % 5), 0.1 + 0.2 * f64::from(k / 5));
            let at = SurfacePoint { element: ElementId(e as u32), st };
            let error = r.evaluate(mesh, at).0[0] - f(mesh.position(at));
            sum += error * error * element.area_m2 / 25.0;
        }
    }
    sum.sqrt()
}

fn order(method: Method) -> f64 {
    let f = |x: DVec3| 2.0 + (PI * x.x + 0.3).sin() * (1.5 * PI * x.y).cos();
    let (coarse, fine) = (l2(&square(8), method, &f), l2(&square(32), method, &f));
    (coarse / fine).log2() / 2.0
}

#[test]
fn l2_error_of_a_smooth_field_falls_with_order_two_bilinear_and_near_three_hermite() {
    let (constant, bilinear, hermite) =
        (order(Method::Constant), order(Method::Bilinear), order(Method::Hermite));
    assert!((constant - 1.0).abs() < 0.1, "constant {constant}");
    assert!((bilinear - 2.0).abs() < 0.1, "bilinear {bilinear}");
    assert!(hermite >= 2.8, "hermite {hermite}");
}

#[test]
fn hermite_beats_bilinear_on_the_light_of_a_square_lamp() {
    // Floor of a unit cube below a square lamp of half width 0.15: the parallel rectangle over a corner, four times.
    let corner = |a: f64, b: f64| {
        let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * PI)
    };
    let f = |x: DVec3| {
        let (l, r) = (0.35 - x.x, 0.65 - x.x);
        let (d, u) = (0.35 - x.y, 0.65 - x.y);
        corner(r, u) - corner(l, u) - corner(r, d) + corner(l, d)
    };
    let mesh = square(8);
    let (bilinear, hermite) = (l2(&mesh, Method::Bilinear, &f), l2(&mesh, Method::Hermite, &f));
    assert!(hermite < 0.2 * bilinear, "{hermite} vs {bilinear}");
}

#[test]
fn hermite_on_a_sphere_beats_bilinear_and_meets_across_the_seam() {
    let mesh = mesh_of([Shape::Sphere { center: DVec3::ZERO, radius: 1.0, inward: false }], 100);
    let f = |x: DVec3| 2.0 + x.normalize().dot(v(0.6, -0.48, 0.64));
    let worst = |method| {
        let r = sampled(&mesh, method, &f);
        let error = |at| (r.evaluate(&mesh, at).0[0] - f(mesh.position(at))).abs();
        places(&mesh).into_iter().map(error).fold(0.0, f64::max)
    };
    let (bilinear, hermite) = (worst(Method::Bilinear), worst(Method::Hermite));
    assert!(hermite < 0.2 * bilinear, "{hermite} vs {bilinear}");
}

#[test]
fn values_break_at_creases_and_only_there() {
    let floor = Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)]);
    let wall = Shape::Quad([v(1., 0., 0.), v(1., 0., 1.), v(1., 1., 1.), v(1., 1., 0.)]);
    let mesh = mesh_of([floor, wall], 32);
    let wall_vertex = |i: usize| mesh.vertices[i].normal.x.abs() > 0.5;
    let values: Vec<Rgb> =
        (0..mesh.vertices.len()).map(|i| Rgb::splat(if wall_vertex(i) { 5.0 } else { 1.0 })).collect();
    let r = Reconstruction::new(&mesh, Method::Hermite, &values, &[]);
    for at in places(&mesh) {
        let expected = if mesh.elements[at.element.0 as usize].normal.x.abs() > 0.5 { 5.0 } else { 1.0 };
        assert!((r.evaluate(&mesh, at).0[0] - expected).abs() < 1e-12);
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

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
        let error = worst(&mesh, Method::Hermite, &f);
        prop_assert!(error < 1e-10, "{:e}", error);
    }
}

/// Random quadtrees under the patches of every irregular mesh, balanced.
fn refined(surfaces: Vec<Surface>, elements: u32, seed: u64) -> Mesh {
    let scene = crate::mesh::tests::scene(surfaces, MeshTarget::Elements(elements));
    let n = Mesh::build(&scene).patches.len() as u32;
    let subdivision = crate::mesh::Subdivision::new(n, |p, place| {
        let id = place.quarters().fold(1, |id, q| 4 * id + u64::from(q));
        place.level() < 4 && crate::sampling::hash(seed, p.into(), id) % 10 < 5
    });
    Mesh::build_with(&scene, &subdivision).expect("the patches of this scene")
}

/// Largest difference between both sides of the halves of coarse edges, over the largest value; how many were seen.
fn largest_gap(mesh: &Mesh, r: &Reconstruction) -> (f64, usize) {
    let on_edge = |element: ElementId, edge: usize, along: f64| {
        let st = match mesh.elements[element.0 as usize].corners {
            Corners::Triangle(_) => [DVec2::ZERO, DVec2::X, DVec2::Y],
            Corners::Quad(_) => [DVec2::ZERO, DVec2::X, DVec2::ONE],
        };
        let n = mesh.elements[element.0 as usize].corners.vertices().len();
        let corner = |k: usize| if n == 4 && k % 4 == 3 { DVec2::Y } else { st[k % n] };
        SurfacePoint { element, st: corner(edge).lerp(corner(edge + 1), along) }
    };
    let (mut gap, mut largest) = (0.0_f64, 0.0_f64);
    for h in &mesh.hanging {
        for (half, fine) in h.fine.into_iter().enumerate() {
            let ids = mesh.elements[fine.0 as usize].corners.vertices();
            let start = if half == 0 { h.vertex } else { h.ends[1] };
            let edge = ids.iter().position(|v| *v == start).expect("it has the half edge");
            for k in 0..=8 {
                let along = f64::from(k) / 8.0;
                let coarse = on_edge(h.coarse, h.edge.into(), 0.5 * (half as f64 + along));
                let fine = on_edge(fine, edge, 1.0 - along);
                assert!(mesh.position(coarse).distance(mesh.position(fine)) < 1e-12);
                let (a, b) = (r.evaluate_unclamped(mesh, coarse), r.evaluate_unclamped(mesh, fine));
                gap = gap.max((a - b).map(f64::abs).max_channel());
                largest = largest.max(a.map(f64::abs).max_channel());
            }
        }
    }
    (gap / largest, mesh.hanging.len())
}

#[test]
fn hermite_is_c1_over_hanging_edges_of_parallelograms_and_of_coplanar_triangles() {
    let f = |x: DVec3| 2.0 + (3.0 * x.x).sin() * (2.0 * x.y).cos() + (x.x * x.y - 0.3).abs();
    let quad = [v(0., 0., 0.), v(2., 0.3, 0.), v(2.4, 1.3, 0.), v(0.4, 1., 0.)];
    let halves = [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]];
    for (name, shapes) in
        [("quads", vec![Shape::Quad(quad)]), ("triangles", halves.map(Shape::Triangle).to_vec())]
    {
        let mesh = refined(smooth(shapes), 64, 3);
        let r = sampled(&mesh, Method::Hermite, &f);
        let (mut jump, mut largest) = (0.0_f64, 0.0_f64);
        assert!(mesh.hanging.len() > 20);
        for h in &mesh.hanging {
            for (half, fine) in h.fine.into_iter().enumerate() {
                let ids = mesh.elements[fine.0 as usize].corners.vertices();
                let start = if half == 0 { h.vertex } else { h.ends[1] };
                let edge = ids.iter().position(|v| *v == start).expect("it has the half edge");
                for along in [0.2, 0.5, 0.7] {
                    let k = usize::from(h.edge);
                    let here = inner_slope(&mesh, &r, h.coarse.0 as usize, k, 0.5 * (half as f64 + along));
                    let there = inner_slope(&mesh, &r, fine.0 as usize, edge, 1.0 - along);
                    jump = jump.max((here + there).abs());
                    largest = largest.max(here.abs());
                }
            }
        }
        assert!(jump < 1e-8 * largest, "{name}: {jump:e} of {largest}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

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
        for method in [Method::Bilinear, Method::Hermite] {
            let r = sampled(&mesh, method, &f);
            let (gap, seen) = largest_gap(&mesh, &r);
            if seen > 0 {
                prop_assert!(gap < 1e-12, "{:?}: {}", method, gap);
            }
            let jump = |at: SurfacePoint| (r.evaluate(&mesh, at).0[0] - f(mesh.position(at))).abs();
            prop_assert!(places(&mesh).into_iter().map(jump).fold(0.0, f64::max) < 2.0);
        }
    }
}
