//! Bundle descriptors to rays, in integers: the bundle generator's function.
//!
//! ```text
//! descriptor, i -> raw direction (exact integers) -> scaled by 2^s into direction words, rounded once -> ray
//!                                                                                        s -> t_max at the point
//! ```
//! Raw direction of ray (i, j) of n x m, and its unit:
//!
//! | kind | raw | one is |
//! |---|---|---|
//! | tile | corner + i u + j v | 2^(D+8) |
//! | fan | v0 + (i + js) (v1 - v0) / n + (j + jt) (v2 - v0) / m, rounded to a coordinate word, minus apex | 2^F |
//! | hemisphere | x t1 + y t2 + z n, (x, y, z) the table's entry floor((64 i + ju) / n), floor((64 j + jv) / m) | 2^(2D) |
//! | targets | point - apex | 2^F |
//!
//! With 2^(L-1) <= largest |raw component| < 2^L the direction is round(raw 2^(D-L)), to nearest, ties to even, so its
//! largest component lies in [2^(D-1), 2^D); if rounding reaches 2^D the shift is one more. Fans and targets end at
//! their point: t_max = 2^(T + L - F), at least 1 and at most 4.0; others have t_max = 4.0.
//! Source: the kinds are DESIGN 4's; none is published. Not modelled: the generator's clock.

use super::RayWords;
use super::hemisphere;
use crate::fixed::{Formats, Rounding, clamp_to_i64, index};
use crate::packet::MAX_BUNDLE_RAYS;

pub use super::hemisphere::HEMISPHERE_LOG2;

/// Fraction bits that tile steps carry below the direction word, so that 64 steps add up exactly enough.
pub const STEP_GUARD_BITS: u32 = 8;

/// Fraction bits of sample positions inside a fan's stratum.
pub const JITTER_BITS: u32 = 12;

/// A bundle descriptor in words; `n * m <= 64`. Ray i is column `i % n`, row `i / n`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BundleWords {
    /// Directions corner + i u + j v, words with D + [`STEP_GUARD_BITS`] fraction bits.
    Tile {
        /// Common origin, coordinate words.
        apex: [i32; 3],
        /// Direction of ray (0, 0).
        corner: [i64; 3],
        /// Step along a row.
        step_u: [i64; 3],
        /// Step from row to row.
        step_v: [i64; 3],
        /// Rays in a row.
        n: u32,
        /// Rows.
        m: u32,
    },
    /// Points on the parallelogram of three vertices; t_max at the point.
    Fan {
        /// Common origin, coordinate words.
        apex: [i32; 3],
        /// v0, v0 + first edge, v0 + second edge, coordinate words.
        vertices: [[i32; 3]; 3],
        /// Strata along the first edge; a power of two keeps the board's division a shift.
        n: u32,
        /// Strata along the second edge.
        m: u32,
        /// Place in the stratum, [`JITTER_BITS`] fraction bits, in [0, 2^JITTER_BITS).
        jitter: [u32; 2],
    },
    /// Cosine-distributed directions from the table, turned into a frame.
    Hemisphere {
        /// Common origin, coordinate words.
        apex: [i32; 3],
        /// Tangents and normal, direction words (unit length, to rounding).
        frame: [[i32; 3]; 3],
        /// Strata along the square's first axis.
        n: u32,
        /// Strata along its second axis.
        m: u32,
        /// Place in the stratum, [`HEMISPHERE_LOG2`] fraction bits, as many as the table has places: 32 is the centre.
        jitter: [u32; 2],
    },
    /// Listed points; t_max at each.
    Targets {
        /// Common origin, coordinate words.
        apex: [i32; 3],
        /// Coordinate words, each different from the apex.
        points: Vec<[i32; 3]>,
    },
}

/// Why a descriptor has no rays.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BundleError {
    /// Over 64 rays, or none.
    #[error("a bundle of {0} rays; 1 to 64 are possible")]
    Size(usize),
    /// A direction that quantises to zero, or out of range.
    #[error("ray {ray} of the bundle has direction {dir:?}")]
    Direction {
        /// Which ray.
        ray: usize,
        /// Its raw direction.
        dir: [i64; 3],
    },
    /// A word that its field cannot hold.
    #[error("{field} of the bundle is {value}; {min} to {max} are possible")]
    Word {
        /// Which field.
        field: &'static str,
        /// Its value.
        value: i64,
        /// Smallest possible.
        min: i64,
        /// Largest possible.
        max: i64,
    },
}

/// A direction before it is scaled: `raw / 2^frac_bits` in real numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct RawDirection {
    raw: [i64; 3],
    frac_bits: u32,
    /// The ray ends where the raw direction ends.
    ends_at_point: bool,
}

