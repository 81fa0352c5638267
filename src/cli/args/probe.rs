//! `radeng probe` as typed.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::common::CastArgs;
use super::false_colour::ScaleArgs;
use super::path::PathArgs;
use crate::cli::given::Given;

/// How irradiance is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProbeMethodArg {
    /// Direct light integrated at the point, indirect gathered from the surfaces that pass 1 solved
    Solved,
    /// Path tracing, unbiased, with its standard error; no pass 1
    Path,
}

/// `radeng probe`
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  radeng probe scenes/lit-cube/scene.toml --at 0.5,0.5,0 --normal 0,0,1
  radeng probe scene.toml --at 1,2,0 --normal 0,0,1 --at 3,2,0 --normal 0,0,1 --json
  radeng probe scene.toml --at 1,2,0 --normal 0,0,1 --method path --paths 1000000
  radeng probe scene.toml --surface floor --height 0.8 --border 0.5 -o workplane.png
  radeng probe scene.toml --grid corner=1,1,0.75 --edge-u 1.6,0,0 --edge-v 0,0.8,0 --n 8,4 --csv desk.csv

A grid has its points at the centres of n_u x n_v equal cells. Without --n they are as many as EN 12464-1 asks for: \
    with d the longer side of the area (m), the shorter where the longer is twice it or more, cells are about \
    p = 0.2 x 5^(log10 d) m wide, at most 10 m: the nearest whole number of them along d, square ones along the other side.
The summary gives E_mean, E_min, E_max (lx) and the uniformities U0 = E_min / E_mean and Ud = E_min / E_max.")]
pub struct ProbeArgs {
    /// What was typed: some methods have no use for some flags.
    #[command(flatten)]
    pub given: Given,
    /// The scene file (TOML), or a model file (.obj, .gltf, .glb)
    pub scene: PathBuf,
    /// A point (m); repeat for more, each with its --normal
    #[arg(long, value_name = "X,Y,Z", required_unless_present_any = ["grid", "surface"], allow_hyphen_values = true)]
    pub at: Vec<String>,
    /// The receiver's normal at the point, any length; of a grid the normal of all its points [default: its own]
    #[arg(long, value_name = "X,Y,Z", required_unless_present_any = ["grid", "surface"], allow_hyphen_values = true)]
    pub normal: Vec<String>,
    /// A grid on the parallelogram from this corner (m); its normal is u x v
    #[arg(long, value_name = "corner=X,Y,Z", requires_all = ["edge_u", "edge_v"], conflicts_with_all = ["at", "surface"], allow_hyphen_values = true, help_heading = "Grids")]
    pub grid: Option<String>,
    /// The grid's first edge, from its corner (m)
    #[arg(
        long,
        value_name = "DX,DY,DZ",
        requires = "grid",
        allow_hyphen_values = true,
        help_heading = "Grids"
    )]
    pub edge_u: Option<String>,
    /// The grid's second edge, from its corner (m)
    #[arg(
        long,
        value_name = "DX,DY,DZ",
        requires = "grid",
        allow_hyphen_values = true,
        help_heading = "Grids"
    )]
    pub edge_v: Option<String>,
    /// A grid on the front of this surface, in its own (s,t): of quads from their first corner, of round ones equal areas
    #[arg(long, value_name = "NAME", conflicts_with_all = ["at", "grid"], help_heading = "Grids")]
    pub surface: Option<String>,
    /// Points along u (or s) and v (or t) [default: by EN 12464-1]
    #[arg(long, value_name = "U,V", value_parser = counts, help_heading = "Grids")]
    pub n: Option<[u32; 2]>,
    /// Width of a band along the area's border that is left out (m)
    #[arg(long, value_name = "M", value_parser = length, allow_negative_numbers = true, help_heading = "Grids")]
    pub border: Option<f64>,
    /// How far the grid is lifted off along the area's own normal (m)
    #[arg(long, value_name = "M", value_parser = length, allow_negative_numbers = true, help_heading = "Grids")]
    pub height: Option<f64>,
    /// Leave out points inside or behind surfaces; without, they are an error
    #[arg(long, help_heading = "Grids")]
    pub skip_hidden: bool,
    /// Write the grid's points: place, normal, irradiance (W/m^2), illuminance (lx)
    #[arg(long, value_name = "FILE.csv", help_heading = "Grids")]
    pub csv: Option<PathBuf>,
    /// Write a picture of the grid's illuminance: a block a cell, u to the right, v upward, and the scale (lx)
    #[arg(short, long = "output", value_name = "FILE.png", help_heading = "Grids")]
    pub output: Option<PathBuf>,
    /// Its scale.
    #[command(flatten)]
    pub scale: ScaleArgs,
    /// How rays are cast.
    #[command(flatten)]
    pub cast: CastArgs,
    /// How irradiance is found
    #[arg(long, value_enum, value_name = "METHOD", default_value = "solved")]
    pub method: ProbeMethodArg,
    /// Path tracing.
    #[command(flatten)]
    pub path: PathArgs,
    /// The value that pass 1 stored on the surface there, instead of light integrated at the point
    #[arg(long)]
    pub interpolated: bool,
    /// Use this solution, as `solve` wrote it for the same scene and mesh, instead of running pass 1
    #[arg(long, value_name = "FILE.radsol")]
    pub solution: Option<PathBuf>,
    /// Print a JSON list of {at, normal, irradiance_w_m2, illuminance_lx} instead of the table; of a grid the report
    #[arg(long)]
    pub json: bool,
    /// Write a JSON report (radeng/probe/1, of a grid radeng/probe-grid/1)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
}

fn counts(text: &str) -> Result<[u32; 2], String> {
    let n = text.split_once(',').and_then(|(u, v)| Some([u.trim().parse().ok()?, v.trim().parse().ok()?]));
    n.filter(|n: &[u32; 2]| !n.contains(&0))
        .ok_or_else(|| "expected two whole numbers over 0, U,V".to_owned())
}

fn length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|m: &f64| (0.0..=1e6).contains(m));
    length.ok_or_else(|| "expected metres, 0 to 1e6".to_owned())
}
