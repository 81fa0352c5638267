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
#[cfg(test)]
mod tests;

use measure::{Errors, Quadtrees, Reference, adaptive, found_in, uniform};

/// The experiment; it is about the host, not the board, so `all` leaves it out.
pub const EXPERIMENT: Experiment =
    Experiment { name: "adaptive", title: "Adaptive meshing against uniform meshes", run };

/// Wanted errors that are tried, over the error of the uniform mesh.
const WANTED: [f64; 5] = [2.0, 1.4, 1.0, 0.7, 0.5];
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
}

const CASES: [Case; 6] = [
    Case {
        name: "cornell-box",
        text: include_str!("../../../scenes/cornell-box/scene.toml"),
        edge_m: Some([5.6 / 32.0, 5.6 / 8.0]),
        share: 0.4,
    },
    Case {
        name: "lit-cube",
        text: include_str!("../../../scenes/lit-cube/scene.toml"),
        edge_m: Some([1.0 / 32.0, 1.0 / 8.0]),
        share: 0.75,
    },
    Case {
        name: "point-room",
        text: include_str!("../../../scenes/point-room/scene.toml"),
        edge_m: None,
        share: 1.0,
    },
    Case {
        name: "sphere-room",
        text: include_str!("../../../scenes/sphere-room/scene.toml"),
        edge_m: None,
        share: 1.0,
    },
    Case {
        name: "mirror-glass",
        text: include_str!("../../../scenes/mirror-glass/scene.toml"),
        edge_m: None,
        share: 1.0,
    },
    Case {
        name: "furnished-room",
        text: include_str!("../../../scenes/furnished-room/scene.toml"),
        edge_m: None,
        share: 1.0,
    },
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
    /// Fewest elements of any pruning with the uniform mesh's error.
    best: u64,
}

impl Outcome {
    /// Least share of the uniform mesh's elements with an error that is no larger, by `error`.
    fn share(&self, error: impl Fn(&Measured) -> f64) -> Option<f64> {
        let enough = self.ours.iter().find(|m| error(m) <= error(&self.uniform))?;
        Some(enough.elements as f64 / self.uniform.elements as f64)
    }
}

fn measure(case: &Case, extent: Extent) -> Result<Outcome, ExperimentError> {
    let path = format!("scenes/{}/scene.toml", case.name);
    let scene = Scene::parse(case.text, Path::new(&path)).map_err(Box::new)?;
    let target =
        case.edge_m.map_or(scene.meshing.target, |e| MeshTarget::MaxElementM(extent.pick(e[0], e[1])));
    let options = SolveOptions::default();
    let mut reference = Reference::new(&scene, target, REFERENCE_SPLITS, &options)?;
    let flat = uniform(&scene, target, &options)?;
    let patches = found_in(&flat.mesh, &reference.samples)?;
    let of = |meshed: &measure::Meshed, reference: &mut Reference| -> Result<Measured, ExperimentError> {
        Ok(Measured {
            elements: meshed.mesh.elements.len() as u64,
            errors: reference.errors(meshed, &patches),
            mesh_error: reference.interpolation_error(&meshed.mesh, &patches)?,
        })
    };
    let uniform = of(&flat, &mut reference)?;
    let mut ours = Vec::new();
    for share in WANTED {
        let refine = RefineOptions { wanted_error: share * uniform.mesh_error, ..RefineOptions::default() };
        ours.push(of(&adaptive(&scene, target, &options, &refine)?, &mut reference)?);
    }
    ours.sort_by_key(|m| m.elements);
    let depth = 1 + RefineOptions::default().max_depth;
    let (best, _) = Quadtrees::new(&scene, target, depth, &mut reference)?.fewest(uniform.mesh_error);
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
        "best quadtree, share",
    ];
    let mut shares = Table::new("Elements for the uniform mesh's error", &columns);
    let columns =
        ["scene", "mesh", "elements", "bilinear L2 (%)", "constant (%)", "Hermite (%)", "mesh alone (%)"];
    let mut errors = Table::new("Errors of each mesh", &columns);
    let mut panels = Vec::new();
    let (mut says, mut checks) = (Vec::new(), Vec::new());
    for case in CASES.iter().take(extent.pick(CASES.len(), 2)) {
        let outcome = measure(case, extent)?;
        let solved = outcome.share(|m| m.errors.bilinear);
        let meshed = outcome.share(|m| m.mesh_error);
        let best = outcome.best as f64 / outcome.uniform.elements as f64;
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
                100.0 * m.errors.hermite,
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
            "{}: the error of the uniform mesh of {} elements takes {} when solved, {} by the mesh alone; the best quadtree {best:.2}.",
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
        method: "Relative L2 error of bilinear irradiance (luminance over the mean of its surface, weighted by area, all \
                 surfaces) against a reference with the same patches and 2 x 2 times the elements. Refined meshes to several \
                 wanted errors; the first that is no worse than the uniform mesh counts. `mesh alone`: the reference's own \
                 values at the vertices; the best quadtree is the optimal pruning of the full trees by that error, without \
                 balance."
            .to_owned(),
        tables: vec![shares, errors],
        panels,
        pictures: Vec::new(),
        says,
        checks,
    })
}
