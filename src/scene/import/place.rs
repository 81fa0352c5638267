//! A model put into a scene: scaled, turned, moved, and its objects made surfaces.
//!
//! ```text
//! Model --unit, scale, rotate x y z, translate--> polygons in the scene's metres --faces/--> Surface per object and material
//! ```

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::super::faces::{FaceCounts, Faults};
use super::super::{Camera, Light, MAX_FACES, MaterialId, SceneError, Shape, Surface};
use super::{Model, Object, shown, stem};
use crate::units::Rgb;

/// Largest coordinate of a scene (m): as in scene files.
pub(in crate::scene) const MAX_COORDINATE_M: f64 = 1e6;

/// Where a model stands: p = translate + rotation (scale p), scale including the unit of length.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Placement {
    /// Metres per unit of the file, times the scale.
    pub(in crate::scene) scale: f64,
    /// About x, then y, then z.
    pub(in crate::scene) rotation: DMat3,
    /// Last (m).
    pub(in crate::scene) translate: DVec3,
}

impl Placement {
    /// As it stands in its file.
    pub(in crate::scene) const NONE: Placement =
        Placement { scale: 1.0, rotation: DMat3::IDENTITY, translate: DVec3::ZERO };

    /// Turns about the axes x, y, z, in this order (degrees).
    pub(in crate::scene) fn turned(degrees: DVec3) -> DMat3 {
        // Quarter turns are exact: a wall that stood straight stands straight.
        let turn = |d: f64| match d.rem_euclid(360.0) {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            d => d.to_radians().sin_cos(),
        };
        let v = DVec3::new;
        let (s, c) = turn(degrees.x);
        let x = DMat3::from_cols(v(1., 0., 0.), v(0., c, s), v(0., -s, c));
        let (s, c) = turn(degrees.y);
        let y = DMat3::from_cols(v(c, 0., -s), v(0., 1., 0.), v(s, 0., c));
        let (s, c) = turn(degrees.z);
        let z = DMat3::from_cols(v(c, s, 0.), v(-s, c, 0.), v(0., 0., 1.));
        z * y * x
    }

    fn point(&self, p: DVec3) -> DVec3 {
        self.translate + self.rotation * (self.scale * p)
    }

    /// The camera as it stands in the scene.
    pub(in crate::scene) fn camera(&self, camera: Camera) -> Camera {
        Camera {
            eye: self.point(camera.eye),
            target: self.point(camera.target),
            up: self.rotation * camera.up,
            ..camera
        }
    }

    /// The light as it stands in the scene; its intensity stays.
    pub(in crate::scene) fn light(&self, light: Light) -> Light {
        match light {
            Light::Point { position, intensity } => {
                Light::Point { position: self.point(position), intensity }
            }
            Light::Spot { position, direction, intensity, inner_deg, outer_deg } => Light::Spot {
                position: self.point(position),
                direction: self.rotation * direction,
                intensity,
                inner_deg,
                outer_deg,
            },
            Light::Directional { direction, irradiance } => {
                Light::Directional { direction: self.rotation * direction, irradiance }
            }
        }
    }
}

/// Names that are taken, each with the next number for another of its kind.
pub(in crate::scene) type Names = HashMap<String, u32>;

/// Where a model's surfaces go.
pub(in crate::scene) struct Target<'a> {
    /// The scene's surfaces so far.
    pub(in crate::scene) surfaces: &'a mut Vec<Surface>,
    /// Their names.
    pub(in crate::scene) names: &'a mut Names,
    /// Faces imported so far.
    pub(in crate::scene) n_faces: &'a mut usize,
    /// What the user should know.
    pub(in crate::scene) warnings: &'a mut Vec<String>,
}

