//! A caster that passes every query on, counts its rays by purpose and clocks the time that answers take.
//!
//! ```text
//! Query --inner caster--> answers, unchanged
//!   |---> Meter: per purpose queries, bundles, rays in bundles, explicit rays, hits; seconds inside the caster
//! ```
//! The counts are results, the same in every run; the seconds are not.

use std::collections::BTreeMap;
use std::time::Instant;

use serde::Serialize;

use super::{CastError, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::mesh::PatchId;

/// What was asked of a caster for one purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    /// Queries.
    pub queries: u64,
    /// Rays in all.
    pub rays: u64,
    /// Bundles.
    pub bundles: u64,
    /// Rays that came in bundles.
    pub bundle_rays: u64,
    /// Rays that came one by one.
    pub explicit_rays: u64,
    /// Rays that asked for any hit, not for the nearest.
    pub any_hit_rays: u64,
    /// Rays that hit.
    pub hits: u64,
}

/// Counts and times of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meter {
    by_purpose: BTreeMap<Purpose, (RayCounts, f64)>,
}

impl Meter {
    /// A caster whose queries count here.
    pub fn around<'a>(&'a mut self, inner: &'a mut dyn RayCaster) -> MeteredCaster<'a> {
        MeteredCaster { inner, meter: self }
    }

    /// What was asked, by purpose; no purpose for which nothing was.
    pub fn counts(&self) -> impl Iterator<Item = (Purpose, RayCounts)> {
        self.by_purpose.iter().map(|(purpose, (counts, _))| (*purpose, *counts))
    }

    /// Wall time inside the caster (s), by purpose.
    pub fn seconds(&self) -> impl Iterator<Item = (Purpose, f64)> {
        self.by_purpose.iter().map(|(purpose, (_, seconds))| (*purpose, *seconds))
    }

    /// Books a query and the answers that `cast` gives.
    fn booked<T>(
        &mut self,
        purpose: Purpose,
        query: Query<'_>,
        cast: impl FnOnce() -> Result<Vec<T>, CastError>,
        is_hit: impl Fn(&T) -> bool,
        any: bool,
    ) -> Result<Vec<T>, CastError> {
        let start = Instant::now();
        let answers = cast()?;
        let seconds = start.elapsed().as_secs_f64();
        let n_rays = query.n_rays() as u64;
        if n_rays == 0 {
            return Ok(answers);
        }
        let (counts, sum) = self.by_purpose.entry(purpose).or_default();
        *sum += seconds;
        counts.queries += 1;
        counts.rays += n_rays;
        match query {
            Query::Bundles(bundles) => {
                counts.bundles += bundles.len() as u64;
                counts.bundle_rays += n_rays;
            }
            Query::Rays(_) => counts.explicit_rays += n_rays,
        }
        if any {
            counts.any_hit_rays += n_rays;
        }
        counts.hits += answers.iter().filter(|answer| is_hit(answer)).count() as u64;
        Ok(answers)
    }
}

/// A caster that is counted.
pub struct MeteredCaster<'a> {
    inner: &'a mut dyn RayCaster,
    meter: &'a mut Meter,
}

impl RayCaster for MeteredCaster<'_> {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        let MeteredCaster { inner, meter } = self;
        meter.booked(purpose, query, || inner.closest_hits(purpose, query), Option::is_some, false)
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        let MeteredCaster { inner, meter } = self;
        meter.booked(purpose, query, || inner.any_hits(purpose, query), |hit| *hit, true)
    }

    /// Tests of the host's own: neither rays nor time of the caster's.
    fn blocked_by(&self, purpose: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        self.inner.blocked_by(purpose, tests)
    }

    fn surface_offset_m(&self) -> f64 {
        self.inner.surface_offset_m()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geom::Ray;
    use crate::mesh::PatchId;
    use crate::raycast::software::SoftwareCaster;
    use crate::raycast::{CastPatch, RayBundle};

    #[test]
    fn metered_caster_answers_as_its_inner_one_and_counts_by_purpose() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let mut inner = SoftwareCaster::new(vec![CastPatch { corners, is_triangle: false }]);
        let up = |x: f64| Ray::unbounded(DVec3::new(x, 0.5, -1.0), DVec3::Z);
        let rays = [up(0.25), up(3.0), up(0.75)];
        let apex = DVec3::new(0.5, 0.5, -1.0);
        let points = vec![DVec3::new(0.5, 0.5, 1.0), DVec3::new(0.6, 0.5, 1.0), DVec3::new(0.5, 0.5, -0.5)];
        let bundles = [RayBundle::Targets { apex, points }];
        let mut meter = Meter::default();
        let mut caster = meter.around(&mut inner);
        let hits = caster.closest_hits(Purpose::Specular, Query::Rays(&rays)).unwrap();
        assert_eq!(
            hits.iter().map(|h| h.map(|h| h.patch)).collect::<Vec<_>>(),
            [Some(PatchId(0)), None, Some(PatchId(0))]
        );
        assert_eq!(caster.any_hits(Purpose::Shadow, Query::Bundles(&bundles)).unwrap(), [true, true, false]);
        caster.any_hits(Purpose::Shadow, Query::Rays(&rays[..1])).unwrap();
        caster.any_hits(Purpose::Probe, Query::Rays(&[])).unwrap();
        assert_eq!(caster.name(), "software");
        let counts: Vec<_> = meter.counts().collect();
        let (shadow, specular) = (counts[0].1, counts[1].1);
        assert_eq!(counts.len(), 2, "nothing was cast for probes");
        assert_eq!((counts[0].0, counts[1].0), (Purpose::Shadow, Purpose::Specular));
        let wanted = RayCounts {
            queries: 2,
            rays: 4,
            bundles: 1,
            bundle_rays: 3,
            explicit_rays: 1,
            any_hit_rays: 4,
            hits: 3,
        };
        assert_eq!(shadow, wanted);
        let wanted = RayCounts { queries: 1, rays: 3, explicit_rays: 3, hits: 2, ..RayCounts::default() };
        assert_eq!(specular, wanted);
        assert!(meter.seconds().all(|(_, seconds)| seconds >= 0.0) && meter.seconds().count() == 2);
    }
}
