//! Ways to choose candidates.
//!
//! ```text
//! Strategy --plan--> ordinals that are known beforehand: grid, random, sobol    (these can be cut into shards)
//!          --run---> what is asked for next depends on answers: halving, nsga2
//! ```
//! Everything follows from the space and its seed: same seed, same candidates, same result.

mod halving;
mod nsga2;
mod sample;

use super::space::{Space, Strategy};
use super::sweep::{Sweep, SweepError};

/// The combinations that a strategy asks for, in order, where they are known beforehand.
///
/// A grid's are all, impossible ones included, so that these are listed; samples hold possible ones alone.
///
/// # Errors
/// A sample without an end, or a grid of more combinations than can be gone through.
pub fn plan(space: &Space) -> Result<Option<Vec<u64>>, String> {
    let wanted = || match (space.search.points, space.search.minutes) {
        (Some(points), _) => Ok(points),
        (None, Some(_)) => Ok(MAX_OPEN),
        (None, None) => Err("expected an end: `points` or `minutes` in [search], --points or --minutes"),
    };
    match space.search.strategy {
        Strategy::Grid => {
            let n = space.n_combinations();
            if n > MAX_GRID {
                return Err(format!(
                    "a grid of {n} combinations: expected at most {MAX_GRID}, or another strategy with --points"
                ));
            }
            Ok(Some((0..n).collect()))
        }
        Strategy::Random => Ok(Some(sample::random(space, wanted()?))),
        Strategy::Sobol => Ok(Some(sample::sobol(space, wanted()?))),
        // Halving without a number begins with all.
        Strategy::Halving { .. } => Ok(None),
        Strategy::Nsga2 { .. } => wanted().map(|_| None).map_err(str::to_owned),
    }
}

/// Most combinations of a grid: each is looked at, and kept in the store.
pub const MAX_GRID: u64 = 10_000_000;

/// Points of a sample that only time ends.
const MAX_OPEN: u64 = 100_000;

/// Runs the search of the sweep's space.
///
/// # Errors
/// When the store fails, or the search cannot be set up.
pub fn run(sweep: &mut Sweep<'_>, planned: Option<&[u64]>) -> Result<(), SweepError> {
    let whole = sweep.whole();
    if let Some(ordinals) = planned {
        return sweep.evaluate(ordinals, whole).map(drop);
    }
    let points = sweep.space().search.points.unwrap_or(u64::MAX);
    match sweep.space().search.strategy {
        Strategy::Halving { rungs, keep } => halving::run(sweep, points, rungs, keep),
        Strategy::Nsga2 { population } => nsga2::run(sweep, points, population),
        Strategy::Grid | Strategy::Random | Strategy::Sobol => {
            unreachable!("plans of these are known beforehand")
        }
    }
}

#[cfg(test)]
mod tests;
