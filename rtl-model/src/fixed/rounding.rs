//! Rounding of integers that stand for fractions.
//!
//! ```text
//! value, shift -> value / 2^shift, rounded        num, den -> num / den, rounded
//! ```
//! With q = floor(x) and r = x - q in [0, 1): up when r > 1/2, or r = 1/2 and the mode's tie rule says so.

use std::cmp::Ordering;

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
    /// `value / 2^shift`, rounded to an integer; `shift` under 127.
    pub fn shift_right(self, value: i128, shift: u32) -> i128 {
        if shift == 0 {
            return value;
        }
        let floor = value >> shift;
        let rest = value - (floor << shift);
        let half = 1_i128 << (shift - 1);
        let up = match self {
            Rounding::NearestEven => rest > half || (rest == half && floor & 1 == 1),
            Rounding::HalfAway => rest > half || (rest == half && value >= 0),
            Rounding::Floor => false,
        };
        floor + i128::from(up)
    }

    /// `num / den`, rounded to an integer; `den != 0` and both magnitudes under 2^127.
    ///
    /// # Panics
    /// When `den` is 0.
    pub fn divide(self, num: i128, den: i128) -> i128 {
        let negative = (num < 0) != (den < 0);
        let (n, d) = (num.unsigned_abs(), den.unsigned_abs());
        let (quotient, rest) = (n / d, n % d);
        // rest against d/2 without doubling: no bit is lost.
        let half = rest.cmp(&(d - rest));
        let up = match self {
            Rounding::NearestEven => {
                half == Ordering::Greater || (half == Ordering::Equal && quotient & 1 == 1)
            }
            Rounding::HalfAway => half != Ordering::Less,
            Rounding::Floor => negative && rest != 0,
        };
        let magnitude = (quotient + u128::from(up)).cast_signed();
        if negative { -magnitude } else { magnitude }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Rounding; 3] = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor];

    #[test]
    fn divide_small_values_satisfies_the_definition_of_each_mode() {
        let mut cases = 0;
        for num in -70_i128..=70 {
            for den in (-12_i128..=12).filter(|d| *d != 0) {
                for mode in ALL {
                    let q = mode.divide(num, den);
                    // q - num/den = error/den, sign-normalised by den > 0.
                    let (n, d) = if den < 0 { (-num, -den) } else { (num, den) };
                    let error = q * d - n;
                    match mode {
                        Rounding::Floor => assert!(error <= 0 && error > -d, "floor {num}/{den} = {q}"),
                        _ => {
                            assert!(2 * error.abs() <= d, "{mode:?} {num}/{den} = {q}");
                            if 2 * error.abs() == d {
                                match mode {
                                    Rounding::NearestEven => assert_eq!(q % 2, 0, "{num}/{den} = {q}"),
                                    _ => assert_eq!(error > 0, n > 0, "away {num}/{den} = {q}"),
                                }
                            }
                        }
                    }
                    cases += 1;
                }
            }
        }
        assert_eq!(cases, 141 * 24 * 3);
    }

    #[test]
    fn shift_right_small_values_equals_division_by_the_power() {
        for value in -600_i128..=600 {
            for shift in 0..10 {
                for mode in ALL {
                    assert_eq!(mode.shift_right(value, shift), mode.divide(value, 1 << shift), "{mode:?}");
                }
            }
        }
    }

    #[test]
    fn divide_widest_operands_stays_exact() {
        let widest = (1_i128 << 122) - 1;
        assert_eq!(Rounding::NearestEven.divide(widest, 1), widest);
        assert_eq!(Rounding::NearestEven.divide(widest, -widest), -1);
        assert_eq!(Rounding::Floor.divide(-1, widest), -1);
        assert_eq!(Rounding::HalfAway.divide(widest, 2), 1 << 121);
        assert_eq!(Rounding::NearestEven.divide(-(1 << 122), 1 << 123), 0);
    }
}
