//! The scale of false-colour pictures as typed, alike in `render` and `probe`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::image::false_colour::{ColourMap, FalseColour, Quantity, ScaleChoice, ScaleKind};

/// How values run along the scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ScaleKindArg {
    /// Equal differences, equal lengths
    Linear,
    /// Equal ratios, equal lengths
    Log,
}

/// Colours of the scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ColourMapArg {
    /// Dark blue, green, yellow; even steps of lightness
    Viridis,
    /// Black, red, yellow; even steps of lightness
    Inferno,
    /// Blue, green, red
    Turbo,
}

/// The scale of false-colour pictures.
#[derive(Debug, Args)]
pub struct ScaleArgs {
    /// Ends of the scale (cd/m^2 or lx), or 'auto': to the 99th percentile, lamps seen directly left out, from 0, or if
    /// logarithmic from the 1st
    #[arg(long, value_name = "LO,HI|auto", default_value = "auto", value_parser = range, allow_hyphen_values = true, help_heading = "False colour")]
    pub scale: Range,
    /// How values run along the scale
    #[arg(long, value_enum, default_value = "linear", help_heading = "False colour")]
    pub scale_kind: ScaleKindArg,
    /// Colours of the scale
    #[arg(long, value_enum, default_value = "viridis", help_heading = "False colour")]
    pub colour_map: ColourMapArg,
}

/// A false-colour picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FalseColourArg {
    /// What it shows.
    pub quantity: Quantity,
    /// Where it goes, if that was said.
    pub path: Option<PathBuf>,
}

pub(super) fn false_colour(text: &str) -> Result<FalseColourArg, String> {
    let (name, path) = match text.split_once('=') {
        Some((name, path)) => (name, Some(PathBuf::from(path))),
        None => (text, None),
    };
    let quantity = [Quantity::Luminance, Quantity::Illuminance, Quantity::Sources]
        .into_iter()
        .find(|q| q.name() == name);
    let quantity = quantity.ok_or("expected luminance, illuminance or sources, and a file after '='")?;
    Ok(FalseColourArg { quantity, path })
}

/// Ends of a scale; `None`: from the values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range(pub Option<[f64; 2]>);

fn range(text: &str) -> Result<Range, String> {
    if text == "auto" {
        return Ok(Range(None));
    }
    let ends = text.split_once(',');
    let ends = ends.and_then(|(lo, hi)| Some([lo.trim().parse().ok()?, hi.trim().parse().ok()?]));
    ends.map(|ends| Range(Some(ends))).ok_or_else(|| "expected 'auto' or two numbers LO,HI".to_owned())
}

impl ScaleArgs {
    /// What is meant.
    ///
    /// # Errors
    /// Ends that make no scale.
    pub fn resolve(&self) -> Result<FalseColour, String> {
        let kind = match self.scale_kind {
            ScaleKindArg::Linear => ScaleKind::Linear,
            ScaleKindArg::Log => ScaleKind::Log,
        };
        let scale = ScaleChoice { range: self.scale.0, kind };
        if let (Some(what), Some([lo, hi])) = (scale.fault(), self.scale.0) {
            return Err(format!("--scale {lo},{hi}: {what}"));
        }
        let colours = match self.colour_map {
            ColourMapArg::Viridis => ColourMap::Viridis,
            ColourMapArg::Inferno => ColourMap::Inferno,
            ColourMapArg::Turbo => ColourMap::Turbo,
        };
        Ok(FalseColour { scale, colours })
    }
}
