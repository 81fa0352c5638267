//! Panels one under the other: frame, grid, ticks, series, legend.

use std::collections::BTreeSet;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::figure::{Area, DrawError, Figure, text_style as font, wrap};
use super::ruler::Ruler;
use super::{Mark, Panel, Point, Scale, Series};
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
const NOTE_LINE: u32 = 18;
/// Characters of a line of the title and of the notes.
const TITLE_CHARACTERS: usize = 100;
const NOTE_CHARACTERS: usize = 140;

/// A picture: title, notes, panels.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// In large letters.
    pub title: String,
    /// Sentences below the title, each on lines of its own.
    pub notes: Vec<String>,
    /// One under the other.
    pub panels: Vec<Panel>,
}

impl Sheet {
    fn notes(&self) -> Vec<String> {
        self.notes.iter().flat_map(|note| wrap(note, NOTE_CHARACTERS)).collect()
    }

    fn head(&self) -> u32 {
        let more = wrap(&self.title, TITLE_CHARACTERS).len().saturating_sub(1) as u32;
        HEAD + 24 * more + NOTE_LINE * self.notes().len() as u32
    }
}

impl Figure for Sheet {
    fn size(&self) -> (u32, u32) {
        (WIDTH, self.head() + PANEL * self.panels.len() as u32)
    }

    fn draw<DB: DrawingBackend>(&self, root: &Area<DB>) -> Result<(), DrawError<DB>> {
        root.fill(&WHITE)?;
        let (head, rest) = root.split_vertically(self.head());
        let mut y = 12;
        for line in wrap(&self.title, TITLE_CHARACTERS) {
            head.draw(&Text::new(line, (16, y), ("sans-serif", TITLE).into_font()))?;
            y += 24;
        }
        for (line, y) in self.notes().into_iter().zip((y + 2..).step_by(NOTE_LINE as usize)) {
            head.draw(&Text::new(line, (16, y), ("sans-serif", TEXT).into_font()))?;
        }
        for (area, panel) in rest.split_evenly((self.panels.len().max(1), 1)).iter().zip(&self.panels) {
            draw_panel(area, panel)?;
        }
        Ok(())
    }
}

/// For each point of stacked series, in order, where its bar begins and ends.
fn stacked(series: &[Series]) -> Vec<Vec<(f64, f64)>> {
    let mut tops: Vec<(f64, f64)> = Vec::new();
    let mut bars = Vec::new();
    for s in series.iter().filter(|s| s.mark == Mark::Stacked) {
        bars.push(Vec::new());
        for p in &s.points {
            let at = tops.iter().position(|(x, _)| *x == p.x).unwrap_or_else(|| {
                tops.push((p.x, 0.0));
                tops.len() - 1
            });
            let from = tops[at].1;
            tops[at].1 += p.y;
            if let Some(last) = bars.last_mut() {
                last.push((from, tops[at].1));
            }
        }
    }
    bars
}

