//! Tests of the search: against brute force over all patches, where pruning may slip, and trees of odd shape.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::*;
use crate::datapath::test_support;
use crate::fixed::Rounding;

const MODES: [Rounding; 3] = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor];

/// Rays that a property compares at least.
const N_RAYS: usize = 100_000;

/// Rays of a case.
const RAYS_A_CASE: usize = 64;

/// Does the closed box of the patch hold a point of the ray at 0 <= s, s S < t_max + 1? At one of s = 0 and the
/// entries of the slabs, if anywhere: each is tried on all axes.
fn box_is_met(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> bool {
    let corners = &patch.corners[..if patch.is_triangle { 3 } else { 4 }];
    let end = |k: usize, high: bool| {
        let words = corners.iter().map(|corner| i128::from(corner[k]));
        if high { words.max() } else { words.min() }.unwrap()
    };
    let (o, d) = (ray.origin.map(i128::from), ray.dir.map(i128::from));
    let entries =
        (0..3).filter(|k| d[*k] != 0).map(|k| ((end(k, d[k] < 0) - o[k]) * d[k].signum(), d[k].abs()));
    let range = (i128::from(ray.t_max) + 1) << formats.coord_frac_bits;
    entries.chain([(0, 1)]).any(|(num, den)| {
        let inside = |k: usize| {
            let at = o[k] * den + d[k] * num;
            end(k, false) * den <= at && at <= end(k, true) * den
        };
        let t_bits = formats.t_frac_bits + formats.dir_frac_bits;
        num >= 0 && num << t_bits < range * den && (0..3).all(inside)
    })
}

/// Everything that the search answers, against all patches one after another.
fn check(oracle: &Oracle, ray: &RayWords) -> Result<bool, TestCaseError> {
    let formats = *oracle.formats();
    let full = formats.cross_drop() == 0;
    let listed = |patch: &&PatchWords| full || box_is_met(&formats, ray, patch);
    let hits = oracle.patches().iter().filter(listed).filter_map(|patch| intersect(&formats, ray, patch));
    let expected = hits.min_by_key(|hit| (hit.t, hit.patch));
    prop_assert_eq!(oracle.nearest(ray), expected, "{:?} {:?}", formats, ray);
    prop_assert_eq!(oracle.any(ray), expected.is_some());
    let mut visited = Vec::new();
    oracle.candidates(ray, |patch| visited.push(patch.id));
    visited.sort_unstable();
    prop_assert!(visited.windows(2).all(|pair| pair[0] < pair[1]), "visited twice: {:?}", visited);
    for patch in oracle.patches() {
        let met = box_is_met(&formats, ray, patch);
        let seen = visited.binary_search(&patch.id).is_ok();
        prop_assert!(seen || !met, "{:?} missed by {:?}", patch, ray);
        prop_assert!(full || met || !seen, "{:?} not met by {:?}", patch, ray);
    }
    let listed: Vec<PatchWords> = oracle.patches().iter().filter(listed).copied().collect();
    prop_assert_eq!(oracle.nearest_of(ray, listed.iter().rev()), expected);
    Ok(expected.is_some())
}

/// Runs scenes until there were enough rays; at least one in so many must hit.
fn run(
    scenes: impl Strategy<Value = (Formats, Vec<PatchWords>, Vec<RayWords>)>,
    n_rays: usize,
    one_in: usize,
) {
    let (rays, hits) = (Cell::new(0), Cell::new(0));
    let cases = u32::try_from(n_rays / RAYS_A_CASE + 1).unwrap();
    let mut runner = TestRunner::new(ProptestConfig { cases, ..ProptestConfig::with_source_file(file!()) });
    let outcome = runner.run(&scenes, |(formats, patches, some)| {
        let oracle = Oracle::new(&formats, &patches);
        for ray in &some {
            let hit = check(&oracle, ray)?;
            rays.set(rays.get() + 1);
            hits.set(hits.get() + usize::from(hit));
        }
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
    assert!(rays.get() >= n_rays && hits.get() * one_in > n_rays, "{} rays, {} hits", rays.get(), hits.get());
}

/// Ids that are not the places: descending, ascending or mixed.
fn with_ids(mut patches: Vec<PatchWords>, order: u32) -> Vec<PatchWords> {
    let n = u32::try_from(patches.len()).unwrap();
    for (patch, place) in patches.iter_mut().zip(0..) {
        patch.id = match order {
            0 => (1 << 28) - 1 - place,
            1 => 5 + 3 * place,
            // 2^16 + 1 is prime: distinct for fewer places.
            _ => (place + 1) * 40_503 % 65_537 + n,
        };
    }
    patches
}

fn any_formats() -> impl Strategy<Value = Formats> {
    (test_support::widths(), 0_usize..3, prop_oneof![3 => Just(None), 1 => (0.0_f64..1.0).prop_map(Some)])
        .prop_map(|((f, d, t), mode, share)| Formats {
            rounding: MODES[mode],
            cross_keep_bits: share.map(|share| 4 + (share * f64::from(2 * f - 4)) as u32),
            ..test_support::formats(f, d, t)
        })
}

/// Turns a ray toward the middle of two corners of a patch.
fn aim(formats: &Formats, ray: RayWords, patch: &PatchWords, corner: usize) -> RayWords {
    let (p, q) = (patch.corners[corner % 4], patch.corners[corner / 4]);
    let toward = [0, 1, 2].map(|k| i64::from(p[k]) + i64::from(q[k]) - 2 * i64::from(ray.origin[k]));
    let most = toward.iter().map(|w| w.abs()).max().unwrap();
    let one = (1_i64 << formats.dir_frac_bits) - 1;
    if most == 0 { ray } else { RayWords { dir: toward.map(|w| (w * one / most) as i32), ..ray } }
}

/// Random patches, patches flat in cell planes, points and lines, and copies of all under other ids; rays anywhere, and
/// toward the corners, edges and middles of patches.
fn scene() -> impl Strategy<Value = (Formats, Vec<PatchWords>, Vec<RayWords>)> {
    let flatten = |(mut patch, kind, axis): (PatchWords, u32, usize)| {
        let first = patch.corners[0];
        for corner in &mut patch.corners {
            match kind {
                0 | 1 => corner[axis] = first[axis],
                2 => *corner = [first[0], first[1], corner[2]],
                3 => *corner = first,
                _ => {}
            }
        }
        patch
    };
    any_formats().prop_flat_map(move |formats| {
        let (f, d, t) = (formats.coord_frac_bits, formats.dir_frac_bits, formats.t_frac_bits);
        let patch = (test_support::patch(f), 0_u32..10, 0_usize..3).prop_map(flatten);
        let rays = prop::collection::vec((test_support::ray(f, d, t), 0_usize..40, 0_usize..16), RAYS_A_CASE);
        (Just(formats), prop::collection::vec(patch, 0..20), 0_usize..6, 0_u32..3, rays).prop_map(
            |(formats, mut patches, copies, order, rays)| {
                let rays = rays.into_iter().map(|(ray, target, corner)| match patches.get(target) {
                    Some(patch) => aim(&formats, ray, patch, corner),
                    None => ray,
                });
                let rays = rays.collect();
                patches.extend_from_within(..copies.min(patches.len()));
                (formats, with_ids(patches, order), rays)
            },
        )
    })
}

#[test]
fn search_random_and_adversarial_scenes_equals_brute_force() {
    run(scene(), N_RAYS, 16);
}

/// A coarse lattice: origins on boxes, rays in their faces and edges, through corners, equal distances.
fn lattice() -> impl Strategy<Value = (Formats, Vec<PatchWords>, Vec<RayWords>)> {
    let word = || prop_oneof![Just(-256), Just(-128), Just(0), Just(128), Just(255)];
    let point = move || [word(), word(), word()];
    let speed = || prop_oneof![3 => Just(0), 1 => Just(128), 1 => Just(-128), 1 => Just(255), 1 => Just(-64)];
    let dir = [speed(), speed(), speed()].prop_filter("a direction", |dir| *dir != [0; 3]);
    let ray = (point(), dir, prop_oneof![Just(1024_u64), Just(256), 0_u64..600])
        .prop_map(|(origin, dir, t_max)| RayWords { origin, dir, t_max });
    let patch = ([point(), point(), point(), point()], any::<bool>())
        .prop_map(|(corners, is_triangle)| PatchWords { corners, is_triangle, id: 0 });
    let rays = prop::collection::vec(ray, RAYS_A_CASE);
    (prop::collection::vec(patch, 0..12), 0_u32..3, rays, 0_usize..3, 0_u32..3).prop_map(
        |(patches, order, rays, mode, kept)| {
            let cross_keep_bits = [None, Some(16), Some(9)][kept as usize];
            let formats =
                Formats { rounding: MODES[mode], cross_keep_bits, ..test_support::formats(8, 8, 8) };
            (formats, with_ids(patches, order), rays)
        },
    )
}

#[test]
fn search_rays_in_faces_edges_and_corners_of_boxes_equals_brute_force() {
    run(lattice(), N_RAYS, 16);
}

/// Walls around the places where t = distance 2^-19 rounds to another word, 2^19 coordinate steps to a t step: many
/// walls share a t, and the smallest id among them wins, be it behind the others.
fn walls() -> impl Strategy<Value = (Formats, Vec<PatchWords>, Vec<RayWords>)> {
    let at = (0_i32..6, prop_oneof![-2_i32..=2, -(1 << 18)..1 << 18])
        .prop_map(|(half, off)| half * (1 << 18) + off);
    let one = 1_i32 << 28;
    let wall = (at, prop_oneof![3 => Just(0), 1 => -3_i32..=3]).prop_map(move |(x, tilt)| {
        let corners = [[x, -one, -one], [x + tilt, one - 1, -one], [x, one - 1, one - 1], [x, -one, one - 1]];
        PatchWords { corners, is_triangle: false, id: 0 }
    });
    let ray = (-2_i32..=2, -1_i32..=1, 0_u64..6).prop_map(|(x, y, t_max)| RayWords {
        origin: [x, 7, 9],
        dir: [128, y, 0],
        t_max,
    });
    let scene = (prop::collection::vec(wall, 1..24), prop::collection::vec(ray, RAYS_A_CASE));
    (scene, 0_u32..3, 0_usize..3).prop_map(|((walls, rays), order, mode)| {
        let formats = Formats { rounding: MODES[mode], ..test_support::formats(28, 8, 8) };
        (formats, with_ids(walls, order), rays)
    })
}

#[test]
fn search_walls_that_round_to_one_t_finds_the_smallest_id() {
    run(walls(), N_RAYS, 2);
}

/// Triangles met at one point only, a corner of their box, by rays through exactly this point: entry and exit of the box
/// are the same fraction in other words on each axis, which rounding alone would put in a wrong order.
fn corners_of_boxes() -> impl Strategy<Value = (Formats, Vec<PatchWords>, Vec<RayWords>)> {
    let away = || [1_i32..1000, 1_i32..1000, 1_i32..1000];
    let patch =
        ([-99_i32..=99, -99..=99, -99..=99], away(), away(), [any::<bool>(), any::<bool>(), any::<bool>()])
            .prop_map(|(tip, u, v, mirrored)| {
                let sign = mirrored.map(|negative| if negative { -1 } else { 1 });
                let at = |off: [i32; 3]| [0, 1, 2].map(|k| 1000 * tip[k] + sign[k] * off[k]);
                PatchWords { corners: [at([0; 3]), at(u), at(v), at(v)], is_triangle: true, id: 0 }
            });
    let word = || -500_i32..=500;
    let aim = (0_usize..8, [word(), word(), word()], 1_i32..=60);
    let aims = prop::collection::vec(aim, RAYS_A_CASE);
    (prop::collection::vec(patch, 1..8), aims, 0_usize..3, 0_u32..3).prop_map(
        |(patches, aims, mode, order)| {
            // D = 10: the words below are directions of length 1/2 and more only if one of them is at least 512.
            let formats = Formats { rounding: MODES[mode], ..test_support::formats(20, 10, 20) };
            let ray = |(target, mut dir, times): (usize, [i32; 3], i32)| {
                dir[target % 3] = 1023 - dir[target % 3].abs();
                let tip = patches[target % patches.len()].corners[0];
                let origin = [0, 1, 2].map(|k| tip[k] - times * dir[k]);
                RayWords { origin, dir, t_max: formats.t_limit() }
            };
            let rays = aims.into_iter().map(ray).collect();
            (formats, with_ids(patches, order), rays)
        },
    )
}

#[test]
fn search_rays_through_one_corner_of_a_box_equals_brute_force() {
    run(corners_of_boxes(), N_RAYS, 2);
}

#[test]
#[ignore = "long: 10^7 rays of each kind of scene"]
fn search_ten_million_rays_equal_brute_force() {
    run(scene(), 10_000_000, 16);
    run(lattice(), 10_000_000, 16);
    run(walls(), 10_000_000, 2);
}

/// A square across the cube's middle part, normal to x.
fn wall(x: i32, id: u32) -> PatchWords {
    let corners = [[x, -100, -100], [x, 100, -100], [x, 100, 100], [x, -100, 100]];
    PatchWords { corners, is_triangle: false, id }
}

#[test]
fn nearest_no_one_and_two_patches() {
    let formats = test_support::formats(8, 8, 8);
    let ray = RayWords { origin: [0; 3], dir: [128, 0, 0], t_max: 1024 };
    let answer = |patches: &[PatchWords], ray: &RayWords| {
        let oracle = Oracle::new(&formats, patches);
        (oracle.nearest(ray).map(|hit| (hit.t, hit.patch)), oracle.any(ray))
    };
    assert_eq!(answer(&[], &ray), (None, false));
    // t = 60/128 of 256.
    assert_eq!(answer(&[wall(60, 9)], &ray), (Some((120, 9)), true));
    assert_eq!(answer(&[wall(-1, 9)], &ray), (None, false));
    assert_eq!(answer(&[wall(60, 9), wall(50, 10)], &ray), (Some((100, 10)), true));
    assert_eq!(answer(&[wall(50, 9), wall(60, 1)], &ray), (Some((100, 9)), true));
    assert_eq!(answer(&[wall(60, 9), wall(60, 4)], &ray), (Some((120, 4)), true));
    let short = |t_max| RayWords { t_max, ..ray };
    assert_eq!(answer(&[wall(60, 9), wall(50, 10)], &short(100)), (Some((100, 10)), true));
    assert_eq!(answer(&[wall(60, 9), wall(50, 10)], &short(99)), (None, false));
    // From the wall itself.
    let on = RayWords { origin: [50, 0, 0], ..ray };
    assert_eq!(answer(&[wall(60, 9), wall(50, 10)], &on), (Some((0, 10)), true));
}

#[test]
fn nearest_many_equal_boxes_finds_the_smallest_id_of_all() {
    let formats = test_support::formats(8, 8, 8);
    let patches: Vec<PatchWords> =
        (0..3000).map(|place| wall(60, (place * 7919 + 4000) % 8191 + 2)).collect();
    let least = patches.iter().map(|patch| patch.id).min();
    let oracle = Oracle::new(&formats, &patches);
    let ray = RayWords { origin: [0; 3], dir: [128, 1, 0], t_max: 1024 };
    assert_eq!(oracle.nearest(&ray).map(|hit| hit.patch), least);
    let mut n_candidates = 0;
    oracle.candidates(&ray, |_| n_candidates += 1);
    assert_eq!(n_candidates, 3000);
}

/// Distances that double: the heuristic cuts few from many, level after level.
#[test]
fn nearest_patches_at_doubling_distances_equals_brute_force() {
    let formats = test_support::formats(28, 28, 32);
    let corner = |k: i32, axis: usize, size: i32| {
        let mut corner = [1 << k, 1 << k, 1 << k];
        corner[axis] += size;
        corner
    };
    let patch = |n: i32| {
        let (k, size) = (n % 27, 1 << (n / 27));
        PatchWords {
            corners: [corner(k, 0, 0), corner(k, 0, size), corner(k, 1, size), corner(k, 2, size)],
            is_triangle: n % 2 == 0,
            id: n.unsigned_abs(),
        }
    };
    let oracle = Oracle::new(&formats, &(0..540).map(patch).collect::<Vec<_>>());
    let mut hits = 0;
    for n in 0..1000_i32 {
        let target = oracle.patches()[n as usize * 7 % 540].corners[n as usize % 3];
        let origin = [-n * 1000, 0, n];
        let toward = [0, 1, 2].map(|k| i64::from(target[k]) - i64::from(origin[k]));
        let most = toward.iter().map(|w| w.abs()).max().unwrap().max(1);
        let dir = toward.map(|w| i32::try_from((w << 28) / (most + most / 1000 + 1)).unwrap());
        if dir == [0; 3] {
            continue;
        }
        hits += usize::from(check(&oracle, &RayWords { origin, dir, t_max: formats.t_limit() }).unwrap());
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn oracle_is_shared_between_threads() {
    fn shared<T: Send + Sync>(_: &T) {}
    shared(&Oracle::new(&Formats::default(), &[]));
}

/// The six walls of a closed box, each of so many squares a side (an even number).
fn room(n_side: i32) -> Vec<PatchWords> {
    let step = (1 << 24) / n_side;
    let mut patches = Vec::new();
    for axis in 0..3 {
        for side in [-1, 1] {
            for (u, v) in
                (-n_side / 2..n_side / 2).flat_map(|u| (-n_side / 2..n_side / 2).map(move |v| (u, v)))
            {
                let corner = |du: i32, dv: i32| {
                    let mut corner = [side * (step * (n_side / 2)); 3];
                    corner[(axis + 1) % 3] = (u + du) * step;
                    corner[(axis + 2) % 3] = (v + dv) * step;
                    corner
                };
                let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                patches.push(PatchWords { corners, is_triangle: false, id: patches.len() as u32 });
            }
        }
    }
    patches
}

/// Rays from inside the room in all directions: each hits.
fn rays_in_room(n: u64) -> impl Iterator<Item = RayWords> {
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as i32 - (1 << 23)
    };
    (0..n).map(move |i| {
        let mut dir = [random() * 2, random() * 2, random() * 2];
        dir[i as usize % 3] = if i % 2 == 0 { (1 << 24) - 1 } else { 1 - (1 << 24) };
        let origin = [random() / 2, random() / 2, random() / 2];
        RayWords { origin, dir, t_max: 4 << 24 }
    })
}

#[test]
fn nearest_inside_a_closed_room_of_many_patches_always_hits() {
    let oracle = Oracle::new(&Formats::default(), &room(130));
    assert!(oracle.patches().len() > 100_000);
    for ray in rays_in_room(2000) {
        assert!(oracle.nearest(&ray).is_some() && oracle.any(&ray), "{ray:?}");
        let mut n_candidates = 0;
        oracle.candidates(&ray, |_| n_candidates += 1);
        assert!(n_candidates <= 16, "{n_candidates} of a hundred thousand for {ray:?}");
    }
}
