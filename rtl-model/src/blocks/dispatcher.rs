//! Dispatcher: decides which cluster gets which bundle, and has the DMA fetch it.
//!
//! ```text
//! jobs of the command --[ low-resolution rays, dealt in turn ]--estimates--> [ cut into ranges of equal estimate ]
//!     static: a range per cluster | pseudo-dynamic: cut anew when it pays | ideal: first cluster with room
//!                                                                       --FetchRequest--> host link
//! ```
//! With partition `shells+static` the centre ray of every n-th bundle is cast first, four of them a job;
//! its cells + tests, times the bundle's rays, estimate that bundle and the n - 1 that follow. Without, a bundle's rays do. Bundles in issue order are then cut
//! by prefix sums. Pseudo-dynamic: when a cluster's range has become empty and max/mean of the remaining estimates is
//! above the threshold, dispatch pauses `rebalance_cycles` and all that is not yet dispatched is cut anew; the first cut
//! after a low-resolution cast takes as long.
//! A cluster's room is counted by credits: fetches asked for less descriptors taken by its bundle generator, so the
//! bus never carries what has no place. One request and one estimate a cycle. Stalls: host link's queue full (output full),
//! no cluster with jobs left has room, estimates not all here, or cutting (resource).
//! Source: static partition by a low-resolution cast (1991 board paper), pseudo-dynamic scheduling (1992); thresholds,
//! costs and the place of the cuts ours. The jobs are a table in the host's memory: the cuts are ASSUMED to be made from
//! sums that the dispatcher keeps, within `rebalance_cycles`.

use std::collections::VecDeque;
use std::ops::Range;

use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Token, next_in_turn};
use crate::spec::{DispatchSpec, Scheduling};

use super::{Estimate, HostPort, Job};

/// One descriptor to fetch for one cluster.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FetchRequest {
    /// For whom.
    pub cluster: u32,
    /// What.
    pub job: Job,
}

impl Token for FetchRequest {
    fn payload(&self) -> u32 {
        self.job.index
    }
}

/// The block.
#[derive(Clone, Debug)]
pub struct Dispatcher {
    scheduling: Scheduling,
    spec: DispatchSpec,
    n_clusters: usize,
    /// Jobs not yet asked for: ranges per cluster, or all of them the first's (ideal, low resolution).
    queues: Vec<VecDeque<Range<usize>>>,
    /// Estimated work left in each queue.
    left: Vec<u64>,
    /// Estimated work of each job.
    estimates: Vec<u64>,
    /// Bundles that an estimate that comes in stands for; 0 outside a low-resolution cast.
    every: usize,
    awaited: usize,
    /// All clusters take from the first queue.
    shared: bool,
    /// A cluster's range has become empty, which was not yet looked into.
    ran_out: bool,
    /// Cycles of cutting that are left.
    pause: u32,
    /// Fetches ever asked for, per cluster.
    issued: Vec<u64>,
    turn: usize,
    rebalances: u64,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct DispatcherIo<'a> {
    /// The jobs of the command, or of its low-resolution cast, in the host's memory.
    pub jobs: &'a [Job],
    /// The clusters' command and estimate FIFOs.
    pub clusters: &'a mut [HostPort],
    /// To the host link.
    pub fetches: &'a mut Fifo<FetchRequest>,
}

impl Dispatcher {
    /// For `n_clusters` clusters.
    pub fn new(scheduling: Scheduling, spec: &DispatchSpec, n_clusters: u32) -> Self {
        let n = n_clusters as usize;
        Dispatcher {
            scheduling,
            spec: *spec,
            n_clusters: n,
            queues: vec![VecDeque::new(); n],
            left: vec![0; n],
            estimates: Vec::new(),
            every: 0,
            awaited: 0,
            shared: false,
            ran_out: false,
            pause: 0,
            issued: vec![0; n],
            turn: 0,
            rebalances: 0,
        }
    }

    /// Takes the low-resolution cast `cast` of a command with these jobs: a ray for every `every` bundles.
    pub fn start_low_resolution(&mut self, jobs: &[Job], cast: &[Job], every: usize) {
        self.estimates = jobs.iter().map(|job| u64::from(job.n_rays)).collect();
        self.every = every;
        self.awaited = cast.iter().map(|job| job.n_rays as usize).sum();
        self.deal(cast.len());
    }

    /// Takes a command's bundles; `estimated` when a low-resolution cast came before.
    pub fn start(&mut self, jobs: &[Job], estimated: bool) {
        self.every = 0;
        if !estimated {
            self.estimates = jobs.iter().map(|job| u64::from(job.n_rays)).collect();
        }
        if self.scheduling == Scheduling::Ideal {
            self.deal(jobs.len());
            return;
        }
        self.shared = false;
        self.pause = if estimated { self.spec.rebalance_cycles } else { 0 };
        self.queues.iter_mut().for_each(VecDeque::clear);
        self.queues[0].push_back(0..jobs.len());
        self.cut();
    }

