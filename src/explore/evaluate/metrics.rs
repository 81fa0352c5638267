//! A candidate's metrics, and how good they could be at best.
//!
//! ```text
//! Candidate, [Counted] a workload, Accuracy --> value of each metric | None
//! Candidate, fewest cycles              --> optimistic objectives, all minimised; -inf where nothing is known
//! ```

use rtl_model::statistics::BoardStatistics;

use super::{Accuracy, Counted};
use crate::explore::metric::{Goal, METRICS, Metric, cost_value};
use crate::explore::space::{Candidate, Objective};

/// Sums over the workloads.
struct Totals {
    cycles: f64,
    rays: f64,
    seconds: f64,
    energy_j: f64,
    icu_utilisation: f64,
}

/// The sum of all workloads, which ran on one board.
pub(super) fn sum(counted: &[Counted]) -> BoardStatistics {
    counted.iter().fold(BoardStatistics::default(), |sum, c| sum.plus(&c.statistics))
}

impl Totals {
    fn new(candidate: &Candidate, counted: &[Counted]) -> Option<Totals> {
        if counted.is_empty() {
            return None;
        }
        let all = sum(counted);
        let cycles = all.cycles as f64;
        Some(Totals {
            cycles,
            rays: all.canonical.rays as f64,
            seconds: cycles / (candidate.spec.clock_mhz * 1e6),
            energy_j: candidate.cost.energy_j(&candidate.spec, &all),
            icu_utilisation: all.icu_utilisation(),
        })
    }
}

/// The value of each of [`METRICS`]; `counted` is empty where no board ran.
pub fn values(candidate: &Candidate, counted: &[Counted], accuracy: Option<&Accuracy>) -> Vec<Option<f64>> {
    let totals = Totals::new(candidate, counted);
    METRICS.iter().map(|metric| value(metric, candidate, totals.as_ref(), accuracy)).collect()
}

fn value(
    metric: &Metric,
    candidate: &Candidate,
    totals: Option<&Totals>,
    accuracy: Option<&Accuracy>,
) -> Option<f64> {
    let cost = &candidate.cost;
    let of = |f: &dyn Fn(&Totals) -> f64| totals.map(f).filter(|v| v.is_finite());
    match metric.name {
        "cycles" => of(&|t| t.cycles),
        "seconds" => of(&|t| t.seconds),
        "cycles_per_ray" => of(&|t| t.cycles / t.rays),
        "rays_per_second" => of(&|t| t.rays / t.seconds),
        "icu_utilisation" => of(&|t| t.icu_utilisation),
        "energy_j" => of(&|t| t.energy_j),
        "power_w" => of(&|t| t.energy_j / t.seconds),
        "nj_per_ray" => of(&|t| t.energy_j * 1e9 / t.rays),
        "rays_per_joule" => of(&|t| t.rays / t.energy_j),
        "rays_per_second_per_mm2" => cost.area_mm2.and_then(|mm2| of(&|t| t.rays / t.seconds / mm2)),
        "misclassified" => accuracy.map(|a| a.misclassified),
        "image_rmse" => accuracy.and_then(|a| a.image_rmse),
        // A metric without a formula is a fault that the test of all names finds.
        name => cost_value(name, cost, &candidate.spec),
    }
}

/// The objectives as [`values`] has them, all to be minimised; `None` when one of them is not known.
pub fn minimised(objectives: &[Objective], values: &[Option<f64>]) -> Option<Vec<f64>> {
    let place = |metric: &Metric| METRICS.iter().position(|m| m.name == metric.name);
    objectives
        .iter()
        .map(|objective| {
            let value = values[place(objective.metric)?]?;
            Some(match objective.goal {
                Goal::Minimise => value,
                Goal::Maximise => -value,
            })
        })
        .collect()
}

/// The best that the objectives can be when the workloads take at least `fewest_cycles`: all minimised, -inf where a
/// bound of cycles says nothing.
pub fn optimistic(
    objectives: &[Objective],
    candidate: &Candidate,
    fewest_cycles: u64,
    rays: u64,
    accuracy: Option<&Accuracy>,
) -> Vec<f64> {
    let bound = Totals {
        cycles: fewest_cycles as f64,
        rays: rays as f64,
        seconds: fewest_cycles as f64 / (candidate.spec.clock_mhz * 1e6),
        energy_j: f64::NAN,
        icu_utilisation: f64::NAN,
    };
    let best = |objective: &Objective| {
        let known = value(objective.metric, candidate, Some(&bound), accuracy);
        match (known, objective.goal, objective.metric.goal) {
            (None, ..) => f64::NEG_INFINITY,
            (Some(value), Goal::Minimise, Goal::Minimise) => value,
            (Some(value), Goal::Maximise, Goal::Maximise) => -value,
            // Against the metric's own direction a bound bounds the wrong side, unless cycles do not matter.
            (Some(value), goal, _) => match (objective.metric.needs, goal) {
                (crate::explore::metric::Needs::Cycles, _) => f64::NEG_INFINITY,
                (_, Goal::Minimise) => value,
                (_, Goal::Maximise) => -value,
            },
        }
    };
    objectives.iter().map(best).collect()
}
