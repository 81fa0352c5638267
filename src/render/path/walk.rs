//! One walk of a path tracer: what it carries, and what becomes of it at a surface.
//!
//! ```text
//! Outcome of a hit --> light += throughput w M / pi            (w: found by a bounce, balance heuristic)
//!         diffuse  --> a shadow ray, worth throughput rho E w' / pi
//!         diffuse bounce | mirrored | through, one by chance (Russian roulette) --> the next ray
//! ```
//! Light is kept in two sums: of paths that the two-pass method models, and of the others.

use glam::DVec3;
use std::f64::consts::PI;

use super::PathTracer;
use crate::geom::Ray;
use crate::raycast::transmit::MAX_PANES;
use crate::raycast::{RayHit, cosine_direction, spun_frame};
use crate::render::shader::CameraRay;
use crate::render::surfaces::{Diffuse, MIN_WEIGHT, Outcome, Path};
use crate::sampling::{hash, mix, unit_pair};
use crate::units::{Radiosity, Rgb};

/// Events after which Russian roulette may end a walk.
const FREE_EVENTS: u32 = 2;
/// Far beyond what roulette lets live (the chance is under 1e-9 even where 99 % is reflected): a stop for light that is
/// caught between surfaces that take nothing.
const MAX_EVENTS: u32 = 4000;

/// Two sums of light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Light {
    /// By paths that the two-pass method models.
    pub modelled: Rgb,
    /// By the others.
    pub missed: Rgb,
}

/// The diffuse point that a walk left last, seen along nothing but panes since.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    position: DVec3,
    normal: DVec3,
    /// Sum that its choice of an emitter was made from.
    total: f64,
    /// Chance with which the walk went on by a diffuse bounce.
    chance: f64,
    panes_since: usize,
}

/// A shadow ray and what it is worth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shadow {
    /// `None`: nothing is between.
    pub ray: Option<Ray>,
    pub worth: Rgb,
    is_modelled: bool,
}

/// A walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    /// The next ray, while it goes on.
    pub ray: Option<Ray>,
    /// Whose it is.
    pub slot: usize,
    pub light: Light,
    pub shadow: Option<Shadow>,
    key: u64,
    throughput: Rgb,
    n_events: u32,
    /// Of the specular recursion from the camera: its depth and weight.
    depth: u32,
    share: Rgb,
    has_bounced: bool,
    is_modelled: bool,
    last: Option<Vertex>,
}

impl Light {
    pub fn total(&self) -> Rgb {
        self.modelled + self.missed
    }

    fn add(&mut self, is_modelled: bool, light: Rgb) {
        if is_modelled {
            self.modelled += light;
        } else {
            self.missed += light;
        }
    }
}

impl Walk {
    /// Walk `number` of those that `key` names.
    pub fn new(slot: usize, key: u64, number: u32) -> Walk {
        Walk {
            ray: None,
            slot,
            light: Light::default(),
            shadow: None,
            key: mix(key ^ mix(u64::from(number) + 1)),
            throughput: Rgb::WHITE,
            n_events: 0,
            depth: 0,
            share: Rgb::WHITE,
            has_bounced: false,
            is_modelled: true,
            last: None,
        }
    }

    /// Its shadow ray arrived with a share of its light.
    pub fn lit(&mut self, share: Rgb) {
        if let Some(shadow) = self.shadow.take() {
            self.light.add(shadow.is_modelled, shadow.worth * share);
        }
    }
}

