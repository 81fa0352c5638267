//! Who shoots how many bundles: in proportion to unshot power, along the order of the elements.
//!
//! ```text
//! power of element 0, 1, 2, ... --running sum--> bundle b belongs where (b + 1/2) / n of the sum falls
//! ```
//! Systematic sampling: an element whose share is x bundles gets floor(x) or ceil(x). One that gets n >= 1 although x >= 1
//! shares its power out among them; one with x < 1 gives its bundle a whole bundle's power, which is right in the mean
//! over neighbours.

use rayon::prelude::*;

use super::super::state::magnitude;
use super::{BUNDLE_RAYS, BUNDLE_SIDE};
use crate::mesh::Mesh;
use crate::units::Rgb;

/// Bundles of one pass.
pub(super) struct Allocation {
    /// Power of every element (W).
    powers: Vec<Rgb>,
    /// Bundles of element e: `firsts[e]..firsts[e + 1]`.
    firsts: Vec<u64>,
    /// How many bundles.
    pub n_bundles: u64,
    /// Magnitude of all power (W).
    pub power_w: f64,
}

impl Allocation {
    /// `radiosity(e)`: what element e shoots (W/m^2).
    pub(super) fn new(mesh: &Mesh, ray_power_w: f64, radiosity: impl Fn(usize) -> Rgb + Sync) -> Allocation {
        let powers: Vec<Rgb> = (0..mesh.elements.len())
            .into_par_iter()
            .map(|e| radiosity(e) * mesh.elements[e].area_m2)
            .collect();
        let power_w: f64 = powers.iter().map(|w| magnitude(*w)).sum();
        let n_bundles = if power_w > 0.0 {
            (power_w / (ray_power_w * BUNDLE_RAYS as f64)).ceil().clamp(1.0, u32::MAX.into()) as u64
        } else {
            0
        };
        let mut firsts = Vec::with_capacity(powers.len() + 1);
        let per_watt = n_bundles as f64 / power_w.max(f64::MIN_POSITIVE);
        let mut below = 0.0;
        for w in &powers {
            firsts.push(((below * per_watt + 0.5) as u64).min(n_bundles));
            below += magnitude(*w);
        }
        firsts.push(n_bundles);
        Allocation { powers, firsts, n_bundles, power_w }
    }

    /// The element that shoots bundle `b`, and the power of each of its rays (W).
    pub(super) fn of_bundle(&self, b: u64) -> (usize, Rgb) {
        let e = self.firsts.partition_point(|first| *first <= b) - 1;
        let n = (self.firsts[e + 1] - self.firsts[e]) as f64;
        let share = magnitude(self.powers[e]) / self.power_w * self.n_bundles as f64;
        let n = if share < 1.0 { share } else { n };
        (e, self.powers[e] / (n * f64::from(BUNDLE_SIDE * BUNDLE_SIDE)))
    }
}
