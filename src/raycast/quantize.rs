//! Floats to board numbers and back: the only place where they meet.
//!
//! ```text
//! points, patches (m) --shift by a multiple of the step, scale by a power of two--> coordinate words
//! dir (m per t)       --scale by a power of two, largest |component| in [1/2, 1)--> direction words, 2^j
//! t_max (host t)      --times 2^j (exact), to nearest-----------------------------> t word
//! t word x |direction words| x half cube (m) / |host dir| ------------------------> host t, at most t_max
//! ```
//! Coordinates: the cube [-1, 1)^3 has half side `half_m` (a power of two, metres) and centre `center` (a multiple
//! of the step half_m 2^-F), with |center|/step + 2^F < 2^53: so every word is an exact f64 point. All rounding is
//! to nearest, ties to even. Rounding of t_max is monotone with the board's rounding of t: a surface at or before
//! the host's t_max always counts, one up to a step of t behind it may; the host's t is cut to t_max.
//!
//! # The surface offset
//! In half cubes, with u_F = sqrt(3)/2 2^-F the largest distance from a point to its word, u_D and u_T alike:
//!
//! | what moves | by at most |
//! |---|---|
//! | a lifted origin | u_F |
//! | every point of a quantised patch (a convex mean of its corners) | u_F |
//! | a ray at t <= 4, by the rounding of its direction | 4 u_D |
//! | a sample of a fan: three rounded corners with weights of sum |w| <= 3, rounded once | 4 u_F |
//! | the end of a ray, by the rounding of t_max and of t, half a step each, |d| <= sqrt(3) | 2 u_T |
//!
//! A ray that leaves a surface upward from height h meets no point of its quantised patch when h > 2 u_F + 4 u_D;
//! one that ends at height h over the surface that it arrives at, when h > 5 u_F + 4 u_D + 2 u_T. The offset is
//! that last sum with 6 u_F, so that the closed range is left strictly, times half_m, plus the bend of quads
//! (points lie on their bilinear surface, patches are two triangles). A lifted point stays on its side of every
//! other surface that is farther than the offset + 2 u_F: so nothing leaks through a wall thicker than
//! [`Quantizer::wall_thickness_m`] = twice the offset.

use fixed::FixedI32;
use fixed::types::extra::U24;
use glam::DVec3;
use rtl_model::datapath::bundle::{BundleError, BundleWords, HEMISPHERE_LOG2, JITTER_BITS, STEP_GUARD_BITS};
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::{FormatError, Formats};

use super::bundle::{check_bundle, spun_frame};
use super::{CastError, CastPatch, Facing, RayBundle, RayHit, bend_m, bundle::check_ray};
use crate::geom::{Aabb, Ray};
use crate::mesh::PatchId;

/// A coordinate of the default format: sign, 24 fraction bits, in half cubes (the integer bits stay empty).
pub type CoordWord = FixedI32<U24>;
/// A direction component of the default format.
pub type DirWord = FixedI32<U24>;

/// Why a scene or a ray has no board numbers.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QuantizeError {
    /// A format outside its range.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Nothing to put into the cube.
    #[error("no patches and no points: the board's cube has no size")]
    Empty,
    /// A point that is not finite.
    #[error("{what} {index} is not finite: {point}")]
    NotFinite {
        /// `patch` or `point`.
        what: &'static str,
        /// Which.
        index: usize,
        /// Its value (m).
        point: DVec3,
    },
    /// The scene is so far from the origin that words are no exact f64 points.
    #[error(
        "the scene's centre is {center_steps:.0} steps of {step_m:e} m from the origin; with the cube that is over 2^53: move the scene toward the origin or take fewer coordinate bits"
    )]
    TooFar {
        /// Largest |coordinate| of the centre, in steps.
        center_steps: f64,
        /// The step (m).
        step_m: f64,
    },
    /// More patches than ids.
    #[error("{count} patches; ids of the board go up to {limit}")]
    TooManyPatches {
        /// How many.
        count: usize,
        /// The largest count.
        limit: usize,
    },
    /// The rounding of the formats is as coarse as the scene.
    #[error(
        "the formats' surface offset is {offset} of half the cube; at most 1/4 can be lifted off surfaces"
    )]
    Coarse {
        /// Offset over half the cube side.
        offset: f64,
    },
}

