//! A first-in first-out queue between two blocks: one writer, one reader, at most one token each a cycle.
//!
//! ```text
//! writer --can_push/push--> [ depth entries ] --front/pop--> reader        commit: the clock edge
//! ```
//! Timing: a token pushed in cycle n is at the front in n + 1 at the earliest; an entry popped in cycle n is free in
//! n + 1. So depth 1 passes a token every other cycle, depth 2 and more one a cycle (a 2-entry skid buffer).

use super::Cycle;

/// The queue. Its statistics count from its making.
#[derive(Clone, Debug)]
pub struct Fifo<T> {
    entries: Box<[T]>,
    depth: u32,
    head: u32,
    len: u32,
    /// A token was written behind the visible ones in this cycle.
    pushed: bool,
    popped: bool,
    changed_at: Cycle,
    occupancy_cycles: u64,
    high_water: u32,
    pushes: u64,
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
            len: 0,
            pushed: false,
            popped: false,
            changed_at: 0,
            occupancy_cycles: 0,
            high_water: 0,
            pushes: 0,
        }
    }

    /// True when the writer may push in this cycle.
    #[inline]
    pub fn can_push(&self) -> bool {
        (self.len < self.depth) & !self.pushed
    }

    /// Stages a token; visible after the next commit.
    ///
    /// # Panics
    /// In debug builds, when [`Fifo::can_push`] is false.
    #[inline]
    pub fn push(&mut self, token: T) {
        debug_assert!(self.can_push(), "push into a full FIFO");
        let free = self.free_entry();
        self.entries[free] = token;
        self.pushed = true;
    }

    /// The oldest token, as of the start of the cycle.
    #[inline]
    pub fn front(&self) -> Option<&T> {
        if self.len == 0 || self.popped { None } else { Some(&self.entries[self.head as usize]) }
    }

    /// Takes the oldest token; its entry is free after the next commit.
    #[inline]
    pub fn pop(&mut self) -> Option<T> {
        let token = self.front().copied();
        self.popped |= token.is_some();
        token
    }

    /// The token staged in this cycle.
    #[inline]
    pub fn staged(&self) -> Option<&T> {
        self.pushed.then(|| &self.entries[self.free_entry()])
    }

    /// The entry behind the visible ones.
    #[inline]
    fn free_entry(&self) -> usize {
        (self.head + self.len) as usize & (self.entries.len() - 1)
    }

    /// Tokens inside, as of the start of the cycle.
    pub fn len(&self) -> u32 {
        self.len
    }

    /// True when nothing is inside or staged.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.len == 0 && !self.pushed
    }

    /// Entries.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The clock edge at the end of cycle `now`.
    #[inline]
    pub fn commit(&mut self, now: Cycle) {
        if !(self.pushed | self.popped) {
            return;
        }
        // The old length held through cycle `now`.
        self.occupancy_cycles += u64::from(self.len) * (now + 1 - self.changed_at);
        self.changed_at = now + 1;
        if self.pushed {
            self.pushed = false;
            self.len += 1;
            self.pushes += 1;
        }
        if self.popped {
            self.popped = false;
            self.head = (self.head + 1) & (self.entries.len() as u32 - 1);
            self.len -= 1;
        }
        self.high_water = self.high_water.max(self.len);
    }

    /// Sum over cycles of the tokens inside, up to the last change.
    pub fn occupancy_cycles(&self) -> u64 {
        self.occupancy_cycles
    }

    /// Most tokens ever inside.
    pub fn high_water(&self) -> u32 {
        self.high_water
    }

    /// Tokens ever pushed.
    pub fn pushes(&self) -> u64 {
        self.pushes
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
            if sent < tokens && fifo.can_push() {
                fifo.push(sent);
                sent += 1;
            }
            if let Some(token) = fifo.pop() {
                assert_eq!(token, got);
                got += 1;
                if got == tokens {
                    return now;
                }
            }
            fifo.commit(now);
        }
        unreachable!()
    }

    #[test]
    fn fifo_pushed_token_is_visible_one_cycle_later_and_not_before() {
        let mut fifo = Fifo::<u32>::new(4);
        fifo.push(7);
        assert!(fifo.front().is_none());
        fifo.commit(0);
        assert_eq!(fifo.front(), Some(&7));
    }

    #[test]
    fn fifo_of_depth_one_passes_a_token_every_other_cycle_and_depth_two_one_a_cycle() {
        assert_eq!(cycles_to_pass(1, 100), 2 * 100 - 1);
        assert_eq!(cycles_to_pass(2, 100), 100);
        assert_eq!(cycles_to_pass(16, 100), 100);
    }

    proptest! {
        /// Little's identity: the sum of occupancy equals the sum of sojourn, empty to empty; order is kept.
        #[test]
        fn fifo_of_any_depth_under_random_traffic_keeps_order_and_littles_identity(
            depth in 1u32..9, traffic in prop::collection::vec((any::<bool>(), any::<bool>()), 1..300)
        ) {
            let mut fifo = Fifo::<(u64, Cycle)>::new(depth);
            let (mut sent, mut got, mut sojourn) = (0, 0, 0);
            let drain = std::iter::repeat_n((false, true), 3 * depth as usize);
            for (now, (push, pop)) in (0..).zip(traffic.into_iter().chain(drain)) {
                if push && fifo.can_push() {
                    // Inside from the cycle after the push.
                    fifo.push((sent, now + 1));
                    sent += 1;
                }
                if pop && let Some((token, since)) = fifo.pop() {
                    prop_assert_eq!(token, got);
                    got += 1;
                    sojourn += now + 1 - since;
                }
                fifo.commit(now);
                prop_assert!(fifo.len() <= depth);
            }
            prop_assert!(fifo.is_empty());
            prop_assert_eq!(got, sent);
            prop_assert_eq!(fifo.occupancy_cycles(), sojourn);
        }
    }
}
