//! C0 edges: one value, derivatives of their own on each side.

use proptest::prelude::*;

use super::nodes::NodeTable;
use super::*;

/// Marks the edges whose two ends `on` holds for.
fn mark(mesh: &mut Mesh, continuity: Continuity, on: impl Fn(DVec3) -> bool) -> usize {
    let mut n = 0;
    for edge in shared_edges(mesh) {
        let ends = [0.0, 1.0].map(|along| mesh.position(on_edge(mesh, edge.a, along)));
        if ends.into_iter().all(&on) {
            set_continuity(mesh, &edge, continuity);
            n += 1;
        }
    }
    assert!(n > 0);
    n
}

fn triangles_over_a_square() -> Mesh {
    let tri = |a, b, c| Shape::Triangle([a, b, c]);
    let (a, b, c, d) = (v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.));
    let (m, n) = (v(0.5, 0., 0.), v(0.5, 1., 0.));
    mesh_of([tri(a, m, d), tri(m, n, d), tri(m, b, n), tri(b, c, n)], 256)
}

#[test]
fn nodes_are_one_per_vertex_and_group_and_one_where_a_c0_edge_ends() {
    let mut mesh = square(4);
    let plain = NodeTable::new(&mesh);
    assert_eq!(plain.len(), mesh.vertices.len());
    // From the border to the middle.
    assert_eq!(mark(&mut mesh, Continuity::C0, |x| x.x == 0.5 && x.y < 0.6), 2);
    let table = NodeTable::new(&mesh);
    for (id, vertex) in (0..).map(VertexId).zip(&mesh.vertices) {
        let two = vertex.position.x == 0.5 && vertex.position.y < 0.4;
        assert_eq!(table.of_vertex(id).len(), if two { 2 } else { 1 }, "{}", vertex.position);
    }
    for (e, element) in (0..).map(ElementId).zip(&mesh.elements) {
        for (k, id) in element.corners.vertices().iter().enumerate() {
            let node = table.at(e, k);
            assert_eq!(table.vertex(node), *id);
            assert!(table.elements(node).contains(&e));
        }
    }
}

#[test]
fn a_roof_over_a_c0_edge_is_exact_and_over_a_c1_edge_is_not() {
    let roof = |x: DVec3| 3.0 + 0.5 * x.y - 2.0 * (x.x - 0.5).abs();
    for mut mesh in [square(8), triangles_over_a_square()] {
        for method in SMOOTH {
            assert!(worst(&mesh, method, &roof) > 0.01);
        }
        mark(&mut mesh, Continuity::C0, |x| (x.x - 0.5).abs() < 1e-12);
        for method in SMOOTH {
            let r = sampled(&mesh, method, &roof);
            let error = worst_of(&mesh, &r, &roof);
            assert!(error < 1e-12, "{method:?}: {error:e}");
            assert!(largest_gap(&mesh, &r) < 1e-12);
        }
    }
}

#[test]
fn a_pyramid_keeps_its_edges_where_c0_edges_cross_and_where_one_turns() {
    // Ridges along x = 1/2 and y = 1/2, for x > 1/2 one more slope beyond y = 1/2 only.
    let f = |x: DVec3| 3.0 - (x.x - 0.5).abs() - 0.7 * (x.y - 0.5).abs();
    for mut mesh in [square(8), triangles_over_a_square()] {
        let on = |x: DVec3| (x.x - 0.5).abs() < 1e-12 || (x.y - 0.5).abs() < 1e-12;
        mark(&mut mesh, Continuity::C0, on);
        for method in SMOOTH {
            let r = sampled(&mesh, method, &f);
            let error = worst_of(&mesh, &r, &f);
            assert!(error < 1e-12, "{method:?}: {error:e}");
            // The measure sees the ridges, so flags and jumps are about the same edges.
            assert!(largest_jump(&mesh, &r).0 < 1e-9);
        }
    }
}

#[test]
fn nothing_crosses_a_broken_edge_between_its_ends() {
    // A crack from the border to the middle: gradients at vertices beside it are those of one side.
    let mut mesh = square(8);
    mark(&mut mesh, Continuity::Broken, |x| x.x == 0.5 && x.y < 0.6);
    let roof = |x: DVec3| 3.0 + 0.5 * x.y - 2.0 * (x.x - 0.5).abs();
    let r = sampled(&mesh, Method::Hermite, &roof);
    for at in places(&mesh) {
        let x = mesh.position(at);
        // The rings of vertices next to the end go around it.
        if x.y < 0.25 && (x.x - 0.5).abs() < 0.25 {
            let got = r.evaluate(&mesh, at).0[0];
            assert!((got - roof(x)).abs() < 1e-12, "{x}: {got}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn c0_and_c1_edges_anywhere_leave_no_gap(seed: u64, kind in 0..3usize, share in 1..9u64) {
        let (o, a, b, c) = (v(0.4, 0.45, 0.), v(0., 0., 0.), v(1.1, -0.1, 0.), v(1.3, 1.0, 0.));
        let (d, e) = (v(-0.1, 1.2, 0.), v(0.7, 1.4, 0.));
        let shapes = [
            vec![Shape::Quad([a, b, c, o]), Shape::Quad([o, c, e, d]), Shape::Triangle([a, o, d])],
            vec![Shape::Triangle([a, b, o]), Shape::Triangle([b, c, o]), Shape::Triangle([o, c, d])],
            vec![Shape::Cylinder { base: v(0., 0., 0.), top: v(0., 0., 1.), radius: 0.4, inward: false }],
        ][kind].clone();
        let mut mesh = refined(smooth(shapes), 24, seed);
        for (k, edge) in (0..).zip(shared_edges(&mesh)) {
            if crate::sampling::hash(seed, 7, k) % 10 < share {
                set_continuity(&mut mesh, &edge, Continuity::C0);
            }
        }
        let f = |x: DVec3| (4.0 * x.x + 1.0).sin() + x.y * x.z + 3.0 + (5.0 * x.y).cos();
        for method in SMOOTH {
            let r = sampled(&mesh, method, &f);
            let gap = largest_gap(&mesh, &r);
            prop_assert!(gap < 1e-12, "{:?}: {}", method, gap);
        }
    }
}
