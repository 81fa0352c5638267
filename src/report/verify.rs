//! `verify --report`: what a verification found, once or for every value of a sweep.
//!
//! ```text
//! Verification, step (m) --> Findings: shares, errors of t in steps and metres, words of the first mismatch
//! ```

use rtl_model::datapath::HitWords;
use rtl_model::fixed::Formats;
use rtl_model::spec::BoardSpec;
use serde::Serialize;

use super::si::share;
use super::{SceneFacts, Timings};
use crate::image::Difference;
use crate::vectors::side;
use crate::verify::{
    Compared, FirstTestShare, Misclassified, Mismatch, Model, OracleScope, PurposeRays, TError, Unexplained,
    Verification, VerifyOptions, WireMargin,
};

/// `verify --report`.
#[derive(Clone, Debug, Serialize)]
pub struct VerifyReport {
    /// [`VerifyReport::SCHEMA`].
    pub schema: &'static str,
    /// The scene.
    pub scene: SceneFacts,
    /// The board, resolved; of a sweep the one whose widths are changed.
    pub board: BoardSpec,
    /// How it was verified.
    pub options: VerifyOptions,
    /// No mismatch, no wrong first test, in any run.
    pub passed: bool,
    /// What was found; absent for a sweep.
    #[serde(flatten)]
    pub findings: Option<Findings>,
    /// The sweep.
    pub sweep: Option<SweepReport>,
    /// Wall times.
    pub timings: Timings,
    /// Warnings, as shown.
    pub warnings: Vec<String>,
}

impl VerifyReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/verify/1";
}

/// A parameter tried over a range of values.
#[derive(Clone, Debug, Serialize)]
pub struct SweepReport {
    /// Which one, as in a board file; `frac_bits`: those of coordinates, directions and t together.
    pub parameter: &'static str,
    /// A row a value, in the order of the values.
    pub rows: Vec<SweepRow>,
}

/// One value of a sweep.
#[derive(Clone, Debug, Serialize)]
pub struct SweepRow {
    /// The value.
    pub value: u32,
    /// What was found.
    #[serde(flatten)]
    pub findings: Findings,
}

/// What one verification found.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// The board's formats.
    pub formats: Formats,
    /// One coordinate step (m).
    pub step_m: f64,
    /// The workload by purpose.
    pub rays: Vec<PurposeRays>,
    /// Rays verified.
    pub n_rays: u64,
    /// Of these, rays that also went through the clocked board.
    pub n_clocked: u64,
    /// Ray x patch tests whose every wire was compared.
    pub n_wire_tests: u64,
    /// Rays and tests on which board and oracle differ.
    pub n_mismatches: u64,
    /// Over which patches the oracle's answers are taken.
    pub oracle_scope: OracleScope,
    /// The first mismatch.
    pub first_mismatch: Option<MismatchFacts>,
    /// Rays whose answers differ between board and software, by cause.
    pub misclassified: MisclassifiedFacts,
    /// The same by purpose, in the order of `rays`; shares are of that purpose's rays.
    pub misclassified_by_purpose: Vec<PurposeMisclassified>,
    /// The first of them without a known cause.
    pub first_unexplained: Option<UnexplainedFacts>,
    /// Error of t against software.
    pub t_error: TErrorFacts,
    /// Per wire of the datapath.
    pub wires: Vec<WireMargin>,
    /// Per width of the first test.
    pub first_test: Vec<FirstTestShare>,
    /// Picture through the board's arithmetic against the software picture.
    pub image: Option<Difference>,
}

/// Rays that board and software answer differently.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MisclassifiedFacts {
    /// By cause.
    #[serde(flatten)]
    pub by_cause: Misclassified,
    /// In all.
    pub total: u64,
    /// In all, over the rays verified.
    pub share: f64,
}

impl MisclassifiedFacts {
    fn new(by_cause: Misclassified, n_rays: u64) -> MisclassifiedFacts {
        let total = by_cause.total();
        MisclassifiedFacts { by_cause, total, share: share(total, n_rays) }
    }

    /// The causes with their names.
    pub fn causes(&self) -> [(&'static str, u64); 4] {
        let m = &self.by_cause;
        [("edge", m.edge), ("depth tie", m.depth_tie), ("t step", m.t_step), ("unexplained", m.unexplained)]
    }
}

/// Rays of one purpose that board and software answer differently.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PurposeMisclassified {
    /// What they are cast for.
    pub purpose: crate::raycast::Purpose,
    /// How many.
    #[serde(flatten)]
    pub misclassified: MisclassifiedFacts,
}

/// Error of t as a distance where board and software name the same patch, in coordinate steps and in metres; magnitudes
/// are absent of no hits.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TErrorFacts {
    /// Hits compared.
    pub n: u64,
    /// Of these, hits for whose error a finite bound is derived.
    pub n_bounded: u64,
    /// Median (coordinate steps).
    pub median_steps: Option<f64>,
    /// 99th percentile (coordinate steps).
    pub p99_steps: Option<f64>,
    /// Largest (coordinate steps).
    pub max_steps: Option<f64>,
    /// Median (m).
    pub median_m: Option<f64>,
    /// 99th percentile (m).
    pub p99_m: Option<f64>,
    /// Largest (m).
    pub max_m: Option<f64>,
    /// Largest ratio of an error to its derived bound; absent where no bound applies.
    pub max_of_bound: Option<f64>,
}

