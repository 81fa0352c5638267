//! The scenes of the experiment, their meshes and references, and all methods on them.
//!
//! ```text
//! lit-cube     total light   integral over a converged solution (lit_cube.rs)     4 .. 32 elements a wall, even and graded
//! point-shadow direct light  closed form (shadows.rs)                             0.5, 0.25, 0.125 m
//! penumbra     direct light  closed form (shadows.rs)                             likewise
//! cornell-box  total light   dense solution in the same patches (nested.rs)       16 and 8 elements along the room
//! sphere-room  total light   likewise                                             one mesh
//! ```

use std::path::Path;

use super::lit_cube::{Light, LitCube};
use super::measure::{Case, Measured, Part, Way, ways};
use super::nested::Nested;
use super::shadows::Shadow;
use crate::experiments::{ExperimentError, Extent};
use crate::mesh::Mesh;
use crate::reconstruct::metrics::Reference;
use crate::scene::{MeshTarget, Scene};

/// Exponent of the graded meshes.
pub const GRADING: f64 = 2.0;
/// Elements along a wall of the lit cube at which the targets are stated.
pub const STATED: u32 = 8;
/// Parts of the lit cube: sides are alike.
pub const CUBE_PARTS: [Part; 3] =
    [("floor", &["floor"]), ("side wall", &["wall-x0"]), ("lamp's wall", &["ceiling"])];
/// Parts of the rooms with a shadow.
const ROOM_PARTS: [Part; 2] = [("floor", &["floor"]), ("walls", &["wall"])];
/// Splits of an element in dense solutions.
const SPLITS: u32 = 3;

const CUBE: &str = include_str!("../../../scenes/lit-cube/scene.toml");

/// All methods on one mesh.
pub struct Run {
    /// Its scene.
    pub scene: &'static str,
    /// How it is meshed.
    pub mesh: String,
    /// Longest element (m).
    pub element_m: f64,
    /// Graded toward borders.
    pub graded: bool,
    /// Elements that count.
    pub n_elements: usize,
    /// Names of its parts.
    pub parts: Vec<&'static str>,
    /// Every method.
    pub rows: Vec<(Way, Measured)>,
}

impl Run {
    fn of(scene: &'static str, element_m: f64, graded: bool, case: &Case, parts: &[Part]) -> Run {
        let mesh = format!("{element_m:.4} m{}", if graded { ", graded" } else { "" });
        Run {
            scene,
            mesh,
            element_m,
            graded,
            n_elements: case.n_elements(),
            parts: parts.iter().map(|p| p.0).collect(),
            rows: ways().into_iter().map(|way| (way, case.measure(&way, true))).collect(),
        }
    }

    /// What a method did.
    ///
    /// # Panics
    /// When it was not run.
    pub fn by(&self, name: &str) -> &Measured {
        let found = self.rows.iter().find(|(way, _)| way.name == name);
        &found.unwrap_or_else(|| panic!("{}: {name} was not run", self.scene)).1
    }
}

/// A shipped scene with another size of elements and another grading.
fn meshed(name: &str, text: &str, element_m: f64, grading: f64) -> Result<Scene, ExperimentError> {
    let path = format!("scenes/{name}/scene.toml");
    let mut scene = Scene::parse(text, Path::new(&path)).map_err(Box::new)?;
    scene.meshing.target = MeshTarget::MaxElementM(element_m);
    scene.meshing.edge_grading = grading;
    Ok(scene)
}

/// The lit cube at `n` elements a wall.
///
/// # Errors
/// None: it is shipped.
pub fn cube_scene(n: u32, grading: f64) -> Result<Scene, ExperimentError> {
    meshed("lit-cube", CUBE, 1.0 / f64::from(n), grading)
}

/// One light of the lit cube at `n` elements a wall.
///
/// # Errors
/// None: it is shipped.
pub fn cube_case(cube: &LitCube, n: u32, grading: f64, light: Light) -> Result<Case, ExperimentError> {
    let scene = cube_scene(n, grading)?;
    Case::new(&scene, Mesh::build(&scene), &CUBE_PARTS, &cube.light(light))
}

/// The lit cube over density, even and graded: of all light.
///
/// # Errors
/// None: it is shipped.
pub fn cube_runs(cube: &LitCube, extent: Extent) -> Result<Vec<Run>, ExperimentError> {
    let densities: &[u32] = extent.pick(&[4, 8, 16, 32], &[4, STATED]);
    let mut runs = Vec::new();
    for grading in [1.0, GRADING] {
        // With two patches a wall grading moves nothing.
        for &n in densities.iter().filter(|n| grading == 1.0 || **n > 4) {
            let case = cube_case(cube, n, grading, Light::Total)?;
            runs.push(Run::of("lit-cube", 1.0 / f64::from(n), grading > 1.0, &case, &CUBE_PARTS));
        }
    }
    Ok(runs)
}

/// A scene with a shadow.
#[derive(Clone, Copy, Debug)]
pub struct ShadowScene {
    /// Its name.
    pub name: &'static str,
    text: &'static str,
}

