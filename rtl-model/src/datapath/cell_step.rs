//! Exact stepping of a ray through the uniform grid: the CTU's function.

use super::RayWords;
use crate::fixed::Formats;

/// A grid of 2^g cells along each axis over the cube [-1, 1)^3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// g, at most min(F, 7).
    pub log2_cells: u32,
}

/// A cell of the grid: indices along x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell(pub [u8; 3]);

/// How a ray leaves a cell: across the plane at integer distance `num` along an axis with direction word `den`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// |boundary - origin| along the axis, coordinate words.
    pub num: u64,
    /// |direction| along the axis, direction words, > 0.
    pub den: u64,
    /// The cell behind the plane; `None` when it is outside the grid.
    pub next: Option<Cell>,
}

impl Grid {
    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        1 << (3 * self.log2_cells)
    }

    /// Index of a cell: x fastest.
    pub fn index(&self, cell: Cell) -> usize {
        let g = self.log2_cells;
        usize::from(cell.0[0]) | usize::from(cell.0[1]) << g | usize::from(cell.0[2]) << (2 * g)
    }

    /// The half-open cell that holds a coordinate.
    pub fn cell_of(&self, formats: &Formats, point: [i32; 3]) -> Cell {
        let _ = (formats, point);
        todo!()
    }

    /// Where the ray leaves `cell`, a cell that it has entered.
    pub fn crossing(&self, formats: &Formats, ray: &RayWords, cell: Cell) -> Crossing {
        let _ = (formats, ray, cell);
        todo!()
    }
}

/// The termination rule: true when `best_t` is strictly less than the crossing's t rounded as a hit's t is.
pub fn ends_before(formats: &Formats, best_t: u64, crossing: &Crossing) -> bool {
    let _ = (formats, best_t, crossing);
    todo!()
}
