//! Metrics against closed forms: bilinear of a quadratic, Hermite of a step, exact fields.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::mesh::tests::{scene, surface};
use crate::reconstruct::Method;
use crate::scene::{MeshTarget, Shape};

const N: u32 = 8;

fn corners() -> [DVec3; 4] {
    [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]
}

/// The unit square with n x n elements.
fn square(n: u32) -> Mesh {
    Mesh::build(&scene(vec![surface("s", Shape::Quad(corners()))], MeshTarget::Elements(n * n)))
}

/// Two triangles with smooth joins.
fn triangles(n: u32) -> Mesh {
    let [a, b, c, d] = corners();
    let of = |name, v| crate::scene::Surface { smooth_group: 1, ..surface(name, Shape::Triangle(v)) };
    Mesh::build(&scene(vec![of("s", [a, b, c]), of("t", [a, c, d])], MeshTarget::Elements(2 * n * n)))
}

fn field(f: impl Fn(DVec3) -> f64 + Sync) -> impl Reference {
    move |mesh: &Mesh, at: SurfacePoint| f(mesh.position(at))
}

fn all(_: ElementId) -> Option<usize> {
    Some(0)
}

fn measured(mesh: &Mesh, method: Method, reference: &impl Reference) -> (Samples, Metrics) {
    let samples = Samples::new(mesh, all, reference);
    let (vertices, means) = (vertex_values(mesh, reference), element_means(mesh, reference));
    let metrics = samples.measure(mesh, &Reconstruction::new(mesh, method, &vertices, &means));
    (samples, metrics)
}

#[track_caller]
fn close(got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() < tolerance, "{got:e}, expected {expected:e}");
}

#[test]
fn metrics_of_bilinear_quadratic_are_their_closed_forms() {
    let mesh = square(N);
    let reference = field(|x| 1.0 + x.x * x.x);
    let (samples, m) = measured(&mesh, Method::Bilinear, &reference);
    assert_eq!(samples.n_points(), 16 * (N * N) as usize);
    assert_eq!(samples.n_edge_points(), 4 * (2 * N * (N - 1)) as usize);
    let h = 1.0 / f64::from(N);
    // Midpoints of 4 N cells.
    let mean_square = 1.0 / 3.0 - (h / 4.0).powi(2) / 12.0;
    let mean = 1.0 + mean_square;
    close(samples.means()[0], mean, 1e-12);
    // Error h^2 s (1 - s) at s = 1/8, 3/8, 5/8, 7/8.
    close(m.l2, h * h * 137.0_f64.sqrt() / 64.0 / mean, 1e-12);
    close(m.linf, h * h * 15.0 / 64.0 / mean, 1e-12);
    close(m.energy_drift, h * h * 11.0 / 64.0 / mean, 1e-12);
    // Error of the slope 2 h (s - 1/2), slope 2 x.
    close(m.h1, (0.3125 * h * h / (4.0 * mean_square)).sqrt(), 1e-9);
    // Slopes break by 2 h at edges across x; the reference curves by 2 there, and nothing happens across y.
    close(m.jump, 2.0 * h * h / mean, 1e-12);
    close(m.band, (2.0 * h - 2.0 * h / 8.0) / 2.0_f64.sqrt() / mean, 1e-12);
    assert_eq!((m.overshoot, m.negative_share), (0.0, 0.0));
}

#[test]
fn metrics_of_fields_that_a_method_reproduces_are_zero() {
    let linear = field(|x| 2.0 + x.x - 0.5 * x.y);
    let quadratic = field(|x| 2.0 + x.x - 0.5 * x.y + x.x * x.y - 0.3 * x.y * x.y);
    for mesh in [square(N), triangles(6)] {
        let of = [measured(&mesh, Method::Bilinear, &linear), measured(&mesh, Method::Hermite, &quadratic)];
        for (samples, m) in of {
            assert!(samples.n_points() > 100 && samples.n_edge_points() > 100);
            let worst = [m.l2, m.linf, m.h1, m.jump, m.band, m.overshoot, m.energy_drift.abs()];
            assert!(worst.iter().all(|x| *x < 1e-9) && m.negative_share == 0.0, "{m:?}");
        }
    }
}

