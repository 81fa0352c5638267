//! The TOML loader.

use std::path::Path;

use super::{Scene, SceneError};

pub(super) fn load(path: &Path) -> Result<Scene, SceneError> {
    let _ = path;
    todo!()
}
