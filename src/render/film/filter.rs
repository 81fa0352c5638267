//! Reconstruction filters: from the rays of a neighbourhood of pixels to one pixel.
//!
//! ```text
//! pixel p = sum_q 1/n_q sum_k f(p - x_qk) L_qk / sum_q 1/n_q sum_k f(p - x_qk)      q: pixels near p, k: the n_q rays of q
//! ```
//! 1/n_q: a pixel with many rays counts as much as one with few, else adaptive sampling would pull light towards where the
//! rays are. Gathered pixel by pixel in a fixed order: the same bits for any number of threads and any order of casting.
//! `box`, `tent` and `mitchell` add up to 1 over the pixels around any point, `gaussian` is made to: with as many rays in
//! every pixel, light is kept, and a flat picture stays flat.
//! Mitchell's lobes are negative beyond one pixel: what they make negative is made 0, and counted.
//! Source: Mitchell, Netravali 1988, "Reconstruction filters in computer graphics" (B = C = 1/3).

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::places::Places;
use super::region::Region;
use crate::units::Rgb;

/// A reconstruction filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Filter {
    /// The mean of the pixel's own rays: what a pixel of a light meter shows.
    #[default]
    Box,
    /// Falls to 0 at the neighbours' centres.
    Tent,
    /// Standard deviation half a pixel, cut off at 1.5 pixels.
    Gaussian,
    /// Mitchell and Netravali's cubic, 2 pixels: sharp, with negative lobes.
    Mitchell,
}

/// Where the Gaussian ends (pixels).
const GAUSSIAN_RADIUS: f64 = 1.5;

impl Filter {
    /// Its name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Filter::Box => "box",
            Filter::Tent => "tent",
            Filter::Gaussian => "gaussian",
            Filter::Mitchell => "mitchell",
        }
    }

    /// How many pixels away a ray still counts.
    pub fn reach(self) -> u32 {
        match self {
            Filter::Box => 0,
            Filter::Tent => 1,
            Filter::Gaussian | Filter::Mitchell => 2,
        }
    }

    /// Its value at a distance (pixels) along one axis, not normalised.
    fn value(self, x: f64) -> f64 {
        let own = -0.5 < x && x <= 0.5;
        let x = x.abs();
        match self {
            Filter::Box => f64::from(u8::from(own)),
            Filter::Tent => (1.0 - x).max(0.0),
            Filter::Gaussian => {
                let bell = |x: f64| (-2.0 * x * x).exp();
                (bell(x) - bell(GAUSSIAN_RADIUS)).max(0.0)
            }
            Filter::Mitchell if x < 1.0 => ((7.0 * x - 12.0) * x * x + 16.0 / 3.0) / 6.0,
            Filter::Mitchell if x < 2.0 => (((-7.0 / 3.0 * x + 12.0) * x - 20.0) * x + 32.0 / 3.0) / 6.0,
            Filter::Mitchell => 0.0,
        }
    }

    /// Weights along one axis of a ray at place `u` of its pixel for the pixels -reach..=reach from it; their sum is 1.
    fn weights(self, u: f64) -> [f64; 5] {
        let reach = self.reach() as i32;
        let mut weights = [0.0; 5];
        for d in -reach..=reach {
            // Centre of pixel d less the ray.
            weights[(d + 2) as usize] = self.value(f64::from(d) + 0.5 - u);
        }
        let sum: f64 = weights.iter().sum();
        weights.map(|w| w / sum)
    }
}

/// A filtered picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Filtered {
    /// Pixels, row by row.
    pub pixels: Vec<Rgb>,
    /// Pixels with a channel that came out negative and was made 0.
    pub n_negative: u64,
}

