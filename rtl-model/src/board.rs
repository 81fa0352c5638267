//! The board: owns blocks and FIFOs, wires them, ticks, commits. Start reading here.
//!
//! ```text
//! host: Work --jobs--> dispatcher --fetches--> host link --descriptors--> cluster 0..C-1 --lines--> DRAM
//!       hits, bits <----------------------------- host link <--entries---'
//! ```
//! A command runs from an empty board to an empty board; caches and open DRAM rows keep what they have. Cycles count
//! from the command to the host's interrupt: `Statistics::cycles` = ticks + `bus.interrupt_cycles` a command.

use crate::blocks::{
    Cluster, ClusterIo, Dispatcher, DispatcherIo, HostLink, HostLinkIo, HostPort, Job, ResultEntry,
};
use crate::datapath::bundle::{BundleError, BundleWords};
use crate::datapath::{HitWords, RayError, RayWords};
use crate::functional::CanonicalCounters;
use crate::memory::{Dram, DramIo, DramPort, LINE_BYTES, Traffic};
use crate::memory_image::MemoryImage;
use crate::packet::{self, MAX_BUNDLE_RAYS};
use crate::sim::{Accounts, Activity, Cycle, Fifo};
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
    counters: CanonicalCounters,
    dispatcher: Dispatcher,
    fetches: Fifo<crate::blocks::FetchRequest>,
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
        let needed_bytes = image.size_bytes() as u64;
        if needed_bytes > spec.dram.bytes {
            return Err(BoardError::PatchMemory { needed_bytes, available_bytes: spec.dram.bytes });
        }
        let n = spec.clusters.count;
        let dram = &spec.dram;
        Ok(Board {
            dispatcher: Dispatcher::new(spec.scheduling, n),
            fetches: Fifo::new(2),
            host_link: HostLink::new(spec),
            host_ports: vec![HostPort::new(spec.fifos.commands, spec.fifos.results); n as usize],
            clusters: (0..n).map(|_| Cluster::new(spec)).collect(),
            dram_ports: vec![DramPort { requests: Fifo::new(2), responses: Fifo::new(2) }; n as usize],
            dram: Dram::new(
                dram.width_bits,
                dram.banks,
                dram.row_bytes,
                dram.row_hit_cycles,
                dram.row_miss_cycles,
            ),
            accounts: Accounts::new(SHARED_BLOCKS.len()),
            #[cfg(test)]
            reversed: false,
            spec: spec.clone(),
            image,
            now: 0,
            given_up: None,
            interrupt_cycles: 0,
            counters: CanonicalCounters::default(),
        })
    }

    /// Nearest hits, in ray order. The board starts and ends empty; its caches keep their lines.
    ///
    /// # Errors
    /// An unusable descriptor or ray, or a watchdog, be it of an earlier command.
    pub fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        let command = self.run(work, false)?;
        let mut hits = vec![None; command.n_rays];
        for entry in &command.delivered {
            if let ResultEntry::Nearest { ray, hit, .. } = *entry {
                hits[ray as usize] = hit;
            }
        }
        Ok(hits)
    }

    /// Hit bits, in ray order.
    ///
    /// # Errors
    /// As [`Board::trace_nearest`].
    pub fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        let command = self.run(work, true)?;
        let mut hits = vec![false; command.n_rays];
        for entry in &command.delivered {
            if let ResultEntry::Any { first_ray, bits, n_rays } = *entry {
                for i in 0..n_rays {
                    hits[(first_ray + i) as usize] = bits >> i & 1 == 1;
                }
            }
        }
        Ok(hits)
    }

    /// Runs a command to its end.
    fn run<'a>(&mut self, work: Work<'a>, any_hit: bool) -> Result<Command<'a>, BoardError> {
        if let Some((cycles, causes)) = &self.given_up {
            return Err(BoardError::Watchdog { cycles: *cycles, causes: causes.clone() });
        }
        let (jobs, n_rays) = self.jobs(work)?;
        let mut command = Command { work, any_hit, jobs, n_rays, delivered: Vec::new() };
        if n_rays == 0 {
            return Ok(command);
        }
        let expected = if any_hit { command.jobs.len() } else { n_rays };
        command.delivered.reserve_exact(expected);
        if let Work::Bundles(bundles) = work {
            self.counters.bundles += bundles.len() as u64;
        }
        self.dispatcher.start(command.jobs.len());
        self.host_link.start(self.entry_bytes(any_hit));
        let mut last_progress = self.now;
        while command.delivered.len() < expected {
            if self.tick(&mut command) {
                last_progress = self.now;
            } else if self.now - last_progress > self.spec.watchdog_cycles {
                let (cycles, causes) = (self.now - last_progress, self.latest_causes());
                self.given_up = Some((cycles, causes.clone()));
                return Err(BoardError::Watchdog { cycles, causes });
            }
            self.commit();
        }
        debug_assert!(self.is_quiet(), "a command ended with tokens on the board");
        let interrupt = self.spec.bus.interrupt_cycles;
        self.interrupt_cycles += interrupt;
        self.accounts.end_run(interrupt);
        self.clusters.iter_mut().for_each(|c| c.end_run(interrupt));
        Ok(command)
    }

    /// One cycle of every block, in whatever order; true when any of them worked.
    #[inline]
    fn tick(&mut self, command: &mut Command<'_>) -> bool {
        #[cfg(test)]
        if self.reversed {
            let mut worked = self.tick_dram() | self.tick_host_link(command);
            for c in (0..self.clusters.len()).rev() {
                worked |= self.tick_cluster(c, command);
            }
            return worked | self.tick_dispatcher(command);
        }
        let mut worked = self.tick_dispatcher(command);
        for c in 0..self.clusters.len() {
            worked |= self.tick_cluster(c, command);
        }
        worked |= self.tick_host_link(command);
        worked | self.tick_dram()
    }

    #[inline]
    fn tick_dispatcher(&mut self, command: &Command<'_>) -> bool {
        let io = DispatcherIo { jobs: &command.jobs, clusters: &self.host_ports, fetches: &mut self.fetches };
        let activity = self.dispatcher.tick(self.now, io);
        self.accounts.record(DISPATCHER, activity, false);
        activity == Activity::Work
    }

    #[inline]
    fn tick_cluster(&mut self, c: usize, command: &Command<'_>) -> bool {
        let io = ClusterIo {
            work: command.work,
            any_hit: command.any_hit,
            image: &self.image,
            host: &mut self.host_ports[c],
            dram: &mut self.dram_ports[c],
            counters: &mut self.counters,
        };
        self.clusters[c].tick(self.now, io)
    }

    #[inline]
    fn tick_host_link(&mut self, command: &mut Command<'_>) -> bool {
        let io = HostLinkIo {
            fetches: &mut self.fetches,
            clusters: &mut self.host_ports,
            delivered: &mut command.delivered,
        };
        let activity = self.host_link.tick(self.now, io);
        self.accounts.record(HOST_LINK, activity, true);
        activity == Activity::Work
    }

    #[inline]
    fn tick_dram(&mut self) -> bool {
        let activity = self.dram.tick(self.now, DramIo { ports: &mut self.dram_ports });
        self.accounts.record(DRAM, activity, true);
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

    /// Cuts the work into jobs.
    fn jobs(&self, work: Work<'_>) -> Result<(Vec<Job>, usize), BoardError> {
        let formats = &self.spec.formats;
        let mut jobs = Vec::new();
        let mut n_rays = 0;
        let mut push = |n: usize, bytes: u32| {
            jobs.push(Job { index: jobs.len() as u32, first_ray: n_rays as u32, n_rays: n as u32, bytes });
            n_rays += n;
        };
        match work {
            Work::Rays(rays) => {
                for (index, ray) in rays.iter().enumerate() {
                    ray.validate(formats).map_err(|source| BoardError::Ray { index, source })?;
                }
                for chunk in rays.chunks(MAX_BUNDLE_RAYS) {
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
        let mut levels = [Traffic::default(); 3];
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
        };
        let [list, patch, buffer] = levels;
        let mut memory = vec![named("patch_cache", patch), named("list_cache", list)];
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
        BoardStatistics {
            cycles: self.now + self.interrupt_cycles,
            canonical: self.counters,
            bus_down_bytes,
            bus_up_bytes,
            memory,
            blocks,
        }
    }

    /// The specification.
    pub fn spec(&self) -> &BoardSpec {
        &self.spec
    }

    /// The patch memory.
    pub fn image(&self) -> &MemoryImage {
        &self.image
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
mod tests;
