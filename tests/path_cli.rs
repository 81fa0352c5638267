//! `--method path` from outside: no pass 1 anywhere, flags without use refused by name, what the report says.

use serde_json::Value;

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

const SMALL: [&str; 6] = ["--elements", "96", "--width", "16", "--height", "12"];

#[test]
fn render_by_path_and_whitted_runs_and_reports_no_pass_1() {
    let place = Place::new();
    let furnace = scene("furnace");
    for method in ["path", "whitted"] {
        let args =
            [&["render", &furnace, "--method", method, "-o", "a.exr", "--report", "a.json"][..], &SMALL];
        let text = place.exits(0, &args.concat()).stdout;
        assert!(!text.contains("pass 1") && !text.contains("energy"), "{text}");
        let report = place.json("a.json");
        assert_eq!(report["options"]["method"], method);
        assert!(report.get("pass_1").is_none() && report.get("account").is_none(), "{report}");
        assert_eq!(report.get("share_not_two_pass").is_some(), method == "path");
    }
    let args =
        [&["render", &furnace, "--method", "two-pass", "-o", "a.exr", "--report", "a.json"][..], &SMALL];
    assert!(place.exits(0, &args.concat()).stdout.contains("pass 1"));
    let report = place.json("a.json");
    assert!(report.get("pass_1").is_some() && report.get("share_not_two_pass").is_none());
}

#[test]
fn render_by_path_tells_transport_and_the_share_that_two_pass_does_not_model() {
    let place = Place::new();
    let mirrors = scene("mirror-glass");
    for (transport, what) in [("full", "in the picture"), ("two-pass", "dropped")] {
        let path = ["render", &mirrors, "--method", "path", "--transport", transport, "--paths", "8"];
        let args = [&path[..], &["-o", "a.exr", "--report", "a.json"], &SMALL].concat();
        let text = place.exits(0, &args).stdout;
        assert!(
            text.contains("8 paths per ray") && text.contains(&format!("{transport} transport")),
            "{text}"
        );
        assert!(text.contains("two-pass does not model") && text.contains(what), "{text}");
        let report = place.json("a.json");
        assert_eq!(report["options"]["transport"], transport);
        let share = report["share_not_two_pass"].as_f64().unwrap();
        assert!((0.01..0.5).contains(&share), "{share}");
    }
}

#[test]
fn flags_without_use_for_a_method_are_refused_by_name() {
    let place = Place::new();
    let furnace = scene("furnace");
    let of_pass_1: [&[&str]; 10] = [
        &["--dense-visibility"],
        &["--kernel", "disc"],
        &["--form-factors", "vertex"],
        &["--max-shooters", "10"],
        &["--adaptive", "off"],
        &["--solution", "a.radsol"],
        &["--ambient"],
        &["--reconstruct", "hermite"],
        &["--checkpoint", "kept"],
        &["--shadow-strata", "4"],
    ];
    for flags in of_pass_1 {
        let args = [&["render", &furnace, "--method", "path"], flags].concat();
        place.refused(&args, &format!("{} has no use with --method path", flags[0]));
    }
    place.refused(&["render", &furnace, "--method", "whitted", "--ambient"], "--ambient has no use");
    place.refused(&["render", &furnace, "--method", "whitted", "--tau", "0.1"], "--tau has no use");
    let stored = ["render", &furnace, "--method", "full-radiosity"];
    place.refused(&[&stored[..], &["--shadow-error", "0.1"]].concat(), "--shadow-error has no use");
    for flags in [["--paths", "4"], ["--transport", "full"]] {
        place.refused(&[&["render", &furnace][..], &flags].concat(), &format!("{} has no use", flags[0]));
    }
    let point = ["probe", &furnace, "--at", "0.5,0.5,0", "--normal", "0,0,1"];
    place.refused(&[&point[..], &["--paths", "9"]].concat(), "--paths has no use with --method solved");
    let by_path = [&point[..], &["--method", "path"]].concat();
    place.refused(&[&by_path[..], &["--interpolated"]].concat(), "--interpolated has no use");
    let grid = ["probe", &furnace, "--surface", "floor", "--method", "path"];
    place.refused(&grid, "--surface has no use");
    place.refused(&[&by_path[..], &["--paths", "0"]].concat(), "--paths");
}

#[test]
fn probe_by_path_tells_its_standard_error_in_table_and_json() {
    let place = Place::new();
    let furnace = scene("furnace");
    let args = [
        "probe",
        &furnace,
        "--at",
        "0.5,0.5,0.01",
        "--normal",
        "0,0,1",
        "--method",
        "path",
        "--paths",
        "500",
    ];
    assert!(place.exits(0, &args).stdout.contains("standard error"));
    let json: Value =
        serde_json::from_str(&place.exits(0, &[&args[..], &["--json"]].concat()).stdout).unwrap();
    let (e, error) = (&json[0]["irradiance_w_m2"][0], &json[0]["standard_error_w_m2"][0]);
    let (e, error) = (e.as_f64().unwrap(), error.as_f64().unwrap());
    assert!(error > 0.0 && error < 0.1 * e, "{e} +- {error}");
}
