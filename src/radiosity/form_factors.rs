//! Form factors of one shooter to every receiver: kernel on the host, visibility through the port.
//!
//! ```text
//! patch --kernel (polygon formula), all receivers--> candidates --Targets bundles, one query--> visible share
//!       --> F = kernel x share, mean over the quadrature points of an element --> Row
//! patch --cosine-distributed rays--> share lost through openings, share on backs
//! ```
//! Source points: one a stratum (quarter) of the shooter, jittered. Shooters in `full` (emitters) are looked at with all
//! strata from every quadrature point and vertex. Of the others, sparse: one quadrature point of an element looks, and a
//! vertex takes the mean share of its elements, all at one stratum of the shooter, or, where its strata see different
//! things (half of it under a block), 64 neighbouring elements at the same one. Dense: each quadrature point looks at
//! one stratum, so that those of an element cover them all, and a vertex at one of its own. A stratum below the
//! receiver's horizon is passed over; when all are, the middle of what is above it is looked at.
//! Method: Wallace, Elmquist, Haines 1989, with the exact kernel instead of the disc.
//!
//! Not modelled: light through glass, and the penumbra inside a patch beyond the four strata.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::emitters::Emitter;
use super::kernel::{Kernel, Source};
use super::near_field::{self, Extent};
use super::receivers::Receivers;
use super::row::SparseRow;
use crate::geom::{Ray, tangent_frame};
use crate::mesh::{Corners, ElementId, Mesh, PatchId, VertexId};
use crate::raycast::{CastError, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::sampling::{hash, unit_pair};
use crate::scene::SurfaceId;

/// Strata of a shooter.
const N_STRATA: usize = 4;
/// Bit of a ray to the middle of what is above the horizon.
const MIDDLE: u8 = 1 << N_STRATA;
/// Source points keep this share of a stratum's width off its edges, where a wall may stand.
const STRATUM_MARGIN: f64 = 0.02;
/// Parts that the receivers of a query are cut into.
const RECEIVER_BLOCKS: usize = 16;
/// Cosine-distributed rays that measure what a shooter loses: n x n strata, jittered, dealt to its source points.
/// Not a `Hemisphere` bundle: its few rings are the same for every shooter, which shifts a loss by 1 % of the power.
const HEMISPHERE_SIDE: u32 = 8;
/// The same for shooters in `full`, which carry most of the power.
const FULL_HEMISPHERE_SIDE: u32 = 16;

/// Form factors from every receiver to one shooter.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Row {
    /// Means over elements.
    pub elements: SparseRow,
    /// At vertices.
    pub vertices: SparseRow,
}

impl Row {
    pub(super) fn n_bytes(&self) -> u64 {
        self.elements.n_bytes() + self.vertices.n_bytes()
    }
}

/// Where the light of a shooter goes that reaches no element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct StrayShares {
    /// Out through openings.
    pub lost: f64,
    /// Onto backs of one-sided surfaces.
    pub back: f64,
}

/// Who shoots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum ShooterId {
    Patch(PatchId),
    /// An index into [`FormFactors::emitters`].
    Emitter(u32),
}

/// How a shooter is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    pub shooter: ShooterId,
    /// With all strata from everywhere.
    pub full: bool,
    /// Its strata see different things: receivers take turns.
    pub uneven: bool,
}

/// Shares of stray light that two strata of an even shooter differ by at most.
const EVEN_SHARE: f64 = 0.5;

/// Casts rows.
pub(super) struct FormFactors<'a> {
    pub mesh: &'a Mesh,
    pub receivers: &'a Receivers,
    pub emitters: &'a [Emitter],
    pub seed: u64,
    pub offset_m: f64,
    pub kernel: Kernel,
    /// Every quadrature point and vertex casts a ray of its own to shooters that do not emit, too.
    pub dense: bool,
}

