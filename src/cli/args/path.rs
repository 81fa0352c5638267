//! Flags of path tracing, in `render` and `probe`.

use clap::{Args, ValueEnum};

use super::common::whole;

/// Which paths of light count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TransportArg {
    /// All
    Full,
    /// Those that the two-pass method models
    TwoPass,
}

/// How paths are traced.
#[derive(Clone, Debug, Default, Args)]
pub struct PathArgs {
    /// Paths per camera ray, or per point [default: 64, of points 65536]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1 << 24), help_heading = "Path tracing")]
    pub paths: Option<u32>,
    /// Which paths count; either way the share of the light that two-pass does not model is told [default: full]
    #[arg(
        long,
        value_enum,
        value_name = "full|two-pass",
        hide_possible_values = true,
        help_heading = "Path tracing"
    )]
    pub transport: Option<TransportArg>,
}
