//! The lit cube's irradiance at any point of its walls, by integration over a converged solution.
//!
//! ```text
//! graded cells of six walls --Lambert's polygon formula--> form factors --Jacobi--> E of every cell
//! E(x) = F(x, lamp) M + sum over blocks of cells  rho E_mean F(x, block)
//! ```
//! The cube is convex: nothing is hidden, so the formula is exact, and E(x) is smooth wherever x is farther from a wall than
//! that wall's cells there are wide. Hence the cells: 1/32 wide, halved seven times more toward the edges, where E goes as
//! a + c d^0.68; and the blocks: all cells near the receiver's own plane, wider ones farther away, chosen by the walls alone,
//! so that moving the receiver never changes them. The eight symmetries of floor and ceiling and the two of a side wall leave
//! about 1,800 unknowns.
//! Checked against lit-cube.csv, which was computed apart from this project.
//!
//! Source: Lambert 1760; the scene is that of Bastos et al. 1992.

use std::collections::HashMap;
use std::sync::Mutex;

use rayon::prelude::*;

use crate::geom::DVec3;
use crate::mesh::{Mesh, SurfacePoint};
use crate::radiosity::kernel::Source;
use crate::reconstruct::metrics::Reference;

/// Cells along an edge before those at the ends are halved.
const CELLS: u32 = 32;
/// How often the cells at both ends are halved.
const HALVINGS: i32 = 7;
/// The lamp's borders.
const LAMP: [f64; 2] = [0.35, 0.65];
/// Places along an edge, in steps of 2^-40 from 0; a point on an edge of the cube looks out from 2^-23 inside.
const STEPS: u64 = 1 << 40;
const INSIDE: u64 = STEPS >> 23;
/// Rounds of the solve: 0.8^100 is 2e-10.
const ROUNDS: usize = 100;

/// One of the cube's walls. Sides are numbered x = 0, x = 1, y = 0, y = 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wall {
    /// z = 0; u along x, v along y.
    Floor,
    /// z = 1; u along x, v along y.
    Ceiling,
    /// u horizontal, v upwards.
    Side(u8),
}

/// All walls.
const WALLS: [Wall; 6] =
    [Wall::Floor, Wall::Ceiling, Wall::Side(0), Wall::Side(1), Wall::Side(2), Wall::Side(3)];

impl Wall {
    /// The wall whose plane a normal looks out from.
    pub fn facing(normal: DVec3) -> Wall {
        let side = |low: bool, first: u8| Wall::Side(first + u8::from(!low));
        match normal.abs().max_position() {
            0 => side(normal.x > 0.0, 0),
            1 => side(normal.y > 0.0, 2),
            _ if normal.z > 0.0 => Wall::Floor,
            _ => Wall::Ceiling,
        }
    }

    /// The point at (u, v), and the normal there.
    pub fn place(self, u: f64, v: f64) -> (DVec3, DVec3) {
        match self {
            Wall::Floor => (DVec3::new(u, v, 0.0), DVec3::Z),
            Wall::Ceiling => (DVec3::new(u, v, 1.0), -DVec3::Z),
            Wall::Side(0) => (DVec3::new(0.0, u, v), DVec3::X),
            Wall::Side(1) => (DVec3::new(1.0, u, v), -DVec3::X),
            Wall::Side(2) => (DVec3::new(u, 0.0, v), DVec3::Y),
            Wall::Side(_) => (DVec3::new(u, 1.0, v), -DVec3::Y),
        }
    }

    /// (u, v) of a point on it.
    fn uv(self, x: DVec3) -> [f64; 2] {
        match self {
            Wall::Floor | Wall::Ceiling => [x.x, x.y],
            Wall::Side(0 | 1) => [x.y, x.z],
            Wall::Side(_) => [x.x, x.z],
        }
    }

    /// The rectangle, counter-clockwise seen from inside.
    fn rectangle(self, u: [f64; 2], v: [f64; 2]) -> [DVec3; 4] {
        let at = |u, v| self.place(u, v).0;
        let corners = [at(u[0], v[0]), at(u[1], v[0]), at(u[1], v[1]), at(u[0], v[1])];
        let front =
            (corners[1] - corners[0]).cross(corners[3] - corners[0]).dot(self.place(0.5, 0.5).1) > 0.0;
        if front { corners } else { [corners[0], corners[3], corners[2], corners[1]] }
    }

    /// Floor, ceiling, sides: walls of a kind are alike.
    fn kind(self) -> usize {
        match self {
            Wall::Floor => 0,
            Wall::Ceiling => 1,
            Wall::Side(_) => 2,
        }
    }

    /// The line along which it meets another wall: which of its coordinates is across it, and whether from 1 down.
    fn meets(self, other: Wall) -> Option<(usize, bool)> {
        let normal = other.place(0.5, 0.5).1;
        let origin = self.place(0.0, 0.0).0;
        let [u, v] =
            [self.place(1.0, 0.0).0 - origin, self.place(0.0, 1.0).0 - origin].map(|d| d.dot(normal));
        match (u != 0.0, v != 0.0) {
            (true, _) => Some((0, u < 0.0)),
            (_, true) => Some((1, v < 0.0)),
            _ => None,
        }
    }
}

