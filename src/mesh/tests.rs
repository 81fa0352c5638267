//! Tests of the mesh: areas, topology, conformity, quadrature, (s,t) round trips.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::PathBuf;

use proptest::prelude::*;

use super::*;
use crate::scene::{Material, MaterialId, MeshTarget, Meshing, Shape, Surface};
use crate::units::Rgb;

pub(crate) fn surface(name: &str, shape: Shape) -> Surface {
    Surface {
        name: name.into(),
        material: MaterialId(0),
        shape,
        two_sided: false,
        smooth_group: 0,
        exitance: Rgb::BLACK,
    }
}

pub(crate) fn scene(surfaces: Vec<Surface>, target: MeshTarget) -> Scene {
    let black = Rgb::BLACK;
    let grey = Material {
        name: "grey".into(),
        reflectance: Rgb::splat(0.5),
        specular: black,
        transmission: black,
        ior: 1.5,
    };
    Scene {
        path: PathBuf::from("in-memory"),
        camera: None,
        materials: vec![grey],
        surfaces,
        lights: Vec::new(),
        continuity: Vec::new(),
        meshing: Meshing { target, ..Meshing::default() },
        warnings: Vec::new(),
    }
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// The six inner walls of a box.
pub(crate) fn room(x: f64, y: f64, z: f64) -> Vec<Surface> {
    let c = |i: u32| v(x * f64::from(i & 1), y * f64::from(i >> 1 & 1), z * f64::from(i >> 2));
    [
        ("floor", [0, 1, 3, 2]),
        ("ceiling", [4, 6, 7, 5]),
        ("west", [0, 2, 6, 4]),
        ("east", [1, 5, 7, 3]),
        ("south", [0, 4, 5, 1]),
        ("north", [2, 3, 7, 6]),
    ]
    .map(|(name, corners)| surface(name, Shape::Quad(corners.map(c))))
    .into()
}

/// Checks what holds for every mesh; returns (vertices, edges, elements) of the front and back together.
pub(crate) fn check(mesh: &Mesh) -> (usize, usize, usize) {
    assert!(!mesh.elements.is_empty());
    let mut edges: HashMap<(u32, u32), Vec<(usize, usize)>> = HashMap::new();
    for (i, e) in mesh.elements.iter().enumerate() {
        let id = ElementId(i as u32);
        let ids = e.corners.vertices();
        for k in 0..4 {
            if k >= ids.len() {
                assert_eq!((e.neighbours[k], e.continuity[k]), (None, Continuity::Broken));
                continue;
            }
            let (a, b) = (ids[k], ids[(k + 1) % ids.len()]);
            edges.entry((a.0.min(b.0), a.0.max(b.0))).or_default().push((i, k));
            assert_eq!(e.neighbours[k].is_some(), e.continuity[k] != Continuity::Broken);
            let ends = match mesh.hanging_on(id, k) {
                Some(h) => vec![(a, h.vertex), (h.vertex, b)],
                None => vec![(a, b)],
            };
            let across: Vec<_> = mesh.neighbours_across(id, k).collect();
            assert!(across.is_empty() || across.len() == ends.len());
            for (other, (a, b)) in across.into_iter().zip(ends) {
                let theirs = mesh.elements[other.0 as usize].corners.vertices();
                let n = theirs.len();
                // The same edge the other way round, or the coarse edge that it is half of.
                let back = (0..n).find(|&m| mesh.neighbours_across(other, m).any(|e| e == id));
                let m = back.expect("neighbours are neighbours both ways");
                let half = mesh.hanging_on(other, m);
                let (c, d) = (theirs[m], theirs[(m + 1) % n]);
                match half {
                    Some(h) => assert!((h.vertex == a && c == b) || (h.vertex == b && d == a)),
                    None => assert_eq!((c, d), (b, a)),
                }
            }
        }
        let q = mesh.quadrature(id);
        let sum: f64 = q.points().iter().map(|p| p.1).sum();
        assert!((sum - e.area_m2).abs() <= 1e-12 * e.area_m2, "element {i}: {sum} vs {}", e.area_m2);
        assert!((e.normal.length() - 1.0).abs() < 1e-12);
    }
    for list in edges.values() {
        assert!(list.len() <= 2, "an edge of {} elements", list.len());
        // Both ends of a broken edge may be dead ends of its line.
        if list.len() == 2 && mesh.discontinuities().is_empty() {
            assert!(list.iter().all(|&(e, k)| mesh.elements[e].neighbours[k].is_some()));
        }
    }
    for (i, h) in mesh.hanging.iter().enumerate() {
        let at = |v: VertexId| mesh.vertices[v.0 as usize].position;
        assert_eq!(at(h.vertex), 0.5 * (at(h.ends[0]) + at(h.ends[1])));
        assert_eq!(mesh.hanging_on(h.coarse, h.edge.into()), Some(h));
        // Coarse to fine: whoever hangs comes before those whose edge ends in it.
        assert!(mesh.hanging[..i].iter().all(|earlier| !earlier.ends.contains(&h.vertex)));
        let level = |e: ElementId| mesh.elements[e.0 as usize].place.level();
        assert!(h.fine.iter().all(|fine| level(*fine) == level(h.coarse) + 1));
    }
    let mut next = 0;
    for (p, patch) in mesh.patches.iter().enumerate() {
        assert_eq!(patch.elements.start, next);
        assert!(!patch.elements.is_empty());
        next = patch.elements.end;
        assert!(patch.elements.clone().all(|e| mesh.elements[e as usize].patch.0 as usize == p));
        let own = &mesh.elements[patch.elements.start as usize..patch.elements.end as usize];
        assert!(own.is_sorted_by(|a, b| a.place < b.place));
        assert_eq!(p >= mesh.n_cast_patches, patch.side == Facing::Back);
        if let Some(twin) = patch.twin {
            let twin = &mesh.patches[twin.0 as usize];
            assert_eq!(twin.twin, Some(PatchId(p as u32)));
            assert!((twin.normal + patch.normal).length() < 1e-12);
        }
    }
    assert_eq!(next as usize, mesh.elements.len());
    for (i, vertex) in mesh.vertices.iter().enumerate() {
        let around = mesh.elements_around(VertexId(i as u32));
        assert!(!around.is_empty());
        for e in around {
            let e = &mesh.elements[e.0 as usize];
            assert!(e.corners.vertices().contains(&VertexId(i as u32)));
            assert!(e.normal.dot(vertex.normal) > 0.5);
        }
    }
    (mesh.vertices.len(), edges.len(), mesh.elements.len())
}

fn euler(mesh: &Mesh) -> i64 {
    let (v, e, f) = check(mesh);
    v as i64 - e as i64 + f as i64
}

#[test]
fn mesh_of_a_box_room_covers_it_without_t_junctions() {
    let mesh = Mesh::build(&scene(room(4.0, 3.0, 2.5), MeshTarget::Elements(4000)));
    check(&mesh);
    assert!((mesh.total_area_m2() - 59.0).abs() < 1e-10);
    assert_eq!(mesh.n_t_junctions, 0);
    let n = mesh.elements.len();
    assert!((4000..4800).contains(&n), "{n} elements");
    assert_eq!(n as u64, Mesh::planned_elements(&scene(room(4.0, 3.0, 2.5), MeshTarget::Elements(4000))));
}

#[test]
fn mesh_of_a_sphere_is_closed_and_has_its_area_and_normals() {
    for inward in [false, true] {
        let shape = Shape::Sphere { center: v(1.0, 2.0, 3.0), radius: 0.5, inward };
        let mesh = Mesh::build(&scene(vec![surface("ball", shape)], MeshTarget::Elements(500)));
        assert_eq!(euler(&mesh), 2);
        assert_eq!(mesh.n_t_junctions, 0);
        let area = mesh.total_area_m2() / PI;
        assert!((area - 1.0).abs() < 1e-12, "{area}");
        let sign = if inward { -1.0 } else { 1.0 };
        for vertex in &mesh.vertices {
            let out = (vertex.position - v(1.0, 2.0, 3.0)).normalize();
            assert!((vertex.normal - sign * out).length() < 1e-12);
        }
    }
}

#[test]
fn mesh_of_a_cylinder_closed_by_disks_meets_them_corner_to_corner() {
    for (base, top) in [(v(0.1, 0.2, 0.3), v(0.9, -0.4, 1.3)), (v(0.5, 1.0, 0.0), v(0.5, -1.0, 0.0))] {
        let axis = (top - base).normalize();
        let disk = |center, normal| Shape::Disk { center, normal, radius: 0.4 };
        let tube = Shape::Cylinder { base, top, radius: 0.4, inward: false };
        let mesh = Mesh::build(&scene(
            vec![
                surface("tube", tube),
                surface("top", disk(top, axis)),
                surface("bottom", disk(base, -axis)),
            ],
            MeshTarget::Elements(1000),
        ));
        // A tube (characteristic 0) and two disks (1 each), not joined: rims are creases.
        assert_eq!(euler(&mesh), 2);
        assert_eq!(mesh.n_t_junctions, 0);
        let positions: std::collections::HashSet<[u64; 3]> =
            mesh.vertices.iter().map(|x| x.position.to_array().map(f64::to_bits)).collect();
        let rim = mesh.vertices.len() - positions.len();
        assert!(rim >= 2 * 64, "{rim} vertices of the rims coincide");
        for p in &mesh.patches {
            let middle =
                mesh.polygon(&p.corners).iter().copied().sum::<DVec3>() / p.corners.vertices().len() as f64;
            assert!(p.normal.dot(middle - 0.5 * (base + top)) > 0.0);
        }
        for (i, s) in mesh.surfaces.iter().enumerate() {
            let true_area = if i == 0 { 2.0 * PI * 0.4 * base.distance(top) } else { PI * 0.16 };
            let (range, back) = mesh.surface_elements(SurfaceId(i as u32));
            assert!(back.is_empty() && range.len() == 4 * s.front.len());
            let area: f64 = range.map(|e| mesh.elements[e as usize].area_m2).sum();
            let excess = area / true_area - 1.0;
            let bound = if i == 0 { 5e-4..1e-3 } else { -1e-12..1e-12 };
            assert!(bound.contains(&excess), "{excess}");
        }
    }
}

/// The measured red wall of the Cornell box: bent by 0.6 % of its width, hence two triangles.
fn red_wall() -> Vec<Surface> {
    let c = [v(5.528, 0.0, 0.0), v(5.496, 0.0, 5.592), v(5.56, 5.488, 5.592), v(5.56, 5.488, 0.0)];
    [("red a", [c[0], c[1], c[2]]), ("red b", [c[0], c[2], c[3]])]
        .map(|(name, t)| Surface { smooth_group: 1, ..surface(name, Shape::Triangle(t)) })
        .into()
}

#[test]
fn mesh_of_a_bent_wall_of_two_triangles_is_one_smooth_sheet() {
    let mesh = Mesh::build(&scene(red_wall(), MeshTarget::Elements(600)));
    assert_eq!(euler(&mesh), 1);
    assert_eq!(mesh.n_t_junctions, 0);
    let borders = mesh.elements.iter().flat_map(|e| &e.neighbours[..3]).filter(|n| n.is_none()).count();
    let n = (mesh.elements.len() as f64 / 2.0).sqrt();
    assert_eq!(borders as f64, 4.0 * n);
}

#[test]
fn mesh_of_quads_in_different_smooth_groups_breaks_between_them() {
    let make = |groups: [u32; 2], bend_deg: f64| {
        let (sin, cos) = bend_deg.to_radians().sin_cos();
        let mut quads = [
            surface("a", Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)])),
            surface(
                "b",
                Shape::Quad([v(1., 0., 0.), v(1. + cos, 0., sin), v(1. + cos, 1., sin), v(1., 1., 0.)]),
            ),
        ];
        quads.iter_mut().zip(groups).for_each(|(q, g)| q.smooth_group = g);
        Mesh::build(&scene(quads.into(), MeshTarget::Elements(32)))
    };
    assert_eq!(make([0, 0], 10.0).vertices.len(), 50);
    assert_eq!(make([1, 2], 10.0).vertices.len(), 50);
    assert_eq!(make([3, 3], 10.0).vertices.len(), 45);
    assert_eq!(make([3, 3], 39.0).vertices.len(), 45);
    assert_eq!(make([3, 3], 41.0).vertices.len(), 50);
    assert_eq!(euler(&make([3, 3], 39.0)), 1);
    assert_eq!(euler(&make([3, 3], 41.0)), 2);
    let fold = make([3, 3], 30.0);
    let on_fold: Vec<_> = fold.vertices.iter().filter(|x| x.position.x == 1.0).collect();
    assert_eq!(on_fold.len(), 5);
    let half = 15.0_f64.to_radians();
    assert!(on_fold.iter().all(|x| (x.normal - v(-half.sin(), 0.0, half.cos())).length() < 1e-12));
}

