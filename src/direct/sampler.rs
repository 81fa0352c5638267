//! Visible shares of sources, by shadow rays: full strata or adaptive leaves, round by round, all asks of a round in one query.
//!
//! ```text
//! Ask (point, source, what is expected) --aim--> bundle: fan | targets --occluders.rs: known to be blocked?-->
//!   any_hits --> lattice of cells.rs --some cells to split?--> targets of the next round
//! ```
//! A scout, the first ask of a region and source that nothing is known of, goes before the others, so that they profit from
//! what it finds.
//! A fan goes down whole or not at all, since its rays' words are the descriptor's; listed targets one by one.
//! Thin glass passes light (`raycast/transmit.rs`); closed glass blocks it.

use std::collections::HashSet;

use glam::DVec3;
use rayon::prelude::*;

use super::cells::{Fineness, Lattice, Look};
use super::occluders::{Key, Occluders};
use super::source::{self, Area, Source, Target};
use crate::geom::Ray;
use crate::mesh::PatchId;
use crate::raycast::transmit::Panes;
use crate::raycast::{CastError, Purpose, Query, RayBundle, RayCaster};
use crate::sampling::{hash, mix, unit_pair};
use crate::units::Rgb;

/// A point that wants to know which share of a source it sees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ask<'a> {
    pub source: &'a Source,
    pub source_index: u32,
    /// Where light is received (m), and with which normal.
    pub position: DVec3,
    pub normal: DVec3,
    /// Where rays start (m): lifted off the surface.
    pub apex: DVec3,
    /// Names it for sampling patterns.
    pub key: u64,
    /// What it lies on, for the occluders.
    pub region: Option<PatchId>,
    pub pattern: Pattern,
}

/// Which samples of an area are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pattern {
    /// n x n strata.
    Full(u32),
    /// None: all of it is visible.
    Visible,
    /// Few, then more where they disagree.
    Adaptive {
        /// One sample does unless it disagrees with this.
        expected: Option<bool>,
        /// Two corners do unless they disagree with this.
        likely: Option<bool>,
        how: Fineness,
    },
}

/// What an ask learnt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sampled {
    /// Visible share, by channel.
    pub share: Rgb,
    /// Who sees what on a 4 x 4 grid of the source.
    pub seed: u16,
}

/// What shadow rays cost and saved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct ShadowCounts {
    /// Pairs of a point and a source that shadow rays were cast for.
    pub pairs: u64,
    /// Shadow rays cast, those that sought an occluder included.
    pub rays: u64,
    /// Rays that sought an occluder.
    pub seeking_rays: u64,
    /// Rays that a known occluder blocked, not cast.
    pub known_blocked: u64,
    /// Tests of a ray with a known occluder, by the host.
    pub occluder_tests: u64,
}

impl ShadowCounts {
    /// What came after `earlier`.
    pub fn since(self, earlier: ShadowCounts) -> ShadowCounts {
        ShadowCounts {
            pairs: self.pairs - earlier.pairs,
            rays: self.rays - earlier.rays,
            seeking_rays: self.seeking_rays - earlier.seeking_rays,
            known_blocked: self.known_blocked - earlier.known_blocked,
            occluder_tests: self.occluder_tests - earlier.occluder_tests,
        }
    }
}

/// Casts asks.
#[derive(Clone, Debug)]
pub(super) struct Sampler {
    pub seed: u64,
    /// The caster's surface offset.
    pub offset_m: f64,
    /// What rays are cast for.
    pub purpose: Purpose,
    /// The scene's thin glass.
    pub panes: Panes,
    /// None: coherence is off.
    pub occluders: Option<Occluders>,
    pub counts: ShadowCounts,
}

/// An ask under way.
struct Work {
    samples: Samples,
    /// What the rays of `bundle` answer.
    awaited: Awaited,
    bundle: Option<RayBundle>,
    /// Of a curved source: how often its samples were made more.
    level: u8,
}

enum Samples {
    /// Of a planar area.
    Square(Box<Lattice>),
    /// Sums of weights, and of weights times what passed.
    Sums { weight: f64, visible: Rgb },
}

enum Awaited {
    /// Looks at a planar area.
    Looks(Vec<Look>),
    /// Samples by weight.
    Weights(Vec<f64>),
}

