//! The sweep as a picture: misclassified rays, error of t and undecided first tests over the swept width, one SVG.
//!
//! ```text
//! SweepReport --> panels, one under the other, each: y on a logarithmic scale, its legend at its right
//! ```
//! A logarithmic scale has no place for 0: zeros are open markers on a line of their own below the scale, labelled 0,
//! of growing size, so that those of several series are seen at one place.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::si::{number, share};
use super::sweep_text::held_fixed_text;
use super::verify::{SweepReport, SweepRow};
use crate::plot::register_fonts;

/// Least size of the picture, of its head and of a panel (pixels).
const WIDTH: u32 = 960;
const HEAD: u32 = 78;
const PANEL: u32 = 330;
/// Where a panel's legend begins, its first line below the panel's top, and the distance of its lines.
const LEGEND: u32 = 760;
const LEGEND_TOP: u32 = 72;
const LEGEND_LINE: u32 = 22;
/// Sizes of text, and a character's largest mean width over the size: fonts are the viewer's.
const TITLE: u32 = 22;
const TEXT: u32 = 14;
const CHARACTER: f64 = 0.6;
/// Series of one panel that are told apart by colour alone.
const N_SOLID: usize = 6;

/// Colours that stay apart for colour-blind readers and in print (Okabe, Ito 2008).
pub(crate) const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// The colour of a sum.
const PALE: RGBColor = RGBColor(200, 200, 200);

/// Lines over the swept values.
struct Panel {
    title: &'static str,
    y_title: &'static str,
    legend_title: &'static str,
    series: Vec<(String, Vec<(f64, f64)>)>,
    /// The first line is the sum of the others: wide and pale beneath them.
    is_sum_first: bool,
}

