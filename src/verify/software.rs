//! Board against software: the unquantised caster on the same rays in f64.
//!
//! ```text
//! rays in f64 --SoftwareCaster--> nearest hits --same patch?--> error of t        --else--> cause (causes.rs)
//! ```

use rayon::prelude::*;
use rtl_model::datapath::PatchWords;

use super::causes::{Bounds, Cause, larger};
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
    /// In the order of the purposes.
    pub by_purpose: Vec<(Purpose, Misclassified)>,
    pub first_unexplained: Option<Unexplained>,
    pub t_error: TError,
}

impl AgainstSoftware {
    /// Over all purposes.
    pub fn misclassified(&self) -> Misclassified {
        self.by_purpose.iter().fold(Misclassified::default(), |sum, (_, of)| sum.plus(*of))
    }

    fn count(&mut self, purpose: Purpose) -> &mut Misclassified {
        let at = match self.by_purpose.iter().position(|(p, _)| *p == purpose) {
            Some(at) => at,
            None => {
                self.by_purpose.push((purpose, Misclassified::default()));
                self.by_purpose.len() - 1
            }
        };
        &mut self.by_purpose[at].1
    }
}

impl TError {
    /// One more hit, whose error is this part of its bound if that is finite.
    fn count_bounded(&mut self, of_bound: Option<f64>) {
        let Some(of_bound) = of_bound else { return };
        self.n_bounded += 1;
        self.max_of_bound = Some(self.max_of_bound.map_or(of_bound, |largest| larger(largest, of_bound)));
    }
}

/// What one ray showed.
enum Outcome {
    BothMiss,
    /// Error in coordinate steps, and over its bound if that is finite.
    SamePatch(f64, Option<f64>),
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
            let index = number * RAYS_PER_BATCH + i;
            let purpose = rays.groups[rays.groups.partition_point(|g| g.first + g.n <= index)].purpose;
            let count = all.count(purpose);
            match outcome {
                Outcome::BothMiss => {}
                Outcome::SamePatch(error, of_bound) => {
                    errors.push(error);
                    all.t_error.count_bounded(of_bound);
                }
                Outcome::Differs(Cause::Edge) => count.edge += 1,
                Outcome::Differs(Cause::DepthTie) => count.depth_tie += 1,
                Outcome::Differs(Cause::TStep) => count.t_step += 1,
                Outcome::Differs(Cause::Unexplained) => {
                    count.unexplained += 1;
                    let ray = &rays_of_batch[i];
                    all.first_unexplained.get_or_insert(Unexplained {
                        purpose,
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
    all.t_error.median_steps = quantile(&errors, 0.5);
    all.t_error.p99_steps = quantile(&errors, 0.99);
    all.t_error.max_steps = quantile(&errors, 1.0);
    Ok(all)
}

/// The smallest of ascending values that at least this share of them do not exceed; 0 of none.
fn quantile(ascending: &[f64], share: f64) -> f64 {
    let place = (share * ascending.len() as f64).ceil() as usize;
    ascending.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn max_of_bound_of_hits_counts_those_with_a_bound_and_keeps_what_is_no_number() {
        let of = |hits: &[Option<f64>]| {
            let mut t = TError::default();
            hits.iter().for_each(|hit| t.count_bounded(*hit));
            (t.n_bounded, t.max_of_bound)
        };
        assert_eq!(of(&[]), (0, None));
        assert_eq!(of(&[None, None]), (0, None));
        assert_eq!(of(&[None, Some(0.0)]), (1, Some(0.0)));
        assert_eq!(of(&[Some(0.25), None, Some(0.75), Some(0.5)]), (3, Some(0.75)));
        for place in 0..3 {
            let mut hits = [Some(0.25); 3];
            hits[place] = Some(f64::NAN);
            assert!(of(&hits).1.is_some_and(f64::is_nan), "{place}");
        }
    }

    #[test]
    fn quantile_of_known_values_is_the_smallest_that_covers_the_share() {
        let values: Vec<f64> = (1..=200).map(f64::from).collect();
        assert_eq!([0.5, 0.99, 1.0].map(|share| quantile(&values, share)), [100.0, 198.0, 200.0]);
        assert_eq!(quantile(&[3.0], 0.5), 3.0);
        assert_eq!(quantile(&[], 0.5), 0.0);
    }
}