    /// All jobs for whoever has room.
    fn deal(&mut self, n_jobs: usize) {
        self.shared = true;
        self.pause = 0;
        self.queues.iter_mut().for_each(VecDeque::clear);
        self.queues[0].push_back(0..n_jobs);
    }

    /// Cuts what is in all queues, in issue order, into one part of equal estimate for each cluster.
    fn cut(&mut self) {
        let mut ranges: Vec<Range<usize>> = self.queues.iter_mut().flat_map(std::mem::take).collect();
        ranges.sort_by_key(|range| range.start);
        let total: u64 = ranges.iter().flat_map(|range| &self.estimates[range.clone()]).sum();
        self.left.fill(0);
        let n = self.n_clusters as u64;
        let mut sum = 0;
        for range in ranges {
            for job in range {
                let estimate = self.estimates[job];
                // The cluster in whose share the job's middle lies.
                let cluster =
                    if total == 0 { 0 } else { ((2 * sum + estimate) * n / (2 * total)).min(n - 1) };
                sum += estimate;
                let cluster = cluster as usize;
                self.left[cluster] += estimate;
                match self.queues[cluster].back_mut() {
                    Some(last) if last.end == job => last.end += 1,
                    _ => self.queues[cluster].push_back(job..job + 1),
                }
            }
        }
    }

    /// True when every job has been asked for and every estimate is here.
    pub fn is_quiet(&self) -> bool {
        self.queues.iter().all(VecDeque::is_empty) && self.awaited == 0
    }

    /// Times that the partition was cut anew so far.
    pub fn rebalances(&self) -> u64 {
        self.rebalances
    }

    /// One cycle.
    #[inline]
    pub fn tick<O: Observer>(&mut self, now: Cycle, io: DispatcherIo<'_>, observer: &mut O) -> Activity {
        if self.is_quiet() {
            return Activity::Idle;
        }
        let took = self.awaited > 0 && self.take_estimate(now, io.clusters, observer);
        if self.pause > 0 {
            self.pause -= 1;
            return Activity::Stall(Cause::Resource);
        }
        if self.queues.iter().all(VecDeque::is_empty) {
            return if took { Activity::Work } else { Activity::Stall(Cause::Resource) };
        }
        if std::mem::take(&mut self.ran_out) && self.is_uneven() {
            self.cut();
            self.rebalances += 1;
            self.pause = self.spec.rebalance_cycles;
            return Activity::Work;
        }
        if !io.fetches.can_push(now) {
            return if took { Activity::Work } else { Activity::Stall(Cause::OutputFull) };
        }
        let with_room = |c: usize| {
            let commands = &io.clusters[c].commands;
            self.issued[c] - commands.taken(now) < u64::from(commands.depth())
                && !self.queues[self.source(c)].is_empty()
        };
        let Some(c) = next_in_turn(self.n_clusters, self.turn, with_room) else {
            return if took { Activity::Work } else { Activity::Stall(Cause::Resource) };
        };
        let source = self.source(c);
        let queue = &mut self.queues[source];
        let Some(job) = queue.front_mut().and_then(Iterator::next) else { return Activity::Idle };
        if queue.front().is_some_and(Range::is_empty) {
            queue.pop_front();
        }
        if !self.shared {
            self.left[source] -= self.estimates[job];
            self.ran_out |= queue.is_empty() && self.scheduling == Scheduling::PseudoDynamic;
        }
        io.fetches.send(now, FetchRequest { cluster: c as u32, job: io.jobs[job] }, observer);
        self.issued[c] += 1;
        self.turn = c + 1;
        Activity::Work
    }

    /// True when the clusters' estimates are too uneven, and a cut can help.
    fn is_uneven(&self) -> bool {
        // What a cut can deal out is whole bundles: with one left there is nothing to gain.
        let jobs: usize = self.queues.iter().flatten().map(ExactSizeIterator::len).sum();
        let (max, sum) = self.left.iter().fold((0, 0), |(max, sum), left| ((*left).max(max), sum + left));
        let mean = sum as f64 / self.n_clusters as f64;
        jobs > 1 && max as f64 > self.spec.rebalance_threshold * mean
    }

    /// Takes one estimate from a cluster.
    fn take_estimate<O: Observer>(
        &mut self,
        now: Cycle,
        clusters: &mut [HostPort],
        observer: &mut O,
    ) -> bool {
        let taken = clusters.iter_mut().find_map(|port| port.estimates.take(now, observer));
        let Some(Estimate { index, cost }) = taken else { return false };
        let first = index as usize * self.every;
        let last = (first + self.every).min(self.estimates.len());
        for estimate in &mut self.estimates[first..last] {
            *estimate *= u64::from(cost.max(1));
        }
        self.awaited -= 1;
        true
    }

