//! Runs vectors: every ray through the clocked board, the functional model and the oracle, every test through the
//! datapath and the oracle, each answer held against the file's.
//!
//! ```text
//! patches --MemoryImage--> Board: nearest-hit rays in one command, any-hit rays in the next -> answers, cycles
//!                          functional::trace, Oracle, per ray (rayon)                        -> answers
//! ```
//! A ray holds when board, functional model and oracle agree, and agree with the file where it expects something.

use rayon::prelude::*;
use rtl_model::board::{Board, BoardError, Work};
use rtl_model::datapath::ray_patch::{intersect, taps};
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::functional::trace_observed;
use rtl_model::memory_image::MemoryImage;
use rtl_model::oracle::{self, Oracle};
use rtl_model::sim::FifoStatistics;
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;

use super::reference::oracle_answer;
use super::{Expected, RayVector, TestVector, Vectors, board_wires};

/// Why vectors could not be run.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The board cannot take them.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// Nothing would be checked.
    #[error("the file holds no rays and no tests: there is nothing to check")]
    Nothing,
}

/// What the vectors' run found.
#[derive(Clone, Debug)]
pub struct Check {
    /// The board, with the file's number formats and, where it has one, its grid.
    pub spec: BoardSpec,
    /// Log2 of the cells a side of its grid.
    pub grid_log2: u32,
    /// What it counted.
    pub statistics: BoardStatistics,
    /// What its queues counted.
    pub links: Vec<FifoStatistics>,
    /// Rays run.
    pub n_rays: u64,
    /// Rays of which the file expects an answer.
    pub n_expected: u64,
    /// Rays that do not hold.
    pub n_rays_wrong: u64,
    /// Single tests run.
    pub n_tests: u64,
    /// Tests that do not hold.
    pub n_tests_wrong: u64,
    /// The first ray that does not hold; without one, the first such test.
    pub first_wrong: Option<Wrong>,
}

impl Check {
    /// Everything holds.
    pub fn passed(&self) -> bool {
        self.n_rays_wrong == 0 && self.n_tests_wrong == 0
    }
}

/// What everyone answers to one ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answers {
    /// What the file expects, if anything.
    pub expected: Option<Expected>,
    /// The clocked board; absent for a single test.
    pub clocked: Option<Expected>,
    /// The datapath without time.
    pub functional: Expected,
    /// The oracle.
    pub oracle: Expected,
}

impl Answers {
    /// All agree.
    pub fn hold(&self) -> bool {
        let same = |answer: Option<Expected>| answer.is_none_or(|a| a == self.oracle);
        self.functional == self.oracle && same(self.clocked) && same(self.expected)
    }
}

/// Something that does not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// A ray.
    Ray {
        /// Its place in the file, from 0.
        place: usize,
        /// The answers.
        answers: Answers,
        /// Patches that any answer names, then those that the functional board tested.
        patches: Vec<PatchWords>,
    },
    /// A single test.
    Test {
        /// Its place in the file, from 0.
        place: usize,
        /// The answers.
        answers: Answers,
    },
}

impl Wrong {
    /// What everyone answers.
    pub fn answers(&self) -> Answers {
        match self {
            Wrong::Ray { answers, .. } | Wrong::Test { answers, .. } => *answers,
        }
    }
}

