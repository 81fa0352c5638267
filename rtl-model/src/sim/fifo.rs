//! A first-in first-out queue between two blocks: one writer, one reader, at most one token each a cycle.
//!
//! ```text
//! writer --can_push/push--> [ depth entries ] --front/pop--> reader
//! ```
//! Timing: a token pushed in cycle n is at the front in n + 1 at the earliest; an entry popped in cycle n is free in
//! n + 1. So depth 1 passes a token every other cycle, depth 2 and more one a cycle (a 2-entry skid buffer).
//! Both sides pass the cycle, and the queue answers with its state at the start of that cycle: there is no commit to
//! call, and the order of the two sides within a cycle changes nothing.

use super::{Cycle, EventKind, NEVER, Observer};

/// What a FIFO carries.
pub trait Token: Copy + Default {
    /// What an observer sees of it: a [`super::RayRef`] payload where it belongs to a ray.
    fn payload(&self) -> u32 {
        0
    }
}

/// The queue. Its statistics count from its making.
///
/// On a cache line of its own: a board looks at hundreds of them every cycle.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Fifo<T> {
    state: LinkState,
    /// A power of two of places, at least the depth.
    entries: Box<[T]>,
}

/// Most bins of an occupancy histogram but one.
const BINS: u32 = 64;

/// No cycle is as late.
const NEVER_READY: Cycle = Cycle::MAX;

/// Everything of a queue but its tokens. What every cycle looks at comes first.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct LinkState {
    /// First cycle in which the reader sees a token, and in which the writer may push: one comparison each a look.
    front_from: Cycle,
    push_from: Cycle,
    head: u32,
    /// Tokens inside, this cycle's push and pop included.
    count: u32,
    depth: u32,
    /// Number in the board's directory.
    number: u16,
    bin_shift: u8,
    pushed_at: Cycle,
    popped_at: Cycle,
    /// The cycle up to which occupancy is counted.
    settled_at: Cycle,
    pushes: u64,
    /// Sum of pop cycles less sum of push cycles.
    sojourn: u64,
    /// Cycles by occupancy at their end; see [`FifoStatistics::cycles_by_occupancy`].
    cycles: Box<[u64]>,
}

/// What a queue counted since its making.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct FifoStatistics {
    /// Name: `cluster0.module0.tests`.
    pub link: String,
    /// Entries.
    pub depth: u32,
    /// Tokens that went in.
    pub tokens: u64,
    /// Cycles by number of tokens inside at their end: bin i counts [i w, (i + 1) w) tokens, w = `bin_tokens`.
    pub cycles_by_occupancy: Vec<u64>,
    /// Tokens of a bin: 1 up to depth 64.
    pub bin_tokens: u32,
    /// Sum over all tokens of the cycles that each spent inside; of an empty queue. By Little's law the sum of
    /// occupancy over the cycles.
    pub sojourn_cycles: u64,
}

impl LinkState {
    fn new(depth: u32) -> Self {
        assert!(depth >= 1, "a FIFO needs an entry");
        let bin_shift = depth.div_ceil(BINS).next_power_of_two().trailing_zeros();
        LinkState {
            front_from: NEVER_READY,
            push_from: 0,
            depth,
            head: 0,
            count: 0,
            number: 0,
            bin_shift: bin_shift as u8,
            pushed_at: NEVER,
            popped_at: NEVER,
            settled_at: 0,
            pushes: 0,
            sojourn: 0,
            cycles: vec![0; (depth >> bin_shift) as usize + 1].into_boxed_slice(),
        }
    }

    /// Gives the queue its number in the board's directory.
    pub fn set_number(&mut self, number: u16) {
        self.number = number;
    }

    /// Its number in the board's directory.
    pub fn number(&self) -> u16 {
        self.number
    }

    /// Entries.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// True when nothing is inside, this cycle's push and pop included.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// True when nothing went in or out in cycle `now`.
    #[inline]
    pub fn is_still(&self, now: Cycle) -> bool {
        self.pushed_at != now && self.popped_at != now
    }

