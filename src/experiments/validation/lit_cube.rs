//! The lit cube: a unit cube with a square lamp of exitance 1 flush in its ceiling, reflectance 0.5 and 0.8.
//!
//! ```text
//! scenes/lit-cube/scene.toml --solve, probe--> E at points  against  lit-cube.csv
//! ```
//! `lit-cube.csv` was computed apart from this project: 10,584 elements graded to edges and lamp, Lambert's polygon
//! formula, 60 Jacobi steps; its own energy residual is 0.04 % (rho 0.5) and 0.09 % (rho 0.8).

use super::formulas;
use super::row::{Group, Row};
use super::setting::{Answer, solve_text};
use crate::experiments::ExperimentError;
use crate::geom::DVec3;

const SCENE: &str = include_str!("../../../scenes/lit-cube/scene.toml");
const REFERENCE: &str = include_str!("lit-cube.csv");
/// Longest elements of the scene file (m).
pub const ELEMENT_M: f64 = 0.0625;
/// The formula of rows against the reference at single points.
pub const BY_REFERENCE: &str = "lit-cube.csv";
const WITHIN: f64 = 0.003;
const DIRECT_WITHIN: f64 = 0.002;

/// A value of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Reflectance of the walls.
    pub rho: f64,
    /// `floor`, `side` (x = 0) or `ceil`.
    pub wall: &'static str,
    /// Horizontal; on floor and ceiling along x.
    pub u: f64,
    /// Upwards; on floor and ceiling along y.
    pub v: f64,
    /// E/M from the lamp.
    pub direct: f64,
    /// E/M in all.
    pub total: f64,
}

impl Reference {
    /// Where it is, and the normal there.
    fn place(&self) -> (DVec3, DVec3) {
        let (u, v) = (self.u, self.v);
        match self.wall {
            "floor" => (DVec3::new(u, v, 0.0), DVec3::Z),
            "side" => (DVec3::new(0.0, u, v), DVec3::X),
            _ => (DVec3::new(u, v, 1.0), -DVec3::Z),
        }
    }
}

/// The reference's values, but for those on edges and inside the lamp.
pub fn reference() -> Vec<Reference> {
    let inner = |x: f64| x > 0.0 && x < 1.0;
    let lamp = |x: f64| (0.35..=0.65).contains(&x);
    let line = |line: &'static str| {
        let cells: Vec<&'static str> = line.split(',').collect();
        let number = |i: usize| cells.get(i).and_then(|c| c.parse().ok()).unwrap_or(f64::NAN);
        Reference {
            rho: number(0),
            wall: cells.get(1).copied().unwrap_or(""),
            u: number(2),
            v: number(3),
            direct: number(4),
            total: number(5),
        }
    };
    let all = REFERENCE.lines().skip(1).map(line);
    all.filter(|r| inner(r.u) && inner(r.v) && !(r.wall == "ceil" && lamp(r.u) && lamp(r.v))).collect()
}

/// The scene at a reflectance, elements of at most `element_m`.
///
/// # Errors
/// None in software.
pub fn solved(rho: f64, element_m: f64) -> Result<Answer, ExperimentError> {
    let text = SCENE.replace("reflectance = 0.5", &format!("reflectance = {rho:?}"));
    let text = text.replace("max_element_m = 0.0625", &format!("max_element_m = {element_m:?}"));
    solve_text(&text, None)
}

/// Rows at the scene's own mesh.
///
/// # Errors
/// None in software.
pub fn rows(element_m: f64) -> Result<Vec<Row>, ExperimentError> {
    let mut rows = Vec::new();
    let mut add = |case: String, formula, expected, ours, bound| {
        rows.push(Row { group: Group::LitCube, case, formula, expected, ours, bound });
    };
    let lamp = [0.35, 0.65];
    let direct = [
        ("floor (1/2, 1/2)", formulas::point_to_parallel([-0.15, 0.15], [-0.15, 0.15], 1.0)),
        // The lamp is 0.35 to 0.65 from the wall, and its height is measured along the wall's normal.
        ("wall (1/2, 1/2)", formulas::point_to_perpendicular([-0.15, 0.15], lamp, 0.5)),
        ("ceiling (1/8, 1/2)", 0.0),
    ];
    let points = [
        (DVec3::new(0.5, 0.5, 0.0), DVec3::Z),
        (DVec3::new(0.0, 0.5, 0.5), DVec3::X),
        (DVec3::new(0.125, 0.5, 1.0), -DVec3::Z),
    ];
    let reference = reference();
    for rho in [0.5, 0.8] {
        let mut answer = solved(rho, element_m)?;
        let e = answer.probe(&points)?;
        for ((e, (at, place)), (point, _)) in e.iter().zip(&direct).zip(&points) {
            let of = reference.iter().filter(|r| r.rho == rho && r.place().0.distance(*point) < 1e-9);
            let total = of.map(|r| r.total).next().unwrap_or(f64::NAN);
            if rho == 0.5 {
                add(
                    format!("{at}: direct E/M"),
                    "point to rectangle (Howell B-3, B-4)",
                    *place,
                    e.direct.0[1],
                    DIRECT_WITHIN,
                );
            }
            add(format!("{at}, rho {rho}: E/M"), BY_REFERENCE, total, e.total().0[1], WITHIN);
        }
        for (wall, name) in [("floor", "floor"), ("side", "wall"), ("ceil", "ceiling")] {
            let of: Vec<&Reference> = reference.iter().filter(|r| r.rho == rho && r.wall == wall).collect();
            let places: Vec<(DVec3, DVec3)> = of.iter().map(|r| r.place()).collect();
            let ratios = answer.probe(&places)?.into_iter().zip(&of).map(|(e, r)| e.total().0[1] / r.total);
            let ratios: Vec<f64> = ratios.collect();
            let n = ratios.len() as f64;
            let rms = (ratios.iter().map(|r| (r - 1.0).powi(2)).sum::<f64>() / n).sqrt();
            add(
                format!("{name}, rho {rho}: relative RMS error of {n} points"),
                "0: lit-cube.csv",
                0.0,
                rms,
                WITHIN,
            );
        }
        add(format!("rho {rho}: energy residual / emitted"), "0", 0.0, answer.residual_share(), 0.001);
    }
    Ok(rows)
}
