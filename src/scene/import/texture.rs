//! Pictures on surfaces: their mean color, which is all that a diffuse solution of one reflectance a surface keeps.
//!
//! ```text
//! PNG, JPEG bytes --decode--> 8-bit pixels --sRGB to linear, weighted by alpha--> mean in [0, 1] per channel
//! ```

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::units::Rgb;

/// Largest picture (pixels).
const MAX_PIXELS: u64 = 1 << 26;

/// Largest side (pixels).
const MAX_SIDE: usize = 1 << 15;

/// What the numbers of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Coding {
    /// Colors as monitors take them (IEC 61966-2-1).
    Srgb,
    /// Data.
    Linear,
}

/// The mean of a PNG or JPEG picture, or why it has none.
pub(super) fn mean(bytes: &[u8], coding: Coding) -> Result<Rgb, String> {
    let to_linear: Vec<f64> = (0..=255_u8).map(|b| linear(b, coding)).collect();
    let mut sum = Sum { to_linear: &to_linear, rgb: [0.0; 3], weight: 0.0 };
    if bytes.starts_with(b"\x89PNG") {
        png(bytes, &mut sum)?;
    } else if bytes.starts_with(b"\xff\xd8") {
        jpeg(bytes, &mut sum)?;
    } else {
        return Err("expected a PNG or JPEG picture".to_owned());
    }
    Ok(if sum.weight > 0.0 { Rgb(sum.rgb) / sum.weight } else { Rgb::BLACK })
}

fn linear(byte: u8, coding: Coding) -> f64 {
    let c = f64::from(byte) / 255.0;
    match coding {
        Coding::Linear => c,
        Coding::Srgb if c <= 0.04045 => c / 12.92,
        Coding::Srgb => ((c + 0.055) / 1.055).powf(2.4),
    }
}

struct Sum<'a> {
    to_linear: &'a [f64],
    rgb: [f64; 3],
    weight: f64,
}

impl Sum<'_> {
    /// Adds pixels of 1 (grey), 2 (grey, alpha), 3 or 4 bytes.
    fn add(&mut self, bytes: &[u8], channels: usize) {
        for pixel in bytes.chunks_exact(channels) {
            let (color, alpha) = match *pixel {
                [v] => ([v, v, v], 255),
                [v, a] => ([v, v, v], a),
                [r, g, b] => ([r, g, b], 255),
                [r, g, b, a] => ([r, g, b], a),
                _ => continue,
            };
            let weight = f64::from(alpha) / 255.0;
            for (sum, c) in self.rgb.iter_mut().zip(color) {
                *sum += weight * self.to_linear[c as usize];
            }
            self.weight += weight;
        }
    }
}

fn png(bytes: &[u8], sum: &mut Sum<'_>) -> Result<(), String> {
    let fault = |e: png::DecodingError| format!("a damaged PNG: {e}");
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(fault)?;
    let info = reader.info();
    size_allowed(info.width as usize, info.height as usize)?;
    let channels = reader.output_color_type().0.samples();
    // Interlaced pictures come in passes of their own row lengths: each pixel once all the same.
    while let Some(row) = reader.next_row().map_err(fault)? {
        sum.add(row.data(), channels);
    }
    Ok(())
}

fn jpeg(bytes: &[u8], sum: &mut Sum<'_>) -> Result<(), String> {
    let options = DecoderOptions::default()
        .set_max_width(MAX_SIDE)
        .set_max_height(MAX_SIDE)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| format!("a damaged JPEG: {e}"))?;
    if let Some((width, height)) = decoder.dimensions() {
        size_allowed(width, height)?;
    }
    let pixels = decoder.decode().map_err(|e| format!("a damaged JPEG: {e}"))?;
    sum.add(&pixels, 3);
    Ok(())
}

fn size_allowed(width: usize, height: usize) -> Result<(), String> {
    let n = (width as u64).saturating_mul(height as u64);
    if width > MAX_SIDE || height > MAX_SIDE || n > MAX_PIXELS {
        return Err(format!(
            "{width} x {height} pixels, expected at most {MAX_PIXELS} and {MAX_SIDE} a side"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_of_a_black_and_white_checker_is_half_in_linear_light() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 4, 2);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&[0, 255, 0, 255, 255, 0, 255, 0]).unwrap();
        assert_eq!(mean(&bytes, Coding::Srgb).unwrap(), Rgb::splat(0.5));
        assert!(mean(&bytes[..40], Coding::Srgb).unwrap_err().contains("PNG"));
        assert!(mean(b"GIF89a", Coding::Srgb).unwrap_err().contains("expected"));
    }

    #[test]
    fn mean_of_an_srgb_grey_follows_the_curve_and_transparent_pixels_do_not_count() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(png::ColorType::Rgba);
        encoder.write_header().unwrap().write_image_data(&[188, 188, 188, 255, 0, 0, 0, 0]).unwrap();
        let grey = mean(&bytes, Coding::Srgb).unwrap().0[1];
        assert!((grey - ((188.0 / 255.0 + 0.055) / 1.055_f64).powf(2.4)).abs() < 1e-12, "{grey}");
        assert_eq!(mean(&bytes, Coding::Linear).unwrap(), Rgb::splat(188.0 / 255.0));
    }
}