/// Lines between cells along an edge; ceilings have the lamp's borders too.
fn lines(lamp: bool) -> Vec<f64> {
    let mut lines: Vec<f64> = (0..=CELLS).map(|k| f64::from(k) / f64::from(CELLS)).collect();
    for k in 1..=HALVINGS {
        let d = 0.5_f64.powi(k) / f64::from(CELLS);
        lines.extend([d, 1.0 - d]);
    }
    if lamp {
        lines.extend(LAMP);
    }
    lines.sort_by(f64::total_cmp);
    lines
}

fn middle(lines: &[f64], i: usize) -> f64 {
    0.5 * (lines[i] + lines[i + 1])
}

fn in_lamp(u: f64, v: f64) -> bool {
    [u, v].iter().all(|x| (LAMP[0]..=LAMP[1]).contains(x))
}

/// Which light is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// From the lamp.
    Direct,
    /// From the walls.
    Indirect,
    /// Both.
    Total,
}

/// The converged solution.
pub struct LitCube {
    lamp: Source,
    /// Per kind of receiving wall, for its first representative: sources and what they radiate (W/m^2).
    blocks: [Vec<(Source, f64)>; 3],
    /// Indirect light at places that were asked for: kind of wall, (u, v) in steps. A pure function of the place, so it does
    /// not matter who asked first.
    seen: Mutex<HashMap<(usize, u64, u64), f64>>,
}

/// One kind of wall cut into cells.
struct Cells {
    u: Vec<f64>,
    v: Vec<f64>,
    /// Index of the unknown of each cell, row by row; `None` in the lamp.
    unknown: Vec<Option<usize>>,
}

impl Cells {
    fn columns(&self) -> usize {
        self.u.len() - 1
    }
}

/// The three kinds of walls, and where each unknown is.
fn cells() -> ([Cells; 3], Vec<(Wall, f64, f64)>) {
    let mut unknowns = Vec::new();
    let cut = |(wall, lamp): (Wall, bool), unknowns: &mut Vec<(Wall, f64, f64)>| {
        let [u, v] = [lines(lamp), lines(lamp)];
        let (n, m) = (u.len() - 1, v.len() - 1);
        let mut unknown = vec![None; n * m];
        for j in 0..m {
            for i in 0..n {
                // The representative among the symmetric ones comes first.
                let (mut a, mut b) = (i.min(n - 1 - i), j);
                if wall.kind() != 2 {
                    b = j.min(m - 1 - j);
                    (a, b) = (a.max(b), a.min(b));
                }
                let place = (middle(&u, i), middle(&v, j));
                if wall == Wall::Ceiling && in_lamp(place.0, place.1) {
                    continue;
                }
                unknown[j * n + i] = if (a, b) == (i, j) {
                    unknowns.push((wall, place.0, place.1));
                    Some(unknowns.len() - 1)
                } else {
                    unknown[b * n + a]
                };
            }
        }
        Cells { u, v, unknown }
    };
    let walls = [(Wall::Floor, false), (Wall::Ceiling, true), (Wall::Side(0), false)];
    let cells = walls.map(|wall| cut(wall, &mut unknowns));
    (cells, unknowns)
}

/// Form factors between the unknowns: row = receiver; sources of all walls added to what they are symmetric to.
fn form_factors(cells: &[Cells; 3], unknowns: &[(Wall, f64, f64)]) -> Vec<Vec<f64>> {
    let mut sources = Vec::new();
    for wall in WALLS {
        let Cells { u, v, unknown } = &cells[wall.kind()];
        let n = u.len() - 1;
        for (k, index) in unknown.iter().enumerate().filter_map(|(k, index)| index.map(|index| (k, index))) {
            let (i, j) = (k % n, k / n);
            let rectangle = wall.rectangle([u[i], u[i + 1]], [v[j], v[j + 1]]);
            sources.push((wall, index, Source::new(&rectangle)));
        }
    }
    let row = |&(wall, u, v): &(Wall, f64, f64)| {
        let (x, n) = wall.place(u, v);
        let mut row = vec![0.0; unknowns.len()];
        for (of, index, source) in &sources {
            if *of != wall {
                row[*index] += source.form_factor(x, n);
            }
        }
        row
    };
    unknowns.par_iter().map(row).collect()
}

/// Lines at which blocks of cells meet, from a share of the way across on; every line within `near` when it is 0.
fn kept(lines: &[f64], step: f64, lamp: bool) -> Vec<f64> {
    let on_step = |x: f64| (x / step - (x / step).round()).abs() < 1e-9;
    lines.iter().copied().filter(|&x| step == 0.0 || on_step(x) || (lamp && LAMP.contains(&x))).collect()
}

