//! Errors of meshes and solutions against a dense reference, and the best that any quadtree could do.
//!
//! ```text
//! dense reference --means of its elements--> samples (point, patch, Y): patches are those of every mesh
//! mesh, solution --reconstruction--> Y at the samples --> relative L2 = sqrt(sum w ((Y - Y_ref) / mean_s)^2 / sum w)
//! reference values at the vertices of a full quadtree --pruning for squared error + price x elements--> the bound
//! ```
//! Luminance of the whole irradiance, direct and indirect, over the mean of its surface, weighted by area, all surfaces.
//! The bound knows the reference's values and needs no balance; ours pays for both.
//!
//! Source of the pruning: Breiman, Friedman, Olshen, Stone 1984; Chou, Lookabaugh, Gray 1989.

use glam::DVec2;
use rayon::prelude::*;

use crate::geom::DVec3;
use crate::mesh::{Corners, Mesh, PatchId, Place, Subdivision, VertexId};
use crate::radiosity::refine::{RefineOptions, RefineReport, solve_adaptive};
use crate::radiosity::{Solution, SolveError, SolveOptions, solve};
use crate::raycast::software::SoftwareCaster;
use crate::reconstruct::{Method, Reconstruction};
use crate::scene::{MeshTarget, Scene};
use crate::units::Rgb;

/// A place where the right luminance is known.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where (m).
    pub point: DVec3,
    /// The patch that it lies on: all meshes that are compared have the same patches.
    pub patch: PatchId,
    /// Index of its surface.
    pub surface: u32,
    /// Area that it stands for (m^2).
    pub area_m2: f64,
    /// Luminance of irradiance, over the mean of its surface.
    pub relative: f64,
}

/// A dense solution.
pub struct Reference {
    /// Its elements' centres and means.
    pub samples: Vec<Sample>,
    /// Mean luminance of each surface (W/m^2).
    pub means: Vec<f64>,
    mesh: Mesh,
    field: Reconstruction,
}

/// A mesh with its solution.
pub struct Meshed {
    /// The mesh.
    pub mesh: Mesh,
    /// Its solution.
    pub solution: Solution,
    /// What refinement did, where it was refined.
    pub refined: Option<RefineReport>,
}

/// Relative L2 errors of a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Of element means.
    pub constant: f64,
    /// Of bilinear reconstruction.
    pub bilinear: f64,
}

fn luminances(solution: &Solution) -> (Vec<Rgb>, Vec<Rgb>) {
    let vertex = solution.vertex_irradiance.iter().map(|e| e.total()).collect();
    (vertex, solution.element_irradiance.iter().map(|e| e.total()).collect())
}

/// The scene with another size of elements.
pub fn sized(scene: &Scene, target: MeshTarget) -> Scene {
    let mut scene = scene.clone();
    scene.meshing.target = target;
    scene
}

/// A uniform mesh, solved.
///
/// # Errors
/// When the caster fails.
pub fn uniform(scene: &Scene, target: MeshTarget, options: &SolveOptions) -> Result<Meshed, SolveError> {
    let scene = sized(scene, target);
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let solution = solve(&scene, &mesh, &mut caster, options, &mut |_| {})?;
    Ok(Meshed { mesh, solution, refined: None })
}

/// A refined mesh, solved.
///
/// # Errors
/// When the caster fails.
pub fn adaptive(
    scene: &Scene,
    target: MeshTarget,
    options: &SolveOptions,
    refine: &RefineOptions,
) -> Result<Meshed, SolveError> {
    let scene = sized(scene, target);
    let initial = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(initial.cast_patches());
    let (mesh, solution, report) =
        solve_adaptive(&scene, &initial, &mut caster, options, refine, &mut |_| {})?;
    Ok(Meshed { mesh, solution, refined: Some(report) })
}

impl Reference {
    /// Solves the patches of `target`, its elements split `splits` times more: sources as coarse as those of the meshes
    /// that are compared, receivers finer.
    ///
    /// # Errors
    /// When the caster fails.
    pub fn new(
        scene: &Scene,
        target: MeshTarget,
        splits: u32,
        options: &SolveOptions,
    ) -> Result<Reference, SolveError> {
        let scene = sized(scene, target);
        let mut mesh = Mesh::build(&scene);
        for _ in 0..splits {
            let finer = mesh.subdivision().split(&vec![true; mesh.elements.len()]);
            mesh = Mesh::build_with(&scene, &finer).unwrap_or(mesh);
        }
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let solution = solve(&scene, &mesh, &mut caster, options, &mut |_| {})?;
        Ok(Reference::of(&scene, mesh, &solution))
    }

