//! Board against software: the unquantised caster on the same rays in f64.
//!
//! ```text
//! rays in f64 --SoftwareCaster--> nearest hits --same patch?--> error of t        --else--> cause (causes.rs)
//! ```

use rayon::prelude::*;
use rtl_model::datapath::PatchWords;

use super::causes::{Bounds, Cause};
use super::exact::Answer;
use super::rays::{Rays, VerifiedRay};
use super::{Misclassified, TError, Unexplained};
use crate::geom::Ray;
use crate::raycast::quantize::Quantizer;
use crate::raycast::software::SoftwareCaster;
use crate::raycast::{CastError, CastPatch, Purpose, Query, RayCaster, RayHit};

/// Rays handed to the caster at once.
const RAYS_PER_BATCH: usize = 1 << 16;
/// Rays per unit of work of a thread.
const RAYS_PER_CHUNK: usize = 512;

/// What the comparison showed.
#[derive(Clone, Debug, Default)]
pub(super) struct AgainstSoftware {
    pub misclassified: Misclassified,
    pub first_unexplained: Option<Unexplained>,
    pub t_error: TError,
}

/// What one ray showed.
enum Outcome {
    BothMiss,
    /// Error in coordinate steps, and over its bound.
    SamePatch(f64, f64),
    Differs(Cause),
}

/// Compares the board's nearest hits with software's.
pub(super) fn compare(
    quantizer: &Quantizer,
    patches: &[CastPatch],
    words: &[PatchWords],
    rays: &Rays,
    answers: &[Answer],
) -> Result<AgainstSoftware, CastError> {
    let mut software = SoftwareCaster::new(patches.to_vec());
    let bounds = Bounds::new(quantizer, patches, words);
    let t_step = 0.5_f64.powi(quantizer.formats().t_frac_bits as i32);
    let mut all = AgainstSoftware::default();
    let mut errors = Vec::new();
    let batches = rays.rays.chunks(RAYS_PER_BATCH).zip(answers.chunks(RAYS_PER_BATCH));
    for (number, (rays_of_batch, answers)) in batches.enumerate() {
        let hosts: Vec<Ray> = rays_of_batch.iter().map(|ray| ray.host).collect();
        // The caster does not look at the purpose.
        let hits = software.closest_hits(Purpose::Primary, Query::Rays(&hosts))?;
        let outcomes: Vec<Outcome> = (rays_of_batch, answers, &hits)
            .into_par_iter()
            .with_min_len(RAYS_PER_CHUNK)
            .map(|(ray, answer, hit)| outcome(&bounds, ray, answer, hit.as_ref()))
            .collect();
        for (i, outcome) in outcomes.into_iter().enumerate() {
            let count = &mut all.misclassified;
            match outcome {
                Outcome::BothMiss => {}
                Outcome::SamePatch(error, of_bound) => {
                    errors.push(error);
                    all.t_error.max_of_bound = all.t_error.max_of_bound.max(of_bound);
                }
                Outcome::Differs(Cause::Edge) => count.edge += 1,
                Outcome::Differs(Cause::DepthTie) => count.depth_tie += 1,
                Outcome::Differs(Cause::TStep) => count.t_step += 1,
                Outcome::Differs(Cause::Unexplained) => {
                    count.unexplained += 1;
                    let index = number * RAYS_PER_BATCH + i;
                    let at = rays.groups.partition_point(|g| g.first + g.n <= index);
                    let ray = &rays_of_batch[i];
                    all.first_unexplained.get_or_insert(Unexplained {
                        purpose: rays.groups[at].purpose,
                        index: index as u64,
                        ray: ray.words,
                        board: answers[i].nearest,
                        software: hits[i].map(|hit| (hit.patch, hit.t * ray.t_scale / t_step)),
                    });
                }
            }
        }
    }
    all.t_error.n = errors.len() as u64;
    errors.sort_unstable_by(f64::total_cmp);
    // The smallest value that at least this share of all do not exceed.
    let quantile = |share: f64| {
        let place = (share * errors.len() as f64).ceil() as usize;
        errors.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
    };
    all.t_error.median_steps = quantile(0.5);
    all.t_error.p99_steps = quantile(0.99);
    all.t_error.max_steps = quantile(1.0);
    Ok(all)
}

fn outcome(bounds: &Bounds<'_>, ray: &VerifiedRay, answer: &Answer, software: Option<&RayHit>) -> Outcome {
    let board = answer.nearest.map(|hit| bounds.board(ray, hit));
    let met = software.map(|hit| bounds.software(ray, hit));
    let named = (answer.nearest.map(|hit| hit.patch), software.map(|hit| hit.patch.0));
    match (&board, &met) {
        (None, None) => Outcome::BothMiss,
        (Some(b), Some(s)) if named.0 == named.1 => {
            let (error, of_bound) = bounds.t_error(b, s);
            Outcome::SamePatch(error, of_bound)
        }
        _ => Outcome::Differs(bounds.cause(ray, board.as_ref(), met.as_ref())),
    }
}
