//! Every parameter of a board, with unit, default and source tag.

use serde::{Deserialize, Serialize};

use crate::fixed::Formats;

/// A board. All fields have defaults; unknown keys are refused.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BoardSpec {
    /// Name for reports.
    pub name: String,
    /// Number formats.
    pub formats: Formats,
    /// log2 of the grid's cells per axis; absent: about two patches a cell.
    pub grid_log2: Option<u32>,
    /// Board clock (MHz).
    pub clock_mhz: f64,
}

/// A parameter that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct SpecError(pub String);

/// One parameter as `info` lists it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterRow {
    /// Dotted name, as in the file.
    pub name: String,
    /// Value with unit.
    pub value: String,
    /// Source tag: `[S]`, `[C]` or `[I]` and where from.
    pub source: String,
}

impl BoardSpec {
    /// The names of the presets that are compiled in.
    pub fn preset_names() -> &'static [&'static str] {
        &["delft-1992", "minimal"]
    }

    /// A preset by name.
    pub fn preset(name: &str) -> Option<BoardSpec> {
        let _ = name;
        todo!()
    }

    /// Parses and validates a board file's text.
    ///
    /// # Errors
    /// Syntax, unknown keys (with line and column), values outside their range.
    pub fn from_toml(text: &str) -> Result<BoardSpec, SpecError> {
        let _ = text;
        todo!()
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter that cannot be, with value and range.
    pub fn validate(&self) -> Result<(), SpecError> {
        todo!()
    }

    /// Every parameter, resolved, with its source tag.
    pub fn parameters(&self) -> Vec<ParameterRow> {
        todo!()
    }
}