/// The picture as SVG text.
///
/// # Errors
/// What the plotting library says.
pub fn sweep_svg(sweep: &SweepReport, scene: &str, board: &str) -> Result<String, String> {
    register_fonts()?;
    let mut svg = String::new();
    {
        let panels = panels(sweep);
        let head = head(sweep, scene, board);
        let root = SVGBackend::with_string(&mut svg, size(&head, &panels)).into_drawing_area();
        draw(&root, sweep.parameter, &panels, &head).map_err(|e| e.to_string())?;
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(svg)
}

/// Title and notes.
fn head(sweep: &SweepReport, scene: &str, board: &str) -> [String; 3] {
    let findings = || sweep.rows.iter().map(|row| &row.findings);
    let rays = findings().map(|f| f.n_rays).max().unwrap_or(0);
    let differ: u64 = findings().map(|f| f.n_mismatches).sum();
    let fixed = findings().next().map_or(String::new(), |f| held_fixed_text(sweep.parameter, &f.formats));
    let rounded: Vec<String> = sweep
        .rows
        .iter()
        .filter(|row| row.findings.formats.cross_drop() > 0)
        .map(|row| row.value.to_string())
        .collect();
    let rounded = match rounded.as_slice() {
        [] => String::new(),
        [one] => format!("; the value {one} rounds edge normals"),
        [first, .., last] => format!("; {first} to {last} round edge normals"),
    };
    [
        format!("{scene} on {board}: {}", sweep.parameter),
        format!("held fixed: {fixed}{rounded}"),
        format!(
            "{rays} rays a value, {differ} of all answers differ between board and oracle; open markers are 0"
        ),
    ]
}

/// What is written in the legend.
fn legend_text(name: &str, points: &[(f64, f64)]) -> String {
    match points {
        [] => format!("{name}: no hits"),
        points if points.iter().all(|p| p.1 <= 0.0) => format!("{name}: 0 throughout"),
        _ => name.to_owned(),
    }
}

/// Width and height that hold every text.
fn size(head: &[String; 3], panels: &[Panel]) -> (u32, u32) {
    let width = |text: &str, size: u32| (text.chars().count() as f64 * f64::from(size) * CHARACTER) as u32;
    let series = || panels.iter().flat_map(|panel| &panel.series);
    let legend = series().map(|(name, points)| width(&legend_text(name, points), TEXT)).max().unwrap_or(0);
    let notes = head[1..].iter().map(|note| width(note, TEXT)).max().unwrap_or(0);
    let widest = (LEGEND + 60 + legend).max(32 + notes).max(32 + width(&head[0], TITLE));
    (WIDTH.max(widest), HEAD + panel_height(panels) * panels.len() as u32)
}

fn panel_height(panels: &[Panel]) -> u32 {
    let lines = panels.iter().map(|panel| panel.series.len() as u32).max().unwrap_or(0);
    PANEL.max(LEGEND_TOP + LEGEND_LINE * lines + 8)
}

fn panels(sweep: &SweepReport) -> Vec<Panel> {
    let known = |name: &str, y: &dyn Fn(&SweepRow) -> Option<f64>| {
        let points = sweep.rows.iter().filter_map(|row| Some((f64::from(row.value), y(row)?)));
        (name.to_owned(), points.collect())
    };
    let over = |name: String, y: &dyn Fn(&SweepRow) -> f64| known(&name, &|row| Some(y(row)));
    let percent = |part: u64, whole: u64| 100.0 * share(part, whole);
    let mut causes = vec![over("all".to_owned(), &|row| 100.0 * row.findings.misclassified.share)];
    for (i, name) in ["edge", "depth tie", "t step", "unexplained"].into_iter().enumerate() {
        let y = |row: &SweepRow| percent(row.findings.misclassified.causes()[i].1, row.findings.n_rays);
        causes.push(over(name.to_owned(), &y));
    }
    let errors = vec![
        known("largest", &|row| Some(1e3 * row.findings.t_error.max_m?)),
        known("99 % of hits", &|row| Some(1e3 * row.findings.t_error.p99_m?)),
        known("median", &|row| Some(1e3 * row.findings.t_error.median_m?)),
    ];
    let mut all = vec![
        Panel {
            title: "Rays that board and software answer differently",
            y_title: "% of the rays",
            legend_title: "by cause",
            series: causes,
            is_sum_first: true,
        },
        Panel {
            title: "Distance of the board's hit from software's, on one patch",
            y_title: "mm",
            legend_title: "",
            series: errors,
            is_sum_first: false,
        },
    ];
    let widths: Vec<u32> =
        sweep.rows.first().map_or(Vec::new(), |row| row.findings.first_test.iter().map(|s| s.bits).collect());
    let undecided = widths.iter().enumerate().map(|(i, bits)| {
        let y =
            |row: &SweepRow| row.findings.first_test.get(i).map_or(0.0, |s| percent(s.undecided, s.tests));
        over(format!("{bits} bits"), &y)
    });
    if !widths.is_empty() {
        all.push(Panel {
            title: "Tests that a first test of few bits leaves undecided",
            y_title: "% of the tests",
            legend_title: "first test",
            series: undecided.collect(),
            is_sum_first: false,
        });
    }
    if sweep.rows.iter().any(|row| row.findings.image.is_some()) {
        all.push(Panel {
            title: "Picture through the board's arithmetic against the software picture",
            y_title: "% of the mean luminance",
            legend_title: "image",
            series: vec![known("RMSE", &|row| Some(100.0 * row.findings.image?.rmse_relative))],
            is_sum_first: false,
        });
    }
    all
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError<'a> = DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>;

fn draw<'a>(
    root: &Area<'a>,
    parameter: &str,
    panels: &[Panel],
    [title, notes @ ..]: &[String; 3],
) -> Result<(), DrawError<'a>> {
    root.fill(&WHITE)?;
    let (head, rest) = root.split_vertically(HEAD);
    head.draw(&Text::new(title.as_str(), (16, 10), ("sans-serif", TITLE).into_font()))?;
    for (note, y) in notes.iter().zip([36, 56]) {
        head.draw(&Text::new(note.as_str(), (16, y), ("sans-serif", TEXT).into_font()))?;
    }
    for (area, panel) in rest.split_evenly((panels.len().max(1), 1)).iter().zip(panels) {
        draw_panel(area, parameter, panel)?;
    }
    Ok(())
}

