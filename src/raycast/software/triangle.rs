//! Ray x triangle in f64 with certified signs: no ray slips between neighbours, at an edge or at a vertex.
//!
//! ```text
//! o, d, v0..v2 --a_i = v_i - o--> e_i = (a_i x a_{i+1}) . d --signs--> inside? --> t, facing
//! ```
//! The sign of e_i is that of the exact determinant of the rounded a_i: neighbours see the same a_i, so their signs
//! are those of one exact geometry and the fan around a vertex has no gap. f64 decides when |e_i| exceeds its error
//! bound; else an expansion (Shewchuk 1997) does. Both signs of all e_i count (both sides block), all zero misses.
//!
//! Error bound: with m >= every |a_i| component and u = 2^-53, a cross component carries at most 4 u m^2, and the
//! dot product adds 6 u m^2 per |d| component: |error| <= 10 u m^2 (|dx| + |dy| + |dz|) (1 + O(u)).
//! Not covered: products below 1e-290, which the caster's limits on directions exclude.

use glam::DVec3;

use crate::raycast::Facing;

/// What a ray carries to the triangle test.
#[derive(Clone, Copy, Debug)]
pub(super) struct TestRay {
    /// Origin (m).
    pub origin: DVec3,
    /// Direction as the host gave it.
    pub dir: DVec3,
    /// Bound on the rounding error of any edge value of this ray.
    pub edge_error: f64,
}

impl TestRay {
    /// `reach_m`: largest |component| of (corner - origin) over the scene.
    pub fn new(origin: DVec3, dir: DVec3, reach_m: f64) -> TestRay {
        let l1 = dir.x.abs() + dir.y.abs() + dir.z.abs();
        TestRay { origin, dir, edge_error: 11.0 * (f64::EPSILON / 2.0) * reach_m * reach_m * l1 }
    }
}

/// One triangle of a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    corners: [DVec3; 3],
    normal: DVec3,
    /// The patch it belongs to.
    pub patch: u32,
}

impl Triangle {
    pub fn new(corners: [DVec3; 3], patch: u32) -> Triangle {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        Triangle { corners, normal, patch }
    }

    /// Where the ray's line meets the triangle: t (may be negative) and the side; the range is the caller's.
    #[inline]
    pub fn intersect(&self, ray: &TestRay) -> Option<(f64, Facing)> {
        let a = self.corners.map(|v| v - ray.origin);
        let e = [
            edge_value(a[0], a[1], ray.dir),
            edge_value(a[1], a[2], ray.dir),
            edge_value(a[2], a[0], ray.dir),
        ];
        let least = e[0].min(e[1]).min(e[2]);
        let most = e[0].max(e[1]).max(e[2]);
        let bound = ray.edge_error;
        if least < -bound && most > bound {
            return None;
        }
        let certain = least > bound || most < -bound;
        let den = dot(self.normal, ray.dir);
        if certain && den != 0.0 && (den > 0.0) == (least > bound) {
            let t = dot(self.normal, a[0]) / den;
            return Some((t, if den < 0.0 { Facing::Front } else { Facing::Back }));
        }
        intersect_near_edge(&a, &e, ray)
    }
}

/// The rare case: an edge value too small for f64. Exact signs; t as the weighted mean of the corners' t, which
/// stays between them however flat the triangle is seen.
#[cold]
#[inline(never)]
fn intersect_near_edge(a: &[DVec3; 3], e: &[f64; 3], ray: &TestRay) -> Option<(f64, Facing)> {
    let mut exact = *e;
    for i in 0..3 {
        if e[i].abs() <= ray.edge_error {
            exact[i] = edge_value_exact(a[i], a[(i + 1) % 3], ray.dir);
        }
    }
    let negative = exact.iter().any(|&x| x < 0.0);
    let positive = exact.iter().any(|&x| x > 0.0);
    if negative == positive {
        return None;
    }
    let along = a.map(|p| dot(p, ray.dir));
    let weight = exact[0] + exact[1] + exact[2];
    let (w0, w1, w2) = (exact[1] / weight, exact[2] / weight, exact[0] / weight);
    let t = (w0 * along[0] + w1 * along[1] + w2 * along[2]) / dot(ray.dir, ray.dir);
    Some((t, if negative { Facing::Front } else { Facing::Back }))
}

/// `(a x b) . d`, without fused operations: swapping a and b negates every intermediate exactly.
#[inline]
fn edge_value(a: DVec3, b: DVec3, d: DVec3) -> f64 {
    (a.y * b.z - a.z * b.y) * d.x + (a.z * b.x - a.x * b.z) * d.y + (a.x * b.y - a.y * b.x) * d.z
}