    /// Counts the occupancy since the last push or pop.
    #[inline]
    fn settle(&mut self, now: Cycle) {
        let since = now - self.settled_at;
        self.cycles[(self.count >> self.bin_shift) as usize] += since;
        self.settled_at = now;
    }

    /// What was counted up to the start of cycle `now`, under a name.
    pub fn statistics(&self, now: Cycle, link: String) -> FifoStatistics {
        let mut settled = self.clone();
        settled.settle(now);
        FifoStatistics {
            link,
            depth: self.depth,
            tokens: self.pushes,
            cycles_by_occupancy: settled.cycles.into_vec(),
            bin_tokens: 1 << self.bin_shift,
            sojourn_cycles: if self.is_empty() { self.sojourn } else { 0 },
        }
    }
}

impl<T: Token> Fifo<T> {
    /// An empty queue of `depth >= 1` entries.
    ///
    /// # Panics
    /// When `depth` is 0.
    pub fn new(depth: u32) -> Self {
        let n = depth.next_power_of_two() as usize;
        Fifo { state: LinkState::new(depth), entries: vec![T::default(); n].into_boxed_slice() }
    }

    /// True when the writer may push in cycle `now`.
    #[inline(always)]
    pub fn can_push(&self, now: Cycle) -> bool {
        now >= self.state.push_from
    }

    /// Puts a token in; the reader sees it from the next cycle on.
    ///
    /// # Panics
    /// In debug builds, when [`Fifo::can_push`] is false.
    #[inline(always)]
    pub fn push(&mut self, now: Cycle, token: T) {
        debug_assert!(self.can_push(now), "push into a full FIFO");
        let mask = self.entries.len() - 1;
        let s = &mut self.state;
        s.settle(now);
        self.entries[(s.head + s.count) as usize & mask] = token;
        s.count += 1;
        s.front_from = if s.count == 1 { now + 1 } else { s.front_from };
        s.push_from = if s.count == s.depth { NEVER_READY } else { now + 1 };
        s.pushed_at = now;
        s.pushes += 1;
        s.sojourn = s.sojourn.wrapping_sub(now);
    }

    /// [`Fifo::push`], told to an observer.
    #[inline(always)]
    pub fn send<O: Observer>(&mut self, now: Cycle, token: T, observer: &mut O) {
        self.push(now, token);
        if O::ON {
            observer.event(now, EventKind::Push, self.state.number, token.payload());
        }
    }

    /// The oldest token, as of the start of the cycle; none any more once it is popped in this cycle.
    #[inline(always)]
    pub fn front(&self, now: Cycle) -> Option<&T> {
        if now < self.state.front_from {
            return None;
        }
        let mask = self.entries.len() - 1;
        Some(&self.entries[self.state.head as usize & mask])
    }

    /// Takes the oldest token; the writer may use its entry from the next cycle on.
    #[inline(always)]
    pub fn pop(&mut self, now: Cycle) -> Option<T> {
        let token = self.front(now).copied()?;
        let s = &mut self.state;
        s.settle(now);
        s.head = (s.head + 1) & (self.entries.len() as u32 - 1);
        if s.count == s.depth {
            s.push_from = now + 1;
        }
        s.count -= 1;
        s.front_from = if s.count == 0 { NEVER_READY } else { now + 1 };
        s.popped_at = now;
        s.sojourn = s.sojourn.wrapping_add(now);
        Some(token)
    }

    /// [`Fifo::pop`], told to an observer.
    #[inline(always)]
    pub fn take<O: Observer>(&mut self, now: Cycle, observer: &mut O) -> Option<T> {
        let token = self.pop(now)?;
        if O::ON {
            observer.event(now, EventKind::Pop, self.state.number, token.payload());
        }
        Some(token)
    }

    /// Tokens inside at the start of cycle `now`.
    #[inline]
    pub fn len(&self, now: Cycle) -> u32 {
        let s = &self.state;
        s.count + u32::from(s.popped_at == now) - u32::from(s.pushed_at == now)
    }

