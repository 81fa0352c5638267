//! ICUs from the literature of the time: simple counts of their own.
//!
//! ```text
//! cordic-unfolded   3 (n + 4) stages of three adders, 20 stages of a multiplier's rows     interval 1
//! cordic-serial     one such stage with its shifters and a table of angles, used 3 n times
//! subdivision       de Casteljau's halving of a bicubic patch's 48 words, a stack of patches, boxes against the ray
//! ```
//! All ASSUMED from the structure that the sources describe: Volder 1959 (CORDIC) for the rotations, Pulleyblank, Kapenga 1987
//! (The feasibility of a VLSI chip for ray tracing bicubic patches) for the subdivision. Their timing is
//! `BoardSpec::icu_timing`'s; these counts say what a chip of that kind costs, not what a published one did.

use crate::spec::IcuUnit;

use super::design::{Block, Design};
use super::hardware::{Hardware, levels};
use super::icu::{job_register, tag_bits};

/// Words of a rotation: x, y, angle.
const ROTATION_WORDS: u64 = 3;
/// Stages of the unfolded unit beside its rotations: `BoardSpec::icu_timing`.
const OTHER_STAGES: u64 = 20;
/// Control points of a bicubic patch, three coordinates each.
const CONTROL_WORDS: u64 = 48;
/// Adders that halve a curve of four points: 6, of the 16 curves' coordinates of a patch, 12 at once.
const HALVING_ADDERS: u64 = 6 * 12;

/// The block of all ICUs of this kind.
pub(super) fn block(design: &Design<'_>) -> Block {
    let timing = design.timing;
    let (hardware, path_ns, path, work) = match design.spec.icu.unit {
        IcuUnit::CordicUnfolded => cordic(design, true),
        IcuUnit::CordicSerial => cordic(design, false),
        _ => subdivision(design),
    };
    let tests = design.timing.comparator(design.t);
    let cycles = f64::from(design.spec.icu_timing().initiation_interval);
    let event_pj = design.logic_pj(&work) * cycles;
    let hardware = hardware + job_register(design) + tests.hardware;
    let paths = [(path_ns, path.to_owned()), (tests.total_ns() + timing.step_ns(), "range test".to_owned())];
    Block::new("icu", design.modules(), hardware, paths, event_pj)
}

/// Hardware, path, its name, and what works in a cycle.
type Counted = (Hardware, f64, &'static str, Hardware);

fn cordic(design: &Design<'_>, is_unfolded: bool) -> Counted {
    let timing = design.timing;
    let n = u64::from(design.spec.icu.cordic_bits);
    // Guard bits against the rounding of n rotations.
    let word = n + levels(n);
    let adder = timing.adder_subtractor(word);
    let adders = adder.hardware.times(ROTATION_WORDS);
    let words = ROTATION_WORDS * word;
    if is_unfolded {
        let rotations = 3 * (n + 4);
        let rows = timing.carry_save_row(2 * word).hardware.times(OTHER_STAGES);
        let stages = rotations + OTHER_STAGES;
        let logic = adders.times(rotations) + rows;
        let registers = Hardware::registers(stages * (words + tag_bits(design)));
        return (logic + registers, adder.total_ns(), "rotation", logic);
    }
    // Two shifters, and an angle an iteration.
    let shifter = timing.shifter(word, levels(word));
    let logic = adders + shifter.hardware.times(2) + Hardware::multiplexer(words, 2);
    let held = Hardware::held(words + tag_bits(design)) + Hardware::memory(n, word);
    (logic + held, shifter.total_ns() + adder.total_ns(), "shift and rotation", logic)
}

fn subdivision(design: &Design<'_>) -> Counted {
    let timing = design.timing;
    // A bit more for the sums of two.
    let word = design.coordinate + 1;
    let adder = timing.adder(word);
    let depth = u64::from(design.spec.formats.coord_frac_bits);
    let boxes = timing.comparator(word);
    let logic = adder.hardware.times(HALVING_ADDERS) + boxes.hardware.times(CONTROL_WORDS);
    let patch = CONTROL_WORDS * word;
    let held = Hardware::held(2 * patch + tag_bits(design)) + Hardware::array(depth, patch);
    let halving_ns = 3.0 * adder.total_ns();
    (logic + held, halving_ns.max(boxes.total_ns()), "halving of a curve", logic)
}
