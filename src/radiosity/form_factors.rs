//! Form factors of one shooter to every receiver: kernel on the host, visibility through the port.
//!
//! ```text
//! patch --kernel (polygon formula), all receivers--> candidates --Targets bundles, one query--> visible share
//!       --> F = kernel x share, mean over the quadrature points of an element --> Row
//! every 16th element, other points of the shooter, the same query--> what F would have been --> Row::spread
//! ```
//! Source points: one a stratum (quarter) of the shooter, jittered. Shooters are looked at in one of three ways ([`Look`]).
//! Full, the emitting patches of small scenes: with all strata from every quadrature point and vertex. Dense, the emitters of
//! large scenes, too many for that: each quadrature point looks at one stratum, so that those of an element cover them all, and
//! a vertex at one of its own. Sparse, all others: one quadrature point of an element looks, and a vertex takes the mean share of
//! its elements; 64 neighbouring elements look at the same stratum. A stratum below the receiver's horizon is passed over;
//! when all are, the middle of what is above it is looked at.
//! Method: Wallace, Elmquist, Haines 1989, with the exact kernel instead of the disc.
//!
//! How much of F is chance: two independent looks at a shooter differ, squared and in the mean, by twice the variance of
//! one. Of each row some elements look a second time, each time others; that makes no difference to F.
//!
//! Thin glass passes its transmittance, as a luminance. Not modelled: its colour in factors, light that it or closed glass sends
//! elsewhere, and the penumbra inside a patch beyond the four strata.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::emitters::Emitter;
use super::kernel::Kernel;
use super::near_field;
use super::receivers::Receivers;
use super::row::SparseRow;
use super::shooter::{Aim, Look, MIDDLE, N_STRATA, Shooter, ShooterId};
use crate::mesh::{Mesh, VertexId};
use crate::raycast::transmit::Panes;
use crate::raycast::{CastError, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster};
use crate::sampling::hash;

/// Parts that the receivers of a query are cut into.
const RECEIVER_BLOCKS: usize = 16;
/// One element in so many looks at a shooter a second time.
const SECOND_LOOK_STRIDE: usize = 16;

/// Form factors from every receiver to one shooter.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Row {
    /// Means over elements.
    pub elements: SparseRow,
    /// At vertices.
    pub vertices: SparseRow,
    /// Surfaces, and the sum over each one's elements of area x variance (m^2) of their factors: by second looks, so none
    /// where nobody asked for them.
    pub spread: Vec<(u32, f64)>,
    /// Sum of area x factor (m^2) of light that came through thin glass, which is counted at the glass, too: where
    /// elements count it, and on backs.
    pub passed_m2: [f64; 2],
}

impl Row {
    pub(super) fn n_bytes(&self) -> u64 {
        self.elements.n_bytes() + self.vertices.n_bytes() + size_of_val(self.spread.as_slice()) as u64
    }
}

/// Casts rows.
pub(super) struct FormFactors<'a> {
    pub mesh: &'a Mesh,
    pub receivers: &'a Receivers,
    pub emitters: &'a [Emitter],
    pub seed: u64,
    pub offset_m: f64,
    pub kernel: Kernel,
    /// Look twice, so that rows know their spread.
    pub twice: bool,
    pub panes: &'a Panes,
}

/// What rays saw of a shooter: 1, 0, or what panes pass.
struct Sight {
    shares: Vec<f32>,
    /// Of rays that passed panes: which, and whether the last was met on a back.
    through: Vec<(usize, bool)>,
}

