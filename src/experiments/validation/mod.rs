//! Pass 1 against closed forms: view factors, furnaces, energy, the lit cube, CIE 171.
//!
//! ```text
//! cases (view_factors, geometry, enclosures, lit_cube, cie171) --solve small scenes (setting)--> ours
//!       formulas, lit-cube.csv -----------------------------------------------------------> expected
//!                                                            Row: error, bound --> tables of docs/validation.md, tests
//! convergence: the same at one, two and four times the elements an edge --> fitted rate
//! ```
//! Every row is solved as a user would: a scene's text, the software caster, form factors by `vertex`, default options but
//! for the unshot share, which is under the bounds. Nothing is renormalised.

use super::table::{Cell, Table, row};
use super::{Check, ExperimentError, Extent, Findings};
use row::{Group, Row};

mod cie171;
mod convergence;
mod enclosures;
pub(super) mod formulas;
mod geometry;
pub(super) mod lit_cube;
mod methods;
mod row;
mod setting;
#[cfg(test)]
mod tests;
mod view_factors;

/// Elements of a scene by default: `[meshing]` says nothing.
const ELEMENTS: u32 = 4000;

/// Elements of the scenes on which methods are compared: each has its own bound, whatever the mesh.
const METHODS_ELEMENTS: u32 = 1500;

/// The rows of a group at default meshing.
///
/// # Errors
/// None in software.
fn rows(group: Group) -> Result<Vec<Row>, ExperimentError> {
    match group {
        Group::ViewFactor => view_factors::cases().iter().map(|case| case.row(ELEMENTS)).collect(),
        Group::Kernel => Ok(geometry::kernel_rows()),
        Group::Area => geometry::area_rows(ELEMENTS),
        Group::Furnace => enclosures::furnace_rows(ELEMENTS),
        Group::Energy => enclosures::energy_rows(ELEMENTS),
        Group::LitCube => lit_cube::rows(lit_cube::ELEMENT_M),
        Group::Cie171 => cie171::rows(ELEMENTS),
        Group::Methods => methods::rows(METHODS_ELEMENTS),
    }
}

/// Runs the validation; `Quick` leaves the convergence out.
pub(super) fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let (mut tables, mut all) = (Vec::new(), Vec::new());
    for group in Group::ALL {
        let mut table = Table::new(group.title(), &COLUMNS);
        for row in rows(group)? {
            table.push(shown(&row));
            all.push(row);
        }
        tables.push(table);
    }
    let converged = match extent {
        Extent::Full => Some(convergence::run()?),
        Extent::Quick => None,
    };
    let mut checks: Vec<Check> = Group::ALL.iter().map(|group| check(*group, &all)).collect();
    let mut says = said(&all);
    let mut panels = vec![convergence::bounds_panel(&all)];
    if let Some(converged) = converged {
        tables.push(converged.table());
        says.extend(converged.says());
        checks.extend(converged.checks());
        panels.push(converged.panel());
    }
    Ok(Findings {
        question: "Is the diffuse solution right, where somebody can say what is right?".into(),
        method: format!(
            "Every case is a scene, solved by pass 1 with its default options (unshot power {:e} of the emitted), with the \
             software caster and form factors by rays from points of the shooter to points of the receivers (`vertex`). \
             View factors are measured by solving: a black emitter of exitance 1, F = power received / power emitted. \
             Scenes have {ELEMENTS} elements, as a scene file without `[meshing]` asks for, the lit cube those of its scene \
             file, {} m. The error is ours / formula - 1, or ours where \
             the formula says 0. Row sums and energy residuals are as they come: nothing is renormalised. Light through glass \
             has no row. A path tracer as a second solver: docs/path-tracing.md.",
            setting::UNSHOT_SHARE,
            lit_cube::ELEMENT_M,
        ),
        tables,
        panels,
        pictures: Vec::new(),
        says,
        checks,
    })
}

const COLUMNS: [&str; 7] = ["case", "formula", "by formula", "ours", "error %", "bound %", "holds"];

fn shown(r: &Row) -> Vec<Cell> {
    row![
        r.case.clone(),
        r.formula,
        Cell::Precise(r.expected),
        Cell::Precise(r.ours),
        100.0 * r.error(),
        100.0 * r.bound,
        if r.holds() { "yes" } else { "NO" },
    ]
}

/// All rows of a group hold; names those that do not.
fn check(group: Group, rows: &[Row]) -> Check {
    let of: Vec<&Row> = rows.iter().filter(|r| r.group == group).collect();
    let wrong: Vec<&str> = of.iter().filter(|r| !r.holds()).map(|r| r.case.as_str()).collect();
    let but = if wrong.is_empty() { String::new() } else { format!(", but not {}", wrong.join("; ")) };
    let what = format!("{}: {} rows are within their bounds{but}", group.title(), of.len() - wrong.len());
    Check::new(!of.is_empty() && wrong.is_empty(), what)
}

/// How many hold, and per group the case that comes nearest to its bound.
fn said(rows: &[Row]) -> Vec<String> {
    let n_holding = rows.iter().filter(|r| r.holds()).count();
    let mut says = vec![format!("{n_holding} of {} rows are within their bounds.", rows.len())];
    for group in Group::ALL {
        let used = |r: &Row| r.error().abs() / r.bound;
        let worst = rows.iter().filter(|r| r.group == group).max_by(|a, b| used(a).total_cmp(&used(b)));
        if let Some(r) = worst {
            says.push(format!(
                "{}: nearest to its bound is \"{}\", with {:.2}% of {}%.",
                group.title(),
                r.case,
                100.0 * r.error(),
                100.0 * r.bound
            ));
        }
    }
    says
}
