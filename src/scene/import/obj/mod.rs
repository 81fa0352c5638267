//! Wavefront OBJ and MTL, read by the crate `tobj` after every statement has been checked with its line.
//!
//! ```text
//! text --clean.rs: checked, lines joined, what is not needed left out--> text --tobj--> models per object and material
//! mtllib --mtl.rs: likewise--> materials        s, missing normals: per polygon, beside tobj
//! ```
//! Source: Alias|Wavefront, "Object Files (.obj)" and "MTL material format", versions 3.0 and 4.2. Everything is two-sided.
//! Not modelled: lines, points, free-form curves and surfaces, texture coordinates.

use std::cell::RefCell;
use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::super::SceneError;
use super::super::faces::RawFaces;
use super::{Model, Notes, Object, default_material, files, shown};
use crate::scene::MAX_FACES;

mod clean;
mod mtl;

/// A polygon without normals in a file that has some.
const NO_NORMAL: u32 = u32::MAX;

pub(super) fn load(path: &Path, folder: &Path, undressed: bool) -> Result<Model, SceneError> {
    let bytes = files::read(path, "a model file")?;
    let text = String::from_utf8_lossy(&bytes);
    let clean = clean::obj(path, &text, MAX_FACES)?;
    drop(text);
    drop(bytes);
    let mut notes = Notes::default();
    for what in &clean.left_out {
        notes.add("left out, only faces are read", what);
    }
    let libraries = RefCell::new(mtl::Libraries::new(folder, undressed));
    let load_library = |name: &Path| libraries.borrow_mut().load(path, name);
    let options = tobj::LoadOptions::default();
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(clean.text.as_bytes()), &options, load_library)
        .map_err(|e| SceneError::of_file(path, format!("not an OBJ file: {e}")))?;
    let (materials, fault) = libraries.into_inner().finish(&mut notes);
    if let Some(fault) = fault {
        return Err(fault);
    }
    let mut model = Model { materials, ..Model::default() };
    let default = model.materials.len();
    model.materials.push(default_material());
    collect(&mut model, models, &clean, default);
    let n_plain = model.objects.iter().filter(|o| o.material == default).count();
    if undressed {
        // Whatever it lacks, it does not show.
    } else if n_plain > 0 && default > 0 {
        notes.add(
            "objects without a material that exists are grey (reflectance 0.6)",
            &format!("{n_plain} objects"),
        );
    } else if n_plain > 0 {
        notes.add("no materials: everything is grey (reflectance 0.6)", &super::stem(path));
    }
    model.warnings = notes.lines(path);
    Ok(model)
}

/// One object per name and material; tobj starts another at every `usemtl`.
fn collect(model: &mut Model, parts: Vec<tobj::Model>, clean: &clean::Clean, default: usize) {
    let mut index: HashMap<(String, usize), usize> = HashMap::new();
    let mut polygon = 0;
    for part in parts {
        let material = part.mesh.material_id.filter(|&id| id < default).unwrap_or(default);
        let n = if part.mesh.face_arities.is_empty() {
            part.mesh.indices.len() / 3
        } else {
            part.mesh.face_arities.len()
        };
        let about = clean.polygons.get(polygon..polygon + n).unwrap_or(&[]);
        polygon += n;
        let at = *index.entry((part.name, material)).or_insert_with_key(|(name, _)| {
            let name = if name == "unnamed_object" { String::new() } else { name.clone() };
            model.objects.push(Object { name, material, faces: RawFaces::default(), two_sided: true });
            model.objects.len() - 1
        });
        append(&mut model.objects[at].faces, &part.mesh, about);
    }
    for object in &mut model.objects {
        let faces = &mut object.faces;
        if faces.corner_normals.iter().all(|&n| n == NO_NORMAL) {
            faces.corner_normals = Vec::new();
        }
        if faces.groups.iter().all(|&g| g == 0) {
            faces.groups = Vec::new();
        }
        if faces.arities.iter().all(|&n| n == 3) {
            faces.arities = Vec::new();
        }
    }
}

fn append(faces: &mut RawFaces, mesh: &tobj::Mesh, about: &[clean::Polygon]) {
    let (first_point, first_normal) = (faces.points.len() as u32, faces.normals.len() as u32);
    let vectors = |v: &[f64]| v.chunks_exact(3).map(DVec3::from_slice).collect::<Vec<_>>();
    faces.points.extend(vectors(&mesh.positions));
    faces.normals.extend(vectors(&mesh.normals));
    faces.corners.extend(mesh.indices.iter().map(|&i| first_point + i));
    let mut corner = 0;
    for (k, polygon) in about.iter().enumerate() {
        let n = mesh.face_arities.get(k).map_or(3, |&n| n as usize);
        faces.arities.push(n as u32);
        faces.groups.push(polygon.group);
        for c in corner..corner + n {
            let normal = mesh.normal_indices.get(c).filter(|_| polygon.has_normals);
            faces.corner_normals.push(normal.map_or(NO_NORMAL, |&i| first_normal + i));
        }
        corner += n;
    }
}

/// The file that `name` in `from` means, inside `folder`.
fn referred(folder: &Path, from: &Path, name: &str) -> Result<PathBuf, SceneError> {
    // Some programs write the separators of their own system.
    let name = name.replace('\\', "/");
    files::inside(folder, &super::folder_of(from), &name)
        .map_err(|message| SceneError::of_file(from, format!("{message} (as `{}`)", shown(&name))))
}
