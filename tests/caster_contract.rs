//! The contract of `trait RayCaster`, run over every backend by one suite.
//!
//! ```text
//! make_caster(patches, points) x law --> each bullet of the trait's documentation, closest and any hit,
//!                                        explicit rays and the four kinds of bundles
//! ```

use glam::DVec3;
use radiosity_engine::geom::Ray;
use radiosity_engine::mesh::PatchId;
use radiosity_engine::raycast::board::BoardCaster;
use radiosity_engine::raycast::functional::FunctionalCaster;
use radiosity_engine::raycast::null::NullCaster;
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::raycast::{CastError, CastPatch, Facing, Purpose, Query, RayBundle, RayCaster, RayHit};
use rtl_model::fixed::Formats;
use rtl_model::spec::BoardSpec;

/// A backend under test.
struct Backend {
    make: fn(&[CastPatch], &[DVec3]) -> Box<dyn RayCaster>,
    /// Rays that go into the closed room.
    n_room_rays: usize,
    /// Largest error of t where software's is exact, relative to the scene.
    t_error: f64,
    /// t_min other than 0 is taken.
    takes_t_min: bool,
}

fn software() -> Backend {
    Backend {
        make: |patches, _| Box::new(SoftwareCaster::new(patches.to_vec())),
        n_room_rays: 1_000_000,
        t_error: 1e-12,
        takes_t_min: true,
    }
}

fn functional() -> Backend {
    Backend {
        make: |patches, points| {
            Box::new(FunctionalCaster::new(&Formats::default(), None, patches, points).unwrap())
        },
        n_room_rays: 50_000,
        t_error: 2e-6,
        takes_t_min: false,
    }
}

/// Eight-bit words: every rounding is coarse.
fn functional_8_bits() -> Backend {
    Backend {
        make: |patches, points| {
            let formats =
                Formats { coord_frac_bits: 8, dir_frac_bits: 8, t_frac_bits: 8, ..Formats::default() };
            Box::new(FunctionalCaster::new(&formats, None, patches, points).unwrap())
        },
        n_room_rays: 50_000,
        t_error: 0.1,
        takes_t_min: false,
    }
}

fn board() -> Backend {
    Backend {
        make: |patches, points| {
            let spec = BoardSpec::preset("delft-1992").unwrap();
            Box::new(BoardCaster::new(&spec, patches, points).unwrap())
        },
        n_room_rays: 4_000,
        t_error: 2e-6,
        takes_t_min: false,
    }
}

fn quad(corner: DVec3, u: DVec3, v: DVec3) -> CastPatch {
    CastPatch { corners: [corner, corner + u, corner + u + v, corner + v], is_triangle: false }
}

/// A small generator with a printed seed (SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [-1, 1).
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// A closed bumpy sphere of quads and triangles about the origin, radius near 1, vertices shared bit by bit.
fn closed_room(n: usize) -> Vec<CastPatch> {
    let vertex = |i: usize, j: usize| {
        let (theta, phi) = (
            std::f64::consts::PI * i as f64 / n as f64,
            std::f64::consts::TAU * (j % (2 * n)) as f64 / (2 * n) as f64,
        );
        let bump = 1.0 + 0.1 * (5.0 * theta).sin() * (3.0 * phi).cos();
        if i == 0 || i == n {
            DVec3::new(0.0, 0.0, theta.cos())
        } else {
            bump * DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
        }
    };
    let mut patches = Vec::new();
    for i in 0..n {
        for j in 0..2 * n {
            // Fronts look inward.
            let c = [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)];
            let patch = match i {
                0 => CastPatch { corners: [c[0], c[2], c[3], c[3]], is_triangle: true },
                i if i == n - 1 => CastPatch { corners: [c[0], c[1], c[2], c[2]], is_triangle: true },
                _ => CastPatch { corners: c, is_triangle: false },
            };
            patches.push(patch);
        }
    }
    patches
}

fn corners(patch: &CastPatch) -> &[DVec3] {
    &patch.corners[..if patch.is_triangle { 3 } else { 4 }]
}

