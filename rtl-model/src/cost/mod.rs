//! What a board costs: gates, flip-flops, memory, clock, area, energy, in named technologies.
//!
//! ```text
//! BoardSpec, width table --design--> blocks: hardware, longest path, energy an event --Technology--> Cost
//!                                                                  BoardStatistics --energy--> J
//! ```
//! `operators` says what an adder or a product takes and where it can be cut, `pipeline` cuts a datapath into stages,
//! `icu`, `division`, `literature`, `ctu`, `front`, `shared`, `memory` and `links` hold one kind of block each: the structure
//! that `blocks/` gives time. Clock = 1 / (longest path of any block + register). Coefficients, their sources, how far off
//! they are: docs/cost-model.md. Not modelled: the board's DRAM chips and bus drivers, pads, clock tree, test logic,
//! placement, wires beyond a factor of delay and area.

use serde::Serialize;

use crate::spec::BoardSpec;

mod ctu;
mod design;
mod division;
mod energy;
mod front;
mod hardware;
mod icu;
mod links;
mod literature;
mod memory;
mod operators;
mod pipeline;
mod shared;
mod technology;

pub use technology::{CellArea, EnergyFigures, Technology, Timing};

use design::{Block, Design};
use hardware::Hardware;

/// All instances of a kind of block.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlockCost {
    /// Which: the kinds of the accounts (`icu`, `ctu`, `patch_loader`), `division`, the caches, and `links`, the FIFOs.
    pub block: &'static str,
    /// How many.
    pub instances: u64,
    /// NAND2 equivalents of logic, of all instances.
    pub gates: f64,
    /// Registers, of all instances.
    pub flip_flops: u64,
    /// Memory bits, of all instances.
    pub ram_bits: u64,
    /// Area of all instances (mm2); of an FPGA `None`.
    pub area_mm2: Option<f64>,
    /// What all instances take of an FPGA.
    pub fpga: Option<FpgaUse>,
    /// Longest path between two registers of one instance (ns), its register's own time included.
    pub path_ns: f64,
    /// What that path goes through.
    pub path: String,
    /// Energy of an event (a test, a step, a look-up, a cycle of work) beyond the registers' clock (pJ).
    pub event_pj: f64,
}

/// What an FPGA needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FpgaUse {
    /// Look-up tables of four inputs.
    pub luts: u64,
    /// Multiplier blocks.
    pub dsps: u64,
    /// Memory blocks.
    pub ram_blocks: u64,
}

/// What a board costs, its DRAM and bus drivers left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// In which technology.
    pub technology: &'static str,
    /// By kind of block.
    pub blocks: Vec<BlockCost>,
    /// NAND2 equivalents of logic.
    pub gates: f64,
    /// Registers.
    pub flip_flops: u64,
    /// Memory bits.
    pub ram_bits: u64,
    /// Area (mm2); of an FPGA `None`.
    pub area_mm2: Option<f64>,
    /// Of an FPGA.
    pub fpga: Option<FpgaUse>,
    /// Longest path between two registers (ns), the register's own time included.
    pub critical_path_ns: f64,
    /// The block that has it.
    pub critical_block: &'static str,
    /// The fastest clock (MHz) that it allows.
    pub max_clock_mhz: f64,
    /// Power at rest (W).
    pub leakage_w: f64,
    /// Energy of all registers' clock, a cycle (pJ).
    pub clock_pj: f64,
}

impl Cost {
    /// The cost of a valid board.
    pub fn of(spec: &BoardSpec, technology: &'static Technology) -> Cost {
        let design = Design::new(spec, technology);
        let designed = all_blocks(&design);
        let blocks: Vec<BlockCost> = designed.iter().map(|block| block_cost(block, technology)).collect();
        let all: Hardware = designed.iter().map(|block| block.hardware).sum();
        let critical = blocks.iter().max_by(|a, b| a.path_ns.total_cmp(&b.path_ns));
        let (critical_block, critical_path_ns) =
            critical.map_or(("none", technology.timing.register_ns), |b| (b.block, b.path_ns));
        let sum = |of: fn(&FpgaUse) -> u64| blocks.iter().filter_map(|b| b.fpga.as_ref().map(of)).sum();
        Cost {
            technology: technology.name,
            gates: blocks.iter().map(|b| b.gates).sum(),
            flip_flops: all.flip_flops,
            ram_bits: all.ram_bits,
            area_mm2: blocks.iter().map(|b| b.area_mm2).sum(),
            fpga: technology.is_fpga.then(|| FpgaUse {
                luts: sum(|f| f.luts),
                dsps: sum(|f| f.dsps),
                ram_blocks: sum(|f| f.ram_blocks),
            }),
            critical_path_ns,
            critical_block,
            max_clock_mhz: 1e3 / critical_path_ns,
            leakage_w: leakage_w(&all, technology),
            clock_pj: all.flip_flops as f64 * technology.energy.clock_pj,
            blocks,
        }
    }
}

/// Every block of the board, in the order of a ray's way.
fn all_blocks(design: &Design<'_>) -> Vec<Block> {
    let mut blocks =
        vec![shared::host_link(design), shared::dispatcher(design), shared::bundle_generator(design)];
    if design.in_shells() {
        blocks.push(front::shell_tracker(design));
    }
    blocks.extend([ctu::block(design), front::patch_loader(design)]);
    blocks.extend(memory::caches(design));
    blocks.extend(icu::blocks(design));
    blocks.extend([
        front::reducer(design),
        shared::result_merge(design),
        memory::cluster_buffer(design),
        memory::dram(design),
        links::block(design),
    ]);
    blocks
}

fn block_cost(block: &Block, technology: &Technology) -> BlockCost {
    let h = &block.hardware;
    let area_mm2 = technology.area.map(|area| {
        let cells = h.gates * area.gate_um2 + h.flip_flops as f64 * area.flip_flop_um2;
        (cells / area.utilisation + h.ram_cells * area.ram_cell_um2) * 1e-6
    });
    let fpga = technology.is_fpga.then(|| FpgaUse {
        luts: h.luts.ceil() as u64,
        dsps: h.dsps,
        ram_blocks: h.ram_blocks,
    });
    BlockCost {
        block: block.kind,
        instances: block.instances,
        gates: h.gates,
        flip_flops: h.flip_flops,
        ram_bits: h.ram_bits,
        area_mm2,
        fpga,
        path_ns: block.path_ns + technology.timing.register_ns,
        path: block.path.clone(),
        event_pj: block.event_pj,
    }
}

fn leakage_w(all: &Hardware, technology: &Technology) -> f64 {
    let energy = &technology.energy;
    let logic = if technology.is_fpga { all.luts } else { all.gates };
    (logic * energy.gate_leak_nw
        + all.flip_flops as f64 * energy.flip_flop_leak_nw
        + all.ram_bits as f64 * energy.ram_bit_leak_nw)
        * 1e-9
}

#[cfg(test)]
mod anchor_tests;
#[cfg(test)]
mod monotone_tests;
#[cfg(test)]
mod tests;
