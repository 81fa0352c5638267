//! What a grid of illuminances comes to: mean, extremes, uniformities.
//!
//! ```text
//! (irradiance, cell area) a point --> E_mean (area-weighted), E_min, E_max (lx), U0 = E_min/E_mean, Ud = E_min/E_max
//! ```
//! Cells of one area, which those of a plane are, make E_mean the arithmetic mean of EN 12464-1.

use serde::Serialize;

use crate::units::{Irradiance, Rgb};

/// Mean, extremes and uniformities of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GridSummary {
    /// Points that count.
    pub n_points: usize,
    /// Mean illuminance, weighted with the cells' areas (lx).
    pub mean_lx: f64,
    /// Least illuminance of a point (lx).
    pub min_lx: f64,
    /// Largest illuminance of a point (lx).
    pub max_lx: f64,
    /// Index of the first point with the least.
    pub min_at: usize,
    /// Index of the first point with the largest.
    pub max_at: usize,
    /// Mean irradiance, weighted with the cells' areas (W/m^2).
    pub mean_irradiance_w_m2: Rgb,
    /// U0 = E_min / E_mean; none in the dark.
    pub u0: Option<f64>,
    /// Ud = E_min / E_max; none in the dark.
    pub ud: Option<f64>,
}

impl GridSummary {
    /// The summary of points, each with its irradiance, `None` where it does not count, and its cell's area (m^2);
    /// `None` when no point counts.
    pub fn new(points: impl IntoIterator<Item = (Option<Irradiance>, f64)>) -> Option<GridSummary> {
        let (mut n_points, mut area, mut sum) = (0, 0.0, Rgb::BLACK);
        let (mut min, mut max) = ((f64::INFINITY, 0), (f64::NEG_INFINITY, 0));
        for (i, (irradiance, area_m2)) in points.into_iter().enumerate() {
            let Some(irradiance) = irradiance else { continue };
            let lx = irradiance.illuminance_lx();
            n_points += 1;
            area += area_m2;
            sum += irradiance.0 * area_m2;
            if lx < min.0 {
                min = (lx, i);
            }
            if lx > max.0 {
                max = (lx, i);
            }
        }
        if n_points == 0 {
            return None;
        }
        let mean = sum / area;
        let mean_lx = Irradiance(mean).illuminance_lx();
        let over = |whole: f64| (whole > 0.0).then(|| min.0 / whole);
        Some(GridSummary {
            n_points,
            mean_lx,
            min_lx: min.0,
            max_lx: max.0,
            min_at: min.1,
            max_at: max.1,
            mean_irradiance_w_m2: mean,
            u0: over(mean_lx),
            ud: over(max.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::LUMENS_PER_WATT;

    fn lux(lx: f64) -> Option<Irradiance> {
        Some(Irradiance(Rgb::splat(lx / LUMENS_PER_WATT)))
    }

    #[test]
    fn summary_of_known_illuminances_is_that_by_hand_and_leaves_out_what_does_not_count() {
        let points = [(lux(300.0), 1.0), (None, 1.0), (lux(100.0), 1.0), (lux(500.0), 2.0)];
        let s = GridSummary::new(points).unwrap();
        assert_eq!((s.n_points, s.min_at, s.max_at), (3, 2, 3));
        assert!((s.mean_lx - 350.0).abs() < 1e-9, "{s:?}");
        assert!((s.min_lx - 100.0).abs() < 1e-9 && (s.max_lx - 500.0).abs() < 1e-9, "{s:?}");
        assert!(
            (s.u0.unwrap() - 100.0 / 350.0).abs() < 1e-12 && (s.ud.unwrap() - 0.2).abs() < 1e-12,
            "{s:?}"
        );
        assert!((s.mean_irradiance_w_m2.0[2] - 350.0 / 179.0).abs() < 1e-12);
    }

    #[test]
    fn summary_in_the_dark_has_no_uniformity_and_of_no_points_there_is_none() {
        let dark = GridSummary::new([(lux(0.0), 1.0); 4]).unwrap();
        assert_eq!((dark.mean_lx, dark.u0, dark.ud), (0.0, None, None));
        assert_eq!(GridSummary::new([(None, 1.0)]), None);
    }
}