#[inline]
fn dot(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// `(a x b) . d` as an exact sum of 24 terms, rounded at the end: the sign is that of the real number.
fn edge_value_exact(a: DVec3, b: DVec3, d: DVec3) -> f64 {
    let mut sum = Expansion::default();
    for (x, y, z) in [(a.y, b.z, d.x), (a.z, b.x, d.y), (a.x, b.y, d.z)] {
        sum.add_product(x, y, z);
    }
    for (x, y, z) in [(a.z, b.y, d.x), (a.x, b.z, d.y), (a.y, b.x, d.z)] {
        sum.add_product(-x, y, z);
    }
    sum.estimate()
}

/// A sum of non-overlapping f64, smallest first.
#[derive(Default)]
struct Expansion {
    terms: [f64; 24],
    n: usize,
}

impl Expansion {
    fn add_product(&mut self, x: f64, y: f64, z: f64) {
        let (p, p_low) = two_product(x, y);
        for part in [p_low, p] {
            let (q, q_low) = two_product(part, z);
            self.add(q_low);
            self.add(q);
        }
    }

    fn add(&mut self, value: f64) {
        let mut carry = value;
        for term in &mut self.terms[..self.n] {
            (carry, *term) = two_sum(carry, *term);
        }
        self.terms[self.n] = carry;
        self.n += 1;
    }

    fn estimate(&self) -> f64 {
        self.terms[..self.n].iter().sum()
    }
}

fn two_product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    (p, a.mul_add(b, -p))
}

fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> Triangle {
        Triangle::new([DVec3::ZERO, DVec3::X, DVec3::Y], 0)
    }

    fn cast(t: &Triangle, o: DVec3, d: DVec3) -> Option<(f64, Facing)> {
        t.intersect(&TestRay::new(o, d, 16.0))
    }

    #[test]
    fn triangle_seen_against_its_normal_answers_front_at_the_plane() {
        let hit = cast(&unit(), DVec3::new(0.25, 0.25, 2.0), DVec3::new(0.0, 0.0, -0.5));
        assert_eq!(hit, Some((4.0, Facing::Front)));
        let hit = cast(&unit(), DVec3::new(0.25, 0.25, -1.0), DVec3::Z);
        assert_eq!(hit, Some((1.0, Facing::Back)));
    }

    #[test]
    fn triangle_at_its_corner_and_edge_answers_and_beyond_does_not() {
        for p in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.5, 0.0, 0.0)] {
            assert_eq!(cast(&unit(), p + DVec3::Z, DVec3::NEG_Z), Some((1.0, Facing::Front)), "{p}");
        }
        assert_eq!(cast(&unit(), DVec3::new(0.5, -1e-300, 1.0), DVec3::NEG_Z), None);
        assert_eq!(cast(&unit(), DVec3::new(0.5, -1e-14, 1.0), DVec3::NEG_Z), None);
    }

    #[test]
    fn triangle_in_the_plane_of_the_ray_misses() {
        assert_eq!(cast(&unit(), DVec3::new(-1.0, 0.25, 0.0), DVec3::X), None);
    }

    /// Integers below 2^20 multiply exactly in i128: a second implementation of the determinant.
    fn exact_in_integers(a: [i64; 3], b: [i64; 3], d: [i64; 3]) -> i128 {
        let w = |x: i64| i128::from(x);
        (w(a[1]) * w(b[2]) - w(a[2]) * w(b[1])) * w(d[0])
            + (w(a[2]) * w(b[0]) - w(a[0]) * w(b[2])) * w(d[1])
            + (w(a[0]) * w(b[1]) - w(a[1]) * w(b[0])) * w(d[2])
    }

    proptest! {
        #[test]
        fn edge_value_exact_of_integers_has_the_sign_of_the_integer_determinant(
            a in prop::array::uniform3(-(1i64 << 40)..1 << 40), b in prop::array::uniform3(-(1i64 << 40)..1 << 40),
            k in -3i64..4, l in -3i64..4, wiggle in prop::array::uniform3(-1i64..2),
        ) {
            // d nearly in the plane of a and b, so that f64 alone cannot tell.
            let d: [i64; 3] = std::array::from_fn(|i| (k * a[i] + l * b[i]) / 8 + wiggle[i]);
            let v = |x: [i64; 3]| DVec3::new(x[0] as f64, x[1] as f64, x[2] as f64);
            let want = exact_in_integers(a, b, d).signum() as f64;
            let got = edge_value_exact(v(a), v(b), v(d));
            prop_assert_eq!(if got == 0.0 { 0.0 } else { got.signum() }, want);
            // The reverse edge negates, and f64 lies within its bound.
            prop_assert_eq!(edge_value_exact(v(b), v(a), v(d)), -got);
            prop_assert_eq!(edge_value(v(b), v(a), v(d)), -edge_value(v(a), v(b), v(d)));
            let m = v(a).abs().max_element().max(v(b).abs().max_element());
            let bound = TestRay::new(DVec3::ZERO, v(d), m).edge_error;
            prop_assert!((edge_value(v(a), v(b), v(d)) - got).abs() <= bound);
        }
    }
}
