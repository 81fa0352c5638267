//! The scene file as typed: one struct per table, every key, nothing resolved.
//!
//! Ranges that one value can break are in its type (`value.rs`); what concerns several values is checked by the
//! file of the same name as the table. `Spanned` keeps the place of what those checks may have to point at.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;

use super::super::MAX_ELEMENTS;
use super::value::{
    Amount, Color, FieldOfView, Fixed, Grading, HalfAngle, Length, Num, Refraction, Share, Table, Vector,
    Whole,
};

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawScene {
    /// Checked before all else: `toml/mod.rs`.
    #[serde(rename = "version")]
    pub(super) _version: IgnoredAny,
    pub(super) camera: Option<Spanned<Table<RawCamera>>>,
    #[serde(default)]
    pub(super) materials: BTreeMap<Spanned<String>, Table<RawMaterial>>,
    #[serde(default)]
    pub(super) surface: Vec<Spanned<Table<RawSurface>>>,
    #[serde(default)]
    pub(super) mesh: Vec<Spanned<Table<RawMesh>>>,
    #[serde(default)]
    pub(super) light: Vec<Spanned<Table<RawLight>>>,
    pub(super) meshing: Option<Table<RawMeshing>>,
    #[serde(default)]
    pub(super) continuity: Vec<Spanned<Table<RawContinuity>>>,
}

/// `[camera]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCamera {
    pub(super) eye: Vector,
    pub(super) target: Spanned<Vector>,
    pub(super) up: Spanned<Vector>,
    pub(super) fov_y_deg: Num<FieldOfView>,
}

/// `[materials.NAME]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMaterial {
    pub(super) reflectance: Option<Spanned<Color<Share>>>,
    pub(super) specular: Option<Spanned<Color<Share>>>,
    pub(super) transmission: Option<Spanned<Color<Share>>>,
    pub(super) ior: Option<Spanned<Num<Refraction>>>,
    pub(super) emission: Option<Spanned<Color<Amount>>>,
    pub(super) luminance_cd_m2: Option<Spanned<Num<Amount>>>,
    pub(super) emission_lm_per_m2: Option<Spanned<Num<Amount>>>,
    pub(super) power_w: Option<Spanned<Num<Amount>>>,
    pub(super) lumens: Option<Spanned<Num<Amount>>>,
    pub(super) color: Option<Spanned<Color<Amount>>>,
}

/// `[[surface]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSurface {
    pub(super) name: Spanned<String>,
    pub(super) material: Spanned<String>,
    pub(super) quad: Option<Spanned<Fixed<Vector, 4>>>,
    pub(super) triangle: Option<Spanned<Fixed<Vector, 3>>>,
    pub(super) disk: Option<Spanned<Table<RawDisk>>>,
    pub(super) sphere: Option<Spanned<Table<RawSphere>>>,
    pub(super) cylinder: Option<Spanned<Table<RawCylinder>>>,
    #[serde(default)]
    pub(super) two_sided: bool,
    pub(super) smooth_group: Option<Whole<0, { u32::MAX }>>,
}

/// `disk = { ... }`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawDisk {
    pub(super) center: Vector,
    pub(super) normal: Spanned<Vector>,
    pub(super) radius: Num<Length>,
}

/// `sphere = { ... }`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSphere {
    pub(super) center: Vector,
    pub(super) radius: Num<Length>,
    #[serde(default)]
    pub(super) inward: bool,
}

/// `cylinder = { ... }`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCylinder {
    pub(super) base: Vector,
    pub(super) top: Spanned<Vector>,
    pub(super) radius: Num<Length>,
    #[serde(default)]
    pub(super) inward: bool,
}

/// `[[mesh]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMesh {
    pub(super) file: Spanned<String>,
    pub(super) unit: Option<RawUnit>,
    pub(super) material: Option<Spanned<String>>,
    pub(super) translate: Option<Vector>,
    pub(super) rotate_deg: Option<Vector>,
    pub(super) scale: Option<Num<Length>>,
}

/// Unit of length of a mesh file.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum RawUnit {
    M,
    Cm,
    Mm,
    In,
}

/// `[[light]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLight {
    pub(super) kind: Spanned<String>,
    pub(super) position: Option<Spanned<Vector>>,
    pub(super) direction: Option<Spanned<Vector>>,
    pub(super) intensity: Option<Spanned<Color<Amount>>>,
    pub(super) intensity_cd: Option<Spanned<Num<Amount>>>,
    pub(super) color: Option<Spanned<Color<Amount>>>,
    pub(super) irradiance: Option<Spanned<Color<Amount>>>,
    pub(super) inner_deg: Option<Spanned<Num<HalfAngle>>>,
    pub(super) outer_deg: Option<Spanned<Num<HalfAngle>>>,
}

/// `[meshing]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMeshing {
    pub(super) elements: Option<Spanned<Whole<1, MAX_ELEMENTS>>>,
    pub(super) max_element_m: Option<Spanned<Num<Length>>>,
    pub(super) adaptive: Option<Spanned<bool>>,
    pub(super) edge_grading: Option<Num<Grading>>,
}

/// `[[continuity]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawContinuity {
    pub(super) between: Spanned<Fixed<Spanned<String>, 2>>,
    pub(super) is: Spanned<String>,
}
