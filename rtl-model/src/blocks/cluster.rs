//! A cluster: one bundle generator, its modules, one result merge, one memory.
//!
//! ```text
//! commands --> generator ==> modules (CTUs, tracker, loader, ICU, reducer) ==> result merge --> entries
//!                            caches ==> cluster buffer --> DRAM
//! ```
//! Owns blocks and links as plain fields and wires them by split borrows. The parts tick in any order.
//! A cluster in which no part worked, with nothing in a pipeline and nothing held back by its surroundings, does the same
//! in every cycle until a descriptor or a line comes: it is not ticked until then. (Exact: a test runs boards both ways.)

use crate::answers::Answers;
use crate::memory::{ClusterBuffer, ClusterBufferIo, DramPort, Line, MemoryRequest, Traffic};
use crate::memory_image::MemoryImage;
use crate::sim::{Accounts, Activity, BlockAccount, Cycle, Fifo, LinkState, Observer, Wire};
use crate::spec::BoardSpec;

use super::module::{Front, LINK_ENTRIES, Module, still};
use super::{
    BundleGenerator, BundleGeneratorIo, CtuIo, HostPort, IcuIo, Job, NewRay, PatchLoaderIo, RayEnd, RayStore,
    ReducerIo, ResultMerge, ResultMergeIo, Run, ShellCtuIo, ShellLoaderIo, ShellTrackerIo,
};

/// A part of a cluster that ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Generator,
    /// In shells only.
    Tracker {
        module: u8,
    },
    Ctu {
        module: u8,
        ctu: u8,
    },
    Loader {
        module: u8,
    },
    Icu {
        module: u8,
    },
    Reducer {
        module: u8,
    },
    Merge,
    Buffer,
}

/// Caches of a module: lists, patches, masks.
const CACHES: usize = 3;

/// The cluster.
#[derive(Clone, Debug)]
pub struct Cluster {
    generator: BundleGenerator,
    modules: Vec<Module>,
    merge: ResultMerge,
    buffer: ClusterBuffer,
    store: RayStore,
    /// Grid: links of CTU c of module m, index m k + c. Shells: a link a module.
    rays: Vec<Fifo<NewRay>>,
    ends: Vec<Fifo<RayEnd>>,
    started: Wire<(u8, Job)>,
    /// The merge's taken slots at the start of the cycle.
    taken_slots: u64,
    n_slots: u32,
    /// Links of the caches: 3 m the list cache of module m, 3 m + 1 its patch cache, 3 m + 2 its mask cache.
    misses: Vec<Fifo<MemoryRequest>>,
    fills: Vec<Wire<Line>>,
    /// Every part, in the order of ticks, and its account.
    parts: Vec<Part>,
    accounts: Accounts,
    /// Nothing can change before something comes in.
    asleep: bool,
    /// Cycles in which it slept.
    slept_cycles: u64,
    #[cfg(test)]
    pub(crate) sleepless: bool,
    #[cfg(test)]
    permutation: Option<Vec<usize>>,
    ctus_per_icu: usize,
}

/// What surrounds a cluster in a cycle.
#[derive(Debug)]
pub struct ClusterIo<'a> {
    /// To and from the host.
    pub host: &'a mut HostPort,
    /// To and from the DRAM.
    pub dram: &'a mut DramPort,
}

