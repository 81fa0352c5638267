//! Measuring grids: cell centres on a plane, or on a surface in its own (s,t).
//!
//! ```text
//! GridSpec --plane: corner + u edge_u + v edge_v-----------------------------> Grid: n_u x n_v points,
//!          --surface: (s,t) -> point on the facets that the mesh has of it --/       normals, cell areas
//! EN 12464-1:2011, 4.4: cells at most p = 0.2 m x 5^log10(d / 1 m) wide, p <= 10 m; d is the longer side of the area, the
//! shorter where the longer is twice it or more; the nearest whole number of points along d, square cells along the other
//! ```
//! (s,t) of surfaces: quads bilinear from corner 0 (s to corner 1, t to corner 3); disks s = angle / 2 pi, t = (r/R)^2;
//! spheres s = azimuth / 2 pi, t = (1 + height) / 2; tubes s = angle / 2 pi, t along the axis; triangles as quads whose
//! first edge has shrunk to corner 0, equal areas. Equal cells of all but skew quads have equal areas.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use crate::geom::{DVec3, tangent_frame};
use crate::mesh::{Mesh, PatchId};
use crate::radiosity::ProbePoint;
use crate::report::si::vector;
use crate::scene::{Scene, Shape, Surface, SurfaceId};

/// Most points of a grid.
pub const MAX_GRID_POINTS: u64 = 1_000_000;
/// Shortest edge of a grid (m).
const MIN_EDGE_M: f64 = 1e-6;
/// Least sine of the angle between a grid's edges.
const MIN_SINE: f64 = 1e-6;

/// A wanted grid.
#[derive(Clone, Debug, PartialEq)]
pub struct GridSpec {
    /// Where.
    pub place: GridPlace,
    /// Points along u and v; those of EN 12464-1 when `None`.
    pub n: Option<[u32; 2]>,
    /// What the points measure with, any length; the plane's or the surface's own normal when `None`.
    pub normal: Option<DVec3>,
    /// Width of the band at the area's border that is left out (m).
    pub border_m: f64,
    /// How far the points are lifted off along the area's own normal (m).
    pub height_m: f64,
}

/// Where a grid lies.
#[derive(Clone, Debug, PartialEq)]
pub enum GridPlace {
    /// A parallelogram; its normal is u x v.
    Plane {
        /// Where u = v = 0 (m).
        corner: DVec3,
        /// From there to u = 1 (m).
        edge_u: DVec3,
        /// From there to v = 1 (m).
        edge_v: DVec3,
    },
    /// The front of the surface of this name.
    Surface(String),
}

/// Points to measure at, row by row, u fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Points along u and v.
    pub n: [u32; 2],
    /// Lengths of the area that they cover (m), the border left out; of curved surfaces their means.
    pub size_m: [f64; 2],
    /// Widest cell by EN 12464-1 (m).
    pub en_spacing_m: f64,
    /// The points.
    pub points: Vec<GridPoint>,
}

/// A point of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPoint {
    /// Its place in the area, from 0 to 1, border included.
    pub uv: [f64; 2],
    /// Where (m).
    pub at: DVec3,
    /// Unit normal that it measures with.
    pub normal: DVec3,
    /// Area of its cell (m^2).
    pub area_m2: f64,
}

/// A grid that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// An edge without length.
    #[error("the grid's edge {edge} is {}, {} m long: expected at least {MIN_EDGE_M} m", vector(*value), value.length())]
    Edge {
        /// `u` or `v`.
        edge: &'static str,
        /// The edge (m).
        value: DVec3,
    },
    /// Edges along one line.
    #[error("the grid's edges u {} and v {} lie along one line: the grid has no area", vector(*u), vector(*v))]
    Parallel {
        /// The first (m).
        u: DVec3,
        /// The second (m).
        v: DVec3,
    },
    /// A border that leaves nothing.
    #[error("a border of {border_m} m leaves nothing of an area of {} m x {} m", size_m[0], size_m[1])]
    Border {
        /// Its width (m).
        border_m: f64,
        /// Lengths of the area (m).
        size_m: [f64; 2],
    },
    /// A surface without coordinates of its own.
    #[error(
        "surface '{name}' is made of a model file's faces, which have no common (s,t): expected a plane grid (corner and \
         edges), or a quad, triangle, disk, sphere or cylinder"
    )]
    Faces {
        /// The surface.
        name: String,
    },
    /// A border where there is none.
    #[error("surface '{name}' is no quad: a border is left out of quads and planes only")]
    NoBorder {
        /// The surface.
        name: String,
    },
    /// Too many points.
    #[error("a grid of {n_u} x {n_v} points: at most {MAX_GRID_POINTS} are possible")]
    TooMany {
        /// Along u.
        n_u: u32,
        /// Along v.
        n_v: u32,
    },
    /// No such surface.
    #[error("the scene has no surface '{name}': it has {known}")]
    NoSurface {
        /// What was asked for.
        name: String,
        /// Names of the scene's surfaces, or the nearest of many.
        known: String,
    },
}

