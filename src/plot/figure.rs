//! A figure over any back end of the plotting library: SVG text, PNG bytes.
//!
//! ```text
//! Figure::draw --svg_of--> SVG: text is the viewer's sans-serif
//!              `-png-----> PIXELS x PIXELS a unit --image::png--> bytes: text is Ubuntu Light, compiled in
//! ```
//! The same figure gives the same bytes. Where the program is built without `explore`, there is no PNG.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Where a figure draws.
pub type Area<DB> = DrawingArea<DB, Shift>;

/// What drawing may say.
pub type DrawError<DB> = DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>;

/// Something that can be drawn.
pub trait Figure {
    /// Width and height (units; of SVG, pixels).
    fn size(&self) -> (u32, u32);

    /// Draws it.
    ///
    /// # Errors
    /// What the back end says.
    fn draw<DB: DrawingBackend>(&self, root: &Area<DB>) -> Result<(), DrawError<DB>>;
}

/// Text of a size at a place.
pub fn text_style<'a>(size: u32, h: HPos, v: VPos) -> TextStyle<'a> {
    // The size of the parent counts for relative sizes only.
    ("sans-serif", size).into_font().into_text_style(&(1, 1)).pos(Pos::new(h, v))
}

/// Text cut into lines of at most `width` characters, between words.
pub fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A figure as SVG text.
///
/// # Errors
/// What the plotting library says.
pub fn svg_of(figure: &impl Figure) -> Result<String, String> {
    register_fonts()?;
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, figure.size()).into_drawing_area();
        figure.draw(&root).map_err(|e| e.to_string())?;
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

/// Makes the font known that the library measures and paints text with.
#[cfg(feature = "explore")]
pub(crate) fn register_fonts() -> Result<(), String> {
    static KNOWN: std::sync::OnceLock<bool> = std::sync::OnceLock::new();
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    let known =
        *KNOWN.get_or_init(|| plotters::style::register_font("sans-serif", FontStyle::Normal, font).is_ok());
    if known { Ok(()) } else { Err("the built-in font cannot be read".to_owned()) }
}

/// Text is measured without a font.
#[cfg(not(feature = "explore"))]
pub(crate) fn register_fonts() -> Result<(), String> {
    Ok(())
}

/// Pixels of a PNG in a figure's unit, each way.
#[cfg(feature = "explore")]
pub const PIXELS: u32 = 2;

/// A figure as a PNG file.
///
/// # Errors
/// What the plotting library or the encoder says.
#[cfg(feature = "explore")]
pub fn png(figure: &impl Figure) -> Result<Vec<u8>, String> {
    register_fonts()?;
    let (width, height) = figure.size();
    let (width, height) = (PIXELS * width, PIXELS * height);
    let mut pixels = vec![255; 3 * width as usize * height as usize];
    {
        let inner = BitMapBackend::with_buffer(&mut pixels, (width, height));
        let root = super::scaled::Scaled { inner, pixels: PIXELS }.into_drawing_area();
        figure.draw(&root).map_err(|e| e.to_string())?;
        root.present().map_err(|e| e.to_string())?;
    }
    crate::image::png::encode_rgb(width as usize, height as usize, &pixels).map_err(|e| e.to_string())
}
