//! THE PORT: every ray of the host, from camera to form factor, is answered through [`RayCaster`].
//!
//! ```text
//! renderer, solver --Query: rays or bundles--> trait RayCaster --> software/ | board.rs | functional.rs | null.rs
//!                  <--hits[i] answers ray i---
//! ```

use glam::DVec3;

use crate::geom::Ray;
use crate::mesh::PatchId;

mod bundle;
mod patch;

pub mod board;
pub mod commands;
pub mod functional;
pub mod metered;
pub mod null;
pub mod quantize;
mod quantized;
pub mod recording;
pub mod software;
pub mod transmit;

pub use bundle::{MAX_BUNDLE_RAYS, RayBundle};
pub(crate) use bundle::{cosine_direction, spun_frame};
use patch::bend_m;

/// Geometry of one patch for casters: a triangle, or a quad = two triangles that share the diagonal v0 v2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CastPatch {
    /// Corner positions (m), counter-clockwise seen from the front; the fourth unused by triangles.
    pub corners: [DVec3; 4],
    /// Three corners, not four.
    pub is_triangle: bool,
}

/// A side of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Facing {
    /// The side from which vertices run counter-clockwise.
    Front,
    /// The other side.
    Back,
}

/// The nearest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Ray parameter, in units of the ray's `dir` length.
    pub t: f64,
    /// Which patch (an index into the cast patches).
    pub patch: PatchId,
    /// Which side of it the ray met.
    pub facing: Facing,
}

/// What rays are cast for: reports count rays, tests and cycles by purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// Camera rays.
    Primary,
    /// Visibility of pass 1.
    FormFactor,
    /// Which sources the vertices and the middles of elements see, before pass 2.
    Selection,
    /// Direct light of pass 2.
    Shadow,
    /// Mirror and glass.
    Specular,
    /// `probe` gathers.
    Probe,
    /// Diffuse bounces of path tracing.
    Bounce,
}

/// What a caster is asked: explicit rays, or bundles with a common apex.
#[derive(Clone, Copy, Debug)]
pub enum Query<'a> {
    /// Explicit rays.
    Rays(&'a [Ray]),
    /// Bundles; their rays count in order, bundle after bundle.
    Bundles(&'a [RayBundle]),
}

impl Query<'_> {
    /// How many rays, hence how many answers.
    pub fn n_rays(&self) -> usize {
        match self {
            Query::Rays(rays) => rays.len(),
            Query::Bundles(bundles) => bundles.iter().map(RayBundle::n_rays).sum(),
        }
    }
}

/// Why a caster gave no answer.
#[derive(Debug, thiserror::Error)]
pub enum CastError {
    /// A ray or bundle that no caster can take (zero or non-finite direction, over 64 rays...).
    #[error("ray {index}: {what}")]
    BadRay {
        /// Index of the ray in its query.
        index: usize,
        /// What is wrong, with the value.
        what: String,
    },
    /// The scene or a ray does not fit the board.
    #[error("board: {0}")]
    Board(String),
    /// Who watches the board wants no more of it.
    #[error("{0}")]
    Watcher(String),
}

/// Answers rays. The contract, checked for every backend by one suite (`tests/caster_contract.rs`):
///
/// - `answers.len() == query.n_rays()`, and `answers[i]` answers ray i, whatever the order of the work.
/// - A hit lies in the closed range `t_min <= t <= t_max`; both sides of every patch block.
/// - The nearest hit is the one with the smallest t; equal t goes to the smaller patch id.
/// - `any_hits[i]` is true exactly when `closest_hits` would give `Some` for ray i.
/// - A ray that `blocked_by` names is one that `any_hits` finds blocked.
/// - A bundle answers as its rays would one by one, to the precision of the backend's formats.
/// - Same query, same answers, for any number of threads; no state of earlier queries shows.
/// - No ray leaves a closed room, aimed anywhere, edges and vertices included.
/// - `null` is exempt from finding hits: every ray misses.
pub trait RayCaster {
    /// Name for reports: `software`, `board`, `null`.
    fn name(&self) -> &'static str;

    /// The nearest hit of every ray of `query`.
    ///
    /// # Errors
    /// [`CastError`] when a ray is unusable or the board fails; no partial answers.
    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError>;

    /// Whether anything lies in each ray's range.
    ///
    /// # Errors
    /// As [`RayCaster::closest_hits`].
    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError>;

    /// For each test, a bit for every ray of the bundle that the patch blocks, whatever else there is: [`RayCaster::any_hits`]
    /// would answer true. Bits may be missing; none is ever wrong. Costs the host a test a ray and no cast.
    fn blocked_by(&self, purpose: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64>;

    /// How far (m) a ray's start or end must be lifted off a surface along its normal so that the surface itself
    /// never answers: derived from the backend's number formats.
    fn surface_offset_m(&self) -> f64;
}
