//! Board against oracle, bit for bit, and board against software, measured, on the rays that a scene really casts.
//!
//! ```text
//! both passes in software --workload.rs: rays by purpose, thinned--> host rays
//!    host rays --quantize--> words --functional, clocked board | oracle--> mismatches (must be 0)
//!    host rays ------------> software caster ---------------------------> misclassified rays by cause, error of t
//! ```
//! Board against oracle (`exact.rs`, `tests.rs`): every ray's generated words, nearest hit and hit bit; every wire of a
//! sample of the tests that the board makes; the clocked board on a sample of whole bundles. Board against software
//! (`software.rs`, `causes.rs`): the bounds are derived in `causes.rs`, those of a ray in `rays.rs`.
//!
//! Not modelled: pass 2 methods other than the default.

use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::oracle::WireDifference;
use serde::{Serialize, Serializer};

use crate::image::Difference;
use crate::mesh::PatchId;
use crate::radiosity::SolveOptions;
use crate::raycast::Purpose;
use crate::render::RenderOptions;

mod causes;
mod clocked;
mod exact;
mod margins;
mod patch_tests;
mod rays;
mod run;
mod software;
mod subject;
#[cfg(test)]
mod tests;
mod workload;

pub use run::{Case, verify};
pub use workload::{chosen, quotas};

/// How a scene is verified.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifyOptions {
    /// Rays to verify, shared among the purposes; fewer when the scene casts fewer.
    pub n_rays: u64,
    /// Of these, rays that also go through the clocked board.
    pub n_clocked: u64,
    /// Widths of the dual-precision first test to try.
    pub first_test_bits: Vec<u32>,
    /// Pass 1.
    pub solve: SolveOptions,
    /// The picture whose rays these are, and that is compared.
    pub picture: RenderOptions,
    /// Render the picture through the board's arithmetic too, and compare it with the software one.
    pub compare_image: bool,
}

/// Rays of one purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PurposeRays {
    /// What they are cast for.
    pub purpose: Purpose,
    /// How many the two passes cast.
    pub cast: u64,
    /// How many were verified.
    pub verified: u64,
}

/// Which of the board's two models answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Model {
    /// The datapath without time.
    Functional,
    /// The cycle model.
    Clocked,
}

/// Over which patches the oracle takes the nearest hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum OracleScope {
    /// All patches of the scene, through the oracle's own search: exact geometry leaves nothing to the cells.
    AllPatches,
    /// Those that the board tested: with rounded products a ray may meet a patch outside the cells that list it, so
    /// what the board answers depends on its walk.
    TestedPatches,
}

/// What was compared where board and oracle differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compared {
    /// The ray that the bundle generator made; the oracle's.
    BundleRay {
        /// The oracle's ray.
        oracle: RayWords,
    },
    /// The nearest hit.
    NearestHit,
    /// Whether there is any hit; `Mismatch::board` is then the hit that ended the ray, `oracle` the nearest one.
    AnyHit {
        /// The board's bit.
        board: bool,
        /// The oracle's.
        oracle: bool,
    },
    /// The result of one ray x patch test, with the first of `Mismatch::patches`.
    TestHit,
    /// A wire of one ray x patch test, with the first of `Mismatch::patches`.
    Wire(WireDifference),
}

/// A ray on which board and oracle differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    /// What differs.
    pub compared: Compared,
    /// The ray asked for any hit.
    pub any_hit: bool,
    /// Which model of the board.
    pub model: Model,
    /// What the ray is cast for.
    pub purpose: Purpose,
    /// Its place among the verified rays.
    pub index: u64,
    /// Its words.
    pub ray: RayWords,
    /// The board's answer.
    pub board: Option<HitWords>,
    /// The oracle's.
    pub oracle: Option<HitWords>,
    /// The patches that either named and those that the board tested.
    pub patches: Vec<PatchWords>,
}

/// Rays whose answer differs between board and software, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Misclassified {
    /// The ray passes an edge of the patch within the bound that rounding can move them apart.
    pub edge: u64,
    /// Two patches at one depth, to the rounding of t.
    pub depth_tie: u64,
    /// A hit within rounding of the range's end.
    pub t_step: u64,
    /// None of these: a fault of the board or of software.
    pub unexplained: u64,
}

