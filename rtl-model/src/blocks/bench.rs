//! What a block's test needs around it: a scene, a ray store, counters, nobody watching.

use crate::answers::Live;
use crate::board::Work;
use crate::functional::CanonicalCounters;
use crate::memory_image::MemoryImage;
use crate::sim::Silent;

use super::{RayStore, Run};

/// The surroundings of one block.
pub(crate) struct Bench {
    image: MemoryImage,
    /// Rays of four bundles.
    pub(crate) store: RayStore,
    /// Canonical counts.
    pub(crate) counters: CanonicalCounters,
    /// The command asks for any hit only.
    pub(crate) any_hit: bool,
}

impl Bench {
    pub(crate) fn new(image: MemoryImage) -> Bench {
        Bench { image, store: RayStore::new(4), counters: CanonicalCounters::default(), any_hit: false }
    }

    /// A cycle of a block.
    pub(crate) fn run<T>(&mut self, cycle: impl FnOnce(&mut RayStore, &mut Run<'_, Live, Silent>) -> T) -> T {
        let mut run = Run {
            work: Work::Rays(&[]),
            image: &self.image,
            any_hit: self.any_hit,
            counters: &mut self.counters,
            answers: &mut Live,
            observer: &mut Silent,
            cluster: 0,
            block: 0,
        };
        cycle(&mut self.store, &mut run)
    }
}
