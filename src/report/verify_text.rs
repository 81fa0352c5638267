//! `verify` on the terminal: one screen for a board; the table of a sweep is `sweep_text.rs`.
//!
//! ```text
//! label      value, value            a table under its label, columns aligned
//! ```

use std::fmt::Write as _;

use rtl_model::fixed::Formats;
use rtl_model::fixed::division::DividerForm;
use rtl_model::spec::{BoardSpec, DivisionSpec, DivisionUnit};

use super::si::{count, percent, share};
use super::sweep_text::sweep_table;
use super::terminal::{line, purpose_name, scene_line, time_line};
use super::verify::{Findings, VerifyReport};
use crate::verify::{FirstTestShare, OracleScope};

/// What `verify` ends with.
pub fn verify_summary(r: &VerifyReport) -> String {
    let mut out = String::new();
    scene_line(&mut out, &r.scene);
    match (&r.findings, &r.sweep) {
        (_, Some(sweep)) => {
            board_lines(&mut out, &r.board, None);
            sweep_table(&mut out, sweep);
        }
        (Some(findings), None) => {
            board_lines(&mut out, &r.board, Some(&findings.formats));
            findings_text(&mut out, findings);
        }
        (None, None) => {}
    }
    out.push('\n');
    time_line(&mut out, &r.timings);
    let runs = r.findings.iter().chain(r.sweep.iter().flat_map(|s| s.rows.iter().map(|row| &row.findings)));
    let (mut differ, mut wrong) = (0, 0);
    for run in runs {
        differ += run.n_mismatches;
        wrong += run.n_first_test_wrong();
    }
    match r.passed {
        true => line(&mut out, "passed", "every compared bit of the board is the oracle's"),
        false => line(
            &mut out,
            "FAILED",
            format_args!("{differ} answers or tests differ from the oracle, {wrong} first tests are wrong"),
        ),
    }
    out
}

fn board_lines(out: &mut String, board: &BoardSpec, formats: Option<&Formats>) {
    match formats {
        Some(formats) => line(out, "board", format_args!("{}: {}", board.name, formats_text(formats))),
        None => line(out, "board", &board.name),
    }
    if let Some(division) = division_text(&board.division) {
        line(out, "", format_args!("division: {division}"));
    }
}

/// The division unit, if it is named.
fn division_text(d: &DivisionSpec) -> Option<String> {
    let form = match d.form {
        DividerForm::Serial => "serial",
        DividerForm::Unrolled => "unrolled",
    };
    match d.unit {
        DivisionUnit::InPipeline => None,
        DivisionUnit::NonRestoring => Some(format!("non-restoring, radix {}, {form}", 1u64 << d.radix_log2)),
        DivisionUnit::Newton => Some(format!(
            "Newton, table of {} index bits, {} iterations of {}-cycle multiplications, {form}",
            d.table_bits, d.iterations, d.multiplier_cycles
        )),
    }
}

pub(super) fn keep_text(f: &Formats) -> String {
    match f.cross_keep_bits {
        Some(k) if f.cross_drop() > 0 => format!("edge normals rounded to {k}"),
        _ => "edge normals in full".to_owned(),
    }
}

/// Number formats in a line.
pub fn formats_text(f: &Formats) -> String {
    let keep = keep_text(f);
    format!(
        "fraction bits: coordinates {}, directions {}, t {}, {keep}; {}",
        f.coord_frac_bits,
        f.dir_frac_bits,
        f.t_frac_bits,
        crate::vectors::rounding_name(f.rounding)
    )
}

/// A share of a whole, as a column of percentages.
fn column_percent(part: u64, whole: u64) -> String {
    if part == 0 { "0".to_owned() } else { percent(share(part, whole)) }
}

fn findings_text(out: &mut String, f: &Findings) {
    let cast: u64 = f.rays.iter().map(|r| r.cast).sum();
    line(
        out,
        "workload",
        format_args!("{} of the {} of both passes", count(f.n_rays, "rays"), count(cast, "rays")),
    );
    for (r, differ) in f.rays.iter().zip(&f.misclassified_by_purpose) {
        let differ = &differ.misclassified;
        let row = format_args!(
            "{:<14} {:>11} verified of {:>13}   {:>9} misclassified {:>9}",
            purpose_name(r.purpose),
            r.verified,
            r.cast,
            differ.total,
            column_percent(differ.total, r.verified)
        );
        line(out, "", row);
    }
    line(
        out,
        "oracle",
        format_args!(
            "{} on {} ({} of them clocked) and {} tests wire by wire",
            mismatches(f.n_mismatches),
            count(f.n_rays, "rays"),
            f.n_clocked,
            count(f.n_wire_tests, "").trim_end()
        ),
    );
    if f.oracle_scope == OracleScope::TestedPatches {
        line(
            out,
            "",
            "its answers are taken over the patches that the board tests: edge normals are rounded",
        );
    }
    if let Some(m) = &f.first_mismatch {
        line(out, "", format_args!("first: {}, {} ray {}", m.compared, purpose_name(m.purpose), m.index));
    }
    let m = &f.misclassified;
    line(
        out,
        "software",
        format_args!("{} of {} rays misclassified = {}", m.total, f.n_rays, percent(m.share)),
    );
    for (cause, n) in m.causes() {
        line(out, "", format_args!("{cause:<14} {n:>11}   {:>10} of the rays", column_percent(n, f.n_rays)));
    }
    if f.formats.cross_drop() > 0 && m.total > 0 {
        line(
            out,
            "",
            "edge normals are rounded: bounds are wide or absent, so most causes will be 'edge' or 't step'",
        );
        line(out, "", "by the rounding of the products itself");
    }
    t_error_text(out, f);
    wires_table(out, f);
    first_test_table(out, &f.first_test);
    if let Some(d) = &f.image {
        line(
            out,
            "\nimage",
            format_args!(
                " {} of {} pixels differ by over 1 % of the mean luminance, RMSE {} of it, largest {}",
                d.n_over_1_percent,
                d.n_pixels,
                percent(d.rmse_relative),
                percent(d.max_relative)
            ),
        );
    }
}

