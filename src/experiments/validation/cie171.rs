//! Analytic test cases of CIE 171:2006 that a diffuse solver covers.
//!
//! ```text
//! case --formula--> reference   scene of that case --solve, probe--> ours
//! ```
//! References are computed from the formulas that the report names, never taken from its tables: its printed table 19
//! (case 5.7) is known to be wrong (Ashdown, CIE 171:2006 errata, Lighting Analysts). What is measured against is therefore
//! the physics of each case; lengths are ours where they are not given here.

use super::formulas;
use super::row::{Group, Row};
use super::setting::Setting;
use crate::experiments::ExperimentError;
use crate::geom::DVec3;
use crate::units::LUMENS_PER_WATT;

const WITHIN: f64 = 0.002;

fn row(case: String, formula: &'static str, expected: f64, ours: f64, bound: f64) -> Row {
    Row { group: Group::Cie171, case, formula, expected, ours, bound }
}

/// All cases.
///
/// # Errors
/// None in software.
pub fn rows(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let mut rows = point_source(elements)?;
    rows.extend(area_source(elements)?);
    rows.extend(conservation(elements)?);
    rows.extend(diffuse_reflection(elements, None)?);
    rows.extend(diffuse_reflection(elements, Some(0.2))?);
    rows.extend(cube(elements)?);
    Ok(rows)
}

/// 5.2: an isotropic source of 1000 cd at 3 m over the middle of a black floor 4 x 4.
fn point_source(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let setting = Setting::default().material("black", 0.0, 0.0).room("black", [0.0; 3], [4.0, 4.0, 3.2]);
    let light = "kind = \"point\"\nposition = [2, 2, 3]\nintensity_cd = 1000.0";
    let mut answer = setting.light(light).solve(elements)?;
    let xs = [2.0, 3.0, 3.75];
    let points = xs.map(|x| (DVec3::new(x, 2.0, 0.0), DVec3::Z));
    let e = answer.probe(&points)?;
    let rows = xs.iter().zip(e).map(|(x, e)| {
        let r2: f64 = (x - 2.0) * (x - 2.0) + 9.0;
        let case = format!("5.2 point source 1000 cd: floor at {} m from below it (lx)", x - 2.0);
        row(case, "I cos / d^2", 1000.0 * 3.0 / r2.powf(1.5), e.total().0[1] * LUMENS_PER_WATT, WITHIN)
    });
    Ok(rows.collect())
}

/// 5.3: a diffuse source 1 x 1 in the ceiling of a black room 4 x 4 x 3.
fn area_source(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let mut answer = ceiling_source(elements, [1.5, 2.5])?;
    let floor = [(2.0, 2.0), (1.0, 2.0), (0.25, 0.25)];
    let wall = [0.5, 1.5, 2.5];
    let points: Vec<(DVec3, DVec3)> = floor
        .iter()
        .map(|&(x, y)| (DVec3::new(x, y, 0.0), DVec3::Z))
        .chain(wall.iter().map(|&z| (DVec3::new(0.0, 1.75, z), DVec3::X)))
        .collect();
    let e = answer.probe(&points)?;
    let mut rows = Vec::new();
    for (&(x, y), e) in floor.iter().zip(&e) {
        let f = formulas::point_to_parallel([1.5 - x, 2.5 - x], [1.5 - y, 2.5 - y], 3.0);
        rows.push(row(
            format!("5.3 area source: floor at ({x}, {y}): E/M"),
            "point to parallel rectangle (Howell B-3)",
            f,
            e.total().0[1],
            WITHIN,
        ));
    }
    for (&z, e) in wall.iter().zip(&e[floor.len()..]) {
        let f = formulas::point_to_perpendicular([1.5 - 1.75, 2.5 - 1.75], [1.5, 2.5], 3.0 - z);
        rows.push(row(
            format!("5.3 area source: wall, {z} m high: E/M"),
            "point to perpendicular rectangle (Howell B-4)",
            f,
            e.total().0[1],
            WITHIN,
        ));
    }
    Ok(rows)
}

/// A black room 4 x 4 x 3 with a source of exitance 1 over a square of its ceiling; what is left of it is cut around.
fn ceiling_source(elements: u32, hole: [f64; 2]) -> Result<super::setting::Answer, ExperimentError> {
    let mut setting = Setting::default().material("black", 0.0, 0.0).material("lamp", 0.0, 1.0);
    let down = |x: [f64; 2], y: [f64; 2]| {
        [[x[0], y[0], 3.0], [x[0], y[1], 3.0], [x[1], y[1], 3.0], [x[1], y[0], 3.0]]
    };
    let cuts = [[0.0, hole[0]], hole, [hole[1], 4.0]];
    for (i, x) in cuts.into_iter().enumerate() {
        for (j, y) in cuts.into_iter().enumerate() {
            let material = if (i, j) == (1, 1) { "lamp" } else { "black" };
            setting = setting.quad(&format!("roof {i}{j}"), material, down(x, y));
        }
    }
    let room = setting.room_without_ceiling("black", [0.0; 3], [4.0, 4.0, 3.0]);
    room.solve(elements)
}