/// Runs the vectors on a board of `spec`, but with the file's number formats and, where it has one, its grid.
///
/// # Errors
/// No rays and no tests; a board that cannot take these patches.
pub fn check(vectors: &Vectors, spec: &BoardSpec) -> Result<Check, CheckError> {
    if vectors.rays.is_empty() && vectors.tests.is_empty() {
        return Err(CheckError::Nothing);
    }
    let formats = vectors.formats;
    let grid_log2 = vectors.grid_log2.or(spec.grid_log2);
    let spec = BoardSpec { formats, grid_log2, ..spec.clone() }.comparable_by_ray();
    spec.validate().map_err(BoardError::Spec)?;
    let image = MemoryImage::for_board(&spec, &vectors.patches);
    let mut board = Board::new(&spec, image)?;
    let clocked = trace_clocked(&mut board, &vectors.rays)?;
    let image = board.image();
    let oracle = Oracle::new(&formats, &vectors.patches);
    let judge = |(ray, clocked): (&RayVector, &Expected)| Answers {
        expected: ray.expected,
        clocked: Some(*clocked),
        functional: functional(image, ray, |_| ()),
        oracle: oracle_answer(image, &oracle, ray),
    };
    let rays: Vec<Answers> = vectors.rays.par_iter().zip(&clocked).with_min_len(64).map(judge).collect();
    let tests: Vec<(Answers, bool)> = vectors.tests.par_iter().map(|t| judge_test(vectors, t)).collect();
    let first_wrong = rays.iter().position(|a| !a.hold()).map(|place| {
        let (answers, ray) = (rays[place], &vectors.rays[place]);
        Wrong::Ray { place, answers, patches: concerned(vectors, image, ray, &answers) }
    });
    let first_test = tests.iter().position(|(_, holds)| !holds);
    Ok(Check {
        grid_log2: image.grid.log2_cells,
        statistics: board.statistics(),
        links: board.link_statistics(),
        n_rays: rays.len() as u64,
        n_expected: rays.iter().filter(|a| a.expected.is_some()).count() as u64,
        n_rays_wrong: rays.iter().filter(|a| !a.hold()).count() as u64,
        n_tests: tests.len() as u64,
        n_tests_wrong: tests.iter().filter(|(_, holds)| !holds).count() as u64,
        first_wrong: first_wrong
            .or_else(|| first_test.map(|place| Wrong::Test { place, answers: tests[place].0 })),
        spec,
    })
}

/// The clocked board's answers, in the order of the rays.
fn trace_clocked(board: &mut Board, rays: &[RayVector]) -> Result<Vec<Expected>, BoardError> {
    let words_of = |any_hit: bool| -> Vec<RayWords> {
        rays.iter().filter(|r| r.any_hit == any_hit).map(|r| r.words).collect()
    };
    let (near, any) = (words_of(false), words_of(true));
    let mut near = board.trace_nearest(Work::Rays(&near))?.into_iter();
    let mut any = board.trace_any(Work::Rays(&any))?.into_iter();
    // The board answers every ray.
    let answer = |ray: &RayVector| match ray.any_hit {
        true => Expected::Any(any.next().unwrap_or_default()),
        false => Expected::Nearest(near.next().unwrap_or_default()),
    };
    Ok(rays.iter().map(answer).collect())
}

/// The functional model's answer; `tested` sees the patches.
fn functional(image: &MemoryImage, ray: &RayVector, mut tested: impl FnMut(&PatchWords)) -> Expected {
    let hit = trace_observed(image, &ray.words, ray.any_hit, |patch, _| tested(patch)).hit;
    if ray.any_hit { Expected::Any(hit.is_some()) } else { Expected::Nearest(hit) }
}

/// The patches that an answer names, and those that the board tested.
fn concerned(vectors: &Vectors, image: &MemoryImage, ray: &RayVector, answers: &Answers) -> Vec<PatchWords> {
    let all = [answers.expected, answers.clocked, Some(answers.functional), Some(answers.oracle)];
    let ids: Vec<u32> = all.into_iter().flatten().filter_map(|a| a.hit()).map(|hit| hit.patch).collect();
    let mut patches: Vec<PatchWords> =
        vectors.patches.iter().filter(|p| ids.contains(&p.id)).copied().collect();
    functional(image, ray, |patch| {
        if !patches.contains(patch) {
            patches.push(*patch);
        }
    });
    patches
}

impl Expected {
    /// The hit that it names.
    pub fn hit(self) -> Option<HitWords> {
        match self {
            Expected::Nearest(hit) => hit,
            Expected::Any(_) => None,
        }
    }
}

fn judge_test(vectors: &Vectors, test: &TestVector) -> (Answers, bool) {
    let (f, ray) = (&vectors.formats, &vectors.rays[test.ray].words);
    let patch = &vectors.patches[test.patch];
    let answers = Answers {
        expected: Some(Expected::Nearest(test.hit)),
        clocked: None,
        functional: Expected::Nearest(intersect(f, ray, patch)),
        oracle: Expected::Nearest(oracle::intersect(f, ray, patch)),
    };
    let wires = oracle::wires(f, ray, patch);
    let same = wires == test.wires && wires == board_wires(&taps(f, ray, patch));
    (answers, answers.hold() && same)
}

#[cfg(test)]
#[path = "check_tests.rs"]
mod tests;
