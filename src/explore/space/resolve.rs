//! From a choice of values to a board, its cost and its clock.
//!
//! ```text
//! choice -> axes' values -> [set] without the clock -> constraints without the clock -> BoardSpec --validate-->
//!   Cost -> clock -> [set] that mentions a cost or the clock -> the other constraints -> validate -> BoardSpec, Cost
//! ```
//! Expressions are in order of their dependencies. What is set after the cost must leave the cost as it is.

use std::ops::Range;

use evalexpr::Value as Eval;
use rtl_model::cost::{Cost, Technology};
use rtl_model::spec::BoardSpec;

use super::super::metric::{METRICS, Needs, cost_value};
use super::super::value::Value;
use super::expressions::{Expression, Frame, Names};
use super::parameters::{Parameters, shown};
use super::{Axis, Clock};

/// How candidates are made.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) parameters: Parameters,
    pub(super) names: Names,
    /// Values of all names before any axis.
    pub(super) start: Vec<Eval>,
    /// Slot of each axis, and whether it is a board parameter.
    pub(super) axes: Vec<(usize, bool)>,
    /// In order of their dependencies; the late ones last.
    pub(super) set: Vec<Assignment>,
    pub(super) constraints: Vec<Constraint>,
    pub(super) technology: &'static Technology,
    pub(super) clock: Clock,
}

/// `[set]` of a board parameter.
#[derive(Clone, Debug)]
pub(super) struct Assignment {
    pub(super) parameter: String,
    pub(super) slot: usize,
    pub(super) expression: Expression,
    /// It depends on the cost or on the derived clock.
    pub(super) is_late: bool,
}

/// `[[constraint]]`
#[derive(Clone, Debug)]
pub(super) struct Constraint {
    pub(super) expression: Expression,
    pub(super) reason: Option<String>,
    /// It depends on the cost or on the derived clock.
    pub(super) is_late: bool,
}

impl Constraint {
    /// As a reason why a combination is no candidate.
    pub(super) fn reason(&self) -> String {
        match &self.reason {
            Some(reason) => format!("constraint {} ({reason})", self.expression.text),
            None => format!("constraint {}", self.expression.text),
        }
    }
}

/// Why a choice is no candidate.
pub(super) enum Refusal {
    /// A constraint, or a board that cannot be.
    Impossible(String),
    /// An expression that makes no sense: a fault of the file.
    Expression { at: Range<usize>, what: String },
}

impl Refusal {
    /// In words.
    pub(super) fn reason(self) -> String {
        match self {
            Refusal::Impossible(reason) | Refusal::Expression { what: reason, .. } => reason,
        }
    }
}

/// The metrics that the cost model alone tells in a technology.
pub(super) fn cost_names(technology: &Technology) -> impl Iterator<Item = &'static str> {
    METRICS.iter().filter(|m| m.needs == Needs::Cost).map(|m| m.name).filter(|n| in_technology(n, technology))
}

/// Whether a technology has a metric: chips have area, FPGAs have look-up tables.
pub(super) fn in_technology(metric: &str, technology: &Technology) -> bool {
    match metric {
        "area_mm2" | "rays_per_second_per_mm2" => !technology.is_fpga,
        "luts" | "dsps" | "ram_blocks" => technology.is_fpga,
        _ => true,
    }
}