/// Rays from inside the room: a quarter each at vertices, along edges, at diagonals, anywhere.
fn room_rays(patches: &[CastPatch], n: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    (0..n)
        .map(|k| {
            let origin = 0.5 * random.vector();
            let patch = &patches[random.next() as usize % patches.len()];
            let c = corners(patch);
            let i = random.next() as usize % c.len();
            let weight = 0.5 + 0.5 * random.signed();
            let dir = match k % 4 {
                0 => c[i] - origin,
                1 => c[i].lerp(c[(i + 1) % c.len()], weight) - origin,
                2 => c[0].lerp(c[2], weight) - origin,
                _ => random.vector(),
            };
            Ray::unbounded(origin, dir)
        })
        .collect()
}

/// Patches that partly hide each other, far from regular.
fn clutter(n: usize, seed: u64) -> Vec<CastPatch> {
    let mut random = Random(seed);
    (0..n)
        .map(|k| {
            let (corner, u, v) = (random.vector(), 0.4 * random.vector(), 0.4 * random.vector());
            let is_triangle = k % 3 == 0;
            CastPatch { is_triangle, ..quad(corner, u, v) }
        })
        .collect()
}

/// Bundles of all four kinds from a few apexes.
fn bundles(seed: u64, n: usize) -> Vec<RayBundle> {
    let mut random = Random(seed);
    (0..n)
        .map(|k| {
            let apex = 0.9 * random.vector();
            match k % 4 {
                0 => RayBundle::Tile {
                    apex,
                    corner: random.vector(),
                    step_u: 0.03 * random.vector(),
                    step_v: 0.03 * random.vector(),
                    n: 8,
                    m: 5,
                },
                1 => RayBundle::Fan {
                    apex,
                    corner: 0.5 * random.vector(),
                    edge_u: 0.3 * random.vector(),
                    edge_v: 0.3 * random.vector(),
                    n: 4,
                    m: 4,
                    jitter: [0.25, 0.75],
                },
                2 => {
                    let normal = random.vector().normalize();
                    RayBundle::Hemisphere { apex, normal, spin: 0.7, n: 8, m: 8, jitter: [0.3, 0.9] }
                }
                _ => RayBundle::Targets { apex, points: (0..9).map(|_| random.vector()).collect() },
            }
        })
        .collect()
}

fn cube() -> [DVec3; 2] {
    [DVec3::splat(-1.0), DVec3::ONE]
}

impl Backend {
    fn caster(&self, patches: &[CastPatch]) -> Box<dyn RayCaster> {
        (self.make)(patches, &cube())
    }

    fn closest(&self, patches: &[CastPatch], rays: &[Ray]) -> Vec<Option<RayHit>> {
        self.caster(patches).closest_hits(Purpose::Primary, Query::Rays(rays)).unwrap()
    }

    fn no_ray_leaves_a_closed_room(&self) {
        let patches = closed_room(24);
        let rays = room_rays(&patches, self.n_room_rays, 11);
        let hits = self.closest(&patches, &rays);
        assert_eq!(hits.len(), self.n_room_rays);
        let lost: Vec<_> = (0..rays.len()).filter(|&i| hits[i].is_none()).take(3).map(|i| rays[i]).collect();
        assert!(lost.is_empty(), "lost: {lost:?}");
        let fronts = hits.iter().flatten().filter(|h| h.facing == Facing::Front).count();
        // Aimed at creases from inside, the far side of a crease may be met first; most see fronts.
        assert!(fronts * 10 > hits.len() * 9, "{fronts} of {} fronts", hits.len());
    }

