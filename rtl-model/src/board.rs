//! The board: owns blocks and FIFOs, wires them, ticks, commits. Start reading here.
//!
//! ```text
//! host: Work --jobs--> dispatcher --fetches--> host link --descriptors--> cluster 0..C-1 --lines--> DRAM
//!       hits, bits <----------------------------- host link <--entries---'
//! ```
//! With partition `shells+static` a command's low-resolution cast runs before its bundles, in the same command.
//! A command runs from an empty board to an empty board; caches and open DRAM rows keep what they have. Cycles count
//! from the command to the host's interrupt: `Statistics::cycles` = ticks + (`bus.interrupt_cycles` +
//! `dispatch.host_cycles_per_command`) a command.

use crate::answers::{Answers, Live};
use crate::blocks::{
    Cluster, ClusterIo, Dispatcher, DispatcherIo, FetchRequest, HostLink, HostLinkIo, HostPort, Job,
    ResultEntry, Run,
};
use crate::datapath::bundle::{BundleError, BundleWords};
use crate::datapath::{HitWords, RayError, RayWords};
use crate::functional::{CENTRE_RAYS_TOGETHER, CanonicalCounters, centre_rays};
use crate::memory::{Dram, DramIo, DramPort, LINE_BYTES, Traffic};
use crate::memory_image::MemoryImage;
use crate::occupancy::UnitOccupancy;
use crate::packet::{self, MAX_BUNDLE_RAYS};
use crate::record::{RecordError, RecordedCommand, Recorder, Replay, hash_work};
use crate::sim::{
    Accounts, Activity, CommandMark, Cycle, Directory, EventKind, EventLog, EventSink, Fifo, LinkState,
    Observer, Silent,
};
use crate::spec::{BoardSpec, MemoryLevels, SpecError};
use crate::statistics::{BoardStatistics, LevelStatistics};

/// The blocks outside the clusters, by the index of their account.
const SHARED_BLOCKS: [&str; 3] = ["host_link", "dispatcher", "dram"];
const HOST_LINK: usize = 0;
const DISPATCHER: usize = 1;
const DRAM: usize = 2;

/// What the host asks of the board.
#[derive(Clone, Copy, Debug)]
pub enum Work<'a> {
    /// Explicit rays; the board takes them in chunks of 64.
    Rays(&'a [RayWords]),
    /// Bundle descriptors.
    Bundles(&'a [BundleWords]),
}

/// Why the board gave no answer.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// The specification is unusable.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The scene does not fit the patch memory.
    #[error(
        "the scene needs {needed_bytes} bytes of patch memory, the board has {available_bytes} (dram.bytes)"
    )]
    PatchMemory {
        /// Bytes of the image.
        needed_bytes: u64,
        /// Bytes of the memory.
        available_bytes: u64,
    },
    /// The image was made for other number formats.
    #[error("the memory image and the board differ in number formats")]
    Formats,
    /// A descriptor is unusable.
    #[error("bundle {index}: {source}")]
    Bundle {
        /// Which bundle.
        index: usize,
        /// Why.
        source: BundleError,
    },
    /// An explicit ray is unusable.
    #[error("ray {index}: {source}")]
    Ray {
        /// Which ray.
        index: usize,
        /// Why.
        source: RayError,
    },
    /// Over 2^32 rays in a command.
    #[error("{0} rays in one command; at most 2^32 - 1 are possible")]
    TooManyRays(usize),
    /// A recorded command that cannot have been recorded on a board with these answers.
    #[error("the record does not fit the board: {0}")]
    Record(#[from] RecordError),
    /// No progress for too many cycles; the board gives this answer to every later command too.
    #[error("no progress for {cycles} cycles; last causes: {causes}")]
    Watchdog {
        /// How long.
        cycles: u64,
        /// Each block's last cause.
        causes: String,
    },
}

