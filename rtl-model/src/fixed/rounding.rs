//! Rounding of integers that stand for fractions.

use serde::{Deserialize, Serialize};

/// How bits below the last kept one are dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rounding {
    /// To nearest, ties to even.
    #[default]
    NearestEven,
    /// To nearest, ties away from zero.
    HalfAway,
    /// Toward minus infinity.
    Floor,
}

impl Rounding {
    /// `value / 2^shift`, rounded to an integer.
    pub fn shift_right(self, value: i128, shift: u32) -> i128 {
        let _ = (value, shift);
        todo!()
    }

    /// `num / den`, rounded to an integer; `den != 0`.
    pub fn divide(self, num: i128, den: i128) -> i128 {
        let _ = (num, den);
        todo!()
    }
}
