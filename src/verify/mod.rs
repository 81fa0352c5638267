//! Board against oracle, bit for bit, and board against software, measured, on the rays that a scene really casts.
//!
//! ```text
//! both passes in software --workload.rs: rays by purpose, thinned--> host rays
//!    host rays --quantize--> words --functional, clocked board | oracle--> mismatches (must be 0)
//!    host rays ------------> software caster ---------------------------> misclassified rays by cause, error of t
//! ```
//! Not modelled: pass 2 methods other than the default.

use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use serde::Serialize;

use crate::image::Difference;
use crate::radiosity::SolveOptions;
use crate::raycast::Purpose;
use crate::render::RenderOptions;

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

/// A ray on which board and oracle differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
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

/// Error of t where board and software name the same patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TError {
    /// Hits compared.
    pub n: u64,
    /// Median of |t error| as a distance, in coordinate steps.
    pub median_steps: f64,
    /// 99th percentile.
    pub p99_steps: f64,
    /// Largest.
    pub max_steps: f64,
    /// Largest ratio of an error to its derived bound; at most 1.
    pub max_of_bound: f64,
}

/// How far a wire was used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WireMargin {
    /// Which wire, as in the width table.
    pub wire: &'static str,
    /// Its width.
    pub bits: u32,
    /// The largest magnitude that it can carry.
    pub max_magnitude: u128,
    /// The largest magnitude seen.
    pub seen: u128,
    /// Upper bits that no test needed.
    pub spare_bits: u32,
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
    /// Against software.
    pub misclassified: Misclassified,
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

    /// No mismatch with the oracle, and no wrong answer of a first test.
    pub fn passed(&self) -> bool {
        self.n_mismatches == 0 && self.first_test.iter().all(|share| share.wrong == 0)
    }
}
