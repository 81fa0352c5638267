//! Two reports of runs on the board: which counters changed and why they could, which parameters differ, which stalls
//! moved.
//!
//! ```text
//! JSON text --RunReport::parse--> RunReport (simulate | render | solve)
//! RunReport, RunReport --RunComparison::new--> canonical work, other counters, inputs, parameters, stalls
//! ```
//! Canonical work is a function of scene, rays, number formats, grid, partition and shells alone: it comes first, and
//! where it changed, with what may have changed it. Counters that only one of the reports has (an older version wrote
//! it) are not compared.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::groups::kind;

/// Schemas of reports that hold a board's counters, and where: at the top, or under `board`.
const SCHEMAS: [(&str, bool); 3] =
    [("radeng/simulate/1", true), ("radeng/render/1", false), ("radeng/solve/1", false)];

/// Stalls that moved by less than this share of the cycles are not told.
const LEAST_MOVE: f64 = 0.001;

/// A report as far as it is compared.
#[derive(Clone, Debug)]
pub struct RunReport {
    schema: &'static str,
    /// Scene, workload and options, by dotted name.
    inputs: BTreeMap<String, String>,
    /// The board's parameters, by dotted name.
    spec: BTreeMap<String, String>,
    counters: Vec<(String, bool, u64)>,
    /// Share of the cycles by kind of block and cause, mean over its instances.
    causes: BTreeMap<(String, String), f64>,
}

#[derive(Deserialize)]
struct BoardPart {
    spec: BTreeMap<String, Value>,
    cycles: u64,
    commands: Option<u64>,
    bundles: u64,
    rays: u64,
    cells: u64,
    list_entries: u64,
    tests: u64,
    hits: u64,
    low_resolution: Option<BTreeMap<String, u64>>,
    bus_down_bytes: u64,
    bus_up_bytes: u64,
    bus_down_cycles: Option<u64>,
    bus_up_cycles: Option<u64>,
    dram_busy_cycles: Option<u64>,
    rebalances: Option<u64>,
    levels: Vec<LevelPart>,
    blocks: Vec<BlockPart>,
}

#[derive(Deserialize)]
struct LevelPart {
    level: String,
    accesses: u64,
    misses: u64,
    bytes: u64,
    written_bytes: Option<u64>,
}

#[derive(Deserialize)]
struct BlockPart {
    block: String,
    cycles: BTreeMap<String, u64>,
}

