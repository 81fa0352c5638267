//! Words for what is wrong with a space, with its place: the machinery of scene files.

use std::ops::Range;

use toml::Spanned;

use super::parameters::Parameters;
use crate::scene::SceneError;
use crate::scene::toml::faults::suggest;
use crate::scene::toml::source::Source;

/// A fault with its place.
pub(super) type Fault = SceneError;

/// A fault at a value.
pub(super) fn fault_in<T>(source: &Source<'_>, value: &Spanned<T>, what: impl Into<String>) -> Fault {
    source.fault(value.span(), what)
}

/// A word that is none of `known`, with "did you mean".
pub(super) fn unknown<'k>(
    source: &Source<'_>,
    at: Range<usize>,
    what: &str,
    given: &str,
    known: impl IntoIterator<Item = &'k str> + Clone,
) -> Fault {
    let list: Vec<&str> = known.clone().into_iter().collect();
    let fault = source.fault(at, format!("unknown {what} {given:?}, expected one of {}", list.join(", ")));
    suggest(fault, given, known)
}

/// A name that is no board parameter, with the closest one.
pub(super) fn unknown_parameter(
    source: &Source<'_>,
    name: &str,
    at: Range<usize>,
    parameters: &Parameters,
) -> Fault {
    let what = format!("unknown board parameter {name:?} (`radeng info delft-1992` lists them)");
    suggest(source.fault(at, what), name, parameters.names())
}

/// True for a name that a free variable can have.
pub(super) fn is_identifier(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !["true", "false", "inf", "nan", "infinity"].contains(&name.to_ascii_lowercase().as_str())
}
