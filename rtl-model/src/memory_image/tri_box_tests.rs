//! Tests of the triangle-cube test: against clipping the triangle to the cube in exact fractions.

use proptest::prelude::*;

use super::*;

/// A fraction in lowest terms, denominator positive.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fraction(i128, i128);

impl Fraction {
    fn new(num: i128, den: i128) -> Fraction {
        let (mut a, mut b) = (num.abs(), den.abs());
        while b != 0 {
            (a, b) = (b, a % b);
        }
        let scale = if den < 0 { -a } else { a };
        Fraction(num / scale, den / scale)
    }

    fn minus(self, other: Fraction) -> Fraction {
        Fraction::new(self.0 * other.1 - other.0 * self.1, self.1 * other.1)
    }

    fn times(self, other: Fraction) -> Fraction {
        Fraction::new(self.0 * other.0, self.1 * other.1)
    }
}

type Point = [Fraction; 3];

/// Sutherland-Hodgman: the part of a convex polygon with sign * (x[axis] - bound) >= 0.
fn clip(polygon: &[Point], axis: usize, bound: i64, sign: i128) -> Vec<Point> {
    let bound = Fraction(i128::from(bound), 1);
    let height = |p: &Point| p[axis].minus(bound).times(Fraction(sign, 1));
    let mut kept = Vec::new();
    for (k, p) in polygon.iter().enumerate() {
        let q = &polygon[(k + 1) % polygon.len()];
        let (a, b) = (height(p), height(q));
        if a.0 >= 0 {
            kept.push(*p);
        }
        if (a.0 > 0 && b.0 < 0) || (a.0 < 0 && b.0 > 0) {
            let gap = a.minus(b);
            let share = Fraction::new(a.0 * gap.1, a.1 * gap.0);
            kept.push([0, 1, 2].map(|i| p[i].minus(p[i].minus(q[i]).times(share))));
        }
    }
    kept
}

fn clips_to_something(corners: [[i32; 3]; 3], low: [i64; 3], side: i64) -> bool {
    let mut polygon: Vec<Point> = corners.iter().map(|c| c.map(|w| Fraction(i128::from(w), 1))).collect();
    for (axis, bound) in low.into_iter().enumerate() {
        polygon = clip(&polygon, axis, bound, 1);
        polygon = clip(&polygon, axis, bound + side, -1);
    }
    !polygon.is_empty()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn touches_random_triangles_equals_exact_clipping(
        corners in [[-9..=9_i32, -9..=9_i32, -9..=9_i32], [-9..=9_i32, -9..=9_i32, -9..=9_i32], [-9..=9_i32, -9..=9_i32, -9..=9_i32]],
        low in [-4..=2_i64, -4..=2_i64, -4..=2_i64],
        side in 1_i64..=4,
    ) {
        prop_assert_eq!(TriangleAxes::new(corners).touches(low, side), clips_to_something(corners, low, side));
    }
}

#[test]
fn touches_every_small_triangle_near_a_unit_cube_equals_exact_clipping() {
    // One corner each on a lattice around [0, 1]^3, degenerate triangles included.
    let lattice = |n: i32| [n % 4 - 1, n / 4 % 4 - 1, n / 16 - 1];
    let (mut cases, mut touching) = (0, 0);
    for n in (0..64 * 64 * 64).step_by(7) {
        let corners = [lattice(n % 64), lattice(n / 64 % 64), lattice(n / 4096)];
        let touches = TriangleAxes::new(corners).touches([0; 3], 1);
        assert_eq!(touches, clips_to_something(corners, [0; 3], 1), "{corners:?}");
        cases += 1;
        touching += usize::from(touches);
    }
    assert!(cases > 37_000 && touching > cases / 4 && touching < cases, "{touching} of {cases}");
}

#[test]
fn touches_widest_words_do_not_overflow() {
    let (low, high) = (-(1_i32 << 28), (1 << 28) - 1);
    let triangle = TriangleAxes::new([[low, low, high], [high, low, low], [low, high, low]]);
    let cube = 1_i64 << 28;
    assert!(triangle.touches([-cube; 3], 2 * cube));
    assert!(!triangle.touches([0; 3], cube));
    // The plane x + y + z = -2^28 - 1 passes the cell below the origin's corner.
    assert!(triangle.touches([-cube; 3], cube));
}