/// Widest cell (m) of an area whose side d is `d_m` (m), by EN 12464-1.
pub fn en_12464_1_spacing_m(d_m: f64) -> f64 {
    (0.2 * 5f64.powf(d_m.log10())).min(10.0)
}

/// The side d of EN 12464-1 of an area (m): the longer one, the shorter where the longer is twice it or more.
fn relevant_side(size_m: [f64; 2]) -> usize {
    let longer = usize::from(size_m[1] > size_m[0]);
    if size_m[longer] < 2.0 * size_m[1 - longer] { longer } else { 1 - longer }
}

/// Points along the sides of an area (m), by EN 12464-1.
pub fn en_12464_1_counts(size_m: [f64; 2]) -> [u32; 2] {
    let d = relevant_side(size_m);
    let points = |length: f64, cell: f64| (length / cell).round().clamp(1.0, f64::from(u32::MAX));
    let along_d = points(size_m[d], en_12464_1_spacing_m(size_m[d]));
    let across = points(size_m[1 - d], size_m[d] / along_d);
    if d == 0 { [along_d as u32, across as u32] } else { [across as u32, along_d as u32] }
}

impl Grid {
    /// The points of `spec` in a meshed scene.
    ///
    /// # Errors
    /// A grid that cannot be.
    pub fn new(spec: &GridSpec, scene: &Scene, mesh: &Mesh) -> Result<Grid, GridError> {
        match &spec.place {
            GridPlace::Plane { corner, edge_u, edge_v } => plane(spec, *corner, *edge_u, *edge_v),
            GridPlace::Surface(name) => {
                let found = scene.surfaces.iter().position(|s| s.name == *name);
                let id = found.ok_or_else(|| no_surface(name, &scene.surfaces))?;
                on_surface(spec, mesh, &scene.surfaces[id], SurfaceId(id as u32))
            }
        }
    }

    /// The points as probes take them.
    pub fn probe_points(&self) -> Vec<ProbePoint> {
        self.points.iter().map(|p| ProbePoint { at: p.at, normal: p.normal }).collect()
    }

    /// Lengths of a cell (m).
    pub fn cell_m(&self) -> [f64; 2] {
        [self.size_m[0] / f64::from(self.n[0]), self.size_m[1] / f64::from(self.n[1])]
    }
}

fn no_surface(name: &str, surfaces: &[Surface]) -> GridError {
    /// Names that are told.
    const MOST: usize = 12;
    let mut names: Vec<&str> = surfaces.iter().map(|s| s.name.as_str()).collect();
    names.sort_by_key(|known| strsim::damerau_levenshtein(known, name));
    let more = if names.len() > MOST { format!(" and {} more", names.len() - MOST) } else { String::new() };
    names.truncate(MOST);
    GridError::NoSurface { name: name.to_owned(), known: format!("'{}'{more}", names.join("', '")) }
}

/// An area's place: (u, v) in the unit square to point, unit normal and area of a unit of the square (m^2).
type Place<'a> = dyn Fn(f64, f64) -> (DVec3, DVec3, f64) + Sync + 'a;

