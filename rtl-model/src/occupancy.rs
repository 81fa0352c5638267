//! How full the units are that work comes in: a unit takes a cluster's bundle slot whole, however few rays it has.
//!
//! ```text
//! rays of each unit --add--> UnitOccupancy: units, rays, full ones, units by eighths of 64 rays
//! ```

use serde::{Deserialize, Serialize};

use crate::packet::MAX_BUNDLE_RAYS;

/// Eighths of a full unit.
const EIGHTHS: usize = 8;

/// Units of 1 to 64 rays, by how many they have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitOccupancy {
    /// Units.
    pub units: u64,
    /// Their rays.
    pub rays: u64,
    /// Units of 64 rays.
    pub full: u64,
    /// Units of 1 to 8, 9 to 16, ... 57 to 64 rays.
    pub by_eighth: [u64; EIGHTHS],
}

impl UnitOccupancy {
    /// Counts a unit of `n_rays` rays, 1 to 64.
    pub fn add(&mut self, n_rays: usize) {
        self.units += 1;
        self.rays += n_rays as u64;
        self.full += u64::from(n_rays == MAX_BUNDLE_RAYS);
        let eighth = n_rays.saturating_sub(1) * EIGHTHS / MAX_BUNDLE_RAYS;
        self.by_eighth[eighth.min(EIGHTHS - 1)] += 1;
    }

    /// Each counter with its counterpart.
    pub fn combine(&self, other: &UnitOccupancy, f: impl Fn(u64, u64) -> u64) -> UnitOccupancy {
        UnitOccupancy {
            units: f(self.units, other.units),
            rays: f(self.rays, other.rays),
            full: f(self.full, other.full),
            by_eighth: std::array::from_fn(|i| f(self.by_eighth[i], other.by_eighth[i])),
        }
    }

    /// Mean rays of a unit; 0 without any.
    pub fn mean_rays(&self) -> f64 {
        if self.units == 0 { 0.0 } else { self.rays as f64 / self.units as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_count_in_their_eighth_and_full_ones_apart() {
        let mut occupancy = UnitOccupancy::default();
        [1, 8, 9, 63, 64, 64].into_iter().for_each(|n| occupancy.add(n));
        assert_eq!((occupancy.units, occupancy.rays, occupancy.full), (6, 209, 2));
        assert_eq!(occupancy.by_eighth, [2, 1, 0, 0, 0, 0, 0, 3]);
        let twice = occupancy.combine(&occupancy, |a, b| a + b);
        assert_eq!((twice.full, twice.by_eighth[7]), (4, 6));
        assert!((twice.mean_rays() - 209.0 / 6.0).abs() < 1e-12);
        assert_eq!(UnitOccupancy::default().mean_rays(), 0.0);
    }
}
