//! Next-event estimation: which emitter a diffuse point looks at, where, and how densely it would look along a direction.
//!
//! ```text
//! point --form factors x exitance (kernel), lights' irradiance--> choice in proportion --uniform on its area--> LightSample
//! point, place on an emitter --> density (1/sr) with which that place is sampled: for multiple importance sampling
//! ```
//! E = sum over emitters, estimated by one sample: M cos cos' A / (pi r^2) / P(emitter), or a light's irradiance / P(light).
//! A piece is a plane polygon of a surface, or a patch of a curved one as casters know it: two triangles where it is bent.
//! Source: Shirley, Wang, Zimmerman 1996, "Monte Carlo techniques for direct lighting calculations".

use glam::DVec3;

use crate::direct::ShadePoint;
use crate::geom::Ray;
use crate::mesh::{Mesh, PatchId};
use crate::radiosity::{kernel, lights};
use crate::raycast::Facing;
use crate::scene::{Light, Scene};
use crate::units::Rgb;

/// A triangle of a piece.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    v0: DVec3,
    edge_1: DVec3,
    edge_2: DVec3,
    /// Toward where its light goes.
    normal: DVec3,
    area_m2: f64,
}

/// What is sampled uniformly.
#[derive(Clone, Copy, Debug)]
struct Piece {
    triangles: [Triangle; 2],
    area_m2: f64,
    source: kernel::Source,
    exitance: Rgb,
}

/// The emitters of a scene.
pub(super) struct Emitters {
    pieces: Vec<Piece>,
    lights: Vec<Light>,
    /// The piece that a patch, of either side, is a part of.
    of_patch: Vec<Option<u32>>,
    offset_m: f64,
}

/// A place that a point looks at.
pub(super) struct LightSample {
    /// Estimate of the unoccluded irradiance of all emitters (W/m^2).
    pub irradiance: Rgb,
    /// Density of its direction (1/sr); `None` for lights without area, which no other ray can find.
    pub density: Option<f64>,
    /// Its shadow ray; `None` where nothing fits between.
    pub ray: Option<Ray>,
    /// Cosine at the point.
    pub cos: f64,
}

impl Triangle {
    fn new(v: [DVec3; 3], turn: f64) -> Triangle {
        let (edge_1, edge_2) = (v[1] - v[0], v[2] - v[0]);
        let cross = edge_1.cross(edge_2);
        let normal = turn * cross.normalize_or_zero();
        Triangle { v0: v[0], edge_1, edge_2, normal, area_m2: 0.5 * cross.length() }
    }

    /// (1 - sqrt u, sqrt u (1 - v), sqrt u v) keeps area (Turk 1990).
    fn place(&self, [u, v]: [f64; 2]) -> DVec3 {
        let r = u.sqrt();
        self.v0 + (r * (1.0 - v)) * self.edge_1 + (r * v) * self.edge_2
    }
}

impl Piece {
    /// `corners` as casters have them: quads are cut along the diagonal v0 v2.
    fn new(corners: &[DVec3], side: Facing, exitance: Rgb) -> Piece {
        let turn = if side == Facing::Front { 1.0 } else { -1.0 };
        let first = Triangle::new([corners[0], corners[1], corners[2]], turn);
        let second = match corners {
            [a, _, c, d] => Triangle::new([*a, *c, *d], turn),
            _ => Triangle { area_m2: 0.0, ..first },
        };
        let mut seen = corners.to_vec();
        if side == Facing::Back {
            seen.reverse();
        }
        Piece {
            triangles: [first, second],
            area_m2: first.area_m2 + second.area_m2,
            source: kernel::Source::new(&seen),
            exitance,
        }
    }

    fn brightness(&self, point: DVec3, normal: DVec3) -> f64 {
        self.exitance.luminance() * self.source.form_factor(point, normal)
    }

    /// The triangle that a place on the piece belongs to.
    fn triangle_at(&self, place: DVec3) -> &Triangle {
        let [first, second] = &self.triangles;
        let normal = first.edge_1.cross(first.edge_2);
        let is_beyond_diagonal = normal.dot(first.edge_2.cross(place - first.v0)) > 0.0;
        if second.area_m2 > 0.0 && is_beyond_diagonal { second } else { first }
    }
}

impl Emitters {
    pub fn new(scene: &Scene, mesh: &Mesh, offset_m: f64) -> Emitters {
        let mut pieces = Vec::new();
        let mut of_patch = vec![None; mesh.patches.len()];
        for (surface, patches) in scene.surfaces.iter().zip(&mesh.surfaces) {
            if surface.exitance.is_black() {
                continue;
            }
            let whole = surface.shape.polygon();
            for (side, range) in [(Facing::Front, &patches.front), (Facing::Back, &patches.back)] {
                let mut add = |corners: &[DVec3]| {
                    pieces.push(Piece::new(corners, side, surface.exitance));
                    Some(pieces.len() as u32 - 1)
                };
                match whole {
                    Some(corners) if !range.is_empty() => {
                        of_patch[range.start as usize..range.end as usize].fill(add(corners));
                    }
                    _ => {
                        for p in range.clone() {
                            // Casters know the front; of a bent quad its diagonal matters.
                            let cast = match (side, mesh.patches[p as usize].twin) {
                                (Facing::Back, Some(front)) => front.0,
                                _ => p,
                            };
                            let corners = mesh.polygon(&mesh.patches[cast as usize].corners);
                            of_patch[p as usize] = add(&corners);
                        }
                    }
                }
            }
        }
        Emitters { pieces, lights: scene.lights.clone(), of_patch, offset_m }
    }

