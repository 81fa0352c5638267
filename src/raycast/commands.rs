//! A caster that passes every query on and keeps the commands that the board would get.
//!
//! ```text
//! Query --inner caster--> answers, unchanged
//!   `---quantized.rs: words, cut as for the board--> CastCommand by CastCommand
//! ```
//! Rays start where the board's would: the surface offset is the quantizer's.

use rtl_model::board::Work;
use rtl_model::datapath::RayWords;
use rtl_model::datapath::bundle::BundleWords;

use super::quantize::Quantizer;
use super::{CastError, Purpose, Query, RayBundle, RayCaster, RayHit, quantized};
use crate::mesh::PatchId;

/// What the board is asked at once.
#[derive(Clone, Debug, PartialEq)]
pub struct CastCommand {
    /// What its rays are cast for.
    pub purpose: Purpose,
    /// Any hit, not the nearest.
    pub any_hit: bool,
    /// Its rays.
    pub words: CommandWords,
}

/// The rays of a command.
#[derive(Clone, Debug, PartialEq)]
pub enum CommandWords {
    /// Explicit rays.
    Rays(Vec<RayWords>),
    /// Descriptors.
    Bundles(Vec<BundleWords>),
}

impl CommandWords {
    /// As the board takes them.
    pub fn work(&self) -> Work<'_> {
        match self {
            CommandWords::Rays(rays) => Work::Rays(rays),
            CommandWords::Bundles(bundles) => Work::Bundles(bundles),
        }
    }
}

/// A caster that keeps its commands.
pub struct CommandCaster<'a> {
    inner: &'a mut dyn RayCaster,
    quantizer: &'a Quantizer,
    commands: Vec<CastCommand>,
}

impl<'a> CommandCaster<'a> {
    /// Around `inner`, for a board whose scene `quantizer` has quantised.
    pub fn new(inner: &'a mut dyn RayCaster, quantizer: &'a Quantizer) -> CommandCaster<'a> {
        CommandCaster { inner, quantizer, commands: Vec::new() }
    }

    /// The commands, in the order in which they were cast.
    pub fn into_commands(self) -> Vec<CastCommand> {
        self.commands
    }

    fn keep(&mut self, purpose: Purpose, any_hit: bool, query: Query<'_>) -> Result<(), CastError> {
        let commands = &mut self.commands;
        quantized::commands(self.quantizer, query, |work| {
            let words = match work {
                Work::Rays(rays) => CommandWords::Rays(rays.to_vec()),
                Work::Bundles(bundles) => CommandWords::Bundles(bundles.to_vec()),
            };
            commands.push(CastCommand { purpose, any_hit, words });
        })
    }
}

impl RayCaster for CommandCaster<'_> {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        self.keep(purpose, false, query)?;
        self.inner.closest_hits(purpose, query)
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        self.keep(purpose, true, query)?;
        self.inner.any_hits(purpose, query)
    }

    fn blocked_by(&self, purpose: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        self.inner.blocked_by(purpose, tests)
    }

    fn surface_offset_m(&self) -> f64 {
        self.quantizer.surface_offset_m()
    }
}
