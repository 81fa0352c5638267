//! How two pictures differ.
//!
//! ```text
//! Film A (the reference), Film B --difference--> Difference
//! pixel difference d = max over channels |b - a|      relative to the mean luminance of A
//! RMSE = sqrt(mean over pixels of (Y(b) - Y(a))^2) / mean Y(a)
//! ```
//! Not modelled: perceptual metrics; Mach bands are those of [`super::second_difference`].

use serde::Serialize;

use super::Film;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Pixels of each picture.
    pub n_pixels: u64,
    /// Pixels that differ at all.
    pub n_differing: u64,
    /// Pixels that differ by more than 1 % of A's mean luminance.
    pub n_over_1_percent: u64,
    /// Pixels that differ by more than 5 % of A's mean luminance.
    pub n_over_5_percent: u64,
    /// The caller's threshold, as a share of A's mean luminance.
    pub threshold: Option<f64>,
    /// Pixels that differ by more than `threshold`.
    pub n_over_threshold: u64,
    /// Pixels that are not finite in one or both pictures; they differ unless they are the same bits.
    pub n_not_finite: u64,
    /// Largest pixel difference (W/m^2/sr), among pixels that are finite in both.
    #[serde(rename = "max_absolute_w_m2_sr")]
    pub max_absolute: f64,
    /// The same over A's mean luminance; infinite when that is 0 and the pictures differ.
    pub max_relative: f64,
    /// Column and row of the largest difference; absent when no finite pixel differs.
    pub max_at: Option<[usize; 2]>,
    /// Root mean square of the luminance difference over A's mean luminance.
    pub rmse_relative: f64,
    /// Mean luminance of A (W/m^2/sr).
    #[serde(rename = "mean_luminance_a_w_m2_sr")]
    pub mean_luminance_a: f64,
    /// Mean luminance of B (W/m^2/sr).
    #[serde(rename = "mean_luminance_b_w_m2_sr")]
    pub mean_luminance_b: f64,
}

/// Pictures that cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the pictures differ in size: {} x {} and {} x {} pixels", a[0], a[1], b[0], b[1])]
pub struct DifferenceError {
    /// Width and height of A.
    pub a: [usize; 2],
    /// Width and height of B.
    pub b: [usize; 2],
}

