//! A caster that passes every query on and keeps a sample of it: the workload of a run, by purpose.
//!
//! ```text
//! Query --inner caster--> answers, unchanged
//!   |---bundles, explicit rays in chunks of 64--group i is kept when its hash ends in `level` zero bits--> Recording
//! ```
//! When a purpose's groups hold more rays than the cap, `level` grows by one and about half of them go: memory is
//! bounded, and what is kept depends on the order of the queries alone. The hash, and not every 2^level-th group,
//! because hosts cast in patterns: of two lamps seen from each point in turn, every second bundle is one lamp's.

use std::collections::BTreeMap;

use super::{CastError, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::geom::Ray;
use crate::mesh::PatchId;
use crate::sampling::mix;

/// A caster that keeps a sample of its queries.
pub struct RecordingCaster<'a> {
    inner: &'a mut dyn RayCaster,
    surface_offset_m: f64,
    cap_rays: u64,
    by_purpose: BTreeMap<Purpose, Recording>,
}

/// What was cast for one purpose: a count of all rays and a sample of the groups.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Rays cast.
    pub cast: u64,
    n_groups: u64,
    level: u32,
    kept: Vec<Kept>,
    n_kept_rays: u64,
}

/// Rays that were cast together.
#[derive(Clone, Debug, PartialEq)]
pub enum GroupRays {
    /// A bundle.
    Bundle(RayBundle),
    /// Neighbouring explicit rays of one query, at most 64.
    Explicit(Vec<Ray>),
}

/// A group, how it was asked and how much of it is wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedGroup {
    /// Its rays.
    pub rays: GroupRays,
    /// They asked for any hit, not for the nearest.
    pub any_hit: bool,
    /// The first so many of its rays are wanted.
    pub take: usize,
}

#[derive(Clone, Debug)]
struct Kept {
    index: u64,
    group: RecordedGroup,
}

impl GroupRays {
    /// How many rays.
    pub fn n_rays(&self) -> usize {
        match self {
            GroupRays::Bundle(bundle) => bundle.n_rays(),
            GroupRays::Explicit(rays) => rays.len(),
        }
    }
}

impl Recording {
    /// Counts a group of `n_rays` and keeps it if its turn comes.
    fn record(&mut self, n_rays: usize, any_hit: bool, cap_rays: u64, rays: impl FnOnce() -> GroupRays) {
        self.cast += n_rays as u64;
        let index = self.n_groups;
        self.n_groups += 1;
        if mix(index).trailing_zeros() < self.level {
            return;
        }
        self.kept.push(Kept { index, group: RecordedGroup { rays: rays(), any_hit, take: n_rays } });
        self.n_kept_rays += n_rays as u64;
        while self.n_kept_rays > cap_rays && self.kept.len() > 1 {
            self.level += 1;
            self.kept.retain(|kept| mix(kept.index).trailing_zeros() >= self.level);
            self.n_kept_rays = self.kept.iter().map(|kept| kept.group.take as u64).sum();
        }
    }

    /// Rays of the kept groups.
    pub fn n_kept_rays(&self) -> u64 {
        self.n_kept_rays
    }

    /// Groups with `n_rays` rays in all (fewer if fewer are kept), spread over the run, in the order in which they
    /// were cast; of the last one chosen only as many rays as are missing.
    pub fn choose(mut self, n_rays: u64) -> Vec<RecordedGroup> {
        // Kept groups agree in the low bits of their hashes; the high bits order them at random.
        self.kept.sort_by_key(|kept| mix(kept.index));
        let mut wanted = n_rays;
        let mut chosen = Vec::new();
        for mut kept in self.kept {
            if wanted == 0 {
                break;
            }
            kept.group.take = kept.group.take.min(usize::try_from(wanted).unwrap_or(usize::MAX));
            wanted -= kept.group.take as u64;
            chosen.push(kept);
        }
        chosen.sort_by_key(|kept| kept.index);
        chosen.into_iter().map(|kept| kept.group).collect()
    }
}

