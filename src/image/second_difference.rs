//! Second differences of a picture's luminance: where it has creases, which an eye sees as Mach bands.
//!
//! ```text
//! Film --Y, 3 x 3 pixels--> H = | Yxx Yxy |   the eigenvalue of H that is larger in magnitude, over the mean of Y
//!                               | Yxy Yyy |
//! CreaseMap --PNG--> grey 0, white a bright band (the slope falls), black a dark one; a crease is a line
//! ```
//! A crease where the slope changes by k a pixel gives k in all across it, whatever its direction. Borders of objects are
//! far stronger: where the reference has a second difference over 1 % of its mean luminance, [`MachBands`] does not look.
//!
//! Source: Ratliff 1965, Mach Bands, for what an eye makes of second differences.
//! Not modelled: the eye's scale: it takes wider differences from farther away.

use serde::Serialize;

use super::png::{display_byte, encode_rgb, srgb_decode};
use super::{Film, OutputError};

/// The percentile of magnitudes that the automatic scale of a map shows in full.
const SCALE_PERCENTILE: f64 = 0.99;
/// Second difference of the reference (share of its mean luminance) from which on a pixel lies on a border.
const BORDER: f64 = 0.01;
/// Columns of white between the two maps of a pair.
const GAP: usize = 4;
/// Colour of pixels without a value.
const NOTHING: [u8; 3] = [60, 60, 110];

/// Second differences of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct CreaseMap {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Luminance per square of a pixel, over the mean luminance; NaN at the picture's border and beside pixels that are
    /// not finite.
    pub values: Vec<f64>,
}

/// How much of Mach bands two pictures have, over the mean luminance of the first (per square of a pixel).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MachBands {
    /// Pixels with a value in both, without those on borders.
    pub n_pixels: u64,
    /// Pixels on borders: over 1 % in A.
    pub n_border: u64,
    /// RMS second difference of A.
    pub rms_a: f64,
    /// RMS second difference of B.
    pub rms_b: f64,
    /// 99th percentile of the magnitude in A.
    pub p99_a: f64,
    /// 99th percentile of the magnitude in B.
    pub p99_b: f64,
    /// RMS second difference of B - A: creases that B has and A has not.
    pub rms_added: f64,
    /// 99th percentile of the magnitude in B - A.
    pub p99_added: f64,
    /// Column and row of the largest magnitude in B - A; absent where nothing was added.
    pub largest_at: Option<[usize; 2]>,
}

fn mean(luminance: &[f64]) -> f64 {
    let finite = || luminance.iter().filter(|y| y.is_finite());
    finite().sum::<f64>() / finite().count().max(1) as f64
}

/// The map of luminances over `mean`.
fn creases(width: usize, height: usize, luminance: &[f64], mean: f64) -> CreaseMap {
    let value = |k: usize| {
        let (x, y) = (k % width, k / width);
        if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
            return f64::NAN;
        }
        let at = |dx: usize, dy: usize| luminance[(y + dy - 1) * width + x + dx - 1];
        let xx = at(2, 1) - 2.0 * at(1, 1) + at(0, 1);
        let yy = at(1, 2) - 2.0 * at(1, 1) + at(1, 0);
        let xy = 0.25 * (at(2, 2) - at(2, 0) - at(0, 2) + at(0, 0));
        let (half_sum, root) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let largest = if half_sum < 0.0 { half_sum - root } else { half_sum + root };
        if largest == 0.0 { 0.0 } else { largest / mean }
    };
    CreaseMap { width, height, values: (0..width * height).map(value).collect() }
}

/// The second differences of a film, over its mean luminance.
pub fn crease_map(film: &Film) -> CreaseMap {
    let luminance: Vec<f64> = film.pixels.iter().map(|p| p.luminance()).collect();
    creases(film.width, film.height, &luminance, mean(&luminance))
}

