//! The board without time: its arithmetic on all threads of the host. Same answers as `board`, no cycles.
//!
//! ```text
//! Query --quantized.rs--> words --rtl_model::functional piece by piece (rayon)--> hits, canonical counters
//! ```

use glam::DVec3;
use rayon::prelude::*;
use rtl_model::board::{BoardError, Work};
use rtl_model::datapath::HitWords;
use rtl_model::fixed::Formats;
use rtl_model::functional::{CENTRE_RAYS_TOGETHER, CanonicalCounters, centre_rays, trace_command};
use rtl_model::memory_image::MemoryImage;
use rtl_model::packet::MAX_BUNDLE_RAYS;
use rtl_model::spec::{BoardSpec, Partition};

use super::quantize::Quantizer;
use super::quantized::{self, Tracer};
use super::{CastError, CastPatch, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::mesh::PatchId;

/// Casts rays with the board's arithmetic, not its clock.
#[derive(Debug)]
pub struct FunctionalCaster {
    quantizer: Quantizer,
    tracer: FunctionalTracer,
}

#[derive(Debug)]
struct FunctionalTracer {
    spec: BoardSpec,
    image: MemoryImage,
    counters: CanonicalCounters,
}

impl FunctionalCaster {
    /// Quantises the scene and builds its patch memory, for rays by themselves in a grid. `extra_points` (m): camera,
    /// lights, probes.
    ///
    /// # Errors
    /// [`CastError::Board`] when the scene has no board numbers.
    pub fn new(
        formats: &Formats,
        grid_log2: Option<u32>,
        patches: &[CastPatch],
        extra_points: &[DVec3],
    ) -> Result<FunctionalCaster, CastError> {
        let mut spec = BoardSpec { partition: Partition::Grid, grid_log2, ..BoardSpec::default() };
        spec.formats = *formats;
        spec.dram.bytes = u64::MAX;
        Self::for_board(&spec, patches, extra_points)
    }

    /// The function of a board of `spec`: its patch memory, its partition, its canonical work.
    ///
    /// # Errors
    /// As [`FunctionalCaster::new`].
    pub fn for_board(
        spec: &BoardSpec,
        patches: &[CastPatch],
        extra_points: &[DVec3],
    ) -> Result<FunctionalCaster, CastError> {
        let (quantizer, image) = quantized::load(spec, patches, extra_points)?;
        let tracer = FunctionalTracer { spec: spec.clone(), image, counters: CanonicalCounters::default() };
        Ok(FunctionalCaster { quantizer, tracer })
    }

    /// Scene space to words.
    pub fn quantizer(&self) -> &Quantizer {
        &self.quantizer
    }

    /// The patch memory.
    pub fn image(&self) -> &MemoryImage {
        &self.tracer.image
    }

    /// The work done so far: equal to the cycle model's for the same queries.
    pub fn counters(&self) -> CanonicalCounters {
        self.tracer.counters
    }
}

impl RayCaster for FunctionalCaster {
    fn name(&self) -> &'static str {
        "functional"
    }

    fn closest_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        quantized::closest_hits(&self.quantizer, &mut self.tracer, query)
    }

    fn any_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        quantized::any_hits(&self.quantizer, &mut self.tracer, query)
    }

    fn blocked_by(&self, _: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        quantized::blocked_by(&self.quantizer, &self.tracer.image, &self.tracer.spec.formats, tests)
    }

    fn surface_offset_m(&self) -> f64 {
        self.quantizer.surface_offset_m()
    }
}

/// Jobs that a thread traces at once.
const JOBS_AT_ONCE: usize = 16;

impl FunctionalTracer {
    /// A hit a ray, in ray order.
    fn run(&mut self, work: Work<'_>, any_hit: bool) -> Vec<Option<HitWords>> {
        let sum = |a: u64, b: u64| a + b;
        let (spec, image) = (&self.spec, &self.image);
        let trace = |work: Work<'_>| {
            // One piece of a command: its low-resolution cast is a matter of the whole.
            let piece = BoardSpec { partition: piecewise(spec.partition), ..spec.clone() };
            trace_command(&piece, image, work, any_hit)
        };
        let (pieces, n_jobs): (Vec<_>, _) = match work {
            Work::Rays(rays) => {
                let pieces =
                    rays.par_chunks(JOBS_AT_ONCE * MAX_BUNDLE_RAYS).map(|rays| trace(Work::Rays(rays)));
                (pieces.collect(), rays.len().div_ceil(MAX_BUNDLE_RAYS))
            }
            Work::Bundles(bundles) => {
                let pieces = bundles.par_chunks(JOBS_AT_ONCE).map(|bundles| trace(Work::Bundles(bundles)));
                (pieces.collect(), bundles.len())
            }
        };
        let centres = centre_rays(spec, work, n_jobs);
        let low = centres.par_chunks(CENTRE_RAYS_TOGETHER).map(|rays| trace(Work::Rays(rays)));
        let low: Vec<_> = low.collect();
        for (_, work) in &low {
            self.counters = self.counters.combine(&work.as_low_resolution(), sum);
        }
        let mut hits = Vec::new();
        for (answers, work) in pieces {
            hits.extend(answers);
            self.counters = self.counters.combine(&work, sum);
        }
        hits
    }
}

/// The partition without a cast of its own.
fn piecewise(partition: Partition) -> Partition {
    if partition.is_shells() { Partition::Shells } else { partition }
}

impl Tracer for FunctionalTracer {
    fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        Ok(self.run(work, false))
    }

    fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        Ok(self.run(work, true).iter().map(Option::is_some).collect())
    }
}
