//! The unquantised caster that replaces the board: a bounding-volume tree in f32, patches in f64, all threads.
//!
//! ```text
//! CastPatch --boxes--> Bvh4 --order of its leaves--> patches, two triangles each at the diagonal v0 v2
//! Query --rays, chunk by chunk (rayon)--> traverse --> nearest (t, patch) | any
//! ```
//! Answers are functions of ray and patches alone: the nearest hit by (t, patch id) whatever the tree or the number
//! of threads. Signs of edge values are exact (`patch_test.rs`), boxes conservative (`bvh4.rs`): no ray leaves a closed
//! room. Patches with non-finite corners never hit.

mod bvh4;
mod patch_test;

use rayon::prelude::*;

use super::bundle::{check_bundles, check_ray};
use super::{CastError, CastPatch, Purpose, Query, RayBundle, RayCaster, RayHit, bend_m};
use crate::geom::{Aabb, Ray};
use crate::huge_pages::move_table;
use crate::mesh::PatchId;
use bvh4::{Bvh4, Pending};
use patch_test::{Patch, TestRay};

/// Rays per unit of work of a thread.
const RAYS_PER_CHUNK: usize = 1024;
/// Bundles per unit of work of a thread.
const BUNDLES_PER_CHUNK: usize = 32;

/// Casts rays in software, exactly enough in f64.
#[derive(Clone, Debug)]
pub struct SoftwareCaster {
    tree: Bvh4,
    /// In the order of the tree's leaves.
    patches: Vec<Patch>,
    /// Place among them, by id.
    places: Vec<Option<u32>>,
    bounds: Aabb,
    surface_offset_m: f64,
}

impl SoftwareCaster {
    /// Builds the tree; the id of a patch is its index.
    pub fn new(patches: Vec<CastPatch>) -> SoftwareCaster {
        let mut ids = Vec::with_capacity(patches.len());
        let mut boxes = Vec::with_capacity(patches.len());
        for (id, patch) in patches.iter().enumerate() {
            let corners = &patch.corners[..if patch.is_triangle { 3 } else { 4 }];
            if corners.iter().all(|c| c.is_finite()) {
                ids.push(id);
                boxes.push(Aabb::around(corners.iter().copied()));
            }
        }
        let tree = Bvh4::build(&boxes);
        let ordered = tree.order.iter().map(|&i| ids[i as usize]);
        let ordered: Vec<Patch> = ordered.map(|id| Patch::new(&patches[id], id as u32)).collect();
        move_table(&tree.nodes);
        move_table(&ordered);
        let mut places = vec![None; patches.len()];
        ordered.iter().enumerate().for_each(|(at, patch)| places[patch.id as usize] = Some(at as u32));
        let bounds =
            boxes.iter().fold(Aabb::EMPTY, |s, b| Aabb { min: s.min.min(b.min), max: s.max.max(b.max) });
        let surface_offset_m = surface_offset_m(&patches, &bounds);
        SoftwareCaster { tree, patches: ordered, places, bounds, surface_offset_m }
    }

    fn test_ray(&self, ray: &Ray) -> TestRay {
        let reach = (self.bounds.min - ray.origin).abs().max((self.bounds.max - ray.origin).abs());
        TestRay::new(ray.origin, ray.dir, reach.max_element())
    }

    /// Nearest hit, or with `ANY` the first that turns up.
    #[inline]
    fn cast<const ANY: bool>(&self, stack: &mut Vec<Pending>, ray: &Ray) -> Option<RayHit> {
        let test = self.test_ray(ray);
        let mut best: Option<RayHit> = None;
        self.tree.traverse(stack, ray.origin, ray.dir, ray.t_min, ray.t_max, |range| {
            for patch in &self.patches[range] {
                let t_max = best.map_or(ray.t_max, |b| b.t);
                let Some((t, facing)) = patch.intersect(&test, ray.t_min, t_max) else { continue };
                if best.is_none_or(|b| t < b.t || patch.id < b.patch.0) {
                    best = Some(RayHit { t, patch: PatchId(patch.id), facing });
                    if ANY {
                        return f64::NEG_INFINITY;
                    }
                }
            }
            best.map_or(ray.t_max, |b| b.t)
        });
        best
    }

    /// Answers every ray of a query, in order, on all threads.
    fn cast_all<T: Send + Clone + Default>(
        &self,
        query: Query<'_>,
        answer: impl Fn(&mut Vec<Pending>, &Ray) -> T + Sync,
    ) -> Result<Vec<T>, CastError> {
        let answer = &answer;
        let parts: Vec<Vec<T>> = match query {
            Query::Rays(rays) => {
                for (index, ray) in rays.iter().enumerate() {
                    check_ray(index, ray)?;
                }
                rays.par_chunks(RAYS_PER_CHUNK)
                    .map(|chunk| {
                        let mut stack = Vec::with_capacity(128);
                        chunk.iter().map(|r| answer(&mut stack, r)).collect()
                    })
                    .collect()
            }
            Query::Bundles(bundles) => {
                check_bundles_in_parallel(bundles)?;
                bundles
                    .par_chunks(BUNDLES_PER_CHUNK)
                    .map(|chunk| {
                        let mut stack = Vec::with_capacity(128);
                        let mut rays = Vec::with_capacity(chunk.iter().map(RayBundle::n_rays).sum());
                        chunk.iter().for_each(|bundle| bundle.for_each_ray(|ray| rays.push(ray)));
                        // Rays of one stratum of neighbouring hemispheres run side by side, those of one bundle apart.
                        let stride = stratum_stride(chunk).unwrap_or(rays.len());
                        let mut answers = vec![T::default(); rays.len()];
                        for stratum in 0..stride {
                            for i in (stratum..rays.len()).step_by(stride) {
                                answers[i] = answer(&mut stack, &rays[i]);
                            }
                        }
                        answers
                    })
                    .collect()
            }
        };
        Ok(parts.concat())
    }
}

