//! Caches, cluster buffers, the DRAM's controller.
//!
//! ```text
//! cache: tags, states, order of use, lines | a comparator a way | miss registers: line number, comparator, line
//! ```
//! Tags are what of a line's number the set does not say, of as many lines as the board's DRAM has. All ways are read at
//! once with their tags and chosen between: the path of a look-up is the longer of tags and comparison, and lines, then
//! the choice. The cluster buffer looks at tags first and then reads one line; both together take `cycles`, cut between
//! tags, decoder and bit lines. A cache of 0 bytes is its miss registers, a line each. DRAM chips are left out.

use crate::spec::BoardSpec;

use super::design::{Block, COUNT_BITS, Design, LINE_BITS};
use super::hardware::{Hardware, index_bits};
use super::operators::{Operator, Part};
use super::pipeline::Pipeline;

/// A cache's shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) bytes: u32,
    pub(super) ways: u32,
    pub(super) miss_registers: u32,
    /// Lines are written back: a dirty bit a line.
    pub(super) is_written: bool,
}

impl Shape {
    fn lines(&self) -> u64 {
        u64::from(self.bytes) * 8 / LINE_BITS
    }

    fn ways(&self) -> u64 {
        u64::from(self.ways).min(self.lines()).max(1)
    }

    fn sets(&self) -> u64 {
        self.lines() / self.ways()
    }

    /// Bits of a tag, of lines numbered in `line_bits`.
    pub(super) fn tag_bits(&self, line_bits: u64) -> u64 {
        line_bits.saturating_sub(index_bits(self.sets()))
    }

    /// Bits of a set beside its lines: tag, valid, dirty, and the place of each way in the order of use.
    pub(super) fn set_bits(&self, line_bits: u64) -> u64 {
        let way = self.tag_bits(line_bits) + 1 + u64::from(self.is_written) + index_bits(self.ways());
        self.ways() * way
    }
}

/// Hardware of a cache.
pub(super) fn cache(design: &Design<'_>, shape: &Shape) -> Hardware {
    let line = design.line;
    let registers = u64::from(shape.miss_registers);
    let matches = design.timing.equality(line).hardware.times(registers);
    let open =
        Hardware::held(line + LINE_BITS + 2).times(registers) + Hardware::multiplexer(LINE_BITS, registers);
    if shape.lines() == 0 {
        return matches + open;
    }
    let tags = Hardware::memory(shape.sets(), shape.set_bits(line));
    let lines = Hardware::memory(shape.sets(), shape.ways() * LINE_BITS);
    let compare = design.timing.equality(shape.tag_bits(line)).hardware.times(shape.ways());
    tags + lines + compare + Hardware::multiplexer(LINE_BITS, shape.ways()) + matches + open
}

/// Reading tags and comparing them (ns).
fn tag_ns(design: &Design<'_>, shape: &Shape) -> f64 {
    let timing = design.timing;
    let open = timing.equality_ns(design.line) + timing.choice_ns(u64::from(shape.miss_registers));
    if shape.lines() == 0 {
        return open;
    }
    let read = timing.memory_ns(shape.sets(), shape.set_bits(design.line));
    open.max(read + timing.equality_ns(shape.tag_bits(design.line)))
}

/// A whole look-up in a cycle (ns).
fn look_up_ns(design: &Design<'_>, shape: &Shape) -> f64 {
    let lines = design.timing.memory_ns(shape.sets(), shape.ways() * LINE_BITS);
    tag_ns(design, shape).max(lines) + design.timing.choice_ns(shape.ways())
}

/// Energy of a look-up (pJ).
fn look_up_pj(design: &Design<'_>, shape: &Shape) -> f64 {
    let tags = design.access_pj(shape.sets(), shape.set_bits(design.line));
    tags + design.access_pj(shape.sets(), shape.ways() * LINE_BITS)
}

