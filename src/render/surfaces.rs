//! What a ray meets where it hits: exitance, a diffuse point that wants irradiance, specular children.
//!
//! ```text
//! Path + RayHit --mesh--> surface, side, normals --material--> Outcome { exitance, diffuse, children }
//! ```
//! Reflected share: specular + transmission x R; refracted: transmission x (1 - R), R by Fresnel. Spheres are closed:
//! rays refract in and out of them. Any other glass is a thin pane: straight on with the slab's transmittance, R its
//! complement. The one-sided diffuse part faces its front only; glass works from both sides.
//! Not modelled: radiance change by n^2 inside glass for diffuse surfaces in it, absorption in glass.

use glam::DVec3;

use super::shader::CameraRay;
use crate::direct::ShadePoint;
use crate::geom::Ray;
use crate::geom::optics::{fresnel, reflect, refract, slab_transmittance};
use crate::mesh::{Mesh, Patch, SurfacePoint};
use crate::raycast::transmit::is_pane;
use crate::raycast::{Facing, RayHit};
use crate::sampling::mix;
use crate::scene::{Material, Scene, Shape, Surface, SurfaceId};
use crate::units::Rgb;

/// Paths of recursion that carry less than this of the pixel's radiance end.
pub(super) const MIN_WEIGHT: f64 = 1e-3;

/// A ray on its way and whose it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub ray: Ray,
    /// Index of its camera ray in the wave.
    pub camera_ray: usize,
    /// Share of the seen radiance that reaches the pixel.
    pub weight: Rgb,
    /// Names the path for sampling patterns.
    pub key: u64,
}

/// A diffuse point and what its irradiance is multiplied with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diffuse {
    pub point: ShadePoint,
    pub reflectance: Rgb,
    /// Where it is on the mesh.
    pub at: SurfacePoint,
}

/// What a path met.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outcome {
    /// M of the seen side (W/m^2).
    pub exitance: Rgb,
    pub diffuse: Option<Diffuse>,
    /// The reflected and the transmitted ray.
    pub children: [Option<Path>; 2],
    /// It is thin glass: the transmitted ray goes straight on.
    pub is_pane: bool,
    /// The black back of a one-sided surface was seen.
    pub back: Option<SurfaceId>,
}

/// The scene's surfaces as rays meet them.
#[derive(Clone, Copy)]
pub(super) struct Surfaces<'a> {
    pub scene: &'a Scene,
    pub mesh: &'a Mesh,
    /// The caster's surface offset.
    pub offset_m: f64,
    /// Paths that carry less than this end.
    pub min_weight: f64,
}

impl Path {
    pub fn camera(camera_ray: usize, of: &CameraRay) -> Path {
        Path { ray: of.ray, camera_ray, weight: Rgb::WHITE, key: of.key() }
    }

    fn child(&self, ray: Ray, share: Rgb, branch: u64) -> Path {
        Path { ray, weight: self.weight * share, key: mix(self.key ^ branch), ..*self }
    }
}

/// Where a path met a surface; normals look back along the path.
struct Meeting<'a> {
    surface: &'a Surface,
    material: &'a Material,
    position: DVec3,
    geometric: DVec3,
    shading: DVec3,
    /// The side of the cast patch.
    facing: Facing,
}