impl Sampler {
    /// The visible shares that `asks` see.
    pub fn cast(&mut self, caster: &mut dyn RayCaster, asks: &[Ask<'_>]) -> Result<Vec<Sampled>, CastError> {
        let mut work: Vec<Work> = asks.par_iter().map(|ask| self.begin(ask)).collect();
        self.counts.pairs += asks.len() as u64;
        let mut waiting: Vec<usize> = (0..work.len()).filter(|i| work[*i].bundle.is_some()).collect();
        let scouts = self.scouts(asks, &waiting);
        if !scouts.is_empty() {
            self.cast_round(caster, asks, &mut work, &scouts)?;
            let scouts: HashSet<usize> = scouts.into_iter().collect();
            let rest: Vec<usize> = waiting.iter().copied().filter(|i| !scouts.contains(i)).collect();
            self.cast_round(caster, asks, &mut work, &rest)?;
        } else {
            self.cast_round(caster, asks, &mut work, &waiting)?;
        }
        loop {
            let this = &*self;
            work.par_iter_mut().zip(asks).for_each(|(work, ask)| this.refine(work, ask));
            waiting = (0..work.len()).filter(|i| work[*i].bundle.is_some()).collect();
            if waiting.is_empty() {
                break;
            }
            self.cast_round(caster, asks, &mut work, &waiting)?;
        }
        Ok(work.iter().map(Work::sampled).collect())
    }

    fn begin(&self, ask: &Ask<'_>) -> Work {
        let jitter = source::jitter(self.seed, ask.key, u64::from(ask.source_index));
        match ask.source {
            _ if ask.pattern == Pattern::Visible => Work::sums(None, Vec::new(), 1.0),
            Source::Light(light) => match source::light_direction(light) {
                Some(toward) => {
                    let step = DVec3::ZERO;
                    let apex = ask.apex;
                    let bundle =
                        RayBundle::Tile { apex, corner: toward, step_u: step, step_v: step, n: 1, m: 1 };
                    Work::sums(Some(bundle), vec![1.0], 0.0)
                }
                None => {
                    let at = crate::radiosity::lights::position(light);
                    let targets = at.map(|position| Target { position, weight: 1.0 });
                    self.listed(ask, &targets.into_iter().collect::<Vec<_>>())
                }
            },
            Source::Areas { areas, .. } => match (&areas[..], ask.pattern) {
                ([area], Pattern::Full(strata)) => self.full(ask, area, strata, jitter),
                ([area], Pattern::Visible | Pattern::Adaptive { expected: Some(_), .. }) => {
                    self.full(ask, area, 1, jitter)
                }
                ([area], Pattern::Adaptive { expected: None, likely, .. }) => self.lattice(ask, area, likely),
                (_, pattern) => {
                    let n = match pattern {
                        Pattern::Full(strata) => (strata * strata) as usize,
                        Pattern::Visible | Pattern::Adaptive { expected: Some(_), .. } => 1,
                        Pattern::Adaptive { expected: None, .. } => 4,
                    };
                    self.listed(ask, &self.spread(ask, areas, n, jitter))
                }
            },
        }
    }

    /// Targets over a curved side.
    fn spread(&self, ask: &Ask<'_>, areas: &[Area], n: usize, jitter: [f64; 2]) -> Vec<Target> {
        let kernels: Vec<f64> =
            areas.iter().map(|a| a.source.form_factor(ask.position, ask.normal)).collect();
        source::spread(areas, &kernels, n, jitter, self.offset_m)
    }

    /// A target this near to the apex has nothing between, and no direction in coarse words.
    fn is_near(&self, ask: &Ask<'_>, target: DVec3) -> bool {
        (target - ask.apex).length() <= 2.0 * self.offset_m
    }

    /// A ray to every target that counts.
    fn listed(&self, ask: &Ask<'_>, targets: &[Target]) -> Work {
        let (mut points, mut weights, mut near_weight) = (Vec::new(), Vec::new(), 0.0);
        for t in targets {
            if self.is_near(ask, t.position) {
                near_weight += t.weight;
            } else {
                points.push(t.position);
                weights.push(t.weight);
            }
        }
        let bundle = (!points.is_empty()).then_some(RayBundle::Targets { apex: ask.apex, points });
        Work::sums(bundle, weights, near_weight)
    }

    /// Where to look when no sample is above the horizon.
    fn centre(&self, ask: &Ask<'_>, area: &Area) -> Work {
        let centre = area.source.centre_above_horizon(ask.position, ask.normal);
        let target = centre.map(|c| Target { position: c + self.offset_m * area.normal, weight: 1.0 });
        self.listed(ask, &target.into_iter().collect::<Vec<_>>())
    }

    /// The weight of a sample at `target`, lifted off the area; `density` is the area that it stands for.
    fn weight(&self, ask: &Ask<'_>, area: &Area, target: DVec3, density: f64) -> f64 {
        density * area.weight(ask.position, ask.normal, target - self.offset_m * area.normal)
    }

    fn full(&self, ask: &Ask<'_>, area: &Area, strata: u32, jitter: [f64; 2]) -> Work {
        let mut targets = area.strata(strata, jitter, self.offset_m);
        for t in &mut targets {
            t.weight = self.weight(ask, area, t.position, t.weight);
        }
        if targets.iter().all(|t| t.weight <= 0.0) {
            return self.centre(ask, area);
        }
        let near = targets.iter().any(|t| self.is_near(ask, t.position));
        match area.fan(ask.apex, strata, jitter, self.offset_m).filter(|_| !near) {
            Some(fan) => Work::sums(Some(fan), targets.iter().map(|t| t.weight).collect(), 0.0),
            None => self.listed(ask, &targets),
        }
    }

    /// A place on an area, lifted, and the weight of the unit of its square there.
    fn look_at(&self, ask: &Ask<'_>, area: &Area, [s, t]: [f64; 2]) -> (DVec3, f64) {
        let (on_area, density) = area.place(s, t);
        let target = on_area + self.offset_m * area.normal;
        (target, self.weight(ask, area, target, density))
    }

    fn lattice(&self, ask: &Ask<'_>, area: &Area, likely: Option<bool>) -> Work {
        let (lattice, looks) = Lattice::new(likely, &|place| self.look_at(ask, area, place).1);
        if looks.is_empty() {
            return self.centre(ask, area);
        }
        let samples = Samples::Square(Box::new(lattice));
        let mut work = Work { samples, awaited: Awaited::Looks(Vec::new()), bundle: None, level: 0 };
        self.await_looks(ask, area, &mut work, looks);
        work
    }

    /// Lists the targets of looks; one too near is visible.
    fn await_looks(&self, ask: &Ask<'_>, area: &Area, work: &mut Work, looks: Vec<Look>) {
        let Samples::Square(lattice) = &mut work.samples else { return };
        let (mut awaited, mut points) = (Vec::with_capacity(looks.len()), Vec::with_capacity(looks.len()));
        for look in looks {
            let target = self.look_at(ask, area, look.place).0;
            if self.is_near(ask, target) {
                lattice.book(&look, Rgb::WHITE);
            } else {
                awaited.push(look);
                points.push(target);
            }
        }
        work.bundle = (!points.is_empty()).then_some(RayBundle::Targets { apex: ask.apex, points });
        work.awaited = Awaited::Looks(awaited);
    }

    /// Makes the next bundle of an ask whose samples leave something open.
    fn refine(&self, work: &mut Work, ask: &Ask<'_>) {
        let Pattern::Adaptive { expected, how, .. } = ask.pattern else { return };
        let Source::Areas { areas, .. } = ask.source else { return };
        let [area] = &areas[..] else { return self.refine_spread(work, ask, areas) };
        match &mut work.samples {
            Samples::Square(lattice) => {
                let jitter = |level: u8, x: u8, y: u8| {
                    let name = u64::from(level) << 16 | u64::from(y) << 8 | u64::from(x);
                    unit_pair(hash(self.seed ^ ask.key, u64::from(ask.source_index), mix(name)))
                };
                loop {
                    let looks = lattice.refine(how, &|place| self.look_at(ask, area, place).1, &jitter);
                    if looks.is_empty() {
                        return;
                    }
                    let none_waits = |l: &Look| self.is_near(ask, self.look_at(ask, area, l.place).0);
                    if looks.iter().all(none_waits) {
                        looks.iter().for_each(|look| lattice.book(look, Rgb::WHITE));
                        continue;
                    }
                    return self.await_looks(ask, area, work, looks);
                }
            }
            // The one sample that was to confirm what is expected did not.
            Samples::Sums { weight, visible } => {
                let surprised = *weight > 0.0 && expected.is_some_and(|e| e == visible.is_black());
                if work.level == 0 && surprised && how.max_level > 0 && how.least_share < 1.0 {
                    *work = Work { level: 1, ..self.lattice(ask, area, None) };
                }
            }
        }
    }

    /// Four times the samples of a curved source that is seen in part.
    fn refine_spread(&self, work: &mut Work, ask: &Ask<'_>, areas: &[Area]) {
        let Pattern::Adaptive { expected, how, .. } = ask.pattern else { return };
        let Samples::Sums { weight, visible } = work.samples else { return };
        if weight <= 0.0 || work.level >= how.max_level {
            return;
        }
        let share = visible.max_channel() / weight;
        let agree = share <= 0.0 || visible.min_channel() >= weight;
        let first = if expected.is_some() { 1.0 } else { 4.0 };
        let surprised = weight <= first && expected.is_some_and(|e| e != (share > 0.0));
        if (agree && !surprised) || how.least_share * weight >= 1.0 {
            return;
        }
        work.level += 1;
        let more = (3.0 * weight).round().clamp(1.0, 48.0) as usize;
        let bits = hash(self.seed ^ ask.key, u64::from(ask.source_index), mix(u64::from(work.level)));
        let next = self.listed(ask, &self.spread(ask, areas, more, unit_pair(bits)));
        if let Samples::Sums { weight: near, visible: near_visible } = next.samples {
            work.samples = Samples::Sums { weight: weight + near, visible: visible + near_visible };
        }
        work.bundle = next.bundle;
        work.awaited = next.awaited;
    }

    /// The first of every region and source that nothing is known of.
    fn scouts(&self, asks: &[Ask<'_>], waiting: &[usize]) -> Vec<usize> {
        let Some(occluders) = &self.occluders else { return Vec::new() };
        let mut met = HashSet::new();
        let is_scout = |i: &&usize| {
            let key = key_of(&asks[**i]);
            key.is_some_and(|key| occluders.of(key, 0).is_none() && met.insert(key))
        };
        waiting.iter().filter(is_scout).copied().collect()
    }

    /// Casts the bundles of some works and books the answers.
    fn cast_round(
        &mut self,
        caster: &mut dyn RayCaster,
        asks: &[Ask<'_>],
        work: &mut [Work],
        which: &[usize],
    ) -> Result<(), CastError> {
        let bundles: Vec<RayBundle> = which.iter().filter_map(|i| work[*i].bundle.take()).collect();
        let known = self.known_blocked(caster, asks, which, &bundles);
        let (mut sent, mut whole) = (Vec::with_capacity(bundles.len()), Vec::with_capacity(bundles.len()));
        for (bundle, known) in bundles.iter().zip(&known) {
            let all = all_rays(bundle);
            // Whose answers come back ray by ray; of the others only those that are not known.
            whole.push(!matches!(bundle, RayBundle::Targets { .. }) && *known != all);
            match bundle {
                _ if *known == all => {}
                RayBundle::Targets { apex, points } if *known != 0 => {
                    let unknown = points.iter().enumerate().filter(|(k, _)| *known >> k & 1 == 0);
                    let points = unknown.map(|(_, p)| *p).collect();
                    sent.push(RayBundle::Targets { apex: *apex, points });
                }
                _ => sent.push(bundle.clone()),
            }
        }
        let arrives = self.panes.transmitted(caster, self.purpose, Query::Bundles(&sent))?;
        self.counts.rays += arrives.len() as u64;
        let mut arrives = arrives.into_iter();
        let mut unexplained: Vec<(Key, Ray)> = Vec::new();
        for (((i, bundle), known), whole) in which.iter().zip(&bundles).zip(&known).zip(whole) {
            let mut passed = Vec::with_capacity(bundle.n_rays());
            let mut open = None;
            for k in 0..bundle.n_rays() {
                let is_known = known >> k & 1 == 1;
                let share =
                    if whole || !is_known { arrives.next().unwrap_or(Rgb::WHITE) } else { Rgb::BLACK };
                self.counts.known_blocked += u64::from(is_known && !whole);
                if share.is_black() && !is_known {
                    open = Some(k);
                }
                passed.push(share);
            }
            work[*i].book(&passed);
            if let (Some(k), Some(key)) = (open, key_of(&asks[*i])) {
                unexplained.push((key, bundle.ray(k)));
            }
        }
        self.seek(caster, unexplained)
    }

    /// By bundle, the rays that a known occluder blocks.
    fn known_blocked(
        &mut self,
        caster: &dyn RayCaster,
        asks: &[Ask<'_>],
        which: &[usize],
        bundles: &[RayBundle],
    ) -> Vec<u64> {
        let mut known = vec![0; bundles.len()];
        let Some(occluders) = &mut self.occluders else { return known };
        for slot in Occluders::slots() {
            let mut tried = Vec::new();
            let mut tests: Vec<(&RayBundle, PatchId)> = Vec::new();
            for (b, (i, bundle)) in which.iter().zip(bundles).enumerate() {
                let key = key_of(&asks[*i]).filter(|_| known[b] != all_rays(bundle));
                if let Some(patch) = key.and_then(|key| occluders.of(key, slot)) {
                    tried.push((b, key));
                    tests.push((bundle, patch));
                }
            }
            self.counts.occluder_tests += tests.iter().map(|(b, _)| b.n_rays() as u64).sum::<u64>();
            for ((b, key), mask) in tried.into_iter().zip(caster.blocked_by(self.purpose, &tests)) {
                if let Some(key) = key.filter(|_| slot > 0 && mask & !known[b] != 0) {
                    occluders.blocked_again(key, slot);
                }
                known[b] |= mask;
            }
        }
        known
    }

    /// Finds out what blocks rays that no known occluder does: the last of each region and source.
    fn seek(&mut self, caster: &mut dyn RayCaster, unexplained: Vec<(Key, Ray)>) -> Result<(), CastError> {
        let Some(occluders) = &mut self.occluders else { return Ok(()) };
        let mut met = HashSet::new();
        let (mut keys, mut rays) = (Vec::new(), Vec::new());
        for (key, ray) in unexplained.into_iter().rev() {
            if met.insert(key) && occluders.seeks(key) {
                keys.push(key);
                rays.push(ray);
            }
        }
        let hits = caster.closest_hits(self.purpose, Query::Rays(&rays))?;
        self.counts.rays += rays.len() as u64;
        self.counts.seeking_rays += rays.len() as u64;
        for (key, hit) in keys.into_iter().zip(hits) {
            // What is behind a pane stays unknown.
            if let Some(hit) = hit.filter(|hit| !self.panes.contains(hit.patch)) {
                occluders.found(key, hit.patch);
            }
        }
        Ok(())
    }
}

/// Where a sampled source is seen from, for the occluders.
fn key_of(ask: &Ask<'_>) -> Option<Key> {
    ask.region.map(|region| (region, ask.source_index))
}

/// A bit for every ray.
fn all_rays(bundle: &RayBundle) -> u64 {
    u64::MAX >> (64 - bundle.n_rays())
}

impl Work {
    fn sums(bundle: Option<RayBundle>, weights: Vec<f64>, near_weight: f64) -> Work {
        let samples = Samples::Sums { weight: near_weight, visible: Rgb::splat(near_weight) };
        Work { samples, awaited: Awaited::Weights(weights), bundle, level: 0 }
    }

    /// What passed along the rays of the last bundle.
    fn book(&mut self, passed: &[Rgb]) {
        match (&mut self.samples, &self.awaited) {
            (Samples::Square(lattice), Awaited::Looks(looks)) => {
                for (look, passed) in looks.iter().zip(passed) {
                    lattice.book(look, *passed);
                }
            }
            (Samples::Sums { weight, visible }, Awaited::Weights(weights)) => {
                for (w, passed) in weights.iter().zip(passed) {
                    *weight += w;
                    *visible += *passed * *w;
                }
            }
            _ => {}
        }
    }

    fn sampled(&self) -> Sampled {
        match &self.samples {
            Samples::Square(lattice) => {
                Sampled { share: lattice.share().unwrap_or(Rgb::BLACK), seed: lattice.seed() }
            }
            Samples::Sums { weight, visible } if *weight > 0.0 => {
                let share = *visible / *weight;
                let seed = match (share.min_channel(), share.is_black()) {
                    (_, true) => 0,
                    (low, _) if low >= 1.0 => u16::MAX,
                    _ => u16::MAX >> 8,
                };
                Sampled { share, seed }
            }
            Samples::Sums { .. } => Sampled::default(),
        }
    }
}
