//! Pictures: film, exposure, files, differences.
//!
//! ```text
//! render --> Film --exr.rs, hdr.rs---------------------> bytes (linear) -----files.rs--> file, old or new, never half
//!              \---exposure.rs--> scale --png.rs (sRGB)--> bytes (8 bit) ----/
//! Film, Field --false_colour/--> colours of a scale, and the scale --> bytes (8 bit)
//! EXR bytes --exr.rs--> Film --\
//!                        Film ----difference.rs--> Difference
//! Film --second_difference.rs--> CreaseMap, MachBands
//! ```
//! Encoders make bytes in memory; only `files.rs` touches the disk.

use crate::units::Rgb;

pub mod difference;
pub mod exposure;
pub mod exr;
pub mod false_colour;
pub mod files;
pub mod hdr;
pub mod png;
pub mod rmse;
pub mod second_difference;

pub use difference::{Difference, DifferenceError, difference};
pub use exposure::{Exposure, ResolvedExposure};
pub use files::{OutputError, OutputFiles, PictureFormat};
pub use second_difference::{CreaseMap, MachBands, crease_map, encode_crease_maps, mach_bands};

/// A linear picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Radiance per pixel (W/m^2/sr), `width * height`.
    pub pixels: Vec<Rgb>,
    /// True where the pixel shows an emitter directly: left out of auto exposure.
    pub emitter: Vec<bool>,
}

impl Film {
    /// A film of `width * height` pixels, none of which shows an emitter.
    ///
    /// # Panics
    /// When `pixels` is of another length.
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<Rgb>) -> Film {
        assert_eq!(pixels.len(), width * height, "pixels of a {width} x {height} film");
        let emitter = vec![false; pixels.len()];
        Film { width, height, pixels, emitter }
    }

    /// The pixel in column `x`, row `y`.
    ///
    /// # Panics
    /// Outside the film.
    pub fn pixel(&self, x: usize, y: usize) -> Rgb {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) of {} x {}", self.width, self.height);
        self.pixels[y * self.width + x]
    }

    /// Mean luminance of all pixels (W/m^2/sr); 0 for a film without pixels.
    pub fn mean_luminance(&self) -> f64 {
        if self.pixels.is_empty() {
            return 0.0;
        }
        self.pixels.iter().map(|p| p.luminance()).sum::<f64>() / self.pixels.len() as f64
    }
}
