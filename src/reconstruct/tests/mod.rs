//! Tests of reconstruction. Here: the meshes and fields that all of them use.

use glam::DVec2;

use super::*;
use crate::geom::DVec3;
use crate::mesh::{Continuity, Corners, ElementId};
use crate::scene::{MeshTarget, Scene, Shape, Surface};

mod c0;
mod continuity;
mod exactness;
mod gradients;
mod limiter;
mod order;

/// Methods that have derivatives.
const SMOOTH: [Method; 4] =
    [Method::Quadratic, Method::CubicTriangle, Method::Hermite, Method::HermiteLimited];

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

/// f, twice f and half of f.
fn rgb(f: f64) -> Rgb {
    Rgb([f, 2.0 * f, 0.5 * f])
}

fn at_vertices(mesh: &Mesh, f: &dyn Fn(DVec3) -> f64) -> Vec<Rgb> {
    mesh.vertices.iter().map(|v| rgb(f(v.position))).collect()
}

fn sampled(mesh: &Mesh, options: impl Into<ReconstructOptions>, f: &dyn Fn(DVec3) -> f64) -> Reconstruction {
    let means: Vec<Rgb> = (0..mesh.elements.len())
        .map(|e| {
            let q = mesh.quadrature(ElementId(e as u32));
            q.points().iter().map(|&(x, w)| rgb(f(x)) * w).sum::<Rgb>() / mesh.elements[e].area_m2
        })
        .collect();
    Reconstruction::new(mesh, options, &at_vertices(mesh, f), &means)
}

/// A planar field with its derivatives: f, (f_x, f_y), (f_xx, f_xy, f_yy).
type Known<'a> = &'a dyn Fn(f64, f64) -> (f64, [f64; 2], [f64; 3]);

