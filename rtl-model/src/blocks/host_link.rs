//! Host bus and DMA: descriptors down, results up, one burst at a time.
//!
//! ```text
//! FetchRequest --> [ set-up, arbitration, beats ] --Job--> command FIFO of the cluster
//! result FIFOs --> [          arbitration, beats ] --------> host memory
//! ```
//! A burst moves at most `burst_bytes` after `arbitration_cycles` of the bus; a beat moves one bus word. An upward
//! burst starts when a cluster has a full one, a bundle's last entry, or a full FIFO; down and up alternate when both
//! wait, by whole descriptors: one longer than a burst keeps its turn, and pays arbitration before each of its bursts.
//! The bus clock runs beside the board clock by an exact integer accumulator; result FIFOs give an entry a board cycle,
//! for which a faster bus waits within its burst. A cycle without a bus edge in which something waits is a stall (bus).
//! A test-bench model, not RTL.
//! Timing is ASSUMED (SBus of a workstation of the time). Not modelled: other masters on the bus.

use crate::sim::{Activity, Cause, Cycle, Fifo, LinkState, Observer, next_set_bit};
use crate::spec::BoardSpec;

use super::dispatcher::FetchRequest;
use super::{Estimate, Job, ResultEntry};

/// A cluster's side of the host link.
#[derive(Clone, Debug)]
pub struct HostPort {
    /// Descriptors, to the cluster's bundle generator.
    pub commands: Fifo<Job>,
    /// Results, from the cluster's result merge.
    pub entries: Fifo<ResultEntry>,
    /// One token per entry that ends a bundle, pushed and popped along with it: the count of ends in `entries`.
    pub ends: Fifo<()>,
    /// Of low-resolution rays, from the cluster's result merge to the dispatcher.
    pub estimates: Fifo<Estimate>,
}

impl HostPort {
    /// Empty queues of these depths.
    pub fn new(commands: u32, entries: u32) -> Self {
        HostPort {
            commands: Fifo::new(commands),
            entries: Fifo::new(entries),
            ends: Fifo::new(entries),
            estimates: Fifo::new(2),
        }
    }

    /// Shows every link with its name.
    pub(crate) fn links(&mut self, name: &str, see: &mut dyn FnMut(String, &mut LinkState)) {
        see(format!("{name}.commands"), self.commands.state_mut());
        see(format!("{name}.results"), self.entries.state_mut());
        see(format!("{name}.estimates"), self.estimates.state_mut());
    }

    /// True when nothing is queued.
    pub fn is_quiet(&self) -> bool {
        self.commands.is_empty()
            && self.entries.is_empty()
            && self.ends.is_empty()
            && self.estimates.is_empty()
    }
}

#[derive(Clone, Copy, Debug)]
enum Transfer {
    Down {
        request: FetchRequest,
        bytes_left: u32,
        burst_left: u32,
    },
    /// `entry` is `None` while the FIFO has none to give in this board cycle.
    Up {
        cluster: usize,
        entries_left: u32,
        entry: Option<ResultEntry>,
        beats_left: u32,
    },
}

/// The block.
#[derive(Clone, Debug)]
pub struct HostLink {
    word_bytes: u32,
    burst_bytes: u32,
    arbitration_cycles: u32,
    setup_cycles: u64,
    board_hz: u64,
    bus_hz: u64,
    phase_hz: u64,
    setup_left: u64,
    arbitration_left: u32,
    transfer: Option<Transfer>,
    last_was_up: bool,
    turn: u32,
    entry_bytes: u32,
    down_bytes: u64,
    up_bytes: u64,
    down_cycles: u64,
    up_cycles: u64,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct HostLinkIo<'a> {
    /// Descriptors to fetch.
    pub fetches: &'a mut Fifo<FetchRequest>,
    /// The clusters.
    pub clusters: &'a mut [HostPort],
    /// Host memory: results in order of arrival.
    pub delivered: &'a mut Vec<ResultEntry>,
}

