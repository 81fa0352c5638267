//! A measuring grid: its report, its table, its rows as CSV.
//!
//! ```text
//! frame::GridProbed --> GridReport (JSON radeng/probe-grid/1) --> table and summary for the terminal, CSV
//! ```

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

use super::si::vector;
use super::terminal::{line, scene_line, time_line};
use super::{SceneFacts, Timings};
use crate::frame::GridProbed;
use crate::image::false_colour::{ColourMap, Quantity, Scale, ScaleKind};
use crate::photometry::{GridPlace, GridSpec, GridSummary};
use crate::units::Rgb;

/// Most points that the terminal lists one by one.
const LISTED: usize = 256;

/// `probe` of a grid: `--json` and `--report`.
#[derive(Clone, Debug, Serialize)]
pub struct GridReport {
    /// [`GridReport::SCHEMA`].
    pub schema: &'static str,
    /// The scene.
    pub scene: SceneFacts,
    /// Which caster answered the rays.
    pub caster: &'static str,
    /// True when the values are those stored on the mesh, not integrated at the points.
    pub interpolated: bool,
    /// The grid.
    pub grid: GridFacts,
    /// Mean, extremes, uniformities.
    pub summary: Option<GridSummary>,
    /// The points, row by row, u fastest.
    pub points: Vec<GridPointReport>,
    /// The picture.
    pub picture: Option<ScaledPicture>,
    /// Wall times.
    pub timings: Timings,
    /// Warnings, as shown.
    pub warnings: Vec<String>,
}

/// Where a grid lies and how fine it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GridFacts {
    /// The surface; none for a plane.
    pub surface: Option<String>,
    /// The plane's corner (m) and edges (m); none for a surface.
    pub corner_and_edges_m: Option<[DVec3; 3]>,
    /// Width of the border that is left out (m).
    pub border_m: f64,
    /// How far the points are lifted off (m).
    pub height_m: f64,
    /// Lengths of the area (m), the border left out.
    pub size_m: [f64; 2],
    /// Points along u and v.
    pub n: [u32; 2],
    /// Lengths of a cell (m).
    pub cell_m: [f64; 2],
    /// The numbers of points are those of EN 12464-1, not given.
    pub n_by_en_12464_1: bool,
    /// Widest cell by EN 12464-1 (m).
    pub en_12464_1_spacing_m: f64,
}

/// One point of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GridPointReport {
    /// Column and row, from 1.
    pub uv: [u32; 2],
    /// Where (m).
    pub at: DVec3,
    /// Unit normal of the receiver.
    pub normal: DVec3,
    /// Irradiance (W/m^2); none inside or behind surfaces.
    pub irradiance_w_m2: Option<Rgb>,
    /// Illuminance (lx); none inside or behind surfaces.
    pub illuminance_lx: Option<f64>,
}

/// A false-colour picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScaledPicture {
    /// Where.
    pub path: PathBuf,
    /// What it shows.
    pub quantity: &'static str,
    /// Unit of the scale.
    pub unit: &'static str,
    /// Its scale.
    pub scale: Scale,
    /// Its colours.
    pub colour_map: ColourMap,
}

impl ScaledPicture {
    /// A picture of `quantity` in the file `path`.
    pub fn new(path: &Path, quantity: Quantity, scale: Scale, colour_map: ColourMap) -> ScaledPicture {
        let (quantity, unit) = (quantity.name(), quantity.unit());
        ScaledPicture { path: path.to_owned(), quantity, unit, scale, colour_map }
    }
}

impl GridReport {
    /// Its schema.
    pub const SCHEMA: &'static str = "radeng/probe-grid/1";

    /// The report of a grid.
    pub fn new(
        probed: GridProbed,
        spec: &GridSpec,
        interpolated: bool,
        picture: Option<ScaledPicture>,
    ) -> GridReport {
        let GridProbed { grid, values, scene, mesh, caster, timings, warnings } = probed;
        let (surface, corner_and_edges_m) = match &spec.place {
            GridPlace::Surface(name) => (Some(name.clone()), None),
            GridPlace::Plane { corner, edge_u, edge_v } => (None, Some([*corner, *edge_u, *edge_v])),
        };
        let points = grid.points.iter().zip(&values).enumerate().map(|(k, (point, value))| GridPointReport {
            uv: [k as u32 % grid.n[0] + 1, k as u32 / grid.n[0] + 1],
            at: point.at,
            normal: point.normal,
            irradiance_w_m2: value.map(|e| e.0),
            illuminance_lx: value.map(|e| e.illuminance_lx()),
        });
        GridReport {
            schema: GridReport::SCHEMA,
            scene: SceneFacts::new(&scene, &mesh),
            caster,
            interpolated,
            points: points.collect(),
            summary: GridSummary::new(
                values.iter().zip(&grid.points).map(|(value, point)| (*value, point.area_m2)),
            ),
            grid: GridFacts {
                surface,
                corner_and_edges_m,
                border_m: spec.border_m,
                height_m: spec.height_m,
                size_m: grid.size_m,
                n: grid.n,
                cell_m: grid.cell_m(),
                n_by_en_12464_1: spec.n.is_none(),
                en_12464_1_spacing_m: grid.en_spacing_m,
            },
            picture,
            timings,
            warnings,
        }
    }