impl LitCube {
    /// Solves the cube with walls of reflectance `rho`, for a lamp of exitance 1.
    pub fn new(rho: f64) -> LitCube {
        let lamp = Source::new(&Wall::Ceiling.rectangle(LAMP, LAMP));
        let (cells, unknowns) = cells();
        let factors = form_factors(&cells, &unknowns);
        let direct: Vec<f64> = (unknowns.iter())
            .map(|&(wall, u, v)| {
                let (x, n) = wall.place(u, v);
                lamp.form_factor(x, n)
            })
            .collect();
        let mut e = direct.clone();
        for _ in 0..ROUNDS {
            let round = |(row, direct): (&Vec<f64>, &f64)| {
                direct + rho * row.iter().zip(&e).map(|(f, e)| f * e).sum::<f64>()
            };
            e = factors.par_iter().zip(&direct).map(round).collect();
        }
        let blocks = [Wall::Floor, Wall::Ceiling, Wall::Side(0)].map(|receiver| {
            let others = WALLS.into_iter().filter(|w| *w != receiver);
            others.flat_map(|source| blocks(receiver, source, &cells[source.kind()], &e, rho)).collect()
        });
        LitCube { lamp, blocks, seen: Mutex::default() }
    }

    /// Irradiance over the lamp's exitance at a point of a wall.
    pub fn irradiance(&self, wall: Wall, u: f64, v: f64, light: Light) -> f64 {
        // The representative of the places that are alike, on the first of the walls that are.
        let steps = |x: f64| ((x * STEPS as f64).round().max(0.0) as u64).clamp(INSIDE, STEPS - INSIDE);
        let (mut a, mut b) = (steps(u), steps(v));
        a = a.min(STEPS - a);
        let of = match wall {
            Wall::Side(_) => Wall::Side(0),
            _ => {
                b = b.min(STEPS - b);
                (a, b) = (a.max(b), a.min(b));
                wall
            }
        };
        let (x, n) = of.place(a as f64 / STEPS as f64, b as f64 / STEPS as f64);
        let direct = || self.lamp.form_factor(x, n);
        let indirect = || {
            let key = (of.kind(), a, b);
            let seen = || self.seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            if let Some(known) = seen().get(&key) {
                return *known;
            }
            let sum: f64 = self.blocks[of.kind()].iter().map(|(s, b)| b * s.form_factor(x, n)).sum();
            seen().insert(key, sum);
            sum
        };
        match light {
            Light::Direct => direct(),
            Light::Indirect => indirect(),
            Light::Total => direct() + indirect(),
        }
    }

    /// One light, as a reference for meshes of the cube.
    pub fn light(&self, light: Light) -> impl Reference + '_ {
        move |mesh: &Mesh, at: SurfacePoint| {
            let wall = Wall::facing(mesh.elements[at.element.0 as usize].normal);
            let [u, v] = wall.uv(mesh.position(at));
            self.irradiance(wall, u, v, light)
        }
    }
}

/// Cells of `source` joined into blocks, as wide as their distance from the plane of `receiver` allows, and their radiosity.
fn blocks(receiver: Wall, source: Wall, cells: &Cells, e: &[f64], rho: f64) -> Vec<(Source, f64)> {
    // (from, to, step) of the distance from the line that the walls share; step 0: every cell.
    let bands: &[[f64; 3]] = match source.meets(receiver) {
        Some(_) => &[[0.0, 0.125, 0.0], [0.125, 0.5, 0.0625], [0.5, 1.0, 0.125]],
        None => &[[0.0, 1.0, 0.0625]],
    };
    let (axis, from_one) = source.meets(receiver).unwrap_or((1, false));
    let lamp = source == Wall::Ceiling;
    let mut out = Vec::new();
    for &[from, to, step] in bands {
        let across = if axis == 0 { &cells.u } else { &cells.v };
        let along = if axis == 0 { &cells.v } else { &cells.u };
        let distance = |x: f64| if from_one { 1.0 - x } else { x };
        let within = |x: &f64| (from - 1e-9..=to + 1e-9).contains(&distance(*x));
        let across: Vec<f64> = kept(across, step, lamp).into_iter().filter(within).collect();
        let along = kept(along, step, lamp);
        for a in across.windows(2) {
            for b in along.windows(2) {
                let (u, v) = if axis == 0 { (a, b) } else { (b, a) };
                let mean = mean_over(cells, e, [u[0], u[1]], [v[0], v[1]]);
                if mean > 0.0 {
                    out.push((Source::new(&source.rectangle([u[0], u[1]], [v[0], v[1]])), rho * mean));
                }
            }
        }
    }
    out
}

/// Mean of E over the cells in a rectangle; 0 in the lamp.
fn mean_over(cells: &Cells, e: &[f64], u: [f64; 2], v: [f64; 2]) -> f64 {
    let range = |lines: &[f64], ends: [f64; 2]| {
        let index = |x: f64| lines.partition_point(|l| *l < x - 1e-12);
        index(ends[0])..index(ends[1])
    };
    let (mut sum, mut area) = (0.0, 0.0);
    for j in range(&cells.v, v) {
        for i in range(&cells.u, u) {
            let cell = (cells.u[i + 1] - cells.u[i]) * (cells.v[j + 1] - cells.v[j]);
            sum += cells.unknown[j * cells.columns() + i].map_or(0.0, |k| e[k]) * cell;
            area += cell;
        }
    }
    sum / area
}
