//! Technologies: what a gate, a register, a bit of memory takes in area, time and energy.
//!
//! ```text
//! liberty files, synthesis of single operators (docs/cost-model.md) --> Technology --> Cost
//! ```
//! Plain numbers, so that figures of a synthesised board can take the place of any of them. Each has its source or
//! ASSUMED. Delays are those of cells before placement; `wire_factor` stands for the wires.

use serde::Serialize;

/// Delays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// An adder's first and last level together: generate and propagate, the sum's XOR (ns).
    pub adder_ends_ns: f64,
    /// A level of its carries after the first; there are log2 of its bits (ns).
    pub adder_level_ns: f64,
    /// The same of a comparison, which needs one carry (ns).
    pub compare_ends_ns: f64,
    /// A level of it after the first (ns).
    pub compare_level_ns: f64,
    /// FPGA: a bit of the carry chain, instead of levels (ns).
    pub carry_bit_ns: f64,
    /// A row of full adders (ns).
    pub full_adder_ns: f64,
    /// The AND gates of a partial product (ns).
    pub partial_product_ns: f64,
    /// FPGA: a multiplier block (ns).
    pub dsp_ns: f64,
    /// A 2:1 multiplexer (ns).
    pub mux_ns: f64,
    /// A gate or two of other logic: an XOR, a step of an arbiter or an OR tree (ns).
    pub logic_ns: f64,
    /// Clock to output, set-up and skew of a register (ns).
    pub register_ns: f64,
    /// Memory: decoder and sense amplifier (ns).
    pub ram_ns: f64,
    /// Memory: each halving of the words by the decoder (ns).
    pub ram_level_ns: f64,
    /// Memory: word and bit lines, a root of 1,024 bits (ns).
    pub ram_wire_ns: f64,
    /// All delays but a register's and a memory's, times this: wires.
    pub wire_factor: f64,
}

/// Areas of standard cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CellArea {
    /// A NAND2 (um2).
    pub gate_um2: f64,
    /// A register (um2).
    pub flip_flop_um2: f64,
    /// A bit of memory with a read and a write port (um2).
    pub ram_cell_um2: f64,
    /// Share of the area that cells fill, the rest being wires.
    pub utilisation: f64,
}

/// Energies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EnergyFigures {
    /// A NAND2 equivalent that switches (pJ).
    pub gate_pj: f64,
    /// Share of the gates of a unit at work that switch, glitches included.
    pub activity: f64,
    /// A register's clock, a cycle (pJ).
    pub clock_pj: f64,
    /// A memory access: each bit read or written (pJ).
    pub ram_bit_pj: f64,
    /// A memory access: word and bit lines, a bit and a root of 1,024 bits (pJ).
    pub ram_wire_pj: f64,
    /// FPGA: an operation of a multiplier block (pJ).
    pub dsp_pj: f64,
    /// Leakage of a NAND2 equivalent, a LUT (nW).
    pub gate_leak_nw: f64,
    /// Leakage of a register (nW).
    pub flip_flop_leak_nw: f64,
    /// Leakage of a bit of memory (nW).
    pub ram_bit_leak_nw: f64,
}

/// A technology: coefficients, each with its source or ASSUMED.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Technology {
    /// Its name in files: `osu-0.35um`.
    pub name: &'static str,
    /// An FPGA: it has look-up tables and blocks, no area.
    pub is_fpga: bool,
    /// Delays.
    pub timing: Timing,
    /// Areas; of an FPGA `None`.
    pub area: Option<CellArea>,
    /// Energies.
    pub energy: EnergyFigures,
}

/// Delay of cells with wires over that of cells alone: ASSUMED.
const WIRE_FACTOR: f64 = 1.2;

/// OSU standard cells, TSMC 0.35 um, 3.3 V, typical, 25 degrees C.
const OSU_035: Technology = Technology {
    name: "osu-0.35um",
    is_fpga: false,
    timing: Timing {
        adder_ends_ns: 0.25,
        adder_level_ns: 0.57,
        compare_ends_ns: 0.33,
        compare_level_ns: 0.195,
        carry_bit_ns: 0.0,
        full_adder_ns: 0.42,
        partial_product_ns: 0.2,
        dsp_ns: 0.0,
        mux_ns: 0.25,
        logic_ns: 0.19,
        register_ns: 0.8,
        ram_ns: 1.2,
        ram_level_ns: 0.12,
        ram_wire_ns: 0.2,
        wire_factor: WIRE_FACTOR,
    },
    area: Some(CellArea { gate_um2: 96.0, flip_flop_um2: 384.0, ram_cell_um2: 29.0, utilisation: 0.75 }),
    energy: EnergyFigures {
        gate_pj: 0.3,
        activity: 0.3,
        clock_pj: 0.5,
        ram_bit_pj: 0.5,
        ram_wire_pj: 0.4,
        dsp_pj: 0.0,
        gate_leak_nw: 0.026,
        flip_flop_leak_nw: 0.113,
        ram_bit_leak_nw: 0.05,
    },
};

