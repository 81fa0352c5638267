//! Operators of a datapath: gates, and the chain of indivisible parts that a pipeline can be cut between.
//!
//! ```text
//! adder of w bits:   level of carries | ... | last level, sum
//! sum of k products: partial products and first row of full adders | row | ... | row | adder
//! ```
//! Adders are prefix adders: delay a + b log2 w. Products are trees of full adders (Dadda 1965): a sum of k products of
//! m x n bits has k n rows; each full adder takes a bit away, so k m n - 2 w of them leave two words of w bits. On an
//! FPGA adders are carry chains in parts of [`CHAIN_BITS`], and products blocks of 18 x 18 bits whose results a tree of
//! adders sums. Laws and coefficients are fitted to synthesised operators: docs/cost-model.md.
//! Not modelled: Booth recoding, compressors beyond full adders, constant operands.

use super::hardware::{Hardware, LUT_ARRAY_WORDS, levels};
use super::technology::Timing;

/// NAND2 equivalents of an adder: a bit, and a bit and level of carries. Fitted to `add8` to `add80`.
pub(super) const ADDER_BIT_GATES: f64 = 6.5;
pub(super) const ADDER_LEVEL_GATES: f64 = 0.5;
/// NAND2 equivalents of choosing between addition and subtraction, a bit: `addsub32`, `addsub80`.
pub(super) const SUBTRACT_GATES: f64 = 3.5;
/// NAND2 equivalents of a magnitude: a bit, and a bit and level: `abs26`, `abs80`.
pub(super) const MAGNITUDE_BIT_GATES: f64 = 3.4;
pub(super) const MAGNITUDE_LEVEL_GATES: f64 = 0.24;
/// A magnitude's delay over an adder's: the same.
const MAGNITUDE_DELAY: f64 = 0.65;
/// NAND2 equivalents of a full adder of a tree: fitted to `mul8` to `mul32`, `smul26`, `cross26`, `dot26`, `csa24`.
pub(super) const FULL_ADDER_GATES: f64 = 10.9;
/// NAND2 equivalents of a bit of a partial product: AND2X1, 128 um2 over 96 um2.
pub(super) const PARTIAL_PRODUCT_GATES: f64 = 1.35;
/// NAND2 equivalents of a compared bit, a < b: `less8` to `less80`.
pub(super) const COMPARE_BIT_GATES: f64 = 6.4;
/// NAND2 equivalents of a compared bit, a = b: `equal24`.
pub(super) const EQUAL_BIT_GATES: f64 = 4.0;
/// NAND2 equivalents of a bit of an OR tree: `any64`.
const OR_GATES: f64 = 1.0;
/// LUTs a bit of an adder-subtractor or magnitude, and of a comparison: `addsub32`, `abs26`; `less24` to `less80`.
const LUTS_A_SIGNED_BIT: f64 = 2.0;
const LUTS_A_COMPARED_BIT: f64 = 2.2;
/// Bits of a carry chain that are one part: ASSUMED.
const CHAIN_BITS: u64 = 16;
/// Factor bits of a multiplier block: ECP5 family data sheet.
const DSP_BITS: u64 = 18;

/// An indivisible part of an operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    /// Its delay (ns).
    pub(super) delay_ns: f64,
    /// Bits alive behind it, of all uses.
    pub(super) bits_after: u64,
}

/// An operator, or so many of it side by side.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Operator {
    pub(super) hardware: Hardware,
    /// Bits that it takes; what is chosen between when it is shared.
    pub(super) in_bits: u64,
    /// At least one.
    pub(super) parts: Vec<Part>,
}

impl Operator {
    fn one(hardware: Hardware, in_bits: u64, delay_ns: f64, out_bits: u64) -> Operator {
        Operator { hardware, in_bits, parts: vec![Part { delay_ns, bits_after: out_bits }] }
    }

    /// Delay of all parts (ns).
    pub(super) fn total_ns(&self) -> f64 {
        self.parts.iter().map(|part| part.delay_ns).sum()
    }

