//! What casters share about patches: the split of quads, and how far a quad is from its two triangles.

use glam::DVec3;

use super::CastPatch;

impl CastPatch {
    /// Corner indices of the triangles that the patch is: one, or two that share the diagonal v0 v2.
    pub fn triangles(&self) -> &'static [[usize; 3]] {
        if self.is_triangle { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] }
    }
}

/// Bound on the distance (m) between a quad's bilinear surface, on which hosts compute points, and its two triangles.
///
/// Over the plane of (v0, v1, v2) the bilinear point has height h3 (1 - s) t with h3 that of v3, so at most h3;
/// over that of (v0, v2, v3) at most h1. Zero for planar quads, up to rounding.
pub(super) fn bend_m(patches: &[CastPatch]) -> f64 {
    let height = |plane: [DVec3; 3], corner: DVec3| {
        let normal = (plane[1] - plane[0]).cross(plane[2] - plane[0]).normalize_or_zero();
        normal.dot(corner - plane[0]).abs()
    };
    let bend = |p: &CastPatch| {
        let [v0, v1, v2, v3] = p.corners;
        height([v0, v1, v2], v3).max(height([v0, v2, v3], v1))
    };
    patches.iter().filter(|p| !p.is_triangle).map(bend).filter(|b| b.is_finite()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bend_of_a_planar_trapezoid_is_zero_and_of_a_lifted_corner_its_height() {
        let trapezoid = |z| CastPatch {
            corners: [
                DVec3::ZERO,
                DVec3::new(4.0, 0.0, 0.0),
                DVec3::new(3.0, 1.0, 0.0),
                DVec3::new(1.0, 1.0, z),
            ],
            is_triangle: false,
        };
        assert!(bend_m(&[trapezoid(0.0)]) < 1e-15);
        let lifted = bend_m(&[trapezoid(1e-6)]);
        // v3 is 1e-6 over its plane; v1 lies farther from the diagonal and so farther off the other one.
        assert!((1e-6..4e-6).contains(&lifted), "{lifted:e}");
    }
}
