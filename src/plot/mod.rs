//! Panels of lines, marks and bars, one under the other, as one picture: SVG or PNG.
//!
//! ```text
//! Sheet: title, notes, panels --Figure::draw, over any back end--> svg(): text
//!   Panel: axes, series --ruler.rs: values to pixels--> grid, ticks, series | legend   `--> png(): bytes
//! ```
//! Axes and ticks are drawn here, value by value: the plotting library's own ticks do not stand at the values that were
//! measured. Colours and sizes are those of the sweeps' plots.

mod draw;
mod figure;
mod ruler;
#[cfg(feature = "explore")]
mod scaled;

pub use draw::Sheet;
pub(crate) use figure::register_fonts;
#[cfg(feature = "explore")]
pub use figure::{Area, DrawError, Figure, png, text_style};
pub use figure::{svg_of, wrap};

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
    /// Small pale dots: what the others stand out from.
    Faint,
    /// A circle around a point.
    Ring,
    /// A dashed vertical through the whole panel at each point's x; y is not looked at.
    Rule,
    /// Bars from the axis; series of a panel stand beside each other.
    Bars,
    /// Bars upon those of the stacked series before.
    Stacked,
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
    svg_of(&Sheet { title: title.to_owned(), notes: Vec::new(), panels: panels.to_vec() })
}

#[cfg(test)]
mod tests;
