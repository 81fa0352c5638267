//! Successive halving: many candidates on short workloads, the better ones on longer ones, the last on all of it.
//!
//! ```text
//! rung 0: all candidates, workloads of 4^-(R-1) of the rays --best share--> rung 1: 4^-(R-2) ... --> rung R-1: whole
//! ```
//! Better: a lower rank of non-dominated sorting; within a rank the more lonely one (crowding distance), then the lower
//! ordinal. Source: Jamieson, Talwalkar 2016 (one objective); ranks as in Deb et al. 2002.

use super::sample;
use crate::explore::evaluate::Extent;
use crate::explore::results::pareto::ranks;
use crate::explore::sweep::{Sweep, SweepError};

/// Candidates up to which `points` left open means all of them.
const MAX_CANDIDATES: u64 = 1_000_000;

/// Runs it on `points` candidates; those of a space that has fewer are all taken.
pub(super) fn run(sweep: &mut Sweep<'_>, points: u64, rungs: u32, keep: f64) -> Result<(), SweepError> {
    let space = sweep.space();
    let n = space.n_combinations();
    let mut candidates: Vec<u64> =
        if n <= points { (0..n.min(MAX_CANDIDATES)).collect() } else { sample::random(space, points) };
    for rung in (0..rungs).rev() {
        let extent = if rung == 0 { sweep.whole() } else { Extent::Rung(rung) };
        let objectives = sweep.evaluate(&candidates, extent)?;
        let known: Vec<(u64, Vec<f64>)> =
            candidates.iter().zip(objectives).filter_map(|(ordinal, o)| Some((*ordinal, o?))).collect();
        if rung == 0 || sweep.is_over() {
            break;
        }
        let wanted = (known.len() as f64 * keep).ceil() as usize;
        candidates = best(&known, wanted);
    }
    Ok(())
}

/// The `wanted` best, by ordinal.
fn best(known: &[(u64, Vec<f64>)], wanted: usize) -> Vec<u64> {
    let objectives: Vec<Vec<f64>> = known.iter().map(|(_, o)| o.clone()).collect();
    let rank = ranks(&objectives);
    let distance = crowding(&objectives, &rank);
    let mut order: Vec<usize> = (0..known.len()).collect();
    order.sort_by(|&a, &b| {
        let by_rank = rank[a].unwrap_or(u32::MAX).cmp(&rank[b].unwrap_or(u32::MAX));
        by_rank.then(distance[b].total_cmp(&distance[a])).then(known[a].0.cmp(&known[b].0))
    });
    let mut chosen: Vec<u64> = order.into_iter().take(wanted).map(|i| known[i].0).collect();
    chosen.sort_unstable();
    chosen
}

/// How lonely each point is among those of its rank: the sum over the objectives of the gap between its neighbours, as a
/// share of the rank's range; infinite at both ends.
fn crowding(points: &[Vec<f64>], rank: &[Option<u32>]) -> Vec<f64> {
    let n_objectives = points.first().map_or(0, Vec::len);
    let by_objective: Vec<Vec<f64>> =
        (0..n_objectives).map(|objective| points.iter().map(|p| p[objective]).collect()).collect();
    let mut distance = vec![0.0; points.len()];
    let n_ranks = rank.iter().flatten().max().map_or(0, |r| r + 1);
    for r in 0..n_ranks {
        let mut members: Vec<usize> = (0..points.len()).filter(|i| rank[*i] == Some(r)).collect();
        for values in &by_objective {
            let at = |i: usize| values[i];
            members.sort_by(|a, b| at(*a).total_cmp(&at(*b)).then(a.cmp(b)));
            let (Some(&first), Some(&last)) = (members.first(), members.last()) else { continue };
            let range = at(last) - at(first);
            distance[first] = f64::INFINITY;
            distance[last] = f64::INFINITY;
            if range > 0.0 && range.is_finite() {
                for neighbours in members.windows(3) {
                    distance[neighbours[1]] += (at(neighbours[2]) - at(neighbours[0])) / range;
                }
            }
        }
    }
    distance
}
