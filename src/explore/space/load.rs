//! From a file to a checked [`Space`], or to one fault with its place.

use std::path::Path;

use rtl_model::cost::Technology;
use rtl_model::spec::BoardSpec;
use toml::Spanned;

use super::assignments::{self, Known, check_clock};
use super::expressions::{Frame, Names};
use super::faults::{Fault, unknown};
use super::parameters::Parameters;
use super::resolve::{Plan, cost_names};
use super::{Clock, Space, axes, constraints, goals, raw};
use crate::scene::toml::faults::suggest;
use crate::scene::toml::source::{self, Source};

/// The base board unless another is named.
const DEFAULT_BASE: &str = "delft-1992";

/// The technology unless another is named.
const DEFAULT_TECHNOLOGY: &str = "osu-0.35um";

/// Largest space file (bytes): axes of a million values.
const MAX_BYTES: usize = 16 << 20;

pub(super) fn load(file: &Path) -> Result<Space, Fault> {
    parse(&source::read(file, "a design space")?, file)
}

pub(super) fn parse(text: &str, file: &Path) -> Result<Space, Fault> {
    let source = Source { path: file, text };
    if text.len() > MAX_BYTES {
        return Err(source.fault(0..0, format!("larger than {} MiB, the limit of a space", MAX_BYTES >> 20)));
    }
    let raw = raw::read(&source)?;
    let head = raw.head;
    let base = base(&source, head.base.as_ref())?;
    let technology = technology(&source, head.technology.as_ref())?;
    const CLOCKS: [(&str, Clock); 2] = [("board", Clock::Board), ("derived", Clock::Derived)];
    let clock = match &head.clock {
        None => Clock::Board,
        Some(given) => goals::one_of(&source, "clock", given, &CLOCKS)?.1,
    };
    let mut parameters = Parameters::of(&base);
    let (axes, places) = axes::resolve(&source, raw.axes, &parameters)?;
    let mut names = Names::default();
    parameters.names().for_each(|name| _ = names.add(name));
    cost_names(technology).for_each(|name| _ = names.add(name));
    let mut slots = Vec::with_capacity(axes.len());
    for (axis, at) in axes.iter().zip(&places) {
        check_clock(&source, &axis.name, at.clone(), clock)?;
        let is_parameter = parameters.is_known(&axis.name);
        if !is_parameter && names.slot(&axis.name).is_some() {
            let what = format!("{} is the name of a cost: a variable needs another", axis.name);
            return Err(source.fault(at.clone(), what));
        }
        slots.push((names.add(&axis.name), is_parameter));
    }
    let known = Known { axes: &axes, names: &names, technology, clock };
    let (set, constraint_list) =
        assignments::resolve(&source, raw.set, head.constraint, &known, &mut parameters)?;
    let used = |name: &str| {
        let expressions =
            set.iter().map(|s| &s.expression).chain(constraint_list.iter().map(|c| &c.expression));
        expressions.into_iter().any(|e| e.mentions().any(|n| n == name))
    };
    for ((axis, at), (_, is_parameter)) in axes.iter().zip(&places).zip(&slots) {
        if !is_parameter && !used(&axis.name) {
            let what = format!("{} is no board parameter, and no expression uses it", axis.name);
            return Err(suggest(source.fault(at.clone(), what), &axis.name, parameters.names()));
        }
    }
    let mut start = Frame::new(&names);
    for name in parameters.names() {
        // A derived clock is not known before the cost.
        if let Some(slot) = names.slot(name).filter(|_| clock == Clock::Board || name != "clock_mhz") {
            start.set(slot, &parameters.base_value(name));
        }
    }
    let start = start.into_values();
    let first_axis = places.first().cloned().unwrap_or(0..0);
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let space = Space {
        file: file.to_owned(),
        text: text.to_owned(),
        question: head.question.unwrap_or_else(|| name.clone()),
        name,
        base,
        technology,
        clock,
        workloads: goals::workloads(&source, head.workload)?,
        objectives: goals::objectives(&source, head.objectives, technology)?,
        search: goals::search(&source, head.search)?,
        plan: Plan {
            parameters,
            names,
            start,
            axes: slots,
            set,
            constraints: constraint_list,
            technology,
            clock,
        },
        axes,
        first_axis,
    };
    constraints::try_out(&source, &space)?;
    Ok(space)
}

/// A preset, or a board file beside the space.
fn base(source: &Source<'_>, given: Option<&Spanned<String>>) -> Result<BoardSpec, Fault> {
    let name = given.map_or(DEFAULT_BASE, |g| g.get_ref().as_str());
    if let Some(preset) = BoardSpec::preset(name) {
        return Ok(preset);
    }
    let at = given.map_or(0..0, Spanned::span);
    let presets = BoardSpec::preset_names();
    let path = goals::beside(source.path, name);
    if !path.is_file() {
        let what = format!(
            "base = {name:?}: no board file {}, and no preset of this name (presets: {})",
            path.display(),
            presets.join(", ")
        );
        return Err(suggest(source.fault(at, what), name, presets.iter().copied()));
    }
    let text = source::read(&path, "a board file").map_err(|e| source.fault(at.clone(), e.to_string()))?;
    BoardSpec::from_toml(&text).map_err(|e| source.fault(at, format!("{}: {e}", path.display())))
}

fn technology(source: &Source<'_>, given: Option<&Spanned<String>>) -> Result<&'static Technology, Fault> {
    let name = given.map_or(DEFAULT_TECHNOLOGY, |g| g.get_ref().as_str());
    Technology::named(name).ok_or_else(|| match given {
        Some(given) => {
            unknown(source, given.span(), "technology", name, Technology::all().iter().map(|t| t.name))
        }
        None => source.fault(0..0, format!("the technology {name} is missing")),
    })
}
