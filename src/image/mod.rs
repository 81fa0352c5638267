//! Pictures: film, exposure, files, metrics.

use crate::units::Rgb;

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
