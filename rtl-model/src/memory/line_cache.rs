//! A set-associative cache's tags and its miss registers, behind one read port.
//!
//! ```text
//! read(line) --> hit now | waits (asked for, or already on its way) | no miss register free
//!                             request FIFO --> next level --> fill wire
//! ```
//! Least recently used replacement. A filled line is handed to whoever waits for it in the cycle of the fill, so
//! its eviction before use costs nothing and a cache of 0 bytes still works (one line register per miss register).

use super::{Line, MemoryRequest, Traffic};
use crate::sim::{Cycle, Fifo, Observer, Wire};

/// Tags of a set-associative cache of 64-byte lines; 0 lines is a cache that never hits.
#[derive(Clone, Debug)]
pub struct LineCache {
    /// Line number + 1 per way, most recently used first; 0 = empty.
    tags: Box<[u32]>,
    ways: usize,
    set_mask: u32,
}

impl LineCache {
    /// An empty cache of `n_lines` lines (0, or a power of two times `ways`).
    pub fn new(n_lines: u32, ways: u32) -> Self {
        let ways = ways.min(n_lines).max(1);
        LineCache {
            tags: vec![0; n_lines as usize].into_boxed_slice(),
            ways: ways as usize,
            set_mask: (n_lines / ways).saturating_sub(1),
        }
    }

    #[inline]
    fn set(&mut self, line: Line) -> &mut [u32] {
        let set = (line.0 & self.set_mask) as usize;
        &mut self.tags[set * self.ways..(set + 1) * self.ways]
    }

    /// True when the line is here; marks it most recently used.
    #[inline]
    pub fn lookup(&mut self, line: Line) -> bool {
        if self.tags.is_empty() {
            return false;
        }
        let set = self.set(line);
        match set.iter().position(|&tag| tag == line.0 + 1) {
            Some(way) => {
                set[..=way].rotate_right(1);
                true
            }
            None => false,
        }
    }

    /// Puts a line in place of the least recently used one of its set.
    pub fn install(&mut self, line: Line) {
        if self.tags.is_empty() || self.lookup(line) {
            return;
        }
        let set = self.set(line);
        set.rotate_right(1);
        set[0] = line.0 + 1;
    }
}

/// Lines asked for and not yet here.
#[derive(Clone, Debug)]
pub struct MissRegisters {
    lines: Vec<Line>,
    capacity: usize,
}

impl MissRegisters {
    /// `capacity >= 1` free registers.
    pub fn new(capacity: u32) -> Self {
        MissRegisters { lines: Vec::with_capacity(capacity as usize), capacity: capacity as usize }
    }

    /// True when the line is already on its way.
    #[inline]
    pub fn holds(&self, line: Line) -> bool {
        self.lines.contains(&line)
    }

    /// True when a register is free.
    #[inline]
    pub fn has_room(&self) -> bool {
        self.lines.len() < self.capacity
    }

    /// Takes a register for a line.
    pub fn take(&mut self, line: Line) {
        debug_assert!(self.has_room());
        self.lines.push(line);
    }

    /// Frees the line's register.
    pub fn release(&mut self, line: Line) {
        self.lines.retain(|&l| l != line);
    }

    /// True when nothing is on its way.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }
}

/// What a read of a line came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// The line is here, now.
    Hit,
    /// It is on its way; the fill wire will bring it.
    Waits,
    /// No room to ask: try again.
    Busy,
    /// No miss register is free: there is no point in trying before the next fill.
    Full,
}

/// A cache with its miss registers and traffic counters.
#[derive(Clone, Debug)]
pub struct ReadPort {
    cache: LineCache,
    misses: MissRegisters,
    traffic: Traffic,
}

impl ReadPort {
    /// An empty cache of `bytes` bytes.
    pub fn new(bytes: u32, ways: u32, miss_registers: u32) -> Self {
        ReadPort {
            cache: LineCache::new(bytes / super::LINE_BYTES, ways),
            misses: MissRegisters::new(miss_registers),
            traffic: Traffic::default(),
        }
    }

    /// Reads a line; on a miss asks the next level, if a register and the request FIFO allow.
    #[inline]
    pub fn read<O: Observer>(
        &mut self,
        now: Cycle,
        line: Line,
        requests: &mut Fifo<MemoryRequest>,
        observer: &mut O,
    ) -> Lookup {
        if self.cache.lookup(line) {
            self.traffic.accesses += 1;
            return Lookup::Hit;
        }
        if !self.misses.holds(line) {
            if !self.misses.has_room() {
                return Lookup::Full;
            }
            if !requests.can_push(now) {
                return Lookup::Busy;
            }
            self.misses.take(line);
            requests.send(now, MemoryRequest::read(line), observer);
            self.traffic.lines += 1;
        }
        self.traffic.accesses += 1;
        self.traffic.misses += 1;
        Lookup::Waits
    }

    /// Takes what the fill wire brings: the line is installed, its register freed.
    #[inline]
    pub fn fill(&mut self, now: Cycle, wire: &Wire<Line>) -> Option<Line> {
        let line = wire.get(now)?;
        self.cache.install(line);
        self.misses.release(line);
        Some(line)
    }

    /// Traffic so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// True when no miss is open.
    pub fn is_quiet(&self) -> bool {
        self.misses.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Silent;

    #[test]
    fn line_cache_two_ways_keeps_the_two_latest_of_a_set() {
        let mut cache = LineCache::new(8, 2); // 4 sets
        for line in [0, 4, 8] {
            cache.install(Line(line)); // all in set 0
        }
        assert!(!cache.lookup(Line(0)));
        assert!(cache.lookup(Line(4)) && cache.lookup(Line(8)));
        cache.lookup(Line(4)); // 8 is now the older one
        cache.install(Line(12));
        assert!(cache.lookup(Line(4)) && !cache.lookup(Line(8)) && cache.lookup(Line(12)));
        assert!(!cache.lookup(Line(5)), "another set");
    }

    #[test]
    fn line_cache_of_zero_lines_never_hits() {
        let mut cache = LineCache::new(0, 2);
        cache.install(Line(3));
        assert!(!cache.lookup(Line(3)));
    }

    #[test]
    fn read_port_miss_takes_a_register_merges_and_is_full_when_none_is_free() {
        let mut port = ReadPort::new(256, 2, 1);
        let mut requests = Fifo::new(2);
        assert_eq!(port.read(0, Line(9), &mut requests, &mut Silent), Lookup::Waits);
        assert_eq!(port.read(0, Line(9), &mut requests, &mut Silent), Lookup::Waits, "merged");
        assert_eq!(port.read(0, Line(10), &mut requests, &mut Silent), Lookup::Full);
        assert_eq!((requests.pop(1), requests.len(2)), (Some(MemoryRequest::read(Line(9))), 0));
        let mut wire = Wire::new();
        wire.set(1, Line(9));
        assert_eq!(port.fill(2, &wire), Some(Line(9)));
        assert!(port.is_quiet());
        assert_eq!(port.read(2, Line(9), &mut requests, &mut Silent), Lookup::Hit);
        assert_eq!(port.traffic(), Traffic { accesses: 3, misses: 2, lines: 1, ..Traffic::default() });
    }
}
