//! What `simulate` says of a record or a sample of its work.
//!
//! ```text
//! WorkRecord, SampleEstimate --> RecordedReport --> "recorded" in the JSON report, a few lines for the terminal
//! ```

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::si::{percent, si};
use crate::recorded::WorkRecord;
use crate::recorded::sample::SampleEstimate;

/// How the workload was run, when not simply from its rays.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "mode", rename_all = "snake_case")]
pub enum RecordedReport {
    /// From its rays, and recorded.
    Recorded(RecordFacts),
    /// From a record.
    Replayed(RecordFacts),
    /// In part. The counts beside this are those of the part.
    Sampled(SampleEstimate),
}

/// A record's size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordFacts {
    /// The file.
    pub file: PathBuf,
    /// Commands of the board.
    pub n_commands: usize,
    /// Bundles, or chunks of up to 64 explicit rays.
    pub n_jobs: u64,
    /// Rays.
    pub n_rays: u64,
    /// Size of the file (B), where it was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file_bytes: Option<usize>,
}

impl RecordFacts {
    fn new(file: &Path, record: &WorkRecord, file_bytes: Option<usize>) -> RecordFacts {
        RecordFacts {
            file: file.to_owned(),
            n_commands: record.commands.len(),
            n_jobs: record.n_jobs(),
            n_rays: record.n_rays(),
            file_bytes,
        }
    }

    fn lines(&self, out: &mut String, what: &str) {
        let RecordFacts { file, n_commands, n_jobs, n_rays, file_bytes } = self;
        let size = file_bytes.map(|bytes| format!(", {}", si(bytes as f64, "B"))).unwrap_or_default();
        let per_ray = file_bytes.filter(|_| *n_rays > 0);
        let per_ray = per_ray.map(|bytes| format!(" = {:.1} B a ray", bytes as f64 / *n_rays as f64));
        let _ = writeln!(
            out,
            "{what:<10} {}: {n_commands} commands, {n_jobs} bundles, {n_rays} rays{size}{}",
            file.display(),
            per_ray.unwrap_or_default()
        );
    }
}

impl RecordedReport {
    /// Of a record of `bytes` bytes that was written.
    pub fn recorded(file: &Path, record: &WorkRecord, bytes: usize) -> RecordedReport {
        RecordedReport::Recorded(RecordFacts::new(file, record, Some(bytes)))
    }

    /// Of a record that was run.
    pub fn replayed(file: &Path, record: &WorkRecord) -> RecordedReport {
        RecordedReport::Replayed(RecordFacts::new(file, record, None))
    }

    /// For the terminal.
    pub fn lines(&self, clock_mhz: f64) -> String {
        let mut out = String::new();
        match self {
            RecordedReport::Recorded(facts) => facts.lines(&mut out, "recorded"),
            RecordedReport::Replayed(facts) => facts.lines(&mut out, "replayed"),
            RecordedReport::Sampled(sample) => {
                let seconds = |cycles: f64| si(cycles / (clock_mhz * 1e6), "s");
                let (cycles, half) = (sample.cycles, sample.half_width_cycles);
                let _ = writeln!(
                    out,
                    "sample     {} of {} commands, seed {}: the counts above are those of the sample",
                    sample.n_sampled, sample.n_commands, sample.seed
                );
                let exact = if half == 0.0 { ", all commands were run" } else { "" };
                let _ = writeln!(
                    out,
                    "estimate   {} +- {} ({} at 95 %) = {} +- {} for the whole workload{exact}",
                    si(cycles, "cycles"),
                    si(half, "cycles"),
                    percent(half / cycles.max(1.0)),
                    seconds(cycles),
                    seconds(half)
                );
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_lines_give_estimate_and_interval_in_cycles_share_and_seconds() {
        let sample = SampleEstimate {
            share: 0.1,
            seed: 7,
            n_commands: 64,
            n_sampled: 7,
            cycles: 5e6,
            half_width_cycles: 1e5,
            groups: Vec::new(),
        };
        let text = RecordedReport::Sampled(sample).lines(25.0);
        for part in
            ["7 of 64 commands, seed 7", "5.00 Mcycles +- 100 kcycles (2.00 % at 95 %)", "200 ms +- 4.00 ms"]
        {
            assert!(text.contains(part), "{text}");
        }
    }
}