    /// Bits of its result.
    pub(super) fn out_bits(&self) -> u64 {
        self.parts.last().map_or(0, |part| part.bits_after)
    }

    /// This one and then another.
    pub(super) fn then(mut self, next: Operator) -> Operator {
        self.hardware += next.hardware;
        self.parts.extend(next.parts);
        self
    }

    /// The same that cannot be cut.
    pub(super) fn undivided(self) -> Operator {
        let (delay_ns, bits_after) = (self.total_ns(), self.out_bits());
        Operator { parts: vec![Part { delay_ns, bits_after }], ..self }
    }
}

impl Timing {
    /// A delay of logic with its wires (ns).
    fn wired(&self, ns: f64) -> f64 {
        ns * self.wire_factor
    }

    /// Is this an FPGA, whose products are blocks?
    fn has_blocks(&self) -> bool {
        self.dsp_ns > 0.0
    }

    /// A step of other logic (ns).
    pub(super) fn step_ns(&self) -> f64 {
        self.wired(self.logic_ns)
    }

    /// A choice between `ways` words (ns).
    pub(super) fn choice_ns(&self, ways: u64) -> f64 {
        self.wired(self.mux_ns * levels(ways) as f64)
    }

    /// An arbiter of `n`, in turn: a tree of priorities there and back (ns).
    pub(super) fn arbiter_ns(&self, n: u64) -> f64 {
        self.wired(self.logic_ns * (1 + 2 * levels(n)) as f64)
    }

    /// The lowest of `n` bits that are set: a tree (ns).
    pub(super) fn lowest_ns(&self, n: u64) -> f64 {
        self.wired(self.logic_ns * (1 + levels(n)) as f64)
    }

    /// An adder in one piece, with its result (ns).
    pub(super) fn adder_ns(&self, bits: u64) -> f64 {
        let carries = self.adder_level_ns * levels_after_first(bits) + self.carry_bit_ns * bits as f64;
        self.wired(self.adder_ends_ns + carries)
    }

    /// Whether a < b (ns).
    pub(super) fn comparator_ns(&self, bits: u64) -> f64 {
        let carries = self.compare_level_ns * levels_after_first(bits) + self.carry_bit_ns * bits as f64;
        self.wired(self.compare_ends_ns + carries)
    }

    /// a + b or a - b of `bits` bits.
    pub(super) fn adder(&self, bits: u64) -> Operator {
        let w = bits as f64;
        let gates = w * (ADDER_BIT_GATES + ADDER_LEVEL_GATES * levels(bits) as f64);
        let hardware = Hardware::logic(gates, w);
        let part = |delay_ns, bits_after| Part { delay_ns: self.wired(delay_ns), bits_after };
        let parts = if self.carry_bit_ns > 0.0 {
            let first = bits.min(CHAIN_BITS);
            let rest = bits - first;
            let n = rest.div_ceil(CHAIN_BITS);
            let chain = |b: u64| self.carry_bit_ns * b as f64;
            // Behind each part its sum, and what is still to be added of both operands.
            let mut parts = vec![part(self.adder_ends_ns + chain(first), bits + rest)];
            parts.extend((1..=n).map(|i| {
                let left = rest.saturating_sub(i * CHAIN_BITS);
                part(chain(rest) / n as f64, bits + left)
            }));
            parts
        } else {
            // Alive inside: propagate bits, and generate and propagate of the groups.
            let n_levels = levels(bits).saturating_sub(1);
            let inner = |_| part(self.adder_level_ns, 3 * bits);
            let mut parts: Vec<Part> = (1..=n_levels).map(inner).collect();
            // The ends are shorter than a level: with the last one.
            match parts.last_mut() {
                Some(last) => *last = part(self.adder_level_ns + self.adder_ends_ns, bits),
                None => parts.push(part(self.adder_ends_ns, bits)),
            }
            parts
        };
        Operator { hardware, in_bits: 2 * bits, parts }
    }

