//! What was seen inside a run, for the terminal.
//!
//! ```text
//! ObservedReport --> lines of `simulate`'s summary, or all of `trace`'s
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;

use rtl_model::observe::Kind;
use rtl_model::sim::{Cause, Phase};

use super::observed::{
    IntervalsReport, LifeReport, ObservedReport, Phases, RayReport, StallReport, TraceReport,
};
use super::si::{count, percent, share};
use super::terminal::line;

/// Cycles by kind of the root and what it does.
type RootsByKind = BTreeMap<(Kind, Cause), u64>;

/// Kinds of blocks whose stalls are told on the terminal.
const MOST_STALLS: usize = 4;
/// Roots told of each.
const MOST_ROOTS: usize = 3;
/// Columns of utilisation over time.
const COLUMNS: usize = 60;
/// Rays whose phases are told one by one, and lines and phases a line of each.
const MOST_RAYS: usize = 2;
const SPAN_LINES: usize = 4;
const SPANS_A_LINE: usize = 6;

/// The terminal's section: nothing where nothing was watched.
pub fn observed_lines(out: &mut String, observed: Option<&ObservedReport>) {
    let Some(o) = observed else { return };
    line(
        out,
        "observed",
        format_args!(
            "{} in {} of the clocked board, {}",
            count(o.events, "events"),
            count(o.clocked_cycles, "cycles"),
            count(o.commands as u64, if o.commands == 1 { "command" } else { "commands" })
        ),
    );
    if let Some(lives) = &o.lives {
        life_lines(out, "  lives", "rays", &lives.rays);
        if let Some(cast) = &lives.low_resolution {
            life_lines(out, "", "low-resolution rays", cast);
        }
    }
    if let Some(stalls) = &o.stall_roots {
        stall_lines(out, stalls);
    }
    if let Some(intervals) = &o.intervals {
        interval_lines(out, intervals);
    }
    let tell_spans = o.rays.len() <= MOST_RAYS;
    o.rays.iter().for_each(|ray| ray_lines(out, ray, tell_spans));
    for (i, file) in o.files.iter().enumerate() {
        line(out, if i == 0 { "  files" } else { "" }, file.display());
    }
}

fn life_lines(out: &mut String, label: &str, what: &str, life: &LifeReport) {
    let Some(((shortest, median), longest)) = life.shortest.zip(life.median).zip(life.longest) else {
        return line(out, label, format_args!("no {what}"));
    };
    line(
        out,
        label,
        format_args!(
            "{}, each {shortest} to {longest} cycles on the board, median {median}:",
            count(life.rays, what)
        ),
    );
    line(out, "", phase_text(&life.cycles_by_phase, |n| percent(share(n, life.ray_cycles))));
}

/// Phases in their order, those without cycles left out.
fn phase_text(cycles: &Phases, text: impl Fn(u64) -> String) -> String {
    let of = |phase: &Phase| (phase.name(), cycles.get(phase.name()).copied().unwrap_or(0));
    let all = Phase::LIFE.iter().map(of).filter(|(_, n)| *n > 0);
    all.map(|(name, n)| format!("{name} {}", text(n))).collect::<Vec<_>>().join(", ")
}

fn stall_lines(out: &mut String, stalls: &[StallReport]) {
    let mut by_kind: BTreeMap<Kind, (u64, RootsByKind)> = BTreeMap::new();
    for stall in stalls {
        let (cycles, roots) = by_kind.entry(stall.kind).or_default();
        *cycles += stall.output_full;
        stall.roots.iter().for_each(|root| *roots.entry((root.kind, root.cause)).or_default() += root.cycles);
    }
    let mut kinds: Vec<_> = by_kind.into_iter().collect();
    kinds.sort_by_key(|(_, (cycles, _))| std::cmp::Reverse(*cycles));
    if kinds.is_empty() {
        line(out, "  roots", "no block waited for room at its output");
    }
    for (i, (kind, (cycles, roots))) in kinds.iter().take(MOST_STALLS).enumerate() {
        let mut roots: Vec<_> = roots.iter().collect();
        roots.sort_by_key(|(_, n)| std::cmp::Reverse(**n));
        let told = roots.iter().take(MOST_ROOTS);
        let told = told.map(|((kind, cause), n)| {
            format!("{} {} {}", kind.name(), cause.name(), percent(share(**n, *cycles)))
        });
        line(
            out,
            if i == 0 { "  roots" } else { "" },
            format_args!(
                "{} had no room in {}: {}",
                kind.name(),
                count(*cycles, "block-cycles"),
                told.collect::<Vec<_>>().join(", ")
            ),
        );
    }
}

