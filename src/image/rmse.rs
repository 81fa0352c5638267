//! How far a rendered picture is from a reference: RMSE of luminance, lamps and outliers apart.
//!
//! ```text
//! films --luminance, at most 4 means of the reference; no pixel within one of a lamp--> RMS difference / mean
//! ```
//! Borders of lamps in a picture are noise of the camera's samples, hundreds of times the mean; what is over four means is
//! told apart by no screen.

use super::Film;

/// Luminances over this many means count as so many.
const CLAMP: f64 = 4.0;

/// Root of the mean square difference of linear luminance over the mean of the reference; the pixels within one of a directly
/// seen emitter of the reference are left out.
///
/// # Panics
/// When the sizes differ.
pub fn rmse(film: &Film, reference: &Film) -> f64 {
    assert_eq!((film.width, film.height), (reference.width, reference.height), "pictures of one size");
    let (width, height) = (reference.width as isize, reference.height as isize);
    let emits = |x: isize, y: isize| {
        (0..width).contains(&x) && (0..height).contains(&y) && reference.emitter[(y * width + x) as usize]
    };
    let near_emitter = |i: usize| {
        let (x, y) = (i as isize % width, i as isize / width);
        (-1..=1).any(|dy| (-1..=1).any(|dx| emits(x + dx, y + dy)))
    };
    let counted: Vec<usize> = (0..reference.pixels.len()).filter(|i| !near_emitter(*i)).collect();
    let n = counted.len().max(1) as f64;
    let mean = counted.iter().map(|i| reference.pixels[*i].luminance()).sum::<f64>() / n;
    if mean <= 0.0 {
        return 0.0;
    }
    let clamped = |of: &Film, i: usize| of.pixels[i].luminance().min(CLAMP * mean);
    let square = |i: &usize| (clamped(film, *i) - clamped(reference, *i)).powi(2);
    (counted.iter().map(square).sum::<f64>() / n).sqrt() / mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rgb;

    #[test]
    fn rmse_is_relative_leaves_out_surroundings_of_lamps_and_clamps_outliers() {
        let grey = |values: &[f64], emitter: &[usize]| Film {
            width: 5,
            height: 1,
            pixels: values.iter().map(|v| Rgb::splat(*v)).collect(),
            emitter: (0..5).map(|i| emitter.contains(&i)).collect(),
        };
        let reference = grey(&[2.0, 2.0, 2.0, 2.0, 2.0], &[]);
        assert!((rmse(&grey(&[2.2, 2.0, 2.0, 2.0, 2.0], &[]), &reference) - 0.1 / 5f64.sqrt()).abs() < 1e-12);
        // A thousand means count as four: three over.
        assert!((rmse(&grey(&[2e3, 2.0, 2.0, 2.0, 2.0], &[]), &reference) - 3.0 / 5f64.sqrt()).abs() < 1e-12);
        let lamp = grey(&[9.0, 2.0, 2.0, 2.0, 2.0], &[0]);
        let other = grey(&[5.0, 7.0, 2.0, 2.0, 2.3], &[0]);
        assert!((rmse(&other, &lamp) - 0.15 / 3f64.sqrt()).abs() < 1e-12);
        assert_eq!(rmse(&reference, &reference), 0.0);
    }
}
