//! Panels of lines, marks and bars, one under the other, as one SVG.
//!
//! ```text
//! Panel: axes, series --Frame: values to pixels--> grid, ticks, series | legend at the right
//! ```
//! Axes and ticks are drawn here, value by value: the plotting library's own ticks do not stand at the values that were
//! measured. Colours and sizes are those of the sweeps' plots.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::report::sweep_plot::COLOURS;

/// Sizes (pixels).
const WIDTH: u32 = 960;
const HEAD: u32 = 44;
const PANEL: u32 = 290;
const LEFT: i32 = 84;
const RIGHT: i32 = 640;
const TOP: i32 = 34;
const BOTTOM: i32 = 236;
const LEGEND: i32 = 660;
const LEGEND_LINE: i32 = 20;
const TITLE: u32 = 20;
const CAPTION: u32 = 16;
const TEXT: u32 = 13;
/// Room between the outermost values and the frame, as a share of its width.
const ROOM: f64 = 0.04;

/// How values become places along an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Scale {
    /// In proportion; from 0 up when `from_zero`.
    Linear {
        /// The axis begins at 0.
        from_zero: bool,
    },
    /// By their logarithm.
    Log,
    /// Value i is the i-th of these, of one line or two.
    Names(Vec<String>),
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What is along it, with unit.
    pub title: String,
    /// How.
    pub scale: Scale,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Dots joined by lines.
    Line,
    /// A dashed line without dots: a formula or a bound.
    Dashed,
    /// Dots, with error bars where there are any.
    Dots,
    /// Bars from the axis; series of a panel stand beside each other.
    Bars,
}

/// A point; `error` is half the length of its error bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Half the error bar, 0: none.
    pub error: f64,
}

/// A named row of points.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// How it is drawn.
    pub mark: Mark,
    /// Which colour; series of one colour belong together.
    pub colour: usize,
    /// Its points, in order of x.
    pub points: Vec<Point>,
}

impl Series {
    /// A series of points without errors.
    pub fn new(
        name: impl Into<String>,
        mark: Mark,
        colour: usize,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Series {
        let points = points.into_iter().map(|(x, y)| Point { x, y, error: 0.0 }).collect();
        Series { name: name.into(), mark, colour, points }
    }
}

/// A chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, in this order.
    pub series: Vec<Series>,
}

impl Panel {
    /// A panel without series.
    pub fn new(title: impl Into<String>, x: (&str, Scale), y: (&str, Scale)) -> Panel {
        let axis = |(title, scale): (&str, Scale)| Axis { title: title.to_owned(), scale };
        Panel { title: title.into(), x: axis(x), y: axis(y), series: Vec::new() }
    }
}

/// The picture as SVG text.
///
/// # Errors
/// What the plotting library says.
pub fn svg(title: &str, panels: &[Panel]) -> Result<String, String> {
    let mut text = String::new();
    {
        let size = (WIDTH, HEAD + PANEL * panels.len() as u32);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&root, title, panels).map_err(|e| e.to_string())?;
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError<'a> = DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>;

fn draw<'a>(root: &Area<'a>, title: &str, panels: &[Panel]) -> Result<(), DrawError<'a>> {
    root.fill(&WHITE)?;
    let (head, rest) = root.split_vertically(HEAD);
    head.draw(&Text::new(title.to_owned(), (16, 12), ("sans-serif", TITLE).into_font()))?;
    for (area, panel) in rest.split_evenly((panels.len().max(1), 1)).iter().zip(panels) {
        draw_panel(area, panel)?;
    }
    Ok(())
}

/// One axis: values to pixels, and its ticks.
struct Ruler<'a> {
    scale: &'a Scale,
    /// Range in the scale's own measure.
    low: f64,
    high: f64,
    /// Pixels at `low` and `high`.
    from: i32,
    to: i32,
}

