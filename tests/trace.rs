//! Looking inside a run from outside: the account of rays and stalls closes, a log replays to what was seen live, what cannot
//! be is refused by name and leaves no file.

use serde_json::Value;

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

const SMALL: [&str; 6] = ["--elements", "96", "--width", "20", "--height", "12"];

/// `simulate` of the lit cube with these flags.
fn simulate<'a>(cube: &'a str, flags: &[&'a str]) -> Vec<&'a str> {
    ["simulate", cube].into_iter().chain(SMALL).chain(flags.iter().copied()).collect()
}

fn numbers(table: &Value) -> impl Iterator<Item = u64> {
    table.as_object().unwrap().values().map(|n| n.as_u64().unwrap())
}

#[test]
fn simulate_with_an_account_closes_it_against_the_stall_tables_and_the_rays() {
    let place = Place::new();
    let cube = scene("lit-cube");
    let flags = ["--account", "--interval", "500", "--ray", "7", "--report", "r.json"];
    let text = place.exits(0, &simulate(&cube, &flags)).stdout;
    for label in ["observed ", "  lives ", "  roots ", "  in time ", "  ray "] {
        assert!(text.contains(label), "{label} is not in\n{text}");
    }
    let report = place.json("r.json");
    let observed = &report["observed"];
    let lives = &observed["lives"];
    assert_eq!(lives["rays"], report["rays"]);
    assert_eq!(numbers(&lives["cycles_by_phase"]).sum::<u64>(), lives["ray_cycles"].as_u64().unwrap());
    let (shortest, median) = (lives["shortest"].as_u64(), lives["median"].as_u64());
    assert!(shortest > Some(0) && shortest <= median && median <= lives["longest"].as_u64());
    let mut n_full = 0;
    for block in report["blocks"].as_array().unwrap() {
        let full = block["cycles"]["output_full"].as_u64().unwrap();
        let stalls = observed["stall_roots"].as_array().unwrap();
        let stall = stalls.iter().find(|stall| stall["block"] == block["block"]);
        let roots =
            stall.map(|s| s["roots"].as_array().unwrap().iter().map(|r| r["cycles"].as_u64().unwrap()));
        assert_eq!(roots.map_or(0, Iterator::sum::<u64>), full, "{}", block["block"]);
        n_full += full;
    }
    assert!(n_full > 0);
    let work = |table: &Value| table["work"].as_u64().unwrap_or(0);
    let icus = report["blocks"].as_array().unwrap().iter();
    let icus = icus.filter(|block| block["block"].as_str().unwrap().ends_with(".icu"));
    let by_block: u64 = icus.map(|block| work(&block["cycles"])).sum();
    let intervals = observed["intervals"]["intervals"].as_array().unwrap();
    let over_time: u64 = intervals.iter().map(|i| work(&i["kinds"]["icu"]["cycles"])).sum();
    assert_eq!(over_time, by_block);
    let clocked = observed["clocked_cycles"].as_u64().unwrap();
    assert_eq!(intervals.len() as u64, clocked.div_ceil(500));
    assert!(clocked < report["cycles"].as_u64().unwrap(), "interrupts are not clocked");
    assert_eq!(observed["rays"].as_array().unwrap().len(), 1);
    assert_eq!(place.names(), ["r.json"]);
}

#[test]
fn trace_of_a_log_shows_what_simulate_showed_without_simulating() {
    let place = Place::new();
    let cube = scene("lit-cube");
    let look = ["--account", "--interval", "500", "--pixel", "3,4", "--window", "50..900"];
    let mut flags =
        vec!["--trace", "t.radlog", "--wave", "a.fst", "--perfetto", "a.json", "--report", "r.json"];
    flags.extend(look);
    let plain = place.exits(0, &simulate(&cube, &["--report", "plain.json"])).stdout;
    let text = place.exits(0, &simulate(&cube, &flags)).stdout;
    assert!(text.contains("pixel 3,4 sample 0") && !plain.contains("observed"), "{text}");
    let (watched, unwatched) = (place.json("r.json"), place.json("plain.json"));
    assert_eq!(watched["blocks"], unwatched["blocks"], "watching changes no cycle");
    assert_eq!(unwatched["observed"], Value::Null);

    let mut args = vec!["trace", "t.radlog", "--wave", "b.fst", "--perfetto", "b.json", "--report", "t.json"];
    args.extend(look);
    let text = place.exits(0, &args).stdout;
    assert!(text.contains("t.radlog: board delft-1992 at 25 MHz, primary"), "{text}");
    let bytes = |name: &str| std::fs::read(place.path(name)).unwrap();
    assert_eq!(bytes("a.fst"), bytes("b.fst"));
    assert_eq!(bytes("a.json"), bytes("b.json"));
    let again = place.json("t.json");
    assert_eq!(again["schema"], "radeng/trace/1");
    let (mut live, mut replayed) = (watched["observed"].clone(), again["observed"].clone());
    for (report, files) in [(&mut live, 3), (&mut replayed, 2)] {
        let files_of = report.as_object_mut().unwrap().remove("files").unwrap();
        assert_eq!(files_of.as_array().unwrap().len(), files);
    }
    assert_eq!(live, replayed);
    // With nothing asked for, the account.
    assert!(place.exits(0, &["trace", "t.radlog"]).stdout.contains("  lives "));
}

#[test]
fn flags_of_looking_inside_that_cannot_be_are_refused_and_leave_no_file() {
    let place = Place::new();
    let cube = scene("lit-cube");
    for (flags, expected) in [
        (&["--window", "1..2"][..], "--window has no use without --wave or --perfetto"),
        (&["--force"], "--force has no use without"),
        (&["--wave", "w.fst", "--window", "20..10"], "expected a cycle TO after FROM"),
        (&["--wave", "w.fst", "--window", "-5..10"], "expected cycles FROM..TO"),
        (&["--wave", "w.fst", "--window", "0..2000000"], "expected 1000000 at most, or --force"),
        (
            &["--wave", "w.fst", "--window", "90000000.."],
            "--window begins with cycle 90000000: expected one of",
        ),
        (&["--wave", "w.vcd"], "expected a name that ends in .fst"),
        (&["--trace", "t.log"], "expected a name that ends in .radlog"),
        (&["--trace", "none/t.radlog"], "does not exist"),
        (&["--perfetto", "p.json", "--report", "./p.json"], "named twice"),
        (&["--interval", "0"], "0 is not in 1.."),
        (&["--pixel", "20,0"], "--pixel 20,0: expected a column in 0..=19 and a row in 0..=11"),
        (&["--pixel", "3"], "expected a column and a row, X,Y"),
        (&["--pixel", "3,4", "--workload", "radiosity"], "expected a workload with camera rays"),
        (&["--ray", "99999999", "--trace", "t.radlog"], "--ray 99999999: the board cast 240 rays"),
    ] {
        place.refused(&simulate(&cube, flags), expected);
    }
    std::fs::write(place.path("v.csv"), "vectors,1\n").unwrap();
    place.refused(&["simulate", "--rays", "v.csv", "--account"], "--account has no use without SCENE");
}

#[test]
fn logs_that_are_none_or_cut_or_changed_are_refused_by_name() {
    let place = Place::new();
    let cube = scene("lit-cube");
    place.exits(0, &simulate(&cube, &["--trace", "t.radlog"]));
    let whole = std::fs::read(place.path("t.radlog")).unwrap();
    place.refused(&["trace", "none.radlog"], "none.radlog: ");
    place.refused(&["trace", &cube], "not an event log");
    place.refused(&["trace", "."], ".: ");
    place.refused(&["trace", "t.radlog", "--pixel", "20,0"], "--pixel 20,0: expected a column in 0..=19");
    place.refused(&["trace", "t.radlog", "--report", "t.radlog"], "expected a name that ends in .json");
    std::fs::copy(place.path("t.radlog"), place.path("t.fst")).unwrap();
    place.refused(&["trace", "t.fst", "--wave", "./t.fst"], "replace the input");
    std::fs::write(place.path("cut.radlog"), &whole[..whole.len() / 2]).unwrap();
    place.refused(&["trace", "cut.radlog", "--wave", "w.fst"], "cut.radlog: cut off: ");
    let mut changed = whole;
    let middle = changed.len() / 2;
    changed[middle] ^= 4;
    std::fs::write(place.path("bad.radlog"), &changed).unwrap();
    let stderr = place.exits(2, &["trace", "bad.radlog", "--perfetto", "p.json"]).stderr;
    // The change may make an event that cannot be; if not, the CRC tells.
    assert!(stderr.starts_with("error: bad.radlog: ") && !place.path("p.json").exists(), "{stderr}");
}
