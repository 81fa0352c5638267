//! Solves that are kept: checkpoints that survive `kill -9`, exact solves, relighting, the ambient term; from outside.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

/// A scene whose solve takes a few seconds.
fn solve_args<'a>(scene: &'a str, out: &'a str) -> Vec<&'a str> {
    vec!["solve", scene, "-o", out, "--elements", "3000", "--unshot", "2e-3"]
}

fn start(place: &Place, args: &[&str]) -> Child {
    Command::new(assert_cmd::cargo::cargo_bin!("radeng"))
        .current_dir(place.path("."))
        .args(args)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// A time between 0 and `most`, from a counter: the same in every run, spread evenly.
fn moment(i: u32, most: Duration) -> Duration {
    let golden = 0.618_033_988_749_895 * f64::from(i + 1);
    most.mul_f64(golden.fract())
}

/// Kills a kept solve at `n` moments, each resumed to its end, and compares the files; how many had something to resume.
fn kill_and_resume(args: &[&str], n: u32) -> u32 {
    let place = Place::new();
    let started = Instant::now();
    place.exits(0, &[args, &["-o", "whole.radsol"]].concat());
    let takes = started.elapsed();
    let whole = std::fs::read(place.path("whole.radsol")).unwrap();
    let kept = [args, &["-o", "kept.radsol", "--checkpoint", "state", "--checkpoint-every", "0.1"]].concat();
    let mut resumed = 0;
    for i in 0..n {
        let mut child = start(&place, &kept);
        std::thread::sleep(moment(i, takes));
        child.kill().unwrap();
        child.wait().unwrap();
        let run = place.run(&kept);
        assert_eq!(run.status, 0, "kill {i}: {}", run.stderr);
        resumed += u32::from(run.stderr.contains("pass 1 goes on from its checkpoint"));
        let again = std::fs::read(place.path("kept.radsol")).unwrap();
        assert_eq!(again.len(), whole.len(), "kill {i}");
        assert!(again == whole, "kill {i}: another file");
        assert_eq!(
            std::fs::read_dir(place.path("state")).unwrap().count(),
            0,
            "kill {i}: the checkpoint stayed"
        );
        std::fs::remove_file(place.path("kept.radsol")).unwrap();
    }
    resumed
}

#[test]
fn solve_killed_at_any_moment_goes_on_to_the_same_file() {
    let box_scene = scene("cornell-box");
    let args = ["solve", &box_scene, "--elements", "800"];
    assert!(kill_and_resume(&args, 5) >= 2);
}

#[test]
fn adaptive_solve_killed_at_any_moment_goes_on_on_its_refined_mesh_to_the_same_file() {
    let box_scene = scene("cornell-box");
    let args = ["solve", &box_scene, "--elements", "600", "--adaptive", "on", "--unshot", "3e-4"];
    assert!(kill_and_resume(&args, 8) >= 1);
}

/// `cargo test --release --test kept_solves -- --ignored --nocapture`
#[test]
#[ignore = "a minute and more"]
fn solves_killed_at_20_moments_go_on_to_the_same_file() {
    let box_scene = scene("cornell-box");
    let kernel = ["solve", &box_scene, "--elements", "2000"];
    let bundles = ["solve", &box_scene, "--elements", "3000", "--max-shooters", "100"];
    for args in [&kernel[..], &bundles[..]] {
        let resumed = kill_and_resume(args, 20);
        println!("{args:?}: 20 kills, {resumed} resumed from a checkpoint, 20 files the same");
        assert!(resumed >= 12, "{resumed}");
    }
}

#[test]
fn solve_stopped_by_ctrl_c_says_where_it_goes_on_and_exits_with_130() {
    let place = Place::new();
    let box_scene = scene("cornell-box");
    let args = [&solve_args(&box_scene, "a.radsol")[..], &["--checkpoint", "state"]].concat();
    let mut child = start(&place, &args);
    let file = place.path("state/solve.lock");
    wait_for(&file);
    std::thread::sleep(Duration::from_millis(300));
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("the same command goes on from state/solve.radchk"), "{stderr}");
    assert!(!place.path("a.radsol").exists());
    let run = place.exits(0, &args);
    assert!(run.stderr.contains("goes on from its checkpoint"), "{}", run.stderr);
    child = start(&place, &["--version"]);
    child.wait().unwrap();
}

