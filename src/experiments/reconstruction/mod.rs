//! Reconstruction without Mach bands: every method and gradient rule against references, the 1992 paper's figures 6 and 7.
//!
//! ```text
//! scenes.rs: meshes, references (lit_cube.rs, shadows.rs, nested.rs) --measure.rs--> Run: Metrics a method
//!   --tables.rs--> tables, plots     --targets.rs--> what they say, what must hold
//! literal.rs: what the paper's tangent rule returns     pictures.rs: irradiance and its second differences as pictures
//! ```
//! All methods get the reference's own values at the vertices: errors are those of interpolation alone.
//!
//! Source: Bastos, Baranoski, Sousa, Ferreira 1992.
//! Not modelled: errors of pass 1 itself (docs/validation.md), adaptive meshes (docs/adaptive.md).

use super::{Experiment, ExperimentError, Extent, Findings};

pub mod lit_cube;
mod literal;
pub mod measure;
pub mod nested;
pub mod pictures;
pub mod scenes;
pub mod shadows;
mod tables;
mod targets;
#[cfg(test)]
mod tests;

use lit_cube::{Light, LitCube};
use measure::{BILINEAR, Case, HERMITE, LIMITED, LITERAL, way};
use pictures::View;
use scenes::{CUBE_PARTS, PENUMBRA, POINT_SHADOW, Run, STATED, ShadowScene};

/// The experiment; it is about the host, not the board, so `all` leaves it out.
pub const EXPERIMENT: Experiment =
    Experiment { name: "reconstruction", title: "Reconstruction without Mach bands", run };

/// Reflectance of the lit cube's walls.
const RHO: f64 = 0.5;
/// Elements of the shadow scenes' pictures (m).
const SHADOW_ELEMENT_M: f64 = 0.25;

fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let cube = LitCube::new(RHO);
    let cube_runs = scenes::cube_runs(&cube, extent)?;
    let shadow_runs = [POINT_SHADOW.runs(extent)?, PENUMBRA.runs(extent)?];
    let dense_runs = scenes::dense_runs(extent)?;
    let graded_ways = [way(BILINEAR), way(HERMITE)];
    let graded = scenes::graded(&cube, extent.pick(&[8, 16], &[8, 16]), &graded_ways)?;
    let stated_case = scenes::cube_case(&cube, STATED, 1.0, Light::Total)?;
    let returned = literal::returned()?;
    let scaled = literal::scaled(&stated_case);
    let mut pictures = Vec::new();
    let mut shown = Vec::new();
    let side = extent.pick(320, 192);
    let mut show = |(rows, of): (Vec<Vec<super::Picture>>, Vec<pictures::Shown>)| {
        pictures.extend(rows);
        shown.extend(of);
    };
    show(cube_pictures(&cube, &stated_case, side, extent)?);
    for scene in [POINT_SHADOW, PENUMBRA] {
        show(shadow_pictures(scene, side, extent)?);
    }

    let all: Vec<&Run> = cube_runs.iter().collect();
    let even: Vec<&Run> = cube_runs.iter().filter(|r| !r.graded).collect();
    let stated = stated(&cube_runs)?;
    let mut tables = vec![
        tables::by_part("lit-cube at 8 x 8 elements a wall", stated),
        tables::over_meshes("lit-cube, L2 (%)", &all, |m| 100.0 * m.l2),
        tables::over_meshes("lit-cube, H1 (%)", &all, |m| 100.0 * m.h1),
        tables::over_meshes("lit-cube, band (1/m)", &all, |m| m.band),
        tables::by_method("lit-cube at 8 x 8, all three walls, and time", &[stated]),
        tables::graded_table(&graded, &CUBE_PARTS.map(|p| p.0)),
        literal::returned_table(&returned),
        literal::scaled_table(&scaled),
    ];
    for runs in &shadow_runs {
        tables.push(tables::by_method(runs[0].scene, &runs.iter().collect::<Vec<_>>()));
    }
    for runs in dense_runs.chunk_by(|a, b| a.scene == b.scene) {
        tables.push(tables::by_method(runs[0].scene, &runs.iter().collect::<Vec<_>>()));
    }
    tables.push(tables::shown_table(&shown));

    let mut checks = targets::cube_checks(stated);
    checks.push(targets::limiter_check(limited_on(&stated_case)));
    checks.extend(targets::graded_checks(&graded));
    let without_lines = |run: &&Run| !run.mesh.ends_with(scenes::LINES);
    checks.extend(shadow_runs[0].iter().filter(without_lines).map(targets::overshoot_check));
    checks.push(targets::literal_check(&returned));

    let mut says = targets::cube_says(stated);
    says.extend(targets::order_says(&even));
    says.extend(targets::graded_says(&graded, &CUBE_PARTS.map(|p| p.0)));
    says.extend(targets::literal_says(&returned, &scaled));
    says.extend(shadow_runs.iter().flatten().chain(&dense_runs).map(targets::scene_says));
    says.extend(targets::shown_says(&shown));
    let panels = vec![
        tables::panel("lit-cube: L2 error, even meshes", "relative L2 (%)", &even, |m| 100.0 * m.l2),
        tables::panel("lit-cube: gradient error, even meshes", "relative H1 (%)", &even, |m| 100.0 * m.h1),
        tables::panel("lit-cube: Mach bands, even meshes", "band (1/m)", &even, |m| m.band),
    ];
    Ok(Findings {
        question: "How near do ways of interpolating irradiance between vertices come to it, and which of them show the mesh?"
            .to_owned(),
        method: format!("{METHOD} {}", extent.pick(FULL, QUICK)),
        tables,
        panels,
        pictures,
        says,
        checks,
    })
}

