//! Which patches touch which closed cells, and how fine the grid is.
//!
//! ```text
//! patches -> descent through the octree of cells, all grids at once -> entries of every g -> g
//!         -> descent to that g -> (cell, patch) -> counting sort -> lists, ascending inside a cell
//! ```
//! A patch touches a cell of side h only if it touches the cell of side 2h around it, so eight children of each
//! touched cell are all that need a test. A quad is its two triangles.

use crate::datapath::PatchWords;
use crate::datapath::cell_step::{Cell, Grid};
use crate::fixed::{Formats, index, word_count};
use crate::packet::PATCH_LINE_WORDS;

use super::Layout;
use super::tri_box::TriangleAxes;

/// What a cell step costs, in tests: 4 CTUs that step once a cycle feed one ICU that tests once a cycle.
const STEP_COST: f64 = 0.25;

/// An automatic grid never asks for more memory than this, unless four times the patches' own size is more.
const AUTO_LIMIT_BYTES: usize = 16 << 20;

/// Words that 32-bit addresses reach.
const ADDRESSABLE_WORDS: usize = 1 << 31;

/// Finest grid of all: 2^7 cells a side.
const MAX_LOG2_CELLS: u32 = 7;

/// The cell lists of the chosen grid.
#[derive(Clone, Debug)]
pub(super) struct CellLists {
    /// The grid.
    pub(super) grid: Grid,
    /// Entries of each cell.
    pub(super) counts: Vec<u32>,
    /// The lists one after another in cell order.
    pub(super) entries: Vec<u32>,
}

impl CellLists {
    /// Lists for a given grid, or for the best one whose image takes at most `max_bytes`.
    pub(super) fn build(
        formats: &Formats,
        patches: &[PatchWords],
        log2_cells: Option<u32>,
        max_bytes: u64,
    ) -> CellLists {
        let log2_cells = match log2_cells {
            Some(g) => g.min(MAX_LOG2_CELLS).min(formats.coord_frac_bits),
            None => auto_grid(formats, patches, max_bytes),
        };
        let grid = Grid { log2_cells };
        let mut pairs = Vec::new();
        let mut counts = vec![0_u32; grid.n_cells()];
        for (patch, number) in patches.iter().zip(0..) {
            descend(formats, patch, log2_cells, &mut |level, cell| {
                if level == log2_cells {
                    let cell = cell_index(level, cell);
                    counts[cell] += 1;
                    pairs.push((word_count(cell), number));
                }
            });
        }
        let mut next = Vec::with_capacity(counts.len());
        let mut total = 0;
        for count in &counts {
            next.push(total);
            total += index(*count);
        }
        let mut entries = vec![0; total];
        for (cell, number) in pairs {
            let slot = &mut next[index(cell)];
            entries[*slot] = number;
            *slot += 1;
        }
        CellLists { grid, counts, entries }
    }
}

impl CellLists {
    /// Numbers the patches by the first cell in Morton order that lists them, and those that none lists after them;
    /// the old number of each new one.
    pub(super) fn renumber_by_cell(&mut self, n_patches: usize) -> Vec<u32> {
        const NONE: u32 = u32::MAX;
        let mut new = vec![NONE; n_patches];
        let mut old = Vec::with_capacity(n_patches);
        for number in self.entries.iter().copied().chain(0..word_count(n_patches)) {
            if new[index(number)] == NONE {
                new[index(number)] = word_count(old.len());
                old.push(number);
            }
        }
        for entry in &mut self.entries {
            *entry = new[index(*entry)];
        }
        old
    }
}

/// Index of a cell of grid g; its places are under 2^7.
fn cell_index(g: u32, cell: [u32; 3]) -> usize {
    Grid { log2_cells: g }.index(Cell(cell.map(|place| u8::try_from(place).unwrap_or(u8::MAX))))
}

/// The g in 1..=7 with the least expected work of a ray, among those that fit the limit; the coarser of two equals.
///
/// A ray crosses about 2^g cells; in each it costs a step, and a test per entry of the mean list (over all cells, empty
/// ones too): 2^g ([`STEP_COST`] + entries / cells).
fn auto_grid(formats: &Formats, patches: &[PatchWords], max_bytes: u64) -> u32 {
    let finest = MAX_LOG2_CELLS.min(formats.coord_frac_bits);
    let patch_words = patches.len() * index(PATCH_LINE_WORDS);
    let max_words = usize::try_from(max_bytes / 4).unwrap_or(usize::MAX);
    let limit = (AUTO_LIMIT_BYTES / 4).max(4 * patch_words).min(ADDRESSABLE_WORDS).min(max_words);
    let words =
        |g: u32, n_entries| Layout::new(Grid { log2_cells: g }.n_cells(), n_entries, patches.len()).n_words;
    let deepest = (1..=finest).rev().find(|g| words(*g, 0) <= limit).unwrap_or(1);
    let mut entries = vec![0_usize; index(deepest) + 1];
    for patch in patches {
        descend(formats, patch, deepest, &mut |level, _| entries[index(level)] += 1);
    }
    let work = |g: u32| {
        let (total, cells) = (entries[index(g)] as f64, Grid { log2_cells: g }.n_cells() as f64);
        f64::from(1 << g) * (STEP_COST + total / cells)
    };
    (1..=deepest)
        .filter(|g| *g == 1 || words(*g, entries[index(*g)]) <= limit)
        .min_by(|a, b| work(*a).total_cmp(&work(*b)))
        .unwrap_or(1)
}

/// Calls `visit(level, cell)` for every cell of every level 0..=`deepest` that the patch touches.
fn descend(formats: &Formats, patch: &PatchWords, deepest: u32, visit: &mut impl FnMut(u32, [u32; 3])) {
    let [v0, v1, v2, v3] = patch.corners;
    let first = TriangleAxes::new([v0, v1, v2]);
    let second = (!patch.is_triangle).then(|| TriangleAxes::new([v0, v2, v3]));
    let triangles = [Some(&first), second.as_ref()];
    let cube = 1_i64 << formats.coord_frac_bits;
    Descent { cube, deepest, visit }.enter(0, [0; 3], triangles);
}

/// The descent of one patch.
struct Descent<'a, V> {
    /// 2^F.
    cube: i64,
    deepest: u32,
    visit: &'a mut V,
}

impl<V: FnMut(u32, [u32; 3])> Descent<'_, V> {
    /// Enters a cell if one of the triangles, which touch the cell around it, touches this one too.
    fn enter(&mut self, level: u32, cell: [u32; 3], triangles: [Option<&TriangleAxes>; 2]) {
        let side = (2 * self.cube) >> level;
        let corner = cell.map(|place| i64::from(place) * side - self.cube);
        let here = triangles.map(|triangle| triangle.filter(|t| t.touches(corner, side)));
        if here.iter().all(Option::is_none) {
            return;
        }
        (self.visit)(level, cell);
        if level == self.deepest {
            return;
        }
        for child in 0..8_u32 {
            let inner =
                [2 * cell[0] + (child & 1), 2 * cell[1] + (child >> 1 & 1), 2 * cell[2] + (child >> 2)];
            self.enter(level + 1, inner, here);
        }
    }
}
