//! The CTU: a step's datapath as a chain cut into `ctu.depth` stages, contexts, the occupancy bit of every cell.
//!
//! ```text
//! distances 3, speeds 3 | crossing products 6 | nearest plane 3 | choice of axis | end test
//! ```
//! In grid partition a context holds its ray's words, cell, best hit and counters; in shells the tracker does, and a
//! context is the place of a step under way. A ready context is chosen and read before the chain, the next cell's occupancy
//! bit read beside its end test: paths of their own.
//! Operators: `datapath/cell_step.rs`. The occupancy bits are on the CTU's chip, as `blocks/ctu.rs` assumes; a board whose
//! grid is chosen for the scene has room for 32 cells an axis.

use super::design::{Block, COUNT_BITS, Design};
use super::hardware::Hardware;
use super::pipeline::Pipeline;

/// Bits that the occupancy memory gives at once: ASSUMED.
const OCCUPANCY_WORD: u64 = 32;
/// Bits of a cell's index along an axis, and a sign.
const INDEX_BITS: u64 = 8;
/// State of a context beside its words: entering, fresh, list done, ready, free.
const CONTEXT_FLAGS: u64 = 5;

/// The block of all CTUs.
pub(super) fn block(design: &Design<'_>) -> Block {
    let (spec, timing) = (design.spec, design.timing);
    let pipeline = datapath(design);
    let cut = pipeline.cut(spec.ctu.depth);
    let contexts = u64::from(spec.ctu.contexts);
    let bits = context_bits(design);
    let held = if design.in_shells() {
        Hardware::held(contexts * (design.place + 1))
    } else {
        Hardware::array(contexts, bits) + Hardware::held(contexts * CONTEXT_FLAGS)
    };
    let (words, word) = occupancy(design);
    let hardware = pipeline.hardware
        + Hardware::registers(cut.register_bits + u64::from(spec.ctu.depth))
        + held
        + Hardware::memory(words, word)
        + Hardware::multiplexer(1, word);
    let choice = if design.in_shells() {
        timing.arbiter_ns(contexts)
    } else {
        timing.arbiter_ns(contexts).max(timing.array_ns(contexts, bits))
    };
    let bit_ns = timing.memory_ns(words, word) + timing.choice_ns(word);
    let paths = [
        (cut.longest_ns, cut.path),
        (choice, "next context".to_owned()),
        (bit_ns, "occupancy bit".to_owned()),
    ];
    let context_pj = if design.in_shells() { 0.0 } else { 2.0 * design.access_pj(contexts, bits) };
    let event_pj = design.logic_pj(&pipeline.work) + design.access_pj(words, word) + context_pj;
    Block::new("ctu", design.ctus(), hardware, paths, event_pj)
}

/// Ray, cell, best hit, tests outstanding, place.
pub(super) fn context_bits(design: &Design<'_>) -> u64 {
    design.ray + design.cell + design.hit + COUNT_BITS + design.place
}

/// Words and width of the memory of occupancy bits.
fn occupancy(design: &Design<'_>) -> (u64, u64) {
    let n_cells = 1_u64 << (3 * design.grid_log2());
    (n_cells.div_ceil(OCCUPANCY_WORD), OCCUPANCY_WORD.min(n_cells))
}

/// The chain of a step.
pub(super) fn datapath<'a>(design: &Design<'a>) -> Pipeline<'a> {
    let timing = design.timing;
    let wire = |name| design.wire(name);
    let (plane, speed) = (wire("cell_plane"), design.direction);
    let (product, end) = (wire("cell_product"), wire("end_product"));
    let tags = design.place + design.context + design.cell + design.t;
    let mut p = Pipeline::new(timing, design.spec.ctu.initiation_interval, design.ray + tags);
    let distances = vec![(timing.adder_subtractor(plane), 3), (timing.magnitude(speed), 3)];
    p.phase("distances", distances, tags);
    let operands = 3 * (plane + speed);
    p.phase(
        "crossing products",
        vec![(timing.sum_of_products(1, plane, speed, product), 6)],
        operands + tags,
    );
    p.phase("nearest plane", vec![(timing.comparator(product), 3)], operands + tags);
    let axis = timing.multiplexer(plane + speed, 3);
    p.phase("choice of axis", vec![(axis, 1), (timing.adder(INDEX_BITS), 1)], design.cell + tags);
    let end_test = timing.sum_of_products(1, wire("t") + 1, speed, end).then(timing.comparator(end));
    // How far the next cell is from the apex's, of which the largest is compared with the shell's radius.
    let distance = timing.adder(INDEX_BITS).then(timing.comparator(INDEX_BITS));
    let n_distances = if design.in_shells() { 3 } else { 0 };
    p.phase("end test", vec![(end_test, 1), (distance, n_distances)], design.cell + tags);
    p
}