/// Most patches: ids have 28 bits.
const MAX_PATCHES: usize = 1 << 28;

/// The map between scene space (m) and the board's words.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantizer {
    formats: Formats,
    center: DVec3,
    half_m: f64,
    surface_offset_m: f64,
}

/// A ray as the board gets it, and what turns its t back into the host's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuantizedRay {
    /// The words.
    pub words: RayWords,
    /// Host t per t step (units of the host ray's dir length).
    pub host_t_per_step: f64,
    /// The host's t_max.
    pub t_max: f64,
}

impl Quantizer {
    /// The cube around patches and `extra_points` (camera, lights, probes), with room for points lifted off them.
    ///
    /// # Errors
    /// Formats outside their range, an empty or non-finite scene, one too far from the origin.
    pub fn new(
        formats: &Formats,
        patches: &[CastPatch],
        extra_points: &[DVec3],
    ) -> Result<Quantizer, QuantizeError> {
        formats.validate()?;
        if patches.len() > MAX_PATCHES {
            return Err(QuantizeError::TooManyPatches { count: patches.len(), limit: MAX_PATCHES });
        }
        let corners = patches.iter().enumerate().flat_map(|(index, p)| {
            p.corners[..if p.is_triangle { 3 } else { 4 }].iter().map(move |&c| ("patch", index, c))
        });
        let extra = extra_points.iter().enumerate().map(|(index, &p)| ("point", index, p));
        let mut bounds = Aabb::EMPTY;
        for (what, index, point) in corners.chain(extra) {
            if !point.is_finite() {
                return Err(QuantizeError::NotFinite { what, index, point });
            }
            bounds = Aabb { min: bounds.min.min(point), max: bounds.max.max(point) };
        }
        if bounds.is_empty() {
            return Err(QuantizeError::Empty);
        }
        let offset = offset_in_half_cubes(formats);
        if offset > 0.25 {
            return Err(QuantizeError::Coarse { offset });
        }
        // Room for a lift along an axis, for the centre's own rounding and for the missing word 2^F.
        let coord_step = power_of_two(-to_i32(formats.coord_frac_bits));
        let usable = 1.0 - offset - 2.0 * coord_step;
        let bend = bend_m(patches);
        let half_extent = (0.5 * bounds.size().max_element() + bend).max(1e-30);
        let mut exponent = exponent_above(half_extent);
        // The smallest power of two in which the extent fits; one down and up covers the estimate's edge.
        exponent -= 1;
        while half_extent > usable * power_of_two(exponent) {
            exponent += 1;
        }
        let half_m = power_of_two(exponent);
        let step_m = half_m * coord_step;
        let center_steps = (0.5 * (bounds.min + bounds.max) / step_m).round();
        let largest = center_steps.abs().max_element();
        if largest + power_of_two(to_i32(formats.coord_frac_bits)) >= power_of_two(53) {
            return Err(QuantizeError::TooFar { center_steps: largest, step_m });
        }
        Ok(Quantizer {
            formats: *formats,
            center: center_steps * step_m,
            half_m,
            surface_offset_m: offset * half_m + bend,
        })
    }

    /// The formats of the words.
    pub fn formats(&self) -> &Formats {
        &self.formats
    }

    /// Centre of the cube (m), a multiple of the step.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Half the side of the cube (m), a power of two.
    pub fn half_m(&self) -> f64 {
        self.half_m
    }

    /// How far (m) to lift points off surfaces; see the module's derivation.
    pub fn surface_offset_m(&self) -> f64 {
        self.surface_offset_m
    }

    /// Walls at least this thick (m) never leak: a lifted point cannot come to lie behind them.
    pub fn wall_thickness_m(&self) -> f64 {
        2.0 * self.surface_offset_m
    }

    /// The words of a point; `None` outside the cube.
    pub fn point(&self, point: DVec3) -> Option<[i32; 3]> {
        let unit = (point - self.center) / self.half_m;
        let limit = 1i32 << self.formats.coord_frac_bits;
        let mut words = [0; 3];
        for (word, x) in words.iter_mut().zip(unit.to_array()) {
            *word = coordinate_word(x, self.formats.coord_frac_bits)?;
            if *word < -limit || *word >= limit {
                return None;
            }
        }
        Some(words)
    }

