//! How many patches each surface gets: the meshing keys turned into grids that conform along shared edges.
//!
//! ```text
//! Scene --h0--> counts per edge class --max over coincident edges, aspect rule--> Grid per surface
//! ```
//! h0 = sqrt(total area / elements), two-sided surfaces counted twice, or `max_element_m`. An edge of length l gets
//! ceil(l / h0) elements, rounded up to even, so that a patch is 2 x 2 elements. Opposite edges of a quad form a
//! class, all edges of a triangle another; classes that meet along a coincident edge share the largest count, so
//! closed rooms have no T-junctions. A flat element's sides differ by at most 2 to 1: the longer is cut further, in
//! its own smooth group (and what is joined to it by hand) only, and never beyond [`MAX_ASPECT_PATCHES`], which keeps slivers affordable.
//! Triangles take their count from the second longest edge (the longest under `max_element_m`): the longest is at
//! most twice as long, and a wall of two triangles then gets the elements of a wall of one quad, halved.
//! Curved surfaces have a least count that keeps their area within 0.1 %, and no aspect rule.

use std::collections::HashSet;
use std::f64::consts::{PI, TAU};

use super::faces::FaceGrid;
use super::weld::{DisjointSets, Welder};
use crate::geom::{Aabb, DVec3};
use crate::scene::{Continuity, FaceSet, MAX_ELEMENTS, MeshTarget, Scene, Shape, Surface, SurfaceId};

/// Patches that the aspect rule may put along an edge, unless h0 asks for more.
const MAX_ASPECT_PATCHES: u64 = 32;
/// Elements that imported faces may take beyond what is wanted, as a multiple of that and their number: slivers have long
/// edges and hardly an area.
const MAX_FACE_OVERSHOOT: u64 = 8;
/// Most elements along one edge: keeps absurd wishes inside the arithmetic.
const MAX_COUNT: f64 = 1e9;

/// Patch grid of one surface.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Grid {
    /// `s` patches along v0 v1, `t` along v1 v2.
    Quad { s: u64, t: u64 },
    /// `n` patches along each edge, n^2 in all.
    Triangle { n: u64 },
    /// `rings` patches from centre to rim; the innermost are triangles.
    Disk { around: u64, rings: u64 },
    /// `rows` patches from pole to pole; first and last are triangles.
    Sphere { around: u64, rows: u64 },
    /// `rows` patches from rim to rim.
    Cylinder { around: u64, rows: u64 },
    /// Faces cut one by one.
    Faces(FaceGrid),
}

impl Grid {
    pub(super) fn n_patches(&self) -> u64 {
        match *self {
            Grid::Quad { s, t } => s.saturating_mul(t),
            Grid::Triangle { n } => n.saturating_mul(n),
            Grid::Disk { around, rings: n }
            | Grid::Sphere { around, rows: n }
            | Grid::Cylinder { around, rows: n } => around.saturating_mul(n),
            Grid::Faces(ref grid) => grid.n_patches,
        }
    }

    /// Elements of one side: 2 x 2 a patch, one where a patch stays whole (`Tessellation::whole`).
    pub(super) fn n_elements(&self) -> u64 {
        match self {
            Grid::Faces(grid) => grid.n_elements,
            _ => self.n_patches().saturating_mul(4),
        }
    }
}

/// Elements that a list of grids makes, backs included.
pub(super) fn n_elements(scene: &Scene, grids: &[Grid]) -> u64 {
    let of = |(surface, grid): (&Surface, &Grid)| {
        grid.n_elements().saturating_mul(if surface.two_sided { 2 } else { 1 })
    };
    scene.surfaces.iter().zip(grids).map(of).fold(0, u64::saturating_add)
}

/// The grids of a scene's surfaces at the size that the scene asks for.
pub(super) fn plan(scene: &Scene) -> Vec<Grid> {
    grids(scene, wanted_size_m(scene))
}

