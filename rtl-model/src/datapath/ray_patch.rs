//! Ray x patch: the ICU's function.
//!
//! ```text
//! v_i, o -> a_i = v_i - o -> c_ij = a_i x a_j (rounded to K bits) -> e_ij = c_ij . d -> signs -> inside?
//!                                      n = sum c, den = sum e, num = a_0 . n -> t = num / den, rounded once -> range
//! ```
//! A quad is the triangles v0 v1 v2 and v0 v2 v3. Their common edge is computed once, as v0 v2, and negated for the
//! first, so a quad has no gap inside it in any rounding mode. A hit behind the origin is refused by the exact sign of
//! num/den, then the rounded t is held against t_max. (Rounding first would let through t in [-1/2, 0) steps, a point
//! outside every cell that the ray enters.) Widths: [`crate::fixed::Formats::width_table`].
//! Source: edge functions by triple products as in Segura, Feito 2001. Not modelled: pipeline stages, time.
//!
//! # No ray escapes from a closed mesh
//!
//! With full products, at any widths and in any rounding mode. *Closed*: every edge, quad diagonals included, belongs to
//! an even number of triangles, with the same words for its ends in all of them; triangles may face either way, cross
//! each other or have no area. *Inside*: the origin o lies on no triangle, and a ray from o that meets no edge crosses
//! an odd number of triangles.
//!
//! 1. e_ij = det(a_i, a_j, d), exactly: on which side of the plane through o and the edge d points. It depends on the
//!    edge's two corners and the ray alone and changes only its sign with their order, so all triangles at an edge see
//!    the same value, and all edges around a corner are judged by one exact geometry.
//! 2. Take directions d_1, d_2, ... that tend to d and lie in no plane through o and an edge. Each of these rays crosses
//!    an odd number of triangles, so at least one, and there are finitely many: one triangle is crossed by infinitely
//!    many of them, at t > 0. It has an area, and o is not in its plane: a ray from o that is not in that plane meets
//!    the plane in o only, and o is on no triangle.
//! 3. For these rays its three e have one strict sign, the same for all (that of num). In the limit d none has the
//!    other sign: this is why "inside" is "none negative or none positive" and not "all of one sign". A strict test
//!    loses the rays through edges and corners; one that takes only one of the signs loses the triangles that face the
//!    other way.
//! 4. Not all three are 0: o is not in the triangle's plane, so a_0, a_1, a_2 are independent, and so are their cross
//!    products; d would have to be 0. Hence den, a sum of values of one sign, is not 0, its sign is that of
//!    num = a_0 . n = det(a_0, a_1, a_2), which is not 0 either, and t = num/den > 0 is a hit. Its point is in the cube,
//!    so t < 4 when the largest |d| is at least 1/2, and a t_max of 4 keeps it.
//!
//! All three e are 0 in two cases, and dropping them loses nothing, as step 2 never picks such a triangle: one without
//! area, and one seen edge-on, whose plane holds the ray. Accepting them would divide 0 by 0. A ray in the plane of a
//! face hits the neighbours across that face's edges instead.
//!
//! Rounded edge normals keep step 1 only in part. Rounding to nearest is odd, round(-c) = -round(c), so neighbours
//! still agree about a common edge; but the values of the edges around a corner are those of different, slightly turned
//! planes, and when all of them get one strict sign, no triangle of the fan has the ray. A floor is not odd: the two
//! sides of an edge may both refuse the ray. In a T-junction, a corner w rounded beside an edge uv of its neighbour,
//! the edges uv, uw, wv occur once each: the mesh is not closed, and the gap is the triangle u w v, up to about a step
//! wide. `tests/watertight.rs` checks all this, `examples/leak_rates.rs` measures what rounding loses.

use super::{Facing, HitWords, PatchWords, RayWords};
use crate::fixed::{Formats, clamp_to_i64};

/// Edges of a quad in the order of [`Taps::c`] and [`Taps::e`].
const EDGE_01: usize = 0;
const EDGE_12: usize = 1;
const EDGE_02: usize = 2;
const EDGE_23: usize = 3;
const EDGE_30: usize = 4;

/// Tests one ray with one patch.
#[inline]
pub fn intersect(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
    SeenPatch::new(formats, ray.origin, patch).test(formats, ray.dir, ray.t_max)
}

/// A patch as seen from an origin: what its tests with all rays of a bundle have in common.
///
/// In hardware the first stages of the pipe, computed anew for each test; here once for all rays with one apex. Besides
/// the integers it keeps them as f64, for a first look at the signs of the edge values: e' = sum c_k d_k in f64 differs
/// from the exact e by less than 8 2^-53 sum |c_k| |d_k| (rounding of three words of c, exact words of d, three products,
/// two sums, to first order 5 2^-53), so with `SIGN_MARGIN` times that sum between e' and 0 its sign is e's. Where any
/// sign of a patch is in doubt, or the ray is inside, the integers decide.
#[derive(Clone, Debug)]
pub struct SeenPatch {
    a0: [i64; 3],
    /// Edges 01, 12, 02, 23, 30; of a triangle 01, 12, 20 and zeros.
    c: [[i64; 3]; 5],
    /// The same by component, edges side by side; a sixth of zeros fills the vector.
    c_f64: [[f64; 6]; 3],
    is_triangle: bool,
    id: u32,
}

