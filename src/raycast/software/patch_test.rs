//! Ray x patch in f64 with certified signs: no ray slips between neighbours, at an edge or at a vertex.
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

use crate::raycast::{CastPatch, Facing};

/// What a ray carries to the patch test.
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

/// One patch: a triangle, or two that share the diagonal v0 v2, five edges in all.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Patch {
    corners: [DVec3; 4],
    /// Its id.
    pub id: u32,
    is_triangle: bool,
}

impl Patch {
    pub fn new(patch: &CastPatch, id: u32) -> Patch {
        Patch { corners: patch.corners, id, is_triangle: patch.is_triangle }
    }

    /// The nearest place in `t_min..=t_max` where the ray meets the patch: t and the side.
    #[inline]
    pub fn intersect(&self, ray: &TestRay, t_min: f64, t_max: f64) -> Option<(f64, Facing)> {
        let [v0, v1, v2, v3] = self.corners;
        let (a0, a1, a2) = (v0 - ray.origin, v1 - ray.origin, v2 - ray.origin);
        let diagonal = edge_value(a2, a0, ray.dir);
        let first = [edge_value(a0, a1, ray.dir), edge_value(a1, a2, ray.dir), diagonal];
        let range = [t_min, t_max];
        let in_range = |hit: &(f64, Facing)| hit.0 >= t_min && hit.0 <= t_max;
        let hit = intersect([v0, v1, v2], [a0, a1, a2], first, ray, range).filter(in_range);
        if self.is_triangle {
            return hit;
        }
        let a3 = v3 - ray.origin;
        let second = [-diagonal, edge_value(a2, a3, ray.dir), edge_value(a3, a0, ray.dir)];
        match (hit, intersect([v0, v2, v3], [a0, a2, a3], second, ray, range).filter(in_range)) {
            (Some(a), Some(b)) => Some(if b.0 < a.0 { b } else { a }),
            (a, b) => a.or(b),
        }
    }
}

/// Where the ray's line meets a triangle with corners `v`, seen from the origin at `a`, and edge values `e`; `None`, too,
/// where it is certain that it meets the plane outside of the `range` of t.
#[inline]
fn intersect(
    v: [DVec3; 3],
    a: [DVec3; 3],
    e: [f64; 3],
    ray: &TestRay,
    range: [f64; 2],
) -> Option<(f64, Facing)> {
    let bound = ray.edge_error;
    let some_negative = e[0] < -bound || e[1] < -bound || e[2] < -bound;
    let some_positive = e[0] > bound || e[1] > bound || e[2] > bound;
    if some_negative && some_positive {
        return None;
    }
    let certain = e.iter().all(|x| x.abs() > bound);
    // From the corners, not from the rounded a_i: as good however far the triangle is.
    let normal = (v[1] - v[0]).cross(v[2] - v[0]);
    let den = dot(normal, ray.dir);
    if certain && den != 0.0 && (den > 0.0) == some_positive {
        let t = dot(normal, a[0]) / den;
        return Some((t, if den < 0.0 { Facing::Front } else { Facing::Back }));
    }
    if stays_beside_plane(&v, a[0], ray, range) {
        return None;
    }
    intersect_near_edge(&a, &e, ray)
}

