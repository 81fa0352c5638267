//! The scenes of the experiment, their meshes and references, and all methods on them.
//!
//! ```text
//! lit-cube     total light   integral over a converged solution (lit_cube.rs)     4 .. 32 elements a wall, even and graded
//! point-shadow direct light  closed form (shadows.rs)                             0.5 .. 0.125 m; with C-1 edges
//! penumbra     direct light  closed form (shadows.rs)                             likewise; with C0 edges
//! cornell-box  total light   dense solution in the same patches (nested.rs)       8 and 12 elements along the room
//! sphere-room  total light   likewise                                             one mesh
//! ```

use std::path::Path;

use super::lit_cube::{Light, LitCube};
use super::measure::{Case, Measured, Part, Way, ways};
use super::nested::{Dense, Nested};
use super::shadows::Shadow;
use crate::experiments::{ExperimentError, Extent};
use crate::mesh::Mesh;
use crate::radiosity::refine::flag_shadow_lines;
use crate::raycast::software::SoftwareCaster;
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
/// Ends the name of a mesh whose edges stand for lines of the shadow.
pub const LINES: &str = ", lines";

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

    /// A case of it; `lines`: edges that stand for the shadow's lines are C-1 or C0.
    ///
    /// # Errors
    /// None: it is shipped.
    pub fn case(&self, element_m: f64, grading: f64, lines: bool) -> Result<Case, ExperimentError> {
        let (scene, shadow) = self.scene(element_m, grading)?;
        let mut mesh = Mesh::build(&scene);
        if lines {
            let mut caster = SoftwareCaster::new(mesh.cast_patches());
            flag_shadow_lines(&scene, &mut mesh, &mut caster)?;
        }
        let values = shadow.vertex_values(&mesh);
        Case::with_values(&scene, mesh, &ROOM_PARTS, &shadow, values)
    }

    /// Over density, graded, and with chosen discontinuities.
    ///
    /// # Errors
    /// None: it is shipped.
    pub fn runs(&self, extent: Extent) -> Result<Vec<Run>, ExperimentError> {
        let even = |element_m| (element_m, 1.0, false);
        let lines = |element_m| (element_m, 1.0, true);
        let full = [even(0.5), even(0.25), even(0.125), (0.25, GRADING, false), lines(0.25), lines(0.125)];
        let quick = [even(0.5), even(0.25), lines(0.25)];
        let meshes: &[(f64, f64, bool)] = extent.pick(&full, &quick);
        let run = |&(element_m, grading, lines): &(f64, f64, bool)| {
            let case = self.case(element_m, grading, lines)?;
            let mut run = Run::of(self.name, element_m, grading > 1.0, &case, &ROOM_PARTS);
            if lines {
                run.mesh += LINES;
            }
            Ok(run)
        };
        meshes.iter().map(run).collect()
    }
}

/// A scene whose reference is a dense solution.
struct DenseScene {
    name: &'static str,
    text: &'static str,
    parts: &'static [Part],
    /// Longest elements (m) and grading, full and quick.
    meshes: [&'static [(f64, f64)]; 2],
    dense: Dense,
}

const DENSE: [DenseScene; 2] = [
    DenseScene {
        name: "cornell-box",
        text: include_str!("../../../scenes/cornell-box/scene.toml"),
        parts: &[("room", &["floor", "ceiling", "back", "green", "red"]), ("boxes", &["short", "tall"])],
        meshes: [&[(5.6 / 8.0, 1.0), (5.6 / 12.0, 1.0), (5.6 / 8.0, GRADING)], &[(5.6 / 8.0, 1.0)]],
        dense: Dense { splits: 3, dense_visibility: true },
    },
    DenseScene {
        name: "sphere-room",
        text: include_str!("../../../scenes/sphere-room/scene.toml"),
        parts: &[("room", &["floor", "ceiling", "wall"]), ("sphere and column", &["sphere", "column"])],
        meshes: [&[(0.5, 1.0)], &[]],
        // A sphere has 2,048 elements at least.
        dense: Dense { splits: 2, dense_visibility: false },
    },
];

/// The scenes without a closed form.
///
/// # Errors
/// None: they are shipped.
pub fn dense_runs(extent: Extent) -> Result<Vec<Run>, ExperimentError> {
    let mut runs = Vec::new();
    for DenseScene { name, text, parts, meshes, dense } in &DENSE {
        for &(element_m, grading) in extent.pick(meshes[0], meshes[1]) {
            let scene = meshed(name, text, element_m, grading)?;
            let quick = Dense { splits: 1, ..*dense };
            let (mesh, reference) = Nested::new(&scene, extent.pick(*dense, quick))?;
            let case = Case::new(&scene, mesh, parts, &reference)?;
            runs.push(Run::of(name, element_m, grading > 1.0, &case, parts));
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
