//! The board without time: the datapath in a loop. The cycle model must retire exactly these answers and counts.
//!
//! ```text
//! command.rs: a command's rays and bundles, the low-resolution cast first  --> answers, canonical counters
//!   grid, a ray by itself: here                shells, a bundle: shells.rs
//!
//! origin's cell -> list entries in order -> (not in mailbox) test -> nearest hit -> cell done: ends, or next cell
//! ```
//! Canonical order of events in grid partition: a cell is entered; every entry of its list is read; an entry that the
//! mailbox does not hold is tested and entered there; when all are done, an any-hit ray with a hit ends, and so does
//! a ray whose best t (t_max while it has none) is strictly less than the far plane's t; the rest step on.

use crate::datapath::cell_step::advance;
use crate::datapath::mailbox::Mailbox;
use crate::datapath::ray_patch::intersect;
use crate::datapath::{HitWords, PatchWords, RayWords};
use crate::memory_image::MemoryImage;

mod command;
mod shells;

pub use crate::datapath::mailbox::MAILBOX_ENTRIES;
pub use command::{CENTRE_RAYS_TOGETHER, centre_rays, n_centre_rays, trace_command};
pub use shells::{BundleTrace, ShellTracer};

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
    /// The low-resolution cast that finds the static partition; none of it is in the counts above.
    pub low_resolution: LowResolutionWork,
}

/// What the rays of low-resolution casts did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct LowResolutionWork {
    /// Rays cast.
    pub rays: u64,
    /// Cells entered.
    pub cells: u64,
    /// Cell-list entries read.
    pub list_entries: u64,
    /// Ray x patch tests.
    pub tests: u64,
}

impl CanonicalCounters {
    /// Each counter with its counterpart.
    pub fn combine(&self, other: &CanonicalCounters, f: impl Fn(u64, u64) -> u64) -> CanonicalCounters {
        let (a, b) = (&self.low_resolution, &other.low_resolution);
        CanonicalCounters {
            bundles: f(self.bundles, other.bundles),
            rays: f(self.rays, other.rays),
            cells: f(self.cells, other.cells),
            list_entries: f(self.list_entries, other.list_entries),
            tests: f(self.tests, other.tests),
            hits: f(self.hits, other.hits),
            low_resolution: LowResolutionWork {
                rays: f(a.rays, b.rays),
                cells: f(a.cells, b.cells),
                list_entries: f(a.list_entries, b.list_entries),
                tests: f(a.tests, b.tests),
            },
        }
    }

    /// The same work as that of a low-resolution cast.
    pub fn as_low_resolution(&self) -> CanonicalCounters {
        let CanonicalCounters { rays, cells, list_entries, tests, .. } = *self;
        let low_resolution = LowResolutionWork { rays, cells, list_entries, tests };
        CanonicalCounters { low_resolution, ..CanonicalCounters::default() }
    }

    /// Adds one traced ray.
    pub fn count(&mut self, trace: &RayTrace) {
        self.rays += 1;
        self.cells += u64::from(trace.cells);
        self.list_entries += u64::from(trace.list_entries);
        self.tests += u64::from(trace.tests);
        self.hits += u64::from(trace.hit.is_some());
    }
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
    trace_observed(image, ray, any_hit, |_, _| ())
}

/// As [`trace`]; `tested` sees every test in order, with its patch and result.
pub fn trace_observed(
    image: &MemoryImage,
    ray: &RayWords,
    any_hit: bool,
    mut tested: impl FnMut(&PatchWords, Option<HitWords>),
) -> RayTrace {
    let mut done = RayTrace::default();
    let mut mailbox = Mailbox::default();
    let mut here = Some(image.grid.cell_of(&image.formats, ray.origin));
    while let Some(cell) = here {
        done.cells += 1;
        if image.is_occupied(cell) {
            let (first, count) = image.cell_list(cell);
            for address in first..first + count {
                let patch = image.list_entry(address);
                done.list_entries += 1;
                if mailbox.contains(patch) {
                    continue;
                }
                mailbox.push(patch);
                done.tests += 1;
                let record = image.patch_ref(patch);
                let hit = intersect(&image.formats, ray, record);
                tested(record, hit);
                done.hit = HitWords::nearer(done.hit, hit);
            }
        }
        if any_hit && done.hit.is_some() {
            break;
        }
        let limit_t = done.hit.map_or(ray.t_max, |hit| hit.t);
        here = advance(&image.formats, &image.grid, ray, cell, limit_t);
    }
    done
}

#[cfg(test)]
mod tests;