impl<'a> RecordingCaster<'a> {
    /// Around `inner`, with a surface offset of its own (m), so that rays start where they would with the caster that
    /// they are recorded for. Per purpose at most `cap_rays` rays are kept, or one group.
    pub fn new(inner: &'a mut dyn RayCaster, surface_offset_m: f64, cap_rays: u64) -> RecordingCaster<'a> {
        RecordingCaster { inner, surface_offset_m, cap_rays, by_purpose: BTreeMap::new() }
    }

    /// What was cast, by purpose; no purpose for which nothing was.
    pub fn into_recordings(self) -> BTreeMap<Purpose, Recording> {
        self.by_purpose
    }

    fn record(&mut self, purpose: Purpose, query: Query<'_>, any_hit: bool) {
        if query.n_rays() == 0 {
            return;
        }
        let recording = self.by_purpose.entry(purpose).or_default();
        match query {
            Query::Bundles(bundles) => {
                for bundle in bundles {
                    let rays = || GroupRays::Bundle(bundle.clone());
                    recording.record(bundle.n_rays(), any_hit, self.cap_rays, rays);
                }
            }
            Query::Rays(rays) => {
                for chunk in rays.chunks(MAX_BUNDLE_RAYS) {
                    let rays = || GroupRays::Explicit(chunk.to_vec());
                    recording.record(chunk.len(), any_hit, self.cap_rays, rays);
                }
            }
        }
    }
}

impl RayCaster for RecordingCaster<'_> {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        self.record(purpose, query, false);
        self.inner.closest_hits(purpose, query)
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        self.record(purpose, query, true);
        self.inner.any_hits(purpose, query)
    }

    fn blocked_by(&self, purpose: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        self.inner.blocked_by(purpose, tests)
    }

    fn surface_offset_m(&self) -> f64 {
        self.surface_offset_m
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::raycast::null::NullCaster;

    fn bundle(number: usize, n: u32) -> RayBundle {
        let (corner, step) = (DVec3::X, DVec3::Y);
        let apex = DVec3::new(number as f64, 0.0, 0.0);
        RayBundle::Tile { apex, corner, step_u: step, step_v: DVec3::Z, n, m: 1 }
    }

    /// Casts bundles 0..count of 4 rays, `per_query` at a time, and returns what was kept.
    fn record(count: usize, per_query: usize, cap_rays: u64) -> Recording {
        let mut inner = NullCaster;
        let mut caster = RecordingCaster::new(&mut inner, 0.5, cap_rays);
        let bundles: Vec<RayBundle> = (0..count).map(|i| bundle(i, 4)).collect();
        for query in bundles.chunks(per_query) {
            caster.any_hits(Purpose::Shadow, Query::Bundles(query)).unwrap();
        }
        assert_eq!(caster.surface_offset_m(), 0.5);
        caster.into_recordings().remove(&Purpose::Shadow).unwrap()
    }

    fn number(group: &RecordedGroup) -> usize {
        match &group.rays {
            GroupRays::Bundle(bundle) => bundle.apex().x as usize,
            GroupRays::Explicit(_) => usize::MAX,
        }
    }

    #[test]
    fn recording_under_its_cap_keeps_everything_in_order() {
        let recording = record(100, 7, 400);
        assert_eq!((recording.cast, recording.n_kept_rays()), (400, 400));
        let groups = recording.choose(u64::MAX);
        assert_eq!(groups.iter().map(number).collect::<Vec<_>>(), (0..100).collect::<Vec<_>>());
        assert!(groups.iter().all(|g| g.any_hit && g.take == 4));
    }

    #[test]
    fn recording_over_its_cap_thins_to_under_it_whatever_the_queries_and_evenly() {
        let (one, other) = (record(20_000, 1, 4000), record(20_000, 999, 4000));
        assert_eq!((one.cast, one.n_kept_rays()), (80_000, other.n_kept_rays()));
        assert!((1500..=4000).contains(&one.n_kept_rays()), "{}", one.n_kept_rays());
        let numbers: Vec<usize> = one.choose(1200).iter().map(number).collect();
        assert_eq!(numbers, other.choose(1200).iter().map(number).collect::<Vec<_>>());
        assert_eq!(numbers.len(), 300);
        assert!(numbers.is_sorted());
        // Neither parity and no quarter of the run is favoured: 300 trials, 4 standard deviations are 35 and 30.
        let odd = numbers.iter().filter(|n| *n % 2 == 1).count();
        assert!((115..=185).contains(&odd), "{odd} odd of 300");
        for quarter in 0..4 {
            let n = numbers.iter().filter(|n| *n / 5000 == quarter).count();
            assert!((45..=105).contains(&n), "{n} of 300 in quarter {quarter}");
        }
    }

    #[test]
    fn recording_chosen_to_a_number_of_rays_cuts_the_last_group_only() {
        for n_rays in [1, 3, 4, 10, 399, 400, 500] {
            let groups = record(100, 100, 400).choose(n_rays);
            let taken: usize = groups.iter().map(|g| g.take).sum();
            assert_eq!(taken as u64, n_rays.min(400));
            assert!(groups.iter().filter(|g| g.take < 4).count() <= 1);
        }
    }

    #[test]
    fn recording_keeps_explicit_rays_in_chunks_with_mode_and_purpose_apart() {
        let mut inner = NullCaster;
        let mut caster = RecordingCaster::new(&mut inner, 0.0, 1000);
        let rays: Vec<Ray> = (0..130).map(|i| Ray::unbounded(DVec3::X * f64::from(i), DVec3::Y)).collect();
        assert_eq!(caster.closest_hits(Purpose::Specular, Query::Rays(&rays)).unwrap(), vec![None; 130]);
        assert_eq!(caster.any_hits(Purpose::Probe, Query::Rays(&rays[..1])).unwrap(), [false]);
        caster.any_hits(Purpose::Shadow, Query::Bundles(&[])).unwrap();
        let mut recordings = caster.into_recordings();
        assert_eq!(recordings.len(), 2, "nothing was cast for shadows");
        let probe = recordings.remove(&Purpose::Probe).unwrap();
        assert!(probe.choose(9)[0].any_hit);
        let specular = recordings.remove(&Purpose::Specular).unwrap();
        assert_eq!(specular.cast, 130);
        let groups = specular.choose(1000);
        assert_eq!(groups.iter().map(|g| g.take).collect::<Vec<_>>(), [64, 64, 2]);
        assert_eq!(groups[1].rays, GroupRays::Explicit(rays[64..128].to_vec()));
        assert!(!groups[0].any_hit);
    }
}
