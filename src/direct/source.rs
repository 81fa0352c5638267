//! Sources of direct light and where on them shadow rays end.
//!
//! ```text
//! polygon --n x n strata, jitter--> targets with area weights (a fan when it is a parallelogram)
//! curved side --its patches, samples in proportion to their kernels--> targets
//! ```

use glam::DVec3;

use crate::radiosity::kernel;
use crate::raycast::RayBundle;
use crate::sampling::{hash, radical_inverse, unit_pair};
use crate::scene::Light;
use crate::units::Rgb;

/// Where light comes from.
#[derive(Clone, Debug)]
pub(super) enum Source {
    /// One emitting side of a surface: its polygon, or the patches of a curved one.
    Areas { areas: Vec<Area>, exitance: Rgb },
    /// A light without area.
    Light(Light),
}

/// A planar (or nearly planar) emitting polygon, front toward the light's way.
#[derive(Clone, Debug)]
pub(super) struct Area {
    corners: [DVec3; 4],
    is_triangle: bool,
    is_parallelogram: bool,
    pub normal: DVec3,
    pub source: kernel::Source,
}

/// An end of a shadow ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Target {
    /// Lifted off the source (m).
    pub position: DVec3,
    /// Relative weight in the visible share.
    pub weight: f64,
}

impl Source {
    /// Irradiance (W/m^2) at a point when nothing is between; exact.
    pub fn unoccluded(&self, point: DVec3, normal: DVec3) -> Rgb {
        match self {
            Source::Light(light) => crate::radiosity::lights::irradiance(light, point, normal),
            Source::Areas { areas, exitance } => {
                *exitance * areas.iter().map(|a| a.source.form_factor(point, normal)).sum::<f64>()
            }
        }
    }

    /// What all its light is a multiple of.
    pub fn colour(&self) -> Rgb {
        match self {
            Source::Areas { exitance, .. } => *exitance,
            Source::Light(light) => light.strength(),
        }
    }

    /// Solid angle (sr) of what faces a point, its horizon apart; 0 of lights without area.
    pub fn solid_angle(&self, point: DVec3) -> f64 {
        match self {
            Source::Light(_) => 0.0,
            Source::Areas { areas, .. } => areas.iter().map(|a| a.solid_angle(point)).sum(),
        }
    }
}

impl Area {
    /// Solid angle (sr) of its front as seen from a point; 0 from behind. Source: van Oosterom, Strackee 1983.
    fn solid_angle(&self, point: DVec3) -> f64 {
        let [a, b, c, d] = self.corners.map(|v| v - point);
        let triangle = |p: DVec3, q: DVec3, r: DVec3| {
            let (lp, lq, lr) = (p.length(), q.length(), r.length());
            let denominator = lp * lq * lr + p.dot(q) * lr + p.dot(r) * lq + q.dot(r) * lp;
            -2.0 * p.dot(q.cross(r)).atan2(denominator)
        };
        let second = if self.is_triangle { 0.0 } else { triangle(a, c, d) };
        (triangle(a, b, c) + second).max(0.0)
    }

    /// Corners counter-clockwise seen from where the light goes; 3 or 4.
    pub fn new(polygon: &[DVec3]) -> Area {
        let source = kernel::Source::new(polygon);
        let is_triangle = polygon.len() == 3;
        let corners = [polygon[0], polygon[1], polygon[2], polygon[polygon.len() - 1]];
        let [v0, v1, v2, v3] = corners;
        let skew = (v0 + v2 - v1 - v3).length();
        let is_parallelogram = !is_triangle && skew <= 1e-9 * (v2 - v0).length();
        Area { corners, is_triangle, is_parallelogram, normal: source.normal(), source }
    }

    /// Place (s, t) in the unit square and the area that a unit of the square stands for.
    ///
    /// Triangles: (1 - sqrt s, sqrt s (1 - t), sqrt s t), which keeps area (Turk 1990). Quads: bilinear.
    pub fn place(&self, s: f64, t: f64) -> (DVec3, f64) {
        let [v0, v1, v2, v3] = self.corners;
        if self.is_triangle {
            let r = s.sqrt();
            return (v0 * (1.0 - r) + v1 * (r * (1.0 - t)) + v2 * (r * t), 1.0);
        }
        let along_s = (v1 - v0).lerp(v2 - v3, t);
        let along_t = (v3 - v0).lerp(v2 - v1, s);
        let position = (v0 + s * (v1 - v0)).lerp(v3 + s * (v2 - v3), t);
        (position, along_s.cross(along_t).length())
    }

    /// One target per stratum, row by row as a fan's rays, weighted by area.
    pub fn strata(&self, n: u32, jitter: [f64; 2], offset_m: f64) -> Vec<Target> {
        (0..n * n)
            .map(|k| {
                let s = (f64::from(k % n) + jitter[0]) / f64::from(n);
                let t = (f64::from(k / n) + jitter[1]) / f64::from(n);
                let (position, weight) = self.place(s, t);
                Target { position: position + offset_m * self.normal, weight }
            })
            .collect()
    }

    /// The same targets as a fan, when the polygon is one.
    pub fn fan(&self, apex: DVec3, n: u32, jitter: [f64; 2], offset_m: f64) -> Option<RayBundle> {
        let [v0, v1, _, v3] = self.corners;
        let corner = v0 + offset_m * self.normal;
        self.is_parallelogram.then(|| RayBundle::Fan {
            apex,
            corner,
            edge_u: v1 - v0,
            edge_v: v3 - v0,
            n,
            m: n,
            jitter,
        })
    }

    /// cos cos' / r^2 between the point and a target on the polygon, 0 when either looks away.
    pub fn weight(&self, point: DVec3, normal: DVec3, target: DVec3) -> f64 {
        let r = target - point;
        let cosines = normal.dot(r).max(0.0) * (-self.normal.dot(r)).max(0.0);
        let r2 = r.length_squared();
        if cosines > 0.0 { cosines / (r2 * r2) } else { 0.0 }
    }
}

/// `n` targets over a curved side, patches hit in proportion to their kernels (systematic sampling): equal weights.
pub(super) fn spread(
    areas: &[Area],
    kernels: &[f64],
    n: usize,
    jitter: [f64; 2],
    offset_m: f64,
) -> Vec<Target> {
    let total: f64 = kernels.iter().sum();
    let mut targets = Vec::with_capacity(n);
    let (mut before, mut at) = (0.0, 0);
    for k in 0..n {
        let wanted = (k as f64 + jitter[0]) / n as f64 * total;
        while at + 1 < areas.len() && (before + kernels[at] <= wanted || kernels[at] == 0.0) {
            before += kernels[at];
            at += 1;
        }
        // What is left of `wanted` in the patch is uniform there; the other axis is a van der Corput sequence.
        let s = if kernels[at] > 0.0 { ((wanted - before) / kernels[at]).clamp(0.0, 1.0) } else { 0.5 };
        let t = (radical_inverse(k as u32) + jitter[1]).fract();
        let (position, _) = areas[at].place(s, t);
        targets.push(Target { position: position + offset_m * areas[at].normal, weight: 1.0 });
    }
    targets
}

/// Unit direction toward a light that is infinitely far.
pub(super) fn light_direction(light: &Light) -> Option<DVec3> {
    match light {
        Light::Directional { direction, .. } => Some(-*direction),
        Light::Point { .. } | Light::Spot { .. } => None,
    }
}

/// The place of samples in their strata, [0, 1)^2, from everything that names them.
pub(super) fn jitter(seed: u64, key: u64, source: u64) -> [f64; 2] {
    unit_pair(hash(seed, key, source))
}
