//! One clocked block a file. Each has a `tick` that borrows its ports for one cycle; registers are its fields.
//!
//! ```text
//! dispatcher --FetchRequest--> host link --Job--> clusters, in each:
//!
//! grid: bundle generator --NewRay--> CTUs --CellRequest--> patch loader --IcuJob--> ICU --TestResult--> reducer
//!                                     ^  ^------------ListDone--'                                       |
//!                                     `-------------------------------Reduced---------------------------'
//!       CTUs --RayEnd--> result merge --ResultEntry--> host link
//!
//! shells: bundle generator --NewRay--> shell tracker --StepRequest--> CTUs --Visit--> shell tracker
//!             shell tracker --ListEntry--> shell loader --IcuJob--> ICU --TestResult--> reducer
//!                  ^  ^----------EntryDone--'                                             |
//!                  `-------------------------------------Reduced--------------------------'
//!         shell tracker --RayEnd--> result merge --ResultEntry--> host link
//! ```

#[cfg(test)]
pub(crate) mod bench;
mod bundle_generator;
mod cluster;
mod ctu;
mod dispatcher;
mod host_link;
mod icu;
mod module;
mod patch_loader;
mod reducer;
mod result_merge;
mod shell_ctu;
mod shell_loader;
mod shell_tracker;

pub use bundle_generator::{BundleGenerator, BundleGeneratorIo};
pub use cluster::{Cluster, ClusterIo};
pub use ctu::{Ctu, CtuIo};
pub use dispatcher::{Dispatcher, DispatcherIo, FetchRequest};
pub use host_link::{HostLink, HostLinkIo, HostPort};
pub use icu::{Icu, IcuIo};
pub use patch_loader::{PatchLoader, PatchLoaderIo};
pub use reducer::{Reducer, ReducerIo};
pub use result_merge::{ResultMerge, ResultMergeIo};
pub use shell_ctu::{ShellCtu, ShellCtuIo};
pub use shell_loader::{ShellLoader, ShellLoaderIo};
pub use shell_tracker::{ShellTracker, ShellTrackerIo};

use crate::answers::At;
use crate::board::Work;
use crate::datapath::cell_step::Cell;
use crate::datapath::{HitWords, RayWords};
use crate::functional::CanonicalCounters;
use crate::memory_image::MemoryImage;
use crate::packet::MAX_BUNDLE_RAYS;
use crate::sim::{RayRef, Token};

/// What all blocks of a run share, lent to each for its cycle.
#[derive(Debug)]
pub struct Run<'a, A, O> {
    /// What the command's jobs hold.
    pub work: Work<'a>,
    /// The patch memory.
    pub image: &'a MemoryImage,
    /// The command asks for any hit only.
    pub any_hit: bool,
    /// Canonical counts.
    pub counters: &'a mut CanonicalCounters,
    /// Where answers come from.
    pub answers: &'a mut A,
    /// Who is told of events.
    pub observer: &'a mut O,
    /// The cluster whose block ticks.
    pub cluster: u8,
    /// The number of that block in the board's directory.
    pub block: u16,
}

impl<A, O> Run<'_, A, O> {
    /// A ray of the cluster, as it asks for answers.
    #[inline]
    pub fn at(&self, ray: RayRef) -> At {
        At { cluster: self.cluster, ray }
    }
}

/// The rays of a cluster's bundles and the best hit of each, by [`RayRef::place`].
///
/// In hardware a ray's words stand in the register of the context or tracker that works on it and travel beside its
/// tokens, and its best hit in its module's reducer; here in one place.
#[derive(Clone, Debug)]
pub struct RayStore {
    words: Box<[RayWords]>,
    best: Box<[Option<HitWords>]>,
    /// Cells entered in shells, and tests made.
    cost: Box<[u32]>,
}

impl RayStore {
    /// Room for the rays of `n_slots` bundles.
    pub fn new(n_slots: u32) -> Self {
        let n = n_slots as usize * MAX_BUNDLE_RAYS;
        let empty = RayWords { origin: [0; 3], dir: [0; 3], t_max: 0 };
        RayStore {
            words: vec![empty; n].into_boxed_slice(),
            best: vec![None; n].into_boxed_slice(),
            cost: vec![0; n].into_boxed_slice(),
        }
    }

