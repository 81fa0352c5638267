//! What all blocks of a board are designed with: the board, the technology, the widths of words and tags.
//!
//! ```text
//! BoardSpec, Technology, width table --> Design --> blocks (icu, ctu, front, memory, links, shared) --> Block
//! ```

use crate::memory::LINE_BYTES;
use crate::packet::{MAX_BUNDLE_RAYS, PATCH_ID_BITS};
use crate::spec::BoardSpec;

use super::hardware::{Hardware, index_bits};
use super::technology::{Technology, Timing};

/// log2 of the grid's cells an axis for which a board without `grid_log2` has room on its chips: ASSUMED, 32 x 32 x 32
/// cells.
const GRID_LOG2_IF_AUTOMATIC: u32 = 5;
/// NAND2 equivalents of a block's sequencer: ASSUMED.
pub(super) const CONTROL_GATES: f64 = 200.0;
/// Registers of a block's sequencer: ASSUMED.
pub(super) const CONTROL_BITS: u64 = 16;

/// Rays of a bundle.
pub(super) const BUNDLE_RAYS: u64 = MAX_BUNDLE_RAYS as u64;
/// Bits of a line of patch memory.
pub(super) const LINE_BITS: u64 = LINE_BYTES as u64 * 8;
/// Bits of a patch number.
pub(super) const PATCH_BITS: u64 = PATCH_ID_BITS as u64;
/// Bits of a counter of tests or list entries: ASSUMED.
pub(super) const COUNT_BITS: u64 = 16;

/// The board, the technology, and widths in bits.
#[derive(Clone, Debug)]
pub(super) struct Design<'a> {
    pub(super) spec: &'a BoardSpec,
    pub(super) technology: &'a Technology,
    pub(super) timing: &'a Timing,
    /// A coordinate and a direction component, signs included.
    pub(super) coordinate: u64,
    pub(super) direction: u64,
    /// A t word.
    pub(super) t: u64,
    /// Origin, direction and t_max.
    pub(super) ray: u64,
    /// Four corners, id and kind.
    pub(super) patch: u64,
    /// t, patch, facing, valid.
    pub(super) hit: u64,
    /// A cell of the grid.
    pub(super) cell: u64,
    /// A bundle slot of the cluster, and a ray of one.
    pub(super) slot: u64,
    pub(super) place: u64,
    /// A context of the module.
    pub(super) context: u64,
    /// The number of a line of patch memory.
    pub(super) line: u64,
    wires: Vec<(&'static str, u64)>,
}

impl<'a> Design<'a> {
    pub(super) fn new(spec: &'a BoardSpec, technology: &'a Technology) -> Design<'a> {
        let formats = &spec.formats;
        let wires: Vec<_> =
            formats.width_table().into_iter().map(|row| (row.wire, u64::from(row.bits))).collect();
        let wire = |name: &str| wires.iter().find(|(n, _)| *n == name).map_or(0, |(_, bits)| *bits);
        let (coordinate, direction, t) = (wire("coordinate"), wire("direction"), wire("t"));
        let slot = index_bits(u64::from(spec.clusters.bundle_slots));
        let contexts = u64::from(spec.clusters.ctus_per_icu * spec.ctu.contexts);
        Design {
            spec,
            technology,
            timing: &technology.timing,
            coordinate,
            direction,
            t,
            ray: 3 * coordinate + 3 * direction + t,
            patch: 12 * coordinate + PATCH_BITS + 1,
            hit: t + PATCH_BITS + 2,
            cell: 3 * u64::from(Self::grid_log2_of(spec)),
            slot,
            place: slot + index_bits(BUNDLE_RAYS),
            context: if spec.partition.is_shells() { 0 } else { index_bits(contexts) },
            line: index_bits(spec.dram.bytes / u64::from(LINE_BYTES)),
            wires,
        }
    }

    /// The width of a wire of the datapath.
    pub(super) fn wire(&self, name: &str) -> u64 {
        self.wires.iter().find(|(n, _)| *n == name).map_or(0, |(_, bits)| *bits)
    }

    fn grid_log2_of(spec: &BoardSpec) -> u32 {
        spec.grid_log2.unwrap_or(GRID_LOG2_IF_AUTOMATIC)
    }

    /// log2 of the cells an axis that the chips have room for.
    pub(super) fn grid_log2(&self) -> u32 {
        Self::grid_log2_of(self.spec)
    }

    pub(super) fn in_shells(&self) -> bool {
        self.spec.partition.is_shells()
    }

    pub(super) fn clusters(&self) -> u64 {
        u64::from(self.spec.clusters.count)
    }

    /// Modules of the board.
    pub(super) fn modules(&self) -> u64 {
        self.clusters() * u64::from(self.spec.clusters.modules)
    }

    /// CTUs of the board.
    pub(super) fn ctus(&self) -> u64 {
        self.modules() * u64::from(self.spec.clusters.ctus_per_icu)
    }

    /// Rays that a module knows of at once: those of its contexts, or of its share of the cluster's bundles.
    pub(super) fn module_rays(&self) -> u64 {
        let c = &self.spec.clusters;
        if self.in_shells() {
            self.module_slots() * BUNDLE_RAYS
        } else {
            u64::from(c.ctus_per_icu * self.spec.ctu.contexts)
        }
    }

    /// Bundle slots of a module in shells.
    pub(super) fn module_slots(&self) -> u64 {
        let c = &self.spec.clusters;
        u64::from(c.bundle_slots.div_ceil(c.modules))
    }

    /// Energy of a memory access (pJ).
    pub(super) fn access_pj(&self, words: u64, bits: u64) -> f64 {
        if words == 0 {
            return 0.0;
        }
        let energy = &self.technology.energy;
        let root = (words as f64 * bits as f64 / 1024.0).sqrt();
        bits as f64 * (energy.ram_bit_pj + energy.ram_wire_pj * root)
    }

    /// Energy of logic at work (pJ).
    pub(super) fn logic_pj(&self, work: &Hardware) -> f64 {
        let energy = &self.technology.energy;
        let switching = if self.technology.is_fpga { work.luts } else { work.gates };
        switching * energy.activity * energy.gate_pj + work.dsps as f64 * energy.dsp_pj
    }
}

/// All instances of a kind of block, as designed.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// The kind of the accounts.
    pub(super) kind: &'static str,
    pub(super) instances: u64,
    /// Of all instances.
    pub(super) hardware: Hardware,
    /// Longest path of one instance without its register (ns).
    pub(super) path_ns: f64,
    pub(super) path: String,
    /// Energy of an event beyond the clock's (pJ).
    pub(super) event_pj: f64,
}

impl Block {
    /// So many blocks of this hardware, with a sequencer each; the longest of the paths given.
    pub(super) fn new(
        kind: &'static str,
        instances: u64,
        hardware: Hardware,
        paths: impl IntoIterator<Item = (f64, String)>,
        event_pj: f64,
    ) -> Block {
        let control = Hardware::logic(CONTROL_GATES, CONTROL_GATES / 4.0) + Hardware::registers(CONTROL_BITS);
        let longest = paths.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let (path_ns, path) = longest.unwrap_or_default();
        let hardware = (hardware + control).times(instances);
        Block { kind, instances, hardware, path_ns, path, event_pj }
    }
}