    /// a + b or a - b, as a sign chooses.
    pub(super) fn adder_subtractor(&self, bits: u64) -> Operator {
        let mut adder = self.adder(bits);
        let w = bits as f64;
        adder.hardware += Hardware::logic(SUBTRACT_GATES * w, (LUTS_A_SIGNED_BIT - 1.0) * w);
        // An FPGA's carry chain has it in the LUT before each carry.
        if !self.has_blocks() {
            adder.parts[0].delay_ns += 2.0 * self.step_ns();
        }
        adder
    }

    /// |a|, or a + 1 where a bit says so.
    pub(super) fn magnitude(&self, bits: u64) -> Operator {
        let mut adder = self.adder(bits);
        let w = bits as f64;
        let gates = w * (MAGNITUDE_BIT_GATES + MAGNITUDE_LEVEL_GATES * levels(bits) as f64);
        adder.hardware = Hardware::logic(gates, LUTS_A_SIGNED_BIT * w);
        if !self.has_blocks() {
            adder.parts.iter_mut().for_each(|part| part.delay_ns *= MAGNITUDE_DELAY);
        }
        Operator { in_bits: bits, ..adder }
    }

    /// Whether a < b: a bit. In one piece.
    pub(super) fn comparator(&self, bits: u64) -> Operator {
        let w = bits as f64;
        let hardware = Hardware::logic(COMPARE_BIT_GATES * w, LUTS_A_COMPARED_BIT * w);
        Operator::one(hardware, 2 * bits, self.comparator_ns(bits), 1)
    }

    /// Whether a = b: a bit.
    pub(super) fn equality(&self, bits: u64) -> Operator {
        let hardware = Hardware::logic(EQUAL_BIT_GATES * bits as f64, bits as f64 * 2.0 / 3.0);
        Operator::one(hardware, 2 * bits, self.equality_ns(bits), 1)
    }

    /// An XOR and a tree of gates of four inputs (ns).
    pub(super) fn equality_ns(&self, bits: u64) -> f64 {
        self.wired(self.logic_ns * (1 + levels(bits).div_ceil(2)) as f64)
    }

    /// Whether any bit is set.
    pub(super) fn any(&self, bits: u64) -> Operator {
        let delay = self.wired(self.logic_ns * levels(bits).div_ceil(2) as f64);
        Operator::one(Hardware::logic(OR_GATES * bits as f64, bits as f64 / 3.0), bits, delay, 1)
    }

    /// One of `ways` words of `bits`.
    pub(super) fn multiplexer(&self, bits: u64, ways: u64) -> Operator {
        Operator::one(Hardware::multiplexer(bits, ways), bits * ways, self.choice_ns(ways), bits)
    }

    /// A shift by 0 to 2^`stages` - 1 places: a multiplexer a stage.
    pub(super) fn shifter(&self, bits: u64, stages: u64) -> Operator {
        let hardware = Hardware::multiplexer(bits, 2).times(stages);
        let part = Part { delay_ns: self.wired(self.mux_ns), bits_after: bits };
        Operator { hardware, in_bits: bits, parts: vec![part; stages.max(1) as usize] }
    }

    /// Three words become two: a row of full adders.
    pub(super) fn carry_save_row(&self, bits: u64) -> Operator {
        let hardware = Hardware::logic(FULL_ADDER_GATES * bits as f64, 2.0 * bits as f64);
        Operator::one(hardware, 3 * bits, self.wired(self.full_adder_ns), 2 * bits)
    }

    /// a + b + c of `bits` bits.
    pub(super) fn sum_of_three(&self, bits: u64) -> Operator {
        self.carry_save_row(bits).then(self.adder(bits))
    }

