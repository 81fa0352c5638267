//! What clusters and board have once: bundle generator, result merge, dispatcher, host link.
//!
//! ```text
//! bundle generator   descriptor | products and sums of the four kinds | choice | normalisation | rounding
//! ```
//! The generator's chain is cut into [`GENERATOR_STAGES`] stages, whose latency the cycle model leaves out: it gives a ray a
//! cycle, as here. Its table of directions is kept for an eighth of the square and mirrored (ASSUMED).
//! The host link is a bus interface's registers and counters; bus drivers are left out.

use crate::datapath::bundle::{HEMISPHERE_LOG2, JITTER_BITS};
use crate::packet::ray_bytes;

use super::design::{BUNDLE_RAYS, Block, Design};
use super::front::arbiters;
use super::hardware::{Hardware, index_bits, levels};
use super::pipeline::Pipeline;

/// Stages of a bundle generator's chain: ASSUMED.
const GENERATOR_STAGES: u32 = 8;
/// Bits of an index or address in the host's memory, and of an estimate's sum: ASSUMED.
pub(super) const INDEX_BITS: u64 = 32;
const SUM_BITS: u64 = 48;

/// Entries of the table of directions: a triangle of the 33 x 33 places of a quarter, and the row of the rim.
fn table_words() -> u64 {
    let quarter = (1 << (HEMISPHERE_LOG2 - 1)) + 1;
    quarter * (quarter + 1) / 2 + quarter
}

/// The bundle generators of all clusters.
pub(super) fn bundle_generator(design: &Design<'_>) -> Block {
    let (timing, wire) = (design.timing, |name: &str| design.wire(name));
    let (tile, fan) = (wire("tile_direction"), wire("fan_product"));
    let (word, raw) = (wire("hemisphere_word"), wire("hemisphere_direction"));
    let target = wire("target_direction");
    // A fan's places have 6 + 12 bits and a sign.
    let place = index_bits(BUNDLE_RAYS) + u64::from(JITTER_BITS) + 1;
    let raw = raw.max(tile).max(fan);
    let rest = 3 * design.coordinate + design.place;
    let mut p = Pipeline::new(timing, 1, 9 * tile + rest);
    let kinds = vec![
        (timing.sum_of_products(3, word, word, raw), 3),
        (timing.sum_of_products(2, place, wire("a"), fan).then(timing.adder(target)), 3),
        (timing.adder(tile), 6),
        (timing.adder(target), 3),
    ];
    p.phase("raw direction", kinds, rest);
    p.phase("choice of kind", vec![(timing.multiplexer(raw, 4), 3)], rest);
    p.phase("leading zeros", vec![(timing.any(raw), 1)], 3 * raw + rest);
    p.phase("normalisation", vec![(timing.shifter(raw, levels(raw)), 3)], rest);
    p.phase("rounding", vec![(timing.magnitude(design.direction), 3)], rest);
    let cut = p.cut(GENERATOR_STAGES);
    let (words, width) = (table_words(), 3 * word);
    let descriptor = 9 * tile + 3 * design.coordinate + 2 * u64::from(JITTER_BITS) + INDEX_BITS;
    let hardware = p.hardware
        + Hardware::memory(words, width)
        + Hardware::held(descriptor)
        + Hardware::registers(cut.register_bits);
    let table = timing.memory_ns(words, width);
    let paths = [(cut.longest_ns, cut.path), (table, "table of directions".to_owned())];
    // One of the four kinds works: reckoned as half of them all.
    let event_pj = 0.5 * (design.logic_pj(&p.work) + design.access_pj(words, width));
    Block::new("bundle_generator", design.clusters(), hardware, paths, event_pj)
}

/// The result merges of all clusters.
pub(super) fn result_merge(design: &Design<'_>) -> Block {
    let (spec, timing) = (design.spec, design.timing);
    let slots = u64::from(spec.clusters.bundle_slots);
    let links = end_links(design);
    // The job, rays to come, entries sent, its place in the order of ending.
    let slot = Hardware::held(2 * INDEX_BITS + 3 * 7 + index_bits(slots));
    let (rays, hit) = (slots * BUNDLE_RAYS, design.hit);
    let hardware = slot.times(slots)
        + Hardware::array(rays, hit)
        + arbiters(1, links)
        + Hardware::multiplexer(design.place + 7, links)
        + Hardware::multiplexer(2 * INDEX_BITS, slots);
    let path = timing.arbiter_ns(links) + timing.choice_ns(links) + timing.adder_ns(7);
    let paths = [(path, "arbiter over ends".to_owned()), (timing.array_ns(rays, hit), "hits".to_owned())];
    let event_pj = design.access_pj(rays, hit);
    Block::new("result_merge", design.clusters(), hardware, paths, event_pj)
}

/// Links on which a cluster's rays or bundles end.
pub(super) fn end_links(design: &Design<'_>) -> u64 {
    let c = &design.spec.clusters;
    u64::from(if design.in_shells() { c.modules } else { c.modules * c.ctus_per_icu })
}

/// The dispatcher.
pub(super) fn dispatcher(design: &Design<'_>) -> Block {
    let (timing, clusters) = (design.timing, design.clusters());
    // A range, what is left of it, fetches asked for.
    let cluster = Hardware::held(2 * INDEX_BITS + SUM_BITS + INDEX_BITS);
    let sums = timing.adder(SUM_BITS).hardware.times(2) + timing.comparator(SUM_BITS).hardware;
    let hardware = cluster.times(clusters)
        + Hardware::held(3 * SUM_BITS + INDEX_BITS)
        + sums
        + arbiters(1, clusters)
        + Hardware::multiplexer(2 * INDEX_BITS + SUM_BITS, clusters);
    let path = timing.arbiter_ns(clusters) + timing.choice_ns(clusters) + timing.adder_ns(INDEX_BITS);
    let paths = [
        (path, "arbiter over clusters, range".to_owned()),
        (timing.adder_ns(SUM_BITS), "sum of estimates".to_owned()),
    ];
    Block::new("dispatcher", 1, hardware, paths, design.logic_pj(&sums))
}

/// The host bus's interface and DMA.
pub(super) fn host_link(design: &Design<'_>) -> Block {
    let (spec, timing, clusters) = (design.spec, design.timing, design.clusters());
    let width = u64::from(spec.bus.width_bits);
    let burst_words = u64::from(spec.bus.burst_bytes) * 8 / width;
    let most = most_descriptor_bits(design);
    let hardware = Hardware::array(burst_words, width)
        + Hardware::held(4 * INDEX_BITS + 2 * width)
        + timing.adder(INDEX_BITS).hardware.times(2)
        + Hardware::multiplexer(design.hit, clusters)
        + arbiters(2, clusters)
        + Hardware::held(index_bits(most));
    let path = timing.arbiter_ns(clusters) + timing.choice_ns(clusters);
    let paths = [
        (path, "arbiter over clusters".to_owned()),
        (timing.adder_ns(INDEX_BITS), "address".to_owned()),
        (timing.array_ns(burst_words, width), "burst".to_owned()),
    ];
    let event_pj = design.access_pj(burst_words, width);
    Block::new("host_link", 1, hardware, paths, event_pj)
}

/// Bits of the longest descriptor: 64 explicit rays.
pub(super) fn most_descriptor_bits(design: &Design<'_>) -> u64 {
    BUNDLE_RAYS * u64::from(ray_bytes(&design.spec.formats)) * 8
}
