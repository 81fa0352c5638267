//! Closed surfaces of quad faces in [-1, 1]^3, before quantising.
//!
//! ```text
//! cube lattice pushed to radii -> box, ellipsoid (convex), bumpy ball (star-shaped)
//! ring of rings                -> torus                                              (no point sees all of it)
//! cells of a lattice           -> U tube, random solids with holes and handles       (corners jittered: bent faces)
//! ```

use std::collections::BTreeMap;

use super::random::Random;

/// Families of surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Flat faces of several patches each; convex.
    Box,
    /// Corners on an ellipsoid; convex before quantising.
    Ellipsoid,
    /// Random radii; star-shaped.
    BumpyBall,
    /// A ring of random thickness.
    Torus,
    /// An extruded concave polygon.
    UTube,
    /// Random cells of a lattice, with holes, handles and edges that four faces share.
    Cells,
}

impl Shape {
    /// All of them.
    pub const ALL: [Shape; 6] =
        [Shape::Box, Shape::Ellipsoid, Shape::BumpyBall, Shape::Torus, Shape::UTube, Shape::Cells];
}

/// Quad faces over shared corners.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Corners.
    pub vertices: Vec<[f64; 3]>,
    /// Faces as places in `vertices`, in order around each.
    pub faces: Vec<[usize; 4]>,
    /// Points inside.
    pub cores: Vec<[f64; 3]>,
}

impl Surface {
    /// A random surface of a family; about half of them turned, the others along the axes.
    pub fn any(shape: Shape, random: &mut Random) -> Surface {
        let mut surface = match shape {
            Shape::Box => {
                let half = [(); 3].map(|()| random.between(0.2, 0.54));
                let n = 1 + random.below(3);
                over_cube(n, |p| scaled(p, half))
            }
            Shape::Ellipsoid => {
                let half = [(); 3].map(|()| random.between(0.4, 0.95));
                over_cube(2 + random.below(2), |p| scaled(unit(p), half))
            }
            Shape::BumpyBall => {
                over_cube(2 + random.below(2), |p| scaled(unit(p), [random.between(0.35, 0.95); 3]))
            }
            Shape::Torus => torus(4 + random.below(4), 3 + random.below(4), random),
            Shape::UTube => {
                let filled = |cell: [usize; 3]| cell[2] == 1 && (cell[0] != 1 || cell[1] == 0);
                cells(filled, random)
            }
            Shape::Cells => {
                let chosen = random.bits() | 1 << random.below(27);
                cells(|cell| chosen >> (cell[0] + 3 * cell[1] + 9 * cell[2]) & 1 == 1, random)
            }
        };
        if random.below(2) == 0 {
            surface.turn(random);
        } else if random.below(3) == 0 {
            surface.fill_cube();
        }
        surface
    }

    fn points(&mut self) -> impl Iterator<Item = &mut [f64; 3]> {
        self.vertices.iter_mut().chain(&mut self.cores)
    }

    /// Turns everything by a random frame.
    fn turn(&mut self, random: &mut Random) {
        let mut vector = || unit([(); 3].map(|()| random.between(-1.0, 1.0)));
        let (x, y) = (vector(), vector());
        let z = unit(cross(x, y));
        let frame = [x, cross(z, x), z];
        for point in self.points() {
            *point = frame.map(|axis| (0..3).map(|k| axis[k] * point[k]).sum());
        }
    }

    /// Grows everything until it reaches the cube's faces.
    fn fill_cube(&mut self) {
        let most = self.vertices.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        self.points().flatten().for_each(|x| *x /= most);
    }
}

fn scaled(p: [f64; 3], half: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| p[k] * half[k])
}

fn unit(p: [f64; 3]) -> [f64; 3] {
    let length = p.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-6);
    p.map(|x| x / length)
}

fn cross(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// Corners of a lattice, made when first used.
struct Corners<'a> {
    places: BTreeMap<[usize; 3], usize>,
    points: Vec<[f64; 3]>,
    at: &'a mut dyn FnMut([usize; 3]) -> [f64; 3],
}

impl Corners<'_> {
    fn corner(&mut self, place: [usize; 3]) -> usize {
        *self.places.entry(place).or_insert_with(|| {
            self.points.push((self.at)(place));
            self.points.len() - 1
        })
    }

    /// The unit face of the lattice at `low`, across `axis`.
    fn face(&mut self, low: [usize; 3], axis: usize) -> [usize; 4] {
        [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| {
            let mut place = low;
            place[(axis + 1) % 3] += u;
            place[(axis + 2) % 3] += v;
            self.corner(place)
        })
    }
}

/// The faces of the cube [-1, 1]^3, n x n each, every corner moved by `at`.
fn over_cube(n: usize, mut at: impl FnMut([f64; 3]) -> [f64; 3]) -> Surface {
    let mut point = |place: [usize; 3]| at(place.map(|w| 2.0 * w as f64 / n as f64 - 1.0));
    let mut corners = Corners { places: BTreeMap::new(), points: Vec::new(), at: &mut point };
    let mut faces = Vec::new();
    for axis in 0..3 {
        for end in [0, n] {
            for place in 0..n * n {
                let mut low = [0; 3];
                (low[axis], low[(axis + 1) % 3], low[(axis + 2) % 3]) = (end, place % n, place / n);
                faces.push(corners.face(low, axis));
            }
        }
    }
    Surface { vertices: corners.points, faces, cores: vec![[0.0; 3]] }
}

/// `n` rings of `m` corners each.
fn torus(n: usize, m: usize, random: &mut Random) -> Surface {
    let angle = |place: usize, of: usize| std::f64::consts::TAU * place as f64 / of as f64;
    let (mut vertices, mut cores) = (Vec::new(), Vec::new());
    for i in 0..n {
        let (sin, cos) = angle(i, n).sin_cos();
        cores.push([0.6 * cos, 0.6 * sin, 0.0]);
        for j in 0..m {
            let thick = random.between(0.2, 0.34);
            let out = 0.6 + thick * angle(j, m).cos();
            vertices.push([out * cos, out * sin, thick * angle(j, m).sin()]);
        }
    }
    let at = |i: usize, j: usize| i % n * m + j % m;
    let faces = (0..n * m)
        .map(|k| (k / m, k % m))
        .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        .collect();
    Surface { vertices, faces, cores }
}

/// The boundary of the filled cells of a 3^3 lattice: every face between a filled cell and one that is not. Corners are
/// jittered in three of four cases, by at most a fifth of a cell.
fn cells(filled: impl Fn([usize; 3]) -> bool, random: &mut Random) -> Surface {
    let side = 0.32;
    let jitter = if random.below(4) == 0 { 0.0 } else { 0.2 * side };
    let mut point =
        |place: [usize; 3]| place.map(|w| side * (w as f64 - 1.5) + jitter * random.between(-1.0, 1.0));
    let mut corners = Corners { places: BTreeMap::new(), points: Vec::new(), at: &mut point };
    let (mut faces, mut cores) = (Vec::new(), Vec::new());
    // Cells 0..=3 along each axis, number 3 outside: its low faces close the lattice.
    for k in 0..64 {
        let cell = [k % 4, k / 4 % 4, k / 16];
        let here = |cell: [usize; 3]| cell.iter().all(|w| *w < 3) && filled(cell);
        if here(cell) {
            cores.push(cell.map(|w| side * (w as f64 - 1.0)));
        }
        for axis in 0..3 {
            let mut before = cell;
            before[axis] = before[axis].wrapping_sub(1);
            if here(cell) != here(before) {
                faces.push(corners.face(cell, axis));
            }
        }
    }
    Surface { vertices: corners.points, faces, cores }
}