#[test]
fn mesh_of_a_strip_keeps_aspect_at_most_two_and_at_least_two_by_two() {
    for (length, width) in [(1.0, 0.13), (1.0, 1.0), (3.0, 0.1), (0.02, 0.9)] {
        let strip = [v(0., 0., 0.), v(length, 0., 0.), v(length, width, 0.), v(0., width, 0.)];
        let mesh = Mesh::build(&scene(vec![surface("strip", Shape::Quad(strip))], MeshTarget::Elements(1)));
        check(&mesh);
        assert!(mesh.elements.len() >= 4);
        for e in &mesh.elements {
            let p = mesh.polygon(&e.corners);
            let (a, b) = (p[0].distance(p[1]), p[1].distance(p[2]));
            assert!(a.max(b) <= 2.0 * a.min(b) * (1.0 + 1e-9), "{length} x {width}: {a} by {b}");
        }
    }
}

#[test]
fn mesh_by_largest_element_has_no_longer_edge() {
    let mut surfaces = room(4.0, 3.0, 2.5);
    surfaces.extend(red_wall());
    surfaces.push(surface("ball", Shape::Sphere { center: v(2., 1., 1.), radius: 0.5, inward: false }));
    let mesh = Mesh::build(&scene(surfaces, MeshTarget::MaxElementM(0.31)));
    check(&mesh);
    let mut n = 0;
    for e in &mesh.elements {
        let p = mesh.polygon(&e.corners);
        for k in 0..p.len() {
            assert!(p[k].distance(p[(k + 1) % p.len()]) <= 0.31 + 1e-9);
            n += 1;
        }
    }
    assert!(n > 1000);
}