/// The caches of all modules: patches, lists, and in shells masks.
pub(super) fn caches(design: &Design<'_>) -> Vec<Block> {
    let spec = design.spec;
    let bytes = spec.effective_cache_bytes();
    let (patch, list, mask) = (&spec.patch_cache, &spec.list_cache, &spec.mask_cache);
    let shape = |bytes, ways, miss_registers, is_written| Shape { bytes, ways, miss_registers, is_written };
    let mut all = vec![
        ("patch_cache", shape(bytes.patch, patch.ways, patch.miss_registers, false)),
        ("list_cache", shape(bytes.list, list.ways, list.miss_registers, false)),
    ];
    if design.in_shells() {
        all.push(("mask_cache", shape(bytes.mask, mask.ways, mask.miss_registers, true)));
    }
    let block = |(kind, shape): (&'static str, Shape)| {
        let mut hardware = cache(design, &shape);
        if shape.is_written {
            // Which lines were written back: 64 bits a bundle slot.
            hardware += Hardware::held(64 * u64::from(spec.clusters.bundle_slots));
        }
        let paths = [(look_up_ns(design, &shape), "tags, lines, choice of way".to_owned())];
        Block::new(kind, design.modules(), hardware, paths, look_up_pj(design, &shape))
    };
    all.into_iter().map(block).collect()
}

/// Cache links of a cluster: as many requests may wait for its memory.
pub(super) fn cache_links(spec: &BoardSpec) -> u64 {
    u64::from(spec.clusters.modules) * if spec.partition.is_shells() { 3 } else { 2 }
}

/// The memory of every cluster.
pub(super) fn cluster_buffer(design: &Design<'_>) -> Block {
    let (spec, timing) = (design.spec, design.timing);
    let buffer = &spec.cluster_buffer;
    let shape = Shape {
        bytes: spec.effective_cache_bytes().buffer,
        ways: buffer.ways,
        miss_registers: buffer.miss_registers,
        is_written: false,
    };
    let sources = cache_links(spec);
    // A miss register keeps who waits; the line goes past it.
    let registers = u64::from(buffer.miss_registers);
    let open = Hardware::held((design.line + sources + 1) * registers)
        + timing.equality(design.line).hardware.times(registers);
    let mut hardware =
        open + Hardware::multiplexer(design.line + 1, sources) + Hardware::multiplexer(LINE_BITS, 2);
    let tags_ns = timing.arbiter_ns(sources) + tag_ns(design, &shape);
    let mut longest = (tags_ns, "tags".to_owned());
    let mut event_pj = design.access_pj(shape.sets(), shape.set_bits(design.line));
    if shape.lines() > 0 {
        let tags = Hardware::memory(shape.sets(), shape.set_bits(design.line));
        let compare = timing.equality(shape.tag_bits(design.line)).hardware.times(shape.ways());
        hardware += tags + Hardware::memory(shape.lines(), LINE_BITS) + compare;
        event_pj += design.access_pj(shape.lines(), LINE_BITS);
        // Where a line lies and for whom it is, then the line.
        let decoder_ns = timing.ram_level_ns * index_bits(shape.lines()) as f64;
        let array_ns = timing.memory_ns(shape.lines(), LINE_BITS) - decoder_ns;
        let mut chain = Pipeline::new(timing, 1, design.line);
        let slices = [
            ("tags", tags_ns, design.line),
            ("decoder", decoder_ns, design.line),
            ("line", array_ns, LINE_BITS),
        ];
        for (name, delay_ns, bits_after) in slices {
            let parts = vec![Part { delay_ns, bits_after }];
            let access = Operator { hardware: Hardware::default(), in_bits: design.line, parts };
            chain.phase(name, vec![(access, 1)], sources);
        }
        let cut = chain.cut(buffer.cycles);
        hardware += Hardware::registers(cut.register_bits);
        longest = (cut.longest_ns, cut.path);
    }
    Block::new("cluster_buffer", design.clusters(), hardware, [longest], event_pj)
}

/// The controller of the DRAM: open rows, one line under way.
pub(super) fn dram(design: &Design<'_>) -> Block {
    let (spec, timing) = (design.spec, design.timing);
    let lines_per_row = u64::from(spec.dram.row_bytes) * 8 / LINE_BITS;
    let row = design.line.saturating_sub(index_bits(lines_per_row));
    let banks = u64::from(spec.dram.banks);
    let clusters = design.clusters();
    let hardware = Hardware::held(banks * (row + 1) + LINE_BITS + design.line + COUNT_BITS)
        + Hardware::multiplexer(row, banks)
        + timing.equality(row).hardware
        + Hardware::multiplexer(design.line + LINE_BITS, clusters);
    let path = timing.arbiter_ns(clusters) + timing.choice_ns(banks) + timing.equality_ns(row);
    let paths = [(path, "arbiter over clusters, open row".to_owned())];
    Block::new("dram", 1, hardware, paths, design.logic_pj(&hardware))
}
