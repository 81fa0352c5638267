//! False-colour pictures: a value a pixel in the colours of a scale, the scale with numbers and unit beside it.
//!
//! ```text
//! Field (lx or cd/m^2 a pixel) --Scale::position--> colour map --> picture | legend: colours, ticks, quantity, unit --> PNG
//! ```
//! The legend stands right of the picture and covers none of it; a low picture gets a taller canvas. Pixels without a
//! value are grey. Colour maps: viridis and inferno (perceptually even), turbo.

use serde::Serialize;

use super::png::encode_rgb;
use super::{Film, OutputError};
use crate::units::{Irradiance, Radiance};

mod canvas;
mod scale;

pub use scale::{Scale, ScaleChoice, ScaleKind};

use canvas::{Canvas, Font};
use scale::label;

/// Of the legend.
const BACKGROUND: [u8; 3] = [24, 24, 24];
const INK: [u8; 3] = [235, 235, 235];
/// Of pixels without a value.
const NOTHING: [u8; 3] = [96, 96, 96];
/// Least height of a canvas, in lines of text: the title's, and some ticks.
const MIN_LINES: usize = 10;

/// Widest and highest field (pixels).
const MAX_SIDE: usize = 32_768;

/// What is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Of what the camera sees (cd/m^2).
    Luminance,
    /// On the surface that the camera sees (lx).
    Illuminance,
    /// How many sources of light are sampled by shadow rays there, each by its weight; the others are stored.
    Sources,
}

/// Colours of a scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ColourMap {
    /// Dark blue, green, yellow: even steps of lightness.
    #[default]
    Viridis,
    /// Black, red, yellow, white: even steps of lightness.
    Inferno,
    /// Blue, green, red: a rainbow without its false edges.
    Turbo,
}

/// A value a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// What the values are.
    pub quantity: Quantity,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values in the quantity's unit, row by row from the top left; NaN where there is none.
    pub values: Vec<f64>,
    /// True for the pixels that an automatic scale looks at.
    pub counts: Vec<bool>,
}

/// How a field is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FalseColour {
    /// Its scale.
    pub scale: ScaleChoice,
    /// Its colours.
    pub colours: ColourMap,
}

impl Quantity {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Luminance => "luminance",
            Quantity::Illuminance => "illuminance",
            Quantity::Sources => "sources",
        }
    }

    /// Its unit, in ASCII.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Luminance => "cd/m^2",
            Quantity::Illuminance => "lx",
            Quantity::Sources => "sampled",
        }
    }
}

impl ColourMap {
    fn at(self, position: f64) -> [u8; 3] {
        let gradient = match self {
            ColourMap::Viridis => colorous::VIRIDIS,
            ColourMap::Inferno => colorous::INFERNO,
            ColourMap::Turbo => colorous::TURBO,
        };
        gradient.eval_continuous(position).as_array()
    }
}

impl Field {
    /// The luminance of a film; emitters do not count for an automatic scale, unless there is nothing else.
    pub fn luminance(film: &Film) -> Field {
        let values = film.pixels.iter().map(|p| Radiance(*p).luminance_cd_m2()).collect();
        let only_emitters = film.emitter.iter().all(|e| *e);
        let counts = film.emitter.iter().map(|e| only_emitters || !e).collect();
        Field { quantity: Quantity::Luminance, width: film.width, height: film.height, values, counts }
    }

    /// The illuminance of `width` x `height` pixels or points, where there is any.
    pub fn illuminance(width: usize, height: usize, irradiance: &[Option<Irradiance>]) -> Field {
        let values = irradiance.iter().map(|e| e.map_or(f64::NAN, Irradiance::illuminance_lx));
        let (values, counts) = (values.collect(), vec![true; irradiance.len()]);
        Field { quantity: Quantity::Illuminance, width, height, values, counts }
    }

    /// The number of sources that `width` x `height` pixels sample, where they show a surface.
    pub fn sources(width: usize, height: usize, sampled: &[Option<f64>]) -> Field {
        let values = sampled.iter().map(|n| n.unwrap_or(f64::NAN)).collect();
        Field { quantity: Quantity::Sources, width, height, values, counts: vec![true; sampled.len()] }
    }

    /// Every value as a block of `side` x `side` pixels, rows from the bottom up.
    pub fn magnified(&self, side: [usize; 2]) -> Field {
        let (width, height) = (self.width * side[0], self.height * side[1]);
        let source = |k: usize| {
            let (x, y) = (k % width / side[0], k / width / side[1]);
            (self.height - 1 - y) * self.width + x
        };
        Field {
            quantity: self.quantity,
            width,
            height,
            values: (0..width * height).map(|k| self.values[source(k)]).collect(),
            counts: (0..width * height).map(|k| self.counts[source(k)]).collect(),
        }
    }

    /// The picture as a PNG file, and the scale that it has.
    ///
    /// # Errors
    /// A field without pixels, or one too large for the format.
    pub fn encode_png(&self, how: FalseColour) -> Result<(Vec<u8>, Scale), OutputError> {
        if self.width.max(self.height) > MAX_SIDE {
            let what = format!("{} x {} pixels, at most {MAX_SIDE} are possible", self.width, self.height);
            return Err(OutputError::Encode { format: "PNG", what });
        }
        let counted = self.values.iter().zip(&self.counts).filter(|(_, counts)| **counts).map(|(v, _)| *v);
        let scale = how.scale.resolve(counted);
        let canvas = self.draw(scale, how.colours);
        let bytes = encode_rgb(canvas.width, canvas.height, canvas.rgb.as_flattened())?;
        Ok((bytes, scale))
    }

