//! The board without time: its arithmetic on all threads of the host. Same answers as `board`, no cycles.
//!
//! ```text
//! Query --quantized.rs--> words --rtl_model::functional::trace per ray (rayon)--> hits, canonical counters
//! ```

use glam::DVec3;
use rayon::prelude::*;
use rtl_model::board::{BoardError, Work};
use rtl_model::datapath::{HitWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::functional::{CanonicalCounters, RayTrace, trace};
use rtl_model::memory_image::MemoryImage;

use super::quantize::Quantizer;
use super::quantized::{self, Tracer};
use super::{CastError, CastPatch, Purpose, Query, RayCaster, RayHit};

/// Casts rays with the board's arithmetic, not its clock.
#[derive(Debug)]
pub struct FunctionalCaster {
    quantizer: Quantizer,
    tracer: FunctionalTracer,
}

#[derive(Debug)]
struct FunctionalTracer {
    image: MemoryImage,
    counters: CanonicalCounters,
}

impl FunctionalCaster {
    /// Quantises the scene and builds its patch memory. `extra_points` (m): camera, lights, probes.
    ///
    /// # Errors
    /// [`CastError::Board`] when the scene has no board numbers.
    pub fn new(
        formats: &Formats,
        grid_log2: Option<u32>,
        patches: &[CastPatch],
        extra_points: &[DVec3],
    ) -> Result<FunctionalCaster, CastError> {
        Self::new_within(formats, grid_log2, patches, extra_points, u64::MAX)
    }

    /// As [`FunctionalCaster::new`], with the grid that a board with `max_bytes` of patch memory gets: its very image.
    ///
    /// # Errors
    /// [`CastError::Board`] when the scene has no board numbers.
    pub fn new_within(
        formats: &Formats,
        grid_log2: Option<u32>,
        patches: &[CastPatch],
        extra_points: &[DVec3],
        max_bytes: u64,
    ) -> Result<FunctionalCaster, CastError> {
        let (quantizer, image) = quantized::load(formats, grid_log2, patches, extra_points, max_bytes)?;
        let tracer = FunctionalTracer { image, counters: CanonicalCounters::default() };
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

    fn surface_offset_m(&self) -> f64 {
        self.quantizer.surface_offset_m()
    }
}

impl FunctionalTracer {
    fn run(&mut self, work: Work<'_>, any_hit: bool) -> Vec<RayTrace> {
        let image = &self.image;
        let one = |ray: &RayWords| trace(image, ray, any_hit);
        let traces: Vec<RayTrace> = match work {
            Work::Rays(rays) => rays.par_iter().with_min_len(64).map(one).collect(),
            Work::Bundles(bundles) => {
                self.counters.bundles += bundles.len() as u64;
                let formats = &image.formats;
                let rays: Vec<RayWords> =
                    bundles.iter().flat_map(|b| (0..b.n_rays()).map(move |i| b.ray(formats, i))).collect();
                rays.par_iter().with_min_len(64).map(one).collect()
            }
        };
        traces.iter().for_each(|t| self.counters.count(t));
        traces
    }
}

impl Tracer for FunctionalTracer {
    fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        Ok(self.run(work, false).into_iter().map(|t| t.hit).collect())
    }

    fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        Ok(self.run(work, true).into_iter().map(|t| t.hit.is_some()).collect())
    }
}
