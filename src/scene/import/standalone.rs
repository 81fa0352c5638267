//! A model file as a scene: with a camera that frames it, and light, where the file has none.
//!
//! ```text
//! Model --place.rs--> surfaces --nothing emits: two suns, or a lamp beside an eye inside--> lights
//!                              --no camera: an eye before and above it, or inside a room seen from within--> Camera
//! ```

use std::path::Path;

use glam::DVec3;

use super::super::{Camera, Light, MaterialId, Meshing, Scene, SceneError, Shape};
use super::place::{Names, Placement, Target};
use crate::geom::Aabb;
use crate::units::Rgb;

/// Vertical field of view of an added camera (degrees).
const FOV_Y_DEG: f64 = 40.0;

/// From the model's middle to an added camera: in front (+z), above (+y), from the right, as models usually stand.
const VIEW: DVec3 = DVec3::new(0.55, 0.45, 1.0);

/// Irradiance (W/m^2) of the brighter of two added suns on a plane that faces it.
const SUN_W_M2: f64 = 10.0;

pub(in crate::scene) fn load(path: &Path) -> Result<Scene, SceneError> {
    let mut model = super::load(path, &super::folder_of(path), false)?;
    let (mut surfaces, mut warnings) = (Vec::new(), Vec::new());
    let (mut names, mut n_faces) = (Names::new(), 0);
    let exitances: Vec<Rgb> = model.materials.iter().map(|m| m.exitance).collect();
    let dress = |material: usize, _: f64, _: u32| (MaterialId(material as u32), exitances[material]);
    let mut target =
        Target { surfaces: &mut surfaces, names: &mut names, n_faces: &mut n_faces, warnings: &mut warnings };
    target.add(path, &mut model, &Placement::NONE, "", &dress)?;
    if surfaces.is_empty() {
        return Err(SceneError::of_file(path, "no face with an area in it, expected at least one"));
    }
    let materials = model.materials.into_iter().map(|m| m.material).collect();
    let mut scene = Scene {
        path: path.to_owned(),
        camera: model.camera,
        materials,
        surfaces,
        lights: model.lights,
        continuity: Vec::new(),
        meshing: Meshing::default(),
        warnings,
    };
    let extent = Extent::of(&scene);
    if scene.camera.is_none() {
        let camera = extent.camera();
        let inside = if extent.is_room() { "inside" } else { "before" };
        scene.warnings.push(format!(
            "{}: no camera in the file: one stands {inside} the model at ({}) m, looks at ({}) m",
            path.display(),
            at(camera.eye),
            at(camera.target)
        ));
        scene.camera = Some(camera);
    }
    if scene.lights.is_empty() && scene.surfaces.iter().all(|s| s.exitance.is_black()) {
        let lights = extent.lights(&scene.camera);
        let what = match lights[..] {
            [Light::Point { .. }] => "a point light beside the camera",
            _ => "two suns, from the camera's upper left and, a quarter as bright, from its right",
        };
        scene.warnings.push(format!("{}: nothing in the file emits light: {what} was added", path.display()));
        scene.lights = lights;
    }
    Ok(scene)
}

/// Where a model is.
struct Extent {
    around: Aabb,
    /// Six times the volume that its faces enclose, positive when their fronts look out (m^3).
    enclosed: f64,
}

impl Extent {
    fn of(scene: &Scene) -> Extent {
        let mut around = Aabb::EMPTY;
        let mut enclosed = 0.0;
        for surface in &scene.surfaces {
            let Shape::Faces(set) = &surface.shape else { continue };
            let of_set = Aabb::around(set.points().iter().copied());
            around = Aabb { min: around.min.min(of_set.min), max: around.max.max(of_set.max) };
        }
        let middle = 0.5 * (around.min + around.max);
        for surface in &scene.surfaces {
            let Shape::Faces(set) = &surface.shape else { continue };
            for face in set.faces() {
                let p = |k: usize| set.points()[face[k] as usize] - middle;
                enclosed += p(0).dot(p(1).cross(p(2)));
                if face.len() == 4 {
                    enclosed += p(0).dot(p(2).cross(p(3)));
                }
            }
        }
        Extent { around, enclosed }
    }

    /// The fronts look inwards and enclose most of the box around: a room.
    fn is_room(&self) -> bool {
        let size = self.around.size();
        self.enclosed < -0.5 * 6.0 * size.x * size.y * size.z
    }

    fn camera(&self) -> Camera {
        let middle = 0.5 * (self.around.min + self.around.max);
        let half = 0.5 * self.around.size();
        if self.is_room() {
            // In the corner of the view, at two thirds of the way from the middle.
            let eye = middle + 0.66 * half * DVec3::new(1.0, 0.3, 1.0);
            return Camera {
                eye,
                target: middle - 0.3 * half * DVec3::new(1.0, 0.3, 1.0),
                up: DVec3::Y,
                fov_y_deg: 60.0,
            };
        }
        // Far enough that the corners of the box are inside the square picture's cone.
        let view = VIEW.normalize();
        let (right, tan) = (DVec3::Y.cross(view).normalize(), (0.5 * FOV_Y_DEG).to_radians().tan());
        let up = view.cross(right);
        let corners = (0..8).map(|i| {
            let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            half * DVec3::new(sign(0), sign(1), sign(2))
        });
        let distance = corners
            .map(|c| c.dot(view) + c.dot(right).abs().max(c.dot(up).abs()) / (0.92 * tan))
            .fold(f64::MIN_POSITIVE, f64::max);
        Camera { eye: middle + distance * view, target: middle, up: DVec3::Y, fov_y_deg: FOV_Y_DEG }
    }

    /// Light for a camera outside, or for one among the surfaces.
    fn lights(&self, camera: &Option<Camera>) -> Vec<Light> {
        let Some(camera) = camera else { return Vec::new() };
        let view = (camera.target - camera.eye).normalize_or(DVec3::NEG_Z);
        let right = view.cross(camera.up).normalize_or(DVec3::X);
        let up = right.cross(view);
        let (low, high) = (self.around.min, self.around.max);
        let size = self.around.size();
        if camera.eye.cmpge(low).all() && camera.eye.cmple(high).all() {
            let reach = size.length() / 3.0;
            let aside = 0.02 * size.length() * (up + 0.5 * right);
            let position = (camera.eye + aside).clamp(low + 1e-3 * size, high - 1e-3 * size);
            return vec![Light::Point { position, intensity: Rgb::splat(SUN_W_M2 * reach * reach) }];
        }
        let sun = |direction: DVec3, share: f64| Light::Directional {
            direction: direction.normalize_or(view),
            irradiance: Rgb::splat(share * SUN_W_M2),
        };
        vec![sun(view + 0.9 * right - 1.1 * up, 1.0), sun(view - 0.9 * right - 0.1 * up, 0.25)]
    }
}

/// A place for a message, to four digits or so.
fn at(p: DVec3) -> String {
    p.to_array().map(|c| format!("{c:.4}").trim_end_matches('0').trim_end_matches('.').to_owned()).join(", ")
}
