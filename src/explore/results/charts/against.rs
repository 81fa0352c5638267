//! Metrics along an axis, one panel under the other: what is gained, what it costs, and where each objective is best.

use super::{Chart, Drawing, axis_title, file_key, scale_for};
use crate::explore::results::Results;
use crate::explore::results::curve::Curve;
use crate::explore::results::pareto::{Front, is_measured};
use crate::explore::results::words::{shortened, shown};
use crate::plot::{Mark, Panel, Scale, Series, Sheet};

/// Most panels.
const PANELS: usize = 8;
/// Characters of a legend's line.
const LEGEND: usize = 44;

/// What is always drawn, where it is known: throughput, clock, what it takes, and throughput of that.
const METRICS: [&str; 5] = ["rays_per_second", "clock_mhz", "area_mm2", "luts", "rays_per_second_per_mm2"];

/// Columns of the metrics that are drawn.
pub(in crate::explore::results) fn metrics(results: &Results, front: &Front, curve: &Curve) -> Vec<usize> {
    let usual = METRICS.iter().filter_map(|name| results.metrics.iter().position(|m| m.name == *name));
    let mut all: Vec<usize> = usual.collect();
    all.extend(front.objectives.iter().filter(|m| !all.contains(m)).copied().collect::<Vec<_>>());
    all.retain(|m| curve.values(results, *m).len() > 1);
    all.truncate(PANELS);
    all
}

pub(super) fn chart(results: &Results, front: &Front, curve: &Curve) -> Chart {
    let axis = &results.axes[curve.axis].name;
    let xs: Vec<f64> = curve.stops.iter().map(|s| s.0).collect();
    // Few values stand on a logarithmic axis themselves.
    let x_scale = match xs.as_slice() {
        [first, .., last] if *first > 0.0 && *last >= 4.0 * first => Scale::Log,
        _ => Scale::Linear { from_zero: false },
    };
    let mut notes = Vec::new();
    if !curve.along.is_empty() {
        notes.push(format!("Lines: {}.", curve.along));
    }
    let mut panels = Vec::new();
    for metric in metrics(results, front, curve) {
        let m = &results.metrics[metric];
        let points = curve.values(results, metric);
        let around: Vec<(f64, f64)> = (results.rows.iter().filter(|row| is_measured(row)))
            .filter_map(|row| Some((row.values.get(curve.axis)?.number()?, row.metrics[metric]?)))
            .collect();
        let has_others = around.len() > points.len();
        let ys: Vec<f64> = if has_others {
            around.iter().map(|p| p.1).collect()
        } else {
            points.iter().map(|p| p.1).collect()
        };
        let (factor, title) = axis_title(m, ys.iter().fold(0.0_f64, |a, b| a.max(b.abs())));
        let y_scale = match scale_for(&ys, true) {
            // A panel is compared with its neighbours: from zero, but for many decades.
            Scale::Log if ys.iter().all(|y| *y > 0.005 * ys.iter().fold(0.0, |a: f64, b| a.max(*b))) => {
                Scale::Linear { from_zero: true }
            }
            scale => scale,
        };
        let mut panel = Panel::new(m.what.clone(), (axis, x_scale.clone()), (&title, y_scale));
        let scaled = |points: &[(f64, f64)]| points.iter().map(|p| (p.0, factor * p.1)).collect::<Vec<_>>();
        if has_others {
            let name = format!("all measured points ({})", around.len());
            panel.series.push(Series::new(name, Mark::Faint, 0, scaled(&around)));
        }
        let name = if curve.is_slice { m.name.clone() } else { format!("mean {}", m.name) };
        panel.series.push(Series::new(name, Mark::Line, 1, scaled(&points)));
        for (objective, colour) in front.objectives.iter().zip([2, 3, 4, 5, 6]) {
            let Some(best) = curve.optimum(results, *objective) else { continue };
            let x = curve.stops[best.stop].0;
            let o = &results.metrics[*objective];
            let text = format!("best {} at {x}", o.name);
            panel.series.push(Series::new(shortened(&text, LEGEND), Mark::Rule, colour, [(x, 0.0)]));
            if *objective == metric {
                let text = format!("{} = {}", m.name, shown(best.value, &m.unit));
                panel.series.push(Series::new(
                    shortened(&text, LEGEND),
                    Mark::Ring,
                    colour,
                    [(x, factor * best.value)],
                ));
            }
        }
        panels.push(panel);
    }
    for objective in &front.objectives {
        notes.extend(curve.optimum(results, *objective).map(|best| best.reason()));
    }
    notes.push(curve.limits(results));
    let title = format!("{} Metrics against {axis}", results.question);
    let sheet = Sheet { title, notes, panels };
    Chart { name: format!("against-{}", file_key(axis)), drawing: Drawing::Sheet(sheet) }
}