impl<'a> Ruler<'a> {
    fn new(scale: &'a Scale, values: &[f64], from: i32, to: i32) -> Ruler<'a> {
        let measured = || values.iter().map(|v| measure(scale, *v)).filter(|v| v.is_finite());
        let (mut low, mut high) =
            measured().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        match scale {
            Scale::Names(names) => (low, high) = (-0.5, names.len() as f64 - 0.5),
            Scale::Linear { from_zero: true } => {
                (low, high) = (low.min(0.0), high.max(0.0));
                high += if high > low { 1.5 * ROOM * (high - low) } else { 1.0 };
                low -= if low < 0.0 { ROOM * (high - low) } else { 0.0 };
            }
            _ => {
                let room = if high > low { ROOM * (high - low) } else { 0.5 };
                (low, high) = (low - room, high + room);
            }
        }
        Ruler { scale, low, high, from, to }
    }

    /// The pixel of a value; the near end for one that the scale has no place for.
    fn pixel(&self, value: f64) -> i32 {
        let v = measure(self.scale, value);
        let share = if v.is_finite() { (v - self.low) / (self.high - self.low) } else { 0.0 };
        self.from + (share.clamp(0.0, 1.0) * f64::from(self.to - self.from)).round() as i32
    }

    /// Values with labels.
    fn ticks(&self, values: &[f64]) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Names(names) => (0..).map(f64::from).zip(names.iter().cloned()).collect(),
            Scale::Linear { .. } => {
                let rough = (self.high - self.low) / 6.5;
                let power = 10_f64.powf(rough.log10().floor());
                let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= rough);
                let step = step.unwrap_or(rough);
                let first = (self.low / step - 1e-9).ceil() as i64;
                (first..)
                    .map(|i| i as f64 * step)
                    .take_while(|v| *v <= self.high + 1e-9 * step)
                    .map(|v| (v, short(v, step)))
                    .collect()
            }
            Scale::Log => {
                // The measured values themselves while they are few and apart, else powers of ten and their parts.
                let mut own: Vec<f64> = values.to_vec();
                own.sort_by(f64::total_cmp);
                own.dedup();
                let gap = |w: &[f64]| measure(self.scale, w[1]) - measure(self.scale, w[0]);
                let apart = own.windows(2).all(|w| gap(w) > 0.055 * (self.high - self.low));
                if !own.is_empty() && own.len() <= 12 && apart {
                    return own.into_iter().map(|v| (v, plain(v))).collect();
                }
                let decades = self.high - self.low;
                let parts: &[f64] = match decades {
                    d if d > 3.0 => &[1.0],
                    d if d > 1.2 => &[1.0, 2.0, 5.0],
                    _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
                };
                (self.low.floor() as i32..=self.high.ceil() as i32)
                    .flat_map(|k| parts.iter().map(move |p| p * 10_f64.powi(k)))
                    .filter(|v| (self.low..=self.high).contains(&v.log10()))
                    .map(|v| (v, plain(v)))
                    .collect()
            }
        }
    }
}

fn measure(scale: &Scale, value: f64) -> f64 {
    match scale {
        Scale::Log => value.log10(),
        _ => value,
    }
}

/// A tick of a linear axis, with the digits that its step needs.
fn short(value: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    format!("{value:.decimals$}")
}