/// Share of sum |c_k| |d_k| beyond which the sign of an edge value in f64 is certain: twice the bound, a power of two.
const SIGN_MARGIN: f64 = 1.0 / (1_u64 << 49) as f64;

impl SeenPatch {
    /// The patch as seen from `origin`.
    #[inline]
    pub fn new(formats: &Formats, origin: [i32; 3], patch: &PatchWords) -> SeenPatch {
        let a = patch.corners.map(|corner| translate(corner, origin));
        let edge = |i: usize, j: usize| edge_normal(formats, a[i], a[j]);
        let c = if patch.is_triangle {
            [edge(0, 1), edge(1, 2), edge(2, 0), [0; 3], [0; 3]]
        } else {
            [edge(0, 1), edge(1, 2), edge(0, 2), edge(2, 3), edge(3, 0)]
        };
        let mut c_f64 = [[0.0; 6]; 3];
        for (k, row) in c_f64.iter_mut().enumerate() {
            for (word, normal) in row.iter_mut().zip(&c) {
                *word = normal[k] as f64;
            }
        }
        SeenPatch { a0: a[0], c, c_f64, is_triangle: patch.is_triangle, id: patch.id }
    }

    /// Tests a ray from that origin.
    #[inline]
    pub fn test(&self, formats: &Formats, dir: [i32; 3], t_max: u64) -> Option<HitWords> {
        if self.is_surely_missed(dir) {
            return None;
        }
        self.test_exactly(formats, dir, t_max)
    }

    /// True when the signs of the edge values are certain and those of a miss.
    #[inline]
    fn is_surely_missed(&self, dir: [i32; 3]) -> bool {
        let d = dir.map(f64::from);
        let size = d.map(f64::abs);
        let [x, y, z] = &self.c_f64;
        let (mut negative, mut positive) = (0_u32, 0_u32);
        for i in 0..5 {
            let e = x[i] * d[0] + y[i] * d[1] + z[i] * d[2];
            let margin = SIGN_MARGIN * (x[i].abs() * size[0] + y[i].abs() * size[1] + z[i].abs() * size[2]);
            negative |= u32::from(e < -margin) << i;
            positive |= u32::from(e > margin) << i;
        }
        if self.is_triangle {
            return (negative & 0b111 != 0) & (positive & 0b111 != 0);
        }
        // Of the first triangle the diagonal runs the other way round.
        let first = 0b011;
        let (first_negative, first_positive) =
            (negative & first | (positive & 0b100), positive & first | (negative & 0b100));
        let second = 0b1_1100;
        (first_negative != 0) & (first_positive != 0) & (negative & second != 0) & (positive & second != 0)
    }

    /// The test in integers alone.
    fn test_exactly(&self, formats: &Formats, dir: [i32; 3], t_max: u64) -> Option<HitWords> {
        let e = self.c.map(|c| dot(c, dir));
        if self.is_triangle {
            let [e01, e12, e20, ..] = e;
            let [c01, c12, c20, ..] = self.c;
            return inside(e01, e12, e20)
                .then(|| self.triangle(formats, t_max, [c01, c12, c20], e01 + e12 + e20))
                .flatten();
        }
        let [e01, e12, e02, e23, e30] = e;
        let first = inside(e01, e12, -e02).then(|| {
            let c20 = self.c[EDGE_02].map(|word| -word);
            self.triangle(formats, t_max, [self.c[EDGE_01], self.c[EDGE_12], c20], e01 + e12 - e02)
        });
        let second = inside(e02, e23, e30).then(|| {
            let c = [self.c[EDGE_02], self.c[EDGE_23], self.c[EDGE_30]];
            self.triangle(formats, t_max, c, e02 + e23 + e30)
        });
        // One id: equal t keeps the first triangle.
        HitWords::nearer(first.flatten(), second.flatten())
    }

    /// The second half of the pipe: distance, division, range test of a triangle whose inside the ray's line meets.
    fn triangle(&self, formats: &Formats, t_max: u64, c: [[i64; 3]; 3], den: i128) -> Option<HitWords> {
        let num = dot_wide(face_normal(c), self.a0);
        if num != 0 && (num < 0) != (den < 0) {
            return None;
        }
        let (up, down) = formats.t_shifts();
        let t = u64::try_from(formats.rounding.divide(num << up, den << down)).ok()?;
        let facing = if den < 0 { Facing::Front } else { Facing::Back };
        (t <= t_max).then_some(HitWords { t, patch: self.id, facing })
    }
}

