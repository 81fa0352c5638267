//! `radeng explore` as a user runs it: files, resumption after a kill, shards and their merge, bad spaces.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// 48 candidates of 24 x 24 camera rays, 6 of them impossible.
const AXES: &str = "\"icu.depth\" = { from = 4, to = 48, step = 4 }\n\"clusters.count\" = [1, 2]\n\"ctu.contexts\" = [4, 16]\n";

fn space(dir: &Path, axes: &str, more: &str) -> PathBuf {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml");
    let text = format!(
        "version = 1\nquestion = \"How deep?\"\nbase = \"delft-1992\"\ntechnology = \"osu-0.35um\"\nclock = \"derived\"\n\n\
         [axes]\n{axes}\n[[workload]]\nscene = \"{}\"\nrays = \"primary\"\nwidth = 24\nheight = 24\nelements = 400\n\n\
         [objectives]\nminimise = [\"seconds\", \"area_mm2\"]\n\n{more}\n",
        scene.display()
    );
    let file = dir.join("space.toml");
    std::fs::write(&file, text).unwrap();
    file
}

const IMPOSSIBLE: &str =
    "[[constraint]]\nrequire = \"clusters.count * icu.depth <= 72\"\nreason = \"no more stages than fit\"\n";

fn radeng(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_radeng")).current_dir(dir).arg("explore").args(args).output().unwrap()
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

fn ok(dir: &Path, args: &[&str]) -> String {
    let output = radeng(dir, args);
    assert!(output.status.success(), "{args:?}: {}", text(&output));
    text(&output)
}

fn refused(dir: &Path, args: &[&str], words: &[&str]) {
    let output = radeng(dir, args);
    let said = text(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{args:?}: expected {word:?} in {said}");
    }
}

/// All files but the store, by name.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            let is_store = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("sweep."));
            if path.is_dir() {
                folders.push(path);
            } else if !is_store {
                let bytes = std::fs::read(&path).unwrap();
                found.push((path.strip_prefix(folder).unwrap().to_owned(), bytes));
            }
        }
    }
    found.sort();
    found
}

fn assert_same_files(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    assert!(a.len() > 4, "{:?}", a.iter().map(|f| &f.0).collect::<Vec<_>>());
    for (a, b) in a.iter().zip(&b) {
        assert!(a == b, "{} differs from {}", a.0.display(), b.0.display());
    }
    assert_eq!(a.len(), b.len());
}

#[test]
fn explore_writes_page_charts_and_rows_and_its_check_holds() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    space(dir, AXES, IMPOSSIBLE);
    let said = ok(dir, &["space.toml", "-o", "out", "--check", "0.1"]);
    assert!(said.contains("every counter of every block equal"), "{said}");
    assert!(said.contains("How deep?") && said.contains("no more stages than fit"), "{said}");
    let names: Vec<String> = files(&dir.join("out")).iter().map(|f| f.0.display().to_string()).collect();
    for name in ["page.html", "results.csv", "results.parquet"] {
        assert!(names.iter().any(|n| n == name), "{name} in {names:?}");
    }
    assert!(names.iter().any(|n| n.starts_with("charts/") && n.ends_with(".svg")), "{names:?}");
    let csv = std::fs::read_to_string(dir.join("out/results.csv")).unwrap();
    assert_eq!(csv.lines().filter(|line| line.contains("simulated")).count(), 42, "{csv}");
    // One of them again, from its command and its board file.
    let point = ok(dir, &["space.toml", "--point", "5", "--save-board", "b.toml"]);
    assert!(point.contains("icu.depth = 8") && point.contains("cycles"), "{point}");
    assert!(std::fs::read_to_string(dir.join("b.toml")).unwrap().contains("depth = 8"));
    // It is not replaced without being asked for.
    refused(dir, &["space.toml", "-o", "out"], &["out", "--resume"]);
    let again = ok(dir, &["space.toml", "-o", "out", "--resume"]);
    assert!(!again.contains("differ"), "{again}");
}

