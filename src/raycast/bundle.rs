//! Ray bundles: at most 64 rays from one apex, described instead of listed, so that the bus carries little.

use glam::DVec3;

use super::CastError;
use crate::geom::{Ray, tangent_frame};

/// Rays that start at one apex. Ray i of an n x m kind is column `i % n`, row `i / n`.
#[derive(Clone, Debug, PartialEq)]
pub enum RayBundle {
    /// Camera tile: directions `corner + i step_u + j step_v`.
    Tile {
        /// Common origin (m).
        apex: DVec3,
        /// Direction of ray (0, 0).
        corner: DVec3,
        /// Direction step along a row.
        step_u: DVec3,
        /// Direction step from row to row.
        step_v: DVec3,
        /// Rays in a row.
        n: u32,
        /// Rows.
        m: u32,
    },
    /// Shadow rays to strata of a parallelogram: targets `corner + (i + jitter.0)/n edge_u + (j + jitter.1)/m edge_v`,
    /// t = t_max = 1 at the target.
    Fan {
        /// Common origin (m).
        apex: DVec3,
        /// Corner of the parallelogram (m).
        corner: DVec3,
        /// Its first edge (m).
        edge_u: DVec3,
        /// Its second edge (m).
        edge_v: DVec3,
        /// Strata along `edge_u`.
        n: u32,
        /// Strata along `edge_v`.
        m: u32,
        /// Place of the sample in its stratum, [0,1)^2.
        jitter: [f64; 2],
    },
    /// Cosine-distributed directions about `normal`: places `((i + jitter.0)/n, (j + jitter.1)/m)` of the unit square.
    Hemisphere {
        /// Common origin (m).
        apex: DVec3,
        /// Unit normal.
        normal: DVec3,
        /// Rotation of the frame about the normal (radians).
        spin: f64,
        /// Strata along the first axis of the square; the whole square is n x m.
        n: u32,
        /// Strata along the second axis.
        m: u32,
        /// Place of the sample in its stratum, [0,1)^2.
        jitter: [f64; 2],
    },
    /// Rays to listed points, t = t_max = 1 at each.
    Targets {
        /// Common origin (m).
        apex: DVec3,
        /// Up to 64 points (m).
        points: Vec<DVec3>,
    },
}

/// Most rays that a bundle may hold.
pub const MAX_BUNDLE_RAYS: usize = 64;

impl RayBundle {
    /// How many rays.
    pub fn n_rays(&self) -> usize {
        match self {
            RayBundle::Tile { n, m, .. }
            | RayBundle::Fan { n, m, .. }
            | RayBundle::Hemisphere { n, m, .. } => *n as usize * *m as usize,
            RayBundle::Targets { points, .. } => points.len(),
        }
    }

    /// The common origin (m).
    pub fn apex(&self) -> DVec3 {
        match self {
            RayBundle::Tile { apex, .. }
            | RayBundle::Fan { apex, .. }
            | RayBundle::Hemisphere { apex, .. }
            | RayBundle::Targets { apex, .. } => *apex,
        }
    }

    /// Ray `i` in f64: what the software caster casts, and what `t` of a hit refers to for every caster.
    ///
    /// # Panics
    /// When `i >= n_rays()`.
    pub fn ray(&self, i: usize) -> Ray {
        assert!(i < self.n_rays(), "ray {i} of a bundle of {}", self.n_rays());
        let split = |n: u32| ((i as u32 % n) as f64, (i as u32 / n) as f64);
        match self {
            RayBundle::Tile { apex, corner, step_u, step_v, n, .. } => {
                let (u, v) = split(*n);
                Ray::unbounded(*apex, *corner + u * *step_u + v * *step_v)
            }
            RayBundle::Fan { apex, corner, edge_u, edge_v, n, m, jitter } => {
                let (u, v) = split(*n);
                let (s, t) = ((u + jitter[0]) / *n as f64, (v + jitter[1]) / *m as f64);
                Ray::to_point(*apex, *corner + s * *edge_u + t * *edge_v)
            }
            RayBundle::Hemisphere { normal, spin, .. } => {
                self.hemisphere_ray(spun_frame(*normal, *spin), i as u32)
            }
            RayBundle::Targets { apex, points } => Ray::to_point(*apex, points[i]),
        }
    }

