//! Lines inside a surface, and continuity by hand between surfaces: who shares a vertex with whom.

use std::collections::HashMap;

use proptest::prelude::*;

use super::*;
use crate::mesh::tests::{check, room, scene, surface};
use crate::mesh::{PatchId, Subdivision};
use crate::scene::{MeshTarget, Scene, Shape, SurfaceContinuity, SurfaceId};

fn v(x: f64, y: f64) -> DVec3 {
    DVec3::new(x, y, 0.0)
}

/// A floor of 1 x 1 m of 4 x 4 elements.
fn floor() -> Scene {
    let corners = [v(0., 0.), v(1., 0.), v(1., 1.), v(0., 1.)];
    scene(vec![surface("floor", Shape::Quad(corners))], MeshTarget::MaxElementM(0.25))
}

/// Discontinuities on the edges inside a mesh whose middle `on` names.
fn lines(mesh: &Mesh, continuity: Continuity, on: impl Fn(DVec3) -> bool) -> Vec<Discontinuity> {
    let mut list = Vec::new();
    for (e, element) in mesh.elements.iter().enumerate() {
        let corners = mesh.polygon(&element.corners);
        for k in 0..corners.len() {
            let middle = 0.5 * (corners[k] + corners[(k + 1) % corners.len()]);
            let sides = mesh.sides_of_edge(ElementId(e as u32), k);
            let lowest = sides.iter().min() == Some(&(ElementId(e as u32), k));
            if sides.len() > 1 && lowest && on(middle) {
                list.push(Discontinuity { element: e as u32, edge: k as u8, continuity });
            }
        }
    }
    list
}

fn parted(scene: &Scene, mesh: &Mesh, list: Vec<Discontinuity>) -> Mesh {
    let parted = Mesh::build_with(scene, &mesh.subdivision().with_discontinuities(list)).unwrap();
    check(&parted);
    lawful(&parted);
    parted
}

/// One vertex per position and continuity group, from the elements' point of view.
fn lawful(mesh: &Mesh) {
    let hangs: HashMap<VertexId, [ElementId; 2]> = mesh.hanging.iter().map(|h| (h.vertex, h.fine)).collect();
    let mut places: HashMap<[u64; 3], Vec<VertexId>> = HashMap::new();
    for (i, vertex) in mesh.vertices.iter().enumerate() {
        let id = VertexId(i as u32);
        places.entry(vertex.position.to_array().map(f64::to_bits)).or_default().push(id);
        // All around it hang together.
        let around = mesh.elements_around(id);
        let mut reached = vec![around[0]];
        let mut next = 0;
        while next < reached.len() {
            let e = reached[next];
            next += 1;
            let beside = |k: usize| {
                let (a, b) = mesh.elements[e.0 as usize].corners.edge(k);
                (a == id || b == id).then(|| mesh.neighbours_across(e, k).collect::<Vec<_>>())
            };
            let n = mesh.elements[e.0 as usize].corners.vertices().len();
            let mut more: Vec<ElementId> = (0..n).filter_map(beside).flatten().collect();
            more.extend(hangs.get(&id).filter(|fine| fine.contains(&e)).into_iter().flatten());
            for e in more {
                if around.contains(&e) && !reached.contains(&e) {
                    reached.push(e);
                }
            }
        }
        assert_eq!(reached.len(), around.len(), "elements around vertex {i} that nothing connects");
        let mean: DVec3 = around
            .iter()
            .map(|e| {
                let corners = mesh.polygon(&mesh.elements[e.0 as usize].corners);
                corners.iter().sum::<DVec3>() / corners.len() as f64
            })
            .sum::<DVec3>()
            / around.len() as f64;
        assert!((vertex.inward - (mean - vertex.position)).length() < 1e-12);
        let parted = mesh.line_vertices().binary_search(&id).is_ok();
        assert!(!parted || mesh.discontinuities().iter().any(|d| d.continuity == Continuity::Broken));
    }
    // Elements that an unbroken edge joins share the vertices on it.
    for (e, element) in mesh.elements.iter().enumerate() {
        for k in 0..element.corners.vertices().len() {
            let (a, b) = element.corners.edge(k);
            let hanging = mesh.hanging_on(ElementId(e as u32), k).map(|h| h.vertex);
            for other in mesh.neighbours_across(ElementId(e as u32), k) {
                let theirs = mesh.elements[other.0 as usize].corners;
                let shared = [Some(a), Some(b), hanging]
                    .into_iter()
                    .flatten()
                    .filter(|v| theirs.vertices().contains(v))
                    .count();
                let fine =
                    mesh.hanging.iter().any(|h| h.coarse == other && h.fine.contains(&ElementId(e as u32)));
                assert_eq!(shared, if fine { 1 } else { 2 }, "element {e}, edge {k}");
            }
        }
    }
    for patch in 0..mesh.patches.len() as u32 {
        let corners = mesh.patches[patch as usize].corners;
        for (j, v) in corners.vertices().iter().enumerate() {
            assert_eq!(mesh.corner_of(PatchId(patch), Place::ROOT, j), *v);
        }
    }
}

