//! Tests of ray x patch: against Moeller-Trumbore in i128, at the extremes of every width, and on closed meshes.

use proptest::prelude::*;

use super::*;
use crate::datapath::test_support::{formats, patch, ray, widths};
use crate::fixed::{Formats, Rounding};

type Wide = [i128; 3];

fn wide(p: [i32; 3]) -> Wide {
    p.map(i128::from)
}

fn minus(p: Wide, q: Wide) -> Wide {
    [0, 1, 2].map(|k| p[k] - q[k])
}

fn cross(p: Wide, q: Wide) -> Wide {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

fn inner(p: Wide, q: Wide) -> i128 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// Moeller, Trumbore 1997 in i128: another formula for the same real numbers. Full products only.
fn reference_triangle(formats: &Formats, ray: &RayWords, v: [[i32; 3]; 3], id: u32) -> Option<HitWords> {
    let (o, d, v0) = (wide(ray.origin), wide(ray.dir), wide(v[0]));
    let (p, q, s) = (minus(wide(v[1]), v0), minus(wide(v[2]), v0), minus(o, v0));
    let h = cross(d, q);
    let det = inner(p, h);
    let sign = det.signum();
    let (u, w) = (sign * inner(s, h), sign * inner(d, cross(s, p)));
    let (num, den) = (sign * inner(q, cross(s, p)), sign * det);
    if det == 0 || u < 0 || w < 0 || u + w > den || num < 0 {
        return None;
    }
    let (up, down) = formats.t_shifts();
    let (num, den) = (num << up, den << down);
    let (floor, rest) = (num / den, num % den);
    let t = match formats.rounding {
        Rounding::Floor => floor,
        Rounding::HalfAway => floor + i128::from(2 * rest >= den),
        Rounding::NearestEven => floor + i128::from(2 * rest > den || (2 * rest == den && floor % 2 == 1)),
    };
    let facing = if det > 0 { Facing::Front } else { Facing::Back };
    (t <= i128::from(ray.t_max)).then(|| HitWords { t: u64::try_from(t).unwrap(), patch: id, facing })
}

fn reference(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
    let [v0, v1, v2, v3] = patch.corners;
    let first = reference_triangle(formats, ray, [v0, v1, v2], patch.id);
    if patch.is_triangle {
        return first;
    }
    match (first, reference_triangle(formats, ray, [v0, v2, v3], patch.id)) {
        (Some(a), Some(b)) => Some(if b.t < a.t { b } else { a }),
        (a, b) => a.or(b),
    }
}

#[test]
fn intersect_every_tiny_triangle_equals_moeller_trumbore() {
    let formats = formats(8, 8, 8);
    let lattice = |n: i32| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
    let origins = [[0, 0, 0], [1, 0, -1], [-1, -1, -1], [0, 1, 0], [2, -2, 1]];
    let (mut cases, mut hits) = (0, 0);
    for n in 0..27 * 27 * 27 {
        let corners = [lattice(n % 27), lattice(n / 27 % 27), lattice(n / 729)];
        let patch = PatchWords {
            corners: [corners[0], corners[1], corners[2], corners[2]],
            is_triangle: true,
            id: 7,
        };
        for direction in (0..27).filter(|k| *k != 13) {
            let origin = origins[cases % origins.len()];
            let ray = RayWords { origin, dir: lattice(direction), t_max: formats.t_limit() };
            let hit = intersect(&formats, &ray, &patch);
            assert_eq!(hit, reference(&formats, &ray, &patch), "{ray:?} {patch:?}");
            cases += 1;
            hits += usize::from(hit.is_some());
        }
    }
    assert_eq!(cases, 27 * 27 * 27 * 26);
    assert!(hits > 5_000, "only {hits} hits");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn intersect_random_patches_at_all_widths_equals_moeller_trumbore(
        (formats, patch, rays) in (widths(), 0..3).prop_flat_map(|((f, d, t), mode)| {
            let rounding = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor][mode as usize];
            (Just(Formats { rounding, ..formats(f, d, t) }), patch(f), prop::collection::vec(ray(f, d, t), 16))
        })
    ) {
        for ray in &rays {
            // Half of the rays are turned toward the patch, so that enough of them hit.
            let aimed = aim(&formats, ray.origin, patch.corners[0], patch.corners[2]);
            for ray in [Some(*ray), aimed].into_iter().flatten() {
                prop_assert_eq!(intersect(&formats, &ray, &patch), reference(&formats, &ray, &patch), "{:?}", ray);
            }
        }
    }
}

