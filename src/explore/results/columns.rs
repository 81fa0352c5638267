//! A sweep as typed columns: one row a candidate, for Parquet and CSV.
//!
//! ```text
//! point | axes | metrics, with how well they are known | limit, path | front | counter_* | stall_KIND_CAUSE | area_BLOCK
//!       | board.PARAMETER of the whole board file | board, command
//! ```
//! Names are those of the axes and metrics. An axis called as another column is `axis.NAME`. Columns of counters, stalls
//! and areas are cells without a value where a candidate was not run.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};

use rtl_model::sim::Cause;
use rtl_model::spec::{BoardSpec, ParameterRow};

use super::pareto::Front;
use super::{Results, Row, Status};
use crate::explore::value::Value;

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column<'a> {
    /// Its name; all differ.
    pub name: String,
    /// Unit; empty: none.
    pub unit: String,
    /// In a few words.
    pub what: String,
    /// A cell a row.
    pub cells: Cells<'a>,
}

/// Cells of one type.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells<'a> {
    /// True or false.
    Bool(Vec<Option<bool>>),
    /// Whole numbers.
    Integer(Vec<Option<i64>>),
    /// Numbers.
    Float(Vec<Option<f64>>),
    /// Words.
    Text(Vec<Option<Cow<'a, str>>>),
}

impl Cells<'_> {
    /// Name of the type.
    pub fn kind(&self) -> &'static str {
        match self {
            Cells::Bool(_) => "boolean",
            Cells::Integer(_) => "integer",
            Cells::Float(_) => "float",
            Cells::Text(_) => "text",
        }
    }
}

/// The name of a status in files.
pub fn status_name(status: &Status) -> &'static str {
    match status {
        Status::Simulated => "simulated",
        Status::Sampled => "sampled",
        Status::Shortened => "shortened",
        Status::Pruned => "pruned",
        Status::Failed(_) => "failed",
    }
}

/// A count as it is kept in files.
fn whole(n: u64) -> i64 {
    i64::try_from(n).unwrap_or(i64::MAX)
}

/// Part of a name: lower case letters, digits and underscores.
pub(super) fn key(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect()
}

/// Cells of the narrowest type that holds all of these.
fn typed<'a>(values: Vec<Option<Value>>) -> Cells<'a> {
    let all = |holds: fn(&Value) -> bool| values.iter().flatten().all(holds);
    if all(|v| matches!(v, Value::Bool(_))) && values.iter().any(Option::is_some) {
        let of = |v| if let Value::Bool(b) = v { Some(b) } else { None };
        Cells::Bool(values.into_iter().map(|v| v.and_then(of)).collect())
    } else if all(|v| matches!(v, Value::Integer(_))) {
        let of = |v| if let Value::Integer(n) = v { Some(n) } else { None };
        Cells::Integer(values.into_iter().map(|v| v.and_then(of)).collect())
    } else if all(|v| v.number().is_some()) {
        Cells::Float(values.into_iter().map(|v| v.and_then(|v| v.number())).collect())
    } else {
        Cells::Text(values.into_iter().map(|v| v.map(|v| Cow::Owned(v.to_string()))).collect())
    }
}

/// Columns as they come, each under a name of its own.
struct Table<'a> {
    rows: &'a [Row],
    columns: Vec<Column<'a>>,
    names: HashSet<String>,
}

impl<'a> Table<'a> {
    fn push(&mut self, name: impl Into<String>, unit: &str, what: impl Into<String>, cells: Cells<'a>) {
        let mut name = name.into();
        while !self.names.insert(name.clone()) {
            name.push('_');
        }
        self.columns.push(Column { name, unit: unit.to_owned(), what: what.into(), cells });
    }

