//! Lights without area in pass 1: direct irradiance at every receiver, one any-hit ray each.
//!
//! ```text
//! Light, receivers --Targets bundles from the light | rays toward a directional light--> E per element and vertex
//! Light --256 rays over its solid angle--> shares lost and on backs
//! ```

use glam::DVec3;
use rayon::prelude::*;

use super::form_factors::{StrayShares, stray};
use super::lights;
use super::receivers::Receivers;
use crate::geom::Ray;
use crate::mesh::Mesh;
use crate::raycast::{CastError, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster};
use crate::scene::Light;
use crate::units::Rgb;

/// Rays that measure what a light loses.
const N_STRAY_RAYS: usize = 256;

/// What one light without area does.
pub(super) struct LightShot {
    /// Irradiance of every element (W/m^2).
    pub elements: Vec<Rgb>,
    /// Irradiance of every vertex (W/m^2).
    pub vertices: Vec<Rgb>,
    /// Its power (W); of a directional light, what it delivered.
    pub power_w: Rgb,
    /// What reached no element.
    pub stray: StrayShares,
    /// Rays cast.
    pub n_rays: u64,
}

pub(super) fn shoot(
    mesh: &Mesh,
    receivers: &Receivers,
    light: &Light,
    caster: &mut dyn RayCaster,
) -> Result<LightShot, CastError> {
    let mut irradiance: Vec<Rgb> =
        receivers.all.par_iter().map(|r| lights::irradiance(light, r.point, r.normal)).collect();
    let lit: Vec<usize> = (0..irradiance.len()).filter(|&i| !irradiance[i].is_black()).collect();
    let mut n_rays = lit.len() as u64;
    if !lit.is_empty() {
        let blocked = match *light {
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                let bundles: Vec<RayBundle> = lit
                    .chunks(MAX_BUNDLE_RAYS)
                    .map(|chunk| RayBundle::Targets {
                        apex: position,
                        points: chunk.iter().map(|&i| receivers.all[i].target).collect(),
                    })
                    .collect();
                caster.any_hits(Purpose::FormFactor, Query::Bundles(&bundles))?
            }
            Light::Directional { direction, .. } => {
                let rays: Vec<Ray> = lit
                    .iter()
                    .map(|&i| Ray::unbounded(receivers.all[i].target, DVec3::ZERO - direction))
                    .collect();
                caster.any_hits(Purpose::FormFactor, Query::Rays(&rays))?
            }
        };
        let mut arrives = vec![false; irradiance.len()];
        lit.iter().zip(blocked).for_each(|(&i, blocked)| arrives[i] = !blocked);
        settle_lines(mesh, receivers, &irradiance, &mut arrives);
        for (e, arrives) in irradiance.iter_mut().zip(arrives) {
            if !arrives {
                *e = Rgb::BLACK;
            }
        }
    }
    let elements: Vec<Rgb> = (0..receivers.n_elements())
        .map(|e| {
            let points = receivers.points_of(e);
            points.map(|i| irradiance[i] * receivers.all[i].weight).sum()
        })
        .collect();
    let delivered_w = || mesh.elements.iter().zip(&elements).map(|(el, e)| *e * el.area_m2).sum();
    let power_w = lights::power_w(light).unwrap_or_else(delivered_w);
    let mut shares = StrayShares::default();
    if let Some(origin) = lights::position(light) {
        let directions = lights::sample_directions(light, N_STRAY_RAYS);
        let rays: Vec<Ray> = directions.iter().map(|(d, _)| Ray::unbounded(origin, *d)).collect();
        let hits = caster.closest_hits(Purpose::FormFactor, Query::Rays(&rays))?;
        shares = stray(mesh, &hits, |i| directions[i].1);
        n_rays += rays.len() as u64;
    }
    let vertices = irradiance.split_off(receivers.n_gauss());
    Ok(LightShot { elements, vertices, power_w, stray: shares, n_rays })
}

/// Lets each side of a broken line see a light as most quadrature points of its elements do that face it: the line that
/// an edge stands for may run beside it, and then a ray to a vertex on that edge tells of the other side.
fn settle_lines(mesh: &Mesh, receivers: &Receivers, unoccluded: &[Rgb], arrives: &mut [bool]) {
    for vertex in mesh.line_vertices() {
        let around = mesh.elements_around(*vertex).iter();
        let points = around.flat_map(|e| receivers.points_of(e.0 as usize));
        let (mut n, mut n_lit) = (0, 0);
        for i in points.filter(|&i| !unoccluded[i].is_black()) {
            n += 1;
            n_lit += usize::from(arrives[i]);
        }
        if n > 0 {
            arrives[receivers.n_gauss() + vertex.0 as usize] = 2 * n_lit >= n;
        }
    }
}
