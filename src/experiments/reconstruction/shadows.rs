//! Direct light behind one blocker, at any point: the penumbra of a square lamp, the shadow of a point light.
//!
//! ```text
//! scene: room, a square lamp that faces down | a point light, and "blocker", a level quad under it --> E_direct(x), exact
//! penumbra: F(x, lamp) less F(x, what of the blocker lies before the lamp), Lambert's formula
//! point:    I cos / r^2, or 0 where the segment crosses the blocker
//! ```
//! Reflected light is left out: shadows are of the direct light, and that has a closed form. Walls and floor only: what faces
//! down or is the blocker itself counts for nothing.

use crate::experiments::ExperimentError;
use crate::experiments::validation::formulas::visible_polygon;
use crate::geom::DVec3;
use crate::mesh::{Mesh, SurfacePoint};
use crate::reconstruct::metrics::{self, Reference};
use crate::scene::{Light, Scene, Shape, Surface};
use crate::units::Rgb;

/// What sends the light.
#[derive(Clone, Debug)]
enum Sender {
    /// Corners, counter-clockwise from below, and exitance (W/m^2).
    Lamp([DVec3; 4], f64),
    /// Position and intensity (W/sr).
    Point(DVec3, f64),
}

/// One sender and one blocker.
#[derive(Clone, Debug)]
pub struct Shadow {
    sender: Sender,
    /// Corners, counter-clockwise from below.
    blocker: [DVec3; 4],
}

/// The quad counter-clockwise seen from below.
fn from_below(corners: [DVec3; 4]) -> [DVec3; 4] {
    let [a, b, c, d] = corners;
    if (b - a).cross(c - a).z < 0.0 { corners } else { [a, d, c, b] }
}

fn quad(surface: &Surface) -> Option<[DVec3; 4]> {
    match surface.shape {
        Shape::Quad(v) => Some(from_below(v)),
        _ => None,
    }
}

impl Shadow {
    /// That of a scene with a quad named `blocker` and either one emitting quad or one point light.
    ///
    /// # Errors
    /// Another scene.
    pub fn of(scene: &Scene) -> Result<Shadow, ExperimentError> {
        let wrong = |what: &str| ExperimentError::Scene(format!("{}: {what}", scene.path.display()));
        let blocker = scene.surfaces.iter().find(|s| s.name == "blocker").and_then(quad);
        let blocker = blocker.ok_or_else(|| wrong("no quad named blocker"))?;
        let lamp = scene.surfaces.iter().find(|s| !s.exitance.is_black());
        let sender = match (lamp, scene.lights.as_slice()) {
            (Some(lamp), []) => {
                let corners = quad(lamp).ok_or_else(|| wrong("a lamp that is no quad"))?;
                Sender::Lamp(corners, lamp.exitance.luminance())
            }
            (None, [Light::Point { position, intensity }]) => Sender::Point(*position, intensity.luminance()),
            _ => return Err(wrong("expected one emitting quad or one point light")),
        };
        Ok(Shadow { sender, blocker })
    }

    /// Direct irradiance at a point (W/m^2, luminance).
    pub fn irradiance(&self, x: DVec3, normal: DVec3) -> f64 {
        match &self.sender {
            Sender::Lamp(corners, exitance) => {
                let above = x.z < corners[0].z;
                if above {
                    exitance * visible_polygon(x, normal, corners, &self.blocker).max(0.0)
                } else {
                    0.0
                }
            }
            Sender::Point(position, intensity) => {
                let hidden = self.hides(x, *position - x);
                if hidden { 0.0 } else { from_point(*position, *intensity, x, normal) }
            }
        }
    }

    /// Values at the vertices of a mesh whose edges stand for shadow lines: a vertex on one is wholly on its elements' side,
    /// as in pass 1.
    pub fn vertex_values(&self, mesh: &Mesh) -> Vec<Rgb> {
        let mut values = metrics::vertex_values(mesh, self);
        let Sender::Point(position, intensity) = &self.sender else { return values };
        for v in mesh.line_vertices() {
            let (vertex, inside) = (&mesh.vertices[v.0 as usize], mesh.centroid(mesh.elements_around(*v)[0]));
            let lit = !self.hides(inside, *position - inside);
            let e = if lit { from_point(*position, *intensity, vertex.position, vertex.normal) } else { 0.0 };
            values[v.0 as usize] = Rgb::splat(e);
        }
        values
    }

    /// Whether the way from x along all of r crosses the blocker.
    fn hides(&self, x: DVec3, r: DVec3) -> bool {
        let share = (self.blocker[0].z - x.z) / r.z;
        if !(0.0..1.0).contains(&share) {
            return false;
        }
        let at = x + share * r;
        // Counter-clockwise from below: clockwise in (x, y).
        (0..4).all(|k| {
            let (a, b) = (self.blocker[k], self.blocker[(k + 1) % 4]);
            (b - a).truncate().perp_dot((at - a).truncate()) <= 0.0
        })
    }
}

/// Irradiance of a point light that nothing hides.
fn from_point(position: DVec3, intensity: f64, x: DVec3, normal: DVec3) -> f64 {
    let r = position - x;
    intensity * normal.dot(r).max(0.0) / r.length().powi(3)
}

impl Reference for Shadow {
    fn luminance(&self, mesh: &Mesh, at: SurfacePoint) -> f64 {
        self.irradiance(mesh.position(at), mesh.elements[at.element.0 as usize].normal)
    }
}
