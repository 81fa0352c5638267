//! The files as a whole: read back, compared, and looked at by other programs.

use std::collections::BTreeMap;
use std::process::Command;

use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::record::Field;

use super::*;

/// Writes a sweep's files into a folder; gives the terminal's text and the names of the files.
fn written(results: &Results, folder: &Path) -> (String, Vec<String>) {
    let mut files = OutputFiles::new();
    let text = write(results, folder, &mut files).unwrap();
    files.commit().unwrap();
    let mut names: Vec<String> = Vec::new();
    for inside in ["", "charts"] {
        for entry in std::fs::read_dir(folder.join(inside)).unwrap() {
            let entry = entry.unwrap();
            if entry.path().is_file() {
                names.push(Path::new(inside).join(entry.file_name()).display().to_string());
            }
        }
    }
    names.sort();
    (text, names)
}

/// Some rows of every kind, few enough for slow readers.
fn some() -> Results {
    let mut results = synthetic::large();
    results.rows.retain(|row| row.ordinal < 400);
    results.impossible.retain(|i| i.ordinal < 400);
    results
}

#[test]
fn write_stages_every_file_and_the_same_results_give_the_same_bytes() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let results = some();
    let names = folders.each_ref().map(|f| written(&results, f.path()).1);
    let expected = [
        "charts/against-clusters.ctus_per_icu.png",
        "charts/against-clusters.ctus_per_icu.svg",
        "charts/against-ctu.contexts.png",
        "charts/against-ctu.contexts.svg",
        "charts/against-patch_cache.bytes.png",
        "charts/against-patch_cache.bytes.svg",
        "charts/pareto-power_w-area_mm2.png",
        "charts/pareto-power_w-area_mm2.svg",
        "charts/pareto-seconds-area_mm2.png",
        "charts/pareto-seconds-area_mm2.svg",
        "charts/pareto-seconds-power_w.png",
        "charts/pareto-seconds-power_w.svg",
        "charts/sensitivity.png",
        "charts/sensitivity.svg",
        "charts/stalls.png",
        "charts/stalls.svg",
        "impossible.csv",
        "page.html",
        "results-columns.csv",
        "results.csv",
        "results.parquet",
    ];
    assert_eq!(names[0], expected);
    for name in &names[0] {
        let [a, b] = folders.each_ref().map(|f| std::fs::read(f.path().join(name)).unwrap());
        assert!(!a.is_empty() && a == b, "{name}");
    }
}

#[test]
fn write_of_no_rows_and_of_rows_without_numbers_makes_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let empty = synthetic::bare(&[("a", 3)], &["seconds"]);
    let (text, names) = written(&empty, folder.path());
    assert!(
        text.contains("0 of 3 combinations") && names.iter().all(|n| !n.starts_with("charts/")),
        "{names:?}"
    );
    let mut failed = empty.clone();
    failed.rows.push(Row {
        status: Status::Failed("no".to_owned()),
        metrics: vec![None],
        ..synthetic::bare_row(0, vec![Value::Integer(0)], &[])
    });
    written(&failed, folder.path());
}

#[test]
fn parquet_read_back_has_every_value_typed_and_the_units() {
    let results = some();
    let columns = columns::columns(&results, &Front::of(&results));
    let bytes = parquet_file::bytes(&results, &columns).unwrap();
    let mut file = tempfile::tempfile().unwrap();
    std::io::Write::write_all(&mut file, &bytes).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    assert_eq!(reader.metadata().file_metadata().num_rows(), results.rows.len() as i64);
    let meta = reader.metadata().file_metadata().key_value_metadata().unwrap();
    let of = |key: &str| -> serde_json::Value {
        let value = meta.iter().find(|kv| kv.key == key).and_then(|kv| kv.value.clone()).unwrap();
        serde_json::from_str(&value).unwrap()
    };
    assert_eq!(of("radeng")["question"], results.question.as_str());
    assert_eq!(of("columns")["seconds"]["unit"], "s");
    assert_eq!(of("columns")["stall_icu_cache_miss"]["unit"], "cycles");
    assert_eq!(of("columns")["icu.depth"]["unit"], "cycles");
    assert_eq!(of("columns")["board.bus.clock_mhz"]["unit"], "MHz");
    let n = columns.len();
    for (row, read) in results.rows.iter().zip(reader.get_row_iter(None).unwrap()) {
        let read: BTreeMap<String, Field> = read.unwrap().into_columns().into_iter().collect();
        assert_eq!(read.len(), n, "names differ");
        assert_eq!(read["point"], Field::Long(row.ordinal as i64));
        assert_eq!(read["icu.depth"], Field::Long(row.values[0].number().unwrap() as i64));
        assert_eq!(read["partition"], Field::Str(row.values[4].to_string()));
        assert_eq!(read["board.icu.depth"], read["icu.depth"]);
        for (metric, value) in results.metrics.iter().zip(&row.metrics) {
            let expected = value.map_or(Field::Null, Field::Double);
            assert_eq!(read[&metric.name], expected, "{}", metric.name);
        }
        assert_eq!(read["board"], Field::Str(row.board.clone()));
        let work = row.stalls.first().map_or(Field::Null, |s| Field::Long(s.cycles[0] as i64));
        assert_eq!(read["stall_icu_work"], work);
        let tests = row.counters.get(1).map_or(Field::Null, |n| Field::Long(*n as i64));
        assert_eq!(read["counter_tests"], tests);
        match &row.status {
            Status::Failed(what) => assert_eq!(read["error"], Field::Str(what.clone())),
            _ => assert_eq!(read["error"], Field::Null),
        }
    }
}

