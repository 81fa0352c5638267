//! Where the light of a shooter goes that reaches no element: out through openings, and onto backs.
//!
//! ```text
//! shooter --n x n cosine-distributed rays, one query for many shooters--> hits --> shares that were lost, that met backs
//! ```

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::form_factors::FormFactors;
use super::shooter::{Aim, Look};
use crate::geom::{Ray, tangent_frame};
use crate::mesh::Mesh;
use crate::raycast::{CastError, Purpose, Query, RayCaster, RayHit, transmit};
use crate::sampling::{hash, unit_pair};

/// Cosine-distributed rays that measure what a shooter loses: n x n strata, jittered, dealt to its source points.
/// Not a `Hemisphere` bundle: its few rings are the same for every shooter, which shifts a loss by 1 % of the power.
const HEMISPHERE_SIDE: u32 = 8;
/// The same for shooters that are looked at in full, which carry most of the power.
const FULL_HEMISPHERE_SIDE: u32 = 16;
/// The same for the emitters of large scenes: a few dozen of them make up a lamp's loss.
const DENSE_HEMISPHERE_SIDE: u32 = 32;

/// Where the light of a shooter goes that reaches no element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct StrayShares {
    /// Out through openings.
    pub lost: f64,
    /// Onto backs of one-sided surfaces.
    pub back: f64,
}

/// Shares of light that strayed behind panes, which are counted at the glass, too: by elements, and on backs.
pub(super) type Passed = [f64; 2];

impl FormFactors<'_> {
    /// Shares of each shooter's light that reach no element, and how many rays that took, in one query.
    pub(super) fn stray_shares(
        &self,
        aims: &[Aim],
        caster: &mut dyn RayCaster,
    ) -> Result<(Vec<(StrayShares, Passed)>, u64), CastError> {
        let (mut rays, mut ends) = (Vec::new(), Vec::new());
        for &aim in aims {
            self.add_hemisphere_rays(aim, &mut rays);
            ends.push(rays.len());
        }
        let hits = caster.closest_hits(Purpose::FormFactor, Query::Rays(&rays))?;
        let beyond = self.panes.beyond(caster, Purpose::FormFactor, Query::Rays(&rays), &hits)?;
        let mut start = 0;
        let shares = ends.into_iter().map(|end| {
            let own = std::mem::replace(&mut start, end)..end;
            let own_beyond = beyond.iter().filter(|p| own.contains(&p.index));
            let mut shares = stray(self.mesh, &hits[own.clone()], |_| 1.0);
            let passed = add_beyond(self.mesh, &mut shares, own_beyond, |_| 1.0 / own.len() as f64);
            (shares, passed)
        });
        Ok((shares.collect(), rays.len() as u64))
    }

    fn add_hemisphere_rays(&self, aim: Aim, rays: &mut Vec<Ray>) {
        let side = hemisphere_side(aim.look);
        let shooter = self.shooter(aim.shooter);
        let (t1, t2) = tangent_frame(shooter.normal);
        rays.extend((0..side * side).map(|k| {
            let (i, j) = (k % side, k / side);
            let [du, dv] = unit_pair(hash(self.seed, shooter.key, 2 << 40 | u64::from(k)));
            let (u, v) = ((f64::from(i) + du) / f64::from(side), (f64::from(j) + dv) / f64::from(side));
            let (sin, cos) = (TAU * v).sin_cos();
            let d = u.sqrt() * (cos * t1 + sin * t2) + (1.0 - u).sqrt() * shooter.normal;
            Ray::unbounded(shooter.apexes[stratum_of(k, side)], d)
        }));
    }
}

/// Strata of the hemisphere along each axis.
fn hemisphere_side(look: Look) -> u32 {
    match look {
        Look::Sparse => HEMISPHERE_SIDE,
        Look::Full => FULL_HEMISPHERE_SIDE,
        Look::Dense => DENSE_HEMISPHERE_SIDE,
    }
}

/// The stratum of the shooter that hemisphere ray `k` starts from.
fn stratum_of(k: u32, side: u32) -> usize {
    (k % side % 2 + 2 * (k / side % 2)) as usize
}

/// Weighted shares of rays that miss everything and that hit backs of one-sided surfaces.
pub(super) fn stray(mesh: &Mesh, hits: &[Option<RayHit>], weight: impl Fn(usize) -> f64) -> StrayShares {
    let (mut shares, mut total) = (StrayShares::default(), 0.0);
    for (i, hit) in hits.iter().enumerate() {
        total += weight(i);
        match hit {
            None => shares.lost += weight(i),
            Some(hit) if mesh.patch_of_hit(hit.patch, hit.facing).is_none() => shares.back += weight(i),
            Some(_) => {}
        }
    }
    if total > 0.0 {
        shares = StrayShares { lost: shares.lost / total, back: shares.back / total };
    }
    shares
}

/// Adds what strays behind panes; `weight`: what each ray stands for.
pub(super) fn add_beyond<'a>(
    mesh: &Mesh,
    shares: &mut StrayShares,
    beyond: impl Iterator<Item = &'a transmit::Passed>,
    weight: impl Fn(usize) -> f64,
) -> Passed {
    let mut passed = [0.0; 2];
    for p in beyond {
        let share = weight(p.index) * p.share.luminance();
        match p.hit {
            None => shares.lost += share,
            Some(hit) if mesh.patch_of_hit(hit.patch, hit.facing).is_none() => shares.back += share,
            Some(_) => continue,
        }
        passed[usize::from(p.by_back)] += share;
    }
    passed
}