/// The emulated board with a scene loaded.
#[derive(Clone, Debug)]
pub struct Board {
    spec: BoardSpec,
    image: MemoryImage,
    now: Cycle,
    /// After a watchdog tokens are stuck inside: cycles and causes, the answer to every later command.
    given_up: Option<(u64, String)>,
    /// Cycles that passed on the host's side of an interrupt.
    interrupt_cycles: u64,
    commands: u64,
    counters: CanonicalCounters,
    /// How full bundles were, and units of rays without one.
    occupancy: [UnitOccupancy; 2],
    dispatcher: Dispatcher,
    fetches: Fifo<FetchRequest>,
    host_link: HostLink,
    host_ports: Vec<HostPort>,
    clusters: Vec<Cluster>,
    dram_ports: Vec<DramPort>,
    dram: Dram,
    /// Of the blocks in [`SHARED_BLOCKS`].
    accounts: Accounts,
    #[cfg(test)]
    reversed: bool,
}

/// A command while it runs.
struct Command<'a> {
    work: Work<'a>,
    any_hit: bool,
    jobs: Vec<Job>,
    n_rays: usize,
    delivered: Vec<ResultEntry>,
}

/// What a command is cut into.
struct Plan {
    jobs: Vec<Job>,
    n_rays: usize,
    /// Those of the jobs that are bundles.
    n_bundles: u64,
    /// The low-resolution cast; its rays, which a recorded command has none of.
    cast: Vec<Job>,
    centres: Vec<RayWords>,
}

/// What a command asks for, and who watches.
struct Request<'a, 'r, A, O> {
    plan: Plan,
    /// The rays of the plan; none of a recorded command.
    work: Work<'a>,
    any_hit: bool,
    answers: &'r mut A,
    observer: &'r mut O,
}

impl Command<'_> {
    fn nearest_hits(&self) -> Vec<Option<HitWords>> {
        let mut hits = vec![None; self.n_rays];
        for entry in &self.delivered {
            if let ResultEntry::Nearest { ray, hit, .. } = *entry {
                hits[ray as usize] = hit;
            }
        }
        hits
    }

    fn hit_bits(&self) -> Vec<bool> {
        let mut hits = vec![false; self.n_rays];
        for entry in &self.delivered {
            if let ResultEntry::Any { first_ray, bits, n_rays } = *entry {
                for i in 0..n_rays {
                    hits[(first_ray + i) as usize] = bits >> i & 1 == 1;
                }
            }
        }
        hits
    }
}

impl Board {
    /// A board of this specification with the scene in its patch memory.
    ///
    /// # Errors
    /// An unusable specification, an image too large or of other formats.
    pub fn new(spec: &BoardSpec, image: MemoryImage) -> Result<Board, BoardError> {
        spec.validate()?;
        if image.formats != spec.formats {
            return Err(BoardError::Formats);
        }
        let needed_bytes = image.size_bytes() as u64 + spec.mask_bytes(image.n_patches);
        if needed_bytes > spec.dram.bytes {
            return Err(BoardError::PatchMemory { needed_bytes, available_bytes: spec.dram.bytes });
        }
        let n = spec.clusters.count;
        let dram = &spec.dram;
        let mut clusters: Vec<Cluster> = Vec::new();
        let mut first_block = SHARED_BLOCKS.len();
        for c in 0..n {
            clusters.push(Cluster::new(spec, &image, c, first_block as u16));
            first_block += clusters[clusters.len() - 1].block_names(0).count();
        }
        let mut board = Board {
            dispatcher: Dispatcher::new(spec.scheduling, &spec.dispatch, n),
            fetches: Fifo::new(2),
            host_link: HostLink::new(spec),
            host_ports: vec![HostPort::new(spec.fifos.commands, spec.fifos.results); n as usize],
            clusters,
            dram_ports: vec![DramPort { requests: Fifo::new(2), responses: Fifo::new(2) }; n as usize],
            dram: Dram::new(
                dram.width_bits,
                dram.banks,
                dram.row_bytes,
                dram.row_hit_cycles,
                dram.row_miss_cycles,
            ),
            accounts: Accounts::new(SHARED_BLOCKS.len(), 0),
            #[cfg(test)]
            reversed: false,
            spec: spec.clone(),
            image,
            now: 0,
            given_up: None,
            interrupt_cycles: 0,
            commands: 0,
            counters: CanonicalCounters::default(),
            occupancy: Default::default(),
        };
        let mut number = 0;
        board.links(&mut |_, link| {
            link.set_number(number);
            number += 1;
        });
        Ok(board)
    }