    /// Gives all rays, in order: those of [`RayBundle::ray`], at less cost.
    pub fn for_each_ray(&self, mut each: impl FnMut(Ray)) {
        match self {
            RayBundle::Hemisphere { normal, spin, n, m, .. } => {
                let frame = spun_frame(*normal, *spin);
                (0..n * m).for_each(|i| each(self.hemisphere_ray(frame, i)));
            }
            _ => (0..self.n_rays()).for_each(|i| each(self.ray(i))),
        }
    }

    /// Ray `i` of a hemisphere whose tangents are `t1` and `t2`.
    #[inline]
    fn hemisphere_ray(&self, (t1, t2): (DVec3, DVec3), i: u32) -> Ray {
        let RayBundle::Hemisphere { apex, normal, n, m, jitter, .. } = self else {
            unreachable!("only hemispheres have a frame")
        };
        let (u, v) = (f64::from(i % n) + jitter[0], f64::from(i / n) + jitter[1]);
        let d = cosine_direction(u / f64::from(*n), v / f64::from(*m));
        Ray::unbounded(*apex, d.x * t1 + d.y * t2 + d.z * *normal)
    }
}

/// The tangent frame of `normal`, turned about it by `spin` radians.
pub fn spun_frame(normal: DVec3, spin: f64) -> (DVec3, DVec3) {
    let (t1, t2) = tangent_frame(normal);
    let (sin, cos) = spin.sin_cos();
    (cos * t1 + sin * t2, cos * t2 - sin * t1)
}

/// Unit square to cosine-distributed unit direction about +z: concentric disk map (Shirley, Chiu 1997), lifted.
pub fn cosine_direction(u: f64, v: f64) -> DVec3 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec3::Z;
    }
    let (r, phi) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)) };
    let (sin, cos) = phi.sin_cos();
    DVec3::new(r * cos, r * sin, (1.0 - r * r).max(0.0).sqrt())
}

/// Lengths of a direction that f64 products of the casters carry without overflow or underflow.
const DIRECTION_LENGTHS: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

/// Checks what every caster needs of a ray: finite, a direction, a range that is one.
pub(super) fn check_ray(index: usize, ray: &Ray) -> Result<(), CastError> {
    let bad = |what: String| Err(CastError::BadRay { index, what });
    if !ray.origin.is_finite() {
        return bad(format!("origin {} is not finite", ray.origin));
    }
    if !ray.dir.is_finite() || !DIRECTION_LENGTHS.contains(&ray.dir.abs().max_element()) {
        let (low, high) = (DIRECTION_LENGTHS.start(), DIRECTION_LENGTHS.end());
        return bad(format!("direction {} has no length in {low:e}..={high:e}", ray.dir));
    }
    if !ray.t_min.is_finite() || ray.t_max.is_nan() {
        return bad(format!("t range {}..={} is none", ray.t_min, ray.t_max));
    }
    Ok(())
}

/// Checks a bundle whose first ray has `index` in its query: 1 to 64 rays, each usable, jitter in [0, 1).
pub(super) fn check_bundle(index: usize, bundle: &RayBundle) -> Result<(), CastError> {
    let n = bundle.n_rays();
    if !(1..=MAX_BUNDLE_RAYS).contains(&n) {
        let what = format!("a bundle of {n} rays; 1 to {MAX_BUNDLE_RAYS} are possible");
        return Err(CastError::BadRay { index, what });
    }
    if let RayBundle::Fan { jitter, .. } | RayBundle::Hemisphere { jitter, .. } = bundle
        && !jitter.iter().all(|j| (0.0..1.0).contains(j))
    {
        let what = format!("jitter {jitter:?} is outside [0, 1)");
        return Err(CastError::BadRay { index, what });
    }
    if let RayBundle::Hemisphere { normal, spin, .. } = bundle
        && !(spin.is_finite() && (normal.length() - 1.0).abs() < 1e-6)
    {
        let what = format!("normal {normal} of length {} or spin {spin} is no frame", normal.length());
        return Err(CastError::BadRay { index, what });
    }
    if matches!(bundle, RayBundle::Hemisphere { .. }) && bundle.apex().is_finite() {
        // Unit directions, by what was checked.
        return Ok(());
    }
    (0..n).try_for_each(|i| check_ray(index + i, &bundle.ray(i)))
}

/// Checks every bundle of a query.
pub(super) fn check_bundles(bundles: &[RayBundle]) -> Result<(), CastError> {
    let mut index = 0;
    for bundle in bundles {
        check_bundle(index, bundle)?;
        index += bundle.n_rays();
    }
    Ok(())
}