impl HostLink {
    /// An idle link.
    pub fn new(spec: &BoardSpec) -> Self {
        let hz = |mhz: f64| (mhz * 1e6).round() as u64;
        HostLink {
            word_bytes: spec.bus.width_bits / 8,
            burst_bytes: spec.bus.burst_bytes,
            arbitration_cycles: spec.bus.arbitration_cycles,
            setup_cycles: spec.bus.dma_setup_cycles,
            board_hz: hz(spec.clock_mhz),
            bus_hz: hz(spec.bus.clock_mhz),
            phase_hz: 0,
            setup_left: 0,
            arbitration_left: 0,
            transfer: None,
            last_was_up: false,
            turn: 0,
            entry_bytes: 8,
            down_bytes: 0,
            up_bytes: 0,
            down_cycles: 0,
            up_cycles: 0,
        }
    }

    /// Takes a command whose result entries have `entry_bytes` bytes each.
    pub fn start(&mut self, entry_bytes: u32) {
        self.setup_left = self.setup_cycles;
        self.entry_bytes = entry_bytes;
    }

    /// True when nothing is being moved.
    pub fn is_quiet(&self) -> bool {
        self.transfer.is_none() && self.setup_left == 0
    }

    /// Bus cycles of transfers down and up so far, their arbitration included.
    pub fn bus_cycles(&self) -> [u64; 2] {
        [self.down_cycles, self.up_cycles]
    }

    /// Bytes moved down and up so far.
    pub fn bytes(&self) -> [u64; 2] {
        [self.down_bytes, self.up_bytes]
    }

    /// One board cycle.
    #[inline]
    pub fn tick<O: Observer>(&mut self, now: Cycle, mut io: HostLinkIo<'_>, observer: &mut O) -> Activity {
        if self.setup_left > 0 {
            self.setup_left -= 1;
            return Activity::Stall(Cause::Bus);
        }
        let mut activity = Activity::Idle;
        self.phase_hz += self.bus_hz;
        let has_edge = self.phase_hz >= self.board_hz;
        while self.phase_hz >= self.board_hz {
            self.phase_hz -= self.board_hz;
            match self.bus_cycle(now, &mut io, observer) {
                Activity::Idle => {}
                Activity::Work => activity = Activity::Work,
                stall if activity == Activity::Idle => activity = stall,
                _ => {}
            }
        }
        if !has_edge {
            let waits = self.transfer.is_some()
                || io.fetches.front(now).is_some()
                || self.sending(now, io.clusters) != 0;
            return if waits { Activity::Stall(Cause::Bus) } else { Activity::Idle };
        }
        activity
    }

    fn bus_cycle<O: Observer>(&mut self, now: Cycle, io: &mut HostLinkIo<'_>, observer: &mut O) -> Activity {
        if self.transfer.is_none() {
            self.grant(now, io, observer);
            if self.transfer.is_none() {
                return Activity::Idle;
            }
        }
        match self.transfer {
            Some(Transfer::Down { .. }) => self.down_cycles += 1,
            _ => self.up_cycles += 1,
        }
        if self.arbitration_left > 0 {
            self.arbitration_left -= 1;
            return Activity::Stall(Cause::Bus);
        }
        self.beat(now, io, observer)
    }

    fn burst_entries(&self) -> u32 {
        (self.burst_bytes / self.entry_bytes).max(1)
    }

    /// The clusters whose results may start a burst, a bit each.
    fn sending(&self, now: Cycle, clusters: &[HostPort]) -> u64 {
        let burst_entries = self.burst_entries();
        let mut sending = 0u64;
        for (c, port) in clusters.iter().enumerate() {
            let len = port.entries.len(now);
            let flush = port.ends.front(now).is_some() || len == port.entries.depth();
            sending |=
                u64::from(len > 0 && port.entries.front(now).is_some() && (flush || len >= burst_entries))
                    << c;
        }
        sending
    }