impl Surfaces<'_> {
    /// What `path` meets; `always`: also the point of a surface that reflects nothing, whose irradiance is asked for.
    pub fn meet(&self, path: &Path, hit: Option<RayHit>, always: bool) -> Outcome {
        let Some(hit) = hit else { return Outcome::default() };
        let cast = &self.mesh.patches[hit.patch.0 as usize];
        let surface = &self.scene.surfaces[cast.surface.0 as usize];
        let material = self.scene.material(surface);
        let seen = self.mesh.patch_of_hit(hit.patch, hit.facing);
        let is_glass = !material.transmission.is_black();
        if seen.is_none() && !is_glass {
            return Outcome { back: Some(cast.surface), ..Outcome::default() };
        }
        let patch_id = seen.unwrap_or(hit.patch);
        let patch = &self.mesh.patches[patch_id.0 as usize];
        let at = self.mesh.locate(patch_id, path.ray.at(hit.t));
        let position = self.mesh.position(at);
        // A back of glass without a patch of its own looks the other way.
        let turn = if seen.is_some() { 1.0 } else { -1.0 };
        let geometric = turn * patch.normal;
        let shading = self.shading_normal(surface, patch, at, turn, path.ray.dir);
        let meeting = Meeting { surface, material, position, geometric, shading, facing: hit.facing };

        let children = self.specular(path, &meeting).map(|child| child.filter(|c| self.carries(c.weight)));
        let is_pane = is_pane(self.scene, surface);
        let mut outcome = Outcome { children, is_pane, ..Outcome::default() };
        if seen.is_some() {
            outcome.exitance = surface.exitance;
            if always || !material.reflectance.is_black() {
                let point =
                    ShadePoint { position, normal: shading, geometric_normal: geometric, key: path.key };
                outcome.diffuse = Some(Diffuse { point, reflectance: material.reflectance, at });
            }
        }
        outcome
    }

    fn carries(&self, weight: Rgb) -> bool {
        !weight.is_black() && weight.max_channel() >= self.min_weight
    }

    /// The vertices' normal on curved and smoothly joined surfaces, where it looks at the viewer; else the patch's.
    fn shading_normal(
        &self,
        surface: &Surface,
        patch: &Patch,
        at: SurfacePoint,
        turn: f64,
        dir: DVec3,
    ) -> DVec3 {
        let flat = turn * patch.normal;
        let curved = matches!(surface.shape, Shape::Sphere { .. } | Shape::Cylinder { .. } | Shape::Faces(_));
        if !curved && surface.smooth_group == 0 {
            return flat;
        }
        let element = &self.mesh.elements[at.element.0 as usize];
        let n = |i: usize| self.mesh.vertices[element.corners.vertices()[i].0 as usize].normal;
        let (s, t) = (at.st.x, at.st.y);
        let mean = if element.corners.vertices().len() == 3 {
            (1.0 - s - t) * n(0) + s * n(1) + t * n(2)
        } else {
            (n(0).lerp(n(1), s)).lerp(n(3).lerp(n(2), s), t)
        };
        let smooth = turn * mean.normalize_or(patch.normal);
        if smooth.dot(dir) < 0.0 { smooth } else { flat }
    }

    /// The reflected and the transmitted ray.
    fn specular(&self, path: &Path, m: &Meeting<'_>) -> [Option<Path>; 2] {
        let Material { specular, transmission, ior, .. } = m.material;
        if specular.is_black() && transmission.is_black() {
            return [None, None];
        }
        let d = path.ray.dir.normalize();
        let cos = -d.dot(m.shading);
        let above = m.position + self.offset_m * m.geometric;
        let below = m.position - self.offset_m * m.geometric;
        // (interface reflectance, share that goes through, its direction)
        let (reflectance, through) = if transmission.is_black() {
            (0.0, None)
        } else if let Shape::Sphere { inward, .. } = m.surface.shape {
            let entering = (m.facing == Facing::Front) != inward;
            let eta = if entering { 1.0 / ior } else { *ior };
            let r = fresnel(cos, eta);
            (r, refract(d, m.shading, eta).map(|dir| (1.0 - r, dir)))
        } else {
            // Of the plane pane, as shadow rays take it.
            let t = slab_transmittance(-d.dot(m.geometric), *ior);
            (1.0 - t, Some((t, d)))
        };
        let mirrored = reflect(d, m.shading);
        // A curved mirror's facet may be in the way of the smooth direction; the facet's own never is.
        let mirrored = if mirrored.dot(m.geometric) > 0.0 { mirrored } else { reflect(d, m.geometric) };
        let through = through.map(|(share, dir)| {
            // Likewise: what goes through leaves on the other side.
            let dir = if dir.dot(m.geometric) < 0.0 { dir } else { d };
            path.child(Ray::unbounded(below, dir), *transmission * share, 2)
        });
        let mirrored =
            path.child(Ray::unbounded(above, mirrored), *specular + *transmission * reflectance, 1);
        [Some(mirrored), through]
    }
}