/// DESIGN 3.2 step by step in i128, for edge normals rounded to K bits; edges as the three of a triangle, or the five
/// of a quad with the diagonal taken once.
fn reference_rounded(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
    let (o, d) = (wide(ray.origin), wide(ray.dir));
    let a = patch.corners.map(|v| minus(wide(v), o));
    let c =
        |i: usize, j: usize| cross(a[i], a[j]).map(|w| formats.rounding.divide(w, 1 << formats.cross_drop()));
    let diagonal = c(0, 2);
    let loops = if patch.is_triangle {
        vec![[c(0, 1), c(1, 2), c(2, 0)]]
    } else {
        vec![[c(0, 1), c(1, 2), diagonal.map(|w| -w)], [diagonal, c(2, 3), c(3, 0)]]
    };
    let mut best: Option<HitWords> = None;
    for edges in loops {
        let e = edges.map(|c| inner(c, d));
        let (most, least) = (*e.iter().max()?, *e.iter().min()?);
        if (most > 0 && least < 0) || (most == 0 && least == 0) {
            continue;
        }
        let n = [0, 1, 2].map(|k| edges.iter().map(|c| c[k]).sum::<i128>());
        let (num, den) = (inner(a[0], n), e.iter().sum::<i128>());
        // t word = num 2^(T+D-F) / den, with both sides doubled often enough to stay whole.
        let (t, d, f) = (formats.t_frac_bits, formats.dir_frac_bits, formats.coord_frac_bits);
        let word = formats.rounding.divide(num << (t + d - f.min(t + d)), den << (f - f.min(t + d)));
        let valid = num * den.signum() >= 0 && word <= i128::from(ray.t_max);
        let facing = if den < 0 { Facing::Front } else { Facing::Back };
        if valid && best.is_none_or(|b| word < i128::from(b.t)) {
            best = Some(HitWords { t: u64::try_from(word).unwrap(), patch: patch.id, facing });
        }
    }
    best
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn intersect_rounded_edge_normals_equals_the_steps_in_i128(
        (formats, patch, rays) in (widths(), 0_usize..3, 0.0_f64..1.0).prop_flat_map(|((f, d, t), mode, share)| {
            let rounding = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor][mode];
            let keep = 4 + (share * f64::from(2 * f - 4)) as u32;
            let formats = Formats { rounding, cross_keep_bits: Some(keep), ..formats(f, d, t) };
            (Just(formats), patch(f), prop::collection::vec(ray(f, d, t), 16))
        })
    ) {
        for ray in &rays {
            let aimed = aim(&formats, ray.origin, patch.corners[0], patch.corners[2]);
            for ray in [Some(*ray), aimed].into_iter().flatten() {
                let expected = reference_rounded(&formats, &ray, &patch);
                prop_assert_eq!(intersect(&formats, &ray, &patch), expected, "{:?}", ray);
            }
        }
    }
}

/// A ray from `origin` toward the middle of two points.
fn aim(formats: &Formats, origin: [i32; 3], p: [i32; 3], q: [i32; 3]) -> Option<RayWords> {
    let toward = [0, 1, 2].map(|k| i64::from(p[k]) + i64::from(q[k]) - 2 * i64::from(origin[k]));
    let most = toward.iter().map(|w| w.abs()).max()?;
    let scale = (1_i64 << formats.dir_frac_bits) - 1;
    (most > 0).then(|| RayWords {
        origin,
        dir: toward.map(|w| i32::try_from(w * scale / most).unwrap()),
        t_max: formats.t_limit(),
    })
}

/// Formats at the corners of the ranges.
fn extreme_formats() -> Vec<Formats> {
    let mut all = Vec::new();
    for (f, d, t) in [(8, 8, 8), (8, 28, 32), (28, 8, 8), (28, 28, 32), (24, 24, 24)] {
        for keep in [None, Some(4), Some(f), Some(2 * f - 1)] {
            for rounding in [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor] {
                all.push(Formats { cross_keep_bits: keep, rounding, ..formats(f, d, t) });
            }
        }
    }
    all
}