fn interval_lines(out: &mut String, report: &IntervalsReport) {
    let n = report.intervals.len();
    let a_column = n.div_ceil(COLUMNS).max(1);
    line(
        out,
        "  in time",
        format_args!("work in tenths, a digit for {} cycles:", report.cycles.saturating_mul(a_column as u64)),
    );
    for kind in [Kind::HostLink, Kind::ShellTracker, Kind::Ctu, Kind::PatchLoader, Kind::Icu, Kind::Dram] {
        let mut digits = String::new();
        for column in report.intervals.chunks(a_column) {
            let of_kind = column.iter().filter_map(|interval| interval.kinds.get(&kind));
            let (mut work, mut all) = (0, 0);
            for kind in of_kind {
                work += kind.cycles.get(&Cause::Work).unwrap_or(&0);
                all += kind.cycles.values().sum::<u64>();
            }
            // Tenths of work, 9 for all of it.
            let tenth = (work * 10).checked_div(all).unwrap_or(0).min(9);
            let _ = write!(digits, "{tenth}");
        }
        if report.intervals.iter().any(|interval| interval.kinds.contains_key(&kind)) {
            line(out, "", format_args!("{:<14} {digits}", kind.name()));
        }
    }
}

fn ray_lines(out: &mut String, ray: &RayReport, tell_spans: bool) {
    let who = match ray.pixel.zip(ray.sample) {
        Some(([x, y], sample)) => format!("pixel {x},{y} sample {sample}: "),
        None => String::new(),
    };
    let life = match ray.died {
        Some(died) => format!("cycles {}..{died}, {} in all", ray.born, died - ray.born),
        None => format!("from cycle {} on", ray.born),
    };
    line(
        out,
        "  ray",
        format_args!(
            "{who}number {} of command {}, place {} of bundle {}, slot {} of cluster{}",
            ray.ray, ray.command, ray.index, ray.bundle, ray.slot, ray.cluster
        ),
    );
    line(out, "", format_args!("{life}: {}", phase_text(&ray.cycles_by_phase, |n| n.to_string())));
    if !tell_spans {
        return;
    }
    let spans: Vec<String> = ray.spans.iter().map(|(cycle, phase)| format!("{cycle} {phase}")).collect();
    for told in spans.chunks(SPANS_A_LINE).take(SPAN_LINES) {
        line(out, "", format_args!("  {}", told.join(", ")));
    }
    if let Some(more) = spans.len().checked_sub(SPAN_LINES * SPANS_A_LINE).filter(|more| *more > 0) {
        line(out, "", format_args!("  and {more} more, all of them in --report"));
    }
}