    fn zero_components_of_either_sign_aim_the_same_way(&self) {
        let patches = closed_room(4);
        let ray = |zero: f64, axis: usize, sign: f64| {
            let mut dir = [zero; 3];
            dir[axis] = sign;
            Ray::unbounded(DVec3::new(0.11, -0.07, 0.13), DVec3::from_array(dir))
        };
        let aims = (0..3).flat_map(|axis| [-1.0, 1.0].map(|sign| (axis, sign)));
        let [plus, minus] =
            [0.0, -0.0].map(|zero| aims.clone().map(|(a, s)| ray(zero, a, s)).collect::<Vec<_>>());
        let hits = self.closest(&patches, &plus);
        assert!(hits.iter().all(Option::is_some) && hits.len() == 6, "{hits:?}");
        assert_eq!(self.closest(&patches, &minus), hits);
    }

    fn any_hits_tell_what_closest_hits_find(&self) {
        let patches = clutter(60, 3);
        let mut rays = room_rays(&patches, 2000, 5);
        for (k, ray) in rays.iter_mut().enumerate() {
            if k % 2 == 0 {
                ray.t_max = 0.3 + 0.001 * (k % 700) as f64;
            }
        }
        let bundles = bundles(9, 40);
        let mut caster = self.caster(&patches);
        for query in [Query::Rays(&rays), Query::Bundles(&bundles)] {
            let closest = caster.closest_hits(Purpose::Primary, query).unwrap();
            let any = caster.any_hits(Purpose::Shadow, query).unwrap();
            assert_eq!(closest.len(), query.n_rays());
            assert_eq!(any, closest.iter().map(Option::is_some).collect::<Vec<_>>());
            let hits = closest.iter().flatten().count();
            assert!(hits > 50 && hits < closest.len(), "{hits} of {}", closest.len());
        }
    }

    fn rays_that_a_patch_is_known_to_block_are_blocked(&self) {
        let patches = clutter(60, 3);
        let bundles = bundles(9, 40);
        let mut caster = self.caster(&patches);
        let closest = caster.closest_hits(Purpose::Shadow, Query::Bundles(&bundles)).unwrap();
        let (mut first, mut n_known, mut n_hit) = (0, 0, 0);
        for bundle in &bundles {
            let hits = &closest[first..first + bundle.n_rays()];
            first += hits.len();
            n_hit += hits.iter().flatten().count();
            let tests: Vec<_> = (0..60).map(|p| (bundle, PatchId(p))).collect();
            let masks = caster.blocked_by(Purpose::Shadow, &tests);
            assert_eq!(masks.len(), 60);
            for (i, hit) in hits.iter().enumerate() {
                let by: Vec<u32> = (0..60).filter(|p| masks[*p as usize] >> i & 1 == 1).collect();
                assert!(hit.is_some() || by.is_empty(), "ray {i} is free, and blocked by {by:?}");
                // All of these backends know all that there is to know of one patch.
                assert!(hit.is_none_or(|hit| by.contains(&hit.patch.0)), "{hit:?} is not among {by:?}");
                n_known += by.len();
            }
            assert!(masks.iter().all(|m| bundle.n_rays() == 64 || m >> bundle.n_rays() == 0));
        }
        assert!(n_known > n_hit && n_hit > 50, "{n_known} {n_hit}");
    }

    fn answers_follow_their_rays_when_shuffled(&self) {
        let patches = clutter(60, 3);
        let rays = room_rays(&patches, 1500, 6);
        let mut caster = self.caster(&patches);
        let straight = caster.closest_hits(Purpose::Primary, Query::Rays(&rays)).unwrap();
        // 1500 and 7 have no common factor: a permutation.
        let order: Vec<usize> = (0..rays.len()).map(|i| i * 7 % rays.len()).collect();
        let shuffled: Vec<Ray> = order.iter().map(|&i| rays[i]).collect();
        let answers = caster.closest_hits(Purpose::Primary, Query::Rays(&shuffled)).unwrap();
        assert_eq!(answers, order.iter().map(|&i| straight[i]).collect::<Vec<_>>());
        let again = caster.closest_hits(Purpose::Primary, Query::Rays(&rays)).unwrap();
        assert_eq!(again, straight, "no state of earlier queries shows");
    }

