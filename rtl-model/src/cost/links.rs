//! The FIFOs between blocks: arrays and their pointers.
//!
//! ```text
//! entries x bits of a token --> array, two pointers, a count      a valid/ready link: its 2-entry skid buffer
//! ```
//! Which there are: `blocks/{module,cluster}.rs`. A ray's words travel beside its tokens (`RayStore`), a patch's record
//! beside its job. The events of a link are the tokens through it; they are reckoned as one for each cycle in which a
//! block works, on a link of mean width.

use super::design::{BUNDLE_RAYS, Block, Design, LINE_BITS};
use super::hardware::{Hardware, index_bits};
use super::icu::job_bits;
use super::shared::{INDEX_BITS, end_links, most_descriptor_bits};

/// Entries of a skid buffer.
const SKID: u64 = 2;
/// NAND2 equivalents of a pointer bit: increment and comparison. ASSUMED.
const POINTER_GATES: f64 = 8.0;

/// FIFOs of one shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fifos {
    pub(super) n: u64,
    pub(super) entries: u64,
    pub(super) bits: u64,
}

/// Hardware of a FIFO.
pub(super) fn fifo(entries: u64, bits: u64) -> Hardware {
    let pointer = index_bits(entries);
    let pointers = 2 * pointer + index_bits(entries + 1);
    let gates = POINTER_GATES * pointers as f64;
    Hardware::array(entries, bits) + Hardware::held(pointers) + Hardware::logic(gates, gates / 4.0)
}

/// Every FIFO of the board.
pub(super) fn all(design: &Design<'_>) -> Vec<Fifos> {
    let spec = design.spec;
    let (clusters, modules, ctus) = (design.clusters(), design.modules(), design.ctus());
    let depth = u64::from(spec.fifos.ctu_icu);
    let new_ray = design.ray + design.place + 7;
    let ends = design.place + 7;
    let of = |n, entries, bits| Fifos { n, entries, bits };
    let mut links = vec![
        of(modules, u64::from(spec.fifos.icu_reducer), design.hit + design.place + design.context),
        of(clusters * end_links(design), SKID, new_ray),
        of(clusters * end_links(design), SKID, ends),
        // To the cluster's memory: lines wanted.
        of(modules * 2, SKID, design.line + 1),
        // The host's side: descriptors by ray, results with their tags, estimates.
        of(
            clusters,
            u64::from(spec.fifos.commands) * BUNDLE_RAYS,
            most_descriptor_bits(design) / BUNDLE_RAYS,
        ),
        of(clusters, u64::from(spec.fifos.results), design.hit + INDEX_BITS),
        of(clusters, SKID, 2 * INDEX_BITS),
        of(1, SKID, 2 * INDEX_BITS + index_bits(clusters)),
        // The DRAM's side.
        of(clusters, SKID, design.line + 1 + LINE_BITS),
        of(clusters, SKID, design.line + LINE_BITS),
    ];
    if design.in_shells() {
        let step = design.ray + design.place + 2 * design.cell + 9 + design.t + 1;
        links.extend([
            of(ctus, SKID, step),
            of(ctus, depth, design.place + design.cell + 3),
            of(modules, depth, design.slot + design.cell + BUNDLE_RAYS),
            of(modules, depth, job_bits(design)),
            // Masks go back, whole lines.
            of(modules, SKID, design.line + 1 + LINE_BITS),
        ]);
    } else {
        let request = design.ray + design.place + design.context + design.cell + 1;
        links.extend([of(ctus, depth, request), of(modules, SKID, job_bits(design))]);
    }
    links
}

/// All links as a block.
pub(super) fn block(design: &Design<'_>) -> Block {
    let timing = design.timing;
    let links = all(design);
    let n: u64 = links.iter().map(|l| l.n).sum();
    let hardware = links.iter().map(|l| fifo(l.entries, l.bits).times(l.n)).sum::<Hardware>();
    let paths = links.iter().map(|l| (timing.array_ns(l.entries, l.bits), String::from("queue")));
    let longest = paths.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
    let access = |l: &Fifos| 2.0 * design.access_pj(l.entries, l.bits) * l.n as f64;
    let event_pj = links.iter().map(access).sum::<f64>() / n.max(1) as f64;
    Block { kind: "links", instances: n, hardware, path_ns: longest.0, path: longest.1, event_pj }
}
