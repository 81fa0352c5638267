//! Radiance pictures (.hdr): the linear picture in 8 bit mantissas and one exponent a pixel, for tools of lighting practice.
//!
//! ```text
//! Film --clamp at 0--> R G B E, run lengths --> bytes; the unit is W/m^2/sr, luminance 179 (0.2126 r + 0.7152 g + 0.0722 b)
//! ```
//! A channel is cut down to a multiple of 1/256 of a power of two over the pixel's largest: what readers add half a step to.
//! The header says the primaries, Rec. 709 / D65, since those that Radiance assumes are others.
//!
//! Source: Ward 1991, "Real pixels"; Radiance 5.4, `src/common/color.c`.

use image::Rgb as Pixel;
use image::codecs::hdr::HdrEncoder;

use super::{Film, OutputError};

/// Rec. 709 red, green, blue and the white D65, x and y each.
const PRIMARIES: &str = "PRIMARIES= 0.640 0.330 0.300 0.600 0.150 0.060 0.3127 0.3290\n";
/// What the header of every such file ends with.
const END_OF_HEADER: &[u8] = b"\n\n";

/// The film as a Radiance picture. Negative channels become 0.
///
/// # Errors
/// A film without pixels, or with one beyond the format's exponents.
pub fn encode_hdr(film: &Film) -> Result<Vec<u8>, OutputError> {
    let fault = |what: String| OutputError::Encode { format: "HDR", what };
    if film.pixels.is_empty() {
        return Err(fault(format!("a film of {} x {} pixels", film.width, film.height)));
    }
    // Exponents go from -128 to 127.
    let is_beyond = |x: &f64| x.is_nan() || *x >= 2f64.powi(127);
    if let Some(i) = film.pixels.iter().position(|p| p.0.iter().any(is_beyond)) {
        let (x, y) = (i % film.width, i / film.width);
        return Err(fault(format!("pixel ({x}, {y}) is {:?}, expected less than 2^127", film.pixels[i].0)));
    }
    let pixels: Vec<Pixel<f32>> = film.pixels.iter().map(|p| Pixel(p.0.map(|x| x.max(0.0) as f32))).collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(&pixels, film.width, film.height).map_err(|e| fault(e.to_string()))?;
    let end = bytes.windows(2).position(|pair| pair == END_OF_HEADER);
    let end = end.ok_or_else(|| fault("a header without an end".to_owned()))? + 1;
    bytes.splice(end..end, PRIMARIES.bytes());
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{DynamicImage, ImageFormat, ImageReader};
    use proptest::prelude::*;

    use super::*;
    use crate::units::Rgb;

    fn read(bytes: &[u8]) -> Vec<[f32; 3]> {
        let picture = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Hdr).decode().unwrap();
        let DynamicImage::ImageRgb32F(picture) = picture else { panic!("not of floats") };
        picture.pixels().map(|p| p.0).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn hdr_of_any_film_reads_back_within_a_step_of_each_pixels_largest_channel(
            width in 1usize..40, height in 1usize..6, exponents in prop::collection::vec(-30.0..30.0f64, 8), seed: u64,
        ) {
            let value = |i: usize| {
                let [u, _] = crate::sampling::unit_pair(crate::sampling::hash(seed, i as u64, 0));
                (u - 0.1) * exponents[i % exponents.len()].exp2()
            };
            let pixels: Vec<Rgb> =
                (0..width * height).map(|i| Rgb([value(3 * i), value(3 * i + 1), value(3 * i + 2)])).collect();
            let bytes = encode_hdr(&Film::from_pixels(width, height, pixels.clone())).unwrap();
            for (read, p) in read(&bytes).iter().zip(&pixels) {
                let largest = p.0.iter().copied().fold(0.0, f64::max);
                for (read, x) in read.iter().zip(p.0) {
                    // The mantissa of the largest has its top bit set: a step is at most 1/128 of it.
                    prop_assert!((f64::from(*read) - x.max(0.0)).abs() <= largest / 128.0, "{} {}", read, x);
                }
            }
        }
    }

    #[test]
    fn hdr_header_and_first_pixel_are_those_of_the_format() {
        // Narrow pictures have no run lengths: four bytes a pixel. 1 = 0.5 x 2^1; 0.25 and 0.125 of it.
        let film = Film::from_pixels(2, 1, vec![Rgb([1.0, 0.25, 0.125]), Rgb([-1.0, 0.0, -0.5])]);
        let bytes = encode_hdr(&film).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        assert!(text.starts_with("#?RADIANCE\n") && text.contains("FORMAT=32-bit_rle_rgbe\n"), "{text}");
        assert!(text.contains(PRIMARIES) && text.contains("\n\n-Y 1 +X 2\n"), "{text}");
        assert_eq!(&bytes[bytes.len() - 8..], [128, 32, 16, 129, 0, 0, 0, 0]);
    }

    #[test]
    fn hdr_of_no_pixels_and_of_numbers_beyond_it_is_refused_with_the_place() {
        assert!(encode_hdr(&Film::from_pixels(0, 0, vec![])).is_err());
        for bad in [f64::NAN, f64::INFINITY, 1e39] {
            let film = Film::from_pixels(2, 1, vec![Rgb::splat(1.0), Rgb([0.0, bad, 0.0])]);
            let message = encode_hdr(&film).unwrap_err().to_string();
            assert!(message.contains("pixel (1, 0)") && message.contains("2^127"), "{message}");
        }
    }
}
