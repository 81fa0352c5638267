//! Lights without area: what they send where, unoccluded.
//!
//! ```text
//! Light, point, normal --> irradiance (W/m^2), where to look for occluders;  Light --> power (W), sample directions
//! ```
//! Point: E = I cos / r^2. Spot: the same, I times ((cos t - cos outer) / (cos inner - cos outer))^2 clamped to [0, 1]
//! (glTF 2.0, KHR_lights_punctual). Directional: E = E_facing cos.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::geom::Ray;
use crate::raycast::transmit::{Panes, Passed};
use crate::raycast::{CastError, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster};
use crate::scene::Light;
use crate::units::Rgb;

/// Unoccluded irradiance (W/m^2) of `light` at a point with unit normal; zero from behind.
pub fn irradiance(light: &Light, point: DVec3, normal: DVec3) -> Rgb {
    match *light {
        Light::Point { position, intensity } => intensity * inverse_square(position, point, normal),
        Light::Spot { position, direction, intensity, inner_deg, outer_deg } => {
            let fall =
                spot_falloff((point - position).normalize_or_zero().dot(direction), inner_deg, outer_deg);
            if fall == 0.0 {
                Rgb::BLACK
            } else {
                intensity * (fall * inverse_square(position, point, normal))
            }
        }
        Light::Directional { direction, irradiance } => irradiance * (-direction.dot(normal)).max(0.0),
    }
}

/// Which places (m) a light does not shine at because something is in the way, by one ray each.
///
/// # Errors
/// When the caster fails.
pub fn blocked(light: &Light, places: &[DVec3], caster: &mut dyn RayCaster) -> Result<Vec<bool>, CastError> {
    Ok(blocked_and_passed(light, places, &Panes::default(), caster)?.0)
}

/// The same, and what comes through `panes` to places that are blocked by nothing else.
///
/// # Errors
/// When the caster fails.
pub fn blocked_and_passed(
    light: &Light,
    places: &[DVec3],
    panes: &Panes,
    caster: &mut dyn RayCaster,
) -> Result<(Vec<bool>, Vec<Passed>), CastError> {
    let (rays, bundles): (Vec<Ray>, Vec<RayBundle>);
    let query = match *light {
        _ if places.is_empty() => return Ok((Vec::new(), Vec::new())),
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let bundle = |points: &[DVec3]| RayBundle::Targets { apex: position, points: points.to_vec() };
            bundles = places.chunks(MAX_BUNDLE_RAYS).map(bundle).collect();
            Query::Bundles(&bundles)
        }
        Light::Directional { direction, .. } => {
            rays = places.iter().map(|place| Ray::unbounded(*place, DVec3::ZERO - direction)).collect();
            Query::Rays(&rays)
        }
    };
    let blocked = caster.any_hits(Purpose::FormFactor, query)?;
    let passed = panes.behind_panes(caster, Purpose::FormFactor, query, &blocked)?;
    Ok((blocked, passed))
}

/// Where a light is (m); `None` when it is infinitely far.
pub fn position(light: &Light) -> Option<DVec3> {
    match *light {
        Light::Point { position, .. } | Light::Spot { position, .. } => Some(position),
        Light::Directional { .. } => None,
    }
}

/// Emitted power (W); `None` for a directional light, whose power depends on what it meets.
pub fn power_w(light: &Light) -> Option<Rgb> {
    match *light {
        Light::Point { intensity, .. } => Some(intensity * (4.0 * PI)),
        Light::Spot { intensity, inner_deg, outer_deg, .. } => {
            let (inner, outer) = (inner_deg.to_radians().cos(), outer_deg.to_radians().cos());
            Some(intensity * (TAU * ((1.0 - inner) + (inner - outer) / 3.0)))
        }
        Light::Directional { .. } => None,
    }
}

/// `n` unit directions evenly over the solid angle that a point or spot light shines into, each with its relative
/// intensity in [0, 1]; none for a directional light.
///
/// Source: spherical Fibonacci points (Swinbank, Purser 2006), cut to the spot's cap.
pub(super) fn sample_directions(light: &Light, n: usize) -> Vec<(DVec3, f64)> {
    let (axis, cos_end) = match *light {
        Light::Point { .. } => (DVec3::Z, -1.0),
        Light::Spot { direction, outer_deg, .. } => (direction, outer_deg.to_radians().cos()),
        Light::Directional { .. } => return Vec::new(),
    };
    let (t1, t2) = crate::geom::tangent_frame(axis);
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..n)
        .map(|i| {
            let z = 1.0 - (1.0 - cos_end) * (i as f64 + 0.5) / n as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            let share = match *light {
                Light::Spot { inner_deg, outer_deg, .. } => spot_falloff(z, inner_deg, outer_deg),
                _ => 1.0,
            };
            (r * cos * t1 + r * sin * t2 + z * axis, share)
        })
        .collect()
}

