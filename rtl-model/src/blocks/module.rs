//! A module: k CTUs, what leads their cells to patches, an ICU and its reducer, with the links between them.
//!
//! ```text
//! grid:   NewRay x k --> CTUs --> patch loader --> ICU --> reducer --> CTUs           RayEnd x k
//! shells: NewRay --> shell tracker <--> CTUs, shell tracker --> shell loader --> ICU --> reducer --> tracker   RayEnd
//! ```
//! Plain fields, no clock of its own: the cluster ticks the parts.

use crate::memory::{Line, MaskCache, ReadPort, Traffic};
use crate::memory_image::MemoryImage;
use crate::sim::{Cycle, Fifo, LinkState, Token, Wire, Wires};
use crate::spec::BoardSpec;

use super::{
    CellRequest, Ctu, EntryDone, Icu, IcuJob, ListDone, ListEntry, PatchLoader, Reduced, ShellCtu,
    ShellLoader, ShellTracker, StepRequest, TestResult, Visit,
};

/// The parts before the ICU in grid partition.
#[derive(Clone, Debug)]
pub(super) struct GridFront {
    pub(super) ctus: Vec<Ctu>,
    pub(super) loader: PatchLoader,
    pub(super) requests: Vec<Fifo<CellRequest>>,
    pub(super) list_done: Wires<ListDone>,
}

/// The parts before the ICU in shells.
#[derive(Clone, Debug)]
pub(super) struct ShellFront {
    pub(super) tracker: ShellTracker,
    pub(super) ctus: Vec<ShellCtu>,
    pub(super) loader: ShellLoader,
    pub(super) requests: Vec<Fifo<StepRequest>>,
    pub(super) visits: Vec<Fifo<Visit>>,
    pub(super) entries: Fifo<ListEntry>,
    pub(super) entry_done: Wire<EntryDone>,
    pub(super) over: Wire<u8>,
}

/// The parts before the ICU.
#[derive(Clone, Debug)]
pub(super) enum Front {
    Grid(Box<GridFront>),
    Shells(Box<ShellFront>),
}

/// The module.
#[derive(Clone, Debug)]
pub(super) struct Module {
    pub(super) front: Front,
    pub(super) icu: Icu,
    pub(super) jobs: Fifo<IcuJob>,
    pub(super) test_results: Fifo<TestResult>,
    pub(super) reduced: Wires<Reduced>,
}

/// A valid/ready link with its 2-entry skid buffer.
pub(super) const LINK_ENTRIES: u32 = 2;

/// True when nothing moved on the links in cycle `now`.
pub(super) fn still<T: Token>(links: &[Fifo<T>], now: Cycle) -> bool {
    links.iter().all(|link| link.state().is_still(now))
}

impl Module {
    /// Module `number` of cluster `cluster`, empty.
    pub(super) fn new(spec: &BoardSpec, image: &MemoryImage, cluster: u32, number: u32) -> Module {
        let (k, contexts) = (spec.clusters.ctus_per_icu, spec.ctu.contexts);
        let caches = spec.effective_cache_bytes();
        let list_port = ReadPort::new(caches.list, spec.list_cache.ways, spec.list_cache.miss_registers);
        let patch_port = ReadPort::new(caches.patch, spec.patch_cache.ways, spec.patch_cache.miss_registers);
        let depth = spec.fifos.ctu_icu;
        let front = if spec.partition.is_shells() {
            let masks = &spec.mask_cache;
            let slots = spec.clusters.bundle_slots;
            let lines_per_slot = image.mask_lines_per_slot();
            let module = cluster * spec.clusters.modules + number;
            let base = image.mask_base() + module * slots * lines_per_slot;
            let mask_port =
                MaskCache::new(caches.mask, masks.ways, masks.miss_registers, Line(base), lines_per_slot);
            Front::Shells(Box::new(ShellFront {
                tracker: ShellTracker::new(&spec.shells, slots, k),
                ctus: (0..k).map(|_| ShellCtu::new(&spec.ctu)).collect(),
                loader: ShellLoader::new(
                    &spec.loader,
                    slots,
                    image.n_patches,
                    list_port,
                    mask_port,
                    patch_port,
                ),
                requests: vec![Fifo::new(LINK_ENTRIES); k as usize],
                visits: vec![Fifo::new(depth); k as usize],
                entries: Fifo::new(depth),
                entry_done: Wire::new(),
                over: Wire::new(),
            }))
        } else {
            Front::Grid(Box::new(GridFront {
                ctus: (0..k).map(|id| Ctu::new(&spec.ctu, id as u8)).collect(),
                loader: PatchLoader::new(spec.loader.slots, k, contexts, list_port, patch_port),
                requests: vec![Fifo::new(depth); k as usize],
                list_done: Wires::new(k as usize),
            }))
        };
        Module {
            front,
            icu: Icu::new(&spec.icu_timing()),
            jobs: Fifo::new(if spec.partition.is_shells() { depth } else { LINK_ENTRIES }),
            test_results: Fifo::new(spec.fifos.icu_reducer),
            reduced: Wires::new(k as usize),
        }
    }

