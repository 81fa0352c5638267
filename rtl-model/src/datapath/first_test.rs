//! Dual precision: a narrow, conservative first test, and the exact test only where it leaves the answer open.
//!
//! ```text
//! v_i, o -> a_i = v_i - o --+--> sign bits: all corners on the far side of the origin, on some axis? ------> Miss
//!                           +--> one exponent s for the patch, a^_i --+
//! d ----> exponent r, d^ ---------------------------------------------+--> p_i = a^_i x d^, e^_ij = a^_i . p_j
//!                        2 E_ij from |p_i|, |p_j|, |a^_j - a^_i| -----+--> e^ - E, e^ + E -> Miss, Inside, Undecided
//! ```
//! **Words.** The differences a_i are exact. s is the smallest shift that brings every one of them into [-2^B, 2^B),
//! B = `bits`; then a^ = floor(a/2^s + 1/2), and d^ likewise with its own r: words in -2^B..=2^B. So near and far
//! patches use all B bits. p and e^ are exact from there on, and |e^| <= 4 2^3B: a word of 3B + 4 bits.
//!
//! **Bound.** Write |x| for the sum of magnitudes, m(x) for the sum of the two largest, A = a/2^s = a^ + alpha,
//! d/2^r = d^ + delta, with every |alpha_k|, |delta_k| <= 1/2; sigma = 0 if s = 0 (then alpha = 0), else 1; rho
//! likewise for r and delta. With u^ = a^_j - a^_i:
//!
//! ```text
//! e/2^(2s+r) = det(A_i, A_j, d^) + det(A_i, A_j, delta)
//! 1. det(A_i, A_j, d^) - e^ = alpha_i . p_j - alpha_j . p_i + d^ . (alpha_i x alpha_j)
//!      |alpha_i . p_j| <= sigma/2 |p_j|, |alpha_j . p_i| <= sigma/2 |p_i|; a component of alpha x alpha is at most
//!      1/4 + 1/4, so the last is <= sigma/2 |d^|
//! 2. det(A_i, A_j, delta) = det(A_i, A_j - A_i, delta) = (A_j - A_i) . (delta x A_i)
//!      a component of delta x A_i is at most rho/2 m(A_i), and m(A_i) <= m(a^_i) + sigma; |A_j - A_i| <= |u^| + 3
//!      sigma (a component of alpha_j - alpha_i is at most 1). The same holds with A_j for A_i: the smaller m counts
//! 3. the exact unit with rounded products takes e_K = c_K . d, 2^drop c_K = c + eps, |eps_k| <= w 2^drop, w = 1/2 to
//!      nearest, 1 for floor: |2^drop e_K - e| <= w 2^drop |d|, and |d|/2^r <= |d^| + 3/2 rho <= |d^| + 2 rho
//!
//! 2 E_ij = sigma (|p_i| + |p_j| + |d^|) + rho (|u^| + 3 sigma) (min(m(a^_i), m(a^_j)) + sigma)
//!          + [drop > 0] ceil(2w 2^(drop-2s) (|d^| + 2 rho))
//! ```
//! So the edge value whose sign the exact unit takes, over the positive 2^(2s+r) (2^(2s+r-drop) if rounded), lies in
//! [e^ - E, e^ + E]. (|a^_i x a^_j| in the place of |u^| m(a^) would be tighter, for 30 more products a quad.)
//!
//! **Verdict.** The exact test says inside when "some e < 0" and "some e > 0" differ. If the intervals make both
//! certain, so is the triangle. A quad is missed when both triangles are, and met when one is, or when its four outer
//! edges would pass as a loop: say none is negative, one positive; then e_02 <= 0 leaves the first triangle without a
//! negative edge value, e_02 >= 0 the second, and one of those two has a positive one. So nothing hangs on the
//! diagonal. Words that fit (s = r = drop = 0) have E = 0: nothing stays open. Zeros and degenerate patches need no
//! special case.
//!
//! **Behind.** With full products a hit has t d = sum w_i a_i, w_i >= 0 (the e's over den: Cramer's rule on a_0, a_1,
//! a_2). If on an axis d_k >= 0 and every a_ik < 0, then t d_k < 0, so t < 0, which the exact test refuses by sign;
//! d_k <= 0 and every a_ik > 0 likewise. Rounded products break the identity, so then this rule rests.
//!
//! **Cost** of a quad, with b = B + 2 bits signed: 24 products b x b for p, 15 of b x (2B + 3) for e^, 5 of b x (B + 3)
//! for E, where the exact test takes 30 of (F+2) x (F+2) and 15 of (K+4) x (D+1). With full products E needs 72 adders
//! of at most 2B + 5 bits and 13 comparators beside its products. It saves multipliers, not time in this emulation.
//!
//! Source: static and dynamic filters of geometric predicates (Shewchuk 1997), here in block floating point.
//! Not modelled: time, the range of t.

