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
use super::value::{Amount, Color, Table};
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
    raw: BTreeMap<Spanned<String>, Table<RawMaterial>>,
    warnings: &mut Vec<String>,
) -> Result<Materials, SceneError> {
    let mut raw: Vec<_> = raw.into_iter().collect();
    raw.sort_by_key(|(name, _)| name.span().start);
    let mut materials = Materials { list: Vec::new(), emission: Vec::new(), by_name: HashMap::new() };
    for (index, (name, Table(raw))) in raw.into_iter().enumerate() {
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::super::parse;
    use super::*;
    use crate::scene::{Scene, Surface};
    use crate::units::Irradiance;

    /// A scene of one surface with these lines in its material and table.
    fn scene(material: &str, surface: &str) -> Scene {
        let text = format!(
            "version = 1\n[materials.m]\n{material}\n[[surface]]\nname = \"s\"\nmaterial = \"m\"\n{surface}\n"
        );
        parse(&text, Path::new("scene.toml")).unwrap()
    }

    /// A 2 m x 3 m panel.
    fn panel(material: &str) -> Surface {
        scene(material, "quad = [[0,0,0],[2,0,0],[2,3,0],[0,3,0]]").surfaces.remove(0)
    }

    fn assert_near(value: f64, expected: f64) {
        assert!((value - expected).abs() <= 1e-12 * expected.abs(), "{value} is not {expected}");
    }

    #[test]
    fn emission_in_watts_is_taken_as_it_stands_and_a_number_means_three_equal_channels() {
        assert_eq!(panel("emission = [18.0, 15, 8.0]").exitance, Rgb([18.0, 15.0, 8.0]));
        assert_eq!(panel("emission = 2").exitance, Rgb::splat(2.0));
        assert_eq!(panel("reflectance = 0.5").exitance, Rgb::BLACK);
    }

    #[test]
    fn luminance_of_a_lambertian_panel_is_pi_l_lumens_per_square_metre() {
        let m = panel("luminance_cd_m2 = 1000.0").exitance;
        assert_near(179.0 * m.luminance(), PI * 1000.0);
        // Radiance L = M / pi in cd/m^2 is the number of the file again.
        assert_near(179.0 * m.luminance() / PI, 1000.0);
    }

    #[test]
    fn emission_in_lumens_per_square_metre_falls_on_a_touching_plane_as_the_same_lux() {
        let m = panel("emission_lm_per_m2 = 500.0\ncolor = [1.0, 0.5, 0.2]").exitance;
        assert_near(Irradiance(m).illuminance_lx(), 500.0);
        assert_near(m.0[0] / m.0[1], 2.0);
    }

    #[test]
    fn power_is_spread_over_the_area_and_its_channels_have_the_mean_of_the_number() {
        let m = panel("power_w = 60.0\ncolor = [3.0, 2.0, 1.0]").exitance;
        assert_near(m.sum() / 3.0 * 6.0, 60.0);
        assert_near(m.0[0], 15.0);
        assert_eq!(panel("power_w = 60.0").exitance, Rgb::splat(10.0));
    }

    #[test]
    fn lumens_are_the_flux_of_the_whole_surface_whatever_its_shape() {
        let shapes = [
            ("quad = [[0,0,0],[2,0,0],[2,3,0],[0,3,0]]", 6.0),
            ("triangle = [[0,0,0],[2,0,0],[2,3,0]]", 3.0),
            ("disk = { center = [0,0,0], normal = [0,0,2], radius = 0.5 }", PI / 4.0),
            ("sphere = { center = [0,0,0], radius = 0.5 }", PI),
            ("cylinder = { base = [0,0,0], top = [0,0,2], radius = 0.5 }", 2.0 * PI),
        ];
        for (shape, area) in shapes {
            let one = scene("lumens = 800", shape).surfaces.remove(0);
            assert_near(179.0 * one.exitance.luminance() * area, 800.0);
            let both = scene("lumens = 800", &format!("{shape}\ntwo_sided = true")).surfaces.remove(0);
            assert_near(179.0 * both.exitance.luminance() * 2.0 * area, 800.0);
        }
    }

    #[test]
    fn exitance_of_a_two_sided_surface_is_that_of_each_side() {
        let quad = "quad = [[0,0,0],[2,0,0],[2,3,0],[0,3,0]]\ntwo_sided = true";
        assert_eq!(scene("emission = 3", quad).surfaces[0].exitance, Rgb::splat(3.0));
        assert_eq!(scene("power_w = 60", quad).surfaces[0].exitance, Rgb::splat(5.0));
    }

    #[test]
    fn materials_stand_in_file_order_with_defaults() {
        let text = "version = 1\n[materials.z]\ntransmission = 0.9\n[materials.a]\n[[surface]]\nname = \"s\"\n\
                    material = \"a\"\nsphere = { center = [0,0,0], radius = 1 }\n";
        let scene = parse(text, Path::new("scene.toml")).unwrap();
        let names: Vec<_> = scene.materials.iter().map(|m| m.name.as_str()).collect();
        assert_eq!(names, ["z", "a"]);
        assert_eq!(scene.material(&scene.surfaces[0]).name, "a");
        assert_eq!(scene.materials[0].ior, DEFAULT_IOR);
        assert_eq!(scene.materials[1].reflectance, Rgb::BLACK);
    }

    #[test]
    fn ior_without_transmission_and_a_scene_without_light_are_warned_about_with_their_place() {
        let warnings = scene("ior = 1.5", "sphere = { center = [0,0,0], radius = 1 }").warnings;
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].starts_with("scene.toml:3:7: `ior`"), "{warnings:?}");
        assert!(warnings[1].contains("black"), "{warnings:?}");
    }

    proptest! {
        #[test]
        fn color_of_any_scale_sets_ratios_only(r in 0.0..1.0f64, g in 0.01..1.0f64, b in 0.0..1.0f64, power in -300i32..9) {
            let k = 10f64.powi(power);
            let rgb = Rgb([r, g, b]);
            let scaled = panel(&format!("lumens = 800\ncolor = [{:e}, {:e}, {:e}]", r * k, g * k, b * k)).exitance;
            prop_assert!((179.0 * 6.0 * scaled.luminance() - 800.0).abs() < 1e-9);
            for i in 0..3 {
                prop_assert!((scaled.0[i] * rgb.0[1] - scaled.0[1] * rgb.0[i]).abs() < 1e-9);
            }
        }
    }
}
