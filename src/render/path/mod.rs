//! Path tracing: what every other method is measured by.
//!
//! ```text
//! first hits x paths --walk.rs--> shadow rays --any_hits, panes--> light
//!                        ^   '--> next rays ----closest_hits---.
//!                        '--------- a wave, until all ended <--'
//! ```
//! L = L_e + rho / pi E: E by one shadow ray to an emitter chosen in proportion to its unoccluded irradiance (`emitters.rs`) and
//! one cosine-distributed bounce, which weigh each other where both find an emitter (balance heuristic); Russian roulette.
//! Unbiased, save what f64 and the surface offset take. Surfaces are those of the other methods (`surfaces.rs`).
//! A wave is all walks that are under way: one query for shadows, one for hits. A walk depends on the seed, its camera ray and
//! its number alone; the light of a camera ray is the sum over its walks in their order. So the picture has the same bits for
//! any number of threads and any size of the waves.
//! Source: Kajiya 1986; Veach, Guibas 1995 (multiple importance sampling).
//! Not modelled: caustics of lights without area, which no bounce can find.

mod emitters;
mod walk;

use rayon::prelude::*;

use super::method::Transport;
use super::shader::{CameraRay, Seen, Shader};
use super::surfaces::{Diffuse, Outcome, Path, Surfaces};
use crate::direct::ShadePoint;
use crate::geom::Ray;
use crate::mesh::{ElementId, Mesh, SurfacePoint};
use crate::radiosity::ProbePoint;
use crate::raycast::transmit::Panes;
use crate::raycast::{CastError, Purpose, Query, RayCaster, RayHit};
use crate::sampling::mix;
use crate::scene::Scene;
use crate::units::{Radiance, Rgb};
use emitters::Emitters;
use walk::{Light, Walk};

/// Walks of a wave, about.
const WALKS_PER_WAVE: usize = 1 << 17;

/// The shader.
pub(super) struct PathTracer<'a> {
    surfaces: Surfaces<'a>,
    emitters: Emitters,
    panes: Panes,
    transport: Transport,
    /// Walks per camera ray.
    n_paths: u32,
    /// Specular depth of the two-pass method.
    max_depth: u32,
    seed: u64,
    /// Also tell the irradiance on surfaces that are seen first.
    irradiance: bool,
    /// Luminance of all that camera rays saw, modelled by the two-pass method and not.
    modelled: f64,
    missed: f64,
}

/// How paths are traced.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PathOptions {
    /// Which paths count.
    pub transport: Transport,
    /// Paths per camera ray or point.
    pub n_paths: u32,
    /// Specular depth of the two-pass method.
    pub max_depth: u32,
    /// Seed of the sampling pattern.
    pub seed: u64,
}

/// Irradiance by path tracing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathIrradiance {
    /// The mean over the paths (W/m^2).
    pub mean: Rgb,
    /// Its standard error (W/m^2).
    pub standard_error: Rgb,
}

/// Irradiance at points by path tracing, in the order of the points; a point's value depends on where it is, not on the others.
///
/// # Errors
/// When the caster fails.
pub fn irradiance(
    scene: &Scene,
    mesh: &Mesh,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
    options: PathOptions,
) -> Result<Vec<PathIrradiance>, CastError> {
    let tracer = PathTracer::new(scene, mesh, caster.surface_offset_m(), options);
    let of_point = |p: &ProbePoint| {
        let key = p.at.to_array().iter().chain(&p.normal.to_array()).fold(0, |key, x| mix(key ^ x.to_bits()));
        ShadePoint { position: p.at, normal: p.normal, geometric_normal: p.normal, key }
    };
    let points: Vec<ShadePoint> = points.iter().map(of_point).collect();
    tracer.irradiance_at(caster, &points)
}

