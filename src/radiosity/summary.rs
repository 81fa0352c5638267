//! What each surface emits, receives and absorbs: the table of `solve` and `render` reports.
//!
//! ```text
//! Scene, Mesh, Solution (E_mean) --> SurfaceSummary per surface --> Totals
//! ```

use serde::Serialize;

use super::Solution;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::units::{Irradiance, Rgb};

/// Illuminance over an area (lx): of `E_mean` per element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct IlluminanceRange {
    /// Mean over the area.
    pub mean: f64,
    /// Of the darkest element.
    pub min: f64,
    /// Of the brightest element.
    pub max: f64,
}

impl IlluminanceRange {
    /// Of an area whose mean irradiance is `mean` and whose elements' illuminances run from `min` to `max`; zeros without
    /// elements.
    fn new(mean: Rgb, [min, max]: [f64; 2]) -> IlluminanceRange {
        if min > max {
            return IlluminanceRange::default();
        }
        IlluminanceRange { mean: Irradiance(mean).illuminance_lx(), min, max }
    }
}

/// One surface in a report. Both sides of a two-sided surface count: area, powers and means.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceSummary {
    /// Its name in the scene.
    pub name: String,
    /// Area that emits and receives (m^2), as meshed.
    pub area_m2: f64,
    /// Emitted power (W).
    pub emitted_w: Rgb,
    /// Power that arrives (W).
    pub incident_w: Rgb,
    /// Power that is absorbed (W): not reflected, not specular, not transmitted.
    pub absorbed_w: Rgb,
    /// Area mean of B = M + rho E (W/m^2).
    pub mean_radiosity_w_m2: Rgb,
    /// Area mean of E (W/m^2).
    pub mean_irradiance_w_m2: Rgb,
    /// Its illuminance (lx).
    pub illuminance_lx: IlluminanceRange,
}

/// Sums over all surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Totals {
    /// Area that emits and receives (m^2).
    pub area_m2: f64,
    /// Power emitted by surfaces (W); lights without area are in the energy account only.
    pub emitted_w: Rgb,
    /// Power that arrives (W).
    pub incident_w: Rgb,
    /// Power that is absorbed (W).
    pub absorbed_w: Rgb,
    /// Area mean of E (W/m^2).
    pub mean_irradiance_w_m2: Rgb,
    /// Illuminance of all surfaces (lx).
    pub illuminance_lx: IlluminanceRange,
}

/// The table, surfaces in scene order.
pub fn summarise(scene: &Scene, mesh: &Mesh, solution: &Solution) -> Vec<SurfaceSummary> {
    let mut area_m2 = vec![0.0; scene.surfaces.len()];
    let mut incident_w = vec![Rgb::BLACK; scene.surfaces.len()];
    let mut range_lx = vec![[f64::INFINITY, f64::NEG_INFINITY]; scene.surfaces.len()];
    for (element, e) in mesh.elements.iter().zip(&solution.element_irradiance) {
        let surface = mesh.patches[element.patch.0 as usize].surface.0 as usize;
        area_m2[surface] += element.area_m2;
        incident_w[surface] += e.total() * element.area_m2;
        let lx = Irradiance(e.total()).illuminance_lx();
        let [min, max] = &mut range_lx[surface];
        (*min, *max) = (min.min(lx), max.max(lx));
    }
    let rows = scene.surfaces.iter().zip(area_m2.into_iter().zip(incident_w)).zip(range_lx);
    rows.map(|((surface, (area_m2, incident_w)), range_lx)| {
        let m = scene.material(surface);
        let emitted_w = surface.exitance * area_m2;
        let leaving_w = emitted_w + m.reflectance * incident_w;
        let over_area = |power_w: Rgb| if area_m2 > 0.0 { power_w / area_m2 } else { Rgb::BLACK };
        let mean_irradiance_w_m2 = over_area(incident_w);
        SurfaceSummary {
            name: surface.name.clone(),
            area_m2,
            emitted_w,
            incident_w,
            absorbed_w: (Rgb::WHITE - m.reflectance - m.specular - m.transmission) * incident_w,
            mean_radiosity_w_m2: over_area(leaving_w),
            mean_irradiance_w_m2,
            illuminance_lx: IlluminanceRange::new(mean_irradiance_w_m2, range_lx),
        }
    })
    .collect()
}

/// Sums of the table.
pub fn totals(surfaces: &[SurfaceSummary]) -> Totals {
    let mut totals = surfaces.iter().fold(Totals::default(), |t, s| Totals {
        area_m2: t.area_m2 + s.area_m2,
        emitted_w: t.emitted_w + s.emitted_w,
        incident_w: t.incident_w + s.incident_w,
        absorbed_w: t.absorbed_w + s.absorbed_w,
        ..t
    });
    let lit = || surfaces.iter().filter(|s| s.area_m2 > 0.0).map(|s| s.illuminance_lx);
    let range_lx = [
        lit().map(|lx| lx.min).fold(f64::INFINITY, f64::min),
        lit().map(|lx| lx.max).fold(f64::NEG_INFINITY, f64::max),
    ];
    if totals.area_m2 > 0.0 {
        totals.mean_irradiance_w_m2 = totals.incident_w / totals.area_m2;
    }
    totals.illuminance_lx = IlluminanceRange::new(totals.mean_irradiance_w_m2, range_lx);
    totals
}
