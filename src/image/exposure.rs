//! Exposure: how many stops lie between radiance and the display's linear range.
//!
//! ```text
//! Film, Exposure --resolve--> ResolvedExposure: display = radiance * 2^EV, white = 1
//! ```
//! `auto` puts the 95th percentile of the luminance of all pixels that show no emitter at 0.75.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::Film;

/// The percentile of non-emitter luminance that `auto` looks at.
pub const AUTO_PERCENTILE: f64 = 0.95;
/// Where `auto` puts it in the display's linear range.
pub const AUTO_TARGET: f64 = 0.75;
/// Largest magnitude of an exposure (stops): beyond it a picture is black or white whatever it shows.
pub const MAX_EV: f64 = 60.0;

/// The wanted exposure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exposure {
    /// From the picture.
    #[default]
    Auto,
    /// Display-linear value = radiance (W/m^2/sr) times 2 to this power.
    Ev(f64),
}

/// An exposure that is known as a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ResolvedExposure {
    /// Stops.
    pub ev: f64,
    /// True when `ev` was chosen from the picture.
    pub auto: bool,
}

/// Not an exposure.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("exposure '{value}' is neither 'auto' nor a number of stops in -{MAX_EV}..={MAX_EV}")]
pub struct ExposureError {
    /// What was given.
    pub value: String,
}

impl FromStr for Exposure {
    type Err = ExposureError;

    fn from_str(text: &str) -> Result<Exposure, ExposureError> {
        if text == "auto" {
            return Ok(Exposure::Auto);
        }
        match text.parse::<f64>() {
            Ok(ev) if ev.abs() <= MAX_EV => Ok(Exposure::Ev(ev)),
            _ => Err(ExposureError { value: text.to_owned() }),
        }
    }
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Exposure::Auto => f.write_str("auto"),
            Exposure::Ev(ev) => write!(f, "{ev}"),
        }
    }
}

impl ResolvedExposure {
    /// Display-linear value of unit radiance.
    pub fn scale(self) -> f64 {
        self.ev.exp2()
    }
}

impl Exposure {
    /// The exposure of `film`. Where every pixel shows an emitter, `auto` looks at all of them; a black film has EV 0.
    pub fn resolve(self, film: &Film) -> ResolvedExposure {
        match self {
            Exposure::Ev(ev) => ResolvedExposure { ev, auto: false },
            Exposure::Auto => {
                let surfaces =
                    film.pixels.iter().zip(&film.emitter).filter(|(_, emitter)| !**emitter).map(|(p, _)| p);
                let level = percentile(surfaces.map(|p| p.luminance()))
                    .or_else(|| percentile(film.pixels.iter().map(|p| p.luminance())));
                let ev = level.map_or(0.0, |level| (AUTO_TARGET / level).log2());
                ResolvedExposure { ev: ev.clamp(-MAX_EV, MAX_EV), auto: true }
            }
        }
    }
}

/// The 95th percentile (nearest rank) of the finite values; `None` without a positive answer.
fn percentile(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    if values.is_empty() {
        return None;
    }
    let rank = ((AUTO_PERCENTILE * values.len() as f64).ceil() as usize).clamp(1, values.len());
    let (_, value, _) = values.select_nth_unstable_by(rank - 1, f64::total_cmp);
    (*value > 0.0).then_some(*value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rgb;

    fn film(values: impl IntoIterator<Item = f64>) -> Film {
        let pixels: Vec<Rgb> = values.into_iter().map(Rgb::splat).collect();
        Film::from_pixels(pixels.len(), 1, pixels)
    }

    #[test]
    fn auto_exposure_of_a_ramp_puts_the_95th_percentile_at_three_quarters() {
        let e = Exposure::Auto.resolve(&film((1..=100).map(f64::from)));
        assert!(e.auto);
        assert!((e.scale() * 95.0 - AUTO_TARGET).abs() < 1e-12, "{e:?}");
    }

    #[test]
    fn auto_exposure_with_a_bright_emitter_ignores_it() {
        let mut f = film([1.0, 1.0, 1.0, 1000.0]);
        f.emitter[3] = true;
        assert!((Exposure::Auto.resolve(&f).scale() - AUTO_TARGET).abs() < 1e-12);
    }

    #[test]
    fn auto_exposure_of_emitters_only_looks_at_them() {
        let mut f = film([3.0; 4]);
        f.emitter = vec![true; 4];
        assert!((Exposure::Auto.resolve(&f).scale() - 0.25).abs() < 1e-12);
    }

    #[test]
    fn auto_exposure_of_black_and_of_no_pixels_is_zero() {
        assert_eq!(Exposure::Auto.resolve(&film([0.0; 4])).ev, 0.0);
        assert_eq!(Exposure::Auto.resolve(&film([])).ev, 0.0);
    }

    #[test]
    fn exposure_text_is_auto_or_a_limited_number() {
        assert_eq!("auto".parse(), Ok(Exposure::Auto));
        assert_eq!("-1.5".parse(), Ok(Exposure::Ev(-1.5)));
        for bad in ["", "bright", "nan", "inf", "61"] {
            assert!(bad.parse::<Exposure>().is_err(), "{bad}");
        }
    }
}
