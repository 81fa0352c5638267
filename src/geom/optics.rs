//! Mirrors and glass: reflection, Snell's refraction, Fresnel's reflectance of unpolarised light.
//!
//! ```text
//! unit d toward the surface, unit n against it, n1 / n2 --> reflected d, refracted d (or total reflection), R
//! ```
//! Source: Born, Wolf 1999, Principles of Optics, 1.5.2; Whitted 1980. Not modelled: polarisation, dispersion, absorption.

use glam::DVec3;

/// `d` mirrored at the plane with unit normal `n`.
pub(crate) fn reflect(d: DVec3, n: DVec3) -> DVec3 {
    d - 2.0 * d.dot(n) * n
}

/// Unit `d` refracted at unit `n` (n . d <= 0) with eta = n1 / n2; `None` under total internal reflection.
pub(crate) fn refract(d: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
    let cos = -d.dot(n);
    let cos2_out = 1.0 - eta * eta * (1.0 - cos * cos);
    (cos2_out >= 0.0).then(|| eta * d + (eta * cos - cos2_out.sqrt()) * n)
}

/// Fresnel's reflectance of the two polarisations (s, p) at one interface, eta = n1 / n2; 1 under total reflection.
fn fresnel_polarised(cos: f64, eta: f64) -> [f64; 2] {
    let cos = cos.clamp(0.0, 1.0);
    let cos2_out = 1.0 - eta * eta * (1.0 - cos * cos);
    if cos2_out <= 0.0 {
        return [1.0, 1.0];
    }
    let out = cos2_out.sqrt();
    let s = (eta * cos - out) / (eta * cos + out);
    let p = (cos - eta * out) / (cos + eta * out);
    [s * s, p * p]
}

/// Reflectance of one interface, mean over the polarisations.
pub(crate) fn fresnel(cos: f64, eta: f64) -> f64 {
    let [s, p] = fresnel_polarised(cos, eta);
    0.5 * (s + p)
}

/// Transmittance of a clear slab with all inner reflections, mean of (1 - R) / (1 + R) over the polarisations.
pub(crate) fn slab_transmittance(cos: f64, ior: f64) -> f64 {
    0.5 * fresnel_polarised(cos, 1.0 / ior).iter().map(|r| (1.0 - r) / (1.0 + r)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn fresnel_at_normal_incidence_is_the_square_of_the_index_step() {
        for n in [1.33, 1.52, 2.4] {
            let want = ((n - 1.0) / (n + 1.0_f64)).powi(2);
            assert!((fresnel(1.0, 1.0 / n) - want).abs() < 1e-15);
            assert!((fresnel(1.0, n) - want).abs() < 1e-15, "the same from inside");
        }
    }

    #[test]
    fn fresnel_at_brewsters_angle_reflects_no_p_light_and_beyond_the_critical_angle_everything() {
        let n: f64 = 1.52;
        let brewster = n.atan();
        assert!(fresnel_polarised(brewster.cos(), 1.0 / n)[1] < 1e-30);
        let critical = (1.0 / n).asin();
        assert_eq!(fresnel((critical + 1e-6).cos(), n), 1.0);
        assert!(fresnel((critical - 1e-6).cos(), n) < 1.0);
    }

    #[test]
    fn slab_transmittance_of_window_glass_is_the_tabulated_one() {
        for (degrees, want) in [(0.0_f64, 0.91832), (45.0, 0.90253), (60.0, 0.84347), (80.0, 0.45604)] {
            let got = slab_transmittance(degrees.to_radians().cos(), 1.52);
            assert!((got - want).abs() < 5e-6, "{degrees} degrees: {got}");
        }
    }

    proptest! {
        #[test]
        fn refraction_obeys_snell_and_runs_backward(angle in 0.0..1.57f64, ior in 1.01..2.5f64) {
            let d = DVec3::new(angle.sin(), 0.0, -angle.cos());
            let inside = refract(d, DVec3::Z, 1.0 / ior).unwrap();
            prop_assert!((inside.length() - 1.0).abs() < 1e-12);
            prop_assert!((inside.x * ior - d.x).abs() < 1e-12, "n1 sin = n2 sin");
            let back = refract(-inside, DVec3::NEG_Z, ior);
            // Within rounding of grazing the way back may be cut off.
            if angle < 1.56 {
                prop_assert!((back.unwrap() + d).length() < 1e-7);
            }
            prop_assert!((reflect(d, DVec3::Z) - DVec3::new(d.x, 0.0, -d.z)).length() < 1e-15);
        }
    }
}
