//! What vectors expect: the oracle's answers, and the vectors of a workload.
//!
//! ```text
//! MemoryImage, rays --spread evenly, oracle--> Vectors: all patches, rays with answers, tests with wires
//! ```
//! With full edge normals the oracle looks at all patches. With rounded ones a ray may meet a patch outside the cells
//! that list it, so the answer depends on the board's walk: then the oracle looks at the patches that the board tests, and
//! the vectors carry the grid of the image, on which this depends.

use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::functional::trace_observed;
use rtl_model::memory_image::MemoryImage;
use rtl_model::oracle::{self, Oracle};

use super::{Expected, RayVector, TestVector, Vectors};
use crate::verify::{Compared, Mismatch};

/// Tests of each ray that get a row: those that hit come first.
const TESTS_PER_RAY: usize = 2;

/// The oracle's answer to a ray of the scene in `image`, which is the scene that `oracle` knows.
pub(super) fn oracle_answer(image: &MemoryImage, oracle: &Oracle, ray: &RayVector) -> Expected {
    let words = &ray.words;
    if image.formats.cross_drop() == 0 {
        return match ray.any_hit {
            true => Expected::Any(oracle.any(words)),
            false => Expected::Nearest(oracle.nearest(words)),
        };
    }
    let mut nearest = None;
    trace_observed(image, words, ray.any_hit, |patch, _| {
        let hit = oracle::intersect(&image.formats, words, patch);
        nearest = smaller(nearest, hit);
    });
    if ray.any_hit { Expected::Any(nearest.is_some()) } else { Expected::Nearest(nearest) }
}

/// The hit with the smaller (t, id).
fn smaller(a: Option<HitWords>, b: Option<HitWords>) -> Option<HitWords> {
    [a, b].into_iter().flatten().min_by_key(|hit| (hit.t, hit.patch))
}

/// Vectors of a scene: all its patches, up to `n_rays` of the rays, spread evenly, with the oracle's answers, and of
/// each the wires of up to two tests that the board makes.
pub fn sample(image: &MemoryImage, rays: &[(RayWords, bool)], n_rays: usize) -> Vectors {
    let patches: Vec<PatchWords> = (0..image.n_patches).map(|i| image.patch(i)).collect();
    let oracle = Oracle::new(&image.formats, &patches);
    let n = n_rays.min(rays.len());
    let mut vectors = Vectors {
        formats: image.formats,
        grid_log2: Some(image.grid.log2_cells),
        patches,
        rays: Vec::with_capacity(n),
        tests: Vec::new(),
    };
    for i in 0..n {
        let (words, any_hit) = rays[(i as u128 * rays.len() as u128 / n as u128) as usize];
        let mut ray = RayVector { words, any_hit, expected: None };
        ray.expected = Some(oracle_answer(image, &oracle, &ray));
        let mut tested: Vec<(u32, bool)> = Vec::new();
        trace_observed(image, &words, any_hit, |patch, hit| tested.push((patch.id, hit.is_some())));
        tested.sort_by_key(|(_, hit)| !hit);
        for (id, _) in tested.into_iter().take(TESTS_PER_RAY) {
            // Ids are places on the host's boards; a patch of another id gets no row.
            if let Some(patch) = vectors.patches.get(id as usize).filter(|patch| patch.id == id) {
                vectors.tests.push(test_vector(&image.formats, (i, &words), (id as usize, patch)));
            }
        }
        vectors.rays.push(ray);
    }
    vectors
}

/// The vectors that replay a mismatch: all patches of the scene, so that the board's cells are the same, the ray with
/// the oracle's answer, or the test with the oracle's wires.
pub fn of_mismatch(image: &MemoryImage, mismatch: &Mismatch) -> Vectors {
    let patches: Vec<PatchWords> = (0..image.n_patches).map(|i| image.patch(i)).collect();
    let words = mismatch.ray;
    let (any_hit, expected) = match mismatch.compared {
        Compared::AnyHit { oracle, .. } => (true, Some(Expected::Any(oracle))),
        Compared::NearestHit => (false, Some(Expected::Nearest(mismatch.oracle))),
        // The ray itself is in question, or one test of it.
        Compared::BundleRay { .. } | Compared::TestHit | Compared::Wire(_) => (mismatch.any_hit, None),
    };
    let is_test = matches!(mismatch.compared, Compared::TestHit | Compared::Wire(_));
    let tested = mismatch.patches.first().filter(|_| is_test);
    let place = tested.and_then(|patch| patches.iter().position(|p| p == patch));
    let test = place.map(|place| test_vector(&image.formats, (0, &words), (place, &patches[place])));
    Vectors {
        formats: image.formats,
        grid_log2: Some(image.grid.log2_cells),
        patches,
        rays: vec![RayVector { words, any_hit, expected }],
        tests: test.into_iter().collect(),
    }
}

/// The test of a ray with a patch, with the oracle's answer and wires; both by their places in a file.
fn test_vector(
    formats: &Formats,
    (ray, words): (usize, &RayWords),
    (patch, patch_words): (usize, &PatchWords),
) -> TestVector {
    TestVector {
        ray,
        patch,
        hit: oracle::intersect(formats, words, patch_words),
        wires: oracle::wires(formats, words, patch_words),
    }
}
