//! Patches and grid as the bit image of the board's patch memory.
//!
//! ```text
//! patches -> cells that each touches (exact) -> grid side -> lists -> packed words; records are read back from the words
//! ```
//! Not modelled: loading the image over the bus; neither its bytes nor its cycles are counted.

mod cell_lists;
mod tri_box;

use crate::datapath::PatchWords;
use crate::datapath::cell_step::{Cell, Grid};
use crate::fixed::{Formats, index, word_count};
use crate::memory::{LINE_WORDS, MASKS_PER_LINE};
use crate::packet::{CellHeader, PATCH_LINE_WORDS, pack_patch, unpack_patch};
use crate::spec::{BoardSpec, PatchLayout};

/// What the host loads into the patch memory, and where things lie in it.
///
/// ```text
/// word 0                 header_base             list_base                    patch_base
/// | occupancy bits       | cell headers, 2 words | record numbers, 1 word each | patch records, one line each |
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
    /// The records, unpacked from `words` once, so that a simulated read costs no bit shuffling.
    records: Vec<PatchWords>,
}

impl MemoryImage {
    /// Builds the image: `log2_cells` as given (at most min(F, 7)), or chosen for the fewest expected steps and
    /// tests of a ray, in at most 16 MiB or four times the patches' own size, if not too large for `max_bytes`
    /// (the patch memory; a given grid may be larger, which [`crate::board::Board::new`] then refuses).
    ///
    /// List entries are places in `patches` (with layout `by-id`); hits report `PatchWords::id`, so the host gives patch i the id i.
    pub fn build_within(
        formats: &Formats,
        patches: &[PatchWords],
        log2_cells: Option<u32>,
        max_bytes: u64,
    ) -> MemoryImage {
        Self::build_laid_out(formats, patches, log2_cells, max_bytes, PatchLayout::ById)
    }

    /// The image that a board of `spec` holds of these patches; as [`MemoryImage::build_within`], with its formats, grid,
    /// memory and layout. In shells the memory also holds the tested masks.
    pub fn for_board(spec: &BoardSpec, patches: &[PatchWords]) -> MemoryImage {
        let masks = spec.mask_bytes(word_count(patches.len()));
        let max_bytes = spec.dram.bytes.saturating_sub(masks);
        Self::build_laid_out(&spec.formats, patches, spec.grid_log2, max_bytes, spec.dram.layout)
    }

    /// [`MemoryImage::build_within`], the records in an order. Lists keep the order of `patches`, so that the order of
    /// records changes nothing but where they lie.
    pub fn build_laid_out(
        formats: &Formats,
        patches: &[PatchWords],
        log2_cells: Option<u32>,
        max_bytes: u64,
        layout: PatchLayout,
    ) -> MemoryImage {
        let mut lists = cell_lists::CellLists::build(formats, patches, log2_cells, max_bytes);
        let reordered;
        let patches = match layout {
            PatchLayout::ById => patches,
            PatchLayout::ByCell => {
                let order = lists.renumber_by_cell(patches.len());
                reordered = order.iter().map(|i| patches[index(*i)]).collect::<Vec<_>>();
                &reordered
            }
        };
        let Layout { header_base, list_base, patch_base, n_words } =
            Layout::new(lists.grid.n_cells(), lists.entries.len(), patches.len());
        let line = index(PATCH_LINE_WORDS);
        let mut words = vec![0; n_words];

        let mut first = list_base;
        for (cell, count) in lists.counts.iter().enumerate() {
            if *count > 0 {
                words[cell / 32] |= 1 << (cell % 32);
            }
            let header = CellHeader { first: word_count(first), count: *count };
            words[header_base + 2 * cell..][..2].copy_from_slice(&header.pack());
            first += index(*count);
        }
        words[list_base..][..lists.entries.len()].copy_from_slice(&lists.entries);
        let mut records = Vec::with_capacity(patches.len());
        for (patch, slot) in patches.iter().zip(words[patch_base..].chunks_exact_mut(line)) {
            let record = pack_patch(formats, patch);
            slot[..record.len()].copy_from_slice(&record);
            // A line is longer than any record, so unpacking cannot fail.
            records.extend(unpack_patch(formats, slot));
        }
        MemoryImage {
            formats: *formats,
            grid: lists.grid,
            words,
            header_base: word_count(header_base),
            list_base: word_count(list_base),
            patch_base: word_count(patch_base),
            n_patches: word_count(patches.len()),
            records,
        }
    }

    /// [`MemoryImage::build_within`] any number of bytes.
    pub fn build(formats: &Formats, patches: &[PatchWords], log2_cells: Option<u32>) -> MemoryImage {
        Self::build_within(formats, patches, log2_cells, u64::MAX)
    }

    /// First line of the tested masks, which follow the records (partition in shells).
    pub fn mask_base(&self) -> u32 {
        word_count(self.words.len()).div_ceil(LINE_WORDS)
    }

    /// Lines of the tested masks of all patches for one bundle slot.
    pub fn mask_lines_per_slot(&self) -> u32 {
        self.n_patches.div_ceil(MASKS_PER_LINE).max(1)
    }

    /// Size in bytes, without tested masks.
    pub fn size_bytes(&self) -> usize {
        self.words.len() * 4
    }

    /// True when the cell's list is not empty (the CTU's occupancy bit).
    #[inline]
    pub fn is_occupied(&self, cell: Cell) -> bool {
        let bit = self.grid.index(cell);
        self.words[bit / 32] >> (bit % 32) & 1 != 0
    }

    /// The cell's list: word address of its first entry, number of entries (read from the cell's header).
    #[inline]
    pub fn cell_list(&self, cell: Cell) -> (u32, u32) {
        let at = index(self.header_address(cell));
        let header = CellHeader::unpack([self.words[at], self.words[at + 1]]);
        (header.first, header.count)
    }

    /// Word address of a cell's header.
    #[inline]
    pub fn header_address(&self, cell: Cell) -> u32 {
        self.header_base + 2 * word_count(self.grid.index(cell))
    }

    /// The record number at a list address.
    #[inline]
    pub fn list_entry(&self, address: u32) -> u32 {
        self.words[index(address)]
    }

    /// Word address of a patch record.
    #[inline]
    pub fn patch_address(&self, patch: u32) -> u32 {
        self.patch_base + PATCH_LINE_WORDS * patch
    }

    /// A patch, as unpacked from its record.
    #[inline]
    pub fn patch(&self, patch: u32) -> PatchWords {
        *self.patch_ref(patch)
    }

    /// A patch by reference, for the tick path.
    #[inline]
    pub fn patch_ref(&self, patch: u32) -> &PatchWords {
        &self.records[index(patch)]
    }
}

/// Where things lie, in words.
struct Layout {
    header_base: usize,
    list_base: usize,
    patch_base: usize,
    n_words: usize,
}

impl Layout {
    fn new(n_cells: usize, n_entries: usize, n_patches: usize) -> Layout {
        let line = index(LINE_WORDS);
        let header_base = n_cells.div_ceil(32).next_multiple_of(line);
        let list_base = (header_base + 2 * n_cells).next_multiple_of(line);
        let patch_base = (list_base + n_entries).next_multiple_of(line);
        Layout {
            header_base,
            list_base,
            patch_base,
            n_words: patch_base + index(PATCH_LINE_WORDS) * n_patches,
        }
    }
}

#[cfg(test)]
#[path = "memory_image/tests.rs"]
mod tests;