/// The shadow of a point light.
pub const POINT_SHADOW: ShadowScene =
    ShadowScene { name: "point-shadow", text: include_str!("../../../scenes/point-shadow/scene.toml") };
/// The penumbra of a lamp.
pub const PENUMBRA: ShadowScene =
    ShadowScene { name: "penumbra", text: include_str!("../../../scenes/penumbra/scene.toml") };

impl ShadowScene {
    /// The scene and its direct light.
    ///
    /// # Errors
    /// None: it is shipped.
    pub fn scene(&self, element_m: f64, grading: f64) -> Result<(Scene, Shadow), ExperimentError> {
        let scene = meshed(self.name, self.text, element_m, grading)?;
        let shadow = Shadow::of(&scene)?;
        Ok((scene, shadow))
    }

    /// A case of it.
    ///
    /// # Errors
    /// None: it is shipped.
    pub fn case(&self, element_m: f64, grading: f64) -> Result<Case, ExperimentError> {
        let (scene, shadow) = self.scene(element_m, grading)?;
        Case::new(&scene, Mesh::build(&scene), &ROOM_PARTS, &shadow)
    }

    /// Over density, and graded.
    ///
    /// # Errors
    /// None: it is shipped.
    pub fn runs(&self, extent: Extent) -> Result<Vec<Run>, ExperimentError> {
        let meshes: &[(f64, f64)] = extent
            .pick(&[(0.5, 1.0), (0.25, 1.0), (0.125, 1.0), (0.25, GRADING)], &[(0.5, 1.0), (0.25, 1.0)]);
        let run = |&(element_m, grading): &(f64, f64)| {
            let case = self.case(element_m, grading)?;
            Ok(Run::of(self.name, element_m, grading > 1.0, &case, &ROOM_PARTS))
        };
        meshes.iter().map(run).collect()
    }
}

/// A scene whose reference is a dense solution.
struct DenseScene {
    name: &'static str,
    text: &'static str,
    parts: &'static [Part],
    /// Longest elements (m), full and quick.
    elements_m: [&'static [f64]; 2],
}

const DENSE: [DenseScene; 2] = [
    DenseScene {
        name: "cornell-box",
        text: include_str!("../../../scenes/cornell-box/scene.toml"),
        parts: &[("room", &["floor", "ceiling", "back", "green", "red"]), ("boxes", &["short", "tall"])],
        elements_m: [&[5.6 / 8.0, 5.6 / 16.0], &[5.6 / 8.0]],
    },
    DenseScene {
        name: "sphere-room",
        text: include_str!("../../../scenes/sphere-room/scene.toml"),
        parts: &[("room", &["floor", "ceiling", "wall"]), ("sphere and column", &["sphere", "column"])],
        elements_m: [&[0.5], &[]],
    },
];

/// The scenes without a closed form.
///
/// # Errors
/// None: they are shipped.
pub fn dense_runs(extent: Extent) -> Result<Vec<Run>, ExperimentError> {
    let mut runs = Vec::new();
    for DenseScene { name, text, parts, elements_m } in &DENSE {
        for &element_m in extent.pick(elements_m[0], elements_m[1]) {
            let gradings: &[f64] = extent.pick(&[1.0, GRADING], &[1.0]);
            for &grading in gradings {
                let scene = meshed(name, text, element_m, grading)?;
                let (mesh, reference) = Nested::new(&scene, extent.pick(SPLITS, 1))?;
                let case = Case::new(&scene, mesh, parts, &reference)?;
                runs.push(Run::of(name, element_m, grading > 1.0, &case, parts));
            }
        }
    }
    Ok(runs)
}

/// Relative L2 errors of one light, even and graded meshes of one count.
pub struct Graded {
    /// Direct or indirect.
    pub light: Light,
    /// Elements a wall.
    pub n: u32,
    /// Method.
    pub way: Way,
    /// Per part, then all: even, graded.
    pub l2: Vec<[f64; 2]>,
}

/// What grading gains for a way, a light and a density at a time.
///
/// # Errors
/// None: it is shipped.
pub fn graded(cube: &LitCube, densities: &[u32], of: &[Way]) -> Result<Vec<Graded>, ExperimentError> {
    let mut out = Vec::new();
    for &n in densities {
        for light in [Light::Indirect, Light::Direct] {
            let cases = [cube_case(cube, n, 1.0, light)?, cube_case(cube, n, GRADING, light)?];
            for way in of {
                let [even, graded] = cases.each_ref().map(|case| case.measure(way, false));
                let pairs = even.parts.iter().zip(&graded.parts).map(|(e, g)| [e.l2, g.l2]);
                let l2 = pairs.chain([[even.all.l2, graded.all.l2]]).collect();
                out.push(Graded { light, n, way: *way, l2 });
            }
        }
    }
    Ok(out)
}

/// A scene's mesh with the reference at its vertices: for pictures, where nothing is measured.
pub fn dense_values(scene: &Scene, reference: &impl Reference) -> (Mesh, Vec<crate::units::Rgb>) {
    let mesh = Mesh::build(scene);
    let values = crate::reconstruct::metrics::vertex_values(&mesh, reference);
    (mesh, values)
}
