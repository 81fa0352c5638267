//! Pixels and text on a picture of 8-bit RGB.
//!
//! ```text
//! rectangles, text (bitmaps of Noto Sans Mono, anti-aliased) --> bytes, row by row from the top left
//! ```
//! What lies outside the picture is cut off.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// A picture that is drawn on.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    pub width: usize,
    pub height: usize,
    /// Red, green, blue a pixel.
    pub rgb: Vec<[u8; 3]>,
}

/// Sizes of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Font(RasterHeight);

impl Font {
    /// The size that suits a picture `height` pixels high.
    pub fn for_height(height: usize) -> Font {
        Font(match height {
            0..480 => RasterHeight::Size16,
            480..960 => RasterHeight::Size24,
            _ => RasterHeight::Size32,
        })
    }

    /// Height of a line (pixels).
    pub fn height(self) -> usize {
        self.0.val()
    }

    /// Width of a text (pixels).
    pub fn width(self, text: &str) -> usize {
        text.chars().count() * get_raster_width(FontWeight::Regular, self.0)
    }
}

impl Canvas {
    pub fn new(width: usize, height: usize, colour: [u8; 3]) -> Canvas {
        Canvas { width, height, rgb: vec![colour; width * height] }
    }

    pub fn put(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            self.rgb[y * self.width + x] = colour;
        }
    }

    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: [u8; 3]) {
        for row in y..y + height {
            for column in x..x + width {
                self.put(column, row, colour);
            }
        }
    }

    /// Writes `text` with its top left corner at (x, y); characters that the font lacks are left out.
    pub fn text(&mut self, x: usize, y: usize, text: &str, font: Font, colour: [u8; 3]) {
        let step = get_raster_width(FontWeight::Regular, font.0);
        for (i, character) in text.chars().enumerate() {
            let Some(glyph) = get_raster(character, FontWeight::Regular, font.0) else { continue };
            for (row, values) in glyph.rows().enumerate() {
                for (column, &ink) in values.iter().enumerate() {
                    let (px, py) = (x + i * step + column, y + row);
                    if ink > 0 && px < self.width && py < self.height {
                        let below = self.rgb[py * self.width + px];
                        let mixed = std::array::from_fn(|c| mix(below[c], colour[c], ink));
                        self.put(px, py, mixed);
                    }
                }
            }
        }
    }
}

/// `ink` of 255 parts of `over` on `below`.
fn mix(below: u8, over: u8, ink: u8) -> u8 {
    let (b, o, i) = (u32::from(below), u32::from(over), u32::from(ink));
    ((b * (255 - i) + o * i + 127) / 255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_leaves_ink_within_its_box_and_none_outside_the_canvas() {
        for height in [100, 500, 1000] {
            let font = Font::for_height(height);
            let (w, h) = (font.width("cd/m\u{b2}"), font.height());
            let mut canvas = Canvas::new(w + 20, h + 20, [0; 3]);
            canvas.text(10, 10, "cd/m\u{b2}", font, [255; 3]);
            let inked = |x: usize, y: usize| canvas.rgb[y * canvas.width + x] != [0; 3];
            let all = (0..canvas.height).flat_map(|y| (0..canvas.width).map(move |x| (x, y)));
            let marks: Vec<_> = all.filter(|&(x, y)| inked(x, y)).collect();
            assert!(marks.len() > 5 * h, "{} marks", marks.len());
            assert!(marks.iter().all(|&(x, y)| (10..10 + w).contains(&x) && (10..10 + h).contains(&y)));
            // The superscript is there.
            assert!(marks.iter().any(|&(x, _)| x >= 10 + w - w / 5));
            canvas.text(canvas.width - 3, canvas.height - 3, "888", font, [255; 3]);
        }
    }
}
