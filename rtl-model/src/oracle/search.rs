//! The oracle's own search for the patches that a ray may meet: a conservative tree of boxes in f64.
//!
//! ```text
//! patches -> boxes -> tree      ray -> boxes that it meets, front to back -> pair test -> smallest (t, id)
//!                                 '<--- t beyond which nothing counts: t_max, then the best hit ---'
//! ```
//! **Full products** (no `cross_keep_bits`): a hit of the pair test is a point of the patch, so it lies in the patch's
//! box, and [`Oracle::nearest`] and [`Oracle::any`] speak of all patches. Let S = 2^(T+D-F) be the t words of one
//! coordinate word over one direction word. A patch whose box the ray enters at s has an exact t of at least s S words.
//! Rounding is monotone and leaves whole numbers alone, so with s S >= b + 1 its rounded t is at least b + 1 in every
//! mode: behind a hit at b. Under b + 1 it may still round to b and win by a smaller id, so only there it is skipped.
//! The same with b = t_max.
//!
//! **Rounded products**: signs and t may be wrong in space, and a patch may be hit outside its box, or before it. Then
//! both answers are over exactly those patches whose closed box holds a point o + s d with 0 <= s and s S < t_max + 1,
//! decided in integers, none skipped for a hit in front of it. The board's answer is over those that its cells list;
//! compare it with [`Oracle::nearest_of`] over the patches that it tested.
//!
//! Not modelled: cells, mailbox, order of tests. Patch ids are distinct, rays valid ([`RayWords::validate`]).

mod tree;

use std::ops::ControlFlow;

use self::tree::{Slabs, Tree};
use super::ray_patch::intersect;
use crate::datapath::{HitWords, PatchWords, RayWords};
use crate::fixed::Formats;

/// A scene of quantised patches with the oracle's search over it.
#[derive(Clone, Debug)]
pub struct Oracle {
    formats: Formats,
    patches: Vec<PatchWords>,
    tree: Tree,
}

impl Oracle {
    /// Builds the search. Patch ids need not be their places.
    pub fn new(formats: &Formats, patches: &[PatchWords]) -> Oracle {
        Oracle { formats: *formats, patches: patches.to_vec(), tree: Tree::new(patches) }
    }

    /// The formats.
    pub fn formats(&self) -> &Formats {
        &self.formats
    }

    /// The patches, in the order in which they were given.
    pub fn patches(&self) -> &[PatchWords] {
        &self.patches
    }

    /// The nearest hit over all patches: smallest (t, id). With rounded products over the patches that the module's
    /// header names.
    pub fn nearest(&self, ray: &RayWords) -> Option<HitWords> {
        let mut best = None;
        self.search(ray, |patch| {
            best = nearer(best, intersect(&self.formats, ray, patch));
            let skip = self.has_full_products();
            ControlFlow::Continue(best.filter(|_| skip).map_or(ray.t_max, |hit| hit.t))
        });
        best
    }

    /// Whether anything lies in the ray's range, over the same patches as [`Oracle::nearest`].
    pub fn any(&self, ray: &RayWords) -> bool {
        let mut hit = false;
        self.search(ray, |patch| {
            hit = intersect(&self.formats, ray, patch).is_some();
            if hit { ControlFlow::Break(()) } else { ControlFlow::Continue(ray.t_max) }
        });
        hit
    }

    /// The nearest hit over the listed patches alone, in whatever order: smallest (t, id).
    pub fn nearest_of<'p>(
        &self,
        ray: &RayWords,
        candidates: impl IntoIterator<Item = &'p PatchWords>,
    ) -> Option<HitWords> {
        candidates.into_iter().fold(None, |best, patch| nearer(best, intersect(&self.formats, ray, patch)))
    }

    /// Visits every patch that the ray may hit within its range: with full products a superset of those that it hits,
    /// with rounded products exactly those that the module's header names. Roughly front to back.
    pub fn candidates(&self, ray: &RayWords, mut visit: impl FnMut(&PatchWords)) {
        self.search(ray, |patch| {
            visit(patch);
            ControlFlow::Continue(ray.t_max)
        });
    }

    /// No edge normal is rounded.
    fn has_full_products(&self) -> bool {
        self.formats.cross_keep_bits.is_none_or(|keep| keep >= 2 * self.formats.coord_frac_bits)
    }

    /// Visits candidates; `visit` answers the greatest t word that still counts, or ends the search.
    fn search(&self, ray: &RayWords, mut visit: impl FnMut(&PatchWords) -> ControlFlow<(), u64>) {
        let slabs = Slabs::new(&self.formats, ray);
        let full = self.has_full_products();
        self.tree.walk(&slabs, ray.t_max, |place, bounds| {
            if full || bounds.is_met(&self.formats, ray) {
                visit(&self.patches[place])
            } else {
                ControlFlow::Continue(ray.t_max)
            }
        });
    }
}

/// The hit with the smaller (t, id).
fn nearer(best: Option<HitWords>, other: Option<HitWords>) -> Option<HitWords> {
    [best, other].into_iter().flatten().min_by_key(|hit| (hit.t, hit.patch))
}

#[cfg(test)]
#[path = "search/tests.rs"]
mod tests;
