//! Patches and grid as the bit image of the board's patch memory.

use crate::datapath::PatchWords;
use crate::datapath::cell_step::{Cell, Grid};
use crate::fixed::Formats;

/// What the host loads into the patch memory, and where things lie in it.
///
/// ```text
/// word 0                 header_base             list_base                    patch_base
/// | occupancy bits       | cell headers, 2 words | patch ids, 1 word each     | patch records, one line each |
/// ```
/// Addresses count 32-bit words; cell headers, lists and records start on 64-byte lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryImage {
    /// Number formats of the words.
    pub formats: Formats,
    /// The grid.
    pub grid: Grid,
    /// The image.
    pub words: Vec<u32>,
    /// First word of the cell headers.
    pub header_base: u32,
    /// First word of the cell lists.
    pub list_base: u32,
    /// First word of the patch records.
    pub patch_base: u32,
    /// Number of patches.
    pub n_patches: u32,
}

impl MemoryImage {
    /// Builds the image: `log2_cells` as given, or chosen for about two patches in an occupied cell.
    pub fn build(formats: &Formats, patches: &[PatchWords], log2_cells: Option<u32>) -> MemoryImage {
        let _ = (formats, patches, log2_cells);
        todo!()
    }

    /// Size in bytes.
    pub fn size_bytes(&self) -> usize {
        self.words.len() * 4
    }

    /// True when the cell's list is not empty (the CTU's occupancy bit).
    pub fn is_occupied(&self, cell: Cell) -> bool {
        let _ = cell;
        todo!()
    }

    /// The cell's list: word address of its first entry, number of entries (read from the cell's header).
    pub fn cell_list(&self, cell: Cell) -> (u32, u32) {
        let _ = cell;
        todo!()
    }

    /// Word address of a cell's header.
    pub fn header_address(&self, cell: Cell) -> u32 {
        let _ = cell;
        todo!()
    }

    /// The patch id at a list address.
    pub fn list_entry(&self, address: u32) -> u32 {
        self.words[address as usize]
    }

    /// Word address of a patch record.
    pub fn patch_address(&self, patch: u32) -> u32 {
        let _ = patch;
        todo!()
    }

    /// Unpacks a patch record.
    pub fn patch(&self, patch: u32) -> PatchWords {
        let _ = patch;
        todo!()
    }
}