fn draw_panel<'a>(area: &Area<'a>, parameter: &str, panel: &Panel) -> Result<(), DrawError<'a>> {
    let (plot, legend) = area.split_horizontally(LEGEND);
    let xs = panel.series.iter().flat_map(|(_, points)| points.iter().map(|p| p.0));
    let (first, last) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let (first, last) = if first <= last { (first, last) } else { (0.0, 0.0) };
    let (low, high) = decades(panel);
    let has_zeros = panel.series.iter().any(|(_, points)| points.iter().any(|p| p.1 <= 0.0));
    // Zeros stand half a decade below the scale.
    let floor = low / 10_f64.sqrt();
    let bottom = if has_zeros { floor } else { low };
    let mut chart = ChartBuilder::on(&plot)
        .caption(panel.title, ("sans-serif", 17))
        .margin(8)
        .x_label_area_size(42)
        .y_label_area_size(74)
        .build_cartesian_2d(first - 0.5..last + 0.5, (bottom / ROOM..high * ROOM).log_scale())?;
    let n_labels = (last - first) as usize + 1;
    chart
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .x_max_light_lines(1)
        .x_labels(n_labels.min(24))
        .x_desc(parameter)
        .y_desc(panel.y_title)
        .x_label_formatter(&|x| if x.fract() == 0.0 { format!("{x}") } else { String::new() })
        .y_label_formatter(&|y| if *y < low / ROOM { String::new() } else { number(rounded(*y)) })
        .axis_desc_style(("sans-serif", TEXT))
        .label_style(("sans-serif", 13))
        .draw()?;
    if has_zeros {
        let ends = [(first - 0.5, floor), (last + 0.5, floor)];
        chart.draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.stroke_width(1)))?;
        let zero = Text::new("0", (-16, -7), ("sans-serif", 13).into_font());
        chart.draw_series([EmptyElement::at(ends[0]) + zero])?;
    }
    legend.draw(&Text::new(panel.legend_title, (10, 44), ("sans-serif", TEXT).into_font()))?;
    for (i, ((name, points), colour)) in panel.series.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let beneath = i == 0 && panel.is_sum_first;
        let (colour, width, radius) = if beneath { (PALE, 7, 5) } else { (*colour, 2, 3) };
        let style = colour.stroke_width(width);
        // Length of a dash and of the gap after it.
        let dash = match i / N_SOLID {
            0 => None,
            1 => Some((9, 5)),
            _ => Some((3, 4)),
        };
        let shown = points.iter().map(|&(x, y)| (x, if y > 0.0 { y } else { floor }));
        match dash {
            None => chart.draw_series(LineSeries::new(shown, style)).map(|_| ()),
            Some((on, off)) => chart.draw_series(DashedLineSeries::new(shown, on, off, style)).map(|_| ()),
        }?;
        let positive = points.iter().filter(|p| p.1 > 0.0).copied();
        let zeros = points.iter().filter(|p| p.1 <= 0.0).map(|p| (p.0, floor));
        chart.draw_series(zeros.map(|at| Circle::new(at, radius + 2 * i as i32, colour.stroke_width(1))))?;
        match dash {
            None => {
                chart.draw_series(positive.map(|at| Circle::new(at, radius, colour.filled()))).map(|_| ())
            }
            Some(_) => chart
                .draw_series(positive.map(|at| TriangleMarker::new(at, radius + 2, colour.filled())))
                .map(|_| ()),
        }?;
        let y = (LEGEND_TOP + LEGEND_LINE * i as u32) as i32;
        let (on, off) = dash.unwrap_or((28, 1));
        for from in (10..38).step_by((on + off) as usize) {
            legend.draw(&PathElement::new(vec![(from, y), ((from + on).min(38), y)], style))?;
        }
        match dash {
            None => legend.draw(&Circle::new((24, y), radius, colour.filled())),
            Some(_) => legend.draw(&TriangleMarker::new((24, y), radius + 2, colour.filled())),
        }?;
        let text = legend_text(name, points);
        legend.draw(&Text::new(text, (46, y - 8), ("sans-serif", TEXT).into_font()))?;
    }
    Ok(())
}

/// Room beyond the outer decades, so that their ticks are drawn.
const ROOM: f64 = 1.1;

/// The powers of ten around all positive values.
fn decades(panel: &Panel) -> (f64, f64) {
    let positive =
        || panel.series.iter().flat_map(|(_, points)| points.iter().map(|p| p.1)).filter(|y| *y > 0.0);
    let (low, high) = positive().fold((f64::INFINITY, 0.0_f64), |(a, b), y| (a.min(y), b.max(y)));
    if high == 0.0 {
        return (1e-3, 1.0);
    }
    let (low, high) = (low.log10().floor(), high.log10().ceil());
    (10_f64.powf(low), 10_f64.powf(if high > low { high } else { low + 1.0 }))
}

/// A tick's value without the last bits of its power.
fn rounded(value: f64) -> f64 {
    let scale = 10_f64.powf(2.0 - value.abs().max(1e-300).log10().floor());
    let digits = (value * scale).round() / scale;
    format!("{digits:.2e}").parse().unwrap_or(digits)
}