    fn draw(&self, scale: Scale, colours: ColourMap) -> Canvas {
        let font = Font::for_height(self.height);
        let line = font.height();
        let height = if self.width * self.height == 0 { 0 } else { self.height.max(MIN_LINES * line) };
        let unit = self.quantity.unit().replace("^2", "\u{b2}");
        // The bar: under two lines of title, half a line of room for the outermost ticks' labels at both ends.
        let (top, bottom) = (3 * line, line);
        let length = height.saturating_sub(top + bottom).max(1);
        let ticks = scale.ticks(length / (2 * line));
        let labels: Vec<String> = ticks.iter().map(|t| label(*t)).collect();
        let text = labels.iter().map(|l| font.width(l)).max().unwrap_or(0);
        let (margin, bar, tick) = (line / 2, line, line / 3);
        let title = font.width(self.quantity.name()).max(font.width(&unit));
        let legend = 2 * margin + title.max(bar + 2 * tick + text);
        let mut canvas = Canvas::new(self.width + legend, height, BACKGROUND);
        for (k, value) in self.values.iter().enumerate() {
            let colour = if value.is_nan() { NOTHING } else { colours.at(scale.position(*value)) };
            canvas.put(k % self.width, k / self.width, colour);
        }
        let left = self.width + margin;
        canvas.text(left, line / 2, self.quantity.name(), font, INK);
        canvas.text(left, line / 2 + line, &unit, font, INK);
        let place = |position: f64| top + ((1.0 - position) * (length - 1) as f64).round() as usize;
        for y in 0..length {
            let position = 1.0 - y as f64 / (length - 1).max(1) as f64;
            canvas.fill(left, top + y, bar, 1, colours.at(position));
        }
        for (value, text) in ticks.iter().zip(&labels) {
            let y = place(scale.position(*value));
            canvas.fill(left + bar, y, tick, 1, INK);
            canvas.text(left + bar + 2 * tick, y.saturating_sub(line / 2), text, font, INK);
        }
        canvas
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photometry::LUMENS_PER_WATT;
    use crate::units::Rgb;

    fn ramp(width: usize, height: usize) -> Field {
        let lux = (0..width * height).map(|k| Some(Irradiance(Rgb::splat(k as f64 / LUMENS_PER_WATT))));
        Field::illuminance(width, height, &lux.collect::<Vec<_>>())
    }

    #[test]
    fn picture_keeps_its_pixels_and_the_legend_stands_beside_it() {
        let field = ramp(30, 20);
        let scale = ScaleChoice { range: Some([0.0, 599.0]), kind: ScaleKind::Linear }.resolve([]);
        let canvas = field.draw(scale, ColourMap::Viridis);
        assert!(canvas.width > 30 && canvas.height >= 20, "{} x {}", canvas.width, canvas.height);
        for k in [0, 29, 300, 599] {
            let expected = colorous::VIRIDIS.eval_continuous(k as f64 / 599.0).as_array();
            assert_eq!(canvas.rgb[k / 30 * canvas.width + k % 30], expected, "{k}");
        }
        // Both ends of the bar in the colours of the ends.
        let column: Vec<_> = (0..canvas.height).map(|y| canvas.rgb[y * canvas.width + 40]).collect();
        for end in [0.0, 1.0] {
            assert!(column.contains(&ColourMap::Viridis.at(end)), "{end}");
        }
    }

    #[test]
    fn pixels_without_a_value_are_grey_and_count_for_no_scale() {
        let lux = [None, Some(Irradiance(Rgb::splat(1.0)))];
        let field = Field::illuminance(2, 1, &lux);
        let (_, scale) = field.encode_png(FalseColour::default()).unwrap();
        assert_eq!((scale.lo, scale.hi), (0.0, 200.0));
        assert_eq!(field.draw(scale, ColourMap::Turbo).rgb[0], NOTHING);
    }

    #[test]
    fn luminance_of_a_film_is_179_times_y_and_lamps_do_not_set_the_scale() {
        let mut film = Film::from_pixels(2, 1, vec![Rgb::splat(1.0), Rgb::splat(1000.0)]);
        film.emitter[1] = true;
        let field = Field::luminance(&film);
        assert!((field.values[0] - 179.0).abs() < 1e-9 && (field.values[1] - 179_000.0).abs() < 1e-6);
        let (_, scale) = field.encode_png(FalseColour::default()).unwrap();
        assert_eq!(scale.hi, 200.0);
    }

    #[test]
    fn magnified_field_has_its_first_row_at_the_bottom() {
        let field = ramp(2, 2).magnified([3, 2]);
        assert_eq!((field.width, field.height), (6, 4));
        let near = |k: usize, v: f64| assert!((field.values[k] - v).abs() < 1e-9, "{k}: {}", field.values[k]);
        near(0, 2.0);
        near(5, 3.0);
        near(23, 1.0);
        near(18, 0.0);
    }

    #[test]
    fn field_without_pixels_or_too_wide_a_one_is_refused() {
        assert!(ramp(0, 0).encode_png(FalseColour::default()).is_err());
        let long = ramp(40_000, 1).encode_png(FalseColour::default()).unwrap_err().to_string();
        assert!(long.contains("40000 x 1 pixels, at most 32768"), "{long}");
    }
}
