//! glTF 2.0 and GLB: the JSON by the crate `gltf`, everything that it points at checked before it is read.
//!
//! ```text
//! file --container.rs--> JSON, buffers --crate gltf--> Root --nodes.rs--> nodes with world matrices, no cycles
//!   meshes --primitive.rs, accessor.rs--> polygons in metres    materials --material.rs--> shares of light, exitance
//! ```
//! Source: Khronos Group, glTF 2.0 specification, with KHR_lights_punctual, KHR_materials_emissive_strength,
//! KHR_materials_ior, KHR_materials_transmission, KHR_mesh_quantization. Luminance (cd/m^2) and intensities (cd, lx)
//! become watts by the 179 lm/W of the whole program, channel by channel. `doubleSided` tells whether a surface has two
//! sides. Not modelled: skins, morph targets, animation, sparse accessors, compressed geometry.

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat4, DVec3};
use gltf::json::validation::{Checked, Error as Invalid, Validate};
use gltf::json::{self, Root};

use super::super::SceneError;
use super::{Model, Notes, Object, default_material, shown, stem};
use crate::scene::{Camera, Light};
use crate::units::{LUMENS_PER_WATT, Rgb};

mod accessor;
mod container;
mod material;
mod nodes;
mod primitive;

/// Extensions that change only what is not modelled, or that are read.
const KNOWN: [&str; 16] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_specular",
    "KHR_materials_clearcoat",
    "KHR_materials_sheen",
    "KHR_materials_volume",
    "KHR_materials_variants",
    "KHR_materials_iridescence",
    "KHR_materials_anisotropy",
    "KHR_materials_dispersion",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_texture_webp",
];

pub(super) fn load(path: &Path, folder: &Path, undressed: bool) -> Result<Model, SceneError> {
    let container::Container { root, json_text, bin } = container::open(path)?;
    check(path, &root)?;
    let buffers = container::buffers(path, folder, &root, bin)?;
    drop(json_text);
    let mut notes = Notes::default();
    for extension in root.extensions_used.iter().filter(|e| !KNOWN.contains(&e.as_str())) {
        notes.add("extensions that are not read", extension);
    }
    if !root.animations.is_empty() || !root.skins.is_empty() {
        notes.add("animation and skins are not read: the rest pose is shown", &stem(path));
    }
    let file = File { path, folder, root: &root, buffers: &buffers };
    let materials = if undressed { material::none(&file) } else { material::all(&file, &mut notes)? };
    let mut model = Model { materials, ..Model::default() };
    let default = model.materials.len();
    model.materials.push(default_material());
    let mut n_triangles = 0;
    for (index, world) in nodes::visible(path, &root)? {
        let node = &root.nodes[index];
        let mesh = node.mesh.and_then(|m| root.get(m));
        if let Some(mesh) = mesh {
            let name =
                node.name.clone().or_else(|| mesh.name.clone()).unwrap_or_else(|| format!("node {index}"));
            let mut by_material: HashMap<usize, usize> = HashMap::new();
            for (p, part) in mesh.primitives.iter().enumerate() {
                let place = || format!("primitive {p} of node '{}'", shown(&name));
                let material = part.material.map_or(default, |m| m.value());
                let at = *by_material.entry(material).or_insert_with(|| {
                    let two_sided = part.material.and_then(|m| root.get(m)).is_some_and(|m| m.double_sided);
                    let faces = Default::default();
                    model.objects.push(Object { name: name.clone(), material, faces, two_sided });
                    model.objects.len() - 1
                });
                let faces = &mut model.objects[at].faces;
                let added = primitive::append(&file, part, &world, faces, n_triangles)
                    .map_err(|e| SceneError::of_file(path, format!("{}: {e}", place())))?;
                match added {
                    Some(n) => n_triangles += n,
                    None => notes.add("points and lines are left out, only faces are read", &name),
                }
            }
        }
        if let Some(camera) = node.camera.and_then(|c| root.get(c)) {
            match lens(path, camera, &world)? {
                Some(camera) => model.camera = model.camera.or(Some(camera)),
                None => notes.add("parallel cameras are left out", node.name.as_deref().unwrap_or("camera")),
            }
        }
        let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(light) = light.and_then(|l| root.get(l.light)) {
            let name = light.name.as_deref().or(node.name.as_deref()).unwrap_or("light");
            let made = lamp(light, &world).map_err(|message| {
                SceneError::of_file(path, format!("light '{}': {message}", shown(name)))
            })?;
            if light.range.is_some() {
                notes.add("`range` of lights is not modelled: their light goes on", name);
            }
            model.lights.extend(made);
        }
    }
    model.objects.retain(|o| !o.faces.corners.is_empty());
    for object in &mut model.objects {
        if object.faces.corner_normals.iter().all(|&n| n == u32::MAX) {
            object.faces.corner_normals = Vec::new();
        }
    }
    model.warnings = notes.lines(path);
    Ok(model)
}

