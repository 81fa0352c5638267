//! Whether a space has candidates at all: combinations are tried before anything runs.
//!
//! ```text
//! all combinations, or a spread of them --Plan::build--> one is possible: the space is
//!                                                   `--> none: which constraint leaves none, which contradict
//! ```
//! An expression that makes no sense for a tried combination is a fault of the file, with its place.

use super::Space;
use super::faults::Fault;
use super::resolve::Refusal;
use crate::scene::line_column;
use crate::scene::toml::source::Source;

/// Most combinations that are tried.
const MAX_TRIED: u64 = 4096;

/// Combinations that are tried even when the first is possible: an expression may make no sense further on.
const MIN_TRIED: u64 = 64;

/// Ordinals from all over the space: all of them, in an order that jumps, or a spread of them.
fn spread(n: u64) -> impl Iterator<Item = u64> {
    // Steps of the golden ratio leave no large gap, and one that shares no factor with n meets every ordinal once.
    let golden = (n as f64 * 0.618_033_988_749_895) as u64;
    let step = (golden.max(1)..).find(|s| gcd(*s, n) == 1).unwrap_or(1);
    (0..n.min(MAX_TRIED)).scan(0_u64, move |at, _| {
        let here = *at;
        *at = (u128::from(*at) + u128::from(step)).rem_euclid(u128::from(n)) as u64;
        Some(here)
    })
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Tries combinations.
///
/// # Errors
/// An expression that makes no sense; a constraint that no combination satisfies, constraints that contradict each
/// other; no board that can be.
pub(super) fn try_out(source: &Source<'_>, space: &Space) -> Result<(), Fault> {
    let n = space.n_combinations();
    let mut is_possible = false;
    for (tried, ordinal) in spread(n).enumerate() {
        match space.plan.build(&space.axes, &space.choice(ordinal), |_, holds| holds) {
            Ok(_) => is_possible = true,
            Err(Refusal::Expression { at, what }) => {
                return Err(source.fault(at, format!("{what} (with {})", space.in_words(ordinal))));
            }
            Err(Refusal::Impossible(_)) => {}
        }
        if is_possible && tried as u64 + 1 >= MIN_TRIED {
            break;
        }
    }
    if is_possible { Ok(()) } else { Err(none_left(source, space)) }
}

/// Why no combination is a candidate.
fn none_left(source: &Source<'_>, space: &Space) -> Fault {
    let n = space.n_combinations();
    let n_constraints = space.plan.constraints.len();
    let (mut tried, mut boards) = (0_u64, 0_u64);
    let (mut kept, mut seen) = (vec![0_u64; n_constraints], vec![0_u64; n_constraints]);
    // Combinations that satisfy the constraints up to each one.
    let mut kept_so_far = vec![0_u64; n_constraints];
    let mut board_fault = None;
    for ordinal in spread(n) {
        tried += 1;
        let mut satisfied = vec![false; n_constraints];
        let built = space.plan.build(&space.axes, &space.choice(ordinal), |i, holds| {
            seen[i] += 1;
            kept[i] += u64::from(holds);
            satisfied[i] = holds;
            true
        });
        for (count, _) in kept_so_far.iter_mut().zip(satisfied.iter().take_while(|holds| **holds)) {
            *count += 1;
        }
        match built {
            Ok(_) => boards += 1,
            Err(refusal) => {
                board_fault.get_or_insert_with(|| (ordinal, refusal.reason()));
            }
        }
    }
    let how_many =
        if tried == n { format!("all {n} combinations") } else { format!("{tried} of {n} combinations") };
    let place = |i: usize| space.plan.constraints[i].expression.at.clone();
    let text = |i: usize| &space.plan.constraints[i].expression.text;
    if let Some(i) = (0..n_constraints).find(|i| seen[*i] > 0 && kept[*i] == 0) {
        let what = format!("no combination satisfies {:?} (tried {how_many})", text(i));
        return source.fault(place(i), what);
    }
    if boards == 0 {
        let (ordinal, reason) = board_fault.unwrap_or((0, "no combination was tried".to_owned()));
        let what = format!(
            "no combination is a board that can be (tried {how_many}); with {}: {reason}",
            space.in_words(ordinal)
        );
        return source.fault(space.first_axis.clone(), what);
    }
    if n_constraints == 0 {
        return source.fault(space.first_axis.clone(), format!("no candidate (tried {how_many})"));
    }
    let last = kept_so_far.iter().position(|n| *n == 0).unwrap_or(n_constraints - 1);
    let line = |i: usize| line_column(source.text, place(i).start).0;
    let lines: Vec<String> = (0..=last)
        .map(|i| format!("{:?} in line {} leaves {} of {}", text(i), line(i), kept[i], seen[i]))
        .collect();
    let what = format!(
        "the constraints contradict each other: no combination satisfies all (tried {how_many}; {})",
        lines.join(", ")
    );
    source.fault(place(last), what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_of_a_small_space_meets_every_ordinal_once() {
        for n in [1_u64, 2, 3, 10, 96, 1000, MAX_TRIED] {
            let mut met: Vec<u64> = spread(n).collect();
            met.sort_unstable();
            assert_eq!(met, (0..n).collect::<Vec<_>>(), "{n}");
        }
    }

    #[test]
    fn spread_of_a_huge_space_has_its_most_and_no_large_gap() {
        let n = 1 << 40;
        let mut met: Vec<u64> = spread(n).collect();
        assert_eq!(met.len() as u64, MAX_TRIED);
        met.sort_unstable();
        met.dedup();
        assert_eq!(met.len() as u64, MAX_TRIED);
        let widest = met.windows(2).map(|w| w[1] - w[0]).max().unwrap();
        assert!(widest < 4 * n / MAX_TRIED, "{widest}");
    }
}
