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

/// One row of the width table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WireWidth {
    /// Which wire, as named in `datapath/`.
    pub wire: &'static str,
    /// Its width in bits, sign included.
    pub bits: u32,
    /// Its fraction bits.
    pub frac_bits: u32,
    /// Largest magnitude that it can carry.
    pub max_magnitude: i128,
}

impl Formats {
    /// Checks every width.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn validate(&self) -> Result<(), FormatError> {
        todo!()
    }

    /// The largest t word: 4.0.
    pub fn t_limit(&self) -> u64 {
        4 << self.t_frac_bits
    }

    /// Width and largest magnitude of every wire of the datapath.
    pub fn width_table(&self) -> Vec<WireWidth> {
        todo!()
    }
}