#[test]
fn columns_of_one_name_are_told_apart_and_types_fit_all_values() {
    let mut results = synthetic::bare(&[("seconds", 2), ("mixed", 2), ("point", 1)], &["seconds"]);
    let values = |v: Value| vec![Value::Integer(1), v, Value::Bool(true)];
    results.rows.push(synthetic::bare_row(0, values(Value::Integer(1)), &[1.0]));
    results.rows.push(synthetic::bare_row(1, values(Value::Float(0.5)), &[2.0]));
    let front = Front::of(&results);
    let kinds = |results: &Results| -> BTreeMap<String, &'static str> {
        let columns = columns::columns(results, &front);
        let kinds: BTreeMap<String, &'static str> =
            columns.iter().map(|c| (c.name.clone(), c.cells.kind())).collect();
        assert_eq!(kinds.len(), columns.len());
        kinds
    };
    let of = kinds(&results);
    assert_eq!(
        (of["axis.seconds"], of["seconds"], of["mixed"], of["point_"]),
        ("integer", "float", "float", "boolean")
    );
    results.rows[1].values[1] = Value::Text("x".to_owned());
    assert_eq!(kinds(&results)["mixed"], "text");
}

#[test]
fn csv_quotes_texts_keeps_all_digits_and_lists_the_impossible() {
    let mut results = synthetic::bare(&[("a", 2), ("b, \"c\"", 3)], &["seconds"]);
    let values = vec![Value::Integer(1), Value::Text("x\ny".to_owned())];
    results.rows.push(synthetic::bare_row(3, values, &[0.1 + 0.2]));
    results.impossible.push(Impossible { ordinal: 5, reason: "no, \"never\"".to_owned() });
    let columns = columns::columns(&results, &Front::of(&results));
    let text = csv::rows(&columns, 1);
    assert!(
        text.starts_with("point,status,error,a,\"b, \"\"c\"\"\",seconds,half_width_cycles,on_front,"),
        "{text}"
    );
    assert!(text.contains("\n3,simulated,,1,\"x\ny\",0.30000000000000004,,"), "{text}");
    assert_eq!(csv::impossible(&results), "point,a,\"b, \"\"c\"\"\",reason\n5,1,2,\"no, \"\"never\"\"\"\n");
    assert!(csv::meanings(&columns).contains("\nseconds,float,s,cycles at the candidate's clock\n"));
}

#[test]
fn page_holds_its_data_whole_whatever_the_texts_hold() {
    let mut results = some();
    results.question = "Is </script><b> & \"x\" {{scripts}} safe?".to_owned();
    let front = Front::of(&results);
    let page = page::page(&results, &front, &curve::curves(&results, &front), &sensitivity(&results));
    assert!(page.contains("<title>Is &lt;/script>&lt;b> &amp; "), "the title is escaped");
    let (_, rest) = page.split_once("<script type=\"application/json\" id=\"data\">").unwrap();
    let (json, _) = rest.split_once("</script>").unwrap();
    let data: serde_json::Value = serde_json::from_str(json).unwrap();
    assert_eq!(data["question"], results.question.as_str());
    assert_eq!(data["rows"]["point"].as_array().unwrap().len(), results.rows.len());
    // A board is the base with its own lines; a command its prefix, middle and suffix.
    let base: Vec<&str> = results.base.lines().collect();
    for (i, row) in results.rows.iter().enumerate() {
        let mut lines = base.clone();
        for change in data["rows"]["board"][i].as_array().expect("lines that differ") {
            lines[change[0].as_u64().unwrap() as usize] = change[1].as_str().unwrap();
        }
        assert_eq!(lines, row.board.lines().collect::<Vec<_>>());
        let command = &data["rows"]["command"];
        let middle = command[2][i].as_str().unwrap();
        assert_eq!(
            format!("{}{middle}{}", command[0].as_str().unwrap(), command[1].as_str().unwrap()),
            row.command
        );
    }
    // Nothing is fetched.
    let outside = page.replace("http://www.w3.org/2000/svg", "");
    for word in ["http://", "https://", "src=", "@import", "url("] {
        assert!(!outside.contains(word), "{word}");
    }
}

