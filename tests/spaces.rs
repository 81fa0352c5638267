//! The shipped design spaces: they load, their candidates can be built, and building them is fast.

use std::path::{Path, PathBuf};
use std::time::Instant;

use radiosity_engine::explore::space::Space;
use radiosity_engine::explore::value::Value;

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
