//! Recorded groups as rays in both worlds: f64 and words, and how far apart rounding can put the two.
//!
//! ```text
//! RecordedGroup --quantize.rs, the board's generator--> words        --as the descriptor's fields say--> Ray in f64
//! ```
//! The ray in f64 is the host's, with two exceptions: places in strata have 12 bits in a fan's descriptor and 6 in a
//! hemisphere's, and a hemisphere's directions come from a table of 64 x 64. Both are fields of the descriptor that move a ray by more than
//! coordinates and directions are rounded; the f64 ray takes the descriptor's places, and its points and directions as
//! the host has them. Then, with u_F, u_D as in `raycast/quantize.rs` and 2^s the scale of the ray's direction (raw
//! direction = words 2^-D 2^s), at the board's parameter t the two rays are at most u_F + `slope` t apart, and their
//! directions (board's length) `stretch`:
//!
//! | kind | slope | stretch | why |
//! |---|---|---|---|
//! | explicit | u_D | u_D | direction rounded once |
//! | tile | u_D (1 + (1 + i + j) 2^(-8-s)) | the same | corner and steps have 8 bits more, i + j steps are added |
//! | hemisphere | u_D (1 + 2 (sqrt 3 + 2^-D) 2^-s) | the same | table and frame rounded: sums of three products of unit vectors |
//! | targets | u_D | u_D + 2 u_F 2^-s | apex and point move by u_F; between them the line moves no farther |
//! | fan | u_D + 3 u_F 2^-s | u_D + 5 u_F 2^-s | the sample moves by 4 u_F, see `quantize.rs` |
//! | targets one step away | as fan | as fan | the point may have been moved off the apex's word |
//!
//! Not modelled: f64's own rounding, which [`super::causes`] adds.

use glam::DVec3;
use rayon::prelude::*;
use rtl_model::datapath::RayWords;
use rtl_model::datapath::bundle::{BundleWords, HEMISPHERE_LOG2, STEP_GUARD_BITS};

use super::PurposeRays;
use super::subject::Subject;
use crate::geom::Ray;
use crate::raycast::quantize::{Quantizer, as_described};
use crate::raycast::recording::{GroupRays, RecordedGroup};
use crate::raycast::{CastError, Purpose, RayBundle, cosine_direction, spun_frame};

/// The rays to verify, group after group.
#[derive(Clone, Debug, Default)]
pub(super) struct Rays {
    pub rays: Vec<VerifiedRay>,
    pub groups: Vec<Group>,
}

/// Rays that go down together.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub purpose: Purpose,
    pub any_hit: bool,
    /// Place of its first ray.
    pub first: usize,
    /// How many of its rays are verified.
    pub n: usize,
    /// Its descriptor, with all its rays; explicit rays have none.
    pub bundle: Option<BundleWords>,
}

/// A ray in both worlds.
#[derive(Clone, Copy, Debug)]
pub(super) struct VerifiedRay {
    /// In f64 (m).
    pub host: Ray,
    /// On the board.
    pub words: RayWords,
    /// The board's t of one host t: a power of two.
    pub t_scale: f64,
    /// Growth of the distance between the two rays, half cubes per board t.
    pub slope: f64,
    /// Distance between their directions, half cubes per board t.
    pub stretch: f64,
}

impl Rays {
    /// A group's rays.
    pub fn of(&self, group: &Group) -> &[VerifiedRay] {
        &self.rays[group.first..group.first + group.n]
    }
}

/// Quantises every group; bundles are expanded by `subject`.
pub(super) fn quantise(
    quantizer: &Quantizer,
    workload: Vec<(PurposeRays, Vec<RecordedGroup>)>,
    subject: &impl Subject,
) -> Result<Rays, CastError> {
    let recorded: Vec<(Purpose, RecordedGroup)> = workload
        .into_iter()
        .flat_map(|(rays, groups)| groups.into_iter().map(move |group| (rays.purpose, group)))
        .collect();
    type Quantised = (Vec<VerifiedRay>, Option<BundleWords>);
    let parts: Vec<Quantised> = recorded
        .par_iter()
        .with_min_len(32)
        .map(|(_, group)| quantise_group(quantizer, group, subject))
        .collect::<Result<_, CastError>>()?;
    let mut all = Rays::default();
    for ((purpose, group), (rays, bundle)) in recorded.iter().zip(parts) {
        let (first, n) = (all.rays.len(), rays.len());
        all.groups.push(Group { purpose: *purpose, any_hit: group.any_hit, first, n, bundle });
        all.rays.extend(rays);
    }
    Ok(all)
}

