//! The board without time: the datapath in a loop. The cycle model must retire exactly these answers and counts.

use crate::datapath::{HitWords, RayWords};
use crate::memory_image::MemoryImage;

/// Mailbox entries of a ray context: a patch met again among the last this-many tested ones is not tested again.
pub const MAILBOX_ENTRIES: usize = 8;

/// The canonical counters: functions of scene, formats, grid and rays alone, equal for every timing choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct CanonicalCounters {
    /// Bundles traced; an explicit ray is none.
    pub bundles: u64,
    /// Rays traced.
    pub rays: u64,
    /// Cells entered.
    pub cells: u64,
    /// Cell-list entries read.
    pub list_entries: u64,
    /// Ray x patch tests.
    pub tests: u64,
    /// Rays that hit.
    pub hits: u64,
}

/// What one ray did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayTrace {
    /// The nearest hit; for any-hit rays whatever made it stop, of which only `is_some` leaves the board.
    pub hit: Option<HitWords>,
    /// Cells entered.
    pub cells: u32,
    /// List entries read.
    pub list_entries: u32,
    /// Tests made.
    pub tests: u32,
}

/// Traces one ray. `any_hit`: it also ends after the first cell in which anything was hit.
pub fn trace(image: &MemoryImage, ray: &RayWords, any_hit: bool) -> RayTrace {
    let _ = (image, ray, any_hit);
    todo!()
}
