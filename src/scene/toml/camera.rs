//! `[camera]`: an eye that looks somewhere, with an up that is not along the view.

use toml::Spanned;

use super::super::{Camera, SceneError};
use super::raw::RawCamera;
use super::source::Source;
use super::value::Table;

/// Smallest sine of the angle between up and view.
const MIN_UP_SINE: f64 = 1e-6;

pub(super) fn resolve(source: &Source<'_>, raw: Spanned<Table<RawCamera>>) -> Result<Camera, SceneError> {
    let Table(raw) = raw.into_inner();
    let (eye, target, up) =
        (raw.eye.to_dvec3(), raw.target.get_ref().to_dvec3(), raw.up.get_ref().to_dvec3());
    let Some(view) = (target - eye).try_normalize() else {
        let message = format!("camera target {target} is its eye, expected another point to look at");
        return Err(source.fault(raw.target.span(), message));
    };
    let Some(up_unit) = up.try_normalize() else {
        return Err(source.fault(raw.up.span(), format!("camera up {up} has no direction")));
    };
    if view.cross(up_unit).length() < MIN_UP_SINE {
        let message = format!("camera up {up} is parallel to the view direction {view}");
        return Err(source.fault(raw.up.span(), message));
    }
    Ok(Camera { eye, target, up, fov_y_deg: raw.fov_y_deg.0 })
}