/// A value under every dotted name that leads to one.
fn flatten(prefix: &str, value: &Value, into: &mut BTreeMap<String, String>) {
    let text = match value {
        Value::Object(fields) => {
            for (key, field) in fields {
                let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                flatten(&name, field, into);
            }
            return;
        }
        Value::Null => "unset".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    into.insert(prefix.to_owned(), text);
}

impl RunReport {
    /// Reads a report.
    ///
    /// # Errors
    /// What is wrong with it: no JSON, no report, one of another kind, one without a board, a counter that is missing.
    pub fn parse(text: &str) -> Result<RunReport, String> {
        let value: Value = serde_json::from_str(text).map_err(|e| format!("no JSON, or damaged: {e}"))?;
        let kinds = "expected a report of simulate, render or solve";
        let found = match value.get("schema") {
            Some(Value::String(schema)) => schema,
            Some(other) => return Err(format!("\"schema\" is {other}, {kinds}")),
            None => return Err(format!("has no \"schema\", {kinds}")),
        };
        let (schema, at_top) = *SCHEMAS
            .iter()
            .find(|(schema, _)| schema == found)
            .ok_or_else(|| format!("a report with schema {found}, {kinds}"))?;
        let board = match (at_top, value.get("board")) {
            (true, _) => &value,
            (false, Some(board @ Value::Object(_))) => board,
            (false, _) => return Err("its rays were cast in software: no counters of a board".to_owned()),
        };
        let place = if at_top { "" } else { "board." };
        let part: BoardPart = serde_path_to_error::deserialize(board)
            .map_err(|e| format!("damaged: {place}{}: {}", e.path(), e.inner()))?;
        let mut inputs = BTreeMap::new();
        // What casts rays, wherever these reports say it.
        for key in ["scene", "workload", "rays_file", "warm_up", "options", "solve_options", "caster"] {
            if let Some(field) = value.get(key) {
                flatten(key, field, &mut inputs);
            }
        }
        for key in ["options", "loaded_from"] {
            if let Some(field) = value.get("pass_1").and_then(|pass| pass.get(key)) {
                flatten(&format!("pass_1.{key}"), field, &mut inputs);
            }
        }
        let mut spec = BTreeMap::new();
        flatten("", &Value::Object(part.spec.clone().into_iter().collect()), &mut spec);
        Ok(RunReport { schema, inputs, spec, counters: part.counters(), causes: part.causes() })
    }
}

impl BoardPart {
    /// Name, canonical or not, count.
    fn counters(&self) -> Vec<(String, bool, u64)> {
        let mut counters = Vec::new();
        for (name, count) in [
            ("bundles", self.bundles),
            ("rays", self.rays),
            ("cells", self.cells),
            ("list_entries", self.list_entries),
            ("tests", self.tests),
            ("hits", self.hits),
        ] {
            counters.push((name.to_owned(), true, count));
        }
        for (name, count) in self.low_resolution.iter().flatten() {
            counters.push((format!("{LOW_RESOLUTION}{name}"), true, *count));
        }
        let others = [
            ("cycles", Some(self.cycles)),
            ("commands", self.commands),
            ("bus_down_bytes", Some(self.bus_down_bytes)),
            ("bus_up_bytes", Some(self.bus_up_bytes)),
            ("bus_down_cycles", self.bus_down_cycles),
            ("bus_up_cycles", self.bus_up_cycles),
            ("dram_busy_cycles", self.dram_busy_cycles),
            ("rebalances", self.rebalances),
        ];
        counters.extend(others.into_iter().filter_map(|(name, n)| Some((name.to_owned(), false, n?))));
        for l in &self.levels {
            let level = [
                ("accesses", Some(l.accesses)),
                ("misses", Some(l.misses)),
                ("bytes", Some(l.bytes)),
                ("written_bytes", l.written_bytes),
            ];
            let named = level.into_iter().filter_map(|(name, n)| Some((name, n?)));
            counters.extend(named.map(|(name, n)| (format!("{}.{name}", l.level), false, n)));
        }
        counters
    }

    fn causes(&self) -> BTreeMap<(String, String), f64> {
        let mut totals: BTreeMap<&str, f64> = BTreeMap::new();
        let mut sums: BTreeMap<(String, String), f64> = BTreeMap::new();
        for block in &self.blocks {
            let which = kind(&block.block);
            for (cause, cycles) in &block.cycles {
                *totals.entry(which).or_default() += *cycles as f64;
                *sums.entry((which.to_owned(), cause.replace('_', " "))).or_default() += *cycles as f64;
            }
        }
        for ((which, _), sum) in &mut sums {
            let total = totals.get(which.as_str()).copied().unwrap_or(0.0);
            *sum = if total > 0.0 { *sum / total } else { 0.0 };
        }
        sums
    }
}

const LOW_RESOLUTION: &str = "low_resolution.";

/// A counter that is not the same in both reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CounterChange {
    /// Its name in the report.
    pub counter: String,
    /// In A.
    pub a: u64,
    /// In B.
    pub b: u64,
    /// B less A.
    pub absolute: i64,
    /// B less A, over A; none where A has 0.
    pub relative: Option<f64>,
}

impl CounterChange {
    fn new(counter: &str, a: u64, b: u64) -> CounterChange {
        let difference = i128::from(b) - i128::from(a);
        let absolute = i64::try_from(difference).unwrap_or(if difference > 0 { i64::MAX } else { i64::MIN });
        let relative = (a != 0).then(|| difference as f64 / a as f64);
        CounterChange { counter: counter.to_owned(), a, b, absolute, relative }
    }

    /// How large the change is; from 0 to something it is beyond all others.
    fn magnitude(&self) -> f64 {
        self.relative.map_or(f64::INFINITY, f64::abs)
    }
}

/// A parameter or an input that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterChange {
    /// Its dotted name.
    pub name: String,
    /// In A.
    pub a: String,
    /// In B.
    pub b: String,
    /// Canonical work may change with it.
    pub may_change_work: bool,
}

/// A share of the cycles that moved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StallChange {
    /// Kind of block.
    pub kind: String,
    /// Cause.
    pub cause: String,
    /// Share of the cycles in A, mean over the blocks of the kind.
    pub a: f64,
    /// In B.
    pub b: f64,
}

/// `compare a.json b.json --report`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunComparison {
    /// [`RunComparison::SCHEMA`].
    pub schema: &'static str,
    /// The reference.
    pub a: PathBuf,
    /// What is compared with it.
    pub b: PathBuf,
    /// The schema of both.
    pub reports: &'static str,
    /// Canonical counters that changed.
    pub canonical: Vec<CounterChange>,
    /// Why they could: names of inputs and parameters that differ; empty where none of those differs that may.
    pub canonical_because_of: Vec<String>,
    /// Other counters that changed, cycles first, then by relative change.
    pub counters: Vec<CounterChange>,
    /// Counters that are equal.
    pub n_equal: usize,
    /// Scene, workload and options that differ.
    pub inputs: Vec<ParameterChange>,
    /// Parameters of the board that differ: those that may change the work first.
    pub parameters: Vec<ParameterChange>,
    /// Shares of the cycles that moved, the largest move first.
    pub stalls: Vec<StallChange>,
    /// Largest relative change that was to be accepted.
    pub threshold: Option<f64>,
    /// Counters that changed by more.
    pub over_threshold: Vec<String>,
    /// False when there are any.
    pub passed: bool,
}