/// Cell centres of an area of `size_m`.
fn lay(spec: &GridSpec, size_m: [f64; 2], place: &Place<'_>) -> Result<Grid, GridError> {
    let inner_m = size_m.map(|length| length - 2.0 * spec.border_m);
    if inner_m.iter().any(|length| *length < MIN_EDGE_M) {
        return Err(GridError::Border { border_m: spec.border_m, size_m });
    }
    let [n_u, n_v] = spec.n.unwrap_or_else(|| en_12464_1_counts(inner_m));
    if u64::from(n_u) * u64::from(n_v) > MAX_GRID_POINTS {
        return Err(GridError::TooMany { n_u, n_v });
    }
    let share: [f64; 2] = std::array::from_fn(|k| inner_m[k] / size_m[k]);
    let along =
        |k: usize, i: u32, n: u32| spec.border_m / size_m[k] + share[k] * (f64::from(i) + 0.5) / f64::from(n);
    let of_square = share[0] * share[1] / (f64::from(n_u) * f64::from(n_v));
    let points = (0..n_u * n_v).into_par_iter().map(|k| {
        let uv = [along(0, k % n_u, n_u), along(1, k / n_u, n_v)];
        let (at, own, area_m2) = place(uv[0], uv[1]);
        let normal = spec.normal.and_then(DVec3::try_normalize).unwrap_or(own);
        GridPoint { uv, at: at + spec.height_m * own, normal, area_m2: area_m2 * of_square }
    });
    let d = relevant_side(inner_m);
    let en_spacing_m = en_12464_1_spacing_m(inner_m[d]);
    Ok(Grid { n: [n_u, n_v], size_m: inner_m, en_spacing_m, points: points.collect() })
}

fn plane(spec: &GridSpec, corner: DVec3, u: DVec3, v: DVec3) -> Result<Grid, GridError> {
    let size_m = [u.length(), v.length()];
    for (edge, value, length) in [("u", u, size_m[0]), ("v", v, size_m[1])] {
        if length < MIN_EDGE_M {
            return Err(GridError::Edge { edge, value });
        }
    }
    let normal = u.cross(v);
    let area_m2 = normal.length();
    if area_m2 < MIN_SINE * size_m[0] * size_m[1] {
        return Err(GridError::Parallel { u, v });
    }
    let normal = normal / area_m2;
    lay(spec, size_m, &|s, t| (corner + s * u + t * v, normal, area_m2))
}

fn on_surface(spec: &GridSpec, mesh: &Mesh, surface: &Surface, id: SurfaceId) -> Result<Grid, GridError> {
    let facets = Facets::of(mesh, id);
    let area_m2 = surface.shape.area_m2();
    if spec.border_m > 0.0 && !matches!(surface.shape, Shape::Quad(_)) {
        return Err(GridError::NoBorder { name: surface.name.clone() });
    }
    let lay = |size_m, place: &Place<'_>| {
        lay(spec, size_m, &|s, t| {
            let (at, normal, area_m2) = place(s, t);
            (facets.nearest(mesh, at), normal, area_m2)
        })
    };
    match surface.shape {
        Shape::Faces(_) => Err(GridError::Faces { name: surface.name.clone() }),
        Shape::Quad([a, b, c, d]) => {
            let mean = |x: DVec3, y: DVec3| 0.5 * (x.length() + y.length());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            lay([mean(b - a, c - d), mean(d - a, c - b)], &|s, t| {
                let along_s = (b - a).lerp(c - d, t);
                let along_t = (d - a).lerp(c - b, s);
                let at = (a + s * (b - a)).lerp(d + s * (c - d), t);
                (at, normal, along_s.cross(along_t).length())
            })
        }
        Shape::Triangle([a, b, c]) => {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            // Mean lengths: half the side opposite corner 0 across, the way from it to that side along.
            let size_m = [0.5 * (c - b).length(), (0.5 * (b + c) - a).length()];
            lay(size_m, &|s, t| (a + t.sqrt() * (b.lerp(c, s) - a), normal, area_m2))
        }
        Shape::Disk { center, normal, radius } => {
            let (x, y) = tangent_frame(normal);
            lay([PI * radius, radius], &|s, t| {
                let (sin, cos) = (TAU * s).sin_cos();
                (center + t.sqrt() * radius * (cos * x + sin * y), normal, area_m2)
            })
        }
        Shape::Sphere { center, radius, inward } => {
            // The mean width of a sphere's strips is pi/4 of its equator.
            lay([0.25 * PI * TAU * radius, PI * radius], &|s, t| {
                let (sin, cos) = (TAU * s).sin_cos();
                let z = 2.0 * t - 1.0;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let out = DVec3::new(r * cos, r * sin, z);
                (center + radius * out, if inward { -out } else { out }, area_m2)
            })
        }
        Shape::Cylinder { base, top, radius, inward } => {
            let axis = (top - base).normalize_or_zero();
            let (x, y) = tangent_frame(axis);
            lay([TAU * radius, (top - base).length()], &|s, t| {
                let (sin, cos) = (TAU * s).sin_cos();
                let out = cos * x + sin * y;
                (base.lerp(top, t) + radius * out, if inward { -out } else { out }, area_m2)
            })
        }
    }
}