/// Compares the creases of two films of one size; `None` when no pixel of both has a second difference, or A is dark.
///
/// # Panics
/// When the sizes differ.
pub fn mach_bands(a: &Film, b: &Film) -> Option<MachBands> {
    assert!((a.width, a.height) == (b.width, b.height), "films of one size");
    let of = |film: &Film| film.pixels.iter().map(|p| p.luminance()).collect::<Vec<f64>>();
    let (ya, yb) = (of(a), of(b));
    let mean = mean(&ya);
    let added: Vec<f64> = ya.iter().zip(&yb).map(|(a, b)| b - a).collect();
    let [ca, cb, cd] = [&ya, &yb, &added].map(|y| creases(a.width, a.height, y, mean).values);
    let (border, known): (Vec<usize>, Vec<usize>) =
        (0..cd.len()).filter(|&k| cd[k].is_finite()).partition(|&k| ca[k].abs() > BORDER);
    if known.is_empty() || mean <= 0.0 {
        return None;
    }
    let rms = |c: &[f64]| (known.iter().map(|&k| c[k] * c[k]).sum::<f64>() / known.len() as f64).sqrt();
    let p99 = |c: &[f64]| percentile(known.iter().map(|&k| c[k]));
    let largest = known.iter().copied().max_by(|&i, &j| cd[i].abs().total_cmp(&cd[j].abs()).then(j.cmp(&i)));
    Some(MachBands {
        n_pixels: known.len() as u64,
        n_border: border.len() as u64,
        rms_a: rms(&ca),
        rms_b: rms(&cb),
        p99_a: p99(&ca),
        p99_b: p99(&cb),
        rms_added: rms(&cd),
        p99_added: p99(&cd),
        largest_at: largest.filter(|&k| cd[k] != 0.0).map(|k| [k % a.width, k / a.width]),
    })
}

/// [`SCALE_PERCENTILE`] of the magnitudes; 0 of none.
fn percentile(values: impl Iterator<Item = f64>) -> f64 {
    let mut magnitudes: Vec<f64> = values.map(f64::abs).filter(|v| v.is_finite()).collect();
    let place =
        ((magnitudes.len() as f64 * SCALE_PERCENTILE) as usize).min(magnitudes.len().saturating_sub(1));
    if magnitudes.is_empty() { 0.0 } else { *magnitudes.select_nth_unstable_by(place, f64::total_cmp).1 }
}

impl CreaseMap {
    /// The magnitude that an automatic scale shows as white or black: the 99th percentile of what is under a border's.
    pub fn scale(&self) -> f64 {
        percentile(self.values.iter().copied().filter(|v| v.abs() <= BORDER))
    }

    fn colour(&self, x: usize, y: usize, scale: f64) -> [u8; 3] {
        let value = self.values[y * self.width + x];
        if value.is_nan() {
            return NOTHING;
        }
        // Even steps of lightness: encoded values, not light.
        let share = if scale > 0.0 { (value / scale).clamp(-1.0, 1.0) } else { 0.0 };
        [display_byte(srgb_decode(0.5 - 0.5 * share)); 3]
    }
}

