//! Closed rooms: furnaces, the integrating sphere, and where the power goes.
//!
//! ```text
//! rho, M constant: B = M / (1 - rho) everywhere      power P inside, rho everywhere: incident = P / (1 - rho)
//! point source in a sphere: indirect E = rho P / (4 pi R^2 (1 - rho)) everywhere on its wall
//! sphere whose wall shines, a port of the share f of it cut out: E = M (1 - f) / (1 - rho (1 - f)) everywhere
//! ```

use std::f64::consts::PI;

use super::row::{Group, Row};
use super::setting::{Answer, Setting, farthest};
use crate::experiments::ExperimentError;

/// Furnaces: reflectance and exitance of everything.
const RHO: f64 = 0.6;
const EXITANCE: f64 = 1.0;
/// Bounds of a furnace's radiosity and of its row sums.
const POLYGONAL: f64 = 0.002;
const CURVED: f64 = 0.005;
/// Bound of the worst row beside an inner corner: what a patch there sees changes across it, and by default each element
/// looks at it from one point.
const INNER_CORNER: f64 = 0.05;
/// Bound of the energy account of closed scenes.
const RESIDUAL: f64 = 0.001;

/// An L of two rooms whose long walls are not cut where the short ones end: T-junctions.
fn l_shape() -> Setting {
    let v = |x: f64, y: f64, z: f64| [x, y, z];
    let wall = |(x0, y0): (f64, f64), (x1, y1): (f64, f64)| {
        [v(x0, y0, 0.0), v(x0, y0, 1.0), v(x1, y1, 1.0), v(x1, y1, 0.0)]
    };
    let level = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64, up: bool| match up {
        true => [v(x0, y0, z), v(x1, y0, z), v(x1, y1, z), v(x0, y1, z)],
        false => [v(x0, y0, z), v(x0, y1, z), v(x1, y1, z), v(x1, y0, z)],
    };
    let corners = [(0.0, 0.0), (2.3, 0.0), (2.3, 1.0), (1.1, 1.0), (1.1, 2.0), (0.0, 2.0)];
    let mut setting = furnace();
    for k in 0..corners.len() {
        setting = setting.quad(&format!("wall {k}"), "grey", wall(corners[k], corners[(k + 1) % 6]));
    }
    for (name, z, up) in [("floor", 0.0, true), ("ceiling", 1.0, false)] {
        setting = setting.quad(&format!("{name} a"), "grey", level([0.0, 2.3], [0.0, 1.0], z, up)).quad(
            &format!("{name} b"),
            "grey",
            level([0.0, 1.1], [1.0, 2.0], z, up),
        );
    }
    setting
}

fn furnace() -> Setting {
    Setting::default().material("grey", RHO, EXITANCE)
}

/// Furnaces: radiosity and row sums.
///
/// # Errors
/// None in software.
pub fn furnace_rows(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let sphere = "sphere = { center = [0, 0, 0], radius = 1.5, inward = true }";
    let ball = "sphere = { center = [0.9, 1.1, 1.0], radius = 0.5 }";
    let cases = [
        ("box 2 x 3 x 2.5", POLYGONAL, furnace().room("grey", [0.0; 3], [2.0, 3.0, 2.5])),
        ("sphere", CURVED, furnace().surface("sphere", "grey", sphere)),
        (
            "sphere in a box",
            CURVED,
            furnace().room("grey", [0.0; 3], [2.0, 2.2, 2.4]).surface("ball", "grey", ball),
        ),
        ("L-shaped room with T-junctions", POLYGONAL, l_shape()),
    ];
    let expected = EXITANCE / (1.0 - RHO);
    let mut rows = Vec::new();
    for (name, bound, setting) in cases {
        let answer = setting.solve(elements)?;
        let of_elements = answer.solution.element_irradiance.iter().map(|e| EXITANCE + RHO * e.total().0[1]);
        let mut add = |what: &str, formula, expected, ours, bound| {
            let case = format!("{name}: {what}");
            rows.push(Row { group: Group::Furnace, case, formula, expected, ours, bound });
        };
        let closed = "M / (1 - rho), rho = 0.6";
        add("B, worst mean of a surface", closed, expected, answer.worst_radiosity(expected), bound);
        add("B, worst element", closed, expected, farthest(of_elements, expected), 5.0 * bound);
        let error = answer.solution.row_sum_error;
        add("row_sum_error, mean", "0: rows of a closed room sum to 1", 0.0, error.mean, bound);
        let largest = if name.contains("L-shaped") { INNER_CORNER } else { 5.0 * bound };
        add("row_sum_error, largest", "0: rows of a closed room sum to 1", 0.0, error.max, largest);
        add("energy residual / emitted", "0", 0.0, answer.residual_share(), RESIDUAL);
    }
    Ok(rows)
}

