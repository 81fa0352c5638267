//! View factors by really solving a scene: a black emitter of exitance 1, black receivers, F = received / emitted.
//!
//! ```text
//! two surfaces --solve: kernel, quadrature, visibility rays--> W received / W emitted  against the closed form
//! ```

use super::formulas::{self, Span};
use super::row::{Group, Row};
use super::setting::{Answer, Setting};
use crate::experiments::ExperimentError;
use crate::geom::DVec3;

/// Bound of cases of polygons, as a share of the value.
const POLYGONAL: f64 = 0.002;
/// Bound of cases with curved surfaces.
const CURVED: f64 = 0.005;
/// The case of the sphere.
const SPHERE: &str = "sphere of radius 0.4 to a rectangle 1.5 x 1 over its corner at distance 0.7";

/// A case: a scene that holds an `emitter` and a `receiver`, and what F is.
#[derive(Clone, Debug)]
pub struct ViewFactor {
    name: &'static str,
    formula: &'static str,
    expected: f64,
    bound: f64,
    sampled: bool,
    setting: Setting,
}

impl ViewFactor {
    /// Something is in between: rays decide what is seen.
    pub fn is_sampled(&self) -> bool {
        self.sampled
    }

    /// The case solved with about `elements`.
    ///
    /// # Errors
    /// None in software.
    pub fn row(&self, elements: u32) -> Result<Row, ExperimentError> {
        Ok(self.row_of(&self.setting.solve(elements)?))
    }

    /// The same, curved surfaces with at least `min_around` patches around, every patch shot by kernel.
    ///
    /// # Errors
    /// None in software.
    pub fn row_with_facets(&self, elements: u32, min_around: u32) -> Result<Row, ExperimentError> {
        Ok(self.row_of(&self.setting.solve_by_kernel(elements, min_around)?))
    }

    /// Something is curved.
    pub fn is_curved(&self) -> bool {
        self.bound == CURVED
    }

    /// What the coarsest mesh is finer by than those of other cases, along an edge: a sphere of eight rows still errs by chance
    /// to either side.
    pub fn fineness(&self) -> u32 {
        if self.name == SPHERE { 2 } else { 1 }
    }

    fn row_of(&self, answer: &Answer) -> Row {
        Row {
            group: Group::ViewFactor,
            case: self.name.to_owned(),
            formula: self.formula,
            expected: self.expected,
            ours: answer.incident_w("receiver") / answer.emitted_w(),
            bound: self.bound,
        }
    }
}

fn black() -> Setting {
    Setting::default().material("black", 0.0, 0.0).material("lamp", 0.0, 1.0)
}

/// A rectangle in the plane z, looking up or down.
fn level(x: Span, y: Span, z: f64, up: bool) -> [[f64; 3]; 4] {
    let ([x0, x1], [y0, y1]) = (x, y);
    match up {
        true => [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]],
        false => [[x0, y0, z], [x0, y1, z], [x1, y1, z], [x1, y0, z]],
    }
}

/// A rectangle in the plane x = 0, looking towards +x.
fn upright(z: Span, y: Span) -> [[f64; 3]; 4] {
    let ([z0, z1], [y0, y1]) = (z, y);
    [[0.0, y0, z0], [0.0, y1, z0], [0.0, y1, z1], [0.0, y0, z1]]
}

