//! Warnings that a scene file alone cannot give: they need its mesh, its solution or a look at the picture.

use crate::geom::{DVec3, Ray};
use crate::mesh::Mesh;
use crate::radiosity::EnergyAccount;
use crate::raycast::software::SoftwareCaster;
use crate::raycast::{CastPatch, Purpose, Query, RayCaster};
use crate::render::Rendering;
use crate::report::si::{percent, share, si};
use crate::scene::{Light, MeshTarget, Scene, Shape};

/// Over this share of camera rays that first meet a back, the user is asked whether a surface is wound wrongly.
pub const BACK_HIT_LIMIT: f64 = 0.2;
/// Surfaces that the warning names.
const NAMED: usize = 5;
/// Share of the emitted power that an energy account may leave open.
pub const RESIDUAL_LIMIT: f64 = 0.01;
/// A mesh of more than this many times the wanted elements is worth a word.
const OVERSHOOT: u64 = 4;

/// A warning when the scene's shapes need many more elements than were asked for.
pub fn more_elements(target: MeshTarget, planned: u64) -> Option<String> {
    let MeshTarget::Elements(wanted) = target else { return None };
    (planned > OVERSHOOT * u64::from(wanted)).then(|| {
        format!(
            "the mesh has {planned} elements, {wanted} were asked for: every surface has a least number, curved \
             ones a larger one"
        )
    })
}

/// A warning when imported faces do not meet edge to edge.
pub fn t_junctions(scene: &Scene, mesh: &Mesh) -> Option<String> {
    let imported = scene.surfaces.iter().any(|s| matches!(s.shape, Shape::Faces(_)));
    (imported && mesh.n_t_junctions > 0).then(|| {
        format!(
            "{} edges have a corner of another face on them (T-junctions): light may leak there through gaps of a step of \
             the board's coordinates",
            mesh.n_t_junctions
        )
    })
}

/// A warning when a channel's residual is over [`RESIDUAL_LIMIT`] of its emitted power.
pub fn open_account(account: &EnergyAccount) -> Option<String> {
    let channels = account.emitted_w.0.iter().zip(account.residual_w.0).zip(["red", "green", "blue"]);
    let open = channels.filter(|((emitted, residual), _)| residual.abs() > RESIDUAL_LIMIT * **emitted);
    let ((emitted, residual), channel) =
        open.max_by(|((e, r), _), ((f, s), _)| (r.abs() / *e).total_cmp(&(s.abs() / *f)))?;
    Some(format!(
        "the energy account does not close: {} of {} emitted ({}) are unaccounted for in {channel}; more elements \
         or dense visibility help",
        si(residual, "W"),
        si(*emitted, "W"),
        percent(residual.abs() / *emitted)
    ))
}

/// A warning for every point or spot light within about twice the surface offset of a surface: rays toward it end
/// before or behind that surface by chance.
pub fn lights_on_surfaces(scene: &Scene, mesh: &Mesh, surface_offset_m: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    for (i, light) in scene.lights.iter().enumerate() {
        let (Light::Point { position, .. } | Light::Spot { position, .. }) = light else { continue };
        let reach = 2.0 * surface_offset_m;
        let Some(surface) = surface_near(scene, mesh, *position, reach) else { continue };
        warnings.push(format!("light {} lies on surface '{surface}': move it off", i + 1));
    }
    warnings
}

/// The surface that a ray of length `reach` along an axis meets from `at`.
fn surface_near<'a>(scene: &'a Scene, mesh: &Mesh, at: DVec3, reach: f64) -> Option<&'a str> {
    // Only patches whose box is near: no tree over the whole scene.
    let near = |patch: &CastPatch| {
        let [a, b, c, d] = patch.corners;
        let d = if patch.is_triangle { c } else { d };
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        (low - reach).cmple(at).all() && at.cmple(high + reach).all()
    };
    let (ids, patches): (Vec<usize>, Vec<CastPatch>) =
        mesh.cast_patches().into_iter().enumerate().filter(|(_, patch)| near(patch)).unzip();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let rays = axes.into_iter().flat_map(|axis| [axis, -axis]);
    let rays: Vec<Ray> = rays.map(|axis| Ray { t_max: reach, ..Ray::unbounded(at, axis) }).collect();
    let hits = SoftwareCaster::new(patches).closest_hits(Purpose::Probe, Query::Rays(&rays)).ok()?;
    let hit = hits.into_iter().flatten().next()?;
    let surface = mesh.patches[*ids.get(hit.patch.0 as usize)?].surface;
    Some(&scene.surfaces[surface.0 as usize].name)
}

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
    use crate::units::Rgb;

    #[test]
    fn elements_beyond_four_times_the_wish_are_told() {
        assert_eq!(more_elements(MeshTarget::Elements(10), 40), None);
        assert_eq!(more_elements(MeshTarget::MaxElementM(1.0), 4000), None);
        let text = more_elements(MeshTarget::Elements(10), 41).unwrap();
        assert!(text.contains("41 elements, 10 were asked for"), "{text}");
    }

    #[test]
    fn account_open_by_over_a_hundredth_names_the_worst_channel() {
        let account = |residual: [f64; 3]| EnergyAccount {
            emitted_w: Rgb([10.0, 10.0, 1.0]),
            residual_w: Rgb(residual),
            ..EnergyAccount::default()
        };
        assert_eq!(open_account(&EnergyAccount::default()), None);
        assert_eq!(open_account(&account([0.1, -0.1, 0.01])), None);
        let text = open_account(&account([0.2, 0.0, -0.05])).unwrap();
        assert!(
            text.contains("does not close") && text.contains("5.00 %") && text.contains("blue"),
            "{text}"
        );
    }

    #[test]
    fn light_on_a_surface_is_named_and_one_off_it_is_not() {
        let text = |z: f64| {
            format!(
                "version = 1\n[materials.a]\nreflectance = 0.5\n[[surface]]\nname = \"floor\"\n\
                 material = \"a\"\nquad = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]\n[[light]]\nkind = \"point\"\n\
                 position = [0.3, 0.4, {z}]\nintensity = 1.0\n"
            )
        };
        let warnings = |z: f64| {
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("scene.toml");
            std::fs::write(&path, text(z)).unwrap();
            let scene = Scene::load(&path).unwrap();
            let mesh = Mesh::build(&scene);
            lights_on_surfaces(&scene, &mesh, 1e-6)
        };
        assert_eq!(warnings(0.0), ["light 1 lies on surface 'floor': move it off"]);
        assert_eq!(warnings(-1.5e-6).len(), 1);
        assert!(warnings(3e-6).is_empty());
        assert!(warnings(0.5).is_empty());
    }

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
