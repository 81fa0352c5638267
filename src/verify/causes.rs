//! Why board and software may differ, with the bounds that decide it.
//!
//! Lengths in half cubes, t and directions as the board has them. u_F = sqrt(3)/2 2^-F and u_D likewise are the largest
//! distances from a point or direction to its word. Move the scene and the ray evenly from the host's to the board's.
//! Every point of a patch moves by at most u_F (it is a convex mean of corners), the ray's point at t by at most
//! u_F + `slope` t ([`super::rays`]; `slope` = u_D for an explicit ray). So relative to each other they move by at most
//!
//! ```text
//! eps(t) = 2 u_F + slope t + f64
//! ```
//! where f64 = 64 2^-53 M, M the largest coordinate, stands for the rounding of the host and of the software caster.
//!
//! # Error of t
//! The board's exact t belongs to a point of the quantised triangle, hence the host's ray at that t is within eps(t) of
//! the host's triangle, hence within eps(t) / |cos| along itself of where it meets its plane. The board's direction has
//! another length, by at most `stretch` (u_D for an explicit ray), and t is rounded, by half a step to nearest, by one
//! down. As a distance, |d| <= sqrt 3 the length of the board's direction:
//!
//! ```text
//! |error| <= eps(t) / |cos| + stretch t + (1/2 or 1) 2^-T |d|
//! ```
//! For a quad the plane is that of its triangle whose plane the ray meets nearest to t; board and software may each have
//! met the other triangle, so twice what its corners stand off that plane is added to eps. eps is taken at the t of
//! the answer at hand, not at the exact one: a difference of second order.
//!
//! # Causes
//! Let the answers be A (software, or none) and B (board, or none), A != B. On the way, A ceased to be hit in the
//! range, or B began to be, or both are hit all the way and changed order. A patch ceases to be hit where the line
//! crosses its boundary, or where its t crosses an end of the range. All of this happens at some stage between host
//! and board, at which nothing has moved by more than the bounds, so that one of these holds:
//!
//! - **edge**: at some t of the range the host's ray is within eps(t) of a boundary edge of A or B, as segments in
//!   space. A quad's diagonal is none, except where the two triangles turn different sides to the ray, in the host's
//!   words or the board's: then it is an outline of a bent quad;
//! - **depth tie**: the distances of the two hits differ by at most the sum of their bounds above;
//! - **t step**: a hit of either lies within its bound of t = 0 or of the end of the range, or between the host's end
//!   and the board's.
//!
//! They are tried in this order. A ray without any is a fault of the board or of software, or of this derivation, which
//! looks for the fold of a bent quad at the two ends only.
//!
//! # Rounded products
//! With K < 2F kept bits a component of an edge normal is off by at most r = 2^-K / 2 (to nearest) or 2^-K (down), an
//! edge value by r (|dx| + |dy| + |dz|). Where an edge value of A or B, computed from the board's words without
//! rounding, lies within that of 0, its sign may be wrong: cause **edge**, and nothing bounds t. Everywhere else the
//! board decides as with full products. The face normal, a sum of three, is off by 3 sqrt(3) r, which tilts the plane
//! about v0: eps at a hit grows by twice that over the normal's length times the distance from v0 (an angle and its
//! sine; ratios over 1/2 bound nothing).

use glam::DVec3;
use rtl_model::datapath::{HitWords, PatchWords};
use rtl_model::fixed::{Formats, Rounding};

use super::rays::{VerifiedRay, board_length, unit_error};
use crate::raycast::quantize::Quantizer;
use crate::raycast::{CastPatch, RayHit};

/// Why the answers to a ray differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    Edge,
    DepthTie,
    TStep,
    Unexplained,
}

/// The larger of both; what is no number stays visible, unlike in `f64::max`.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The scene in both worlds, and the formats' bounds.
#[derive(Clone, Debug)]
pub(super) struct Bounds<'a> {
    formats: Formats,
    center: DVec3,
    half_m: f64,
    patches: &'a [CastPatch],
    words: &'a [PatchWords],
    /// 2 u_F + f64.
    eps_0: f64,
    /// Largest error of t by its rounding.
    t_rounding: f64,
    /// r, the largest error of a component of an edge normal.
    cross_error: f64,
}

/// A hit as a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    /// From the ray's origin (half cubes).
    distance: f64,
    /// Bound on the difference between board and software (half cubes).
    bound: f64,
    patch: usize,
}

/// A ray in half cubes.
#[derive(Clone, Copy, Debug)]
struct Line {
    origin: DVec3,
    /// Half cubes per board t.
    dir: DVec3,
}