/// The facets that casters know of a surface: points of a curved one lie on them, not on the true surface.
struct Facets {
    /// Patch, middle and largest distance of a corner from it (m).
    patches: Vec<(PatchId, DVec3, f64)>,
}

impl Facets {
    fn of(mesh: &Mesh, surface: SurfaceId) -> Facets {
        let patches = mesh.surfaces[surface.0 as usize].front.clone().map(|p| {
            let corners = mesh.polygon(&mesh.patches[p as usize].corners);
            let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let radius = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
            (PatchId(p), middle, radius)
        });
        Facets { patches: patches.collect() }
    }

    /// The nearest point of the facets; `point` itself where there are none.
    fn nearest(&self, mesh: &Mesh, point: DVec3) -> DVec3 {
        let mut best = (f64::INFINITY, point);
        for &(patch, middle, radius) in &self.patches {
            if middle.distance(point) - radius >= best.0 {
                continue;
            }
            let at = mesh.position(mesh.locate(patch, point));
            let distance = at.distance(point);
            if distance < best.0 {
                best = (distance, at);
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::{room, scene, surface};
    use crate::scene::MeshTarget;

    fn spec(place: GridPlace) -> GridSpec {
        GridSpec { place, n: None, normal: None, border_m: 0.0, height_m: 0.0 }
    }

    fn plane(u: DVec3, v: DVec3) -> GridSpec {
        spec(GridPlace::Plane { corner: DVec3::new(0.5, 0.5, 0.8), edge_u: u, edge_v: v })
    }

    fn grid(spec: &GridSpec) -> Result<Grid, GridError> {
        let mut surfaces = room(5.0, 4.0, 3.0);
        let center = DVec3::new(2.0, 2.0, 1.0);
        surfaces.push(surface("ball", Shape::Sphere { center, radius: 0.5, inward: false }));
        surfaces.push(surface("dome", Shape::Sphere { center, radius: 0.6, inward: true }));
        surfaces.push(surface("lamp", Shape::Disk { center, normal: DVec3::NEG_Z, radius: 0.2 }));
        let (base, top) = (DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 3.0));
        surfaces.push(surface("column", Shape::Cylinder { base, top, radius: 0.2, inward: false }));
        surfaces.push(surface("sail", Shape::Triangle([base, base + DVec3::X, base + DVec3::Y])));
        let scene = scene(surfaces, MeshTarget::Elements(2000));
        Grid::new(spec, &scene, &Mesh::build(&scene))
    }

    #[test]
    fn spacing_of_the_standard_is_its_formula_at_the_sides_of_its_table() {
        for (d, p) in [(1.0, 0.2), (10.0, 1.0), (100.0, 5.0), (1000.0, 10.0)] {
            assert!((en_12464_1_spacing_m(d) - p).abs() < 1e-12, "{d}");
        }
        // The standard's table A.1: length of the area, points.
        for (d, n) in [(1.0, 5), (2.0, 6), (5.0, 8), (10.0, 10), (100.0, 20)] {
            assert_eq!(en_12464_1_counts([d, d]), [n, n], "{d}");
        }
        // d is the shorter side where the longer is twice it or more; cells are about square.
        assert_eq!(en_12464_1_counts([10.0, 5.1]), [10, 5]);
        assert_eq!(en_12464_1_counts([5.0, 20.0]), [8, 32]);
    }

    #[test]
    fn plane_has_its_cell_centres_row_by_row_and_the_normal_u_cross_v() {
        let mut spec = plane(DVec3::X * 2.0, DVec3::Y);
        spec.n = Some([4, 2]);
        let g = grid(&spec).unwrap();
        assert_eq!((g.n, g.size_m, g.cell_m(), g.points.len()), ([4, 2], [2.0, 1.0], [0.5, 0.5], 8));
        assert_eq!(g.points[1].at, DVec3::new(1.25, 0.75, 0.8));
        assert_eq!(g.points[6].at, DVec3::new(1.75, 1.25, 0.8));
        assert!(g.points.iter().all(|p| p.normal == DVec3::Z && (p.area_m2 - 0.25).abs() < 1e-15));
        spec.normal = Some(DVec3::new(0.0, 0.0, -3.0));
        spec.height_m = 0.1;
        let turned = grid(&spec).unwrap();
        assert!(turned.points.iter().all(|p| p.normal == DVec3::NEG_Z && (p.at.z - 0.9).abs() < 1e-15));
    }

    #[test]
    fn border_is_left_out_and_the_standard_counts_what_is_left() {
        let mut spec = spec(GridPlace::Surface("floor".to_owned()));
        spec.border_m = 0.5;
        let g = grid(&spec).unwrap();
        assert!(g.size_m.iter().zip([4.0, 3.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{:?}", g.size_m);
        assert_eq!(g.n, en_12464_1_counts([4.0, 3.0]));
        let least = g.points.iter().map(|p| p.at.x).fold(f64::INFINITY, f64::min);
        assert!((least - (0.5 + 0.5 * g.cell_m()[0])).abs() < 1e-12);
        let area: f64 = g.points.iter().map(|p| p.area_m2).sum();
        assert!((area - 12.0).abs() < 1e-9, "{area}");
        spec.border_m = 2.0;
        let e = grid(&spec).unwrap_err().to_string();
        let tube = GridSpec { border_m: 0.1, ..spec.clone() };
        let tube = GridSpec { place: GridPlace::Surface("column".to_owned()), ..tube };
        assert!(grid(&tube).unwrap_err().to_string().contains("'column' is no quad"));
        assert_eq!(e, "a border of 2 m leaves nothing of an area of 5 m x 4 m");
    }

    #[test]
    fn grids_on_surfaces_of_each_shape_cover_their_area_and_lie_on_their_facets() {
        let center = DVec3::new(2.0, 2.0, 1.0);
        let area = |g: &Grid| g.points.iter().map(|p| p.area_m2).sum::<f64>();
        let of = |name: &str| grid(&spec(GridPlace::Surface(name.to_owned()))).unwrap();
        let (ball, dome, lamp) = (of("ball"), of("dome"), of("lamp"));
        let near =
            |value: f64, expected: f64| assert!((value - expected).abs() < 1e-9, "{value}, {expected}");
        near(area(&ball), 4.0 * PI * 0.25);
        near(area(&dome), 4.0 * PI * 0.36);
        near(area(&lamp), PI * 0.04);
        near(area(&of("column")), TAU * 0.2 * 3.0);
        near(area(&of("sail")), 0.5);
        near(area(&of("floor")), 20.0);
        for p in &ball.points {
            // Facets lie inside the sphere, by their sagitta at most.
            let r = p.at.distance(center);
            assert!(r <= 0.5 + 1e-12 && r > 0.45, "{r}");
            assert!((p.at - center).normalize().dot(p.normal) > 0.99);
        }
        assert!(dome.points.iter().all(|p| (center - p.at).dot(p.normal) > 0.0));
        assert!(lamp.points.iter().all(|p| p.normal == DVec3::NEG_Z && p.at.distance(center) < 0.2));
        let sail = of("sail");
        assert!(sail.points.iter().all(|p| p.at.x > 1.0 && p.at.y > 1.0 && p.at.x + p.at.y < 3.0));
    }

    #[test]
    fn grids_that_cannot_be_are_refused_by_name() {
        let refused = |spec: &GridSpec, expected: &str| {
            let e = grid(spec).unwrap_err().to_string();
            assert!(e.contains(expected), "{e}");
        };
        refused(&plane(DVec3::ZERO, DVec3::Y), "edge u is 0, 0, 0, 0 m long");
        refused(&plane(DVec3::X, DVec3::Y * 1e-9), "edge v is 0, 0.000000001, 0");
        refused(&plane(DVec3::X, DVec3::X * -2.0), "lie along one line");
        refused(&GridSpec { n: Some([2000, 2000]), ..plane(DVec3::X, DVec3::Y) }, "at most 1000000");
        let unknown = spec(GridPlace::Surface("flor".to_owned()));
        refused(&unknown, "no surface 'flor': it has 'floor'");
    }
}