impl PathTracer<'_> {
    /// The ray of `walk` met `hit`.
    pub(super) fn meet(&self, walk: &mut Walk, hit: Option<RayHit>) {
        let Some(ray) = walk.ray.take() else { return };
        let path = Path { ray, camera_ray: walk.slot, weight: Rgb::WHITE, key: walk.key };
        let outcome = self.surfaces.meet(&path, hit, false);
        self.scatter(walk, &ray, hit, &outcome);
    }

    /// The first hit of a camera ray.
    pub(super) fn first(&self, walk: &mut Walk, of: &CameraRay, hit: Option<RayHit>, outcome: &Outcome) {
        self.scatter(walk, &of.ray, hit, outcome);
    }

    fn scatter(&self, walk: &mut Walk, ray: &Ray, hit: Option<RayHit>, outcome: &Outcome) {
        if !outcome.exitance.is_black() {
            let radiance = Radiosity(outcome.exitance).radiance().0;
            let weight = hit.map_or(1.0, |hit| self.weight_of_found(walk, ray, hit));
            walk.light.add(walk.is_modelled, walk.throughput * radiance * weight);
        }
        self.go_on(walk, outcome);
    }

    /// Share of an emitter's light that counts where a bounce finds it; the shadow ray of the last vertex stands for the rest.
    fn weight_of_found(&self, walk: &Walk, ray: &Ray, hit: RayHit) -> f64 {
        let (Some(last), Some(patch)) = (walk.last, self.surfaces.mesh.patch_of_hit(hit.patch, hit.facing))
        else {
            return 1.0;
        };
        let place = ray.at(hit.t);
        let cos = last.normal.dot((place - last.position).normalize_or_zero());
        let by_bounce = last.chance * cos.max(0.0) / PI;
        let by_shadow_ray = self.emitters.density(last.position, last.normal, last.total, patch, place);
        if by_bounce > 0.0 { by_bounce / (by_bounce + by_shadow_ray) } else { 1.0 }
    }

    /// Casts the lots of a walk at a surface: its shadow ray and its next ray.
    pub(super) fn go_on(&self, walk: &mut Walk, outcome: &Outcome) {
        let lots =
            |dimension: u64| unit_pair(hash(self.seed, walk.key, u64::from(walk.n_events) << 2 | dimension));
        let [choice, which_emitter] = lots(0);
        let (on_emitter, direction) = (lots(1), lots(2));
        let reflectance = outcome.diffuse.map_or(Rgb::BLACK, |d| d.reflectance);
        let [mirrored, through] = outcome.children.map(|child| child.map_or(Rgb::BLACK, |c| c.weight));
        let weights = [reflectance, mirrored, through];
        let sum: f64 = weights.iter().map(|w| w.max_channel()).sum();
        walk.shadow = None;
        if sum <= 0.0 {
            return;
        }
        let mut survival = 1.0;
        if walk.n_events >= FREE_EVENTS {
            // How bright the walk would be after it went on by chance.
            survival = (walk.throughput.max_channel() * sum).min(1.0);
        }
        let chances = weights.map(|w| survival * w.max_channel() / sum);
        let mut total = 0.0;
        if let Some(diffuse) = &outcome.diffuse
            && !diffuse.reflectance.is_black()
        {
            let u = [which_emitter, on_emitter[0], on_emitter[1]];
            total = self.look_at_emitters(walk, diffuse, chances[0], u);
        }
        walk.n_events += 1;
        let mut left = choice;
        let taken = chances.iter().position(|chance| {
            let is_taken = left < *chance;
            left -= chance;
            is_taken
        });
        let Some(taken) = taken.filter(|_| walk.n_events < MAX_EVENTS) else { return };
        match (taken, &outcome.diffuse) {
            (0, Some(diffuse)) => self.bounce(walk, diffuse, chances[0], total, direction),
            _ => self.follow(walk, outcome, taken),
        }
        walk.throughput = walk.throughput * weights[taken] / chances[taken];
    }

    /// Sets the shadow ray of a diffuse point; the sum that its choice was made from.
    fn look_at_emitters(&self, walk: &mut Walk, diffuse: &Diffuse, chance: f64, u: [f64; 3]) -> f64 {
        let (sample, total) = self.emitters.sample(&diffuse.point, u);
        if let Some(sample) = sample {
            let by_bounce = chance * sample.cos.max(0.0) / PI;
            let weight = sample.density.map_or(1.0, |density| density / (density + by_bounce));
            let reflected = Radiosity(diffuse.reflectance * sample.irradiance).radiance().0;
            let worth = walk.throughput * reflected * weight;
            walk.shadow = Some(Shadow { ray: sample.ray, worth, is_modelled: walk.is_modelled });
        }
        total
    }

    /// A cosine-distributed bounce.
    fn bounce(&self, walk: &mut Walk, diffuse: &Diffuse, chance: f64, total: f64, u: [f64; 2]) {
        let point = &diffuse.point;
        let (t1, t2) = spun_frame(point.normal, 0.0);
        let d = cosine_direction(u[0], u[1]);
        let dir = d.x * t1 + d.y * t2 + d.z * point.normal;
        walk.has_bounced = true;
        walk.last =
            Some(Vertex { position: point.position, normal: point.normal, total, chance, panes_since: 0 });
        if point.geometric_normal.dot(dir) > 0.0 {
            let origin = point.position + self.surfaces.offset_m * point.geometric_normal;
            walk.ray = Some(Ray::unbounded(origin, dir));
        }
    }

    /// Goes on along the mirrored (1) or the transmitted (2) ray.
    fn follow(&self, walk: &mut Walk, outcome: &Outcome, taken: usize) {
        let Some(child) = outcome.children[taken - 1] else { return };
        walk.ray = Some(child.ray);
        let is_straight = outcome.is_pane && taken == 2;
        if walk.has_bounced {
            walk.is_modelled &= is_straight;
        } else {
            walk.depth += 1;
            walk.share = walk.share * child.weight;
            walk.is_modelled &= walk.depth <= self.max_depth && walk.share.max_channel() >= MIN_WEIGHT;
        }
        walk.last = walk
            .last
            .filter(|_| is_straight)
            .map(|last| Vertex { panes_since: last.panes_since + 1, ..last });
        if walk.last.is_some_and(|last| last.panes_since > MAX_PANES) {
            // No shadow ray gets that far, so a bounce has to find it, and the two-pass method does not.
            walk.last = None;
            walk.is_modelled = false;
        }
    }
}