#[test]
fn line_through_a_surface_gives_each_side_its_own_vertices() {
    let scene = floor();
    let mesh = Mesh::build(&scene);
    let list = lines(&mesh, Continuity::Broken, |m| m.x == 0.5);
    assert_eq!(list.len(), 4);
    let cut = parted(&scene, &mesh, list);
    assert_eq!(cut.vertices.len(), mesh.vertices.len() + 5);
    assert_eq!(cut.line_vertices().len(), 10);
    for v in cut.line_vertices() {
        let vertex = &cut.vertices[v.0 as usize];
        assert_eq!(vertex.position.x, 0.5);
        assert!((vertex.inward.x.abs() - 0.125).abs() < 1e-12);
        for e in cut.elements_around(*v) {
            let corners = cut.polygon(&cut.elements[e.0 as usize].corners);
            assert!(corners.iter().all(|c| (c.x - 0.5) * vertex.inward.x >= 0.0));
        }
    }
    // Vertices of before keep their numbers.
    let same = cut.vertices.iter().zip(&mesh.vertices).all(|(a, b)| a.position == b.position);
    assert!(same);
}

#[test]
fn end_of_a_line_inside_a_surface_stays_one_vertex() {
    let scene = floor();
    let mesh = Mesh::build(&scene);
    let list = lines(&mesh, Continuity::Broken, |m| m.x == 0.5 && m.y < 0.5);
    assert_eq!(list.len(), 2);
    let cut = parted(&scene, &mesh, list);
    // At y = 0 and 0.25; the line ends at 0.5.
    assert_eq!(cut.vertices.len(), mesh.vertices.len() + 2);
    let at = |p: DVec3| cut.vertices.iter().filter(|w| w.position == p).count();
    assert_eq!([v(0.5, 0.0), v(0.5, 0.25), v(0.5, 0.5)].map(at), [2, 2, 1]);
    let alone = parted(&scene, &mesh, lines(&mesh, Continuity::Broken, |m| m == v(0.5, 0.375)));
    assert_eq!(alone.vertices.len(), mesh.vertices.len(), "both ends of a single edge inside are dead ends");
}

#[test]
fn lines_that_cross_part_a_vertex_in_four() {
    let scene = floor();
    let mesh = Mesh::build(&scene);
    let cut = parted(&scene, &mesh, lines(&mesh, Continuity::Broken, |m| m.x == 0.5 || m.y == 0.5));
    let centre: Vec<_> = cut.vertices.iter().filter(|w| w.position == v(0.5, 0.5)).collect();
    assert_eq!(centre.len(), 4);
    assert!(centre.iter().all(|w| w.inward.x.abs() == 0.125 && w.inward.y.abs() == 0.125));
}

