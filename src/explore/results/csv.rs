//! CSV (RFC 4180): the rows; beside them what their columns mean; the combinations that cannot be built.
//!
//! ```text
//! columns --> results.csv: a header, then a row a point     results-columns.csv: name, type, unit, meaning of each
//! impossible --> impossible.csv: point, axes, reason
//! ```
//! A cell without a value is empty; texts with commas, quotes or line ends stand in quotes. Numbers have all their digits.

use super::Results;
use super::columns::{Cells, Column};
use crate::report::si::number;

/// The rows of all columns, a header first.
pub fn rows(columns: &[Column<'_>], n_rows: usize) -> String {
    let mut out = String::new();
    line(&mut out, columns.iter().map(|c| quoted(&c.name)));
    for row in 0..n_rows {
        line(&mut out, columns.iter().map(|c| cell(&c.cells, row)));
    }
    out
}

/// A row a column: its name, type, unit and meaning.
pub fn meanings(columns: &[Column<'_>]) -> String {
    let mut out = "column,type,unit,meaning\n".to_owned();
    for c in columns {
        line(&mut out, [&c.name, c.cells.kind(), &c.unit, &c.what].into_iter().map(quoted));
    }
    out
}

/// A row a combination that cannot be built.
pub fn impossible(results: &Results) -> String {
    let mut out = String::new();
    let names = results.axes.iter().map(|a| quoted(&a.name));
    line(&mut out, ["point".to_owned()].into_iter().chain(names).chain(["reason".to_owned()]));
    for i in &results.impossible {
        // The last axis is the fastest.
        let mut rest = i.ordinal;
        let mut values: Vec<String> = Vec::new();
        for axis in results.axes.iter().rev() {
            let n = (axis.values.len() as u64).max(1);
            values.push(
                axis.values.get((rest % n) as usize).map_or_else(String::new, |v| quoted(&v.to_string())),
            );
            rest /= n;
        }
        let values = values.into_iter().rev();
        line(&mut out, [i.ordinal.to_string()].into_iter().chain(values).chain([quoted(&i.reason)]));
    }
    out
}

fn line(out: &mut String, cells: impl Iterator<Item = String>) {
    for (i, cell) in cells.enumerate() {
        if i > 0 {
            out.push(',');
        }
        out.push_str(&cell);
    }
    out.push('\n');
}

fn cell(cells: &Cells<'_>, row: usize) -> String {
    let text = match cells {
        Cells::Bool(v) => v[row].map(|b| b.to_string()),
        Cells::Integer(v) => v[row].map(|n| n.to_string()),
        Cells::Float(v) => v[row].map(number),
        Cells::Text(v) => v[row].as_deref().map(quoted),
    };
    text.unwrap_or_default()
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
