//! `radeng probe` as typed.

use std::path::PathBuf;

use clap::Args;

use super::common::CastArgs;

/// `radeng probe`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng probe scenes/lit-cube/scene.toml --at 0.5,0.5,0 --normal 0,0,1
  radeng probe scene.toml --at 1,2,0 --normal 0,0,1 --at 3,2,0 --normal 0,0,1 --json")]
pub struct ProbeArgs {
    /// The scene file (TOML)
    pub scene: PathBuf,
    /// A point (m); repeat for more, each with its --normal
    #[arg(long, value_name = "X,Y,Z", required = true, allow_hyphen_values = true)]
    pub at: Vec<String>,
    /// The receiver's normal at the point, any length
    #[arg(long, value_name = "X,Y,Z", required = true, allow_hyphen_values = true)]
    pub normal: Vec<String>,
    /// How rays are cast.
    #[command(flatten)]
    pub cast: CastArgs,
    /// The value that pass 1 stored on the surface there, instead of light integrated at the point
    #[arg(long)]
    pub interpolated: bool,
    /// Use this solution, as `solve` wrote it for the same scene and mesh, instead of running pass 1
    #[arg(long, value_name = "FILE.radsol")]
    pub solution: Option<PathBuf>,
    /// Print a JSON list of {at, normal, irradiance_w_m2, illuminance_lx} instead of the table
    #[arg(long)]
    pub json: bool,
    /// Write a JSON report (radeng/probe/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}
