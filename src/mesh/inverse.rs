//! From a point to (s,t): the inverse of the bilinear map of a convex quad, and of a triangle's weights.
//!
//! ```text
//! p = a + s b + t c + s t d  --cross with (c + s d)-->  A s^2 + B s + C = 0, A = -b x d, B = q x d - b x c, C = q x c
//! ```
//! with q = p - a, in the plane of the facet. At the root inside a convex quad the derivative 2 A s + B is minus the
//! Jacobian, hence negative: s = 2 C / (sqrt(B^2 - 4 A C) - B), which has no cancellation when A vanishes
//! (parallelograms and trapezoids). One Newton step takes rounding off.

use glam::DVec2;

use crate::geom::DVec3;

/// Square of the bend, as a share of a side, up to which a quad is a parallelogram: s and t are off by no more than its root.
const PARALLELOGRAM_SHARE: f64 = 1e-28;

/// Weights (s,t) of corners 1 and 2 at the point of the triangle nearest to `p` in its plane.
pub(super) fn triangle_st(corners: &[DVec3; 3], p: DVec3) -> DVec2 {
    let (u, v) = (corners[1] - corners[0], corners[2] - corners[0]);
    let n = u.cross(v);
    let q = p - corners[0];
    let scale = n.length_squared();
    if scale == 0.0 {
        return DVec2::ZERO;
    }
    let (s, t) = (q.cross(v).dot(n) / scale, u.cross(q).dot(n) / scale);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return DVec2::new(s, t);
    }
    // Outside: the nearest point of the border.
    let ends = [DVec2::ZERO, DVec2::X, DVec2::Y];
    let mut best = (f64::INFINITY, DVec2::ZERO);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let k = ((p - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let distance = (a + k * (b - a)).distance_squared(p);
        if distance < best.0 {
            best = (distance, ends[i].lerp(ends[(i + 1) % 3], k));
        }
    }
    best.1
}

/// (s,t) of the quad at `p`, clamped to the unit square.
pub(super) fn quad_st(corners: &[DVec3; 4], p: DVec3) -> DVec2 {
    let bend = corners[0] - corners[1] + corners[2] - corners[3];
    let (along_s, along_t) = (corners[1] - corners[0], corners[3] - corners[0]);
    if bend.length_squared() <= PARALLELOGRAM_SHARE * along_s.length_squared().min(along_t.length_squared()) {
        let n = along_s.cross(along_t);
        let q = p - corners[0];
        let st = DVec2::new(q.cross(along_t).dot(n), along_s.cross(q).dot(n)) / n.length_squared();
        return if st.is_finite() { st.clamp(DVec2::ZERO, DVec2::ONE) } else { DVec2::splat(0.5) };
    }
    let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
    let e1 = (corners[2] - corners[0]).normalize_or_zero();
    let e2 = normal.cross(e1).normalize_or_zero();
    let flat = |v: DVec3| DVec2::new(v.dot(e1), v.dot(e2));
    bilinear_st(
        flat(p - corners[0]),
        [corners[1] - corners[0], corners[3] - corners[0], corners[0] - corners[1] + corners[2] - corners[3]]
            .map(flat),
    )
}

/// (s,t) where `q` = s b + t c + s t d, clamped to the unit square.
#[inline]
pub(super) fn bilinear_st(q: DVec2, [b, c, d]: [DVec2; 3]) -> DVec2 {
    let (a2, a1, a0) = (-b.perp_dot(d), q.perp_dot(d) - b.perp_dot(c), q.perp_dot(c));
    let root = (a1 * a1 - 4.0 * a2 * a0).max(0.0).sqrt();
    let s = if a1 <= 0.0 { 2.0 * a0 / (root - a1) } else { (-a1 - root) / (2.0 * a2) };
    let s = if s.is_finite() { s.clamp(0.0, 1.0) } else { 0.5 };
    let across = c + s * d;
    let t = (q - s * b).dot(across) / across.length_squared();
    let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 };

    let (x_s, x_t) = (b + t * d, c + s * d);
    let left = q - (s * b + t * c + s * t * d);
    let jacobian = x_s.perp_dot(x_t);
    let step = DVec2::new(left.perp_dot(x_t), x_s.perp_dot(left)) / jacobian;
    let polished = DVec2::new(s, t) + step;
    // Far outside points are not on the quad: the step only polishes.
    let st = if step.is_finite() && step.length() < 1e-3 { polished } else { DVec2::new(s, t) };
    st.clamp(DVec2::ZERO, DVec2::ONE)
}
