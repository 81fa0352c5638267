//! `[[mesh]]`: not supported yet. A path outside the scene's folder and a missing file are told first.

use std::path::{Component, Path};

use toml::Spanned;

use super::super::SceneError;
use super::raw::RawMesh;
use super::source::Source;
use super::value::Table;

pub(super) fn refuse(source: &Source<'_>, meshes: &[Spanned<Table<RawMesh>>]) -> Result<(), SceneError> {
    let Some(mesh) = meshes.first() else { return Ok(()) };
    let given = &mesh.get_ref().0.file;
    let fault = |message: String| Err(source.fault(given.span(), message));
    let file = given.get_ref();
    let folder = source.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let path = Path::new(file);
    let path_beyond = path.components().any(|c| !matches!(c, Component::Normal(_) | Component::CurDir));
    let full = folder.join(path);
    if path_beyond || leaves(folder, &full) {
        return fault(format!("mesh file {file:?} is outside the scene's folder, expected one inside it"));
    }
    let extension = path.extension().map(|e| e.to_ascii_lowercase()).unwrap_or_default();
    if !["obj", "gltf", "glb"].iter().any(|e| extension == *e) {
        return fault(format!("mesh file {file:?}, expected .obj, .gltf or .glb"));
    }
    if !full.is_file() {
        return fault(format!("no such mesh file: {:?}", full.display().to_string()));
    }
    Err(source.fault(mesh.span(), "`[[mesh]]` is not supported yet, expected `[[surface]]` only"))
}

/// Whether an existing file's true place, symbolic links followed, is not under `folder`.
fn leaves(folder: &Path, file: &Path) -> bool {
    match (folder.canonicalize(), file.canonicalize()) {
        (Ok(folder), Ok(file)) => !file.starts_with(folder),
        _ => false,
    }
}
