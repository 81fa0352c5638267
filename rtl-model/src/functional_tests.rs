//! Tests of the functional model: against brute force over all patches.

use proptest::prelude::*;

use super::*;
use crate::datapath::PatchWords;
use crate::fixed::{Formats, Rounding};

fn formats(f: u32, d: u32, t: u32) -> Formats {
    Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() }
}

/// Every patch, no grid.
fn brute_force(image: &MemoryImage, ray: &RayWords) -> Option<HitWords> {
    (0..image.n_patches)
        .fold(None, |best, patch| HitWords::nearer(best, intersect(&image.formats, ray, &image.patch(patch))))
}

/// Coordinates that are random, or within three steps of a plane of a 2^3 grid.
fn coordinate(f: u32) -> impl Strategy<Value = i32> {
    let one = 1_i32 << f;
    let cell_log2 = f + 1 - 3;
    prop_oneof![
        -one..one,
        (0_i32..=8, -3_i32..=3)
            .prop_map(move |(plane, off)| { ((plane << cell_log2) - one + off).clamp(-one, one - 1) }),
    ]
}

fn point(f: u32) -> impl Strategy<Value = [i32; 3]> {
    [coordinate(f), coordinate(f), coordinate(f)]
}

fn small_patch(f: u32) -> impl Strategy<Value = PatchWords> {
    let spread = (1_i32 << f) / 2;
    let one = 1_i32 << f;
    let offset = move || [-spread..=spread, -spread..=spread, -spread..=spread];
    (point(f), offset(), offset(), any::<bool>(), prop::collection::vec(coordinate(f), 3)).prop_map(
        move |(v0, u, v, is_triangle, last)| {
            let at = |offset: [i32; 3]| [0, 1, 2].map(|k| (v0[k] + offset[k]).clamp(-one, one - 1));
            let (v1, v2) = (at(u), at(v));
            // A bent quad, not a planar one: both diagonals' triangles matter.
            let v3 = if is_triangle { v2 } else { [last[0], last[1], last[2]] };
            PatchWords { corners: [v0, v1, v2, v3], is_triangle, id: 0 }
        },
    )
}

fn direction(d: u32) -> impl Strategy<Value = [i32; 3]> {
    let most = (1_i32 << d) - 1;
    let component = move || prop_oneof![3 => -most..=most, 1 => Just(0), 1 => -3_i32..=3, 1 => Just(most)];
    ([component(), component(), component()], 0_usize..3, any::<bool>()).prop_map(
        move |(mut dir, axis, negative)| {
            // The largest component lies in [2^(D-1), 2^D).
            if dir.iter().all(|w| w.abs() < 1 << (d - 1)) {
                dir[axis] = if negative { -(1 << (d - 1)) } else { 1 << (d - 1) };
            }
            dir
        },
    )
}

fn scene() -> impl Strategy<Value = (Formats, Vec<PatchWords>, Vec<RayWords>, Option<u32>)> {
    let widths = prop_oneof![
        Just((8_u32, 8_u32, 8_u32)),
        Just((8, 8, 12)),
        Just((10, 8, 8)),
        Just((12, 16, 20)),
        Just((24, 24, 24)),
        Just((28, 28, 32)),
    ];
    let modes = prop_oneof![Just(Rounding::NearestEven), Just(Rounding::HalfAway), Just(Rounding::Floor)];
    (widths, modes).prop_flat_map(|((f, d, t), rounding)| {
        let formats = Formats { rounding, ..formats(f, d, t) };
        let ray = (point(f), direction(d), prop_oneof![Just(4_u64 << t), 0..=(4_u64 << t)])
            .prop_map(|(origin, dir, t_max)| RayWords { origin, dir, t_max });
        let grid = prop_oneof![Just(None), Just(Some(1)), Just(Some(3)), Just(Some(5))];
        (Just(formats), prop::collection::vec(small_patch(f), 1..24), prop::collection::vec(ray, 24), grid)
    })
}

fn numbered(mut patches: Vec<PatchWords>) -> Vec<PatchWords> {
    for (patch, id) in patches.iter_mut().zip(0..) {
        patch.id = id;
    }
    patches
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn trace_random_and_adversarial_scenes_equals_brute_force((formats, patches, rays, grid) in scene()) {
        let image = MemoryImage::build(&formats, &numbered(patches), grid);
        for ray in &rays {
            let nearest = trace(&image, ray, false);
            let expected = brute_force(&image, ray);
            prop_assert_eq!(nearest.hit, expected, "{:?} {:?}", formats, ray);
            let any = trace(&image, ray, true);
            prop_assert_eq!(any.hit.is_some(), expected.is_some());
            prop_assert!(any.cells <= nearest.cells && any.tests <= nearest.tests);
            prop_assert!(nearest.tests <= nearest.list_entries);
        }
    }
}
