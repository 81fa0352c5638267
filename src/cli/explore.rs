//! `radeng explore`: a sweep of a design space, or one of its candidates.
//!
//! ```text
//! ExploreArgs --> Space, run::Options --explore::run--> Explored --results::write--> files, summary
//! ```

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::args::{ExploreArgs, StrategyArg};
use super::interrupt::Interrupt;
use super::{CliError, Outcome, plan};
use crate::explore::evaluate::{Counted, Extent, WorkloadSetup, values};
use crate::explore::metric::METRICS;
use crate::explore::run::{self, Checked, Explored, Options};
use crate::explore::space::{Space, Strategy};
use crate::explore::sweep::{Limits, Tally};
use crate::explore::{results, strategy};
use crate::image::OutputFiles;
use crate::report::si::count;

/// Rungs of successive halving, and the share that goes on, where the space does not say.
const RUNGS: u32 = 3;
const KEEP: f64 = 0.25;
/// Candidates of a generation, where the space does not say.
const POPULATION: u32 = 32;

pub(super) fn run(args: &ExploreArgs) -> Result<Outcome, CliError> {
    let mut space = Space::load(&args.space)?;
    if let Some(ordinal) = args.point {
        return point(args, &space, ordinal);
    }
    search(args, &mut space)?;
    let folder = args.output.clone().unwrap_or_default();
    // Flag and key are over 0; what is longer than a duration can be is no limit.
    let time = space.search.minutes.map(|m| Duration::try_from_secs_f64(m * 60.0).unwrap_or(Duration::MAX));
    let options = Options {
        folder: folder.clone(),
        resume: args.resume,
        shard: args.shard,
        merge: args.merge.clone(),
        limits: Limits { time, sample: args.sample, prune: args.prune },
        check: args.check,
    };
    let mut interrupt = Interrupt::default();
    let stop = interrupt.flag().clone();
    let bar = Bar::new(&space);
    let explored = run::run(&space, &options, &stop, &mut |tally| bar.show(tally))?;
    bar.finish();
    let mut outcome = Outcome::default();
    outcome.warnings.extend(explored.warnings.iter().cloned());
    outcome.warnings.extend(interrupt.warning());
    if explored.stopped {
        outcome.stopped = true;
        outcome.text = stopped_text(args, &explored);
        return Ok(outcome);
    }
    let mut files = OutputFiles::new();
    if let Some(results) = &explored.results {
        outcome.text = results::write(results, &folder, &mut files)?;
        files.commit()?;
    } else if let Some(shard) = args.shard {
        outcome.text = format!(
            "shard {shard}: {}\nwhen all are done: radeng explore {} -o DIR --merge SHARDS...\n",
            done_text(&explored.tally),
            args.space.display()
        );
    }
    if let Some(checked) = &explored.checked {
        outcome.text += &checked_text(checked);
        outcome.check_failed = !checked.faults.is_empty();
    }
    Ok(outcome)
}

/// What was typed goes before what the space says.
fn search(args: &ExploreArgs, space: &mut Space) -> Result<(), CliError> {
    let search = &mut space.search;
    if let Some(strategy) = args.strategy {
        search.strategy = match (strategy, search.strategy) {
            (StrategyArg::Grid, _) => Strategy::Grid,
            (StrategyArg::Random, _) => Strategy::Random,
            (StrategyArg::Sobol, _) => Strategy::Sobol,
            (StrategyArg::Halving, same @ Strategy::Halving { .. }) => same,
            (StrategyArg::Halving, _) => Strategy::Halving { rungs: RUNGS, keep: KEEP },
            (StrategyArg::Nsga2, same @ Strategy::Nsga2 { .. }) => same,
            (StrategyArg::Nsga2, _) => Strategy::Nsga2 { population: POPULATION },
        };
        if strategy == StrategyArg::Grid {
            search.points = None;
        }
    }
    if let Some(points) = args.points {
        search.points = Some(u64::from(points));
    }
    if search.strategy == Strategy::Grid
        && let Some(points) = search.points
    {
        return Err(CliError::Usage(format!(
            "--points {points}: expected --strategy random, sobol, halving or nsga2 beside it: a grid has all combinations"
        )));
    }
    search.seed = args.seed.unwrap_or(search.seed);
    search.minutes = args.minutes.or(search.minutes);
    // What cannot be planned is told before a folder is made.
    strategy::plan(space)
        .map(drop)
        .map_err(|what| CliError::Usage(format!("{}: {what}", args.space.display())))
}

fn done_text(tally: &Tally) -> String {
    let Tally { evaluated, found, failed, pruned, impossible } = *tally;
    let mut text = format!("{evaluated} evaluated");
    for (n, what) in
        [(found, "found in the store"), (pruned, "pruned"), (impossible, "impossible"), (failed, "failed")]
    {
        if n > 0 {
            text += &format!(", {n} {what}");
        }
    }
    text
}

