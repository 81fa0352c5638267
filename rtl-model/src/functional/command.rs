//! A whole command without time: what the board must answer and count for it.
//!
//! ```text
//! rays (in chunks of 64) | bundles --low-resolution rays first--> grid: trace | shells: ShellTracer --> hits, counters
//! ```

use crate::board::Work;
use crate::datapath::{HitWords, RayWords};
use crate::memory_image::MemoryImage;
use crate::packet::MAX_BUNDLE_RAYS;
use crate::spec::{BoardSpec, Partition};

use super::{CanonicalCounters, ShellTracer, trace};

/// Rays of a low-resolution cast that are traced together. They see little in common, so what counts is that all bundle
/// slots have some.
pub const CENTRE_RAYS_TOGETHER: usize = 4;

/// How many rays the low-resolution cast of a command of `n_jobs` jobs has: one for every so many of them, none for a
/// short command.
pub fn n_centre_rays(spec: &BoardSpec, n_jobs: usize) -> usize {
    let wanted = spec.partition == Partition::ShellsStatic
        && n_jobs >= crate::fixed::index(spec.dispatch.low_resolution_min_bundles);
    if wanted { n_jobs.div_ceil(crate::fixed::index(spec.dispatch.low_resolution_every.max(1))) } else { 0 }
}

/// The rays of a command's low-resolution cast: the centre ray of every so many of its `n_jobs` jobs. They are traced as
/// explicit rays, [`CENTRE_RAYS_TOGETHER`] a job.
pub fn centre_rays(spec: &BoardSpec, work: Work<'_>, n_jobs: usize) -> Vec<RayWords> {
    let every = crate::fixed::index(spec.dispatch.low_resolution_every.max(1));
    let centre = |job: usize| match work {
        Work::Rays(rays) => {
            let first = job * MAX_BUNDLE_RAYS;
            rays[first + (rays.len() - first).min(MAX_BUNDLE_RAYS) / 2]
        }
        Work::Bundles(bundles) => bundles[job].ray(&spec.formats, bundles[job].n_rays() / 2),
    };
    (0..n_centre_rays(spec, n_jobs)).map(|i| centre(i * every)).collect()
}

/// Answers a command by the partition of `spec`: a hit per ray in ray order, and the canonical counters.
pub fn trace_command(
    spec: &BoardSpec,
    image: &MemoryImage,
    work: Work<'_>,
    any_hit: bool,
) -> (Vec<Option<HitWords>>, CanonicalCounters) {
    let jobs: Vec<Vec<RayWords>> = match work {
        Work::Rays(rays) => rays.chunks(MAX_BUNDLE_RAYS).map(<[_]>::to_vec).collect(),
        Work::Bundles(bundles) => bundles
            .iter()
            .map(|bundle| (0..bundle.n_rays()).map(|i| bundle.ray(&image.formats, i)).collect())
            .collect(),
    };
    let mut counters = CanonicalCounters::default();
    if let Work::Bundles(bundles) = work {
        counters.bundles = bundles.len() as u64;
    }
    let mut hits = Vec::new();
    let mut tracer = ShellTracer::new(image, &spec.shells);
    let mut job = |rays: &[RayWords]| match spec.partition {
        Partition::Grid => {
            let mut work = CanonicalCounters::default();
            let hits = rays.iter().map(|ray| {
                let traced = trace(image, ray, any_hit);
                work.count(&traced);
                traced.hit
            });
            (hits.collect(), work)
        }
        Partition::Shells | Partition::ShellsStatic => {
            let traced = tracer.trace(rays, any_hit);
            (traced.hits, traced.work)
        }
    };
    let sum = |a: u64, b: u64| a + b;
    for rays in centre_rays(spec, work, jobs.len()).chunks(CENTRE_RAYS_TOGETHER) {
        let (_, work): (Vec<_>, _) = job(rays);
        counters = counters.combine(&work.as_low_resolution(), sum);
    }
    for rays in &jobs {
        let (answers, work): (Vec<_>, _) = job(rays);
        hits.extend(answers);
        counters = counters.combine(&work, sum);
    }
    (hits, counters)
}