    /// A new ray without a hit.
    #[inline]
    pub fn start(&mut self, ray: RayRef, words: RayWords) {
        self.words[ray.place()] = words;
        self.best[ray.place()] = None;
        self.cost[ray.place()] = 0;
    }

    /// Cells that it entered (in shells) and tests that it took part in.
    #[inline]
    pub fn cost(&self, ray: RayRef) -> u32 {
        self.cost[ray.place()]
    }

    /// Counts a cell. (Adding does not mind whether it or the reducer comes first in a cycle.)
    #[inline]
    pub fn count_cell(&mut self, ray: RayRef) {
        self.cost[ray.place()] += 1;
    }

    /// Its words.
    #[inline]
    pub fn words(&self, ray: RayRef) -> &RayWords {
        &self.words[ray.place()]
    }

    /// Its best hit so far.
    #[inline]
    pub fn best(&self, ray: RayRef) -> Option<HitWords> {
        self.best[ray.place()]
    }

    /// Takes a test into account; the best hit then.
    #[inline]
    pub fn reduce(&mut self, ray: RayRef, hit: Option<HitWords>) -> Option<HitWords> {
        let best = &mut self.best[ray.place()];
        *best = HitWords::nearer(*best, hit);
        self.cost[ray.place()] += 1;
        *best
    }
}

/// A bundle, or up to 64 explicit rays, as the board moves it: an index into the command's jobs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Job {
    /// Which bundle (or chunk of explicit rays) of the command.
    pub index: u32,
    /// Index of its first ray in the command.
    pub first_ray: u32,
    /// Its rays, 1 to 64.
    pub n_rays: u32,
    /// Rays of a low-resolution cast: their work is wanted, not their hits.
    pub low_resolution: bool,
    /// Size of its descriptor on the bus (B).
    pub bytes: u32,
}

/// What the work on a ray of a low-resolution cast came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Estimate {
    /// Which ray of the cast.
    pub index: u32,
    /// Cells entered and tests made.
    pub cost: u32,
}

/// Names a ray context of a module: CTU and context in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContextId {
    /// Which CTU of the module.
    pub ctu: u8,
    /// Which of its contexts.
    pub context: u8,
}

impl ContextId {
    /// Its place in a table of all contexts of the module.
    #[inline]
    pub fn index(self, contexts_per_ctu: usize) -> usize {
        usize::from(self.ctu) * contexts_per_ctu + usize::from(self.context)
    }
}

/// A ray on its way to a CTU or shell tracker; its words are in the [`RayStore`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NewRay {
    /// Which ray.
    pub ray: RayRef,
    /// Rays of its bundle.
    pub n_rays: u8,
}

/// A ray entered an occupied cell: its list is wanted (grid).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRequest {
    /// Who asks.
    pub context: ContextId,
    /// Its ray.
    pub ray: RayRef,
    /// The cell.
    pub cell: Cell,
    /// The ray's first request: its mailbox starts empty.
    pub fresh: bool,
}

impl Default for CellRequest {
    fn default() -> Self {
        let (context, ray) = (ContextId::default(), RayRef::default());
        CellRequest { context, ray, cell: Cell([0; 3]), fresh: false }
    }
}

/// A ray is to take a step (shells).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepRequest {
    /// Which ray.
    pub ray: RayRef,
    /// Where it is.
    pub cell: Cell,
    /// Its apex's cell.
    pub apex: Cell,
    /// Distance from the apex at which its next shell begins.
    pub radius: u32,
    /// The t beyond which nothing nearer can come.
    pub limit_t: u64,
    /// It enters its apex's cell.
    pub enters: bool,
}

impl Default for StepRequest {
    fn default() -> Self {
        let cell = Cell([0; 3]);
        StepRequest { ray: RayRef::default(), cell, apex: cell, radius: 0, limit_t: 0, enters: false }
    }
}

/// What a step came to (shells).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VisitKind {
    /// It entered an empty cell.
    Empty,
    /// It entered a cell with patches.
    Occupied,
    /// Its next cell, this one, is in a shell to come.
    Parked {
        /// That cell has patches.
        occupied: bool,
    },
    /// It ends.
    #[default]
    Ended,
}

/// A CTU's answer to a step request (shells).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visit {
    /// Which ray.
    pub ray: RayRef,
    /// The cell.
    pub cell: Cell,
    /// What it came to.
    pub kind: VisitKind,
}

impl Default for Visit {
    fn default() -> Self {
        Visit { ray: RayRef::default(), cell: Cell([0; 3]), kind: VisitKind::Ended }
    }
}