#[test]
fn line_along_a_coarse_edge_frees_what_hangs_on_it_and_one_that_ends_there_parts_nothing() {
    let scene = floor();
    let uniform = Mesh::build(&scene);
    // The left half twice as fine.
    let split: Vec<bool> =
        uniform.elements.iter().map(|e| uniform.polygon(&e.corners).iter().all(|c| c.x <= 0.5)).collect();
    let mesh = Mesh::build_with(&scene, &uniform.subdivision().split(&split)).unwrap();
    assert_eq!(mesh.hanging.len(), 4);
    // Half of one coarse edge: all of it is flagged.
    let half = lines(&mesh, Continuity::Broken, |m| m.x == 0.5 && m.y < 0.25);
    assert_eq!(half.len(), 1);
    let cut = parted(&scene, &mesh, half);
    assert_eq!(cut.hanging.len(), 3);
    let along = parted(&scene, &mesh, lines(&mesh, Continuity::Broken, |m| m.x == 0.5));
    assert_eq!((along.hanging.len(), along.vertices.len()), (0, mesh.vertices.len() + 5));
    // Both sides' ends of coarse edges, and what hung between them on the fine side.
    assert_eq!(along.line_vertices().len(), 2 * 5 + 4);
    // From the left up to the coarse edge.
    let up_to = parted(&scene, &mesh, lines(&mesh, Continuity::Broken, |m| m.y == 0.125 && m.x < 0.5));
    assert_eq!(up_to.hanging.len(), 4);
    let at = |p: DVec3| up_to.vertices.iter().filter(|w| w.position == p).count();
    assert_eq!([v(0.0, 0.125), v(0.375, 0.125), v(0.5, 0.125)].map(at), [2, 2, 1]);
}

#[test]
fn c0_line_keeps_vertices_and_neighbours_and_a_broken_one_on_it_wins() {
    let scene = floor();
    let mesh = Mesh::build(&scene);
    let c0 = lines(&mesh, Continuity::C0, |m| m.x == 0.5);
    let soft = parted(&scene, &mesh, c0.clone());
    assert_eq!(soft.vertices, mesh.vertices);
    assert!(soft.line_vertices().is_empty());
    let n = soft.elements.iter().flat_map(|e| e.continuity).filter(|c| *c == Continuity::C0).count();
    assert_eq!(n, 8);
    let mut both = c0;
    both.extend(lines(&mesh, Continuity::Broken, |m| m.x == 0.5 && m.y < 0.25));
    both.sort_unstable();
    let cut = parted(&scene, &mesh, both);
    let of = |c| cut.elements.iter().flat_map(|e| e.continuity).filter(|x| *x == c).count();
    assert_eq!(of(Continuity::C0), 6);
}

#[test]
fn discontinuities_that_cannot_be_are_refused_by_name() {
    let scene = floor();
    let mesh = Mesh::build(&scene);
    let with = |subdivision: Subdivision, element, edge, continuity| {
        let list = vec![Discontinuity { element, edge, continuity }];
        Mesh::build_with(&scene, &subdivision.with_discontinuities(list)).map(|_| ()).unwrap_err()
    };
    let whole = mesh.subdivision();
    let n = mesh.elements.len() as u32;
    let wrong = with(whole.clone(), n, 0, Continuity::Broken);
    assert_eq!(wrong, SubdivisionError::Edge { element: n, edge: 0 });
    assert_eq!(wrong.to_string(), "no discontinuity is possible on edge 0 of element 16");
    assert_eq!(with(whole.clone(), 3, 4, Continuity::C0), SubdivisionError::Edge { element: 3, edge: 4 });
    assert_eq!(with(whole.clone(), 3, 1, Continuity::C1), SubdivisionError::Edge { element: 3, edge: 1 });
    // One element two levels finer than its neighbours.
    let mut split = vec![false; 16];
    split[3] = true;
    let finer = Mesh::build_with(&scene, &whole.split(&split)).unwrap().subdivision();
    let mut split = vec![false; 19];
    split[3..7].fill(true);
    let steep = finer.split(&split);
    assert!(Mesh::build_with(&scene, &steep).is_ok());
    assert_eq!(with(steep, 0, 0, Continuity::Broken), SubdivisionError::Unbalanced);
}

/// A room in which floor and west wall meet as said, in smooth groups or not.
fn by_hand(continuity: Option<Continuity>, smooth_group: u32) -> Mesh {
    let mut surfaces = room(1.0, 1.0, 1.0);
    surfaces.iter_mut().for_each(|s| s.smooth_group = smooth_group);
    let mut scene = scene(surfaces, MeshTarget::MaxElementM(0.25));
    let entry = |continuity| SurfaceContinuity { between: [SurfaceId(0), SurfaceId(2)], continuity };
    scene.continuity = continuity.map(entry).into_iter().collect();
    assert!(Mesh::continuity_without_edge(&scene).is_empty());
    Mesh::build(&scene)
}