/// a = v - o: F + 2 bits.
#[inline]
fn translate(corner: [i32; 3], origin: [i32; 3]) -> [i64; 3] {
    [0, 1, 2].map(|k| i64::from(corner[k]) - i64::from(origin[k]))
}

/// c = a_i x a_j, exact in 2F + 4 <= 60 bits, then rounded to K fraction bits.
#[inline]
fn edge_normal(formats: &Formats, p: [i64; 3], q: [i64; 3]) -> [i64; 3] {
    let exact = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    match formats.cross_drop() {
        0 => exact,
        drop => exact.map(|word| clamp_to_i64(formats.rounding.shift_right(i128::from(word), drop))),
    }
}

/// e = c . d: K + D + 6 bits, from products of 64 x 32 bits.
#[inline]
fn dot(c: [i64; 3], d: [i32; 3]) -> i128 {
    dot_wide(c, d.map(i64::from))
}

/// A dot product from 64 x 64 bit products.
#[inline]
fn dot_wide(p: [i64; 3], q: [i64; 3]) -> i128 {
    i128::from(p[0]) * i128::from(q[0])
        + i128::from(p[1]) * i128::from(q[1])
        + i128::from(p[2]) * i128::from(q[2])
}

/// No edge value negative or none positive, and not all 0. Then their sum, den, is not 0.
#[inline]
fn inside(e0: i128, e1: i128, e2: i128) -> bool {
    let any_negative = (e0 < 0) | (e1 < 0) | (e2 < 0);
    let any_positive = (e0 > 0) | (e1 > 0) | (e2 > 0);
    any_negative != any_positive
}

/// n = c_0 + c_1 + c_2: K + 4 bits.
#[inline]
fn face_normal(c: [[i64; 3]; 3]) -> [i64; 3] {
    [0, 1, 2].map(|k| c[0][k] + c[1][k] + c[2][k])
}

/// Inner wires of one test, for debugging, waveforms and the width test; not record fields.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Taps {
    /// Corners relative to the origin.
    pub a: [[i64; 3]; 4],
    /// Rounded normals of the edges 01, 12, 02, 23, 30 (for a triangle 01, 12, 20 and zeros).
    pub c: [[i64; 3]; 5],
    /// Their edge values.
    pub e: [i128; 5],
    /// The triangles v0 v1 v2 and, of a quad, v0 v2 v3.
    pub triangles: [Option<TriangleTaps>; 2],
}

/// Wires of one triangle of a patch, computed whether the ray is inside or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleTaps {
    /// The ray's line meets the triangle.
    pub inside: bool,
    /// Face normal.
    pub n: [i64; 3],
    /// Sum of the edge values.
    pub den: i128,
    /// a_0 . n.
    pub num: i128,
    /// Dividend.
    pub num_shifted: i128,
    /// Divisor.
    pub den_shifted: i128,
}

/// The wires of a test, by the functions that [`intersect`] is made of.
pub fn taps(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> Taps {
    let a = patch.corners.map(|corner| translate(corner, ray.origin));
    let pairs: &[(usize, usize)] =
        if patch.is_triangle { &[(0, 1), (1, 2), (2, 0)] } else { &[(0, 1), (1, 2), (0, 2), (2, 3), (3, 0)] };
    let (mut c, mut e) = ([[0; 3]; 5], [0; 5]);
    for (k, (i, j)) in pairs.iter().enumerate() {
        c[k] = edge_normal(formats, a[*i], a[*j]);
        e[k] = dot(c[k], ray.dir);
    }
    let (up, down) = formats.t_shifts();
    let wires = |normals: [[i64; 3]; 3], values: [i128; 3]| {
        let n = face_normal(normals);
        let (den, num) = (values.iter().sum::<i128>(), dot_wide(n, a[0]));
        let inside = inside(values[0], values[1], values[2]);
        TriangleTaps { inside, n, den, num, num_shifted: num << up, den_shifted: den << down }
    };
    let triangles = if patch.is_triangle {
        [Some(wires([c[0], c[1], c[2]], [e[0], e[1], e[2]])), None]
    } else {
        let c20 = c[EDGE_02].map(|word| -word);
        [
            Some(wires([c[EDGE_01], c[EDGE_12], c20], [e[EDGE_01], e[EDGE_12], -e[EDGE_02]])),
            Some(wires([c[EDGE_02], c[EDGE_23], c[EDGE_30]], [e[EDGE_02], e[EDGE_23], e[EDGE_30]])),
        ]
    };
    Taps { a, c, e, triangles }
}

#[cfg(test)]
#[path = "ray_patch_tests.rs"]
mod tests;
