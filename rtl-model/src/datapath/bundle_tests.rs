//! Tests of the bundle expansion: closed forms, bounds of the rounding, refusals.

use proptest::prelude::*;

use super::*;
use crate::datapath::test_support::{formats, point, widths};

/// Every property that a direction and its scale must have, given the exact raw direction.
fn check_normalised(formats: &Formats, raw: [i64; 3], frac_bits: u32, ray: &RayWords, scale: i32) {
    let d = formats.dir_frac_bits;
    let largest = ray.dir.iter().map(|w| w.unsigned_abs()).max().unwrap();
    assert!(largest >= 1 << (d - 1) && largest < 1 << d, "{raw:?} gives {:?}", ray.dir);
    // dir = raw 2^-right to nearest, ties to even, with right = frac_bits + scale - D.
    let right = i64::from(frac_bits) + i64::from(scale) - i64::from(d);
    for (word, exact) in ray.dir.iter().zip(raw) {
        let (left, right) = (u32::try_from((-right).max(0)).unwrap(), u32::try_from(right.max(0)).unwrap());
        let exact = i128::from(exact) << left;
        let miss = 2 * (exact - (i128::from(*word) << right)).abs();
        assert!(miss <= 1 << right, "{raw:?} gives {:?}", ray.dir);
        assert!(miss < 1 << right || right == 0 || word % 2 == 0, "tie to an odd word");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn tile_any_valid_descriptor_is_the_rounded_sum(
        (formats, apex, corner, step_u, step_v) in widths().prop_flat_map(|(f, d, t)| {
            let (one, step) = (1_i64 << (d + 8), 1_i64 << (d + 4));
            (
                Just(formats(f, d, t)),
                point(f),
                [-one..=one, -one..=one, -one..=one],
                [-step..=step, -step..=step, -step..=step],
                [-step..=step, -step..=step, -step..=step],
            )
        }),
        shrink in 0_u32..16,
        (n, m) in (1_u32..=8, 1_u32..=8),
    ) {
        let corner = corner.map(|w| w >> shrink);
        let bundle = BundleWords::Tile { apex, corner, step_u, step_v, n, m };
        prop_assume!(bundle.validate(&formats).is_ok());
        for i in 0..bundle.n_rays() {
            let (u, v) = (i as i64 % i64::from(n), i as i64 / i64::from(n));
            let raw = [0, 1, 2].map(|k| corner[k] + u * step_u[k] + v * step_v[k]);
            let (ray, scale) = bundle.scaled_ray(&formats, i);
            check_normalised(&formats, raw, formats.dir_frac_bits + 8, &ray, scale);
            prop_assert_eq!((ray.origin, ray.t_max), (apex, formats.t_limit()));
        }
    }

    #[test]
    fn targets_and_fan_end_at_their_points(
        (formats, apex, vertices) in widths()
            .prop_flat_map(|(f, d, t)| (Just(formats(f, d, t)), point(f), [point(f), point(f), point(f)])),
        (n, m) in (1_u32..=9, 1_u32..=7),
        jitter in [0_u32..4096, 0_u32..4096],
    ) {
        let fan = BundleWords::Fan { apex, vertices, n, m, jitter };
        let mut points = Vec::new();
        for i in 0..fan.n_rays() as i64 {
            let (u, v) = (i % i64::from(n), i / i64::from(n));
            points.push([0, 1, 2].map(|k| {
                // Independent of the datapath: search the nearest word of an f64 estimate by exact comparison.
                let [v0, v1, v2] = vertices.map(|p| i128::from(p[k]));
                let den = 4096 * i128::from(n) * i128::from(m);
                let a = i128::from(u * 4096 + i64::from(jitter[0])) * (v1 - v0) * i128::from(m);
                let b = i128::from(v * 4096 + i64::from(jitter[1])) * (v2 - v0) * i128::from(n);
                let num = v0 * den + a + b;
                let miss = |w: i128| ((w * den - num).abs(), w.rem_euclid(2));
                let near = num / den;
                let best = (near - 2..=near + 2).min_by_key(|w| miss(*w)).unwrap();
                i32::try_from(best).unwrap()
            }));
        }
        let limit = 1_i32 << formats.coord_frac_bits;
        prop_assume!(points.iter().all(|p| p != &apex && p.iter().all(|w| (-limit..limit).contains(w))));
        let targets = BundleWords::Targets { apex, points: points.clone() };
        prop_assert_eq!(fan.validate(&formats), Ok(()));
        prop_assert_eq!(targets.validate(&formats), Ok(()));
        for (i, point) in points.iter().enumerate() {
            let (ray, scale) = targets.scaled_ray(&formats, i);
            prop_assert_eq!(&fan.scaled_ray(&formats, i), &(ray, scale));
            let raw = [0, 1, 2].map(|k| i64::from(point[k]) - i64::from(apex[k]));
            check_normalised(&formats, raw, formats.coord_frac_bits, &ray, scale);
            // The point lies at t = 2^scale; below one step of t the ray still has one step.
            let exact = f64::from(formats.t_frac_bits as i32 + scale).exp2();
            prop_assert_eq!(ray.t_max as f64, exact.max(1.0).floor());
            prop_assert!(ray.t_max <= formats.t_limit());
        }
    }
}

#[test]
fn tile_direction_that_rounds_to_one_halves_the_scale() {
    let formats = formats(8, 8, 8);
    let tile =
        |corner| BundleWords::Tile { apex: [0; 3], corner, step_u: [0; 3], step_v: [0; 3], n: 1, m: 1 };
    let one = 1_i64 << 16;
    // 1 - 2^-16 in 8 fraction bits is 1.0: not a word, so 1/2 with the scale doubled.
    assert_eq!(tile([one - 1, 0, 256]).scaled_ray(&formats, 0).0.dir, [128, 0, 0]);
    assert_eq!(tile([one - 1, 0, 256]).scaled_ray(&formats, 0).1, 1);
    assert_eq!(
        tile([one - 129, 0, 256]).scaled_ray(&formats, 0),
        (RayWords { origin: [0; 3], dir: [255, 0, 1], t_max: 1024 }, 0)
    );
    // Small directions keep their guard bits: 257 = 2^8 + 1 becomes 2^7 + 1/2, to even 128.
    assert_eq!(tile([257, -3, 0]).scaled_ray(&formats, 0).0.dir, [128, -2, 0]);
    assert_eq!(tile([257, -3, 0]).scaled_ray(&formats, 0).1, -7);
}

#[test]
fn fan_one_stratum_without_jitter_ends_at_the_first_vertex() {
    let formats = Formats::default();
    let quarter = 1 << 22;
    let vertices = [[0, 0, quarter], [quarter, 0, quarter], [0, quarter, quarter]];
    let fan = BundleWords::Fan { apex: [0; 3], vertices, n: 1, m: 1, jitter: [0; 2] };
    // 1/4 away along z: direction 1/2, t = 1/2.
    let ray = RayWords { origin: [0; 3], dir: [0, 0, 1 << 23], t_max: 1 << 23 };
    assert_eq!(fan.scaled_ray(&formats, 0), (ray, -1));
}

#[test]
fn hemisphere_eight_by_eight_points_at_the_stratum_centres() {
    let formats = Formats::default();
    let one = 1 << 24;
    // Normal -y: a frame that the table is turned into.
    let frame = [[0, 0, one], [one, 0, 0], [0, -one, 0]];
    let bundle = BundleWords::Hemisphere { apex: [1, 2, 3], frame, n: 8, m: 8, jitter: [32; 2] };
    assert_eq!(bundle.validate(&formats), Ok(()));
    for i in 0..64 {
        let (ray, scale) = bundle.scaled_ray(&formats, i);
        let dir = ray.dir.map(|w| f64::from(w) / f64::from(one) * f64::from(scale).exp2());
        let centre = |place: usize| (place as f64 + 0.5) / 8.0;
        let [x, y, z] = hemisphere::cosine_direction(centre(i % 8), centre(i / 8));
        for (word, exact) in dir.iter().zip([y, -z, x]) {
            assert!((word - exact).abs() < 1e-6, "ray {i}: {dir:?}");
        }
        assert_eq!((ray.origin, ray.t_max), ([1, 2, 3], formats.t_limit()));
    }
}

#[test]
fn hemisphere_eight_by_eight_with_jitter_points_at_its_place_in_every_stratum() {
    let formats = Formats::default();
    let one = 1 << 24;
    let frame = [[one, 0, 0], [0, one, 0], [0, 0, one]];
    // 3/8 and 1/8 along a stratum, up to its next eighth: places of the table.
    for jitter in [[24, 8], [31, 15]] {
        let bundle = BundleWords::Hemisphere { apex: [0; 3], frame, n: 8, m: 8, jitter };
        for i in 0..64 {
            let (ray, scale) = bundle.scaled_ray(&formats, i);
            let (u, v) = ((i % 8) as f64 + 0.375, (i / 8) as f64 + 0.125);
            let exact = hemisphere::cosine_direction(u / 8.0, v / 8.0);
            for (word, exact) in ray.dir.iter().zip(exact) {
                let word = f64::from(*word) / f64::from(one) * f64::from(scale).exp2();
                assert!((word - exact).abs() < 1e-6, "ray {i}: {:?}", ray.dir);
            }
        }
    }
}

#[test]
fn validate_each_fault_is_named() {
    let formats = formats(8, 8, 8);
    let (apex, step) = ([0; 3], [0; 3]);
    let tile = |corner, n, m| BundleWords::Tile { apex, corner, step_u: step, step_v: step, n, m };
    assert_eq!(tile([256; 3], 8, 8).validate(&formats), Ok(()));
    assert_eq!(tile([256; 3], 8, 9).validate(&formats), Err(BundleError::Size(72)));
    assert_eq!(tile([256; 3], 0, 8).validate(&formats), Err(BundleError::Size(0)));
    assert!(matches!(tile([1; 3], u32::MAX, 2).validate(&formats), Err(BundleError::Size(_))));
    let zero = BundleError::Direction { ray: 0, dir: [0; 3] };
    assert_eq!(tile([0; 3], 1, 1).validate(&formats), Err(zero.clone()));
    let word = |field, value, min, max| Err(BundleError::Word { field, value, min, max });
    assert_eq!(tile([1 << 17, 0, 0], 1, 1).validate(&formats), word("corner", 1 << 17, -131_071, 131_071));
    // A tile's sum may take its largest word, and no more.
    let sum = |step: i64| BundleWords::Tile {
        apex,
        corner: [-131_071, 1, 0],
        step_u: [step, 0, 0],
        step_v: [0; 3],
        n: 3,
        m: 1,
    };
    assert_eq!(sum(131_071).validate(&formats), Ok(()));
    let tall = |step: i64| BundleWords::Tile {
        apex,
        corner: [1, 131_070, 0],
        step_u: [0, step, 0],
        step_v: [0; 3],
        n: 2,
        m: 1,
    };
    assert_eq!(tall(1).validate(&formats), Ok(()));
    let long = |ray, y| Err(BundleError::Direction { ray, dir: [1, y, 0] });
    assert_eq!(tall(2).validate(&formats), long(1, 131_072));
    assert_eq!(tall(1000).validate(&formats), long(1, 132_070));
    let points = vec![[5, 5, 256]];
    assert_eq!(BundleWords::Targets { apex, points }.validate(&formats), word("point", 256, -256, 255));
    let none = BundleWords::Targets { apex, points: Vec::new() };
    assert_eq!(none.validate(&formats), Err(BundleError::Size(0)));
    let here = BundleWords::Targets { apex, points: vec![apex] };
    assert_eq!(here.validate(&formats), Err(zero.clone()));
    let fan =
        |v1, jitter| BundleWords::Fan { apex, vertices: [[200; 3], v1, [200, 255, 200]], n: 4, m: 4, jitter };
    assert_eq!(fan([255, 200, 200], [0; 2]).validate(&formats), Ok(()));
    assert_eq!(fan([255, 200, 200], [4096, 0]).validate(&formats), word("jitter", 4096, 0, 4095));
    // The fourth corner lies outside the cube.
    assert!(matches!(fan([255, 250, 200], [4095; 2]).validate(&formats), Err(BundleError::Direction { .. })));
    let frame = [[0; 3]; 3];
    let hemisphere = |frame, jitter| BundleWords::Hemisphere { apex, frame, n: 1, m: 1, jitter };
    assert_eq!(hemisphere(frame, [32; 2]).validate(&formats), Err(zero));
    assert_eq!(hemisphere([[1; 3]; 3], [63, 64]).validate(&formats), word("jitter", 64, 0, 63));
}

#[path = "bundle_oracle_tests.rs"]
mod oracle;
