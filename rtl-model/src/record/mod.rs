//! Recorded work: what the datapath answered to a command, kept so that the board's clock can run without it.
//!
//! ```text
//! Board::record_*: blocks --ask--> Recorder --compute--> datapath          RecordedCommand: jobs, streams
//!                                     `--keeps, bundle by bundle-->             |
//! Board::replay:   blocks --ask--> Replay <--look-ups by cursor-----------------'
//! ```
//! What blocks ask for of one bundle is canonical: steps in an order per ray; verdicts and tests in an order per bundle
//! in shells, per ray in grid partition. So a record made at one timing serves every other: any clusters, depths,
//! caches, memory, bus, scheduling. It does not serve another scene, other formats, another grid or another partition:
//! [`RecordKey`] says which differs.
//! Source: ours. Not modelled: rays. A replay has none; nothing on the board but the datapath looks at their words.

mod fingerprint;
mod recorder;
mod replay;
mod stream;

pub use fingerprint::{KeyDifference, RecordKey, hash_work};
pub use recorder::Recorder;
pub use replay::Replay;

use serde::{Deserialize, Serialize};

use crate::blocks::Job;
use crate::functional::n_centre_rays;
use crate::memory_image::MemoryImage;
use crate::packet::MAX_BUNDLE_RAYS;
use crate::spec::BoardSpec;

/// Why bytes are no record of a command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} of job {job}{}", if *.low_resolution { " of the low-resolution cast" } else { "" })]
pub struct RecordError {
    /// What is wrong.
    pub what: &'static str,
    /// Which job of the command.
    pub job: usize,
    /// It is one of the low-resolution cast.
    pub low_resolution: bool,
}

/// A bundle, or up to 64 explicit rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct RecordedJob {
    /// Its rays, 1 to 64.
    n_rays: u8,
    /// Size of its descriptor on the bus (B).
    descriptor_bytes: u32,
    /// Where its streams end in the command's bytes; they begin where those of the job before end.
    end: u64,
}

/// Jobs and their streams, one after the other.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct RecordedJobs {
    jobs: Vec<RecordedJob>,
    bytes: Vec<u8>,
}

/// A command as it was recorded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordedCommand {
    any_hit: bool,
    /// Explicit rays, not bundles.
    explicit: bool,
    /// [`hash_work`] of its rays or bundles.
    work: u64,
    bundles: RecordedJobs,
    /// The low-resolution cast before them.
    cast: RecordedJobs,
}

impl RecordedJobs {
    /// As the dispatcher takes them.
    fn jobs(&self, low_resolution: bool) -> Vec<Job> {
        let mut first_ray = 0;
        let job = |(index, recorded): (usize, &RecordedJob)| {
            let n_rays = u32::from(recorded.n_rays);
            let job = Job {
                index: index as u32,
                first_ray,
                n_rays,
                bytes: recorded.descriptor_bytes,
                low_resolution,
            };
            first_ray += n_rays;
            job
        };
        self.jobs.iter().enumerate().map(job).collect()
    }

    /// The streams of job `index`.
    fn streams(&self, index: usize) -> &[u8] {
        let start = index.checked_sub(1).map_or(0, |before| self.jobs[before].end);
        &self.bytes[start as usize..self.jobs[index].end as usize]
    }

    fn n_rays(&self) -> u64 {
        self.jobs.iter().map(|job| u64::from(job.n_rays)).sum()
    }

    fn check(&self, limits: &stream::Limits, low_resolution: bool) -> Result<(), RecordError> {
        let mut streams = stream::Streams::default();
        let mut start = 0;
        for (job, recorded) in self.jobs.iter().enumerate() {
            let wrong = |what| RecordError { what, job, low_resolution };
            if !(1..=MAX_BUNDLE_RAYS).contains(&usize::from(recorded.n_rays)) {
                return Err(wrong("the number of rays"));
            }
            if recorded.end < start || recorded.end > self.bytes.len() as u64 {
                return Err(wrong("the length"));
            }
            start = recorded.end;
            streams.open(self.streams(job), usize::from(recorded.n_rays), limits).map_err(wrong)?;
            streams.check(limits.per_ray).map_err(wrong)?;
        }
        if start == self.bytes.len() as u64 {
            Ok(())
        } else {
            Err(RecordError { what: "bytes after the end", job: self.jobs.len(), low_resolution })
        }
    }
}

impl RecordedCommand {
    /// The jobs of the command, and those of its low-resolution cast.
    pub(crate) fn jobs(&self) -> [Vec<Job>; 2] {
        [self.bundles.jobs(false), self.cast.jobs(true)]
    }

    /// The command asks for any hit, not for the nearest.
    pub fn any_hit(&self) -> bool {
        self.any_hit
    }

    /// Explicit rays, not bundles.
    pub fn is_explicit(&self) -> bool {
        self.explicit
    }

    /// [`hash_work`] of the rays or bundles that were traced.
    pub fn work_hash(&self) -> u64 {
        self.work
    }

    /// Bundles, or chunks of up to 64 explicit rays.
    pub fn n_jobs(&self) -> usize {
        self.bundles.jobs.len()
    }

    /// Rays, those of the low-resolution cast not counted.
    pub fn n_rays(&self) -> u64 {
        self.bundles.n_rays()
    }

    /// Size of the streams (B).
    pub fn stream_bytes(&self) -> usize {
        self.bundles.bytes.len() + self.cast.bytes.len()
    }

    /// Decodes everything once: what it holds then is in the ranges of a board of `spec` with this image.
    ///
    /// # Errors
    /// The first thing that is not.
    pub fn check(&self, spec: &BoardSpec, image: &MemoryImage) -> Result<(), RecordError> {
        let limits = stream::Limits { per_ray: !spec.partition.is_shells(), grid: image.grid };
        self.bundles.check(&limits, false)?;
        self.cast.check(&limits, true)?;
        let too_many = self.n_rays().max(self.cast.n_rays()) > u64::from(u32::MAX);
        let wanted = n_centre_rays(spec, self.n_jobs()) as u64;
        if too_many || self.cast.n_rays() != wanted {
            let low_resolution = !too_many;
            return Err(RecordError { what: "the sum of rays", job: 0, low_resolution });
        }
        Ok(())
    }

    /// Changes bits of a byte of the bundles' streams.
    #[cfg(test)]
    pub(crate) fn flip(&mut self, at: usize, bits: u8) {
        let byte = at % self.bundles.bytes.len();
        self.bundles.bytes[byte] ^= bits;
    }
}