impl Target<'_> {
    /// Adds the surfaces of a model read from `path`; `dress` tells an object's material, and what it emits given its
    /// area (m^2) and number of sides.
    pub(in crate::scene) fn add(
        &mut self,
        path: &Path,
        model: &mut Model,
        placement: &Placement,
        prefix: &str,
        dress: &dyn Fn(usize, f64, u32) -> (MaterialId, Rgb),
    ) -> Result<(), SceneError> {
        let mut counts = FaceCounts::default();
        let mut n_turned = 0;
        let objects = std::mem::take(&mut model.objects);
        let names = object_names(path, &objects, model, prefix);
        for (mut object, name) in objects.into_iter().zip(names) {
            for p in &mut object.faces.points {
                *p = placement.point(*p);
            }
            for n in &mut object.faces.normals {
                *n = placement.rotation * *n;
            }
            let built = object.faces.build(MAX_COORDINATE_M);
            let (set, from_both_sides) = built.map_err(|Faults::FarPoint(p)| {
                SceneError::of_file(
                    path,
                    format!(
                        "object '{}' has a point at {p} m, expected coordinates within +-{MAX_COORDINATE_M:e} m",
                        shown(&object.name)
                    ),
                )
            })?;
            n_turned += usize::from(from_both_sides && !object.two_sided);
            let Some(set) = set else {
                counts.n_polygons += object.faces.n_polygons();
                counts.n_degenerate += object.faces.n_polygons();
                continue;
            };
            counts += set.counts();
            *self.n_faces += set.n_faces();
            if *self.n_faces > MAX_FACES {
                return Err(too_many_faces(path));
            }
            let two_sided = object.two_sided || from_both_sides;
            let area_m2 = set.area_m2();
            let (material, exitance) = dress(object.material, area_m2, if two_sided { 2 } else { 1 });
            let name = unique(self.names, name);
            let shape = Shape::Faces(Arc::new(set));
            self.surfaces.push(Surface { name, material, shape, two_sided, smooth_group: 0, exitance });
        }
        self.tell(path, counts, n_turned);
        self.warnings.append(&mut model.warnings);
        Ok(())
    }

    fn tell(&mut self, path: &Path, counts: FaceCounts, n_turned: usize) {
        let FaceCounts { n_polygons, n_degenerate, n_doubled, .. } = counts;
        let mut say = |text: String| self.warnings.push(format!("{}: {text}", path.display()));
        if n_degenerate > 0 {
            say(format!("{n_degenerate} of {n_polygons} faces have no area (corners on one line): dropped"));
        }
        if n_doubled > 0 {
            say(format!("{n_doubled} of {n_polygons} faces have the same corners as another one: dropped"));
        }
        if n_turned > 0 {
            say(format!(
                "{n_turned} surfaces have faces that stood there once from either side: made two-sided"
            ));
        }
    }
}

/// The refusal of a model, or of models, beyond the limit.
pub(in crate::scene) fn too_many_faces(path: &Path) -> SceneError {
    SceneError::of_file(
        path,
        format!("more than {MAX_FACES} faces in the scene, the limit of imported meshes"),
    )
}

/// `[prefix/]object`, or `[prefix/]object/material` for an object of several materials.
fn object_names(path: &Path, objects: &[Object], model: &Model, prefix: &str) -> Vec<String> {
    let mut n_of: HashMap<&str, usize> = HashMap::new();
    for object in objects {
        *n_of.entry(&object.name).or_default() += 1;
    }
    let name = |object: &Object| {
        let own = shown(object.name.trim());
        let own = if own.is_empty() { stem(path) } else { own };
        let material = &model.materials[object.material].material.name;
        let several = n_of[object.name.as_str()] > 1;
        format!("{prefix}{own}{}", if several { format!("/{}", shown(material)) } else { String::new() })
    };
    objects.iter().map(name).collect()
}

/// `name`, or `name #2` and so on when it is taken.
pub(in crate::scene) fn unique(names: &mut Names, name: String) -> String {
    let Some(next) = names.get_mut(&name) else {
        names.insert(name.clone(), 2);
        return name;
    };
    let mut k = *next;
    *next += 1;
    loop {
        let numbered = format!("{name} #{k}");
        if !names.contains_key(&numbered) {
            names.insert(numbered.clone(), 2);
            return numbered;
        }
        k += 1;
    }
}