fn wait_for(file: &Path) {
    let started = Instant::now();
    while !file.exists() {
        assert!(started.elapsed() < Duration::from_secs(60), "{}", file.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn checkpoint_that_cannot_be_is_refused_before_the_work() {
    let place = Place::new();
    let furnace = scene("furnace");
    let solve = |more: &[&'static str]| [&["solve", &furnace, "-o", "a.radsol"], more].concat();
    place.refused(&solve(&["--checkpoint", "no/such"]), "--checkpoint no/such: the folder cannot be made");
    place.refused(&solve(&["--checkpoint-every", "5"]), "--checkpoint");
    place.refused(&solve(&["--checkpoint", "s", "--checkpoint-every", "-1"]), "expected seconds");
    place.refused(&solve(&["--checkpoint", "s", "--exact"]), "--exact");
    place.refused(
        &["render", &furnace, "--solution", "a.radsol", "--checkpoint", "s"],
        "--checkpoint has no use with --solution",
    );
}

#[test]
fn exact_solve_agrees_with_progressive_refinement_and_names_its_limit() {
    let place = Place::new();
    let box_scene = scene("cornell-box");
    let solve = |out: &'static str, more: &[&'static str]| {
        let report = format!("{out}.json");
        let args = ["solve", &box_scene, "--elements", "800", "-o", out, "--report", &report];
        place.exits(0, &[&args, more].concat());
        place.json(&report)
    };
    let (exact, progressive) = (solve("e.radsol", &["--exact"]), solve("p.radsol", &["--unshot", "1e-6"]));
    let incident = |report: &serde_json::Value| -> Vec<f64> {
        let surfaces = report["surfaces"].as_array().unwrap();
        surfaces.iter().map(|s| s["incident_w"][1].as_f64().unwrap()).collect()
    };
    let (e, p) = (incident(&exact), incident(&progressive));
    assert!(!e.is_empty() && e.len() == p.len());
    for (e, p) in e.iter().zip(&p) {
        assert!((e - p).abs() <= 1e-4 * e, "{e} {p}");
    }
    assert_eq!(exact["account"]["unshot_w"][0], 0.0);
    assert_eq!(exact["pass_1"]["exact"], true);
    assert!(exact["reciprocity"]["rms"].as_f64().unwrap() > 0.0, "{}", exact["reciprocity"]);
    place.refused(
        &["solve", &box_scene, "--elements", "40000", "-o", "x.radsol", "--exact"],
        "the exact solve takes at most 5000 patches, the mesh has",
    );
}

/// The Cornell box with the left wall's colour changed.
fn repainted(place: &Place) -> PathBuf {
    let text = std::fs::read_to_string(scene("cornell-box")).unwrap();
    let red = text.lines().find(|l| l.starts_with("reflectance") && l.contains("0.05")).unwrap();
    let path = place.path("repainted.toml");
    std::fs::write(&path, text.replacen(red, "reflectance = [0.1, 0.2, 0.6]", 1)).unwrap();
    path
}

#[test]
fn cornell_box_with_another_colour_goes_on_to_the_picture_of_a_solve_anew_in_fewer_shots() {
    let place = Place::new();
    let (old, new) = (scene("cornell-box"), repainted(&place));
    let new = new.to_str().unwrap();
    let size = ["--elements", "1500"];
    place.exits(0, &[&["solve", &old, "-o", "old.radsol"], &size[..]].concat());
    place.refused(
        &[&["render", new, "--solution", "old.radsol", "-o", "x.png"], &size[..]].concat(),
        "reflectance",
    );
    let run = |out: &str, more: &[&str]| {
        let report = format!("{out}.json");
        let started = Instant::now();
        place.exits(0, &[&["solve", new, "-o", out, "--report", &report], &size[..], more].concat());
        let report = place.json(&report);
        (report["pass_1"]["n_shots"].as_f64().unwrap(), started.elapsed().as_secs_f64(), report)
    };
    let (shots_on, s_on, on) = run("on.radsol", &["--continue-from", "old.radsol"]);
    let (shots_anew, s_anew, anew) = run("anew.radsol", &[]);
    println!("shots {shots_on} / {shots_anew} = {:.2}, time {:.2}", shots_on / shots_anew, s_on / s_anew);
    assert!(shots_on < 0.8 * shots_anew, "{shots_on} {shots_anew}");
    assert_eq!(on["pass_1"]["earlier"]["n_solves"], 1);
    for (a, b) in on["surfaces"].as_array().unwrap().iter().zip(anew["surfaces"].as_array().unwrap()) {
        for c in 0..3 {
            let of = |s: &serde_json::Value| s["incident_w"][c].as_f64().unwrap();
            assert!((of(a) - of(b)).abs() <= 2e-3 * of(b).abs(), "{a} {b}");
        }
    }
    place.refused(
        &["solve", new, "-o", "x.radsol", "--continue-from", "old.radsol", "--elements", "3000"],
        "another geometry or another mesh",
    );
    place
        .refused(&["solve", new, "-o", "x.radsol", "--continue-from", "old.radsol", "--seed", "2"], "--seed");
}

#[test]
fn ambient_term_brightens_the_picture_of_an_early_solution_and_is_reported() {
    let place = Place::new();
    let box_scene = scene("cornell-box");
    let size = ["--elements", "800"];
    let early = ["solve", &box_scene, "-o", "early.radsol", "--max-shots", "60", "--report", "s.json"];
    place.exits(0, &[&early, &size[..]].concat());
    let look = |more: &[&str]| {
        let args = [
            "render",
            &box_scene,
            "--solution",
            "early.radsol",
            "--width",
            "32",
            "--height",
            "32",
            "-o",
            "a.exr",
        ];
        let args = [&args, &size[..], &["--report", "r.json"], more].concat();
        let text = place.exits(0, &args).stdout;
        (place.json("r.json"), text)
    };
    let (without, text) = look(&[]);
    assert!(without["ambient_w_m2"].is_null() && !text.contains("ambient"), "{text}");
    let (with, text) = look(&["--ambient"]);
    assert!(text.contains("added to the stored light, in no account"), "{text}");
    let luminance = |r: &serde_json::Value| r["mean_luminance_w_m2_sr"].as_f64().unwrap();
    assert!(luminance(&with) > 1.02 * luminance(&without), "{} {}", luminance(&with), luminance(&without));
    assert_eq!(with["account"], without["account"]);
    assert!(with["ambient_w_m2"][0].as_f64().unwrap() > 0.0);
}
