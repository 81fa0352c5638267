//! A cluster: one bundle generator, its modules (k CTUs, loader, ICU, reducer), one result merge, one memory.
//!
//! ```text
//! commands --> generator ==> k x M CTUs ==> result merge --> entries
//!                            loader, ICU, reducer per module; caches ==> cluster buffer --> DRAM
//! ```
//! Owns blocks and links as plain fields and wires them by split borrows. The parts tick in any order.

use crate::board::Work;
use crate::functional::CanonicalCounters;
use crate::memory::{ClusterBuffer, ClusterBufferIo, DramPort, Line, ReadPort, Traffic};
use crate::memory_image::MemoryImage;
use crate::sim::{Accounts, Activity, BlockAccount, Cycle, Fifo, Wire, Wires};
use crate::spec::BoardSpec;

use super::{
    BundleGenerator, BundleGeneratorIo, CellRequest, Ctu, CtuIo, HostPort, Icu, IcuIo, Job, ListDone, NewRay,
    PatchLoader, PatchLoaderIo, RayResult, Reduced, Reducer, ReducerIo, ResultMerge, ResultMergeIo,
    TestResult, TestToken,
};

/// A part of a cluster that ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Generator,
    Ctu { module: u8, ctu: u8 },
    Loader { module: u8 },
    Icu { module: u8 },
    Reducer { module: u8 },
    Merge,
    Buffer,
}

#[derive(Clone, Debug)]
struct Module {
    ctus: Vec<Ctu>,
    loader: PatchLoader,
    icu: Icu,
    reducer: Reducer,
    requests: Vec<Fifo<CellRequest>>,
    tests: Fifo<TestToken>,
    test_results: Fifo<TestResult>,
    list_done: Wires<ListDone>,
    reduced: Wires<Reduced>,
}

/// The cluster.
#[derive(Clone, Debug)]
pub struct Cluster {
    generator: BundleGenerator,
    modules: Vec<Module>,
    merge: ResultMerge,
    buffer: ClusterBuffer,
    /// Links of CTU c of module m: index m k + c.
    rays: Vec<Fifo<NewRay>>,
    results: Vec<Fifo<RayResult>>,
    started: Wire<(u8, Job)>,
    /// The merge's taken slots at the start of the cycle.
    taken_slots: u64,
    n_slots: u32,
    /// Links of the caches: 2 m the list cache of module m, 2 m + 1 its patch cache.
    misses: Vec<Fifo<Line>>,
    fills: Vec<Wire<Line>>,
    /// Every part, in the order of ticks, and its account.
    parts: Vec<Part>,
    accounts: Accounts,
    #[cfg(test)]
    permutation: Option<Vec<usize>>,
    ctus_per_icu: usize,
}

/// What surrounds a cluster in a cycle.
#[derive(Debug)]
pub struct ClusterIo<'a> {
    /// What the command's jobs hold.
    pub work: Work<'a>,
    /// The command asks for any hit only.
    pub any_hit: bool,
    /// The patch memory.
    pub image: &'a MemoryImage,
    /// To and from the host.
    pub host: &'a mut HostPort,
    /// To and from the DRAM.
    pub dram: &'a mut DramPort,
    /// Canonical counts.
    pub counters: &'a mut CanonicalCounters,
}

/// A valid/ready link with its 2-entry skid buffer.
const LINK_ENTRIES: u32 = 2;

impl Cluster {
    /// An empty cluster of a validated specification.
    pub fn new(spec: &BoardSpec) -> Self {
        let (modules, k, contexts) = (spec.clusters.modules, spec.clusters.ctus_per_icu, spec.ctu.contexts);
        let caches = spec.effective_cache_bytes();
        let mut parts = vec![Part::Generator];
        for module in 0..modules as u8 {
            parts.extend((0..k as u8).map(|ctu| Part::Ctu { module, ctu }));
            parts.extend([Part::Loader { module }, Part::Icu { module }, Part::Reducer { module }]);
        }
        parts.extend([Part::Merge, Part::Buffer]);
        let module = || Module {
            ctus: (0..k).map(|id| Ctu::new(&spec.ctu, id as u8)).collect(),
            loader: PatchLoader::new(
                spec.loader.slots,
                k,
                contexts,
                ReadPort::new(caches.list, spec.list_cache.ways, spec.list_cache.miss_registers),
                ReadPort::new(caches.patch, spec.patch_cache.ways, spec.patch_cache.miss_registers),
            ),
            icu: Icu::new(&spec.icu_timing()),
            reducer: Reducer::new(k, contexts),
            requests: vec![Fifo::new(spec.fifos.ctu_icu); k as usize],
            tests: Fifo::new(LINK_ENTRIES),
            test_results: Fifo::new(spec.fifos.icu_reducer),
            list_done: Wires::new(k as usize),
            reduced: Wires::new(k as usize),
        };
        Cluster {
            generator: BundleGenerator::default(),
            modules: (0..modules).map(|_| module()).collect(),
            merge: ResultMerge::new(spec.clusters.bundle_slots),
            buffer: ClusterBuffer::new(
                caches.buffer,
                spec.cluster_buffer.ways,
                spec.cluster_buffer.cycles,
                spec.cluster_buffer.miss_registers,
            ),
            rays: vec![Fifo::new(LINK_ENTRIES); (modules * k) as usize],
            results: vec![Fifo::new(LINK_ENTRIES); (modules * k) as usize],
            started: Wire::new(),
            taken_slots: 0,
            n_slots: spec.clusters.bundle_slots,
            misses: vec![Fifo::new(LINK_ENTRIES); 2 * modules as usize],
            fills: vec![Wire::new(); 2 * modules as usize],
            accounts: Accounts::new(parts.len()),
            parts,
            #[cfg(test)]
            permutation: None,
            ctus_per_icu: k as usize,
        }
    }