const METHOD: &str = "Every method gets the reference's own values at the vertices, so errors are those of interpolation alone. \
    Metrics are of luminance over the mean of its part of the scene, in world units, at 16 points an element and 4 points an edge: \
    L2, Linf; H1, the relative L2 error of the gradient; jump, the largest break of slope over a C1 edge times the element's width; \
    band, the RMS over C1 edges of the second difference at an eighth of the element's width, over that distance, less the \
    reference's; overshoot beyond the reference's range in the element and those around it; the share of the area that is negative; \
    energy drift. References: lit-cube by integrating Lambert's formula over a converged solution graded to the edges; point-shadow \
    and penumbra by closed forms of their direct light; cornell-box and sphere-room by solving with every element split again, \
    whose visibility is cast by rays and has their noise. Times are wall time of one thread and differ from run to run; all else is \
    the same on every run. Meshes with lines: edges that stand for the computed lines of the shadow are C-1 under a point light, \
    and a vertex has a value on either side, C0 at the borders of a penumbra. Where such an edge lies beside the line, values of \
    one side reach over to the other, in every method, and count as overshoot.";

const FULL: &str =
    "Elements of the Cornell box's dense solutions are split thrice, those of sphere-room's twice.";
const QUICK: &str = "A quick run: few meshes, elements of the dense solution split once, no sphere-room.";

/// The even run at the density at which the targets are stated.
fn stated(runs: &[Run]) -> Result<&Run, ExperimentError> {
    let found = runs.iter().find(|r| !r.graded && r.element_m == 1.0 / f64::from(STATED));
    found.ok_or_else(|| ExperimentError::Scene(format!("no lit-cube at {STATED} elements a wall was run")))
}

/// Vertices of the lit cube's floor and side walls that `hermite-limited` limits, ceiling flattened to make that all there are.
fn limited_on(case: &Case) -> usize {
    let mut values = case.values.clone();
    let ceiling = |e: &crate::mesh::Element| e.normal.z < -0.5;
    for element in case.mesh.elements.iter().filter(|e| ceiling(e)) {
        element.corners.vertices().iter().for_each(|v| values[v.0 as usize] = crate::units::Rgb::WHITE);
    }
    let options = way(LIMITED).options;
    crate::reconstruct::Reconstruction::new(&case.mesh, options, &values, case.element_means())
        .limited_vertices()
}

type Shown = (Vec<Vec<super::Picture>>, Vec<pictures::Shown>);

fn cube_pictures(cube: &LitCube, case: &Case, side: u32, extent: Extent) -> Result<Shown, ExperimentError> {
    let scene = scenes::cube_scene(STATED, 1.0)?;
    let dense = scenes::cube_scene(extent.pick(64, 24), 1.0)?;
    let (mesh, values) = scenes::dense_values(&dense, &cube.light(Light::Total));
    let ways = [BILINEAR, LITERAL, HERMITE].map(way);
    pictures::pictures(View { name: "lit-cube", side }, &scene, case, &ways, (&mesh, &values))
}

fn shadow_pictures(of: ShadowScene, side: u32, extent: Extent) -> Result<Shown, ExperimentError> {
    let (scene, _) = of.scene(SHADOW_ELEMENT_M, 1.0)?;
    let case = of.case(SHADOW_ELEMENT_M, 1.0, false)?;
    let (dense, shadow) = of.scene(SHADOW_ELEMENT_M / extent.pick(16.0, 4.0), 1.0)?;
    let (mesh, values) = scenes::dense_values(&dense, &shadow);
    let ways = [BILINEAR, HERMITE, LIMITED].map(way);
    pictures::pictures(View { name: of.name, side }, &scene, &case, &ways, (&mesh, &values))
}
