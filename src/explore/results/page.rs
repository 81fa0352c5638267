//! The page: one HTML file with everything in it.
//!
//! ```text
//! Results --Data: columns of numbers, base board and lines that differ--> JSON, `<` escaped --+
//! page/page.html (frame), style.css, *.js --compiled in-------------------------------------> page.html
//! ```
//! No network, no library. Numbers stand column by column, as 10,000 rows are read faster so.

use serde::Serialize;

use super::columns::{first_seen, status_name};
use super::curve::Curve;
use super::pareto::Front;
use super::sensitivity::{MetricEffects, Share, basis};
use super::words::{area_unit, summary};
use super::{AxisColumn, MetricColumn, Results, Status};

const FRAME: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/style.css");
const SCRIPTS: [&str; 5] = [
    include_str!("page/data.js"),
    include_str!("page/scatter.js"),
    include_str!("page/table.js"),
    include_str!("page/detail.js"),
    include_str!("page/charts.js"),
];

/// What the scripts read.
#[derive(Serialize)]
struct Data<'a> {
    question: &'a str,
    name: &'a str,
    summary: String,
    about: Vec<(&'static str, String)>,
    axes: &'a [AxisColumn],
    metrics: &'a [MetricColumn],
    causes: Vec<&'static str>,
    base: &'a str,
    rows: Rows<'a>,
    sensitivity: Vec<Sensitivity>,
    curves: Vec<CurveData>,
    impossible: Vec<(&'a str, usize)>,
}

/// Columns of the rows.
#[derive(Serialize)]
struct Rows<'a> {
    point: Vec<u64>,
    status: Vec<&'static str>,
    /// Row and error of those that failed.
    errors: Vec<(usize, &'a str)>,
    /// Of each axis, the place of each row's value.
    values: Vec<Vec<i64>>,
    /// Of each metric.
    metrics: Vec<Vec<Option<f64>>>,
    half_width_cycles: Vec<(usize, f64)>,
    rank: Vec<Option<u32>>,
    limit: Vec<Option<(&'a str, f64)>>,
    block: Vec<&'a str>,
    kinds: Vec<&'a str>,
    /// Of each kind and row, thousandths of its cycles by cause; empty: not run.
    stalls: Vec<Vec<Vec<u32>>>,
    area_unit: &'static str,
    blocks: Vec<&'a str>,
    /// Of each block and row.
    area: Vec<Vec<Option<f64>>>,
    board: Vec<Board<'a>>,
    /// What all commands begin and end with, and what is between.
    command: (&'a str, &'a str, Vec<&'a str>),
}

/// A board file.
#[derive(Serialize)]
#[serde(untagged)]
enum Board<'a> {
    /// As the base but for these lines.
    Lines(Vec<(usize, &'a str)>),
    /// Of another number of lines: in full.
    Whole(&'a str),
}

#[derive(Serialize)]
struct Sensitivity {
    metric: usize,
    basis: String,
    /// Of each axis: share, or why not, and how the means go.
    cells: Vec<(Option<f64>, &'static str)>,
}

#[derive(Serialize)]
struct CurveData {
    axis: usize,
    along: String,
    /// Columns of the metrics that are drawn.
    metrics: Vec<usize>,
    x: Vec<f64>,
    /// Of every metric at each x.
    y: Vec<Vec<Option<f64>>>,
    /// Objective, place along x, reason.
    optima: Vec<(usize, usize, String)>,
    limits: String,
}

/// The page of a sweep.
pub fn page(results: &Results, front: &Front, curves: &[Curve], effects: &[MetricEffects]) -> String {
    let data = data(results, front, curves, effects);
    // Strings and numbers are always JSON; `<` may not end the script it stands in.
    let json = serde_json::to_string(&data).unwrap_or_default().replace('<', "\\u003c");
    let title = results.question.replace('&', "&amp;").replace('<', "&lt;");
    let mut out = FRAME.replacen("{{title}}", &title, 1).replacen("{{style}}", STYLE, 1);
    // Last: what is put in may hold anything.
    let (before, after) = out.split_once("{{scripts}}").unwrap_or((&out, ""));
    out = format!(
        "{before}<script type=\"application/json\" id=\"data\">{json}</script>\n<script>\n\"use strict\";\n{}</script>{after}",
        SCRIPTS.concat()
    );
    out
}

fn data<'a>(results: &'a Results, front: &Front, curves: &[Curve], effects: &[MetricEffects]) -> Data<'a> {
    let mut about = vec![
        ("space", format!("{} ({})", results.name, results.space_file)),
        ("technology", results.technology.clone()),
        ("search", results.search.clone()),
        ("version", results.version.clone()),
    ];
    about.extend(results.workloads.iter().map(|w| ("workload", w.clone())));
    let reasons = results.impossible.iter().map(|i| i.reason.as_str());
    Data {
        question: &results.question,
        name: &results.name,
        summary: summary(results, front.members.len()),
        about,
        axes: &results.axes,
        metrics: &results.metrics,
        causes: rtl_model::sim::Cause::ALL.iter().map(|c| c.name()).collect(),
        base: &results.base,
        rows: rows(results, front),
        sensitivity: effects.iter().map(|e| sensitivity(results, e)).collect(),
        curves: curves.iter().map(|c| curve(results, front, c)).collect(),
        impossible: super::words::by_frequency(reasons),
    }
}

fn rows<'a>(results: &'a Results, front: &Front) -> Rows<'a> {
    let rows = &results.rows;
    let place = |axis: usize, row: &super::Row| {
        let at = row.values.get(axis).and_then(|v| results.axes[axis].values.iter().position(|a| a == v));
        at.map_or(-1, |at| at as i64)
    };
    let kinds = first_seen(rows.iter().flat_map(|r| r.stalls.iter().map(|s| s.kind.as_str())));
    let blocks = first_seen(rows.iter().flat_map(|r| r.area.iter().map(|a| a.0.as_str())));
    let thousandths = |row: &super::Row, kind: &str| -> Vec<u32> {
        let Some(stalls) = row.stalls.iter().find(|s| s.kind == kind) else { return Vec::new() };
        let sum = stalls.cycles.iter().sum::<u64>().max(1);
        stalls.cycles.iter().map(|c| (1000.0 * *c as f64 / sum as f64).round() as u32).collect()
    };
    let base: Vec<&str> = results.base.lines().collect();
    Rows {
        point: rows.iter().map(|r| r.ordinal).collect(),
        status: rows.iter().map(|r| status_name(&r.status)).collect(),
        errors: (rows.iter().enumerate())
            .filter_map(
                |(i, r)| if let Status::Failed(what) = &r.status { Some((i, what.as_str())) } else { None },
            )
            .collect(),
        values: (0..results.axes.len()).map(|a| rows.iter().map(|r| place(a, r)).collect()).collect(),
        metrics: (0..results.metrics.len())
            .map(|m| {
                rows.iter().map(|r| r.metrics.get(m).copied().flatten().filter(|x| x.is_finite())).collect()
            })
            .collect(),
        half_width_cycles: (rows.iter().enumerate())
            .filter_map(|(i, r)| Some((i, r.half_width_cycles?)))
            .collect(),
        rank: front.rank.clone(),
        limit: rows.iter().map(|r| r.limit.as_ref().map(|l| (l.0.as_str(), l.1))).collect(),
        block: rows.iter().map(|r| r.critical_block.as_str()).collect(),
        stalls: kinds.iter().map(|k| rows.iter().map(|r| thousandths(r, k)).collect()).collect(),
        kinds,
        area_unit: area_unit(results),
        area: blocks
            .iter()
            .map(|b| rows.iter().map(|r| r.area.iter().find(|a| a.0 == *b).map(|a| a.1)).collect())
            .collect(),
        blocks,
        board: rows.iter().map(|r| board(&base, &r.board)).collect(),
        command: common(&rows.iter().map(|r| r.command.as_str()).collect::<Vec<_>>()),
    }
}

fn board<'a>(base: &[&str], text: &'a str) -> Board<'a> {
    if text.lines().count() != base.len() {
        return Board::Whole(text);
    }
    let lines = text.lines().zip(base).enumerate();
    Board::Lines(lines.filter(|(_, (line, base))| line != *base).map(|(i, (line, _))| (i, line)).collect())
}

