//! A ray segment: `origin + t dir` for `t_min <= t <= t_max`, t in units of dir's length.

use super::DVec3;

/// A ray segment in scene space (m). `dir` need not be of unit length; `t` counts lengths of `dir`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where t = 0 (m).
    pub origin: DVec3,
    /// Direction, any non-zero length (m per unit of t).
    pub dir: DVec3,
    /// Smallest t that counts; the board takes 0 only.
    pub t_min: f64,
    /// Largest t that counts; may be infinite.
    pub t_max: f64,
}

impl Ray {
    /// A ray without end from `origin` along `dir`.
    pub fn unbounded(origin: DVec3, dir: DVec3) -> Ray {
        Ray { origin, dir, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// The segment from `origin` to `target`: t = 1 at the target.
    pub fn to_point(origin: DVec3, target: DVec3) -> Ray {
        Ray { origin, dir: target - origin, t_min: 0.0, t_max: 1.0 }
    }

    /// The point at parameter `t` (m).
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.dir
    }
}