/// Reconstructed from exact gradients, and Hessians where `second`.
fn known(mesh: &Mesh, options: impl Into<ReconstructOptions>, f: Known<'_>, second: bool) -> Reconstruction {
    let all: Vec<_> = mesh.vertices.iter().map(|v| f(v.position.x, v.position.y)).collect();
    let values: Vec<Rgb> = all.iter().map(|(f, ..)| rgb(*f)).collect();
    let gradients: Vec<_> = all.iter().map(|(_, [x, y], _)| [rgb(*x), rgb(*y), Rgb::BLACK]).collect();
    let zero = Rgb::BLACK;
    let hessians: Vec<_> = all
        .iter()
        .map(|(.., [xx, xy, yy])| [[rgb(*xx), rgb(*xy), zero], [rgb(*xy), rgb(*yy), zero], [zero; 3]])
        .collect();
    let given = GivenDerivatives { gradients: &gradients, hessians: second.then_some(&hessians) };
    Reconstruction::with_derivatives(mesh, options, &values, given)
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
fn worst_of(mesh: &Mesh, r: &Reconstruction, f: &dyn Fn(DVec3) -> f64) -> f64 {
    let error = |at: SurfacePoint| {
        (r.evaluate_unclamped(mesh, at) - rgb(f(mesh.position(at)))).map(f64::abs).max_channel()
    };
    places(mesh).into_iter().map(error).fold(0.0, f64::max)
}

fn worst(mesh: &Mesh, options: impl Into<ReconstructOptions>, f: &dyn Fn(DVec3) -> f64) -> f64 {
    worst_of(mesh, &sampled(mesh, options, f), f)
}

/// The plane's meshes, regular ones first, then a fan of quads and triangles over a bent outline.
fn planar_meshes() -> Vec<(&'static str, Mesh)> {
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

/// Random quadtrees under the patches, balanced.
fn refined(surfaces: Vec<Surface>, elements: u32, seed: u64) -> Mesh {
    let scene = crate::mesh::tests::scene(surfaces, MeshTarget::Elements(elements));
    let n = Mesh::build(&scene).patches.len() as u32;
    let subdivision = crate::mesh::Subdivision::new(n, |p, place| {
        let id = place.quarters().fold(1, |id, q| 4 * id + u64::from(q));
        place.level() < 4 && crate::sampling::hash(seed, p.into(), id) % 10 < 5
    });
    Mesh::build_with(&scene, &subdivision).expect("the patches of this scene")
}

/// A stretch of edge with an element on each side.
struct Shared {
    /// The finer one, or either; and its edge.
    a: (ElementId, usize),
    b: (ElementId, usize),
    /// Where on b's edge a's edge begins and ends.
    on_b: [f64; 2],
    continuity: Continuity,
}

/// Every edge between two elements, once; halves of coarse edges one by one.
fn shared_edges(mesh: &Mesh) -> Vec<Shared> {
    let mut all = Vec::new();
    let edge_from = |e: ElementId, start: VertexId| {
        mesh.elements[e.0 as usize].corners.vertices().iter().position(|v| *v == start)
    };
    for (e, element) in (0..).map(ElementId).zip(&mesh.elements) {
        let ids = element.corners.vertices();
        for k in 0..ids.len() {
            if mesh.hanging_on(e, k).is_some() {
                continue;
            }
            let Some(other) = element.neighbours[k].filter(|o| *o > e) else { continue };
            let (start, end) = (ids[k], ids[(k + 1) % ids.len()]);
            let Some(m) = edge_from(other, end) else { continue };
            let theirs = mesh.elements[other.0 as usize].corners.vertices();
            if theirs[(m + 1) % theirs.len()] == start {
                let continuity = element.continuity[k];
                all.push(Shared { a: (e, k), b: (other, m), on_b: [1.0, 0.0], continuity });
            }
        }
    }
    for h in &mesh.hanging {
        let coarse = (h.coarse, usize::from(h.edge));
        let continuity = mesh.elements[h.coarse.0 as usize].continuity[coarse.1];
        for (half, fine) in h.fine.into_iter().enumerate() {
            let start = if half == 0 { h.vertex } else { h.ends[1] };
            let edge = edge_from(fine, start).expect("it has the half edge");
            let low = 0.5 * half as f64;
            all.push(Shared { a: (fine, edge), b: coarse, on_b: [low + 0.5, low], continuity });
        }
    }
    assert!(!all.is_empty());
    all
}

/// A place on an edge of an element.
fn on_edge(mesh: &Mesh, (element, edge): (ElementId, usize), along: f64) -> SurfacePoint {
    let corners: &[DVec2] = match mesh.elements[element.0 as usize].corners {
        Corners::Triangle(_) => &[DVec2::ZERO, DVec2::X, DVec2::Y],
        Corners::Quad(_) => &[DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y],
    };
    SurfacePoint { element, st: corners[edge].lerp(corners[(edge + 1) % corners.len()], along) }
}

/// Both sides of a shared edge.
fn sides(mesh: &Mesh, edge: &Shared, along: f64) -> [SurfacePoint; 2] {
    let on_b = edge.on_b[0] + along * (edge.on_b[1] - edge.on_b[0]);
    let places = [on_edge(mesh, edge.a, along), on_edge(mesh, edge.b, on_b)];
    assert!(mesh.position(places[0]).distance(mesh.position(places[1])) < 1e-12);
    places
}

/// Largest difference of the values on both sides of edges that are not broken, over the largest value.
fn largest_gap(mesh: &Mesh, r: &Reconstruction) -> f64 {
    let (mut gap, mut largest) = (0.0_f64, f64::MIN_POSITIVE);
    for edge in shared_edges(mesh).iter().filter(|e| e.continuity != Continuity::Broken) {
        for k in 0..=8 {
            let [a, b] = sides(mesh, edge, f64::from(k) / 8.0).map(|at| r.evaluate_unclamped(mesh, at));
            gap = gap.max((a - b).map(f64::abs).max_channel());
            largest = largest.max(a.map(f64::abs).max_channel());
        }
    }
    gap / largest
}

/// Slope along the in-plane unit normal of an element's edge, inwards.
fn inner_slope(mesh: &Mesh, r: &Reconstruction, at: SurfacePoint, edge: usize) -> f64 {
    let element = &mesh.elements[at.element.0 as usize];
    let p = mesh.polygon(&element.corners);
    let inner = element.normal.cross(p[(edge + 1) % p.len()] - p[edge]).normalize();
    let [x, y, z] = r.gradient(mesh, at).map(|g| g.0[0]);
    v(x, y, z).dot(inner)
}

/// Largest jump of the slope across C1 edges, and the largest gradient met on them.
fn largest_jump(mesh: &Mesh, r: &Reconstruction) -> (f64, f64) {
    let (mut jump, mut largest) = (0.0_f64, 0.0_f64);
    for edge in shared_edges(mesh).iter().filter(|e| e.continuity == Continuity::C1) {
        for along in [0.03, 0.3, 0.5, 0.6, 0.9] {
            let [a, b] = sides(mesh, edge, along);
            jump = jump.max((inner_slope(mesh, r, a, edge.a.1) + inner_slope(mesh, r, b, edge.b.1)).abs());
            let [x, y, z] = r.gradient(mesh, a).map(|g| g.0[0]);
            largest = largest.max(v(x, y, z).length());
        }
    }
    (jump, largest)
}

/// Sets what may continue over an edge, as both sides see it.
fn set_continuity(mesh: &mut Mesh, edge: &Shared, continuity: Continuity) {
    for (element, edge) in [edge.a, edge.b] {
        mesh.elements[element.0 as usize].continuity[edge] = continuity;
    }
    // The other half of a coarse edge.
    if let Some(h) = mesh.hanging_on(edge.b.0, edge.b.1).copied() {
        for fine in h.fine {
            let n = mesh.elements[fine.0 as usize].corners.vertices().len();
            for k in 0..n {
                if mesh.elements[fine.0 as usize].neighbours[k] == Some(h.coarse) {
                    mesh.elements[fine.0 as usize].continuity[k] = continuity;
                }
            }
        }
    }
}

/// The floor of a unit cube below a square lamp of half width 0.15: the parallel rectangle over a corner, four times.
fn below_a_lamp(x: DVec3) -> f64 {
    let corner = |a: f64, b: f64| {
        let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * std::f64::consts::PI)
    };
    let (l, r) = (0.35 - x.x, 0.65 - x.x);
    let (d, u) = (0.35 - x.y, 0.65 - x.y);
    corner(r, u) - corner(l, u) - corner(r, d) + corner(l, d)
}

#[test]
fn names_of_methods_and_rules_are_those_of_their_files() {
    for m in Method::ALL {
        assert_eq!(serde_json::to_value(m).expect("a name"), m.name());
    }
    for g in GradientRule::ALL {
        assert_eq!(serde_json::to_value(g).expect("a name"), g.name());
    }
    for t in TwistRule::ALL {
        assert_eq!(serde_json::to_value(t).expect("a name"), t.name());
    }
}
