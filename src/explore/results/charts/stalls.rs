//! Where the ICUs' cycles went, point by point: stacked bars by cause.

use rtl_model::sim::Cause;

use super::{Chart, Drawing};
use crate::explore::results::Results;
use crate::explore::results::pareto::{Front, is_measured};
use crate::explore::results::words::shortened;
use crate::plot::{Mark, Panel, Scale, Series, Sheet};

/// Most bars.
const BARS: usize = 24;
/// Most bars whose places along the axis are told by their values.
const NAMED: usize = 10;

/// The kind of block that is shown.
const KIND: &str = "icu";

/// Rows that are shown, and which they are: all, or some spread along the one axis, or along the front.
fn shown_rows(results: &Results, front: &Front) -> (Vec<usize>, &'static str) {
    let with_stalls = |i: &usize| {
        let row = &results.rows[*i];
        is_measured(row) && row.stalls.iter().any(|s| s.kind == KIND && s.cycles.iter().any(|c| *c > 0))
    };
    let mut all: Vec<usize> = (0..results.rows.len()).filter(with_stalls).collect();
    if results.axes.len() == 1 {
        let value = |row: &usize| results.rows[*row].values[0].number().unwrap_or(0.0);
        all.sort_by(|a, b| value(a).total_cmp(&value(b)));
    }
    if all.len() <= BARS {
        return (all, "all points");
    }
    let members: Vec<usize> = front.members.iter().copied().filter(with_stalls).collect();
    let (from, which) = if members.is_empty() || results.axes.len() == 1 {
        (all, "points spread over the sweep")
    } else {
        (members, "points of the front")
    };
    if from.len() <= BARS {
        return (from, which);
    }
    let spread = (0..BARS).map(|i| from[i * (from.len() - 1) / (BARS - 1)]);
    (spread.collect(), which)
}

pub(super) fn chart(results: &Results, front: &Front) -> Option<Chart> {
    let (rows, which) = shown_rows(results, front);
    if rows.is_empty() {
        return None;
    }
    let one_axis = results.axes.len() == 1;
    let name = |row: &usize| {
        let r = &results.rows[*row];
        if one_axis {
            r.values[0].to_string()
        } else if rows.len() <= NAMED {
            let values: Vec<String> = r.values.iter().map(ToString::to_string).collect();
            let half = values.len().div_ceil(2);
            let lines: Vec<String> = values.chunks(half).map(|v| shortened(&v.join(" "), 12)).collect();
            lines.join("\n")
        } else {
            r.ordinal.to_string()
        }
    };
    let x_title = if one_axis { results.axes[0].name.as_str() } else { "" };
    let mut names: Vec<String> = rows.iter().map(name).collect();
    let is_numbered = !one_axis && rows.len() > NAMED;
    if is_numbered {
        // Every second one a line lower, as they are wider than a bar.
        names.iter_mut().skip(1).step_by(2).for_each(|name| name.insert(0, '\n'));
    }
    let mut panel = Panel::new(
        "Cycles of all ICUs by cause",
        (x_title, Scale::Names(names)),
        ("% of the ICUs' cycles", Scale::Linear { from_zero: true }),
    );
    for (i, cause) in Cause::ALL.iter().enumerate() {
        let share = |row: &usize| {
            let icu = results.rows[*row].stalls.iter().find(|s| s.kind == KIND);
            let cycles = icu.map_or([0; 10], |s| s.cycles);
            100.0 * cycles[i] as f64 / cycles.iter().sum::<u64>().max(1) as f64
        };
        let bars: Vec<(f64, f64)> = rows.iter().map(share).zip(0..).map(|(y, x)| (f64::from(x), y)).collect();
        if bars.iter().any(|b| b.1 > 0.0) {
            // Work in green; the first colour, black, for the last cause.
            let colour = [3, 2, 1, 4, 5, 6, 9, 8, 12, 13][i];
            panel.series.push(Series::new(cause.name(), Mark::Stacked, colour, bars));
        }
    }
    let mut notes = vec![format!(
        "{} of {} measured, {which}.",
        rows.len(),
        results.rows.iter().filter(|r| is_measured(r)).count()
    )];
    if is_numbered {
        let order = front.objectives.first().map_or("", |m| results.metrics[*m].name.as_str());
        notes.push(format!("Below each bar: its point. From left to right: the best {order} first."));
    } else if !one_axis {
        let axes: Vec<&str> = results.axes.iter().map(|a| a.name.as_str()).collect();
        notes.push(format!("Below each bar: {}.", axes.join(", ")));
    }
    let sheet = Sheet { title: results.question.clone(), notes, panels: vec![panel] };
    Some(Chart { name: "stalls".to_owned(), drawing: Drawing::Sheet(sheet) })
}
