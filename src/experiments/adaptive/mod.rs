//! Adaptive meshing against uniform meshing: elements for the same error, beside the best quadtree.
//!
//! ```text
//! scene --uniform mesh, solved--> error       --refined to several wanted errors, solved--> elements, errors
//!       --dense reference-------> pruned quadtrees: fewest elements for the uniform mesh's error
//! ```
//! All meshes of a scene have the same patches, so sources are equally coarse in all of them, and the reference's:
//! what differs is where irradiance is stored. Two errors: of the solution's own values, noise of visibility and all, and
//! of the mesh alone, with the reference's values at its vertices; the pruned quadtrees have the latter.

use std::path::Path;

use super::plot::{Mark, Panel, Scale, Series};
use super::table::{Cell, Table, row};
use super::{Check, Experiment, ExperimentError, Extent, Findings};
use crate::radiosity::SolveOptions;
use crate::radiosity::refine::RefineOptions;
use crate::scene::{MeshTarget, Scene};

pub mod measure;
mod search;
#[cfg(test)]
mod tests;

use measure::{Errors, Quadtrees, Reference, adaptive, uniform};
use search::Search;

/// The experiment; it is about the host, not the board, so `all` leaves it out.
pub const EXPERIMENT: Experiment =
    Experiment { name: "adaptive", title: "Adaptive meshing against uniform meshes", run };

/// Refined meshes that are made of a case at most.
const N_TRIES: usize = 5;
/// Errors under this count as none, and none is wanted smaller (relative L2).
const NO_ERROR: f64 = 1e-4;
/// Unshot share of scenes whose errors are percents: most patches need not shoot then.
const UNSHOT_SHARE: f64 = 0.01;
/// Splits of every element of the uniform mesh in the reference.
const REFERENCE_SPLITS: u32 = 1;

/// A scene and the uniform mesh that it is compared with.
struct Case {
    name: &'static str,
    text: &'static str,
    /// Element edges, full and quick; the scene file's own `[meshing]` without.
    edge_m: Option<[f64; 2]>,
    /// Share of the uniform mesh's elements that is asked for.
    share: f64,
    /// What is left unshot; the default where light is so even that it would show.
    unshot_share: Option<f64>,
}

/// A case of a shipped scene.
macro_rules! case {
    ($name:literal, $edge_m:expr, $share:expr, $unshot:expr) => {
        Case {
            name: $name,
            text: include_str!(concat!("../../../scenes/", $name, "/scene.toml")),
            edge_m: $edge_m,
            share: $share,
            unshot_share: $unshot,
        }
    };
}

/// The two that a share is asked of, then every other shipped scene.
const CASES: [Case; 11] = [
    case!("cornell-box", Some([5.6 / 32.0, 5.6 / 8.0]), 0.4, Some(UNSHOT_SHARE)),
    case!("lit-cube", Some([1.0 / 32.0, 1.0 / 8.0]), 0.75, None),
    case!("point-room", None, 1.0, None),
    case!("sphere-room", None, 1.0, Some(UNSHOT_SHARE)),
    case!("mirror-glass", None, 1.0, Some(UNSHOT_SHARE)),
    case!("furnished-room", None, 1.0, Some(UNSHOT_SHARE)),
    case!("random-patches", None, 1.0, Some(UNSHOT_SHARE)),
    case!("imported", None, 1.0, Some(UNSHOT_SHARE)),
    case!("furnace", None, 1.0, None),
    case!("parallel-squares", None, 1.0, None),
    case!("corner-squares", None, 1.0, None),
];

/// One mesh of a case.
struct Measured {
    elements: u64,
    errors: Errors,
    /// Of the mesh alone.
    mesh_error: f64,
}

/// A case measured.
struct Outcome {
    uniform: Measured,
    /// In order of rising number of elements.
    ours: Vec<Measured>,
    /// Fewer elements than this have no pruning with the uniform mesh's error.
    best: f64,
}

impl Outcome {
    /// Least share of the uniform mesh's elements with an error that is no larger, by `error`.
    fn share(&self, error: impl Fn(&Measured) -> f64) -> Option<f64> {
        let enough = self.ours.iter().find(|m| error(m) <= error(&self.uniform).max(NO_ERROR))?;
        Some(enough.elements as f64 / self.uniform.elements as f64)
    }
}

fn measure(case: &Case, extent: Extent) -> Result<Outcome, ExperimentError> {
    let path = format!("scenes/{}/scene.toml", case.name);
    let scene = Scene::parse(case.text, Path::new(&path)).map_err(Box::new)?;
    let target =
        case.edge_m.map_or(scene.meshing.target, |e| MeshTarget::MaxElementM(extent.pick(e[0], e[1])));
    let plain = SolveOptions::default();
    let options = SolveOptions { unshot_share: case.unshot_share.unwrap_or(plain.unshot_share), ..plain };
    let reference = Reference::new(&scene, target, REFERENCE_SPLITS, &options)?;
    let flat = uniform(&scene, target, &options)?;
    let of = |meshed: &measure::Meshed| Measured {
        elements: meshed.mesh.elements.len() as u64,
        errors: reference.errors(meshed),
        mesh_error: reference.interpolation_error(&meshed.mesh),
    };
    let uniform = of(&flat);
    let n_patches = flat.mesh.patches.len() as u64;
    let mut ours = Vec::new();
    let allowed = uniform.errors.bilinear.max(NO_ERROR);
    let mut search = Search::new(uniform.mesh_error.max(NO_ERROR));
    while ours.len() < N_TRIES && !search.is_over() {
        let refine = RefineOptions { wanted_error: search.wanted(), ..RefineOptions::default() };
        let refined = adaptive(&scene, target, &options, &refine)?;
        let estimated = refined.refined.as_ref().map_or(0.0, |report| report.estimated_error);
        let meshed = of(&refined);
        let ratio = meshed.errors.bilinear / allowed;
        // A mesh larger than the uniform one is no answer: far coarser, whatever its error.
        let is_larger = ratio <= 1.0 && meshed.elements > uniform.elements;
        search.tell(if is_larger { ratio.min(0.4) } else { ratio }, estimated);
        let is_coarsest = meshed.elements == n_patches;
        ours.push(meshed);
        if is_coarsest && ratio <= 1.0 {
            break;
        }
    }
    ours.sort_by_key(|m| m.elements);
    let depth = 1 + RefineOptions::default().max_depth;
    let best = Quadtrees::new(&scene, target, depth, &reference).fewest(uniform.mesh_error.max(NO_ERROR));
    Ok(Outcome { uniform, ours, best })
}

fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let columns = [
        "scene",
        "uniform elements",
        "its L2 (%)",
        "ours, share of elements",
        "its mesh's L2 (%)",
        "our mesh, share",
        "any quadtree, share at least",
    ];
    let mut shares = Table::new("Elements for the uniform mesh's error", &columns);
    let columns = ["scene", "mesh", "elements", "bilinear L2 (%)", "constant (%)", "mesh alone (%)"];
    let mut errors = Table::new("Errors of each mesh", &columns);
    let mut panels = Vec::new();
    let (mut says, mut checks) = (Vec::new(), Vec::new());
    for case in CASES.iter().take(extent.pick(CASES.len(), 2)) {
        let outcome = measure(case, extent)?;
        let solved = outcome.share(|m| m.errors.bilinear);
        let meshed = outcome.share(|m| m.mesh_error);
        let best = outcome.best / outcome.uniform.elements as f64;
        let cell = |share: Option<f64>| share.map_or(Cell::None, Cell::Number);
        shares.push(vec![
            case.name.into(),
            outcome.uniform.elements.into(),
            (100.0 * outcome.uniform.errors.bilinear).into(),
            cell(solved),
            (100.0 * outcome.uniform.mesh_error).into(),
            cell(meshed),
            best.into(),
        ]);
        let mut add = |mesh: &str, m: &Measured| {
            errors.push(row![
                case.name,
                mesh,
                m.elements,
                100.0 * m.errors.bilinear,
                100.0 * m.errors.constant,
                100.0 * m.mesh_error
            ]);
        };
        add("uniform", &outcome.uniform);
        outcome.ours.iter().for_each(|m| add("refined", m));
        let mut panel = Panel::new(
            format!("{}: error of bilinear irradiance over elements", case.name),
            ("elements", Scale::Log),
            ("relative L2 (%)", Scale::Log),
        );
        let xy = |m: &Measured| (m.elements as f64, 100.0 * m.errors.bilinear);
        panel.series.push(Series::new("refined", Mark::Line, 0, outcome.ours.iter().map(xy)));
        panel.series.push(Series::new("uniform", Mark::Dots, 1, [xy(&outcome.uniform)]));
        panels.push(panel);
        let told = |share: Option<f64>| {
            share.map_or_else(
                || "no refined mesh that was tried".to_owned(),
                |s| format!("{s:.2} of its elements"),
            )
        };
        says.push(format!(
            "{}: the error of the uniform mesh of {} elements takes {} when solved, {} by the mesh alone; any quadtree at least \
             {best:.2}.",
            case.name,
            outcome.uniform.elements,
            told(solved),
            told(meshed),
        ));
        checks.push(Check::new(
            solved.is_some_and(|s| s <= extent.pick(case.share, 1.0)),
            format!(
                "{}: at most {:.2} of the elements for the same error",
                case.name,
                extent.pick(case.share, 1.0)
            ),
        ));
    }
    Ok(Findings {
        question: "How many elements does a refined mesh take for the error of a uniform one, and how many would the best \
                   quadtree take?"
            .to_owned(),
        method: format!(
            "Every scene is solved on its uniform mesh (2 x 2 elements a patch), on refined meshes of the same patches, and on a \
             reference with the same patches and 2 x 2 times the uniform mesh's elements. The error is the relative L2 of \
             bilinear irradiance: luminance, direct and indirect, over the mean of its surface, weighted by area, all surfaces; \
             the reference's element means stand for the values at their centres. Sources are patches in all meshes, so what \
             they get wrong is in none of these errors: they measure where irradiance is stored and what visibility was seen \
             there. Refined meshes: at most {N_TRIES} a scene; the wanted error is searched for the coarsest mesh that is no \
             worse than the uniform one, until one has an error of {:.0} to 100 % of its; errors under {} % count as none. All solves of a scene \
             leave the same share of the power unshot, the default, or {} % in cornell-box, sphere-room, mirror-glass, \
             furnished-room, random-patches and imported. The first mesh has one \
             element a patch, so for 2 x 2 elements a patch 0.25 is the least share there is. `Mesh alone`: the \
             reference's own values at the vertices. `Any quadtree`: no pruning of the full quadtrees under the patches \
             meets the uniform mesh's error of the mesh alone with fewer elements (Lagrangian bound; no balance, no \
             noise of visibility), so it is a bound for the mesh alone.",
            100.0 * search::GOOD_RATIO,
            100.0 * NO_ERROR,
            100.0 * UNSHOT_SHARE,
        ),
        tables: vec![shares, errors],
        panels,
        pictures: Vec::new(),
        says,
        checks,
    })
}