fn quantise_group(
    quantizer: &Quantizer,
    group: &RecordedGroup,
    subject: &impl Subject,
) -> Result<(Vec<VerifiedRay>, Option<BundleWords>), CastError> {
    let formats = quantizer.formats();
    let u_f = unit_error(formats.coord_frac_bits);
    let u_d = unit_error(formats.dir_frac_bits);
    match &group.rays {
        GroupRays::Explicit(rays) => {
            let quantised = |(index, host): (usize, &Ray)| {
                let words = quantizer.ray(index, host)?.words;
                Ok(verified(quantizer, *host, words, u_d, u_d))
            };
            let rays = rays.iter().take(group.take).enumerate().map(quantised);
            Ok((rays.collect::<Result<_, CastError>>()?, None))
        }
        GroupRays::Bundle(bundle) => {
            let descriptor = quantizer.bundle(0, bundle)?;
            let described = as_described(bundle);
            let quantised = |i: usize| {
                let words = subject.expand(&descriptor, i);
                let scale = descriptor.scaled_ray(formats, i).1;
                let per_raw = 0.5_f64.powi(scale);
                // L = 1: the raw direction is one step long.
                let one_step = 1 - formats.coord_frac_bits as i32;
                let (slope, stretch) = match &descriptor {
                    BundleWords::Tile { n, .. } => {
                        let steps = 1 + i as u32 % n + i as u32 / n;
                        let steps = f64::from(steps) * 0.5_f64.powi(STEP_GUARD_BITS as i32);
                        (u_d * (1.0 + steps * per_raw), u_d * (1.0 + steps * per_raw))
                    }
                    BundleWords::Hemisphere { .. } => {
                        let sums = 2.0 * (3f64.sqrt() + 0.5_f64.powi(formats.dir_frac_bits as i32));
                        (u_d * (1.0 + sums * per_raw), u_d * (1.0 + sums * per_raw))
                    }
                    BundleWords::Targets { .. } if scale != one_step => (u_d, u_d + 2.0 * u_f * per_raw),
                    BundleWords::Targets { .. } | BundleWords::Fan { .. } => {
                        (u_d + 3.0 * u_f * per_raw, u_d + 5.0 * u_f * per_raw)
                    }
                };
                let mut ray = verified(quantizer, ray_of(&described, i), words, slope, stretch);
                // Raw directions to points have the host's length, and short ones are not just rounded.
                if matches!(descriptor, BundleWords::Targets { .. } | BundleWords::Fan { .. }) {
                    ray.t_scale = 2f64.powi(scale);
                }
                ray
            };
            Ok(((0..group.take).map(quantised).collect(), Some(descriptor)))
        }
    }
}

fn verified(quantizer: &Quantizer, host: Ray, words: RayWords, slope: f64, stretch: f64) -> VerifiedRay {
    // Both lengths are of one direction, up to a power of two and rounding far under a factor of sqrt 2.
    let length = board_length(words.dir, quantizer.formats().dir_frac_bits);
    let t_scale = (host.dir.length() / (quantizer.half_m() * length)).log2().round().exp2();
    VerifiedRay { host, words, t_scale, slope, stretch }
}

/// Length of the board's direction, half cubes per board t.
pub(super) fn board_length(dir: [i32; 3], dir_frac_bits: u32) -> f64 {
    DVec3::from_array(dir.map(f64::from)).length() * 0.5_f64.powi(dir_frac_bits as i32)
}

/// sqrt(3)/2 2^-bits: the largest distance from a point to its word, in half cubes.
pub(super) fn unit_error(bits: u32) -> f64 {
    0.5 * 3f64.sqrt() * 0.5_f64.powi(bits as i32)
}

/// Ray `i` in f64; of a hemisphere, along the table's entry.
fn ray_of(described: &RayBundle, i: usize) -> Ray {
    let RayBundle::Hemisphere { apex, normal, spin, n, m, jitter } = described else {
        return described.ray(i);
    };
    let side = f64::from(1u32 << HEMISPHERE_LOG2);
    // Entries stand at k/64, that of a place at or just below it; entry 0 at 1/128.
    let entry = |k: u32, jitter: f64, n: u32| {
        let place = (f64::from(k) + jitter) * side / f64::from(n);
        place.floor().max(0.5) / side
    };
    let d = cosine_direction(entry(i as u32 % n, jitter[0], *n), entry(i as u32 / n, jitter[1], *m));
    let (t1, t2) = spun_frame(*normal, *spin);
    Ray::unbounded(*apex, d.x * t1 + d.y * t2 + d.z * *normal)
}
