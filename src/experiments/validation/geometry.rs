//! Areas of curved surfaces at default meshing, and the kernel by itself.

use std::f64::consts::{PI, TAU};

use super::formulas;
use super::row::{Group, Row};
use super::setting::Setting;
use crate::experiments::ExperimentError;
use crate::geom::DVec3;
use crate::radiosity::kernel::point_to_polygon;

/// Areas of sphere, disk and cylinder.
///
/// # Errors
/// None in software.
pub fn area_rows(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let answer = Setting::default()
        .material("black", 0.0, 0.0)
        .surface("sphere", "black", "sphere = { center = [3, 0, 0], radius = 0.7 }")
        .surface("tube", "black", "cylinder = { base = [0, 0, 0], top = [0.3, 0.4, 1.2], radius = 0.5 }")
        .surface("disk", "black", "disk = { center = [0, 0, 0], normal = [-0.3, -0.4, -1.2], radius = 0.5 }")
        .solve(elements)?;
    let cases = [
        ("sphere", "4 pi r^2", 4.0 * PI * 0.49),
        ("tube", "2 pi r h (it meets disks)", TAU * 0.5 * 1.3),
        ("disk", "pi r^2", PI * 0.25),
    ];
    let row = |(name, formula, expected): (&str, &'static str, f64)| Row {
        group: Group::Area,
        case: format!("{name}: sum of its elements (m^2)"),
        formula,
        expected,
        ours: answer.area_m2(name),
        bound: 0.001,
    };
    Ok(cases.into_iter().map(row).collect())
}

/// The kernel at single points.
pub fn kernel_rows() -> Vec<Row> {
    let v = DVec3::new;
    let row = |case: &str, formula, expected, ours| Row {
        group: Group::Kernel,
        case: case.to_owned(),
        formula,
        expected,
        ours,
        bound: 1e-9,
    };
    let over = [v(0., 0., 1.), v(0., 2., 1.), v(3., 2., 1.), v(3., 0., 1.)];
    let disk: Vec<DVec3> =
        (0..400).map(|k| k as f64 / 400.0 * TAU).map(|a| v(0.6 * a.sin(), 0.6 * a.cos(), 0.8)).collect();
    let wall = [v(-1., 0.4, 0.), v(1.5, 0.4, 0.), v(1.5, 0.4, 2.), v(-1., 0.4, 2.)];
    vec![
        row(
            "point to a parallel rectangle 3 x 2 over its corner",
            "Howell B-3",
            formulas::point_to_parallel([0.0, 3.0], [0.0, 2.0], 1.0),
            point_to_polygon(DVec3::ZERO, DVec3::Z, &over),
        ),
        row(
            "point to a perpendicular rectangle 2.5 x 2 at 0.4",
            "Howell B-4",
            formulas::point_to_perpendicular([-1.0, 1.5], [0.0, 2.0], 0.4),
            point_to_polygon(DVec3::ZERO, DVec3::Z, &wall),
        ),
        Row {
            bound: 1e-4,
            ..row(
                "point to a parallel disk of radius 0.6 at 0.8, as a polygon of 400",
                "r^2 / (r^2 + h^2) (Howell B-12)",
                formulas::point_to_disk(0.6, 0.8),
                point_to_polygon(DVec3::ZERO, DVec3::Z, &disk),
            )
        },
    ]
}
