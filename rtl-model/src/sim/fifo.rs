//! A first-in first-out queue between two blocks: one writer, one reader, at most one token each a cycle.
//!
//! ```text
//! writer --can_push/push--> [ depth entries ] --front/pop--> reader
//! ```
//! Timing: a token pushed in cycle n is at the front in n + 1 at the earliest; an entry popped in cycle n is free in
//! n + 1. So depth 1 passes a token every other cycle, depth 2 and more one a cycle (a 2-entry skid buffer).
//! Both sides pass the cycle, and the queue answers with its state at the start of that cycle: there is no commit to
//! call, and the order of the two sides within a cycle changes nothing.

use super::{Cycle, NEVER};

/// The queue. Its statistics count from its making.
///
/// On a cache line of its own: a board looks at hundreds of them every cycle.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Fifo<T> {
    /// A power of two of places, at least `depth`.
    entries: Box<[T]>,
    depth: u32,
    head: u32,
    /// Tokens inside, this cycle's push and pop included.
    count: u32,
    pushed_at: Cycle,
    popped_at: Cycle,
    pushes: u64,
    /// Sum of pop cycles less sum of push cycles.
    #[cfg(test)]
    sojourn: u64,
}

impl<T: Copy + Default> Fifo<T> {
    /// An empty queue of `depth >= 1` entries.
    ///
    /// # Panics
    /// When `depth` is 0.
    pub fn new(depth: u32) -> Self {
        assert!(depth >= 1, "a FIFO needs an entry");
        let n = depth.next_power_of_two() as usize;
        Fifo {
            entries: vec![T::default(); n].into_boxed_slice(),
            depth,
            head: 0,
            count: 0,
            pushed_at: NEVER,
            popped_at: NEVER,
            pushes: 0,
            #[cfg(test)]
            sojourn: 0,
        }
    }

    /// True when the writer may push in cycle `now`.
    #[inline]
    pub fn can_push(&self, now: Cycle) -> bool {
        (self.pushed_at != now) & (self.count + u32::from(self.popped_at == now) < self.depth)
    }

    /// Puts a token in; the reader sees it from the next cycle on.
    ///
    /// # Panics
    /// In debug builds, when [`Fifo::can_push`] is false.
    #[inline]
    pub fn push(&mut self, now: Cycle, token: T) {
        debug_assert!(self.can_push(now), "push into a full FIFO");
        let mask = self.entries.len() - 1;
        self.entries[(self.head + self.count) as usize & mask] = token;
        self.count += 1;
        self.pushed_at = now;
        self.pushes += 1;
        #[cfg(test)]
        {
            self.sojourn = self.sojourn.wrapping_sub(now);
        }
    }

    /// The oldest token, as of the start of the cycle; none any more once it is popped in this cycle.
    #[inline]
    pub fn front(&self, now: Cycle) -> Option<&T> {
        let visible = self.count - u32::from(self.pushed_at == now);
        if (visible == 0) | (self.popped_at == now) {
            return None;
        }
        let mask = self.entries.len() - 1;
        Some(&self.entries[self.head as usize & mask])
    }

    /// Takes the oldest token; the writer may use its entry from the next cycle on.
    #[inline]
    pub fn pop(&mut self, now: Cycle) -> Option<T> {
        let token = self.front(now).copied()?;
        self.head = (self.head + 1) & (self.entries.len() as u32 - 1);
        self.count -= 1;
        self.popped_at = now;
        #[cfg(test)]
        {
            self.sojourn = self.sojourn.wrapping_add(now);
        }
        Some(token)
    }

    /// Tokens inside at the start of cycle `now`.
    #[inline]
    pub fn len(&self, now: Cycle) -> u32 {
        self.count + u32::from(self.popped_at == now) - u32::from(self.pushed_at == now)
    }

    /// True when nothing is inside, this cycle's push and pop included.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Entries.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// Sum over all tokens of the cycles that each spent inside, once the queue is empty.
    #[cfg(test)]
    fn sojourn_cycles(&self) -> Option<u64> {
        self.is_empty().then_some(self.sojourn)
    }

    /// Tokens taken by the reader before cycle `now`.
    #[inline]
    pub fn taken(&self, now: Cycle) -> u64 {
        self.pushes - u64::from(self.pushed_at == now) - u64::from(self.len(now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cycles_to_pass(depth: u32, tokens: u64) -> u64 {
        let mut fifo = Fifo::<u64>::new(depth);
        let (mut sent, mut got) = (0, 0);
        for now in 0.. {
            if sent < tokens && fifo.can_push(now) {
                fifo.push(now, sent);
                sent += 1;
            }
            if let Some(token) = fifo.pop(now) {
                assert_eq!(token, got);
                got += 1;
                if got == tokens {
                    return now;
                }
            }
        }
        unreachable!()
    }

    #[test]
    fn fifo_pushed_token_is_visible_one_cycle_later_and_not_before() {
        let mut fifo = Fifo::<u32>::new(4);
        fifo.push(0, 7);
        assert!(fifo.front(0).is_none());
        assert_eq!(fifo.front(1), Some(&7));
    }

    #[test]
    fn fifo_of_depth_one_passes_a_token_every_other_cycle_and_depth_two_one_a_cycle() {
        assert_eq!(cycles_to_pass(1, 100), 2 * 100 - 1);
        assert_eq!(cycles_to_pass(2, 100), 100);
        assert_eq!(cycles_to_pass(16, 100), 100);
    }

    proptest! {
        /// Little's identity: the sum of occupancy equals the sum of sojourn, empty to empty; tokens keep their order;
        /// whichever side acts first in a cycle, the same happens.
        #[test]
        fn fifo_of_any_depth_under_random_traffic_keeps_order_and_littles_identity(
            depth in 1u32..9, traffic in prop::collection::vec((any::<bool>(), any::<bool>()), 1..300)
        ) {
            let mut fifos = [Fifo::<u64>::new(depth), Fifo::new(depth)];
            let (mut sent, mut got, mut occupancy) = (0, 0, 0);
            let drain = std::iter::repeat_n((false, true), 3 * depth as usize);
            for (now, (push, pop)) in (0..).zip(traffic.into_iter().chain(drain)) {
                occupancy += u64::from(fifos[0].len(now));
                prop_assert!(fifos[0].len(now) <= depth);
                let pushes = push && fifos[0].can_push(now);
                let [writer_first, reader_first] = &mut fifos;
                if pushes {
                    writer_first.push(now, sent);
                }
                let tokens = [writer_first, reader_first].map(|f| if pop { f.pop(now) } else { None });
                prop_assert_eq!(tokens[0], tokens[1]);
                prop_assert_eq!(fifos[1].can_push(now), fifos[0].can_push(now) || pushes);
                if pushes {
                    fifos[1].push(now, sent);
                    sent += 1;
                }
                if let Some(token) = tokens[0] {
                    prop_assert_eq!(token, got);
                    got += 1;
                }
                prop_assert_eq!(fifos[0].len(now), fifos[1].len(now));
                prop_assert_eq!(fifos[0].taken(now + 1), got);
            }
            prop_assert_eq!(got, sent);
            prop_assert_eq!(fifos.map(|f| f.sojourn_cycles()), [Some(occupancy); 2]);
        }
    }
}