    /// What `point` looks at, by `[choice, u, v]` in [0, 1); and the sum that its choice was made from, 0 when it sees none.
    pub fn sample(&self, point: &ShadePoint, u: [f64; 3]) -> (Option<LightSample>, f64) {
        let (position, normal) = (point.position, point.normal);
        // Weighted reservoir of one, the random number stretched again after each look.
        let (mut left, mut total, mut chosen) = (u[0], 0.0, None);
        let mut consider = |k: usize, weight: f64| {
            if weight > 0.0 {
                total += weight;
                let share = weight / total;
                if left < share {
                    chosen = Some((k, weight));
                    left /= share;
                } else {
                    left = (left - share) / (1.0 - share);
                }
            }
        };
        for (k, piece) in self.pieces.iter().enumerate() {
            consider(k, piece.brightness(position, normal));
        }
        for (k, light) in self.lights.iter().enumerate() {
            let e = lights::irradiance(light, position, normal);
            consider(self.pieces.len() + k, e.luminance());
        }
        let Some((k, weight)) = chosen else { return (None, 0.0) };
        let probability = weight / total;
        let sample = match self.pieces.get(k) {
            Some(piece) => self.on_piece(point, piece, probability, [u[1], u[2]]),
            None => self.of_light(point, &self.lights[k - self.pieces.len()], probability),
        };
        (sample, total)
    }

    fn on_piece(
        &self,
        point: &ShadePoint,
        piece: &Piece,
        probability: f64,
        [u, v]: [f64; 2],
    ) -> Option<LightSample> {
        let [first, second] = &piece.triangles;
        let share = first.area_m2 / piece.area_m2;
        let (triangle, u) =
            if u < share { (first, u / share) } else { (second, (u - share) / (1.0 - share)) };
        let place = triangle.place([u, v]);
        let r = place - point.position;
        let (r2, distance) = (r.length_squared(), r.length());
        let (cos, cos_emitter) = (point.normal.dot(r) / distance, -triangle.normal.dot(r) / distance);
        if !(cos > 0.0 && cos_emitter > 0.0 && point.geometric_normal.dot(r) > 0.0) {
            return None;
        }
        let density = probability / piece.area_m2 * r2 / cos_emitter;
        let irradiance = piece.exitance * (cos / (std::f64::consts::PI * density));
        let ray = self.shadow_ray(point, place + self.offset_m * triangle.normal);
        Some(LightSample { irradiance, density: Some(density), ray, cos })
    }

    fn of_light(&self, point: &ShadePoint, light: &Light, probability: f64) -> Option<LightSample> {
        let irradiance = lights::irradiance(light, point.position, point.normal) / probability;
        let toward = match light {
            Light::Directional { direction, .. } => -*direction,
            Light::Point { position, .. } | Light::Spot { position, .. } => *position - point.position,
        };
        if point.geometric_normal.dot(toward) <= 0.0 {
            return None;
        }
        let ray = match lights::position(light) {
            Some(position) => self.shadow_ray(point, position),
            None => Some(Ray::unbounded(self.apex(point), toward)),
        };
        let cos = point.normal.dot(toward.normalize_or_zero());
        Some(LightSample { irradiance, density: None, ray, cos })
    }

    fn apex(&self, point: &ShadePoint) -> DVec3 {
        point.position + self.offset_m * point.geometric_normal
    }

    fn shadow_ray(&self, point: &ShadePoint, target: DVec3) -> Option<Ray> {
        let apex = self.apex(point);
        // A target within the offset of the apex has nothing between, and no direction in coarse words.
        ((target - apex).length() > 2.0 * self.offset_m).then(|| Ray::to_point(apex, target))
    }

    /// Density (1/sr) with which a point, whose choice is made from the sum `total`, samples `place` on patch `patch`.
    pub fn density(&self, from: DVec3, normal: DVec3, total: f64, patch: PatchId, place: DVec3) -> f64 {
        let Some(piece) = self.of_patch[patch.0 as usize].map(|k| &self.pieces[k as usize]) else {
            return 0.0;
        };
        if total <= 0.0 {
            return 0.0;
        }
        let r = place - from;
        let (r2, distance) = (r.length_squared(), r.length());
        let cos_emitter = -piece.triangle_at(place).normal.dot(r) / distance;
        if cos_emitter <= 0.0 {
            return 0.0;
        }
        piece.brightness(from, normal) / total / piece.area_m2 * r2 / cos_emitter
    }
}
