//! Illuminance on a measuring grid of a solved scene.
//!
//! ```text
//! Scene::load -> Mesh::build -> Grid -> caster -> radiosity::solve -> hidden points? -> probe -> GridProbed
//! ```

use super::*;
use crate::photometry::{Grid, GridError, GridSpec, hidden_behind};
use crate::report::si::vector;

/// What a grid measures, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct GridOptions {
    /// The grid.
    pub spec: GridSpec,
    /// Leave out points inside or behind surfaces; without, the first one is an error.
    pub skip_hidden: bool,
    /// The values that pass 1 stored, instead of light integrated at the points.
    pub interpolated: bool,
}

/// Irradiance on a grid.
#[derive(Debug)]
pub struct GridProbed {
    /// The grid.
    pub grid: Grid,
    /// One value a point, in the order of the points; `None` for those that are hidden.
    pub values: Vec<Option<Irradiance>>,
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// Name of the caster.
    pub caster: &'static str,
    /// Wall times.
    pub timings: Timings,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Irradiance on a grid of a solved scene.
///
/// # Errors
/// As [`probe_scene`]; a grid that cannot be; points inside or behind surfaces, unless they are skipped.
pub fn probe_grid(
    path: &Path,
    options: &FrameOptions,
    wanted: &GridOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<GridProbed, FrameError> {
    let mut timings = Timings::default();
    let (mut scene, mesh) = load_and_mesh(path, options.elements, options.adaptive, &mut timings)?;
    let grid = Grid::new(&wanted.spec, &scene, &mesh)?;
    let points = grid.probe_points();
    let mut starts: Vec<DVec3> = points.iter().map(|p| p.at).collect();
    let reach_m = reach_m(&options.caster, &scene, &mesh, &starts);
    starts.extend(points.iter().map(|p| p.at + reach_m * p.normal));
    let mut caster = timings.measure("caster", || make_caster(&options.caster, &scene, &mesh, &starts))?;
    let hidden = hidden_behind(&mesh, caster.port(), &points, reach_m)?;
    let n_hidden = hidden.iter().flatten().count();
    let first = hidden.iter().zip(&points).find_map(|(surface, point)| Some(((*surface)?, point)));
    if let Some((surface, point)) = first
        && (!wanted.skip_hidden || n_hidden == points.len())
    {
        let surface = scene.surfaces[surface.0 as usize].name.clone();
        return Err(GridPointsHidden { at: point.at, surface, n_hidden, n: points.len() }.into());
    }
    warn_of_lights(&mut scene, &mesh, &mut caster);
    let passed = pass_1_refined(&scene, mesh, caster.port(), &options.pass_1, &mut timings, progress)?;
    let Passed { mesh, solution, .. } = passed;
    let shown = points.iter().zip(&hidden).filter(|(_, hidden)| hidden.is_none());
    let shown: Vec<ProbePoint> = shown.map(|(point, _)| *point).collect();
    let mut values = timings.measure("probe", || -> Result<_, FrameError> {
        let values = if wanted.interpolated {
            stored_irradiance(&scene, &mesh, &solution, caster.port(), &shown, reach_m)?
        } else {
            let progress = &mut |share| progress(Progress::Probe(share));
            let parts = radiosity::probe_many(&scene, &mesh, &solution, caster.port(), &shown, progress)?;
            parts.iter().map(|e| Irradiance(e.total())).collect()
        };
        Ok(values.into_iter())
    })?;
    let values = hidden.iter().map(|hidden| if hidden.is_some() { None } else { values.next() }).collect();
    let mut warnings = scene.warnings.clone();
    warnings.extend(warnings::open_account(&solution.account));
    if n_hidden > 0 {
        warnings.push(format!(
            "{n_hidden} of {} grid points lie inside or behind surfaces and are left out",
            points.len()
        ));
    }
    Ok(GridProbed { grid, values, caster: caster.name(), scene, mesh, timings, warnings })
}

/// Points of a grid where nobody can measure.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{n_hidden} of {n} grid points lie inside or behind surfaces, the first at {} behind '{surface}': is the normal \
     turned round? (--skip-hidden leaves such points out)",
    vector((*at * 1e6).round() / 1e6)
)]
pub struct GridPointsHidden {
    /// The first (m).
    pub at: DVec3,
    /// What hides it.
    pub surface: String,
    /// How many are hidden.
    pub n_hidden: usize,
    /// Points of the grid.
    pub n: usize,
}

/// A grid that cannot be measured on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(transparent)]
pub enum GridFault {
    /// It has no points.
    Grid(#[from] GridError),
    /// Its points are hidden.
    Hidden(#[from] GridPointsHidden),
}

impl From<GridError> for FrameError {
    fn from(error: GridError) -> FrameError {
        FrameError::Grid(Box::new(error.into()))
    }
}

impl From<GridPointsHidden> for FrameError {
    fn from(error: GridPointsHidden) -> FrameError {
        FrameError::Grid(Box::new(error.into()))
    }
}
