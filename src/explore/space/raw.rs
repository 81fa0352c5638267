//! The space file as typed: every key, nothing resolved.
//!
//! ```text
//! text --toml--> tables with spans --> RawSpace: axes and expressions in the file's order, the rest by serde
//! ```
//! `Spanned` keeps the place of what later checks may have to point at. Format: scenes/spaces/README.md.

use std::ops::Range;

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::super::value::Value;
use crate::scene::SceneError;
use crate::scene::toml::source::Source;
use crate::scene::toml::value::{Table, Whole};
use crate::scene::toml::{faults, read_root};

/// Longest side of a picture (pixels), as on the command line.
const MAX_SIDE: u32 = 32_768;

/// The whole file.
pub(super) struct RawSpace {
    pub(super) head: RawHead,
    /// In the file's order.
    pub(super) axes: Vec<RawAxis>,
    /// In the file's order.
    pub(super) set: Vec<RawSet>,
}

/// All but axes and expressions.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawHead {
    /// Checked before all else.
    #[serde(rename = "version")]
    _version: IgnoredAny,
    pub(super) question: Option<String>,
    pub(super) base: Option<Spanned<String>>,
    pub(super) technology: Option<Spanned<String>>,
    pub(super) clock: Option<Spanned<String>>,
    /// `RawSpace::axes`.
    #[serde(rename = "axes")]
    _axes: Option<IgnoredAny>,
    /// `RawSpace::set`.
    #[serde(rename = "set")]
    _set: Option<IgnoredAny>,
    #[serde(default)]
    pub(super) constraint: Vec<Spanned<Table<RawConstraint>>>,
    #[serde(default)]
    pub(super) workload: Vec<Spanned<Table<RawWorkload>>>,
    pub(super) objectives: Option<Spanned<Table<RawObjectives>>>,
    pub(super) search: Option<Table<RawSearch>>,
}

/// `[[constraint]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawConstraint {
    pub(super) require: Spanned<String>,
    pub(super) reason: Option<String>,
}

/// `[[workload]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawWorkload {
    pub(super) name: Option<Spanned<String>>,
    pub(super) scene: Spanned<String>,
    pub(super) rays: Option<Spanned<String>>,
    pub(super) elements: Option<Whole<1, { crate::scene::MAX_ELEMENTS }>>,
    pub(super) width: Option<Whole<1, MAX_SIDE>>,
    pub(super) height: Option<Whole<1, MAX_SIDE>>,
    pub(super) seed: Option<Whole<0, { u32::MAX }>>,
}

/// `[objectives]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawObjectives {
    #[serde(default)]
    pub(super) minimise: Vec<Spanned<String>>,
    #[serde(default)]
    pub(super) maximise: Vec<Spanned<String>>,
}

/// `[search]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSearch {
    pub(super) strategy: Option<Spanned<String>>,
    pub(super) seed: Option<Whole<0, { u32::MAX }>>,
    pub(super) points: Option<Spanned<Whole<1, { u32::MAX }>>>,
    pub(super) minutes: Option<Spanned<f64>>,
    pub(super) rungs: Option<Spanned<Whole<2, 8>>>,
    pub(super) keep: Option<Spanned<f64>>,
    pub(super) population: Option<Spanned<Whole<4, 1000>>>,
}

/// An entry of `[axes]`.
pub(super) struct RawAxis {
    pub(super) name: String,
    /// Place of the name.
    pub(super) at: Range<usize>,
    pub(super) values: RawValues,
}

/// Values of an axis as typed.
pub(super) enum RawValues {
    /// `[1, 2, 3]`
    List(Vec<Spanned<Value>>),
    /// `{ from = 1, to = 8, step = 1 }`
    Range(RawRange),
}

/// A range as typed.
pub(super) struct RawRange {
    pub(super) from: Spanned<Value>,
    pub(super) to: Spanned<Value>,
    pub(super) step: Option<Spanned<Value>>,
    pub(super) scale: Option<Spanned<Value>>,
}

/// An entry of `[set]`.
pub(super) struct RawSet {
    pub(super) name: String,
    /// Place of the name.
    pub(super) at: Range<usize>,
    /// An expression, or a constant.
    pub(super) value: Spanned<Value>,
}

