//! Samples of a space: uniform, and by a Sobol sequence.
//!
//! ```text
//! random: hash(seed, i) mod combinations          sobol: a coordinate an axis, its place floor(x n)
//! ```
//! Both leave out impossible combinations and repetitions, and end when [`TRIES`] draws in a row bring nothing new: the
//! space has no more, or nearly none.
//! Source: Owen-scrambled Sobol by hashes, Burley 2020 (crate `sobol_burley`). With more axes than it has dimensions the
//! sequence's dimensions repeat with another scramble.

use std::collections::BTreeSet;

use sobol_burley::{NUM_DIMENSIONS, sample as sobol_coordinate};

use crate::explore::space::Space;
use crate::sampling::mix;

/// Draws without anything new after which a sample ends.
const TRIES: u64 = 10_000;
/// Points of the Sobol sequence: its index has 16 bits.
const SOBOL_POINTS: u64 = 1 << 16;

/// A uniform sample without repetition.
pub(super) fn random(space: &Space, points: u64) -> Vec<u64> {
    let n = space.n_combinations();
    let seed = mix(space.search.seed);
    draw(space, points, |i| Some(mix(seed.wrapping_add(i)) % n))
}

/// The first points of a scrambled Sobol sequence.
pub(super) fn sobol(space: &Space, points: u64) -> Vec<u64> {
    let seed = mix(space.search.seed) as u32;
    draw(space, points, |i| {
        (i < SOBOL_POINTS).then(|| {
            let place = |(axis, values): (usize, usize)| {
                let dimension = axis as u32 % NUM_DIMENSIONS;
                let scramble = seed.wrapping_add(axis as u32 / NUM_DIMENSIONS);
                let x = f64::from(sobol_coordinate(i as u32, dimension, scramble));
                ((x * values as f64) as usize).min(values - 1)
            };
            let choice: Vec<usize> =
                space.axes.iter().map(|axis| axis.values.len()).enumerate().map(place).collect();
            space.ordinal(&choice)
        })
    })
}

/// Up to `points` new and possible combinations of a sequence.
fn draw(space: &Space, points: u64, at: impl Fn(u64) -> Option<u64>) -> Vec<u64> {
    let mut seen = BTreeSet::new();
    let mut drawn = Vec::new();
    let (mut i, mut idle) = (0, 0);
    while (drawn.len() as u64) < points && idle < TRIES {
        let Some(ordinal) = at(i) else { break };
        i += 1;
        if seen.insert(ordinal) && space.candidate(ordinal).is_ok() {
            drawn.push(ordinal);
            idle = 0;
        } else {
            idle += 1;
        }
    }
    drawn
}