/// The pixels of `shown` from `rays`, those of the pixels of `based`, whose places are known by their order. A pixel without
/// rays is black.
pub(super) fn gather(
    filter: Filter,
    places: Places,
    shown: Region,
    based: Region,
    rays: &[Vec<Rgb>],
) -> Filtered {
    let most = rays.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let weights: Vec<[[f64; 5]; 2]> = (0..most).map(|k| places.at(k).map(|u| filter.weights(u))).collect();
    let reach = filter.reach();
    let pixels: Vec<(Rgb, bool)> = (0..shown.n_pixels())
        .into_par_iter()
        .map(|i| {
            let (x, y) = shown.pixel(i);
            if based.index(x, y).is_none_or(|own| rays[own].is_empty()) {
                return (Rgb::BLACK, false);
            }
            let (mut sum, mut all) = (Rgb::BLACK, 0.0);
            for qy in y.saturating_sub(reach)..=y + reach {
                for qx in x.saturating_sub(reach)..=x + reach {
                    let Some(q) = based.index(qx, qy) else { continue };
                    // From q to p, shifted by 2.
                    let (dx, dy) = ((x + 2 - qx) as usize, (y + 2 - qy) as usize);
                    let share = 1.0 / rays[q].len() as f64;
                    for (radiance, [wx, wy]) in rays[q].iter().zip(&weights) {
                        let weight = share * wx[dx] * wy[dy];
                        sum += *radiance * weight;
                        all += weight;
                    }
                }
            }
            let mean = sum / all;
            (mean.map(|c| c.max(0.0)), mean.min_channel() < 0.0)
        })
        .collect();
    Filtered {
        n_negative: pixels.iter().filter(|(_, negative)| *negative).count() as u64,
        pixels: pixels.into_iter().map(|(radiance, _)| radiance).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTERS: [Filter; 4] = [Filter::Box, Filter::Tent, Filter::Gaussian, Filter::Mitchell];

    fn whole(width: u32, height: u32) -> Region {
        Region::whole(width, height)
    }

    #[test]
    fn filters_add_up_to_one_over_the_pixels_around_any_ray() {
        for filter in FILTERS {
            for i in 0..64 {
                let u = f64::from(i) / 64.0;
                let reach = filter.reach() as i32 + 1;
                let sum: f64 = (-reach..=reach).map(|d| filter.value(f64::from(d) + 0.5 - u)).sum();
                // The Gaussian alone needs its normalisation.
                if filter != Filter::Gaussian {
                    assert!((sum - 1.0).abs() < 1e-12, "{filter:?} at {u}: {sum}");
                }
                let reached: f64 = filter.weights(u).iter().sum();
                assert!((reached - 1.0).abs() < 1e-15, "{filter:?}");
                let far = filter.value(f64::from(reach) + 0.5 - u).abs()
                    + filter.value(-f64::from(reach) + 0.5 - u).abs();
                assert!(far < 1e-15, "{filter:?} reaches farther than it says: {far} at {u}");
            }
        }
    }

    #[test]
    fn mitchell_at_its_nodes_has_the_papers_values() {
        let f = |x: f64| Filter::Mitchell.value(x);
        assert!((f(0.0) - 8.0 / 9.0).abs() < 1e-15 && (f(1.0) - 1.0 / 18.0).abs() < 1e-15 && f(2.0) == 0.0);
        assert!((f(1.0 - 1e-9) - f(1.0)).abs() < 1e-8 && f(2.0 - 1e-9).abs() < 1e-8, "no steps");
        assert!(f(1.5) < 0.0, "negative lobes");
    }

    #[test]
    fn flat_picture_stays_flat_under_every_filter_whatever_the_counts() {
        let value = Rgb([0.3, 7.0, 1e-5]);
        let rays: Vec<Vec<Rgb>> = (0..63).map(|i| vec![value; [1, 4, 16, 8][i % 4]]).collect();
        for filter in FILTERS {
            let picture = gather(filter, Places::Growing(16), whole(9, 7), whole(9, 7), &rays);
            assert_eq!((picture.pixels.len(), picture.n_negative), (63, 0));
            for pixel in &picture.pixels {
                for c in 0..3 {
                    assert!((pixel.0[c] / value.0[c] - 1.0).abs() < 1e-12, "{filter:?}: {pixel:?}");
                }
            }
        }
    }

    #[test]
    fn light_of_a_pixel_far_from_the_border_is_kept_by_every_filter() {
        for filter in FILTERS {
            for n in [1, 2, 4, 7, 16] {
                let mut rays = vec![vec![Rgb::BLACK; n]; 81];
                rays[40] = (0..n).map(|k| Rgb::splat(1.0 + k as f64)).collect();
                // On a floor that keeps the lobes from being cut.
                let lit: Vec<Vec<Rgb>> =
                    rays.iter().map(|q| q.iter().map(|l| *l + Rgb::splat(20.0)).collect()).collect();
                let picture = gather(filter, Places::Fixed(n as u32), whole(9, 9), whole(9, 9), &lit);
                assert_eq!(picture.n_negative, 0);
                let kept: f64 = picture.pixels.iter().map(|p| p.0[0] - 20.0).sum();
                let given = rays[40].iter().map(|l| l.0[0]).sum::<f64>() / n as f64;
                assert!((kept - given).abs() < 1e-10, "{filter:?} {n}: {kept} of {given}");
            }
        }
    }

    #[test]
    fn pixel_with_many_rays_draws_no_more_light_than_one_with_few() {
        let lit = |n: usize| vec![Rgb::WHITE; n];
        let dark = |n: usize| vec![Rgb::BLACK; n];
        for filter in [Filter::Tent, Filter::Gaussian, Filter::Mitchell] {
            // Columns dark, dark, lit, lit, lit; the third with 16 rays or with 1: the dark one beside it stays dark.
            let beside = |n: usize| {
                let rays: Vec<Vec<Rgb>> =
                    (0..25).map(|i| [dark(1), dark(1), lit(n), lit(1), lit(1)][i % 5].clone()).collect();
                gather(filter, Places::Growing(16), whole(5, 5), whole(5, 5), &rays).pixels[11].0[0]
            };
            assert!((beside(16) - beside(1)).abs() < 0.2, "{filter:?}: {} and {}", beside(16), beside(1));
        }
    }

    #[test]
    fn box_gives_the_mean_of_a_pixels_own_rays() {
        let rays: Vec<Vec<Rgb>> = (0..6).map(|i| vec![Rgb::splat(f64::from(i)), Rgb::splat(1.0)]).collect();
        let picture = gather(Filter::Box, Places::Fixed(2), whole(3, 2), whole(3, 2), &rays);
        for (i, pixel) in picture.pixels.iter().enumerate() {
            assert!((pixel.0[1] - (i as f64 + 1.0) / 2.0).abs() < 1e-15);
        }
    }

    #[test]
    fn negative_lobes_beside_a_bright_pixel_are_made_zero_and_counted() {
        let mut rays = vec![vec![Rgb::BLACK]; 49];
        rays[24] = vec![Rgb::splat(1.0)];
        let picture = gather(Filter::Mitchell, Places::Fixed(1), whole(7, 7), whole(7, 7), &rays);
        // One ray in the middle: its weights at distance 1.5 and beyond are 0 or less only off the centre; none here.
        assert_eq!(picture.n_negative, 0);
        let off: Vec<Vec<Rgb>> =
            (0..49).map(|i| vec![Rgb::BLACK, Rgb::splat(f64::from(u8::from(i == 24)))]).collect();
        let picture = gather(Filter::Mitchell, Places::Fixed(2), whole(7, 7), whole(7, 7), &off);
        assert!(picture.n_negative > 0);
        assert!(picture.pixels.iter().all(|p| p.min_channel() >= 0.0));
    }

    #[test]
    fn region_of_a_picture_has_the_bits_of_the_whole() {
        let rays: Vec<Vec<Rgb>> = (0..140_u32)
            .map(|i| (0..1 + i % 5).map(|k| Rgb::splat(f64::from(i * 7 % 13) + 0.1 * f64::from(k))).collect())
            .collect();
        let all = whole(14, 10);
        for filter in FILTERS {
            let picture = gather(filter, Places::Growing(8), all, all, &rays);
            let shown = Region { x: 3, y: 4, width: 6, height: 3 };
            let part = gather(filter, Places::Growing(8), shown, all, &rays);
            for (i, pixel) in part.pixels.iter().enumerate() {
                let (x, y) = shown.pixel(i);
                assert_eq!(*pixel, picture.pixels[(y * 14 + x) as usize], "{filter:?}");
            }
        }
    }
}
