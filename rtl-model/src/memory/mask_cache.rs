//! The cache of tested masks: which rays of a bundle each patch was tested with, four patches a line, written back.
//!
//! ```text
//! look_up(line) --> here | waits for the next level | a write-back or a register in the way
//!     misses on lines that were never written back are new: zeros, no fetch
//! evicted dirty lines --MemoryRequest { write }--> next level        bundle ends: its lines are dropped
//! ```
//! Least recently used replacement, write-back, write-allocate. A line that is fetched or new stands in a miss register
//! until its place in the set is free; with 0 bytes every line lives in a register and is written back at once. Per
//! bundle slot a filter of 64 bits remembers which lines (by their low 6 bits) were written back: a miss on any other is
//! new. Losing a mask would make tests depend on timing, so nothing that is alive is dropped.
//! The masks themselves are in [`MaskStore`]; this is where they are, and what moving them costs.
//! Source: ours. In DESIGN's words the mask is cached with the record; a cache of its own lets clusters and bundles
//! share records.

use super::{Line, MemoryRequest, Traffic};
use crate::sim::{Cycle, Fifo, Observer, Wire};

/// Patches whose masks share a line: 16 bytes each, mask and bundle tag.
pub const MASKS_PER_LINE: u32 = 4;

/// What a look-up came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaskLookup {
    /// The line is here and may be changed.
    Here,
    /// It is on its way; [`MaskCache::fill`] will bring it.
    Waits,
    /// The request FIFO is full: try again.
    Busy,
    /// No miss register is free: try again.
    Full,
}

#[derive(Clone, Copy, Debug)]
struct Way {
    line: Line,
    dirty: bool,
}

#[derive(Clone, Copy, Debug)]
struct Register {
    line: Line,
    /// The line is here; until then it is on its way.
    filled: bool,
    /// Whoever asked for it has not used it yet: it stays.
    held: bool,
    dirty: bool,
}

/// The cache.
#[derive(Clone, Debug)]
pub struct MaskCache {
    /// Most recently used first, set by set.
    ways: Box<[Option<Way>]>,
    ways_per_set: usize,
    set_mask: u32,
    registers: Vec<Register>,
    capacity: usize,
    /// First line of the masks of slot 0, and lines of a slot.
    base: u32,
    lines_per_slot: u32,
    spilled: [u64; 16],
    traffic: Traffic,
}

impl MaskCache {
    /// An empty cache of `bytes` for masks that begin at line `base`, `lines_per_slot` for each bundle slot.
    pub fn new(bytes: u32, ways: u32, registers: u32, base: Line, lines_per_slot: u32) -> Self {
        let n_lines = bytes / super::LINE_BYTES;
        MaskCache {
            ways: vec![None; n_lines as usize].into_boxed_slice(),
            ways_per_set: ways.min(n_lines).max(1) as usize,
            set_mask: (n_lines / ways).saturating_sub(1),
            registers: Vec::with_capacity(registers as usize),
            capacity: registers as usize,
            base: base.0,
            lines_per_slot: lines_per_slot.max(1),
            spilled: [0; 16],
            traffic: Traffic::default(),
        }
    }

    /// The line that holds a patch's mask for a bundle slot.
    #[inline]
    pub fn line(&self, slot: u8, patch: u32) -> Line {
        Line(self.base + u32::from(slot) * self.lines_per_slot + patch / MASKS_PER_LINE)
    }

    fn set(&mut self, line: Line) -> &mut [Option<Way>] {
        let set = (line.0 & self.set_mask) as usize;
        &mut self.ways[set * self.ways_per_set..(set + 1) * self.ways_per_set]
    }

    #[inline]
    fn filter_bit(line: Line) -> u64 {
        1 << (line.0 & 63)
    }

    fn slot_of(&self, line: Line) -> usize {
        ((line.0 - self.base) / self.lines_per_slot) as usize & 15
    }

    /// True when a way holds the line; makes it most recently used, and dirty if `writes`.
    #[inline]
    fn touch(&mut self, line: Line, writes: bool) -> bool {
        if self.ways.is_empty() {
            return false;
        }
        let set = self.set(line);
        let Some(at) = set.iter().position(|way| way.is_some_and(|w| w.line == line)) else { return false };
        set[..=at].rotate_right(1);
        if let Some(way) = &mut set[0] {
            way.dirty |= writes;
        }
        true
    }