/// A tick of a logarithmic axis.
fn plain(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if (1e-4..1e7).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

fn font<'a>(size: u32, h: HPos, v: VPos) -> TextStyle<'a> {
    ("sans-serif", size).into_font().into_text_style(&(WIDTH, PANEL)).pos(Pos::new(h, v))
}

fn draw_panel<'a>(area: &Area<'a>, panel: &Panel) -> Result<(), DrawError<'a>> {
    let all = |f: fn(&Point) -> [f64; 2]| -> Vec<f64> {
        panel.series.iter().flat_map(|s| &s.points).flat_map(f).collect()
    };
    let xs: Vec<f64> = all(|p| [p.x, p.x]);
    let ys = all(|p| [p.y - p.error, p.y + p.error]);
    let x = Ruler::new(&panel.x.scale, &xs, LEFT, RIGHT);
    let y = Ruler::new(&panel.y.scale, &ys, BOTTOM, TOP);
    area.draw(&Text::new(panel.title.clone(), (LEFT, 8), font(CAPTION, HPos::Left, VPos::Top)))?;
    let grid = RGBColor(222, 222, 222).stroke_width(1);
    for (value, label) in x.ticks(&xs) {
        let px = x.pixel(value);
        if !matches!(panel.x.scale, Scale::Names(_)) {
            area.draw(&PathElement::new(vec![(px, TOP), (px, BOTTOM)], grid))?;
        }
        for (line, text) in (0..).zip(label.lines()) {
            let place = (px, BOTTOM + 7 + 17 * line);
            area.draw(&Text::new(text.to_owned(), place, font(TEXT, HPos::Center, VPos::Top)))?;
        }
    }
    for (value, label) in y.ticks(&[]) {
        let py = y.pixel(value);
        area.draw(&PathElement::new(vec![(LEFT, py), (RIGHT, py)], grid))?;
        area.draw(&Text::new(label, (LEFT - 7, py), font(TEXT, HPos::Right, VPos::Center)))?;
    }
    let corners = vec![(LEFT, TOP), (LEFT, BOTTOM), (RIGHT, BOTTOM), (RIGHT, TOP), (LEFT, TOP)];
    area.draw(&PathElement::new(corners, RGBColor(90, 90, 90).stroke_width(1)))?;
    let x_title = ((LEFT + RIGHT) / 2, BOTTOM + 26);
    area.draw(&Text::new(panel.x.title.clone(), x_title, font(TEXT, HPos::Center, VPos::Top)))?;
    let upright = font(TEXT, HPos::Center, VPos::Top).transform(FontTransform::Rotate270);
    area.draw(&Text::new(panel.y.title.clone(), (12, (TOP + BOTTOM) / 2), upright))?;

    let n_bars = panel.series.iter().filter(|s| s.mark == Mark::Bars).count();
    let mut bar = 0;
    for (i, series) in panel.series.iter().enumerate() {
        let colour = COLOURS[series.colour % COLOURS.len()];
        let at: Vec<(i32, i32)> = series.points.iter().map(|p| (x.pixel(p.x), y.pixel(p.y))).collect();
        let entry = TOP + 8 + LEGEND_LINE * i as i32;
        let sample = [(LEGEND, entry), (LEGEND + 28, entry)];
        match series.mark {
            Mark::Line | Mark::Dots => {
                if series.mark == Mark::Line {
                    area.draw(&PathElement::new(at.clone(), colour.stroke_width(2)))?;
                    area.draw(&PathElement::new(sample.to_vec(), colour.stroke_width(2)))?;
                }
                for (p, &place) in series.points.iter().zip(&at) {
                    area.draw(&Circle::new(place, 3, colour.filled()))?;
                    if p.error > 0.0 {
                        let ends = vec![(place.0, y.pixel(p.y - p.error)), (place.0, y.pixel(p.y + p.error))];
                        area.draw(&PathElement::new(ends, colour.stroke_width(1)))?;
                    }
                }
                area.draw(&Circle::new((LEGEND + 14, entry), 3, colour.filled()))?;
            }
            Mark::Dashed => {
                dashes(area, &at, colour)?;
                dashes(area, &sample, colour)?;
            }
            Mark::Bars => {
                // A slot a value, four fifths of it for the bars.
                let slot = f64::from(x.pixel(1.0) - x.pixel(0.0));
                let width = 0.8 * slot / n_bars as f64;
                let zero = y.pixel(0.0);
                for &(px, py) in &at {
                    let left = f64::from(px) + width * (bar as f64 - 0.5 * n_bars as f64);
                    let ends = [(left.round() as i32 + 1, py), ((left + width).round() as i32 - 1, zero)];
                    area.draw(&Rectangle::new(ends, colour.filled()))?;
                }
                area.draw(&Rectangle::new([(LEGEND, entry - 6), (LEGEND + 28, entry + 6)], colour.filled()))?;
                bar += 1;
            }
        }
        let label = (LEGEND + 36, entry);
        area.draw(&Text::new(series.name.clone(), label, font(TEXT, HPos::Left, VPos::Center)))?;
    }
    Ok(())
}