#[test]
fn explore_killed_and_resumed_gives_the_files_of_an_uninterrupted_run() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    // Enough work that kills come in the middle.
    space(dir, &AXES.replace("step = 4", "step = 1"), "");
    ok(dir, &["space.toml", "-o", "whole"]);
    let mut kills = 0;
    for wait_ms in [150, 250, 400, 300, 200] {
        let mut args = vec!["explore", "space.toml", "-o", "cut", "--threads", "1"];
        if dir.join("cut/sweep.sqlite").exists() {
            args.push("--resume");
        }
        let mut child = Command::new(env!("CARGO_BIN_EXE_radeng"))
            .current_dir(dir)
            .args(&args)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait_ms));
        kills += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(kills > 0, "every run was over before its kill");
    ok(dir, &["space.toml", "-o", "cut", "--resume"]);
    assert_same_files(&dir.join("whole"), &dir.join("cut"));
}

#[test]
fn explore_in_shards_merges_to_the_files_of_one_run_and_finds_lost_and_repeated_ones() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    space(dir, AXES, IMPOSSIBLE);
    ok(dir, &["space.toml", "-o", "whole"]);
    for shard in ["1/3", "2/3", "3/3"] {
        let folder = format!("part{}", &shard[..1]);
        let said = ok(dir, &["space.toml", "-o", &folder, "--shard", shard]);
        assert!(said.contains(&format!("shard {shard}")), "{said}");
    }
    refused(dir, &["space.toml", "-o", "lost", "--merge", "part1", "part3"], &["1 shard is missing: 2/3"]);
    assert!(!dir.join("lost").exists());
    refused(dir, &["space.toml", "-o", "o", "--merge", "part1", "part1"], &["shard 1/3 is in part1 as well"]);
    std::fs::create_dir(dir.join("copy")).unwrap();
    std::fs::copy(dir.join("part2/sweep.sqlite"), dir.join("copy/sweep.sqlite")).unwrap();
    let twice = ["space.toml", "-o", "twice", "--merge", "part1", "part2", "copy", "part3"];
    refused(dir, &twice, &["shard 2/3 is in part2 as well"]);
    let other = ["space.toml", "-o", "part1", "--shard", "2/3", "--resume"];
    refused(dir, &other, &["is of shard 1/3, expected shard 2/3"]);
    ok(dir, &["space.toml", "-o", "merged", "--merge", "part1", "part2", "part3"]);
    assert_same_files(&dir.join("whole"), &dir.join("merged"));
    // A search that follows its answers has no parts.
    let searched = ["space.toml", "-o", "s", "--strategy", "nsga2", "--points", "20", "--shard", "1/2"];
    refused(dir, &searched, &["cannot be cut into shards"]);
}

#[test]
fn explore_flags_that_do_not_go_together_are_refused_before_anything_is_made() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    space(dir, AXES, "");
    let cases: [(&[&str], &str); 8] = [
        (&["space.toml"], "--output"),
        (&["space.toml", "-o", "o", "--shard", "4/3"], "such as 3/8"),
        (&["space.toml", "-o", "o", "--points", "5"], "a grid has all combinations"),
        (&["space.toml", "-o", "o", "--strategy", "random"], "--points or --minutes"),
        (&["space.toml", "-o", "o", "--minutes", "-1"], "over 0"),
        (&["space.toml", "-o", "o", "--sample", "1.5"], "up to 1"),
        (&["space.toml", "--point", "48"], "under 48"),
        (&["none.toml", "-o", "o"], "none.toml"),
    ];
    for (args, words) in cases {
        refused(dir, args, &[words]);
        assert!(!dir.join("o").exists(), "{args:?}");
    }
}

#[test]
fn explore_of_a_scene_without_a_camera_is_refused_before_anything_is_made() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let furnace = std::fs::read_to_string(root.join("scenes/furnace/scene.toml")).unwrap();
    let (before, rest) = furnace.split_once("[camera]").unwrap();
    let after = &rest[rest.find("\n[").unwrap()..];
    std::fs::create_dir(dir.join("dark")).unwrap();
    std::fs::write(dir.join("dark/scene.toml"), format!("{before}{after}")).unwrap();
    let file = space(dir, AXES, "");
    let cornell = root.join("scenes/cornell-box/scene.toml").display().to_string();
    let text = std::fs::read_to_string(&file).unwrap().replace(&cornell, "dark/scene.toml");
    std::fs::write(&file, text).unwrap();
    refused(dir, &["space.toml", "-o", "o"], &["dark-primary", "camera"]);
    // Shards and an end by time do not go together, wherever the time stands.
    space(dir, AXES, "[search]\nstrategy = \"grid\"\nminutes = 1\n");
    refused(dir, &["space.toml", "-o", "o", "--shard", "1/2"], &["no `minutes` with shards"]);
    assert!(!dir.join("o").exists());
}

