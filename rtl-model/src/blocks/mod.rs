//! One clocked block a file. Each has a `tick` that borrows its ports for one cycle; registers are its fields.
//!
//! ```text
//! dispatcher --FetchRequest--> host link --Job--> clusters, in each:
//!   bundle generator --NewRay--> CTUs --CellRequest--> patch loader --TestToken--> ICU --TestResult--> reducer
//!                                 ^  ^------------ListDone--'                                          |
//!                                 `-------------------------------Reduced------------------------------'
//!   CTUs --RayResult--> result merge --ResultEntry--> host link
//! ```

mod bundle_generator;
mod cluster;
mod ctu;
mod dispatcher;
mod host_link;
mod icu;
mod patch_loader;
mod reducer;
mod result_merge;

pub use bundle_generator::{BundleGenerator, BundleGeneratorIo};
pub use cluster::{Cluster, ClusterIo};
pub use ctu::{Ctu, CtuIo};
pub use dispatcher::{Dispatcher, DispatcherIo, FetchRequest};
pub use host_link::{HostLink, HostLinkIo, HostPort};
pub use icu::{Icu, IcuIo};
pub use patch_loader::{PatchLoader, PatchLoaderIo};
pub use reducer::{Reducer, ReducerIo};
pub use result_merge::{ResultMerge, ResultMergeIo};

use crate::datapath::cell_step::Cell;
use crate::datapath::{HitWords, RayWords};

/// A bundle, or up to 64 explicit rays, as the board moves it: an index into the command's jobs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Job {
    /// Which bundle (or chunk of explicit rays) of the command.
    pub index: u32,
    /// Index of its first ray in the command.
    pub first_ray: u32,
    /// Its rays, 1 to 64.
    pub n_rays: u32,
    /// Size of its descriptor on the bus (B).
    pub bytes: u32,
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

/// A ray on its way to a CTU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NewRay {
    /// The ray.
    pub ray: RayWords,
    /// Bundle slot of the cluster.
    pub slot: u8,
    /// Place in the bundle.
    pub index: u8,
}

impl Default for NewRay {
    fn default() -> Self {
        NewRay { ray: RayWords { origin: [0; 3], dir: [0; 3], t_max: 0 }, slot: 0, index: 0 }
    }
}

/// A ray entered an occupied cell: its list is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRequest {
    /// Who asks.
    pub context: ContextId,
    /// The cell.
    pub cell: Cell,
    /// The ray's first request: its mailbox starts empty.
    pub fresh: bool,
}

impl Default for CellRequest {
    fn default() -> Self {
        CellRequest { context: ContextId::default(), cell: Cell([0; 3]), fresh: false }
    }
}

/// One ray is to be tested with one patch. In hardware the record travels beside it; here it is read by its number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TestToken {
    /// Whose ray.
    pub context: ContextId,
    /// Number of the patch's record.
    pub patch: u32,
    /// The ray's first test: its best hit starts empty.
    pub fresh: bool,
}

/// The answer of a test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TestResult {
    /// Whose ray.
    pub context: ContextId,
    /// The hit, if any.
    pub hit: Option<HitWords>,
    /// As in [`TestToken`].
    pub fresh: bool,
}

/// A cell's list is through: so many tests were sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ListDone {
    /// Whose cell.
    pub context: u8,
    /// Tests sent for it.
    pub tests: u32,
}

/// A test was reduced; the ray's best hit so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reduced {
    /// Whose ray.
    pub context: u8,
    /// Its best hit.
    pub best: Option<HitWords>,
}

/// A ray has ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayResult {
    /// Bundle slot of the cluster.
    pub slot: u8,
    /// Place in the bundle.
    pub index: u8,
    /// Its nearest hit (for any-hit rays: whatever hit).
    pub hit: Option<HitWords>,
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