impl Cluster {
    /// Cluster `number` of a validated specification, empty, its blocks numbered from `first_block` on.
    pub fn new(spec: &BoardSpec, image: &MemoryImage, number: u32, first_block: u16) -> Self {
        let (modules, k) = (spec.clusters.modules, spec.clusters.ctus_per_icu);
        let in_shells = spec.partition.is_shells();
        let mut parts = vec![Part::Generator];
        for module in 0..modules as u8 {
            parts.extend(in_shells.then_some(Part::Tracker { module }));
            parts.extend((0..k as u8).map(|ctu| Part::Ctu { module, ctu }));
            parts.extend([Part::Loader { module }, Part::Icu { module }, Part::Reducer { module }]);
        }
        parts.extend([Part::Merge, Part::Buffer]);
        let n_links = if in_shells { modules } else { modules * k } as usize;
        Cluster {
            generator: BundleGenerator::new(in_shells.then_some(modules)),
            modules: (0..modules).map(|m| Module::new(spec, image, number, m)).collect(),
            merge: ResultMerge::new(spec.clusters.bundle_slots),
            buffer: ClusterBuffer::new(
                spec.effective_cache_bytes().buffer,
                spec.cluster_buffer.ways,
                spec.cluster_buffer.cycles,
                spec.cluster_buffer.miss_registers,
            ),
            store: RayStore::new(spec.clusters.bundle_slots),
            rays: vec![Fifo::new(LINK_ENTRIES); n_links],
            ends: vec![Fifo::new(LINK_ENTRIES); n_links],
            started: Wire::new(),
            taken_slots: 0,
            n_slots: spec.clusters.bundle_slots,
            misses: vec![Fifo::new(LINK_ENTRIES); CACHES * modules as usize],
            fills: vec![Wire::new(); CACHES * modules as usize],
            accounts: Accounts::new(parts.len(), first_block),
            parts,
            asleep: false,
            slept_cycles: 0,
            #[cfg(test)]
            sleepless: false,
            #[cfg(test)]
            permutation: None,
            ctus_per_icu: k as usize,
        }
    }

    /// One cycle of every part; true when any of them worked.
    #[inline]
    pub fn tick<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        mut io: ClusterIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> bool {
        if self.asleep {
            if io.host.commands.front(now).is_none() && io.dram.responses.front(now).is_none() {
                self.slept_cycles += 1;
                return false;
            }
            self.asleep = false;
        }
        let worked = self.tick_parts(now, &mut io, run);
        if !worked {
            self.asleep = self.is_still(now, &io);
        }
        worked
    }

    /// True when no part can do anything else in the next cycle unless something comes in.
    #[inline(never)]
    fn is_still(&self, now: Cycle, io: &ClusterIo<'_>) -> bool {
        #[cfg(test)]
        if self.sleepless {
            return false;
        }
        // A block without work may still have let something go. What merge and buffer have for the outside must have
        // room there, else they wait for it.
        self.modules.iter().all(|module| module.is_still(now))
            && self.buffer.is_still()
            && still(&self.rays, now)
            && still(&self.ends, now)
            && still(&self.misses, now)
            && io.host.entries.can_push(now)
            && io.host.estimates.can_push(now)
            && io.dram.requests.can_push(now)
    }

    /// Cycles in which the cluster was not ticked, since nothing could change.
    pub fn slept_cycles(&self) -> u64 {
        self.slept_cycles
    }

    #[inline]
    fn tick_parts<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        io: &mut ClusterIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> bool {
        let assigned = self.taken_slots != 0 || io.host.commands.len(now) > 0 || !self.generator.is_quiet();
        #[cfg(test)]
        if let Some(permutation) = self.permutation.take() {
            let worked = permutation
                .iter()
                .map(|&i| self.tick_and_record(now, self.parts[i], i, assigned, io, run))
                .fold(false, |any, worked| any | worked);
            self.permutation = Some(permutation);
            return worked;
        }
        // The order of `parts`, written out so that each part's code stands in line.
        let mut worked = self.tick_and_record(now, Part::Generator, 0, assigned, io, run);
        let mut i = 1;
        for module in 0..self.modules.len() as u8 {
            if let Front::Shells(_) = self.modules[usize::from(module)].front {
                worked |= self.tick_and_record(now, Part::Tracker { module }, i, assigned, io, run);
                i += 1;
            }
            for ctu in 0..self.ctus_per_icu as u8 {
                worked |= self.tick_and_record(now, Part::Ctu { module, ctu }, i, assigned, io, run);
                i += 1;
            }
            worked |= self.tick_and_record(now, Part::Loader { module }, i, assigned, io, run);
            worked |= self.tick_and_record(now, Part::Icu { module }, i + 1, assigned, io, run);
            worked |= self.tick_and_record(now, Part::Reducer { module }, i + 2, assigned, io, run);
            i += 3;
        }
        worked |= self.tick_and_record(now, Part::Merge, i, assigned, io, run);
        worked |= self.tick_and_record(now, Part::Buffer, i + 1, assigned, io, run);
        worked
    }

