//! How direct light is found, as typed.

use clap::{Args, ValueEnum};

use super::common::{SwitchArg, whole};
use crate::direct::{DirectOptions, ShadowSampling};

/// Which shadow rays are cast.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShadowSamplingArg {
    /// The corners of a lamp, then more where they disagree; fewer where the surface around says what to expect
    Adaptive,
    /// N x N everywhere
    Full,
}

/// Options of direct light.
#[derive(Debug, Args)]
#[command(next_help_heading = "Direct light")]
pub struct DirectArgs {
    /// Shadow rays per point and light surface: N x N at most, 1 to 8; adaptive sampling takes 1, 2, 4 or 8 for N
    #[arg(long, value_name = "N", default_value_t = DirectOptions::default().shadow_strata, allow_negative_numbers = true, value_parser = whole(8))]
    pub shadow_strata: u32,
    /// Which shadow rays are cast
    #[arg(long, value_enum, value_name = "HOW", default_value = "adaptive")]
    pub shadow_sampling: ShadowSamplingArg,
    /// Adaptive sampling stops where what is left in doubt is under this share of the light at the point
    #[arg(long, value_name = "SHARE", default_value_t = DirectOptions::default().shadow_error, allow_negative_numbers = true, value_parser = from_0_to_1)]
    pub shadow_error: f64,
    /// Try the surface that blocked a light last near a point first: fewer rays, the same picture
    #[arg(long, value_enum, value_name = "on|off", default_value = "on", hide_possible_values = true)]
    pub shadow_coherence: SwitchArg,
    /// Two-pass: lights are sampled by shadow rays until those that are left could give less than this share of the light;
    /// the rest is shown as stored. 0: all are sampled, 1: none
    #[arg(long, value_name = "TAU", default_value_t = DirectOptions::default().stored_share, allow_negative_numbers = true, value_parser = from_0_to_1)]
    pub tau: f64,
}

impl DirectArgs {
    /// As meant.
    pub fn resolve(&self) -> DirectOptions {
        DirectOptions {
            shadow_strata: self.shadow_strata,
            shadow_sampling: match self.shadow_sampling {
                ShadowSamplingArg::Adaptive => ShadowSampling::Adaptive,
                ShadowSamplingArg::Full => ShadowSampling::Full,
            },
            shadow_error: self.shadow_error,
            shadow_coherence: self.shadow_coherence == SwitchArg::On,
            stored_share: self.tau,
        }
    }
}

fn from_0_to_1(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share: &f64| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "expected a number from 0 to 1, such as 0.1".to_owned())
}