#[test]
fn width_table_every_cube_corner_stays_in_its_wires_and_reaches_the_bounds() {
    for formats in extreme_formats() {
        formats.validate().unwrap();
        let table = formats.width_table();
        let bound = |wire: &str| table.iter().find(|row| row.wire == wire).unwrap().max_magnitude;
        let mut seen = std::collections::BTreeMap::<&str, i128>::new();
        let ends = [-(1_i32 << formats.coord_frac_bits), (1 << formats.coord_frac_bits) - 1];
        let most = (1_i32 << formats.dir_frac_bits) - 1;
        let corner = |n: usize| [ends[n & 1], ends[n >> 1 & 1], ends[n >> 2 & 1]];
        for n in 0..4096_usize {
            // Every tetrahedron of cube corners; the fourth corner of the quad walks along.
            let corners = [n, n >> 3, n >> 6, n ^ n >> 5].map(corner);
            let dir = [0, 1, 2].map(|k| if (n * 7 + n / 64) >> k & 1 == 0 { most } else { -most });
            for flip in [[1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]] {
                let dir = [0, 1, 2].map(|k| dir[k] * flip[k]);
                let ray = RayWords { origin: corner(n >> 9), dir, t_max: formats.t_limit() };
                let patch = PatchWords { corners, is_triangle: n % 2 == 1, id: 0 };
                let taps = taps(&formats, &ray, &patch);
                let mut note = |wire, value: i128| {
                    let largest = seen.entry(wire).or_default();
                    *largest = (*largest).max(value.abs());
                };
                taps.a.iter().flatten().for_each(|w| note("a", i128::from(*w)));
                taps.c.iter().flatten().for_each(|w| note("c", i128::from(*w)));
                taps.e.iter().for_each(|w| note("e", *w));
                for triangle in taps.triangles.iter().flatten() {
                    triangle.n.iter().for_each(|w| note("n", i128::from(*w)));
                    note("den", triangle.den);
                    note("num", triangle.num);
                    note("num_shifted", triangle.num_shifted);
                    note("den_shifted", triangle.den_shifted);
                    let hit = intersect(&formats, &ray, &patch);
                    assert!(hit.is_none_or(|h| h.t <= formats.t_limit()));
                }
            }
        }
        assert_eq!(seen.len(), 8);
        for (wire, largest) in seen {
            assert!(largest <= bound(wire), "{wire}: {largest} > {} at {formats:?}", bound(wire));
            if formats.cross_drop() == 0 {
                assert_eq!(largest, bound(wire), "{wire} at {formats:?}");
            } else if formats.cross_keep() >= formats.coord_frac_bits {
                assert!(
                    10 * largest >= 9 * bound(wire),
                    "{wire}: {largest} of {} at {formats:?}",
                    bound(wire)
                );
            }
        }
        for row in &table {
            let needed = 128 - row.max_magnitude.leading_zeros();
            let signed = ["a", "c", "e", "n", "den", "num", "num_shifted", "den_shifted", "direction"];
            let needed = needed + u32::from(signed.contains(&row.wire));
            assert!(row.bits >= needed, "{} needs {needed} bits, has {}", row.wire, row.bits);
            assert!(row.bits <= 123, "{} has {} bits", row.wire, row.bits);
        }
    }
}

#[test]
fn intersect_behind_the_origin_by_less_than_half_a_step_is_no_hit() {
    // x = 1/4 step behind the origin (0, 0, 0), in a plane tilted through integer points: rounds to t = 0.
    let formats = formats(8, 8, 8);
    let corners = [[-1, -1, -3], [-1, -1, 3], [2, 3, 0], [2, 3, 0]];
    let patch = PatchWords { corners, is_triangle: true, id: 0 };
    let ray = RayWords { origin: [0, 0, 0], dir: [200, 0, 0], t_max: formats.t_limit() };
    let wires = taps(&formats, &ray, &patch).triangles[0].unwrap();
    assert!(wires.inside && (wires.num < 0) != (wires.den < 0), "{wires:?}");
    assert_eq!(Rounding::NearestEven.divide(wires.num_shifted, wires.den_shifted), 0);
    assert_eq!(intersect(&formats, &ray, &patch), None);
    let turned = RayWords { dir: [-200, 0, 0], ..ray };
    assert_eq!(intersect(&formats, &turned, &patch).map(|h| h.t), Some(0));
}

#[test]
fn intersect_front_and_back_of_a_quad_names_the_side() {
    let formats = Formats::default();
    let (half, quarter) = (1 << 23, 1 << 22);
    let corners =
        [[-half, -half, quarter], [half, -half, quarter], [half, half, quarter], [-half, half, quarter]];
    let patch = PatchWords { corners, is_triangle: false, id: 3 };
    let up = RayWords { origin: [5, 9, 0], dir: [0, 0, half], t_max: formats.t_limit() };
    // Counter-clockwise seen from +z: from below it is the back; t = (1/4) / (1/2).
    let back = HitWords { t: 1 << 23, patch: 3, facing: Facing::Back };
    assert_eq!(intersect(&formats, &up, &patch), Some(back));
    let down = RayWords { origin: [5, 9, half], dir: [0, 0, -half], ..up };
    assert_eq!(intersect(&formats, &down, &patch), Some(HitWords { facing: Facing::Front, ..back }));
    let away = RayWords { dir: [0, 0, half], ..down };
    assert_eq!(intersect(&formats, &away, &patch), None);
}

#[path = "ray_patch_watertight_tests.rs"]
mod watertight;
