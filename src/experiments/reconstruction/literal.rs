//! What a gradient rule returns for a linear field, over the field's scale: the finding on the 1992 paper's rule.
//!
//! ```text
//! f = k x on a regular grid --rule--> gradient at an inner vertex, over k
//! lit cube, all values times a factor --rule--> relative L2 error
//! ```

use std::path::Path;

use super::measure::{Case, Way, way};
use crate::experiments::ExperimentError;
use crate::experiments::table::{Cell, Table};
use crate::mesh::{Mesh, SurfacePoint};
use crate::reconstruct::{GradientRule, Method, ReconstructOptions, Reconstruction};
use crate::scene::Scene;
use crate::units::Rgb;

/// Slopes of the linear field (W/m^2 a metre).
const SLOPES: [f64; 7] = [1e-3, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0];
/// Factors on the lit cube's irradiance, whose lamp has an exitance of 1 W/m^2.
const FACTORS: [f64; 5] = [0.01, 1.0, 100.0, 1e4, 1e6];

/// The rules, and their names.
const RULES: [(&str, GradientRule); 4] = [
    ("seed-edge-normals", GradientRule::SeedEdgeNormals),
    ("facet-normals", GradientRule::FacetNormals),
    ("least-squares", GradientRule::LeastSquares),
    ("zero", GradientRule::Zero),
];

/// One slope: what each rule returns of it, as a share, in the order of [`RULES`].
#[derive(Clone, Debug, PartialEq)]
pub struct Returned {
    /// Slope of the field (W/m^2 a metre).
    pub slope: f64,
    /// Shares.
    pub shares: [f64; 4],
}

/// The unit square in 8 x 8 elements.
const SQUARE: &str = "version = 1\n[materials.m]\nreflectance = 0.5\n[meshing]\nmax_element_m = 0.125\n[[surface]]\n\
    name = \"s\"\nmaterial = \"m\"\nquad = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n";

/// The linear field at every slope.
///
/// # Errors
/// None: the square is a scene.
pub fn returned() -> Result<Vec<Returned>, ExperimentError> {
    let scene = Scene::parse(SQUARE, Path::new("square")).map_err(Box::new)?;
    let mesh = Mesh::build(&scene);
    let inner = |at: &SurfacePoint| {
        let x = mesh.position(*at);
        (0.3..0.7).contains(&x.x) && (0.3..0.7).contains(&x.y)
    };
    let corners = (0..mesh.elements.len() as u32)
        .map(|e| SurfacePoint { element: crate::mesh::ElementId(e), st: crate::geom::DVec2::ZERO });
    let at = corners.into_iter().find(inner);
    let at = at.ok_or_else(|| ExperimentError::Scene("a square without an inner vertex".to_owned()))?;
    let of = |slope: f64| {
        let values: Vec<Rgb> =
            mesh.vertices.iter().map(|v| Rgb::splat(slope * (2.0 + v.position.x))).collect();
        let share = |(_, gradients): (&str, GradientRule)| {
            let options = ReconstructOptions { gradients, ..Method::Hermite.into() };
            let field = Reconstruction::new(&mesh, options, &values, &[]);
            field.gradient(&mesh, at)[0].luminance() / slope
        };
        Returned { slope, shares: RULES.map(share) }
    };
    Ok(SLOPES.into_iter().map(of).collect())
}

/// [`returned`] as a table.
pub fn returned_table(rows: &[Returned]) -> Table {
    let columns = ["slope (W/m^2 a metre)", "seed-edge-normals", "facet-normals", "least-squares", "zero"];
    let mut table = Table::new("Share of the true gradient that a rule returns on a regular grid", &columns);
    for r in rows {
        let shares = r.shares.iter().map(|s| Cell::Number(*s));
        table.push(std::iter::once(Cell::Number(r.slope)).chain(shares).collect());
    }
    table
}

/// A factor on the values: relative L2 error of each way of [`scaled_ways`].
#[derive(Clone, Debug, PartialEq)]
pub struct Scaled {
    /// The factor.
    pub factor: f64,
    /// Relative L2 errors.
    pub l2: [f64; 3],
}

/// What [`Scaled`] compares.
pub fn scaled_ways() -> [Way; 3] {
    [way(super::measure::LITERAL), way("hermite facet-normals"), way(super::measure::HERMITE)]
}

/// The errors on a case, all of its values and the reference times each factor.
pub fn scaled(case: &Case) -> Vec<Scaled> {
    let of = |factor| Scaled { factor, l2: scaled_ways().map(|way| case.scaled_l2(&way, factor)) };
    FACTORS.into_iter().map(of).collect()
}

/// [`scaled`] as a table.
pub fn scaled_table(rows: &[Scaled]) -> Table {
    let columns = [
        "exitance of the lamp (W/m^2)",
        "seed-edge-normals L2 (%)",
        "facet-normals (%)",
        "least-squares (%)",
    ];
    let mut table = Table::new("lit-cube at 8 x 8, brighter and darker", &columns);
    for r in rows {
        let errors = r.l2.iter().map(|e| Cell::Number(100.0 * e));
        table.push(std::iter::once(Cell::Number(r.factor)).chain(errors).collect());
    }
    table
}