impl Plan {
    /// The board, cost and clock of a choice. `holds` sees every constraint and whether it holds; where it answers
    /// false the choice is refused for it.
    pub(super) fn build(
        &self,
        axes: &[Axis],
        choice: &[usize],
        mut holds: impl FnMut(usize, bool) -> bool,
    ) -> Result<(BoardSpec, Cost), Refusal> {
        let mut frame = Frame::with(&self.names, self.start.clone());
        let mut changes: Vec<(&str, Value)> = Vec::with_capacity(axes.len() + self.set.len());
        for ((axis, place), (slot, is_parameter)) in axes.iter().zip(choice).zip(&self.axes) {
            let value = &axis.values[*place];
            frame.set(*slot, value);
            if *is_parameter {
                changes.push((&axis.name, value.clone()));
            }
        }
        self.assign(false, &mut frame, &mut changes)?;
        self.check(false, &frame, &mut holds)?;

        let board = |changes: &[(&str, Value)]| {
            self.parameters.spec(changes.iter().map(|(n, v)| (*n, v))).map_err(Refusal::Impossible)
        };
        let valid = |spec: &BoardSpec| spec.validate().map_err(|e| Refusal::Impossible(e.to_string()));
        let mut spec = board(&changes)?;
        if self.clock == Clock::Derived {
            // Until it is known, the clock that nothing forbids.
            spec.clock_mhz = spec.bus.clock_mhz;
        }
        valid(&spec)?;
        let cost = Cost::of(&spec, self.technology);
        if self.clock == Clock::Derived {
            spec.clock_mhz = cost.max_clock_mhz;
        }
        for name in cost_names(self.technology) {
            if let (Some(slot), Some(value)) = (self.names.slot(name), cost_value(name, &cost, &spec)) {
                frame.set(slot, &Value::Float(value));
            }
        }
        let n_early = changes.len();
        if self.assign(true, &mut frame, &mut changes)? {
            let clock_mhz = spec.clock_mhz;
            spec = board(&changes)?;
            if self.clock == Clock::Derived {
                spec.clock_mhz = clock_mhz;
            }
            valid(&spec)?;
            if Cost::of(&spec, self.technology) != cost {
                return Err(self.changes_its_cost(&changes, n_early, &cost));
            }
        }
        self.check(true, &frame, &mut holds)?;
        valid(&spec)?;
        Ok((spec, cost))
    }

    /// Sets the early or the late parameters; tells whether there were any.
    fn assign<'p>(
        &'p self,
        is_late: bool,
        frame: &mut Frame<'_>,
        changes: &mut Vec<(&'p str, Value)>,
    ) -> Result<bool, Refusal> {
        let mut any = false;
        for set in self.set.iter().filter(|s| s.is_late == is_late) {
            let fault = |what: String| Refusal::Expression { at: set.expression.at.clone(), what };
            let value = set
                .expression
                .value(frame)
                .map_err(|what| fault(format!("{} = {:?}: {what}", set.parameter, set.expression.text)))?;
            if let Some(x) = value.number().filter(|x| !x.is_finite()) {
                let what = format!("{} = {:?} is {x}", set.parameter, set.expression.text);
                return Err(Refusal::Impossible(what));
            }
            let value = self.parameters.convert(&set.parameter, &value).map_err(fault)?;
            frame.set(set.slot, &value);
            changes.push((&set.parameter, value));
            any = true;
        }
        Ok(any)
    }

    fn check(
        &self,
        is_late: bool,
        frame: &Frame<'_>,
        holds: &mut impl FnMut(usize, bool) -> bool,
    ) -> Result<(), Refusal> {
        for (i, constraint) in self.constraints.iter().enumerate().filter(|(_, c)| c.is_late == is_late) {
            let expression = &constraint.expression;
            let what = match expression.value(frame) {
                Ok(Value::Bool(is_kept)) => {
                    if !holds(i, is_kept) {
                        return Err(Refusal::Impossible(constraint.reason()));
                    }
                    continue;
                }
                Ok(other) => format!("is {}, expected true or false", shown(&other)),
                Err(what) => what,
            };
            let what = format!("{:?}: {what}", expression.text);
            return Err(Refusal::Expression { at: expression.at.clone(), what });
        }
        Ok(())
    }

    /// The fault that what follows from the cost changes it: of the late changes the first that does so by itself.
    fn changes_its_cost(&self, changes: &[(&str, Value)], n_early: usize, cost: &Cost) -> Refusal {
        let (early, late) = changes.split_at(n_early);
        let moves_it = |change: &(&str, Value)| {
            let with = early.iter().chain([change]).map(|(name, value)| (*name, value));
            self.parameters
                .spec(with)
                .is_ok_and(|spec| spec.validate().is_err() || Cost::of(&spec, self.technology) != *cost)
        };
        let name = late.iter().find(|change| moves_it(change)).or(late.first()).map_or("", |(name, _)| name);
        let set = self.set.iter().find(|s| s.parameter == name);
        let at = set.map_or(0..0, |s| s.expression.at.clone());
        let what = format!("{name} follows from the cost and changes it: the cost would depend on itself");
        Refusal::Expression { at, what }
    }
}