/// OSU standard cells, TSMC 0.18 um, 1.8 V, typical, 25 degrees C.
const OSU_018: Technology = Technology {
    name: "osu-0.18um",
    is_fpga: false,
    timing: Timing {
        adder_ends_ns: 0.2,
        adder_level_ns: 0.295,
        compare_ends_ns: 0.23,
        compare_level_ns: 0.12,
        carry_bit_ns: 0.0,
        full_adder_ns: 0.3,
        partial_product_ns: 0.12,
        dsp_ns: 0.0,
        mux_ns: 0.15,
        logic_ns: 0.115,
        register_ns: 0.55,
        ram_ns: 0.7,
        ram_level_ns: 0.07,
        ram_wire_ns: 0.12,
        wire_factor: WIRE_FACTOR,
    },
    area: Some(CellArea { gate_um2: 24.0, flip_flop_um2: 96.0, ram_cell_um2: 7.7, utilisation: 0.75 }),
    energy: EnergyFigures {
        gate_pj: 0.05,
        activity: 0.3,
        clock_pj: 0.08,
        ram_bit_pj: 0.08,
        ram_wire_pj: 0.06,
        dsp_pj: 0.0,
        gate_leak_nw: 0.039,
        flip_flop_leak_nw: 0.161,
        ram_bit_leak_nw: 0.08,
    },
};

/// Lattice ECP5, 40 nm, 1.1 V, speed grade 6.
const ECP5: Technology = Technology {
    name: "ecp5",
    is_fpga: true,
    timing: Timing {
        adder_ends_ns: 2.0,
        adder_level_ns: 0.0,
        compare_ends_ns: 2.0,
        compare_level_ns: 0.0,
        carry_bit_ns: 0.0355,
        full_adder_ns: 1.15,
        partial_product_ns: 0.0,
        dsp_ns: 5.0,
        mux_ns: 0.6,
        logic_ns: 1.15,
        register_ns: 0.52,
        ram_ns: 6.4,
        ram_level_ns: 0.0,
        ram_wire_ns: 0.0,
        wire_factor: 1.0,
    },
    area: None,
    energy: EnergyFigures {
        gate_pj: 0.3,
        activity: 0.2,
        clock_pj: 0.05,
        ram_bit_pj: 0.1,
        ram_wire_pj: 0.02,
        dsp_pj: 10.0,
        gate_leak_nw: 1000.0,
        flip_flop_leak_nw: 0.0,
        ram_bit_leak_nw: 10.0,
    },
};

/// Feature size of the board's time over that of the 0.35 um cells.
const SCALE: f64 = 1.6 / 0.35;
/// Their supplies, 5 V and 3.3 V.
const SUPPLY_SCALE: f64 = 5.0 / 3.3;

/// CMOS of the board's time, 5 V: the 0.35 um cells scaled. ASSUMED: areas go with the square of the feature size,
/// delays with the feature size (the rule of a fan-out-of-4 delay, Ho, Mai, Horowitz 2001), energies with capacitance, so
/// the feature size, times the square of the supply, leakage not at all.
const CMOS_1600: Technology = Technology {
    name: "cmos-1.6um",
    is_fpga: false,
    timing: scaled_timing(&OSU_035.timing, SCALE),
    area: Some(CellArea {
        gate_um2: 96.0 * SCALE * SCALE,
        flip_flop_um2: 384.0 * SCALE * SCALE,
        ram_cell_um2: 29.0 * SCALE * SCALE,
        utilisation: 0.75,
    }),
    energy: EnergyFigures {
        gate_pj: OSU_035.energy.gate_pj * SCALE * SUPPLY_SCALE * SUPPLY_SCALE,
        clock_pj: OSU_035.energy.clock_pj * SCALE * SUPPLY_SCALE * SUPPLY_SCALE,
        ram_bit_pj: OSU_035.energy.ram_bit_pj * SCALE * SUPPLY_SCALE * SUPPLY_SCALE,
        ram_wire_pj: OSU_035.energy.ram_wire_pj * SCALE * SUPPLY_SCALE * SUPPLY_SCALE,
        ..OSU_035.energy
    },
};

/// All delays times a factor.
const fn scaled_timing(of: &Timing, factor: f64) -> Timing {
    Timing {
        adder_ends_ns: of.adder_ends_ns * factor,
        adder_level_ns: of.adder_level_ns * factor,
        compare_ends_ns: of.compare_ends_ns * factor,
        compare_level_ns: of.compare_level_ns * factor,
        carry_bit_ns: of.carry_bit_ns * factor,
        full_adder_ns: of.full_adder_ns * factor,
        partial_product_ns: of.partial_product_ns * factor,
        dsp_ns: of.dsp_ns * factor,
        mux_ns: of.mux_ns * factor,
        logic_ns: of.logic_ns * factor,
        register_ns: of.register_ns * factor,
        ram_ns: of.ram_ns * factor,
        ram_level_ns: of.ram_level_ns * factor,
        ram_wire_ns: of.ram_wire_ns * factor,
        wire_factor: of.wire_factor,
    }
}

static TECHNOLOGIES: [Technology; 4] = [OSU_035, OSU_018, ECP5, CMOS_1600];

impl Technology {
    /// Every technology.
    pub fn all() -> &'static [Technology] {
        &TECHNOLOGIES
    }

    /// The technology of this name.
    pub fn named(name: &str) -> Option<&'static Technology> {
        Technology::all().iter().find(|t| t.name == name)
    }
}
