//! The hierarchical patch memory, from the ICU outward.
//!
//! ```text
//! patch loader: patch cache, list cache --Line--> cluster buffer --Line--> DRAM
//!                               <--Line (a wire per cache)--  <--Line--
//! ```
//! A line is 64 bytes (16 words). Caches hold tags only: the bits themselves are those of the memory image, which
//! never changes while a command runs.

mod cluster_buffer;
mod dram;
mod line_cache;
mod mask_cache;

pub use cluster_buffer::{ClusterBuffer, ClusterBufferIo};
pub use dram::{Dram, DramIo, DramPort};
pub use line_cache::{LineCache, Lookup, MissRegisters, ReadPort};
pub use mask_cache::{MASKS_PER_LINE, MaskCache, MaskLookup, MaskStore};

use crate::sim::Token;

/// Words of a line.
pub const LINE_WORDS: u32 = 16;
/// Bytes of a line.
pub const LINE_BYTES: u32 = 4 * LINE_WORDS;

/// The number of a 64-byte line of the patch memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Line(pub u32);

impl Line {
    /// The line that holds a word.
    #[inline]
    pub fn of_word(address: u32) -> Line {
        Line(address / LINE_WORDS)
    }
}

/// What a cache asks of the next level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryRequest {
    /// The line.
    pub line: Line,
    /// It is written back (and nothing is answered) instead of read.
    pub write: bool,
}

impl MemoryRequest {
    /// Asks for a line.
    pub fn read(line: Line) -> MemoryRequest {
        MemoryRequest { line, write: false }
    }
}

impl Token for Line {
    fn payload(&self) -> u32 {
        self.0
    }
}

impl Token for MemoryRequest {
    fn payload(&self) -> u32 {
        self.line.0 << 1 | u32::from(self.write)
    }
}

/// Traffic of one memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Look-ups or line transfers.
    pub accesses: u64,
    /// Look-ups that missed (DRAM: row misses).
    pub misses: u64,
    /// Lines asked of the next level (DRAM: read); misses that merge with an open one ask for none.
    pub lines: u64,
    /// Lines written to the next level (DRAM: written).
    pub written: u64,
    /// Cycles in which the memory was occupied (DRAM only).
    pub busy_cycles: u64,
}

impl Traffic {
    /// Adds another memory's traffic.
    pub fn add(&mut self, other: Traffic) {
        self.accesses += other.accesses;
        self.misses += other.misses;
        self.lines += other.lines;
        self.written += other.written;
        self.busy_cycles += other.busy_cycles;
    }
}