#[test]
fn mesh_of_two_sided_surfaces_has_backs_after_all_fronts_with_their_own_vertices() {
    let mut surfaces = room(1.0, 1.0, 1.0);
    surfaces[2].two_sided = true;
    surfaces.push(Surface {
        two_sided: true,
        ..surface("leaf", Shape::Triangle([v(0.2, 0.2, 0.5), v(0.8, 0.2, 0.5), v(0.2, 0.8, 0.5)]))
    });
    let mesh = Mesh::build(&scene(surfaces, MeshTarget::Elements(400)));
    check(&mesh);
    assert!((mesh.total_area_m2() - 7.36).abs() < 1e-12);
    assert!(mesh.patches.len() > mesh.n_cast_patches);
    assert_eq!(mesh.cast_patches().len(), mesh.n_cast_patches);
    for s in [2, 6] {
        let (front, back) = mesh.surface_elements(SurfaceId(s));
        assert_eq!(front.len(), back.len());
        let ids = |r: Range<u32>| -> std::collections::HashSet<VertexId> {
            r.flat_map(|e| mesh.elements[e as usize].corners.vertices().to_vec()).collect()
        };
        assert!(ids(front).is_disjoint(&ids(back)));
    }
    let (leaf, west) = (mesh.surfaces[6].front.start, mesh.surfaces[0].front.start);
    assert_eq!(mesh.patch_of_hit(PatchId(leaf), Facing::Back), mesh.patches[leaf as usize].twin);
    assert_eq!(mesh.patch_of_hit(PatchId(leaf), Facing::Front), Some(PatchId(leaf)));
    assert_eq!(mesh.patch_of_hit(PatchId(west), Facing::Back), None);
}

