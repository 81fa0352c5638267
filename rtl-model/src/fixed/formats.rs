//! The formats of a board and the width table of its datapath.

use serde::{Deserialize, Serialize};

use super::Rounding;

/// Run-time word lengths of a board.
///
/// | role | word | range | step |
/// |---|---|---|---|
/// | coordinate | sign + F fraction bits | [-1, 1) | 2^-F of half the scene cube |
/// | direction | sign + D fraction bits | (-1, 1), largest component in [1/2, 1) | 2^-D |
/// | ray parameter t | 3 integer + T fraction bits, unsigned | [0, 4] | 2^-T of the direction |
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Formats {
    /// F, 8..=28.
    pub coord_frac_bits: u32,
    /// D, 8..=28.
    pub dir_frac_bits: u32,
    /// T, 8..=32.
    pub t_frac_bits: u32,
    /// How many of the 2F fraction bits of the edge normals are kept; `None` keeps all.
    pub cross_keep_bits: Option<u32>,
    /// Rounding of kept edge normals and of t.
    pub rounding: Rounding,
}

impl Default for Formats {
    fn default() -> Self {
        Formats {
            coord_frac_bits: 24,
            dir_frac_bits: 24,
            t_frac_bits: 24,
            cross_keep_bits: None,
            rounding: Rounding::NearestEven,
        }
    }
}

/// A format outside its range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} = {value} is outside {min}..={max}")]
pub struct FormatError {
    /// Which parameter.
    pub name: &'static str,
    /// Its value.
    pub value: u32,
    /// Smallest allowed.
    pub min: u32,
    /// Largest allowed.
    pub max: u32,
}

impl Formats {
    /// Checks every width.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn validate(&self) -> Result<(), FormatError> {
        let check = |name, value, min, max| {
            if (min..=max).contains(&value) { Ok(()) } else { Err(FormatError { name, value, min, max }) }
        };
        check("coord_frac_bits", self.coord_frac_bits, 8, 28)?;
        check("dir_frac_bits", self.dir_frac_bits, 8, 28)?;
        check("t_frac_bits", self.t_frac_bits, 8, 32)?;
        check("cross_keep_bits", self.cross_keep(), 4, 2 * self.coord_frac_bits)
    }

    /// The largest t word: 4.0.
    pub fn t_limit(&self) -> u64 {
        4 << self.t_frac_bits
    }

    /// K, the fraction bits of a kept edge normal.
    pub fn cross_keep(&self) -> u32 {
        self.cross_keep_bits.unwrap_or(2 * self.coord_frac_bits)
    }

    /// How many fraction bits of an edge normal are rounded away: 2F - K.
    #[inline]
    pub fn cross_drop(&self) -> u32 {
        self.cross_keep_bits.map_or(0, |keep| (2 * self.coord_frac_bits).saturating_sub(keep))
    }

    /// What turns (coordinate words) / (direction words) into t words, as left shifts of numerator and denominator:
    /// t word = num 2^(T+D-F) / den; one of the two is 0.
    #[inline]
    pub fn t_shifts(&self) -> (u32, u32) {
        let (up, down) = (self.t_frac_bits + self.dir_frac_bits, self.coord_frac_bits);
        (up.saturating_sub(down), down.saturating_sub(up))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validate_default_formats_passes() {
        assert_eq!(Formats::default().validate(), Ok(()));
    }

    #[test]
    fn validate_each_width_outside_its_range_is_named() {
        let ok = Formats::default();
        let cases = [
            (Formats { coord_frac_bits: 7, ..ok }, "coord_frac_bits"),
            (Formats { coord_frac_bits: 29, ..ok }, "coord_frac_bits"),
            (Formats { dir_frac_bits: 7, ..ok }, "dir_frac_bits"),
            (Formats { dir_frac_bits: 29, ..ok }, "dir_frac_bits"),
            (Formats { t_frac_bits: 7, ..ok }, "t_frac_bits"),
            (Formats { t_frac_bits: 33, ..ok }, "t_frac_bits"),
            (Formats { cross_keep_bits: Some(3), ..ok }, "cross_keep_bits"),
            (Formats { cross_keep_bits: Some(49), ..ok }, "cross_keep_bits"),
        ];
        for (formats, name) in cases {
            assert_eq!(formats.validate().map_err(|e| e.name), Err(name), "{formats:?}");
        }
    }

    #[test]
    fn t_shifts_over_all_formats_differ_by_t_plus_d_minus_f() {
        for (f, d, t) in [(8, 28, 32), (28, 8, 8), (24, 24, 24)] {
            let formats =
                Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() };
            let (up, down) = formats.t_shifts();
            assert_eq!(i64::from(up) - i64::from(down), i64::from(t) + i64::from(d) - i64::from(f));
            assert!(up == 0 || down == 0);
        }
    }
}
