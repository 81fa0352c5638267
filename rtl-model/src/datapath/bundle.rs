//! Bundle descriptors to rays, in integers: the bundle generator's function.

use super::RayWords;
use crate::fixed::Formats;

/// Fraction bits that tile steps carry below the direction word, so that 64 steps add up exactly enough.
pub const STEP_GUARD_BITS: u32 = 8;

/// Fraction bits of sample positions inside a fan's stratum.
pub const JITTER_BITS: u32 = 12;

/// log2 of the side of the hemisphere's direction table.
pub const HEMISPHERE_LOG2: u32 = 6;

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
}

impl BundleWords {
    /// How many rays.
    pub fn n_rays(&self) -> usize {
        match self {
            BundleWords::Tile { n, m, .. }
            | BundleWords::Fan { n, m, .. }
            | BundleWords::Hemisphere { n, m, .. } => (n * m) as usize,
            BundleWords::Targets { points, .. } => points.len(),
        }
    }

    /// Checks the descriptor: 1 to 64 rays, words in range, no zero direction.
    ///
    /// # Errors
    /// [`BundleError`].
    pub fn validate(&self, formats: &Formats) -> Result<(), BundleError> {
        let _ = formats;
        todo!()
    }

    /// Ray `i` of a valid descriptor.
    pub fn ray(&self, formats: &Formats, i: usize) -> RayWords {
        let _ = (formats, i);
        todo!()
    }
}
