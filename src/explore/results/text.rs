//! What a sweep ends with in the terminal: one screen.
//!
//! ```text
//! question, counts | impossible and failed ones with reasons | front as a table | the best of each objective, and why
//! ```

use std::fmt::Write as _;

use super::curve::Curve;
use super::pareto::{Front, REFERENCE};
use super::words::{by_frequency, metric_text, point_text, shortened, status_counts};
use super::{Results, Status};
use crate::plot::wrap;
use crate::report::si::percent;
use crate::report::terminal::{WIDTH, line};

/// Most rows of the front.
const ROWS: usize = 12;
/// Most reasons of impossible and failed points.
const REASONS: usize = 4;
/// Width of a label, as of the other summaries.
const LABEL: usize = 11;

/// The summary; `files` is what was written, in words.
pub fn summary(results: &Results, front: &Front, curves: &[Curve], files: &[String]) -> String {
    let mut out = String::new();
    paragraph(&mut out, "question", &results.question);
    let space = format!("{}, costs in {}, {}", results.space_file, results.technology, results.search);
    paragraph(&mut out, "space", &space);
    for (i, workload) in results.workloads.iter().enumerate() {
        paragraph(&mut out, if i == 0 { "workload" } else { "" }, workload);
    }
    counts(&mut out, results);
    table(&mut out, results, front);
    optima(&mut out, results, front, curves);
    for (i, file) in files.iter().enumerate() {
        paragraph(&mut out, if i == 0 { "files" } else { "" }, file);
    }
    out
}

fn paragraph(out: &mut String, label: &str, text: &str) {
    for (i, part) in wrap(text, WIDTH - LABEL).iter().enumerate() {
        line(out, if i == 0 { label } else { "" }, part);
    }
}

fn counts(out: &mut String, results: &Results) {
    let counts: Vec<String> =
        status_counts(results).into_iter().map(|(what, n)| format!("{n} {what}")).collect();
    let all =
        format!("{} of {} combinations: {}", results.rows.len(), results.n_combinations, counts.join(", "));
    paragraph(out, "points", &all);
    let impossible = results.impossible.iter().map(|i| i.reason.as_str());
    reasons(out, "impossible", results.impossible.len(), by_frequency(impossible));
    let failed: Vec<&str> = results
        .rows
        .iter()
        .filter_map(|row| if let Status::Failed(what) = &row.status { Some(what.as_str()) } else { None })
        .collect();
    reasons(out, "failed", failed.len(), by_frequency(failed.iter().copied()));
}

fn reasons(out: &mut String, label: &str, n: usize, reasons: Vec<(&str, usize)>) {
    if n == 0 {
        return;
    }
    for (i, (reason, n)) in reasons.iter().take(REASONS).enumerate() {
        // A reason may have lines of its own.
        let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
        paragraph(out, if i == 0 { label } else { "" }, &format!("{n}: {reason}"));
    }
    let rest: usize = reasons.iter().skip(REASONS).map(|(_, n)| n).sum();
    if rest > 0 {
        line(out, "", format_args!("{rest} for {} other reasons", reasons.len() - REASONS));
    }
}

/// The front as an aligned table: point, axes, objectives, limit, longest path.
fn table(out: &mut String, results: &Results, front: &Front) {
    if front.members.is_empty() {
        line(out, "front", "none: no point has every objective");
        return;
    }
    let share = front.hypervolume.map_or_else(String::new, |h| {
        format!(", {} of the box up to {REFERENCE} of all ranges (hypervolume)", percent(h))
    });
    line(out, "front", format_args!("{} of {} compared{share}", front.members.len(), front.n_compared));
    let mut header = vec!["point".to_owned()];
    header.extend(front.objectives.iter().map(|m| results.metrics[*m].name.clone()));
    header.extend(results.axes.iter().map(|a| a.name.clone()));
    header.extend(["limit".to_owned(), "longest path".to_owned()]);
    // Of a long front some, spread over it, both ends among them.
    let n = front.members.len();
    let shown: Vec<usize> = match n {
        _ if n <= ROWS => (0..n).collect(),
        _ => (0..ROWS).map(|i| i * (n - 1) / (ROWS - 1)).collect(),
    };
    let mut lines = Vec::new();
    for i in &shown {
        let row = &results.rows[front.members[*i]];
        let sampled = if row.status == Status::Sampled { "~" } else { "" };
        let mut cells = vec![format!("{sampled}{}", row.ordinal)];
        cells.extend(front.objectives.iter().map(|m| metric_text(results, row, *m)));
        cells.extend(row.values.iter().map(|v| shortened(&v.to_string(), 20)));
        cells.push(
            row.limit
                .as_ref()
                .map_or_else(String::new, |(what, share)| format!("{what} {}", percent(*share))),
        );
        cells.push(row.critical_block.clone());
        lines.push(cells);
    }
    out.push('\n');
    aligned(out, &header, &lines);
    if n > shown.len() {
        let _ = writeln!(out, "  and {} more, in results.csv where on_front = true", n - shown.len());
    }
    out.push('\n');
}

