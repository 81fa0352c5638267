//! A closed room, fronts inward, with lamps flush in holes of its ceiling.
//!
//! ```text
//! size, lamp spans along x and y --> floor, four walls, ceiling cut along every lamp's edges, lamps in the holes
//!
//!   y   +---+--+---+--+---+
//!   |   |   |  |   |  |   |      two spans along x, one along y:
//!   |   +---+--+---+--+---+      two lamps (#), thirteen pieces of ceiling
//!   |   |   |##|   |##|   |
//!   |   +---+--+---+--+---+
//!   |   |   |  |   |  |   |
//!   |   +---+--+---+--+---+
//!   '-------------------- x      seen from above
//! ```
//! The whole ceiling is cut, not only around the lamps, so that its pieces meet edge to edge.

use glam::IVec3;

use super::text::{Light, Quad};

/// A room from (0, 0, 0) to `size` (um).
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Room {
    /// Far corner (um).
    pub(super) size: IVec3,
    /// From where to where lamps lie along x (um), ascending, apart from each other and from the walls.
    pub(super) lamps_x: Vec<[i32; 2]>,
    /// Likewise along y: one lamp at every crossing.
    pub(super) lamps_y: Vec<[i32; 2]>,
}

impl Room {
    /// A room with `n` lamps of a size (um) along each axis, in the middles of equal parts.
    pub(super) fn with_lamps(size: IVec3, n: [i32; 2], lamp_size: [i32; 2]) -> Room {
        let spans = |length: i32, n: i32, lamp: i32| {
            let spans = (0..n).map(|k| {
                let low = length / (2 * n) * (2 * k + 1) - lamp / 2;
                [low, low + lamp]
            });
            spans.collect()
        };
        Room { size, lamps_x: spans(size.x, n[0], lamp_size[0]), lamps_y: spans(size.y, n[1], lamp_size[1]) }
    }

    /// Materials of the room's surfaces, each lamp with so many lumens.
    pub(super) fn materials(floor: [f64; 3], lamp_lumens: u32) -> Vec<(&'static str, Light)> {
        vec![
            ("wall", Light::Reflects([0.7, 0.68, 0.63])),
            ("ceiling", Light::Reflects([0.8; 3])),
            ("floor", Light::Reflects(floor)),
            ("lamp", Light::ShinesLumens(lamp_lumens)),
        ]
    }

    /// Its surfaces.
    pub(super) fn quads(&self) -> Vec<Quad> {
        let mut quads = self.floor_and_walls();
        let cuts = |spans: &[[i32; 2]], end: i32| -> Vec<i32> {
            [0].into_iter().chain(spans.iter().copied().flatten()).chain([end]).collect()
        };
        let (x, y) = (cuts(&self.lamps_x, self.size.x), cuts(&self.lamps_y, self.size.y));
        let (mut n_pieces, mut n_lamps) = (0, 0);
        for (j, y) in y.windows(2).enumerate() {
            for (i, x) in x.windows(2).enumerate() {
                let p = |x: i32, y: i32| IVec3::new(x, y, self.size.z);
                let corners = [p(x[0], y[0]), p(x[0], y[1]), p(x[1], y[1]), p(x[1], y[0])];
                if i % 2 == 1 && j % 2 == 1 {
                    n_lamps += 1;
                    quads.push(Quad::new(format!("lamp-{n_lamps}"), "lamp", corners));
                } else {
                    n_pieces += 1;
                    let piece = Quad::new(format!("ceiling-{n_pieces}"), "ceiling", corners);
                    quads.push(Quad { smooth_group: 1, ..piece });
                }
            }
        }
        quads
    }

    /// All but the ceiling.
    pub(super) fn floor_and_walls(&self) -> Vec<Quad> {
        let IVec3 { x, y, z } = self.size;
        let p = IVec3::new;
        let quad = |name: &str, material, corners| Quad::new(name.to_owned(), material, corners);
        vec![
            quad("floor", "floor", [p(0, 0, 0), p(x, 0, 0), p(x, y, 0), p(0, y, 0)]),
            quad("wall-west", "wall", [p(0, 0, 0), p(0, y, 0), p(0, y, z), p(0, 0, z)]),
            quad("wall-east", "wall", [p(x, 0, 0), p(x, 0, z), p(x, y, z), p(x, y, 0)]),
            quad("wall-south", "wall", [p(0, 0, 0), p(0, 0, z), p(x, 0, z), p(x, 0, 0)]),
            quad("wall-north", "wall", [p(0, y, 0), p(x, y, 0), p(x, y, z), p(0, y, z)]),
        ]
    }
}
