//! Axes: lists and ranges as typed -> the values of each axis, all different, all possible for some board.
//!
//! ```text
//! [2, 4, 8]                                          as they stand
//! { from = 4, to = 16, step = 4 }                    from, from + step, ... up to `to`
//! { from = 1024, to = 16384, scale = "powers-of-two" }   every power of two between
//! ```

use std::ops::Range;

use toml::Spanned;

use super::super::value::Value;
use super::Axis;
use super::faults::{Fault, fault_in, is_identifier, unknown_parameter};
use super::parameters::Parameters;
use super::raw::{RawAxis, RawRange, RawValues};
use crate::scene::toml::source::Source;

/// Most values of an axis.
const MAX_VALUES: u64 = 1 << 20;

/// Most combinations of a space.
const MAX_COMBINATIONS: u64 = 1 << 40;

/// The axes, and where each one's name stands.
pub(super) fn resolve(
    source: &Source<'_>,
    raw: Vec<RawAxis>,
    parameters: &Parameters,
) -> Result<(Vec<Axis>, Vec<Range<usize>>), Fault> {
    if raw.is_empty() {
        return Err(source.fault(0..0, "a space without axes, expected `[axes]` with at least one"));
    }
    let mut n_combinations = 1_u64;
    let (mut axes, mut places) = (Vec::new(), Vec::new());
    for axis in raw {
        let RawAxis { name, at, values } = axis;
        let is_parameter = parameters.is_known(&name);
        if !is_parameter && !is_identifier(&name) {
            return Err(unknown_parameter(source, &name, at, parameters));
        }
        let values = match values {
            RawValues::List(list) => list,
            RawValues::Range(range) => expand(source, &name, range)?,
        };
        if values.is_empty() {
            return Err(source.fault(at, format!("{name}: an axis without values")));
        }
        let mut converted: Vec<Value> = Vec::with_capacity(values.len());
        let mut seen = std::collections::BTreeSet::new();
        for value in values {
            let (span, mut value) = (value.span(), value.into_inner());
            if is_parameter {
                value = parameters.convert(&name, &value).map_err(|what| source.fault(span.clone(), what))?;
                parameters.possible(&name, &value).map_err(|e| e.at(source, span.clone()))?;
            }
            if !seen.insert(key(&value)) {
                return Err(source.fault(span, format!("{name}: {value} stands twice")));
            }
            converted.push(value);
        }
        n_combinations = n_combinations.saturating_mul(converted.len() as u64);
        if n_combinations > MAX_COMBINATIONS {
            return Err(source.fault(at, "more than 2^40 combinations with this axis"));
        }
        axes.push(Axis { name, values: converted });
        places.push(at);
    }
    Ok((axes, places))
}

/// Equal for equal values: 4 and 4.0 are one.
fn key(value: &Value) -> String {
    value.number().map_or_else(|| format!("{value:?}"), |x| (x + 0.0).to_string())
}

fn expand(source: &Source<'_>, name: &str, range: RawRange) -> Result<Vec<Spanned<Value>>, Fault> {
    let RawRange { from, to, step, scale } = range;
    let number = |value: &Spanned<Value>, what: &str| {
        value.get_ref().number().ok_or_else(|| {
            fault_in(source, value, format!("{what} = {:?}, expected a number", value.get_ref().to_string()))
        })
    };
    let (first, last) = (number(&from, "from")?, number(&to, "to")?);
    if last < first {
        let what = format!("{name}: the range ends at {last}, before its start {first}");
        return Err(fault_in(source, &to, what));
    }
    let powers = match &scale {
        None => false,
        Some(scale) => match scale.get_ref() {
            Value::Text(word) if word == "powers-of-two" => true,
            Value::Text(word) if word == "linear" => false,
            other => {
                let what =
                    format!("scale = {:?}, expected \"linear\" or \"powers-of-two\"", other.to_string());
                return Err(fault_in(source, scale, what));
            }
        },
    };
    // The place of the values is that of the end: it is what is changed most often.
    let here = |value| Spanned::new(to.span(), value);
    if powers {
        if let Some(step) = &step {
            return Err(fault_in(source, step, "step has no use with scale = \"powers-of-two\""));
        }
        for end in [&from, &to] {
            let is_power = matches!(end.get_ref(), Value::Integer(n) if *n > 0 && n.count_ones() == 1);
            if !is_power {
                return Err(fault_in(source, end, format!("{name}: {} is no power of two", end.get_ref())));
            }
        }
        let (first, last) = ((first as u64).trailing_zeros(), (last as u64).trailing_zeros());
        return Ok((first..=last).map(|k| here(Value::Integer(1 << k))).collect());
    }
    let by = step.as_ref().map_or(Ok(1.0), |s| number(s, "step"))?;
    if by <= 0.0 {
        let place = step.as_ref().map_or(to.span(), Spanned::span);
        return Err(source.fault(place, format!("{name}: step = {by}, expected over 0")));
    }
    // 0.1, 0.2, 0.3: the third is not short of the end for its last bit.
    let n = ((last - first) / by + 1e-9).floor();
    if n >= MAX_VALUES as f64 {
        return Err(fault_in(source, &to, format!("{name}: more than {MAX_VALUES} values")));
    }
    let whole = [Some(&from), Some(&to), step.as_ref()]
        .into_iter()
        .flatten()
        .all(|v| matches!(v.get_ref(), Value::Integer(_)));
    let value = |i: u64| {
        let x = first + i as f64 * by;
        if whole { Value::Integer(x as i64) } else { Value::Float(short(x)) }
    };
    Ok((0..=n as u64).map(|i| here(value(i))).collect())
}

/// `x` to twelve digits, so that 0.1 + 2 * 0.1 is 0.3.
fn short(x: f64) -> f64 {
    format!("{x:.12e}").parse().unwrap_or(x)
}