/// Compares `b` with the reference `a`; pixels over `threshold` (a share of A's mean luminance) are counted.
///
/// # Errors
/// When the sizes differ.
pub fn difference(a: &Film, b: &Film, threshold: Option<f64>) -> Result<Difference, DifferenceError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(DifferenceError { a: [a.width, a.height], b: [b.width, b.height] });
    }
    let finite_mean = |film: &Film| {
        let finite: Vec<f64> = film.pixels.iter().filter(|p| p.is_finite()).map(|p| p.luminance()).collect();
        if finite.is_empty() { 0.0 } else { finite.iter().sum::<f64>() / finite.len() as f64 }
    };
    let (mean_a, mean_b) = (finite_mean(a), finite_mean(b));
    let mut d = Difference {
        n_pixels: a.pixels.len() as u64,
        n_differing: 0,
        n_over_1_percent: 0,
        n_over_5_percent: 0,
        threshold,
        n_over_threshold: 0,
        n_not_finite: 0,
        max_absolute: 0.0,
        max_relative: 0.0,
        max_at: None,
        rmse_relative: 0.0,
        mean_luminance_a: mean_a,
        mean_luminance_b: mean_b,
    };
    let relative = |x: f64| if x == 0.0 { 0.0 } else { x / mean_a };
    let mut square_sum = 0.0;
    for (i, (pa, pb)) in a.pixels.iter().zip(&b.pixels).enumerate() {
        let (same, absolute) = if pa.is_finite() && pb.is_finite() {
            let delta = *pb - *pa;
            square_sum += delta.luminance() * delta.luminance();
            let absolute = delta.map(f64::abs).max_channel();
            if absolute > d.max_absolute {
                d.max_absolute = absolute;
                d.max_at = Some([i % a.width, i / a.width]);
            }
            (absolute == 0.0, absolute)
        } else {
            d.n_not_finite += 1;
            let same = pa.0.map(f64::to_bits) == pb.0.map(f64::to_bits);
            (same, if same { 0.0 } else { f64::INFINITY })
        };
        let share = relative(absolute);
        d.n_differing += u64::from(!same);
        d.n_over_1_percent += u64::from(share > 0.01);
        d.n_over_5_percent += u64::from(share > 0.05);
        d.n_over_threshold += u64::from(threshold.is_some_and(|limit| share > limit));
    }
    d.max_relative = relative(d.max_absolute);
    d.rmse_relative = relative((square_sum / (d.n_pixels.max(1) as f64)).sqrt());
    Ok(d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rgb;

    fn grey(values: &[f64]) -> Film {
        Film::from_pixels(values.len() / 2, 2, values.iter().map(|v| Rgb::splat(*v)).collect())
    }

    #[test]
    fn difference_of_a_film_with_itself_is_nothing() {
        let f = grey(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let d = difference(&f, &f, Some(0.0)).unwrap();
        assert_eq!((d.n_pixels, d.n_differing, d.n_over_threshold, d.max_at), (6, 0, 0, None));
        assert_eq!((d.max_absolute, d.rmse_relative), (0.0, 0.0));
    }

    #[test]
    fn difference_of_known_films_gives_counts_place_and_rmse() {
        // Mean of A is 2; the differences are 0, 0.01, 0.06 and 0.2: 0, 0.5, 3 and 10 % of the mean.
        let a = grey(&[2.0, 2.0, 2.0, 2.0]);
        let b = grey(&[2.0, 2.01, 1.94, 2.2]);
        let d = difference(&a, &b, Some(0.02)).unwrap();
        assert_eq!((d.n_differing, d.n_over_1_percent, d.n_over_5_percent, d.n_over_threshold), (3, 2, 1, 2));
        assert_eq!(d.max_at, Some([1, 1]));
        assert!((d.max_absolute - 0.2).abs() < 1e-12 && (d.max_relative - 0.1).abs() < 1e-12);
        let rmse = ((0.0001 + 0.0036 + 0.04) / 4.0f64).sqrt() / 2.0;
        assert!((d.rmse_relative - rmse).abs() < 1e-12, "{}", d.rmse_relative);
    }

    #[test]
    fn difference_in_one_channel_counts() {
        let a = Film::from_pixels(1, 1, vec![Rgb([1.0, 1.0, 1.0])]);
        let b = Film::from_pixels(1, 1, vec![Rgb([1.0, 1.0, 1.0 + 1e-12])]);
        assert_eq!(difference(&a, &b, None).unwrap().n_differing, 1);
    }

    #[test]
    fn difference_of_sizes_is_an_error_with_both() {
        let message = difference(&grey(&[0.0; 4]), &grey(&[0.0; 6]), None).unwrap_err().to_string();
        assert!(message.contains("2 x 2") && message.contains("3 x 2"), "{message}");
    }

    #[test]
    fn difference_from_black_is_over_every_threshold() {
        let d = difference(&grey(&[0.0; 4]), &grey(&[0.0, 0.0, 0.0, 1.0]), Some(1e9)).unwrap();
        assert_eq!(d.n_over_threshold, 1);
        assert!(d.max_relative.is_infinite());
    }

    #[test]
    fn difference_with_nan_counts_it_and_keeps_the_rest() {
        let d = difference(&grey(&[1.0; 4]), &grey(&[f64::NAN, 1.0, 1.0, 2.0]), Some(0.5)).unwrap();
        assert_eq!((d.n_not_finite, d.n_differing, d.n_over_threshold), (1, 2, 2));
        assert!(d.rmse_relative.is_finite() && d.max_absolute == 1.0);
    }
}
