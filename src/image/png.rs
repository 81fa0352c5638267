//! PNG: 8 bit sRGB of an exposed film.
//!
//! ```text
//! radiance * 2^EV --clamp to [0,1]--> display-linear --sRGB transfer--> * 255, to nearest --> bytes
//! ```
//! Channels are clamped one by one: an overexposed lamp turns white, as on photographic film.
//!
//! Source: IEC 61966-2-1 (the sRGB transfer function). Not modelled: dithering, a film curve.

use super::{Film, OutputError, ResolvedExposure};

/// The sRGB transfer function: display-linear [0, 1] to encoded [0, 1].
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_encode`].
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// One channel as a byte. A NaN becomes 0, so that it shows as black and never as a random value.
pub fn display_byte(display_linear: f64) -> u8 {
    if display_linear.is_nan() {
        return 0;
    }
    (srgb_encode(display_linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// The film as a PNG file.
///
/// # Errors
/// A film without pixels, or one too large for the format.
pub fn encode_png(film: &Film, exposure: ResolvedExposure) -> Result<Vec<u8>, OutputError> {
    let scale = exposure.scale();
    let data: Vec<u8> = film.pixels.iter().flat_map(|p| p.0.map(|c| display_byte(c * scale))).collect();
    encode_rgb(film.width, film.height, &data)
}

/// Counts as grey levels of a PNG file: black none, white `most`, even steps of the encoded value.
///
/// # Errors
/// As [`encode_png`].
pub fn encode_counts(width: usize, height: usize, counts: &[u8], most: u32) -> Result<Vec<u8>, OutputError> {
    let most = f64::from(most.max(1));
    let grey = |n: &u8| [(255.0 * f64::from(*n) / most).round().min(255.0) as u8; 3];
    let data: Vec<u8> = counts.iter().flat_map(grey).collect();
    encode_rgb(width, height, &data)
}

/// sRGB bytes, three a pixel, as a PNG file.
///
/// # Errors
/// As [`encode_png`].
pub(crate) fn encode_rgb(width: usize, height: usize, data: &[u8]) -> Result<Vec<u8>, OutputError> {
    let fault = |what: String| OutputError::Encode { format: "PNG", what };
    let size = |n: usize| u32::try_from(n).map_err(|_| fault(format!("{n} pixels in a row or column")));
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, size(width)?, size(height)?);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().map_err(|e| fault(e.to_string()))?;
    writer.write_image_data(data).map_err(|e| fault(e.to_string()))?;
    writer.finish().map_err(|e| fault(e.to_string()))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rgb;

    #[test]
    fn srgb_transfer_at_known_points_matches_the_standard() {
        assert_eq!(display_byte(0.0), 0);
        assert_eq!(display_byte(1.0), 255);
        assert_eq!(display_byte(0.5), 188);
        assert!((srgb_encode(0.214_041_14) - 0.5).abs() < 1e-7);
        assert!((srgb_encode(0.003_130_8) - 0.040_45).abs() < 1e-5);
    }

    #[test]
    fn srgb_decode_of_every_byte_encodes_back_to_it() {
        for byte in 0..=255u8 {
            assert_eq!(display_byte(srgb_decode(f64::from(byte) / 255.0)), byte);
        }
    }

    #[test]
    fn display_byte_outside_the_range_is_clamped() {
        assert_eq!(display_byte(-1.0), 0);
        assert_eq!(display_byte(f64::INFINITY), 255);
        assert_eq!(display_byte(f64::NAN), 0);
    }

    #[test]
    fn png_of_four_pixels_decodes_to_the_exposed_bytes_in_row_order() {
        let pixels = vec![Rgb([1.0, 0.0, 0.0]), Rgb([0.0, 1.0, 0.0]), Rgb([0.0, 0.0, 1.0]), Rgb::splat(0.25)];
        let film = Film::from_pixels(2, 2, pixels);
        let bytes = encode_png(&film, ResolvedExposure { ev: 1.0, auto: false }).unwrap();
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        assert_eq!((info.width, info.height), (2, 2));
        assert_eq!(data, [255, 0, 0, 0, 255, 0, 0, 0, 255, 188, 188, 188]);
    }

    #[test]
    fn png_of_no_pixels_is_refused() {
        let film = Film::from_pixels(0, 0, vec![]);
        assert!(encode_png(&film, ResolvedExposure { ev: 0.0, auto: false }).is_err());
    }
}
