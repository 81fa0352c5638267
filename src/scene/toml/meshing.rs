//! `[meshing]`: a wanted element count or a largest element, within the stated limit.

use super::super::{MAX_ELEMENTS, MeshTarget, Meshing, SceneError, Shape, Surface};
use super::raw::RawMeshing;
use super::source::Source;

pub(super) fn resolve(
    source: &Source<'_>,
    raw: Option<RawMeshing>,
    surfaces: &[Surface],
    warnings: &mut Vec<String>,
) -> Result<Meshing, SceneError> {
    let mut meshing = Meshing::default();
    let Some(raw) = raw else { return Ok(meshing) };
    match (&raw.elements, &raw.max_element_m) {
        (Some(_), Some(h)) => {
            return Err(source.fault(h.span(), "max_element_m beside elements, expected one of them"));
        }
        (Some(n), None) => meshing.target = MeshTarget::Elements(n.get_ref().0),
        (None, Some(h)) => {
            let max_element_m = h.get_ref().0;
            let n_elements: f64 = surfaces.iter().map(|s| n_elements(s, max_element_m)).sum();
            if n_elements > f64::from(MAX_ELEMENTS) {
                let message = format!(
                    "max_element_m {max_element_m} asks for about {n_elements:.3e} elements, \
                     expected at most {MAX_ELEMENTS}"
                );
                return Err(source.fault(h.span(), message));
            }
            meshing.target = MeshTarget::MaxElementM(max_element_m);
        }
        (None, None) => {}
    }
    if let Some(adaptive) = &raw.adaptive {
        meshing.adaptive = *adaptive.get_ref();
        if meshing.adaptive {
            warnings.push(source.warning(adaptive.span(), "adaptive = true: meshing is uniform for now"));
        }
    }
    Ok(meshing)
}

/// How many elements with edges up to `h` a surface takes, both sides counted.
fn n_elements(surface: &Surface, h: f64) -> f64 {
    let along = |length: f64| (length / h).ceil().max(1.0);
    let one_side = match surface.shape {
        Shape::Quad(v) => {
            let edge = |i: usize| (v[(i + 1) % 4] - v[i]).length();
            along(edge(0).max(edge(2))) * along(edge(1).max(edge(3)))
        }
        _ => along(surface.shape.area_m2().sqrt()).powi(2),
    };
    if surface.two_sided { 2.0 * one_side } else { one_side }
}
