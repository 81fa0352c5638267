//! What a solution was made with: emission and reflection of every surface, and the lights.
//!
//! ```text
//! Scene --> Lighting --.radsol--> Lighting --difference--> what changed, by name
//! ```
//! A solution is used for the same lighting only; a solve goes on from one of another lighting (`relight.rs`).

use serde::{Deserialize, Serialize};

use crate::scene::{Light, Scene};
use crate::units::Rgb;

/// Emission and reflection of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceOptics {
    /// Exitance of an emitting side (W/m^2).
    pub exitance: Rgb,
    /// Diffuse reflectance.
    pub reflectance: Rgb,
    /// Mirror share.
    pub specular: Rgb,
    /// Transmitted share.
    pub transmission: Rgb,
}

/// Everything about a scene but its geometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lighting {
    /// Surfaces in scene order.
    pub surfaces: Vec<SurfaceOptics>,
    /// Lights in scene order.
    pub lights: Vec<Light>,
}

impl Lighting {
    /// That of a scene.
    pub fn of(scene: &Scene) -> Lighting {
        let surfaces = scene.surfaces.iter().map(|surface| {
            let material = scene.material(surface);
            SurfaceOptics {
                exitance: surface.exitance,
                reflectance: material.reflectance,
                specular: material.specular,
                transmission: material.transmission,
            }
        });
        Lighting { surfaces: surfaces.collect(), lights: scene.lights.clone() }
    }

    /// The first thing that is different in `scene`, with both values; `None` when nothing is.
    pub fn difference(&self, scene: &Scene) -> Option<String> {
        let now = Lighting::of(scene);
        if self.surfaces.len() != now.surfaces.len() {
            return Some(format!("{} surfaces, the scene has {}", self.surfaces.len(), now.surfaces.len()));
        }
        for ((then, now), surface) in self.surfaces.iter().zip(&now.surfaces).zip(&scene.surfaces) {
            let parts = [
                ("emission (W/m^2)", then.exitance, now.exitance),
                ("reflectance", then.reflectance, now.reflectance),
                ("specular share", then.specular, now.specular),
                ("transmission", then.transmission, now.transmission),
            ];
            if let Some((what, then, now)) = parts.into_iter().find(|(_, then, now)| then != now) {
                return Some(format!(
                    "{what} {:?} of surface '{}', the scene has {:?}",
                    then.0, surface.name, now.0
                ));
            }
        }
        let n = self.lights.len().max(now.lights.len());
        let first = (0..n).find(|&i| self.lights.get(i) != now.lights.get(i))?;
        Some(format!(
            "another light {} of {}, the scene has {}",
            first + 1,
            self.lights.len(),
            now.lights.len()
        ))
    }

    /// What in it cannot be, in words.
    pub fn fault(&self) -> Option<String> {
        let wrong = |rgb: Rgb, most: f64| !rgb.0.iter().all(|c| (0.0..=most).contains(c));
        let surfaces = self.surfaces.iter().enumerate();
        for (i, s) in surfaces {
            let shares = s.reflectance + s.specular + s.transmission;
            if wrong(s.exitance, f64::MAX)
                || [s.reflectance, s.specular, s.transmission, shares].iter().any(|rgb| wrong(*rgb, 1.0))
            {
                return Some(format!("surface {} with {s:?}", i + 1));
            }
        }
        None
    }
}
