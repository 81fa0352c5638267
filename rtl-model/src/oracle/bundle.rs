//! Bundle descriptors to rays in f64: the oracle of the bundle generator.

use crate::datapath::RayWords;
use crate::datapath::bundle::BundleWords;
use crate::fixed::Formats;

/// Ray `i` of a valid descriptor.
pub fn ray(_formats: &Formats, _bundle: &BundleWords, _i: usize) -> RayWords {
    todo!()
}