/// Rays of each bundle when all are hemispheres of one size.
fn stratum_stride(bundles: &[RayBundle]) -> Option<usize> {
    let n_rays = bundles.first()?.n_rays();
    let alike = |b: &RayBundle| matches!(b, RayBundle::Hemisphere { .. }) && b.n_rays() == n_rays;
    bundles.iter().all(alike).then_some(n_rays)
}

/// [`check_bundles`] on all threads: the first fault is sought only when there is one.
fn check_bundles_in_parallel(bundles: &[RayBundle]) -> Result<(), CastError> {
    if bundles.par_chunks(BUNDLES_PER_CHUNK).all(|chunk| check_bundles(chunk).is_ok()) {
        return Ok(());
    }
    check_bundles(bundles)
}

impl RayCaster for SoftwareCaster {
    fn name(&self) -> &'static str {
        "software"
    }

    fn closest_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        self.cast_all(query, |stack, ray| self.cast::<false>(stack, ray))
    }

    fn any_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        self.cast_all(query, |stack, ray| self.cast::<true>(stack, ray).is_some())
    }

    fn blocked_by(&self, _: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        let mask = |(bundle, patch): &(&RayBundle, PatchId)| {
            let Some(place) = self.places.get(patch.0 as usize).copied().flatten() else { return 0 };
            let patch = &self.patches[place as usize];
            let (mut mask, mut i) = (0_u64, 0);
            bundle.for_each_ray(|ray| {
                let hit = patch.intersect(&self.test_ray(&ray), ray.t_min, ray.t_max);
                mask |= u64::from(hit.is_some()) << i;
                i += 1;
            });
            mask
        };
        tests.par_iter().map(mask).collect()
    }

    fn surface_offset_m(&self) -> f64 {
        self.surface_offset_m
    }
}

/// How far (m) rounding can put a point of a surface to the wrong side of the triangles that stand for it.
///
/// With M the largest coordinate (m), u = 2^-53: a point computed on a patch is off by at most 8 u M; translating a
/// corner, 2 u M; the plane distance n . a, 6 u M per unit of normal; t at a lifted target, as much again at both
/// ends: under 32 u M in all, doubled to 64 u M = 2^-47 M. A normal from edges l1, l2 tilts by 4 u l1 l2 / |n|, which
/// multiplies the plane's share by the largest such ratio (1 for a rectangle's half). A quad that is not planar adds
/// the distance between its bilinear surface and its two triangles.
fn surface_offset_m(patches: &[CastPatch], bounds: &Aabb) -> f64 {
    if bounds.is_empty() {
        return 0.0;
    }
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let mut slenderness = 1.0_f64;
    for patch in patches {
        for &[i, j, k] in patch.triangles() {
            let (e1, e2) = (patch.corners[j] - patch.corners[i], patch.corners[k] - patch.corners[i]);
            let ratio = e1.length() * e2.length() / e1.cross(e2).length();
            // Beyond this a sliver is narrower than its own rounding and cannot be told from an edge.
            if ratio.is_finite() {
                slenderness = slenderness.max(ratio.min((1 << 16) as f64));
            }
        }
    }
    largest * slenderness * 2f64.powi(-47) + bend_m(patches)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::raycast::Facing;

    fn quad(corners: [DVec3; 4]) -> CastPatch {
        CastPatch { corners, is_triangle: false }
    }

    #[test]
    fn software_of_no_patches_misses_everything() {
        let mut caster = SoftwareCaster::new(Vec::new());
        let rays = [Ray::unbounded(DVec3::ZERO, DVec3::X)];
        assert_eq!(caster.closest_hits(Purpose::Primary, Query::Rays(&rays)).unwrap(), vec![None]);
    }

    #[test]
    fn software_from_a_thousand_scene_sizes_away_meets_the_quad_at_its_distance() {
        let p = |x, y| DVec3::new(x, y, 0.0);
        let mut caster =
            SoftwareCaster::new(vec![quad([p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 1.0)])]);
        let rays = [Ray::unbounded(DVec3::new(0.25, 0.75, 1000.0), DVec3::new(0.0, 0.0, -2.0))];
        let hits = caster.closest_hits(Purpose::Primary, Query::Rays(&rays)).unwrap();
        assert_eq!(hits, vec![Some(RayHit { t: 500.0, patch: PatchId(0), facing: Facing::Front })]);
    }

    #[test]
    fn software_with_one_and_four_threads_answers_the_same_bits() {
        let mut patches = Vec::new();
        for i in 0..200 {
            let x = f64::from(i) * 0.37 % 2.0;
            let p = |a: f64, b: f64| DVec3::new(x + a, 0.2 * b + x * 0.3, f64::from(i) * 0.01 + a * b);
            patches.push(quad([p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 1.0)]));
        }
        let caster = SoftwareCaster::new(patches);
        let rays: Vec<Ray> = (0..5000)
            .map(|i| {
                let f = f64::from(i);
                Ray::unbounded(
                    DVec3::new(1.0, -1.0, f * 4e-4),
                    DVec3::new((f * 0.7).sin(), 1.0, (f * 0.3).cos()),
                )
            })
            .collect();
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| caster.clone().closest_hits(Purpose::Primary, Query::Rays(&rays)).unwrap())
        };
        let one = run(1);
        assert!(one.iter().filter(|h| h.is_some()).count() > 100);
        assert_eq!(one, run(4));
    }
}
