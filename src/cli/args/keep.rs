//! Flags of solves that are kept: checkpoints.

use std::path::PathBuf;

use clap::Args;

/// Where the state of pass 1 is kept while it runs.
#[derive(Clone, Debug, Default, Args)]
pub struct CheckpointArgs {
    /// Keep the state of pass 1 in this folder while it runs, and at Ctrl-C: the same command goes on from it, to the same
    /// bits, however it was ended. Removed when the output is written
    #[arg(long, value_name = "DIR")]
    pub checkpoint: Option<PathBuf>,
    /// Seconds between two checkpoints [default: 30]
    #[arg(long, value_name = "SECONDS", requires = "checkpoint", allow_negative_numbers = true, value_parser = seconds)]
    pub checkpoint_every: Option<f64>,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s: &f64| (0.0..=86_400.0).contains(s));
    seconds.ok_or_else(|| "expected seconds, 0 to 86400".to_owned())
}
