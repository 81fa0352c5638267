//! Ray x patch.

use super::{HitWords, PatchWords, RayWords};
use crate::fixed::Formats;

/// Tests one ray with one patch: the ICU's function.
pub fn intersect(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
    let _ = (formats, ray, patch);
    todo!()
}
