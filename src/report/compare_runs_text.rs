//! What `compare a.json b.json` prints: work first, then cycles and traffic, what differs in the boards, stalls.
//!
//! ```text
//! RunComparison --> a table a section; long sections are cut and say by how much
//! ```

use std::fmt::Write as _;

use super::compare_runs::{CounterChange, ParameterChange, RunComparison};
use super::si::percent;
use super::terminal::line;

/// Most rows of a section.
const ROWS: usize = 12;

/// The comparison as text.
pub fn compare_runs_summary(c: &RunComparison) -> String {
    let mut out = String::new();
    line(&mut out, "A", c.a.display());
    line(&mut out, "B", c.b.display());
    work(&mut out, c);
    if c.counters.is_empty() {
        line(&mut out, "counters", "cycles, traffic and all others are equal");
    } else {
        out.push_str("\nother counters that changed, the largest change first after the cycles\n");
        counters(&mut out, &c.counters);
        let _ = writeln!(out, "  {} counters are equal", c.n_equal);
    }
    if !c.inputs.is_empty() {
        out.push_str("\nscene, workload and options that differ\n");
        parameters(&mut out, &c.inputs);
    }
    match c.parameters.as_slice() {
        [] => line(&mut out, "boards", "no parameter differs"),
        changed => {
            out.push_str("\nparameters of the boards that differ\n");
            parameters(&mut out, changed);
        }
    }
    if !c.stalls.is_empty() {
        out.push_str("\nshares of the cycles that moved, mean over the blocks of a kind\n");
        for s in c.stalls.iter().take(ROWS) {
            let _ = writeln!(
                out,
                "  {:<17} {:<12} {:>7} -> {:>7}   {:>+6.1} points",
                s.kind,
                s.cause,
                percent(s.a),
                percent(s.b),
                100.0 * (s.b - s.a)
            );
        }
        rest(&mut out, c.stalls.len());
    }
    if let Some(limit) = c.threshold {
        let label = if c.passed { "passed" } else { "FAILED" };
        let over = match c.over_threshold.as_slice() {
            [] => "no counter".to_owned(),
            names => names.join(", "),
        };
        line(&mut out, label, format_args!("{over} changed by more than {}", percent(limit)));
    }
    out
}

fn work(out: &mut String, c: &RunComparison) {
    if c.canonical.is_empty() {
        line(out, "work", "canonical counters are equal: the same rays, cells, tests and hits");
        return;
    }
    out.push_str("\ncanonical work that changed; no choice of timing may change it\n");
    counters(out, &c.canonical);
    match c.canonical_because_of.as_slice() {
        [] => out.push_str(
            "  NOT EXPLAINED: neither scene, options, formats, partition nor grid differ in the reports.\n  \
             The scene file's content, or the version of radeng, must be another.\n",
        ),
        names => {
            let names = names.iter().take(ROWS).map(String::as_str).collect::<Vec<_>>().join(", ");
            let _ = writeln!(out, "  it may, because these differ: {names}");
        }
    }
}

fn counters(out: &mut String, changes: &[CounterChange]) {
    for c in changes.iter().take(2 * ROWS) {
        let relative = c.relative.map_or("from 0".to_owned(), |r| format!("{:+.2} %", 100.0 * r));
        let _ = writeln!(
            out,
            "  {:<28} {:>15} -> {:>15} {:>+16} {:>11}",
            c.counter, c.a, c.b, c.absolute, relative
        );
    }
}

fn parameters(out: &mut String, changes: &[ParameterChange]) {
    for p in changes.iter().take(2 * ROWS) {
        let note = if p.may_change_work { "  may change the work" } else { "" };
        let _ = writeln!(out, "  {:<36} {} -> {}{note}", p.name, p.a, p.b);
    }
    if changes.len() > 2 * ROWS {
        let _ = writeln!(out, "  and {} more (--report)", changes.len() - 2 * ROWS);
    }
}

fn rest(out: &mut String, n: usize) {
    if n > ROWS {
        let _ = writeln!(out, "  and {} more (--report)", n - ROWS);
    }
}
