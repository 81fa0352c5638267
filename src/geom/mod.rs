//! Points, rays and polygons in metres, f64. Vectors are `glam::DVec3`.

mod aabb;
mod ray;
pub(crate) mod optics;
pub(crate) mod weld;

pub use aabb::Aabb;
pub use glam::{DVec2, DVec3};
pub use ray::Ray;

/// Two unit vectors that with the unit vector `n` form a right-handed frame (t1 x t2 = n).
///
/// Source: Duff et al. 2017, "Building an orthonormal basis, revisited".
pub fn tangent_frame(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn tangent_frame_of_any_unit_normal_is_orthonormal_and_right_handed(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64
        ) {
            let v = DVec3::new(x, y, z);
            prop_assume!(v.length() > 1e-3);
            let n = v.normalize();
            let (t1, t2) = tangent_frame(n);
            prop_assert!((t1.cross(t2) - n).length() < 1e-12);
            prop_assert!(t1.dot(t2).abs() < 1e-12);
        }
    }
}