/// As [`plan`], coarser where the wish is beyond four times the limit that loaders enforce: building never
/// runs out of index space.
pub(super) fn plan_bounded(scene: &Scene) -> Vec<Grid> {
    let mut size_m = wanted_size_m(scene);
    let mut grids_now = grids(scene, size_m);
    for _ in 0..100 {
        if n_elements(scene, &grids_now) <= 4 * u64::from(MAX_ELEMENTS) {
            break;
        }
        size_m *= 1.5;
        grids_now = grids(scene, size_m);
    }
    grids_now
}

/// The tolerance (m) within which corners of different surfaces are one point.
pub(super) fn weld_tolerance_m(scene: &Scene) -> f64 {
    let points = scene.surfaces.iter().flat_map(|surface| match &surface.shape {
        Shape::Quad(v) => v.to_vec(),
        Shape::Triangle(v) => v.to_vec(),
        Shape::Disk { center, radius, .. } | Shape::Sphere { center, radius, .. } => {
            vec![*center - DVec3::splat(*radius), *center + DVec3::splat(*radius)]
        }
        Shape::Cylinder { base, top, .. } => vec![*base, *top],
        Shape::Faces(set) => {
            let around = Aabb::around(set.points().iter().copied());
            vec![around.min, around.max]
        }
    });
    let size = Aabb::around(points).size().length();
    if size.is_finite() && size > 0.0 { 1e-9 * size } else { 1e-9 }
}

fn wanted_size_m(scene: &Scene) -> f64 {
    match scene.meshing.target {
        MeshTarget::MaxElementM(size_m) => size_m,
        MeshTarget::Elements(n) => {
            let sides = |s: &Surface| if s.two_sided { 2.0 } else { 1.0 };
            let area: f64 = scene.surfaces.iter().map(|s| sides(s) * s.shape.area_m2()).sum();
            (area / f64::from(n.max(1))).sqrt()
        }
    }
}

/// Patches (two elements each) that cover `length_m` with elements of at most `size_m`, at least one.
pub(super) fn n_patches_along(length_m: f64, size_m: f64) -> u64 {
    // The slack keeps an exact quotient that rounding lifted from costing another patch.
    let n = (length_m / size_m - 1e-9).ceil().clamp(1.0, MAX_COUNT);
    (n as u64).div_ceil(2).max(1)
}

fn grids(scene: &Scene, size_m: f64) -> Vec<Grid> {
    let MeshTarget::Elements(wanted) = scene.meshing.target else { return grids_of(scene, size_m, size_m) };
    let n_faces: usize = scene.surfaces.iter().filter_map(face_set).map(FaceSet::n_faces).sum();
    let most = MAX_FACE_OVERSHOOT * (u64::from(wanted) + n_faces as u64);
    let mut face_size_m = size_m;
    loop {
        let grids = grids_of(scene, size_m, face_size_m);
        let of_faces = |grid: &Grid| if matches!(grid, Grid::Faces(_)) { grid.n_elements() } else { 0 };
        let n = grids.iter().map(of_faces).fold(0, u64::saturating_add);
        if n <= most || face_size_m > 1e12 * size_m {
            return grids;
        }
        face_size_m *= 1.5;
    }
}

/// Grids with elements of `size_m`, of `face_size_m` on imported faces.
fn grids_of(scene: &Scene, size_m: f64, face_size_m: f64) -> Vec<Grid> {
    let counts = flat_counts(scene, size_m, face_size_m);
    let mut first_class = 2 * scene.surfaces.len();
    let cut = any_long_face(scene, face_size_m);
    let min_around = u64::from(scene.meshing.min_around.max(3));
    let grid = |(i, surface): (usize, &Surface)| match surface.shape {
        Shape::Faces(ref set) => {
            let start = first_class;
            first_class += n_face_classes(set, cut);
            let counts = face_counts(set, &counts[start..first_class]);
            Grid::Faces(FaceGrid::new(set, counts, scene.meshing.target, face_size_m))
        }
        Shape::Quad(_) => Grid::Quad { s: counts[2 * i], t: counts[2 * i + 1] },
        Shape::Triangle(_) => Grid::Triangle { n: counts[2 * i] },
        Shape::Disk { radius, .. } => Grid::Disk {
            around: n_patches_along(TAU * radius, size_m).max(min_around),
            rings: n_patches_along(radius, size_m).max(2),
        },
        Shape::Sphere { radius, .. } => {
            let rows = n_patches_along(PI * radius, size_m).max(min_around / 3).max(2);
            Grid::Sphere { around: 2 * rows, rows }
        }
        Shape::Cylinder { base, top, radius, .. } => Grid::Cylinder {
            around: n_patches_along(TAU * radius, size_m).max(min_around),
            rows: n_patches_along(base.distance(top), size_m),
        },
    };
    scene.surfaces.iter().enumerate().map(grid).collect()
}

