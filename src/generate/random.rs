//! Random numbers in sequence for scenes: the same for a seed and a stream, on every machine.
//!
//! ```text
//! seed, stream, 0, 1, 2, ... --sampling.rs: hash--> 64 bits --> whole numbers, [0, 1), vectors
//! ```
//! Only `+ - * / sqrt` touch what is drawn, which IEEE 754 rounds alike everywhere; no sine, no logarithm.

use crate::geom::DVec3;
use crate::sampling::hash;

/// One stream of random numbers.
#[derive(Clone, Debug)]
pub(super) struct Random {
    seed: u64,
    stream: u64,
    n_drawn: u64,
}

impl Random {
    /// The stream of a number: streams of one seed have nothing to do with each other.
    pub(super) fn new(seed: u64, stream: u64) -> Random {
        Random { seed, stream, n_drawn: 0 }
    }

    fn bits(&mut self) -> u64 {
        self.n_drawn += 1;
        hash(self.seed, self.stream, self.n_drawn)
    }

    /// A number in [0, 1), a multiple of 2^-53.
    pub(super) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number in [`low`, `high`).
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A whole number from `low` to `high`, both included.
    ///
    /// # Panics
    /// When `low` is over `high`.
    pub(super) fn whole(&mut self, low: i32, high: i32) -> i32 {
        assert!(low <= high, "a whole number from {low} to {high}");
        let n = (i64::from(high) - i64::from(low) + 1) as u64;
        // The upper word of a product: bits spread over 0..n.
        let k = (u128::from(self.bits()) * u128::from(n)) >> 64;
        (i64::from(low) + k as i64) as i32
    }

    /// One of a list.
    ///
    /// # Panics
    /// When it is empty.
    pub(super) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.whole(0, from.len() as i32 - 1) as usize]
    }

    /// A unit vector, every direction alike.
    pub(super) fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            let square = v.length_squared();
            if (0.01..=1.0).contains(&square) {
                return v / square.sqrt();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_of_equal_seed_and_stream_repeats_and_of_another_stream_does_not() {
        let draw = |seed, stream| {
            let mut random = Random::new(seed, stream);
            [(); 8].map(|()| random.bits())
        };
        assert_eq!(draw(1, 2), draw(1, 2));
        assert!(draw(1, 2) != draw(2, 2) && draw(1, 2) != draw(1, 3) && draw(1, 2) != draw(2, 1));
    }

    #[test]
    fn random_whole_reaches_both_ends_about_equally_often() {
        let mut random = Random::new(7, 0);
        let mut counts = [0; 5];
        for _ in 0..5000 {
            counts[(random.whole(-2, 2) + 2) as usize] += 1;
        }
        assert!(counts.iter().all(|c| (900..1100).contains(c)), "{counts:?}");
        assert_eq!(random.whole(3, 3), 3);
        let full = random.whole(i32::MIN, i32::MAX);
        assert_ne!(full, random.whole(i32::MIN, i32::MAX));
    }

    #[test]
    fn random_direction_has_unit_length_and_no_preferred_side() {
        let mut random = Random::new(3, 0);
        let n = 4000;
        let mut sum = DVec3::ZERO;
        let mut squares = DVec3::ZERO;
        for _ in 0..n {
            let v = random.direction();
            assert!((v.length() - 1.0).abs() < 1e-12);
            sum += v;
            squares += v * v;
        }
        assert!((sum / f64::from(n)).abs().max_element() < 0.04, "{sum}");
        assert!((squares / f64::from(n) - 1.0 / 3.0).abs().max_element() < 0.02, "{squares}");
    }
}
