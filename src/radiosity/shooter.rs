//! A patch, or a part of an emitting surface, made ready to shoot: its kernel's polygon and a point in each stratum.
//!
//! ```text
//! patch or emitter --seed--> Source (kernel), 4 jittered points, one a stratum (quarter), lifted off it for rays
//! ```

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::emitters::Emitter;
use super::kernel::Source;
use super::near_field::Extent;
use crate::mesh::{Corners, ElementId, Mesh, PatchId};
use crate::sampling::{hash, unit_pair};
use crate::scene::SurfaceId;

/// Strata of a shooter.
pub(super) const N_STRATA: usize = 4;
/// Bit of a ray to the middle of what is above the horizon.
pub(super) const MIDDLE: u8 = 1 << N_STRATA;
/// Source points keep this share of a stratum's width off its edges, where a wall may stand.
const STRATUM_MARGIN: f64 = 0.02;

/// Who shoots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum ShooterId {
    Patch(PatchId),
    /// An index into [`FormFactors::emitters`].
    Emitter(u32),
}

/// How a shooter is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum Look {
    /// By one quadrature point of an element, at one stratum; vertices take the mean of their elements.
    Sparse,
    /// By every quadrature point and vertex, each at one stratum.
    Dense,
    /// By every quadrature point and vertex, at all strata.
    Full,
}

/// Who is looked at, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct Aim {
    pub shooter: ShooterId,
    pub look: Look,
}

/// What never sees a shooter.
#[derive(Clone, Copy)]
enum Own {
    /// The patch itself and its other side.
    Patch(PatchId, Option<PatchId>),
    /// All of a plane surface.
    Surface(SurfaceId),
}

/// A patch or emitter made ready to shoot.
pub(super) struct Shooter {
    /// Of sampling patterns.
    pub(super) key: u64,
    own: Own,
    pub(super) source: Source,
    pub(super) extent: Extent,
    pub(super) normal: DVec3,
    pub(super) centre: DVec3,
    /// Source points on the patch (m), one a stratum, and the same lifted off it.
    points: [DVec3; N_STRATA],
    pub(super) apexes: [DVec3; N_STRATA],
}

impl Shooter {
    pub(super) fn of(mesh: &Mesh, id: PatchId, seed: u64, offset_m: f64) -> Shooter {
        let patch = &mesh.patches[id.0 as usize];
        let corners = mesh.polygon(&patch.corners);
        let mut points = [DVec3::ZERO; N_STRATA];
        let mut apexes = points;
        for k in 0..N_STRATA {
            let jitter = stratum_jitter(seed, u64::from(id.0), k);
            points[k] = mesh.quarter_position(id, k as u32, folded(&patch.corners, jitter));
            apexes[k] = points[k] + offset_m * patch.normal;
        }
        Shooter {
            key: u64::from(id.0),
            own: Own::Patch(id, patch.twin),
            source: Source::new(&corners),
            extent: Extent::of(&corners),
            normal: patch.normal,
            centre: corners.iter().sum::<DVec3>() / corners.len() as f64,
            points,
            apexes,
        }
    }

    pub(super) fn of_emitter(emitter: &Emitter, key: u64, seed: u64, offset_m: f64) -> Shooter {
        let [a, b, c, d] = emitter.corners;
        let place = |k: usize| {
            let [s, t] = stratum_jitter(seed, key, k);
            let (s, t) = (0.5 * (s + (k & 1) as f64), 0.5 * (t + (k >> 1) as f64));
            (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * d + s * c)
        };
        let points: [DVec3; N_STRATA] = std::array::from_fn(place);
        Shooter {
            key,
            own: Own::Surface(emitter.surface),
            source: Source::new(&emitter.corners),
            extent: Extent::of(&emitter.corners),
            normal: emitter.normal,
            centre: 0.25 * (a + b + c + d),
            points,
            apexes: points.map(|p| p + offset_m * emitter.normal),
        }
    }

    /// True for patches that never see it.
    pub(super) fn is_own(&self, mesh: &Mesh, patch: PatchId) -> bool {
        match self.own {
            Own::Patch(own, twin) => patch == own || Some(patch) == twin,
            Own::Surface(surface) => mesh.patches[patch.0 as usize].surface == surface,
        }
    }

    /// Strata that a receiver looks at: those above its horizon, all or the first from `first` on.
    pub(super) fn looks(&self, target: DVec3, normal: DVec3, first: usize, full: bool) -> u8 {
        let mut looks = 0;
        for turn in 0..N_STRATA {
            let k = (first + turn) % N_STRATA;
            if (self.points[k] - target).dot(normal) > 0.0 {
                looks |= 1 << k;
                if !full {
                    break;
                }
            }
        }
        if looks == 0 { MIDDLE } else { looks }
    }
}

/// Place of a shooter's source point in stratum `k`.
fn stratum_jitter(seed: u64, key: u64, k: usize) -> [f64; 2] {
    unit_pair(hash(seed, key, 1 << 40 | k as u64)).map(|u| STRATUM_MARGIN + (1.0 - 2.0 * STRATUM_MARGIN) * u)
}

/// Local coordinates of a uniform sample in an element; a triangle folds the square.
pub(super) fn inside(mesh: &Mesh, element: ElementId, st: [f64; 2]) -> DVec2 {
    folded(&mesh.elements[element.0 as usize].corners, st)
}

fn folded(corners: &Corners, [s, t]: [f64; 2]) -> DVec2 {
    match corners {
        Corners::Triangle(_) if s + t > 1.0 => DVec2::new(1.0 - s, 1.0 - t),
        _ => DVec2::new(s, t),
    }
}
