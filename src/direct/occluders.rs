//! Shadow coherence: what blocked a source's light last near a point is tried first.
//!
//! ```text
//! (region of the receiver, source) --> patches that blocked there --port: blocked_by--> rays known to be blocked
//! blocked rays that none of them explains --closest_hits of one--> the patch that did it
//! ```
//! A region is a patch of the receiver. The port's word that a patch blocks a ray is the caster's own arithmetic, so a ray
//! that is left out would have been blocked: no answer ever changes, only how many rays are cast.
//! Source: Haines, Greenberg 1986 (last occluder); Kok, Jansen, Woodward 1991.

use std::collections::HashMap;

use crate::mesh::PatchId;

/// Patches remembered for a region and a source.
const SLOTS: usize = 2;
/// Occluders that are sought for a region and a source at most: where many small things cast a shadow, knowing the last one
/// is worth less than it costs.
const MAX_SOUGHT: u8 = 8;

/// Where light goes from where.
pub(super) type Key = (PatchId, u32);

/// What blocked light, by region and source.
#[derive(Clone, Debug, Default)]
pub(super) struct Occluders {
    known: HashMap<Key, Slots>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Slots {
    /// The last that blocked first.
    patches: [Option<PatchId>; SLOTS],
    sought: u8,
}

impl Occluders {
    /// The occluder in a slot of `key`.
    pub fn of(&self, key: Key, slot: usize) -> Option<PatchId> {
        self.known.get(&key).and_then(|slots| slots.patches[slot])
    }

    /// Slots to try, in order.
    pub fn slots() -> std::ops::Range<usize> {
        0..SLOTS
    }

    /// Something unknown blocks light of `key`: true when it is worth finding out what.
    pub fn seeks(&mut self, key: Key) -> bool {
        let slots = self.known.entry(key).or_default();
        slots.sought < MAX_SOUGHT
    }

    /// What was found.
    pub fn found(&mut self, key: Key, patch: PatchId) {
        let slots = self.known.entry(key).or_default();
        slots.sought += 1;
        if slots.patches[0] != Some(patch) {
            slots.patches.rotate_right(1);
            slots.patches[0] = Some(patch);
        }
    }

    /// The patch in `slot` blocked again: it goes to the front.
    pub fn blocked_again(&mut self, key: Key, slot: usize) {
        if let Some(slots) = self.known.get_mut(&key) {
            slots.patches[..=slot].rotate_right(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn occluders_keep_the_last_two_and_stop_seeking_after_a_while() {
        let mut occluders = Occluders::default();
        let key = (PatchId(3), 1);
        assert_eq!(occluders.of(key, 0), None);
        for patch in [7, 8, 9] {
            assert!(occluders.seeks(key));
            occluders.found(key, PatchId(patch));
        }
        assert_eq!((occluders.of(key, 0), occluders.of(key, 1)), (Some(PatchId(9)), Some(PatchId(8))));
        occluders.blocked_again(key, 1);
        assert_eq!((occluders.of(key, 0), occluders.of(key, 1)), (Some(PatchId(8)), Some(PatchId(9))));
        for patch in 10..15 {
            occluders.found(key, PatchId(patch));
        }
        assert!(!occluders.seeks(key));
        assert!(occluders.seeks((PatchId(3), 2)));
    }
}
