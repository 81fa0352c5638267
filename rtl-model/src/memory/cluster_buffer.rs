//! The memory of a cluster: an optional buffer between the caches of its modules and the board's DRAM.
//!
//! ```text
//! request FIFO per cache --one a cycle, in turn--> tags --hit, after `cycles`--> fill wire of the cache
//!                                                   `--miss--> miss register --> DRAM link --> install --> fill wires
//! ```
//! State: tags, miss registers with the set of caches that wait for each, hit pipeline. One look-up a cycle; a hit
//! takes `cycles`, a miss the DRAM's time + 2 (link each way). A fill that would drive a wire twice waits a cycle.
//! A line written back by a cache goes through to the DRAM, in order with the reads of its cache.
//! Stalls: DRAM link full (output full), no miss register free (resource), lines on their way (memory).
//! Source: "hierarchical patch memory with a cache per processing element" (1992 board paper); the rest ASSUMED.

use super::{Line, LineCache, MemoryRequest, Traffic};
use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Pipe, Wire, next_set_bit};

/// A line on its way to the caches in `sources` (a bit each).
#[derive(Clone, Copy, Debug)]
struct Fill {
    line: Line,
    sources: u64,
}

/// The cluster's memory; without a buffer (0 bytes) it only merges and routes.
#[derive(Clone, Debug)]
pub struct ClusterBuffer {
    cache: LineCache,
    hits: Pipe<Fill>,
    open: Vec<Fill>,
    capacity: usize,
    /// Caches whose request found no miss register free; they bid again after the next fill.
    full: u64,
    /// Something changed in this cycle that is no work: a look-up that found no room, or joined one on its way.
    unsettled: bool,
    turn: u32,
    traffic: Traffic,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct ClusterBufferIo<'a> {
    /// Requests, one FIFO per cache.
    pub requests: &'a mut [Fifo<MemoryRequest>],
    /// Fills, one wire per cache.
    pub fills: &'a mut [Wire<Line>],
    /// To the DRAM.
    pub dram_request: &'a mut Fifo<MemoryRequest>,
    /// From the DRAM.
    pub dram_response: &'a mut Fifo<Line>,
}

impl ClusterBuffer {
    /// An empty buffer of `bytes` bytes, answering hits after `cycles >= 1`.
    pub fn new(bytes: u32, ways: u32, cycles: u32, miss_registers: u32) -> Self {
        ClusterBuffer {
            cache: LineCache::new(bytes / super::LINE_BYTES, ways),
            hits: Pipe::new(cycles),
            open: Vec::with_capacity(miss_registers as usize),
            capacity: miss_registers as usize,
            full: 0,
            unsettled: false,
            turn: 0,
            traffic: Traffic::default(),
        }
    }

    /// One cycle.
    #[inline]
    pub fn tick<O: Observer>(&mut self, now: Cycle, io: ClusterBufferIo<'_>, observer: &mut O) -> Activity {
        self.unsettled = false;
        let mut driven = 0;
        if let Some(&fill) = self.hits.head() {
            deliver(now, fill, io.fills);
            driven = fill.sources;
        }
        let mut filled = false;
        if let Some(&line) = io.dram_response.front(now) {
            let register = self.open.iter().position(|fill| fill.line == line);
            let register = register.expect("a line that nobody asked for came from the DRAM");
            if self.open[register].sources & driven == 0 {
                io.dram_response.take(now, observer);
                deliver(now, self.open.swap_remove(register), io.fills);
                self.cache.install(line);
                self.full = 0;
                filled = true;
            }
        }
        let (hit, looked_up, refused) = self.look_up(now, io.requests, io.dram_request, observer);
        if hit.is_some() || !self.hits.is_empty() {
            self.hits.step(hit);
        }
        if filled || looked_up || driven != 0 {
            Activity::Work
        } else if let Some(cause) = refused {
            Activity::Stall(cause)
        } else if !self.open.is_empty() {
            Activity::Stall(Cause::Memory)
        } else {
            Activity::Idle
        }
    }

