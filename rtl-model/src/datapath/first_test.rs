//! Dual precision: a narrow, conservative first test, and the exact test only where it leaves the answer open.

use super::{HitWords, PatchWords, RayWords};
use crate::fixed::Formats;

/// What the first test says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirstTest {
    /// Certainly no hit: the exact test is saved.
    Miss,
    /// The ray's line certainly meets the patch; the exact test is needed for t alone.
    Inside,
    /// Open: the exact test decides.
    Undecided,
}

/// The first test with words of `bits` significant bits (4..=24).
pub fn first_test(_formats: &Formats, _bits: u32, _ray: &RayWords, _patch: &PatchWords) -> FirstTest {
    todo!()
}

/// What the first test's narrow words alone would answer, error bounds ignored: does the ray's line meet the patch?
pub fn narrow_inside(_formats: &Formats, _bits: u32, _ray: &RayWords, _patch: &PatchWords) -> bool {
    todo!()
}

/// The whole dual-precision unit: equal to [`super::ray_patch::intersect`] for every input.
pub fn intersect(formats: &Formats, bits: u32, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
    match first_test(formats, bits, ray, patch) {
        FirstTest::Miss => None,
        FirstTest::Inside | FirstTest::Undecided => super::ray_patch::intersect(formats, ray, patch),
    }
}