#[test]
fn explore_of_a_bad_space_names_file_and_line() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    space(dir, "\"icu.dept\" = [1, 2]\n", "");
    refused(dir, &["space.toml", "-o", "o"], &["space.toml", "8", "icu.depth"]);
    assert!(!dir.join("o").exists());
}

#[test]
fn explore_with_a_sample_has_error_bars_that_hold_the_cycles() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    space(dir, "\"icu.depth\" = [4, 22]\n", "");
    let said = ok(dir, &["space.toml", "-o", "o", "--sample", "0.5"]);
    let csv = std::fs::read_to_string(dir.join("o/results.csv")).unwrap();
    assert!(csv.contains("sampled") && csv.lines().next().unwrap().contains("half_width"), "{said}{csv}");
}

/// The claims about speed and search, on 10,000 boards: minutes.
/// `cargo test --release --test explore -- --ignored --nocapture ten_thousand`
#[test]
#[ignore = "ten thousand boards, and 1 % of them in full: about ten CPU minutes"]
fn explore_ten_thousand_timings_checks_1_percent_and_nsga2_finds_their_front_with_a_tenth() {
    use std::sync::atomic::AtomicBool;
    use std::time::Instant;

    use radiosity_engine::explore::results::pareto::Ranges;
    use radiosity_engine::explore::run::{Options, run};
    use radiosity_engine::explore::space::{Space, Strategy};

    let dir = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut space = Space::load(&root.join("scenes/spaces/timing-10k.toml")).unwrap();
    let stop = AtomicBool::new(false);
    let mut options = Options { folder: dir.path().join("out"), ..Options::default() };
    let points = |space: &Space, options: &Options| -> Vec<Vec<f64>> {
        let results = run(space, options, &stop, &mut |_| {}).unwrap().results.unwrap();
        let objectives: Vec<usize> =
            (0..results.metrics.len()).filter(|i| results.metrics[*i].is_objective).collect();
        let of = |row: &radiosity_engine::explore::results::Row| -> Option<Vec<f64>> {
            objectives.iter().map(|i| row.metrics[*i]).collect()
        };
        results.rows.iter().filter_map(of).collect()
    };
    let began = Instant::now();
    let all = points(&space, &options);
    println!("{} candidates in {:.0} s", all.len(), began.elapsed().as_secs_f64());
    assert_eq!(all.len(), 10_000);

    options.resume = true;
    options.check = Some(0.01);
    let checked = run(&space, &options, &stop, &mut |_| {}).unwrap().checked.unwrap();
    println!("{} in full: {} differ", checked.n, checked.faults.len());
    assert_eq!((checked.n, checked.faults), (100, Vec::new()));

    options.check = None;
    let ranges = Ranges::of(&all);
    let whole = ranges.hypervolume(&all);
    space.search.strategy = Strategy::Nsga2 { population: 50 };
    space.search.points = Some(1000);
    for seed in 1..=5 {
        space.search.seed = seed;
        let found = points(&space, &options);
        let share = ranges.hypervolume(&found) / whole;
        println!(
            "NSGA-II, seed {seed}: {} candidates, {:.2} % of the hypervolume",
            found.len(),
            share * 100.0
        );
        assert!(found.len() <= 1000 && share > 0.95, "{share}");
        let strategy = std::mem::replace(&mut space.search.strategy, Strategy::Random);
        let chance = ranges.hypervolume(&points(&space, &options)) / whole;
        println!("as many by chance: {:.2} %", chance * 100.0);
        space.search.strategy = strategy;
    }
}
