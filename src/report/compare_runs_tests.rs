//! Reports that are compared, and what is no report, each by name.

use super::super::compare_runs_text::compare_runs_summary;
use super::*;
use serde_json::json;

/// A small report of `simulate`.
fn report() -> Value {
    let block = |name: &str, work: u64, starved: u64| json!({"block": name, "cycles": {"work": work, "cache_miss": 0, "starved": starved}});
    json!({
        "schema": "radeng/simulate/1",
        "scene": {"path": "a/scene.toml", "n_patches": 12},
        "workload": "primary", "rays_file": null, "warm_up": null,
        "options": {"width": 16, "seed": 1},
        "solve_options": {"seed": 1},
        "spec": {"name": "x", "partition": "shells", "grid_log2": null, "clusters": {"count": 4},
                 "formats": {"coord_frac_bits": 24}, "dispatch": {"low_resolution_every": 1}},
        "cycles": 1000, "commands": 2, "bundles": 3, "rays": 100, "cells": 400, "list_entries": 500, "tests": 600,
        "hits": 90, "low_resolution": {"rays": 3, "cells": 9, "list_entries": 9, "tests": 9},
        "bus_down_bytes": 64, "bus_up_bytes": 128, "bus_down_cycles": 20, "bus_up_cycles": 40,
        "dram_busy_cycles": 300, "rebalances": 0,
        "levels": [{"level": "dram", "accesses": 10, "misses": 4, "bytes": 640, "written_bytes": 0}],
        "blocks": [block("dram", 300, 700), block("cluster0.icu", 500, 500), block("cluster1.icu", 700, 300)],
    })
}

fn parse(value: &Value) -> Result<RunReport, String> {
    RunReport::parse(&value.to_string())
}

fn compare(a: &Value, b: &Value, threshold: Option<f64>) -> RunComparison {
    let paths = [Path::new("a.json"), Path::new("b.json")];
    RunComparison::new(paths, &parse(a).unwrap(), &parse(b).unwrap(), threshold).unwrap()
}

/// The report with the value at a pointer replaced.
fn with(pointer: &str, value: Value) -> Value {
    let mut changed = report();
    *changed.pointer_mut(pointer).unwrap() = value;
    changed
}

#[test]
fn equal_reports_differ_in_nothing() {
    let c = compare(&report(), &report(), Some(0.0));
    assert!(c.is_equal() && c.passed && c.n_equal == 22, "{c:?}");
    assert!(c.inputs.is_empty() && c.parameters.is_empty() && c.stalls.is_empty());
    let text = compare_runs_summary(&c);
    assert!(text.contains("canonical counters are equal") && text.contains("no parameter differs"), "{text}");
    assert!(text.contains("passed     no counter changed by more than 0 %"), "{text}");
}

#[test]
fn another_timing_changes_cycles_and_stalls_and_is_held_against_the_threshold() {
    let mut b = with("/spec/clusters/count", json!(8));
    b["cycles"] = json!(900);
    b["levels"][0]["misses"] = json!(8);
    b["rebalances"] = json!(2);
    b["blocks"][2]["cycles"] = json!({"work": 500, "cache_miss": 100, "starved": 400});
    let c = compare(&report(), &b, Some(0.05));
    assert!(c.canonical.is_empty() && c.canonical_because_of.is_empty());
    let changed: Vec<_> = c.counters.iter().map(|c| (c.counter.as_str(), c.absolute, c.relative)).collect();
    let expected = [("cycles", -100, Some(-0.1)), ("rebalances", 2, None), ("dram.misses", 4, Some(1.0))];
    assert_eq!(changed, expected);
    assert_eq!((c.passed, c.over_threshold.len()), (false, 3));
    assert_eq!(c.parameters.len(), 1);
    assert_eq!((c.parameters[0].name.as_str(), c.parameters[0].may_change_work), ("clusters.count", false));
    let stalls: Vec<_> = c.stalls.iter().map(|s| (s.kind.as_str(), s.cause.as_str())).collect();
    assert_eq!(stalls, [("icu", "work"), ("icu", "cache miss"), ("icu", "starved")]);
    assert!((c.stalls[0].a - 0.6).abs() < 1e-12 && (c.stalls[0].b - 0.5).abs() < 1e-12);
    let text = compare_runs_summary(&c);
    for part in ["-10.00 %", "from 0", "clusters.count", "4 -> 8", "-10.0 points", "FAILED     cycles, "] {
        assert!(text.contains(part), "'{part}' is missing in\n{text}");
    }
    assert!(compare(&report(), &b, Some(f64::MAX)).over_threshold == ["rebalances"], "from 0 is beyond any");
    assert!(compare(&report(), &b, None).passed);
}