fn t_error_text(out: &mut String, f: &Findings) {
    let t = &f.t_error;
    let magnitudes = [(t.median_steps, t.median_m), (t.p99_steps, t.p99_m), (t.max_steps, t.max_m)];
    let [median, p99, max] = magnitudes.map(|(steps, m)| Some((steps?, m?)));
    let (Some(median), Some(p99), Some(max)) = (median, p99, max) else {
        line(out, "t error", "no hits on one patch");
        return;
    };
    let in_mm = |(steps, m): (f64, f64)| format!("{} = {} mm", short(steps), short(1e3 * m));
    line(
        out,
        "t error",
        format_args!("in coordinate steps: median {}, p99 {}, max {}", in_mm(median), in_mm(p99), in_mm(max)),
    );
    let without = t.n - t.n_bounded;
    let bound = match t.max_of_bound {
        None => format!("no bound applies to {without} of {}", t.n),
        Some(most) if without == 0 => format!("at most {} of the derived bound", percent(most)),
        Some(most) => {
            format!("at most {} of the derived bound; none applies to {without} of {}", percent(most), t.n)
        }
    };
    let hits = count(t.n, "hits");
    line(out, "", format_args!("over {hits} on one patch; a step is {} mm; {bound}", short(1e3 * f.step_m)));
}

fn mismatches(n: u64) -> String {
    match n {
        0 => "board == oracle: 0 mismatches".to_owned(),
        1 => "board != oracle: 1 MISMATCH".to_owned(),
        n => format!("board != oracle: {n} MISMATCHES"),
    }
}

fn wires_table(out: &mut String, f: &Findings) {
    let Some(wire) = f.wires.iter().map(|w| w.wire.len()).max() else { return };
    let wire = wire.max("wire".len());
    let _ = writeln!(
        out,
        "\n{:<wire$}  {:>4}     {:>10}  {:>14}  {:>9}  {:>10}  |{:<20}|",
        "wire", "bits", "can carry", "seen", "of that", "spare bits", "bits needed (log2)"
    );
    for w in &f.wires {
        let sign = if w.signed { "s" } else { "u" };
        let _ = write!(out, "{:<wire$}  {:>4} {sign}   {:>10}", w.wire, w.bits, power(w.max_magnitude));
        let _ = match (w.seen, w.spare_bits) {
            (Some(seen), Some(spare)) => {
                let used = seen as f64 / w.max_magnitude.max(1) as f64;
                let (seen, bar) = (power(seen), bits_bar(w.bits, spare));
                writeln!(out, "  {seen:>14}  {:>9}  {spare:>10}  |{bar:<20}|", percent(used))
            }
            _ => {
                let why = if w.observed { "not exercised" } else { "not observed" };
                writeln!(out, "  {why:>14}  {:>9}  {:>10}", "-", "-")
            }
        };
    }
    let _ = writeln!(
        out,
        "s: one of the bits is a sign, u: unsigned; the bar counts bits of the width, so it is log2"
    );
}

/// The bits that tests needed as a bar of 20.
fn bits_bar(bits: u32, spare: u32) -> String {
    let used = 20 * bits.saturating_sub(spare) / bits.max(1);
    "#".repeat(used as usize)
}

/// A magnitude as a power of two.
fn power(value: u128) -> String {
    if value == 0 { "0".to_owned() } else { format!("2^{:.2}", (value as f64).log2()) }
}

fn first_test_table(out: &mut String, shares: &[FirstTestShare]) {
    let Some(first) = shares.first() else { return };
    let _ = writeln!(
        out,
        "\nfirst test at low width, then the exact one where it must: {}, no answer may be wrong",
        count(first.tests, "tests")
    );
    let _ = writeln!(
        out,
        "{:>4}  {:>10}  {:>10}  {:>10}  {:>6}  {:>24}",
        "bits", "saved", "inside", "undecided", "wrong", "wrong without the second"
    );
    for s in shares {
        let of = |part: u64| column_percent(part, s.tests);
        let _ = writeln!(
            out,
            "{:>4}  {:>10}  {:>10}  {:>10}  {:>6}  {:>24}",
            s.bits,
            of(s.saved),
            of(s.inside),
            of(s.undecided),
            s.wrong,
            of(s.narrow_wrong)
        );
    }
}

/// A positive number in three digits, short at any magnitude.
pub(super) fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        m if !(0.001..9_995.0).contains(&m) => format!("{value:.1e}"),
        m if m >= 99.95 => format!("{value:.0}"),
        m if m >= 9.995 => format!("{value:.1}"),
        m if m >= 0.999_5 => format!("{value:.2}"),
        m if m >= 0.099_95 => format!("{value:.3}"),
        _ => format!("{value:.4}"),
    }
}

#[cfg(test)]
#[path = "verify_text_tests.rs"]
mod tests;
