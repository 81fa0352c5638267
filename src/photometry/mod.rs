//! Photometry: what the eye makes of radiant quantities, and the grids on which lighting people measure it.
//!
//! ```text
//! W, W/m^2, W/m^2/sr (RGB) --179 lm/W x Y, Y of Rec. 709--> lm, lx, cd/m^2
//! grid.rs:    plane or surface, spacing of EN 12464-1 --> points, normals, cell areas
//! summary.rs: illuminances of a grid --> E_mean, E_min, E_max, U0 = E_min/E_mean, Ud = E_min/E_max
//! hidden.rs:  points that lie inside or behind surfaces
//! ```
//! Photometric input of scene files is divided by the same 179 lm/W, so that lux out equals lux in, whatever the true
//! efficacy of a lamp's spectrum. Source: EN 12464-1:2011 (grids, uniformity).
//!
//! Not modelled: spectra, mesopic vision, glare.

use crate::units::{Irradiance, Radiance, Rgb};

mod grid;
mod hidden;
mod summary;

pub use grid::{Grid, GridError, GridPlace, GridPoint, GridSpec, en_12464_1_counts, en_12464_1_spacing_m};
pub use hidden::hidden_behind;
pub use summary::GridSummary;

/// Luminous efficacy that relates photometric to radiometric quantities, both ways (lm/W).
pub const LUMENS_PER_WATT: f64 = 179.0;

/// The photometric quantity that belongs to a radiometric one: W to lm, W/m^2 to lx, W/sr to cd, W/m^2/sr to cd/m^2.
pub fn photometric(radiometric: Rgb) -> f64 {
    LUMENS_PER_WATT * radiometric.luminance()
}

impl Irradiance {
    /// Illuminance (lx).
    pub fn illuminance_lx(self) -> f64 {
        photometric(self.0)
    }
}

impl Radiance {
    /// Luminance (cd/m^2).
    pub fn luminance_cd_m2(self) -> f64 {
        photometric(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Radiosity;

    #[test]
    fn white_watt_is_179_lumens_and_channels_weigh_as_rec_709() {
        assert!((photometric(Rgb::WHITE) - 179.0).abs() < 1e-12);
        let of = |rgb| photometric(Rgb(rgb)) / 179.0;
        assert!((of([1.0, 0.0, 0.0]) - 0.2126).abs() < 1e-12);
        assert!((of([0.0, 1.0, 0.0]) - 0.7152).abs() < 1e-12);
        assert!((of([0.0, 0.0, 1.0]) - 0.0722).abs() < 1e-12);
    }

    #[test]
    fn matt_white_wall_under_pi_lux_has_a_luminance_of_one_candela_a_square_metre() {
        let irradiance = Irradiance(Rgb::splat(std::f64::consts::PI / LUMENS_PER_WATT));
        assert!((irradiance.illuminance_lx() - std::f64::consts::PI).abs() < 1e-12);
        let radiance = Radiosity::of(Rgb::BLACK, Rgb::WHITE, irradiance).radiance();
        assert!((radiance.luminance_cd_m2() - 1.0).abs() < 1e-12);
    }
}
