//! The immutable scene: what a scene file says, checked and with every unit resolved.
//!
//! ```text
//! scene.toml --toml/--> raw tables with spans --checks--> Scene      (error.rs: file:line:column, value, expected)
//! model.obj, .gltf, .glb --import/--> polygons, materials, lights --faces/--> surfaces of many faces
//! ```
//! Lengths in metres, exitance in W/m^2 per channel and emitting side, angles in degrees where the name says so.
//! Format: version 1, described in scenes/README.md.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::units::Rgb;

mod continuity;
mod error;
pub(crate) mod faces;
mod import;
mod shape;
pub(crate) mod toml;

pub use continuity::{Continuity, SurfaceContinuity};
pub(crate) use error::line_column;
pub use error::{Place, SceneError};
pub use faces::{FaceCounts, FaceSet, MAX_FACES};
pub use import::MAX_MODEL_BYTES;

/// Index of a surface in [`Scene::surfaces`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SurfaceId(pub u32);

/// Index of a material in [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// A checked scene. Never changed after loading.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file it came from.
    pub path: PathBuf,
    /// The eye, when the file has one: only `render` needs it.
    pub camera: Option<Camera>,
    /// Materials in file order.
    pub materials: Vec<Material>,
    /// Surfaces in file order; at least one.
    pub surfaces: Vec<Surface>,
    /// Lights without area.
    pub lights: Vec<Light>,
    /// What was said by hand of the continuity between surfaces; no pair twice.
    pub continuity: Vec<SurfaceContinuity>,
    /// How finely to mesh.
    pub meshing: Meshing,
    /// What the user should know but what is no error (shown on stderr).
    pub warnings: Vec<String>,
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position (m).
    pub eye: DVec3,
    /// Point in the middle of the picture (m); differs from `eye`.
    pub target: DVec3,
    /// Up in the picture; not parallel to the view direction.
    pub up: DVec3,
    /// Vertical field of view, in (0, 180) degrees.
    pub fov_y_deg: f64,
}

/// How a surface treats light. reflectance + specular + transmission < 1 in every channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Unique name.
    pub name: String,
    /// Diffuse reflectance rho, in [0, 1).
    pub reflectance: Rgb,
    /// Mirror reflectance, in [0, 1).
    pub specular: Rgb,
    /// Share let through by glass (Fresnel applies on top), in [0, 1).
    pub transmission: Rgb,
    /// Index of refraction of glass.
    pub ior: f64,
}

/// One surface of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Unique name.
    pub name: String,
    /// What it is made of.
    pub material: MaterialId,
    /// Its geometry; the front is where vertices run counter-clockwise.
    pub shape: Shape,
    /// Both sides emit and reflect.
    pub two_sided: bool,
    /// Surfaces of one non-zero group continue each other where normals differ by under 40 degrees.
    pub smooth_group: u32,
    /// Exitance M per emitting side (W/m^2), resolved from whichever unit the file used.
    pub exitance: Rgb,
}

/// Geometry of a surface (m).
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Planar convex quadrilateral; front normal (v1 - v0) x (v2 - v0).
    Quad([DVec3; 4]),
    /// Triangle; front normal (v1 - v0) x (v2 - v0).
    Triangle([DVec3; 3]),
    /// Disk; `normal` (unit) points to its front.
    Disk {
        /// Centre.
        center: DVec3,
        /// Unit front normal.
        normal: DVec3,
        /// Radius, > 0.
        radius: f64,
    },
    /// Sphere; the front is outside unless `inward`.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius, > 0.
        radius: f64,
        /// The front is the inside.
        inward: bool,
    },
    /// Open tube between two points; the front is outside unless `inward`. Disks close it.
    Cylinder {
        /// Centre of one rim.
        base: DVec3,
        /// Centre of the other rim.
        top: DVec3,
        /// Radius, > 0.
        radius: f64,
        /// The front is the inside.
        inward: bool,
    },
    /// Many planar faces: a mesh from other software.
    Faces(Arc<FaceSet>),
}