/// DuckDB, where Python has it (`pip install duckdb`), reads the Parquet file and the CSV file, and they agree.
#[test]
fn duckdb_reads_parquet_and_csv_and_finds_the_same_front() {
    let has =
        Command::new("python3").args(["-c", "import duckdb"]).output().is_ok_and(|o| o.status.success());
    if !has {
        eprintln!("SKIPPED: python3 has no duckdb (pip install duckdb)");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let results = some();
    written(&results, folder.path());
    let front = Front::of(&results);
    let code = r#"
import duckdb, json, sys
out = {}
for name in ["results.parquet", "results.csv"]:
    q = lambda sql: duckdb.sql(sql.replace("T", f"'{sys.argv[1]}/{name}'")).fetchall()
    out[name] = [
        q("select count(*), sum(cycles)::double, sum(counter_tests)::double, min(seconds) from T"),
        q("select point from T where on_front order by point"),
        q("select \"icu.depth\", avg(area_mm2) from T where status = 'simulated' group by 1 order by 1"),
        q("select length(board), error from T where status = 'failed' order by point"),
    ]
print(json.dumps(out))
"#;
    let output = Command::new("python3").args(["-c", code]).arg(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["results.parquet"], found["results.csv"]);
    let parquet = &found["results.parquet"];
    assert_eq!(parquet[0][0][0], results.rows.len());
    let tests: u64 = results.rows.iter().filter_map(|r| r.counters.get(1)).sum();
    assert_eq!(parquet[0][0][2].as_f64(), Some(tests as f64));
    let mut points: Vec<u64> = front.members.iter().map(|m| results.rows[*m].ordinal).collect();
    points.sort_unstable();
    let read: Vec<u64> = parquet[1].as_array().unwrap().iter().map(|p| p[0].as_u64().unwrap()).collect();
    assert_eq!(read, points);
    assert!(parquet[3].as_array().unwrap().iter().all(|r| r[1].as_str().unwrap().contains("<watchdog>")));
}

/// Opens a page in headless Chromium by `page/check.mjs`, where it and Node are.
fn used_in_a_browser(results: &Results) {
    let browser = std::env::var("CHROMIUM").unwrap_or_else(|_| "chromium".to_owned());
    let there = |name: &str| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    if !there("node") || !there(&browser) {
        eprintln!("SKIPPED: no node, or no {browser} (CHROMIUM names another)");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    written(results, folder.path());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/explore/results/page/check.mjs");
    let output = Command::new("node").arg(script).arg(folder.path().join("page.html")).output().unwrap();
    let [out, err] = [&output.stdout, &output.stderr].map(|t| String::from_utf8_lossy(t).into_owned());
    assert!(output.status.success(), "{out}{err}");
    eprintln!("{out}");
}

#[test]
fn page_of_30_rows_sorts_filters_hovers_picks_and_copies_in_a_browser() {
    used_in_a_browser(&synthetic::depths());
}

/// `cargo test --release --lib page_of_10000 -- --ignored`.
#[test]
#[ignore = "some ten seconds"]
fn page_of_10000_rows_sorts_filters_hovers_picks_and_copies_in_a_browser() {
    used_in_a_browser(&synthetic::large());
}

/// Sweeps to look at: `RESULTS=/tmp/x cargo test --release --lib results_to_look_at -- --ignored`.
#[test]
#[ignore = "writes files to look at"]
fn results_to_look_at() {
    let folder = std::env::var("RESULTS").expect("RESULTS: a folder");
    for (name, results) in [("30", synthetic::depths()), ("some", some()), ("10000", synthetic::large())] {
        let start = std::time::Instant::now();
        let (text, _) = written(&results, &Path::new(&folder).join(name));
        println!("{text}\n{name}: {:.2} s", start.elapsed().as_secs_f64());
    }
}