/// True when both ends of the ray's range certainly lie on one side of the triangle's plane: shadow rays to vertices meet
/// the patches around them in edges, just past their ends, and need no exact signs.
///
/// The side at t is n . (a - t d). A component of n is off by 4 u N, N the sum of the magnitudes of its two products; a,
/// the dot product and t d add 4 u: under 9 u sum N (|a| + t |d|) in all.
#[cold]
#[inline(never)]
fn stays_beside_plane(v: &[DVec3; 3], a: DVec3, ray: &TestRay, [t_min, t_max]: [f64; 2]) -> bool {
    const ERROR: f64 = 9.0 * f64::EPSILON / 2.0;
    let (e1, e2) = (v[1] - v[0], v[2] - v[0]);
    let normal = e1.cross(e2);
    let (m1, m2) = (e1.abs(), e2.abs());
    let magnitude =
        DVec3::new(m1.y * m2.z + m1.z * m2.y, m1.z * m2.x + m1.x * m2.z, m1.x * m2.y + m1.y * m2.x);
    let (at_origin, falls) = (dot(normal, a), dot(normal, ray.dir));
    let (error, falls_error) = (ERROR * dot(magnitude, a.abs()), ERROR * dot(magnitude, ray.dir.abs()));
    // -1, 1, or 0 where it is not certain; of an endless ray the side that it runs to.
    let side = |t: f64| {
        let (value, error) = match t.is_finite() {
            true => (at_origin - t * falls, error + t.abs() * falls_error),
            false => (-falls, falls_error),
        };
        f64::from(i8::from(value > error) - i8::from(value < -error))
    };
    side(t_min) * side(t_max) > 0.0
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

    fn unit() -> Patch {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Y];
        Patch::new(&CastPatch { corners, is_triangle: true }, 0)
    }

    fn cast(t: &Patch, o: DVec3, d: DVec3) -> Option<(f64, Facing)> {
        t.intersect(&TestRay::new(o, d, 16.0), 0.0, f64::INFINITY)
    }

    #[test]
    fn bent_quad_seen_along_its_fold_answers_with_the_nearer_triangle_in_range() {
        // A roof with its ridge along the diagonal: a ray level through it meets both slopes.
        let corners =
            [DVec3::ZERO, DVec3::new(1.0, -1.0, -1.0), DVec3::new(2.0, 0.0, 0.0), DVec3::new(1.0, 1.0, -1.0)];
        let roof = Patch::new(&CastPatch { corners, is_triangle: false }, 0);
        let ray = TestRay::new(DVec3::new(1.0, -2.0, -0.5), DVec3::Y, 4.0);
        assert_eq!(roof.intersect(&ray, 0.0, 9.0), Some((1.5, Facing::Front)));
        assert_eq!(roof.intersect(&ray, 2.0, 9.0), Some((2.5, Facing::Back)));
        assert_eq!(roof.intersect(&ray, 1.6, 2.4), None);
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
    fn shadow_ray_to_just_before_a_corner_is_free_and_to_just_behind_it_blocked() {
        let t = unit();
        let origin = DVec3::new(0.3, -0.2, 1.7);
        for corner in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.25, 0.0, 0.0)]
        {
            for (lift, blocked) in
                [(1e-14, false), (1e-9, false), (-1e-9, true), (-1e-14, true), (-1e-15, true)]
            {
                // Through the corner itself, so that edge values vanish, with its end before or behind it.
                let d = corner - origin;
                let ray = TestRay::new(origin, d, 16.0);
                let hit = t.intersect(&ray, 0.0, 1.0 - lift);
                assert_eq!(hit.is_some(), blocked, "{corner}, {lift:e}");
            }
        }
        let away = TestRay::new(origin, origin, 16.0);
        assert_eq!(t.intersect(&away, 0.0, f64::INFINITY), None);
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
        /// Corners, origin and direction in integers: the sides of the ends are exact in i128.
        #[test]
        fn ray_that_stays_beside_a_plane_does_so_in_integers(
            v in prop::array::uniform3(prop::array::uniform3(-(1i64 << 20)..1 << 20)),
            weights in prop_oneof![Just([1, 0, 0]), Just([0, 0, 1]), prop::array::uniform3(0i64..8)],
            lift in prop_oneof![Just([0; 3]), prop::array::uniform3(-2i64..3)],
            origin in prop::array::uniform3(-(1i64 << 20)..1 << 20), endless: bool,
        ) {
            // The end lies in the plane, or next to it.
            let total: i64 = weights.iter().sum::<i64>().max(1);
            let end: [i64; 3] = std::array::from_fn(|i| {
                (0..3).map(|k| weights[k] * v[k][i]).sum::<i64>() / total + lift[i]
            });
            let d: [i64; 3] = std::array::from_fn(|i| end[i] - origin[i]);
            let f = |x: [i64; 3]| DVec3::new(x[0] as f64, x[1] as f64, x[2] as f64);
            let minus = |a: [i64; 3], b: [i64; 3]| -> [i64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
            let (e1, e2) = (minus(v[1], v[0]), minus(v[2], v[0]));
            let side = |p: [i64; 3]| exact_in_integers(e1, e2, minus(v[0], p)).signum();
            let last = if endless { -exact_in_integers(e1, e2, d).signum() } else { side(end) };
            let ray = TestRay::new(f(origin), f(d), (1 << 22) as f64);
            let t_max = if endless { f64::INFINITY } else { 1.0 };
            if stays_beside_plane(&v.map(f), f(v[0]) - f(origin), &ray, [0.0, t_max]) {
                prop_assert_eq!(side(origin) * last, 1);
            } else {
                // It gives up only next to the plane: within 2^-40 of the sizes.
                let size = f64::from(1 << 22).powi(3) * 2f64.powi(-40);
                let value = |p: [i64; 3]| exact_in_integers(e1, e2, minus(v[0], p)) as f64;
                let near = |x: f64| x.abs() < size;
                let last_value = if endless { exact_in_integers(e1, e2, d) as f64 } else { value(end) };
                prop_assert!(side(origin) * last != 1 || near(value(origin)) || near(last_value));
            }
        }

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
