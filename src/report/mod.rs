//! What runs tell: JSON reports for programs, a summary for the terminal.
//!
//! ```text
//! frame outcome --documents.rs--> RenderReport, SolveReport... --to_json--> "schema": "radeng/<name>/1"
//! Meter         --kinds.rs------> rays by kind, share of ray casting with Amdahl's bound
//!               --board.rs------> BoardReport (totals, bounds.rs, energy.rs, stall tables, queues, by purpose)
//! two reports   --compare_runs.rs--> RunComparison
//!               --observed.rs---> ObservedReport (lives of rays, roots of stalls, work over time) --observed_text.rs--> lines
//!               --recorded.rs---> RecordedReport (a record or a sample of the work)
//!               --verify.rs-----> VerifyReport, Findings --sweep_plot.rs--> SVG
//!               --terminal.rs, board_text.rs, verify_text.rs, side_by_side.rs--> text of one screen, SI prefixes by si.rs
//! ```
//! Nothing here prints or writes: callers get bytes and strings.

pub mod board;
pub mod board_text;
pub mod bounds;
pub mod compare_runs;
pub mod compare_runs_text;
pub mod documents;
pub mod energy;
pub mod grid;
pub mod groups;
pub mod kinds;
pub mod observed;
pub mod observed_text;
pub mod recorded;
pub mod si;
pub mod side_by_side;
pub mod sweep_plot;
pub mod sweep_text;
pub mod terminal;
pub mod verify;
pub mod verify_text;

pub use board::BoardReport;
pub use compare_runs::{RunComparison, RunReport};
pub use documents::{
    BackHits, CompareReport, PartialReport, PassOneReport, PictureFact, ProbeReport, ProbedPoint,
    QualityReport, RenderReport, SceneFacts, SimulateReport, SolveReport, VectorsReport, WarmUpReport,
};
pub use grid::{GridReport, ScaledPicture};
pub use kinds::{KindReport, RayCastingTime};
pub use observed::{ObservedReport, TraceReport};
pub use recorded::RecordedReport;
pub use verify::{Findings, SweepReport, SweepRow, VerifyReport};

use std::time::Instant;

use serde::Serialize;

/// Wall time of one phase of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Phase {
    /// Name: `load`, `mesh`, `caster`, `pass 1`, `pass 2`, `write`.
    pub name: &'static str,
    /// Wall time (s).
    pub seconds: f64,
}

/// Wall time of a run, phase by phase.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Timings {
    /// Phases in the order in which they ran.
    pub phases: Vec<Phase>,
    /// Their sum (s).
    pub total_seconds: f64,
    /// Of it, what was spent in the caster, where that was clocked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ray_casting: Option<RayCastingTime>,
}

impl Timings {
    /// Runs `work` as phase `name`.
    pub fn measure<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(name, start.elapsed().as_secs_f64());
        result
    }

    /// Adds to the phase `name`, which may have run before.
    pub fn add_to(&mut self, name: &'static str, seconds: f64) {
        match self.phases.iter_mut().find(|phase| phase.name == name) {
            Some(phase) => {
                phase.seconds += seconds;
                self.total_seconds += seconds;
            }
            None => self.add(name, seconds),
        }
    }

    /// Adds a phase.
    pub fn add(&mut self, name: &'static str, seconds: f64) {
        self.phases.push(Phase { name, seconds });
        self.total_seconds += seconds;
    }
}

/// A report as JSON text, indented, with a newline at its end.
///
/// # Panics
/// Never for the reports of this module: their keys are strings.
pub fn to_json(report: &impl Serialize) -> Vec<u8> {
    let mut bytes = serde_json::to_vec_pretty(report).expect("report keys are strings");
    bytes.push(b'\n');
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timings_total_is_the_sum_of_the_phases() {
        let mut timings = Timings::default();
        timings.add("load", 0.5);
        timings.add("mesh", 0.25);
        assert_eq!(timings.measure("write", || 7), 7);
        timings.add_to("mesh", 0.5);
        timings.add_to("board", 0.125);
        assert_eq!(
            timings.phases.iter().map(|p| p.name).collect::<Vec<_>>(),
            ["load", "mesh", "write", "board"]
        );
        assert_eq!(timings.phases[1].seconds, 0.75);
        let sum: f64 = timings.phases.iter().map(|p| p.seconds).sum();
        assert!((timings.total_seconds - sum).abs() < 1e-12);
    }
}