impl<'a> PathTracer<'a> {
    pub fn new(scene: &'a Scene, mesh: &'a Mesh, offset_m: f64, options: PathOptions) -> PathTracer<'a> {
        PathTracer {
            surfaces: Surfaces { scene, mesh, offset_m, min_weight: 0.0 },
            emitters: Emitters::new(scene, mesh, offset_m),
            panes: Panes::of(scene, mesh),
            transport: options.transport,
            n_paths: options.n_paths.max(1),
            max_depth: options.max_depth,
            seed: options.seed,
            irradiance: false,
            modelled: 0.0,
            missed: 0.0,
        }
    }

    /// The same, that also tells the irradiance on surfaces that are seen first, or not.
    pub fn with_irradiance(self, irradiance: bool) -> PathTracer<'a> {
        PathTracer { irradiance, ..self }
    }

    /// What the transport lets through.
    fn counted(&self, light: &Light) -> Rgb {
        match self.transport {
            Transport::Full => light.total(),
            Transport::TwoPass => light.modelled,
        }
    }

    /// Traces `n_paths` walks for each of `n` slots: `start` gives a walk its first event, `end` takes every slot's lights in
    /// the order of their numbers.
    fn trace(
        &self,
        caster: &mut dyn RayCaster,
        n: usize,
        start: impl Fn(&mut Walk) + Sync,
        key: impl Fn(usize) -> u64 + Sync,
        mut end: impl FnMut(usize, &Light),
    ) -> Result<(), CastError> {
        if n == 0 {
            return Ok(());
        }
        let per_wave = (WALKS_PER_WAVE / n).max(1) as u32;
        let mut first = 0;
        while first < self.n_paths {
            let numbers = per_wave.min(self.n_paths - first) as usize;
            let mut walks: Vec<Walk> = (0..numbers * n)
                .into_par_iter()
                .with_min_len(1024)
                .map(|i| {
                    let mut walk = Walk::new(i, key(i % n), first + (i / n) as u32);
                    start(&mut walk);
                    walk
                })
                .collect();
            let mut lights = vec![Light::default(); walks.len()];
            self.finish(caster, &mut walks, &mut lights)?;
            for (i, light) in lights.iter().enumerate() {
                end(i % n, light);
            }
            first += numbers as u32;
        }
        Ok(())
    }

    /// Walks on until all have ended.
    fn finish(
        &self,
        caster: &mut dyn RayCaster,
        walks: &mut Vec<Walk>,
        lights: &mut [Light],
    ) -> Result<(), CastError> {
        while !walks.is_empty() {
            let shadows: Vec<Ray> = walks.iter().filter_map(|w| w.shadow.and_then(|s| s.ray)).collect();
            let shares = match shadows.is_empty() {
                true => Vec::new(),
                false => self.panes.transmitted(caster, Purpose::Shadow, Query::Rays(&shadows))?,
            };
            let mut shares = shares.into_iter();
            for walk in walks.iter_mut() {
                match walk.shadow {
                    Some(shadow) if shadow.ray.is_some() => walk.lit(shares.next().unwrap_or(Rgb::BLACK)),
                    Some(_) => walk.lit(Rgb::WHITE),
                    None => {}
                }
            }
            walks.retain(|walk| {
                if walk.ray.is_none() {
                    lights[walk.slot] = walk.light;
                }
                walk.ray.is_some()
            });
            let rays: Vec<Ray> = walks.iter().filter_map(|w| w.ray).collect();
            if rays.is_empty() {
                break;
            }
            let hits = caster.closest_hits(Purpose::Bounce, Query::Rays(&rays))?;
            walks.par_iter_mut().with_min_len(256).zip(&hits).for_each(|(walk, hit)| self.meet(walk, *hit));
        }
        Ok(())
    }

    /// Irradiance at points with normals, direct and indirect.
    ///
    /// # Errors
    /// When the caster fails.
    pub fn irradiance_at(
        &self,
        caster: &mut dyn RayCaster,
        points: &[ShadePoint],
    ) -> Result<Vec<PathIrradiance>, CastError> {
        // A white surface there: E = pi L.
        let white = |point: ShadePoint| {
            let at = SurfacePoint { element: ElementId(0), st: glam::DVec2::ZERO };
            Outcome { diffuse: Some(Diffuse { point, reflectance: Rgb::WHITE, at }), ..Outcome::default() }
        };
        let n = points.len();
        let mut sums = vec![(Rgb::BLACK, Rgb::BLACK); n];
        self.trace(
            caster,
            n,
            |walk| self.go_on(walk, &white(points[walk.slot % n])),
            |i| points[i].key,
            |i, light| {
                let e = self.counted(light) * std::f64::consts::PI;
                sums[i].0 += e;
                sums[i].1 += e * e;
            },
        )?;
        let count = f64::from(self.n_paths);
        Ok(sums
            .into_iter()
            .map(|(sum, squares)| {
                let mean = sum / count;
                let variance = (squares / count - mean * mean).map(|v| v.max(0.0) / (count - 1.0).max(1.0));
                PathIrradiance { mean, standard_error: variance.map(f64::sqrt) }
            })
            .collect())
    }
}

impl Shader for PathTracer<'_> {
    fn see(
        &mut self,
        caster: &mut dyn RayCaster,
        rays: &[CameraRay],
        hits: Vec<Option<RayHit>>,
    ) -> Result<Vec<Seen>, CastError> {
        let outcomes: Vec<Outcome> = rays
            .par_iter()
            .enumerate()
            .zip(&hits)
            .map(|((i, ray), hit)| self.surfaces.meet(&Path::camera(i, ray), *hit, self.irradiance))
            .collect();
        let n = rays.len();
        let mut lights = vec![Light::default(); n];
        self.trace(
            caster,
            n,
            |walk| {
                let i = walk.slot % n;
                self.first(walk, &rays[i], hits[i], &outcomes[i]);
            },
            |i| rays[i].key(),
            |i, light| {
                lights[i].modelled += light.modelled;
                lights[i].missed += light.missed;
            },
        )?;
        let mut seen: Vec<Seen> = outcomes
            .iter()
            .zip(&lights)
            .map(|(outcome, light)| Seen {
                radiance: Radiance(self.counted(light) / f64::from(self.n_paths)),
                emits: !outcome.exitance.is_black(),
                back: outcome.back,
                ..Seen::default()
            })
            .collect();
        for light in &lights {
            self.modelled += light.modelled.luminance();
            self.missed += light.missed.luminance();
        }
        if self.irradiance {
            let (places, points): (Vec<usize>, Vec<ShadePoint>) = outcomes
                .iter()
                .enumerate()
                .filter_map(|(i, outcome)| Some((i, outcome.diffuse?.point)))
                .unzip();
            for (i, e) in places.into_iter().zip(self.irradiance_at(caster, &points)?) {
                seen[i].irradiance = Some(e.mean);
            }
        }
        Ok(seen)
    }

    fn missed_share(&self) -> Option<f64> {
        let all = self.modelled + self.missed;
        Some(if all > 0.0 { self.missed / all } else { 0.0 })
    }
}
