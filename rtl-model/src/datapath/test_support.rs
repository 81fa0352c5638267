//! Generators that several test modules share.

use proptest::prelude::*;

use crate::datapath::{PatchWords, RayWords};
use crate::fixed::Formats;

/// Formats with these widths, the rest at default.
pub(crate) fn formats(f: u32, d: u32, t: u32) -> Formats {
    Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() }
}

/// Coordinates that are random, or within three steps of a plane of a 2^3 grid.
pub(crate) fn coordinate(f: u32) -> impl Strategy<Value = i32> {
    let one = 1_i32 << f;
    let cell_log2 = f + 1 - 3;
    prop_oneof![
        -one..one,
        (0_i32..=8, -3_i32..=3)
            .prop_map(move |(plane, off)| { ((plane << cell_log2) - one + off).clamp(-one, one - 1) }),
    ]
}

/// Points of such coordinates.
pub(crate) fn point(f: u32) -> impl Strategy<Value = [i32; 3]> {
    [coordinate(f), coordinate(f), coordinate(f)]
}

/// Directions with zero, tiny and extreme components.
pub(crate) fn direction(d: u32) -> impl Strategy<Value = [i32; 3]> {
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

/// Rays with such origins and directions, full or cut.
pub(crate) fn ray(f: u32, d: u32, t: u32) -> impl Strategy<Value = RayWords> {
    (point(f), direction(d), prop_oneof![Just(4_u64 << t), 0..=(4_u64 << t)])
        .prop_map(|(origin, dir, t_max)| RayWords { origin, dir, t_max })
}

/// Triangles and bent quads, up to half the cube wide.
pub(crate) fn patch(f: u32) -> impl Strategy<Value = PatchWords> {
    let one = 1_i32 << f;
    let offset = move || [-one / 2..=one / 2, -one / 2..=one / 2, -one / 2..=one / 2];
    (point(f), offset(), offset(), any::<bool>(), point(f)).prop_map(move |(v0, u, v, is_triangle, last)| {
        let at = |offset: [i32; 3]| [0, 1, 2].map(|k| (v0[k] + offset[k]).clamp(-one, one - 1));
        let (v1, v2) = (at(u), at(v));
        let v3 = if is_triangle { v2 } else { last };
        PatchWords { corners: [v0, v1, v2, v3], is_triangle, id: 0 }
    })
}

/// The widths that property tests run at: low, mixed, default, widest.
pub(crate) fn widths() -> impl Strategy<Value = (u32, u32, u32)> {
    prop_oneof![
        Just((8, 8, 8)),
        Just((8, 8, 12)),
        Just((10, 8, 8)),
        Just((28, 8, 8)),
        Just((8, 28, 32)),
        Just((12, 16, 20)),
        Just((24, 24, 24)),
        Just((28, 28, 32)),
    ]
}

/// Patches with their places as ids.
pub(crate) fn numbered(mut patches: Vec<PatchWords>) -> Vec<PatchWords> {
    for (patch, id) in patches.iter_mut().zip(0..) {
        patch.id = id;
    }
    patches
}
