//! Face sets: closed forms of small solids, faces that are dropped, joined, smoothed.

use std::f64::consts::{PI, TAU};

use super::*;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Polygons of these corners.
pub(crate) fn raw(points: &[DVec3], polygons: &[&[u32]]) -> RawFaces {
    RawFaces {
        points: points.to_vec(),
        corners: polygons.iter().flat_map(|p| p.iter().copied()).collect(),
        arities: polygons.iter().map(|p| p.len() as u32).collect(),
        ..RawFaces::default()
    }
}

pub(crate) fn set(raw: &RawFaces) -> FaceSet {
    raw.build(1e6).unwrap().0.unwrap()
}

const CUBE: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

fn cube_points() -> Vec<DVec3> {
    (0..8).map(|i| v(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect()
}

#[test]
fn cube_of_quads_has_six_faces_that_share_no_point_and_its_area() {
    let polygons: Vec<&[u32]> = CUBE.iter().map(|f| &f[..]).collect();
    let cube = set(&raw(&cube_points(), &polygons));
    assert_eq!((cube.n_faces(), cube.points().len()), (6, 24));
    assert!((cube.area_m2() - 6.0).abs() < 1e-15);
    assert_eq!(cube.counts(), FaceCounts { n_polygons: 6, ..FaceCounts::default() });
}

#[test]
fn cube_of_triangles_is_joined_into_the_same_six_quads_whichever_way_its_diagonals_run() {
    for flip in 0..64_u32 {
        let mut triangles: Vec<Vec<u32>> = Vec::new();
        for (i, [a, b, c, d]) in CUBE.into_iter().enumerate() {
            if flip >> i & 1 == 0 {
                triangles.extend([vec![a, b, c], vec![a, c, d]]);
            } else {
                triangles.extend([vec![b, c, d], vec![d, a, b]]);
            }
        }
        let polygons: Vec<&[u32]> = triangles.iter().map(|t| &t[..]).collect();
        let cube = set(&raw(&cube_points(), &polygons));
        assert_eq!((cube.n_faces(), cube.counts().n_joined), (6, 6), "{flip}");
        assert!((cube.area_m2() - 6.0).abs() < 1e-15);
        for (face, [a, b, c, d]) in cube.faces().zip(CUBE) {
            let p = |i: u32| cube_points()[i as usize];
            let normal = (p(c) - p(a)).cross(p(d) - p(b));
            let at = |k: usize| cube.points()[face[k] as usize];
            assert_eq!(face.len(), 4);
            assert_eq!((at(2) - at(0)).cross(at(3) - at(1)), normal, "{flip}");
        }
    }
}

/// A grid of n x n unit squares, each cut along the same diagonal.
fn grid(n: u32) -> (Vec<DVec3>, Vec<Vec<u32>>) {
    let points = (0..=n).flat_map(|j| (0..=n).map(move |i| v(f64::from(i), f64::from(j), 0.3))).collect();
    let at = |i, j| j * (n + 1) + i;
    let cut = |i, j| {
        [vec![at(i, j), at(i + 1, j), at(i + 1, j + 1)], vec![at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    };
    (points, (0..n).flat_map(|j| (0..n).flat_map(move |i| cut(i, j))).collect())
}

#[test]
fn grid_of_triangles_becomes_squares_not_slanted_parallelograms_and_stays_connected() {
    let n = 9;
    let (points, triangles) = grid(n);
    let polygons: Vec<&[u32]> = triangles.iter().map(|t| &t[..]).collect();
    let grid = set(&raw(&points, &polygons));
    assert_eq!(grid.n_faces(), (n * n) as usize);
    assert_eq!(grid.points().len(), ((n + 1) * (n + 1)) as usize);
    for face in grid.faces() {
        let p = |k: usize| grid.points()[face[k] as usize];
        assert!((p(1) - p(0)).dot(p(3) - p(0)).abs() < 1e-12);
    }
}

#[test]
fn triangles_that_form_a_kite_or_are_bent_stay_triangles() {
    let kite = [v(0., 0., 0.), v(1., 0., 0.), v(2., 2., 0.), v(0., 1., 0.)];
    let bent = [v(0., 0., 0.), v(1., 0., 0.1), v(1., 1., 0.), v(0., 1., 0.1)];
    for points in [kite, bent] {
        let set = set(&raw(&points, &[&[0, 1, 2], &[0, 2, 3]]));
        assert_eq!((set.n_faces(), set.counts().n_joined), (2, 0));
    }
}

/// A tube of n flat sides, every point with its radial normal.
fn tube(n: u32) -> RawFaces {
    let mut raw = RawFaces::default();
    for k in 0..n {
        let (sin, cos) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
        raw.points.extend([v(cos, sin, 0.0), v(cos, sin, 1.0)]);
        raw.normals.extend([v(cos, sin, 0.0); 2]);
    }
    for k in 0..n {
        let (a, b) = (2 * k, 2 * ((k + 1) % n));
        raw.corners.extend([a, b, b + 1, a + 1]);
        raw.arities.push(4);
    }
    raw.corner_normals = raw.corners.clone();
    raw
}

#[test]
fn tube_with_radial_normals_continues_around_and_without_them_breaks_at_every_edge() {
    let n = 24;
    let smooth = set(&tube(n));
    assert_eq!(smooth.points().len(), 2 * n as usize);
    let area = 2.0 * f64::from(n) * (PI / f64::from(n)).sin();
    assert!((smooth.area_m2() - area).abs() < 1e-12);
    let flat = RawFaces { normals: Vec::new(), corner_normals: Vec::new(), ..tube(n) };
    assert_eq!(set(&flat).points().len(), 4 * n as usize);
    let grouped = RawFaces { groups: vec![7; n as usize], ..flat.clone() };
    assert_eq!(set(&grouped), smooth);
    let two_groups = RawFaces { groups: (0..n).map(|k| 1 + k / (n / 2)).collect(), ..flat };
    assert_eq!(set(&two_groups).points().len(), 2 * n as usize + 4);
    // Sides that turn by 60 degrees break whatever the normals say.
    assert_eq!(set(&tube(6)).points().len(), 24);
}

#[test]
fn degenerate_and_doubled_faces_are_dropped_and_counted() {
    let points = [v(0., 0., 0.), v(1., 0., 0.), v(0., 1., 0.), v(2., 0., 0.), v(1., 0., 1e-12)];
    let polygons: [&[u32]; 6] = [&[0, 1, 2], &[0, 1, 3], &[0, 1, 4], &[0, 1, 1], &[1, 2, 0], &[0, 1]];
    let (built, both) = raw(&points, &polygons).build(1e6).unwrap();
    let built = built.unwrap();
    assert_eq!(built.n_faces(), 1);
    let expected =
        FaceCounts { n_polygons: 6, n_degenerate: 4, n_doubled: 1, n_welded: 1, ..FaceCounts::default() };
    assert_eq!((built.counts(), both), (expected, false));
    let (_, both) = raw(&points, &[&[0, 1, 2], &[0, 2, 1]]).build(1e6).unwrap();
    assert!(both);
    assert!(raw(&points, &[&[0, 1, 3]]).build(1e6).unwrap().0.is_none());
}

#[test]
fn polygon_of_many_corners_keeps_area_and_winding() {
    // A star: concave at every second corner.
    let n = 14_u32;
    let ray = |k: u32| {
        let (sin, cos) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
        if k.is_multiple_of(2) { v(cos, sin, 2.0) } else { 0.4 * v(cos, sin, 0.0) + v(0.0, 0.0, 2.0) }
    };
    let points: Vec<DVec3> = (0..n).map(ray).collect();
    let ring: Vec<u32> = (0..n).collect();
    let star = set(&raw(&points, &[&ring]));
    let area = f64::from(n) * 0.5 * 0.4 * (TAU / f64::from(n)).sin();
    assert!((star.area_m2() - area).abs() < 1e-12, "{} {area}", star.area_m2());
    assert_eq!(star.counts().n_cut, 1);
    for face in star.faces() {
        let p = |k: usize| star.points()[face[k] as usize];
        assert!((p(1) - p(0)).cross(p(2) - p(0)).z > 0.0);
    }
    // A dart: only one diagonal is inside.
    let dart = set(&raw(&[v(0., 0., 0.), v(2., 1., 0.), v(0., 2., 0.), v(0.5, 1., 0.)], &[&[0, 1, 2, 3]]));
    assert!((dart.area_m2() - 1.5).abs() < 1e-12);
}

#[test]
fn points_beyond_the_limit_are_refused() {
    let far = [v(0., 0., 0.), v(1e7, 0., 0.), v(0., 1., 0.)];
    assert_eq!(raw(&far, &[&[0, 1, 2]]).build(1e6), Err(Faults::FarPoint(far[1])));
}