    fn text(&mut self, name: &str, what: &str, of: impl Fn(&'a Row) -> Option<Cow<'a, str>>) {
        self.push(name, "", what, Cells::Text(self.rows.iter().map(of).collect()));
    }

    fn float(&mut self, name: String, unit: &str, what: &str, of: impl Fn(&Row) -> Option<f64>) {
        self.push(name, unit, what, Cells::Float(self.rows.iter().map(of).collect()));
    }

    fn integer(&mut self, name: String, unit: &str, what: &str, of: impl Fn(&Row) -> Option<i64>) {
        self.push(name, unit, what, Cells::Integer(self.rows.iter().map(of).collect()));
    }
}

/// All columns of a sweep.
pub fn columns<'a>(results: &'a Results, front: &Front) -> Vec<Column<'a>> {
    let mut t = Table { rows: &results.rows, columns: Vec::new(), names: HashSet::new() };
    t.integer("point".to_owned(), "", "place in the full grid, the last axis fastest", |r| {
        Some(whole(r.ordinal))
    });
    let status =
        "simulated; sampled: cycles estimated; shortened: a part of the workload; pruned: not run; failed";
    t.text("status", status, |r| Some(Cow::Borrowed(status_name(&r.status))));
    t.text("error", "what a failed point ran into", |r| match &r.status {
        Status::Failed(what) => Some(Cow::Borrowed(what.as_str())),
        _ => None,
    });
    // Later columns keep their names.
    let reserved: HashSet<&str> = (results.metrics.iter().map(|m| m.name.as_str()))
        .chain(["half_width_cycles", "on_front", "pareto_rank", "limit_resource", "limit_share"])
        .chain(["critical_block", "board", "command"])
        .collect();
    let units = parameter_units(&results.base);
    for (i, axis) in results.axes.iter().enumerate() {
        let taken = reserved.contains(axis.name.as_str());
        let name = if taken { format!("axis.{}", axis.name) } else { axis.name.clone() };
        let values = results.rows.iter().map(|row| row.values.get(i).cloned()).collect();
        t.push(name, units.get(&axis.name).map_or("", String::as_str), "axis", typed(values));
    }
    for (i, metric) in results.metrics.iter().enumerate() {
        let of = |row: &Row| row.metrics.get(i).copied().flatten();
        let what =
            if metric.is_objective { format!("{}; objective", metric.what) } else { metric.what.clone() };
        t.float(metric.name.clone(), &metric.unit, &what, of);
    }
    t.float("half_width_cycles".to_owned(), "cycles", "half the 95 % interval of estimated cycles", |r| {
        r.half_width_cycles
    });
    let member = (0..results.rows.len()).map(|i| front.rank[i].map(|rank| rank == 0));
    t.push(
        "on_front",
        "",
        "not dominated in the objectives; empty: not compared",
        Cells::Bool(member.collect()),
    );
    let rank = front.rank.iter().map(|rank| rank.map(i64::from));
    t.push(
        "pareto_rank",
        "",
        "0 on the front, 1 on the front of the rest, ...",
        Cells::Integer(rank.collect()),
    );
    t.text("limit_resource", "what limits the board most", |r| {
        Some(Cow::Borrowed(r.limit.as_ref()?.0.as_str()))
    });
    let share = "cycles that this resource needs at least, of those taken";
    t.float("limit_share".to_owned(), "", share, |r| Some(r.limit.as_ref()?.1));
    t.text("critical_block", "block with the longest path", |r| {
        (!r.critical_block.is_empty()).then_some(Cow::Borrowed(r.critical_block.as_str()))
    });
    counted(&mut t, results);
    boards(&mut t, &units);
    t.text("board", "the whole board file (TOML)", |r| Some(Cow::Borrowed(r.board.as_str())));
    t.text("command", "runs the point again", |r| Some(Cow::Borrowed(r.command.as_str())));
    t.columns
}

/// Counters, stalls, areas.
fn counted(t: &mut Table<'_>, results: &Results) {
    for (i, counter) in results.counters.iter().enumerate() {
        let of = |row: &Row| row.counters.get(i).map(|n| whole(*n));
        let unit = match () {
            () if counter.ends_with("cycles") => "cycles",
            () if counter.ends_with("bytes") => "B",
            () => "",
        };
        t.integer(format!("counter_{}", key(counter)), unit, counter, of);
    }
    for kind in first_seen(t.rows.iter().flat_map(|row| row.stalls.iter().map(|s| s.kind.as_str()))) {
        for (i, cause) in Cause::ALL.iter().enumerate() {
            let of = |row: &Row| row.stalls.iter().find(|s| s.kind == kind).map(|s| whole(s.cycles[i]));
            let what = format!("all {kind}: {}", cause.name());
            t.integer(format!("stall_{}_{}", key(kind), key(cause.name())), "cycles", &what, of);
        }
    }
    let unit = super::words::area_unit(results);
    for block in first_seen(t.rows.iter().flat_map(|row| row.area.iter().map(|a| a.0.as_str()))) {
        let of = |row: &Row| row.area.iter().find(|a| a.0 == block).map(|a| a.1);
        t.float(format!("area_{}", key(block)), unit, &format!("all {block}"), of);
    }
}

/// Names, each once, in the order in which they first come.
pub(super) fn first_seen<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = HashSet::new();
    names.filter(|name| seen.insert(*name)).collect()
}

/// Every parameter of the boards.
fn boards(t: &mut Table<'_>, units: &BTreeMap<String, String>) {
    let n = t.rows.len();
    let mut parameters: BTreeMap<String, Vec<Option<Value>>> = BTreeMap::new();
    for (i, row) in t.rows.iter().enumerate() {
        for (name, value) in parameters_of(&row.board) {
            parameters.entry(name).or_insert_with(|| vec![None; n])[i] = Some(value);
        }
    }
    for (name, values) in parameters {
        let unit = units.get(&name).map_or("", String::as_str);
        t.push(format!("board.{name}"), unit, "parameter of the board", typed(values));
    }
}

/// Units of the parameters that have one, as the board's own list tells them.
fn parameter_units(board: &str) -> BTreeMap<String, String> {
    let parameters = BoardSpec::from_toml(board).map(|spec| spec.parameters()).unwrap_or_default();
    let unit = |row: ParameterRow| {
        let (number, unit) = row.value.split_once(' ')?;
        number.parse::<f64>().is_ok().then(|| (row.name.to_owned(), unit.to_owned()))
    };
    parameters.into_iter().filter_map(unit).collect()
}

/// Dotted names and values of a board file; of something else, nothing.
pub(super) fn parameters_of(board: &str) -> Vec<(String, Value)> {
    fn walk(out: &mut Vec<(String, Value)>, prefix: &str, table: &toml::Table) {
        for (key, value) in table {
            let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
            out.push(match value {
                toml::Value::Table(inner) => {
                    walk(out, &name, inner);
                    continue;
                }
                toml::Value::Boolean(b) => (name, Value::Bool(*b)),
                toml::Value::Integer(n) => (name, Value::Integer(*n)),
                toml::Value::Float(x) => (name, Value::Float(*x)),
                toml::Value::String(text) => (name, Value::Text(text.clone())),
                other => (name, Value::Text(other.to_string())),
            });
        }
    }
    let mut out = Vec::new();
    if let Ok(table) = toml::from_str::<toml::Table>(board) {
        walk(&mut out, "", &table);
    }
    out
}
