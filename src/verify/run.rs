//! One verification: its parts in order.
//!
//! ```text
//! workload -> rays -> board and oracle: rays, tests, clocked -> board and software -> Verification
//! ```

use rtl_model::board::Board;
use rtl_model::datapath::PatchWords;
use rtl_model::oracle::Oracle;

use super::subject::{Real, Subject};
use super::{PurposeRays, Verification, VerifyOptions, clocked, exact, patch_tests, rays, software};
use crate::raycast::quantize::Quantizer;
use crate::raycast::recording::RecordedGroup;
use crate::raycast::{CastError, CastPatch};
use crate::report::Timings;

/// What is verified: a scene in both worlds and the rays of its workload.
#[derive(Debug)]
pub struct Case<'a> {
    /// The patches as the host has them.
    pub patches: &'a [CastPatch],
    /// From them to words.
    pub quantizer: &'a Quantizer,
    /// The board with the scene in its patch memory.
    pub board: Board,
    /// The rays, by purpose: how many were cast, and the groups to verify.
    pub workload: Vec<(PurposeRays, Vec<RecordedGroup>)>,
}

/// Verifies a workload; `image` of the result is left to the caller. Phases are added to `timings`, `progress` gets the
/// share that is done.
///
/// # Errors
/// [`CastError`] when a ray has no board numbers or the clocked board fails.
pub fn verify(
    case: Case<'_>,
    options: &VerifyOptions,
    timings: &mut Timings,
    progress: &mut dyn FnMut(f64),
) -> Result<Verification, CastError> {
    let image = case.board.image().clone();
    verify_subject(&Real { image: &image }, case, options, timings, progress)
}

/// As [`verify`], of any subject.
pub(super) fn verify_subject(
    subject: &impl Subject,
    case: Case<'_>,
    options: &VerifyOptions,
    timings: &mut Timings,
    progress: &mut dyn FnMut(f64),
) -> Result<Verification, CastError> {
    let Case { patches, quantizer, mut board, workload } = case;
    let image = subject.image();
    let words: Vec<PatchWords> = (0..image.n_patches).map(|i| image.patch(i)).collect();
    let purposes: Vec<PurposeRays> = workload.iter().map(|(rays, _)| *rays).collect();
    let rays = timings.measure("quantise", || rays::quantise(quantizer, workload, subject))?;
    let oracle = timings.measure("oracle's tree", || Oracle::new(quantizer.formats(), &words));
    progress(0.05);
    let (answers, mut found) = timings.measure("rays, board and oracle", || {
        exact::check_rays(subject, &oracle, &rays, &mut |share| progress(0.05 + 0.6 * share))
    });
    let tests = timings.measure("tests, board and oracle", || {
        patch_tests::check_tests(subject, &rays, &answers, &options.first_test_bits)
    });
    found = found.then(tests.found);
    progress(0.8);
    let (n_clocked, clocked) = timings.measure("clocked board", || {
        clocked::check_clocked(subject, &oracle, &mut board, &rays, options.n_clocked)
    })?;
    found = found.then(clocked);
    progress(0.9);
    let against_software =
        timings.measure("software", || software::compare(quantizer, patches, &words, &rays, &answers))?;
    progress(1.0);
    Ok(Verification {
        formats: *quantizer.formats(),
        rays: purposes,
        n_clocked,
        n_wire_tests: tests.n_tests,
        n_mismatches: found.n,
        first_mismatch: found.first,
        oracle_scope: exact::scope(quantizer.formats()),
        misclassified: against_software.misclassified(),
        misclassified_by_purpose: against_software.by_purpose,
        first_unexplained: against_software.first_unexplained,
        t_error: against_software.t_error,
        wires: tests.seen.margins(quantizer.formats()),
        first_test: tests.shares,
        image: None,
    })
}