impl FormFactors<'_> {
    /// The rows of `shooters`, and how many rays each took, in one query.
    pub(super) fn rows(
        &self,
        shooters: &[Aim],
        caster: &mut dyn RayCaster,
    ) -> Result<Vec<(Row, u64)>, CastError> {
        let mut plans: Vec<Plan> = shooters.iter().map(|aim| self.plan(*aim)).collect();
        if self.twice {
            let second: Vec<Plan> =
                shooters.iter().zip(&plans).map(|(aim, plan)| self.second_plan(*aim, plan)).collect();
            plans.extend(second);
        }
        let mut bundles: Vec<Vec<(u32, RayBundle)>> =
            plans.par_iter().map(|plan| self.bundles(plan)).collect();
        // Receivers block by block, in each block shooter by shooter: neighbouring bundles meet the same patches, and a
        // cluster of the board that is given a range of them keeps to a part of the scene.
        let n_receivers = self.receivers.all.len().max(1);
        let block = |first: u32| first as usize * RECEIVER_BLOCKS / n_receivers;
        let mut order: Vec<(usize, usize)> = Vec::new();
        for (p, of_plan) in bundles.iter().enumerate() {
            order.extend((0..of_plan.len()).map(|b| (p, b)));
        }
        order.sort_by_key(|&(p, b)| {
            let first = bundles[p][b].0;
            (block(first), p, first, b)
        });
        // Where the answers of a shooter's bundles begin among all of its.
        let starts: Vec<Vec<usize>> = bundles
            .iter()
            .map(|of_plan| {
                let mut sum = 0;
                let start = |(_, bundle): &(u32, RayBundle)| {
                    let start = sum;
                    sum += bundle.n_rays();
                    start
                };
                of_plan.iter().map(start).collect()
            })
            .collect();
        let mut blocked: Vec<Sight> = bundles
            .iter()
            .map(|of_plan| {
                let n_rays = of_plan.iter().map(|(_, bundle)| bundle.n_rays()).sum();
                Sight { shares: vec![0.0; n_rays], through: Vec::new() }
            })
            .collect();
        let nothing = RayBundle::Targets { apex: DVec3::ZERO, points: Vec::new() };
        let take = |&(p, b): &(usize, usize)| std::mem::replace(&mut bundles[p][b].1, nothing.clone());
        let query: Vec<RayBundle> = order.iter().map(take).collect();
        let answers = match query.is_empty() {
            true => Vec::new(),
            false => caster.any_hits(Purpose::FormFactor, Query::Bundles(&query))?,
        };
        let passed =
            self.panes.behind_panes(caster, Purpose::FormFactor, Query::Bundles(&query), &answers)?;
        let mut passed = passed.iter().peekable();
        let mut at = 0;
        for (&(p, b), bundle) in order.iter().zip(&query) {
            let (sight, end) = (&mut blocked[p], at + bundle.n_rays());
            let start = starts[p][b];
            for (share, blocked) in sight.shares[start..].iter_mut().zip(&answers[at..end]) {
                *share = f32::from(u8::from(!blocked));
            }
            while let Some(passed) = passed.next_if(|passed| passed.index < end) {
                let ray = start + passed.index - at;
                // A factor has no colour.
                sight.shares[ray] = passed.share.luminance() as f32;
                sight.through.push((ray, passed.by_back));
            }
            at = end;
        }
        blocked.iter_mut().for_each(|sight| sight.through.sort_unstable_by_key(|(ray, _)| *ray));
        let (plans, second_plans) = plans.split_at(shooters.len());
        let (blocked, second_blocked) = blocked.split_at(shooters.len());
        let row = |p: usize| {
            let (mut row, factors) = self.row(&plans[p], &blocked[p]);
            let mut n_rays = blocked[p].shares.len();
            if let (Some(plan), Some(blocked)) = (second_plans.get(p), second_blocked.get(p)) {
                row.spread = self.spread(&factors, plan, blocked);
                n_rays += blocked.shares.len();
            }
            (row, n_rays as u64)
        };
        Ok((0..shooters.len()).into_par_iter().map(row).collect())
    }

    /// The shooter made ready.
    pub(super) fn shooter(&self, id: ShooterId) -> Shooter {
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
        let looks = (0..receivers.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| self.looks(&shooter, i, &kernels, aim.look))
            .collect();
        Plan { shooter, look: aim.look, kernels: Arc::new(kernels), looks }
    }

    /// What the elements ask that look a second time: at other points of the shooter.
    fn second_plan(&self, aim: Aim, first: &Plan) -> Plan {
        let other = FormFactors { seed: hash(self.seed, 6 << 40, 0), ..*self };
        let shooter = other.shooter(aim.shooter);
        let mut looks = vec![0; self.receivers.all.len()];
        for e in self.looking_twice(&shooter) {
            for i in self.receivers.points_of(e) {
                looks[i] = other.looks(&shooter, i, &first.kernels, aim.look);
            }
        }
        Plan { shooter, look: aim.look, kernels: Arc::clone(&first.kernels), looks }
    }

    /// The elements that look at a shooter a second time.
    fn looking_twice(&self, shooter: &Shooter) -> impl Iterator<Item = usize> {
        let first = hash(0, shooter.key, 7 << 40) as usize % SECOND_LOOK_STRIDE;
        (first..self.receivers.n_elements()).step_by(SECOND_LOOK_STRIDE)
    }

    /// [`Row::spread`] from the factors of a row and what the second look saw.
    fn spread(&self, factors: &[f32], second: &Plan, sight: &Sight) -> Vec<(u32, f64)> {
        let n_visible = self.n_visible(second, sight.shares.iter().copied());
        let mut of_surfaces = BTreeMap::new();
        for e in self.looking_twice(&second.shooter) {
            let off = f64::from(factors[e]) - self.element_factor(second, &n_visible, e);
            let element = &self.mesh.elements[e];
            let variance = 0.5 * off * off * SECOND_LOOK_STRIDE as f64;
            // What rounding to f32 takes off is no spread.
            if off.abs() > f64::from(f32::EPSILON) * f64::from(factors[e]) {
                let surface = self.mesh.patches[element.patch.0 as usize].surface.0;
                *of_surfaces.entry(surface).or_insert(0.0) += element.area_m2 * variance;
            }
        }
        of_surfaces.into_iter().collect()
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

    /// What the rays of every receiver saw in all, from shares in the order of [`FormFactors::bundles`].
    fn n_visible(&self, plan: &Plan, shares: impl Iterator<Item = f32>) -> Vec<f32> {
        let mut n_visible = vec![0.0; self.receivers.all.len()];
        for (owner, share) in plan.owners().zip(shares) {
            n_visible[owner] += share;
        }
        n_visible
    }

    /// [`Row::passed_m2`].
    fn passed_m2(&self, plan: &Plan, sight: &Sight) -> [f64; 2] {
        [false, true].map(|by_back| {
            if !sight.through.iter().any(|(_, b)| *b == by_back) {
                return 0.0;
            }
            let mut shares = vec![0.0; sight.shares.len()];
            for (ray, _) in sight.through.iter().filter(|(_, b)| *b == by_back) {
                shares[*ray] = sight.shares[*ray];
            }
            let n_passed = self.n_visible(plan, shares.into_iter());
            let area_m2 = |e: usize| self.mesh.elements[e].area_m2;
            (0..self.receivers.n_elements())
                .map(|e| area_m2(e) * self.element_factor(plan, &n_passed, e))
                .sum()
        })
    }

    /// Sparse: the share that the element's one ray saw, if it cast one.
    fn element_share(&self, plan: &Plan, n_visible: &[f32], e: usize) -> Option<f64> {
        self.receivers.points_of(e).find(|&i| plan.looks[i] != 0).map(|i| plan.share(n_visible, i))
    }

    fn element_factor(&self, plan: &Plan, n_visible: &[f32], e: usize) -> f64 {
        let mut points = self.receivers.points_of(e);
        let weighted = |i: usize| self.receivers.all[i].weight * plan.kernels[i];
        if plan.look != Look::Sparse {
            points.filter(|&i| plan.looks[i] != 0).map(|i| weighted(i) * plan.share(n_visible, i)).sum()
        } else {
            let share = self.element_share(plan, n_visible, e);
            share.map_or(0.0, |share| share * points.by_ref().map(weighted).sum::<f64>())
        }
    }

    /// A row from what its rays saw, and its factors to all elements.
    fn row(&self, plan: &Plan, sight: &Sight) -> (Row, Vec<f32>) {
        let Plan { kernels, looks, .. } = plan;
        let receivers = &self.receivers.all;
        let n_gauss = self.receivers.n_gauss();
        let n_visible = self.n_visible(plan, sight.shares.iter().copied());
        let elements: Vec<f32> = (0..self.receivers.n_elements())
            .into_par_iter()
            .with_min_len(1024)
            .map(|e| self.element_factor(plan, &n_visible, e) as f32)
            .collect();
        let vertices: Vec<f32> = (n_gauss..receivers.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                if kernels[i] == 0.0 {
                    return 0.0;
                }
                let share = if looks[i] != 0 {
                    plan.share(&n_visible, i)
                } else {
                    let around = self.mesh.elements_around(VertexId(receivers[i].owner));
                    let share = |e: usize| self.element_share(plan, &n_visible, e);
                    let shares = around.iter().filter_map(|e| share(e.0 as usize));
                    let (sum, n) = shares.fold((0.0, 0), |(sum, n), share| (sum + share, n + 1));
                    sum / f64::from(n.max(1))
                };
                (kernels[i] * share) as f32
            })
            .collect();
        let row = Row {
            elements: SparseRow::pack(&elements),
            vertices: SparseRow::pack(&vertices),
            spread: Vec::new(),
            passed_m2: self.passed_m2(plan, sight),
        };
        (row, elements)
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

    /// The strata that receiver `i` looks at, if it looks.
    fn looks(&self, shooter: &Shooter, i: usize, kernels: &[f64], look: Look) -> u8 {
        let sparse = look == Look::Sparse;
        if kernels[i] == 0.0 || sparse && !self.stands_in(shooter.key, i, kernels) {
            return 0;
        }
        let receiver = &self.receivers.all[i];
        let first = if sparse {
            // At least a bundle's worth of neighbours from one point, so that they cross the same cells.
            let group = u64::from(receiver.owner) / MAX_BUNDLE_RAYS as u64;
            hash(self.seed, shooter.key, 4 << 40 | group) as usize
        } else {
            let kind = u64::from(i >= self.receivers.n_gauss()) << 32;
            let turn = hash(self.seed, shooter.key, kind | u64::from(receiver.owner)) as usize;
            turn + receiver.slot as usize
        };
        shooter.looks(receiver.target, receiver.normal, first % N_STRATA, look == Look::Full)
    }

    /// `Targets` bundles stratum by stratum, receivers in mesh order: a ray per entry of [`Plan::owners`]; each with its first
    /// receiver.
    fn bundles(&self, plan: &Plan) -> Vec<(u32, RayBundle)> {
        let shooter = &plan.shooter;
        let mut bundles = Vec::new();
        for (stratum, &apex) in shooter.apexes.iter().enumerate() {
            let looking: Vec<u32> = plan.looking_at(1 << stratum).map(|i| i as u32).collect();
            let target = |i: &u32| self.receivers.all[*i as usize].target;
            let bundle = |chunk: &[u32]| {
                let points = chunk.iter().map(target).collect();
                (chunk[0], RayBundle::Targets { apex, points })
            };
            bundles.par_extend(looking.par_chunks(MAX_BUNDLE_RAYS).with_min_len(64).map(bundle));
        }
        bundles.extend(plan.looking_at(MIDDLE).map(|i| {
            let r = &self.receivers.all[i];
            let middle = shooter.source.centre_above_horizon(r.point, r.normal);
            let apex = middle.unwrap_or(shooter.centre) + self.offset_m * shooter.normal;
            (i as u32, RayBundle::Targets { apex, points: vec![r.target] })
        }));
        bundles
    }
}

/// One shooter's questions.
struct Plan {
    shooter: Shooter,
    look: Look,
    /// Unoccluded form factor at every receiver.
    kernels: Arc<Vec<f64>>,
    /// Strata that every receiver looks at, and `MIDDLE`.
    looks: Vec<u8>,
}

impl Plan {
    /// Share of its rays that receiver `i` saw the shooter with.
    fn share(&self, n_visible: &[f32], i: usize) -> f64 {
        f64::from(n_visible[i]) / f64::from(self.looks[i].count_ones())
    }

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