    /// The sum of `k` products of `m` x `n` bits, in `bits` bits.
    pub(super) fn sum_of_products(&self, k: u64, m: u64, n: u64, bits: u64) -> Operator {
        let in_bits = k * (m + n);
        if self.has_blocks() {
            return self.sum_of_blocks(k, m, n, bits);
        }
        let n_bits = k * m * n;
        let n_full_adders = n_bits.saturating_sub(2 * bits);
        let gates = PARTIAL_PRODUCT_GATES * n_bits as f64 + FULL_ADDER_GATES * n_full_adders as f64;
        let rows = dadda_rows(k * m.min(n));
        let delay = |first: bool| {
            let products = if first { self.partial_product_ns } else { 0.0 };
            self.wired(self.full_adder_ns + products)
        };
        // Each row leaves two thirds of the bits, to the two words at the end.
        let mut alive = n_bits as f64;
        let mut parts: Vec<Part> = (0..rows)
            .map(|row| {
                alive = (alive * 2.0 / 3.0).max(2.0 * bits as f64);
                Part {
                    delay_ns: delay(row == 0),
                    bits_after: if row + 1 == rows { 2 * bits } else { alive.round() as u64 },
                }
            })
            .collect();
        if parts.is_empty() {
            parts.push(Part { delay_ns: self.wired(self.partial_product_ns), bits_after: 2 * bits });
        }
        Operator { hardware: Hardware::logic(gates, 0.0), in_bits, parts }.then(self.adder(bits))
    }

    /// The same of blocks.
    fn sum_of_blocks(&self, k: u64, m: u64, n: u64, bits: u64) -> Operator {
        let n_blocks = k * m.div_ceil(DSP_BITS) * n.div_ceil(DSP_BITS);
        // Gates as of cells, so that the count means the same in every technology.
        let n_bits = k * m * n;
        let gates =
            PARTIAL_PRODUCT_GATES * n_bits as f64 + FULL_ADDER_GATES * n_bits.saturating_sub(2 * bits) as f64;
        let mut terms = n_blocks;
        let width = |terms: u64| terms * bits.min(2 * DSP_BITS);
        let first = Part { delay_ns: self.wired(self.dsp_ns), bits_after: width(terms).max(bits) };
        let hardware = Hardware { dsps: n_blocks, gates, ..Hardware::default() };
        let mut all = Operator { hardware, in_bits: k * (m + n), parts: vec![first] };
        while terms > 1 {
            let pairs = terms / 2;
            // Neighbouring blocks' results overlap by half (`mul20` to `mul32`).
            let mut row = self.adder(bits / 2);
            row.hardware = row.hardware.times(pairs);
            terms -= pairs;
            for part in &mut row.parts {
                part.bits_after = (part.bits_after * 2 * terms).max(bits);
            }
            all = all.then(row);
        }
        all
    }

    /// A memory access, in one piece (ns).
    pub(super) fn memory_ns(&self, words: u64, bits: u64) -> f64 {
        if words == 0 {
            return 0.0;
        }
        if self.has_blocks() && words <= LUT_ARRAY_WORDS {
            return self.wired(self.logic_ns * (1 + levels(words.div_ceil(16))) as f64);
        }
        let root = (words as f64 * bits as f64 / 1024.0).sqrt();
        self.ram_ns + self.ram_level_ns * levels(words) as f64 + self.ram_wire_ns * root
    }

    /// Reading a word of an array (ns).
    pub(super) fn array_ns(&self, words: u64, bits: u64) -> f64 {
        let in_registers = words.min(super::hardware::REGISTER_WORDS);
        let choices = in_registers + u64::from(words > in_registers);
        self.choice_ns(choices).max(self.memory_ns(words - in_registers, bits))
    }
}

/// Levels of carries of so many bits after the first one.
fn levels_after_first(bits: u64) -> f64 {
    levels(bits).saturating_sub(1) as f64
}

/// Rows of full adders from `rows` words to two: Dadda's sequence 2, 3, 4, 6, 9, 13...
fn dadda_rows(rows: u64) -> u64 {
    let (mut reach, mut n) = (2, 0);
    while reach < rows {
        reach = reach * 3 / 2;
        n += 1;
    }
    n
}
