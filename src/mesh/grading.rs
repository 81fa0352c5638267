//! Where quads are cut finer: toward the borders of what their smooth group makes one surface.
//!
//! ```text
//! Scene --edges that no quad of the same group continues--> ends of each quad's two axes
//!       --coincident edges agree: an end is graded where it is in all quads that share the edge--> Grading per surface
//! place k of n along an axis: one end x^g | both ends (2 x)^g / 2, mirrored | none x
//! ```
//! Irradiance goes as a + c d^0.68 near an edge where walls meet, so a mesh is worth more there. Counts are those of the even
//! mesh (`plan.rs`), and quads that share an edge still share its points.
//!
//! Not modelled: triangles and imported faces stay even, and may then meet graded quads in T-junctions.

use super::plan::weld_tolerance_m;
use super::weld::Welder;
use crate::scene::{Scene, Shape};

/// How a quad is graded: exponent, and per axis (s, t) whether toward its beginning and its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grading {
    exponent: f64,
    ends: [[bool; 2]; 2],
}

impl Grading {
    /// None.
    pub(super) const EVEN: Grading = Grading { exponent: 1.0, ends: [[false; 2]; 2] };

    /// The place of part `k` of `n` along axis s (0) or t (1).
    pub(super) fn place(&self, axis: usize, k: u32, n: u32) -> f64 {
        let share = |k: u32| f64::from(k) / f64::from(n);
        let half = |k: u32| 0.5 * (2.0 * share(k)).powf(self.exponent);
        match self.ends[axis] {
            _ if self.exponent == 1.0 => share(k),
            [false, false] => share(k),
            [true, false] => share(k).powf(self.exponent),
            [false, true] => 1.0 - share(n - k).powf(self.exponent),
            [true, true] if 2 * k <= n => half(k),
            [true, true] => 1.0 - half(n - k),
        }
    }
}

/// One edge of a quad: ends welded, which quad, which edge.
struct Edge {
    low: u32,
    high: u32,
    start: u32,
    surface: usize,
    edge: usize,
}

impl Edge {
    /// The axis along it, and which end of that axis the welded point is.
    fn end(&self, point: u32) -> (usize, usize) {
        let begins = usize::from(self.edge >= 2);
        (self.edge & 1, if point == self.start { begins } else { 1 - begins })
    }
}

/// The grading of every surface that the scene's `meshing` asks for.
pub(super) fn gradings(scene: &Scene) -> Vec<Grading> {
    let exponent = scene.meshing.edge_grading;
    let mut all = vec![Grading::EVEN; scene.surfaces.len()];
    if exponent == 1.0 {
        return all;
    }
    let mut welder = Welder::new(weld_tolerance_m(scene));
    let mut edges = Vec::new();
    for (surface, of) in scene.surfaces.iter().enumerate() {
        let Shape::Quad(corners) = of.shape else { continue };
        all[surface] = Grading { exponent, ends: [[true; 2]; 2] };
        let ids = corners.map(|c| welder.weld(c).0);
        for edge in 0..4 {
            let (a, b) = (ids[edge], ids[(edge + 1) % 4]);
            edges.push(Edge { low: a.min(b), high: a.max(b), start: a, surface, edge });
        }
    }
    edges.sort_by_key(|e| (e.low, e.high, e.surface, e.edge));
    let shared: Vec<&[Edge]> = edges.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high)).collect();
    let group = |e: &Edge| scene.surfaces[e.surface].smooth_group;
    for edge in shared.iter().flat_map(|set| set.iter().map(move |e| (set, e))).filter_map(|(set, e)| {
        let joined = set.iter().any(|o| o.surface != e.surface && group(o) == group(e));
        (group(e) != 0 && joined).then_some(e)
    }) {
        // The edge bounds the other axis: t at edges 0 and 2, s at edges 3 and 1.
        let (axis, end) = [(1, 0), (0, 1), (1, 1), (0, 0)][edge.edge];
        all[edge.surface].ends[axis][end] = false;
    }
    // Ends only lose their grading, so this settles.
    let mut changed = true;
    while changed {
        changed = false;
        for set in &shared {
            for point in [set[0].low, set[0].high] {
                let places = || set.iter().map(|e| (e.surface, e.end(point)));
                let graded = places().all(|(s, (axis, end))| all[s].ends[axis][end]);
                for (s, (axis, end)) in places().collect::<Vec<_>>() {
                    changed |= all[s].ends[axis][end] != graded;
                    all[s].ends[axis][end] = graded;
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;

    #[test]
    fn places_run_from_0_to_1_and_lie_closer_at_graded_ends() {
        let grading = |first, last| Grading { exponent: 2.0, ends: [[first, last], [false; 2]] };
        let places = |g: Grading| [0, 1, 2, 3, 4].map(|k| g.place(0, k, 4));
        assert_eq!(places(grading(true, false)), [0.0, 0.0625, 0.25, 0.5625, 1.0]);
        assert_eq!(places(grading(false, true)), [0.0, 0.4375, 0.75, 0.9375, 1.0]);
        assert_eq!(places(grading(true, true)), [0.0, 0.125, 0.5, 0.875, 1.0]);
        assert_eq!(places(grading(false, false)), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(places(Grading::EVEN), [0.0, 0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn pieces_of_a_ceiling_are_graded_toward_the_walls_alone_and_still_join() {
        let text = include_str!("../../scenes/lit-cube/scene.toml");
        let mut scene = Scene::parse(text, std::path::Path::new("lit-cube")).unwrap();
        let even = Mesh::build(&scene);
        let joins = |mesh: &Mesh| mesh.elements.iter().flat_map(|e| e.neighbours).flatten().count();
        scene.meshing.edge_grading = 2.0;
        let mesh = Mesh::build(&scene);
        assert_eq!((mesh.elements.len(), joins(&mesh)), (even.elements.len(), joins(&even)));
        let of = |name: &str| {
            let at = scene.surfaces.iter().position(|s| s.name == name).unwrap();
            gradings(&scene)[at].ends
        };
        assert_eq!(of("floor"), [[true; 2]; 2]);
        assert_eq!(of("lamp"), [[false; 2]; 2]);
        // Its corner at the origin, s along y, t along x.
        assert_eq!(of("ceiling-1"), [[true, false], [true, false]]);
        assert_eq!(of("ceiling-2"), [[true, false], [false, false]]);
        assert_eq!(of("ceiling-8"), [[false, true], [false, true]]);
    }
}
