//! Slices parsed back against the trace event format.

use std::collections::{BTreeMap, HashMap};

use serde::Deserialize;

use super::super::tests::{put_in_place, seen, spec, watch};
use super::super::{Choice, WatchOptions};
use super::*;
use rtl_model::observe::Intervals;
use rtl_model::spec::Partition;

/// The format's required fields.
#[derive(Debug, Deserialize)]
struct TraceFile {
    #[serde(rename = "displayTimeUnit")]
    display_time_unit: String,
    #[serde(rename = "traceEvents")]
    events: Vec<TraceEvent>,
}

#[derive(Debug, Deserialize)]
struct TraceEvent {
    ph: String,
    name: String,
    pid: u32,
    tid: u32,
    ts: f64,
    dur: Option<f64>,
    args: HashMap<String, serde_json::Value>,
}

impl TraceEvent {
    fn cycle(&self, key: &str) -> u64 {
        self.args[key].as_u64().unwrap()
    }
}

/// A run's slices: 25 MHz, a cycle is 0.04 microseconds.
fn slices(options: WatchOptions, partition: Partition) -> (TraceFile, super::super::Observed) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.json");
    let mut spec = spec(partition);
    spec.clock_mhz = 25.0;
    let (observed, files) = watch(&spec, WatchOptions { slices: Some(path.clone()), ..options }).unwrap();
    put_in_place(files);
    (serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap(), observed)
}

/// Slices of a thread lie beside or within each other.
fn assert_nested(file: &TraceFile) {
    let mut threads: BTreeMap<(u32, u32), Vec<(u64, u64)>> = BTreeMap::new();
    for event in file.events.iter().filter(|event| event.ph == "X") {
        let picoseconds = |us: f64| (us * 1e6).round() as u64;
        let (from, length) = (picoseconds(event.ts), picoseconds(event.dur.unwrap()));
        assert!(length > 0, "{event:?}");
        threads.entry((event.pid, event.tid)).or_default().push((from, from + length));
    }
    for (thread, mut slices) in threads {
        // Outer ones first.
        slices.sort_by_key(|(from, to)| (*from, std::cmp::Reverse(*to)));
        let mut open: Vec<u64> = Vec::new();
        for (from, to) in slices {
            open.retain(|end| *end > from);
            assert!(open.iter().all(|end| to <= *end), "a slice {from}..{to} of {thread:?} sticks out");
            open.push(to);
        }
    }
}

#[test]
fn slices_parse_as_trace_events_nest_and_have_named_threads() {
    for partition in [Partition::Grid, Partition::ShellsStatic] {
        let choice = Choice { rays: vec![0, 100], pixels: vec![[5, 5]] };
        let (file, observed) = slices(WatchOptions { rays: choice, ..Default::default() }, partition);
        assert_eq!(file.display_time_unit, "ns");
        assert_nested(&file);
        let named = |event: &TraceEvent, what: &str| event.ph == "M" && event.name == what;
        for event in file.events.iter().filter(|event| event.ph == "X") {
            let process = file.events.iter().any(|m| named(m, "process_name") && m.pid == event.pid);
            let thread = |m: &TraceEvent| named(m, "thread_name") && (m.pid, m.tid) == (event.pid, event.tid);
            assert!(process && file.events.iter().any(thread), "{event:?}");
            let us = event.cycle("from") as f64 * 0.04;
            assert!((event.ts - us).abs() < 1e-9, "{event:?}");
            let length = (event.cycle("to") - event.cycle("from")) as f64 * 0.04;
            assert!((event.dur.unwrap() - length).abs() < 1e-9, "{event:?}");
        }
        assert!(file.events.iter().all(|event| matches!(event.ph.as_str(), "X" | "M")));
        let n = |start: &str| file.events.iter().filter(|e| e.ph == "X" && e.name.starts_with(start)).count();
        // One chunk of rays, six tiles.
        assert_eq!((n("command "), n("bundle ")), (2, 7));
        assert_eq!(n("cast ") > 0, partition == Partition::ShellsStatic);
        assert_eq!(n("ray "), 3);
        // Each ray's phases fill its life.
        for (thread, ray) in (1..).zip(&observed.chosen) {
            let life = ray.life.as_ref().unwrap();
            let mine = || file.events.iter().filter(|e| e.ph == "X" && (e.pid, e.tid) == (RAYS, thread));
            let phases = mine().filter(|e| !e.name.starts_with("ray "));
            let cycles: u64 = phases.map(|e| e.cycle("to") - e.cycle("from")).sum();
            assert_eq!(cycles, life.died.unwrap() - life.born);
        }
    }
}

#[test]
fn slices_of_stalls_last_as_long_as_the_account_says() {
    let (places, seen, _) = seen(&spec(Partition::Grid));
    let mut intervals = Intervals::new(&places, u64::MAX, 1);
    seen.iter().for_each(|(now, seen)| intervals.see(*now, seen).unwrap());
    let (file, _) = slices(WatchOptions::default(), Partition::Grid);
    let mut n_stalls = 0;
    for (number, (block, account)) in (0..).zip(places.blocks.iter().zip(intervals.account())) {
        for cause in Cause::ALL.into_iter().filter(|cause| is_stall(*cause)) {
            let of = |e: &&TraceEvent| e.ph == "X" && e.tid == BLOCKS + number && e.name == cause.name();
            let cycles: u64 = file.events.iter().filter(of).map(|e| e.cycle("to") - e.cycle("from")).sum();
            assert_eq!(cycles, account[cause as usize], "{}: {}", block.name, cause.name());
            n_stalls += cycles;
        }
    }
    assert!(n_stalls > 1000);
}

#[test]
fn slices_are_clipped_to_the_window_and_counted() {
    let window = "500..700".parse().unwrap();
    let (file, _) = slices(WatchOptions { window, ..Default::default() }, Partition::Grid);
    assert_nested(&file);
    let times = file.events.iter().filter(|event| event.ph == "X").map(|e| (e.ts, e.ts + e.dur.unwrap()));
    let times: Vec<_> = times.collect();
    assert!(times.len() > 3);
    assert!(times.iter().all(|(from, to)| *from >= 20.0 - 1e-9 && *to <= 28.0 + 1e-9), "{times:?}");

    let (places, ..) = seen(&spec(Partition::Grid));
    let mut slices = Slices::new(Vec::new(), &places, "test", 25.0, Window::default(), false).unwrap();
    slices.n_slices = MAX_SLICES - 1;
    slices.slice(1, 1, "last", 0, 1, "").unwrap();
    let e = slices.slice(1, 1, "one more", 1, 2, "").unwrap_err().to_string();
    assert!(e.starts_with("over 1000000 slices by cycle 2") && e.contains("--force"), "{e}");
}

#[test]
fn microseconds_of_picoseconds_are_exact() {
    assert_eq!(microseconds(40_000), "0.040000");
    assert_eq!(microseconds(12_345_678_901), "12345.678901");
}
