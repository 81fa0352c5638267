//! The ICU: its datapath as a chain, cut into `icu.depth` stages.
//!
//! ```text
//! translate 12 | edge normals 15 | edge values 5, face normals 6 | signs, sums 2 | choice | numerator | magnitudes
//!   | range check | T + 3 rows of a non-restoring division | correction | rounding | range test
//! ```
//! One test takes a whole quad: five edges, both triangles' sums, and one division, of the triangle that the ray meets.
//! A division unit named in `[division]` stands behind the magnitudes, as a block of its own (`division`).
//! Beside the chain: the register of the job at hand. In shells a ray's words come from the module's table of rays, read
//! in a cycle of their own.
//! Widths: `Formats::width_table`; operators: `datapath/ray_patch.rs`. Not modelled: a second division for a bent quad both of
//! whose triangles a ray meets; what holds the pipeline when its output is full (ASSUMED: the clock is gated).

use crate::fixed::Rounding;
use crate::spec::{DivisionUnit, IcuUnit};

use super::design::{BUNDLE_RAYS, Block, Design, PATCH_BITS};
use super::hardware::Hardware;
use super::pipeline::Pipeline;
use super::{division, literature};

/// The blocks of all ICUs: the unit, and its division unit where one is named.
pub(super) fn blocks(design: &Design<'_>) -> Vec<Block> {
    if design.spec.icu.unit != IcuUnit::FixedPipelined {
        return vec![literature::block(design)];
    }
    let pipeline = datapath(design);
    let cut = pipeline.cut(design.spec.icu.depth);
    let valid = Hardware::registers(u64::from(design.spec.icu.depth));
    let hardware = pipeline.hardware + Hardware::registers(cut.register_bits) + valid + job_register(design);
    let event_pj = design.logic_pj(&pipeline.work);
    let paths = [(cut.longest_ns, cut.path), ray_path(design)];
    let icu = Block::new("icu", design.modules(), hardware, paths, event_pj);
    let named = (design.spec.division.unit != DivisionUnit::InPipeline).then(|| division::block(design));
    std::iter::once(icu).chain(named).collect()
}

/// What travels beside a test: its ray's place, its context, the patch's number, t_max, a sign.
pub(super) fn tag_bits(design: &Design<'_>) -> u64 {
    design.place + design.context + PATCH_BITS + design.t + 1
}

/// The job at hand: the record, and the rays to test with it (shells) or the ray (grid).
pub(super) fn job_register(design: &Design<'_>) -> Hardware {
    Hardware::held(job_bits(design))
}

/// Bits of a job: record and rays, or record, ray and context.
pub(super) fn job_bits(design: &Design<'_>) -> u64 {
    let rays = if design.in_shells() {
        BUNDLE_RAYS + design.slot
    } else {
        design.ray + design.place + design.context
    };
    design.patch + rays
}

/// The ray's words out of the module's table (shells), or the job's own.
fn ray_path(design: &Design<'_>) -> (f64, String) {
    let timing = design.timing;
    if design.in_shells() {
        let ns = timing.lowest_ns(BUNDLE_RAYS).max(timing.array_ns(design.module_rays(), design.ray));
        (ns, "next ray of the job".into())
    } else {
        (timing.choice_ns(2), "job register".into())
    }
}

/// The chain of the fixed-point test.
pub(super) fn datapath<'a>(design: &Design<'a>) -> Pipeline<'a> {
    let (timing, formats) = (design.timing, &design.spec.formats);
    let wire = |name| design.wire(name);
    let (a, c, e, n) = (wire("a"), wire("c"), wire("e"), wire("n"));
    let (num, den) = (wire("num"), wire("den"));
    // Edge normals before rounding: 2F + 4 bits.
    let exact = 2 * a;
    let (direction, tags) = (3 * design.direction, tag_bits(design));
    let mut p =
        Pipeline::new(timing, design.spec.icu.initiation_interval, 15 * design.coordinate + direction + tags);
    p.phase("translation", vec![(timing.adder(a), 12)], direction + tags);
    p.phase("edge normals", vec![(timing.sum_of_products(2, a, a, exact), 15)], 3 * a + direction + tags);
    if formats.cross_drop() > 0 && formats.rounding != Rounding::Floor {
        p.phase("rounding of normals", vec![(timing.magnitude(c), 15)], 3 * a + direction + tags);
    }
    let edge_values = timing.sum_of_products(3, c, design.direction, e);
    p.phase("edge values", vec![(edge_values, 5), (timing.sum_of_three(n), 6)], 3 * a + tags);
    p.phase("sums", vec![(timing.sum_of_three(den), 2), (timing.any(e), 5)], 6 * n + 5 + 3 * a + tags);
    p.phase("choice of triangle", vec![(timing.multiplexer(3 * n + den, 2), 1)], 3 * a + tags);
    p.phase("numerator", vec![(timing.sum_of_products(3, n, a, num), 1)], den + tags);
    p.phase("magnitudes", vec![(timing.magnitude(num), 1), (timing.magnitude(den), 1)], tags);
    if design.spec.division.unit == DivisionUnit::InPipeline {
        division::in_pipeline(design, &mut p);
    }
    p
}
