//! How errors fall with the mesh: one, two and four times the elements along an edge, and the fitted rate.
//!
//! ```text
//! |error| at h, h/2, h/4 --least squares of log |error| against log h--> rate: |error| ~ h^rate
//! ```
//! Errors under [`ROUNDING`] are rounding of stored form factors (f32) and unshot power, not of the mesh: from the coarsest mesh
//! to the first that is there, the rate is at least so much; without one where that says little.

use super::lit_cube;
use super::row::Row;
use super::view_factors;
use crate::experiments::plot::{Mark, Panel, Scale, Series};
use crate::experiments::table::{Cell, Table};
use crate::experiments::{Check, ExperimentError};

/// Elements of the scenes of view factors: twice as many along an edge from one to the next.
const ELEMENTS: [u32; 3] = [250, 1000, 4000];
/// Fewest patches around curved surfaces, so that they get finer in all directions; by default the 48 of the middle one.
const FACETS: [u32; 3] = [24, 48, 96];
/// Longest elements of the lit cube (m).
const LIT_CUBE_M: [f64; 3] = [0.125, 0.0625, 0.031_25];
/// Errors that the mesh has no part in.
const ROUNDING: f64 = 2e-6;
/// Least rate where errors stand clear of rounding and of visibility rays.
const LEAST_RATE: f64 = 1.5;

/// What is left of an error when the mesh is fine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Limit {
    /// Nothing: it falls on.
    Mesh,
    /// Few visibility rays.
    Rays,
    /// The error of the reference.
    Reference,
}

/// A case at three meshes.
#[derive(Clone, Debug)]
pub struct Line {
    case: String,
    bound: f64,
    errors: [f64; 3],
    limit: Limit,
    curved: bool,
}

/// A fitted rate, or a bound of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// The exponent of h.
    exponent: f64,
    /// It is at least so much: the finer errors are rounding.
    is_bound: bool,
}

impl Line {
    /// The rate; `None` when errors are rounding before they show it.
    pub fn rate(&self) -> Option<Rate> {
        let first_rounding = self.errors.iter().position(|e| e.abs() <= ROUNDING);
        let finest = first_rounding.unwrap_or(2);
        let fall = (self.errors[0].abs() / self.errors[finest].abs().max(ROUNDING)).log2();
        let rate = Rate { exponent: fall / finest as f64, is_bound: first_rounding.is_some() };
        (finest > 0 && (!rate.is_bound || rate.exponent >= LEAST_RATE)).then_some(rate)
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{:.1}", if self.is_bound { "at least " } else { "" }, self.exponent)
    }
}

/// All cases at three meshes.
#[derive(Clone, Debug)]
pub struct Converged {
    lines: Vec<Line>,
}

/// Solves them.
///
/// # Errors
/// None in software.
pub fn run() -> Result<Converged, ExperimentError> {
    let mut lines = Vec::new();
    for case in view_factors::cases() {
        let n = case.fineness();
        let rows = |k: usize| case.row_with_facets(n * n * ELEMENTS[k], n * FACETS[k]);
        let limit = if case.is_sampled() { Limit::Rays } else { Limit::Mesh };
        lines.push(Line { curved: case.is_curved(), ..line(&[&rows(0)?, &rows(1)?, &rows(2)?], limit) });
    }
    let cubes =
        [lit_cube::rows(LIT_CUBE_M[0])?, lit_cube::rows(LIT_CUBE_M[1])?, lit_cube::rows(LIT_CUBE_M[2])?];
    for (i, row) in cubes[2].iter().enumerate() {
        if row.formula == lit_cube::BY_REFERENCE {
            lines.push(line(&[&cubes[0][i], &cubes[1][i], row], Limit::Reference));
        }
    }
    Ok(Converged { lines })
}

fn line(rows: &[&Row; 3], limit: Limit) -> Line {
    let Row { case, bound, .. } = rows[0];
    Line { case: case.clone(), bound: *bound, errors: rows.map(Row::error), limit, curved: false }
}