    /// Starts a burst.
    fn grant<O: Observer>(&mut self, now: Cycle, io: &mut HostLinkIo<'_>, observer: &mut O) {
        let up = next_set_bit(self.sending(now, io.clusters), self.turn);
        let down = io.fetches.front(now).is_some();
        match up {
            Some(cluster) if !(down && self.last_was_up) => {
                self.turn = cluster + 1;
                let cluster = cluster as usize;
                let entries_left = self.burst_entries().min(io.clusters[cluster].entries.len(now));
                let entry = self.take_entry(now, &mut io.clusters[cluster], observer);
                let beats_left = self.beats_per_entry();
                self.transfer = Some(Transfer::Up { cluster, entries_left, entry, beats_left });
                self.last_was_up = true;
            }
            _ => {
                let Some(request) = io.fetches.take(now, observer) else { return };
                let bytes_left = request.job.bytes;
                self.transfer = Some(Transfer::Down { request, bytes_left, burst_left: self.burst_bytes });
                self.last_was_up = false;
            }
        }
        self.arbitration_left = self.arbitration_cycles;
    }

    fn beats_per_entry(&self) -> u32 {
        self.entry_bytes.div_ceil(self.word_bytes)
    }

    fn take_entry<O: Observer>(
        &self,
        now: Cycle,
        port: &mut HostPort,
        observer: &mut O,
    ) -> Option<ResultEntry> {
        let entry = port.entries.take(now, observer)?;
        if entry.is_last() {
            port.ends.pop(now);
        }
        Some(entry)
    }

