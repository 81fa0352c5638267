//! The oracle's own search for the patches that a ray may meet: a conservative tree of boxes in f64.

use crate::datapath::{HitWords, PatchWords, RayWords};
use crate::fixed::Formats;

/// A scene of quantised patches with the oracle's search over it.
#[derive(Clone, Debug)]
pub struct Oracle {
    formats: Formats,
    patches: Vec<PatchWords>,
}

impl Oracle {
    /// Builds the search. Patch ids need not be their places.
    pub fn new(formats: &Formats, patches: &[PatchWords]) -> Oracle {
        Oracle { formats: *formats, patches: patches.to_vec() }
    }

    /// The formats.
    pub fn formats(&self) -> &Formats {
        &self.formats
    }

    /// The patches, in the order in which they were given.
    pub fn patches(&self) -> &[PatchWords] {
        &self.patches
    }

    /// The nearest hit over all patches: smallest (t, id).
    pub fn nearest(&self, _ray: &RayWords) -> Option<HitWords> {
        todo!()
    }

    /// Whether anything lies in the ray's range.
    pub fn any(&self, _ray: &RayWords) -> bool {
        todo!()
    }
}
