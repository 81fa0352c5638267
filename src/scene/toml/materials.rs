//! `[materials.NAME]`: shares of reflected light, and emission in any unit.
//!
//! ```text
//! emission                exitance M per emitting side (W/m^2)
//! luminance_cd_m2    L    Y(M) = pi L / 179           a Lambertian surface: M = pi L
//! emission_lm_per_m2 M_v  Y(M) = M_v / 179
//! power_w            P    mean(M) = P / (area sides)  of each surface of the material
//! lumens             F    Y(M) = F / (179 area sides) likewise
//! ```
//! Y is relative luminance; `color` gives the channels' ratio (default white).

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;

use toml::Spanned;

use super::super::{Material, MaterialId, SceneError};
use super::raw::RawMaterial;
use super::source::Source;
use super::value::{Amount, Color};
use crate::units::{LUMENS_PER_WATT, Rgb};

/// Glass when `ior` is not given.
const DEFAULT_IOR: f64 = 1.5;

/// All materials, with what they emit.
pub(super) struct Materials {
    /// In file order.
    pub(super) list: Vec<Material>,
    /// Of each material.
    pub(super) emission: Vec<Emission>,
    /// Index by name.
    pub(super) by_name: HashMap<String, MaterialId>,
}

/// What a material emits, before the area of the surface is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Emission {
    /// Exitance per emitting side (W/m^2).
    Exitance(Rgb),
    /// Power of each surface, all its sides (W).
    Power(Rgb),
}

impl Emission {
    /// Exitance per emitting side (W/m^2) of a surface.
    pub(super) fn exitance(self, area_m2: f64, n_sides: u32) -> Rgb {
        match self {
            Emission::Exitance(m) => m,
            Emission::Power(p) => p / (area_m2 * f64::from(n_sides)),
        }
    }
}

pub(super) fn resolve(
    source: &Source<'_>,
    raw: BTreeMap<Spanned<String>, RawMaterial>,
    warnings: &mut Vec<String>,
) -> Result<Materials, SceneError> {
    let mut raw: Vec<_> = raw.into_iter().collect();
    raw.sort_by_key(|(name, _)| name.span().start);
    let mut materials = Materials { list: Vec::new(), emission: Vec::new(), by_name: HashMap::new() };
    for (index, (name, raw)) in raw.into_iter().enumerate() {
        materials.emission.push(emission(source, &raw)?);
        let name = name.into_inner();
        materials.by_name.insert(name.clone(), MaterialId(index as u32));
        materials.list.push(material(source, name, &raw, warnings)?);
    }
    Ok(materials)
}

fn material(
    source: &Source<'_>,
    name: String,
    raw: &RawMaterial,
    warnings: &mut Vec<String>,
) -> Result<Material, SceneError> {
    let parts = [&raw.reflectance, &raw.specular, &raw.transmission];
    let [reflectance, specular, transmission] =
        parts.map(|p| p.as_ref().map_or(Rgb::BLACK, |c| c.get_ref().0));
    let total = reflectance + specular + transmission;
    if let Some(channel) = total.0.iter().position(|&t| t >= 1.0) {
        // With one part alone its own range holds, so a specular or transmission is there to point at.
        let last = raw.transmission.as_ref().or(raw.specular.as_ref());
        let message = format!(
            "material {name:?}: reflectance + specular + transmission is {} in {}, expected under 1",
            total.0[channel],
            ["red", "green", "blue"][channel]
        );
        return Err(source.fault(last.map_or(0..0, |c| c.span()), message));
    }
    if let (Some(ior), true) = (&raw.ior, transmission.is_black()) {
        warnings.push(source.warning(ior.span(), "`ior` without `transmission` has no effect"));
    }
    let ior = raw.ior.as_ref().map_or(DEFAULT_IOR, |i| i.get_ref().0);
    Ok(Material { name, reflectance, specular, transmission, ior })
}

fn emission(source: &Source<'_>, raw: &RawMaterial) -> Result<Emission, SceneError> {
    let scalars = [
        ("luminance_cd_m2", &raw.luminance_cd_m2),
        ("emission_lm_per_m2", &raw.emission_lm_per_m2),
        ("power_w", &raw.power_w),
        ("lumens", &raw.lumens),
    ];
    let mut given = scalars.iter().filter_map(|(key, value)| value.as_ref().map(|v| (*key, v)));
    let first = given.next();
    let second = given.next().or(first.filter(|_| raw.emission.is_some()));
    if let Some((key, value)) = second {
        let other = if raw.emission.is_some() { "emission" } else { first.map_or("", |f| f.0) };
        let message = format!("{key} beside {other}, expected one unit of emission per material");
        return Err(source.fault(value.span(), message));
    }
    let Some((key, value)) = first else {
        if let Some(color) = &raw.color {
            let message = "`color` goes with luminance_cd_m2, emission_lm_per_m2, power_w or lumens only";
            return Err(source.fault(color.span(), message));
        }
        return Ok(Emission::Exitance(raw.emission.as_ref().map_or(Rgb::BLACK, |e| e.get_ref().0)));
    };
    let value = value.get_ref().0;
    Ok(match key {
        "luminance_cd_m2" => Emission::Exitance(photometric(source, raw.color.as_ref(), PI * value)?),
        "emission_lm_per_m2" => Emission::Exitance(photometric(source, raw.color.as_ref(), value)?),
        "lumens" => Emission::Power(photometric(source, raw.color.as_ref(), value)?),
        _ => Emission::Power(radiometric(source, raw.color.as_ref(), value)?),
    })
}

/// The radiometric quantity whose luminance is `value` / 179, of the given color.
pub(super) fn photometric(
    source: &Source<'_>,
    color: Option<&Spanned<Color<Amount>>>,
    value: f64,
) -> Result<Rgb, SceneError> {
    scaled(source, color, value / LUMENS_PER_WATT, Rgb::luminance)
}

/// The quantity whose channels have the mean `value`, of the given color.
fn radiometric(
    source: &Source<'_>,
    color: Option<&Spanned<Color<Amount>>>,
    value: f64,
) -> Result<Rgb, SceneError> {
    scaled(source, color, value, |c| c.sum() / 3.0)
}

fn scaled(
    source: &Source<'_>,
    color: Option<&Spanned<Color<Amount>>>,
    value: f64,
    measure: impl Fn(Rgb) -> f64,
) -> Result<Rgb, SceneError> {
    let Some(color) = color else { return Ok(Rgb::splat(value)) };
    let rgb = color.get_ref().0;
    // Scaled first: a tiny color must not lose its digits to underflow.
    let largest = rgb.max_channel();
    if largest < f64::MIN_POSITIVE {
        return Err(source.fault(color.span(), "a black color, expected at least one channel over 0"));
    }
    let unit = rgb / largest;
    Ok(unit * (value / measure(unit)))
}