impl Converged {
    /// Errors and rates.
    pub fn table(&self) -> Table {
        let mut table = Table::new(
            "Convergence",
            &["case", "error % at h", "at h/2", "at h/4", "rate: error ~ h^rate", "bound %"],
        );
        for line in &self.lines {
            let [a, b, c] = line.errors.map(|e| Cell::Number(100.0 * e));
            let rate = match (line.rate(), line.limit) {
                (_, Limit::Rays) => Cell::Text("visibility rays".to_owned()),
                (None, _) => Cell::Text("rounding".to_owned()),
                (Some(rate), _) => Cell::Text(rate.to_string()),
            };
            table.push(vec![line.case.clone().into(), a, b, c, rate, Cell::Number(100.0 * line.bound)]);
        }
        table
    }

    fn rates(&self) -> impl Iterator<Item = (&Line, Rate)> {
        self.lines.iter().filter(|l| l.limit == Limit::Mesh).filter_map(|l| l.rate().map(|r| (l, r)))
    }

    /// The least rate.
    pub fn says(&self) -> Vec<String> {
        let least = self.rates().min_by(|a, b| a.1.exponent.total_cmp(&b.1.exponent));
        least
            .map(|(line, rate)| {
                format!(
                    "Where the mesh decides the error it falls at least as h^{:.1} ({}). The lit cube's reference has \
                     errors of 0.04 to 0.09 % itself, at which its rows level off.",
                    rate.exponent, line.case
                )
            })
            .into_iter()
            .collect()
    }

    /// What must hold.
    pub fn checks(&self) -> Vec<Check> {
        let worst = self.rates().map(|(_, rate)| rate.exponent).fold(f64::INFINITY, f64::min);
        let n_curved = self.lines.iter().filter(|l| l.curved).count();
        let n_curved_rates = self.rates().filter(|(line, _)| line.curved).count();
        let falls = |l: &Line| l.errors[2].abs() <= l.errors[0].abs().max(ROUNDING).max(0.1 * l.bound);
        vec![
            Check::new(
                worst >= LEAST_RATE,
                format!("errors of view factors fall at least as h^{LEAST_RATE}"),
            ),
            Check::new(
                n_curved == n_curved_rates && n_curved > 0,
                format!("{n_curved_rates} of {n_curved} cases with curved surfaces have a rate"),
            ),
            Check::new(
                self.lines.iter().all(falls),
                "no case is worse on the finest mesh than on the coarsest",
            ),
        ]
    }

    /// |error| against h.
    pub fn panel(&self) -> Panel {
        let x = Scale::Names(["h", "h/2", "h/4"].map(str::to_owned).to_vec());
        let mut panel =
            Panel::new("Errors against the mesh", ("element size", x), ("|error| (%)", Scale::Log));
        for (i, (line, _)) in self.rates().enumerate() {
            let points = (0..3).map(|k| (k as f64, 100.0 * line.errors[k].abs().max(1e-9)));
            panel.series.push(Series::new(
                line.case.chars().take(40).collect::<String>(),
                Mark::Line,
                i,
                points,
            ));
        }
        panel
    }
}

/// Every row's |error| as a share of its bound.
pub fn bounds_panel(rows: &[Row]) -> Panel {
    let y = Scale::Linear { from_zero: true };
    let mut panel = Panel::new(
        "Every row: |error| / bound, 1 is the limit",
        ("row of the tables below", Scale::Linear { from_zero: true }),
        ("|error| / bound", y),
    );
    for (colour, group) in super::Group::ALL.into_iter().enumerate() {
        let of = rows.iter().enumerate().filter(|(_, r)| r.group == group);
        let points = of.map(|(i, r)| (1.0 + i as f64, r.error().abs() / r.bound));
        panel.series.push(Series::new(group.title(), Mark::Dots, colour, points));
    }
    panel
}