#[test]
fn continuity_by_hand_joins_what_no_smooth_group_would() {
    let apart = by_hand(None, 0);
    for continuity in [Continuity::C1, Continuity::C0] {
        let joined = by_hand(Some(continuity), 0);
        // Five vertices of the common edge are one.
        assert_eq!(joined.vertices.len(), apart.vertices.len() - 5);
        let flags: Vec<_> = joined
            .elements
            .iter()
            .flat_map(|e| e.neighbours.iter().zip(e.continuity).map(move |(n, c)| (e.patch, *n, c)))
            .filter_map(|(p, n, c)| {
                let surface = |p: PatchId| joined.patches[p.0 as usize].surface;
                let other = surface(joined.elements[n?.0 as usize].patch);
                (other != surface(p)).then_some(c)
            })
            .collect();
        assert_eq!(flags, [continuity; 8]);
    }
    assert_eq!(by_hand(Some(Continuity::Broken), 0).vertices, apart.vertices);
}

#[test]
fn continuity_by_hand_parts_what_a_smooth_group_joins() {
    // Two coplanar halves of one smooth group.
    let half = |name: &str, x: f64| {
        let corners = [v(x, 0.), v(x + 1., 0.), v(x + 1., 1.), v(x, 1.)];
        crate::scene::Surface { smooth_group: 1, ..surface(name, Shape::Quad(corners)) }
    };
    let mut both = scene(vec![half("a", 0.0), half("b", 1.0)], MeshTarget::MaxElementM(0.5));
    assert_eq!(Mesh::build(&both).vertices.len(), 15);
    let between = [SurfaceId(0), SurfaceId(1)];
    both.continuity = vec![SurfaceContinuity { between, continuity: Continuity::Broken }];
    let mesh = Mesh::build(&both);
    check(&mesh);
    assert_eq!(mesh.vertices.len(), 18);
    // Elsewhere they do not meet.
    both.surfaces[1] = half("b", 1.5);
    assert_eq!(Mesh::continuity_without_edge(&both), [0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn mesh_with_lines_on_any_edges_keeps_its_law_and_is_the_same_again(
        seed: u64, share in 0.0..0.9f64, depth in 1..4u32
    ) {
        let mut surfaces = room(1.0, 1.0, 1.0);
        surfaces.truncate(2);
        surfaces.push(surface("leaf", Shape::Triangle([v(2., 0.), v(3., 0.), v(2., 1.)])));
        let scene = scene(surfaces, MeshTarget::MaxElementM(0.5));
        let coin = |a: u64, b: u64| crate::sampling::unit_pair(crate::sampling::hash(seed, a, b))[0];
        let n = Mesh::build(&scene).patches.len() as u32;
        let trees = Subdivision::new(n, |p, place| {
            let id = place.quarters().fold(1, |id, q| 4 * id + u64::from(q));
            place.level() < depth && coin(p.into(), id) < 0.6
        });
        let mesh = Mesh::build_with(&scene, &trees).unwrap();
        let mut list: Vec<Discontinuity> = Vec::new();
        for (i, d) in lines(&mesh, Continuity::Broken, |_| true).into_iter().enumerate() {
            let u = coin(1 << 40, i as u64);
            if u < share {
                let continuity = if u < 0.3 * share { Continuity::C0 } else { Continuity::Broken };
                list.push(Discontinuity { continuity, ..d });
            }
        }
        list.sort_unstable();
        let cut = parted(&scene, &mesh, list);
        let again = Mesh::build_with(&scene, &cut.subdivision()).unwrap();
        prop_assert_eq!(&again.vertices, &cut.vertices);
        prop_assert_eq!(&again.hanging, &cut.hanging);
        prop_assert_eq!(again.discontinuities(), cut.discontinuities());
        let same = |(a, b): (&crate::mesh::Element, &crate::mesh::Element)| {
            (a.corners, a.neighbours, a.continuity) == (b.corners, b.neighbours, b.continuity)
        };
        prop_assert!(again.elements.iter().zip(&cut.elements).all(same));
        let bytes = postcard::to_stdvec(&cut.subdivision()).unwrap();
        prop_assert_eq!(&postcard::from_bytes::<Subdivision>(&bytes).unwrap(), &cut.subdivision());
    }
}
