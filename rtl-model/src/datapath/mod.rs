//! Pure, bit-exact functions of the board's arithmetic: no clock, no state, integers only.

pub mod bundle;
pub mod cell_step;
pub mod first_test;
mod hemisphere;
pub mod mailbox;
pub mod ray_patch;
pub mod shell;

#[cfg(test)]
pub(crate) mod test_support;

use crate::fixed::Formats;

/// A ray as the board holds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayWords {
    /// Origin, coordinate words in [-2^F, 2^F).
    pub origin: [i32; 3],
    /// Direction words in (-2^D, 2^D), not all zero, largest magnitude at least 2^(D-1).
    pub dir: [i32; 3],
    /// Largest t word that counts, at most [`crate::fixed::Formats::t_limit`].
    pub t_max: u64,
}

/// Why a ray's words are no ray.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RayError {
    /// A word outside its range.
    #[error("{field} = {value}; {min} to {max} are possible")]
    Word {
        /// Which word.
        field: &'static str,
        /// Its value.
        value: i128,
        /// Smallest possible.
        min: i64,
        /// Largest possible.
        max: i64,
    },
    /// A direction of three zeros.
    #[error("dir = [0, 0, 0]; at least one word other than 0 is expected")]
    NoDirection,
}

impl RayWords {
    /// Checks that the words fit the formats and that the direction is not zero.
    ///
    /// # Errors
    /// [`RayError`], with the first word outside its range.
    pub fn validate(&self, formats: &Formats) -> Result<(), RayError> {
        let within = |field, words: [i32; 3], min: i64, max: i64| match words
            .iter()
            .find(|word| !(min..=max).contains(&i64::from(**word)))
        {
            Some(value) => Err(RayError::Word { field, value: i128::from(*value), min, max }),
            None => Ok(()),
        };
        let (cube, unit) = (1_i64 << formats.coord_frac_bits, 1_i64 << formats.dir_frac_bits);
        within("origin", self.origin, -cube, cube - 1)?;
        within("dir", self.dir, 1 - unit, unit - 1)?;
        if self.dir == [0; 3] {
            return Err(RayError::NoDirection);
        }
        if self.t_max > formats.t_limit() {
            let (value, max) = (i128::from(self.t_max), formats.t_limit().cast_signed());
            return Err(RayError::Word { field: "t_max", value, min: 0, max });
        }
        Ok(())
    }
}

/// A patch as the board holds it: a triangle, or a quad = two triangles that share the diagonal v0 v2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatchWords {
    /// Corners, coordinate words; the fourth repeats the third in a triangle.
    pub corners: [[i32; 3]; 4],
    /// Three corners, not four.
    pub is_triangle: bool,
    /// Patch id, under 2^28.
    pub id: u32,
}

/// Why a patch's words are no patch.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PatchError {
    /// A word outside its range.
    #[error("{field} = {value}; {min} to {max} are possible")]
    Word {
        /// Which word.
        field: &'static str,
        /// Its value.
        value: i64,
        /// Smallest possible.
        min: i64,
        /// Largest possible.
        max: i64,
    },
    /// A triangle whose fourth corner is not its third.
    #[error("the fourth corner of a triangle is {fourth:?}; the third, {third:?}, is expected")]
    FourthCorner {
        /// What stands there.
        fourth: [i32; 3],
        /// What is expected.
        third: [i32; 3],
    },
}

impl PatchWords {
    /// Checks that the words fit the formats and the record.
    ///
    /// # Errors
    /// [`PatchError`], with the first word outside its range.
    pub fn validate(&self, formats: &Formats) -> Result<(), PatchError> {
        let cube = 1_i64 << formats.coord_frac_bits;
        for (field, corner) in ["corner 0", "corner 1", "corner 2", "corner 3"].into_iter().zip(self.corners)
        {
            for value in corner.map(i64::from) {
                if !(-cube..cube).contains(&value) {
                    return Err(PatchError::Word { field, value, min: -cube, max: cube - 1 });
                }
            }
        }
        let most = (1_i64 << crate::packet::PATCH_ID_BITS) - 1;
        if i64::from(self.id) > most {
            return Err(PatchError::Word { field: "id", value: i64::from(self.id), min: 0, max: most });
        }
        let [_, _, third, fourth] = self.corners;
        if self.is_triangle && fourth != third {
            return Err(PatchError::FourthCorner { fourth, third });
        }
        Ok(())
    }
}

/// The side of a patch that a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Corners run counter-clockwise as seen from the ray's origin.
    Front,
    /// Clockwise.
    Back,
}

/// What the board answers for a nearest-hit ray that hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HitWords {
    /// t word, T fraction bits.
    pub t: u64,
    /// Patch id.
    pub patch: u32,
    /// Side.
    pub facing: Facing,
}

impl HitWords {
    /// The nearer of two hits: smallest (t, patch id), so the answer never depends on the order of tests.
    pub fn nearer(a: Option<HitWords>, b: Option<HitWords>) -> Option<HitWords> {
        match (a, b) {
            (Some(x), Some(y)) => Some(if (y.t, y.patch) < (x.t, x.patch) { y } else { x }),
            (x, None) => x,
            (None, y) => y,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patch_words_outside_their_range_are_named() {
        let formats = test_support::formats(8, 8, 8);
        let good = PatchWords {
            corners: [[-256, 0, 255], [255, 0, 0], [0, 1, 2], [0, 1, 2]],
            is_triangle: true,
            id: (1 << 28) - 1,
        };
        assert_eq!(good.validate(&formats), Ok(()));
        let fault = |change: &dyn Fn(&mut PatchWords)| {
            let mut patch = good;
            change(&mut patch);
            patch.validate(&formats).unwrap_err().to_string()
        };
        assert_eq!(fault(&|p| p.corners[1][2] = 256), "corner 1 = 256; -256 to 255 are possible");
        assert_eq!(fault(&|p| p.corners[0][0] = -257), "corner 0 = -257; -256 to 255 are possible");
        assert!(fault(&|p| p.id = 1 << 28).starts_with("id = 268435456"));
        assert!(fault(&|p| p.corners[3][1] = 0).contains("[0, 1, 2], is expected"));
        assert_eq!(
            PatchWords { is_triangle: false, corners: [[0, 0, 0]; 4], ..good }.validate(&formats),
            Ok(())
        );
    }
}