    /// The point (m) that words stand for, exactly.
    pub fn dequantize(&self, words: [i32; 3]) -> DVec3 {
        let step_m = self.half_m * power_of_two(-to_i32(self.formats.coord_frac_bits));
        DVec3::from_array(words.map(f64::from)) * step_m + self.center
    }

    /// The words of a patch of the scene that the cube was made for; `None` for one outside it.
    pub fn patch(&self, id: u32, patch: &CastPatch) -> Option<PatchWords> {
        let corner = |i: usize| self.point(patch.corners[i]);
        let third = corner(2)?;
        let fourth = if patch.is_triangle { third } else { corner(3)? };
        Some(PatchWords {
            corners: [corner(0)?, corner(1)?, third, fourth],
            is_triangle: patch.is_triangle,
            id,
        })
    }

    /// Ray `index` of a query in words.
    ///
    /// # Errors
    /// [`CastError::BadRay`]: not finite, no direction, `t_min != 0`, an origin outside the cube.
    pub fn ray(&self, index: usize, ray: &Ray) -> Result<QuantizedRay, CastError> {
        check_ray(index, ray)?;
        if ray.t_min != 0.0 {
            let what = format!("t_min is {}; the board takes 0 only: move the origin", ray.t_min);
            return Err(CastError::BadRay { index, what });
        }
        if ray.t_max < 0.0 {
            let what = format!("t_max is {}; the board takes 0 and more", ray.t_max);
            return Err(CastError::BadRay { index, what });
        }
        let origin = self.point_of_ray(index, "origin", ray.origin)?;
        let (dir, exponent) = direction_words(ray.dir / self.half_m, self.formats.dir_frac_bits);
        // host dir / half = words 2^-D 2^exponent, so board t = host t 2^exponent, exactly.
        let limit = self.formats.t_limit();
        let steps = ray.t_max * power_of_two(exponent + to_i32(self.formats.t_frac_bits));
        let t_max = if steps >= limit as f64 { limit } else { steps.round_ties_even() as u64 };
        let words = RayWords { origin, dir, t_max };
        Ok(QuantizedRay { words, host_t_per_step: self.host_t_per_step(dir, ray.dir), t_max: ray.t_max })
    }

    /// A bundle whose first ray has `index` in its query, in words.
    ///
    /// # Errors
    /// [`CastError::BadRay`] as for rays, and for targets or fan corners outside the cube, with the ray's index. Targets
    /// and samples that fall on the apex's word are no errors: they become rays of one step.
    pub fn bundle(&self, index: usize, bundle: &RayBundle) -> Result<BundleWords, CastError> {
        check_bundle(index, bundle)?;
        let apex = self.point_of_ray(index, "apex", bundle.apex())?;
        let words = match bundle {
            RayBundle::Tile { corner, step_u, step_v, n, m, .. } => {
                let (corner, step_u, step_v) = self.tile_words(*corner, *step_u, *step_v, *n, *m);
                BundleWords::Tile { apex, corner, step_u, step_v, n: *n, m: *m }
            }
            RayBundle::Fan { corner, edge_u, edge_v, n, m, jitter, .. } => {
                let vertex = |p| self.point_of_ray(index, "corner of the fan", p);
                let vertices = [vertex(*corner)?, vertex(*corner + *edge_u)?, vertex(*corner + *edge_v)?];
                let jitter = jitter.map(|j| jitter_word(j, JITTER_BITS));
                BundleWords::Fan { apex, vertices, n: *n, m: *m, jitter }
            }
            RayBundle::Hemisphere { normal, spin, n, m, jitter, .. } => {
                let (t1, t2) = spun_frame(*normal, *spin);
                let jitter = jitter.map(|j| jitter_word(j, HEMISPHERE_LOG2));
                let scale = f64::from(1u32 << self.formats.dir_frac_bits);
                let word = |x: f64| (x.clamp(-1.0, 1.0) * scale).round_ties_even() as i32;
                let frame = [t1, t2, *normal].map(|axis| axis.to_array().map(word));
                BundleWords::Hemisphere { apex, frame, n: *n, m: *m, jitter }
            }
            RayBundle::Targets { points, .. } => {
                BundleWords::Targets { apex, points: self.target_words(index, apex, bundle.apex(), points)? }
            }
        };
        // A sample of a fan on the apex's own word: the fan as the list of its samples.
        let words = match words.validate(&self.formats) {
            Err(BundleError::Direction { dir: [0, 0, 0], .. })
                if matches!(words, BundleWords::Fan { .. }) =>
            {
                let described = as_described(bundle);
                let ends = (0..described.n_rays()).map(|i| described.ray(i).at(1.0));
                let points: Vec<DVec3> = ends.collect();
                BundleWords::Targets { apex, points: self.target_words(index, apex, bundle.apex(), &points)? }
            }
            _ => words,
        };
        words.validate(&self.formats).map_err(|error| {
            let ray = match &error {
                BundleError::Direction { ray, .. } => *ray,
                _ => 0,
            };
            CastError::BadRay { index: index + ray, what: error.to_string() }
        })?;
        Ok(words)
    }

