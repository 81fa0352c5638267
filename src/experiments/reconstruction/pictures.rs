//! Irradiance seen through a scene's camera, method beside method, and the second differences of the same pictures.
//!
//! ```text
//! scene without its lights, "indirect" vertex values = all of the irradiance --render--> Film (one ray a pixel)
//! Films --one exposure--> PNG     --second differences, one scale--> PNG     --against the reference's--> MachBands
//! ```
//! The renderer samples direct light at every pixel; here all light is in the vertex values, as in a full radiosity picture.

use super::measure::{BILINEAR, Case, Way, way};
use crate::experiments::{ExperimentError, Picture};
use crate::image::png::encode_png;
use crate::image::{Exposure, Film, MachBands, crease_map, encode_crease_maps, mach_bands};
use crate::mesh::Mesh;
use crate::radiosity::{Solution, SplitIrradiance};
use crate::raycast::software::SoftwareCaster;
use crate::reconstruct::ReconstructOptions;
use crate::render::{RenderOptions, render};
use crate::scene::Scene;
use crate::units::Rgb;

/// What the pictures of a scene are called, and how large they are.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Begins the names of its files.
    pub name: &'static str,
    /// Columns and rows.
    pub side: u32,
}

/// The scene's surfaces with their stored irradiance alone.
///
/// # Errors
/// A scene without a camera; a caster that fails.
pub fn film(
    scene: &Scene,
    mesh: &Mesh,
    values: &[Rgb],
    means: &[Rgb],
    way: &Way,
    side: u32,
) -> Result<Film, ExperimentError> {
    let mut unlit = scene.clone();
    unlit.lights.clear();
    unlit.surfaces.iter_mut().for_each(|s| s.exitance = Rgb::BLACK);
    let camera = scene.camera.ok_or_else(|| ExperimentError::Scene("a scene without a camera".to_owned()))?;
    let mut solution = Solution::dark(mesh);
    let stored = |e: &Rgb| SplitIrradiance { direct: Rgb::BLACK, indirect: *e };
    solution.vertex_irradiance = values.iter().map(stored).collect();
    solution.element_irradiance = means.iter().map(stored).collect();
    let ReconstructOptions { method: reconstruct, gradients, twists } = way.options;
    let (width, height) = (side, side);
    let options = RenderOptions { width, height, reconstruct, gradients, twists, ..RenderOptions::default() };
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    Ok(render(&unlit, &camera, mesh, &solution, &mut caster, &options, &mut |_| {})?.film)
}

/// A method's picture compared with the reference's.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Its scene.
    pub view: &'static str,
    /// Its method.
    pub way: &'static str,
    /// Against the reference.
    pub bands: Option<MachBands>,
}

/// Pictures of ways on a case beside that of a dense mesh with its vertex values, `right`: a row of irradiance, a row of
/// second differences.
///
/// # Errors
/// As [`film`]; a picture that cannot be written.
pub fn pictures(
    view: View,
    scene: &Scene,
    case: &Case,
    ways: &[Way],
    right: (&Mesh, &[Rgb]),
) -> Result<(Vec<Vec<Picture>>, Vec<Shown>), ExperimentError> {
    let of =
        |case: &Case, way: &Way| film(scene, &case.mesh, &case.values, case.element_means(), way, view.side);
    let nothing = vec![Rgb::BLACK; right.0.elements.len()];
    let mut films = vec![("reference", film(scene, right.0, right.1, &nothing, &way(BILINEAR), view.side)?)];
    for way in ways {
        films.push((way.name, of(case, way)?));
    }
    let reference = &films[0].1;
    let exposure = Exposure::Auto.resolve(reference);
    let maps: Vec<_> = films.iter().map(|(_, film)| crease_map(film)).collect();
    // The scale at which the first method's creases show; borders of surfaces go beyond it.
    let scale =
        SCALE_OF_ADDED * mach_bands(reference, &films[1.min(films.len() - 1)].1).map_or(1.0, |b| b.p99_added);
    let png = |e: crate::image::OutputError| ExperimentError::Scene(e.to_string());
    let (mut seen, mut creases, mut shown) = (Vec::new(), Vec::new(), Vec::new());
    for ((name, film), map) in films.iter().zip(&maps) {
        let file = |kind: &str| format!("{}-{}{kind}.png", view.name, name.replace(' ', "-"));
        let picture = |kind, alt: &str, bytes| Picture {
            file: file(kind),
            title: format!("{}: {name}{alt}", view.name),
            bytes,
        };
        seen.push(picture("", "", encode_png(film, exposure).map_err(png)?));
        let map = encode_crease_maps(&[map], scale).map_err(png)?;
        creases.push(picture("-bands", ", second differences", map));
        shown.push(Shown { view: view.name, way: name, bands: mach_bands(reference, film) });
    }
    Ok((vec![seen, creases], shown))
}

/// Creases that are added show white or black at this multiple of their 99th percentile.
const SCALE_OF_ADDED: f64 = 1.0;
