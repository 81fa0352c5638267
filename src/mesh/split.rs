//! Patches split into 2 x 2 elements, linked edge by edge.
//!
//! ```text
//! d---m2---c        c          patch edge i runs from corner i to corner i + 1 and has its middle in m_i;
//! | 2 | 3  |        |\         elements of a quad row by row, of a triangle at corners 0, 1, 2, then the
//! m3--+---m1       m2-m1       middle one upside down
//! | 0 | 1  |        |\|\
//! a---m0---b        a-m0-b
//! ```

use super::weld::DisjointSets;
use super::{Continuity, Corners, Element, ElementId, Patch, PatchId, Vertex, VertexId};
use crate::geom::DVec3;

/// Nothing lies across, or no number yet.
pub(super) const NONE: u32 = u32::MAX;

/// (element, edge) of the first and second half of each patch edge.
const HALVES_QUAD: [[(u32, usize); 2]; 4] =
    [[(0, 0), (1, 0)], [(1, 1), (3, 1)], [(3, 2), (2, 2)], [(2, 3), (0, 3)]];
const HALVES_TRIANGLE: [[(u32, usize); 2]; 3] = [[(0, 0), (1, 0)], [(1, 1), (2, 1)], [(2, 2), (0, 2)]];
/// Element edges that meet inside a patch.
const INNER_QUAD: [[(u32, usize); 2]; 4] =
    [[(0, 1), (1, 3)], [(0, 2), (2, 0)], [(1, 2), (3, 0)], [(2, 1), (3, 3)]];
const INNER_TRIANGLE: [[(u32, usize); 2]; 3] = [[(0, 1), (3, 1)], [(1, 2), (3, 2)], [(2, 0), (3, 0)]];

/// Unit normal and area (m^2) of a planar polygon of 3 or 4 corners.
pub(super) fn facet(points: &[DVec3], corners: &Corners) -> (DVec3, f64) {
    let p = |v: VertexId| points[v.0 as usize];
    let cross = match *corners {
        Corners::Triangle([a, b, c]) => (p(b) - p(a)).cross(p(c) - p(a)),
        Corners::Quad([a, b, c, d]) => (p(c) - p(a)).cross(p(d) - p(b)),
    };
    (cross.normalize_or(DVec3::Z), 0.5 * cross.length())
}

/// Splits patches into 2 x 2 elements and numbers the vertices in the order of first use.
pub(super) fn split(
    mut points: Vec<DVec3>,
    patches: &mut [Patch],
    across: &[u32],
    sets: &mut DisjointSets,
) -> (Vec<Vertex>, Vec<Element>) {
    let n_corners = points.len();
    let mut vertices = Vec::new();
    let mut elements: Vec<Element> = Vec::with_capacity(4 * patches.len());
    // Final number of each provisional vertex, and provisional midpoint of each patch edge.
    let mut numbers = vec![NONE; n_corners];
    let mut middles = vec![NONE; across.len()];
    for (p, patch) in patches.iter_mut().enumerate() {
        let corners = patch.corners;
        let ends = corners.vertices();
        let n = ends.len();
        let mut mid = [VertexId(NONE); 4];
        for (e, middle) in mid.iter_mut().enumerate().take(n) {
            let slot = 4 * p + e;
            let shared = match across[slot] {
                NONE => NONE,
                other => middles[other as usize],
            };
            middles[slot] = if shared == NONE {
                let (a, b) = corners.edge(e);
                points.push(0.5 * (points[a.0 as usize] + points[b.0 as usize]));
                numbers.push(NONE);
                points.len() as u32 - 1
            } else {
                shared
            };
            *middle = VertexId(middles[slot]);
        }
        let cut = match corners {
            Corners::Triangle([a, b, c]) => [
                Corners::Triangle([a, mid[0], mid[2]]),
                Corners::Triangle([mid[0], b, mid[1]]),
                Corners::Triangle([mid[2], mid[1], c]),
                Corners::Triangle([mid[1], mid[2], mid[0]]),
            ],
            Corners::Quad([a, b, c, d]) => {
                let sum = [a, b, c, d].iter().fold(DVec3::ZERO, |s, v| s + points[v.0 as usize]);
                points.push(0.25 * sum);
                numbers.push(NONE);
                let center = VertexId(points.len() as u32 - 1);
                [
                    Corners::Quad([a, mid[0], center, mid[3]]),
                    Corners::Quad([mid[0], b, mid[1], center]),
                    Corners::Quad([mid[3], center, mid[2], d]),
                    Corners::Quad([center, mid[1], c, mid[2]]),
                ]
            }
        };
        let mut number = |v: VertexId| {
            let root = if (v.0 as usize) < n_corners { sets.find(v.0) } else { v.0 };
            let slot = &mut numbers[root as usize];
            if *slot == NONE {
                *slot = vertices.len() as u32;
                let position = points[root as usize];
                vertices.push(Vertex { position, normal: DVec3::ZERO, inward: DVec3::ZERO });
            }
            VertexId(*slot)
        };
        let start = elements.len() as u32;
        let mut area_m2 = 0.0;
        for provisional in cut {
            let area = facet(&points, &provisional).1;
            area_m2 += area;
            elements.push(Element {
                corners: match provisional {
                    Corners::Triangle(v) => Corners::Triangle(v.map(&mut number)),
                    Corners::Quad(v) => Corners::Quad(v.map(&mut number)),
                },
                patch: PatchId(p as u32),
                area_m2: area,
                normal: patch.normal,
                neighbours: [None; 4],
                continuity: [Continuity::Broken; 4],
            });
        }
        patch.corners = match corners {
            Corners::Triangle(v) => Corners::Triangle(v.map(&mut number)),
            Corners::Quad(v) => Corners::Quad(v.map(&mut number)),
        };
        patch.elements = start..start + 4;
        patch.area_m2 = area_m2;
    }
    (vertices, elements)
}

fn halves(patch: &Patch, edge: usize) -> [(u32, usize); 2] {
    match patch.corners {
        Corners::Triangle(_) => HALVES_TRIANGLE[edge],
        Corners::Quad(_) => HALVES_QUAD[edge],
    }
}

pub(super) fn link_neighbours(patches: &[Patch], across: &[u32], elements: &mut [Element]) {
    let mut link = |a: u32, edge: usize, b: u32| {
        elements[a as usize].neighbours[edge] = Some(ElementId(b));
        elements[a as usize].continuity[edge] = Continuity::C1;
    };
    for (p, patch) in patches.iter().enumerate() {
        let base = patch.elements.start;
        let inner: &[[(u32, usize); 2]] = match patch.corners {
            Corners::Triangle(_) => &INNER_TRIANGLE,
            Corners::Quad(_) => &INNER_QUAD,
        };
        for &[(a, ea), (b, eb)] in inner {
            link(base + a, ea, base + b);
            link(base + b, eb, base + a);
        }
        for e in 0..patch.corners.vertices().len() {
            let other = across[4 * p + e];
            if other == NONE {
                continue;
            }
            let next = &patches[(other / 4) as usize];
            // The edges run against each other: our first half meets their second.
            let ([a0, a1], [b0, b1]) = (halves(patch, e), halves(next, (other % 4) as usize));
            link(base + a0.0, a0.1, next.elements.start + b1.0);
            link(base + a1.0, a1.1, next.elements.start + b0.0);
        }
    }
}