impl TErrorFacts {
    fn new(t: &TError, step_m: f64) -> TErrorFacts {
        let of_hits = |steps: f64| (t.n > 0).then_some(steps);
        let [median_steps, p99_steps, max_steps] = [t.median_steps, t.p99_steps, t.max_steps].map(of_hits);
        let in_m = |steps: Option<f64>| steps.map(|steps| steps * step_m);
        TErrorFacts {
            n: t.n,
            n_bounded: t.n_bounded,
            median_steps,
            p99_steps,
            max_steps,
            median_m: in_m(median_steps),
            p99_m: in_m(p99_steps),
            max_m: in_m(max_steps),
            max_of_bound: t.max_of_bound,
        }
    }
}

/// A hit in words.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct HitFacts {
    /// t word.
    pub t: u64,
    /// Patch id.
    pub patch: u32,
    /// `front` or `back`.
    pub side: &'static str,
}

impl From<HitWords> for HitFacts {
    fn from(hit: HitWords) -> HitFacts {
        HitFacts { t: hit.t, patch: hit.patch, side: side(hit.facing) }
    }
}

/// The first mismatch in words.
#[derive(Clone, Debug, Serialize)]
pub struct MismatchFacts {
    /// What differs, in words.
    pub compared: String,
    /// Which model of the board.
    pub model: Model,
    /// What the ray is cast for.
    pub purpose: crate::raycast::Purpose,
    /// Its place among the verified rays.
    pub index: u64,
    /// It asked for any hit.
    pub any_hit: bool,
    /// Origin words.
    pub origin: [i32; 3],
    /// Direction words.
    pub dir: [i32; 3],
    /// t_max word.
    pub t_max: u64,
    /// The board's answer.
    pub board: Option<HitFacts>,
    /// The oracle's.
    pub oracle: Option<HitFacts>,
}

impl MismatchFacts {
    fn new(m: &Mismatch) -> MismatchFacts {
        MismatchFacts {
            compared: describe(&m.compared),
            model: m.model,
            purpose: m.purpose,
            index: m.index,
            any_hit: m.any_hit,
            origin: m.ray.origin,
            dir: m.ray.dir,
            t_max: m.ray.t_max,
            board: m.board.map(HitFacts::from),
            oracle: m.oracle.map(HitFacts::from),
        }
    }
}

/// What differs, as people read it.
pub fn describe(compared: &Compared) -> String {
    match compared {
        Compared::BundleRay { oracle } => {
            format!(
                "the ray that the bundle generator makes; the oracle's is {:?} {:?} {}",
                oracle.origin, oracle.dir, oracle.t_max
            )
        }
        Compared::NearestHit => "the nearest hit".to_owned(),
        Compared::AnyHit { board, oracle } => {
            let answer = |hit: bool| if hit { "hit" } else { "miss" };
            format!("the hit bit: board {}, oracle {}", answer(*board), answer(*oracle))
        }
        Compared::TestHit => "the result of one test".to_owned(),
        Compared::Wire(w) => format!("wire {}: board {}, oracle {}", w.wire, w.board, w.oracle),
    }
}

/// A ray whose answers differ for no known cause.
#[derive(Clone, Debug, Serialize)]
pub struct UnexplainedFacts {
    /// What the ray is cast for.
    pub purpose: crate::raycast::Purpose,
    /// Its place among the verified rays.
    pub index: u64,
    /// Origin words.
    pub origin: [i32; 3],
    /// Direction words.
    pub dir: [i32; 3],
    /// t_max word.
    pub t_max: u64,
    /// The board's answer.
    pub board: Option<HitFacts>,
    /// The patch that the software caster names.
    pub software_patch: Option<u32>,
    /// Its t in the board's steps.
    pub software_t: Option<f64>,
}

impl UnexplainedFacts {
    fn new(u: &Unexplained) -> UnexplainedFacts {
        UnexplainedFacts {
            purpose: u.purpose,
            index: u.index,
            origin: u.ray.origin,
            dir: u.ray.dir,
            t_max: u.ray.t_max,
            board: u.board.map(HitFacts::from),
            software_patch: u.software.map(|(patch, _)| patch.0),
            software_t: u.software.map(|(_, t)| t),
        }
    }
}

impl Findings {
    /// The findings of a verification whose coordinates have steps of `step_m`.
    pub fn new(v: &Verification, step_m: f64) -> Findings {
        let of_purpose = |rays: &PurposeRays| {
            let all = v.misclassified_by_purpose.iter().filter(|(purpose, _)| *purpose == rays.purpose);
            let sum = all.fold(Misclassified::default(), |sum, (_, of)| sum.plus(*of));
            let misclassified = MisclassifiedFacts::new(sum, rays.verified);
            PurposeMisclassified { purpose: rays.purpose, misclassified }
        };
        Findings {
            formats: v.formats,
            step_m,
            rays: v.rays.clone(),
            n_rays: v.n_rays(),
            n_clocked: v.n_clocked,
            n_wire_tests: v.n_wire_tests,
            n_mismatches: v.n_mismatches,
            oracle_scope: v.oracle_scope,
            first_mismatch: v.first_mismatch.as_ref().map(MismatchFacts::new),
            misclassified: MisclassifiedFacts::new(v.misclassified, v.n_rays()),
            misclassified_by_purpose: v.rays.iter().map(of_purpose).collect(),
            first_unexplained: v.first_unexplained.as_ref().map(UnexplainedFacts::new),
            t_error: TErrorFacts::new(&v.t_error, step_m),
            wires: v.wires.clone(),
            first_test: v.first_test.clone(),
            image: v.image,
        }
    }

    /// Wrong answers of the dual-precision unit, all widths.
    pub fn n_first_test_wrong(&self) -> u64 {
        self.first_test.iter().map(|s| s.wrong).sum()
    }

    /// No mismatch, no wrong answer of a first test.
    pub fn passed(&self) -> bool {
        self.n_mismatches == 0 && self.n_first_test_wrong() == 0
    }
}
