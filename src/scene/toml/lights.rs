//! `[[light]]`: point, spot and directional lights; each kind has its own keys.
//!
//! Intensities in W/sr, or `intensity_cd` (cd = lm/sr) with an optional `color`, as for emission.

use toml::Spanned;

use super::super::{Light, SceneError};
use super::faults::suggest;
use super::materials::photometric;
use super::raw::RawLight;
use super::source::Source;
use super::value::{MAX_LIGHT, Vector};
use crate::units::Rgb;

/// Cone of a spot light whose angles are not given: those of glTF.
const DEFAULT_CONE_DEG: (f64, f64) = (0.0, 45.0);

const KINDS: [&str; 3] = ["point", "spot", "directional"];

pub(super) fn resolve(source: &Source<'_>, raw: Spanned<RawLight>) -> Result<Light, SceneError> {
    let table = raw.span();
    let raw = raw.into_inner();
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