/// A name in parts that fit a column, cut behind dots, underscores and spaces.
fn cut(name: &str, width: usize) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for piece in name.split_inclusive(['.', '_', ' ']) {
        match parts.last_mut() {
            Some(last) if last.chars().count() + piece.chars().count() <= width => last.push_str(piece),
            _ => parts.push(piece.to_owned()),
        }
    }
    parts
}

/// Columns wide enough for their cells, under headers of some lines; the last that do not fit a screen are named below.
fn aligned(out: &mut String, header: &[String], lines: &[Vec<String>]) {
    const LEAST: usize = 9;
    let cells = |c: usize| lines.iter().map(move |l| l[c].chars().count()).max().unwrap_or(0);
    let heads: Vec<Vec<String>> =
        header.iter().enumerate().map(|(c, name)| cut(name, cells(c).max(LEAST))).collect();
    let width =
        |c: usize| heads[c].iter().map(|part| part.trim_end().chars().count()).fold(cells(c), usize::max);
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    // Numbers to the right.
    let is_text = |c: usize| lines.iter().any(|l| l[c].starts_with(|x: char| x.is_alphabetic()));
    let mut total = 0;
    let fits = widths.iter().take_while(|w| {
        total += **w + 2;
        total <= WIDTH
    });
    let fits = fits.count();
    let mut write = |cell: &dyn Fn(usize) -> String| {
        let padded: Vec<String> = (0..fits)
            .map(|c| {
                let (cell, width) = (cell(c), widths[c]);
                if is_text(c) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            })
            .collect();
        let _ = writeln!(out, "  {}", padded.join("  ").trim_end());
    };
    // Headers stand on their columns.
    let height = heads[..fits].iter().map(Vec::len).max().unwrap_or(0);
    for line in 0..height {
        let part = |c: usize| {
            let at = (line + heads[c].len()).checked_sub(height);
            at.map_or_else(String::new, |at| heads[c][at].trim_end().to_owned())
        };
        write(&part);
    }
    lines.iter().for_each(|cells| write(&|c| cells[c].clone()));
    if fits < header.len() {
        paragraph(out, "", &format!("not shown: {}", header[fits..].join(", ")));
    }
}

fn optima(out: &mut String, results: &Results, front: &Front, curves: &[Curve]) {
    for metric in &front.objectives {
        let Some((row, _)) = front.best(results, *metric) else { continue };
        let row = &results.rows[row];
        let text = format!(
            "{} {}: point {}, {}",
            results.metrics[*metric].name,
            metric_text(results, row, *metric),
            row.ordinal,
            point_text(results, row)
        );
        paragraph(out, "best", &text);
        // One axis: how things change on both sides. Several: what limits the point itself.
        let one = curves.first().filter(|_| results.axes.len() == 1);
        let reason = match one.and_then(|curve| curve.optimum(results, *metric)) {
            Some(best) => best.sides,
            None => {
                let limit = row
                    .limit
                    .as_ref()
                    .map(|(what, s)| format!("limit {what} ({} of the cycles)", percent(*s)));
                let path = (!row.critical_block.is_empty())
                    .then(|| format!("longest path in {}", row.critical_block));
                limit.into_iter().chain(path).collect::<Vec<_>>().join(", ")
            }
        };
        if !reason.is_empty() {
            paragraph(out, "", &reason);
        }
    }
    if results.axes.len() == 1
        && let Some(curve) = curves.first()
    {
        let limits = curve.limits(results);
        paragraph(out, "along", limits.split_once(": ").map_or("", |(_, stretches)| stretches));
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::curves;
    use super::super::synthetic;
    use super::*;

    fn text(results: &Results) -> String {
        let front = Front::of(results);
        summary(results, &front, &curves(results, &front), &["out/page.html".to_owned()])
    }

    #[test]
    fn summary_counts_points_and_reasons_and_stays_within_a_screens_width() {
        let results = synthetic::large();
        let text = text(&results);
        for part in [
            "question   Where does the area of the whole board go best?",
            "of 10000 combinations: ",
            " simulated, ",
            " sampled, ",
            " pruned, ",
            "impossible 122: ",
            "one 16 KiB macro a module",
            "failed     ",
            "no progress in 100000 cycles",
            "more, in results.csv where on_front = true",
            "best       seconds",
            "longest path in ",
            "files      out/page.html",
        ] {
            assert!(text.contains(part), "'{part}' is missing in\n{text}");
        }
        assert!(text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
        assert!(text.contains("not shown: "), "{text}");
        assert!(text.lines().count() < 50, "{text}");
    }

    #[test]
    fn summary_of_one_axis_tells_both_sides_of_each_optimum() {
        let text = text(&synthetic::depths());
        for part in [
            "From 2 to it: clock",
            "From it to 60: ",
            "This is the smallest value",
            "along      2: longest path in",
        ] {
            assert!(text.contains(part), "'{part}' is missing in\n{text}");
        }
    }

    #[test]
    fn summary_of_no_rows_says_that_there_is_no_front() {
        let mut results = synthetic::bare(&[("a", 3)], &["seconds"]);
        results.metrics[0].is_objective = true;
        let text = text(&results);
        assert!(
            text.contains("0 of 3 combinations: 0 simulated")
                && text.contains("no point has every objective")
        );
    }
}