/// An opened file with its buffers.
struct File<'a> {
    path: &'a Path,
    folder: &'a Path,
    root: &'a Root,
    buffers: &'a [Vec<u8>],
}

/// What the crate finds wrong, by the path of the value, and required extensions that are not read.
fn check(path: &Path, root: &Root) -> Result<(), SceneError> {
    if let Some(extension) = root.extensions_required.iter().find(|e| !KNOWN.contains(&e.as_str())) {
        let what = match extension.as_str() {
            "KHR_draco_mesh_compression" | "EXT_meshopt_compression" => "compressed geometry",
            _ => "an extension that it requires",
        };
        let message = format!("needs {}: {what} is not read, expected a file without it", shown(extension));
        return Err(SceneError::of_file(path, message));
    }
    // The crate's own check looks up positions before it has checked their index.
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let positions = primitive.attributes.get(&Checked::Valid(json::mesh::Semantic::Positions));
            if let Some(index) = positions.filter(|i| i.value() >= root.accessors.len()) {
                let message = format!(
                    "meshes[{m}].primitives[{p}].attributes: POSITION is accessor {} of {}, past the end of its list",
                    index.value(),
                    root.accessors.len()
                );
                return Err(SceneError::of_file(path, message));
            }
        }
    }
    let mut first: Option<String> = None;
    root.validate(root, json::Path::new, &mut |at, error| {
        let at = at().as_str().to_owned();
        let what = match error {
            Invalid::Unsupported => return,
            // Bounds that some writers leave out; nothing here needs them.
            Invalid::Missing if at.ends_with("min") || at.ends_with("max") => return,
            Invalid::Missing => "is missing",
            Invalid::IndexOutOfBounds => "points past the end of its list",
            Invalid::Oversize => "is too large",
            Invalid::Invalid => "has no valid value",
        };
        first.get_or_insert_with(|| format!("{at} {what}"));
    });
    match first {
        Some(message) => Err(SceneError::of_file(path, message)),
        None => Ok(()),
    }
}

/// A camera that looks along -z of its node, +y up; `None` for a parallel one.
fn lens(path: &Path, camera: &json::Camera, world: &DMat4) -> Result<Option<Camera>, SceneError> {
    let Some(perspective) = &camera.perspective else { return Ok(None) };
    let fov_y_deg = f64::from(perspective.yfov).to_degrees();
    let axis = |v: DVec3| world.transform_vector3(v).try_normalize();
    match (axis(DVec3::NEG_Z), axis(DVec3::Y)) {
        (Some(view), Some(up)) if fov_y_deg > 0.0 && fov_y_deg < 180.0 && view.cross(up).length() > 1e-6 => {
            let eye = world.w_axis.truncate();
            Ok(Some(Camera { eye, target: eye + view, up, fov_y_deg }))
        }
        _ => {
            let message = format!(
                "a camera of yfov {} rad in a flat node, expected an angle under pi",
                perspective.yfov
            );
            Err(SceneError::of_file(path, message))
        }
    }
}

/// A light without area, W from lm by 179 lm/W; `None` for a black one.
fn lamp(
    light: &json::extensions::scene::khr_lights_punctual::Light,
    world: &DMat4,
) -> Result<Option<Light>, String> {
    use json::extensions::scene::khr_lights_punctual::Type;
    let photometric = Rgb(light.color.map(f64::from)) * f64::from(light.intensity);
    let watts = photometric / LUMENS_PER_WATT;
    if !watts.0.iter().all(|c| (0.0..=1e12).contains(c)) {
        return Err(format!(
            "color {:?} x intensity {}, expected an amount of light from 0 to 1e12 W",
            light.color, light.intensity
        ));
    }
    if watts.is_black() {
        return Ok(None);
    }
    let position = world.w_axis.truncate();
    let direction = world.transform_vector3(DVec3::NEG_Z).try_normalize();
    let direction = || direction.ok_or("a node without a direction".to_owned());
    Ok(Some(match light.type_ {
        Checked::Valid(Type::Directional) => {
            Light::Directional { direction: direction()?, irradiance: watts }
        }
        Checked::Valid(Type::Spot) => {
            let (inner, outer) = light
                .spot
                .as_ref()
                .map_or((0.0, std::f32::consts::FRAC_PI_4), |s| (s.inner_cone_angle, s.outer_cone_angle));
            let (inner_deg, outer_deg) = (f64::from(inner).to_degrees(), f64::from(outer).to_degrees());
            // A right angle in single precision may be a little more than one.
            if !(inner_deg >= 0.0 && inner_deg < outer_deg && outer_deg <= 90.0 + 1e-4) {
                return Err(format!("cone of {inner} to {outer} rad, expected 0 <= inner < outer <= pi/2"));
            }
            let outer_deg = outer_deg.min(90.0);
            Light::Spot { position, direction: direction()?, intensity: watts, inner_deg, outer_deg }
        }
        _ => Light::Point { position, intensity: watts },
    }))
}