    /// One cycle of every part; true when any of them worked.
    #[inline]
    pub fn tick(&mut self, now: Cycle, mut io: ClusterIo<'_>) -> bool {
        let assigned = self.taken_slots != 0 || io.host.commands.len(now) > 0 || !self.generator.is_quiet();
        #[cfg(test)]
        if let Some(permutation) = self.permutation.take() {
            let worked = permutation
                .iter()
                .map(|&i| self.tick_and_record(now, self.parts[i], i, assigned, &mut io))
                .fold(false, |any, worked| any | worked);
            self.permutation = Some(permutation);
            return worked;
        }
        // The order of `parts`, written out so that each part's code stands in line.
        let mut worked = self.tick_and_record(now, Part::Generator, 0, assigned, &mut io);
        let mut i = 1;
        for module in 0..self.modules.len() as u8 {
            for ctu in 0..self.ctus_per_icu as u8 {
                worked |= self.tick_and_record(now, Part::Ctu { module, ctu }, i, assigned, &mut io);
                i += 1;
            }
            worked |= self.tick_and_record(now, Part::Loader { module }, i, assigned, &mut io);
            worked |= self.tick_and_record(now, Part::Icu { module }, i + 1, assigned, &mut io);
            worked |= self.tick_and_record(now, Part::Reducer { module }, i + 2, assigned, &mut io);
            i += 3;
        }
        worked |= self.tick_and_record(now, Part::Merge, i, assigned, &mut io);
        worked |= self.tick_and_record(now, Part::Buffer, i + 1, assigned, &mut io);
        worked
    }

    #[inline(always)]
    fn tick_and_record(
        &mut self,
        now: Cycle,
        part: Part,
        account: usize,
        assigned: bool,
        io: &mut ClusterIo<'_>,
    ) -> bool {
        let activity = self.tick_part(now, part, io);
        self.accounts.record(account, activity, assigned);
        activity == Activity::Work
    }

    #[inline(always)]
    fn tick_part(&mut self, now: Cycle, part: Part, io: &mut ClusterIo<'_>) -> Activity {
        match part {
            Part::Generator => self.generator.tick(
                now,
                BundleGeneratorIo {
                    work: io.work,
                    formats: &io.image.formats,
                    commands: &mut io.host.commands,
                    taken_slots: self.taken_slots,
                    n_slots: self.n_slots,
                    started: &mut self.started,
                    rays: &mut self.rays,
                },
            ),
            Part::Ctu { module, ctu } => {
                let (m, ctu) = (usize::from(module), usize::from(ctu));
                let (link, module) = (m * self.ctus_per_icu + ctu, &mut self.modules[m]);
                module.ctus[ctu].tick(
                    now,
                    CtuIo {
                        image: io.image,
                        any_hit: io.any_hit,
                        rays: &mut self.rays[link],
                        requests: &mut module.requests[ctu],
                        results: &mut self.results[link],
                        list_done: &module.list_done,
                        reduced: &module.reduced,
                        counters: io.counters,
                    },
                )
            }
            Part::Loader { module } => {
                let m = usize::from(module);
                let module = &mut self.modules[m];
                let [list_misses, patch_misses] = &mut self.misses[2 * m..2 * m + 2] else {
                    unreachable!("two caches a module")
                };
                module.loader.tick(
                    now,
                    PatchLoaderIo {
                        image: io.image,
                        requests: &mut module.requests,
                        tests: &mut module.tests,
                        list_done: &mut module.list_done,
                        list_misses,
                        list_fill: &self.fills[2 * m],
                        patch_misses,
                        patch_fill: &self.fills[2 * m + 1],
                        counters: io.counters,
                    },
                )
            }
            Part::Icu { module } => {
                let module = &mut self.modules[usize::from(module)];
                module.icu.tick(
                    now,
                    IcuIo {
                        image: io.image,
                        ctus: &module.ctus,
                        tests: &mut module.tests,
                        results: &mut module.test_results,
                        counters: io.counters,
                    },
                )
            }
            Part::Reducer { module } => {
                let module = &mut self.modules[usize::from(module)];
                module
                    .reducer
                    .tick(now, ReducerIo { results: &mut module.test_results, reduced: &mut module.reduced })
            }
            Part::Merge => self.merge.tick(
                now,
                ResultMergeIo {
                    any_hit: io.any_hit,
                    started: &self.started,
                    results: &mut self.results,
                    host: io.host,
                    counters: io.counters,
                },
            ),
            Part::Buffer => self.buffer.tick(
                now,
                ClusterBufferIo {
                    requests: &mut self.misses,
                    fills: &mut self.fills,
                    dram_request: &mut io.dram.requests,
                    dram_response: &mut io.dram.responses,
                },
            ),
        }
    }

