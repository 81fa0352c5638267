//! Face sets cut into patches: how many along each edge, and the cutting.
//!
//! ```text
//! FaceSet, counts per edge --quads: grids; triangles: grids, or halved until their sides agree--> points, patches
//! ```
//! The count of an edge depends on the edge alone (and, through quads, on the opposite ones), so faces that meet along
//! it agree and no edge of the mesh ends inside another. A sliver of a quad is cut as two triangles. A triangle whose three counts are equal is cut into similar
//! ones; else its side of most patches is halved toward the opposite corner (Rivara 1984, longest-edge bisection),
//! which keeps angles from getting ever smaller.
//!
//! Not modelled: the aspect rule of quads that scene files write; imported faces keep the shape that they came with.

use std::collections::HashMap;

use super::plan::n_patches_along;
use super::tessellate::Tessellation;
use super::{Corners, VertexId};
use crate::geom::DVec3;
use crate::scene::{FaceSet, MeshTarget};

/// Patches from which a triangle's number is estimated, not counted: it will be refused or made coarser.
const MANY: u64 = 1 << 24;

/// How a face set is cut.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FaceGrid {
    /// Patches along edge e of face f: `counts[4 f + e]`; empty when all are 1.
    pub(super) counts: Vec<u32>,
    /// Wanted size of an element (m).
    pub(super) size_m: f64,
    /// What an element must not be larger than.
    target: MeshTarget,
    /// Patches in all.
    pub(super) n_patches: u64,
    /// Elements in all.
    pub(super) n_elements: u64,
}

impl FaceGrid {
    /// The grid of these counts, with its number of patches and elements.
    pub(super) fn new(set: &FaceSet, counts: Vec<u32>, target: MeshTarget, size_m: f64) -> FaceGrid {
        let mut grid = FaceGrid { counts, size_m, target, n_patches: 0, n_elements: 0 };
        for (f, face) in set.faces().enumerate() {
            let n = match grid.counts.get(4 * f..4 * f + 4) {
                Some(counts) => n_patches_of(set, face, counts, size_m),
                None => 1,
            };
            grid.n_patches = grid.n_patches.saturating_add(n);
            let per_patch = if n == 1 && grid.stays_whole(set, face) { 1 } else { 4 };
            grid.n_elements = grid.n_elements.saturating_add(n.saturating_mul(per_patch));
        }
        grid
    }

    /// Whether a face that is one patch is one element too: no larger than two wanted elements, or no edge too long.
    fn stays_whole(&self, set: &FaceSet, face: &[u32]) -> bool {
        let p = |k: usize| set.points()[face[k % face.len()] as usize];
        match self.target {
            MeshTarget::MaxElementM(size_m) => {
                (0..face.len()).all(|e| p(e).distance(p(e + 1)) <= size_m * (1.0 + 1e-9))
            }
            MeshTarget::Elements(_) => {
                // Of a triangle the fourth corner is the first again.
                let area = 0.5 * (p(2) - p(0)).cross(p(3) - p(1)).length();
                area <= 2.0 * self.size_m * self.size_m
            }
        }
    }
}

fn n_patches_of(set: &FaceSet, face: &[u32], counts: &[u32], size_m: f64) -> u64 {
    let n_along = |e: usize| u64::from(counts[e]);
    if is_gridded(set, face) {
        return n_along(0) * n_along(1);
    }
    let mut sorted: Vec<u64> = (0..face.len()).map(n_along).collect();
    sorted.sort_unstable();
    if sorted[0] == sorted[face.len() - 1] && (face.len() == 3 || sorted[0] == 1) {
        return sorted[0] * sorted[0];
    }
    let about = sorted[face.len() - 2].saturating_mul(sorted[face.len() - 1]);
    if about > MANY { about } else { count(set, face, counts, size_m) }
}

