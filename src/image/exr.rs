//! OpenEXR: the linear picture, three f32 channels R, G, B, without loss beyond f32.
//!
//! ```text
//! Film --encode_exr--> bytes (scan lines, ZIP)          file --read_exr--> Film (no emitter mask)
//! ```
//! Primaries are Rec. 709 / D65, the format's default; the unit is W/m^2/sr.

use std::io::{Cursor, ErrorKind};
use std::path::{Path, PathBuf};

use ::exr::prelude::{
    Encoding, Image, ReadChannels, ReadLayers, SpecificChannels, Vec2, WritableImage, read,
};

use super::{Film, OutputError};
use crate::units::Rgb;

/// Most pixels that [`read_exr`] takes: a file that claims more is damaged or not meant for this.
pub const MAX_READ_PIXELS: usize = 1 << 28;

/// A picture that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file system said no.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// There is no file.
    #[error("{path}: {what}, expected an EXR picture", path = path.display())]
    NoFile {
        /// The path.
        path: PathBuf,
        /// What is there instead.
        what: &'static str,
    },
    /// Not an EXR file, damaged, or without R, G and B.
    #[error("{path}: not a readable EXR picture with channels R, G, B: {what}", path = path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        what: String,
    },
}

/// The film as an EXR file.
///
/// # Errors
/// A film without pixels, or one too large for the format.
pub fn encode_exr(film: &Film) -> Result<Vec<u8>, OutputError> {
    let fault = |what: String| OutputError::Encode { format: "EXR", what };
    if film.pixels.is_empty() {
        return Err(fault(format!("a film of {} x {} pixels", film.width, film.height)));
    }
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = film.pixels[at.y() * film.width + at.x()].0;
        (r as f32, g as f32, b as f32)
    });
    let image = Image::from_encoded_channels((film.width, film.height), Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Vec::new();
    image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).map_err(|e| fault(e.to_string()))?;
    Ok(bytes)
}

/// Reads the first layer with channels R, G, B, of any sample type.
///
/// # Errors
/// [`ReadError`] with the file's name.
pub fn read_exr(path: &Path) -> Result<Film, ReadError> {
    let no_file = |what| ReadError::NoFile { path: path.to_owned(), what };
    if path.is_dir() {
        return Err(no_file("is a directory"));
    }
    let bytes = std::fs::read(path).map_err(|source| match source.kind() {
        ErrorKind::NotFound => no_file("no such file"),
        _ => ReadError::Io { path: path.to_owned(), source },
    })?;
    decode_exr(&bytes).map_err(|what| ReadError::Format { path: path.to_owned(), what })
}

fn decode_exr(bytes: &[u8]) -> Result<Film, String> {
    // The size is checked before the decoder allocates by it.
    let meta =
        ::exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    for header in &meta.headers {
        let (w, h) = (header.layer_size.width(), header.layer_size.height());
        if w.checked_mul(h).is_none_or(|n| n > MAX_READ_PIXELS) {
            return Err(format!("{w} x {h} pixels, the limit is {MAX_READ_PIXELS} in all"));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| Film::from_pixels(size.width(), size.height(), vec![Rgb::BLACK; size.area()]),
            |film: &mut Film, at, (r, g, b): (f32, f32, f32)| {
                let i = at.y() * film.width + at.x();
                film.pixels[i] = Rgb([f64::from(r), f64::from(g), f64::from(b)]);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    Ok(image.layer_data.channel_data.pixels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn exr_of_any_f32_film_reads_back_bit_for_bit(
            width in 1usize..40, height in 1usize..40, seed in any::<u32>()
        ) {
            let value = |i: u32| {
                let v = f32::from_bits(i.wrapping_mul(2_654_435_761).wrapping_add(seed));
                if v.is_finite() { f64::from(v) } else { 0.5 }
            };
            let n = (width * height) as u32;
            let pixels = (0..n).map(|i| Rgb([value(3 * i), value(3 * i + 1), value(3 * i + 2)])).collect();
            let film = Film::from_pixels(width, height, pixels);
            prop_assert_eq!(decode_exr(&encode_exr(&film).unwrap()).unwrap(), film);
        }

        #[test]
        fn exr_decoder_on_damaged_bytes_errs_or_reads_but_never_panics(at in 0usize..400, byte in any::<u8>()) {
            let film = Film::from_pixels(4, 3, vec![Rgb([1.0, 2.0, 3.0]); 12]);
            let mut bytes = encode_exr(&film).unwrap();
            let i = at % bytes.len();
            bytes[i] = byte;
            let _ = decode_exr(&bytes);
            let _ = decode_exr(&bytes[..i]);
        }
    }

    #[test]
    fn exr_encoder_gives_the_same_bytes_twice() {
        let film = Film::from_pixels(3, 2, (0..6).map(|i| Rgb::splat(f64::from(i))).collect());
        assert_eq!(encode_exr(&film).unwrap(), encode_exr(&film).unwrap());
    }

    #[test]
    fn exr_reader_on_garbage_names_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("noise.exr");
        std::fs::write(&path, [7u8; 100]).unwrap();
        let message = read_exr(&path).unwrap_err().to_string();
        assert!(message.contains("noise.exr") && message.contains("EXR"), "{message}");
        assert!(matches!(read_exr(&dir.path().join("none.exr")), Err(ReadError::NoFile { .. })));
    }

    #[test]
    fn exr_of_no_pixels_is_refused() {
        assert!(encode_exr(&Film::from_pixels(0, 0, vec![])).is_err());
    }
}
