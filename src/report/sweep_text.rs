//! A sweep of `verify` on the terminal: a row a value, and a bar of the misclassified rays.
//!
//! ```text
//! SweepReport --> what is held fixed, table, bars on a logarithmic scale
//! ```

use std::fmt::Write as _;

use rtl_model::fixed::Formats;

use super::si::{count, number, percent, share};
use super::terminal::line;
use super::verify::SweepReport;
use super::verify_text::{keep_text, short};

/// The formats that a sweep of `parameter` holds fixed, in a line; the other widths may be of any of its values.
pub fn held_fixed_text(parameter: &str, f: &Formats) -> String {
    let widths = [
        ("coord_frac_bits", "coordinates", f.coord_frac_bits),
        ("dir_frac_bits", "directions", f.dir_frac_bits),
        ("t_frac_bits", "t", f.t_frac_bits),
    ];
    let fixed = widths.iter().filter(|(name, ..)| parameter != *name && parameter != "frac_bits");
    let fixed: Vec<String> = fixed.map(|(_, role, bits)| format!("{role} {bits}")).collect();
    let widths = match fixed.is_empty() {
        true => String::new(),
        false => format!("fraction bits: {}, ", fixed.join(", ")),
    };
    let keep = match (parameter, f.cross_keep_bits) {
        ("cross_keep_bits", _) => String::new(),
        // Which values round depends on the swept coordinates.
        ("coord_frac_bits" | "frac_bits", Some(k)) => format!("edge normals of at most {k}; "),
        _ => format!("{}; ", keep_text(f)),
    };
    format!("{widths}{keep}{}", crate::vectors::rounding_name(f.rounding))
}

/// Shares at which the bar of a sweep begins and ends.
const BAR_DECADES: [f64; 2] = [-6.0, 0.0];
/// Characters of the bar: four a decade.
const BAR: usize = 24;

/// Marks values whose edge normals are rounded.
const ROUNDED: char = '*';

/// The table and the bars of a sweep.
pub(super) fn sweep_table(out: &mut String, sweep: &SweepReport) {
    let Some(first) = sweep.rows.first() else { return };
    let rays = match sweep.rows.iter().map(|r| r.findings.n_rays).max() {
        Some(most) if most == first.findings.n_rays => count(most, "rays"),
        Some(most) => format!("up to {}", count(most, "rays")),
        None => String::new(),
    };
    let last = sweep.rows.last().map_or(first.value, |r| r.value);
    let text = format!("{} {} to {last}, {rays} each", sweep.parameter, first.value);
    line(out, "sweep", text);
    line(out, "held fixed", held_fixed_text(sweep.parameter, &first.findings.formats));
    let widths: Vec<u32> = first.findings.first_test.iter().map(|s| s.bits).collect();
    let _ = writeln!(
        out,
        "\n{:>5} {:>6} | {:<34} | {:<31} {}",
        "",
        "oracle",
        "misclassified, % of the rays",
        "error of t, coordinate steps",
        if widths.is_empty() { String::new() } else { "| undecided at first-test bits, %".to_owned() }
    );
    let row = |out: &mut String, cells: &[String]| {
        let _ = write!(out, "{:>6}{:>6}", cells[0], cells[1]);
        for (i, cell) in cells.iter().enumerate().skip(2) {
            let bar = if matches!(i, 2 | 7 | 11) { " |" } else { "" };
            let width = if (7..11).contains(&i) { 7 } else { 6 };
            let _ = write!(out, "{bar} {cell:>width$}");
        }
        out.push('\n');
    };
    let titles =
        ["bits ", "differ", "edge", "tie", "t step", "unexpl", "all", "median", "p99", "max", "max mm"];
    let titles = titles.into_iter().map(str::to_owned).chain(widths.iter().map(u32::to_string));
    row(out, &titles.collect::<Vec<_>>());
    for swept in &sweep.rows {
        let f = &swept.findings;
        let m = &f.misclassified;
        let pc = |n: u64| short(100.0 * share(n, f.n_rays));
        let mark = if f.formats.cross_drop() > 0 { ROUNDED } else { ' ' };
        let mut cells = vec![format!("{}{mark}", swept.value), f.n_mismatches.to_string()];
        cells.extend(m.causes().map(|(_, n)| pc(n)));
        cells.push(pc(m.total));
        let t = &f.t_error;
        let max_mm = t.max_m.map(|m| 1e3 * m);
        let or_none = |value: Option<f64>| value.map_or("-".to_owned(), short);
        cells.extend([t.median_steps, t.p99_steps, t.max_steps, max_mm].map(or_none));
        cells.extend(f.first_test.iter().map(|s| short(100.0 * share(s.undecided, s.tests))));
        row(out, &cells);
    }
    if sweep.rows.iter().any(|row| row.findings.formats.cross_drop() > 0) {
        let _ = writeln!(
            out,
            "{ROUNDED} edge normals are rounded: bounds are wide or absent, most causes will be 'edge' or 't step'"
        );
    }
    let [low, high] = BAR_DECADES.map(|d| number(10_f64.powf(d + 2.0)));
    let _ = writeln!(out, "\nmisclassified, {low} % to {high} % on a logarithmic scale, . = none");
    let has_images = sweep.rows.iter().any(|row| row.findings.image.is_some());
    if has_images {
        let _ = writeln!(out, "{:>47}  image RMSE %", "");
    }
    for row in &sweep.rows {
        let m = &row.findings.misclassified;
        let (bar, of_rays) = (log_bar(m.share), percent(m.share));
        let rmse = row.findings.image.map(|d| short(100.0 * d.rmse_relative));
        let _ = match has_images {
            true => {
                let rmse = rmse.as_deref().unwrap_or("-");
                writeln!(out, "{:>5}  |{bar:<BAR$}| {of_rays:<12}  {rmse:>12}", row.value)
            }
            false => writeln!(out, "{:>5}  |{bar:<BAR$}| {of_rays}", row.value),
        };
    }
    if !widths.is_empty() {
        let wrong: u64 = sweep.rows.iter().map(|r| r.findings.n_first_test_wrong()).sum();
        let _ = writeln!(out, "\nfirst tests with a wrong answer, all widths: {wrong}");
    }
}

/// A share as a bar on a logarithmic scale.
fn log_bar(share: f64) -> String {
    if share <= 0.0 {
        return ".".to_owned();
    }
    let [low, high] = BAR_DECADES;
    let full = (share.log10() - low) / (high - low) * BAR as f64;
    "#".repeat((full.round().clamp(1.0, BAR as f64)) as usize)
}
