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
    /// Strata along each axis of a bundle.
    pub bundle_side: u32,
    /// Magnitude of all power (W).
    pub power_w: f64,
}

impl Allocation {
    /// `radiosity(e)`: what element e shoots (W/m^2).
    pub(super) fn new(
        mesh: &Mesh,
        ray_power_w: f64,
        bundle_side: u32,
        radiosity: impl Fn(usize) -> Rgb + Sync,
    ) -> Allocation {
        let powers: Vec<Rgb> = (0..mesh.elements.len())
            .into_par_iter()
            .map(|e| radiosity(e) * mesh.elements[e].area_m2)
            .collect();
        let power_w: f64 = powers.iter().map(|w| magnitude(*w)).sum();
        let n_bundles = if power_w > 0.0 {
            (power_w / (ray_power_w * f64::from(bundle_side.pow(2)))).ceil().clamp(1.0, u32::MAX.into())
                as u64
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
        Allocation { powers, firsts, n_bundles, bundle_side, power_w }
    }

    /// The element that shoots bundle `b`, and the power of each of its rays (W).
    pub(super) fn of_bundle(&self, b: u64) -> (usize, Rgb) {
        let e = self.firsts.partition_point(|first| *first <= b) - 1;
        let n = (self.firsts[e + 1] - self.firsts[e]) as f64;
        let share = magnitude(self.powers[e]) / self.power_w * self.n_bundles as f64;
        let n = if share < 1.0 { share } else { n };
        (e, self.powers[e] / (n * f64::from(self.bundle_side.pow(2))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::tests::{grey, room, scene};
    use glam::DVec3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
        #[test]
        fn allocation_of_any_powers_gives_each_its_share_to_within_a_bundle(
            weights in prop::collection::vec(prop_oneof![Just(0.0), 0.0..1.0, -20.0..20.0], 24),
            rays in 1.0..1e6_f64,
        ) {
            let scene = scene(vec![grey("grey", 0.5)], room(DVec3::ONE, 0.0), vec![], 24);
            let mesh = Mesh::build(&scene);
            prop_assert_eq!(mesh.elements.len(), 24);
            let radiosity = |e: usize| Rgb([weights[e], 0.5 * weights[e], 0.0]);
            let total: f64 = (0..24).map(|e| magnitude(radiosity(e)) * mesh.elements[e].area_m2).sum();
            prop_assume!(total > 0.0);
            let allocation = Allocation::new(&mesh, total / rays, 8, radiosity);
            prop_assert_eq!(allocation.n_bundles, (rays / 64.0).ceil() as u64);
            let (mut counts, mut carried) = (vec![0.0; 24], vec![Rgb::BLACK; 24]);
            for b in 0..allocation.n_bundles {
                let (e, ray_power_w) = allocation.of_bundle(b);
                counts[e] += 1.0;
                carried[e] += ray_power_w * 64.0;
            }
            for e in 0..24 {
                let power = radiosity(e) * mesh.elements[e].area_m2;
                let share = magnitude(power) / total * allocation.n_bundles as f64;
                let n: f64 = counts[e];
                prop_assert!((n - share).abs() < 1.0 + 1e-9, "{n} of {share}");
                if share >= 1.0 {
                    prop_assert!(magnitude(carried[e] - power) < 1e-9 * total);
                } else if n > 0.0 {
                    prop_assert!((magnitude(carried[e]) * allocation.n_bundles as f64 / total - 1.0).abs() < 1e-9);
                }
            }
        }
    }
}
