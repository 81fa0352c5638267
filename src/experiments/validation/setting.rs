//! Small scenes written as scene files are, and solved.
//!
//! ```text
//! Setting: materials, surfaces, lights --TOML text--> Scene::parse -> Mesh -> software caster -> solve --> Answer
//! ```

use std::fmt::Write as _;
use std::path::Path;

use crate::experiments::ExperimentError;
use crate::geom::DVec3;
use crate::mesh::Mesh;
use crate::radiosity::summary::{SurfaceSummary, summarise};
use crate::radiosity::{FormFactorMethod, ProbePoint, Solution, SolveOptions, SplitIrradiance, probe, solve};
use crate::raycast::software::SoftwareCaster;
use crate::scene::{MeshTarget, Meshing, Scene};

/// Power that is left unshot, as a share: under every bound of the table.
pub const UNSHOT_SHARE: f64 = 1e-5;

/// A scene's text in the making.
#[derive(Clone, Debug, Default)]
pub struct Setting {
    materials: String,
    surfaces: String,
}

impl Setting {
    /// A material of grey reflectance and exitance (W/m^2).
    pub fn material(mut self, name: &str, reflectance: f64, emission: f64) -> Setting {
        let _ = write!(
            self.materials,
            "[materials.{name}]\nreflectance = {reflectance:?}\nemission = {emission:?}\n"
        );
        self
    }

    /// A material of one reflectance a channel.
    pub fn coloured(mut self, name: &str, reflectance: [f64; 3]) -> Setting {
        let _ = write!(self.materials, "[materials.{name}]\nreflectance = {reflectance:?}\n");
        self
    }

    /// A surface; `shape` as in a scene file.
    pub fn surface(mut self, name: &str, material: &str, shape: &str) -> Setting {
        let _ = write!(self.surfaces, "[[surface]]\nname = \"{name}\"\nmaterial = \"{material}\"\n{shape}\n");
        self
    }

    /// A quad, counter-clockwise seen from its front.
    pub fn quad(self, name: &str, material: &str, corners: [[f64; 3]; 4]) -> Setting {
        self.surface(name, material, &format!("quad = {corners:?}"))
    }

    /// The six walls of a box, looking inwards.
    pub fn room(self, material: &str, low: [f64; 3], high: [f64; 3]) -> Setting {
        self.walls(material, low, high, &ROOM_WALLS)
    }

    /// The same without its ceiling.
    pub fn room_without_ceiling(self, material: &str, low: [f64; 3], high: [f64; 3]) -> Setting {
        self.walls(material, low, high, &ROOM_WALLS[1..])
    }

    fn walls(
        mut self,
        material: &str,
        low: [f64; 3],
        high: [f64; 3],
        walls: &[(&str, [usize; 4])],
    ) -> Setting {
        let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] });
        for &(name, corners) in walls {
            self = self.quad(name, material, corners.map(corner));
        }
        self
    }

    /// A light, as in a scene file.
    pub fn light(mut self, lines: &str) -> Setting {
        let _ = write!(self.surfaces, "[[light]]\n{lines}\n");
        self
    }

    /// The scene, meshed into about `elements` and solved.
    ///
    /// # Errors
    /// A scene that is not one.
    pub fn solve(&self, elements: u32) -> Result<Answer, ExperimentError> {
        solve_text(&self.text(), Some(elements))
    }

    /// As [`Setting::solve`], curved surfaces with at least `min_around` patches around, all power shot by kernel, however many
    /// patches there are.
    ///
    /// # Errors
    /// A scene that is not one.
    pub fn solve_by_kernel(&self, elements: u32, min_around: u32) -> Result<Answer, ExperimentError> {
        let meshing = |m: Meshing| Meshing { target: MeshTarget::Elements(elements), min_around, ..m };
        solve_so(&self.text(), meshing, SolveOptions { max_shooters: usize::MAX, ..SolveOptions::default() })
    }

    fn text(&self) -> String {
        format!("version = 1\n{}{}", self.materials, self.surfaces)
    }
}

