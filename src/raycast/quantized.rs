//! What `board` and `functional` share: queries to words, words to a tracer, answers back.
//!
//! ```text
//! Query --quantize.rs--> RayWords | BundleWords --Tracer--> HitWords | bit --quantize.rs--> RayHit | bool
//! ```

use glam::DVec3;
use rayon::prelude::*;
use rtl_model::board::{BoardError, Work};
use rtl_model::datapath::HitWords;
use rtl_model::datapath::bundle::BundleWords;
use rtl_model::datapath::ray_patch::SeenPatch;
use rtl_model::fixed::Formats;
use rtl_model::memory_image::MemoryImage;
use rtl_model::spec::BoardSpec;

use super::quantize::{QuantizedRay, Quantizer};
use super::{CastError, CastPatch, Query, RayBundle, RayHit};
use crate::mesh::PatchId;

/// Answers work in words: the board, or its function without time.
pub(super) trait Tracer {
    /// Nearest hits in ray order.
    fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError>;
    /// Hit bits in ray order.
    fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError>;
}

/// Rays handed to the tracer at once, so that words never take more than a few megabytes.
const RAYS_PER_BATCH: usize = 1 << 16;
/// Bundles handed over at once.
const BUNDLES_PER_BATCH: usize = RAYS_PER_BATCH / super::MAX_BUNDLE_RAYS;

/// The cube of a scene and the patch memory that a board of `spec` holds of it.
pub(super) fn load(
    spec: &BoardSpec,
    patches: &[CastPatch],
    extra_points: &[DVec3],
) -> Result<(Quantizer, MemoryImage), CastError> {
    let quantizer =
        Quantizer::new(&spec.formats, patches, extra_points).map_err(|e| CastError::Board(e.to_string()))?;
    let mut words = Vec::with_capacity(patches.len());
    for (id, patch) in patches.iter().enumerate() {
        let patch = quantizer.patch(id as u32, patch);
        words.push(patch.ok_or_else(|| CastError::Board(format!("patch {id} lies outside the cube")))?);
    }
    let image = MemoryImage::for_board(spec, &words);
    Ok((quantizer, image))
}

/// Checks and quantises the whole query before anything is traced, so that a bad ray costs no cycles.
enum Words {
    Rays(Vec<QuantizedRay>),
    Bundles(Vec<BundleWords>),
}

fn quantize(quantizer: &Quantizer, query: Query<'_>) -> Result<Words, CastError> {
    Ok(match query {
        Query::Rays(rays) => {
            Words::Rays(rays.iter().enumerate().map(|(i, r)| quantizer.ray(i, r)).collect::<Result<_, _>>()?)
        }
        Query::Bundles(bundles) => {
            let mut first = 0;
            let mut words = Vec::with_capacity(bundles.len());
            for bundle in bundles {
                words.push(quantizer.bundle(first, bundle)?);
                first += bundle.n_rays();
            }
            Words::Bundles(words)
        }
    })
}

/// Runs `trace` over the query's words in batches and collects its answers.
fn trace_batches<T>(
    words: &Words,
    mut trace: impl FnMut(Work<'_>) -> Result<Vec<T>, BoardError>,
) -> Result<Vec<T>, CastError> {
    let mut answers = Vec::new();
    let mut take = |work: Work<'_>, n_rays: usize| {
        let part = trace(work).map_err(|e| CastError::Board(e.to_string()))?;
        if part.len() != n_rays {
            return Err(CastError::Board(format!("{} answers to {n_rays} rays", part.len())));
        }
        answers.extend(part);
        Ok(())
    };
    match words {
        Words::Rays(rays) => {
            for batch in rays.chunks(RAYS_PER_BATCH) {
                let batch: Vec<_> = batch.iter().map(|r| r.words).collect();
                take(Work::Rays(&batch), batch.len())?;
            }
        }
        Words::Bundles(bundles) => {
            for batch in bundles.chunks(BUNDLES_PER_BATCH) {
                take(Work::Bundles(batch), batch.iter().map(BundleWords::n_rays).sum())?;
            }
        }
    }
    Ok(answers)
}

/// Shows the commands that a query becomes on the board.
///
/// # Errors
/// As the query's own.
pub(super) fn commands(
    quantizer: &Quantizer,
    query: Query<'_>,
    mut see: impl FnMut(Work<'_>),
) -> Result<(), CastError> {
    let no_answers = |work: Work<'_>| {
        see(work);
        let n_rays = match work {
            Work::Rays(rays) => rays.len(),
            Work::Bundles(bundles) => bundles.iter().map(BundleWords::n_rays).sum(),
        };
        Ok(vec![(); n_rays])
    };
    trace_batches(&quantize(quantizer, query)?, no_answers).map(drop)
}

/// The rays that single patches block, by the datapath itself. Only with full products: else what the board answers depends
/// on the cells that a patch is listed in, too.
pub(super) fn blocked_by(
    quantizer: &Quantizer,
    image: &MemoryImage,
    formats: &Formats,
    tests: &[(&RayBundle, PatchId)],
) -> Vec<u64> {
    if formats.cross_drop() > 0 {
        return vec![0; tests.len()];
    }
    let mask = |(bundle, patch): &(&RayBundle, PatchId)| {
        let Ok(words) = quantizer.bundle(0, bundle) else { return 0 };
        let seen = SeenPatch::new(formats, words.apex(), image.patch_ref(patch.0));
        (0..words.n_rays()).fold(0, |mask, i| {
            let ray = words.ray(formats, i);
            mask | u64::from(seen.test(formats, ray.dir, ray.t_max).is_some()) << i
        })
    };
    tests.par_iter().map(mask).collect()
}

/// The nearest hits of a query.
pub(super) fn closest_hits(
    quantizer: &Quantizer,
    tracer: &mut impl Tracer,
    query: Query<'_>,
) -> Result<Vec<Option<RayHit>>, CastError> {
    let words = quantize(quantizer, query)?;
    let hits = trace_batches(&words, |work| tracer.trace_nearest(work))?;
    Ok(match (query, &words) {
        (Query::Bundles(bundles), Words::Bundles(words)) => {
            let places = bundles
                .iter()
                .zip(words)
                .flat_map(|(bundle, words)| (0..bundle.n_rays()).map(move |i| (bundle, words, i)));
            hits.into_iter()
                .zip(places)
                .map(|(hit, (bundle, words, i))| hit.map(|h| quantizer.bundle_hit(bundle, words, i, h)))
                .collect()
        }
        (_, Words::Rays(rays)) => {
            hits.into_iter().zip(rays).map(|(hit, ray)| hit.map(|h| quantizer.hit(ray, h))).collect()
        }
        (Query::Rays(_), Words::Bundles(_)) => Vec::new(),
    })
}

/// The hit bits of a query.
pub(super) fn any_hits(
    quantizer: &Quantizer,
    tracer: &mut impl Tracer,
    query: Query<'_>,
) -> Result<Vec<bool>, CastError> {
    let words = quantize(quantizer, query)?;
    trace_batches(&words, |work| tracer.trace_any(work))
}
