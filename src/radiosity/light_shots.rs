//! Lights without area in pass 1: direct irradiance at every receiver, one any-hit ray each.
//!
//! ```text
//! Light, receivers --Targets bundles from the light | rays toward a directional light--> E per element and vertex
//! Light --256 rays over its solid angle--> shares lost and on backs
//! ```

use glam::DVec3;
use rayon::prelude::*;

use super::lights;
use super::receivers::Receivers;
use super::stray::{StrayShares, add_beyond, stray};
use crate::geom::Ray;
use crate::mesh::{ElementId, Mesh, VertexId};
use crate::raycast::transmit::Panes;
use crate::raycast::{CastError, Purpose, Query, RayCaster};
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
    /// What came through panes (W), which is counted at the glass, too: by elements, and on backs.
    pub passed_w: [Rgb; 2],
    /// Rays cast.
    pub n_rays: u64,
}

pub(super) fn shoot(
    mesh: &Mesh,
    receivers: &Receivers,
    light: &Light,
    panes: &Panes,
    caster: &mut dyn RayCaster,
) -> Result<LightShot, CastError> {
    let mut irradiance: Vec<Rgb> =
        receivers.all.par_iter().map(|r| lights::irradiance(light, r.point, r.normal)).collect();
    let lit: Vec<usize> = (0..irradiance.len()).filter(|&i| !irradiance[i].is_black()).collect();
    let mut n_rays = lit.len() as u64;
    let mut passed_w = [Rgb::BLACK; 2];
    if !lit.is_empty() {
        let targets: Vec<DVec3> = lit.iter().map(|&i| receivers.all[i].target).collect();
        let (blocked, passed) = lights::blocked_and_passed(light, &targets, panes, caster)?;
        let mut arrives = vec![false; irradiance.len()];
        lit.iter().zip(blocked).for_each(|(&i, blocked)| arrives[i] = !blocked);
        n_rays += settle_lines(mesh, receivers.n_gauss(), light, &irradiance, &mut arrives, caster)?;
        let mut shares: Vec<Rgb> =
            arrives.iter().map(|arrives| if *arrives { Rgb::WHITE } else { Rgb::BLACK }).collect();
        for p in passed {
            let i = lit[p.index];
            shares[i] = p.share;
            if i < receivers.n_gauss() {
                let receiver = &receivers.all[i];
                let area_m2 = mesh.elements[receiver.owner as usize].area_m2;
                passed_w[usize::from(p.by_back)] += irradiance[i] * p.share * (receiver.weight * area_m2);
            }
        }
        for (e, share) in irradiance.iter_mut().zip(shares) {
            *e = *e * share;
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
        let beyond = panes.beyond(caster, Purpose::FormFactor, Query::Rays(&rays), &hits)?;
        let all: f64 = directions.iter().map(|(_, share)| share).sum();
        let strayed = add_beyond(mesh, &mut shares, beyond.iter(), |i| directions[i].1 / all);
        passed_w = [0, 1].map(|side| passed_w[side] + power_w * strayed[side]);
        n_rays += rays.len() as u64;
    }
    let vertices = irradiance.split_off(receivers.n_gauss());
    Ok(LightShot { elements, vertices, power_w, stray: shares, passed_w, n_rays })
}

/// Lets each side of a broken line see a light as the centroids of its elements do: the line that an edge stands for may run
/// beside it, and then a ray to a vertex on that edge tells of the other side. How many rays that took.
fn settle_lines(
    mesh: &Mesh,
    n_gauss: usize,
    light: &Light,
    unoccluded: &[Rgb],
    arrives: &mut [bool],
    caster: &mut dyn RayCaster,
) -> Result<u64, CastError> {
    let lit = |v: &&VertexId| !unoccluded[n_gauss + v.0 as usize].is_black();
    let vertices: Vec<VertexId> = mesh.line_vertices().iter().filter(lit).copied().collect();
    let mut elements: Vec<ElementId> =
        vertices.iter().flat_map(|v| mesh.elements_around(*v)).copied().collect();
    elements.sort_unstable();
    elements.dedup();
    if elements.is_empty() {
        return Ok(0);
    }
    let offset_m = caster.surface_offset_m();
    let target = |e: &ElementId| mesh.centroid(*e) + offset_m * mesh.elements[e.0 as usize].normal;
    let targets: Vec<DVec3> = elements.iter().map(target).collect();
    let blocked = lights::blocked(light, &targets, caster)?;
    for v in vertices {
        let around = mesh.elements_around(v);
        let n_lit = around.iter().filter(|e| elements.binary_search(e).is_ok_and(|i| !blocked[i])).count();
        arrives[n_gauss + v.0 as usize] = 2 * n_lit >= around.len();
    }
    Ok(elements.len() as u64)
}