#[test]
fn metrics_of_constant_reconstruction_are_its_steps() {
    // f = 1 + x: steps of h between elements, no slope anywhere.
    let mesh = square(N);
    let (_, m) = measured(&mesh, Method::Constant, &field(|x| 1.0 + x.x));
    let h = 1.0 / f64::from(N);
    close(m.h1, 1.0, 1e-9);
    close(m.jump, 0.0, 1e-12);
    close(m.linf, 0.375 * h / 1.5, 1e-12);
    // Across x the value breaks by h over a distance of h / 8, seen from one side.
    close(m.band, 8.0 / 2.0_f64.sqrt() / 1.5, 1e-9);
    close(m.energy_drift, 0.0, 1e-12);
}

#[test]
fn hermite_of_a_step_overshoots_and_goes_negative_left_of_it() {
    let mesh = square(N);
    let reference = field(|x| if x.x < 0.4999 { 0.0 } else { 1.0 });
    // Rows that no border's fit reaches.
    let centre = |e: ElementId| {
        let y = mesh.polygon(&mesh.elements[e.0 as usize].corners).iter().map(|x| x.y).sum::<f64>() / 4.0;
        (y - 0.5).abs() < 0.2
    };
    let samples = Samples::new(&mesh, |e| centre(e).then_some(0), &reference);
    let vertices = vertex_values(&mesh, &reference);
    let of = |method| samples.measure(&mesh, &Reconstruction::new(&mesh, method, &vertices, &[]));
    let m = of(Method::Hermite);
    // s^2 (s - 1) / 2 at s = 5/8 left of the step's element, over the mean 1/2.
    close(m.overshoot, 2.0 * 25.0 * 3.0 / 1024.0, 1e-9);
    close(m.negative_share, 1.0 / f64::from(N), 1e-12);
    let m = of(Method::Bilinear);
    assert_eq!((m.overshoot, m.negative_share), (0.0, 0.0));
}

#[test]
fn groups_are_measured_over_their_own_means_and_the_dark_left_out() {
    let mesh = square(N);
    let reference = field(|x| if x.x < 0.5 { 2.0 } else { 0.0 });
    let right = |e: ElementId| {
        usize::from(mesh.polygon(&mesh.elements[e.0 as usize].corners).iter().all(|x| x.x >= 0.5))
    };
    let samples = Samples::new(&mesh, |e| Some(right(e)), &reference);
    assert_eq!(samples.means(), [2.0, 0.0]);
    assert_eq!(samples.n_points(), 16 * (N * N / 2) as usize);
    let dark = Reconstruction::new(&mesh, Method::Bilinear, &vec![Rgb::BLACK; mesh.vertices.len()], &[]);
    let m = samples.measure(&mesh, &dark);
    close(m.l2, 1.0, 1e-12);
    close(m.energy_drift, -1.0, 1e-12);
    assert_eq!((samples.only(0).n_points(), samples.only(1).n_points()), (samples.n_points(), 0));
    assert_eq!(samples.only(1).measure(&mesh, &dark), Metrics::default());
}

#[test]
fn edges_over_hanging_vertices_are_measured_once_from_the_finer_side() {
    let coarse = square(2);
    let mut flags = vec![false; coarse.elements.len()];
    flags[0] = true;
    let scene = scene(vec![surface("s", Shape::Quad(corners()))], MeshTarget::Elements(4));
    let mesh = Mesh::build_with(&scene, &coarse.subdivision().split(&flags)).unwrap();
    assert_eq!((mesh.elements.len(), mesh.hanging.len()), (7, 2));
    let calls = AtomicUsize::new(0);
    let reference = |mesh: &Mesh, at: SurfacePoint| {
        calls.fetch_add(1, Ordering::Relaxed);
        1.0 + mesh.position(at).x
    };
    let samples = Samples::new(&mesh, all, &reference);
    // 4 edges inside the split element, 2 on each side of it, 2 between the others.
    assert_eq!(samples.n_edge_points(), 4 * 10);
    assert_eq!(calls.load(Ordering::Relaxed), 7 * (4 + 16 * 5) + 40 * 3);
    for p in &samples.edges {
        assert!(mesh.position(p.on[0]).distance(mesh.position(p.on[1])) < 1e-12);
        let [a, b] = p.off.map(|at| mesh.position(at));
        close(a.distance(b), 2.0 * p.distance_m, 1e-12);
        close(0.5 * (a + b).distance(2.0 * mesh.position(p.on[0])), 0.0, 1e-12);
    }
    let (_, m) = measured(&mesh, Method::Hermite, &reference);
    assert!(m.l2 < 1e-12 && m.jump < 1e-12 && m.band < 1e-10, "{m:?}");
}
