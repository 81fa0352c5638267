//! Hemisphere bundles of a pass: one apex on the element, 8 x 8 or 4 x 4 cosine strata.
//!
//! ```text
//! b --R4 sequence, shifted by the round's seed--> place on the element, place in the strata --> RayBundle::Hemisphere
//! ```
//! Bundle b is at (b + 1/2)/n of the power along the order of the elements and at element b of a four-dimensional
//! Kronecker sequence, so that the bundles of one element, of its neighbours, and of all stand evenly in place and direction.
//! Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences"; Cranley, Patterson 1976 (the shift).

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use rayon::prelude::*;

use super::super::shooter::inside;
use super::allocation::Allocation;
use crate::mesh::{ElementId, Mesh, SurfacePoint};
use crate::raycast::RayBundle;
use crate::sampling::{hash, unit_pair};
use crate::units::Rgb;

/// Rays start at least this share of an element inside its edges, where a wall may stand.
const EDGE_MARGIN: f64 = 1e-4;
/// Steps of the sequence in units of 2^-64: powers of 1/x, x^5 = x + 1.
const STEPS: [u64; 4] = steps();

/// A bundle and what each of its rays carries (W).
pub(super) struct Source {
    pub bundle: RayBundle,
    pub ray_power_w: Rgb,
}

const fn steps() -> [u64; 4] {
    // 1/x in units of 2^-64; products keep the upper half.
    const INVERSE: u64 = 15_802_862_336_838_869_349;
    let mut steps = [INVERSE; 4];
    let mut k = 1;
    while k < 4 {
        steps[k] = ((steps[k - 1] as u128 * INVERSE as u128) >> 64) as u64;
        k += 1;
    }
    steps
}

/// The bundles `range` of a pass, in order.
pub(super) fn sources(
    mesh: &Mesh,
    allocation: &Allocation,
    seed: u64,
    offset_m: f64,
    range: Range<u64>,
) -> Vec<Source> {
    let shift: [u64; 4] = std::array::from_fn(|k| hash(seed, 5 << 40, k as u64));
    let first = range.start;
    (0..(range.end - first) as usize)
        .into_par_iter()
        .with_min_len(64)
        .map(|b| {
            let b = first + b as u64;
            let (e, ray_power_w) = allocation.of_bundle(b);
            let x: [f64; 4] =
                std::array::from_fn(|k| unit_pair(shift[k].wrapping_add(b.wrapping_mul(STEPS[k])))[0]);
            let element = ElementId(e as u32);
            let place = [x[0], x[1]].map(|x| EDGE_MARGIN + (1.0 - 2.0 * EDGE_MARGIN) * x);
            let at = mesh.position(SurfacePoint { element, st: inside(mesh, element, place) });
            let normal = mesh.elements[e].normal;
            let bundle = RayBundle::Hemisphere {
                apex: at + offset_m * normal,
                normal,
                // Quarter turns map the square onto itself and take out what the board's table leans.
                spin: FRAC_PI_2 * (b & 3) as f64,
                n: allocation.bundle_side,
                m: allocation.bundle_side,
                jitter: [x[2], x[3]],
            };
            Source { bundle, ray_power_w }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_the_sequence_are_the_powers_of_the_root() {
        let x = STEPS[0] as f64 / 2f64.powi(64);
        let root = 1.0 / x;
        assert!((root.powi(5) - root - 1.0).abs() < 1e-14, "{root}");
        for (k, step) in STEPS.iter().enumerate() {
            let expected = x.powi(k as i32 + 1);
            assert!((*step as f64 / 2f64.powi(64) - expected).abs() < 1e-15);
        }
    }
}
