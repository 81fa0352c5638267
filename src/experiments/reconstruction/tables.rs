//! Runs as tables and plots.
//!
//! ```text
//! [Run] --> wall by wall | a metric over meshes, a method a column | a scene, a method a row | lines over elements
//! ```

use super::lit_cube::Light;
use super::measure::{CONSTANT, LIMITED, Measured, ways};
use super::pictures::Shown;
use super::scenes::{Graded, Run};
use crate::experiments::plot::{Mark, Panel, Scale, Series};
use crate::experiments::table::{Cell, Table, row};
use crate::reconstruct::metrics::Metrics;

/// Names of a table's method columns.
fn method_columns(first: &[&'static str]) -> Vec<&'static str> {
    first.iter().copied().chain(ways().map(|w| w.name)).collect()
}

fn percent(share: f64) -> f64 {
    100.0 * share
}

/// One mesh, part by part: every method.
pub fn by_part(title: &str, run: &Run) -> Table {
    let columns = [
        "surface",
        "method",
        "L2 (%)",
        "Linf (%)",
        "H1 (%)",
        "jump (%)",
        "band (1/m)",
        "overshoot (%)",
        "negative (%)",
        "energy drift (%)",
    ];
    let mut table = Table::new(title, &columns);
    for (p, part) in run.parts.iter().enumerate() {
        for (way, measured) in &run.rows {
            let m = &measured.parts[p];
            table.push(row![
                *part,
                way.name,
                percent(m.l2),
                percent(m.linf),
                percent(m.h1),
                percent(m.jump),
                m.band,
                percent(m.overshoot),
                percent(m.negative_share),
                percent(m.energy_drift),
            ]);
        }
    }
    table
}

/// One metric over the meshes of a scene, a method a column.
pub fn over_meshes(title: &str, runs: &[&Run], metric: impl Fn(&Metrics) -> f64) -> Table {
    let mut table = Table::new(title, &method_columns(&["mesh", "elements"]));
    for run in runs {
        let values = run.rows.iter().map(|(_, m)| Cell::Number(metric(&m.all)));
        table.push(row![run.mesh.clone(), run.n_elements as u64].into_iter().chain(values).collect());
    }
    table
}

/// All meshes of a scene, a method a row, all parts together.
pub fn by_method(title: &str, runs: &[&Run]) -> Table {
    let columns = [
        "mesh",
        "elements",
        "method",
        "L2 (%)",
        "Linf (%)",
        "H1 (%)",
        "band (1/m)",
        "overshoot (%)",
        "negative (%)",
        "energy drift (%)",
        "limited vertices",
        "ns a point",
    ];
    let mut table = Table::new(title, &columns);
    for run in runs {
        for (way, Measured { all: m, ns_per_point, n_limited, .. }) in &run.rows {
            table.push(row![
                run.mesh.clone(),
                run.n_elements as u64,
                way.name,
                percent(m.l2),
                percent(m.linf),
                percent(m.h1),
                m.band,
                percent(m.overshoot),
                percent(m.negative_share),
                percent(m.energy_drift),
                *n_limited as u64,
                *ns_per_point,
            ]);
        }
    }
    table
}

/// What grading gains.
pub fn graded_table(rows: &[Graded], parts: &[&'static str]) -> Table {
    let columns = ["light", "elements a wall", "method", "surface", "even L2 (%)", "graded L2 (%)", "gain"];
    let mut table =
        Table::new("lit-cube, the same number of elements even and graded to the edges", &columns);
    for g in rows {
        let light = if g.light == Light::Direct { "direct" } else { "indirect" };
        for (part, [even, graded]) in parts.iter().copied().chain(["all"]).zip(&g.l2) {
            if *even > 0.0 {
                table.push(row![
                    light,
                    g.n,
                    g.way.name,
                    part,
                    percent(*even),
                    percent(*graded),
                    even / graded
                ]);
            }
        }
    }
    table
}

/// Pictures against their references.
pub fn shown_table(shown: &[Shown]) -> Table {
    let columns = [
        "scene",
        "picture",
        "RMS second difference",
        "added to the reference's",
        "99th percentile of what is added",
    ];
    let mut table = Table::new("Pictures, over the mean luminance per square of a pixel", &columns);
    for s in shown {
        let Some(b) = &s.bands else { continue };
        table.push(row![s.view, s.way, b.rms_b, b.rms_added, b.p99_added]);
    }
    table
}

/// A metric over elements, a line a method that interpolates: even meshes.
pub fn panel(title: &str, axis: &str, runs: &[&Run], metric: impl Fn(&Metrics) -> f64) -> Panel {
    let mut panel = Panel::new(title, ("elements along a metre", Scale::Log), (axis, Scale::Log));
    // Where nothing is limited that line is `hermite`'s, and there are seven colours.
    let drawn = ways().into_iter().filter(|w| !matches!(w.name, CONSTANT | LIMITED));
    for (colour, way) in drawn.enumerate() {
        let points = runs.iter().map(|r| (1.0 / r.element_m, metric(&r.by(way.name).all)));
        // What is 0 has no place on a logarithmic axis.
        let points: Vec<(f64, f64)> = points.filter(|p| p.1 > 0.0).collect();
        if !points.is_empty() {
            panel.series.push(Series::new(way.name, Mark::Line, colour, points));
        }
    }
    panel
}