    #[inline(always)]
    fn tick_and_record<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        part: Part,
        account: usize,
        assigned: bool,
        io: &mut ClusterIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> bool {
        run.block = self.accounts.number(account);
        let activity = self.tick_part(now, part, io, run);
        self.accounts.record(now, account, activity, assigned, run.observer);
        activity == Activity::Work
    }

    #[inline(always)]
    fn tick_part<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        part: Part,
        io: &mut ClusterIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        match part {
            Part::Generator => {
                let io = BundleGeneratorIo {
                    commands: &mut io.host.commands,
                    taken_slots: self.taken_slots,
                    n_slots: self.n_slots,
                    started: &mut self.started,
                    store: &mut self.store,
                    rays: &mut self.rays,
                };
                self.generator.tick(now, io, run)
            }
            Part::Tracker { module: m } => {
                let m = usize::from(m);
                let Module { front: Front::Shells(front), reduced, .. } = &mut self.modules[m] else {
                    unreachable!("a tracker is a part in shells only")
                };
                let io = ShellTrackerIo {
                    rays: &mut self.rays[m],
                    store: &mut self.store,
                    requests: &mut front.requests,
                    visits: &mut front.visits,
                    entries: &mut front.entries,
                    entry_done: &front.entry_done,
                    reduced,
                    ends: &mut self.ends[m],
                    over: &mut front.over,
                };
                front.tracker.tick(now, io, run)
            }
            Part::Ctu { module: m, ctu } => {
                let (m, ctu) = (usize::from(m), usize::from(ctu));
                let module = &mut self.modules[m];
                match &mut module.front {
                    Front::Grid(front) => {
                        let link = m * self.ctus_per_icu + ctu;
                        let io = CtuIo {
                            store: &self.store,
                            rays: &mut self.rays[link],
                            requests: &mut front.requests[ctu],
                            ends: &mut self.ends[link],
                            list_done: &front.list_done,
                            reduced: &module.reduced,
                        };
                        front.ctus[ctu].tick(now, io, run)
                    }
                    Front::Shells(front) => {
                        let io = ShellCtuIo {
                            store: &self.store,
                            requests: &mut front.requests[ctu],
                            visits: &mut front.visits[ctu],
                        };
                        front.ctus[ctu].tick(now, io, run)
                    }
                }
            }
            Part::Loader { module: m } => {
                let m = usize::from(m);
                let module = &mut self.modules[m];
                let [list_misses, patch_misses, mask_misses] = &mut self.misses[CACHES * m..][..CACHES]
                else {
                    unreachable!("three caches a module")
                };
                let [list_fill, patch_fill, mask_fill] = &self.fills[CACHES * m..][..CACHES] else {
                    unreachable!("three caches a module")
                };
                match &mut module.front {
                    Front::Grid(front) => {
                        let io = PatchLoaderIo {
                            requests: &mut front.requests,
                            jobs: &mut module.jobs,
                            list_done: &mut front.list_done,
                            list_misses,
                            list_fill,
                            patch_misses,
                            patch_fill,
                        };
                        front.loader.tick(now, io, run)
                    }
                    Front::Shells(front) => {
                        let io = ShellLoaderIo {
                            entries: &mut front.entries,
                            over: &front.over,
                            jobs: &mut module.jobs,
                            entry_done: &mut front.entry_done,
                            list_misses,
                            list_fill,
                            patch_misses,
                            patch_fill,
                            mask_misses,
                            mask_fill,
                        };
                        front.loader.tick(now, io, run)
                    }
                }
            }
            Part::Icu { module: m } => {
                let module = &mut self.modules[usize::from(m)];
                let io =
                    IcuIo { jobs: &mut module.jobs, store: &self.store, results: &mut module.test_results };
                module.icu.tick(now, io, run)
            }
            Part::Reducer { module: m } => {
                let module = &mut self.modules[usize::from(m)];
                let (results, reduced) = (&mut module.test_results, &mut module.reduced);
                super::Reducer.tick(now, ReducerIo { results, store: &mut self.store, reduced }, run)
            }
            Part::Merge => {
                let (started, ends, store) = (&self.started, &mut self.ends[..], &self.store);
                self.merge.tick(now, ResultMergeIo { started, ends, store, host: io.host }, run)
            }
            Part::Buffer => {
                let io = ClusterBufferIo {
                    requests: &mut self.misses,
                    fills: &mut self.fills,
                    dram_request: &mut io.dram.requests,
                    dram_response: &mut io.dram.responses,
                };
                self.buffer.tick(now, io, run.observer)
            }
        }
    }

    /// The clock edge: FIFOs and wires need none, they go by the cycle.
    #[inline]
    pub fn commit(&mut self) {
        self.taken_slots = self.merge.taken_slots();
    }

    /// Shows every link with its name.
    pub(crate) fn links(&mut self, cluster: usize, see: &mut dyn FnMut(String, &mut LinkState)) {
        let in_shells = self.generator_links_modules();
        let k = self.ctus_per_icu;
        let of = |i: usize| match in_shells {
            true => format!("cluster{cluster}.module{i}"),
            false => format!("cluster{cluster}.module{}.ctu{}", i / k, i % k),
        };
        for (i, link) in self.rays.iter_mut().enumerate() {
            see(format!("{}.rays", of(i)), link.state_mut());
        }
        for (m, module) in self.modules.iter_mut().enumerate() {
            module.links(&format!("cluster{cluster}.module{m}"), see);
        }
        for (i, link) in self.misses.iter_mut().enumerate() {
            let cache = ["list", "patch", "mask"][i % CACHES];
            if in_shells || cache != "mask" {
                see(format!("cluster{cluster}.module{}.{cache}_misses", i / CACHES), link.state_mut());
            }
        }
        for (i, link) in self.ends.iter_mut().enumerate() {
            see(format!("{}.ends", of(i)), link.state_mut());
        }
    }

    fn generator_links_modules(&self) -> bool {
        matches!(self.modules[0].front, Front::Shells(_))
    }

    /// True when no token, line or message is in a block or on a wire; links are the board's to look at.
    pub fn is_quiet(&self, now: Cycle) -> bool {
        self.modules.iter().all(|m| m.is_quiet(now))
            && self.generator.is_quiet()
            && self.merge.is_quiet()
            && self.buffer.is_quiet()
            && self.started.is_quiet(now)
            && self.fills.iter().all(|w| w.is_quiet(now))
    }

    /// Ends a run before cycle `now`; `after` cycles with nothing on the board follow.
    pub fn end_run(&mut self, now: Cycle, after: Cycle) {
        self.accounts.end_run(now, after);
        // The next run's first cycle is recorded whatever happens in it.
        self.asleep = false;
    }

    /// Names of the parts, in the order of their numbers.
    pub(crate) fn block_names(&self, cluster: usize) -> impl Iterator<Item = String> {
        self.parts.iter().map(move |part| part.name(cluster))
    }

    /// The named accounts of every part.
    pub fn block_accounts(&self, cluster: usize) -> Vec<BlockAccount> {
        let parts = self.parts.iter().enumerate();
        parts.map(|(i, part)| self.accounts.named(i, part.name(cluster))).collect()
    }

    /// Each part's latest activity, for the watchdog's message.
    pub(crate) fn latest_activities(&self, cluster: usize) -> impl Iterator<Item = String> {
        let parts = self.parts.iter().enumerate();
        parts.map(move |(i, part)| format!("{} {}", part.name(cluster), self.accounts.latest(i)))
    }

    /// Traffic of the list caches, patch caches, mask caches and the cluster buffer.
    pub fn traffic(&self) -> [Traffic; 4] {
        let mut sum = [Traffic::default(); CACHES + 1];
        sum[CACHES] = self.buffer.traffic();
        for module in &self.modules {
            for (level, traffic) in sum.iter_mut().zip(module.traffic()) {
                level.add(traffic);
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
            Part::Tracker { module } => format!("cluster{cluster}.module{module}.shell_tracker"),
            Part::Ctu { module, ctu } => format!("cluster{cluster}.module{module}.ctu{ctu}"),
            Part::Loader { module } => format!("cluster{cluster}.module{module}.patch_loader"),
            Part::Icu { module } => format!("cluster{cluster}.module{module}.icu"),
            Part::Reducer { module } => format!("cluster{cluster}.module{module}.reducer"),
            Part::Merge => format!("cluster{cluster}.result_merge"),
            Part::Buffer => format!("cluster{cluster}.cluster_buffer"),
        }
    }
}