/// Syntax, version, keys and types.
pub(super) fn read(source: &Source<'_>) -> Result<RawSpace, SceneError> {
    let root = read_root(source, "a design space: `version = 1`, axes, workloads, objectives")?;
    let table = |key: &str| -> Result<Vec<Entry<'_>>, SceneError> {
        let mut entries = Vec::new();
        if let Some(value) = root.get_ref().get(key) {
            let DeValue::Table(inner) = value.get_ref() else {
                return Err(source.fault(value.span(), format!("{key}: expected a table `[{key}]`")));
            };
            flatten("", inner, &mut entries);
            // The library keeps keys in the order of the alphabet; the file's order says which axis is fastest.
            entries.sort_by_key(|e| e.at.start);
        }
        for (i, entry) in entries.iter().enumerate() {
            if entries[..i].iter().any(|e| e.name == entry.name) {
                return Err(source.fault(entry.at.clone(), format!("{} stands twice in [{key}]", entry.name)));
            }
        }
        Ok(entries)
    };
    let axes = table("axes")?.into_iter().map(|e| axis(source, e)).collect::<Result<_, _>>()?;
    let set = table("set")?.into_iter().map(|e| assignment(source, e)).collect::<Result<_, _>>()?;
    let head = RawHead::deserialize(Deserializer::from(root)).map_err(|e| faults::of_toml(source, &e))?;
    Ok(RawSpace { head, axes, set })
}

/// A key of `[axes]` or `[set]`, dots resolved.
struct Entry<'a> {
    name: String,
    at: Range<usize>,
    value: &'a Spanned<DeValue<'a>>,
}

const RANGE_KEYS: [&str; 4] = ["from", "to", "step", "scale"];

/// `icu.depth = 3` is a table in a table: the same as `"icu.depth" = 3`.
fn flatten<'a>(prefix: &str, table: &'a DeTable<'a>, into: &mut Vec<Entry<'a>>) {
    for (key, value) in table {
        let name =
            if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        match value.get_ref() {
            DeValue::Table(inner)
                if !inner.is_empty() && !RANGE_KEYS.iter().any(|k| inner.contains_key(*k)) =>
            {
                flatten(&name, inner, into);
            }
            _ => into.push(Entry { name, at: key.span(), value }),
        }
    }
}

fn axis(source: &Source<'_>, entry: Entry<'_>) -> Result<RawAxis, SceneError> {
    let Entry { name, at, value } = entry;
    let values = match value.get_ref() {
        DeValue::Array(list) => {
            RawValues::List(list.iter().map(|v| scalar(source, v)).collect::<Result<_, _>>()?)
        }
        DeValue::Table(table) => RawValues::Range(range(source, &at, table)?),
        _ => {
            let message = format!(
                "{name} = {}, expected a list of values, or {{ from, to, step }}",
                source.slice(&value.span())
            );
            return Err(source.fault(value.span(), message));
        }
    };
    Ok(RawAxis { name, at, values })
}

fn range(source: &Source<'_>, at: &Range<usize>, table: &DeTable<'_>) -> Result<RawRange, SceneError> {
    if let Some(key) = table.keys().find(|k| !RANGE_KEYS.contains(&k.get_ref().as_ref())) {
        let fault = source.fault(
            key.span(),
            format!("unknown key {:?}, expected one of {}", key.get_ref(), RANGE_KEYS.join(", ")),
        );
        return Err(faults::suggest(fault, key.get_ref(), RANGE_KEYS));
    }
    let optional = |key: &str| table.get(key).map(|v| scalar(source, v)).transpose();
    let needed = |key: &str| {
        optional(key)?.ok_or_else(|| source.fault(at.clone(), format!("a range without `{key}`")))
    };
    Ok(RawRange {
        from: needed("from")?,
        to: needed("to")?,
        step: optional("step")?,
        scale: optional("scale")?,
    })
}

fn assignment(source: &Source<'_>, entry: Entry<'_>) -> Result<RawSet, SceneError> {
    let Entry { name, at, value } = entry;
    Ok(RawSet { name, at, value: scalar(source, value)? })
}

fn scalar(source: &Source<'_>, value: &Spanned<DeValue<'_>>) -> Result<Spanned<Value>, SceneError> {
    let span = value.span();
    let fault = |message: String| source.fault(span.clone(), message);
    let scalar = match value.get_ref() {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix())
            .map(Value::Integer)
            .map_err(|_| fault(format!("{n}, expected a number of at most 64 bits")))?,
        DeValue::Float(x) => match x.as_str().parse::<f64>() {
            Ok(number) if number.is_finite() => Value::Float(number),
            _ => return Err(fault(format!("{x}, expected a finite number"))),
        },
        DeValue::Boolean(b) => Value::Bool(*b),
        DeValue::Datetime(_) | DeValue::Array(_) | DeValue::Table(_) => {
            return Err(fault("expected a number, a word, true or false".to_owned()));
        }
    };
    Ok(Spanned::new(span, scalar))
}
