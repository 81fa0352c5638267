//! The TOML loader: from a file to a checked [`Scene`], or to one fault with its place.
//!
//! ```text
//! file --source.rs--> text --toml--> tables with spans --raw.rs, value.rs--> RawScene (every single value in range)
//!      --camera, materials, surfaces (geometry), lights, meshing, continuity: what several values say together--> Scene
//! ```
//! The first fault ends the loading. Format: version 1, scenes/README.md.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::{Scene, SceneError};
use source::Source;

mod camera;
mod continuity;
pub(crate) mod faults;
mod geometry;
mod lights;
mod materials;
mod meshes;
mod meshing;
mod raw;
pub(crate) mod source;
mod surfaces;
pub(crate) mod value;

pub(super) fn load(path: &Path) -> Result<Scene, SceneError> {
    parse(&source::read(path, source::SCENE)?, path)
}

pub(super) fn parse(text: &str, path: &Path) -> Result<Scene, SceneError> {
    let source = Source { path, text };
    let raw = read_tables(&source)?;

    let mut warnings = Vec::new();
    let mut camera = raw.camera.map(|c| camera::resolve(&source, c)).transpose()?;
    let mut materials = materials::resolve(&source, raw.materials, &mut warnings)?;
    let mut surfaces = surfaces::resolve(&source, raw.surface, &materials)?;
    let mut lights =
        raw.light.into_iter().map(|l| lights::resolve(&source, l)).collect::<Result<Vec<_>, _>>()?;
    let mut parts = meshes::Parts {
        camera: &mut camera,
        materials: &mut materials,
        surfaces: &mut surfaces,
        lights: &mut lights,
        warnings: &mut warnings,
    };
    meshes::add(&source, &raw.mesh, &mut parts)?;
    if surfaces.is_empty() {
        let message = "a scene without surfaces, expected at least one `[[surface]]` or `[[mesh]]`";
        return Err(source.fault(0..0, message));
    }
    let meshing = meshing::resolve(&source, raw.meshing, &surfaces)?;
    let by_hand = continuity::resolve(&source, raw.continuity, &surfaces)?;
    if lights.is_empty() && surfaces.iter().all(|s| s.exitance.is_black()) {
        warnings.push(format!("{}: nothing emits light: the picture will be black", path.display()));
    }
    let scene = Scene {
        path: path.to_owned(),
        camera,
        materials: materials.list,
        surfaces,
        lights,
        continuity: by_hand.list.clone(),
        meshing,
        warnings,
    };
    continuity::check_edges(&source, &scene, &by_hand)?;
    Ok(scene)
}

/// Syntax, version, then keys and types: a file of another version is told so, not that its keys are unknown.
fn read_tables(source: &Source<'_>) -> Result<raw::RawScene, SceneError> {
    let root = read_root(source, "a scene: `version = 1`, materials, surfaces")?;
    raw::RawScene::deserialize(Deserializer::from(root)).map_err(|e| faults::of_toml(source, &e))
}

/// The tables of a file of version 1; `expected` says of what.
pub(crate) fn read_root<'t>(source: &Source<'t>, expected: &str) -> Result<Spanned<DeTable<'t>>, SceneError> {
    if source.text.trim().is_empty() {
        return Err(source.fault(0..0, format!("the file is empty, expected {expected}")));
    }
    if let Some(at) = source.text.find('\0') {
        return Err(source.fault(at..at + 1, "a zero byte, expected UTF-8 text"));
    }
    let root = DeTable::parse(source.text).map_err(|e| faults::of_toml(source, &e))?;
    match root.get_ref().get("version") {
        None => return Err(source.fault(0..0, "missing key `version`, expected `version = 1`")),
        Some(version) => {
            let is_one = match version.get_ref() {
                DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()) == Ok(1),
                _ => false,
            };
            if !is_one {
                let span = version.span();
                let message = format!("version {}, expected 1, the only one so far", source.slice(&span));
                return Err(source.fault(span, message));
            }
        }
    }
    Ok(root)
}