    /// Shows every link with its name, always in the same order.
    fn links(&mut self, see: &mut dyn FnMut(String, &mut LinkState)) {
        see("fetches".into(), self.fetches.state_mut());
        for (c, port) in self.host_ports.iter_mut().enumerate() {
            port.links(&format!("cluster{c}"), see);
        }
        for (c, cluster) in self.clusters.iter_mut().enumerate() {
            cluster.links(c, see);
        }
        for (c, port) in self.dram_ports.iter_mut().enumerate() {
            see(format!("cluster{c}.dram_requests"), port.requests.state_mut());
            see(format!("cluster{c}.dram_responses"), port.responses.state_mut());
        }
    }

    /// The names of blocks and links by the numbers that events carry.
    pub fn directory(&self) -> Directory {
        let mut blocks: Vec<String> = SHARED_BLOCKS.map(String::from).to_vec();
        for (c, cluster) in self.clusters.iter().enumerate() {
            blocks.extend(cluster.block_names(c));
        }
        let mut links = Vec::new();
        self.clone().links(&mut |name, link| links.push((name, link.depth())));
        Directory { blocks, links }
    }

    /// [`Board::trace_nearest`], every event told to `sink`.
    ///
    /// # Errors
    /// As [`Board::trace_nearest`].
    pub fn trace_nearest_observed(
        &mut self,
        work: Work<'_>,
        sink: EventSink<'_>,
    ) -> Result<Vec<Option<HitWords>>, BoardError> {
        let mut log = EventLog::new(sink);
        let hits = self.nearest_with(work, &mut Live, &mut log);
        log.flush();
        hits
    }

    /// [`Board::trace_any`], every event told to `sink`.
    ///
    /// # Errors
    /// As [`Board::trace_nearest`].
    pub fn trace_any_observed(
        &mut self,
        work: Work<'_>,
        sink: EventSink<'_>,
    ) -> Result<Vec<bool>, BoardError> {
        let mut log = EventLog::new(sink);
        let hits = self.any_with(work, &mut Live, &mut log);
        log.flush();
        hits
    }