    /// True when nothing is inside, this cycle's push and pop included.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.state.is_empty()
    }

    /// Entries.
    pub fn depth(&self) -> u32 {
        self.state.depth
    }

    /// Everything but the tokens.
    pub fn state(&self) -> &LinkState {
        &self.state
    }

    /// Everything but the tokens.
    pub fn state_mut(&mut self) -> &mut LinkState {
        &mut self.state
    }

    /// Tokens taken by the reader before cycle `now`.
    #[inline]
    pub fn taken(&self, now: Cycle) -> u64 {
        self.state.pushes - u64::from(self.state.pushed_at == now) - u64::from(self.len(now))
    }
}

impl FifoStatistics {
    /// What was counted since `earlier`, a previous state of the same queue; it was empty then as it is now.
    pub fn since(&self, earlier: &FifoStatistics) -> FifoStatistics {
        debug_assert_eq!((&self.link, self.depth), (&earlier.link, earlier.depth), "two queues");
        let bins = self.cycles_by_occupancy.iter().zip(&earlier.cycles_by_occupancy);
        FifoStatistics {
            tokens: self.tokens - earlier.tokens,
            cycles_by_occupancy: bins.map(|(now, before)| now - before).collect(),
            sojourn_cycles: self.sojourn_cycles - earlier.sojourn_cycles,
            ..self.clone()
        }
    }

    /// Cycles counted.
    pub fn total_cycles(&self) -> u64 {
        self.cycles_by_occupancy.iter().sum()
    }

    /// Mean number of tokens inside, by Little's law from their sojourn.
    pub fn mean_occupancy(&self) -> f64 {
        match self.total_cycles() {
            0 => 0.0,
            n => self.sojourn_cycles as f64 / n as f64,
        }
    }

    /// Share of the cycles at whose end the queue was full (of a deep one: in its last bin).
    pub fn full_share(&self) -> f64 {
        match self.total_cycles() {
            0 => 0.0,
            n => *self.cycles_by_occupancy.last().unwrap_or(&0) as f64 / n as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    impl Token for u64 {}
    impl Token for u32 {}

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

    #[test]
    fn fifo_of_any_depth_has_a_bin_for_every_occupancy_and_at_most_65() {
        for depth in (1..=300).chain([511, 512, 513, 1000, 4095, 4096]) {
            let state = LinkState::new(depth);
            assert!(state.cycles.len() as u32 <= BINS + 1, "depth {depth}: {} bins", state.cycles.len());
            assert!(depth > BINS || state.cycles.len() as u32 == depth + 1, "depth {depth}");
        }
    }

    #[test]
    fn fifo_statistics_since_an_earlier_state_are_those_of_the_cycles_between() {
        let mut fifo = Fifo::<u32>::new(2);
        fifo.push(0, 1);
        fifo.pop(3);
        let earlier = fifo.state().statistics(5, "a".into());
        assert_eq!(
            (earlier.tokens, earlier.sojourn_cycles, &earlier.cycles_by_occupancy[..]),
            (1, 3, &[2, 3, 0][..])
        );
        fifo.push(6, 2);
        fifo.push(7, 3);
        fifo.pop(8);
        fifo.pop(9);
        let since = fifo.state().statistics(12, "a".into()).since(&earlier);
        assert_eq!(
            (since.tokens, since.sojourn_cycles, &since.cycles_by_occupancy[..]),
            (2, 4, &[4, 2, 1][..])
        );
        assert_eq!((since.total_cycles(), since.depth, since.link.as_str()), (7, 2, "a"));
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
            for fifo in fifos {
                let end = 301 + 3 * u64::from(depth);
                let counted = fifo.state().statistics(end, String::new());
                let by_bins: u64 = (0..).zip(&counted.cycles_by_occupancy).map(|(len, n)| len * n).sum();
                prop_assert_eq!((counted.sojourn_cycles, by_bins), (occupancy, occupancy));
                prop_assert_eq!(counted.total_cycles(), end);
            }
        }
    }
}