/// Corner points (m) and patches of a face set.
pub(super) fn cut(set: &FaceSet, grid: &FaceGrid) -> Tessellation {
    let mut cut = Cut { points: set.points().to_vec(), patches: Vec::with_capacity(grid.n_patches as usize) };
    let mut whole = Vec::with_capacity(grid.n_patches as usize);
    let mut edges = HashMap::new();
    for (f, face) in set.faces().enumerate() {
        let n = face.len();
        let counts = grid.counts.get(4 * f..4 * f + 4).filter(|counts| counts[..n].iter().any(|&n| n > 1));
        let Some(counts) = counts else {
            cut.patches.push(of_ids(face));
            whole.push(grid.stays_whole(set, face));
            continue;
        };
        let mut side = |e: usize| cut.edge(&mut edges, face[e], face[(e + 1) % n], counts[e]);
        if n == 4 {
            let sides = [side(0), side(1), side(2), side(3)];
            quad(&mut cut, sides, is_gridded(set, face), grid.size_m);
        } else {
            let sides = [side(0), side(1), side(2)];
            triangle(&mut cut, sides, grid.size_m);
        }
        whole.resize(cut.patches.len(), false);
    }
    Tessellation { points: cut.points, patches: cut.patches, whole }
}

fn of_ids(face: &[u32]) -> Corners {
    match *face {
        [a, b, c, d] => Corners::Quad([a, b, c, d].map(VertexId)),
        _ => Corners::Triangle([face[0], face[1], face[2]].map(VertexId)),
    }
}

/// Whether a face that is cut becomes a grid: a quad whose opposite sides are alike and whose sides stand apart. Others
/// are two triangles when they are cut: a grid of a sliver would have as many patches as its long sides squared.
pub(super) fn is_gridded(set: &FaceSet, face: &[u32]) -> bool {
    let [a, b, c, d] = *face else { return false };
    let p = |i: u32| set.points()[i as usize];
    let (e0, e1, e2, e3) =
        (p(a).distance(p(b)), p(b).distance(p(c)), p(c).distance(p(d)), p(d).distance(p(a)));
    let alike = |x: f64, y: f64| x.max(y) <= 2.0 * x.min(y);
    let area = 0.5 * (p(c) - p(a)).cross(p(d) - p(b)).length();
    alike(e0, e2) && alike(e1, e3) && area >= 0.2 * e0.max(e2) * e1.max(e3)
}

/// A point under way: its id and its place (m).
type At = (u32, DVec3);

/// Who takes points and patches.
trait Sink {
    fn point(&mut self, at: DVec3) -> At;
    fn patch(&mut self, corners: Corners);
}

struct Cut {
    points: Vec<DVec3>,
    patches: Vec<Corners>,
}

impl Sink for Cut {
    fn point(&mut self, at: DVec3) -> At {
        self.points.push(at);
        (self.points.len() as u32 - 1, at)
    }

    fn patch(&mut self, corners: Corners) {
        self.patches.push(corners);
    }
}

impl Cut {
    /// Points from `a` to `b`, both included, `n` patches apart; the same for every face that has this edge.
    fn edge(&mut self, edges: &mut HashMap<(u32, u32), u32>, a: u32, b: u32, n: u32) -> Vec<At> {
        let (from, to) = (self.points[a as usize], self.points[b as usize]);
        // The direction is the places': copies of an edge at a crease get the same bits.
        let forward = from.to_array() <= to.to_array();
        let (first, last) = if forward { (a, b) } else { (b, a) };
        let start = *edges.entry((first, last)).or_insert_with(|| {
            let start = self.points.len() as u32;
            let (p, q) = (self.points[first as usize], self.points[last as usize]);
            self.points.extend((1..n).map(|k| p.lerp(q, f64::from(k) / f64::from(n))));
            start
        });
        let ids = std::iter::once(first).chain(start..start + n - 1).chain([last]);
        let mut side: Vec<At> = ids.map(|id| (id, self.points[id as usize])).collect();
        if !forward {
            side.reverse();
        }
        side
    }
}

/// Only counts.
struct Count(u64);

impl Sink for Count {
    fn point(&mut self, at: DVec3) -> At {
        (0, at)
    }

    fn patch(&mut self, _: Corners) {
        self.0 += 1;
    }
}

fn count(set: &FaceSet, face: &[u32], counts: &[u32], size_m: f64) -> u64 {
    let side = |e: usize| -> Vec<At> {
        let at = |c: usize| set.points()[face[c % face.len()] as usize];
        (0..=counts[e]).map(|k| (0, at(e).lerp(at(e + 1), f64::from(k) / f64::from(counts[e])))).collect()
    };
    let mut counter = Count(0);
    if face.len() == 4 {
        quad(&mut counter, [side(0), side(1), side(2), side(3)], false, size_m);
    } else {
        triangle(&mut counter, [side(0), side(1), side(2)], size_m);
    }
    counter.0
}