/// All cases.
pub fn cases() -> Vec<ViewFactor> {
    let parallel = |name, a: [Span; 2], b: [Span; 2], gap: f64| ViewFactor {
        name,
        formula: "parallel rectangles in general position (Ehlert, Smith 1993; Howell C-11, C-13)",
        expected: formulas::parallel_rectangles(a, b, gap),
        bound: POLYGONAL,
        sampled: false,
        setting: black().quad("emitter", "lamp", level(a[0], a[1], 0.0, true)).quad(
            "receiver",
            "black",
            level(b[0], b[1], gap, false),
        ),
    };
    let perpendicular = |name, a: [Span; 2], b: [Span; 2]| ViewFactor {
        name,
        formula: "perpendicular rectangles in general position (Ehlert, Smith 1993; Howell C-14)",
        expected: formulas::perpendicular_rectangles(a, b),
        bound: POLYGONAL,
        sampled: false,
        setting: black().quad("emitter", "lamp", level(a[0], a[1], 0.0, true)).quad(
            "receiver",
            "black",
            upright(b[0], b[1]),
        ),
    };
    let disks = |name, r1: f64, r2: f64, h: f64| ViewFactor {
        name,
        formula: "coaxial disks (Howell C-41)",
        expected: formulas::coaxial_disks(r1, r2, h),
        bound: CURVED,
        sampled: false,
        setting: black()
            .surface(
                "emitter",
                "lamp",
                &format!("disk = {{ center = [0, 0, 0], normal = [0, 0, 1], radius = {r1:?} }}"),
            )
            .surface(
                "receiver",
                "black",
                &format!("disk = {{ center = [0, 0, {h:?}], normal = [0, 0, -1], radius = {r2:?} }}"),
            ),
    };
    let unit = [0.0, 1.0];
    vec![
        parallel("unit squares, parallel at distance 1", [unit, unit], [unit, unit], 1.0),
        parallel("rectangles 2 x 1, parallel at distance 0.5", [[0.0, 2.0], unit], [[0.0, 2.0], unit], 0.5),
        parallel(
            "squares, parallel, offset by (1.5, 0.5) at distance 0.8",
            [unit, unit],
            [[1.5, 2.5], [0.5, 1.5]],
            0.8,
        ),
        perpendicular("unit squares with a common edge", [unit, unit], [unit, unit]),
        perpendicular(
            "rectangles 2 x 1 and 0.5 x 1 with a common edge",
            [[0.0, 2.0], unit],
            [[0.0, 0.5], unit],
        ),
        perpendicular(
            "rectangles at right angles, apart by (0.3, 0.4, 0.2)",
            [[0.3, 1.3], unit],
            [[0.2, 1.0], [1.4, 2.2]],
        ),
        disks("coaxial disks of radius 1 at distance 1", 1.0, 1.0, 1.0),
        disks("coaxial disks of radius 0.5 and 1.2 at distance 0.7", 0.5, 1.2, 0.7),
        sphere(),
        cylinder(),
        blocker(),
    ]
}

fn sphere() -> ViewFactor {
    ViewFactor {
        name: SPHERE,
        formula: "solid angle over 4 pi: atan(1 / sqrt(D1^2 + D2^2 + D1^2 D2^2)) / (4 pi) (Howell, sphere to rectangle)",
        expected: formulas::sphere_to_rectangle(1.5, 1.0, 0.7),
        bound: CURVED,
        sampled: false,
        setting: black().surface("emitter", "lamp", "sphere = { center = [0, 0, 0], radius = 0.4 }").quad(
            "receiver",
            "black",
            level([0.0, 1.5], [0.0, 1.0], 0.7, false),
        ),
    }
}

fn cylinder() -> ViewFactor {
    let (r, h) = (0.5, 0.8);
    ViewFactor {
        name: "inside of a cylinder, r = 0.5, h = 0.8, to its base",
        formula: "r / (2 h) x (1 - coaxial disks): the enclosure is closed",
        expected: formulas::cylinder_to_base(r, h),
        bound: CURVED,
        sampled: false,
        setting: black()
            .surface(
                "emitter",
                "lamp",
                "cylinder = { base = [0, 0, 0], top = [0, 0, 0.8], radius = 0.5, inward = true }",
            )
            .surface("receiver", "black", "disk = { center = [0, 0, 0], normal = [0, 0, 1], radius = 0.5 }")
            .surface("top", "black", "disk = { center = [0, 0, 0.8], normal = [0, 0, -1], radius = 0.5 }"),
    }
}

/// A small square between two: its shadow covers some of the emitter for every point of the receiver.
fn blocker() -> ViewFactor {
    let (unit, middle): (Span, Span) = ([0.0, 1.0], [0.3, 0.75]);
    let polygon = |corners: [[f64; 3]; 4]| corners.map(DVec3::from_array);
    let (emitter, board) = (level(unit, unit, 0.0, true), level(middle, middle, 0.4, true));
    let seen = |x: f64, y: f64| {
        formulas::visible_polygon(DVec3::new(x, y, 1.0), -DVec3::Z, &polygon(emitter), &polygon(board))
    };
    ViewFactor {
        name: "unit squares, parallel at distance 1, a square of 0.45 between them",
        formula: "Lambert's formula on the visible polygon, mean over 400 x 400 points of the receiver",
        expected: formulas::mean_over(unit, unit, 400, seen),
        bound: POLYGONAL,
        sampled: true,
        setting: black()
            .quad("emitter", "lamp", emitter)
            .quad("receiver", "black", level(unit, unit, 1.0, false))
            .quad("board", "black", board),
    }
}