/// Maps side by side as a PNG file, magnitudes of `scale` white and black.
///
/// # Errors
/// No map or maps without pixels, maps of several heights, or too large ones for the format.
pub fn encode_crease_maps(maps: &[&CreaseMap], scale: f64) -> Result<Vec<u8>, OutputError> {
    let height = maps.first().map_or(0, |m| m.height);
    if maps.iter().any(|m| m.height != height) {
        return Err(OutputError::Encode { format: "PNG", what: "maps of several heights".to_owned() });
    }
    let mut data: Vec<u8> = Vec::new();
    for y in 0..height {
        for (i, map) in maps.iter().enumerate() {
            let gap = if i > 0 { GAP } else { 0 };
            data.extend(std::iter::repeat_n(255, 3 * gap));
            data.extend((0..map.width).flat_map(|x| map.colour(x, y, scale)));
        }
    }
    let width = maps.iter().map(|m| m.width).sum::<usize>() + GAP * maps.len().saturating_sub(1);
    encode_rgb(width, height, &data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rgb;

    fn film(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Film {
        let pixel = |k: usize| Rgb::splat(f((k % width) as f64, (k / width) as f64));
        Film::from_pixels(width, height, (0..width * height).map(pixel).collect())
    }

    fn at(map: &CreaseMap, x: usize, y: usize) -> f64 {
        map.values[y * map.width + x]
    }

    #[test]
    fn second_differences_of_a_quadratic_are_its_curvature_and_the_border_has_none() {
        // Principal curvatures 2 k and 0 along a slanted direction.
        let (k, nx, ny) = (0.01, 0.6, 0.8);
        let f = film(16, 12, |x, y| 5.0 + k * (nx * x + ny * y).powi(2));
        let mean = f.mean_luminance();
        let map = crease_map(&f);
        for y in 0..12 {
            for x in 0..16 {
                let border = x == 0 || y == 0 || x == 15 || y == 11;
                let value = at(&map, x, y);
                assert_eq!(value.is_nan(), border, "({x}, {y})");
                assert!(border || (value - 2.0 * k / mean).abs() < 1e-12, "({x}, {y}): {value}");
            }
        }
        assert!((map.scale() - 2.0 * k / mean).abs() < 1e-12);
    }

    #[test]
    fn crease_shows_as_a_line_of_its_change_of_slope_on_flat_ground() {
        let slope = 0.02;
        let f = film(21, 9, |x, _| 1.0 + slope * (x - 10.0).max(0.0));
        let (map, mean) = (crease_map(&f), f.mean_luminance());
        for y in 1..8 {
            for x in 1..20 {
                let expected = if x == 10 { slope / mean } else { 0.0 };
                assert!((at(&map, x, y) - expected).abs() < 1e-12, "({x}, {y}): {}", at(&map, x, y));
            }
        }
        // The slope rises: a dark band.
        let bytes = encode_crease_maps(&[&map, &map], slope / mean).unwrap();
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        assert_eq!((info.width, info.height), (2 * 21 + GAP as u32, 9));
        let pixel = |x: usize| data[3 * (4 * info.width as usize + x)];
        assert_eq!([pixel(9), pixel(10), pixel(11), pixel(21), pixel(21 + GAP + 10)], [128, 0, 128, 255, 0]);
    }

    #[test]
    fn mach_bands_that_only_the_second_film_has_are_what_was_added() {
        let base = |x: f64, y: f64| 2.0 + 0.05 * x + 0.02 * (y - 4.0).max(0.0);
        let a = film(12, 10, base);
        let b = film(12, 10, |x, y| base(x, y) + 0.01 * (x - 6.0).max(0.0));
        let bands = mach_bands(&a, &b).unwrap();
        let mean = a.mean_luminance();
        assert_eq!(bands.n_pixels, 10 * 8);
        // One of 10 columns, one of 8 rows.
        assert!((bands.rms_added - 0.01 / mean / 10.0_f64.sqrt()).abs() < 1e-12);
        assert!((bands.rms_a - 0.02 / mean / 8.0_f64.sqrt()).abs() < 1e-12);
        assert!((bands.p99_added - 0.01 / mean).abs() < 1e-12);
        assert!(bands.rms_b > bands.rms_a && bands.largest_at.is_some_and(|[x, _]| x == 6), "{bands:?}");
        // A border is left out, whatever lies on it.
        let step = |k: f64| film(12, 10, move |x, y| base(x, y) + k * f64::from(u8::from(x > 8.0)));
        let bordered = mach_bands(&step(1.0), &step(1.5)).unwrap();
        assert_eq!((bordered.n_border, bordered.n_pixels), (2 * 8, 8 * 8));
        assert!(bordered.rms_added < 1e-12, "{bordered:?}");
        let same = mach_bands(&a, &a).unwrap();
        assert_eq!((same.rms_added, same.largest_at), (0.0, None));
    }

    #[test]
    fn mach_bands_of_films_without_an_inner_pixel_or_without_light_are_none() {
        let dark = film(5, 5, |_, _| 0.0);
        assert_eq!(mach_bands(&dark, &dark), None);
        let thin = film(4, 1, |x, _| x);
        assert_eq!(mach_bands(&thin, &thin), None);
        assert!(encode_crease_maps(&[], 1.0).is_err());
        assert!(encode_crease_maps(&[&crease_map(&thin), &crease_map(&dark)], 1.0).is_err());
    }

    #[test]
    fn pixels_beside_one_that_is_not_finite_have_no_value() {
        let f = film(7, 7, |x, y| if (x, y) == (3.0, 3.0) { f64::NAN } else { 1.0 + x });
        let map = crease_map(&f);
        assert_eq!(map.values.iter().filter(|v| v.is_finite()).count(), 25 - 9);
        assert!(map.scale() < 1e-12);
    }
}