    /// Whose queue cluster `c` takes its jobs from.
    fn source(&self, c: usize) -> usize {
        if self.shared { 0 } else { c }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Silent;

    fn jobs(n: u32) -> Vec<Job> {
        (0..n).map(|index| Job { index, n_rays: 4, ..Job::default() }).collect()
    }

    struct Bench {
        dispatcher: Dispatcher,
        clusters: Vec<HostPort>,
        fetches: Fifo<FetchRequest>,
        dealt: Vec<Vec<u32>>,
    }

    impl Bench {
        fn new(scheduling: Scheduling) -> Bench {
            let spec = DispatchSpec { rebalance_cycles: 10, ..DispatchSpec::default() };
            Bench {
                dispatcher: Dispatcher::new(scheduling, &spec, 4),
                clusters: vec![HostPort::new(16, 2); 4],
                fetches: Fifo::new(2),
                dealt: vec![Vec::new(); 4],
            }
        }

        fn tick(&mut self, now: Cycle, jobs: &[Job]) -> Activity {
            let (clusters, fetches) = (&mut self.clusters[..], &mut self.fetches);
            let activity = self.dispatcher.tick(now, DispatcherIo { jobs, clusters, fetches }, &mut Silent);
            if let Some(fetch) = self.fetches.pop(now) {
                self.dealt[fetch.cluster as usize].push(fetch.job.index);
            }
            activity
        }
    }

    /// Job indices in the order in which each of 4 clusters gets them, of 10 jobs.
    fn dealt(scheduling: Scheduling) -> Vec<Vec<u32>> {
        let jobs = jobs(10);
        let mut bench = Bench::new(scheduling);
        bench.dispatcher.start(&jobs, false);
        for now in 0..20 {
            bench.tick(now, &jobs);
        }
        assert!(bench.dispatcher.is_quiet());
        bench.dealt
    }

    #[test]
    fn dispatcher_static_cuts_ten_equal_jobs_into_ranges_of_two_or_three() {
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
        let jobs = jobs(10);
        let mut dispatcher = Dispatcher::new(Scheduling::Static, &DispatchSpec::default(), 1);
        dispatcher.start(&jobs, false);
        let mut clusters = [HostPort::new(2, 2)];
        let mut fetches = Fifo::new(16);
        let mut tick = |now| {
            let (jobs, clusters, fetches) = (&jobs[..], &mut clusters[..], &mut fetches);
            dispatcher.tick(now, DispatcherIo { jobs, clusters, fetches }, &mut Silent)
        };
        let no_room = Activity::Stall(Cause::Resource);
        assert_eq!([0, 1, 2, 3].map(&mut tick), [Activity::Work, Activity::Work, no_room, no_room]);
    }

    #[test]
    fn dispatcher_after_a_low_resolution_cast_cuts_where_the_estimates_say() {
        let jobs = jobs(8);
        let mut bench = Bench::new(Scheduling::Static);
        let low: Vec<Job> = (0..2).map(|i| Job { index: i, n_rays: 2, ..Job::default() }).collect();
        bench.dispatcher.start_low_resolution(&jobs, &low, 2);
        for now in 0..6 {
            bench.tick(now, &low);
        }
        assert_eq!(bench.dealt, [vec![0], vec![1], vec![], vec![]], "centre rays, dealt in turn");
        // The first two bundles are nine times the work of each other pair: 9 9 1 1 1 1 1 1, mean 6.
        for (at, cost) in [9, 1, 1, 1].into_iter().enumerate() {
            bench.clusters[at].estimates.push(6, Estimate { index: at as u32, cost });
        }
        for now in 7..11 {
            assert_eq!(bench.tick(now, &low), Activity::Work);
        }
        assert!(bench.dispatcher.is_quiet());
        bench.dispatcher.start(&jobs, true);
        bench.dealt.iter_mut().for_each(Vec::clear);
        let stalls =
            (11..21).filter(|now| bench.tick(*now, &jobs) == Activity::Stall(Cause::Resource)).count();
        assert_eq!(stalls, 10, "the cut");
        for now in 21..40 {
            bench.tick(now, &jobs);
        }
        // Middles of the jobs at 4.5, 13.5, 18.5, 19.5 ... of 24.
        assert_eq!(bench.dealt, [vec![0], vec![], vec![1], vec![2, 3, 4, 5, 6, 7]]);
    }

    #[test]
    fn dispatcher_pseudo_dynamic_cuts_anew_when_a_cluster_is_out_of_jobs_and_the_rest_is_uneven() {
        let jobs = jobs(16);
        let mut bench = Bench::new(Scheduling::PseudoDynamic);
        bench.dispatcher.start(&jobs, false);
        // Cluster 0 takes its four descriptors, the others none beyond the depth of their FIFOs.
        bench.clusters = (0..4).map(|c| HostPort::new(if c == 0 { 16 } else { 1 }, 2)).collect();
        for now in 0..8 {
            bench.tick(now, &jobs);
        }
        // 4 + 1 + 1 + 1 dealt; then 3, 3, 3 left: max/mean = 4/3 > 1.25.
        assert_eq!(bench.dispatcher.rebalances(), 1);
        for now in 8..40 {
            bench.tick(now, &jobs);
        }
        assert_eq!(bench.dealt[0][..6], [0, 1, 2, 3, 5, 6], "its part of the nine that were left");
        assert!(bench.dispatcher.rebalances() > 1, "it runs out again, the others take nothing");
    }
}
