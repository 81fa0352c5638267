//! A register between two blocks whose reader always takes: set in cycle n, seen in cycle n + 1 only.

use super::{Cycle, NEVER};

/// The register. Two places, by the parity of the cycle, so that writer and reader never meet.
#[derive(Clone, Copy, Debug)]
pub struct Wire<T> {
    places: [(Cycle, T); 2],
}

impl<T: Copy + Default> Default for Wire<T> {
    fn default() -> Self {
        Wire { places: [(NEVER, T::default()); 2] }
    }
}

impl<T: Copy + Default> Wire<T> {
    /// An empty register.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets what the reader sees in the next cycle. At most once a cycle.
    #[inline]
    pub fn set(&mut self, now: Cycle, value: T) {
        let place = &mut self.places[(now & 1) as usize];
        debug_assert!(place.0 != now, "a wire is driven twice in a cycle");
        *place = (now, value);
    }

    /// What was set in the last cycle.
    #[inline]
    pub fn get(&self, now: Cycle) -> Option<T> {
        let (at, value) = &self.places[(now & 1 ^ 1) as usize];
        (*at + 1 == now).then_some(*value)
    }

    /// True when nothing is to be seen in cycle `now` or the next.
    pub fn is_quiet(&self, now: Cycle) -> bool {
        self.places.iter().all(|(at, _)| *at != now && *at + 1 != now)
    }
}

/// A bundle of up to 64 wires to as many readers; at most one is set a cycle.
///
/// One stamp for all: a reader without a message looks at nothing else.
#[derive(Clone, Debug)]
pub struct Wires<T> {
    wire: Wire<(u32, T)>,
    n_readers: usize,
}

impl<T: Copy + Default> Wires<T> {
    /// Empty registers for `n_readers` readers.
    pub fn new(n_readers: usize) -> Self {
        Wires { wire: Wire::new(), n_readers }
    }

    /// Sets what `reader` sees in the next cycle.
    #[inline]
    pub fn set(&mut self, now: Cycle, reader: usize, value: T) {
        debug_assert!(reader < self.n_readers, "no such reader");
        self.wire.set(now, (reader as u32, value));
    }

    /// True when `reader` sees something.
    #[inline]
    pub fn has(&self, now: Cycle, reader: usize) -> bool {
        let (at, (to, _)) = &self.wire.places[(now & 1 ^ 1) as usize];
        (*at + 1 == now) & (*to as usize == reader)
    }

    /// What was set for `reader` in the last cycle.
    #[inline]
    pub fn get(&self, now: Cycle, reader: usize) -> Option<T> {
        self.has(now, reader).then(|| self.wire.places[(now & 1 ^ 1) as usize].1.1)
    }

    /// True when no reader sees anything in cycle `now` or the next.
    pub fn is_quiet(&self, now: Cycle) -> bool {
        self.wire.is_quiet(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wire_value_is_seen_in_the_next_cycle_only_even_when_set_every_cycle() {
        let mut wire = Wire::new();
        wire.set(0, 3);
        assert_eq!(wire.get(0), None);
        assert!(!wire.is_quiet(0) && !wire.is_quiet(1));
        wire.set(1, 4);
        assert_eq!(wire.get(1), Some(3));
        assert_eq!(wire.get(2), Some(4));
        assert_eq!(wire.get(3), None);
        assert!(wire.is_quiet(3));
    }

    #[test]
    fn wires_message_reaches_its_reader_only() {
        let mut wires = Wires::new(3);
        wires.set(5, 1, 'a');
        assert_eq!([0, 1, 2].map(|reader| wires.get(6, reader)), [None, Some('a'), None]);
        assert_eq!(wires.get(7, 1), None);
        assert!(wires.is_quiet(7));
    }
}