    fn bundles_answer_as_their_rays_one_by_one(&self) {
        let patches = closed_room(12);
        let bundles: Vec<RayBundle> = bundles(21, 60)
            .into_iter()
            .map(|b| match b {
                RayBundle::Tile { corner, step_u, step_v, n, m, .. } => {
                    RayBundle::Tile { apex: DVec3::splat(0.1), corner, step_u, step_v, n, m }
                }
                RayBundle::Hemisphere { normal, spin, n, m, jitter, .. } => {
                    RayBundle::Hemisphere { apex: DVec3::splat(0.1), normal, spin, n, m, jitter }
                }
                other => other,
            })
            .collect();
        let rays: Vec<Ray> = bundles.iter().flat_map(|b| (0..b.n_rays()).map(|i| b.ray(i))).collect();
        let mut caster = self.caster(&patches);
        let as_bundles = caster.closest_hits(Purpose::Primary, Query::Bundles(&bundles)).unwrap();
        let as_rays = caster.closest_hits(Purpose::Primary, Query::Rays(&rays)).unwrap();
        assert_eq!(as_bundles.len(), as_rays.len());
        let mut differ = 0;
        for ((b, r), ray) in as_bundles.iter().zip(&as_rays).zip(&rays) {
            match (b, r) {
                // In metres; a hemisphere's directions come from a table of 64 x 64 entries.
                (Some(b), Some(r)) => {
                    let distance = (b.t - r.t).abs() * ray.dir.length();
                    differ += usize::from(distance > 0.02 + self.t_error);
                }
                (None, None) => {}
                _ => differ += 1,
            }
        }
        // Rays near the ends of segments and near grazing may fall to either side of rounding.
        assert!(differ * 50 <= rays.len(), "{differ} of {}", rays.len());
    }

    fn equal_t_goes_to_the_smaller_patch_id(&self) {
        let patch = quad(DVec3::new(-0.5, -0.5, 0.25), DVec3::X, DVec3::Y);
        let other = quad(DVec3::new(-0.5, -0.5, 0.75), DVec3::X, DVec3::Y);
        let patches = [other, patch, patch, patch];
        let rays = [Ray::unbounded(DVec3::new(0.25, -0.125, -0.5), DVec3::Z)];
        let hit = self.closest(&patches, &rays)[0].unwrap();
        assert_eq!(hit.patch, PatchId(1));
        assert!((hit.t - 0.75).abs() <= self.t_error);
    }

    fn both_sides_block_and_are_told_apart(&self) {
        let patches = [quad(DVec3::new(-0.5, -0.5, 0.0), DVec3::X, DVec3::Y)];
        let from = |z: f64| Ray::unbounded(DVec3::new(0.125, -0.25, z), DVec3::new(0.0, 0.0, -2.0 * z));
        let hits = self.closest(&patches, &[from(0.5), from(-0.5)]);
        let facing: Vec<_> = hits.iter().map(|h| h.unwrap().facing).collect();
        assert_eq!(facing, [Facing::Front, Facing::Back]);
        assert!(hits.iter().all(|h| (h.unwrap().t - 0.5).abs() <= self.t_error), "t counts lengths of dir");
    }