impl<'a> Bounds<'a> {
    /// For patches whose ids are their places.
    pub fn new(quantizer: &Quantizer, patches: &'a [CastPatch], words: &'a [PatchWords]) -> Bounds<'a> {
        let formats = *quantizer.formats();
        let (center, half_m) = (quantizer.center(), quantizer.half_m());
        let f64_error = 64.0 * (f64::EPSILON / 2.0) * (1.0 + center.abs().max_element() / half_m);
        let share = if formats.rounding == Rounding::Floor { 1.0 } else { 0.5 };
        let step = |bits: u32| 0.5_f64.powi(bits as i32);
        let cross_error = if formats.cross_drop() == 0 { 0.0 } else { share * step(formats.cross_keep()) };
        Bounds {
            formats,
            center,
            half_m,
            patches,
            words,
            eps_0: 2.0 * unit_error(formats.coord_frac_bits) + f64_error,
            t_rounding: share * step(formats.t_frac_bits),
            cross_error,
        }
    }

    fn line(&self, ray: &VerifiedRay) -> Line {
        let origin = (ray.host.origin - self.center) / self.half_m;
        Line { origin, dir: ray.host.dir / (self.half_m * ray.t_scale) }
    }

    /// A patch's corners in half cubes: the host's, and those of its words.
    fn corners(&self, patch: usize) -> [[DVec3; 4]; 2] {
        let step = 0.5_f64.powi(self.formats.coord_frac_bits as i32);
        let words = &self.words[patch];
        [
            self.patches[patch].corners.map(|corner| (corner - self.center) / self.half_m),
            words.corners.map(|corner| DVec3::from_array(corner.map(f64::from)) * step),
        ]
    }

    /// The board's hit.
    pub fn board(&self, ray: &VerifiedRay, hit: HitWords) -> Reach {
        let t = hit.t as f64 * 0.5_f64.powi(self.formats.t_frac_bits as i32);
        let length = board_length(ray.words.dir, self.formats.dir_frac_bits);
        let patch = hit.patch as usize;
        Reach { distance: t * length, bound: self.bound(ray, patch, t), patch }
    }

    /// Software's hit.
    pub fn software(&self, ray: &VerifiedRay, hit: &RayHit) -> Reach {
        let t = hit.t * ray.t_scale;
        let patch = hit.patch.0 as usize;
        let distance = hit.t * ray.host.dir.length() / self.half_m;
        Reach { distance, bound: self.bound(ray, patch, t), patch }
    }

    /// Bound on the error of the distance of a hit of `patch` at about board t `t`.
    fn bound(&self, ray: &VerifiedRay, patch: usize, t: f64) -> f64 {
        if self.cross_error > 0.0 && self.has_open_sign(ray, patch) {
            return f64::INFINITY;
        }
        let line = self.line(ray);
        let [corners, quantised] = self.corners(patch);
        let mut nearest = f64::INFINITY;
        let mut along = f64::INFINITY;
        for &[i, j, k] in self.patches[patch].triangles() {
            let normal = (corners[j] - corners[i]).cross(corners[k] - corners[i]).normalize_or_zero();
            let cosine = normal.dot(line.dir).abs() / line.dir.length();
            let plane_t = normal.dot(corners[i] - line.origin) / normal.dot(line.dir);
            if !plane_t.is_finite() || (plane_t - t).abs() >= nearest {
                continue;
            }
            nearest = (plane_t - t).abs();
            let bend =
                corners.map(|corner| normal.dot(corner - corners[0]).abs()).into_iter().fold(0.0, f64::max);
            let bend = if self.patches[patch].is_triangle { 0.0 } else { bend };
            let area = (quantised[j] - quantised[i]).cross(quantised[k] - quantised[i]).length();
            let tilt = 3.0 * 3f64.sqrt() * self.cross_error / area;
            let tilted = match self.cross_error > 0.0 {
                true if tilt <= 0.5 => 2.0 * tilt * (line.at(t) - corners[i]).length(),
                true => f64::INFINITY,
                false => 0.0,
            };
            along = (self.eps_0 + ray.slope * t + 2.0 * bend + tilted) / cosine;
        }
        along + ray.stretch * t + self.t_rounding * board_length(ray.words.dir, self.formats.dir_frac_bits)
    }

    /// Difference of the two distances in coordinate steps, and over its bound if that is finite, where both name one
    /// patch.
    pub fn t_error(&self, board: &Reach, software: &Reach) -> (f64, Option<f64>) {
        let error = (board.distance - software.distance).abs();
        let bound = larger(board.bound, software.bound);
        let of_bound = (bound != f64::INFINITY).then_some(if error == 0.0 { 0.0 } else { error / bound });
        (error * f64::from(1u32 << self.formats.coord_frac_bits), of_bound)
    }

    /// Why the answers differ, which name different patches, or one none.
    pub fn cause(&self, ray: &VerifiedRay, board: Option<&Reach>, software: Option<&Reach>) -> Cause {
        let hits = || [board, software].into_iter().flatten();
        let line = self.line(ray);
        let ends = self.ends(ray);
        let limit_t = ends[0].max(ends[1]).min(4.0);
        let edge = |hit: &Reach| {
            self.passes_edge(ray, &line, hit.patch, limit_t)
                || (self.cross_error > 0.0 && self.has_open_sign(ray, hit.patch))
        };
        if hits().any(edge) {
            return Cause::Edge;
        }
        if let (Some(b), Some(s)) = (board, software)
            && (b.distance - s.distance).abs() <= b.bound + s.bound
        {
            return Cause::DepthTie;
        }
        let [first, last] = [ends[0].min(ends[1]), ends[0].max(ends[1])].map(|t| t * line.dir.length());
        let near_end = |hit: &Reach| {
            hit.distance <= hit.bound
                || (hit.distance >= first - hit.bound && hit.distance <= last + hit.bound)
        };
        if hits().any(near_end) { Cause::TStep } else { Cause::Unexplained }
    }

    /// The end of the range in board t: the host's and the board's.
    fn ends(&self, ray: &VerifiedRay) -> [f64; 2] {
        [ray.host.t_max * ray.t_scale, ray.words.t_max as f64 * 0.5_f64.powi(self.formats.t_frac_bits as i32)]
    }

    /// Rounded products may have given an edge value of the patch another sign.
    fn has_open_sign(&self, ray: &VerifiedRay, patch: usize) -> bool {
        let step = |bits: u32| 0.5_f64.powi(bits as i32);
        let real = |words: [i32; 3], bits: u32| DVec3::from_array(words.map(f64::from)) * step(bits);
        let (origin, dir) = (
            real(ray.words.origin, self.formats.coord_frac_bits),
            real(ray.words.dir, self.formats.dir_frac_bits),
        );
        let [_, corners] = self.corners(patch);
        let a = corners.map(|corner| corner - origin);
        // f64's own error of an edge value: components up to 2, 10 units each as in the software caster.
        let open = (self.cross_error + 40.0 * f64::EPSILON) * dir.abs().element_sum();
        edges(self.patches[patch].is_triangle, true)
            .iter()
            .any(|&(i, j)| a[i].cross(a[j]).dot(dir).abs() <= open)
    }

    /// The line passes a boundary edge of the patch within eps(t) at some t in 0..=`limit_t`.
    fn passes_edge(&self, ray: &VerifiedRay, line: &Line, patch: usize, limit_t: f64) -> bool {
        let both = self.corners(patch);
        let corners = &both[0];
        let outline = || {
            let sides = both.iter().flat_map(|c| {
                self.patches[patch]
                    .triangles()
                    .iter()
                    .map(|&[i, j, k]| (c[j] - c[i]).cross(c[k] - c[i]).dot(line.dir) > 0.0)
            });
            let n_positive = sides.clone().filter(|side| *side).count();
            n_positive != 0 && n_positive != sides.count()
        };
        let is_triangle = self.patches[patch].is_triangle;
        edges(is_triangle, outline()).iter().any(|&(i, j)| {
            let (from, edge) = (corners[i], corners[j] - corners[i]);
            let off = |t: f64| {
                let a = line.at(t) - from;
                let along = (a.dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
                // A quantised point has no direction.
                let nearest = if along.is_finite() { along * edge } else { DVec3::ZERO };
                (a - nearest).length() - ray.slope * t
            };
            least(off, limit_t) <= self.eps_0
        })
    }
}

/// The edges of a patch, without and with a quad's diagonal.
fn edges(is_triangle: bool, diagonal: bool) -> &'static [(usize, usize)] {
    match (is_triangle, diagonal) {
        (true, _) => &[(0, 1), (1, 2), (2, 0)],
        (false, true) => &[(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)],
        (false, false) => &[(0, 1), (1, 2), (2, 3), (3, 0)],
    }
}

impl Line {
    fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.dir
    }
}

/// The least value of a convex function over 0..=`end`.
fn least(f: impl Fn(f64) -> f64, end: f64) -> f64 {
    let (mut low, mut high) = (0.0, end);
    // Thirds: after 90 rounds less than 2^-52 of the range is left.
    for _ in 0..90 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if f(a) <= f(b) { high = b } else { low = a }
    }
    f(low).min(f(high)).min(f(0.0)).min(f(end))
}

#[cfg(test)]
#[path = "causes_tests.rs"]
mod tests;