/// Corners of a flat shape, none for the others.
fn flat_corners(shape: &Shape) -> &[DVec3] {
    match shape {
        Shape::Quad(v) => v,
        Shape::Triangle(v) => v,
        _ => &[],
    }
}

/// Patches along the edges of flat surfaces: class `2 i + (edge & 1)` of quad i, class `2 i` of triangle i.
fn flat_counts(scene: &Scene, size_m: f64, face_size_m: f64) -> Vec<u64> {
    let n_flat = 2 * scene.surfaces.len();
    let sets = || scene.surfaces.iter().filter_map(face_set);
    let cut = any_long_face(scene, face_size_m);
    let n_classes = n_flat + sets().map(|set| n_face_classes(set, cut)).sum::<usize>();
    let longest_rule = matches!(scene.meshing.target, MeshTarget::MaxElementM(_));
    let class = |i: usize, n_corners: usize, edge: usize| 2 * i + if n_corners == 4 { edge & 1 } else { 0 };

    let mut welder = Welder::new(weld_tolerance_m(scene));
    let mut need = vec![1_u64; n_classes];
    let mut edges = Vec::new();
    for (i, surface) in scene.surfaces.iter().enumerate() {
        let corners = flat_corners(&surface.shape);
        let n = corners.len();
        let ids: Vec<u32> = corners.iter().map(|&c| welder.weld(c).0).collect();
        let mut lengths: Vec<f64> = (0..n).map(|e| corners[e].distance(corners[(e + 1) % n])).collect();
        for e in 0..n {
            let (a, b) = (ids[e], ids[(e + 1) % n]);
            edges.push((a.min(b), a.max(b), class(i, n, e)));
        }
        if n == 3 {
            lengths.sort_unstable_by(f64::total_cmp);
            let rule = if longest_rule { lengths[2] } else { lengths[1] };
            lengths = vec![rule];
        }
        for (e, &length) in lengths.iter().enumerate() {
            let c = class(i, n, e);
            need[c] = need[c].max(n_patches_along(length, size_m));
        }
    }
    let mut first_class = n_flat;
    for set in sets().filter(|_| cut) {
        let ids: Vec<u32> = set.points().iter().map(|&p| welder.weld(p).0).collect();
        for (f, face) in set.faces().enumerate() {
            let n = face.len();
            for e in 0..n {
                let (p, q) = (face[e] as usize, face[(e + 1) % n] as usize);
                let c = first_class + 4 * f + e;
                edges.push((ids[p].min(ids[q]), ids[p].max(ids[q]), c));
                need[c] =
                    need[c].max(n_patches_along(set.points()[p].distance(set.points()[q]), face_size_m));
            }
        }
        first_class += n_face_classes(set, cut);
    }
    edges.sort_unstable();
    let by_hand: HashSet<[SurfaceId; 2]> =
        scene.continuity.iter().filter(|c| c.continuity != Continuity::Broken).map(|c| c.between).collect();
    let continues = |a: usize, b: usize| {
        let group_of = |class: usize| scene.surfaces[class / 2].smooth_group;
        let (one, other) = (SurfaceId(a as u32 / 2), SurfaceId(b as u32 / 2));
        group_of(a) != 0 && group_of(a) == group_of(b) || by_hand.contains(&[one.min(other), one.max(other)])
    };
    let mut touching = DisjointSets::new(n_classes);
    // Opposite edges of a quad that becomes a grid go together.
    let mut first_face = n_flat;
    for set in sets().filter(|_| cut) {
        for (f, _) in set.faces().enumerate().filter(|(_, face)| super::faces::is_gridded(set, face)) {
            let class = |e: usize| (first_face + 4 * f + e) as u32;
            touching.union(class(0), class(2));
            touching.union(class(1), class(3));
        }
        first_face += n_face_classes(set, cut);
    }
    let mut smooth = DisjointSets::new(n_classes);
    for pair in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for next in pair.windows(2) {
            touching.union(next[0].2 as u32, next[1].2 as u32);
        }
        let flat: Vec<usize> = pair.iter().map(|e| e.2).filter(|&class| class < n_flat).collect();
        for (k, &a) in flat.iter().enumerate() {
            for &b in flat[k + 1..].iter().filter(|&&b| continues(a, b)) {
                smooth.union(a as u32, b as u32);
            }
        }
    }
    let mut counts = share_largest(&need, &mut touching);
    // Counts only grow and are bounded, but a chain may take several rounds to settle.
    for _ in 0..16 {
        let wanted = aspect_counts(scene, &counts);
        if wanted == counts {
            break;
        }
        counts = share_largest(&wanted, &mut smooth);
    }
    counts
}

