//! Flags that look inside a run of the board, alike in `simulate` and `trace`.
//!
//! ```text
//! LookArgs --resolve--> trace::WatchOptions        files with their extensions for the check of outputs
//! ```

use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use crate::trace::{Choice, WatchOptions, Window};

/// What is to be seen.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Looking inside")]
pub struct LookArgs {
    /// Phases of all rays' lives and the roots of stalls, in summary and report
    #[arg(long)]
    pub account: bool,
    /// Utilisation over time: what every kind of block did in each N cycles
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub interval: Option<u64>,
    /// The camera rays of a pixel (column and row from the top left, from 0), and their lives cycle by cycle; repeatable
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pub pixel: Vec<[u32; 2]>,
    /// A ray by its number, from 0 in the order in which rays are cast, and its life cycle by cycle; repeatable
    #[arg(long, value_name = "N")]
    pub ray: Vec<u64>,
    /// Write a waveform: causes of blocks, occupancy of links
    #[arg(long, value_name = "FILE.fst")]
    pub wave: Option<PathBuf>,
    /// Write slices for ui.perfetto.dev: bundles, stalls of blocks, phases of the rays of --pixel and --ray
    #[arg(long, value_name = "FILE.json")]
    pub perfetto: Option<PathBuf>,
    /// Clocked cycles that --wave and --perfetto show, TO not among them; at most 1,000,000 [default: from 0]
    #[arg(long, value_name = "FROM..TO", allow_hyphen_values = true)]
    pub window: Option<Window>,
    /// No limits of cycles, slices and intervals
    #[arg(long)]
    pub force: bool,
}

fn pixel(text: &str) -> Result<[u32; 2], String> {
    let place =
        text.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    place.ok_or_else(|| "expected a column and a row, X,Y".to_owned())
}

impl LookArgs {
    /// What is meant; `log` is where the event log goes.
    ///
    /// # Errors
    /// A flag without use.
    pub(super) fn resolve(&self, log: Option<PathBuf>) -> Result<WatchOptions, CliError> {
        let shows = self.wave.is_some() || self.perfetto.is_some();
        if self.window.is_some() && !shows {
            return Err(CliError::Usage("--window has no use without --wave or --perfetto".to_owned()));
        }
        if self.force && !shows && self.interval.is_none() {
            let what = "--force has no use without --wave, --perfetto or --interval";
            return Err(CliError::Usage(what.to_owned()));
        }
        Ok(WatchOptions {
            log,
            wave: self.wave.clone(),
            slices: self.perfetto.clone(),
            window: self.window.unwrap_or_default(),
            account: self.account,
            interval: self.interval,
            rays: Choice { rays: self.ray.clone(), pixels: self.pixel.clone() },
            force: self.force,
        })
    }

    /// Outputs with the extensions that they must have.
    pub(super) fn outputs(&self) -> [(Option<&Path>, &'static str); 2] {
        [(self.wave.as_deref(), "fst"), (self.perfetto.as_deref(), "json")]
    }
}
