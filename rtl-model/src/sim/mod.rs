//! Clock, FIFO, pipe, statistics. Nothing here knows what a ray is.

use serde::Serialize;

/// Why a block did what it did in a cycle: exactly one cause per block and cycle, the first that applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Did useful work.
    Work,
    /// Has a token and nowhere to put it.
    OutputFull,
    /// Waits for a unit of its own (context, table entry, pipeline slot).
    Resource,
    /// Waits for a line that a cache asked for.
    CacheMiss,
    /// Waits for the memory itself.
    Memory,
    /// Waits for the host bus.
    Bus,
    /// Has work in progress elsewhere and nothing to do until it comes back.
    Starved,
    /// Nothing assigned.
    Idle,
    /// Before its first token of the run.
    Fill,
    /// After its last token of the run.
    Drain,
}

impl Cause {
    /// Every cause, in order of precedence.
    pub const ALL: [Cause; 10] = [
        Cause::Work,
        Cause::OutputFull,
        Cause::Resource,
        Cause::CacheMiss,
        Cause::Memory,
        Cause::Bus,
        Cause::Starved,
        Cause::Idle,
        Cause::Fill,
        Cause::Drain,
    ];
}

/// The closed account of one block.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct BlockAccount {
    /// Hierarchical name: `cluster0.module0.icu`.
    pub block: String,
    /// Cycles by cause, in the order of [`Cause::ALL`].
    pub cycles: [u64; 10],
}
