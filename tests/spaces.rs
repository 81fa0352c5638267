//! The shipped design spaces: they load, their candidates can be built, and building them is fast.

use std::path::{Path, PathBuf};
use std::time::Instant;

use radiosity_engine::explore::space::Space;
use radiosity_engine::explore::value::Value;
use rtl_model::cost::Cost;
use rtl_model::spec::{BoardSpec, Partition, Scheduling};

/// The files of all shipped spaces.
fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/spaces");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    assert!(files.len() >= 8);
    files
}

fn space(name: &str) -> Space {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/spaces").join(name);
    Space::load(&file).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn shipped_spaces_load_say_their_question_first_and_have_candidates() {
    for file in shipped() {
        let space = Space::load(&file).unwrap_or_else(|e| panic!("{e}"));
        let first = space.text.lines().next().unwrap();
        assert!(first.starts_with("# ") && first.ends_with('?'), "{}: {first}", file.display());
        let impossible = space.impossible(0..space.n_combinations());
        let n = impossible.n_asked - impossible.list.len() as u64;
        println!("{}: {n} candidates of {}; {:?}", space.name, impossible.n_asked, impossible.by_reason);
        assert!(n >= 10, "{}", file.display());
    }
}

#[test]
fn pipeline_depth_has_30_to_60_candidates_with_dram_and_host_in_nanoseconds() {
    let space = space("pipeline-depth.toml");
    assert!((30..=60).contains(&space.n_combinations()));
    for ordinal in 0..space.n_combinations() {
        let candidate = space.candidate(ordinal).unwrap_or_else(|e| panic!("{e:?}"));
        let (spec, mhz) = (&candidate.spec, candidate.cost.max_clock_mhz);
        assert_eq!(Value::Integer(spec.icu.depth.into()), space.values(&candidate.choice)[0]);
        assert_eq!(spec.clock_mhz, mhz);
        assert_eq!(spec.dram.row_miss_cycles, (240.0 * mhz / 1000.0).ceil() as u32);
        assert_eq!(spec.bus.interrupt_cycles, (20.0 * mhz).ceil() as u64);
    }
}

#[test]
fn ten_thousand_candidates_are_built_in_about_a_second() {
    let space = space("timing-10k.toml");
    assert_eq!(space.n_combinations(), 10_000);
    let start = Instant::now();
    let built = (0..10_000).filter(|o| space.candidate(*o).is_ok()).count();
    let seconds = start.elapsed().as_secs_f64();
    println!("{built} candidates in {seconds:.2} s");
    assert_eq!(built, 10_000);
    // On a busy machine.
    assert!(seconds < 5.0, "{seconds} s");
}

/// A space with these top-level keys and sections, on the smallest scene.
fn parsed(head: &str, sections: &str) -> Space {
    let text = format!(
        "version = 1\n{head}\n{sections}\n[[workload]]\nscene = \"scenes/lit-cube/scene.toml\"\n\
         [objectives]\nminimise = [\"cycles\"]\n"
    );
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("test.toml");
    Space::parse(&text, &file).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn candidates_equal_boards_made_field_by_field() {
    let space = parsed(
        "clock = \"derived\"",
        r#"
[axes]
"icu.depth" = [3, 22]
bits = [16, 24]
partition = ["grid", "shells"]
grid_log2 = ["auto", 4]
[set]
"fifos.icu_reducer" = "fifos.ctu_icu + 1"
"fifos.ctu_icu" = 'if(partition == "grid", 8, 2 * icu.depth)'
"formats.t_frac_bits" = "bits"
"formats.cross_keep_bits" = "2 * bits"
scheduling = "static"
"dram.row_hit_cycles" = "ceil(dram.row_miss_cycles / 3)"
"dram.row_miss_cycles" = "ceil(240 * clock_mhz / 1000)"
"#,
    );
    assert_eq!(space.n_combinations(), 16);
    for ordinal in 0..16 {
        let [icu, bits, shells, grid] = [3, 2, 1, 0].map(|place| (ordinal >> place & 1) as usize);
        let mut spec = BoardSpec::preset("delft-1992").unwrap();
        spec.icu.depth = [3, 22][icu];
        spec.formats.t_frac_bits = [16, 24][bits];
        spec.formats.cross_keep_bits = Some(2 * spec.formats.t_frac_bits);
        spec.partition = [Partition::Grid, Partition::Shells][shells];
        spec.grid_log2 = [None, Some(4)][grid];
        spec.fifos.ctu_icu = if shells == 0 { 8 } else { 2 * spec.icu.depth };
        spec.fifos.icu_reducer = spec.fifos.ctu_icu + 1;
        spec.scheduling = Scheduling::Static;
        let cost = Cost::of(&spec, space.technology);
        spec.clock_mhz = cost.max_clock_mhz;
        spec.dram.row_miss_cycles = (240.0 * cost.max_clock_mhz / 1000.0).ceil() as u32;
        spec.dram.row_hit_cycles = spec.dram.row_miss_cycles.div_ceil(3);
        let candidate = space.candidate(ordinal).unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(candidate.spec, spec, "{}", space.in_words(ordinal));
        assert_eq!(candidate.cost, cost);
    }
}

#[test]
fn clock_of_the_board_is_a_parameter_like_others_and_may_follow_the_cost() {
    let axis = parsed("", "[axes]\nclock_mhz = [20, 25, 50]\n[set]\n\"fifos.results\" = \"2 * clock_mhz\"");
    let results: Vec<u32> = (0..3).map(|o| axis.candidate(o).unwrap().spec.fifos.results).collect();
    assert_eq!(results, [40, 50, 100]);
    let half = parsed("", "[axes]\n\"icu.depth\" = [3, 22]\n[set]\nclock_mhz = \"max_clock_mhz / 2\"");
    for ordinal in 0..2 {
        let candidate = half.candidate(ordinal).unwrap();
        assert_eq!(candidate.spec.clock_mhz, candidate.cost.max_clock_mhz / 2.0);
    }
    let fast_enough = parsed(
        "",
        "[axes]\nclock_mhz = [1, 1000]\n\
         [[constraint]]\nrequire = \"clock_mhz <= max_clock_mhz\"\nreason = \"it must work\"",
    );
    assert!(fast_enough.candidate(0).is_ok());
    let refused = fast_enough.candidate(1).unwrap_err();
    assert_eq!(refused.reason, "constraint clock_mhz <= max_clock_mhz (it must work)");
}

#[test]
fn ranges_hold_what_they_say() {
    let values = |range: &str| {
        let space = parsed("", &format!("[axes]\nx = {range}\n[[constraint]]\nrequire = \"x > -1e9\""));
        space.axes[0].values.iter().map(Value::to_string).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(values("{ from = 4, to = 7 }"), "4 5 6 7");
    assert_eq!(values("{ from = 4, to = 14, step = 4 }"), "4 8 12");
    assert_eq!(values("{ from = -1, to = 1, step = 0.5 }"), "-1 -0.5 0 0.5 1");
    assert_eq!(values("{ from = 0.1, to = 0.6, step = 0.1 }"), "0.1 0.2 0.3 0.4 0.5 0.6");
    assert_eq!(values("{ from = 1, to = 16, scale = \"powers-of-two\" }"), "1 2 4 8 16");
    assert_eq!(values("{ from = 8, to = 8, scale = \"linear\" }"), "8");
}

#[test]
fn base_may_be_a_board_file_beside_the_space() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mine.toml"), "name = \"mine\"\n[icu]\ndepth = 7\n").unwrap();
    std::fs::create_dir(folder.path().join("spaces")).unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/lit-cube/scene.toml");
    let text = format!(
        "version = 1\nbase = \"../mine.toml\"\n[axes]\n\"ctu.contexts\" = [4, 8]\n\
         [[workload]]\nscene = {scene:?}\n[objectives]\nminimise = [\"cycles\"]\n"
    );
    let file = folder.path().join("spaces/s.toml");
    let space = Space::parse(&text, &file).unwrap_or_else(|e| panic!("{e}"));
    let spec = space.candidate(1).unwrap().spec;
    assert_eq!((spec.name.as_str(), spec.icu.depth, spec.ctu.contexts), ("mine", 7, 8));

    std::fs::write(folder.path().join("mine.toml"), "[icu]\ndepth = 0\n").unwrap();
    let refused = Space::parse(&text, &file).unwrap_err().to_string();
    assert!(refused.contains("s.toml:2:8") && refused.contains("icu.depth = 0: expected 1"), "{refused}");
}

#[test]
fn readme_of_the_spaces_names_every_metric_and_every_shipped_space() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/spaces");
    let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
    for metric in radiosity_engine::explore::metric::METRICS {
        assert!(readme.contains(&format!("| `{}` |", metric.name)), "{}", metric.name);
    }
    for file in shipped() {
        let space = Space::load(&file).unwrap();
        let row = format!("[{}]({}.toml) | {} |", space.name, space.name, space.question);
        assert!(readme.contains(&row), "{row}");
    }
    // The file that it shows is a good one.
    let shown = readme.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    Space::parse(shown, &folder.join("shown.toml")).unwrap_or_else(|e| panic!("{e}"));
}