impl BundleWords {
    /// How many rays.
    pub fn n_rays(&self) -> usize {
        match self {
            BundleWords::Tile { n, m, .. }
            | BundleWords::Fan { n, m, .. }
            | BundleWords::Hemisphere { n, m, .. } => index(n.saturating_mul(*m)),
            BundleWords::Targets { points, .. } => points.len(),
        }
    }

    /// The common origin, coordinate words.
    pub fn apex(&self) -> [i32; 3] {
        match self {
            BundleWords::Tile { apex, .. }
            | BundleWords::Fan { apex, .. }
            | BundleWords::Hemisphere { apex, .. }
            | BundleWords::Targets { apex, .. } => *apex,
        }
    }

    /// Checks the descriptor: 1 to 64 rays, words in range, no zero direction.
    ///
    /// # Errors
    /// [`BundleError`].
    pub fn validate(&self, formats: &Formats) -> Result<(), BundleError> {
        let n_rays = self.n_rays();
        if n_rays == 0 || n_rays > MAX_BUNDLE_RAYS {
            return Err(BundleError::Size(n_rays));
        }
        let cube = 1_i64 << formats.coord_frac_bits;
        let within = |field, words: &[i64], min: i64, max: i64| match words
            .iter()
            .find(|word| !(min..=max).contains(*word))
        {
            Some(value) => Err(BundleError::Word { field, value: *value, min, max }),
            None => Ok(()),
        };
        let point = |field, words: [i32; 3]| within(field, &words.map(i64::from), -cube, cube - 1);
        point("apex", self.apex())?;
        let unit = 1_i64 << formats.dir_frac_bits;
        let tile = (unit << (STEP_GUARD_BITS + 1)) - 1;
        match self {
            BundleWords::Tile { corner, step_u, step_v, .. } => {
                within("corner", corner, -tile, tile)?;
                within("step_u", step_u, -tile, tile)?;
                within("step_v", step_v, -tile, tile)?;
            }
            BundleWords::Fan { vertices, jitter, .. } => {
                vertices.iter().try_for_each(|v| point("vertex", *v))?;
                within("jitter", &jitter.map(i64::from), 0, (1 << JITTER_BITS) - 1)?;
            }
            BundleWords::Hemisphere { frame, jitter, .. } => {
                frame.iter().try_for_each(|axis| within("frame", &axis.map(i64::from), -unit, unit))?;
                within("jitter", &jitter.map(i64::from), 0, (1 << HEMISPHERE_LOG2) - 1)?;
            }
            BundleWords::Targets { points, .. } => points.iter().try_for_each(|p| point("point", *p))?,
        }
        for ray in 0..n_rays {
            let RawDirection { raw, .. } = self.raw_direction(formats, ray);
            let largest = largest(raw);
            // A tile's sum has to fit its words; a fan's fourth corner has to lie in the cube.
            let too_long = match self {
                BundleWords::Tile { .. } => largest > tile.cast_unsigned(),
                BundleWords::Fan { apex, .. } => (0..3).any(|k| {
                    let word = raw[k] + i64::from(apex[k]);
                    word < -cube || word >= cube
                }),
                BundleWords::Hemisphere { .. } | BundleWords::Targets { .. } => false,
            };
            if largest == 0 || too_long {
                return Err(BundleError::Direction { ray, dir: raw });
            }
        }
        Ok(())
    }

    /// Ray `i` of a valid descriptor.
    ///
    /// # Panics
    /// When a descriptor lists fewer than `i + 1` targets.
    pub fn ray(&self, formats: &Formats, i: usize) -> RayWords {
        self.scaled_ray(formats, i).0
    }

    /// Ray `i` and its scale s: raw direction = (direction words / 2^D) 2^s, to rounding, so a hit at t lies
    /// `t * 2^-s` raw directions away. For fans and targets raw = point - apex in half cube sides; for tiles
    /// and hemispheres raw is in the unit of their words.
    ///
    /// # Panics
    /// As [`BundleWords::ray`].
    pub fn scaled_ray(&self, formats: &Formats, i: usize) -> (RayWords, i32) {
        let direction = self.raw_direction(formats, i);
        let (dir, length_log2) = normalise(direction.raw, formats.dir_frac_bits);
        let scale = difference(length_log2, direction.frac_bits);
        let t_max = if direction.ends_at_point {
            let t_log2 = formats.t_frac_bits + length_log2;
            // Under one step: one step, the smallest t_max that a ray can have.
            t_log2.checked_sub(formats.coord_frac_bits).map_or(1, |log2| 1 << log2.min(63))
        } else {
            formats.t_limit()
        };
        let ray = RayWords { origin: self.apex(), dir, t_max: t_max.min(formats.t_limit()) };
        (ray, scale)
    }

