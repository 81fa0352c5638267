//! How far a reconstruction is from the right field, and whether its creases would be seen.
//!
//! ```text
//! Mesh, Reference --Samples::new--> points of elements: value, gradient, range around | of C1 edges: second difference
//! Samples, Reconstruction --measure--> Metrics: l2, linf, h1, jump, band, overshoot, negative share, energy drift
//! ```
//! Luminance of irradiance over the mean of its group (a surface, or several that are looked at as one), in world units.
//! With y = Y / mean, r the reference's, g gradients along the surface, w areas, h the narrower element's width at an edge:
//! - `l2` = sqrt(sum w (y - r)^2 / sum w), `linf` = max |y - r|, `h1` = sqrt(sum w |g - g_r|^2 / sum w |g_r|^2);
//! - `jump` = max |dy/dn+ - dy/dn-| h over points of C1 edges: 0 for every C1 surface, flat-spotted ones too;
//! - `band` = RMS over points of C1 edges of the second difference at d = h/8 over d, less the reference's:
//!   (y(+d) - 2 y(0) + y(-d)) / d (1/m). A crease of slope s gives s, a curvature c gives c h / 8: what an eye takes
//!   for a Mach band;
//! - `overshoot` = how far y leaves the reference's range in the element and those around it, at worst;
//! - `negative_share` = share of the area where the reconstruction is negative before it is clamped;
//! - `energy_drift` = sum w (y - r) / sum w r: what interpolation adds to the power.
//!
//! Source: Bastos et al. 1992 for the question; the metrics are ours.
//! Not modelled: the eye's contrast sensitivity.

use serde::Serialize;

use super::Reconstruction;
use crate::geom::DVec3;
use crate::mesh::{ElementId, Mesh, SurfacePoint, VertexId};
use crate::units::Rgb;

mod edges;
mod points;
#[cfg(test)]
mod tests;

use edges::EdgePoint;
use points::ElementPoint;

/// Where the right luminance is known.
pub trait Reference: Sync {
    /// Luminance of the irradiance (W/m^2) at a place on a mesh.
    fn luminance(&self, mesh: &Mesh, at: SurfacePoint) -> f64;

    /// Step of the central differences that give its gradient, as a share of an element's (s,t).
    fn step(&self) -> f64 {
        1.0 / 64.0
    }
}

impl<F: Fn(&Mesh, SurfacePoint) -> f64 + Sync> Reference for F {
    fn luminance(&self, mesh: &Mesh, at: SurfacePoint) -> f64 {
        self(mesh, at)
    }
}

/// What is measured of a reconstruction; definitions at the head of this module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// RMS error, over the mean.
    pub l2: f64,
    /// Largest error, over the mean.
    pub linf: f64,
    /// Relative L2 error of the gradient.
    pub h1: f64,
    /// Largest break of the slope across a C1 edge, times the element's width, over the mean.
    pub jump: f64,
    /// RMS second difference across C1 edges over its distance, less the reference's, over the mean (1/m).
    #[serde(rename = "band_1_m")]
    pub band: f64,
    /// How far the range of the reference around is left, over the mean.
    pub overshoot: f64,
    /// Share of the area with a negative value.
    pub negative_share: f64,
    /// Power that interpolation adds, as a share.
    pub energy_drift: f64,
}

/// A reference, sampled for one mesh.
#[derive(Clone, Debug)]
pub struct Samples {
    points: Vec<ElementPoint>,
    edges: Vec<EdgePoint>,
    /// Mean of each group (W/m^2).
    means: Vec<f64>,
}

impl Samples {
    /// Samples a reference on the elements that `group` counts, each over the mean of its group.
    ///
    /// Groups whose mean is 0 are left out: nothing is relative to darkness.
    pub fn new(
        mesh: &Mesh,
        group: impl Fn(ElementId) -> Option<usize> + Sync,
        reference: &impl Reference,
    ) -> Samples {
        let (points, means) = points::sample(mesh, &group, reference);
        let edges = edges::sample(mesh, &group, &means, reference);
        Samples { points, edges, means }
    }

    /// The points of one group.
    pub fn only(&self, group: usize) -> Samples {
        Samples {
            points: self.points.iter().filter(|p| p.group == group).copied().collect(),
            edges: self.edges.iter().filter(|p| p.group == group).copied().collect(),
            means: self.means.clone(),
        }
    }

    /// The samples of the reference times a factor over 0.
    pub fn scaled(&self, factor: f64) -> Samples {
        let mut scaled = self.clone();
        // What is kept is relative to the means.
        scaled.points.iter_mut().for_each(|p| p.mean *= factor);
        scaled.edges.iter_mut().for_each(|p| p.mean *= factor);
        scaled.means.iter_mut().for_each(|mean| *mean *= factor);
        scaled
    }

    /// Points on elements.
    pub fn n_points(&self) -> usize {
        self.points.len()
    }

    /// Points on C1 edges.
    pub fn n_edge_points(&self) -> usize {
        self.edges.len()
    }

    /// Mean luminance of each group (W/m^2).
    pub fn means(&self) -> &[f64] {
        &self.means
    }

    /// Where its values are known: for timing.
    pub fn places(&self) -> impl Iterator<Item = SurfacePoint> {
        self.points.iter().map(|p| p.at)
    }

    /// What a reconstruction of the same mesh is like.
    pub fn measure(&self, mesh: &Mesh, field: &Reconstruction) -> Metrics {
        let (jump, band) = edges::measure(&self.edges, mesh, field);
        Metrics { jump, band, ..points::measure(&self.points, mesh, field) }
    }
}

/// The reference's luminance at every vertex, as grey: converged vertex values.
pub fn vertex_values(mesh: &Mesh, reference: &impl Reference) -> Vec<Rgb> {
    use rayon::prelude::*;
    let value = |v: u32| {
        let Some(&element) = mesh.elements_around(VertexId(v)).first() else { return Rgb::BLACK };
        let corners = mesh.elements[element.0 as usize].corners;
        let corner = corners.vertices().iter().position(|c| c.0 == v).unwrap_or(0);
        let at = SurfacePoint { element, st: points::corner_st(corners.vertices().len(), corner) };
        Rgb::splat(reference.luminance(mesh, at))
    };
    (0..mesh.vertices.len() as u32).into_par_iter().map(value).collect()
}

/// The reference's mean luminance over every element, as grey, from the points that [`Samples`] has on it.
pub fn element_means(mesh: &Mesh, reference: &impl Reference) -> Vec<Rgb> {
    use rayon::prelude::*;
    let value = |e: u32| {
        let places = points::places(mesh, ElementId(e));
        let sum: f64 = places.iter().map(|(at, w)| w * reference.luminance(mesh, *at)).sum();
        Rgb::splat(sum / places.iter().map(|(_, w)| w).sum::<f64>())
    };
    (0..mesh.elements.len() as u32).into_par_iter().map(value).collect()
}

/// Luminance of a gradient.
fn luminance_gradient([x, y, z]: [Rgb; 3]) -> DVec3 {
    DVec3::new(x.luminance(), y.luminance(), z.luminance())
}
