//! Workloads, objectives and search as typed -> checked.

use std::path::{Path, PathBuf};

use rtl_model::cost::Technology;
use toml::Spanned;

use super::super::metric::{Goal, METRICS, Metric};
use super::faults::{Fault, fault_in, unknown};
use super::raw::{RawObjectives, RawSearch, RawWorkload};
use super::resolve::in_technology;
use super::{Objective, Search, SpaceWorkload, Strategy, WorkloadRays};
use crate::scene::toml::source::Source;
use crate::scene::toml::value::Table;

/// Side of a picture (pixels) unless it is given.
const DEFAULT_SIDE: u32 = 128;

/// `[[workload]]`
pub(super) fn workloads(
    source: &Source<'_>,
    raw: Vec<Spanned<Table<RawWorkload>>>,
) -> Result<Vec<SpaceWorkload>, Fault> {
    if raw.is_empty() {
        let what = "a space without workloads, expected at least one `[[workload]]` with a scene";
        return Err(source.fault(0..0, what));
    }
    let mut workloads: Vec<SpaceWorkload> = Vec::new();
    for spanned in raw {
        let at = spanned.span();
        let raw = spanned.into_inner().0;
        let scene = beside(source.path, raw.scene.get_ref());
        if !scene.is_file() {
            let what = format!("no scene file {}", scene.display());
            return Err(fault_in(source, &raw.scene, what));
        }
        const RAYS: [(&str, WorkloadRays); 4] = [
            ("primary", WorkloadRays::Primary),
            ("radiosity", WorkloadRays::Radiosity),
            ("shadow", WorkloadRays::Shadow),
            ("all", WorkloadRays::All),
        ];
        let (word, rays) = match &raw.rays {
            None => RAYS[0],
            Some(given) => one_of(source, "rays", given, &RAYS)?,
        };
        let folder = scene.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
        let place = raw.name.as_ref().map_or(at, Spanned::span);
        let name = raw.name.map_or_else(|| format!("{folder}-{word}"), Spanned::into_inner);
        if name.is_empty() {
            return Err(source.fault(place, "a workload without a name"));
        }
        if workloads.iter().any(|w| w.name == name) {
            return Err(source.fault(place, format!("two workloads are named {name:?}: give one a `name`")));
        }
        workloads.push(SpaceWorkload {
            name,
            scene,
            rays,
            elements: raw.elements.map(|n| n.0),
            width: raw.width.map_or(DEFAULT_SIDE, |n| n.0),
            height: raw.height.map_or(DEFAULT_SIDE, |n| n.0),
            seed: raw.seed.map_or(1, |n| n.0.into()),
        });
    }
    Ok(workloads)
}

/// `file` as seen from the folder of `space`, the short way where that is the same file.
pub(super) fn beside(space: &Path, file: &str) -> PathBuf {
    let mut short = space.parent().unwrap_or(Path::new("")).to_owned();
    let long = short.join(file);
    for part in Path::new(file).components() {
        match part {
            std::path::Component::ParentDir
                if short.file_name().is_some_and(|n| n != "..") && !short.is_symlink() =>
            {
                short.pop();
            }
            std::path::Component::CurDir => {}
            part => short.push(part),
        }
    }
    short
        .canonicalize()
        .ok()
        .filter(|real| long.canonicalize().is_ok_and(|same| same == *real))
        .map_or(long, |_| short)
}

