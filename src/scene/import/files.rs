//! Files that a model may read: whole, of a limited size, and only inside the folder of the scene.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

use super::super::SceneError;
use super::MAX_MODEL_BYTES;

/// Reads a whole file of at most [`MAX_MODEL_BYTES`].
pub(in crate::scene) fn read(path: &Path, expected: &str) -> Result<Vec<u8>, SceneError> {
    let of_file = |message: String| SceneError::of_file(path, message);
    let file = File::open(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => of_file(format!("no such file, expected {expected}")),
        _ => of_file(format!("cannot be opened: {e}")),
    })?;
    let meta = file.metadata().map_err(|e| of_file(format!("cannot be read: {e}")))?;
    if meta.is_dir() {
        return Err(of_file(format!("is a directory, expected {expected}")));
    }
    let mut bytes = Vec::with_capacity(meta.len().min(MAX_MODEL_BYTES) as usize);
    // One byte beyond the limit tells a file of the limit from a longer one, also of pipes and devices.
    file.take(MAX_MODEL_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| of_file(format!("cannot be read: {e}")))?;
    if bytes.len() as u64 > MAX_MODEL_BYTES {
        return Err(of_file(format!("larger than {} MiB, the limit of a model file", MAX_MODEL_BYTES >> 20)));
    }
    Ok(bytes)
}

/// Where `reference` (as a file writes it) lies from `from`, when that is inside `folder`; else why not.
pub(in crate::scene) fn inside(folder: &Path, from: &Path, reference: &str) -> Result<PathBuf, String> {
    let path = Path::new(reference);
    let outside =
        || format!("{:?} is outside the scene's folder, expected one inside it", super::shown(reference));
    if reference.contains("://") || reference.contains('\0') {
        return Err(outside());
    }
    if path.components().any(|c| !matches!(c, Component::Normal(_) | Component::CurDir)) {
        return Err(outside());
    }
    let full = from.join(path);
    // An existing file's true place, symbolic links followed.
    match (folder.canonicalize(), full.canonicalize()) {
        (Ok(folder), Ok(file)) if !file.starts_with(&folder) => Err(outside()),
        _ => Ok(full),
    }
}