    /// Looks for the line of a patch's mask.
    #[inline]
    pub fn look_up<O: Observer>(
        &mut self,
        now: Cycle,
        line: Line,
        requests: &mut Fifo<MemoryRequest>,
        observer: &mut O,
    ) -> MaskLookup {
        if self.touch(line, false) {
            self.traffic.accesses += 1;
            return MaskLookup::Here;
        }
        if let Some(register) = self.registers.iter_mut().find(|r| r.line == line) {
            self.traffic.accesses += 1;
            if !register.filled {
                return MaskLookup::Waits;
            }
            register.held = false;
            return MaskLookup::Here;
        }
        if self.registers.len() == self.capacity {
            return MaskLookup::Full;
        }
        let is_new = self.spilled[self.slot_of(line)] & Self::filter_bit(line) == 0;
        if !is_new {
            if !requests.can_push(now) {
                return MaskLookup::Busy;
            }
            requests.send(now, MemoryRequest::read(line), observer);
            self.traffic.lines += 1;
            self.traffic.misses += 1;
        }
        self.traffic.accesses += 1;
        self.registers.push(Register { line, filled: is_new, held: !is_new, dirty: false });
        if is_new { MaskLookup::Here } else { MaskLookup::Waits }
    }

    /// Notes that a line that is here was changed.
    #[inline]
    pub fn write(&mut self, line: Line) {
        if !self.touch(line, true)
            && let Some(register) = self.registers.iter_mut().find(|r| r.line == line)
        {
            register.dirty = true;
        }
    }

    /// Takes what the fill wire brings.
    #[inline]
    pub fn fill(&mut self, now: Cycle, wire: &Wire<Line>) -> Option<Line> {
        let line = wire.get(now)?;
        for register in &mut self.registers {
            register.filled |= register.line == line;
        }
        Some(line)
    }

    /// Moves one line from its register to its set, the one that it displaces to the next level; true when something
    /// moved. Called once at the end of a cycle, after all look-ups of it: a line stays in its register for the cycle.
    pub fn settle<O: Observer>(
        &mut self,
        now: Cycle,
        requests: &mut Fifo<MemoryRequest>,
        observer: &mut O,
    ) -> bool {
        let Some(at) = self.registers.iter().position(|r| r.filled && !r.held) else { return false };
        let Register { line, dirty, .. } = self.registers[at];
        // With no ways the line displaces itself.
        let victim = match self.ways.is_empty() {
            true => dirty.then_some(line),
            false => self.set(line).last().copied().flatten().filter(|way| way.dirty).map(|way| way.line),
        };
        if let Some(victim) = victim {
            if !requests.can_push(now) {
                return false;
            }
            requests.send(now, MemoryRequest { line: victim, write: true }, observer);
            self.traffic.written += 1;
            self.spilled[self.slot_of(victim)] |= Self::filter_bit(victim);
        }
        if !self.ways.is_empty() {
            let set = self.set(line);
            set.rotate_right(1);
            set[0] = Some(Way { line, dirty });
        }
        self.registers.remove(at);
        true
    }

    /// A bundle of a slot ended: its lines are dropped, whatever they hold.
    pub fn drop_bundle(&mut self, slot: u8) {
        let first = self.base + u32::from(slot) * self.lines_per_slot;
        let lines = first..first + self.lines_per_slot;
        for way in &mut self.ways {
            if way.is_some_and(|w| lines.contains(&w.line.0)) {
                *way = None;
            }
        }
        self.registers.retain(|register| !lines.contains(&register.line.0));
        self.spilled[usize::from(slot & 15)] = 0;
    }

    /// Traffic so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// True when no line waits in a register.
    #[inline]
    pub fn is_quiet(&self) -> bool {
        self.registers.is_empty()
    }
}

/// The masks: what the lines of [`MaskCache`] hold, wherever they are.
#[derive(Clone, Debug)]
pub struct MaskStore {
    /// By slot and patch: tag of the bundle that wrote it, mask.
    masks: Vec<(u32, u64)>,
    tags: [u32; 16],
    n_patches: usize,
}

impl MaskStore {
    /// Masks of all patches for each of `n_slots` bundle slots (at most 16).
    pub fn new(n_slots: u32, n_patches: u32) -> Self {
        MaskStore {
            masks: vec![(0, 0); n_slots as usize * n_patches as usize],
            tags: [0; 16],
            n_patches: n_patches as usize,
        }
    }

    /// A slot takes a new bundle: all its masks are 0.
    pub fn start_bundle(&mut self, slot: u8) {
        self.tags[usize::from(slot)] += 1;
    }