    /// From a dense solution.
    pub fn of(scene: &Scene, mesh: Mesh, solution: &Solution) -> Reference {
        let surface = |e: usize| mesh.patches[mesh.elements[e].patch.0 as usize].surface.0;
        let mut sums = vec![(0.0, 0.0); scene.surfaces.len()];
        for (e, irradiance) in solution.element_irradiance.iter().enumerate() {
            let area_m2 = mesh.elements[e].area_m2;
            let (sum, area) = &mut sums[surface(e) as usize];
            *sum += irradiance.total().luminance() * area_m2;
            *area += area_m2;
        }
        let means: Vec<f64> = sums.iter().map(|(sum, area)| sum / area.max(f64::MIN_POSITIVE)).collect();
        let samples = (0..mesh.elements.len())
            .filter(|&e| means[surface(e) as usize] > 0.0)
            .map(|e| {
                let element = &mesh.elements[e];
                let corners = mesh.polygon(&element.corners);
                Sample {
                    point: corners.iter().sum::<DVec3>() / corners.len() as f64,
                    patch: element.patch,
                    surface: surface(e),
                    area_m2: element.area_m2,
                    relative: solution.element_irradiance[e].total().luminance() / means[surface(e) as usize],
                }
            })
            .collect();
        let (vertex, element) = luminances(solution);
        let field = Reconstruction::new(&mesh, Method::Bilinear, &vertex, &element);
        Reference { samples, means, mesh, field }
    }

    /// Relative L2 errors of a mesh's solution.
    ///
    /// # Panics
    /// When the mesh has other patches than the reference.
    pub fn errors(&self, meshed: &Meshed) -> Errors {
        let (vertex, element) = luminances(&meshed.solution);
        let of = |method| self.error(&meshed.mesh, method, &vertex, &element);
        Errors { constant: of(Method::Constant), bilinear: of(Method::Bilinear) }
    }

    /// Relative L2 error of bilinear interpolation between the reference's own values at the vertices of a mesh: of the
    /// mesh alone.
    ///
    /// # Panics
    /// As [`Reference::errors`].
    pub fn interpolation_error(&self, mesh: &Mesh) -> f64 {
        let vertex: Vec<Rgb> = self.at_vertices(mesh).into_iter().map(Rgb::splat).collect();
        self.error(mesh, Method::Bilinear, &vertex, &[])
    }

    fn error(&self, mesh: &Mesh, method: Method, vertex: &[Rgb], element: &[Rgb]) -> f64 {
        let field = Reconstruction::new(mesh, method, vertex, element);
        let (mut sum, mut area) = (0.0, 0.0);
        for sample in &self.samples {
            let at = mesh.locate(sample.patch, sample.point);
            let y = field.evaluate(mesh, at).luminance() / self.means[sample.surface as usize];
            sum += sample.area_m2 * (y - sample.relative).powi(2);
            area += sample.area_m2;
        }
        (sum / area).sqrt()
    }

    /// Luminance (W/m^2) at the vertices of another mesh of the same patches, bilinear in the reference; on the side of
    /// the vertex's own elements where a border or a line runs through it.
    fn at_vertices(&self, mesh: &Mesh) -> Vec<f64> {
        assert_eq!(mesh.patches.len(), self.mesh.patches.len(), "meshes of the same patches");
        let value = |(v, vertex): (usize, &crate::mesh::Vertex)| {
            let patch = mesh.elements[mesh.elements_around(VertexId(v as u32))[0].0 as usize].patch;
            self.field.evaluate(&self.mesh, self.mesh.locate(patch, vertex.position)).luminance()
        };
        mesh.vertices.par_iter().enumerate().map(value).collect()
    }
}

/// The quadtrees under the patches of a mesh, with the squared error of each node as a leaf.
pub struct Quadtrees {
    /// Full trees, patch by patch, level by level: squared error x area of node `k` of a level.
    levels: Vec<Vec<Vec<f64>>>,
    area_m2: f64,
}