#[test]
fn mesh_of_unequal_quads_along_one_line_counts_their_t_junctions() {
    // One long edge against two short ones: the long side's patch edges carry the joint unless it falls on a corner.
    let surfaces = vec![
        surface("long", Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)])),
        surface("left", Shape::Quad([v(0., -0.5, 0.), v(0.3, -0.5, 0.), v(0.3, 0., 0.), v(0., 0., 0.)])),
        surface("right", Shape::Quad([v(0.3, -0.5, 0.), v(1., -0.5, 0.), v(1., 0., 0.), v(0.3, 0., 0.)])),
    ];
    let mesh = Mesh::build(&scene(surfaces, MeshTarget::MaxElementM(0.5)));
    check(&mesh);
    // One patch each: only the long one has a vertex on an edge, at 0.3.
    assert_eq!(mesh.n_t_junctions, 1);
}

#[test]
fn mesh_neighbouring_surfaces_share_positions_bit_for_bit() {
    let third = 1.0 / 3.0;
    let a = [v(0.1, 0.2, 0.3), v(third, 0.7, 0.3), v(third, 0.7, 1.1), v(0.1, 0.2, 1.1)];
    let b = [v(third, 0.7, 1.1), v(third, 0.7, 0.3), v(0.9, third, 0.3), v(0.9, third, 1.1)];
    let mesh = Mesh::build(&scene(
        vec![surface("a", Shape::Quad(a)), surface("b", Shape::Quad(b))],
        MeshTarget::Elements(700),
    ));
    let edge = |s: u32| {
        let (range, _) = mesh.surface_elements(SurfaceId(s));
        let mut z: Vec<[u64; 3]> = range
            .flat_map(|e| mesh.polygon(&mesh.elements[e as usize].corners))
            .filter(|p| (p.x - third).abs() < 1e-9 && (p.y - 0.7).abs() < 1e-9)
            .map(|p| p.to_array().map(f64::to_bits))
            .collect();
        z.sort_unstable();
        z.dedup();
        z
    };
    assert!(edge(0).len() > 10);
    assert_eq!(edge(0), edge(1));
    assert_eq!(mesh.n_t_junctions, 0);
}