    /// The rays of `mask` that the patch was not yet tested with; from now on it is.
    #[inline]
    pub fn take_untested(&mut self, slot: u8, patch: u32, mask: u64) -> u64 {
        let slot = usize::from(slot);
        let (tag, tested) = &mut self.masks[slot * self.n_patches + patch as usize];
        if *tag != self.tags[slot] {
            (*tag, *tested) = (self.tags[slot], 0);
        }
        let wanted = mask & !*tested;
        *tested |= mask;
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Silent;

    struct Bench {
        cache: MaskCache,
        requests: Fifo<MemoryRequest>,
        now: Cycle,
    }

    impl Bench {
        fn new(bytes: u32, registers: u32) -> Bench {
            let cache = MaskCache::new(bytes, 1, registers, Line(1000), 100);
            Bench { cache, requests: Fifo::new(8), now: 10 }
        }

        /// A cycle in which a line is looked up and changed if it is here.
        fn change(&mut self, line: u32) -> MaskLookup {
            self.now += 1;
            let lookup = self.cache.look_up(self.now, Line(line), &mut self.requests, &mut Silent);
            if lookup == MaskLookup::Here {
                self.cache.write(Line(line));
            }
            // A look-up may have used the FIFO's one push of the cycle.
            self.cache.settle(self.now, &mut self.requests, &mut Silent);
            lookup
        }

        fn request(&mut self) -> Option<(u32, bool)> {
            self.requests.pop(self.now + 1).map(|r| (r.line.0, r.write))
        }

        fn fill(&mut self, line: u32) {
            let mut wire = Wire::new();
            wire.set(self.now, Line(line));
            self.now += 1;
            assert_eq!(self.cache.fill(self.now, &wire), Some(Line(line)));
        }
    }

    #[test]
    fn mask_cache_new_lines_cost_no_fetch_and_evicted_ones_are_written_and_fetched_again() {
        // One set of one way... two lines of 64 bytes, direct mapped: lines 1000 and 1002 share a set.
        let mut bench = Bench::new(128, 2);
        assert_eq!(bench.change(1000), MaskLookup::Here);
        assert_eq!(bench.change(1001), MaskLookup::Here);
        assert_eq!(bench.request(), None);
        assert_eq!(bench.change(1002), MaskLookup::Here);
        assert_eq!(bench.request(), Some((1000, true)));
        assert_eq!(bench.change(1000), MaskLookup::Waits);
        assert_eq!(bench.request(), Some((1000, false)));
        bench.fill(1000);
        assert_eq!(bench.change(1000), MaskLookup::Here, "from its register");
        assert_eq!(bench.request(), Some((1002, true)), "displaced when 1000 takes its place");
        let t = bench.cache.traffic();
        assert_eq!((t.lines, t.written, t.misses), (1, 2, 1));
        assert!(bench.cache.is_quiet());
    }

    #[test]
    fn mask_cache_of_zero_bytes_writes_every_line_back_at_once() {
        let mut bench = Bench::new(0, 1);
        assert_eq!(bench.change(1000), MaskLookup::Here);
        assert_eq!(bench.request(), Some((1000, true)));
        assert_eq!(bench.change(1000), MaskLookup::Waits);
        assert_eq!(bench.change(1001), MaskLookup::Full, "its one register waits");
    }

    #[test]
    fn mask_cache_of_an_ended_bundle_writes_nothing_back() {
        let mut bench = Bench::new(64, 1);
        assert_eq!(bench.change(1000), MaskLookup::Here);
        bench.cache.drop_bundle(0);
        assert_eq!(bench.change(1101), MaskLookup::Here, "slot 1, same set");
        assert_eq!(bench.request(), None);
        assert_eq!(bench.change(1000), MaskLookup::Here, "new again");
        assert_eq!(bench.request(), Some((1101, true)), "slot 1 is alive");
    }

    #[test]
    fn mask_store_gives_each_ray_once_a_bundle() {
        let mut store = MaskStore::new(2, 3);
        store.start_bundle(0);
        store.start_bundle(1);
        assert_eq!(store.take_untested(0, 2, 0b0110), 0b0110);
        assert_eq!(store.take_untested(0, 2, 0b1100), 0b1000);
        assert_eq!(store.take_untested(1, 2, 0b0100), 0b0100, "another slot");
        store.start_bundle(0);
        assert_eq!(store.take_untested(0, 2, 0b0100), 0b0100, "another bundle");
    }
}
