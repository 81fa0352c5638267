//! `[meshing]`: a wanted element count or a largest element, within the stated limit.

use super::super::{MAX_ELEMENTS, MeshTarget, Meshing, SceneError, Shape, Surface};
use super::raw::RawMeshing;
use super::source::Source;
use super::value::Table;

pub(super) fn resolve(
    source: &Source<'_>,
    raw: Option<Table<RawMeshing>>,
    surfaces: &[Surface],
) -> Result<Meshing, SceneError> {
    let mut meshing = Meshing::default();
    let Some(Table(raw)) = raw else { return Ok(meshing) };
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
    meshing.adaptive = raw.adaptive.as_ref().is_some_and(|adaptive| *adaptive.get_ref());
    meshing.edge_grading = raw.edge_grading.map_or(meshing.edge_grading, |grading| grading.0);
    Ok(meshing)
}

/// How many elements with edges up to `h` a surface takes, both sides counted.
fn n_elements(surface: &Surface, h: f64) -> f64 {
    let along = |length: f64| (length / h).ceil().max(1.0);
    let one_side = match &surface.shape {
        Shape::Quad(v) => {
            let edge = |i: usize| (v[(i + 1) % 4] - v[i]).length();
            along(edge(0).max(edge(2))) * along(edge(1).max(edge(3)))
        }
        Shape::Faces(set) => (surface.shape.area_m2() / (h * h)).max(1.0) + set.n_faces() as f64,
        _ => along(surface.shape.area_m2().sqrt()).powi(2),
    };
    if surface.two_sided { 2.0 * one_side } else { one_side }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::parse;
    use super::*;

    fn meshing(keys: &str) -> Result<(Meshing, Vec<String>), SceneError> {
        let text = format!(
            "version = 1\n[materials.m]\nemission = 1\n[[surface]]\nname = \"s\"\nmaterial = \"m\"\n\
             quad = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]\n{keys}\n"
        );
        parse(&text, Path::new("scene.toml")).map(|s| (s.meshing, s.warnings))
    }

    #[test]
    fn meshing_of_a_file_without_the_table_is_the_default() {
        assert_eq!(meshing("").unwrap().0, Meshing::default());
        assert_eq!(meshing("[meshing]").unwrap().0, Meshing::default());
    }

    #[test]
    fn meshing_limit_is_accepted_and_one_more_refused() {
        let (at_limit, _) = meshing(&format!("[meshing]\nelements = {MAX_ELEMENTS}")).unwrap();
        assert_eq!(at_limit.target, MeshTarget::Elements(MAX_ELEMENTS));
        assert!(meshing(&format!("[meshing]\nelements = {}", MAX_ELEMENTS + 1)).is_err());
        // 2000 x 2000 elements are the limit, 2001 x 2001 are too many.
        assert!(meshing("[meshing]\nmax_element_m = 0.001").is_ok());
        assert!(meshing("[meshing]\nmax_element_m = 0.0009995").is_err());
    }

    #[test]
    fn edge_grading_is_even_without_its_key_and_refused_outside_its_range() {
        assert_eq!(meshing("[meshing]\nelements = 9").unwrap().0.edge_grading, 1.0);
        assert_eq!(meshing("[meshing]\nedge_grading = 2.5").unwrap().0.edge_grading, 2.5);
        for wrong in ["0.5", "4.5", "nan", "true"] {
            let message = meshing(&format!("[meshing]\nedge_grading = {wrong}")).unwrap_err().to_string();
            assert!(message.contains("a grading from 1 (even) to 4") && message.contains(":9:"), "{message}");
        }
    }

    #[test]
    fn adaptive_meshing_is_asked_for_by_its_key_alone() {
        let (adaptive, warnings) = meshing("[meshing]\nmax_element_m = 0.5\nadaptive = true").unwrap();
        assert!(adaptive.adaptive && warnings.is_empty(), "{warnings:?}");
        assert!(!meshing("[meshing]\nmax_element_m = 0.5").unwrap().0.adaptive);
    }
}
