//! What leads a module's rays to patches, and what gathers their hits: shell tracker, patch loader, reducer.
//!
//! ```text
//! shell tracker   a bundle: bits a ray, cells, limits; a table of cells (associative) and masks; the rays' words
//! patch loader    slots: registers and a line of list entries each; grid: mailboxes   shells: stations, mask logic
//! reducer         best hit a ray, a comparator
//! ```
//! Paths: a slot's turn is chosen in the cycle before its look-up (ASSUMED), so arbiters and caches are paths of their
//! own. Structure: `blocks/`.

use crate::functional::MAILBOX_ENTRIES;
use crate::memory::LINE_WORDS;

use super::design::{BUNDLE_RAYS, Block, COUNT_BITS, Design, PATCH_BITS};
use super::hardware::{Hardware, levels};

/// Bits of a distance in cells: 256 at most.
const RADIUS_BITS: u64 = 9;
/// Counters of a bundle: rays, arrived, cursor, shell, entries, tests, prefetches, state.
const BUNDLE_COUNTERS: u64 = 7 + 7 + 6 + 8 + RADIUS_BITS + 9 + COUNT_BITS + 7 + 6;
/// Registers of a slot's state, one bit a state: 11 in grid partition, 9 in shells; of a station 5.
const SLOT_STATES: u64 = 11;
const STATION_STATES: u64 = 5;
/// NAND2 equivalents of an arbiter, a requester and grant: ASSUMED.
pub(super) const ARBITER_GATES: f64 = 8.0;
/// Arbiters of a loader: header and list, record, mask or mailbox, done.
const LOADER_PORTS: u64 = 4;

/// Logic of arbiters.
pub(super) fn arbiters(n: u64, requesters: u64) -> Hardware {
    let gates = ARBITER_GATES * (n * requesters) as f64;
    Hardware::logic(gates, gates / 4.0)
}

/// The shell trackers of all modules.
pub(super) fn shell_tracker(design: &Design<'_>) -> Block {
    let (spec, timing) = (design.spec, design.timing);
    let entries = u64::from(spec.shells.entries);
    let ctus = u64::from(spec.clusters.ctus_per_icu);
    let (cell, t) = (design.cell, design.t);
    // Open, walking, in a step, fresh.
    let bits = Hardware::held(4 * BUNDLE_RAYS + BUNDLE_COUNTERS);
    let rays = Hardware::array(BUNDLE_RAYS, 2 * cell) + Hardware::array(BUNDLE_RAYS, t);
    let keys = Hardware::held(entries * (cell + 1)) + timing.equality(cell).hardware.times(entries);
    let masks = Hardware::array(entries, BUNDLE_RAYS);
    let ahead = if spec.shells.prefetch { Hardware::array(BUNDLE_RAYS, cell) } else { Hardware::default() };
    let slots = design.module_slots();
    let bundle = bits + rays + keys + masks + ahead;
    let words = Hardware::array(design.module_rays(), design.ray);
    let choices = Hardware::multiplexer(cell + BUNDLE_RAYS, slots) + arbiters(3, slots) + arbiters(2, ctus);
    let barrier = timing.comparator(t).hardware + timing.adder(RADIUS_BITS).hardware;
    let hardware = bundle.times(slots) + words + choices + barrier;
    let walk = timing.arbiter_ns(BUNDLE_RAYS) + timing.choice_ns(slots);
    let table = timing.equality_ns(cell)
        + timing.step_ns() * levels(entries).div_ceil(2) as f64
        + timing.array_ns(entries, BUNDLE_RAYS);
    let paths = [
        (walk, "next walking ray".to_owned()),
        (table, "table of cells, mask".to_owned()),
        (timing.array_ns(design.module_rays(), design.ray), "rays' words".to_owned()),
    ];
    let search = timing.equality(cell).hardware.times(entries);
    let event_pj = design.logic_pj(&search)
        + design.access_pj(entries, BUNDLE_RAYS)
        + design.access_pj(design.module_rays(), design.ray);
    Block::new("shell_tracker", design.modules(), hardware, paths, event_pj)
}

