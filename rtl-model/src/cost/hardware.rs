//! What blocks are made of, in terms that no technology changes: gates, registers, memory.
//!
//! ```text
//! operators, arrays --Hardware--> sums by block --Technology--> mm2, LUTs
//! ```
//! Gates are NAND2 equivalents: cell area over that of a NAND2X1, the same number in both OSU libraries, whose areas
//! differ by exactly 4. An FPGA's LUTs, multipliers and memory blocks are counted beside them, from the same structure.
//!
//! # Arrays
//! An array of words (a FIFO, a table, the contexts of a CTU) keeps its first [`REGISTER_WORDS`] words in registers, with
//! a multiplexer before (write enable) and behind each bit, and all others in memory: small arrays are registers, large
//! ones memory with a register stage, and a further word never takes a register away. Memory takes its bits and, for
//! decoders, drivers and sense amplifiers, [`PERIPHERY_ROWS`] rows and columns of a square of them.

use serde::Serialize;

/// Words of an array that are registers: ASSUMED.
pub(super) const REGISTER_WORDS: u64 = 4;
/// Rows, and as many columns, of bit cells that the periphery of a square memory takes the place of: ASSUMED, the form
/// of Mulder, Quach, Flynn 1991 (An area model for on-chip memories).
const PERIPHERY_ROWS: f64 = 12.0;
/// Words up to which an FPGA keeps an array in look-up tables: ASSUMED.
pub(super) const LUT_ARRAY_WORDS: u64 = 64;
/// LUTs of 16 words of 4 bits, with their write decoder: ECP5 family data sheet (a slice pair as memory, one to write).
const LUTS_A_LUT_ARRAY: f64 = 6.0;
/// Widest word and, at that width, the words of a memory block of 18 Kibit: ECP5 family data sheet.
const BLOCK_BITS: u64 = 36;
const BLOCK_WORDS: u64 = 512;

/// NAND2 equivalents of a 2:1 multiplexer: fitted to `mux32`, `shift54`, `regs32` (docs/cost-model.md).
pub(super) const MUX_GATES: f64 = 3.0;

/// A sum of hardware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Hardware {
    /// NAND2 equivalents of logic.
    pub gates: f64,
    /// Registers.
    pub flip_flops: u64,
    /// Memory bits.
    pub ram_bits: u64,
    /// Memory in bit cells, its periphery included.
    pub ram_cells: f64,
    /// FPGA: look-up tables.
    pub luts: f64,
    /// FPGA: multipliers of 18 x 18 bits.
    pub dsps: u64,
    /// FPGA: memory blocks.
    pub ram_blocks: u64,
}

impl std::ops::AddAssign for Hardware {
    fn add_assign(&mut self, other: Hardware) {
        self.gates += other.gates;
        self.flip_flops += other.flip_flops;
        self.ram_bits += other.ram_bits;
        self.ram_cells += other.ram_cells;
        self.luts += other.luts;
        self.dsps += other.dsps;
        self.ram_blocks += other.ram_blocks;
    }
}

impl std::ops::Add for Hardware {
    type Output = Hardware;

    fn add(mut self, other: Hardware) -> Hardware {
        self += other;
        self
    }
}

impl std::iter::Sum for Hardware {
    fn sum<I: Iterator<Item = Hardware>>(parts: I) -> Hardware {
        parts.fold(Hardware::default(), |sum, part| sum + part)
    }
}

impl Hardware {
    /// So many of it.
    pub(super) fn times(self, n: u64) -> Hardware {
        Hardware {
            gates: self.gates * n as f64,
            flip_flops: self.flip_flops * n,
            ram_bits: self.ram_bits * n,
            ram_cells: self.ram_cells * n as f64,
            luts: self.luts * n as f64,
            dsps: self.dsps * n,
            ram_blocks: self.ram_blocks * n,
        }
    }

    /// Logic, with the LUTs that it takes.
    pub(super) fn logic(gates: f64, luts: f64) -> Hardware {
        Hardware { gates, luts, ..Hardware::default() }
    }

    /// Registers that take a value in every cycle.
    pub(super) fn registers(bits: u64) -> Hardware {
        Hardware { flip_flops: bits, ..Hardware::default() }
    }

    /// Registers that hold their value until they are written: a multiplexer a bit (of an FPGA, the register's enable).
    pub(super) fn held(bits: u64) -> Hardware {
        Hardware { gates: MUX_GATES * bits as f64, flip_flops: bits, ..Hardware::default() }
    }

    /// `ways` words of `bits`, one of which is chosen.
    pub(super) fn multiplexer(bits: u64, ways: u64) -> Hardware {
        let choices = (bits * ways.saturating_sub(1)) as f64;
        // `mux32`: 128 LUTs for 32 x 3 choices.
        Hardware::logic(MUX_GATES * choices, choices * 4.0 / 3.0)
    }

    /// Memory alone, as of caches: `words` of `bits`.
    pub(super) fn memory(words: u64, bits: u64) -> Hardware {
        let n = words * bits;
        if n == 0 {
            return Hardware::default();
        }
        let mut memory = Hardware {
            ram_bits: n,
            ram_cells: n as f64 + 2.0 * PERIPHERY_ROWS * (n as f64).sqrt(),
            ..Hardware::default()
        };
        if words <= LUT_ARRAY_WORDS {
            memory.luts = (words.div_ceil(16) * bits.div_ceil(4)) as f64 * LUTS_A_LUT_ARRAY;
        } else {
            memory.ram_blocks = bits.div_ceil(BLOCK_BITS) * words.div_ceil(BLOCK_WORDS);
        }
        memory
    }

    /// An array of `words` words of `bits`: the first in registers, the others in memory.
    pub(super) fn array(words: u64, bits: u64) -> Hardware {
        let first = words.min(REGISTER_WORDS);
        let others = words - first;
        let choices = first + u64::from(others > 0);
        Hardware::held(first * bits) + Hardware::multiplexer(bits, choices) + Hardware::memory(others, bits)
    }
}

/// Bits that count up to `n` things: of the numbers 0..n.
pub(super) fn index_bits(n: u64) -> u64 {
    u64::from(u64::BITS - n.saturating_sub(1).leading_zeros())
}

/// log2 of `n`, rounded up; 0 for 0 and 1.
pub(super) fn levels(n: u64) -> u64 {
    index_bits(n)
}
