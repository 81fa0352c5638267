//! What each axis does to each metric: means at its values, and the share of the variance that it explains.
//!
//! ```text
//! rows with the metric --by value of the axis--> Level: n, mean, smallest, largest   (the main effect)
//!                      `--sums of squares------> share: between the levels / all      (first order)
//! full grid      share = SS_between / SS_total                          exact for these values, each as likely
//! part of it     share = (SS_between - (k - 1) MS_within) / SS_total    k levels; at least 0
//! ```
//! On a full grid the share is Sobol's first-order index; what axes do only together is in no share, so that they add up
//! to at most 1. On a part of a grid, chance alone gives k levels of n rows a share of (k - 1) / (n - 1): the second
//! formula (epsilon squared) takes that off, and where no row is left to tell chance from effect, there is no share.
//! Axes that vary together there cannot be told apart: each is given what they do, and shares may exceed 1 in sum.
//!
//! Sources: Sobol 1993; Kelley 1935 for epsilon squared. Not modelled: interactions one by one, error of sampled rows.

use serde::Serialize;

use super::pareto::is_measured;
use super::{Results, Row};
use crate::explore::metric::{Metric, Needs};

/// The rows at one value of an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Place of the value in the axis.
    pub value: usize,
    /// Rows.
    pub n: usize,
    /// Mean of the metric over them.
    pub mean: f64,
    /// Smallest.
    pub low: f64,
    /// Largest.
    pub high: f64,
}

/// How much of a metric's variance an axis explains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Share {
    /// This much, 0 to 1.
    Of(f64),
    /// The metric does not change.
    Constant,
    /// The axis has one value in these rows, or none is left to tell chance from effect.
    TooFew,
}

impl Share {
    /// The number, 0 for a metric that does not change.
    pub fn value(self) -> Option<f64> {
        match self {
            Share::Of(share) => Some(share),
            Share::Constant => Some(0.0),
            Share::TooFew => None,
        }
    }
}

/// What an axis does to a metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// Values of the axis that have rows, in the axis' order.
    pub levels: Vec<Level>,
    /// Share of the variance.
    pub share: Share,
}

/// What the axes do to a metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricEffects {
    /// Column of the metric.
    pub metric: usize,
    /// Rows that have it.
    pub n_rows: usize,
    /// They are all combinations of the axes.
    pub is_full_grid: bool,
    /// Of each axis.
    pub effects: Vec<Effect>,
}

/// Of every metric that some row has.
pub fn sensitivity(results: &Results) -> Vec<MetricEffects> {
    (0..results.metrics.len()).filter_map(|metric| of_metric(results, metric)).collect()
}

/// Rows that count for a metric: what follows from the board alone is known of every row.
fn counts(row: &Row, name: &str) -> bool {
    is_measured(row) || Metric::named(name).is_some_and(|m| m.needs == Needs::Cost)
}

fn of_metric(results: &Results, metric: usize) -> Option<MetricEffects> {
    let name = &results.metrics[metric].name;
    let known = results.rows.iter().filter(|row| counts(row, name));
    let rows: Vec<(&Row, f64)> = known
        .filter_map(|row| Some((row, row.metrics.get(metric).copied().flatten().filter(|x| x.is_finite())?)))
        .collect();
    if rows.is_empty() {
        return None;
    }
    let is_full_grid = rows.len() as u64 == results.n_combinations;
    // One axis that changes explains all that changes.
    let varies = |axis: usize| rows.iter().any(|(row, _)| row.values.get(axis) != rows[0].0.values.get(axis));
    let n_varying = (0..results.axes.len()).filter(|axis| varies(*axis)).count();
    let effects = (0..results.axes.len())
        .map(|axis| {
            let levels = levels(results, &rows, axis);
            let exact = is_full_grid || (n_varying == 1 && levels.len() > 1);
            let share = share(&rows, &levels, exact);
            Effect { levels, share }
        })
        .collect();
    Some(MetricEffects { metric, n_rows: rows.len(), is_full_grid, effects })
}

fn levels(results: &Results, rows: &[(&Row, f64)], axis: usize) -> Vec<Level> {
    let of = |(place, value)| {
        let at: Vec<f64> =
            rows.iter().filter(|(row, _)| row.values.get(axis) == Some(value)).map(|(_, x)| *x).collect();
        let mean = at.iter().sum::<f64>() / at.len() as f64;
        let low = at.iter().copied().fold(f64::INFINITY, f64::min);
        let high = at.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (!at.is_empty()).then_some(Level { value: place, n: at.len(), mean, low, high })
    };
    results.axes[axis].values.iter().enumerate().filter_map(of).collect()
}

fn share(rows: &[(&Row, f64)], levels: &[Level], exact: bool) -> Share {
    let n = rows.len() as f64;
    let mean = rows.iter().map(|(_, x)| x).sum::<f64>() / n;
    let total: f64 = rows.iter().map(|(_, x)| (x - mean).powi(2)).sum();
    // Below the rounding of the sums there is no change.
    if total <= n * (1e-12 * mean).powi(2) {
        return Share::Constant;
    }
    if levels.len() < 2 {
        // On a full grid an axis of one value explains nothing.
        return if exact { Share::Of(0.0) } else { Share::TooFew };
    }
    let between: f64 = levels.iter().map(|l| l.n as f64 * (l.mean - mean).powi(2)).sum();
    // What is left of nothing after rounding is nothing.
    let of = |part: f64| Share::Of(if part > 1e-9 * total { (part / total).min(1.0) } else { 0.0 });
    if exact {
        return of(between);
    }
    let (k, left) = (levels.len() as f64, n - levels.len() as f64);
    if left < 1.0 {
        return Share::TooFew;
    }
    let within = (total - between).max(0.0) / left;
    of(between - (k - 1.0) * within)
}

/// How the shares of a metric were found, for readers.
pub fn basis(results: &Results, effects: &MetricEffects) -> String {
    let (n, all) = (effects.n_rows, results.n_combinations);
    if effects.is_full_grid {
        format!("full grid of {all}")
    } else {
        format!("{n} of {all} combinations, corrected for chance")
    }
}

#[cfg(test)]
#[path = "sensitivity_tests.rs"]
mod tests;