    /// The words of targets. One on the apex's own word would be no ray: it is moved by one step along the largest
    /// component of its true direction, so it ends within 2 u_F + u_F of its place, under the fan's 4 u_F.
    fn target_words(
        &self,
        index: usize,
        apex_words: [i32; 3],
        apex: DVec3,
        points: &[DVec3],
    ) -> Result<Vec<[i32; 3]>, CastError> {
        let limit = 1 << self.formats.coord_frac_bits;
        let words = |(i, &point): (usize, &DVec3)| {
            let mut words = self.point_of_ray(index + i, "target", point)?;
            if words == apex_words {
                let toward = point - apex;
                let axis = toward.abs().max_position();
                let step = if toward[axis] < 0.0 { -1 } else { 1 };
                // At the cube's face there is room on the other side only.
                let moved = words[axis] + step;
                words[axis] = if (-limit..limit).contains(&moved) { moved } else { words[axis] - step };
            }
            Ok(words)
        };
        points.iter().enumerate().map(words).collect()
    }

    /// The board's nearest hit of an explicit ray, in the host's terms.
    pub fn hit(&self, ray: &QuantizedRay, hit: HitWords) -> RayHit {
        host_hit(hit, ray.host_t_per_step, ray.t_max)
    }

    /// The board's nearest hit of ray `i` of a bundle, in the host's terms.
    pub fn bundle_hit(&self, bundle: &RayBundle, words: &BundleWords, i: usize, hit: HitWords) -> RayHit {
        let ray = bundle.ray(i);
        let dir = words.ray(&self.formats, i).dir;
        host_hit(hit, self.host_t_per_step(dir, ray.dir), ray.t_max)
    }

    /// Distance per t step along the words, over the length of the host's direction.
    fn host_t_per_step(&self, dir: [i32; 3], host_dir: DVec3) -> f64 {
        let bits = to_i32(self.formats.dir_frac_bits) + to_i32(self.formats.t_frac_bits);
        let step_m = DVec3::from_array(dir.map(f64::from)).length() * power_of_two(-bits) * self.half_m;
        step_m / host_dir.length()
    }

    fn point_of_ray(&self, index: usize, what: &str, point: DVec3) -> Result<[i32; 3], CastError> {
        self.point(point).ok_or_else(|| CastError::BadRay {
            index,
            what: format!(
                "{what} {point} m lies outside the board's cube: within {} m of {} along each axis",
                self.half_m, self.center
            ),
        })
    }

    /// Tile words: one power of two for the whole tile, such that no direction reaches 1 after rounding.
    fn tile_words(
        &self,
        corner: DVec3,
        step_u: DVec3,
        step_v: DVec3,
        n: u32,
        m: u32,
    ) -> ([i64; 3], [i64; 3], [i64; 3]) {
        // The directions' largest component is at one of the tile's four corners, before and after rounding.
        let ends = [(0, 0), (n - 1, 0), (0, m - 1), (n - 1, m - 1)];
        let largest = ends
            .iter()
            .map(|&(i, j)| (corner + f64::from(i) * step_u + f64::from(j) * step_v).abs().max_element())
            .fold(0.0, f64::max);
        let bits = self.formats.dir_frac_bits + STEP_GUARD_BITS;
        let limit = ((1i64 << self.formats.dir_frac_bits) - 1) << STEP_GUARD_BITS;
        let mut exponent = exponent_above(largest);
        loop {
            let scale = power_of_two(to_i32(bits) - exponent);
            let words = |v: DVec3| v.to_array().map(|x| (x * scale).round_ties_even() as i64);
            let (c, u, v) = (words(corner), words(step_u), words(step_v));
            let fits = ends.iter().all(|&(i, j)| {
                (0..3).all(|k| (c[k] + i64::from(i) * u[k] + i64::from(j) * v[k]).abs() <= limit)
            });
            if fits {
                return (c, u, v);
            }
            exponent += 1;
        }
    }
}

