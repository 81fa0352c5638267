//! The form-factor kernel: Lambert's polygon formula, clipped to the receiver's horizon.

use glam::DVec3;

/// Unoccluded form factor from a point with unit normal to a planar (or bent) polygon, in [0, 1].
///
/// Irradiance at the point = this x the polygon's (uniform) radiosity. Sources' facing is the caller's concern:
/// the polygon counts as seen from its front (vertices counter-clockwise as seen from the point); seen from its
/// back it gives 0.
pub fn point_to_polygon(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let _ = (point, normal, polygon);
    todo!()
}