    /// Nearest hits, in ray order. The board starts and ends empty; its caches keep their lines.
    ///
    /// # Errors
    /// An unusable descriptor or ray, or a watchdog, be it of an earlier command.
    pub fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        self.nearest_with(work, &mut Live, &mut Silent)
    }

    /// Hit bits, in ray order.
    ///
    /// # Errors
    /// As [`Board::trace_nearest`].
    pub fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        self.any_with(work, &mut Live, &mut Silent)
    }

    /// Nearest hits with answers from somewhere, watched by somebody.
    pub(crate) fn nearest_with<A: Answers, O: Observer>(
        &mut self,
        work: Work<'_>,
        answers: &mut A,
        observer: &mut O,
    ) -> Result<Vec<Option<HitWords>>, BoardError> {
        let plan = self.plan(work)?;
        Ok(self.run(Request { plan, work, any_hit: false, answers, observer })?.nearest_hits())
    }

    /// Hit bits with answers from somewhere, watched by somebody.
    pub(crate) fn any_with<A: Answers, O: Observer>(
        &mut self,
        work: Work<'_>,
        answers: &mut A,
        observer: &mut O,
    ) -> Result<Vec<bool>, BoardError> {
        let plan = self.plan(work)?;
        Ok(self.run(Request { plan, work, any_hit: true, answers, observer })?.hit_bits())
    }

    /// [`Board::trace_nearest`], and a record of what the datapath answered.
    ///
    /// # Errors
    /// As [`Board::trace_nearest`].
    pub fn record_nearest(
        &mut self,
        work: Work<'_>,
    ) -> Result<(Vec<Option<HitWords>>, RecordedCommand), BoardError> {
        let mut recorder = Recorder::new(&self.spec);
        let hits = self.nearest_with(work, &mut recorder, &mut Silent)?;
        Ok((hits, recorder.finish(false, matches!(work, Work::Rays(_)), hash_work(&self.spec.formats, work))))
    }

    /// [`Board::trace_any`], and a record of what the datapath answered.
    ///
    /// # Errors
    /// As [`Board::trace_nearest`].
    pub fn record_any(&mut self, work: Work<'_>) -> Result<(Vec<bool>, RecordedCommand), BoardError> {
        let mut recorder = Recorder::new(&self.spec);
        let hits = self.any_with(work, &mut recorder, &mut Silent)?;
        Ok((hits, recorder.finish(true, matches!(work, Work::Rays(_)), hash_work(&self.spec.formats, work))))
    }

    /// Runs a recorded command: every cycle and count is that of the command itself on this board. The record must be
    /// of this scene and partition ([`crate::record::RecordKey`]), and sound ([`RecordedCommand::check`]).
    ///
    /// # Errors
    /// A record of other work, or a watchdog, be it of an earlier command.
    pub fn replay(&mut self, command: &RecordedCommand) -> Result<(), BoardError> {
        self.replay_with(command, &mut Silent).map(drop)
    }

    /// [`Board::replay`], every event told to `sink`.
    ///
    /// # Errors
    /// As [`Board::replay`].
    pub fn replay_observed(
        &mut self,
        command: &RecordedCommand,
        sink: EventSink<'_>,
    ) -> Result<(), BoardError> {
        let mut log = EventLog::new(sink);
        let done = self.replay_with(command, &mut log).map(drop);
        log.flush();
        done
    }

    /// A recorded command, watched by somebody; as it ended.
    fn replay_with<O: Observer>(
        &mut self,
        recorded: &RecordedCommand,
        observer: &mut O,
    ) -> Result<Command<'static>, BoardError> {
        let [jobs, cast] = recorded.jobs();
        let n_bundles = if recorded.is_explicit() { 0 } else { jobs.len() as u64 };
        let n_rays = jobs.iter().map(|job| job.n_rays as usize).sum();
        let plan = Plan { jobs, n_rays, n_bundles, cast, centres: Vec::new() };
        let mut replay = Replay::new(&self.spec, &self.image, recorded);
        let (work, any_hit, answers) = (Work::Rays(&[]), recorded.any_hit(), &mut replay);
        let command = self.run(Request { plan, work, any_hit, answers, observer })?;
        replay.finish()?;
        Ok(command)
    }

    /// Runs a command to its end.
    fn run<'a, A: Answers, O: Observer>(
        &mut self,
        request: Request<'a, '_, A, O>,
    ) -> Result<Command<'a>, BoardError> {
        if let Some((cycles, causes)) = &self.given_up {
            return Err(BoardError::Watchdog { cycles: *cycles, causes: causes.clone() });
        }
        let Request { plan, work, any_hit, answers, observer } = request;
        let Plan { jobs, n_rays, n_bundles, cast, centres } = plan;
        let mut command = Command { work, any_hit, jobs, n_rays, delivered: Vec::new() };
        if n_rays == 0 {
            return Ok(command);
        }
        self.counters.bundles += n_bundles;
        let occupancy = &mut self.occupancy[usize::from(n_bundles == 0)];
        command.jobs.iter().for_each(|job| occupancy.add(job.n_rays as usize));
        self.host_link.start(self.entry_bytes(any_hit));
        let mark = |mark: CommandMark| (EventKind::Command, 0, mark as u32);
        let mut tell = |now, (kind, place, payload)| observer.event(now, kind, place, payload);
        tell(self.now, mark(if any_hit { CommandMark::Any } else { CommandMark::Nearest }));
        let estimated = !cast.is_empty();
        if estimated {
            tell(self.now, mark(CommandMark::LowResolution));
            let every = self.spec.dispatch.low_resolution_every as usize;
            self.dispatcher.start_low_resolution(&command.jobs, &cast, every);
            let work = Work::Rays(&centres);
            let mut cast = Command { work, any_hit, jobs: cast, n_rays: 0, delivered: Vec::new() };
            self.clock(&mut cast, answers, observer)?;
        }
        observer.event(self.now, EventKind::Command, 0, CommandMark::Bundles as u32);
        self.dispatcher.start(&command.jobs, estimated);
        command.delivered.reserve_exact(if any_hit { command.jobs.len() } else { n_rays });
        self.clock(&mut command, answers, observer)?;
        observer.event(self.now, EventKind::Command, 0, CommandMark::End as u32);
        let after = self.spec.bus.interrupt_cycles + self.spec.dispatch.host_cycles_per_command;
        self.interrupt_cycles += after;
        self.commands += 1;
        self.accounts.end_run(self.now, after);
        self.clusters.iter_mut().for_each(|c| c.end_run(self.now, after));
        Ok(command)
    }

    /// Clocks the board until the dispatcher has nothing left and the board is empty.
    fn clock<A: Answers, O: Observer>(
        &mut self,
        command: &mut Command<'_>,
        answers: &mut A,
        observer: &mut O,
    ) -> Result<(), BoardError> {
        let is_cast = command.n_rays == 0;
        let mut counters = CanonicalCounters::default();
        let expected = match (is_cast, command.any_hit) {
            (true, _) => 0,
            (false, true) => command.jobs.len(),
            (false, false) => command.n_rays,
        };
        let mut last_progress = self.now;
        let mut over = false;
        while !over {
            if self.tick(command, &mut counters, answers, observer) {
                last_progress = self.now;
            } else if self.now - last_progress > self.spec.watchdog_cycles {
                let (cycles, causes) = (self.now - last_progress, self.latest_causes());
                self.given_up = Some((cycles, causes.clone()));
                return Err(BoardError::Watchdog { cycles, causes });
            }
            self.commit();
            // Lines may be on their way for nobody: prefetched, or masks that are written back.
            over = command.delivered.len() == expected && self.dispatcher.is_quiet() && self.is_quiet();
        }
        let done = if is_cast { counters.as_low_resolution() } else { counters };
        self.counters = self.counters.combine(&done, |a, b| a + b);
        Ok(())
    }

    /// One cycle of every block, in whatever order; true when any of them worked.
    #[inline]
    fn tick<A: Answers, O: Observer>(
        &mut self,
        command: &mut Command<'_>,
        counters: &mut CanonicalCounters,
        answers: &mut A,
        observer: &mut O,
    ) -> bool {
        #[cfg(test)]
        if self.reversed {
            let mut worked = self.tick_dram(observer) | self.tick_host_link(command, observer);
            for c in (0..self.clusters.len()).rev() {
                worked |= self.tick_cluster(c, command, counters, answers, observer);
            }
            return worked | self.tick_dispatcher(command, observer);
        }
        let mut worked = self.tick_dispatcher(command, observer);
        for c in 0..self.clusters.len() {
            worked |= self.tick_cluster(c, command, counters, answers, observer);
        }
        worked |= self.tick_host_link(command, observer);
        worked | self.tick_dram(observer)
    }

    #[inline]
    fn tick_dispatcher<O: Observer>(&mut self, command: &Command<'_>, observer: &mut O) -> bool {
        let io =
            DispatcherIo { jobs: &command.jobs, clusters: &mut self.host_ports, fetches: &mut self.fetches };
        let activity = self.dispatcher.tick(self.now, io, observer);
        self.accounts.record(self.now, DISPATCHER, activity, false, observer);
        activity == Activity::Work
    }

    #[inline]
    fn tick_cluster<A: Answers, O: Observer>(
        &mut self,
        c: usize,
        command: &Command<'_>,
        counters: &mut CanonicalCounters,
        answers: &mut A,
        observer: &mut O,
    ) -> bool {
        let mut run = Run {
            work: command.work,
            image: &self.image,
            any_hit: command.any_hit,
            counters,
            answers,
            observer,
            cluster: c as u8,
            block: 0,
        };
        let io = ClusterIo { host: &mut self.host_ports[c], dram: &mut self.dram_ports[c] };
        self.clusters[c].tick(self.now, io, &mut run)
    }

    #[inline]
    fn tick_host_link<O: Observer>(&mut self, command: &mut Command<'_>, observer: &mut O) -> bool {
        let io = HostLinkIo {
            fetches: &mut self.fetches,
            clusters: &mut self.host_ports,
            delivered: &mut command.delivered,
        };
        let activity = self.host_link.tick(self.now, io, observer);
        self.accounts.record(self.now, HOST_LINK, activity, true, observer);
        activity == Activity::Work
    }

    #[inline]
    fn tick_dram<O: Observer>(&mut self, observer: &mut O) -> bool {
        let activity = self.dram.tick(self.now, DramIo { ports: &mut self.dram_ports }, observer);
        self.accounts.record(self.now, DRAM, activity, true, observer);
        activity == Activity::Work
    }

    /// The clock edge.
    #[inline]
    fn commit(&mut self) {
        self.clusters.iter_mut().for_each(Cluster::commit);
        self.now += 1;
    }

    /// Bytes of one entry on its way up: a hit record, or the hit bits of a bundle.
    fn entry_bytes(&self, any_hit: bool) -> u32 {
        if any_hit { packet::any_hit_bytes(MAX_BUNDLE_RAYS) } else { packet::hit_bytes(&self.spec.formats) }
    }

    /// Cuts the work, and its low-resolution cast, into jobs.
    fn plan(&self, work: Work<'_>) -> Result<Plan, BoardError> {
        let (jobs, n_rays) = self.jobs(work, MAX_BUNDLE_RAYS)?;
        let n_bundles = if let Work::Bundles(bundles) = work { bundles.len() as u64 } else { 0 };
        let centres = centre_rays(&self.spec, work, jobs.len());
        let (mut cast, _) = self.jobs(Work::Rays(&centres), CENTRE_RAYS_TOGETHER)?;
        cast.iter_mut().for_each(|job| job.low_resolution = true);
        Ok(Plan { jobs, n_rays, n_bundles, cast, centres })
    }

    /// Cuts the work into jobs, explicit rays into so many a job.
    fn jobs(&self, work: Work<'_>, rays_a_job: usize) -> Result<(Vec<Job>, usize), BoardError> {
        let formats = &self.spec.formats;
        let mut jobs = Vec::new();
        let mut n_rays = 0;
        let mut push = |n: usize, bytes: u32| {
            jobs.push(Job {
                index: jobs.len() as u32,
                first_ray: n_rays as u32,
                n_rays: n as u32,
                bytes,
                ..Job::default()
            });
            n_rays += n;
        };
        match work {
            Work::Rays(rays) => {
                for (index, ray) in rays.iter().enumerate() {
                    ray.validate(formats).map_err(|source| BoardError::Ray { index, source })?;
                }
                for chunk in rays.chunks(rays_a_job) {
                    push(chunk.len(), chunk.len() as u32 * packet::ray_bytes(formats));
                }
            }
            Work::Bundles(bundles) => {
                for (index, bundle) in bundles.iter().enumerate() {
                    bundle.validate(formats).map_err(|source| BoardError::Bundle { index, source })?;
                    push(bundle.n_rays(), packet::bundle_bytes(bundle, formats));
                }
            }
        }
        if u32::try_from(n_rays).is_err() {
            return Err(BoardError::TooManyRays(n_rays));
        }
        Ok((jobs, n_rays))
    }

    /// Every block with its latest activity.
    fn latest_causes(&self) -> String {
        let shared = SHARED_BLOCKS.iter().enumerate();
        let mut causes: Vec<String> =
            shared.map(|(i, name)| format!("{name} {}", self.accounts.latest(i))).collect();
        causes.extend(self.clusters.iter().enumerate().flat_map(|(c, cluster)| cluster.latest_activities(c)));
        causes.join(", ")
    }

    /// True when no token is anywhere on the board.
    pub fn is_quiet(&self) -> bool {
        self.dispatcher.is_quiet()
            && self.fetches.is_empty()
            && self.host_link.is_quiet()
            && self.host_ports.iter().all(HostPort::is_quiet)
            && self.clusters.iter().all(|c| c.is_quiet(self.now))
            && self.dram_ports.iter().all(|p| p.requests.is_empty() && p.responses.is_empty())
            && self.dram.is_quiet()
    }

    /// Everything counted so far.
    pub fn statistics(&self) -> BoardStatistics {
        let mut levels = [Traffic::default(); 4];
        for cluster in &self.clusters {
            for (sum, traffic) in levels.iter_mut().zip(cluster.traffic()) {
                sum.add(traffic);
            }
        }
        let named = |level: &str, t: Traffic| LevelStatistics {
            level: level.into(),
            accesses: t.accesses,
            misses: t.misses,
            bytes: t.lines * u64::from(LINE_BYTES),
            written_bytes: t.written * u64::from(LINE_BYTES),
        };
        let [list, patch, mask, buffer] = levels;
        let mut memory = vec![named("patch_cache", patch), named("list_cache", list)];
        if self.spec.partition.is_shells() {
            memory.push(named("mask_cache", mask));
        }
        // Without the level the block only passes lines on.
        if self.spec.memory == MemoryLevels::Hierarchical {
            memory.push(named("cluster_buffer", buffer));
        }
        memory.push(named("dram", self.dram.traffic()));
        let shared = SHARED_BLOCKS.iter().enumerate();
        let mut blocks: Vec<_> = shared.map(|(i, name)| self.accounts.named(i, (*name).into())).collect();
        for (c, cluster) in self.clusters.iter().enumerate() {
            blocks.extend(cluster.block_accounts(c));
        }
        let [bus_down_bytes, bus_up_bytes] = self.host_link.bytes();
        let [bus_down_cycles, bus_up_cycles] = self.host_link.bus_cycles();
        BoardStatistics {
            cycles: self.now + self.interrupt_cycles,
            commands: self.commands,
            canonical: self.counters,
            bundles: self.occupancy[0],
            explicit: self.occupancy[1],
            bus_down_bytes,
            bus_up_bytes,
            bus_down_cycles,
            bus_up_cycles,
            dram_busy_cycles: self.dram.traffic().busy_cycles,
            rebalances: self.dispatcher.rebalances(),
            memory,
            blocks,
        }
    }

    /// Share of the clusters' cycles in which a cluster was not ticked, since nothing in it could change.
    pub fn quiet_share(&self) -> f64 {
        let slept: u64 = self.clusters.iter().map(Cluster::slept_cycles).sum();
        slept as f64 / (self.now.max(1) * self.clusters.len() as u64) as f64
    }

    /// What every FIFO counted so far. Cycles on the host's side of interrupts are none of theirs.
    pub fn link_statistics(&self) -> Vec<crate::sim::FifoStatistics> {
        let mut statistics = Vec::new();
        let now = self.now;
        self.clone().links(&mut |name, link| statistics.push(link.statistics(now, name)));
        statistics
    }

    /// Cycles in which the board was clocked: all but those on the host's side of interrupts.
    pub fn clocked_cycles(&self) -> Cycle {
        self.now
    }

    /// The specification.
    pub fn spec(&self) -> &BoardSpec {
        &self.spec
    }

    /// The patch memory.
    pub fn image(&self) -> &MemoryImage {
        &self.image
    }

    /// Ticks every cluster in every cycle.
    #[cfg(test)]
    pub(crate) fn never_sleep(&mut self) {
        self.clusters.iter_mut().for_each(|cluster| cluster.sleepless = true);
    }

    #[cfg(test)]
    pub(crate) fn permute_ticks(&mut self, seed: u64) {
        self.reversed = !seed.is_multiple_of(2000);
        for (c, cluster) in (0..).zip(&mut self.clusters) {
            cluster.permute(seed + c);
        }
    }
}

#[cfg(test)]
#[path = "board_tests.rs"]
pub(crate) mod tests;