/// What all texts begin and end with, and what each has between.
fn common<'a>(texts: &[&'a str]) -> (&'a str, &'a str, Vec<&'a str>) {
    let Some(first) = texts.first() else { return ("", "", Vec::new()) };
    let mut prefix = *first;
    for text in texts {
        let same = prefix
            .char_indices()
            .zip(text.chars())
            .take_while(|((_, a), b)| a == b)
            .map(|((i, a), _)| i + a.len_utf8());
        prefix = &prefix[..same.last().unwrap_or(0)];
    }
    let rests: Vec<&str> = texts.iter().map(|t| &t[prefix.len()..]).collect();
    let mut suffix = rests[0];
    for rest in &rests {
        let same = suffix
            .char_indices()
            .rev()
            .zip(rest.chars().rev())
            .take_while(|((_, a), b)| a == b)
            .map(|((i, _), _)| i);
        suffix = &suffix[same.last().unwrap_or(suffix.len())..];
    }
    let between = rests.iter().map(|r| &r[..r.len() - suffix.len()]).collect();
    (prefix, suffix, between)
}

fn sensitivity(results: &Results, effects: &MetricEffects) -> Sensitivity {
    let cell = |(axis, effect): (usize, &super::sensitivity::Effect)| match effect.share {
        Share::Of(share) => (Some(share), super::charts::direction(results, axis, effect)),
        Share::Constant => (None, "constant"),
        Share::TooFew => (None, "too few rows"),
    };
    Sensitivity {
        metric: effects.metric,
        basis: basis(results, effects),
        cells: effects.effects.iter().enumerate().map(cell).collect(),
    }
}

fn curve(results: &Results, front: &Front, curve: &Curve) -> CurveData {
    let y = (0..results.metrics.len()).map(|m| {
        let known = curve.values(results, m);
        curve.stops.iter().map(|s| known.iter().find(|k| k.0 == s.0).map(|k| k.1)).collect()
    });
    let optima = front.objectives.iter().filter_map(|m| curve.optimum(results, *m));
    CurveData {
        axis: curve.axis,
        along: curve.along.clone(),
        metrics: super::charts::shown_metrics(results, front, curve),
        x: curve.stops.iter().map(|s| s.0).collect(),
        y: y.collect(),
        optima: optima.map(|o| (o.metric, o.stop, o.reason())).collect(),
        limits: curve.limits(results),
    }
}