    fn range_of_t_is_closed_at_both_ends(&self) {
        // Powers of two all the way: every backend's numbers are exact.
        let patches = [quad(DVec3::new(-0.5, -0.5, 0.0), DVec3::X, DVec3::Y)];
        let origin = DVec3::new(0.125, -0.25, 0.5);
        let with = |t_min, t_max| Ray { t_min, t_max, ..Ray::unbounded(origin, DVec3::NEG_Z) };
        let step = 4.0 * self.t_error.max(1e-9);
        let hits = self.closest(&patches, &[with(0.0, 0.5), with(0.0, 0.5 - step), with(0.0, 0.5 + step)]);
        assert_eq!(hits.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, true]);
        assert_eq!(hits[0].unwrap().t, 0.5);
        let at_zero = Ray::unbounded(DVec3::new(0.125, -0.25, 0.0), DVec3::NEG_Z);
        assert_eq!(self.closest(&patches, &[at_zero])[0].unwrap().t, 0.0);
        if self.takes_t_min {
            let hits = self.closest(&patches, &[with(0.5, 1.0), with(0.5 + step, 1.0)]);
            assert_eq!(hits.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false]);
        } else {
            let error = self
                .caster(&patches)
                .closest_hits(Purpose::Primary, Query::Rays(&[with(0.0, 1.0), with(0.25, 1.0)]));
            assert!(matches!(error, Err(CastError::BadRay { index: 1, .. })), "{error:?}");
        }
    }

    fn surfaces_do_not_answer_rays_lifted_off_them_by_the_offset(&self) {
        let patches = clutter(60, 8);
        let mut caster = self.caster(&patches);
        let offset = caster.surface_offset_m();
        let mut random = Random(77);
        let mut rays = Vec::new();
        for k in 0..2000 {
            let patch = &patches[k % patches.len()];
            let [v0, v1, v2, _] = patch.corners;
            let normal = (v1 - v0).cross(v2 - v0).normalize();
            let (a, b) = (0.5 * (1.0 + random.signed()), 0.5 * (1.0 + random.signed()));
            let point = v0 + a * (v1 - v0) + b * (1.0 - a) * (v2 - v1).lerp(v2 - v0, 1.0 - a);
            let d = random.vector();
            let d = if d.dot(normal) < 0.0 { -d } else { d };
            rays.push(Ray::unbounded(point + offset * normal, d));
        }
        let hits = caster.closest_hits(Purpose::Shadow, Query::Rays(&rays)).unwrap();
        let own = hits.iter().enumerate().filter(|(k, h)| h.is_some_and(|h| h.patch.0 as usize == k % 60));
        assert_eq!(own.count(), 0);
        assert!(hits.iter().flatten().count() > 100, "others are met");
    }

    fn empty_queries_have_no_answers(&self) {
        let mut caster = self.caster(&clutter(3, 1));
        for query in [Query::Rays(&[]), Query::Bundles(&[])] {
            assert!(caster.closest_hits(Purpose::Primary, query).unwrap().is_empty());
            assert!(caster.any_hits(Purpose::Primary, query).unwrap().is_empty());
        }
    }

    fn unusable_rays_and_bundles_are_refused_with_their_index(&self) {
        let mut caster = self.caster(&clutter(3, 1));
        let good = Ray::unbounded(DVec3::ZERO, DVec3::X);
        let bad = [
            Ray { dir: DVec3::ZERO, ..good },
            Ray { dir: DVec3::new(f64::NAN, 0.0, 1.0), ..good },
            Ray { dir: DVec3::new(f64::INFINITY, 0.0, 1.0), ..good },
            Ray { origin: DVec3::NAN, ..good },
            Ray { t_max: f64::NAN, ..good },
        ];
        for ray in bad {
            let rays = [good, good, ray];
            let error = caster.closest_hits(Purpose::Primary, Query::Rays(&rays));
            assert!(matches!(error, Err(CastError::BadRay { index: 2, .. })), "{ray:?}: {error:?}");
            let error = caster.any_hits(Purpose::Primary, Query::Rays(&rays));
            assert!(matches!(error, Err(CastError::BadRay { index: 2, .. })), "{ray:?}: {error:?}");
        }
        let targets = |n: usize| RayBundle::Targets { apex: DVec3::ZERO, points: vec![DVec3::X; n] };
        let apex = RayBundle::Targets { apex: DVec3::X, points: vec![DVec3::Y, DVec3::X] };
        let huge = RayBundle::Hemisphere {
            apex: DVec3::ZERO,
            normal: DVec3::Z,
            spin: 0.0,
            n: 1 << 16,
            m: 1 << 16,
            jitter: [0.5; 2],
        };
        for (bundle, index) in [(targets(65), 64), (targets(0), 64), (apex, 65), (huge, 64)] {
            let error = caster.closest_hits(Purpose::Primary, Query::Bundles(&[targets(64), bundle]));
            match error {
                Err(CastError::BadRay { index: i, .. }) => assert_eq!(i, index),
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(
            caster.closest_hits(Purpose::Primary, Query::Rays(&[good])).unwrap().len(),
            1,
            "usable after a refusal"
        );
    }

    fn one_and_many_threads_answer_the_same_bits(&self) {
        let patches = clutter(60, 3);
        let rays = room_rays(&patches, 3000, 4);
        let run = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| self.closest(&patches, &rays))
        };
        assert_eq!(run(1), run(3));
    }
}

