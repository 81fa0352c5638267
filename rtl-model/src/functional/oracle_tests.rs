//! The board without time, and the board with it, against the oracle's own search: whole scenes, full products.
//!
//! ```text
//! patches -> cell lists -> walk, mailbox, termination -> hit  ==  hit <- tree of boxes in f64 <- patches
//! ```
//! What only a scene can show: a cell left out of the walk or of a list, a ray ended a cell too early.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::super::trace;
use crate::board::{Board, Work};
use crate::datapath::test_support::{self, formats};
use crate::datapath::{PatchWords, RayWords};
use crate::fixed::{Formats, Rounding};
use crate::memory_image::MemoryImage;
use crate::oracle::Oracle;
use crate::spec::BoardSpec;

/// Rays that a property compares at least.
const N_RAYS: usize = 100_000;

/// Rays of a case.
const RAYS_A_CASE: usize = 128;

/// A scene with its grid (None: chosen) and its rays.
#[derive(Clone, Debug)]
struct Scene {
    formats: Formats,
    log2_cells: Option<u32>,
    patches: Vec<PatchWords>,
    rays: Vec<RayWords>,
}

/// Runs scenes until there were enough rays; more than one in `one_in` must hit.
fn compare(scenes: impl Strategy<Value = Scene>, n_rays: usize, one_in: usize) {
    let (rays, hits) = (Cell::new(0), Cell::new(0));
    let cases = u32::try_from(n_rays / RAYS_A_CASE + 1).unwrap();
    let mut runner = TestRunner::new(ProptestConfig { cases, ..ProptestConfig::with_source_file(file!()) });
    let outcome = runner.run(&scenes, |scene| {
        let image = MemoryImage::build(&scene.formats, &scene.patches, scene.log2_cells);
        let oracle = Oracle::new(&scene.formats, &scene.patches);
        for ray in &scene.rays {
            prop_assert_eq!(ray.validate(&scene.formats), Ok(()));
            let expected = oracle.nearest(ray);
            prop_assert_eq!(trace(&image, ray, false).hit, expected, "{:?}", ray);
            prop_assert_eq!(trace(&image, ray, true).hit.is_some(), oracle.any(ray), "{:?}", ray);
            rays.set(rays.get() + 1);
            hits.set(hits.get() + usize::from(expected.is_some()));
        }
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
    assert!(rays.get() >= n_rays && hits.get() * one_in > n_rays, "{} rays, {} hits", rays.get(), hits.get());
}

/// F, D, T anywhere, at the ends of their ranges, or with many coordinate steps to a step of t.
fn any_formats() -> impl Strategy<Value = Formats> {
    let bits = |most: u32| prop_oneof![2 => 8..=most, 1 => Just(8), 1 => Just(most)];
    let coarse = (10_u32..=28, 8_u32..=10, 8_u32..=9);
    (prop_oneof![2 => (bits(28), bits(28), bits(32)), 1 => coarse], 0_usize..3).prop_map(
        |((f, d, t), mode)| {
            let rounding = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor][mode];
            Formats { rounding, ..formats(f, d, t) }
        },
    )
}

/// Ids in another order than places.
fn with_ids(mut patches: Vec<PatchWords>, descending: bool) -> Vec<PatchWords> {
    for (patch, place) in patches.iter_mut().zip(0..) {
        patch.id = if descending { (1 << 28) - 1 - place } else { 7 * place };
    }
    patches
}

/// A direction toward a point, scaled by a power of two; exact if the difference has at most D bits.
fn toward(formats: &Formats, from: [i32; 3], to: [i32; 3]) -> Option<[i32; 3]> {
    let way = [0, 1, 2].map(|k| i64::from(to[k]) - i64::from(from[k]));
    let length = way.iter().map(|w| u64::BITS - w.unsigned_abs().leading_zeros()).max()?;
    let (left, right) =
        (formats.dir_frac_bits.saturating_sub(length), length.saturating_sub(formats.dir_frac_bits));
    // Truncated toward zero: no word grows to 2^D.
    (length > 0).then(|| way.map(|w| i32::try_from((w << left) / (1_i64 << right)).unwrap()))
}

/// Patches of every size and rays at them, off them and anywhere; copies under other ids.
fn random_scene() -> impl Strategy<Value = Scene> {
    let grid = prop_oneof![Just(None), (0_u32..=5).prop_map(Some)];
    (any_formats(), grid, any::<bool>()).prop_flat_map(|(formats, log2_cells, descending)| {
        let (f, d, t) = (formats.coord_frac_bits, formats.dir_frac_bits, formats.t_frac_bits);
        // Shrunk toward their first corner by up to 2^-8.
        let patch = (test_support::patch(f), 0_u32..9).prop_map(|(mut patch, shrink)| {
            let first = patch.corners[0];
            for corner in &mut patch.corners {
                *corner = [0, 1, 2].map(|k| first[k] + ((corner[k] - first[k]) >> shrink));
            }
            patch
        });
        let rays = prop::collection::vec((test_support::ray(f, d, t), 0_usize..40, 0_usize..16), RAYS_A_CASE);
        (prop::collection::vec(patch, 0..24), rays, 0_usize..4).prop_map(
            move |(mut patches, rays, copies)| {
                // Toward the middle of two corners, or of one with itself.
                let aim = |(ray, target, pair): (RayWords, usize, usize)| {
                    let middle = patches.get(target).map(|patch| {
                        let (p, q) = (patch.corners[pair % 4], patch.corners[pair / 4]);
                        [0, 1, 2].map(|k| p[k] + (q[k] - p[k]) / 2)
                    });
                    let dir = middle.and_then(|point| toward(&formats, ray.origin, point));
                    RayWords { dir: dir.unwrap_or(ray.dir), ..ray }
                };
                let rays = rays.into_iter().map(aim).collect();
                patches.extend_from_within(..copies.min(patches.len()));
                Scene { formats, log2_cells, patches: with_ids(patches, descending), rays }
            },
        )
    })
}

#[test]
fn trace_random_scenes_of_all_formats_equals_the_oracle() {
    compare(random_scene(), N_RAYS, 16);
}

/// Walls, nearly parallel to the cell planes and within three steps of them, and rays for which a plane lies where t
/// rounds from one word to the next: the walls on both sides of it have equal or neighbouring t, and either may win.
fn walls() -> impl Strategy<Value = Scene> {
    (any_formats(), 1_u32..=4, 0_usize..3, any::<bool>()).prop_flat_map(|(formats, g, axis, descending)| {
        let (f, d, t) = (formats.coord_frac_bits, formats.dir_frac_bits, formats.t_frac_bits);
        let one = 1_i64 << f;
        let plane = move |place: i64| (place << (f + 1 - g)) - one;
        let clamp = move |word: i64| i32::try_from(word.clamp(-one, one - 1)).unwrap();
        let offset = || -3_i64..=3;
        // A few planes only, so that walls crowd.
        let near = (1_i64 << g) / 2;
        let wall = (near - 1..=near + 1, [offset(), offset(), offset(), offset()], any::<bool>()).prop_map(
            move |(place, off, is_triangle)| {
                let corner = |off: i64, u: i64, v: i64| {
                    let mut corner = [0; 3];
                    corner[axis] = clamp(plane(place) + off);
                    corner[(axis + 1) % 3] = clamp(u * one);
                    corner[(axis + 2) % 3] = clamp(v * one);
                    corner
                };
                let mut corners = [
                    corner(off[0], -1, -1),
                    corner(off[1], 1, -1),
                    corner(off[2], 1, 1),
                    corner(off[3], -1, 1),
                ];
                if is_triangle {
                    corners[3] = corners[2];
                }
                PatchWords { corners, is_triangle, id: 0 }
            },
        );
        let most = (1_i32 << d) - 1;
        let half = 1_i32 << (d - 1);
        // At speed 1/2 a step of t is 2^(F-T-1) coordinate steps and its half 2^(F-T-2).
        let half_step = 1_i64 << f.saturating_sub(t + 2);
        let steep =
            (near - 1..=near + 1, 0_i64..12, -2_i64..=2, [-2_i32..=2, -2_i32..=2], any::<bool>(), 0_u64..12)
                .prop_map(move |(place, halves, off, drift, back, t_max)| {
                    let sign = if back { -1 } else { 1 };
                    let (mut origin, mut dir) = ([clamp(one / 3); 3], [half * sign; 3]);
                    origin[axis] = clamp(plane(place) - i64::from(sign) * (halves * half_step + off));
                    dir[(axis + 1) % 3] = drift[0];
                    dir[(axis + 2) % 3] = drift[1];
                    RayWords { origin, dir, t_max: if t_max > 9 { 4 << t } else { t_max } }
                });
        let grazing = (test_support::ray(f, d, t), -4_i32..=4, 1_usize..3, any::<bool>()).prop_map(
            move |(mut ray, slope, other, back)| {
                ray.dir[axis] = slope;
                ray.dir[(axis + other) % 3] = if back { -most } else { most };
                ray
            },
        );
        let any = test_support::ray(f, d, t);
        let rays = prop::collection::vec(prop_oneof![2 => steep, 1 => grazing, 1 => any], RAYS_A_CASE);
        (prop::collection::vec(wall, 1..10), rays).prop_map(move |(patches, rays)| Scene {
            formats,
            log2_cells: Some(g),
            patches: with_ids(patches, descending),
            rays,
        })
    })
}

#[test]
fn trace_walls_within_three_steps_of_cell_planes_equals_the_oracle() {
    compare(walls(), N_RAYS, 4);
}

/// Corners of patches on corners, edges and planes of cells; rays exactly through such points, and inside cell planes.
fn lattice() -> impl Strategy<Value = Scene> {
    (any_formats(), 1_u32..=4, any::<bool>()).prop_flat_map(|(formats, g, descending)| {
        let (f, d, t) = (formats.coord_frac_bits, formats.dir_frac_bits, formats.t_frac_bits);
        let one = 1_i32 << f;
        let planes = 1_i32 << g;
        let word = move || {
            let plane =
                (0..=planes).prop_map(move |p| ((i64::from(p) << (f + 1 - g)) - i64::from(one)) as i32);
            let beside = (0..=planes, -3_i32..=3)
                .prop_map(move |(p, off)| ((i64::from(p) << (f + 1 - g)) - i64::from(one)) as i32 + off);
            prop_oneof![6 => plane, 1 => beside, 1 => -one..one].prop_map(move |w| w.clamp(-one, one - 1))
        };
        let point = move || [word(), word(), word()];
        let patch = ([point(), point(), point(), point()], any::<bool>(), 0_usize..6).prop_map(
            |(mut corners, is_triangle, flat)| {
                // Half of them lie in a plane along an axis.
                let first = corners[0];
                if flat < 3 {
                    corners.iter_mut().for_each(|corner| corner[flat] = first[flat]);
                }
                if is_triangle {
                    corners[3] = corners[2];
                }
                PatchWords { corners, is_triangle, id: 0 }
            },
        );
        let ray = (point(), point(), 0_usize..6, prop_oneof![2 => Just(4_u64 << t), 1 => 0..=4_u64 << t])
            .prop_map(move |(origin, mut target, still, t_max)| {
                // Half of them stay in the plane that their origin lies in.
                if still < 3 {
                    target[still] = origin[still];
                }
                let dir = toward(&formats, origin, target).unwrap_or([1 << (d - 1), 0, 0]);
                RayWords { origin, dir, t_max }
            });
        let patches = prop::collection::vec(patch, 0..12);
        (patches, prop::collection::vec(ray, RAYS_A_CASE)).prop_map(move |(patches, rays)| Scene {
            formats,
            log2_cells: Some(g),
            patches: with_ids(patches, descending),
            rays,
        })
    })
}

#[test]
fn trace_hits_on_cell_planes_and_corners_and_rays_along_planes_equals_the_oracle() {
    compare(lattice(), N_RAYS, 8);
}

#[test]
#[ignore = "long: 10^7 rays of each kind of scene; cargo test --release -p rtl-model --lib functional -- --ignored"]
fn trace_ten_million_rays_of_each_kind_equals_the_oracle() {
    compare(random_scene(), 10_000_000, 16);
    compare(walls(), 10_000_000, 4);
    compare(lattice(), 10_000_000, 8);
}

/// The clocked board of a preset, in the scene's formats.
fn compare_board(preset: &str, cases: u32) {
    let compared = Cell::new(0);
    let mut runner = TestRunner::new(ProptestConfig { cases, ..ProptestConfig::with_source_file(file!()) });
    let outcome = runner.run(&prop_oneof![random_scene(), walls(), lattice()], |scene| {
        let spec = BoardSpec { formats: scene.formats, ..BoardSpec::preset(preset).unwrap() };
        let image = MemoryImage::build(&scene.formats, &scene.patches, scene.log2_cells);
        let mut board = Board::new(&spec, image).unwrap();
        let oracle = Oracle::new(&scene.formats, &scene.patches);
        let nearest = board.trace_nearest(Work::Rays(&scene.rays)).unwrap();
        let any = board.trace_any(Work::Rays(&scene.rays)).unwrap();
        prop_assert_eq!((nearest.len(), any.len()), (scene.rays.len(), scene.rays.len()));
        for ((ray, nearest), any) in scene.rays.iter().zip(nearest).zip(any) {
            prop_assert_eq!((nearest, any), (oracle.nearest(ray), oracle.any(ray)), "{:?}", ray);
            compared.set(compared.get() + 1);
        }
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
    assert!(compared.get() >= cases as usize * RAYS_A_CASE, "{}", compared.get());
}

#[test]
fn board_minimal_on_adversarial_scenes_equals_the_oracle() {
    compare_board("minimal", 100);
}

#[test]
fn board_delft_1992_on_adversarial_scenes_equals_the_oracle() {
    compare_board("delft-1992", 100);
}
