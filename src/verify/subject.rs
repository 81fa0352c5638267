//! What is held against the oracle: the board's own functions, or in tests a copy with a fault.

use rtl_model::board::{Board, BoardError, Work};
use rtl_model::datapath::bundle::BundleWords;
use rtl_model::datapath::first_test;
use rtl_model::datapath::ray_patch::{self, Taps};
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::functional::{RayTrace, trace_observed};
use rtl_model::memory_image::MemoryImage;

/// The board as it is verified.
pub(super) trait Subject: Sync {
    /// The scene in its patch memory.
    fn image(&self) -> &MemoryImage;

    /// Ray `i` of a bundle.
    fn expand(&self, bundle: &BundleWords, i: usize) -> RayWords {
        bundle.ray(&self.image().formats, i)
    }

    /// Traces a ray; `tested` sees each test's patch and result.
    fn trace(
        &self,
        ray: &RayWords,
        any_hit: bool,
        tested: &mut dyn FnMut(&PatchWords, Option<HitWords>),
    ) -> RayTrace {
        trace_observed(self.image(), ray, any_hit, tested)
    }

    /// The wires of a test.
    fn taps(&self, ray: &RayWords, patch: &PatchWords) -> Taps {
        ray_patch::taps(&self.image().formats, ray, patch)
    }

    /// A test by the dual-precision unit.
    fn dual_precision(&self, bits: u32, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
        first_test::intersect(&self.image().formats, bits, ray, patch)
    }

    /// Nearest hits of the clocked board.
    fn clocked_nearest(
        &self,
        board: &mut Board,
        work: Work<'_>,
    ) -> Result<Vec<Option<HitWords>>, BoardError> {
        board.trace_nearest(work)
    }

    /// Hit bits of the clocked board.
    fn clocked_any(&self, board: &mut Board, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        board.trace_any(work)
    }
}

/// The board's own functions.
pub(super) struct Real<'a> {
    /// The scene.
    pub image: &'a MemoryImage,
}

impl Subject for Real<'_> {
    fn image(&self) -> &MemoryImage {
        self.image
    }
}