/// A place in a stratum in words: down, so that [0, 1) stays below 2^bits.
fn jitter_word(place: f64, bits: u32) -> u32 {
    (place * f64::from(1u32 << bits)) as u32
}

/// The bundle with the place in its strata as its descriptor has it.
pub(crate) fn as_described(bundle: &RayBundle) -> RayBundle {
    let mut described = bundle.clone();
    let as_word = |place: f64, bits: u32| f64::from(jitter_word(place, bits)) / f64::from(1u32 << bits);
    match &mut described {
        RayBundle::Fan { jitter, .. } => *jitter = jitter.map(|place| as_word(place, JITTER_BITS)),
        RayBundle::Hemisphere { jitter, .. } => {
            *jitter = jitter.map(|place| as_word(place, HEMISPHERE_LOG2));
        }
        RayBundle::Tile { .. } | RayBundle::Targets { .. } => {}
    }
    described
}

/// 6 u_F + 4 u_D + 2 u_T, in half cubes.
fn offset_in_half_cubes(formats: &Formats) -> f64 {
    let step = |bits: u32| power_of_two(-to_i32(bits));
    0.5 * 3f64.sqrt()
        * (6.0 * step(formats.coord_frac_bits)
            + 4.0 * step(formats.dir_frac_bits)
            + 2.0 * step(formats.t_frac_bits))
}

fn host_hit(hit: HitWords, host_t_per_step: f64, t_max: f64) -> RayHit {
    let facing = match hit.facing {
        rtl_model::datapath::Facing::Front => Facing::Front,
        rtl_model::datapath::Facing::Back => Facing::Back,
    };
    RayHit { t: (hit.t as f64 * host_t_per_step).min(t_max), patch: PatchId(hit.patch), facing }
}

/// A coordinate in half cubes to its word: by the `fixed` type at the default width, else by a power of two.
fn coordinate_word(x: f64, frac_bits: u32) -> Option<i32> {
    if frac_bits == CoordWord::FRAC_NBITS {
        return CoordWord::checked_from_num(x).map(CoordWord::to_bits);
    }
    coordinate_word_at_run_time(x, frac_bits)
}

fn coordinate_word_at_run_time(x: f64, frac_bits: u32) -> Option<i32> {
    let word = (x * power_of_two(to_i32(frac_bits))).round_ties_even();
    (word.abs() < f64::from(i32::MAX)).then_some(word as i32)
}

/// Direction words with the largest in [2^(D-1), 2^D), and e: dir = words 2^-D 2^e, to rounding.
///
/// `dir` is finite and not zero; its length is one that `check_ray` lets pass, give or take the cube.
fn direction_words(dir: DVec3, frac_bits: u32) -> ([i32; 3], i32) {
    let mut exponent = exponent_above(dir.abs().max_element());
    loop {
        let scaled = dir * power_of_two(-exponent);
        let words = scaled.to_array().map(|x| direction_word(x, frac_bits));
        if words.iter().all(|w| w.unsigned_abs() < 1 << frac_bits) {
            return (words, exponent);
        }
        exponent += 1;
    }
}

fn direction_word(x: f64, frac_bits: u32) -> i32 {
    if frac_bits == DirWord::FRAC_NBITS {
        DirWord::saturating_from_num(x).to_bits()
    } else {
        direction_word_at_run_time(x, frac_bits)
    }
}

fn direction_word_at_run_time(x: f64, frac_bits: u32) -> i32 {
    (x * power_of_two(to_i32(frac_bits))).round_ties_even() as i32
}

/// The e with 2^(e-1) <= x < 2^e, for normal x > 0.
fn exponent_above(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1022
}

/// 2^e exactly, for e in -1022..=1023.
fn power_of_two(e: i32) -> f64 {
    f64::from_bits(((e.clamp(-1022, 1023) + 1023) as u64) << 52)
}

/// Bit counts are under 64.
fn to_i32(bits: u32) -> i32 {
    bits as i32
}

#[cfg(test)]
#[path = "quantize_tests.rs"]
mod tests;