use super::{HitWords, PatchWords, RayWords};
use crate::fixed::{Formats, Rounding};

/// What the first test says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirstTest {
    /// Certainly no hit: the exact test is saved.
    Miss,
    /// The ray's line certainly meets the patch; the exact test is needed for t alone.
    Inside,
    /// Open: the exact test decides.
    Undecided,
}

/// The first test with words of `bits` significant bits (4..=24; it is right for any number).
pub fn first_test(formats: &Formats, bits: u32, ray: &RayWords, patch: &PatchWords) -> FirstTest {
    let a = differences(ray, patch);
    if formats.cross_drop() == 0 && is_behind(corners_of(&a, patch), ray.dir) {
        return FirstTest::Miss;
    }
    verdict(patch.is_triangle, narrow_edges(formats, bits, ray, patch))
}

/// What the first test's narrow words alone would answer, error bounds ignored: does the ray's line meet the patch?
pub fn narrow_inside(formats: &Formats, bits: u32, ray: &RayWords, patch: &PatchWords) -> bool {
    let believed = narrow_edges(formats, bits, ray, patch).map(|edge| NarrowEdge { twice_bound: 0, ..edge });
    verdict(patch.is_triangle, believed) == FirstTest::Inside
}

/// The whole dual-precision unit: equal to [`super::ray_patch::intersect`] for every input.
pub fn intersect(formats: &Formats, bits: u32, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
    match first_test(formats, bits, ray, patch) {
        FirstTest::Miss => None,
        FirstTest::Inside | FirstTest::Undecided => super::ray_patch::intersect(formats, ray, patch),
    }
}

/// An edge value in narrow words, in units of 2^(2s+r) / 2: the true one is within `twice_bound` of `twice_value`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct NarrowEdge {
    twice_value: i128,
    twice_bound: i128,
}

impl NarrowEdge {
    fn low(&self) -> i128 {
        self.twice_value - self.twice_bound
    }

    fn high(&self) -> i128 {
        self.twice_value + self.twice_bound
    }

    fn negated(self) -> NarrowEdge {
        NarrowEdge { twice_value: -self.twice_value, ..self }
    }
}

/// What the edges' intervals say of a patch.
fn verdict(is_triangle: bool, e: [NarrowEdge; 5]) -> FirstTest {
    let first = around(&[e[0], e[1], e[2].negated()]);
    if is_triangle {
        return first;
    }
    let second = around(&[e[2], e[3], e[4]]);
    let outline = around(&[e[0], e[1], e[3], e[4]]);
    if first == FirstTest::Miss && second == FirstTest::Miss {
        FirstTest::Miss
    } else if [first, second, outline].contains(&FirstTest::Inside) {
        FirstTest::Inside
    } else {
        FirstTest::Undecided
    }
}

/// The inside rule, "some e < 0" differs from "some e > 0", over the intervals of a loop of edges.
fn around(edges: &[NarrowEdge]) -> FirstTest {
    let (surely_negative, surely_positive) =
        (edges.iter().any(|e| e.high() < 0), edges.iter().any(|e| e.low() > 0));
    let (maybe_negative, maybe_positive) =
        (edges.iter().any(|e| e.low() < 0), edges.iter().any(|e| e.high() > 0));
    if surely_negative && surely_positive || !maybe_negative && !maybe_positive {
        FirstTest::Miss
    } else if surely_negative && !maybe_positive || surely_positive && !maybe_negative {
        FirstTest::Inside
    } else {
        FirstTest::Undecided
    }
}

/// Corners of the edges 01, 12, 02 of the first triangle (which runs the third backwards) and 23, 30 of the second.
const EDGES: [(usize, usize); 5] = [(0, 1), (1, 2), (0, 2), (2, 3), (3, 0)];

