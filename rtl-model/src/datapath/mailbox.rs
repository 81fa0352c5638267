//! The mailbox of a ray context: the patches that its ray was tested with last.
//!
//! ```text
//! patch of a cell list -> contains? -> (no) test, push        first in, first out
//! ```
//! A large patch lies in many neighbouring cells; the mailbox saves its repeated tests. Skipping is safe: a repeated
//! test returns the same hit. Source: Amanatides, Woo 1987 (a ray id per object), here turned round so
//! that the state is the ray context's.

/// Entries of a ray context's mailbox.
pub const MAILBOX_ENTRIES: usize = 8;

/// A register with no entry yet: patch numbers have 28 bits, so it equals none.
const EMPTY: u32 = u32::MAX;

/// The last [`MAILBOX_ENTRIES`] tested patches of one ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mailbox {
    entries: [u32; MAILBOX_ENTRIES],
}

impl Default for Mailbox {
    fn default() -> Self {
        Mailbox { entries: [EMPTY; MAILBOX_ENTRIES] }
    }
}

impl Mailbox {
    /// True when the patch is among the last tested ones.
    #[inline]
    pub fn contains(&self, patch: u32) -> bool {
        // Compares all registers, as the hardware does: no early exit, so it vectorises.
        self.entries.iter().fold(false, |found, entry| found | (*entry == patch))
    }

    /// Enters a tested patch in place of the oldest: a shift register.
    #[inline]
    pub fn push(&mut self, patch: u32) {
        self.entries.copy_within(..MAILBOX_ENTRIES - 1, 1);
        self.entries[0] = patch;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mailbox_after_nine_pushes_has_forgotten_only_the_first() {
        let mut mailbox = Mailbox::default();
        assert!(!mailbox.contains(0));
        for patch in 0..9 {
            mailbox.push(patch);
            assert!(mailbox.contains(patch));
        }
        assert!(!mailbox.contains(0));
        assert!((1..9).all(|patch| mailbox.contains(patch)));
        assert!(!mailbox.contains(9));
    }

    #[test]
    fn mailbox_patch_entered_twice_is_found_and_takes_two_places() {
        let mut mailbox = Mailbox::default();
        mailbox.push(3);
        mailbox.push(3);
        assert!(mailbox.contains(3));
        (10..16).for_each(|patch| mailbox.push(patch));
        assert!(mailbox.contains(3));
        mailbox.push(16);
        assert!(mailbox.contains(3) && mailbox.contains(10));
        mailbox.push(17);
        assert!(!mailbox.contains(3) && mailbox.contains(10));
    }

    #[test]
    fn mailbox_against_a_queue_of_eight_agrees_at_every_push() {
        let (mut mailbox, mut queue) = (Mailbox::default(), std::collections::VecDeque::new());
        for step in 0..2_000_u32 {
            let patch = step.wrapping_mul(2_654_435_761) >> 28;
            for known in 0..16 {
                assert_eq!(mailbox.contains(known), queue.contains(&known), "step {step}, patch {known}");
            }
            mailbox.push(patch);
            queue.push_front(patch);
            queue.truncate(8);
        }
        assert!(!mailbox.contains((1 << 28) - 1), "the largest patch number is no empty register");
    }
}
