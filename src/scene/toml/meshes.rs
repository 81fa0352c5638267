//! `[[mesh]]`: a model file's objects as surfaces, scaled, turned and moved, its lights, and its camera where there is none.
//!
//! ```text
//! file (inside the scene's folder) --import/--> Model --unit, scale, rotate_deg, translate, material--> surfaces, lights
//! ```

use std::path::Path;

use glam::DVec3;
use toml::Spanned;

use super::super::import::{self, Model, Names, Placement, Target};
use super::super::{Camera, Light, Material, MaterialId, SceneError, Surface};
use super::faults::suggest;
use super::materials::{Emission, Materials};
use super::raw::{RawMesh, RawUnit};
use super::source::Source;
use super::value::{MAX_LIGHT, Table};

/// What meshes add to, or are added to.
pub(super) struct Parts<'a> {
    pub(super) camera: &'a mut Option<Camera>,
    pub(super) materials: &'a mut Materials,
    pub(super) surfaces: &'a mut Vec<Surface>,
    pub(super) lights: &'a mut Vec<Light>,
    pub(super) warnings: &'a mut Vec<String>,
}

pub(super) fn add(
    source: &Source<'_>,
    meshes: &[Spanned<Table<RawMesh>>],
    parts: &mut Parts<'_>,
) -> Result<(), SceneError> {
    let mut names: Names = parts.surfaces.iter().map(|s| (s.name.clone(), 2)).collect();
    let mut material_names: Names = parts.materials.list.iter().map(|m| (m.name.clone(), 2)).collect();
    let mut n_faces = 0;
    for mesh in meshes {
        let Table(mesh) = mesh.get_ref();
        let path = file(source, &mesh.file)?;
        let own = own_material(source, mesh, parts.materials)?;
        let from = || {
            let (line, column) = super::super::error::line_column(source.text, mesh.file.span().start);
            format!("a [[mesh]] of {}:{line}:{column}", source.path.display())
        };
        let mut model = import::load(&path, &import::folder_of(source.path), own.is_some())
            .map_err(|fault| fault.with_help(from()))?;
        let placement = placement(mesh);
        let prefix = format!("{}/", import::stem(&path));
        let first = parts.materials.list.len();
        if own.is_none() {
            add_materials(parts.materials, &mut material_names, &model, &prefix);
        }
        let emission = &parts.materials.emission;
        let dress = |material: usize, area_m2: f64, n_sides: u32| {
            let id = own.map_or(first + material, |m| m.0 as usize);
            (MaterialId(id as u32), emission[id].exitance(area_m2, n_sides))
        };
        let first_surface = parts.surfaces.len();
        Target {
            surfaces: parts.surfaces,
            names: &mut names,
            n_faces: &mut n_faces,
            warnings: parts.warnings,
        }
        .add(&path, &mut model, &placement, &prefix, &dress)
        .map_err(|fault| fault.with_help(from()))?;
        for surface in &parts.surfaces[first_surface..] {
            let largest = surface.exitance.max_channel();
            if largest.is_nan() || largest > MAX_LIGHT {
                let message = format!(
                    "surface {:?} would emit {largest:e} W/m^2, expected at most {MAX_LIGHT:e}",
                    surface.name
                );
                return Err(source.fault(mesh.file.span(), message));
            }
        }
        parts.lights.extend(model.lights.iter().map(|&light| placement.light(light)));
        if parts.camera.is_none() {
            *parts.camera = model.camera.map(|camera| placement.camera(camera));
        }
    }
    Ok(())
}

/// The model file, inside the scene's folder.
fn file(source: &Source<'_>, given: &Spanned<String>) -> Result<std::path::PathBuf, SceneError> {
    let fault = |message: String| source.fault(given.span(), message);
    let file = given.get_ref();
    let folder = import::folder_of(source.path);
    let full = import::inside(&folder, &folder, file).map_err(|e| fault(format!("mesh file {e}")))?;
    if Path::new(file).extension().is_some_and(|e| e.eq_ignore_ascii_case("ies")) {
        let message =
            format!("mesh file {file:?}: IES photometric files are not read, expected .obj, .gltf or .glb");
        return Err(fault(message));
    }
    if !import::is_model(Path::new(file)) {
        return Err(fault(format!("mesh file {file:?}, expected .obj, .gltf or .glb")));
    }
    if !full.is_file() {
        return Err(fault(format!("no such mesh file: {:?}", full.display().to_string())));
    }
    Ok(full)
}

/// The scene's own material for all of a mesh.
fn own_material(
    source: &Source<'_>,
    mesh: &RawMesh,
    materials: &Materials,
) -> Result<Option<MaterialId>, SceneError> {
    let Some(wanted) = &mesh.material else { return Ok(None) };
    let name = wanted.get_ref();
    if let Some(&id) = materials.by_name.get(name) {
        return Ok(Some(id));
    }
    let message = format!("unknown material {name:?}, expected a table [materials.{name}]");
    let fault = source.fault(wanted.span(), message);
    Err(suggest(fault, name, materials.list.iter().map(|m| m.name.as_str())))
}

/// The model's materials under names of their own, in its order.
fn add_materials(materials: &mut Materials, names: &mut Names, model: &Model, prefix: &str) {
    for given in &model.materials {
        let name = import::unique(names, format!("{prefix}{}", given.material.name));
        materials.list.push(Material { name, ..given.material.clone() });
        materials.emission.push(Emission::Exitance(given.exitance));
    }
}

fn placement(mesh: &RawMesh) -> Placement {
    let unit_m = match mesh.unit {
        None | Some(RawUnit::M) => 1.0,
        Some(RawUnit::Cm) => 0.01,
        Some(RawUnit::Mm) => 0.001,
        Some(RawUnit::In) => 0.0254,
    };
    Placement {
        scale: unit_m * mesh.scale.map_or(1.0, |s| s.0),
        rotation: Placement::turned(mesh.rotate_deg.map_or(DVec3::ZERO, |r| r.to_dvec3())),
        translate: mesh.translate.map_or(DVec3::ZERO, |t| t.to_dvec3()),
    }
}

#[cfg(test)]
mod tests;
