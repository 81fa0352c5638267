//! Tests of the width table: rows worked out by hand, and the wires of the bundle generator and the cell step at their
//! extremes. The wires of ray x patch are driven to theirs in `datapath/ray_patch_tests.rs`.

use super::*;
use crate::datapath::RayWords;
use crate::datapath::bundle::BundleWords;
use crate::datapath::cell_step::{Cell, Grid, ends_before};
use crate::fixed::Rounding;

fn formats(f: u32, d: u32, t: u32) -> Formats {
    Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() }
}

/// Formats at the ends of the ranges and between.
fn all_formats() -> [Formats; 6] {
    [(8, 8, 8), (8, 28, 32), (28, 8, 8), (28, 28, 32), (24, 24, 24), (20, 11, 13)]
        .map(|(f, d, t)| formats(f, d, t))
}

fn bound(formats: &Formats, wire: &str) -> i128 {
    let rows = formats.width_table();
    rows.iter().find(|row| row.wire == wire).map(|row| row.max_magnitude).expect("a wire of that name")
}

fn assert_rows(formats: &Formats, expected: &[(&'static str, u32, u32, i128)]) {
    let table = formats.width_table();
    assert_eq!(table.len(), expected.len());
    for (row, (wire, bits, frac_bits, max_magnitude)) in table.iter().zip(expected) {
        let (wire, bits, frac_bits, max_magnitude) = (*wire, *bits, *frac_bits, *max_magnitude);
        assert_eq!(*row, WireWidth { wire, bits, frac_bits, max_magnitude });
    }
}

#[test]
fn width_table_eight_bits_each_is_as_worked_out_by_hand() {
    // S = 511, S^2 = 261,121, S^3 = 133,432,831, T + D - F = 8.
    assert_rows(
        &formats(8, 8, 8),
        &[
            ("coordinate", 9, 8, 256),
            ("direction", 9, 8, 255),
            ("a", 10, 8, 511),
            ("c", 20, 16, 261_121),
            ("e", 30, 24, 199_757_565),
            ("n", 20, 16, 261_121),
            ("den", 30, 24, 199_757_565),
            ("num", 31, 24, 266_865_662),
            ("num_shifted", 39, 32, 68_317_609_472),
            ("den_shifted", 30, 24, 199_757_565),
            ("t", 11, 8, 1024),
            ("cell_plane", 10, 8, 256),
            ("cell_num", 10, 8, 512),
            ("cell_den", 9, 8, 255),
            ("cell_product", 19, 16, 130_560),
            ("cell_num_shifted", 18, 16, 131_072),
            ("end_product", 21, 16, 522_495),
            ("tile_product", 19, 16, 262_142),
            ("tile_direction", 18, 16, 131_071),
            ("target_direction", 10, 8, 511),
            ("fan_product", 28, 20, 133_955_073),
            ("fan_num", 28, 20, 67_239_936),
            ("fan_den", 19, 12, 262_144),
            ("hemisphere_word", 10, 8, 256),
            ("hemisphere_product", 18, 16, 65_536),
            ("hemisphere_direction", 18, 16, 114_688),
            ("direction_rounded", 10, 8, 256),
        ],
    );
}

#[test]
fn width_table_rounded_products_and_a_shifted_divisor_are_as_worked_out_by_hand() {
    // S = 2^21 - 1, s = 40 - 21 = 19: S^2 / 2^19 = 2^23 - 8 + 2^-19, 2 S^3 / 2^19 = 2^45 - 3 2^24 + 24 - 2^-18,
    // 9 S = 18,874,359. T + D - F = -4.
    let formats = Formats { cross_keep_bits: Some(21), ..formats(20, 8, 8) };
    assert_rows(
        &formats,
        &[
            ("coordinate", 21, 20, 1_048_576),
            ("direction", 9, 8, 255),
            ("a", 22, 20, 2_097_151),
            ("c", 25, 21, 8_388_601),
            ("e", 35, 29, 6_417_279_765),
            ("n", 25, 21, 8_388_603),
            ("den", 35, 29, 6_417_281_295),
            ("num", 48, 41, 35_184_340_631_567),
            ("num_shifted", 48, 41, 35_184_340_631_567),
            ("den_shifted", 39, 33, 102_676_500_720),
            ("t", 11, 8, 1024),
            ("cell_plane", 22, 20, 1_048_576),
            ("cell_num", 22, 20, 2_097_152),
            ("cell_den", 9, 8, 255),
            ("cell_product", 31, 28, 534_773_760),
            ("cell_num_shifted", 22, 20, 2_097_152),
            ("end_product", 25, 20, 8_359_920),
            ("tile_product", 19, 16, 262_142),
            ("tile_direction", 18, 16, 131_071),
            ("target_direction", 22, 20, 2_097_151),
            ("fan_product", 40, 32, 549_753_454_593),
            ("fan_num", 40, 32, 274_878_038_016),
            ("fan_den", 19, 12, 262_144),
            ("hemisphere_word", 10, 8, 256),
            ("hemisphere_product", 18, 16, 65_536),
            ("hemisphere_direction", 18, 16, 114_688),
            ("direction_rounded", 10, 8, 256),
        ],
    );
}

#[test]
fn width_table_every_wire_holds_its_bound_and_no_name_is_twice() {
    let unsigned =
        ["t", "cell_num", "cell_den", "cell_product", "cell_num_shifted", "end_product", "fan_den"];
    for formats in all_formats() {
        let table = formats.width_table();
        for (place, row) in table.iter().enumerate() {
            let sign = u32::from(!unsigned.contains(&row.wire));
            // A coordinate reaches -2^F only, the least word of its width.
            let most = if row.wire == "coordinate" { row.max_magnitude - 1 } else { row.max_magnitude };
            let needed = i128::BITS - most.leading_zeros() + sign;
            assert!(row.bits >= needed && row.bits <= 123, "{row:?} needs {needed} bits");
            assert!(row.bits <= needed + 2, "{row:?} needs only {needed} bits");
            assert!(table[..place].iter().all(|other| other.wire != row.wire), "{} is twice", row.wire);
        }
    }
}

/// Direction words and t_max of ray `i`, checked to be valid words.
fn expand(formats: &Formats, bundle: &BundleWords, i: usize) -> (RayWords, i32) {
    assert_eq!(bundle.validate(formats), Ok(()), "{bundle:?}");
    let (ray, scale) = bundle.scaled_ray(formats, i);
    assert_eq!(ray.validate(formats), Ok(()), "{bundle:?}");
    (ray, scale)
}

#[test]
fn tile_wires_at_the_extremes_reach_their_bounds() {
    for formats in all_formats() {
        let d = formats.dir_frac_bits;
        let tile = (1_i64 << (d + 9)) - 1;
        let (corner, step_u) = ([tile, -tile, 1], [-tile, tile, 0]);
        let bundle = BundleWords::Tile { apex: [0; 3], corner, step_u, step_v: [0; 3], n: 3, m: 1 };
        // Directions tile, 0 and -tile; the product of the last is twice as long.
        assert_eq!(i128::from(2 * step_u[1]), bound(&formats, "tile_product"));
        assert_eq!(i128::from(corner[0]), bound(&formats, "tile_direction"));
        // 2^(D+9) - 1 rounds to 2^D, which is no word: half of it, at a scale of 4 for lengths just under 2.
        let half = 1 << (d - 1);
        assert_eq!(2 * i128::from(half), bound(&formats, "direction_rounded"));
        for (i, dir) in [(0, [half, -half, 0]), (2, [-half, half, 0])] {
            let (ray, scale) = expand(&formats, &bundle, i);
            assert_eq!((ray.dir, scale), (dir, 2));
        }
        let longer =
            BundleWords::Tile { apex: [0; 3], corner: [tile; 3], step_u: [1; 3], step_v: [0; 3], n: 2, m: 1 };
        assert!(longer.validate(&formats).is_err());
    }
}

#[test]
fn fan_wires_at_the_extremes_reach_their_bounds() {
    for formats in all_formats() {
        let f = formats.coord_frac_bits;
        let (low, high) = (-(1_i32 << f), (1_i32 << f) - 1);
        let wide = |word: i32| i128::from(word);
        // The last sample: places (63 2^12 + j0) of 64 2^12 and j1 of 2^12, m = 1, den = 2^18.
        let sample = |v: [i32; 3], jitter: [i128; 2]| {
            let first = (63 * 4096 + jitter[0]) * (wide(v[1]) - wide(v[0]));
            let second = jitter[1] * (wide(v[2]) - wide(v[0])) * 64;
            (first, second, (wide(v[0]) << 18) + first + second)
        };
        let corner = |word| [word; 3];
        // Half a step below the cube's lowest corner: 1 - 63/64 - 33/64 = -1/2 from it, to even on it.
        let vertices = [corner(low + 1), corner(low), corner(low)];
        let bundle = BundleWords::Fan { apex: corner(high), vertices, n: 64, m: 1, jitter: [0, 33 * 64] };
        let (_, _, num) = sample([low + 1, low, low], [0, 33 * 64]);
        assert_eq!(num.abs(), bound(&formats, "fan_num"));
        assert_eq!(1 << 18, bound(&formats, "fan_den"));
        let (ray, scale) = expand(&formats, &bundle, 63);
        // From corner to corner: -S along each axis, S = 2^(F+1) - 1 rounded to D bits.
        assert_eq!(wide(high) - wide(low), bound(&formats, "target_direction"));
        let d = formats.dir_frac_bits;
        let (word, log2) = if f < d { (((1 << (f + 1)) - 1) << (d - f - 1), 1) } else { (1 << (d - 1), 2) };
        assert_eq!((ray.dir, scale), ([-word; 3], log2));
        assert_eq!(i128::from(ray.t_max), bound(&formats, "t") >> (2 - log2));
        let target = BundleWords::Targets { apex: corner(high), points: vec![corner(low)] };
        assert_eq!(expand(&formats, &target, 0), (ray, scale));

        let bundle = BundleWords::Fan {
            apex: corner(low),
            vertices: [corner(low), corner(high), corner(low)],
            n: 64,
            m: 1,
            jitter: [4095, 4095],
        };
        let (first, second, num) = sample([low, high, low], [4095, 4095]);
        assert_eq!((first, second), (bound(&formats, "fan_product"), 0));
        assert!(num.abs() < bound(&formats, "fan_num"));
        expand(&formats, &bundle, 63);
        // A last place of 2^12 n - 1 times m is most for m = 1.
        for n in 1..=64_i128 {
            let m = 64 / n;
            assert!((4096 * n - 1) * m * (wide(high) - wide(low)) <= bound(&formats, "fan_product"));
        }
    }
}

#[test]
fn hemisphere_wires_at_the_extremes_stay_in_and_come_near_their_bounds() {
    for formats in all_formats() {
        let d = formats.dir_frac_bits;
        let one = 1_i32 << d;
        assert_eq!(i128::from(one), bound(&formats, "hemisphere_word"));
        // The middle of the table is the normal, 2^D, times a frame word of 2^D.
        let frame = [[0; 3], [0; 3], [one, 0, -one]];
        let (ray, scale) = expand(
            &formats,
            &BundleWords::Hemisphere { apex: [0; 3], frame, n: 1, m: 1, jitter: [32; 2] },
            0,
        );
        assert_eq!((ray.dir, scale), ([one / 2, 0, -one / 2], 1));
        assert_eq!(1 << (2 * d), bound(&formats, "hemisphere_product"));
        let most = bound(&formats, "hemisphere_direction") as f64 / f64::from(2 * d).exp2();
        let mut largest = 0.0_f64;
        for signs in 0..4 {
            let signed = |axis: u32| if signs >> axis & 1 == 0 { one } else { -one };
            let frame = [[signed(0); 3], [signed(1); 3], [one; 3]];
            let bundle = BundleWords::Hemisphere { apex: [0; 3], frame, n: 8, m: 8, jitter: [32; 2] };
            for i in 0..64 {
                let Ok(()) = bundle.validate(&formats) else { continue };
                let (ray, scale) = bundle.scaled_ray(&formats, i);
                let length = f64::from(ray.dir[0].abs()) / f64::from(one) * f64::from(scale).exp2();
                largest = largest.max(length);
            }
        }
        assert!(largest > 0.98 * most && largest < most, "{largest} of {most} at D = {d}");
    }
}

#[test]
fn cell_wires_at_the_extremes_reach_their_bounds() {
    for formats in all_formats() {
        let (f, d) = (formats.coord_frac_bits, formats.dir_frac_bits);
        let most = (1_i32 << d) - 1;
        let whole = Grid { log2_cells: 0 };
        // From the lowest corner through the whole cube, two axes at full speed: the second comparison's product.
        let ray = RayWords { origin: [-(1 << f); 3], dir: [most; 3], t_max: formats.t_limit() };
        let crossing = whole.crossing(&formats, &ray, Cell([0; 3]));
        assert_eq!(i128::from(crossing.num), bound(&formats, "cell_num"));
        assert_eq!(i128::from(crossing.den), bound(&formats, "cell_den"));
        assert_eq!(
            i128::from(crossing.num) * i128::from(crossing.den),
            bound(&formats, "cell_product"),
            "of one axis with the other's speed"
        );
        assert_eq!(
            i128::from(ray.origin[0]) + i128::from(crossing.num),
            bound(&formats, "cell_plane"),
            "the far face"
        );
        let (up, down) = formats.t_shifts();
        assert_eq!(i128::from(crossing.num) << up, bound(&formats, "cell_num_shifted"));
        let longest = (2 * i128::from(formats.t_limit()) + 1) * (i128::from(crossing.den) << down);
        assert_eq!(longest, bound(&formats, "end_product"));
        for rounding in [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor] {
            // The whole cube is crossed at t just over 2 (2^D / (2^D - 1)), before 4.
            let formats = Formats { rounding, ..formats };
            assert!(!ends_before(&formats, formats.t_limit(), &crossing));
            assert!(ends_before(&formats, formats.t_limit() / 2 - 1, &crossing));
        }
    }
}
