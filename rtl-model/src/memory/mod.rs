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

pub use cluster_buffer::{ClusterBuffer, ClusterBufferIo};
pub use dram::{Dram, DramIo, DramPort};
pub use line_cache::{LineCache, Lookup, MissRegisters, ReadPort};

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

/// Traffic of one memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Look-ups or line transfers.
    pub accesses: u64,
    /// Look-ups that missed (DRAM: row misses).
    pub misses: u64,
    /// Lines asked of the next level (DRAM: read); misses that merge with an open one ask for none.
    pub lines: u64,
}

impl Traffic {
    /// Adds another memory's traffic.
    pub fn add(&mut self, other: Traffic) {
        self.accesses += other.accesses;
        self.misses += other.misses;
        self.lines += other.lines;
    }
}