/// glTF's angular attenuation for the cosine of the angle off the axis.
fn spot_falloff(cosine: f64, inner_deg: f64, outer_deg: f64) -> f64 {
    let (inner, outer) = (inner_deg.to_radians().cos(), outer_deg.to_radians().cos());
    if inner <= outer {
        return if cosine >= outer { 1.0 } else { 0.0 };
    }
    let fall = ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0);
    fall * fall
}

/// cos / r^2 (1/m^2), zero from behind and at the light itself.
fn inverse_square(from: DVec3, point: DVec3, normal: DVec3) -> f64 {
    let to_light = from - point;
    let r2 = to_light.length_squared();
    if r2 > 0.0 { (to_light.dot(normal) / (r2 * r2.sqrt())).max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot() -> Light {
        Light::Spot {
            position: DVec3::new(0.0, 0.0, 2.0),
            direction: -DVec3::Z,
            intensity: Rgb([8.0, 4.0, 2.0]),
            inner_deg: 20.0,
            outer_deg: 40.0,
        }
    }

    #[test]
    fn point_light_at_two_metres_overhead_gives_a_quarter_of_its_intensity() {
        let light = Light::Point { position: DVec3::new(0.0, 0.0, 2.0), intensity: Rgb([8.0, 4.0, 0.0]) };
        assert_eq!(irradiance(&light, DVec3::ZERO, DVec3::Z), Rgb([2.0, 1.0, 0.0]));
        assert_eq!(irradiance(&light, DVec3::ZERO, -DVec3::Z), Rgb::BLACK);
        let at_45 = irradiance(&light, DVec3::new(2.0, 0.0, 0.0), DVec3::Z).0[0];
        assert!((at_45 - 8.0 * 0.5_f64.sqrt() / 8.0).abs() < 1e-15, "{at_45}");
    }

    #[test]
    fn spot_light_is_full_inside_and_dark_outside_and_squared_between() {
        let e = |tan: f64| irradiance(&spot(), DVec3::new(2.0 * tan, 0.0, 0.0), DVec3::Z).0[0];
        assert_eq!(e(0.0), 2.0);
        assert_eq!(e(41.0_f64.to_radians().tan()), 0.0);
        let t = 30.0_f64.to_radians();
        let (inner, outer) = (20.0_f64.to_radians().cos(), 40.0_f64.to_radians().cos());
        let expected = 2.0 * t.cos().powi(3) * ((t.cos() - outer) / (inner - outer)).powi(2);
        assert!((e(t.tan()) - expected).abs() < 1e-12);
    }

    #[test]
    fn spot_power_is_the_integral_of_its_intensity_over_its_cap() {
        let n = 200_000;
        let mean = sample_directions(&spot(), n).iter().map(|(_, share)| share).sum::<f64>() / n as f64;
        let numeric = 8.0 * mean * TAU * (1.0 - 40.0_f64.to_radians().cos());
        let power = power_w(&spot()).expect("a spot has power").0[0];
        assert!((power / numeric - 1.0).abs() < 1e-6, "{power} {numeric}");
    }

    #[test]
    fn sample_directions_of_a_point_light_are_unit_and_balance() {
        let light = Light::Point { position: DVec3::ZERO, intensity: Rgb::WHITE };
        let directions = sample_directions(&light, 64);
        assert_eq!(directions.len(), 64);
        assert!(directions.iter().all(|(d, s)| (d.length() - 1.0).abs() < 1e-12 && *s == 1.0));
        let mean: DVec3 = directions.iter().map(|(d, _)| *d).sum::<DVec3>() / 64.0;
        assert!(mean.length() < 0.02, "{mean}");
    }

    #[test]
    fn directional_light_falls_with_the_cosine() {
        let light = Light::Directional { direction: -DVec3::Z, irradiance: Rgb::splat(3.0) };
        let n = DVec3::new(0.6, 0.0, 0.8);
        assert!((irradiance(&light, DVec3::ZERO, n).0[0] - 2.4).abs() < 1e-12);
        assert_eq!(irradiance(&light, DVec3::ZERO, -n), Rgb::BLACK);
        assert!(power_w(&light).is_none() && position(&light).is_none());
    }
}
