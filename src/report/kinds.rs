//! Rays by kind, and what share of the run their casting took.
//!
//! ```text
//! Meter --counts--> [KindReport], a result        --seconds, wall time of the run--> RayCastingTime, with Amdahl's bound
//! ```
//! With the share f of the time that a run in software spends in the caster, no board makes the whole run more than
//! 1 / (1 - f) times faster. Of a run on the emulated board the same share tells what emulation costs, and no bound.
//! Source: Amdahl 1967.

use serde::Serialize;

use super::si::{count, percent, share, si};
use super::terminal::{line, purpose_name, wrapped};
use crate::raycast::Purpose;
use crate::raycast::metered::{Meter, RayCounts};

/// Rays that were cast for one purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct KindReport {
    /// What for.
    pub purpose: Purpose,
    /// How many, and how they came.
    #[serde(flatten)]
    pub counts: RayCounts,
}

/// Wall time inside the caster.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RayCastingTime {
    /// In all (s).
    pub seconds: f64,
    /// Over the wall time of the run: with the software caster what a board takes over.
    pub share: f64,
    /// 1 / (1 - share): no board makes the run faster than by this; of a run in software only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amdahl_bound: Option<f64>,
    /// By purpose (s).
    pub by_purpose: Vec<(Purpose, f64)>,
}

/// The counts of a run.
pub fn by_kind(meter: &Meter) -> Vec<KindReport> {
    meter.counts().map(|(purpose, counts)| KindReport { purpose, counts }).collect()
}

impl RayCastingTime {
    /// Of a run of `total_seconds` with the caster `caster`.
    pub fn new(meter: &Meter, caster: &str, total_seconds: f64) -> RayCastingTime {
        let by_purpose: Vec<(Purpose, f64)> = meter.seconds().collect();
        let seconds: f64 = by_purpose.iter().map(|(_, seconds)| seconds).sum();
        let share = if total_seconds > 0.0 { (seconds / total_seconds).min(1.0) } else { 0.0 };
        let bound = (caster == "software" && share < 1.0).then(|| 1.0 / (1.0 - share));
        RayCastingTime { seconds, share, amdahl_bound: bound, by_purpose }
    }
}

/// Share of explicit rays beside bundles from which on the summary tells it.
const TOLD_SHARE: f64 = 0.01;

/// Rays by kind, in a line or two.
pub(super) fn kind_lines(out: &mut String, kinds: &[KindReport]) {
    if kinds.is_empty() {
        return;
    }
    let items: Vec<String> = kinds.iter().map(kind_text).collect();
    wrapped(out, "rays", &items, "; ");
}

fn kind_text(kind: &KindReport) -> String {
    let c = &kind.counts;
    let plain = |n: u64| count(n, "").trim_end().to_owned();
    let how = match (c.bundles, c.explicit_rays) {
        (0, _) => "explicit".to_owned(),
        (bundles, explicit) if share(explicit, c.rays) < TOLD_SHARE => {
            format!("{} a bundle", mean(c.bundle_rays, bundles))
        }
        (bundles, explicit) => {
            format!(
                "{} a bundle, {} explicit",
                mean(c.bundle_rays, bundles),
                percent(share(explicit, c.rays))
            )
        }
    };
    format!("{} {} ({how})", purpose_name(kind.purpose), plain(c.rays))
}

fn mean(rays: u64, bundles: u64) -> String {
    format!("{:.1}", rays as f64 / bundles as f64)
}

/// The share of ray casting and what follows from it.
pub(super) fn time_text(t: &RayCastingTime) -> String {
    match t.amdahl_bound {
        Some(bound) => format!(
            "{} in ray casting, {} of the run: a board makes all of it at most {bound:.3} times faster",
            si(t.seconds, "s"),
            percent(t.share)
        ),
        None => format!("{} in the emulated board, {} of the run", si(t.seconds, "s"), percent(t.share)),
    }
}

/// A line with [`time_text`].
pub(super) fn time_line(out: &mut String, t: &RayCastingTime) {
    line(out, "", time_text(t));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec3, Ray};
    use crate::raycast::null::NullCaster;
    use crate::raycast::{Query, RayBundle, RayCaster};

    fn meter() -> Meter {
        let mut meter = Meter::default();
        let mut nothing = NullCaster;
        let mut caster = meter.around(&mut nothing);
        let (apex, corner, step_u, step_v) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
        let tile = RayBundle::Tile { apex, corner, step_u, step_v, n: 8, m: 7 };
        let ray = Ray::unbounded(DVec3::ZERO, DVec3::X);
        caster.closest_hits(Purpose::Primary, Query::Bundles(&[tile.clone(), tile])).unwrap();
        caster.closest_hits(Purpose::Primary, Query::Rays(&[ray; 16])).unwrap();
        caster.closest_hits(Purpose::Specular, Query::Rays(&[ray; 3])).unwrap();
        meter
    }

    #[test]
    fn kinds_tell_rays_and_how_they_came() {
        let kinds = by_kind(&meter());
        let mut text = String::new();
        kind_lines(&mut text, &kinds);
        assert_eq!(text, "rays       primary 128 (56.0 a bundle, 12.5 % explicit); specular 3 (explicit)\n");
        let json = serde_json::to_value(&kinds).unwrap();
        assert_eq!((&json[0]["purpose"], &json[0]["bundle_rays"]), (&"primary".into(), &112.into()));
    }

    #[test]
    fn bound_follows_from_the_share_and_is_told_of_software_only() {
        let meter = meter();
        let seconds: f64 = meter.seconds().map(|(_, s)| s).sum();
        let time = RayCastingTime::new(&meter, "software", 4.0 * seconds);
        assert!((time.share - 0.25).abs() < 1e-12);
        assert!((time.amdahl_bound.unwrap() - 4.0 / 3.0).abs() < 1e-12);
        assert_eq!(RayCastingTime::new(&meter, "board", 4.0 * seconds).amdahl_bound, None);
        assert_eq!(RayCastingTime::new(&meter, "software", 0.0).share, 0.0);
    }
}
