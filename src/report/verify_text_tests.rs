//! The text of `verify`, its sweep and its plot: what is said in which case.

use super::*;
use crate::radiosity::SolveOptions;
use crate::raycast::Purpose;
use crate::render::RenderOptions;
use crate::report::sweep_text::held_fixed_text;
use crate::report::{SceneFacts, SweepReport, SweepRow, Timings};
use crate::verify::{
    Misclassified, OracleScope, PurposeRays, TError, Verification, VerifyOptions, WireMargin,
};

fn idle_wire(wire: &'static str, observed: bool) -> WireMargin {
    WireMargin { wire, bits: 8, signed: false, max_magnitude: 255, observed, seen: None, spare_bits: None }
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
        ("dir_frac_bits", "fraction bits: coordinates 24, t 24, edge normals rounded to 20; nearest-even"),
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
    assert!(text.contains("\nFAILED     3 answers or tests differ from the oracle, 0 first tests"), "{text}");
    let text = verify_summary(&report(0, 2));
    assert!(text.contains("\nFAILED     0 answers or tests differ from the oracle, 2 first tests"), "{text}");
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
    let height =
        |svg: &str| svg.split("height=\"").nth(1).unwrap().split('"').next().unwrap().parse::<u32>().unwrap();
    let (few, many) = (with(6), with(16));
    assert!(height(&many) > height(&few), "{} {}", height(&many), height(&few));
    let lines = |svg: &str| svg.matches("<polyline").count() + svg.matches("<line").count();
    assert!(lines(&many) > lines(&few) + 10 && many.contains("19 bits") && many.contains("largest: no hits"));
    assert_eq!((few.matches("<polygon").count(), many.matches("<polygon").count()), (0, 3 * 10));
    let width = many.split("width=\"").nth(1).unwrap().split('"').next().unwrap().parse::<usize>().unwrap();
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
