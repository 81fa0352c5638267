//! What `--method` means for the other flags: those that it has no use for are refused by name.
//!
//! ```text
//! MethodArg, flags as typed --> RenderMethod, paths, transport | the first flag without use
//! ```

use super::CliError;
use super::args::{MethodArg, PathArgs, ProbeArgs, ProbeMethodArg, RenderArgs, TransportArg};
use super::given::Given;
use crate::render::path::PathOptions;
use crate::render::{DEFAULT_PATHS, RenderMethod, RenderOptions, Transport};

/// Paths of a probed point, unless asked otherwise.
const PATHS_OF_A_POINT: u32 = 1 << 16;

/// Flags of pass 1 and of the light that it stores.
const OF_PASS_1: [&str; 12] = [
    "dense_visibility",
    "kernel",
    "form_factors",
    "max_shooters",
    "wanted_error",
    "checkpoint",
    "checkpoint_every",
    "adaptive",
    "solution",
    "ambient",
    "reconstruct",
    "gradients",
];

/// Flags of sampled direct light.
const OF_SHADOW_RAYS: [&str; 4] = ["shadow_strata", "shadow_sampling", "shadow_error", "shadow_coherence"];

/// Sets the method of a picture and what only it knows.
///
/// # Errors
/// A flag without use.
pub(super) fn resolve(args: &RenderArgs, picture: &mut RenderOptions) -> Result<(), CliError> {
    picture.method = match args.method {
        MethodArg::TwoPass => RenderMethod::TwoPass,
        MethodArg::FullRadiosity => RenderMethod::FullRadiosity,
        MethodArg::Whitted => RenderMethod::Whitted,
        MethodArg::Path => RenderMethod::Path,
    };
    let method = picture.method.name();
    if !picture.method.needs_pass_1() {
        refuse(&args.given, &OF_PASS_1, method, "it has no pass 1")?;
        refuse(&args.given, &["twists"], method, "it has no pass 1")?;
    }
    let why = match picture.method {
        RenderMethod::Path => Some("a path has one shadow ray a bounce; see --paths"),
        RenderMethod::FullRadiosity => Some("all light is stored, no shadow rays are cast"),
        RenderMethod::Whitted | RenderMethod::TwoPass => None,
    };
    if let Some(why) = why {
        refuse(&args.given, &OF_SHADOW_RAYS, method, why)?;
    }
    if picture.method != RenderMethod::TwoPass {
        refuse(&args.given, &["tau"], method, "it does not choose what is stored")?;
    }
    if picture.method != RenderMethod::Path {
        refuse(&args.given, &["paths", "transport"], method, "it traces no paths")?;
    }
    picture.transport = transport(&args.path);
    picture.paths = args.path.paths.unwrap_or(DEFAULT_PATHS);
    Ok(())
}

/// How points are probed by path tracing; `None`: as pass 1 left them.
///
/// # Errors
/// A flag without use.
pub(super) fn resolve_probe(args: &ProbeArgs) -> Result<Option<PathOptions>, CliError> {
    if args.method == ProbeMethodArg::Solved {
        refuse(&args.given, &["paths", "transport"], "solved", "it traces no paths")?;
        return Ok(None);
    }
    refuse(&args.given, &OF_PASS_1, "path", "it has no pass 1")?;
    refuse(&args.given, &["interpolated"], "path", "nothing is stored")?;
    refuse(&args.given, &["grid", "surface"], "path", "it takes points, not grids")?;
    Ok(Some(PathOptions {
        transport: transport(&args.path),
        n_paths: args.path.paths.unwrap_or(PATHS_OF_A_POINT),
        max_depth: RenderOptions::default().max_depth,
        seed: args.cast.seed,
    }))
}

fn transport(args: &PathArgs) -> Transport {
    match args.transport {
        Some(TransportArg::TwoPass) => Transport::TwoPass,
        Some(TransportArg::Full) | None => Transport::Full,
    }
}

fn refuse(given: &Given, ids: &[&str], method: &str, why: &str) -> Result<(), CliError> {
    match ids.iter().find(|id| given.has(id)) {
        Some(id) => {
            let flag = id.replace('_', "-");
            Err(CliError::Usage(format!("--{flag} has no use with --method {method}: {why}")))
        }
        None => Ok(()),
    }
}