/// 5.4: what enters through an opening arrives.
fn conservation(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let mut rows = Vec::new();
    for hole in [[1.5, 2.5], [0.5, 3.5]] {
        let answer = ceiling_source(elements, hole)?;
        let side = hole[1] - hole[0];
        let case = format!("5.4 flux through an opening {side} x {side}: arriving W / entering W");
        rows.push(row(case, "1", 1.0, answer.incident_w("") / (side * side), 0.001));
    }
    Ok(rows)
}

/// 5.6: a wall 1 x 1, lit evenly by parallel light, lights points of a floor and of a wall opposite; 5.7: over a board of
/// height `board` that stands 1 m before it, wide enough to hide all below.
fn diffuse_reflection(elements: u32, board: Option<f64>) -> Result<Vec<Row>, ExperimentError> {
    let (rho, facing) = (0.8, 10.0);
    let mut setting = Setting::default().material("white", rho, 0.0).material("black", 0.0, 0.0).quad(
        "wall",
        "white",
        [[0.0, -0.5, 0.0], [0.0, 0.5, 0.0], [0.0, 0.5, 1.0], [0.0, -0.5, 1.0]],
    );
    // Steep light, which passes behind the board.
    setting = setting.light("kind = \"directional\"\ndirection = [-0.6, 0.0, -0.8]\nirradiance = 10.0");
    if let Some(height) = board {
        let quad = [[1.0, -0.6, 0.0], [1.0, 0.6, 0.0], [1.0, 0.6, height], [1.0, -0.6, height]];
        setting = setting.surface("board", "black", &format!("quad = {quad:?}\ntwo_sided = true"));
    }
    let mut answer = setting.solve(elements)?;
    let exitance = rho * facing * 0.6;
    let distances = [1.5, 2.0, 3.0];
    let floor = distances.map(|d| (DVec3::new(d, 0.0, 0.0), DVec3::Z));
    let opposite = distances.map(|d| (DVec3::new(d, 0.2, 0.3), -DVec3::X));
    let e = answer.probe(&[floor, opposite].concat())?;
    // Height on the wall that the board's edge hides from a point.
    let hidden = |d: f64, z: f64| board.map_or(0.0, |h| (z + (h - z) * d / (d - 1.0)).clamp(0.0, 1.0));
    let name = if board.is_some() { "5.7 diffuse reflection over a board" } else { "5.6 diffuse reflection" };
    let mut rows = Vec::new();
    for (&d, e) in distances.iter().zip(&e) {
        let f = formulas::point_to_perpendicular([-0.5, 0.5], [hidden(d, 0.0), 1.0], d);
        let case = format!("{name}: floor at {d} m: E / (rho E_wall)");
        rows.push(row(
            case,
            "point to the visible rectangle (Howell B-4)",
            f,
            e.indirect.0[1] / exitance,
            WITHIN,
        ));
    }
    for (&d, e) in distances.iter().zip(&e[distances.len()..]) {
        let f = formulas::point_to_parallel([-0.7, 0.3], [hidden(d, 0.3) - 0.3, 0.7], d);
        let case = format!("{name}: opposite at {d} m: E / (rho E_wall)");
        rows.push(row(
            case,
            "point to the visible rectangle (Howell B-3)",
            f,
            e.indirect.0[1] / exitance,
            WITHIN,
        ));
    }
    Ok(rows)
}

/// 5.8: 10 klm in a cube of 4 m, a reflectance a channel.
fn cube(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let mut rows = Vec::new();
    let intensity = 10_000.0 / (4.0 * std::f64::consts::PI);
    let light = format!("kind = \"point\"\nposition = [2, 2, 2]\nintensity_cd = {intensity:?}");
    for rhos in [[0.0, 0.2, 0.5], [0.8, 0.9, 0.95]] {
        let setting = Setting::default().coloured("grey", rhos).room("grey", [0.0; 3], [4.0; 3]);
        let answer = setting.light(&light).solve(elements)?;
        for (channel, rho) in rhos.into_iter().enumerate() {
            let incident_w: f64 = answer.surfaces.iter().map(|s| s.incident_w.0[channel]).sum();
            let mean = incident_w / answer.area_m2("") * LUMENS_PER_WATT;
            let case =
                format!("5.8 diffuse interreflection, 10 klm in a cube of 4 m, rho {rho}: mean E (lx)");
            rows.push(row(case, "P / (A (1 - rho))", 10_000.0 / (96.0 * (1.0 - rho)), mean, WITHIN));
        }
    }
    Ok(rows)
}
