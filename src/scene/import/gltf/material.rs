//! Materials: metallic-roughness shares of light, emission in W/m^2.
//!
//! ```text
//! baseColor x (1 - metallic)       diffuse
//! baseColor x metallic             mirror where roughness <= 0.1; diffuse, with a note, from 0.5; between: refused
//! transmission x baseColor         glass, for the share that is not metal; opacity under 1 of BLEND: likewise, unrefracted
//! emissiveFactor x strength = L    M = pi L / 179 per channel, L in cd/m^2
//! ```
//! Each factor times the mean of its texture. Not modelled: the coat of a non-metal (its reflection of 4 % and more),
//! cut-outs by alpha, normal maps.

use std::collections::HashMap;
use std::f64::consts::PI;

use gltf::json;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

use super::accessor::view_bytes;
use super::{File, container};
use crate::scene::import::texture::{self, Coding};
use crate::scene::import::{MIRROR_ROUGHNESS, ModelMaterial, Notes, bounded, metal, shown};
use crate::scene::{Material, SceneError};
use crate::units::{LUMENS_PER_WATT, Rgb};

/// Index of refraction of glass that does not say.
const DEFAULT_IOR: f64 = 1.5;

/// Transmission that is more than a coat's noise.
const MIN_TRANSMISSION: f64 = 0.05;

/// All materials of a file.
pub(super) fn all(file: &File<'_>, notes: &mut Notes) -> Result<Vec<ModelMaterial>, SceneError> {
    let mut textures = Textures { file, means: HashMap::new() };
    let used = used(file);
    let mut list = Vec::with_capacity(file.root.materials.len());
    for (index, given) in file.root.materials.iter().enumerate() {
        let name = given.name.clone().filter(|n| !n.trim().is_empty()).unwrap_or(format!("material {index}"));
        list.push(if used[index] {
            resolve(given, &name, &mut textures, notes).map_err(|e| SceneError::of_file(file.path, e))?
        } else {
            super::default_material()
        });
        list[index].material.name = name;
    }
    Ok(list)
}

/// As many materials as the file has, none of them read.
pub(super) fn none(file: &File<'_>) -> Vec<ModelMaterial> {
    vec![super::default_material(); file.root.materials.len()]
}

/// Materials that a mesh has: what nobody sees is not refused.
fn used(file: &File<'_>) -> Vec<bool> {
    let mut used = vec![false; file.root.materials.len()];
    for primitive in file.root.meshes.iter().flat_map(|m| &m.primitives) {
        if let Some(flag) = primitive.material.and_then(|m| used.get_mut(m.value())) {
            *flag = true;
        }
    }
    used
}

struct Textures<'a, 'f> {
    file: &'f File<'a>,
    means: HashMap<(usize, Coding), Result<Rgb, String>>,
}

impl Textures<'_, '_> {
    /// The mean of a texture, white where there is none or it cannot be read.
    fn mean(&mut self, texture: Option<usize>, coding: Coding, whose: &str, notes: &mut Notes) -> Rgb {
        let Some(texture) = texture else { return Rgb::WHITE };
        let root = self.file.root;
        let source = root.textures.get(texture).map_or(usize::MAX, |t| t.source.value());
        let file = self.file;
        let mean = self.means.entry((source, coding)).or_insert_with(|| {
            let image = root.images.get(source).ok_or("no picture that is read")?;
            let bytes = match (&image.uri, image.buffer_view) {
                (_, Some(view)) => view_bytes(file, view)?.to_vec(),
                (Some(uri), None) => container::referred(file.path, file.folder, uri)?,
                (None, None) => return Err("neither uri nor bufferView".to_owned()),
            };
            texture::mean(&bytes, coding)
        });
        match mean {
            Ok(mean) => {
                notes.add("a picture on a material became its mean color", whose);
                *mean
            }
            Err(why) => {
                notes.add(&format!("a picture is left out ({})", shown(why)), whose);
                Rgb::WHITE
            }
        }
    }
}

