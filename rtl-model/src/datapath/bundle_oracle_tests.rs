//! The bundle generator against its oracle in f64, every kind, all formats, descriptors made to trip the rounding.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::super::BundleWords;
use crate::datapath::test_support::formats;
use crate::fixed::Formats;
use crate::oracle;

/// Rays that a property compares at least.
const N_RAYS: usize = 100_000;

/// F, D, T: any, or at the ends of their ranges.
fn any_formats() -> impl Strategy<Value = Formats> {
    let bits = |most: u32| prop_oneof![3 => 8..=most, 1 => Just(8), 1 => Just(most)];
    (bits(28), bits(28), bits(32)).prop_map(|(f, d, t)| formats(f, d, t))
}

/// Rows and columns of at most 64 rays, powers of two or not.
fn size() -> impl Strategy<Value = (u32, u32)> {
    (1_u32..=64, 0_u32..64, any::<bool>()).prop_map(|(n, m, swap)| {
        let m = 1 + m % (64 / n);
        if swap { (m, n) } else { (n, m) }
    })
}

/// Whole numbers of at most so many bits: of any length, tiny, around powers of two.
fn word(most_bits: u32) -> impl Strategy<Value = i64> {
    (0..=most_bits, any::<i64>(), 0_u32..5).prop_map(move |(bits, random, kind)| {
        let power = 1_i64 << bits;
        let limit = 1_i64 << most_bits;
        let value = match kind {
            0 => random % 4,
            1 => power - 2 + random.rem_euclid(5),
            2 => -power - 2 + random.rem_euclid(5),
            _ => random % power,
        };
        value.clamp(1 - limit, limit - 1)
    })
}

/// Raw directions of at most `most_bits` bits whose rounding to D bits is hard.
fn raw(most_bits: u32, d: u32) -> impl Strategy<Value = [i64; 3]> {
    let limit = (1_i64 << most_bits) - 1;
    let odd = move || (-(1_i64 << d)..1 << d).prop_map(|w| 2 * w + 1);
    let ties = ([odd(), odd(), odd()], 0..=most_bits.saturating_sub(d + 2))
        .prop_map(move |(w, shift)| w.map(|w| (w << shift).clamp(-limit, limit)));
    // Where words of D bits round to one: 2^k - 2^(k-D-1) and next to it.
    let to_one = ([word(most_bits), word(most_bits)], 1..=most_bits, -1_i64..=1, 0_usize..3, any::<bool>())
        .prop_map(move |(others, k, off, axis, negative)| {
            let one = (1_i64 << k) - ((1_i64 << k) >> (d + 1)) + off;
            let mut raw = [others[0] % one.max(1), others[1] % one.max(1), 0];
            raw[2] = if negative { -one } else { one };
            raw.swap(2, axis);
            raw.map(|w| w.clamp(-limit, limit))
        });
    prop_oneof![2 => [word(most_bits), word(most_bits), word(most_bits)], 1 => ties, 1 => to_one]
}

/// Coordinate words: anywhere, near the middle, at the faces.
fn coordinate(f: u32) -> impl Strategy<Value = i32> {
    let one = 1_i32 << f;
    prop_oneof![3 => -one..one, 1 => -4_i32..=4, 1 => Just(-one), 1 => Just(one - 1), 1 => word(f).prop_map(|w| w as i32)]
}

fn point(f: u32) -> impl Strategy<Value = [i32; 3]> {
    [coordinate(f), coordinate(f), coordinate(f)]
}

fn tile() -> impl Strategy<Value = (Formats, BundleWords)> {
    (any_formats(), size()).prop_flat_map(|(formats, (n, m))| {
        let d = formats.dir_frac_bits;
        // At most 64 steps stay under the tile's limit of D + 9 bits, most of the time.
        let step =
            move || prop_oneof![1 => Just([0; 3]), 2 => raw(d + 3, d), 2 => raw(d + 8 - n.max(m).ilog2(), d)];
        (Just(formats), point(formats.coord_frac_bits), raw(d + 9, d), step(), step()).prop_map(
            move |(formats, apex, corner, step_u, step_v)| {
                (formats, BundleWords::Tile { apex, corner, step_u, step_v, n, m })
            },
        )
    })
}

fn fan() -> impl Strategy<Value = (Formats, BundleWords)> {
    (any_formats(), size()).prop_flat_map(|(formats, (n, m))| {
        let f = formats.coord_frac_bits;
        let one = 1_i32 << f;
        // Parallelograms whose fourth corner stays inside: a third of the cube around the middle; faces of a box.
        let middle = [point(f), point(f), point(f)].prop_map(|v| v.map(|p| p.map(|w| w / 3)));
        let face = (point(f), point(f), 0_usize..3, 0_usize..3).prop_map(|(p, q, axis, other)| {
            let along = |axis: usize| {
                let mut corner = p;
                corner[axis] = q[axis];
                corner
            };
            [p, along(axis), along((axis + 1 + other % 2) % 3)]
        });
        let small = (point(f), [-9_i32..=9, -9..=9, -9..=9], [-9_i32..=9, -9..=9, -9..=9]).prop_map(
            move |(p, u, v)| {
                let p = p.map(|w| w.clamp(20 - one, one - 20));
                [p, [0, 1, 2].map(|k| p[k] + u[k]), [0, 1, 2].map(|k| p[k] + v[k])]
            },
        );
        let jitter = || prop_oneof![Just(0_u32), Just(4095), Just(2048), 0_u32..4096];
        let vertices = prop_oneof![middle, face, small];
        (Just(formats), point(f), vertices, [jitter(), jitter()]).prop_map(
            move |(formats, apex, vertices, jitter)| {
                (formats, BundleWords::Fan { apex, vertices, n, m, jitter })
            },
        )
    })
}

