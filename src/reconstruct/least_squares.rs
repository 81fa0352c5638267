//! Small linear least squares with a rank check: Householder QR with column pivoting, three right-hand sides at once.
//!
//! ```text
//! rows (a_1..a_5 | b_red, b_green, b_blue) --columns to unit length, QR--> x minimising |A x - b|, or "rank-deficient"
//! ```
//! Source: Golub, Van Loan, "Matrix Computations", section 5.4 (QR with column pivoting).

/// Smallest pivot that counts as full rank, where columns have unit length.
const MIN_PIVOT: f64 = 1e-4;

/// A growing system of up to five unknowns; its buffers are reused from fit to fit.
#[derive(Default)]
pub(super) struct LeastSquares {
    rows: Vec<[f64; 5]>,
    right: Vec<[f64; 3]>,
    /// Column-wise working copies.
    a: Vec<f64>,
    b: Vec<f64>,
}

impl LeastSquares {
    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.right.clear();
    }

    pub(super) fn push(&mut self, row: [f64; 5], right: [f64; 3]) {
        self.rows.push(row);
        self.right.push(right);
    }

    /// Solves for the first `N` unknowns, the others zero; `None` when the rank is below `N`.
    pub(super) fn solve<const N: usize>(&mut self) -> Option<[[f64; 3]; 5]> {
        let m = self.rows.len();
        if m < N {
            return None;
        }
        let (a, b) = (&mut self.a, &mut self.b);
        a.clear();
        b.clear();
        let mut norms = [0.0; N];
        for (k, norm) in norms.iter_mut().enumerate() {
            *norm = self.rows.iter().map(|r| r[k] * r[k]).sum::<f64>().sqrt();
            if *norm == 0.0 {
                return None;
            }
            a.extend(self.rows.iter().map(|r| r[k] / *norm));
        }
        for c in 0..3 {
            b.extend(self.right.iter().map(|r| r[c]));
        }
        let mut order: [usize; N] = std::array::from_fn(|k| k);
        let mut diagonal = [0.0; N];
        for k in 0..N {
            // The column with the longest rest goes next.
            let rest = |a: &[f64], j: usize| a[j * m + k..(j + 1) * m].iter().map(|v| v * v).sum::<f64>();
            let best = (k..N).reduce(|p, q| if rest(a, q) > rest(a, p) { q } else { p })?;
            if best != k {
                order.swap(k, best);
                for i in 0..m {
                    a.swap(k * m + i, best * m + i);
                }
            }
            let length = rest(a, k).sqrt();
            // The first pivot is a whole column, of length 1. NaN counts as no pivot.
            if length.is_nan() || length <= MIN_PIVOT {
                return None;
            }
            diagonal[k] = if a[k * m + k] > 0.0 { -length } else { length };
            // Reflector v = x - diagonal e_k, kept in place of the column.
            a[k * m + k] -= diagonal[k];
            let (head, tail) = a.split_at_mut((k + 1) * m);
            let v = &head[k * m + k..];
            let square: f64 = v.iter().map(|x| x * x).sum();
            let others = tail.chunks_exact_mut(m).chain(b.chunks_exact_mut(m));
            for other in others {
                let other = &mut other[k..];
                let dot: f64 = v.iter().zip(other.iter()).map(|(x, y)| x * y).sum();
                let factor = 2.0 * dot / square;
                other.iter_mut().zip(v).for_each(|(y, x)| *y -= factor * x);
            }
        }
        let mut x = [[0.0; 3]; 5];
        for c in 0..3 {
            let mut z = [0.0; N];
            for k in (0..N).rev() {
                let known: f64 = (k + 1..N).map(|j| a[j * m + k] * z[j]).sum();
                z[k] = (b[c * m + k] - known) / diagonal[k];
            }
            for k in 0..N {
                x[order[k]][c] = z[k] / norms[order[k]];
            }
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn least_squares_of_points_on_a_conic_is_rank_deficient_for_a_quadratic_only() {
        let mut system = LeastSquares::default();
        // Points of the parabola w = u^2: columns w and u^2 / 2 are parallel.
        for k in 1..9 {
            let u = f64::from(k) / 8.0;
            let w = u * u;
            system.push([u, w, 0.5 * u * u, u * w, 0.5 * w * w], [u, w, u + w]);
        }
        assert!(system.solve::<5>().is_none());
        let x = system.solve::<2>().expect("a linear fit is possible");
        for (k, expected) in [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0; 3]].into_iter().enumerate() {
            assert!((0..3).all(|c| (x[k][c] - expected[c]).abs() < 1e-12));
        }
    }

    #[test]
    fn least_squares_of_too_few_or_collinear_rows_is_none() {
        let mut system = LeastSquares::default();
        assert!(system.solve::<2>().is_none());
        for k in 1..9 {
            system.push([f64::from(k), 2.0 * f64::from(k), 0.0, 0.0, 0.0], [1.0; 3]);
        }
        assert!(system.solve::<2>().is_none());
    }

    proptest! {
        #[test]
        fn least_squares_residual_is_normal_to_the_columns(
            rows in prop::collection::vec(prop::array::uniform5(-1.0..1.0f64), 8..20),
            right in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 20)
        ) {
            let mut system = LeastSquares::default();
            rows.iter().zip(&right).for_each(|(r, b)| system.push(*r, *b));
            let x = system.solve::<5>();
            prop_assume!(x.is_some());
            let x = x.unwrap_or_default();
            for k in 0..5 {
                for c in 0..3 {
                    let dot: f64 = rows.iter().zip(&right).map(|(r, b)| {
                        r[k] * (b[c] - (0..5).map(|j| r[j] * x[j][c]).sum::<f64>())
                    }).sum();
                    prop_assert!(dot.abs() < 1e-9, "column {}, side {}: {}", k, c, dot);
                }
            }
        }
    }
}