    /// Shows every link with its name.
    pub(super) fn links(&mut self, name: &str, see: &mut dyn FnMut(String, &mut LinkState)) {
        match &mut self.front {
            Front::Grid(front) => {
                for (c, link) in front.requests.iter_mut().enumerate() {
                    see(format!("{name}.ctu{c}_requests"), link.state_mut());
                }
            }
            Front::Shells(front) => {
                for (c, link) in front.requests.iter_mut().enumerate() {
                    see(format!("{name}.ctu{c}_requests"), link.state_mut());
                }
                for (c, link) in front.visits.iter_mut().enumerate() {
                    see(format!("{name}.ctu{c}_visits"), link.state_mut());
                }
                see(format!("{name}.entries"), front.entries.state_mut());
            }
        }
        see(format!("{name}.jobs"), self.jobs.state_mut());
        see(format!("{name}.test_results"), self.test_results.state_mut());
    }

    /// True when time alone changes nothing in its blocks, and nothing moved on its links in cycle `now`.
    #[inline]
    pub(super) fn is_still(&self, now: Cycle) -> bool {
        self.icu.is_still()
            && still(std::slice::from_ref(&self.jobs), now)
            && still(std::slice::from_ref(&self.test_results), now)
            && match &self.front {
                Front::Grid(front) => {
                    front.ctus.iter().all(Ctu::is_still)
                        && front.loader.is_still()
                        && still(&front.requests, now)
                }
                Front::Shells(front) => {
                    front.ctus.iter().all(ShellCtu::is_still)
                        && front.loader.is_still()
                        && still(&front.requests, now)
                        && still(&front.visits, now)
                        && still(std::slice::from_ref(&front.entries), now)
                }
            }
    }

    /// True when no block holds anything and no wire carries anything; links are the board's to look at.
    pub(super) fn is_quiet(&self, now: Cycle) -> bool {
        let front = match &self.front {
            Front::Grid(f) => {
                f.ctus.iter().all(Ctu::is_quiet) && f.loader.is_quiet() && f.list_done.is_quiet(now)
            }
            Front::Shells(f) => {
                f.tracker.is_quiet()
                    && f.ctus.iter().all(ShellCtu::is_quiet)
                    && f.loader.is_quiet()
                    && f.entry_done.is_quiet(now)
            }
        };
        front && self.icu.is_quiet() && self.reduced.is_quiet(now)
    }

    /// Traffic of the list, patch and mask caches.
    pub(super) fn traffic(&self) -> [Traffic; 3] {
        match &self.front {
            Front::Grid(front) => {
                let [list, patch] = front.loader.traffic();
                [list, patch, Traffic::default()]
            }
            Front::Shells(front) => front.loader.traffic(),
        }
    }
}
