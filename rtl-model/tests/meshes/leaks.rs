//! How many rays escape from closed meshes when products are rounded.

use rtl_model::datapath::RayWords;
use rtl_model::datapath::ray_patch::intersect;
use rtl_model::fixed::Formats;

use super::Mesh;
use super::inside::origin;
use super::random::Random;
use super::rays::{self, Target};

/// Rays from inside one mesh.
#[derive(Clone, Debug)]
pub struct Cast {
    /// The mesh.
    pub mesh: Mesh,
    /// The rays.
    pub rays: Vec<RayWords>,
}

/// How a ray's direction is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// Rounded to D bits: the ray passes near its target.
    Rounded,
    /// Not rounded: the ray passes through its target.
    Exact,
}

/// `n_rays` rays at the targets of as many random meshes as it takes, 32 a mesh.
pub fn casts(formats: &Formats, aim: Aim, target: Target, n_rays: usize, random: &mut Random) -> Vec<Cast> {
    let mut casts = Vec::new();
    let mut missing = n_rays;
    // Edges need points that are words; an odd number leaves all low bits of the products in use.
    let snap = if (aim, target) == (Aim::Exact, Target::Edge) { 15 } else { 1 };
    while missing > 0 {
        let mesh = Mesh::any(formats.coord_frac_bits, snap, random);
        let mut rays = Vec::new();
        for _ in 0..4 * 32 {
            if rays.len() == missing.min(32) {
                break;
            }
            let ray = origin(&mesh, random).and_then(|base| match aim {
                Aim::Rounded => rays::aimed(formats, &mesh, base, target, random),
                Aim::Exact => rays::exact(formats, &mesh, base, target, random),
            });
            rays.extend(ray);
        }
        missing -= rays.len();
        casts.push(Cast { mesh, rays });
    }
    casts
}

/// How many rays hit no patch of their mesh.
pub fn escaped(formats: &Formats, casts: &[Cast]) -> usize {
    let lost = |cast: &Cast, ray: &RayWords| {
        cast.mesh.patches.iter().all(|patch| intersect(formats, ray, patch).is_none())
    };
    casts.iter().map(|cast| cast.rays.iter().filter(|ray| lost(cast, ray)).count()).sum()
}