impl Quadtrees {
    /// Every node of the trees of `depth` levels under the patches of the mesh of `target`, reconstructed (bi)linearly
    /// from the reference's values at its corners.
    pub fn new(scene: &Scene, target: MeshTarget, depth: u32, reference: &Reference) -> Quadtrees {
        let scene = sized(scene, target);
        let initial = Mesh::build(&scene);
        let full = Subdivision::new(initial.patches.len() as u32, |_, place| place.level() < depth);
        let full = Mesh::build_with(&scene, &full).unwrap_or(initial);
        let values = reference.at_vertices(&full);
        let mut levels: Vec<Vec<Vec<f64>>> =
            vec![(0..=depth).map(|l| vec![0.0; 1 << (2 * l)]).collect(); full.patches.len()];
        let mut area_m2 = 0.0;
        for sample in &reference.samples {
            let patch = sample.patch;
            area_m2 += sample.area_m2;
            let at = full.locate(patch, sample.point);
            let element = &full.elements[at.element.0 as usize];
            let quarters: Vec<u32> = element.place.quarters().collect();
            let mean = reference.means[sample.surface as usize];
            let mut st = at.st;
            for level in (0..=depth).rev() {
                let index = quarters[..level as usize].iter().fold(0, |i, q| 4 * i + *q as usize);
                let value = node_value(&full, &values, patch, element.place.at_level(level), st);
                levels[patch.0 as usize][level as usize][index] +=
                    sample.area_m2 * (value / mean - sample.relative).powi(2);
                if level > 0 {
                    st = in_parent(&element.corners, quarters[level as usize - 1], st);
                }
            }
        }
        Quadtrees { levels, area_m2 }
    }

    /// No pruning with at most this relative L2 error has fewer elements; no balance asked for.
    ///
    /// Whatever the price, squared error + price x elements of any pruning is at least that of the pruning that minimises
    /// it: the largest of the bounds that follow. Between two prunings that are best at one price it is on the line between
    /// them.
    pub fn fewest(&self, error: f64) -> f64 {
        let allowed = error * error * self.area_m2;
        // Below this price differences of rounding would count.
        let (mut low, mut high) = (-30.0_f64, 20.0_f64);
        let mut fewest = 0.0_f64;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let (n, squares) = self.pruned(middle.exp());
            fewest = fewest.max(n as f64 + (squares - allowed) / middle.exp());
            if squares <= allowed { low = middle } else { high = middle }
        }
        fewest
    }

    /// The pruning that minimises squared error + price x elements: elements, squared error (m^2).
    fn pruned(&self, price: f64) -> (u64, f64) {
        let (mut n, mut squares) = (0, 0.0);
        for tree in &self.levels {
            // (cost, elements, squared error) of the best subtree of each node, from the finest level up.
            let mut best: Vec<(f64, u64, f64)> =
                tree[tree.len() - 1].iter().map(|&e| (e + price, 1, e)).collect();
            for level in tree[..tree.len() - 1].iter().rev() {
                best = level
                    .iter()
                    .enumerate()
                    .map(|(k, &e)| {
                        let split = best[4 * k..4 * k + 4]
                            .iter()
                            .fold((0.0, 0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2));
                        if e + price <= split.0 { (e + price, 1, e) } else { split }
                    })
                    .collect();
            }
            n += best[0].1;
            squares += best[0].2;
        }
        (n, squares)
    }
}

/// (Bi)linear interpolation in a node from the values at its corners.
fn node_value(mesh: &Mesh, values: &[f64], patch: PatchId, place: Place, st: DVec2) -> f64 {
    let f = |j: usize| values[mesh.corner_of(patch, place, j).0 as usize];
    let (s, t) = (st.x, st.y);
    match mesh.patches[patch.0 as usize].corners {
        Corners::Triangle(_) => f(0) * (1.0 - s - t) + f(1) * s + f(2) * t,
        Corners::Quad(_) => (f(0) * (1.0 - s) + f(1) * s) * (1.0 - t) + (f(3) * (1.0 - s) + f(2) * s) * t,
    }
}

/// (s,t) of a quarter as (s,t) of what it is a quarter of.
fn in_parent(corners: &Corners, quarter: u32, st: DVec2) -> DVec2 {
    let half = DVec2::new(f64::from(quarter & 1), f64::from(quarter >> 1));
    match (corners, quarter) {
        (Corners::Triangle(_), 3) => 0.5 * (DVec2::ONE - st),
        (Corners::Triangle(_), 1) => 0.5 * (st + DVec2::X),
        (Corners::Triangle(_), 2) => 0.5 * (st + DVec2::Y),
        (Corners::Triangle(_), _) => 0.5 * st,
        (Corners::Quad(_), _) => 0.5 * (st + half),
    }
}
