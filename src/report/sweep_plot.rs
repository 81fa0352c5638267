//! The sweep as a picture: misclassified rays, error of t and undecided first tests over the swept width, one SVG.
//!
//! ```text
//! SweepReport --> panels, one under the other, each: y on a logarithmic scale, its legend at its right
//! ```
//! A logarithmic scale has no place for 0: there a line is interrupted, and a series of zeros is named as such.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::si::{number, share};
use super::verify::{SweepReport, SweepRow};

/// Size of the picture without its panels, and of a panel (pixels).
const WIDTH: u32 = 960;
const HEAD: u32 = 56;
const PANEL: u32 = 330;
/// Where a panel's legend begins.
const LEGEND: u32 = 760;

/// Colours that stay apart for colour-blind readers and in print (Okabe, Ito 2008).
const COLOURS: [RGBColor; 7] = [
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
    let mut svg = String::new();
    {
        let panels = panels(sweep);
        let size = (WIDTH, HEAD + PANEL * panels.len() as u32);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&root, sweep, &panels, scene, board).map_err(|e| e.to_string())?;
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(svg)
}

fn panels(sweep: &SweepReport) -> Vec<Panel> {
    let over = |name: String, y: &dyn Fn(&SweepRow) -> f64| {
        (name, sweep.rows.iter().map(|row| (f64::from(row.value), y(row))).collect())
    };
    let percent = |part: u64, whole: u64| 100.0 * share(part, whole);
    let mut causes = vec![over("all".to_owned(), &|row| 100.0 * row.findings.misclassified.share)];
    for (i, name) in ["edge", "depth tie", "t step", "unexplained"].into_iter().enumerate() {
        let y = |row: &SweepRow| percent(row.findings.misclassified.causes()[i].1, row.findings.n_rays);
        causes.push(over(name.to_owned(), &y));
    }
    let errors = vec![
        over("largest".to_owned(), &|row| 1e3 * row.findings.t_error.max_m),
        over("99 % of hits".to_owned(), &|row| 1e3 * row.findings.t_error.p99_m),
        over("median".to_owned(), &|row| 1e3 * row.findings.t_error.median_m),
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
    all
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError<'a> = DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>;

fn draw<'a>(
    root: &Area<'a>,
    sweep: &SweepReport,
    panels: &[Panel],
    scene: &str,
    board: &str,
) -> Result<(), DrawError<'a>> {
    root.fill(&WHITE)?;
    let (head, rest) = root.split_vertically(HEAD);
    let rays = sweep.rows.first().map_or(0, |row| row.findings.n_rays);
    let title = format!("{scene} on {board}: {}", sweep.parameter);
    head.draw(&Text::new(title, (16, 10), ("sans-serif", 22).into_font()))?;
    let differ: u64 = sweep.rows.iter().map(|row| row.findings.n_mismatches).sum();
    let note = format!(
        "{rays} rays a value, {differ} of all answers differ between board and oracle; a value of 0 is not drawn"
    );
    head.draw(&Text::new(note, (16, 36), ("sans-serif", 14).into_font()))?;
    for (area, panel) in rest.split_evenly((panels.len().max(1), 1)).iter().zip(panels) {
        draw_panel(area, sweep.parameter, panel)?;
    }
    Ok(())
}

fn draw_panel<'a>(area: &Area<'a>, parameter: &str, panel: &Panel) -> Result<(), DrawError<'a>> {
    let (plot, legend) = area.split_horizontally(LEGEND);
    let xs = panel.series.iter().flat_map(|(_, points)| points.iter().map(|p| p.0));
    let (first, last) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let (low, high) = decades(panel);
    let mut chart = ChartBuilder::on(&plot)
        .caption(panel.title, ("sans-serif", 17))
        .margin(8)
        .x_label_area_size(42)
        .y_label_area_size(74)
        .build_cartesian_2d(first - 0.5..last + 0.5, (low..high).log_scale())?;
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
        .y_label_formatter(&|y| number(rounded(*y)))
        .axis_desc_style(("sans-serif", 14))
        .label_style(("sans-serif", 13))
        .draw()?;
    legend.draw(&Text::new(panel.legend_title, (10, 44), ("sans-serif", 14).into_font()))?;
    for (i, ((name, points), colour)) in panel.series.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let beneath = i == 0 && panel.is_sum_first;
        let (colour, width, radius) = if beneath { (PALE, 7, 5) } else { (*colour, 2, 3) };
        let style = colour.stroke_width(width);
        for run in points.split(|p| p.1 <= 0.0).filter(|run| !run.is_empty()) {
            chart.draw_series(LineSeries::new(run.iter().copied(), style))?;
            chart.draw_series(run.iter().map(|p| Circle::new(*p, radius, colour.filled())))?;
        }
        let y = 72 + 22 * i as i32;
        let none = points.iter().all(|p| p.1 <= 0.0);
        let name = if none { format!("{name}: 0 throughout") } else { name.clone() };
        legend.draw(&PathElement::new(vec![(10, y), (38, y)], style))?;
        legend.draw(&Circle::new((24, y), radius, colour.filled()))?;
        legend.draw(&Text::new(name, (46, y - 8), ("sans-serif", 14).into_font()))?;
    }
    Ok(())
}

/// Room beyond the outer decades, so that their ticks are drawn.
const ROOM: f64 = 1.1;

/// The powers of ten around all positive values, with a little room.
fn decades(panel: &Panel) -> (f64, f64) {
    let positive =
        || panel.series.iter().flat_map(|(_, points)| points.iter().map(|p| p.1)).filter(|y| *y > 0.0);
    let (low, high) = positive().fold((f64::INFINITY, 0.0_f64), |(a, b), y| (a.min(y), b.max(y)));
    if high == 0.0 {
        return (1e-3 / ROOM, ROOM);
    }
    let (low, high) = (low.log10().floor(), high.log10().ceil());
    (10_f64.powf(low) / ROOM, 10_f64.powf(if high > low { high } else { low + 1.0 }) * ROOM)
}

/// A tick's value without the last bits of its power.
fn rounded(value: f64) -> f64 {
    let scale = 10_f64.powf(2.0 - value.abs().max(1e-300).log10().floor());
    let digits = (value * scale).round() / scale;
    format!("{digits:.2e}").parse().unwrap_or(digits)
}