/// The meaning of a word.
pub(super) fn one_of<'w, T: Copy>(
    source: &Source<'_>,
    key: &str,
    given: &Spanned<String>,
    words: &[(&'w str, T)],
) -> Result<(&'w str, T), Fault> {
    let found = words.iter().find(|(word, _)| word == given.get_ref());
    found.copied().ok_or_else(|| {
        let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        unknown(source, given.span(), key, given.get_ref(), known)
    })
}

/// `[objectives]`
pub(super) fn objectives(
    source: &Source<'_>,
    raw: Option<Spanned<Table<RawObjectives>>>,
    technology: &'static Technology,
) -> Result<Vec<Objective>, Fault> {
    let missing = "expected `[objectives]` with at least one metric in `minimise` or `maximise`";
    let Some(raw) = raw else { return Err(source.fault(0..0, format!("no objective: {missing}"))) };
    let at = raw.span();
    let raw = raw.into_inner().0;
    let listed = raw
        .minimise
        .into_iter()
        .map(|name| (name, Goal::Minimise))
        .chain(raw.maximise.into_iter().map(|name| (name, Goal::Maximise)));
    let mut objectives: Vec<Objective> = Vec::new();
    for (name, goal) in listed {
        let Some(metric) = Metric::named(name.get_ref()) else {
            return Err(unknown(
                source,
                name.span(),
                "metric",
                name.get_ref(),
                METRICS.iter().map(|m| m.name),
            ));
        };
        if !in_technology(metric.name, technology) {
            let kind = if technology.is_fpga { "an FPGA" } else { "no FPGA" };
            let what = format!("{} is not known of {}, which is {kind}", metric.name, technology.name);
            return Err(fault_in(source, &name, what));
        }
        if objectives.iter().any(|o| o.metric == metric) {
            return Err(fault_in(source, &name, format!("{} is an objective twice", metric.name)));
        }
        objectives.push(Objective { metric, goal });
    }
    if objectives.is_empty() {
        return Err(source.fault(at, format!("no objective: {missing}")));
    }
    Ok(objectives)
}

/// `[search]`
pub(super) fn search(source: &Source<'_>, raw: Option<Table<RawSearch>>) -> Result<Search, Fault> {
    let Some(Table(raw)) = raw else {
        return Ok(Search { strategy: Strategy::Grid, seed: 1, points: None, minutes: None });
    };
    const WORDS: [(&str, ()); 5] =
        [("grid", ()), ("random", ()), ("sobol", ()), ("halving", ()), ("nsga2", ())];
    let word = match &raw.strategy {
        None => "grid",
        Some(given) => one_of(source, "strategy", given, &WORDS)?.0,
    };
    let no_use = |at: Range, key: &str, of: &str| -> Result<(), Fault> {
        let Some(at) = at else { return Ok(()) };
        Err(source.fault(at, format!("{key} is an option of strategy = {of:?}, and it is {word:?}")))
    };
    if word != "halving" {
        no_use(raw.rungs.as_ref().map(Spanned::span), "rungs", "halving")?;
        no_use(raw.keep.as_ref().map(Spanned::span), "keep", "halving")?;
    }
    if word != "nsga2" {
        no_use(raw.population.as_ref().map(Spanned::span), "population", "nsga2")?;
    }
    if let Some(minutes) = &raw.minutes {
        let m = *minutes.get_ref();
        if !(m > 0.0 && m.is_finite()) {
            return Err(fault_in(source, minutes, format!("minutes = {m}, expected over 0")));
        }
    }
    let points = raw.points.as_ref().map(|n| u64::from(n.get_ref().0));
    if ["random", "sobol", "nsga2"].contains(&word) && points.is_none() && raw.minutes.is_none() {
        let at = raw.strategy.as_ref().map_or(0..0, Spanned::span);
        return Err(source.fault(at, format!("strategy = {word:?} needs an end: `points` or `minutes`")));
    }
    let strategy = match word {
        "random" => Strategy::Random,
        "sobol" => Strategy::Sobol,
        "halving" => {
            let keep = raw.keep.as_ref().map_or(DEFAULT_KEEP, |k| *k.get_ref());
            if let Some(given) = raw.keep.as_ref().filter(|_| !(keep > 0.0 && keep < 1.0)) {
                return Err(fault_in(source, given, format!("keep = {keep}, expected over 0 and under 1")));
            }
            Strategy::Halving { rungs: raw.rungs.map_or(DEFAULT_RUNGS, |r| r.get_ref().0), keep }
        }
        "nsga2" => {
            let population = raw.population.as_ref().map_or(DEFAULT_POPULATION, |p| p.get_ref().0);
            if let (Some(given), Some(points)) = (&raw.points, points)
                && points < u64::from(population)
            {
                let what = format!("points = {points}: a population of {population} is more");
                return Err(fault_in(source, given, what));
            }
            Strategy::Nsga2 { population }
        }
        _ => Strategy::Grid,
    };
    Ok(Search {
        strategy,
        seed: raw.seed.map_or(1, |n| n.0.into()),
        points,
        minutes: raw.minutes.map(Spanned::into_inner),
    })
}

type Range = Option<std::ops::Range<usize>>;

/// Share that goes on, unless it is given.
const DEFAULT_KEEP: f64 = 0.25;

/// Steps of successive halving, unless they are given.
const DEFAULT_RUNGS: u32 = 3;

/// Candidates a generation, unless they are given.
const DEFAULT_POPULATION: u32 = 32;
