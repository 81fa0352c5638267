//! `verify` on the terminal: one screen for a board, one table for a sweep.
//!
//! ```text
//! label      value, value            a table under its label, columns aligned
//! ```

use std::fmt::Write as _;

use rtl_model::fixed::Formats;
use rtl_model::fixed::division::DividerForm;
use rtl_model::spec::{BoardSpec, DivisionSpec, DivisionUnit};

use super::si::{count, number, percent, share};
use super::terminal::{line, purpose_name, scene_line, time_line};
use super::verify::{Findings, SweepReport, VerifyReport};
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

fn keep_text(f: &Formats) -> String {
    match f.cross_keep_bits {
        Some(k) if f.cross_drop() > 0 => format!("edge normals rounded to {k}"),
        _ => "edge normals in full".to_owned(),
    }
}

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
fn short(value: f64) -> String {
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

/// Shares at which the bar of a sweep begins and ends.
const BAR_DECADES: [f64; 2] = [-6.0, 0.0];
/// Characters of the bar: four a decade.
const BAR: usize = 24;

/// Marks values whose edge normals are rounded.
const ROUNDED: char = '*';

fn sweep_table(out: &mut String, sweep: &SweepReport) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::SolveOptions;
    use crate::raycast::Purpose;
    use crate::render::RenderOptions;
    use crate::report::{SceneFacts, SweepRow, Timings};
    use crate::verify::{
        Misclassified, OracleScope, PurposeRays, TError, Verification, VerifyOptions, WireMargin,
    };

    fn idle_wire(wire: &'static str, observed: bool) -> WireMargin {
        WireMargin {
            wire,
            bits: 8,
            signed: false,
            max_magnitude: 255,
            observed,
            seen: None,
            spare_bits: None,
        }
    }

    fn verification(n_mismatches: u64, wrong: u64) -> Verification {
        Verification {
            formats: Formats { cross_keep_bits: Some(20), ..Formats::default() },
            rays: vec![PurposeRays { purpose: Purpose::Shadow, cast: 5000, verified: 1000 }],
            n_clocked: 10,
            n_wire_tests: 70,
            n_mismatches,
            first_mismatch: None,
            oracle_scope: OracleScope::TestedPatches,
            misclassified: Misclassified { edge: 10, depth_tie: 3, t_step: 2, unexplained: 0 },
            misclassified_by_purpose: vec![(
                Purpose::Shadow,
                Misclassified { edge: 10, depth_tie: 3, t_step: 2, unexplained: 0 },
            )],
            first_unexplained: None,
            t_error: TError {
                n: 900,
                n_bounded: 700,
                median_steps: 0.25,
                p99_steps: 2.0,
                max_steps: 8.0,
                max_of_bound: Some(0.5),
            },
            wires: vec![
                WireMargin {
                    wire: "a",
                    bits: 10,
                    signed: true,
                    max_magnitude: 512,
                    observed: true,
                    seen: Some(64),
                    spare_bits: Some(2),
                },
                idle_wire("b", true),
                idle_wire("c", false),
            ],
            first_test: vec![FirstTestShare {
                bits: 8,
                tests: 1000,
                saved: 800,
                inside: 150,
                undecided: 50,
                wrong,
                narrow_wrong: 5,
            }],
            image: None,
        }
    }

    fn report(n_mismatches: u64, wrong: u64) -> VerifyReport {
        let findings = Findings::new(&verification(n_mismatches, wrong), 1e-3);
        VerifyReport {
            schema: VerifyReport::SCHEMA,
            scene: SceneFacts {
                path: "s.toml".into(),
                n_surfaces: 1,
                n_materials: 1,
                n_lights: 0,
                n_elements: 4,
                n_vertices: 9,
                n_patches: 1,
                n_cast_patches: 1,
                n_t_junctions: 0,
            },
            board: BoardSpec::default(),
            options: VerifyOptions {
                n_rays: 1000,
                n_clocked: 10,
                first_test_bits: vec![8],
                solve: SolveOptions::default(),
                picture: RenderOptions::default(),
                compare_image: false,
            },
            passed: findings.passed(),
            findings: Some(findings),
            sweep: None,
            timings: Timings::default(),
            warnings: Vec::new(),
        }
    }

    #[test]
    fn summary_gives_shares_steps_and_millimetres() {
        let text = verify_summary(&report(0, 0));
        for part in [
            "board == oracle: 0 mismatches on 1000 rays (10 of them clocked) and 70 tests wire by wire",
            "edge normals rounded to 20",
            "over the patches that the board tests",
            "15 of 1000 rays misclassified = 1.50 %",
            "1.00 % of the rays",
            "verified of          5000          15 misclassified    1.50 %",
            "edge normals are rounded: bounds are wide or absent",
            "in coordinate steps: median 0.250 = 0.250 mm, p99 2.00 = 2.00 mm, max 8.00 = 8.00 mm",
            "at most 50.0 % of the derived bound; none applies to 200 of 900",
            "a       10 s       2^9.00          2^6.00     12.5 %",
            "b        8 u       2^7.99   not exercised          -           -\n",
            "c        8 u       2^7.99    not observed          -           -\n",
            "|################    |",
            "80.0 %      15.0 %      5.00 %       0",
            "\npassed ",
        ] {
            assert!(text.contains(part), "'{part}' is missing in\n{text}");
        }
    }

    #[test]
    fn t_error_without_bounds_or_hits_says_so_and_is_null() {
        let told = |t_error: TError| {
            let found = Findings::new(&Verification { t_error, ..verification(0, 0) }, 1e-3);
            let json = serde_json::to_value(found.t_error).unwrap();
            let mut report = report(0, 0);
            report.findings = Some(found);
            (verify_summary(&report), json)
        };
        let (text, json) = told(TError { n: 200, ..TError::default() });
        assert!(
            text.contains("; no bound applies to 200 of 200\n") && text.contains("median 0 = 0 mm"),
            "{text}"
        );
        assert!(json["max_of_bound"].is_null() && json["median_m"] == 0.0, "{json}");
        let (text, json) = told(TError::default());
        assert!(text.contains("t error    no hits on one patch\n"), "{text}");
        assert!(json["max_of_bound"].is_null() && json["max_m"].is_null() && json["n"] == 0, "{json}");
    }

    #[test]
    fn division_unit_is_named_unless_it_is_in_the_pipeline() {
        assert!(!verify_summary(&report(0, 0)).contains("division"));
        let mut report = report(0, 0);
        report.board.division.unit = DivisionUnit::NonRestoring;
        report.board.division.radix_log2 = 2;
        let text = verify_summary(&report);
        assert!(text.contains("\n           division: non-restoring, radix 4, unrolled\n"), "{text}");
    }

    #[test]
    fn held_fixed_of_a_sweep_leaves_out_what_changes() {
        let formats = Formats { cross_keep_bits: Some(20), ..Formats::default() };
        let cases = [
            (
                "dir_frac_bits",
                "fraction bits: coordinates 24, t 24, edge normals rounded to 20; nearest-even",
            ),
            ("cross_keep_bits", "fraction bits: coordinates 24, directions 24, t 24, nearest-even"),
            ("frac_bits", "edge normals of at most 20; nearest-even"),
        ];
        for (parameter, text) in cases {
            assert_eq!(held_fixed_text(parameter, &formats), text);
        }
        assert_eq!(held_fixed_text("frac_bits", &Formats::default()), "edge normals in full; nearest-even");
    }

    #[test]
    fn summary_of_a_failure_says_what_failed() {
        let text = verify_summary(&report(3, 0));
        assert!(text.contains("board != oracle: 3 MISMATCHES on"), "{text}");
        assert!(
            text.contains("\nFAILED     3 answers or tests differ from the oracle, 0 first tests"),
            "{text}"
        );
        let text = verify_summary(&report(0, 2));
        assert!(
            text.contains("\nFAILED     0 answers or tests differ from the oracle, 2 first tests"),
            "{text}"
        );
    }

    #[test]
    fn sweep_table_aligns_its_columns_and_bars_shrink_by_decades() {
        let mut report = report(0, 0);
        let row = |value: u32, edge: u64| {
            let mut found = verification(0, 0);
            found.misclassified = Misclassified { edge, ..Misclassified::default() };
            SweepRow { value, findings: Findings::new(&found, 1e-3) }
        };
        let rows = vec![row(8, 100), row(12, 10), row(16, 0)];
        report.sweep = Some(SweepReport { parameter: "t_frac_bits", rows });
        report.findings = None;
        let text = verify_summary(&report);
        let table = text.lines().take_while(|l| !l.starts_with("misclassified"));
        let table: Vec<&str> = table.filter(|l| l.contains(" | ")).collect();
        assert_eq!(table.len(), 5, "{text}");
        let bars =
            |line: &str| line.char_indices().filter(|(_, c)| *c == '|').map(|(i, _)| i).collect::<Vec<_>>();
        assert!(table[1..].iter().all(|line| bars(line) == bars(table[1])), "{text}");
        assert!(table[2].starts_with("    8*     0 |   10.0"), "{text}");
        assert!(
            text.contains("\nheld fixed fraction bits: coordinates 24, directions 24, edge normals"),
            "{text}"
        );
        assert!(text.contains("\n* edge normals are rounded") && !text.contains("image RMSE"), "{text}");
        let bar = |value: &str| {
            let line = text.lines().find(|l| l.starts_with(&format!("   {value}  |"))).unwrap();
            line.matches('#').count()
        };
        assert_eq!((bar(" 8"), bar("12"), bar("16")), (20, 16, 0));
    }

    #[test]
    fn sweep_plot_of_many_first_tests_grows_and_draws_the_later_ones_dashed() {
        let share = verification(0, 0).first_test[0];
        let with = |n: u32| {
            let rows = [8, 9].map(|value| {
                let first_test = (0..n).map(|i| FirstTestShare { bits: 4 + i, ..share }).collect();
                let found = Verification { first_test, t_error: TError::default(), ..verification(0, 0) };
                SweepRow { value, findings: Findings::new(&found, 1e-3) }
            });
            let sweep = SweepReport { parameter: "t_frac_bits", rows: rows.to_vec() };
            super::super::sweep_plot::sweep_svg(&sweep, &"long ".repeat(30), "b").unwrap()
        };
        let height = |svg: &str| {
            svg.split("height=\"").nth(1).unwrap().split('"').next().unwrap().parse::<u32>().unwrap()
        };
        let (few, many) = (with(6), with(16));
        assert!(height(&many) > height(&few), "{} {}", height(&many), height(&few));
        let lines = |svg: &str| svg.matches("<polyline").count() + svg.matches("<line").count();
        assert!(
            lines(&many) > lines(&few) + 10 && many.contains("19 bits") && many.contains("largest: no hits")
        );
        assert_eq!((few.matches("<polygon").count(), many.matches("<polygon").count()), (0, 3 * 10));
        let width =
            many.split("width=\"").nth(1).unwrap().split('"').next().unwrap().parse::<usize>().unwrap();
        assert!(width > 150 * 11, "{width}");
    }

    #[test]
    fn sweep_plot_holds_every_line_and_names_those_that_are_zero() {
        let rows = [(8, 100), (9, 0), (10, 10), (11, 1)].map(|(value, edge)| {
            let mut found = verification(0, 0);
            found.misclassified = Misclassified { edge, ..Misclassified::default() };
            SweepRow { value, findings: Findings::new(&found, 1e-3) }
        });
        let sweep = SweepReport { parameter: "dir_frac_bits", rows: rows.to_vec() };
        let svg = super::super::sweep_plot::sweep_svg(&sweep, "room <1>", "a & b").unwrap();
        for part in
            ["room &lt;1&gt; on a &amp; b: dir_frac_bits", "depth tie: 0 throughout", "8 bits", "0.1", "mm"]
        {
            assert!(svg.contains(part), "'{part}' is missing");
        }
        // Four values of each of 5 shares, 3 errors, 1 first test; legends: one each. Zeros are open: one of 'all' and of
        // 'edge', all of three causes.
        assert_eq!(svg.matches("<circle").count(), 4 * 9 + 9);
        let open = svg.lines().filter(|l| l.starts_with("<circle") && l.contains("fill=\"none\"")).count();
        assert_eq!(open, 2 + 3 * 4);
        assert!(
            svg.contains("held fixed: fraction bits: coordinates 24, t 24")
                && svg.contains("; 8 to 11 round edge normals")
        );
        let one = SweepReport { rows: rows[1..2].to_vec(), ..sweep };
        assert!(super::super::sweep_plot::sweep_svg(&one, "s", "b").unwrap().contains("<svg"));
    }
}
