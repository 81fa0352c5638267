//! `[[light]]`: point, spot and directional lights; each kind has its own keys.
//!
//! Intensities in W/sr, or `intensity_cd` (cd = lm/sr) with an optional `color`, as for emission.

use toml::Spanned;

use super::super::{Light, SceneError};
use super::faults::suggest;
use super::materials::photometric;
use super::raw::RawLight;
use super::source::Source;
use super::value::{MAX_LIGHT, Table, Vector};
use crate::units::Rgb;

/// Cone of a spot light whose angles are not given: those of glTF.
const DEFAULT_CONE_DEG: (f64, f64) = (0.0, 45.0);

const KINDS: [&str; 3] = ["point", "spot", "directional"];

pub(super) fn resolve(source: &Source<'_>, raw: Spanned<Table<RawLight>>) -> Result<Light, SceneError> {
    let table = raw.span();
    let Table(raw) = raw.into_inner();
    let kind = raw.kind.get_ref().as_str();
    if !KINDS.contains(&kind) {
        let message = format!("light kind {kind:?}, expected one of {}", KINDS.join(", "));
        return Err(suggest(source.fault(raw.kind.span(), message), kind, KINDS));
    }
    refuse_foreign_keys(source, &raw, kind)?;
    let need = |value: &Option<Spanned<Vector>>, key: &str| match value {
        Some(v) => Ok(v.get_ref().to_dvec3()),
        None => Err(source.fault(table.clone(), format!("missing key `{key}` of a {kind} light"))),
    };
    let direction = || {
        let given = need(&raw.direction, "direction")?;
        given.try_normalize().ok_or_else(|| {
            let span = raw.direction.as_ref().map_or(table.clone(), Spanned::span);
            source.fault(span, format!("light direction {given} has no direction"))
        })
    };
    match kind {
        "point" => Ok(Light::Point {
            position: need(&raw.position, "position")?,
            intensity: intensity(source, &raw, &table)?,
        }),
        "spot" => {
            let (inner_deg, outer_deg) = cone(source, &raw, &table)?;
            Ok(Light::Spot {
                position: need(&raw.position, "position")?,
                direction: direction()?,
                intensity: intensity(source, &raw, &table)?,
                inner_deg,
                outer_deg,
            })
        }
        _ => match &raw.irradiance {
            Some(e) => Ok(Light::Directional { direction: direction()?, irradiance: e.get_ref().0 }),
            None => Err(source.fault(table, "missing key `irradiance` of a directional light")),
        },
    }
}

/// A key that the kind does not have would be without effect: it is refused.
fn refuse_foreign_keys(source: &Source<'_>, raw: &RawLight, kind: &str) -> Result<(), SceneError> {
    let given = [
        ("position", raw.position.as_ref().map(Spanned::span)),
        ("direction", raw.direction.as_ref().map(Spanned::span)),
        ("intensity", raw.intensity.as_ref().map(Spanned::span)),
        ("intensity_cd", raw.intensity_cd.as_ref().map(Spanned::span)),
        ("color", raw.color.as_ref().map(Spanned::span)),
        ("irradiance", raw.irradiance.as_ref().map(Spanned::span)),
        ("inner_deg", raw.inner_deg.as_ref().map(Spanned::span)),
        ("outer_deg", raw.outer_deg.as_ref().map(Spanned::span)),
    ];
    let own: &[&str] = match kind {
        "point" => &["position", "intensity", "intensity_cd", "color"],
        "spot" => &["position", "direction", "intensity", "intensity_cd", "color", "inner_deg", "outer_deg"],
        _ => &["direction", "irradiance"],
    };
    for (key, span) in given {
        if let (Some(span), false) = (span, own.contains(&key)) {
            let message = format!("key `{key}` of a {kind} light, expected only kind, {}", own.join(", "));
            return Err(source.fault(span, message));
        }
    }
    Ok(())
}