    /// The points as CSV, units in the header; no numbers for those inside or behind surfaces.
    pub fn csv(&self) -> String {
        let mut out = "u,v,x_m,y_m,z_m,normal_x,normal_y,normal_z,irradiance_r_w_m2,irradiance_g_w_m2,\
                       irradiance_b_w_m2,illuminance_lx\n"
            .to_owned();
        for p in &self.points {
            let (at, normal) = (p.at, p.normal);
            let place = format!("{},{},{},{},{}", p.uv[0], p.uv[1], at.x, at.y, at.z);
            let normal = format!("{},{},{}", normal.x, normal.y, normal.z);
            let value = match p.irradiance_w_m2.zip(p.illuminance_lx) {
                Some((Rgb([r, g, b]), lx)) => format!("{r},{g},{b},{lx}"),
                None => ",,,".to_owned(),
            };
            let _ = writeln!(out, "{place},{normal},{value}");
        }
        out
    }
}

/// What `probe` of a grid prints.
pub fn grid_text(r: &GridReport) -> String {
    let mut out = String::new();
    scene_line(&mut out, &r.scene);
    grid_lines(&mut out, &r.grid);
    if r.points.len() <= LISTED {
        point_table(&mut out, r);
    } else {
        let n = r.points.len();
        line(&mut out, "points", format_args!("{n}, too many to list: --csv FILE or --json has them"));
    }
    if let Some(summary) = &r.summary {
        summary_lines(&mut out, r, summary);
    }
    if let Some(picture) = &r.picture {
        line(&mut out, "picture", picture_text(picture));
    }
    time_line(&mut out, &r.timings);
    out
}

/// A false-colour picture's file and scale.
pub fn picture_text(p: &ScaledPicture) -> String {
    let kind = match p.scale.kind {
        ScaleKind::Linear => "linear",
        ScaleKind::Log => "logarithmic",
    };
    let auto = if p.scale.auto { " (auto)" } else { "" };
    let Scale { lo, hi, .. } = p.scale;
    format!("{}  {} in false colour, {lo} to {hi} {}, {kind}{auto}", p.path.display(), p.quantity, p.unit)
}

fn grid_lines(out: &mut String, g: &GridFacts) {
    let place = match (&g.surface, g.corner_and_edges_m) {
        (Some(name), _) => format!("on '{name}'"),
        (None, Some([corner, u, v])) => {
            format!("from {} m along {} m and {} m", vector(corner), vector(u), vector(v))
        }
        (None, None) => String::new(),
    };
    let lifted = if g.height_m > 0.0 { format!(", {} m over it", g.height_m) } else { String::new() };
    let border =
        if g.border_m > 0.0 { format!(", without a border of {} m", g.border_m) } else { String::new() };
    line(out, "grid", format_args!("{place}{lifted}{border}"));
    let by = if g.n_by_en_12464_1 { "by" } else { "given;" };
    line(
        out,
        "",
        format_args!(
            "{} x {} points, cells of {:.3} m x {:.3} m ({by} EN 12464-1: p = {:.3} m)",
            g.n[0], g.n[1], g.cell_m[0], g.cell_m[1], g.en_12464_1_spacing_m
        ),
    );
}