    /// The clock edge: FIFOs and wires need none, they go by the cycle.
    #[inline]
    pub fn commit(&mut self) {
        self.taken_slots = self.merge.taken_slots();
    }

    /// True when no token, line or message is anywhere in the cluster.
    pub fn is_quiet(&self, now: Cycle) -> bool {
        let modules = self.modules.iter().all(|m| {
            m.ctus.iter().all(Ctu::is_quiet)
                && m.loader.is_quiet()
                && m.icu.is_quiet()
                && m.requests.iter().all(Fifo::is_empty)
                && m.tests.is_empty()
                && m.test_results.is_empty()
                && m.list_done.is_quiet(now)
                && m.reduced.is_quiet(now)
        });
        modules
            && self.generator.is_quiet()
            && self.merge.is_quiet()
            && self.buffer.is_quiet()
            && self.started.is_quiet(now)
            && self.rays.iter().all(Fifo::is_empty)
            && self.results.iter().all(Fifo::is_empty)
            && self.misses.iter().all(Fifo::is_empty)
            && self.fills.iter().all(|w| w.is_quiet(now))
    }

    /// Ends a run, which `after` cycles with nothing on the board follow.
    pub fn end_run(&mut self, after: Cycle) {
        self.accounts.end_run(after);
    }

    /// The named accounts of every part.
    pub fn block_accounts(&self, cluster: usize) -> Vec<BlockAccount> {
        let parts = self.parts.iter().enumerate();
        let mut blocks: Vec<_> = parts.map(|(i, part)| self.accounts.named(i, part.name(cluster))).collect();
        blocks.sort_by(|a, b| a.block.cmp(&b.block));
        blocks
    }

    /// Each part's latest activity, for the watchdog's message.
    pub(crate) fn latest_activities(&self, cluster: usize) -> impl Iterator<Item = String> {
        let parts = self.parts.iter().enumerate();
        parts.map(move |(i, part)| format!("{} {}", part.name(cluster), self.accounts.latest(i)))
    }

    /// Traffic of the list caches, patch caches and the cluster buffer.
    pub fn traffic(&self) -> [Traffic; 3] {
        let mut sum = [Traffic::default(), Traffic::default(), self.buffer.traffic()];
        for module in &self.modules {
            for (level, traffic) in module.loader.traffic().into_iter().enumerate() {
                sum[level].add(traffic);
            }
        }
        sum
    }

    /// Reorders the parts for the test that the order of ticks changes nothing.
    #[cfg(test)]
    pub(crate) fn permute(&mut self, seed: u64) {
        let mut state = seed;
        let mut permutation: Vec<usize> = (0..self.parts.len()).collect();
        for i in (1..permutation.len()).rev() {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            permutation.swap(i, (state >> 33) as usize % (i + 1));
        }
        self.permutation = Some(permutation);
    }
}

impl Part {
    fn name(self, cluster: usize) -> String {
        match self {
            Part::Generator => format!("cluster{cluster}.bundle_generator"),
            Part::Ctu { module, ctu } => format!("cluster{cluster}.module{module}.ctu{ctu}"),
            Part::Loader { module } => format!("cluster{cluster}.module{module}.patch_loader"),
            Part::Icu { module } => format!("cluster{cluster}.module{module}.icu"),
            Part::Reducer { module } => format!("cluster{cluster}.module{module}.reducer"),
            Part::Merge => format!("cluster{cluster}.result_merge"),
            Part::Buffer => format!("cluster{cluster}.cluster_buffer"),
        }
    }
}