    /// The exact direction of ray `i`, in the integers of its kind.
    fn raw_direction(&self, formats: &Formats, i: usize) -> RawDirection {
        match self {
            BundleWords::Tile { corner, step_u, step_v, n, .. } => {
                let (u, v) = place(i, *n);
                let raw = [0, 1, 2].map(|k| corner[k] + u * step_u[k] + v * step_v[k]);
                let frac_bits = formats.dir_frac_bits + STEP_GUARD_BITS;
                RawDirection { raw, frac_bits, ends_at_point: false }
            }
            BundleWords::Fan { apex, vertices, n, m, jitter } => {
                let (u, v) = place(i, *n);
                let at = |place: i64, jitter: u32| (place << JITTER_BITS) + i64::from(jitter);
                let (along_u, along_v) = (at(u, jitter[0]), at(v, jitter[1]));
                let (n, m) = (i64::from(*n), i64::from(*m));
                let raw = [0, 1, 2].map(|k| {
                    let [v0, v1, v2] = vertices.map(|vertex| i64::from(vertex[k]));
                    // One denominator n m 2^J for all, so that the point is rounded once: under 2^49.
                    let den = (n * m) << JITTER_BITS;
                    let num = v0 * den + along_u * (v1 - v0) * m + along_v * (v2 - v0) * n;
                    let point = clamp_to_i64(Rounding::NearestEven.divide(i128::from(num), i128::from(den)));
                    point - i64::from(apex[k])
                });
                RawDirection { raw, frac_bits: formats.coord_frac_bits, ends_at_point: true }
            }
            BundleWords::Hemisphere { frame, n, m, jitter, .. } => {
                let (u, v) = place(i, *n);
                let (column, row) = (table_place(u, jitter[0], *n), table_place(v, jitter[1], *m));
                let entry = hemisphere::entry(formats.dir_frac_bits, column, row);
                let raw = [0, 1, 2]
                    .map(|k| (0..3).map(|axis| i64::from(entry[axis]) * i64::from(frame[axis][k])).sum());
                RawDirection { raw, frac_bits: 2 * formats.dir_frac_bits, ends_at_point: false }
            }
            BundleWords::Targets { apex, points } => {
                let raw = [0, 1, 2].map(|k| i64::from(points[i][k]) - i64::from(apex[k]));
                RawDirection { raw, frac_bits: formats.coord_frac_bits, ends_at_point: true }
            }
        }
    }
}

/// Column and row of ray `i`.
fn place(i: usize, n: u32) -> (i64, i64) {
    let n = index(n.max(1));
    let word = |place: usize| i64::try_from(place).unwrap_or(i64::MAX);
    (word(i % n), word(i / n))
}

/// The table place at or just below (place + jitter/64) / n of the square: floor((64 place + jitter) / n).
fn table_place(place: i64, jitter: u32, n: u32) -> u32 {
    u32::try_from(((place << HEMISPHERE_LOG2) + i64::from(jitter)) / i64::from(n.max(1))).unwrap_or(0)
}

/// Largest magnitude of three words.
fn largest(words: [i64; 3]) -> u64 {
    words.map(i64::unsigned_abs).into_iter().fold(0, u64::max)
}

/// Scales to direction words by a power of two, rounding once to nearest even: the words, and L with every
/// |component| < 2^L (one more where rounding would have reached 2^D).
fn normalise(raw: [i64; 3], dir_frac_bits: u32) -> ([i32; 3], u32) {
    let mut length_log2 = u64::BITS - largest(raw).leading_zeros();
    let mut words = round_to_bits(raw, length_log2, dir_frac_bits);
    if largest(words) >> dir_frac_bits != 0 {
        length_log2 += 1;
        words = round_to_bits(raw, length_log2, dir_frac_bits);
    }
    // D + 1 <= 29 bits.
    (words.map(|word| i32::try_from(word).unwrap_or(0)), length_log2)
}

/// raw 2^(kept - length), rounded.
fn round_to_bits(raw: [i64; 3], length_log2: u32, kept: u32) -> [i64; 3] {
    let (left, right) = (kept.saturating_sub(length_log2), length_log2.saturating_sub(kept));
    raw.map(|word| clamp_to_i64(Rounding::NearestEven.shift_right(i128::from(word) << left, right)))
}

/// a - b of two bit counts.
fn difference(a: u32, b: u32) -> i32 {
    i32::try_from(i64::from(a) - i64::from(b)).unwrap_or(0)
}

#[cfg(test)]
#[path = "bundle_tests.rs"]
mod tests;
