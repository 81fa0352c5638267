//! Every row of the validation table, and the formulas themselves.

use super::formulas::*;
use super::*;
use crate::geom::DVec3;

/// Every row of a group holds; prints those that do not.
fn assert_holds(group: Group, least: usize) {
    let rows = rows(group).expect("software");
    let wrong: Vec<String> = rows
        .iter()
        .filter(|r| !r.holds())
        .map(|r| {
            format!("{}: {}, {} by formula, error {:.4}%", r.case, r.ours, r.expected, 100.0 * r.error())
        })
        .collect();
    assert!(rows.len() >= least && wrong.is_empty(), "{} rows, wrong: {wrong:#?}", rows.len());
}

#[test]
fn view_factors_by_solving_are_the_closed_forms() {
    assert_holds(Group::ViewFactor, 11);
}

#[test]
fn kernel_and_areas_are_the_closed_forms() {
    assert_holds(Group::Kernel, 2);
    assert_holds(Group::Area, 3);
}

#[test]
fn furnaces_have_one_radiosity_everywhere() {
    assert_holds(Group::Furnace, 20);
}

#[test]
fn power_in_closed_rooms_is_accounted_for() {
    assert_holds(Group::Energy, 7);
}

#[test]
fn lit_cube_is_the_reference() {
    assert_holds(Group::LitCube, 17);
}

#[test]
fn cie_171_cases_are_their_formulas() {
    assert_holds(Group::Cie171, 28);
}

#[test]
fn hemisphere_and_vertex_agree_within_the_stated_error() {
    assert_holds(Group::Methods, 4);
}

/// cargo test --release --lib validation -- --ignored
#[test]
#[ignore = "a minute: fine meshes"]
fn errors_fall_with_the_mesh() {
    let converged = convergence::run().expect("software");
    assert!(converged.checks().iter().all(|c| c.holds), "{}", converged.table().text());
}

#[test]
fn row_with_a_nan_or_past_its_bound_fails() {
    let row =
        |ours| Row { group: Group::Area, case: String::new(), formula: "", expected: 2.0, ours, bound: 0.01 };
    assert!(row(2.019).holds() && !row(2.021).holds() && !row(f64::NAN).holds());
    let zero = Row { expected: 0.0, ..row(0.009) };
    assert!(zero.holds() && (zero.error() - 0.009).abs() < 1e-15);
}

#[test]
fn rectangle_formulas_are_the_tabulated_values() {
    let unit = [0.0, 1.0];
    assert!((parallel_rectangles([unit; 2], [unit; 2], 1.0) - 0.199_824_895_7).abs() < 1e-10);
    assert!((perpendicular_rectangles([unit; 2], [unit; 2]) - 0.200_043_776_1).abs() < 1e-10);
    assert!((point_to_parallel(unit, unit, 1.0) - 0.138_531_606_0).abs() < 1e-10);
    assert!((point_to_perpendicular(unit, unit, 1.0) - 0.055_734_197_0).abs() < 1e-10);
    assert!((coaxial_disks(1.0, 1.0, 1.0) - 0.381_966_011_3).abs() < 1e-10);
}

#[test]
fn rectangle_formulas_in_general_position_are_means_of_those_of_points() {
    let (a, b) = ([[0.2, 1.3], [0.1, 0.8]], [[1.5, 2.1], [-0.4, 0.6]]);
    let mean = mean_over(a[0], a[1], 200, |x, y| {
        point_to_parallel([b[0][0] - x, b[0][1] - x], [b[1][0] - y, b[1][1] - y], 0.7)
    });
    assert!((parallel_rectangles(a, b, 0.7) / mean - 1.0).abs() < 1e-5);
    let (z, y) = ([0.3, 1.1], [-0.4, 0.6]);
    let mean = mean_over(a[0], a[1], 200, |px, py| point_to_perpendicular([y[0] - py, y[1] - py], z, px));
    assert!((perpendicular_rectangles(a, [z, y]) / mean - 1.0).abs() < 1e-5);
}

#[test]
fn sphere_to_rectangle_is_the_flux_of_a_point_source_through_it() {
    // E of a sphere of power 1 at distance r is that of a point of intensity 1 / (4 pi).
    let (a, b, d) = (1.5, 1.0, 0.7);
    let mean = mean_over([0.0, a], [0.0, b], 400, |x, y| d / (x * x + y * y + d * d).powf(1.5));
    let flux = mean * a * b / (4.0 * std::f64::consts::PI);
    assert!((sphere_to_rectangle(a, b, d) / flux - 1.0).abs() < 1e-5);
}

#[test]
fn visible_polygon_behind_a_board_that_hides_half_is_half() {
    let square = |z: f64, r: f64| [(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| DVec3::new(x, y, z));
    let (below, far) = (DVec3::new(0.0, 0.0, 1.0), square(0.0, 0.5));
    let whole = visible_polygon(below, -DVec3::Z, &far, &square(0.5, 1e-9));
    assert!((whole - 4.0 * point_to_parallel([0.0, 0.5], [0.0, 0.5], 1.0)).abs() < 1e-9);
    let half = [(0.0, -9.0), (9.0, -9.0), (9.0, 9.0), (0.0, 9.0)].map(|(x, y)| DVec3::new(x, y, 0.5));
    assert!((visible_polygon(below, -DVec3::Z, &far, &half) - 0.5 * whole).abs() < 1e-12);
    assert!(visible_polygon(below, -DVec3::Z, &far, &square(0.5, 0.25 + 1e-12)).abs() < 1e-9);
}
