//! Shells of cells around an apex, and the table that gathers the rays of a bundle cell by cell.
//!
//! ```text
//! shell s = cells at Chebyshev distance r_s <= max |c - apex| < r_{s+1} from the apex's cell
//! r_0 = 0, r_1 = 1, then `cells` more a shell, or 1, 2, 4... times `cells` with growth
//!
//! (cell, ray) --BundleTable::insert--> a bit in the cell's mask | a new entry | no room
//! ```
//! Along a ray from the apex no component of |c - apex| falls, so it meets the shells one after another. Explicit rays
//! have an apex each: their origin's cell.
//! Source: the shell-like partition of the 1990 board paper; thickness, growth and table ours.

use super::cell_step::Cell;
use crate::spec::{ShellGrowth, ShellSpec};

/// Chebyshev distance of a cell from the apex's cell, in cells.
#[inline]
pub fn distance(cell: Cell, apex: Cell) -> u32 {
    let [x, y, z] = [0, 1, 2].map(|k| cell.0[k].abs_diff(apex.0[k]));
    u32::from(x.max(y).max(z))
}

/// The distance at which the shell after the one that begins at `inner` begins; at most 256, beyond every grid.
#[inline]
pub fn next_radius(spec: &ShellSpec, shell: u32) -> u32 {
    match shell {
        0 => 1,
        _ => {
            let growth = match spec.growth {
                ShellGrowth::Fixed => shell,
                // 1 + 2 + 4 + ... of `shell` terms.
                ShellGrowth::Double => (1_u32 << shell.min(9)) - 1,
            };
            (1 + spec.cells * growth).min(256)
        }
    }
}

/// What became of a (cell, ray).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inserted {
    /// The cell has an entry: the ray's bit is set in it.
    Joined,
    /// A new entry was made.
    New,
    /// The cell has no entry and the table no room: what is in it has to be processed first.
    Full,
}

/// One cell and the rays that are in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BundleEntry {
    /// The cell.
    pub cell: Cell,
    /// A bit per ray of the bundle.
    pub mask: u64,
}

/// The bundle tracker's associative table, entries in the order of their making.
#[derive(Clone, Debug)]
pub struct BundleTable {
    keys: Vec<u32>,
    masks: Vec<u64>,
    capacity: usize,
}

#[inline]
fn key(cell: Cell) -> u32 {
    let [x, y, z] = cell.0.map(u32::from);
    x | y << 8 | z << 16
}

impl BundleTable {
    /// An empty table of `capacity >= 1` entries.
    pub fn new(capacity: u32) -> Self {
        let capacity = crate::fixed::index(capacity);
        BundleTable { keys: Vec::with_capacity(capacity), masks: Vec::with_capacity(capacity), capacity }
    }

    /// Marks that `ray` (under 64) is in `cell`.
    #[inline]
    pub fn insert(&mut self, cell: Cell, ray: u8) -> Inserted {
        let (key, bit) = (key(cell), 1_u64 << (ray & 63));
        // The latest entries first: neighbouring rays are in the same cells.
        if let Some(at) = self.keys.iter().rposition(|k| *k == key) {
            self.masks[at] |= bit;
            return Inserted::Joined;
        }
        if self.keys.len() == self.capacity {
            return Inserted::Full;
        }
        self.keys.push(key);
        self.masks.push(bit);
        Inserted::New
    }

    /// Entry `i`.
    #[inline]
    pub fn entry(&self, i: usize) -> BundleEntry {
        let [x, y, z, _] = self.keys[i].to_le_bytes();
        BundleEntry { cell: Cell([x, y, z]), mask: self.masks[i] }
    }

    /// Number of entries.
    #[inline]
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// True without entries.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Empties it.
    #[inline]
    pub fn clear(&mut self) {
        self.keys.clear();
        self.masks.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_radius_fixed_and_doubling_are_those_of_the_definition() {
        let radii = |growth| {
            let spec = ShellSpec { cells: 2, growth, ..ShellSpec::default() };
            (0..7).map(|shell| next_radius(&spec, shell)).collect::<Vec<_>>()
        };
        assert_eq!(radii(ShellGrowth::Fixed), [1, 3, 5, 7, 9, 11, 13]);
        assert_eq!(radii(ShellGrowth::Double), [1, 3, 7, 15, 31, 63, 127]);
        let last = |growth, cells| next_radius(&ShellSpec { cells, growth, ..ShellSpec::default() }, 200);
        assert_eq!([last(ShellGrowth::Fixed, 64), last(ShellGrowth::Double, 1)], [256, 256]);
    }

    #[test]
    fn bundle_table_joins_rays_of_a_cell_and_is_full_for_other_cells_only() {
        let mut table = BundleTable::new(2);
        let [a, b, c] = [[1, 2, 3], [3, 2, 1], [1, 2, 4]].map(Cell);
        assert_eq!(table.insert(a, 0), Inserted::New);
        assert_eq!(table.insert(b, 63), Inserted::New);
        assert_eq!(table.insert(c, 1), Inserted::Full);
        assert_eq!(table.insert(a, 5), Inserted::Joined);
        assert_eq!((table.len(), table.entry(0)), (2, BundleEntry { cell: a, mask: 0b10_0001 }));
        assert_eq!(table.entry(1), BundleEntry { cell: b, mask: 1 << 63 });
        table.clear();
        assert!(table.is_empty());
        assert_eq!(table.insert(c, 1), Inserted::New);
    }

    #[test]
    fn distance_is_the_largest_of_the_components() {
        assert_eq!(distance(Cell([5, 0, 9]), Cell([7, 8, 9])), 8);
        assert_eq!(distance(Cell([5, 0, 9]), Cell([5, 0, 9])), 0);
    }
}