/// Narrow edge values with their bounds; of a triangle the first three.
#[inline]
fn narrow_edges(formats: &Formats, bits: u32, ray: &RayWords, patch: &PatchWords) -> [NarrowEdge; 5] {
    let a = differences(ray, patch);
    let s = exponent(bits, corners_of(&a, patch).iter().flatten().copied());
    let r = exponent(bits, ray.dir.iter().copied().map(i64::from));
    let a = a.map(|corner| corner.map(|word| reduce(word, s)));
    let d = ray.dir.map(|word| reduce(i64::from(word), r));
    let p = a.map(|corner| cross(corner, d));
    let (sigma, rho) = (i64::from(s > 0), i64::from(r > 0));
    let of_patch = sigma * sum_of_magnitudes(d);
    let of_products = product_rounding(formats, s, sum_of_magnitudes(d) + 2 * rho);

    let mut edges = [NarrowEdge::default(); 5];
    let n_edges = if patch.is_triangle { 3 } else { 5 };
    for (edge, (i, j)) in edges.iter_mut().zip(EDGES).take(n_edges) {
        let u = [0, 1, 2].map(|k| a[j][k] - a[i][k]);
        let of_corners = sigma * (sum_of_magnitudes(p[i]) + sum_of_magnitudes(p[j]));
        let arm = two_largest(a[i]).min(two_largest(a[j])) + sigma;
        let of_direction = rho * (sum_of_magnitudes(u) + 3 * sigma) * arm;
        *edge = NarrowEdge {
            twice_value: 2 * dot(a[i], p[j]),
            twice_bound: i128::from(of_corners + of_patch + of_direction) + of_products,
        };
    }
    edges
}

/// a_i = v_i - o, exact: F + 2 bits.
#[inline]
fn differences(ray: &RayWords, patch: &PatchWords) -> [[i64; 3]; 4] {
    patch.corners.map(|v| [0, 1, 2].map(|k| i64::from(v[k]) - i64::from(ray.origin[k])))
}

/// The corners that count.
fn corners_of<'a>(a: &'a [[i64; 3]; 4], patch: &PatchWords) -> &'a [[i64; 3]] {
    if patch.is_triangle { &a[..3] } else { a }
}

/// On some axis every corner lies on the side that the ray never reaches.
#[inline]
fn is_behind(a: &[[i64; 3]], dir: [i32; 3]) -> bool {
    (0..3).any(|k| {
        dir[k] >= 0 && a.iter().all(|corner| corner[k] < 0)
            || dir[k] <= 0 && a.iter().all(|corner| corner[k] > 0)
    })
}

/// The smallest shift that brings all words into [-2^bits, 2^bits).
#[inline]
fn exponent(bits: u32, words: impl Iterator<Item = i64>) -> u32 {
    // A negative word needs as many bits as its complement.
    let used = words.fold(0, |used, word| used | (word ^ (word >> 63)));
    (64 - used.leading_zeros()).saturating_sub(bits)
}

/// `word / 2^shift` to nearest, ties up.
#[inline]
fn reduce(word: i64, shift: u32) -> i64 {
    (word + (1 << shift >> 1)) >> shift
}

/// Twice the third part of E: how far rounded products move an edge value; `norm` bounds |d| / 2^r.
#[inline]
fn product_rounding(formats: &Formats, s: u32, norm: i64) -> i128 {
    let drop = formats.cross_drop();
    if drop == 0 {
        return 0;
    }
    let units = match formats.rounding {
        Rounding::Floor => 2 * i128::from(norm),
        Rounding::NearestEven | Rounding::HalfAway => i128::from(norm),
    };
    // Rounded up.
    -(-(units << drop) >> (2 * s))
}

/// p x q of narrow words: 2 bits + 3.
#[inline]
fn cross(p: [i64; 3], q: [i64; 3]) -> [i64; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// p . q, exact.
#[inline]
fn dot(p: [i64; 3], q: [i64; 3]) -> i128 {
    i128::from(p[0]) * i128::from(q[0])
        + i128::from(p[1]) * i128::from(q[1])
        + i128::from(p[2]) * i128::from(q[2])
}

/// |x|.
#[inline]
fn sum_of_magnitudes(x: [i64; 3]) -> i64 {
    x[0].abs() + x[1].abs() + x[2].abs()
}

/// m(x).
#[inline]
fn two_largest(x: [i64; 3]) -> i64 {
    sum_of_magnitudes(x) - x[0].abs().min(x[1].abs()).min(x[2].abs())
}

#[cfg(test)]
#[path = "first_test_tests.rs"]
mod tests;