/// Cuts a triangle; `sides[i]` runs from corner i to corner i + 1.
fn triangle<S: Sink>(sink: &mut S, sides: [Vec<At>; 3], size_m: f64) {
    let n = [0, 1, 2].map(|i| sides[i].len() - 1);
    if n == [1, 1, 1] {
        sink.patch(Corners::Triangle([0, 1, 2].map(|i| VertexId(sides[i][0].0))));
    } else if n[0] == n[1] && n[1] == n[2] {
        similar(sink, &sides);
    } else {
        let length = |i: usize| sides[i][0].1.distance(sides[i][n[i]].1);
        let i = (0..3).max_by(|&a, &b| n[a].cmp(&n[b]).then(length(a).total_cmp(&length(b)))).unwrap_or(0);
        let middle = n[i] / 2;
        let [side, next, last] = [0, 1, 2].map(|k| &sides[(i + k) % 3]);
        let (from, apex) = (side[middle], last[0]);
        let across = line(sink, from, apex, size_m);
        let back: Vec<At> = across.iter().rev().copied().collect();
        let halves =
            [[side[..=middle].to_vec(), across, last.clone()], [side[middle..].to_vec(), next.clone(), back]];
        for half in halves {
            triangle(sink, half, size_m);
        }
    }
}

/// New points from one point to another, both included.
fn line<S: Sink>(sink: &mut S, from: At, to: At, size_m: f64) -> Vec<At> {
    let n = n_patches_along(from.1.distance(to.1), size_m);
    let mut points = vec![from];
    points.extend((1..n).map(|k| sink.point(from.1.lerp(to.1, k as f64 / n as f64))));
    points.push(to);
    points
}

/// A triangle of n patches along each side: n^2 similar ones.
fn similar<S: Sink>(sink: &mut S, sides: &[Vec<At>; 3]) {
    let n = sides[0].len() - 1;
    let [a, b, c] = [0, 1, 2].map(|i| sides[i][0].1);
    // Row j of points runs from the third side to the second.
    let mut below: Vec<At> = sides[0].clone();
    for j in 1..=n {
        let mut row = Vec::with_capacity(n - j + 1);
        for i in 0..=n - j {
            let (w, u, t) = ((n - i - j) as f64, i as f64, j as f64);
            row.push(match i {
                0 => sides[2][n - j],
                _ if i == n - j => sides[1][j],
                _ => sink.point((w * a + u * b + t * c) / n as f64),
            });
        }
        for i in 0..=n - j {
            sink.patch(Corners::Triangle([below[i], below[i + 1], row[i]].map(|p| VertexId(p.0))));
            if i < n - j {
                sink.patch(Corners::Triangle([below[i + 1], row[i + 1], row[i]].map(|p| VertexId(p.0))));
            }
        }
        below = row;
    }
}

/// Cuts a quad, as a grid when opposite sides have equally many patches, or in two along its shorter diagonal;
/// `sides[i]` runs from corner i to corner i + 1.
fn quad<S: Sink>(sink: &mut S, sides: [Vec<At>; 4], gridded: bool, size_m: f64) {
    if !gridded {
        let corner = |i: usize| sides[i][0];
        let first = usize::from(corner(0).1.distance(corner(2).1) > corner(1).1.distance(corner(3).1));
        let diagonal = line(sink, corner(first), corner(first + 2), size_m);
        let back = diagonal.iter().rev().copied().collect();
        let side = |i: usize| sides[(first + i) % 4].clone();
        triangle(sink, [side(0), side(1), back], size_m);
        return triangle(sink, [diagonal, side(2), side(3)], size_m);
    }
    let (n, m) = (sides[0].len() - 1, sides[1].len() - 1);
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| sides[i][0].1);
    let mut below: Vec<At> = sides[0].clone();
    for j in 1..=m {
        let row: Vec<At> = if j == m {
            sides[2].iter().rev().copied().collect()
        } else {
            let t = j as f64 / m as f64;
            (0..=n)
                .map(|i| match i {
                    0 => sides[3][m - j],
                    _ if i == n => sides[1][j],
                    _ => {
                        let s = i as f64 / n as f64;
                        sink.point(a.lerp(b, s).lerp(d.lerp(c, s), t))
                    }
                })
                .collect()
        };
        for i in 0..n {
            let corners = [below[i], below[i + 1], row[i + 1], row[i]];
            sink.patch(Corners::Quad(corners.map(|p| VertexId(p.0))));
        }
        below = row;
    }
}

#[cfg(test)]
mod tests;