/// True for parameters that canonical work depends on; of those of the low-resolution cast only its own does.
fn may_change_work(parameter: &str) -> bool {
    parameter.starts_with("formats.")
        || parameter.starts_with("dispatch.low_resolution_")
        || ["partition", "grid_log2", "shells.cells", "shells.growth", "shells.entries"].contains(&parameter)
}

fn differing(
    a: &BTreeMap<String, String>,
    b: &BTreeMap<String, String>,
    matters: impl Fn(&str) -> bool,
) -> Vec<ParameterChange> {
    let mut names: Vec<&String> = a.keys().chain(b.keys()).collect();
    names.sort();
    names.dedup();
    let text = |of: &BTreeMap<String, String>, name: &str| {
        of.get(name).cloned().unwrap_or_else(|| "not in the report".to_owned())
    };
    let all = names.into_iter().map(|name| ParameterChange {
        name: name.clone(),
        a: text(a, name),
        b: text(b, name),
        may_change_work: matters(name),
    });
    let mut changes: Vec<ParameterChange> = all.filter(|p| p.a != p.b).collect();
    changes.sort_by_key(|p| !p.may_change_work);
    changes
}

impl RunComparison {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/compare-runs/1";

    /// Compares `b` with `a`.
    ///
    /// # Errors
    /// Reports of two kinds: their counters are of different rays.
    pub fn new(
        [path_a, path_b]: [&Path; 2],
        a: &RunReport,
        b: &RunReport,
        threshold: Option<f64>,
    ) -> Result<RunComparison, String> {
        if a.schema != b.schema {
            return Err(format!(
                "reports of two kinds, {} and {}: expected two of one kind",
                a.schema, b.schema
            ));
        }
        let inputs = differing(&a.inputs, &b.inputs, |_| true);
        let parameters = differing(&a.spec, &b.spec, may_change_work);
        let (mut canonical, mut counters, mut n_equal) = (Vec::new(), Vec::new(), 0);
        for (name, is_canonical, n_a) in &a.counters {
            let Some((_, _, n_b)) = b.counters.iter().find(|(other, _, _)| other == name) else { continue };
            match (n_a == n_b, is_canonical) {
                (true, _) => n_equal += 1,
                (false, true) => canonical.push(CounterChange::new(name, *n_a, *n_b)),
                (false, false) => counters.push(CounterChange::new(name, *n_a, *n_b)),
            }
        }
        counters.sort_by(|x, y| {
            let key = |c: &CounterChange| (c.counter != "cycles", c.magnitude());
            let ((not_x, size_x), (not_y, size_y)) = (key(x), key(y));
            not_x.cmp(&not_y).then(size_y.total_cmp(&size_x))
        });
        let only_low = canonical.iter().all(|c: &CounterChange| c.counter.starts_with(LOW_RESOLUTION));
        let explains = |p: &&ParameterChange| {
            p.may_change_work && (only_low || !p.name.starts_with("dispatch.low_resolution_"))
        };
        let because = inputs.iter().chain(&parameters).filter(explains).map(|p| p.name.clone());
        let canonical_because_of = if canonical.is_empty() { Vec::new() } else { because.collect() };
        let over_threshold: Vec<String> = canonical
            .iter()
            .chain(&counters)
            .filter(|c| threshold.is_some_and(|limit| c.magnitude() > limit))
            .map(|c| c.counter.clone())
            .collect();
        Ok(RunComparison {
            schema: Self::SCHEMA,
            a: path_a.to_owned(),
            b: path_b.to_owned(),
            reports: a.schema,
            canonical,
            canonical_because_of,
            counters,
            n_equal,
            inputs,
            parameters,
            stalls: moved(&a.causes, &b.causes),
            threshold,
            passed: over_threshold.is_empty(),
            over_threshold,
        })
    }

    /// True when nothing that counts differs.
    pub fn is_equal(&self) -> bool {
        self.canonical.is_empty() && self.counters.is_empty()
    }
}

fn moved(a: &BTreeMap<(String, String), f64>, b: &BTreeMap<(String, String), f64>) -> Vec<StallChange> {
    let mut names: Vec<&(String, String)> = a.keys().chain(b.keys()).collect();
    names.sort();
    names.dedup();
    let share = |of: &BTreeMap<(String, String), f64>, name| of.get(name).copied().unwrap_or(0.0);
    let all = names.into_iter().map(|name| StallChange {
        kind: name.0.clone(),
        cause: name.1.clone(),
        a: share(a, name),
        b: share(b, name),
    });
    let size = |s: &StallChange| (s.b - s.a).abs();
    let mut stalls: Vec<StallChange> = all.filter(|s| size(s) >= LEAST_MOVE).collect();
    stalls.sort_by(|x, y| size(y).total_cmp(&size(x)));
    stalls
}

#[cfg(test)]
#[path = "compare_runs_tests.rs"]
mod tests;
