//! `verify`, its sweep, and test vectors from outside: exit statuses, tables, reports, files that replay.

use serde_json::Value;

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

fn write(place: &Place, name: &str, text: impl AsRef<[u8]>) {
    std::fs::write(place.path(name), text).unwrap();
}

fn text(place: &Place, name: &str) -> String {
    std::fs::read_to_string(place.path(name)).unwrap()
}

/// Every word stands in the text, one behind the other.
fn in_order(text: &str, words: &[&str]) {
    let mut rest = text;
    for word in words {
        let at = rest.find(word);
        assert!(at.is_some(), "'{word}' is missing, or before the others, in\n{text}");
        rest = &rest[at.unwrap_or(0) + word.len()..];
    }
}

/// Few rays, a small picture, a coarse mesh.
const SMALL: [&str; 14] = [
    "--elements",
    "96",
    "--width",
    "12",
    "--height",
    "8",
    "--shadow-strata",
    "2",
    "--rays",
    "2000",
    "--clocked",
    "300",
    "--board",
    "minimal",
];

fn verify<'a>(scene: &'a str, extra: &[&'a str]) -> Vec<&'a str> {
    [&["verify", scene][..], &SMALL, extra].concat()
}

/// A triangle, a quad before it, rays of each kind with right answers.
const VECTORS: &str = "vectors,1
formats,8,8,8,full,nearest-even
patch,7,triangle,-10,-10,100,10,-10,100,0,20,100
patch,3,quad,-10,-10,50,10,-10,50,10,10,50,-10,10,50
ray,nearest,0,0,0,0,0,255,1024,50,3,back
ray,any,0,0,-200,0,0,255,1024,hit
ray,nearest,0,0,0,0,0,-255,1024,miss
ray,any,0,0,0,255,0,0,3
end,2,4,0
";

#[test]
fn verify_of_a_room_passes_and_prints_one_screen() {
    let place = Place::new();
    let scene = scene("point-room");
    let run = place.exits(0, &verify(&scene, &["--report", "r.json"]));
    for word in [
        "board == oracle: 0 mismatches",
        "2000 rays",
        "primary",
        "form factors",
        "shadow",
        "misclassified",
        "edge",
        "unexplained",
        "median",
        "of the derived bound",
        "spare bits",
        "num_shifted",
        "undecided",
        "RMSE",
        "passed",
    ] {
        assert!(run.stdout.contains(word), "'{word}' is missing in\n{}", run.stdout);
    }
    assert!(
        run.stdout.lines().count() <= 62
            && run.stdout.lines().all(|l| l.len() <= 120 || l.starts_with("scene")),
        "{}",
        run.stdout
    );
    assert_eq!(place.names(), ["r.json"], "no mismatch, no file");
    let report = place.json("r.json");
    assert_eq!((&report["schema"], &report["passed"]), (&"radeng/verify/1".into(), &true.into()));
    assert_eq!((&report["n_rays"], &report["n_mismatches"]), (&2000.into(), &0.into()));
    assert_eq!(report["board"]["name"], "minimal");
    assert!(report["n_wire_tests"].as_u64().unwrap() > 100);
    assert_eq!(report["first_test"].as_array().unwrap().len(), 5);
    assert!(report["wires"].as_array().unwrap().len() >= 17);
    let t = &report["t_error"];
    let step_m = report["step_m"].as_f64().unwrap();
    assert!((t["max_m"].as_f64().unwrap() - step_m * t["max_steps"].as_f64().unwrap()).abs() < 1e-12);
    assert!(report["sweep"].is_null() && report["image"]["n_pixels"] == 96);
}

#[test]
fn sweep_of_three_widths_prints_plots_and_reports_a_row_each() {
    let place = Place::new();
    let scene = scene("point-room");
    let flags =
        ["--sweep", "frac_bits=8..16:4", "--first-test", "8,6", "--plot", "p.svg", "--report", "r.json"];
    let run = place.exits(0, &verify(&scene, &flags));
    assert!(run.stdout.contains("frac_bits 8 to 16, 2000 rays each"), "{}", run.stdout);
    assert!(run.stdout.lines().all(|l| l.len() <= 120 || l.starts_with("scene")), "{}", run.stdout);
    let report = place.json("r.json");
    let rows = report["sweep"]["rows"].as_array().unwrap();
    assert_eq!(report["sweep"]["parameter"], "frac_bits");
    assert_eq!(rows.iter().map(|r| r["value"].as_u64().unwrap()).collect::<Vec<_>>(), [8, 12, 16]);
    for row in rows {
        let formats = &row["formats"];
        for width in ["coord_frac_bits", "dir_frac_bits", "t_frac_bits"] {
            assert_eq!(formats[width], row["value"], "{formats}");
        }
        assert_eq!((&row["n_mismatches"], &row["n_rays"]), (&0.into(), &2000.into()));
        assert!(row["image"].is_null());
        let line = run
            .stdout
            .lines()
            .find(|l| l.starts_with(&format!("{:>5} ", row["value"].as_u64().unwrap())))
            .unwrap();
        let cells: Vec<&str> = line.split_whitespace().filter(|c| *c != "|").collect();
        assert_eq!(cells.len(), 2 + 5 + 4 + 2, "{line}");
        assert_eq!(cells[1], "0", "{line}");
    }
    let error_m = |row: &Value| row["t_error"]["p99_m"].as_f64().unwrap();
    assert!(error_m(&rows[0]) > 4.0 * error_m(&rows[1]) && error_m(&rows[1]) > 4.0 * error_m(&rows[2]));
    let svg = text(&place, "p.svg");
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    for word in ["point-room on minimal: frac_bits", "depth tie", "6 bits", "% of the rays", "polyline"] {
        assert!(svg.contains(word), "'{word}' is missing in the plot");
    }
}

#[test]
fn verify_with_flags_that_cannot_be_is_refused_before_any_work() {
    let place = Place::new();
    let scene = scene("furnace");
    let refused = |extra: &[&str], expected: &str| {
        place.refused(&[&["verify", scene.as_str()][..], extra].concat(), expected);
    };
    refused(&["--sweep", "coord_frac_bits=7..9"], "coord_frac_bits = 7 is outside 8..=28");
    refused(&["--sweep", "t_frac_bits=30..40"], "t_frac_bits = 33 is outside 8..=32");
    refused(&["--sweep", "width=8..9"], "'width' is none of coord_frac_bits");
    refused(&["--sweep", "coord_frac_bits"], "expected NAME=FROM..TO");
    refused(&["--first-test", "3"], "3 is not in 4..=24");
    refused(&["--first-test", "6,,8"], "--first-test");
    refused(&["--rays", "0"], "0 is not in 1..=");
    refused(&["--plot", "p.svg"], "--sweep");
    refused(&["--sweep", "t_frac_bits=8..9", "--vectors", "v.csv"], "--vectors");
    refused(&["--sweep", "t_frac_bits=8..9", "--plot", "p.png"], "ends in .svg");
    refused(&["--vectors", "v.txt"], "v.txt: expected a name that ends in .csv or .rvec");
    refused(&["--mismatch", "v"], "v: expected a name that ends in .csv or .rvec");
    refused(&["--vectors", "v.csv", "--mismatch", "./v.csv"], "named twice");
    refused(&["--vector-rays", "10"], "--vectors");
    refused(&["--board", "delft-1991"], "(presets: delft-1992, minimal)");
}

#[test]
fn vectors_of_verify_replay_and_a_changed_answer_is_found() {
    let place = Place::new();
    let scene = scene("point-room");
    place.exits(0, &verify(&scene, &["--no-image", "--vectors", "v.csv", "--vector-rays", "60"]));
    let run = place.exits(0, &["simulate", "--rays", "v.csv", "--board", "minimal", "--report", "r.json"]);
    assert!(run.stdout.contains("passed     60 of 60 rays hold, "), "{}", run.stdout);
    assert!(run.stdout.contains("single tests hold; 60 of 60 expected answers\n"), "{}", run.stdout);
    assert!(run.stdout.contains(", the file's\n"), "{}", run.stdout);
    assert!(run.stdout.contains("% of the cycles") && run.stdout.contains("least work"), "{}", run.stdout);
    let report = place.json("r.json");
    assert_eq!((&report["schema"], &report["workload"]), (&"radeng/simulate/1".into(), &"vectors".into()));
    let vectors = &report["vectors"];
    assert_eq!((&vectors["n_expected"], &vectors["passed"]), (&60.into(), &true.into()));
    assert!(vectors["n_tests"].as_u64().unwrap() > 60 && report["cycles"].as_u64().unwrap() > 0);
    assert_eq!(report["rays"], 60);
    assert!(report["scene"].is_null());

    // The binary file is the same, and runs as well.
    place.exits(0, &verify(&scene, &["--no-image", "--vectors", "v.rvec", "--vector-rays", "60"]));
    let binary = place.exits(0, &["simulate", "--rays", "v.rvec", "--board", "minimal"]);
    assert!(binary.stdout.contains("passed     60 of 60 rays hold, "), "{}", binary.stdout);

    // One unit of t of one nearest-hit ray.
    let text = text(&place, "v.csv");
    let is_hit = |line: &str| line.starts_with("ray,nearest") && !line.ends_with("miss");
    let (number, line) =
        text.lines().filter(|l| l.starts_with("ray,")).enumerate().find(|(_, l)| is_hit(l)).unwrap();
    let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
    fields[9] = (fields[9].parse::<u64>().unwrap() ^ 1).to_string();
    write(&place, "wrong.csv", text.replacen(line, &fields.join(","), 1));
    let run = place.exits(1, &["simulate", "--rays", "wrong.csv", "--board", "minimal"]);
    assert!(run.stdout.contains("FAILED     1 of 60 rays does not hold, "), "{}", run.stdout);
    in_order(&run.stdout, &["FAILED", "first wrong answer", "again ", "% of the cycles"]);
    assert!(run.stdout.contains(&format!("first wrong answer: ray {number} of the file")), "{}", run.stdout);
    for word in [
        "board, clocked",
        "board, functional",
        "oracle",
        "num012",
        "again      radeng simulate --rays wrong.csv --board minimal",
    ] {
        assert!(run.stdout.contains(word), "'{word}' is missing in\n{}", run.stdout);
    }
    // One unit of one wire of one test.
    let line = text.lines().find(|l| l.starts_with("test,")).unwrap();
    let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
    fields[5 + 27] = (fields[5 + 27].parse::<i128>().unwrap() + 1).to_string();
    write(&place, "wire.csv", text.replacen(line, &fields.join(","), 1));
    let run = place.exits(1, &["simulate", "--rays", "wire.csv", "--board", "minimal"]);
    let n_tests = text.lines().filter(|l| l.starts_with("test,")).count();
    let failed = format!("FAILED     60 of 60 rays hold, 1 of {n_tests} single tests does not");
    assert!(run.stdout.contains(&failed), "{}", run.stdout);
    in_order(&run.stdout, &["FAILED", "first wrong answer", "again ", "% of the cycles"]);
    assert!(run.stdout.contains("first wrong answer: test 0 of the file"), "{}", run.stdout);
    let differing: Vec<&str> = run.stdout.lines().filter(|l| l.ends_with("<-- differ")).collect();
    assert_eq!(differing.len(), 1, "{}", run.stdout);
    assert!(differing[0].trim_start().starts_with("e01"), "{}", differing[0]);
}

#[test]
fn simulate_of_small_vectors_tells_what_holds_and_which_formats_it_takes() {
    let place = Place::new();
    write(&place, "v.csv", VECTORS);
    let run = place.exits(0, &["simulate", "--rays", "v.csv"]);
    assert!(run.stdout.contains("2 patches, 4 rays of which 3 with an expected answer"), "{}", run.stdout);
    assert!(run.stderr.contains("number formats replace those of board delft-1992"), "{}", run.stderr);
    write(&place, "back.csv", VECTORS.replace("50,3,back", "50,3,front"));
    let run = place.exits(1, &["simulate", "--rays", "back.csv"]);
    assert!(
        run.stdout.contains("first wrong answer: ray 0 of the file (from 0), nearest hit"),
        "{}",
        run.stdout
    );
    write(&place, "any.csv", VECTORS.replace(",hit", ",miss"));
    let run = place.exits(1, &["simulate", "--rays", "any.csv"]);
    assert!(run.stdout.contains("first wrong answer: ray 1 of the file (from 0), any hit"), "{}", run.stdout);
}

#[test]
fn simulate_of_vectors_without_answers_says_that_nothing_was_expected() {
    let place = Place::new();
    let questions = "vectors,1\nformats,24,24,24,48,nearest-even\ngrid,3\npatch,7,triangle,-10,-10,100,10,-10,100,0,20,100\n\
        ray,nearest,0,0,0,0,0,255,1024\nray,any,0,0,0,255,0,0,3\nend,1,2,0\n";
    write(&place, "v.csv", questions);
    let run = place.exits(0, &["simulate", "--rays", "v.csv"]);
    assert!(run.stdout.contains("0 of 0 expected"), "{}", run.stdout);
    let agree = "clocked board, functional model and oracle agree on 2 of 2 rays";
    assert!(run.stdout.contains(agree) && !run.stdout.contains("passed"), "{}", run.stdout);
    assert!(run.stdout.contains("grid of 2^3 cells a side, the file's"), "{}", run.stdout);
    // K = 2F keeps all bits, as the board does: nothing is replaced.
    assert_eq!(run.stderr, "");
    // Half of the bits does replace the board's.
    write(&place, "half.csv", questions.replacen(",48,", ",24,", 1));
    let run = place.exits(0, &["simulate", "--rays", "half.csv"]);
    assert!(run.stderr.contains("number formats replace those of board"), "{}", run.stderr);
}

#[test]
fn simulate_of_vectors_with_a_grid_says_when_it_replaces_the_boards() {
    let place = Place::new();
    write(&place, "five.toml", "grid_log2 = 5\n");
    let with_grid = |g: u32| VECTORS.replacen("patch,7", &format!("grid,{g}\npatch,7"), 1);
    for (text, replaced, grid) in [
        (with_grid(3), true, "2^3 cells a side, the file's"),
        (with_grid(5), false, "2^5 cells a side, the file's"),
    ] {
        write(&place, "v.csv", text);
        let run =
            place.exits(0, &["simulate", "--rays", "v.csv", "--board", "five.toml", "--report", "r.json"]);
        assert_eq!(
            run.stderr.contains("the vectors' grid of 2^3 cells a side replaces"),
            replaced,
            "{}",
            run.stderr
        );
        assert!(run.stdout.contains(grid), "{}", run.stdout);
    }
    write(&place, "v.csv", VECTORS);
    let run = place.exits(0, &["simulate", "--rays", "v.csv", "--board", "five.toml"]);
    assert!(run.stdout.contains("grid of 2^5 cells a side, that of board"), "{}", run.stdout);
    assert!(!run.stderr.contains("grid"), "{}", run.stderr);
}

#[test]
fn simulate_of_what_it_cannot_take_says_what_to_do() {
    let place = Place::new();
    let furnace = scene("furnace");
    write(&place, "v.csv", VECTORS);
    write(&place, "metres.csv", "0,0,0,0,0,1\n");
    write(&place, "bad.csv", VECTORS.replace("miss", "mist"));
    write(
        &place,
        "empty.csv",
        "vectors,1\nformats,8,8,8,full,floor\npatch,1,triangle,0,0,0,1,0,0,0,1,0\nend,1,0,0\n",
    );
    write(&place, "cut.rvec", b"RVEC\x01\0\0\0");
    place.refused(&["simulate"], "SCENE");
    place.refused(&["simulate", &furnace, "--rays", "v.csv"], "take no SCENE: radeng simulate --rays v.csv");
    place.refused(&["simulate", "--rays", "metres.csv"], "radeng simulate SCENE --rays metres.csv");
    place.refused(&["simulate", "--rays", "bad.csv"], "bad.csv:7: t of the hit is 'mist'");
    place.refused(&["simulate", "--rays", "cut.rvec"], "cut.rvec byte 8: the length of the file is 8 bytes");
    place.refused(&["simulate", "--rays", "empty.csv"], "empty.csv: the file holds no rays and no tests");
    place.refused(&["simulate", "--rays", "none.csv"], "none.csv: no such file, expected test vectors");
    place.refused(&["simulate", "--rays", "."], "is a directory, expected test vectors");
    for flag in [
        &["--elements", "10"][..],
        &["--seed", "1"],
        &["--dense-visibility"],
        &["--width", "256"],
        &["--height", "10"],
        &["--samples", "1"],
        &["--shadow-strata", "4"],
    ] {
        let expected = format!("{} has no use without SCENE", flag[0]);
        place.refused(&[&["simulate", "--rays", "v.csv"], flag].concat(), &expected);
    }
    let two = ["simulate", "--seed", "2", "--rays", "v.csv", "--height", "9"];
    place.refused(&two, "--seed, --height have no use without SCENE");
    write(&place, "cut.csv", VECTORS.replace("end,2,4,0\n", ""));
    place.refused(
        &["simulate", "--rays", "cut.csv"],
        "cut.csv:8: the end of the file is here, expected a line end,",
    );
    write(&place, "other.rvec", "PK zip");
    place.refused(
        &["simulate", "--rays", "other.rvec"],
        "other.rvec byte 0: the magic is 'PK z', expected RVEC",
    );
    for name in ["nothing.rvec", "nothing.csv"] {
        write(&place, name, "");
        place.refused(&["simulate", "--rays", name], "the file is empty, expected test vectors");
    }
    write(&place, "marked.csv", format!("\u{feff}{VECTORS}"));
    place.exits(0, &["simulate", "--rays", "marked.csv"]);
    write(&place, "tiny.toml", "grid_log2 = 7\n[dram]\nbytes = 4096\n");
    place.refused(
        &["simulate", "--rays", "v.csv", "--board", "tiny.toml", "--report", "r.json"],
        "patch memory",
    );
}

#[test]
fn help_of_verify_and_simulate_describes_sweeps_and_vectors() {
    let place = Place::new();
    let help = |name: &str| {
        place.exits(0, &[name, "--help"]).stdout.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let verify = help("verify");
    for word in ["Examples:", "coord_frac_bits=8..28", "radeng simulate --rays out.csv", "exit status is 1"] {
        assert!(verify.contains(word), "'{word}' is missing in\n{verify}");
    }
    let simulate = help("simulate");
    for word in [
        "radeng simulate --rays vectors.csv",
        "Without SCENE it holds test vectors",
        "radeng verify --vectors",
    ] {
        assert!(simulate.contains(word), "'{word}' is missing in\n{simulate}");
    }
}
