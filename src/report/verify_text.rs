//! `verify` on the terminal: one screen for a board, one table for a sweep.
//!
//! ```text
//! label      value, value            a table under its label, columns aligned
//! ```

use std::fmt::Write as _;

use rtl_model::fixed::Formats;
use rtl_model::spec::BoardSpec;

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
            line(&mut out, "board", board_text(&r.board, None));
            sweep_table(&mut out, sweep);
        }
        (Some(findings), None) => {
            line(&mut out, "board", board_text(&r.board, Some(&findings.formats)));
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

fn board_text(board: &BoardSpec, formats: Option<&Formats>) -> String {
    match formats {
        Some(formats) => format!("{}: {}", board.name, formats_text(formats)),
        None => board.name.clone(),
    }
}

/// Number formats in a line.
pub fn formats_text(f: &Formats) -> String {
    let keep = match f.cross_keep_bits {
        Some(k) if f.cross_drop() > 0 => format!("edge normals rounded to {k}"),
        _ => "edge normals in full".to_owned(),
    };
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
    for r in &f.rays {
        let row =
            format_args!("{:<14} {:>11} verified of {:>13}", purpose_name(r.purpose), r.verified, r.cast);
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
    let t = &f.t_error;
    let in_mm = |steps: f64, m: f64| format!("{} steps = {} mm", short(steps), short(1e3 * m));
    line(
        out,
        "t error",
        format_args!(
            "median {}, p99 {}, max {}",
            in_mm(t.steps.median_steps, t.median_m),
            in_mm(t.steps.p99_steps, t.p99_m),
            in_mm(t.steps.max_steps, t.max_m)
        ),
    );
    line(
        out,
        "",
        format_args!(
            "over {} on one patch; a step is {} mm; at most {} of the derived bound",
            count(t.steps.n, "hits"),
            short(1e3 * f.step_m),
            percent(t.steps.max_of_bound)
        ),
    );
    wires_table(out, f);
    first_test_table(out, &f.first_test);
    if let Some(d) = &f.image {
        line(
            out,
            "\nimage",
            format_args!(
                " {} of {} pixels differ, RMSE {} of the mean luminance, largest {}",
                d.n_differing,
                d.n_pixels,
                percent(d.rmse_relative),
                percent(d.max_relative)
            ),
        );
    }
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
        "\n{:<wire$}  {:>4}  {:>12}  {:>12}  {:>9}  {:>10}",
        "wire", "bits", "can carry", "seen", "of that", "spare bits"
    );
    for w in &f.wires {
        let used = if w.max_magnitude == 0 { 0.0 } else { w.seen as f64 / w.max_magnitude as f64 };
        let _ = writeln!(
            out,
            "{:<wire$}  {:>4}  {:>12}  {:>12}  {:>9}  {:>10}  |{:<20}|",
            w.wire,
            w.bits,
            power(w.max_magnitude),
            power(w.seen),
            percent(used),
            w.spare_bits,
            bits_bar(w.bits, w.spare_bits),
        );
    }
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
        let _ = write!(out, "{:>5} {:>6}", cells[0], cells[1]);
        for (i, cell) in cells.iter().enumerate().skip(2) {
            let bar = if matches!(i, 2 | 7 | 11) { " |" } else { "" };
            let width = if (7..11).contains(&i) { 7 } else { 6 };
            let _ = write!(out, "{bar} {cell:>width$}");
        }
        out.push('\n');
    };
    let titles =
        ["bits", "differ", "edge", "tie", "t step", "unexpl", "all", "median", "p99", "max", "max mm"];
    let titles = titles.into_iter().map(str::to_owned).chain(widths.iter().map(u32::to_string));
    row(out, &titles.collect::<Vec<_>>());
    for swept in &sweep.rows {
        let f = &swept.findings;
        let m = &f.misclassified;
        let pc = |n: u64| short(100.0 * share(n, f.n_rays));
        let mut cells = vec![swept.value.to_string(), f.n_mismatches.to_string()];
        cells.extend(m.causes().map(|(_, n)| pc(n)));
        cells.push(pc(m.total));
        let t = &f.t_error;
        cells.extend([t.steps.median_steps, t.steps.p99_steps, t.steps.max_steps, 1e3 * t.max_m].map(short));
        cells.extend(f.first_test.iter().map(|s| short(100.0 * share(s.undecided, s.tests))));
        row(out, &cells);
    }
    let [low, high] = BAR_DECADES.map(|d| number(10_f64.powf(d + 2.0)));
    let _ = writeln!(out, "\nmisclassified, {low} % to {high} % on a logarithmic scale, . = none");
    for row in &sweep.rows {
        let m = &row.findings.misclassified;
        let bar = log_bar(m.share);
        let _ = writeln!(out, "{:>5}  |{bar:<BAR$}| {}", row.value, percent(m.share));
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
            misclassified_by_purpose: Vec::new(),
            first_unexplained: None,
            t_error: TError { n: 900, median_steps: 0.25, p99_steps: 2.0, max_steps: 8.0, max_of_bound: 0.5 },
            wires: vec![WireMargin { wire: "a", bits: 10, max_magnitude: 512, seen: 64, spare_bits: 2 }],
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
            "median 0.250 steps = 0.250 mm, p99 2.00 steps = 2.00 mm, max 8.00 steps = 8.00 mm",
            "at most 50.0 % of the derived bound",
            "2^9.00        2^6.00     12.5 %",
            "|################    |",
            "80.0 %      15.0 %      5.00 %       0",
            "\npassed ",
        ] {
            assert!(text.contains(part), "'{part}' is missing in\n{text}");
        }
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
        assert!(table[2].starts_with("    8      0 |   10.0"), "{text}");
        let bar = |value: &str| {
            let line = text.lines().find(|l| l.starts_with(&format!("   {value}  |"))).unwrap();
            line.matches('#').count()
        };
        assert_eq!((bar(" 8"), bar("12"), bar("16")), (20, 16, 0));
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
        // Four values of 'all', 'edge', the three errors and one first test, less two values of 0; legends: 5 + 3 + 1.
        assert_eq!(svg.matches("<circle").count(), 4 * 6 - 2 + 9);
        let one = SweepReport { rows: rows[1..2].to_vec(), ..sweep };
        assert!(super::super::sweep_plot::sweep_svg(&one, "s", "b").unwrap().contains("<svg"));
    }
}