/// Radiant intensity (W/sr) from whichever key was used.
fn intensity(source: &Source<'_>, raw: &RawLight, table: &std::ops::Range<usize>) -> Result<Rgb, SceneError> {
    match (&raw.intensity, &raw.intensity_cd) {
        (Some(_), Some(cd)) => {
            Err(source.fault(cd.span(), "intensity_cd beside intensity, expected one of them"))
        }
        (None, None) => Err(source
            .fault(table.clone(), "a light without `intensity` or `intensity_cd`, expected one of them")),
        (Some(watts), None) => match &raw.color {
            Some(color) => Err(source.fault(color.span(), "`color` goes with intensity_cd only")),
            None => Ok(watts.get_ref().0),
        },
        (None, Some(cd)) => {
            let rgb = photometric(source, raw.color.as_ref(), cd.get_ref().0)?;
            if rgb.max_channel() <= MAX_LIGHT {
                return Ok(rgb);
            }
            Err(source
                .fault(cd.span(), format!("{:e} W/sr, expected at most {MAX_LIGHT:e}", rgb.max_channel())))
        }
    }
}

fn cone(
    source: &Source<'_>,
    raw: &RawLight,
    table: &std::ops::Range<usize>,
) -> Result<(f64, f64), SceneError> {
    let inner = raw.inner_deg.as_ref().map_or(DEFAULT_CONE_DEG.0, |a| a.get_ref().0);
    let outer = raw.outer_deg.as_ref().map_or(DEFAULT_CONE_DEG.1, |a| a.get_ref().0);
    if inner < outer {
        return Ok((inner, outer));
    }
    let span = raw.outer_deg.as_ref().or(raw.inner_deg.as_ref()).map_or(table.clone(), Spanned::span);
    Err(source.fault(span, format!("outer_deg {outer} with inner_deg {inner}, expected outer over inner")))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DVec3;

    use super::super::parse;
    use super::*;

    fn light(keys: &str) -> Light {
        let text = format!(
            "version = 1\n[materials.m]\n[[surface]]\nname = \"s\"\nmaterial = \"m\"\n\
             sphere = {{ center = [0, 0, 0], radius = 1 }}\n[[light]]\n{keys}\n"
        );
        let scene = parse(&text, Path::new("scene.toml")).unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        scene.lights[0]
    }

    #[test]
    fn point_light_of_one_candela_lights_a_facing_plane_at_one_metre_with_one_lux() {
        let Light::Point { intensity, .. } =
            light("kind = \"point\"\nposition = [0, 0, 5]\nintensity_cd = 1.0\ncolor = [1, 0.8, 0.6]")
        else {
            panic!("a point light");
        };
        // E = I / r^2 with r = 1 m.
        let lux = crate::units::Irradiance(intensity).illuminance_lx();
        assert!((lux - 1.0).abs() < 1e-12, "{lux}");
        assert!((intensity.0[0] / intensity.0[2] - 1.0 / 0.6).abs() < 1e-12);
    }

    #[test]
    fn spot_light_has_a_unit_axis_and_the_cone_of_gltf_by_default() {
        let spot =
            light("kind = \"spot\"\nposition = [1, 2, 3]\ndirection = [0, 0, -5]\nintensity = [1, 2, 3]");
        let expected = Light::Spot {
            position: DVec3::new(1.0, 2.0, 3.0),
            direction: DVec3::NEG_Z,
            intensity: Rgb([1.0, 2.0, 3.0]),
            inner_deg: 0.0,
            outer_deg: 45.0,
        };
        assert_eq!(spot, expected);
    }

    #[test]
    fn directional_light_has_a_unit_direction_and_its_irradiance() {
        let sun = light("kind = \"directional\"\ndirection = [3, 0, -4]\nirradiance = 5.0");
        let direction = DVec3::new(0.6, 0.0, -0.8);
        let Light::Directional { direction: d, irradiance } = sun else { panic!("a directional light") };
        assert!((d - direction).length() < 1e-15);
        assert_eq!(irradiance, Rgb::splat(5.0));
    }
}