#[test]
fn mesh_of_absurd_wishes_stays_bounded() {
    let sliver = [v(0., 0., 0.), v(1., 0., 0.), v(1., 1e-6, 0.), v(0., 1e-6, 0.)];
    let mesh = Mesh::build(&scene(vec![surface("sliver", Shape::Quad(sliver))], MeshTarget::Elements(4)));
    assert!(mesh.elements.len() < 10_000);
    let huge = scene(room(1.0, 1.0, 1.0), MeshTarget::MaxElementM(1e-9));
    assert!(Mesh::planned_elements(&huge) > u64::from(crate::scene::MAX_ELEMENTS));
    let bounded = plan::plan_bounded(&huge);
    assert!(plan::n_elements(&huge, &bounded) <= 4 * u64::from(crate::scene::MAX_ELEMENTS));
}

#[test]
fn mesh_memory_is_counted_and_under_400_bytes_an_element() {
    let mesh = Mesh::build(&scene(room(1.0, 1.0, 1.0), MeshTarget::Elements(10_000)));
    let per_element = mesh.memory_bytes() as f64 / mesh.elements.len() as f64;
    assert!((150.0..400.0).contains(&per_element), "{per_element}");
}

#[test]
fn mesh_by_its_own_uniform_subdivision_is_the_same_and_another_scene_s_is_refused() {
    let room = scene(room(1.0, 2.0, 1.5), MeshTarget::Elements(300));
    let mesh = Mesh::build(&room);
    assert!(mesh.hanging.is_empty());
    assert!(mesh.elements.iter().all(|e| e.place.level() == 1));
    let again = Mesh::build_with(&room, &mesh.subdivision()).unwrap();
    assert_eq!(again.vertices, mesh.vertices);
    let few = Subdivision::new(7, |_, _| false);
    assert!(matches!(
        Mesh::build_with(&room, &few),
        Err(SubdivisionError::Patches { found: 7, expected }) if expected as usize == mesh.patches.len()
    ));
    // One element a patch: the patches themselves.
    let whole = Mesh::build_with(&room, &Subdivision::new(mesh.patches.len() as u32, |_, _| false)).unwrap();
    check(&whole);
    assert_eq!(whole.elements.len(), whole.patches.len());
    assert!(whole.patches.iter().zip(&whole.elements).all(|(p, e)| p.corners == e.corners));
    let p = whole.patches[3].clone();
    let centre = whole.polygon(&p.corners).iter().sum::<DVec3>() / 4.0;
    assert_eq!(whole.locate(PatchId(3), centre).element, ElementId(3));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn quadrature_of_a_parallelogram_is_exact_for_cubics(
        u in prop::array::uniform3(-1.0..1.0f64), w in prop::array::uniform3(-1.0..1.0f64),
        k in prop::array::uniform10(-1.0..1.0f64)
    ) {
        let (u, w) = (DVec3::from_array(u), DVec3::from_array(w));
        prop_assume!(u.cross(w).length() > 0.05);
        let shape = Shape::Quad([DVec3::ZERO, u, u + w, w]);
        let mesh = Mesh::build(&scene(vec![surface("p", shape)], MeshTarget::Elements(1)));
        // A cubic in the parameters of the whole quad, integrated term by term: 1 / ((i + 1) (j + 1)).
        let terms = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];
        let exact: f64 = terms.iter().zip(k).map(|(&(i, j), k)| k / f64::from((i + 1) * (j + 1))).sum();
        let n = u.cross(w);
        let got: f64 = (0..mesh.elements.len())
            .flat_map(|e| mesh.quadrature(ElementId(e as u32)).points().to_vec())
            .map(|(p, weight)| {
                let (s, t) = (p.cross(w).dot(n) / n.length_squared(), u.cross(p).dot(n) / n.length_squared());
                weight * terms.iter().zip(k).map(|(&(i, j), k)| k * s.powi(i) * t.powi(j)).sum::<f64>()
            })
            .sum();
        prop_assert!((got - exact * n.length()).abs() < 1e-12);
    }

    #[test]
    fn locate_of_a_position_gives_the_place_back(
        kind in 0..5usize, pick in 0.0..1.0f64, s in 0.0..1.0f64, t in 0.0..1.0f64,
        bend in prop::array::uniform2(0.3..2.0f64)
    ) {
        let shape = [
            Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(bend[0], bend[1].max(1.05 - bend[0]), 0.), v(0., 1., 0.)]),
            Shape::Triangle([v(0.1, 0., 0.), v(1., bend[0], 0.3), v(0., 1., bend[1])]),
            Shape::Disk { center: v(1., 2., 3.), normal: v(bend[0], bend[1], 1.0).normalize(), radius: bend[0] },
            Shape::Sphere { center: v(1., 2., 3.), radius: bend[0], inward: true },
            Shape::Cylinder { base: v(0., 0., 0.), top: v(bend[0], bend[1], 1.0), radius: 0.3, inward: false },
        ][kind].clone();
        let mut subject = surface("subject", shape);
        subject.two_sided = true;
        let mesh = Mesh::build(&scene(vec![subject], MeshTarget::Elements(64)));
        let element = ElementId((pick * mesh.elements.len() as f64) as u32);
        let e = &mesh.elements[element.0 as usize];
        let st = match e.corners {
            Corners::Triangle(_) if s + t > 1.0 => DVec2::new(1.0 - s, 1.0 - t),
            _ => DVec2::new(s, t),
        };
        let at = mesh.position(SurfacePoint { element, st });
        let found = mesh.locate(e.patch, at);
        prop_assert!(mesh.position(found).distance(at) < 1e-12);
        if s.min(t).min(1.0 - s).min(1.0 - t).min((s + t - 1.0).abs()) > 1e-9 {
            prop_assert_eq!(found.element, element);
            prop_assert!((found.st - st).length() < 1e-9, "{:?} vs {}", found, st);
        }
        // Off the patch: clamped, never NaN.
        for far in [v(9.0, -7.0, 3.0), v(-5.0, 8.0, -1.0), at + 3.0 * (at - mesh.polygon(&e.corners)[0])] {
            let clamped = mesh.locate(e.patch, far).st;
            prop_assert!(clamped.min_element() >= 0.0 && clamped.max_element() <= 1.0);
        }
    }

    #[test]
    fn mesh_of_any_subdivision_keeps_areas_balance_and_places(
        seed: u64, n in 1..200u32, pick in 0.0..1.0f64, s in 0.01..0.99f64, t in 0.01..0.99f64
    ) {
        let mut surfaces = room(1.0, 0.7, 1.3);
        surfaces.extend(red_wall());
        surfaces[2].two_sided = true;
        surfaces.push(surface("tube", Shape::Cylinder {
            base: v(0.3, 0.3, 0.1), top: v(0.4, 0.5, 0.9), radius: 0.2, inward: false,
        }));
        let scene = scene(surfaces, MeshTarget::Elements(n));
        let uniform = Mesh::build(&scene);
        let chosen = Subdivision::new(uniform.patches.len() as u32, |p, place| {
            let id = place.quarters().fold(1, |id, q| 4 * id + u64::from(q));
            place.level() < 5 && crate::sampling::hash(seed, p.into(), id) % 16 < 7
        });
        let mesh = Mesh::build_with(&scene, &chosen).unwrap();
        check(&mesh);
        prop_assert_eq!(mesh.cast_patches(), uniform.cast_patches());
        for (a, b) in mesh.patches.iter().zip(&uniform.patches) {
            prop_assert!((a.area_m2 - b.area_m2).abs() <= 1e-12 * b.area_m2);
        }
        // Only splits were added, and meshing the balanced subdivision again is the same mesh.
        let balanced = mesh.subdivision();
        let leaves = balanced.leaves().unwrap();
        for (p, place) in chosen.leaves().unwrap() {
            prop_assert!(leaves.iter().any(|l| l.0 == p && l.1.at_level(place.level()) == place));
        }
        let again = Mesh::build_with(&scene, &balanced).unwrap();
        prop_assert_eq!(&again.vertices, &mesh.vertices);
        prop_assert_eq!(&again.hanging, &mesh.hanging);
        let same = |(a, b): (&Element, &Element)| {
            (a.corners, a.place, a.neighbours) == (b.corners, b.place, b.neighbours)
        };
        prop_assert!(again.elements.iter().zip(&mesh.elements).all(same));
        let element = ElementId((pick * mesh.elements.len() as f64) as u32);
        let e = &mesh.elements[element.0 as usize];
        let st = match e.corners {
            Corners::Triangle(_) if s + t > 1.0 => DVec2::new(1.0 - s, 1.0 - t),
            _ => DVec2::new(s, t),
        };
        let found = mesh.locate(e.patch, mesh.position(SurfacePoint { element, st }));
        if (s + t - 1.0).abs() > 1e-6 {
            prop_assert_eq!(found.element, element);
            prop_assert!((found.st - st).length() < 1e-7, "{:?} vs {}", found, st);
        }
    }

    #[test]
    fn mesh_area_of_flat_scenes_is_that_of_the_shapes(
        size in prop::array::uniform3(0.1..5.0f64), n in 1..3000u32
    ) {
        let mut surfaces = room(size[0], size[1], size[2]);
        surfaces.extend(red_wall());
        let exact: f64 = surfaces.iter().map(|s| s.shape.area_m2()).sum();
        let mesh = Mesh::build(&scene(surfaces, MeshTarget::Elements(n)));
        check(&mesh);
        prop_assert!((mesh.total_area_m2() - exact).abs() < 1e-10 * exact);
    }
}

