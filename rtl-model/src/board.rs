//! The board: owns blocks and FIFOs, wires them, ticks, commits. Start reading here.

use serde::Serialize;

use crate::datapath::bundle::{BundleError, BundleWords};
use crate::datapath::{HitWords, RayWords};
use crate::functional::CanonicalCounters;
use crate::memory_image::MemoryImage;
use crate::sim::BlockAccount;
use crate::spec::{BoardSpec, SpecError};

/// What the host asks of the board.
#[derive(Clone, Copy, Debug)]
pub enum Work<'a> {
    /// Explicit rays.
    Rays(&'a [RayWords]),
    /// Bundle descriptors.
    Bundles(&'a [BundleWords]),
}

/// Why the board gave no answer.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// The specification is unusable.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The scene does not fit the patch memory.
    #[error("the scene needs {needed_bytes} bytes of patch memory, the board has {available_bytes}")]
    PatchMemory {
        /// Bytes of the image.
        needed_bytes: usize,
        /// Bytes of the memory.
        available_bytes: usize,
    },
    /// The image was made for other number formats.
    #[error("the memory image and the board differ in number formats")]
    Formats,
    /// A descriptor is unusable.
    #[error("bundle {index}: {source}")]
    Bundle {
        /// Which bundle.
        index: usize,
        /// Why.
        source: BundleError,
    },
    /// No progress for too many cycles.
    #[error("no progress for {cycles} cycles: {stalls}")]
    Watchdog {
        /// How long.
        cycles: u64,
        /// Each block's last stall.
        stalls: String,
    },
}

/// Everything counted since the board was made, or between two moments.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BoardStatistics {
    /// Board clock cycles.
    pub cycles: u64,
    /// Work that no timing choice changes.
    pub canonical: CanonicalCounters,
    /// Bytes from host to board.
    pub bus_down_bytes: u64,
    /// Bytes from board to host.
    pub bus_up_bytes: u64,
    /// Cache and memory levels, from the ICU outward.
    pub memory: Vec<LevelStatistics>,
    /// The closed account of every block: causes sum to `cycles`.
    pub blocks: Vec<BlockAccount>,
}

/// Traffic of one memory level, summed over its instances.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LevelStatistics {
    /// Which level.
    pub level: String,
    /// Look-ups (cache) or line transfers (DRAM).
    pub accesses: u64,
    /// Look-ups that missed.
    pub misses: u64,
    /// Bytes delivered.
    pub bytes: u64,
}

impl BoardStatistics {
    /// What was counted since `earlier`, a previous state of the same board.
    pub fn since(&self, earlier: &BoardStatistics) -> BoardStatistics {
        let _ = earlier;
        todo!()
    }

    /// The sum of two counts of the same board.
    pub fn plus(&self, other: &BoardStatistics) -> BoardStatistics {
        let _ = other;
        todo!()
    }
}

/// The emulated board with a scene loaded.
#[derive(Debug)]
pub struct Board {}

impl Board {
    /// A board of this specification with the scene in its patch memory.
    ///
    /// # Errors
    /// An unusable specification, an image too large or of other formats.
    pub fn new(spec: &BoardSpec, image: MemoryImage) -> Result<Board, BoardError> {
        let _ = (spec, image);
        todo!()
    }

    /// Nearest hits, in ray order. The board starts and ends empty; its caches keep their lines.
    ///
    /// # Errors
    /// An unusable descriptor, or a watchdog.
    pub fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        let _ = work;
        todo!()
    }

    /// Hit bits, in ray order.
    ///
    /// # Errors
    /// As [`Board::trace_nearest`].
    pub fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        let _ = work;
        todo!()
    }

    /// Everything counted so far.
    pub fn statistics(&self) -> BoardStatistics {
        todo!()
    }

    /// The specification.
    pub fn spec(&self) -> &BoardSpec {
        todo!()
    }
}
