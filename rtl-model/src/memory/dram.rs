//! The board's DRAM: one line at a time, from banks with an open row each.
//!
//! ```text
//! request FIFO per cluster --in turn--> [ row hit or miss cycles, then 512/width beats ] --> response FIFO of the cluster
//! ```
//! Line l lies in bank l mod banks; a row of a bank holds `row_bytes`. A line takes `row_hit` or `row_miss` cycles,
//! then one beat a cycle; the next one starts in the cycle after the last beat. A line written back takes as long and is
//! not answered. A test-bench model, not RTL.
//! Sizes, banks and timing are ASSUMED. Not modelled: refresh, overlap of banks.

use super::{LINE_BYTES, Line, MemoryRequest, Traffic};
use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, next_set_bit};

/// One cluster's link to the DRAM.
#[derive(Debug, Clone)]
pub struct DramPort {
    /// Lines asked for, or written back.
    pub requests: Fifo<MemoryRequest>,
    /// Lines delivered.
    pub responses: Fifo<Line>,
}

#[derive(Clone, Copy, Debug)]
struct Service {
    cluster: u32,
    request: MemoryRequest,
    latency: u32,
    beats: u32,
}

/// The memory.
#[derive(Clone, Debug)]
pub struct Dram {
    open_rows: Vec<Option<u32>>,
    row_hit_cycles: u32,
    row_miss_cycles: u32,
    beats_per_line: u32,
    lines_per_row: u32,
    service: Option<Service>,
    turn: u32,
    traffic: Traffic,
}

/// The ports of a cycle: `ports[c]` is cluster c's.
#[derive(Debug)]
pub struct DramIo<'a> {
    /// Links to the clusters.
    pub ports: &'a mut [DramPort],
}

impl Dram {
    /// An idle memory with all rows closed.
    pub fn new(
        width_bits: u32,
        banks: u32,
        row_bytes: u32,
        row_hit_cycles: u32,
        row_miss_cycles: u32,
    ) -> Self {
        Dram {
            open_rows: vec![None; banks as usize],
            row_hit_cycles,
            row_miss_cycles,
            beats_per_line: LINE_BYTES * 8 / width_bits,
            lines_per_row: row_bytes / LINE_BYTES,
            service: None,
            turn: 0,
            traffic: Traffic::default(),
        }
    }

    /// One cycle.
    #[inline]
    pub fn tick<O: Observer>(&mut self, now: Cycle, io: DramIo<'_>, observer: &mut O) -> Activity {
        if self.service.is_none() {
            self.service = self.next_request(now, io.ports, observer);
        }
        let Some(service) = &mut self.service else { return Activity::Idle };
        self.traffic.busy_cycles += 1;
        if service.latency > 0 {
            service.latency -= 1;
            return Activity::Stall(Cause::Memory);
        }
        if service.beats > 1 {
            service.beats -= 1;
            return Activity::Work;
        }
        if !service.request.write {
            let responses = &mut io.ports[service.cluster as usize].responses;
            if !responses.can_push(now) {
                self.traffic.busy_cycles -= 1;
                return Activity::Stall(Cause::OutputFull);
            }
            responses.send(now, service.request.line, observer);
        }
        self.service = None;
        Activity::Work
    }

    fn next_request<O: Observer>(
        &mut self,
        now: Cycle,
        ports: &mut [DramPort],
        observer: &mut O,
    ) -> Option<Service> {
        let waiting = (0..).zip(ports.iter()).filter(|(_, p)| p.requests.front(now).is_some());
        let waiting = waiting.fold(0u64, |mask, (i, _): (u32, _)| mask | 1 << i);
        let cluster = next_set_bit(waiting, self.turn)?;
        self.turn = cluster + 1;
        let request = ports[cluster as usize].requests.take(now, observer)?;
        let line = request.line;
        let banks = self.open_rows.len() as u32;
        let (bank, row) = (line.0 % banks, line.0 / banks / self.lines_per_row);
        let open = &mut self.open_rows[bank as usize];
        let hit = *open == Some(row);
        *open = Some(row);
        self.traffic.accesses += 1;
        self.traffic.lines += u64::from(!request.write);
        self.traffic.written += u64::from(request.write);
        self.traffic.misses += u64::from(!hit);
        let latency = if hit { self.row_hit_cycles } else { self.row_miss_cycles };
        Some(Service { cluster, request, latency, beats: self.beats_per_line })
    }

    /// Line transfers and row misses so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// True when no line is being read.
    pub fn is_quiet(&self) -> bool {
        self.service.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Silent;

    /// Cycle in which the responses become visible, for lines requested together in cycle 0.
    fn arrival_cycles(lines: &[u32], mut dram: Dram) -> Vec<u64> {
        let mut ports = vec![DramPort { requests: Fifo::new(8), responses: Fifo::new(2) }];
        let mut to_send = lines.iter();
        let mut arrivals = Vec::new();
        for now in 0..1000 {
            if ports[0].requests.can_push(now)
                && let Some(&line) = to_send.next()
            {
                ports[0].requests.push(now, MemoryRequest::read(Line(line)));
            }
            if ports[0].responses.pop(now).is_some() {
                arrivals.push(now);
            }
            dram.tick(now, DramIo { ports: &mut ports }, &mut Silent);
        }
        assert_eq!(arrivals.len(), lines.len());
        arrivals
    }

    #[test]
    fn dram_line_takes_row_cycles_plus_beats_and_rows_stay_open() {
        let dram = || Dram::new(32, 4, 1024, 2, 6);
        // Request visible in cycle 1; 6 + 16 cycles of service end in cycle 22; response visible in 23.
        assert_eq!(arrival_cycles(&[0], dram()), [1 + 6 + 16]);
        // Same bank, same row: 2 + 16 more. Another bank: a row miss again.
        assert_eq!(arrival_cycles(&[0, 4, 1], dram()), [23, 23 + 18, 23 + 18 + 22]);
        // Same bank, the next row (16 lines a row, 4 banks).
        assert_eq!(arrival_cycles(&[0, 64], dram()), [23, 23 + 22]);
    }

    #[test]
    fn dram_twice_as_wide_halves_the_beats() {
        assert_eq!(arrival_cycles(&[0], Dram::new(64, 4, 1024, 2, 6)), [1 + 6 + 8]);
    }
}
