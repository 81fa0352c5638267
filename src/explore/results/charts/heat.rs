//! The share of each metric's variance that each axis explains, as cells from white to blue, with the way it goes.
//!
//! ```text
//! effects --objectives first--> a row a metric, a column an axis: 54 % rising
//! ```

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{Chart, Drawing};
use crate::explore::results::Results;
use crate::explore::results::sensitivity::{Effect, MetricEffects, Share, basis};
use crate::explore::results::words::shortened;
use crate::plot::{Area, DrawError, Figure, text_style, wrap};
use crate::report::si::percent;

/// Most metrics.
const METRICS: usize = 20;
/// Sizes (pixels).
const LEFT: i32 = 230;
const ROW: i32 = 34;
const HEAD: i32 = 104;
const COLUMN: i32 = 150;
const BASIS: i32 = 330;
const TEXT: u32 = 13;
const TITLE: u32 = 20;

/// Cells by rows and columns.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    title: String,
    note: String,
    columns: Vec<String>,
    /// Name, cells, and how they were found.
    rows: Vec<(String, Vec<Cell>, String)>,
}

/// A cell: its share of full colour, and its text.
#[derive(Clone, Debug, PartialEq)]
struct Cell {
    share: Option<f64>,
    text: String,
}

/// How the means go along the axis.
pub(in crate::explore::results) fn direction(
    results: &Results,
    axis: usize,
    effect: &Effect,
) -> &'static str {
    let numbers: Option<Vec<f64>> = results.axes[axis].values.iter().map(|v| v.number()).collect();
    let Some(numbers) = numbers else { return "" };
    let mut means: Vec<(f64, f64)> = effect.levels.iter().map(|l| (numbers[l.value], l.mean)).collect();
    means.sort_by(|a, b| a.0.total_cmp(&b.0));
    let steps = || means.windows(2).map(|w| w[1].1 - w[0].1);
    let low = means.iter().fold(f64::INFINITY, |a, b| a.min(b.1));
    let high = means.iter().fold(f64::NEG_INFINITY, |a, b| a.max(b.1));
    // Steps back of under 2 % of the way do not count.
    let least = 0.02 * (high - low);
    // What the axis hardly does has no way.
    if effect.share.value().is_none_or(|share| share < 0.005) {
        return "";
    }
    match (steps().all(|s| s >= -least), steps().all(|s| s <= least)) {
        _ if means.len() < 2 || high <= low => "",
        (true, _) => "rising",
        (_, true) => "falling",
        _ => "turning",
    }
}

pub(super) fn chart(results: &Results, effects: &[MetricEffects]) -> Option<Chart> {
    if effects.is_empty() || results.axes.is_empty() {
        return None;
    }
    let mut order: Vec<&MetricEffects> = effects.iter().collect();
    order.sort_by_key(|e| !results.metrics[e.metric].is_objective);
    let row = |e: &&MetricEffects| {
        let m = &results.metrics[e.metric];
        let name = if m.is_objective { format!("{} *", m.name) } else { m.name.clone() };
        let cell = |(axis, effect): (usize, &Effect)| {
            let text = match effect.share {
                Share::Of(share) => format!("{} {}", percent(share), direction(results, axis, effect)),
                Share::Constant => "constant".to_owned(),
                Share::TooFew => "too few rows".to_owned(),
            };
            Cell { share: effect.share.value(), text }
        };
        (name, e.effects.iter().enumerate().map(cell).collect(), basis(results, e))
    };
    let rows = order.iter().take(METRICS).map(row).collect();
    let mut note = "Share of each metric's variance that an axis explains alone; the rest of a row is what axes do only \
                    together. * objective."
        .to_owned();
    if effects.iter().any(|e| !e.is_full_grid) {
        note += " Where rows are a part of the grid, axes may vary together: then each is given what they do, and a row \
                 can have more than 100 %.";
    }
    let columns = results.axes.iter().map(|a| shortened(&a.name, 22)).collect();
    let map = HeatMap { title: results.question.clone(), note, columns, rows };
    Some(Chart { name: "sensitivity".to_owned(), drawing: Drawing::Heat(map) })
}

impl Figure for HeatMap {
    fn size(&self) -> (u32, u32) {
        let width = LEFT + COLUMN * self.columns.len() as i32 + BASIS;
        (width.max(960) as u32, (HEAD + ROW * self.rows.len() as i32 + 16) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, root: &Area<DB>) -> Result<(), DrawError<DB>> {
        root.fill(&WHITE)?;
        let title = shortened(&self.title, 100);
        root.draw(&Text::new(title, (16, 12), text_style(TITLE, HPos::Left, VPos::Top)))?;
        for (line, y) in wrap(&self.note, 140).into_iter().zip((42..).step_by(18)) {
            root.draw(&Text::new(line, (16, y), text_style(TEXT, HPos::Left, VPos::Top)))?;
        }
        for (name, x) in self.columns.iter().zip((LEFT..).step_by(COLUMN as usize)) {
            let at = (x + COLUMN / 2, HEAD - 8);
            root.draw(&Text::new(name.clone(), at, text_style(TEXT, HPos::Center, VPos::Bottom)))?;
        }
        for ((name, cells, basis), y) in self.rows.iter().zip((HEAD..).step_by(ROW as usize)) {
            let middle = y + ROW / 2;
            let label = text_style(TEXT, HPos::Right, VPos::Center);
            root.draw(&Text::new(name.clone(), (LEFT - 10, middle), label))?;
            for (cell, x) in cells.iter().zip((LEFT..).step_by(COLUMN as usize)) {
                let ends = [(x, y), (x + COLUMN - 2, y + ROW - 2)];
                let (fill, ink) = colours(cell.share);
                root.draw(&Rectangle::new(ends, fill.filled()))?;
                let style = text_style(TEXT, HPos::Center, VPos::Center).color(&ink);
                root.draw(&Text::new(cell.text.trim_end().to_owned(), (x + COLUMN / 2, middle), style))?;
            }
            let x = LEFT + COLUMN * cells.len() as i32 + 10;
            let style = text_style(TEXT, HPos::Left, VPos::Center).color(&RGBColor(90, 90, 90));
            root.draw(&Text::new(basis.clone(), (x, middle), style))?;
        }
        Ok(())
    }
}

/// A cell's colour, from white to blue, and that of its text.
fn colours(share: Option<f64>) -> (RGBColor, RGBColor) {
    let Some(share) = share else { return (RGBColor(235, 235, 235), RGBColor(110, 110, 110)) };
    let mix = |full: f64| (255.0 + (full - 255.0) * share.clamp(0.0, 1.0)).round() as u8;
    let ink = if share > 0.8 { WHITE } else { BLACK };
    (RGBColor(mix(0.0), mix(114.0), mix(178.0)), ink)
}
