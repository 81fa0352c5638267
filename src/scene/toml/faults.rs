//! Faults of syntax, keys and types, as the TOML library reports them, in the words of our file formats.

use super::super::SceneError;
use super::source::Source;

/// The fault that a TOML error means: its place, and for an unknown key the closest known one.
pub(crate) fn of_toml(source: &Source<'_>, error: &toml::de::Error) -> SceneError {
    let span = error.span().unwrap_or(0..0);
    let message = error.message();
    if let Some(rest) = message.strip_prefix("unknown field `") {
        // serde: unknown field `KEY`, expected one of `a`, `b` | expected `a` | there are no fields
        let (key, expected) = rest.rsplit_once("`, expected ").unwrap_or((rest, ""));
        let known: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
        let fault = source.fault(span, format!("unknown key {key:?}, expected one of {}", known.join(", ")));
        return suggest(fault, key, known);
    }
    if let Some(key) = message.strip_prefix("missing field ") {
        return source.fault(span, format!("missing key {key}"));
    }
    // serde's words for TOML's things.
    let message = message
        .replace("invalid type: map", "invalid type: table")
        .replace("invalid type: sequence", "invalid type: array")
        .replace("expected a sequence", "expected an array of tables");
    match key_path(error) {
        Some(path) => source.fault(span, format!("{path}: {message}")),
        None => source.fault(span, message),
    }
}

/// The keys that lead to the value at fault, `materials.wall.reflectance`: the last line that the error displays.
fn key_path(error: &toml::de::Error) -> Option<String> {
    let shown = error.to_string();
    let path = shown.trim_end().lines().last()?.strip_prefix("in `")?.strip_suffix('`')?;
    Some(path.to_owned())
}

/// `fault` with "did you mean" when one of `known` is close to `given`.
pub(crate) fn suggest<'k>(
    fault: SceneError,
    given: &str,
    known: impl IntoIterator<Item = &'k str>,
) -> SceneError {
    // A third of the letters may differ, swapped neighbours count once.
    let limit = (given.chars().count() / 3).max(1);
    let close = known
        .into_iter()
        .filter(|k| k.len().abs_diff(given.len()) <= 4 * limit)
        .map(|k| (strsim::osa_distance(given, k), k))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance);
    match close {
        Some((_, name)) => fault.with_help(format!("did you mean {name:?}?")),
        None => fault,
    }
}
