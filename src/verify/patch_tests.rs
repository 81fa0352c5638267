//! The tests that the board makes, wire by wire: board against oracle, how far each wire was used, and what a narrow
//! first test would have made of them.
//!
//! ```text
//! rays, spread --trace--> (ray, patch, result) --taps | oracle::wires--> every field equal?      --> Seen
//!                                              --first_test, each width--> saved, inside, undecided, wrong
//! ```

use rayon::prelude::*;
use rtl_model::datapath::first_test::{FirstTest, first_test, narrow_inside};
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::oracle;

use super::exact::{Answer, Both, Found, mismatch};
use super::margins::Seen;
use super::rays::{Group, Rays};
use super::subject::Subject;
use super::{Compared, FirstTestShare, Model};
use crate::sampling::mix;

/// Most tests whose wires are compared.
const MAX_TESTS: u64 = 2_000_000;
/// Rays per unit of work of a thread.
const RAYS_PER_CHUNK: usize = 256;

/// What the tests showed.
#[derive(Clone, Debug)]
pub(super) struct Tests {
    pub n_tests: u64,
    pub found: Found,
    pub seen: Seen,
    pub shares: Vec<FirstTestShare>,
}

impl Tests {
    fn new(first_test_bits: &[u32]) -> Tests {
        let share = |&bits| FirstTestShare {
            bits,
            tests: 0,
            saved: 0,
            inside: 0,
            undecided: 0,
            wrong: 0,
            narrow_wrong: 0,
        };
        Tests {
            n_tests: 0,
            found: Found::default(),
            seen: Seen::default(),
            shares: first_test_bits.iter().map(share).collect(),
        }
    }

    fn then(self, later: Tests) -> Tests {
        let mut shares = self.shares;
        for (sum, more) in shares.iter_mut().zip(&later.shares) {
            sum.tests += more.tests;
            sum.saved += more.saved;
            sum.inside += more.inside;
            sum.undecided += more.undecided;
            sum.wrong += more.wrong;
            sum.narrow_wrong += more.narrow_wrong;
        }
        Tests {
            n_tests: self.n_tests + later.n_tests,
            found: self.found.then(later.found),
            seen: self.seen.max(&later.seen),
            shares,
        }
    }
}

/// Checks every test of as many rays, spread over all, as make at most [`MAX_TESTS`] tests.
pub(super) fn check_tests(
    subject: &impl Subject,
    rays: &Rays,
    answers: &[Answer],
    first_test_bits: &[u32],
) -> Tests {
    let parts: Vec<Tests> = sample(answers)
        .par_chunks(RAYS_PER_CHUNK)
        .map(|chunk| {
            let mut tests = Tests::new(first_test_bits);
            for &index in chunk {
                check_ray(subject, rays, index, &mut tests);
            }
            tests
        })
        .collect();
    let mut all = parts.into_iter().fold(Tests::new(first_test_bits), Tests::then);
    for bundle in rays.groups.iter().filter_map(|group| group.bundle.as_ref()) {
        all.seen.bundle(bundle);
    }
    all
}

/// Places of the rays whose tests are checked, ascending.
fn sample(answers: &[Answer]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..answers.len()).collect();
    let total: u64 = answers.iter().map(|a| u64::from(a.n_tests)).sum();
    if total > MAX_TESTS {
        order.sort_by_key(|&i| mix(i as u64));
        let mut n = 0;
        order.retain(|&i| {
            n += u64::from(answers[i].n_tests);
            n <= MAX_TESTS
        });
        order.sort_unstable();
    }
    order
}

fn check_ray(subject: &impl Subject, rays: &Rays, index: usize, tests: &mut Tests) {
    let at = rays.groups.partition_point(|g| g.first + g.n <= index);
    let group = &rays.groups[at];
    let ray = rays.rays[index].words;
    let mut made: Vec<(PatchWords, Option<HitWords>)> = Vec::new();
    let trace = subject.trace(&ray, group.any_hit, &mut |patch, hit| made.push((*patch, hit)));
    tests.seen.cells(subject.image(), &ray, &trace);
    for (patch, hit) in made {
        tests.n_tests += 1;
        check_test(subject, group, index, &ray, &patch, hit, tests);
    }
}

fn check_test(
    subject: &impl Subject,
    group: &Group,
    index: usize,
    ray: &RayWords,
    patch: &PatchWords,
    hit: Option<HitWords>,
    tests: &mut Tests,
) {
    let formats = &subject.image().formats;
    let taps = subject.taps(ray, patch);
    tests.seen.test(ray, patch, &taps, hit);
    let expected = oracle::intersect(formats, ray, patch);
    let differs = match oracle::wires(formats, ray, patch).difference(&taps) {
        Some(wire) => Some(Compared::Wire(wire)),
        None => (hit != expected).then_some(Compared::TestHit),
    };
    if let Some(compared) = differs {
        let both = Both { board: hit, oracle: expected, n_tests: 1 };
        tests.found.note(|| {
            let mut found =
                mismatch(subject, Model::Functional, group, index - group.first, *ray, compared, both);
            found.patches.retain(|p| p.id != patch.id);
            found.patches.insert(0, *patch);
            found
        });
    }
    let inside = taps.triangles.iter().flatten().any(|triangle| triangle.inside);
    for share in &mut tests.shares {
        let first = first_test(formats, share.bits, ray, patch);
        share.tests += 1;
        match first {
            FirstTest::Miss => share.saved += 1,
            FirstTest::Inside => share.inside += 1,
            FirstTest::Undecided => share.undecided += 1,
        }
        // The exact test follows either way, so a wrong `Inside` would show nowhere else.
        let wrong = subject.dual_precision(share.bits, ray, patch) != hit;
        share.wrong += u64::from(wrong || (first == FirstTest::Inside && !inside));
        share.narrow_wrong += u64::from(narrow_inside(formats, share.bits, ray, patch) != inside);
    }
}
