//! Rays' words at both ends of every range, and the order of hits.

use rtl_model::datapath::{Facing, HitWords, RayError, RayWords};
use rtl_model::fixed::Formats;

const FORMATS: [(u32, u32, u32); 4] = [(8, 10, 12), (12, 8, 32), (24, 24, 24), (28, 28, 32)];

fn formats((f, d, t): (u32, u32, u32)) -> Formats {
    Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() }
}

/// A valid ray with one word changed.
fn with(change: impl FnOnce(&mut RayWords)) -> RayWords {
    let mut ray = RayWords { origin: [0; 3], dir: [0, 0, 1], t_max: 0 };
    change(&mut ray);
    ray
}

#[test]
fn validate_words_at_both_ends_of_their_ranges_pass() {
    for widths in FORMATS {
        let formats = formats(widths);
        let (cube, unit) = (1 << widths.0, 1 << widths.1);
        for axis in 0..3 {
            for ray in [
                with(|ray| ray.origin[axis] = -cube),
                with(|ray| ray.origin[axis] = cube - 1),
                with(|ray| ray.dir[axis] = 1 - unit),
                with(|ray| ray.dir[axis] = unit - 1),
                with(|ray| ray.t_max = 4 << widths.2),
                with(|ray| (ray.dir = [0; 3], ray.dir[axis] = -1).0),
            ] {
                assert_eq!(ray.validate(&formats), Ok(()), "{ray:?} at {formats:?}");
            }
        }
    }
}

#[test]
fn validate_words_one_step_outside_are_named_with_their_range() {
    for widths in FORMATS {
        let formats = formats(widths);
        let (cube, unit) = (1_i32 << widths.0, 1_i32 << widths.1);
        for axis in 0..3 {
            for word in [-cube - 1, cube] {
                let (min, max) = (i64::from(-cube), i64::from(cube - 1));
                let fault = RayError::Word { field: "origin", value: i128::from(word), min, max };
                assert_eq!(with(|ray| ray.origin[axis] = word).validate(&formats), Err(fault));
            }
            for word in [-unit, unit] {
                let (min, max) = (i64::from(1 - unit), i64::from(unit - 1));
                let fault = RayError::Word { field: "dir", value: i128::from(word), min, max };
                assert_eq!(with(|ray| ray.dir[axis] = word).validate(&formats), Err(fault));
            }
        }
        assert_eq!(with(|ray| ray.dir = [0; 3]).validate(&formats), Err(RayError::NoDirection));
        let limit = 4_i64 << widths.2;
        let fault = RayError::Word { field: "t_max", value: i128::from(limit) + 1, min: 0, max: limit };
        assert_eq!(with(|ray| ray.t_max = limit.cast_unsigned() + 1).validate(&formats), Err(fault));
    }
}

#[test]
fn nearer_orders_by_t_then_patch_and_keeps_the_first_of_equals() {
    let hit = |t, patch, facing| Some(HitWords { t, patch, facing });
    let near = hit(5, 9, Facing::Front);
    for (other, nearer) in [
        (hit(6, 1, Facing::Back), near),
        (hit(4, 10, Facing::Back), hit(4, 10, Facing::Back)),
        (hit(5, 10, Facing::Back), near),
        (hit(5, 8, Facing::Back), hit(5, 8, Facing::Back)),
        (None, near),
    ] {
        assert_eq!(HitWords::nearer(near, other), nearer);
        assert_eq!(HitWords::nearer(other, near), nearer);
    }
    assert_eq!(HitWords::nearer(None, None), None);
    // The two triangles of a bent quad, met at one distance from both sides.
    let back = hit(5, 9, Facing::Back);
    assert_eq!(HitWords::nearer(near, back), near);
    assert_eq!(HitWords::nearer(back, near), back);
}
