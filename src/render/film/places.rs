//! Where in its pixel each camera ray goes.
//!
//! ```text
//! a fixed count N:  Hammersley's N points, one in each of N columns and rows (the centre for 1)
//! 1 to N, growing:  the first points of a (0,2)-sequence: every first 2^k of them are stratified
//! ```
//! The same for all pixels, so that one sample of a tile of pixels is one bundle.
//! Source: Kollig, Keller 2002, "Efficient multidimensional sampling" (Sobol's second dimension).

use crate::sampling::radical_inverse;

/// The pattern of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::render) enum Places {
    /// Every pixel has this many rays.
    Fixed(u32),
    /// A pixel has up to this many.
    Growing(u32),
}

impl Places {
    /// Place of ray `k` in its pixel, [0,1)^2.
    pub fn at(self, k: u32) -> [f64; 2] {
        match self {
            Places::Fixed(0 | 1) => [0.5, 0.5],
            Places::Fixed(n) => {
                let n = f64::from(n);
                [(f64::from(k) + 0.5) / n, (radical_inverse(k) + 0.5 / n).fract()]
            }
            Places::Growing(max) => {
                // Half a cell of the finest grid puts the mean of all points in the middle; half a pixel puts the first
                // point there.
                let cell = 1.0 / f64::from(max.next_power_of_two());
                [radical_inverse(k), sobol(k)].map(|u| (u + 0.5).fract() + 0.5 * cell)
            }
        }
    }
}

/// The second dimension of Sobol's sequence, base 2.
fn sobol(mut k: u32) -> f64 {
    let (mut bits, mut v) = (0_u32, 1_u32 << 31);
    while k != 0 {
        if k & 1 != 0 {
            bits ^= v;
        }
        k >>= 1;
        v ^= v >> 1;
    }
    f64::from(bits) * (1.0 / 4_294_967_296.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strata(places: &[[f64; 2]], columns: u32, rows: u32) -> Vec<u32> {
        let cell = |u: f64, n: u32| (u * f64::from(n)) as u32;
        let mut all: Vec<u32> =
            places.iter().map(|p| cell(p[1], rows) * columns + cell(p[0], columns)).collect();
        all.sort_unstable();
        all
    }

    #[test]
    fn fixed_samples_of_a_pixel_lie_one_in_each_row_and_column_of_strata() {
        assert_eq!(Places::Fixed(1).at(0), [0.5, 0.5]);
        for n in 2..=16u32 {
            let all: Vec<_> = (0..n).map(|k| Places::Fixed(n).at(k)).collect();
            assert_eq!(strata(&all, n, 1), (0..n).collect::<Vec<_>>());
            assert!(all.iter().all(|p| (0.0..1.0).contains(&p[1])));
            if n.is_power_of_two() {
                assert_eq!(strata(&all, 1, n), (0..n).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn growing_samples_are_stratified_in_every_way_at_every_power_of_two() {
        for max in [4, 8, 16] {
            for n in [2, 4, 8, 16].into_iter().filter(|n| *n <= max) {
                let all: Vec<_> = (0..n).map(|k| Places::Growing(max).at(k)).collect();
                let mut columns = 1;
                while columns <= n {
                    let cells = strata(&all, columns, n / columns);
                    assert_eq!(cells, (0..n).collect::<Vec<_>>(), "{n} of {max}, {columns} columns");
                    columns *= 2;
                }
            }
            let all: Vec<_> = (0..max).map(|k| Places::Growing(max).at(k)).collect();
            for axis in 0..2 {
                let mean = all.iter().map(|p| p[axis]).sum::<f64>() / f64::from(max);
                assert!((mean - 0.5).abs() < 1e-12, "{mean}");
            }
            let off = Places::Growing(max).at(0).map(|u| u - 0.5);
            assert_eq!(
                off,
                [0.5 / f64::from(max); 2],
                "the first ray goes through the middle but for half a cell"
            );
        }
    }
}