/// Power inside rooms that reflect: sums, and the integrating sphere.
///
/// # Errors
/// None in software.
pub fn energy_rows(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let mut rows = Vec::new();
    let mut add = |case: &str, formula, expected: f64, ours: f64, bound| {
        rows.push(Row { group: Group::Energy, case: case.to_owned(), formula, expected, ours, bound });
    };
    let total = "incident in all = P / (1 - rho)";
    let point = "kind = \"point\"\nposition = [1.3, 0.7, 1.9]\nintensity = 10.0";
    let lit = |rho: f64| Setting::default().material("grey", rho, 0.0);
    let power = 4.0 * PI * 10.0;

    let answer = lit(0.5).room("grey", [0.0; 3], [2.0, 3.0, 2.5]).light(point).solve(elements)?;
    add(
        "box 2 x 3 x 2.5, point source, rho 0.5: incident W",
        total,
        power / 0.5,
        answer.incident_w(""),
        0.002,
    );
    add("box, point source: residual / emitted", "0", 0.0, answer.residual_share(), RESIDUAL);

    let lamp =
        "quad = [[0.8, 1.2, 2.0], [0.8, 1.8, 2.0], [1.2, 1.8, 2.0], [1.2, 1.2, 2.0]]\ntwo_sided = true";
    let answer = lit(0.5)
        .material("lamp", 0.5, 10.0)
        .room("grey", [0.0; 3], [2.0, 3.0, 2.5])
        .surface("lamp", "lamp", lamp)
        .solve(elements)?;
    let power = 2.0 * 0.24 * 10.0;
    add("box, two-sided lamp inside, rho 0.5: incident W", total, power / 0.5, answer.incident_w(""), 0.002);
    add("box, two-sided lamp inside: residual / emitted", "0", 0.0, answer.residual_share(), RESIDUAL);

    let rho = 0.8;
    let answer = integrating_sphere(rho).solve(elements)?;
    let power = 4.0 * PI * 10.0;
    let wall_m2 = 4.0 * PI;
    let indirect = rho * power / (wall_m2 * (1.0 - rho));
    let e = answer.solution.element_irradiance.iter().map(|e| e.indirect.0[1]);
    let uniform = "rho P / (4 pi R^2 (1 - rho)), uniform";
    let mean = answer.mean_indirect();
    add(
        "integrating sphere, rho 0.8, source off its centre: indirect E, mean",
        uniform,
        indirect,
        mean,
        0.005,
    );
    add("integrating sphere: indirect E, worst element", uniform, indirect, farthest(e, indirect), 0.01);
    add("integrating sphere: residual / emitted", "0", 0.0, answer.residual_share(), RESIDUAL);

    let rho = 0.9;
    let f = port_share();
    let per_wall = 1.0 - rho * (1.0 - f);
    let of_port = "M (1 - f) / (1 - rho (1 - f)), f = 0.038 of the sphere";
    for (port, hole) in [("black", false), ("open", true)] {
        // Its facets are small already.
        let answer = sphere_with_port(rho, hole).solve(elements / 4)?;
        let case = |what: &str| format!("integrating sphere, rho 0.9, {port} port: {what}");
        let mean = |name: &str| answer.incident_w(name) / answer.area_m2(name);
        let expected = (1.0 - f) / per_wall;
        add(&case("E of the wall, mean"), of_port, expected, mean("wall"), 0.005);
        if !hole {
            add(&case("E of the port, mean"), of_port, expected, mean("port"), 0.005);
        }
        let out_w = if hole { answer.solution.account.lost_w.0[1] } else { answer.incident_w("port") };
        // What leaves is measured by 64 rays a shooter, of which two or three find the hole.
        let bound = if hole { 0.05 } else { 0.005 };
        let out = out_w / answer.emitted_w();
        add(&case("power out / emitted"), "f / (1 - rho (1 - f))", f / per_wall, out, bound);
        add(
            &case("residual / emitted"),
            "0",
            0.0,
            answer.residual_share(),
            0.001_f64.max(bound * f / per_wall),
        );
    }
    Ok(rows)
}

/// Rows and columns of facets of the sphere with a port, and how many of the rows, from a pole on, are the port.
const SPHERE_ROWS: u32 = 16;
const SPHERE_AROUND: u32 = 32;
const PORT_ROWS: u32 = 2;

/// The port's share of the sphere.
fn port_share() -> f64 {
    0.5 * (1.0 - (PI * f64::from(PORT_ROWS) / f64::from(SPHERE_ROWS)).cos())
}

/// A sphere of facets that looks inwards, its wall of exitance 1; its port is black, or a hole.
fn sphere_with_port(rho: f64, hole: bool) -> Setting {
    let point = |row: u32, column: u32| {
        let (sin, cos) = (PI * f64::from(row) / f64::from(SPHERE_ROWS)).sin_cos();
        let (east, north) =
            (2.0 * PI * f64::from(column % SPHERE_AROUND) / f64::from(SPHERE_AROUND)).sin_cos();
        [sin * north, sin * east, cos]
    };
    let mut setting = Setting::default().material("wall", rho, 1.0).material("black", 0.0, 0.0);
    for (row, column) in (0..SPHERE_ROWS).flat_map(|row| (0..SPHERE_AROUND).map(move |column| (row, column)))
    {
        let is_port = row < PORT_ROWS;
        if is_port && hole {
            continue;
        }
        let (name, material) = if is_port { ("port", "black") } else { ("wall", "wall") };
        let name = format!("{name} {row} {column}");
        let [a, b] = [point(row, column), point(row, column + 1)];
        let [c, d] = [point(row + 1, column + 1), point(row + 1, column)];
        setting = match row {
            0 => setting.surface(&name, material, &format!("triangle = {:?}", [a, c, d])),
            _ if row + 1 == SPHERE_ROWS => {
                setting.surface(&name, material, &format!("triangle = {:?}", [a, b, c]))
            }
            _ => setting.quad(&name, material, [a, b, c, d]),
        };
    }
    setting
}

fn integrating_sphere(rho: f64) -> Setting {
    Setting::default()
        .material("grey", rho, 0.0)
        .surface("sphere", "grey", "sphere = { center = [0, 0, 0], radius = 1.0, inward = true }")
        .light("kind = \"point\"\nposition = [0.3, 0.2, -0.4]\nintensity = 10.0")
}

impl Answer {
    /// Mean of the indirect irradiance (W/m^2).
    fn mean_indirect(&self) -> f64 {
        let e = self.mesh.elements.iter().zip(&self.solution.element_irradiance);
        e.map(|(element, e)| element.area_m2 * e.indirect.0[1]).sum::<f64>() / self.mesh.total_area_m2()
    }
}