/// What `trace` ends with.
pub fn trace_summary(r: &TraceReport) -> String {
    let mut out = String::new();
    let scene = r.scene.as_ref().map(|scene| format!(", {}", scene.display())).unwrap_or_default();
    line(
        &mut out,
        "log",
        format_args!("{}: board {} at {} MHz, {}{scene}", r.log.display(), r.board, r.clock_mhz, r.workload),
    );
    observed_lines(&mut out, Some(&r.observed));
    super::terminal::time_line(&mut out, &r.timings);
    out
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::report::observed::{IntervalReport, KindReport, LivesReport, RootReport, phases};

    /// Work in i fifths of the ICU's cycles, the rest without room.
    fn interval(i: u64) -> IntervalReport {
        let cycles = BTreeMap::from([(Cause::Work, 20 * i), (Cause::OutputFull, 100 - 20 * i)]);
        let kind = KindReport { work: i as f64 / 5.0, leads: Some(Cause::OutputFull), cycles };
        IntervalReport { from: 100 * i, kinds: BTreeMap::from([(Kind::Icu, kind)]) }
    }

    fn observed() -> ObservedReport {
        let life = LifeReport {
            rays: 2,
            cycles_by_phase: phases(&[10, 20, 0, 30, 0, 0, 40]),
            ray_cycles: 100,
            shortest: Some(45),
            median: Some(45),
            longest: Some(55),
        };
        let root =
            |block: &str, kind, cause, cycles| RootReport { block: block.to_owned(), kind, cause, cycles };
        let stall = StallReport {
            block: "cluster0.module0.ctu0".to_owned(),
            kind: Kind::Ctu,
            output_full: 40,
            roots: vec![
                root("cluster0.module0.icu", Kind::Icu, Cause::Work, 30),
                root("dram", Kind::Dram, Cause::Memory, 10),
            ],
        };
        let ray = RayReport {
            pixel: Some([3, 4]),
            sample: Some(0),
            command: 0,
            ray: 70,
            bundle: 1,
            index: 6,
            cluster: 2,
            slot: 5,
            born: 100,
            died: Some(145),
            cycles_by_phase: phases(&[5, 10, 0, 10, 0, 0, 20]),
            spans: (0..40).map(|i| (100 + i, if i % 2 == 0 { "stepping" } else { "loading" })).collect(),
        };
        ObservedReport {
            events: 1234,
            clocked_cycles: 500,
            commands: 1,
            files: vec![PathBuf::from("t.radlog"), PathBuf::from("w.fst")],
            lives: Some(LivesReport { rays: life, low_resolution: None }),
            stall_roots: Some(vec![stall]),
            intervals: Some(IntervalsReport { cycles: 100, intervals: (0..5).map(interval).collect() }),
            rays: vec![ray],
        }
    }

    #[test]
    fn observed_section_tells_lives_roots_rays_and_files_in_few_lines() {
        let mut out = String::new();
        observed_lines(&mut out, Some(&observed()));
        for expected in [
            "observed   1234 events in 500 cycles of the clocked board, 1 command",
            "2 rays, each 45 to 55 cycles on the board, median 45:",
            "waiting 10.0 %, stepping 20.0 %, loading 30.0 %, returning 40.0 %",
            "ctu had no room in 40 block-cycles: icu work 75.0 %, dram memory 25.0 %",
            "pixel 3,4 sample 0: number 70 of command 0, place 6 of bundle 1, slot 5 of cluster2",
            "cycles 100..145, 45 in all: waiting 5, stepping 10, loading 10, returning 20",
            "100 stepping, 101 loading",
            "and 16 more",
            "a digit for 100 cycles:",
            "icu            02468",
            "  files    t.radlog",
        ] {
            assert!(out.contains(expected), "{expected} is not in\n{out}");
        }
        assert!(out.lines().count() <= 17 && out.lines().all(|l| l.len() <= 120), "{out}");
        let mut nothing = String::new();
        observed_lines(&mut nothing, None);
        assert!(nothing.is_empty());
    }

    #[test]
    fn observed_report_in_json_names_phases_causes_and_kinds() {
        let json = serde_json::to_value(observed()).unwrap();
        assert_eq!(json["lives"]["cycles_by_phase"]["returning"], 40);
        assert_eq!(json["lives"]["cycles_by_phase"].as_object().unwrap().len(), 7);
        assert_eq!(json["stall_roots"][0]["roots"][1]["cause"], "memory");
        assert_eq!(json["stall_roots"][0]["kind"], "ctu");
        assert_eq!(json["intervals"]["intervals"][1]["kinds"]["icu"]["cycles"]["output_full"], 80);
        assert_eq!(json["rays"][0]["spans"][1], serde_json::json!([101, "loading"]));
    }
}