macro_rules! contract {
    ($($backend:ident)*) => { $(
        mod $backend {
            #[test]
            fn room_that_is_closed_loses_no_ray() { super::$backend().no_ray_leaves_a_closed_room(); }
            #[test]
            fn zero_components_of_either_sign_aim_the_same_way() {
                super::$backend().zero_components_of_either_sign_aim_the_same_way();
            }
            #[test]
            fn any_hits_of_any_query_tell_what_closest_hits_find() {
                super::$backend().any_hits_tell_what_closest_hits_find();
            }
            #[test]
            fn answers_of_shuffled_rays_follow_them() {
                super::$backend().answers_follow_their_rays_when_shuffled();
            }
            #[test]
            fn bundle_answers_as_its_rays_one_by_one() {
                super::$backend().bundles_answer_as_their_rays_one_by_one();
            }

            #[test]
            fn rays_that_a_patch_is_known_to_block_are_blocked() {
                super::$backend().rays_that_a_patch_is_known_to_block_are_blocked();
            }
            #[test]
            fn coincident_patches_answer_with_the_smaller_id() {
                super::$backend().equal_t_goes_to_the_smaller_patch_id();
            }
            #[test]
            fn both_sides_of_a_patch_block() { super::$backend().both_sides_block_and_are_told_apart(); }
            #[test]
            fn hits_at_the_ends_of_the_range_count() { super::$backend().range_of_t_is_closed_at_both_ends(); }
            #[test]
            fn rays_lifted_by_the_offset_never_meet_their_surface() {
                super::$backend().surfaces_do_not_answer_rays_lifted_off_them_by_the_offset();
            }
            #[test]
            fn empty_query_has_no_answers() { super::$backend().empty_queries_have_no_answers(); }
            #[test]
            fn unusable_ray_is_refused_with_its_index() {
                super::$backend().unusable_rays_and_bundles_are_refused_with_their_index();
            }
            #[test]
            fn threads_change_no_bit() { super::$backend().one_and_many_threads_answer_the_same_bits(); }
        }
    )* };
}

contract! { software functional functional_8_bits board }

#[test]
fn null_answers_every_ray_with_a_miss() {
    let rays = room_rays(&clutter(3, 1), 10, 1);
    let bundles = bundles(1, 8);
    for query in [Query::Rays(&rays), Query::Bundles(&bundles)] {
        assert_eq!(NullCaster.closest_hits(Purpose::Primary, query).unwrap(), vec![None; query.n_rays()]);
        assert_eq!(NullCaster.any_hits(Purpose::Primary, query).unwrap(), vec![false; query.n_rays()]);
    }
}

#[test]
fn functional_and_software_agree_on_hits_away_from_edges() {
    let patches = clutter(60, 3);
    let mut random = Random(99);
    let rays: Vec<Ray> = (0..5000).map(|_| Ray::unbounded(0.9 * random.vector(), random.vector())).collect();
    let (a, b) = (software().closest(&patches, &rays), functional().closest(&patches, &rays));
    let differ = a.iter().zip(&b).filter(|(a, b)| a.map(|h| h.patch) != b.map(|h| h.patch)).count();
    assert!(differ < 5, "{differ} of {}", rays.len());
    let worst = a.iter().zip(&b).filter_map(|(a, b)| {
        let (a, b) = ((*a)?, (*b)?);
        (a.patch == b.patch).then_some((a.t - b.t).abs())
    });
    // Grazing hits move by the words' steps over the cosine.
    assert!(worst.filter(|e| *e > 1e-4).count() < 20);
}