/// Walls of a box by the bits of their corners (x, y, z from the lowest), fronts inside.
const ROOM_WALLS: [(&str, [usize; 4]); 6] = [
    ("ceiling", [4, 6, 7, 5]),
    ("floor", [0, 1, 3, 2]),
    ("south", [0, 4, 5, 1]),
    ("north", [2, 3, 7, 6]),
    ("west", [0, 2, 6, 4]),
    ("east", [1, 5, 7, 3]),
];

/// A scene file's text, meshed into about `elements` (or as it says) and solved.
///
/// # Errors
/// A scene that is not one.
pub fn solve_text(text: &str, elements: Option<u32>) -> Result<Answer, ExperimentError> {
    let meshing = |m: Meshing| Meshing { target: elements.map_or(m.target, MeshTarget::Elements), ..m };
    solve_with(text, meshing, FormFactorMethod::Vertex)
}

/// A scene file's text, its `[meshing]` changed, solved, power shot in one way or the other.
///
/// # Errors
/// A scene that is not one.
pub fn solve_with(
    text: &str,
    meshing: impl FnOnce(Meshing) -> Meshing,
    form_factors: FormFactorMethod,
) -> Result<Answer, ExperimentError> {
    solve_so(text, meshing, SolveOptions { form_factors, ..SolveOptions::default() })
}

/// The unshot share of the options is [`UNSHOT_SHARE`].
fn solve_so(
    text: &str,
    meshing: impl FnOnce(Meshing) -> Meshing,
    options: SolveOptions,
) -> Result<Answer, ExperimentError> {
    let mut scene = Scene::parse(text, Path::new("validation")).map_err(Box::new)?;
    scene.meshing = meshing(scene.meshing);
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let options = SolveOptions { unshot_share: UNSHOT_SHARE, ..options };
    let solution = solve(&scene, &mesh, &mut caster, &options, &mut |_| {})?;
    let surfaces = summarise(&scene, &mesh, &solution);
    Ok(Answer { scene, mesh, caster, solution, surfaces })
}

/// A solved scene. Materials are grey unless a case says otherwise: values are those of the green channel.
#[derive(Debug)]
pub struct Answer {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    caster: SoftwareCaster,
    /// Pass 1.
    pub solution: Solution,
    /// Per surface.
    pub surfaces: Vec<SurfaceSummary>,
}

impl Answer {
    /// Power that arrives on the surfaces whose names begin so (W).
    pub fn incident_w(&self, name: &str) -> f64 {
        self.surfaces.iter().filter(|s| s.name.starts_with(name)).map(|s| s.incident_w.0[1]).sum()
    }

    /// Power of all surfaces and lights (W).
    pub fn emitted_w(&self) -> f64 {
        self.solution.account.emitted_w.0[1]
    }

    /// What the account misses, over what was emitted.
    pub fn residual_share(&self) -> f64 {
        self.solution.account.residual_w.0[1] / self.emitted_w()
    }

    /// Area of the elements of the surfaces whose names begin so (m^2).
    pub fn area_m2(&self, name: &str) -> f64 {
        self.surfaces.iter().filter(|s| s.name.starts_with(name)).map(|s| s.area_m2).sum()
    }

    /// The surface mean of `M + rho E` farthest from `expected` (W/m^2).
    pub fn worst_radiosity(&self, expected: f64) -> f64 {
        farthest(self.surfaces.iter().map(|s| s.mean_radiosity_w_m2.0[1]), expected)
    }

    /// Irradiance at points with normals (W/m^2).
    ///
    /// # Errors
    /// None in software.
    pub fn probe(&mut self, points: &[(DVec3, DVec3)]) -> Result<Vec<SplitIrradiance>, ExperimentError> {
        let points: Vec<ProbePoint> = points.iter().map(|&(at, normal)| ProbePoint { at, normal }).collect();
        Ok(probe(&self.scene, &self.mesh, &self.solution, &mut self.caster, &points)?)
    }
}

/// The value farthest from `expected`; NaN when one is NaN or there is none.
pub fn farthest(values: impl Iterator<Item = f64>, expected: f64) -> f64 {
    let off = |x: f64| (x - expected).abs();
    values.reduce(|worst, x| if off(x) <= off(worst) { worst } else { x }).unwrap_or(f64::NAN)
}