fn hemisphere() -> impl Strategy<Value = (Formats, BundleWords)> {
    (any_formats(), size()).prop_flat_map(|(formats, (n, m))| {
        let d = formats.dir_frac_bits;
        let one = 1_i32 << d;
        let component =
            || prop_oneof![3 => -one..=one, 1 => Just(0), 1 => Just(one), 1 => Just(-one), 1 => -2_i32..=2];
        let axis = || [component(), component(), component()];
        let jitter = || prop_oneof![Just(0_u32), Just(32), Just(63), 0_u32..64];
        (Just(formats), point(formats.coord_frac_bits), [axis(), axis(), axis()], [jitter(), jitter()])
            .prop_map(move |(formats, apex, frame, jitter)| {
                (formats, BundleWords::Hemisphere { apex, frame, n, m, jitter })
            })
    })
}

fn targets() -> impl Strategy<Value = (Formats, BundleWords)> {
    any_formats().prop_flat_map(|formats| {
        let (f, d) = (formats.coord_frac_bits, formats.dir_frac_bits);
        let target = prop_oneof![1 => point(f).prop_map(|p| (p, [0; 3])), 2 => raw(f + 1, d).prop_map(|r| ([0; 3], r))];
        (Just(formats), point(f), prop::collection::vec(target, 1..=64)).prop_map(|(formats, apex, targets)| {
            let cube = 1_i64 << formats.coord_frac_bits;
            let place = |(at, off): &([i32; 3], [i64; 3])| {
                let from = if *off == [0; 3] { *at } else { apex };
                [0, 1, 2].map(|k| (i64::from(from[k]) + off[k]).clamp(-cube, cube - 1) as i32)
            };
            let points = targets.iter().map(place).filter(|p| *p != apex).collect();
            (formats, BundleWords::Targets { apex, points })
        })
    })
}

/// Compares every ray of valid descriptors until there were enough; fails when too few descriptors are valid.
fn compare(descriptors: impl Strategy<Value = (Formats, BundleWords)>, n_rays: usize) {
    let compared = Cell::new(0);
    let at_limit = Cell::new(0);
    for round in 0.. {
        assert!(round < 50, "only {} of {n_rays} rays: too few valid descriptors", compared.get());
        if compared.get() >= n_rays {
            break;
        }
        let cases = u32::try_from(n_rays / 100).unwrap().max(1);
        let mut runner =
            TestRunner::new(ProptestConfig { cases, ..ProptestConfig::with_source_file(file!()) });
        let outcome = runner.run(&descriptors, |(formats, bundle)| {
            if bundle.validate(&formats).is_ok() {
                for i in 0..bundle.n_rays() {
                    let (board, oracle) =
                        (bundle.scaled_ray(&formats, i), oracle::bundle::scaled_ray(&formats, &bundle, i));
                    prop_assert_eq!(&board, &oracle, "ray {} {:?}", i, formats);
                    prop_assert_eq!(bundle.ray(&formats, i), oracle::bundle::ray(&formats, &bundle, i));
                    prop_assert_eq!(board.0.validate(&formats), Ok(()));
                    compared.set(compared.get() + 1);
                    at_limit.set(at_limit.get() + usize::from(board.0.t_max == formats.t_limit()));
                }
            }
            Ok(())
        });
        outcome.unwrap_or_else(|failure| panic!("{failure}"));
    }
    assert!(at_limit.get() > 0, "no ray reached t_max = 4.0");
}

#[test]
fn tile_any_descriptor_equals_the_oracle() {
    compare(tile(), N_RAYS);
}

#[test]
fn fan_any_descriptor_equals_the_oracle() {
    compare(fan(), N_RAYS);
}

#[test]
fn hemisphere_any_frame_equals_the_oracle() {
    compare(hemisphere(), N_RAYS);
}

#[test]
fn targets_any_points_equal_the_oracle() {
    compare(targets(), N_RAYS);
}

#[test]
#[ignore = "long: 10^7 rays of every kind"]
fn bundle_ten_million_rays_of_every_kind_equal_the_oracle() {
    compare(tile(), 10_000_000);
    compare(fan(), 10_000_000);
    compare(hemisphere(), 10_000_000);
    compare(targets(), 10_000_000);
}

/// Every entry of the table that a bundle of at most 64 rays can reach, at every width, in a frame that copies it.
#[test]
fn hemisphere_every_reachable_entry_of_every_width_equals_the_oracle() {
    let mut compared = 0;
    for d in 8..=28 {
        let formats = formats(8, d, 8);
        let one = 1 << d;
        let frame = [[one, 0, 0], [0, one, 0], [0, 0, one]];
        for n in 1..=64_u32 {
            for m in 1..=64 / n {
                for jitter in [[32, 32], [0, 63], [63, 0]] {
                    let bundle = BundleWords::Hemisphere { apex: [0; 3], frame, n, m, jitter };
                    for i in 0..bundle.n_rays() {
                        let expected = oracle::bundle::scaled_ray(&formats, &bundle, i);
                        assert_eq!(bundle.scaled_ray(&formats, i), expected, "D = {d}, {n} x {m}, ray {i}");
                        compared += 1;
                    }
                }
            }
        }
    }
    assert!(compared > N_RAYS, "{compared}");
}