fn resolve(
    given: &json::Material,
    name: &str,
    textures: &mut Textures<'_, '_>,
    notes: &mut Notes,
) -> Result<ModelMaterial, String> {
    let in_range = |value: f64, what: &str, most: f64| {
        if (0.0..=most).contains(&value) {
            return Ok(value);
        }
        Err(format!("material '{}': {what} {value}, expected 0 to {most:e}", shown(name)))
    };
    let pbr = &given.pbr_metallic_roughness;
    let [r, g, b, alpha] = pbr.base_color_factor.0.map(f64::from);
    for channel in [r, g, b, alpha] {
        in_range(channel, "baseColorFactor", 1.0)?;
    }
    let texture = |info: &Option<json::texture::Info>| info.as_ref().map(|i| i.index.value());
    let base = Rgb([r, g, b]) * textures.mean(texture(&pbr.base_color_texture), Coding::Srgb, name, notes);
    let data = textures.mean(texture(&pbr.metallic_roughness_texture), Coding::Linear, name, notes);
    let metallic = in_range(f64::from(pbr.metallic_factor.0), "metallicFactor", 1.0)? * data.0[2];
    let roughness = in_range(f64::from(pbr.roughness_factor.0), "roughnessFactor", 1.0)? * data.0[1];

    let rough = if metallic > 0.0 { metal(name, metallic, roughness, notes)? } else { 1.0 };
    let specular = base * (metallic * (1.0 - rough));
    let mut rest = base - specular;
    let extensions = given.extensions.as_ref();
    let mut transmission = Rgb::BLACK;
    let mut ior = extensions.and_then(|e| e.ior.as_ref()).map_or(DEFAULT_IOR, |i| f64::from(i.ior.0));
    if let Some(glass) = extensions.and_then(|e| e.transmission.as_ref()) {
        let mean = textures.mean(texture(&glass.transmission_texture), Coding::Linear, name, notes).0[0];
        let share = in_range(f64::from(glass.transmission_factor.0), "transmissionFactor", 1.0)?
            * mean
            * (1.0 - metallic);
        if share > MIN_TRANSMISSION && roughness > MIRROR_ROUGHNESS {
            return Err(format!(
                "material '{}': rough transmission (transmission {share:.2}, roughness {roughness:.2}) is not \
                 modelled, expected roughness up to {MIRROR_ROUGHNESS}; `material` of a [[mesh]] in a scene file puts \
                 another material in its place",
                shown(name)
            ));
        }
        transmission = rest * share;
        rest -= transmission;
    }
    match given.alpha_mode {
        Checked::Valid(AlphaMode::Blend) if alpha < 1.0 => {
            // What is behind shows through as it is: a pane without refraction.
            rest = rest * alpha;
            if transmission.is_black() {
                ior = 1.0;
            }
            transmission = transmission * alpha + Rgb::splat(1.0 - alpha);
        }
        Checked::Valid(AlphaMode::Mask) => notes.add("cut-outs by alpha are not modelled: opaque", name),
        _ => {}
    }
    if ior.is_nan() || ior < 1.0 {
        ior = DEFAULT_IOR;
    }
    let strength = extensions
        .and_then(|e| e.emissive_strength.as_ref())
        .map_or(1.0, |s| f64::from(s.emissive_strength.0));
    let strength = in_range(strength, "emissiveStrength", 1e12)?;
    let mut luminance = Rgb(given.emissive_factor.0.map(f64::from)) * strength;
    for channel in luminance.0 {
        in_range(channel, "emission (cd/m^2)", 1e12)?;
    }
    if !luminance.is_black() {
        luminance = luminance * textures.mean(texture(&given.emissive_texture), Coding::Srgb, name, notes);
    }
    let exitance = luminance * (PI / LUMENS_PER_WATT);
    let (material, scaled) = bounded(Material {
        name: name.to_owned(),
        reflectance: rest,
        specular,
        transmission,
        ior: ior.min(10.0),
    });
    if scaled {
        notes.add("reflects and transmits all light: scaled to 0.95 of it", name);
    }
    Ok(ModelMaterial { material, exitance })
}
