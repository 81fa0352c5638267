//! Meshes from other software: a model file becomes surfaces, materials, lights and a camera.
//!
//! ```text
//! .obj (+ .mtl) --obj/-->            } Model: polygons per object and material, in metres of the file
//! .gltf (+ .bin), .glb --gltf/-->    }
//! Model, Placement --place.rs--> surfaces of a scene (faces/: welded, cleaned, joined, smoothed)
//! Model alone --standalone.rs--> Scene: a camera that frames it and light, where the file has none
//! ```
//! Textures become their mean color (texture.rs). Nothing is read from outside the model's folder (files.rs).
//! Not modelled: skins, morph targets, animation (the rest pose is read), lines and points, free-form curves.

use std::path::{Path, PathBuf};

use super::faces::RawFaces;
use super::{Camera, Light, Material, SceneError};
use crate::units::Rgb;

mod files;
mod gltf;
mod obj;
mod place;
mod standalone;
mod texture;

pub(super) use files::inside;
pub(super) use place::{Names, Placement, Target, unique};
pub(super) use standalone::load as load_standalone;

/// Largest model file, buffer or material library (bytes).
pub const MAX_MODEL_BYTES: u64 = 512 << 20;

/// Diffuse, mirrored and transmitted shares are scaled to this sum where a file's reach 1: files say white and mean it.
const LARGEST_SHARE: f64 = 0.95;

/// Reflectance of what a file gives no material.
const DEFAULT_REFLECTANCE: f64 = 0.6;

/// Roughness up to which a metal is a mirror.
const MIRROR_ROUGHNESS: f64 = 0.1;

/// Roughness from which a metal is taken as diffuse: its lobe is about as wide.
const DIFFUSE_ROUGHNESS: f64 = 0.5;

/// Metal below this share is no more than a coat.
const MIN_METALLIC: f64 = 0.1;

/// A model file, checked: every index in range, every number finite.
#[derive(Clone, Debug, Default)]
pub(super) struct Model {
    /// Objects; one per name (or node) and material.
    pub(super) objects: Vec<Object>,
    /// What they are made of.
    pub(super) materials: Vec<ModelMaterial>,
    /// The first camera of the file.
    pub(super) camera: Option<Camera>,
    /// Lights without area.
    pub(super) lights: Vec<Light>,
    /// What the user should know.
    pub(super) warnings: Vec<String>,
}

/// Polygons of one object and one material.
#[derive(Clone, Debug)]
pub(super) struct Object {
    /// Its name in the file; not unique.
    pub(super) name: String,
    /// Index into the model's materials.
    pub(super) material: usize,
    /// Its polygons, in the file's unit of length.
    pub(super) faces: RawFaces,
    /// Both sides emit and reflect.
    pub(super) two_sided: bool,
}

/// A material of a model.
#[derive(Clone, Debug)]
pub(super) struct ModelMaterial {
    /// How it treats light.
    pub(super) material: Material,
    /// Exitance M per emitting side (W/m^2).
    pub(super) exitance: Rgb,
}

/// Formats, by extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Obj,
    Gltf,
    Glb,
}

impl Format {
    /// The format that a file's name tells.
    pub(super) fn of(path: &Path) -> Option<Format> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Format::Obj),
            "gltf" => Some(Format::Gltf),
            "glb" => Some(Format::Glb),
            _ => None,
        }
    }
}

/// Whether the name is that of a model file.
pub(super) fn is_model(path: &Path) -> bool {
    Format::of(path).is_some()
}

/// Reads a model file; what it refers to must lie in `folder`. `undressed`: its materials are not wanted.
pub(super) fn load(path: &Path, folder: &Path, undressed: bool) -> Result<Model, SceneError> {
    let model = match Format::of(path) {
        Some(Format::Obj) => obj::load(path, folder, undressed),
        Some(Format::Gltf | Format::Glb) => gltf::load(path, folder, undressed),
        None => Err(SceneError::of_file(path, "expected a model file: .obj, .gltf or .glb")),
    }?;
    if model.objects.is_empty() {
        return Err(SceneError::of_file(path, "no faces in it, expected at least one"));
    }
    Ok(model)
}

/// A material whose shares sum to under 1: scaled where a file's do not. True when that was needed.
fn bounded(mut material: Material) -> (Material, bool) {
    let total = (material.reflectance + material.specular + material.transmission).max_channel();
    if total < 1.0 {
        return (material, false);
    }
    let scale = LARGEST_SHARE / total;
    material.reflectance = material.reflectance * scale;
    material.specular = material.specular * scale;
    material.transmission = material.transmission * scale;
    (material, true)
}

/// Share of a metal's reflection that is taken as diffuse: 0 for a mirror, 1 for a rough metal (with a note).
///
/// A rough mirror between the two is what the solver has no model for: refused by name.
fn metal(name: &str, metallic: f64, roughness: f64, notes: &mut Notes) -> Result<f64, String> {
    if roughness <= MIRROR_ROUGHNESS {
        return Ok(0.0);
    }
    if roughness >= DIFFUSE_ROUGHNESS || metallic < MIN_METALLIC {
        notes.add("rough metal is taken as diffuse", name);
        return Ok(1.0);
    }
    Err(format!(
        "material '{}': rough specular reflection (metallic {metallic:.2}, roughness {roughness:.2}) is not modelled, \
         expected roughness up to {MIRROR_ROUGHNESS} (a mirror) or from {DIFFUSE_ROUGHNESS} (taken as diffuse); \
         `material` of a [[mesh]] in a scene file puts another material in its place",
        shown(name)
    ))
}

/// The material of what a file gives none.
fn default_material() -> ModelMaterial {
    ModelMaterial {
        material: Material {
            name: "default".to_owned(),
            reflectance: Rgb::splat(DEFAULT_REFLECTANCE),
            specular: Rgb::BLACK,
            transmission: Rgb::BLACK,
            ior: 1.5,
        },
        exitance: Rgb::BLACK,
    }
}

/// The warnings of one file, each told once with how often it came.
#[derive(Debug, Default)]
struct Notes {
    notes: Vec<(String, Vec<String>)>,
}

impl Notes {
    /// Something about `whom`.
    fn add(&mut self, what: &str, whom: &str) {
        match self.notes.iter_mut().find(|(known, _)| known == what) {
            Some((_, names)) => names.push(whom.to_owned()),
            None => self.notes.push((what.to_owned(), vec![whom.to_owned()])),
        }
    }

    /// One line a note, with the first few names.
    fn lines(self, path: &Path) -> Vec<String> {
        const NAMED: usize = 3;
        let line = |(what, names): (String, Vec<String>)| {
            let named: Vec<String> = names.iter().take(NAMED).map(|n| format!("'{}'", shown(n))).collect();
            let more = if names.len() > NAMED {
                format!(" and {} more", names.len() - NAMED)
            } else {
                String::new()
            };
            format!("{}: {what}: {}{more}", path.display(), named.join(", "))
        };
        self.notes.into_iter().map(line).collect()
    }
}

/// A name of a file for one line of a message: short, no control characters.
fn shown(name: &str) -> String {
    name.chars().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The file's stem: what objects without a name are called.
pub(super) fn stem(path: &Path) -> String {
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    if stem.is_empty() { "model".to_owned() } else { shown(&stem) }
}

/// The folder of a file.
pub(super) fn folder_of(path: &Path) -> PathBuf {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned()
}

#[cfg(test)]
mod tests;
