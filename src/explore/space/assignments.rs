//! `[set]` and `[[constraint]]` as typed -> expressions in the order of their dependencies, early or late.
//!
//! ```text
//! "fifos.ctu_icu" = "2 * icu.depth"                          early: needs the axes
//! "dram.row_miss_cycles" = "ceil(240 * clock_mhz / 1000)"    late: needs the clock, which follows from the cost
//! ```

use std::collections::BTreeSet;
use std::ops::Range;

use rtl_model::cost::Technology;
use toml::Spanned;

use super::super::value::Value;
use super::expressions::{Expression, Names};
use super::faults::{Fault, fault_in, unknown_parameter};
use super::parameters::Parameters;
use super::raw::{RawConstraint, RawSet};
use super::resolve::{Assignment, Constraint, cost_names};
use super::{Axis, Clock};
use crate::scene::toml::source::Source;
use crate::scene::toml::value::Table;

/// What expressions may mention, and where costs and clock come from.
pub(super) struct Known<'k> {
    pub(super) axes: &'k [Axis],
    pub(super) names: &'k Names,
    pub(super) technology: &'static Technology,
    pub(super) clock: Clock,
}

/// `[set]` and `[[constraint]]`. Constants go into the base of `parameters`.
pub(super) fn resolve(
    source: &Source<'_>,
    raw_set: Vec<RawSet>,
    raw_constraints: Vec<Spanned<Table<RawConstraint>>>,
    known: &Known<'_>,
    parameters: &mut Parameters,
) -> Result<(Vec<Assignment>, Vec<Constraint>), Fault> {
    let mut set = Vec::new();
    for RawSet { name, at, value } in raw_set {
        check_target(source, &name, at, known, parameters)?;
        match constant(source, &name, &value, parameters)? {
            Some(value) => parameters.set_base(&name, &value),
            None => {
                let text = Spanned::new(value.span(), value.get_ref().to_string());
                let expression = Expression::parse(source, &text)?;
                expression.check_names(source, known.names)?;
                let Some(slot) = known.names.slot(&name) else { continue };
                set.push(Assignment { parameter: name, slot, expression, is_late: false });
            }
        }
    }
    let mut set = in_order(source, set)?;
    // What is known only after the cost: the costs, the clock that follows from them, and what is set from these.
    let mut late: BTreeSet<String> =
        cost_names(known.technology).filter(|n| *n != "clock_mhz").map(str::to_owned).collect();
    if known.clock == Clock::Derived {
        late.insert("clock_mhz".to_owned());
    }
    for assignment in &mut set {
        assignment.is_late = assignment.expression.mentions().any(|n| late.contains(n));
        if assignment.is_late {
            late.insert(assignment.parameter.clone());
        }
    }
    let mut constraints = Vec::new();
    for raw in raw_constraints {
        let RawConstraint { require, reason } = raw.into_inner().0;
        let expression = Expression::parse(source, &require)?;
        expression.check_names(source, known.names)?;
        let is_late = expression.mentions().any(|n| late.contains(n));
        constraints.push(Constraint { expression, reason, is_late });
    }
    Ok((set, constraints))
}

fn check_target(
    source: &Source<'_>,
    name: &str,
    at: Range<usize>,
    known: &Known<'_>,
    parameters: &Parameters,
) -> Result<(), Fault> {
    if !parameters.is_known(name) {
        return Err(unknown_parameter(source, name, at, parameters));
    }
    if known.axes.iter().any(|a| a.name == name) {
        return Err(source.fault(at, format!("{name} is an axis already: it cannot be set too")));
    }
    check_clock(source, name, at, known.clock)
}

/// A derived clock follows from the cost: nothing else sets it.
pub(super) fn check_clock(
    source: &Source<'_>,
    name: &str,
    at: Range<usize>,
    clock: Clock,
) -> Result<(), Fault> {
    if name == "clock_mhz" && clock == Clock::Derived {
        let fault = source.fault(at, "clock_mhz follows from the critical path with clock = \"derived\"");
        return Err(fault.with_help("clock = \"board\" takes the board's"));
    }
    Ok(())
}

/// The value of a number, of true and false, and of a word that the parameter takes.
fn constant(
    source: &Source<'_>,
    name: &str,
    value: &Spanned<Value>,
    parameters: &Parameters,
) -> Result<Option<Value>, Fault> {
    let given = value.get_ref();
    let converted = parameters.convert(name, given);
    if let Value::Text(_) = given {
        // A word that the parameter takes is that word, all else an expression.
        return Ok(converted.ok().filter(|word| parameters.possible(name, word).is_ok()));
    }
    let converted = converted.map_err(|what| fault_in(source, value, what))?;
    parameters.possible(name, &converted).map_err(|e| e.at(source, value.span()))?;
    Ok(Some(converted))
}

/// Each after those that set what it mentions.
fn in_order(source: &Source<'_>, mut set: Vec<Assignment>) -> Result<Vec<Assignment>, Fault> {
    let mut ordered: Vec<Assignment> = Vec::with_capacity(set.len());
    while !set.is_empty() {
        let is_ready = |a: &Assignment| {
            a.expression.mentions().all(|name| set.iter().all(|waiting| waiting.parameter != name))
        };
        match set.iter().position(is_ready) {
            Some(i) => ordered.push(set.remove(i)),
            None => return Err(cycle(source, &set)),
        }
    }
    Ok(ordered)
}

/// Every one of `set` waits for another: following them ends in a circle.
fn cycle(source: &Source<'_>, set: &[Assignment]) -> Fault {
    let next = |a: &Assignment| {
        set.iter().position(|b| a.expression.mentions().any(|name| name == b.parameter)).unwrap_or(0)
    };
    let mut way = vec![0_usize];
    loop {
        let to = next(&set[way[way.len() - 1]]);
        if let Some(start) = way.iter().position(|i| *i == to) {
            let names: Vec<&str> =
                way[start..].iter().chain([&to]).map(|i| set[*i].parameter.as_str()).collect();
            let what = format!("expressions in a circle: {}", names.join(" <- "));
            return source.fault(set[to].expression.at.clone(), what);
        }
        way.push(to);
    }
}