fn point_table(out: &mut String, r: &GridReport) {
    let _ = writeln!(
        out,
        "\n{:>4} {:>4}  {:>28}  {:>33}  {:>16}",
        "u", "v", "at (m)", "irradiance r g b (W/m^2)", "illuminance (lx)"
    );
    for p in &r.points {
        let at = format!("{:.4} {:.4} {:.4}", p.at.x, p.at.y, p.at.z);
        let _ = write!(out, "{:>4} {:>4}  {at:>28}  ", p.uv[0], p.uv[1]);
        let _ = match p.irradiance_w_m2.zip(p.illuminance_lx) {
            Some((Rgb([r, g, b]), lx)) => writeln!(out, "{r:>11.4e}{g:>11.4e}{b:>11.4e}  {lx:>16.2}"),
            None => writeln!(out, "{:>33}  {:>16}", "inside or behind a surface", "-"),
        };
    }
    out.push('\n');
}

fn summary_lines(out: &mut String, r: &GridReport, s: &GridSummary) {
    let at = |k: usize| r.points.get(k).map(|p| vector_m(p.at)).unwrap_or_default();
    let Rgb([red, green, blue]) = s.mean_irradiance_w_m2;
    line(out, "E_mean", format_args!("{:.2} lx   {red:.4e} {green:.4e} {blue:.4e} W/m^2 (r g b)", s.mean_lx));
    line(out, "E_min", format_args!("{:.2} lx   at {} m", s.min_lx, at(s.min_at)));
    line(out, "E_max", format_args!("{:.2} lx   at {} m", s.max_lx, at(s.max_at)));
    let share = |u: Option<f64>| u.map_or("none: it is dark".to_owned(), |u| format!("{u:.3}"));
    line(out, "U0", format_args!("{}   = E_min / E_mean (EN 12464-1)", share(s.u0)));
    line(out, "Ud", format_args!("{}   = E_min / E_max", share(s.ud)));
}

fn vector_m(v: DVec3) -> String {
    format!("{:.4} {:.4} {:.4}", v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Irradiance;

    fn report() -> GridReport {
        let values = [Some(Irradiance(Rgb([1.0, 2.0, 4.0]))), None, Some(Irradiance(Rgb::splat(0.5)))];
        let points = values.iter().zip(1..).map(|(value, u)| GridPointReport {
            uv: [u, 1],
            at: DVec3::new(f64::from(u), 0.5, 0.0),
            normal: DVec3::Z,
            irradiance_w_m2: value.map(|e| e.0),
            illuminance_lx: value.map(|e| e.illuminance_lx()),
        });
        GridReport {
            schema: GridReport::SCHEMA,
            scene: SceneFacts {
                path: "room.toml".into(),
                n_surfaces: 6,
                n_materials: 1,
                n_lights: 0,
                n_elements: 600,
                n_vertices: 700,
                n_patches: 150,
                n_cast_patches: 150,
                n_t_junctions: 0,
            },
            caster: "software",
            interpolated: false,
            points: points.collect(),
            summary: GridSummary::new(values.map(|value| (value, 1.0))),
            grid: GridFacts {
                surface: Some("desk".to_owned()),
                corner_and_edges_m: None,
                border_m: 0.5,
                height_m: 0.0,
                size_m: [3.0, 1.0],
                n: [3, 1],
                cell_m: [1.0, 1.0],
                n_by_en_12464_1: false,
                en_12464_1_spacing_m: 0.2,
            },
            picture: None,
            timings: Timings::default(),
            warnings: Vec::new(),
        }
    }

    #[test]
    fn csv_has_units_in_its_header_and_no_numbers_for_hidden_points() {
        let expected = "u,v,x_m,y_m,z_m,normal_x,normal_y,normal_z,irradiance_r_w_m2,irradiance_g_w_m2,\
                        irradiance_b_w_m2,illuminance_lx\n\
                        1,1,1,0.5,0,0,0,1,1,2,4,345.7922\n\
                        2,1,2,0.5,0,0,0,1,,,,\n\
                        3,1,3,0.5,0,0,0,1,0.5,0.5,0.5,89.5\n";
        assert_eq!(report().csv(), expected);
    }

    #[test]
    fn text_lists_the_points_and_sums_them_up_within_a_screens_width() {
        let text = grid_text(&report());
        for part in [
            "on 'desk', without a border of 0.5 m\n",
            "3 x 1 points, cells of 1.000 m x 1.000 m (given; EN 12464-1: p = 0.200 m)",
            "inside or behind a surface",
            "E_mean     217.65 lx",
            "E_min      89.50 lx   at 3.0000 0.5000 0.0000 m",
            "U0         0.411   = E_min / E_mean",
            "Ud         0.259   = E_min / E_max",
        ] {
            assert!(text.contains(part), "'{part}' is missing in\n{text}");
        }
        assert!(text.lines().all(|l| l.chars().count() <= 100), "{text}");
    }
}
