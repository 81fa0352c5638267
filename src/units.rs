//! Quantities of light: linear RGB (Rec. 709 primaries, D65) with the physical quantity in the type.
//!
//! `Irradiance` E arrives, `Radiosity` B = M + rho E leaves (both W/m^2 per channel), `Radiance` L = B / pi is
//! what a camera sees of a diffuse surface (W/m^2/sr). Nothing converts silently between them; [`crate::photometry`]
//! makes lumens, lux and candelas of them.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use serde::{Deserialize, Serialize};

pub use crate::photometry::LUMENS_PER_WATT;

/// Three linear channels of any quantity: red, green, blue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rgb(pub [f64; 3]);

impl Rgb {
    /// Zero in every channel.
    pub const BLACK: Rgb = Rgb([0.0; 3]);
    /// One in every channel.
    pub const WHITE: Rgb = Rgb([1.0; 3]);

    /// The same value in every channel.
    pub const fn splat(value: f64) -> Rgb {
        Rgb([value; 3])
    }

    /// Relative luminance Y of Rec. 709 primaries, in the unit of the channels.
    pub fn luminance(self) -> f64 {
        0.2126 * self.0[0] + 0.7152 * self.0[1] + 0.0722 * self.0[2]
    }

    /// Largest channel.
    pub fn max_channel(self) -> f64 {
        self.0[0].max(self.0[1]).max(self.0[2])
    }

    /// Smallest channel.
    pub fn min_channel(self) -> f64 {
        self.0[0].min(self.0[1]).min(self.0[2])
    }

    /// Sum of the channels: the power that progressive refinement ranks shooters by.
    pub fn sum(self) -> f64 {
        self.0[0] + self.0[1] + self.0[2]
    }

    /// `f` applied to each channel.
    pub fn map(self, f: impl FnMut(f64) -> f64) -> Rgb {
        Rgb(self.0.map(f))
    }

    /// True when every channel is zero.
    pub fn is_black(self) -> bool {
        self.0 == [0.0; 3]
    }

    /// True when no channel is NaN or infinite.
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|c| c.is_finite())
    }
}

impl Add for Rgb {
    type Output = Rgb;
    fn add(self, o: Rgb) -> Rgb {
        Rgb([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}
impl Sub for Rgb {
    type Output = Rgb;
    fn sub(self, o: Rgb) -> Rgb {
        Rgb([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}
impl Mul for Rgb {
    type Output = Rgb;
    fn mul(self, o: Rgb) -> Rgb {
        Rgb([self.0[0] * o.0[0], self.0[1] * o.0[1], self.0[2] * o.0[2]])
    }
}
impl Mul<f64> for Rgb {
    type Output = Rgb;
    fn mul(self, k: f64) -> Rgb {
        self.map(|c| c * k)
    }
}
impl Div<f64> for Rgb {
    type Output = Rgb;
    fn div(self, k: f64) -> Rgb {
        self.map(|c| c / k)
    }
}
impl Neg for Rgb {
    type Output = Rgb;
    fn neg(self) -> Rgb {
        self.map(|c| -c)
    }
}
impl AddAssign for Rgb {
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}
impl SubAssign for Rgb {
    fn sub_assign(&mut self, o: Rgb) {
        *self = *self - o;
    }
}
impl Sum for Rgb {
    fn sum<I: Iterator<Item = Rgb>>(iter: I) -> Rgb {
        iter.fold(Rgb::BLACK, Add::add)
    }
}

/// Power that arrives at a surface per area (W/m^2 per channel).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Irradiance(pub Rgb);

/// Power that leaves a surface per area (W/m^2 per channel).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Radiosity(pub Rgb);

/// Power per area and solid angle (W/m^2/sr per channel).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Radiance(pub Rgb);

impl Radiosity {
    /// B = M + rho E of a diffuse surface.
    pub fn of(exitance: Rgb, reflectance: Rgb, irradiance: Irradiance) -> Radiosity {
        Radiosity(exitance + reflectance * irradiance.0)
    }

    /// L = B / pi: the one bridge from radiosity to what a camera sees.
    pub fn radiance(self) -> Radiance {
        Radiance(self.0 / std::f64::consts::PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_of_white_is_one() {
        assert!((Rgb::WHITE.luminance() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn radiosity_of_a_half_grey_furnace_is_one_and_its_radiance_one_over_pi() {
        let b = Radiosity::of(Rgb::splat(0.5), Rgb::splat(0.5), Irradiance(Rgb::WHITE));
        assert_eq!(b.0, Rgb::WHITE);
        assert!((b.radiance().0.0[1] * std::f64::consts::PI - 1.0).abs() < 1e-15);
    }
}