/// A light without area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// Equal in all directions.
    Point {
        /// Position (m).
        position: DVec3,
        /// Radiant intensity (W/sr).
        intensity: Rgb,
    },
    /// Full inside `inner_deg` of the axis, nothing beyond `outer_deg`, falling as in glTF between.
    Spot {
        /// Position (m).
        position: DVec3,
        /// Unit axis.
        direction: DVec3,
        /// Radiant intensity on the axis (W/sr).
        intensity: Rgb,
        /// Half angle of the full cone (degrees).
        inner_deg: f64,
        /// Half angle where it ends (degrees).
        outer_deg: f64,
    },
    /// Parallel light from infinitely far.
    Directional {
        /// Unit direction of travel.
        direction: DVec3,
        /// Irradiance on a plane that faces it (W/m^2).
        irradiance: Rgb,
    },
}

impl Light {
    /// Its intensity (W/sr), or irradiance (W/m^2) where it is parallel.
    pub fn strength(&self) -> Rgb {
        match *self {
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity,
            Light::Directional { irradiance, .. } => irradiance,
        }
    }

    /// The same light of another strength.
    pub fn with_strength(mut self, strength: Rgb) -> Light {
        match &mut self {
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity = strength,
            Light::Directional { irradiance, .. } => *irradiance = strength,
        }
        self
    }

    /// The same light with its strength times `k`, by channel.
    pub fn scaled(&self, k: Rgb) -> Light {
        self.with_strength(self.strength() * k)
    }

    /// The two differ in their strength alone.
    pub fn shines_like(&self, other: &Light) -> bool {
        self.with_strength(Rgb::BLACK) == other.with_strength(Rgb::BLACK)
    }
}

/// How finely surfaces are cut into elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meshing {
    /// The wanted size.
    pub target: MeshTarget,
    /// Subdivide where light changes.
    pub adaptive: bool,
    /// How much finer quads are cut toward borders, those inside a smooth group excepted: part x of the way becomes x^this.
    /// 1: evenly.
    pub edge_grading: f64,
    /// Fewest patches around a disk or cylinder, and a third of it those of a sphere from pole to pole, however large elements
    /// may be. No key of the scene file: where a mesh is to be coarser or finer in all directions.
    pub min_around: u32,
}

impl Meshing {
    /// Of a cylinder that meets disks of the right area, the area is then 0.07 % too much; corners of a sphere stand 0.4 % of
    /// the radius outside.
    pub const MIN_AROUND: u32 = 48;
}

/// The wanted size of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeshTarget {
    /// About this many elements in the whole scene.
    Elements(u32),
    /// No element edge longer than this (m).
    MaxElementM(f64),
}

/// Largest element count that a scene file may ask for.
pub const MAX_ELEMENTS: u32 = 4_000_000;

impl Default for Meshing {
    fn default() -> Self {
        Meshing {
            target: MeshTarget::Elements(4000),
            adaptive: false,
            edge_grading: 1.0,
            min_around: Meshing::MIN_AROUND,
        }
    }
}

impl Scene {
    /// Reads and checks a scene file, or a model file (`.obj`, `.gltf`, `.glb`) as a scene of its own.
    ///
    /// # Errors
    /// Every fault of the file, with its place (file:line:column), the value, and what was expected.
    pub fn load(path: &Path) -> Result<Scene, SceneError> {
        if Scene::is_model_file(path) {
            return import::load_standalone(path);
        }
        toml::load(path)
    }

    /// Whether a file's name is that of a model file, which [`Scene::load`] reads as a scene of its own.
    pub fn is_model_file(path: &Path) -> bool {
        import::is_model(path)
    }

    /// Checks the text of a scene file that would stand at `path`.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Scene, SceneError> {
        toml::parse(text, path)
    }

    /// The surface of a name.
    pub fn surface_named(&self, name: &str) -> Option<SurfaceId> {
        self.surfaces.iter().position(|s| s.name == name).map(|i| SurfaceId(i as u32))
    }

    /// The material of a surface.
    pub fn material(&self, surface: &Surface) -> &Material {
        &self.materials[surface.material.0 as usize]
    }
}