    /// Serves one request: a hit to start down the pipeline, whether one was taken, why one was refused.
    fn look_up<O: Observer>(
        &mut self,
        now: Cycle,
        requests: &mut [Fifo<MemoryRequest>],
        dram_request: &mut Fifo<MemoryRequest>,
        observer: &mut O,
    ) -> (Option<Fill>, bool, Option<Cause>) {
        let waiting = (0..).zip(requests.iter()).filter(|(_, f)| f.front(now).is_some());
        let waiting = waiting.fold(0u64, |mask, (i, _): (u32, _)| mask | 1 << i);
        let Some(source) = next_set_bit(waiting & !self.full, self.turn) else {
            return (None, false, (waiting != 0).then_some(Cause::Resource));
        };
        self.turn = source + 1;
        let request = &mut requests[source as usize];
        let Some(&MemoryRequest { line, write }) = request.front(now) else { return (None, false, None) };
        if write {
            // Written through: a copy in the buffer is brought up to date, none is made.
            if !dram_request.can_push(now) {
                self.unsettled = true;
                return (None, false, Some(Cause::OutputFull));
            }
            dram_request.send(now, MemoryRequest { line, write }, observer);
            request.take(now, observer);
            self.cache.lookup(line);
            self.traffic.written += 1;
            return (None, true, None);
        }
        let fill = Fill { line, sources: 1 << source };
        if self.cache.lookup(line) {
            request.take(now, observer);
            self.traffic.accesses += 1;
            return (Some(fill), true, None);
        }
        if let Some(open) = self.open.iter_mut().find(|open| open.line == line) {
            open.sources |= fill.sources;
        } else if self.open.len() == self.capacity {
            self.full |= fill.sources;
            self.unsettled = true;
            return (None, false, Some(Cause::Resource));
        } else if dram_request.can_push(now) {
            dram_request.send(now, MemoryRequest::read(line), observer);
            self.open.push(fill);
            self.traffic.lines += 1;
        } else {
            self.unsettled = true;
            return (None, false, Some(Cause::OutputFull));
        }
        request.take(now, observer);
        self.traffic.accesses += 1;
        self.traffic.misses += 1;
        (None, true, None)
    }

    /// True when time alone changes nothing in it.
    #[inline]
    pub fn is_still(&self) -> bool {
        self.hits.is_empty() && !self.unsettled
    }

    /// Traffic so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// True when no request is inside.
    pub fn is_quiet(&self) -> bool {
        self.open.is_empty() && self.hits.is_empty()
    }
}

fn deliver(now: Cycle, fill: Fill, wires: &mut [Wire<Line>]) {
    let mut left = fill.sources;
    while left != 0 {
        wires[left.trailing_zeros() as usize].set(now, fill.line);
        left &= left - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Silent;

    /// A buffer, its one cache's request FIFO and wire, and its DRAM link.
    struct Bench {
        buffer: ClusterBuffer,
        requests: Vec<Fifo<MemoryRequest>>,
        fills: Vec<Wire<Line>>,
        dram_request: Fifo<MemoryRequest>,
        dram_response: Fifo<Line>,
    }

    impl Bench {
        fn new(cycles: u32, miss_registers: u32) -> Bench {
            Bench {
                buffer: ClusterBuffer::new(1024, 2, cycles, miss_registers),
                requests: vec![Fifo::new(8)],
                fills: vec![Wire::new()],
                dram_request: Fifo::new(2),
                dram_response: Fifo::new(2),
            }
        }

        fn tick(&mut self, now: Cycle) -> Activity {
            let io = ClusterBufferIo {
                requests: &mut self.requests,
                fills: &mut self.fills,
                dram_request: &mut self.dram_request,
                dram_response: &mut self.dram_response,
            };
            self.buffer.tick(now, io, &mut Silent)
        }
    }

    #[test]
    fn cluster_buffer_hit_is_not_out_at_cycles_minus_one_and_out_at_cycles() {
        for cycles in [1, 2, 3, 10] {
            let mut bench = Bench::new(cycles, 1);
            bench.buffer.cache.install(Line(5));
            bench.requests[0].push(0, MemoryRequest::read(Line(5)));
            let mut seen = Vec::new();
            for now in 0..30 {
                bench.tick(now);
                // What is put on the wire in a cycle is seen in the next.
                seen.extend(bench.fills[0].get(now + 1).map(|line| (now, line)));
            }
            assert_eq!(seen, [(1 + u64::from(cycles), Line(5))], "looked up in cycle 1");
            assert_eq!(bench.buffer.traffic(), Traffic { accesses: 1, ..Traffic::default() });
            assert!(bench.buffer.is_quiet());
        }
    }

    #[test]
    fn cluster_buffer_stall_is_named_after_what_is_full() {
        let stall = |miss_registers| {
            let mut bench = Bench::new(1, miss_registers);
            for line in 0..4 {
                bench.requests[0].push(u64::from(line), MemoryRequest::read(Line(line)));
            }
            // Nobody takes from the DRAM link of 2 entries.
            (10..20).map(|now| bench.tick(now)).last()
        };
        assert_eq!(stall(4), Some(Activity::Stall(Cause::OutputFull)));
        assert_eq!(stall(1), Some(Activity::Stall(Cause::Resource)));
    }
}