fn draw_panel<DB: DrawingBackend>(area: &Area<DB>, panel: &Panel) -> Result<(), DrawError<DB>> {
    let xs: Vec<f64> = panel.series.iter().flat_map(|s| &s.points).map(|p| p.x).collect();
    let ends = |p: &Point| [p.y - p.error, p.y + p.error];
    let stacks = stacked(&panel.series);
    let measured = panel.series.iter().filter(|s| !matches!(s.mark, Mark::Rule | Mark::Stacked));
    let ys: Vec<f64> = (measured.flat_map(|s| &s.points).flat_map(ends))
        .chain(stacks.iter().flatten().map(|(_, top)| *top))
        .collect();
    let x = Ruler::new(&panel.x.scale, &xs, LEFT, RIGHT);
    let y = Ruler::new(&panel.y.scale, &ys, BOTTOM, TOP);
    draw_frame(area, panel, (&x, &xs), &y)?;
    let n_bars = panel.series.iter().filter(|s| s.mark == Mark::Bars).count();
    let (mut bar, mut stack) = (0, stacks.iter());
    let mut rules: Vec<i32> = Vec::new();
    for (i, series) in panel.series.iter().enumerate() {
        let colour = COLOURS[series.colour % COLOURS.len()];
        let at: Vec<(i32, i32)> = series.points.iter().map(|p| (x.pixel(p.x), y.pixel(p.y))).collect();
        let entry = TOP + 8 + LEGEND_LINE * i as i32;
        let sample = [(LEGEND, entry), (LEGEND + 28, entry)];
        // A slot a value, four fifths of it for the bars.
        let slot = f64::from(x.pixel(1.0) - x.pixel(0.0));
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
            Mark::Faint => {
                // Many points may share a pixel.
                let places: BTreeSet<(i32, i32)> = at.into_iter().collect();
                for place in places.into_iter().chain([(LEGEND + 14, entry)]) {
                    area.draw(&Circle::new(place, 2, pale(colour, 0.6).filled()))?;
                }
            }
            Mark::Ring => {
                for place in at.into_iter().chain([(LEGEND + 14, entry)]) {
                    area.draw(&Circle::new(place, 7, colour.stroke_width(2)))?;
                }
            }
            Mark::Rule => {
                for (px, _) in at {
                    // Of several at one place all are seen.
                    let aside = px + 2 * rules.iter().filter(|r| **r == px).count() as i32;
                    rules.push(px);
                    dashes(area, &[(aside, TOP), (aside, BOTTOM)], colour)?;
                }
                dashes(area, &sample, colour)?;
            }
            Mark::Dashed => {
                dashes(area, &at, colour)?;
                dashes(area, &sample, colour)?;
            }
            Mark::Bars => {
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
            Mark::Stacked => {
                let half = (0.4 * slot).round() as i32;
                let shade = colour_of_stack(series.colour);
                for (&(px, _), (from, to)) in at.iter().zip(stack.next().into_iter().flatten()) {
                    let ends = [(px - half, y.pixel(*to)), (px + half, y.pixel(*from))];
                    area.draw(&Rectangle::new(ends, shade.filled()))?;
                }
                area.draw(&Rectangle::new([(LEGEND, entry - 6), (LEGEND + 28, entry + 6)], shade.filled()))?;
            }
        }
        let label = (LEGEND + 36, entry);
        area.draw(&Text::new(series.name.clone(), label, font(TEXT, HPos::Left, VPos::Center)))?;
    }
    Ok(())
}

/// Colours of stacked series: beyond the first seven, the same again, paler.
fn colour_of_stack(i: usize) -> RGBColor {
    let colour = COLOURS[i % COLOURS.len()];
    if i < COLOURS.len() { colour } else { pale(colour, 0.5) }
}

/// A colour with a share of white.
fn pale(RGBColor(r, g, b): RGBColor, white: f64) -> RGBColor {
    let mix = |c: u8| (f64::from(c) + white * (255.0 - f64::from(c))).round() as u8;
    RGBColor(mix(r), mix(g), mix(b))
}

/// Title, grid, ticks, frame and the titles of the axes.
fn draw_frame<DB: DrawingBackend>(
    area: &Area<DB>,
    panel: &Panel,
    (x, xs): (&Ruler<'_>, &[f64]),
    y: &Ruler<'_>,
) -> Result<(), DrawError<DB>> {
    area.draw(&Text::new(panel.title.clone(), (LEFT, 8), font(CAPTION, HPos::Left, VPos::Top)))?;
    let grid = RGBColor(222, 222, 222).stroke_width(1);
    for (value, label) in x.ticks(xs) {
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
    Ok(())
}

/// A dashed line through pixels.
fn dashes<DB: DrawingBackend>(
    area: &Area<DB>,
    at: &[(i32, i32)],
    colour: RGBColor,
) -> Result<(), DrawError<DB>> {
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
