//! Warnings that only a look at the picture can give.

use crate::render::Rendering;
use crate::report::si::{percent, share};
use crate::scene::Scene;

/// Over this share of camera rays that first meet a back, the user is asked whether a surface is wound wrongly.
pub const BACK_HIT_LIMIT: f64 = 0.2;
/// Surfaces that the warning names.
const NAMED: usize = 5;

/// A warning when too many camera rays first meet the black back of a surface.
pub fn back_faces(scene: &Scene, rendering: &Rendering) -> Option<String> {
    let names = scene.surfaces.iter().map(|s| s.name.as_str());
    back_face_warning(names, &rendering.back_hits, rendering.n_camera_rays)
}

fn back_face_warning<'a>(
    names: impl Iterator<Item = &'a str>,
    back_hits: &[u64],
    n_camera_rays: u64,
) -> Option<String> {
    let all: u64 = back_hits.iter().sum();
    if share(all, n_camera_rays) <= BACK_HIT_LIMIT {
        return None;
    }
    let mut hit: Vec<(&str, u64)> = names.zip(back_hits.iter().copied()).filter(|(_, n)| *n > 0).collect();
    hit.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    let named: Vec<String> = hit
        .iter()
        .take(NAMED)
        .map(|(name, n)| format!("'{name}' {}", percent(share(*n, n_camera_rays))))
        .collect();
    let more = if hit.len() > NAMED { format!(" and {} more", hit.len() - NAMED) } else { String::new() };
    Some(format!(
        "{} of the camera rays first meet the black back of a surface: {}{more}. Wound the other way? The front is \
         the side from which the vertices run counter-clockwise; 'two_sided = true' makes both sides fronts",
        percent(share(all, n_camera_rays)),
        named.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn back_faces_under_the_limit_give_no_warning() {
        assert_eq!(back_face_warning(["a", "b"].into_iter(), &[10, 10], 100), None);
        assert_eq!(back_face_warning(["a"].into_iter(), &[0], 0), None);
    }

    #[test]
    fn back_faces_over_the_limit_name_the_surfaces_worst_first() {
        let text = back_face_warning(["floor", "wall", "lamp"].into_iter(), &[5, 20, 0], 100).unwrap();
        assert!(text.contains("25.0 %"), "{text}");
        assert!(text.find("'wall' 20.0 %").unwrap() < text.find("'floor' 5.00 %").unwrap(), "{text}");
        assert!(!text.contains("lamp"), "{text}");
    }
}