/// The patch loaders of all modules.
pub(super) fn patch_loader(design: &Design<'_>) -> Block {
    let (spec, timing) = (design.spec, design.timing);
    let slots = u64::from(spec.loader.slots);
    let line_words = u64::from(LINE_WORDS);
    let address = design.line + 4;
    // Address, entries left, entries left in the line, tests, line awaited.
    let common = design.cell + address + COUNT_BITS + 5 + COUNT_BITS + design.line + SLOT_STATES;
    let choices = arbiters(LOADER_PORTS, slots);
    let (hardware, work) = if design.in_shells() {
        let stations = u64::from(spec.loader.stations);
        let slot = Hardware::held(design.slot + BUNDLE_RAYS + common + slots);
        let lists = Hardware::array(slots * line_words, PATCH_BITS);
        let station =
            Hardware::held(design.slot + PATCH_BITS + BUNDLE_RAYS + design.line + STATION_STATES + stations);
        let verdict =
            timing.any(BUNDLE_RAYS).hardware + Hardware::logic(2.0 * BUNDLE_RAYS as f64, BUNDLE_RAYS as f64);
        let chosen = Hardware::multiplexer(BUNDLE_RAYS + address, slots)
            + Hardware::multiplexer(BUNDLE_RAYS + PATCH_BITS, stations)
            + arbiters(2, stations);
        (slot.times(slots) + lists + station.times(stations) + verdict + chosen + choices, verdict)
    } else {
        let mailbox = MAILBOX_ENTRIES as u64 * PATCH_BITS;
        // Every slot compares an entry a cycle, so it has its line in registers, and reads its ray's mailbox.
        let compare = timing.equality(PATCH_BITS).hardware.times(MAILBOX_ENTRIES as u64);
        let slot = Hardware::held(design.ray + design.place + design.context + PATCH_BITS + common)
            + Hardware::held(line_words * PATCH_BITS)
            + Hardware::multiplexer(PATCH_BITS, line_words)
            + compare;
        let mailboxes = Hardware::array(design.module_rays(), mailbox);
        let chosen = Hardware::multiplexer(design.ray + address, slots);
        (slot.times(slots) + mailboxes + chosen + choices, compare)
    };
    let mut paths = vec![(timing.arbiter_ns(slots) + timing.choice_ns(slots), "turn of a slot".to_owned())];
    if design.in_shells() {
        let stations = u64::from(spec.loader.stations);
        paths
            .push((timing.arbiter_ns(stations) + timing.choice_ns(stations), "turn of a station".to_owned()));
        paths.push((timing.array_ns(slots * line_words, PATCH_BITS), "list entry".to_owned()));
    } else {
        let mailbox = timing.array_ns(design.module_rays(), MAILBOX_ENTRIES as u64 * PATCH_BITS);
        let compare = timing.equality_ns(PATCH_BITS) + timing.step_ns();
        paths.push((mailbox + compare, "mailbox".to_owned()));
    }
    Block::new("patch_loader", design.modules(), hardware, paths, design.logic_pj(&work))
}

/// The reducers of all modules.
pub(super) fn reducer(design: &Design<'_>) -> Block {
    let timing = design.timing;
    let (rays, hit) = (design.module_rays(), design.hit);
    let compare = timing.comparator(design.t + PATCH_BITS);
    let hardware = Hardware::array(rays, hit) + compare.hardware + Hardware::multiplexer(hit, 2);
    let path = timing.array_ns(rays, hit) + compare.total_ns() + timing.choice_ns(2);
    let paths = [(path, "best hit, comparison".to_owned())];
    let event_pj = design.logic_pj(&compare.hardware) + 2.0 * design.access_pj(rays, hit);
    Block::new("reducer", design.modules(), hardware, paths, event_pj)
}