fn face_set(surface: &Surface) -> Option<&FaceSet> {
    match &surface.shape {
        Shape::Faces(set) => Some(set),
        _ => None,
    }
}

/// Whether any face has to be cut.
fn any_long_face(scene: &Scene, size_m: f64) -> bool {
    let long = |set: &FaceSet| {
        let at = |i: u32| set.points()[i as usize];
        let is_long = |a: u32, b: u32| n_patches_along(at(a).distance(at(b)), size_m) > 1;
        set.faces().any(|face| (0..face.len()).any(|e| is_long(face[e], face[(e + 1) % face.len()])))
    };
    scene.surfaces.iter().filter_map(face_set).any(long)
}

/// Classes that the faces of a set take, four a face; none when nothing is cut.
fn n_face_classes(set: &FaceSet, cut: bool) -> usize {
    if cut { 4 * set.n_faces() } else { 0 }
}

/// Patches along each edge of each face.
fn face_counts(set: &FaceSet, classes: &[u64]) -> Vec<u32> {
    if classes.is_empty() {
        return Vec::new();
    }
    let mut counts = vec![1; 4 * set.n_faces()];
    for (f, face) in set.faces().enumerate() {
        for e in 0..face.len() {
            counts[4 * f + e] = classes[4 * f + e].min(u64::from(u32::MAX)) as u32;
        }
    }
    counts
}

/// Each class gets the largest value of its set.
fn share_largest(values: &[u64], sets: &mut DisjointSets) -> Vec<u64> {
    let mut largest = vec![0_u64; values.len()];
    for (c, &v) in values.iter().enumerate() {
        let root = sets.find(c as u32) as usize;
        largest[root] = largest[root].max(v);
    }
    (0..values.len()).map(|c| largest[sets.find(c as u32) as usize]).collect()
}

/// Raises the counts of quads whose elements would be more than twice as long as wide.
fn aspect_counts(scene: &Scene, counts: &[u64]) -> Vec<u64> {
    let mut wanted = counts.to_vec();
    for (i, surface) in scene.surfaces.iter().enumerate() {
        let Shape::Quad(v) = surface.shape else { continue };
        let length = |a: usize, b: usize| v[a].distance(v[b]);
        let lengths = [length(0, 1).max(length(2, 3)), length(1, 2).max(length(3, 0))];
        for long in 0..2 {
            let (l, w) = (2 * i + long, 2 * i + 1 - long);
            let size = lengths[long] / counts[l] as f64;
            let width = lengths[1 - long] / counts[w] as f64;
            if size > 2.0 * width * (1.0 + 1e-9) {
                let n = (lengths[long] / (2.0 * width) - 1e-9).ceil().clamp(1.0, MAX_COUNT) as u64;
                wanted[l] = n.min(MAX_ASPECT_PATCHES).max(counts[l]);
            }
        }
    }
    wanted
}
