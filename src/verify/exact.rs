//! Board against oracle, ray by ray: what the bundle generator makes, the nearest hit, the hit bit.
//!
//! ```text
//! descriptor, i --board | oracle--> words: equal?
//! words --functional::trace | Oracle::nearest--> (t, id, facing): equal?        any-hit rays also: the bit
//! ```

use rayon::prelude::*;
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::oracle::{self, Oracle};

use super::rays::{Group, Rays};
use super::subject::Subject;
use super::{Compared, Mismatch, Model, OracleScope};

/// Groups per unit of work of a thread.
const GROUPS_PER_CHUNK: usize = 64;
/// Parts after each of which progress is told.
const PARTS: usize = 64;

/// The functional board's answer to one ray.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Answer {
    /// The nearest hit.
    pub nearest: Option<HitWords>,
    /// Tests made, in the mode in which the ray was asked.
    pub n_tests: u32,
}

/// Mismatches: their number and the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    pub n: u64,
    pub first: Option<Mismatch>,
}

impl Found {
    /// One more; `make` is called for the first only.
    pub fn note(&mut self, make: impl FnOnce() -> Mismatch) {
        self.n += 1;
        if self.first.is_none() {
            self.first = Some(make());
        }
    }

    /// These, then those.
    pub fn then(self, later: Found) -> Found {
        Found { n: self.n + later.n, first: self.first.or(later.first) }
    }
}

/// Over which patches the oracle's answers are taken.
pub(super) fn scope(formats: &Formats) -> OracleScope {
    if formats.cross_drop() == 0 { OracleScope::AllPatches } else { OracleScope::TestedPatches }
}

/// Board and oracle for one ray in one mode.
#[derive(Clone, Copy, Debug)]
pub(super) struct Both {
    /// The board's hit: the nearest, or for any-hit rays whatever ended them.
    pub board: Option<HitWords>,
    /// The oracle's nearest hit, where it was asked.
    pub oracle: Option<HitWords>,
    /// Tests that the board made.
    pub n_tests: u32,
}

impl Both {
    /// Traces the ray on the board and asks the oracle; of an any-hit ray over all patches not even that.
    pub fn trace(subject: &impl Subject, oracle: &Oracle, ray: &RayWords, any_hit: bool) -> Both {
        let over_tested = scope(oracle.formats()) == OracleScope::TestedPatches;
        let mut tested: Vec<PatchWords> = Vec::new();
        let trace = subject.trace(ray, any_hit, &mut |patch, _| {
            if over_tested {
                tested.push(*patch);
            }
        });
        let oracle = match (over_tested, any_hit) {
            (true, _) => oracle.nearest_of(ray, &tested),
            (false, false) => oracle.nearest(ray),
            (false, true) => None,
        };
        Both { board: trace.hit, oracle, n_tests: trace.tests }
    }
}

/// The oracle's hit bit of a ray: by its own search, or over the patches that the board tested.
fn any_hit_bits(subject: &impl Subject, oracle: &Oracle, ray: &RayWords) -> (Both, bool) {
    let both = Both::trace(subject, oracle, ray, true);
    let bit = match scope(oracle.formats()) {
        OracleScope::AllPatches => oracle.any(ray),
        OracleScope::TestedPatches => both.oracle.is_some(),
    };
    (both, bit)
}

/// Checks every ray; the answers are in their order.
pub(super) fn check_rays(
    subject: &impl Subject,
    oracle: &Oracle,
    rays: &Rays,
    progress: &mut dyn FnMut(f64),
) -> (Vec<Answer>, Found) {
    let mut answers = Vec::with_capacity(rays.rays.len());
    let mut found = Found::default();
    for part in rays.groups.chunks(rays.groups.len().div_ceil(PARTS).max(GROUPS_PER_CHUNK)) {
        let chunks: Vec<(Vec<Answer>, Found)> = part
            .par_chunks(GROUPS_PER_CHUNK)
            .map(|groups| {
                let (mut answers, mut found) = (Vec::new(), Found::default());
                for group in groups {
                    check_group(subject, oracle, rays, group, &mut answers, &mut found);
                }
                (answers, found)
            })
            .collect();
        for (part, of_part) in chunks {
            answers.extend(part);
            found = found.then(of_part);
        }
        progress(answers.len() as f64 / rays.rays.len() as f64);
    }
    (answers, found)
}

/// Checks the rays of a group: of each at most one difference counts, the first.
fn check_group(
    subject: &impl Subject,
    oracle: &Oracle,
    rays: &Rays,
    group: &Group,
    answers: &mut Vec<Answer>,
    found: &mut Found,
) {
    for (i, ray) in rays.of(group).iter().enumerate() {
        let nearest = Both::trace(subject, oracle, &ray.words, false);
        let mut n_tests = nearest.n_tests;
        let mut differs = None;
        if let Some(bundle) = &group.bundle {
            let expected = oracle::bundle::ray(oracle.formats(), bundle, i);
            if expected != ray.words {
                differs = Some((Compared::BundleRay { oracle: expected }, nearest));
            }
        }
        if nearest.board != nearest.oracle {
            differs = differs.or(Some((Compared::NearestHit, nearest)));
        }
        if group.any_hit {
            let (mut both, bit) = any_hit_bits(subject, oracle, &ray.words);
            n_tests = both.n_tests;
            if both.board.is_some() != bit {
                both.oracle = nearest.oracle;
                let compared = Compared::AnyHit { board: both.board.is_some(), oracle: bit };
                differs = differs.or(Some((compared, both)));
            }
        }
        answers.push(Answer { nearest: nearest.board, n_tests });
        if let Some((compared, both)) = differs {
            found.note(|| mismatch(subject, Model::Functional, group, i, ray.words, compared, both));
        }
    }
}

/// A mismatch of ray `i` of a group, with the patches that either answer names and those that the board tested.
pub(super) fn mismatch(
    subject: &impl Subject,
    model: Model,
    group: &Group,
    i: usize,
    ray: RayWords,
    compared: Compared,
    both: Both,
) -> Mismatch {
    let image = subject.image();
    let named = [both.board, both.oracle].into_iter().flatten().map(|hit| hit.patch);
    let named = named.filter(|id| *id < image.n_patches).map(|id| image.patch(id));
    let mut patches: Vec<PatchWords> = named.collect();
    subject.trace(&ray, group.any_hit, &mut |patch, _| patches.push(*patch));
    let mut seen = std::collections::BTreeSet::new();
    patches.retain(|patch| seen.insert(patch.id));
    let index = (group.first + i) as u64;
    Mismatch {
        compared,
        any_hit: group.any_hit,
        model,
        purpose: group.purpose,
        index,
        ray,
        board: both.board,
        oracle: both.oracle,
        patches,
    }
}