#[test]
fn canonical_work_that_changed_is_explained_by_what_differs_or_called_unexplained() {
    let text = |b: &Value| compare_runs_summary(&compare(&report(), b, None));
    let mut b = with("/tests", json!(700));
    let c = compare(&report(), &b, None);
    assert_eq!((c.canonical.len(), c.canonical_because_of.len()), (1, 0));
    assert!(text(&b).contains("NOT EXPLAINED"));

    b["spec"]["clusters"]["count"] = json!(1);
    b["spec"]["dispatch"]["low_resolution_every"] = json!(2);
    assert!(text(&b).contains("NOT EXPLAINED"), "neither of them changes the work of the rays themselves");
    b["spec"]["partition"] = json!("grid");
    b["scene"]["n_patches"] = json!(13);
    let c = compare(&report(), &b, None);
    assert_eq!(c.canonical_because_of, ["scene.n_patches", "partition"]);
    let shown = text(&b);
    assert!(shown.contains("because these differ: scene.n_patches, partition"), "{shown}");
    assert!(shown.contains("shells -> grid  may change the work") && shown.contains("+16.67 %"), "{shown}");

    let mut low = with("/low_resolution/rays", json!(2));
    low["spec"]["dispatch"]["low_resolution_every"] = json!(2);
    assert_eq!(
        compare(&report(), &low, None).canonical_because_of,
        ["dispatch.low_resolution_every"],
        "the low-resolution cast has work of its own"
    );
}

#[test]
fn counters_that_an_older_report_lacks_are_not_compared() {
    let mut old = report();
    for key in ["commands", "low_resolution", "bus_down_cycles", "dram_busy_cycles", "rebalances"] {
        old.as_object_mut().unwrap().remove(key);
    }
    for (a, b) in [(&old, &report()), (&report(), &old)] {
        let c = compare(a, b, Some(0.0));
        assert!(c.is_equal() && c.passed && c.n_equal == 22 - 8, "{c:?}");
    }
}

#[test]
fn report_of_a_render_has_its_board_inside() {
    let mut inside = report();
    inside.as_object_mut().unwrap().remove("schema");
    let render = json!({"schema": "radeng/render/1", "caster": "board", "board": inside,
        "pass_1": {"options": {"seed": 1}, "loaded_from": null}});
    let solve = {
        let mut solve = render.clone();
        solve["schema"] = json!("radeng/solve/1");
        solve
    };
    let mut other = render.clone();
    other["board"]["tests"] = json!(1);
    other["pass_1"]["options"]["seed"] = json!(2);
    let c = compare(&render, &other, None);
    assert_eq!(
        (c.canonical.len(), &c.canonical_because_of[..]),
        (1, &["pass_1.options.seed".to_owned()][..])
    );
    let paths = [Path::new("a"), Path::new("b")];
    for (a, b) in [(&render, &solve), (&render, &report())] {
        let e = RunComparison::new(paths, &parse(a).unwrap(), &parse(b).unwrap(), None).unwrap_err();
        assert!(e.starts_with("reports of two kinds, radeng/render/1 and radeng/s"), "{e}");
    }
    let mut software = render.clone();
    software["board"] = Value::Null;
    assert!(parse(&software).unwrap_err().contains("cast in software"));
}

#[test]
fn what_is_no_report_of_a_run_is_refused_by_name() {
    let whole = report().to_string();
    let cases: [(&str, String, &str); 15] = [
        ("empty file", String::new(), "no JSON, or damaged: EOF"),
        ("half a report", whole[..whole.len() / 2].to_owned(), "no JSON, or damaged: EOF"),
        ("two reports in a row", format!("{whole}{whole}"), "no JSON, or damaged: trailing characters"),
        ("text", "cycles = 3".to_owned(), "no JSON, or damaged"),
        ("a list", "[1, 2]".to_owned(), "has no \"schema\""),
        ("a number", "3".to_owned(), "has no \"schema\""),
        ("no schema", "{}".to_owned(), "has no \"schema\", expected a report of simulate, render or solve"),
        ("schema of another type", "{\"schema\": 1}".to_owned(), "\"schema\" is 1"),
        ("schema of verify", "{\"schema\": \"radeng/verify/1\"}".to_owned(), "schema radeng/verify/1"),
        ("schema of the future", "{\"schema\": \"radeng/simulate/2\"}".to_owned(), "radeng/simulate/2"),
        ("nothing but a schema", "{\"schema\": \"radeng/simulate/1\"}".to_owned(), "missing field `spec`"),
        ("negative cycles", with("/cycles", json!(-1)).to_string(), "damaged: cycles: invalid value"),
        ("fractional tests", with("/tests", json!(1.5)).to_string(), "damaged: tests: invalid type"),
        ("level without its bytes", with("/levels/0", json!({"level": "dram"})).to_string(), "levels[0]"),
        ("block of text", with("/blocks/1/cycles", json!("many")).to_string(), "blocks[1].cycles"),
    ];
    for (name, text, expected) in cases {
        let e = RunReport::parse(&text).expect_err(name);
        assert!(e.contains(expected), "{name}: expected '{expected}' in '{e}'");
    }
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(RunReport::parse(&deep).unwrap_err().contains("recursion limit"));
    let huge = with("/blocks/1/cycles", json!({"work": u64::MAX, "starved": u64::MAX}));
    assert!(compare(&report(), &huge, None).stalls.iter().all(|s| s.b <= 1.0));
    let extremes = compare(&with("/cycles", json!(0)), &with("/cycles", json!(u64::MAX)), None);
    assert_eq!(extremes.counters[0].absolute, i64::MAX);
}