impl FormFactors<'_> {
    /// The rows of `shooters`, and how many rays each took, in one query.
    pub(super) fn rows(
        &self,
        shooters: &[Aim],
        caster: &mut dyn RayCaster,
    ) -> Result<Vec<(Row, u64)>, CastError> {
        let plans: Vec<Plan> = shooters.iter().map(|aim| self.plan(*aim)).collect();
        let mut bundles: Vec<Vec<RayBundle>> = plans.par_iter().map(|plan| self.bundles(plan)).collect();
        // Receivers block by block, in each block shooter by shooter: neighbouring bundles meet the same patches, and a
        // cluster of the board that is given a range of them keeps to a part of the scene.
        let mut order: Vec<(usize, usize)> = Vec::new();
        for block in 0..RECEIVER_BLOCKS {
            for (p, of_plan) in bundles.iter().enumerate() {
                let edge = |k: usize| k * of_plan.len() / RECEIVER_BLOCKS;
                order.extend((edge(block)..edge(block + 1)).map(|b| (p, b)));
            }
        }
        let nothing = RayBundle::Targets { apex: DVec3::ZERO, points: Vec::new() };
        let take = |&(p, b): &(usize, usize)| std::mem::replace(&mut bundles[p][b], nothing.clone());
        let query: Vec<RayBundle> = order.iter().map(take).collect();
        let answers = match query.is_empty() {
            true => Vec::new(),
            false => caster.any_hits(Purpose::FormFactor, Query::Bundles(&query))?,
        };
        // Blocks of a shooter come in order, so its answers do too.
        let mut blocked = vec![Vec::new(); plans.len()];
        let mut at = 0;
        for (&(p, _), bundle) in order.iter().zip(&query) {
            blocked[p].extend_from_slice(&answers[at..at + bundle.n_rays()]);
            at += bundle.n_rays();
        }
        let rows = plans.par_iter().zip(&blocked);
        Ok(rows.map(|(plan, blocked)| (self.row(plan, blocked), blocked.len() as u64)).collect())
    }

    /// The shooter made ready.
    fn shooter(&self, id: ShooterId) -> Shooter {
        let mut shooter = match id {
            ShooterId::Patch(patch) => Shooter::of(self.mesh, patch, self.seed, self.offset_m),
            ShooterId::Emitter(e) => {
                let key = self.mesh.patches.len() as u64 + u64::from(e);
                Shooter::of_emitter(&self.emitters[e as usize], key, self.seed, self.offset_m)
            }
        };
        shooter.source = shooter.source.with_kernel(self.kernel);
        shooter
    }

    /// What every receiver asks of a shooter.
    fn plan(&self, aim: Aim) -> Plan {
        let Aim { full, .. } = aim;
        let shooter = self.shooter(aim.shooter);
        let receivers = &self.receivers.all;
        let n_gauss = self.receivers.n_gauss();
        let mut kernels: Vec<f64> = receivers
            .par_iter()
            .enumerate()
            .with_min_len(1024)
            .map(|(i, r)| {
                let is_own =
                    i < n_gauss && shooter.is_own(self.mesh, self.mesh.elements[r.owner as usize].patch);
                if is_own { 0.0 } else { shooter.source.form_factor(r.point, r.normal) }
            })
            .collect();
        self.integrate_near(&shooter, &mut kernels);
        let dense = full || self.dense;
        let looks = (0..receivers.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let asks = dense || self.stands_in(shooter.key, i, &kernels);
                if asks { self.looks(&shooter, i, &kernels, aim) } else { 0 }
            })
            .collect();
        Plan { shooter, dense, kernels, looks }
    }

    /// Makes the kernels of elements close to the shooter, whose mean four points do not give, add up to that mean.
    fn integrate_near(&self, shooter: &Shooter, kernels: &mut [f64]) {
        let starts = &self.receivers.element_starts;
        let means: Vec<(usize, f64)> = (self.receivers.extents.par_iter().enumerate().with_min_len(1024))
            .filter(|(_, extent)| extent.is_near(&shooter.extent))
            .filter_map(|(e, _)| {
                let element = &self.mesh.elements[e];
                let polygon = self.mesh.polygon(&element.corners);
                let mean = || near_field::mean_form_factor(&shooter.source, &polygon, element.normal);
                (!shooter.is_own(self.mesh, element.patch)).then(|| (e, mean()))
            })
            .collect();
        for (e, mean) in means {
            let points = starts[e] as usize..starts[e + 1] as usize;
            let by_points: f64 = points.clone().map(|i| self.receivers.all[i].weight * kernels[i]).sum();
            for kernel in &mut kernels[points] {
                *kernel = if by_points > 0.0 { *kernel * (mean / by_points) } else { mean };
            }
        }
    }

    /// A row from what its rays saw, in the order of [`FormFactors::bundles`].
    fn row(&self, plan: &Plan, blocked: &[bool]) -> Row {
        let Plan { dense, kernels, looks, .. } = plan;
        let receivers = &self.receivers.all;
        let n_gauss = self.receivers.n_gauss();
        let mut n_visible = vec![0u8; receivers.len()];
        for (owner, blocked) in plan.owners().zip(blocked) {
            n_visible[owner] += u8::from(!blocked);
        }
        let own_share = |i: usize| f64::from(n_visible[i]) / f64::from(looks[i].count_ones());
        let starts = &self.receivers.element_starts;
        let points_of = |e: usize| starts[e] as usize..starts[e + 1] as usize;
        // Sparse: the share that the element's one ray saw, if it cast one.
        let element_share = |e: usize| points_of(e).find(|&i| looks[i] != 0).map(own_share);
        let elements: Vec<f32> = (0..self.receivers.n_elements())
            .into_par_iter()
            .with_min_len(1024)
            .map(|e| {
                let weighted = |i: usize| receivers[i].weight * kernels[i];
                let factor: f64 = if *dense {
                    points_of(e).filter(|&i| looks[i] != 0).map(|i| weighted(i) * own_share(i)).sum()
                } else {
                    element_share(e).map_or(0.0, |share| share * points_of(e).map(weighted).sum::<f64>())
                };
                factor as f32
            })
            .collect();
        let vertices: Vec<f32> = (n_gauss..receivers.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                if kernels[i] == 0.0 {
                    return 0.0;
                }
                let share = if looks[i] != 0 {
                    own_share(i)
                } else {
                    let around = self.mesh.elements_around(VertexId(receivers[i].owner));
                    let shares = around.iter().filter_map(|e| element_share(e.0 as usize));
                    let (sum, n) = shares.fold((0.0, 0), |(sum, n), share| (sum + share, n + 1));
                    sum / f64::from(n.max(1))
                };
                (kernels[i] * share) as f32
            })
            .collect();
        Row { elements: SparseRow::pack(&elements), vertices: SparseRow::pack(&vertices) }
    }

    /// Sparse: true for the one quadrature point of an element that casts its ray, a hashed one of those that the
    /// shooter's light reaches, and for a vertex none of whose elements casts one.
    fn stands_in(&self, key: u64, i: usize, kernels: &[f64]) -> bool {
        let receiver = &self.receivers.all[i];
        let starts = &self.receivers.element_starts;
        let lit = |e: usize| (starts[e] as usize..starts[e + 1] as usize).filter(|&p| kernels[p] != 0.0);
        if i >= self.receivers.n_gauss() {
            let around = self.mesh.elements_around(VertexId(receiver.owner));
            return around.iter().all(|e| lit(e.0 as usize).next().is_none());
        }
        let e = receiver.owner as usize;
        let n_lit = lit(e).count();
        let turn = hash(self.seed, key, 3 << 40 | u64::from(receiver.owner)) as usize;
        n_lit > 0 && lit(e).nth(turn % n_lit) == Some(i)
    }

    /// The strata that receiver `i` looks at.
    fn looks(&self, shooter: &Shooter, i: usize, kernels: &[f64], aim: Aim) -> u8 {
        if kernels[i] == 0.0 {
            return 0;
        }
        let receiver = &self.receivers.all[i];
        let first = if self.dense {
            let kind = u64::from(i >= self.receivers.n_gauss()) << 32;
            let turn = hash(self.seed, shooter.key, kind | u64::from(receiver.owner)) as usize;
            turn + receiver.slot as usize
        } else {
            // All from one point, or at least a bundle's worth of neighbours, so that they cross the same cells.
            let group = if aim.uneven { 1 + u64::from(receiver.owner) / MAX_BUNDLE_RAYS as u64 } else { 0 };
            hash(self.seed, shooter.key, 4 << 40 | group) as usize
        };
        shooter.looks(receiver.target, receiver.normal, first % N_STRATA, aim.full)
    }

    /// `Targets` bundles stratum by stratum, receivers in mesh order: a ray per entry of [`Plan::owners`].
    fn bundles(&self, plan: &Plan) -> Vec<RayBundle> {
        let shooter = &plan.shooter;
        let mut bundles = Vec::new();
        for (stratum, &apex) in shooter.apexes.iter().enumerate() {
            let looking: Vec<u32> = plan.looking_at(1 << stratum).map(|i| i as u32).collect();
            let target = |i: &u32| self.receivers.all[*i as usize].target;
            let bundle =
                |chunk: &[u32]| RayBundle::Targets { apex, points: chunk.iter().map(target).collect() };
            bundles.par_extend(looking.par_chunks(MAX_BUNDLE_RAYS).with_min_len(64).map(bundle));
        }
        bundles.extend(plan.looking_at(MIDDLE).map(|i| {
            let r = &self.receivers.all[i];
            let middle = shooter.source.centre_above_horizon(r.point, r.normal);
            let apex = middle.unwrap_or(shooter.centre) + self.offset_m * shooter.normal;
            RayBundle::Targets { apex, points: vec![r.target] }
        }));
        bundles
    }

    /// Shares of each shooter's light that reach no element, how it is to be looked at, and how many rays that took, in
    /// one query. `shooters`: who, and whether in full.
    pub(super) fn stray_shares(
        &self,
        shooters: &[(ShooterId, bool)],
        caster: &mut dyn RayCaster,
    ) -> Result<(Vec<(StrayShares, Aim)>, u64), CastError> {
        let (mut rays, mut ends) = (Vec::new(), Vec::new());
        for &(shooter, full) in shooters {
            self.add_hemisphere_rays(shooter, full, &mut rays);
            ends.push(rays.len());
        }
        let hits = caster.closest_hits(Purpose::FormFactor, Query::Rays(&rays))?;
        let mut start = 0;
        let shares = ends.into_iter().zip(shooters).map(|(end, &(shooter, full))| {
            let hits = &hits[std::mem::replace(&mut start, end)..end];
            let of_stratum = |k| {
                let side = hemisphere_side(full);
                let stray =
                    stray(self.mesh, hits, |ray| f64::from(u8::from(stratum_of(ray as u32, side) == k)));
                stray.lost + stray.back
            };
            let by_stratum: [f64; N_STRATA] = std::array::from_fn(of_stratum);
            let least = by_stratum.iter().copied().fold(f64::INFINITY, f64::min);
            let most = by_stratum.iter().copied().fold(0.0, f64::max);
            (stray(self.mesh, hits, |_| 1.0), Aim { shooter, full, uneven: most - least > EVEN_SHARE })
        });
        Ok((shares.collect(), rays.len() as u64))
    }

    fn add_hemisphere_rays(&self, shooter: ShooterId, full: bool, rays: &mut Vec<Ray>) {
        let side = hemisphere_side(full);
        let shooter = self.shooter(shooter);
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
fn hemisphere_side(full: bool) -> u32 {
    if full { FULL_HEMISPHERE_SIDE } else { HEMISPHERE_SIDE }
}

/// The stratum of the shooter that hemisphere ray `k` starts from.
fn stratum_of(k: u32, side: u32) -> usize {
    (k % side % 2 + 2 * (k / side % 2)) as usize
}

/// One shooter's questions.
struct Plan {
    shooter: Shooter,
    /// Every receiver looks for itself.
    dense: bool,
    /// Unoccluded form factor at every receiver.
    kernels: Vec<f64>,
    /// Strata that every receiver looks at, and `MIDDLE`.
    looks: Vec<u8>,
}

impl Plan {
    /// Receivers that look at a stratum (a bit of `looks`).
    fn looking_at(&self, bit: u8) -> impl Iterator<Item = usize> {
        let looks = self.looks.iter().enumerate();
        looks.filter(move |(_, looks)| *looks & bit != 0).map(|(i, _)| i)
    }

    /// The receiver of every ray, in the order of [`FormFactors::bundles`].
    fn owners(&self) -> impl Iterator<Item = usize> {
        (0..N_STRATA).map(|k| 1 << k).chain([MIDDLE]).flat_map(|bit| self.looking_at(bit))
    }
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

/// What never sees a shooter.
#[derive(Clone, Copy)]
enum Own {
    /// The patch itself and its other side.
    Patch(PatchId, Option<PatchId>),
    /// All of a plane surface.
    Surface(SurfaceId),
}

/// A patch or emitter made ready to shoot.
struct Shooter {
    /// Of sampling patterns.
    key: u64,
    own: Own,
    source: Source,
    extent: Extent,
    normal: DVec3,
    centre: DVec3,
    /// Source points on the patch (m), one a stratum, and the same lifted off it.
    points: [DVec3; N_STRATA],
    apexes: [DVec3; N_STRATA],
}

impl Shooter {
    fn of(mesh: &Mesh, id: PatchId, seed: u64, offset_m: f64) -> Shooter {
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

    fn of_emitter(emitter: &Emitter, key: u64, seed: u64, offset_m: f64) -> Shooter {
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
    fn is_own(&self, mesh: &Mesh, patch: PatchId) -> bool {
        match self.own {
            Own::Patch(own, twin) => patch == own || Some(patch) == twin,
            Own::Surface(surface) => mesh.patches[patch.0 as usize].surface == surface,
        }
    }

    /// Strata that a receiver looks at: those above its horizon, all or the first from `first` on.
    fn looks(&self, target: DVec3, normal: DVec3, first: usize, full: bool) -> u8 {
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
