//! Dispatcher: decides which cluster gets which bundle, and has the DMA fetch it.
//!
//! ```text
//! jobs of the command --static: a range per cluster | ideal: first cluster with room--> FetchRequest --> host link
//! ```
//! A cluster's room is counted by credits: fetches asked for less descriptors taken by its bundle generator, so the
//! bus never carries what has no place. One request a cycle. Stalls: host link's queue full (output full), no cluster with
//! jobs left has room (resource).
//! Source: static partition (1991 board paper; here of equal bundle counts). Not modelled yet: low-resolution
//! estimate, pseudo-dynamic rebalance.

use std::ops::Range;

use crate::sim::{Activity, Cause, Cycle, Fifo, next_in_turn};
use crate::spec::Scheduling;

use super::{HostPort, Job};

/// One descriptor to fetch for one cluster.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FetchRequest {
    /// For whom.
    pub cluster: u32,
    /// What.
    pub job: Job,
}

/// The block.
#[derive(Clone, Debug)]
pub struct Dispatcher {
    scheduling: Scheduling,
    /// Jobs not yet asked for: one range per cluster (static), or the first for all (ideal).
    ranges: Vec<Range<usize>>,
    /// Fetches ever asked for, per cluster.
    issued: Vec<u64>,
    turn: usize,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct DispatcherIo<'a> {
    /// The command's jobs, in the host's memory.
    pub jobs: &'a [Job],
    /// The clusters' command FIFOs.
    pub clusters: &'a [HostPort],
    /// To the host link.
    pub fetches: &'a mut Fifo<FetchRequest>,
}

impl Dispatcher {
    /// For `n_clusters` clusters.
    pub fn new(scheduling: Scheduling, n_clusters: u32) -> Self {
        let n = n_clusters as usize;
        Dispatcher { scheduling, ranges: vec![0..0; n], issued: vec![0; n], turn: 0 }
    }

    /// Takes a command of `n_jobs` jobs.
    pub fn start(&mut self, n_jobs: usize) {
        let n = self.ranges.len();
        for (c, range) in self.ranges.iter_mut().enumerate() {
            *range = match self.scheduling {
                Scheduling::Static => c * n_jobs / n..(c + 1) * n_jobs / n,
                Scheduling::Ideal => 0..if c == 0 { n_jobs } else { 0 },
            };
        }
    }

    /// True when every job has been asked for.
    pub fn is_quiet(&self) -> bool {
        self.ranges.iter().all(Range::is_empty)
    }

    /// One cycle.
    #[inline]
    pub fn tick(&mut self, now: Cycle, io: DispatcherIo<'_>) -> Activity {
        if self.is_quiet() {
            return Activity::Idle;
        }
        if !io.fetches.can_push(now) {
            return Activity::Stall(Cause::OutputFull);
        }
        let with_room = |c: usize| {
            let commands = &io.clusters[c].commands;
            self.issued[c] - commands.taken(now) < u64::from(commands.depth())
                && !self.ranges[self.source(c)].is_empty()
        };
        let Some(c) = next_in_turn(self.ranges.len(), self.turn, with_room) else {
            return Activity::Stall(Cause::Resource);
        };
        let source = self.source(c);
        let Some(job) = self.ranges[source].next() else { return Activity::Idle };
        io.fetches.push(now, FetchRequest { cluster: c as u32, job: io.jobs[job] });
        self.issued[c] += 1;
        self.turn = c + 1;
        Activity::Work
    }

    /// Whose range cluster `c` takes its jobs from.
    fn source(&self, c: usize) -> usize {
        match self.scheduling {
            Scheduling::Static => c,
            Scheduling::Ideal => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Job indices in the order in which each of 4 clusters gets them, of 10 jobs.
    fn dealt(scheduling: Scheduling) -> Vec<Vec<u32>> {
        let jobs: Vec<Job> = (0..10).map(|index| Job { index, ..Job::default() }).collect();
        let mut dispatcher = Dispatcher::new(scheduling, 4);
        dispatcher.start(jobs.len());
        let clusters = vec![HostPort::new(16, 2); 4];
        let mut fetches = Fifo::new(2);
        let mut dealt = vec![Vec::new(); 4];
        for now in 0..20 {
            dispatcher.tick(now, DispatcherIo { jobs: &jobs, clusters: &clusters, fetches: &mut fetches });
            if let Some(fetch) = fetches.pop(now) {
                dealt[fetch.cluster as usize].push(fetch.job.index);
            }
        }
        assert!(dispatcher.is_quiet());
        dealt
    }

    #[test]
    fn dispatcher_static_cuts_ten_jobs_into_ranges_of_two_or_three() {
        let expected = [vec![0, 1], vec![2, 3, 4], vec![5, 6], vec![7, 8, 9]];
        assert_eq!(dealt(Scheduling::Static), expected);
    }

    #[test]
    fn dispatcher_ideal_deals_jobs_in_turn_while_all_have_room() {
        let expected = [vec![0, 4, 8], vec![1, 5, 9], vec![2, 6], vec![3, 7]];
        assert_eq!(dealt(Scheduling::Ideal), expected);
    }

    #[test]
    fn dispatcher_stops_at_the_depth_of_the_command_fifos() {
        let jobs = [Job::default(); 10];
        let mut dispatcher = Dispatcher::new(Scheduling::Static, 1);
        dispatcher.start(jobs.len());
        let clusters = [HostPort::new(2, 2)];
        let mut fetches = Fifo::new(16);
        let mut tick = |now| {
            dispatcher.tick(now, DispatcherIo { jobs: &jobs, clusters: &clusters, fetches: &mut fetches })
        };
        let no_room = Activity::Stall(Cause::Resource);
        assert_eq!([0, 1, 2, 3].map(&mut tick), [Activity::Work, Activity::Work, no_room, no_room]);
    }
}