#[test]
fn edge_grading_moves_patches_toward_borders_keeps_their_number_and_still_conforms() {
    let mut graded = scene(room(1.0, 1.0, 1.0), MeshTarget::MaxElementM(0.125));
    let even = Mesh::build(&graded);
    graded.meshing.edge_grading = 2.0;
    let mesh = Mesh::build(&graded);
    assert_eq!((mesh.patches.len(), mesh.elements.len()), (even.patches.len(), even.elements.len()));
    assert_eq!((mesh.n_t_junctions, Mesh::planned_elements(&graded)), (0, mesh.elements.len() as u64));
    check(&mesh);
    // Quarters of an edge at 1/8, 1/2, 7/8; elements halve their patches.
    let mut xs: Vec<f64> = mesh.vertices.iter().map(|v| v.position.x).collect();
    xs.sort_by(f64::total_cmp);
    xs.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let expected = [0.0, 0.0625, 0.125, 0.3125, 0.5, 0.6875, 0.875, 0.9375, 1.0];
    assert_eq!(xs.len(), expected.len());
    assert!(xs.iter().zip(expected).all(|(x, e)| (x - e).abs() < 1e-12), "{xs:?}");
    let area: f64 = mesh.elements.iter().map(|e| e.area_m2).sum();
    assert!((area - 6.0).abs() < 1e-12, "{area}");
}