    /// Moves one bus word. With a bus faster than the board it stalls when the last word of a descriptor finds its link
    /// taken in this cycle (output full), and when the next result comes in the next board cycle only (bus).
    fn beat<O: Observer>(&mut self, now: Cycle, io: &mut HostLinkIo<'_>, observer: &mut O) -> Activity {
        match self.transfer.take() {
            None => {}
            Some(Transfer::Down { request, bytes_left, burst_left })
                if bytes_left <= self.word_bytes
                    && !io.clusters[request.cluster as usize].commands.can_push(now) =>
            {
                self.transfer = Some(Transfer::Down { request, bytes_left, burst_left });
                return Activity::Stall(Cause::OutputFull);
            }
            Some(Transfer::Down { request, bytes_left, burst_left }) => {
                let moved = self.word_bytes.min(bytes_left);
                self.down_bytes += u64::from(moved);
                let (bytes_left, burst_left) = (bytes_left - moved, burst_left - self.word_bytes);
                if bytes_left == 0 {
                    io.clusters[request.cluster as usize].commands.send(now, request.job, observer);
                    return Activity::Work;
                }
                let burst_left = if burst_left == 0 {
                    self.arbitration_left = self.arbitration_cycles;
                    self.burst_bytes
                } else {
                    burst_left
                };
                self.transfer = Some(Transfer::Down { request, bytes_left, burst_left });
            }
            Some(Transfer::Up { cluster, entries_left, entry, beats_left }) => {
                let Some(entry) = entry.or_else(|| self.take_entry(now, &mut io.clusters[cluster], observer))
                else {
                    self.transfer = Some(Transfer::Up { cluster, entries_left, entry: None, beats_left });
                    return Activity::Stall(Cause::Bus);
                };
                if beats_left > 1 {
                    let (entry, beats_left) = (Some(entry), beats_left - 1);
                    self.transfer = Some(Transfer::Up { cluster, entries_left, entry, beats_left });
                    return Activity::Work;
                }
                self.up_bytes += u64::from(self.entry_bytes);
                io.delivered.push(entry);
                if entries_left > 1 {
                    self.transfer = Some(Transfer::Up {
                        cluster,
                        entries_left: entries_left - 1,
                        entry: self.take_entry(now, &mut io.clusters[cluster], observer),
                        beats_left: self.beats_per_entry(),
                    });
                }
            }
        }
        Activity::Work
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Silent;

    fn link(bus_mhz: f64, arbitration_cycles: u32, burst_bytes: u32) -> HostLink {
        let mut spec = BoardSpec::default();
        spec.bus.clock_mhz = bus_mhz;
        spec.bus.arbitration_cycles = arbitration_cycles;
        spec.bus.burst_bytes = burst_bytes;
        spec.bus.dma_setup_cycles = 0;
        let mut link = HostLink::new(&spec);
        link.start(8);
        link
    }

    /// Activities from cycle 100 on, of a link that fetches one descriptor.
    fn fetch(mut link: HostLink, bytes: u32, cycles: u64) -> Vec<Activity> {
        let mut fetches = Fifo::new(2);
        let job = Job { bytes, ..Job::default() };
        fetches.push(0, FetchRequest { cluster: 0, job });
        let mut clusters = [HostPort::new(2, 2)];
        let mut delivered = Vec::new();
        let activities = (100..100 + cycles)
            .map(|now| {
                let (fetches, clusters, delivered) = (&mut fetches, &mut clusters[..], &mut delivered);
                link.tick(now, HostLinkIo { fetches, clusters, delivered }, &mut Silent)
            })
            .collect();
        assert_eq!(clusters[0].commands.pop(100 + cycles), Some(job));
        assert_eq!(link.bytes(), [u64::from(bytes), 0]);
        activities
    }

    #[test]
    fn host_link_on_a_10_mhz_bus_moves_a_beat_each_two_and_a_half_cycles_of_a_25_mhz_board() {
        let activities = fetch(link(10.0, 0, 1024), 400, 260);
        let works = (0..260).filter(|i| activities[*i] == Activity::Work).collect::<Vec<_>>();
        assert_eq!(works.len(), 100);
        assert_eq!(works[99], 249, "100 beats in 250 cycles");
        assert!(works.windows(3).all(|w| w[2] - w[0] == 5 && (2..=3).contains(&(w[1] - w[0]))), "{works:?}");
        // Between the beats, and before the first, the bus is waited for.
        assert!(activities[..250].iter().all(|a| matches!(a, Activity::Work | Activity::Stall(Cause::Bus))));
        assert!(activities[250..].iter().all(|a| *a == Activity::Idle));
    }

    #[test]
    fn host_link_descriptor_of_three_bursts_pays_arbitration_three_times() {
        let activities = fetch(link(25.0, 4, 64), 160, 60);
        let works = activities.iter().filter(|a| **a == Activity::Work).count();
        let waits = activities.iter().filter(|a| **a == Activity::Stall(Cause::Bus)).count();
        assert_eq!((works, waits), (40, 3 * 4));
        assert!(activities[52..].iter().all(|a| *a == Activity::Idle));
    }

    #[test]
    fn host_link_faster_than_the_board_keeps_its_upward_burst_and_takes_an_entry_a_cycle() {
        let mut link = link(100.0, 4, 64);
        let mut clusters = [HostPort::new(2, 8)];
        for ray in 0..8 {
            let entry = ResultEntry::Nearest { ray, hit: None, last: ray == 7 };
            clusters[0].entries.push(u64::from(ray), entry);
        }
        clusters[0].ends.push(7, ());
        let (mut fetches, mut delivered) = (Fifo::new(2), Vec::new());
        let counts: Vec<usize> = (8..17)
            .map(|now| {
                let (fetches, clusters) = (&mut fetches, &mut clusters[..]);
                link.tick(now, HostLinkIo { fetches, clusters, delivered: &mut delivered }, &mut Silent);
                delivered.len()
            })
            .collect();
        // Four bus cycles of arbitration, once; two beats an entry, of which the first was taken with the grant.
        assert_eq!(counts, [0, 2, 3, 4, 5, 6, 7, 8, 8]);
        assert!(link.is_quiet() && clusters[0].is_quiet());
    }
}
