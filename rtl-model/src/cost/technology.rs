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
/// Share of a chip's area that its cells fill: ASSUMED.
const UTILISATION: f64 = 0.75;
/// Share of a unit's gates that switch when it works: ASSUMED, 0.1 to 0.3 in datapaths.
const ACTIVITY: f64 = 0.2;
/// A bit of memory with two ports, in squares of the feature size: ASSUMED, a cell of eight transistors.
const RAM_CELL_SQUARES: f64 = 240.0;

/// OSU standard cells, TSMC 0.35 um, 3.3 V, typical, 25 degrees C: `osu035_stdcells.lib` of Debian's qflow-tech-osu035. *Fitted*:
/// to operators synthesised with these cells, docs/cost-model.md.
const OSU_035: Technology = Technology {
    name: "osu-0.35um",
    is_fpga: false,
    timing: Timing {
        // Fitted: add8 to add80; less8 to less80.
        adder_ends_ns: 0.25,
        adder_level_ns: 0.57,
        compare_ends_ns: 0.33,
        compare_level_ns: 0.195,
        carry_bit_ns: 0.0,
        // Fitted: mul8 to mul32, smul26, cross26, dot26.
        full_adder_ns: 0.42,
        partial_product_ns: 0.2,
        dsp_ns: 0.0,
        // Fitted: mux32, shift54; any64, equal24, addsub32.
        mux_ns: 0.25,
        logic_ns: 0.19,
        // DFFPOSX1 at a slew of 0.24 ns and 40 fF: clock to output 0.30, set-up 0.35. ASSUMED: skew 0.15.
        register_ns: 0.8,
        // ASSUMED: 3.0 ns for 4 KiB in 32 rows, 5 ns for 32 KiB.
        ram_ns: 1.2,
        ram_level_ns: 0.12,
        ram_wire_ns: 0.2,
        wire_factor: WIRE_FACTOR,
    },
    area: Some(CellArea {
        // NAND2X1 and DFFPOSX1.
        gate_um2: 96.0,
        flip_flop_um2: 384.0,
        ram_cell_um2: RAM_CELL_SQUARES * 0.35 * 0.35,
        utilisation: UTILISATION,
    }),
    energy: EnergyFigures {
        // NAND2X1: 0.14 pJ inside, mean of rise and fall; half C V^2 of two inputs of 18 fF and, ASSUMED, 30 fF of wire.
        gate_pj: 0.5,
        activity: ACTIVITY,
        // DFFPOSX1: clock pin 0.7 pJ a cycle at a slew of 0.24 ns, and C V^2 of its 40 fF. The clock's wires are left out.
        clock_pj: 1.1,
        // ASSUMED: a column's sense amplifier and precharge; bit lines of 2 fF a row.
        ram_bit_pj: 0.3,
        ram_wire_pj: 0.1,
        dsp_pj: 0.0,
        // cell_leakage_power of NAND2X1 and DFFPOSX1; a bit of memory as two inverters.
        gate_leak_nw: 0.026,
        flip_flop_leak_nw: 0.113,
        ram_bit_leak_nw: 0.03,
    },
};

/// Energy of 0.18 um and 1.8 V over that of 0.35 um and 3.3 V: capacitance times the square of the supply.
const ENERGY_018: f64 = (0.18 / 0.35) * (1.8 / 3.3) * (1.8 / 3.3);

/// OSU standard cells, TSMC 0.18 um, 1.8 V, typical, 25 degrees C: `osu018_stdcells.lib` of Debian's qflow-tech-osu018. Fitted as
/// above.
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
        // DFFPOSX1 at a slew of 0.24 ns and 25 fF: clock to output 0.20, set-up 0.27. ASSUMED: skew 0.08.
        register_ns: 0.55,
        // ASSUMED: those of 0.35 um times 0.6, as the operators' delays.
        ram_ns: 0.72,
        ram_level_ns: 0.072,
        ram_wire_ns: 0.12,
        wire_factor: WIRE_FACTOR,
    },
    area: Some(CellArea {
        gate_um2: 24.0,
        flip_flop_um2: 96.0,
        ram_cell_um2: RAM_CELL_SQUARES * 0.18 * 0.18,
        utilisation: UTILISATION,
    }),
    energy: EnergyFigures {
        // NAND2X1: 0.028 pJ inside; half C V^2 of two inputs of 13 fF and, ASSUMED, 15 fF of wire.
        gate_pj: 0.095,
        activity: ACTIVITY,
        // DFFPOSX1: clock pin 0.14 pJ, and C V^2 of its 28 fF.
        clock_pj: 0.23,
        ram_bit_pj: 0.3 * ENERGY_018,
        ram_wire_pj: 0.1 * ENERGY_018,
        dsp_pj: 0.0,
        gate_leak_nw: 0.039,
        flip_flop_leak_nw: 0.161,
        ram_bit_leak_nw: 0.044,
    },
};

/// Lattice ECP5, 40 nm, 1.1 V, speed grade 6: delays of single circuits placed and routed by nextpnr 0.11.1
/// (docs/cost-model.md), their wires included.
const ECP5: Technology = Technology {
    name: "ecp5",
    is_fpga: true,
    timing: Timing {
        // add24, add80: routing 1.10, into the chain 0.45, out of it 0.44; 0.071 for two bits.
        adder_ends_ns: 2.0,
        adder_level_ns: 0.0,
        compare_ends_ns: 2.0,
        compare_level_ns: 0.0,
        carry_bit_ns: 0.0355,
        // any64: 0.24 a LUT, 0.9 its routing.
        full_adder_ns: 1.15,
        partial_product_ns: 0.0,
        // DEPENDENCIES.md: 180 MHz with a register behind the blocks (mul18: routing 1.35, block 3.93).
        dsp_ns: 5.0,
        // mux32: two levels in a LUT and the slice's own multiplexer.
        mux_ns: 0.6,
        logic_ns: 1.15,
        // Clock to output 0.52, set-up 0.
        register_ns: 0.52,
        // ram36: clock to output 5.83, routing 1.2, less the register's own time, which is the block's.
        ram_ns: 6.4,
        ram_level_ns: 0.0,
        ram_wire_ns: 0.0,
        wire_factor: 1.0,
    },
    area: None,
    energy: EnergyFigures {
        // ASSUMED: half C V^2 of 0.8 pF, a LUT's output and its routing.
        gate_pj: 0.5,
        activity: ACTIVITY,
        // ASSUMED, as the other three: orders of magnitude for 40 nm.
        clock_pj: 0.05,
        ram_bit_pj: 0.1,
        ram_wire_pj: 0.02,
        dsp_pj: 10.0,
        // ASSUMED: about 0.2 A at 1.1 V over the 84,000 LUTs of the largest device; registers and memory in it.
        gate_leak_nw: 2600.0,
        flip_flop_leak_nw: 0.0,
        ram_bit_leak_nw: 0.0,
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
        ram_cell_um2: RAM_CELL_SQUARES * 1.6 * 1.6,
        utilisation: UTILISATION,
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