/// An entry of a bundle's table on its way to the loader (shells). An empty mask asks for a prefetch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListEntry {
    /// Bundle slot of the cluster.
    pub slot: u8,
    /// The cell whose list is wanted.
    pub cell: Cell,
    /// The rays in it.
    pub mask: u64,
}

impl Default for ListEntry {
    fn default() -> Self {
        ListEntry { slot: 0, cell: Cell([0; 3]), mask: 0 }
    }
}

/// A patch and the rays to test with it. In hardware the record travels beside it; here it is read by its number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IcuJob {
    /// Bundle slot of the cluster.
    pub slot: u8,
    /// In grid partition, the context of its one ray.
    pub context: ContextId,
    /// Number of the patch's record.
    pub patch: u32,
    /// A bit per ray of the bundle, at least one.
    pub rays: u64,
}

/// The answer of a test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TestResult {
    /// Whose.
    pub ray: RayRef,
    /// In grid partition, its context.
    pub context: ContextId,
    /// The hit, if any.
    pub hit: Option<HitWords>,
}

/// A cell's list is through: so many tests were sent (grid).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ListDone {
    /// Whose cell.
    pub context: u8,
    /// Tests sent for it.
    pub tests: u32,
}

/// An entry's list is through: so many tests were sent (shells).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EntryDone {
    /// Whose entry.
    pub slot: u8,
    /// Tests sent for it.
    pub tests: u32,
    /// It was a prefetch.
    pub prefetch: bool,
}

/// A test was reduced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reduced {
    /// Grid: whose ray.
    pub context: u8,
    /// Shells: whose bundle.
    pub slot: u8,
    /// The ray's best hit.
    pub best: Option<HitWords>,
}

/// A ray has ended (grid), or all rays of a bundle together (shells).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayEnd {
    /// The ray; of a bundle, its ray 0.
    pub ray: RayRef,
    /// How many rays ended.
    pub n_rays: u8,
}

/// What one entry of the result queue brings to the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResultEntry {
    /// The nearest hit of one ray.
    Nearest {
        /// Index of the ray in the command.
        ray: u32,
        /// Its hit.
        hit: Option<HitWords>,
        /// The bundle's last entry.
        last: bool,
    },
    /// The hit bits of a bundle.
    Any {
        /// Index of its first ray in the command.
        first_ray: u32,
        /// A bit per ray.
        bits: u64,
        /// Its rays.
        n_rays: u32,
    },
}

impl Default for ResultEntry {
    fn default() -> Self {
        ResultEntry::Any { first_ray: 0, bits: 0, n_rays: 0 }
    }
}

impl ResultEntry {
    /// True for the entry that ends its bundle.
    pub fn is_last(&self) -> bool {
        matches!(self, ResultEntry::Any { .. } | ResultEntry::Nearest { last: true, .. })
    }
}

impl Token for () {}

impl Token for Job {
    fn payload(&self) -> u32 {
        self.index
    }
}

impl Token for Estimate {
    fn payload(&self) -> u32 {
        self.index
    }
}

impl Token for NewRay {
    fn payload(&self) -> u32 {
        self.ray.payload()
    }
}

impl Token for CellRequest {
    fn payload(&self) -> u32 {
        self.ray.payload()
    }
}

impl Token for StepRequest {
    fn payload(&self) -> u32 {
        self.ray.payload()
    }
}

impl Token for Visit {
    fn payload(&self) -> u32 {
        self.ray.payload()
    }
}

impl Token for ListEntry {
    fn payload(&self) -> u32 {
        RayRef { slot: self.slot, index: 0 }.payload()
    }
}

impl Token for IcuJob {
    /// The bundle's slot, and above it the patch.
    fn payload(&self) -> u32 {
        RayRef { slot: self.slot, index: 0 }.payload() | self.patch << 10
    }
}

impl Token for TestResult {
    fn payload(&self) -> u32 {
        self.ray.payload() | u32::from(self.hit.is_some()) << 10
    }
}

impl Token for RayEnd {
    fn payload(&self) -> u32 {
        self.ray.payload()
    }
}

impl Token for ResultEntry {
    fn payload(&self) -> u32 {
        match *self {
            ResultEntry::Nearest { ray, .. } => ray,
            ResultEntry::Any { first_ray, .. } => first_ray,
        }
    }
}
