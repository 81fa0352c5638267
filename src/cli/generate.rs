//! `radeng generate`: a scene file for an experiment.

use super::args::{GenerateArgs, KindArg};
use super::{CliError, Outcome, plan};
use crate::generate::{self, Generated, Kind};
use crate::image::{OutputError, OutputFiles};
use crate::report::si::bytes;

pub(super) fn run(args: &GenerateArgs) -> Result<Outcome, CliError> {
    plan::check_outputs([], &[(Some(&args.output), "toml")], &[])?;
    if args.output.exists() && !args.force {
        let what = "exists, and may be a scene of your own; --force replaces it".to_owned();
        return Err(OutputError::Target { path: args.output.clone(), what }.into());
    }
    let kind = match args.kind {
        KindArg::RandomPatches => Kind::RandomPatches,
        KindArg::FurnishedRoom => Kind::FurnishedRoom,
        KindArg::ManyLamps => Kind::ManyLamps,
        KindArg::Segments2d => Kind::Segments2d,
    };
    let Generated { text, n_surfaces } =
        generate::generate(kind, args.count, args.seed).map_err(|e| CliError::Usage(format!("--{e}")))?;
    let size = bytes(text.len() as u64);
    let mut files = OutputFiles::new();
    files.stage(&args.output, text.into_bytes());
    files.commit()?;
    let text = format!("scene      {}: {kind}, {n_surfaces} surfaces, {size}\n", args.output.display());
    Ok(Outcome { text, ..Outcome::default() })
}