impl Misclassified {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.edge + self.depth_tie + self.t_step + self.unexplained
    }

    /// These and those.
    pub fn plus(self, other: Misclassified) -> Misclassified {
        Misclassified {
            edge: self.edge + other.edge,
            depth_tie: self.depth_tie + other.depth_tie,
            t_step: self.t_step + other.t_step,
            unexplained: self.unexplained + other.unexplained,
        }
    }
}

/// A ray whose answers differ for no known cause.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unexplained {
    /// What the ray is cast for.
    pub purpose: Purpose,
    /// Its place among the verified rays.
    pub index: u64,
    /// Its words.
    pub ray: RayWords,
    /// The board's answer.
    pub board: Option<HitWords>,
    /// The software caster's: patch, and t in the board's steps.
    pub software: Option<(PatchId, f64)>,
}

/// Error of t where board and software name the same patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TError {
    /// Hits compared.
    pub n: u64,
    /// Of these, hits for whose error a finite bound is derived.
    pub n_bounded: u64,
    /// Median of |t error| as a distance, in coordinate steps; 0 of none.
    pub median_steps: f64,
    /// 99th percentile.
    pub p99_steps: f64,
    /// Largest.
    pub max_steps: f64,
    /// Largest ratio of an error to its derived bound; at most 1; absent where no bound applies.
    pub max_of_bound: Option<f64>,
}

/// How far a wire was used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WireMargin {
    /// Which wire, as in the width table.
    pub wire: &'static str,
    /// Its width.
    pub bits: u32,
    /// One of its bits is a sign.
    pub signed: bool,
    /// The largest magnitude that it can carry; in JSON a decimal string, as it may exceed 2^53.
    #[serde(serialize_with = "decimal")]
    pub max_magnitude: u128,
    /// Its values are looked at; of some wires the datapath tells nothing.
    pub observed: bool,
    /// The largest magnitude seen, in JSON a decimal string; absent where nothing but 0 was seen.
    #[serde(serialize_with = "decimal_or_null")]
    pub seen: Option<u128>,
    /// Upper bits that nothing needed; absent with `seen`.
    pub spare_bits: Option<u32>,
}

fn decimal<S: Serializer>(value: &u128, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

fn decimal_or_null<S: Serializer>(value: &Option<u128>, serializer: S) -> Result<S::Ok, S::Error> {
    match value {
        Some(value) => decimal(value, serializer),
        None => serializer.serialize_none(),
    }
}

/// What a dual-precision first test of some width would do on the same tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct FirstTestShare {
    /// Its width.
    pub bits: u32,
    /// Tests tried.
    pub tests: u64,
    /// Certain misses: exact tests saved.
    pub saved: u64,
    /// Certain to be inside.
    pub inside: u64,
    /// Left to the exact test.
    pub undecided: u64,
    /// Wrong answers of the unit; must be 0.
    pub wrong: u64,
    /// Wrong inside decisions if the narrow words alone decided.
    pub narrow_wrong: u64,
}

/// Everything that was found.
#[derive(Clone, Debug)]
pub struct Verification {
    /// The board's formats.
    pub formats: Formats,
    /// The workload.
    pub rays: Vec<PurposeRays>,
    /// Rays that also went through the clocked board.
    pub n_clocked: u64,
    /// Ray x patch tests whose every wire was compared with the oracle's.
    pub n_wire_tests: u64,
    /// Rays or tests on which board and oracle differ.
    pub n_mismatches: u64,
    /// The first of them.
    pub first_mismatch: Option<Mismatch>,
    /// Over which patches the oracle's answers are taken.
    pub oracle_scope: OracleScope,
    /// Against software.
    pub misclassified: Misclassified,
    /// The same, by purpose, in the order of `rays`.
    pub misclassified_by_purpose: Vec<(Purpose, Misclassified)>,
    /// The first ray for whose difference no cause was found.
    pub first_unexplained: Option<Unexplained>,
    /// Against software.
    pub t_error: TError,
    /// Per wire of the datapath.
    pub wires: Vec<WireMargin>,
    /// Per width of the first test.
    pub first_test: Vec<FirstTestShare>,
    /// Picture through the board's arithmetic against the software picture; absent without camera.
    pub image: Option<Difference>,
}

impl Verification {
    /// Rays verified.
    pub fn n_rays(&self) -> u64 {
        self.rays.iter().map(|r| r.verified).sum()
    }

    /// Something was compared, no mismatch with the oracle, and no wrong answer of a first test.
    pub fn passed(&self) -> bool {
        self.n_rays() > 0 && self.n_mismatches == 0 && self.first_test.iter().all(|share| share.wrong == 0)
    }
}