fn stopped_text(args: &ExploreArgs, explored: &Explored) -> String {
    let of = explored.planned.map_or(String::new(), |n| format!(" of {n}"));
    format!(
        "stopped: {}{of}\ngo on      the same command with --resume{}\n",
        done_text(&explored.tally),
        if args.resume { "" } else { " added" }
    )
}

fn checked_text(checked: &Checked) -> String {
    let Checked { n, runs, pruned, faults } = checked;
    let pruned = if *pruned > 0 {
        format!(" ({pruned} of them pruned: bounds hold, all dominated)")
    } else {
        String::new()
    };
    match faults.split_first() {
        None => format!(
            "check      {n} candidates in full, {runs} runs{pruned}: every counter of every block equal\n"
        ),
        Some((first, rest)) => {
            format!("check      {n} candidates in full: {} differ; {first}\n", rest.len() + 1)
        }
    }
}

/// One candidate, every ray traced.
fn point(args: &ExploreArgs, space: &Space, ordinal: u64) -> Result<Outcome, CliError> {
    let n = space.n_combinations();
    if ordinal >= n {
        return Err(CliError::Usage(format!("--point {ordinal}: expected an ordinal under {n}")));
    }
    if let Some(path) = &args.save_board {
        plan::check_outputs([], &[(Some(path.as_path()), "toml")], &[Some(args.space.as_path())])?;
    }
    let candidate = space.candidate(ordinal).map_err(|impossible| {
        CliError::Usage(format!("--point {ordinal} cannot be built: {}", impossible.reason))
    })?;
    let mut text = format!("point      {ordinal} of {}\n", args.space.display());
    for (axis, place) in space.axes.iter().zip(&candidate.choice) {
        text += &format!("           {} = {}\n", axis.name, axis.values[*place]);
    }
    let mut counted = Vec::new();
    for workload in &space.workloads {
        let statistics = WorkloadSetup::new(workload)
            .simulate(&candidate.spec, Extent::Whole)
            .map_err(|what| CliError::Usage(format!("workload {}: {what}", workload.name)))?;
        text += &format!("workload   {}: {}\n", workload.name, count(statistics.cycles, "cycles"));
        counted.push(Counted::whole(statistics));
    }
    for (metric, value) in METRICS.iter().zip(values(&candidate, &counted, None)) {
        if let Some(value) = value {
            text += &format!("{:<24} {} {}\n", metric.name, number(value), metric.unit);
        }
    }
    if let Some(path) = &args.save_board {
        let board =
            toml::to_string(&candidate.spec).unwrap_or_else(|e| panic!("a board has a TOML form: {e}"));
        let mut files = OutputFiles::new();
        files.stage(path, board.into_bytes());
        files.commit()?;
        text += &format!("board      {}\n", path.display());
    }
    Ok(Outcome { text, ..Outcome::default() })
}

/// Whole numbers whole, others to six digits.
fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value:.0}") } else { format!("{value:.6e}") }
}

/// The bar of a sweep.
struct Bar(ProgressBar);

impl Bar {
    fn new(space: &Space) -> Bar {
        let known = strategy::plan(space).ok().flatten().map(|plan| plan.len() as u64);
        let bar = ProgressBar::new(known.or(space.search.points).unwrap_or(0));
        let style = ProgressStyle::with_template(
            "explore [{bar:30}] {pos}/{len} candidates, {per_sec}, {eta} left{msg}",
        );
        bar.set_style(
            style.unwrap_or_else(|e| panic!("the template is constant: {e}")).progress_chars("=> "),
        );
        Bar(bar)
    }

    fn show(&self, tally: &Tally) {
        let Tally { evaluated, found, pruned, impossible, failed } = *tally;
        self.0.set_position(evaluated + found + pruned + impossible);
        if pruned + failed > 0 {
            self.0.set_message(format!("; {pruned} pruned, {failed} failed"));
        }
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Errors that name the space's line keep it.
impl From<crate::explore::space::SpaceError> for CliError {
    fn from(error: crate::explore::space::SpaceError) -> CliError {
        CliError::Space(Box::new(error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_of_whole_and_small_values_reads() {
        assert_eq!(number(12_345.0), "12345");
        assert_eq!(number(1.25e-7), "1.250000e-7");
    }

    #[test]
    fn done_text_tells_only_what_there_was() {
        let tally = Tally { evaluated: 3, pruned: 2, ..Tally::default() };
        assert_eq!(done_text(&tally), "3 evaluated, 2 pruned");
    }
}