/// A dashed line through pixels.
fn dashes<'a>(area: &Area<'a>, at: &[(i32, i32)], colour: RGBColor) -> Result<(), DrawError<'a>> {
    const DASH: f64 = 6.0;
    let mut walked = 0.0;
    for ends in at.windows(2) {
        let [(x0, y0), (x1, y1)] = [ends[0], ends[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
        let length = (x1 - x0).hypot(y1 - y0);
        let mut from = 0.0;
        while from < length {
            let phase = (walked / DASH).floor();
            let to = length.min(from + (phase + 1.0) * DASH - walked).max(from + 0.01);
            if phase % 2.0 == 0.0 {
                let place = |s: f64| {
                    let share = s / length;
                    ((x0 + share * (x1 - x0)).round() as i32, (y0 + share * (y1 - y0)).round() as i32)
                };
                area.draw(&PathElement::new(vec![place(from), place(to)], colour.stroke_width(2)))?;
            }
            walked += to - from;
            from = to;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, values: &[f64]) -> Vec<String> {
        let ruler = Ruler::new(&scale, values, 0, 100);
        ruler.ticks(values).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_of_a_linear_axis_from_zero_are_round_and_include_zero() {
        assert_eq!(labels(Scale::Linear { from_zero: true }, &[3.0, 9.4]), ["0", "2", "4", "6", "8"]);
        assert_eq!(
            labels(Scale::Linear { from_zero: true }, &[0.01, 0.031]),
            ["0.00", "0.01", "0.02", "0.03"]
        );
    }

    #[test]
    fn ticks_of_a_logarithmic_axis_are_the_values_while_few_and_decades_otherwise() {
        assert_eq!(labels(Scale::Log, &[1.0, 4.0, 16.0]), ["1", "4", "16"]);
        let many: Vec<f64> = (0..40).map(|i| 1.3_f64.powi(i)).collect();
        assert_eq!(labels(Scale::Log, &many), ["1", "10", "100", "1000", "10000"]);
    }

    #[test]
    fn ruler_puts_larger_values_further_on_and_the_impossible_at_the_near_end() {
        let scale = Scale::Log;
        let ruler = Ruler::new(&scale, &[1.0, 100.0], 10, 110);
        assert!(ruler.pixel(1.0) < ruler.pixel(10.0) && ruler.pixel(10.0) < ruler.pixel(100.0));
        assert_eq!(ruler.pixel(10.0), 60);
        assert_eq!(ruler.pixel(0.0), 10);
    }

    #[test]
    fn svg_of_every_mark_holds_titles_axes_and_legends() {
        let mut panel =
            Panel::new("Panel", ("x (m)", Scale::Log), ("y (s)", Scale::Linear { from_zero: true }));
        for (i, mark) in [Mark::Line, Mark::Dashed, Mark::Dots].into_iter().enumerate() {
            panel.series.push(Series::new(format!("series {i}"), mark, i, [(1.0, 2.0), (10.0, 3.0)]));
        }
        let names = Scale::Names(vec!["one".to_owned(), "two".to_owned()]);
        let mut bars = Panel::new("Bars", ("", names), ("y (s)", Scale::Linear { from_zero: true }));
        bars.series.push(Series::new("bar", Mark::Bars, 0, [(0.0, 2.0), (1.0, 3.0)]));
        let text = svg("Title", &[panel, bars]).unwrap();
        for part in ["Title", "Panel", "x (m)", "y (s)", "series 2", "Bars", "two", "bar", "<svg"] {
            assert!(text.contains(part), "{part} is missing");
        }
    }
}
