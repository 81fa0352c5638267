//! Tests of the cell step: exact rational references, and the termination rule against a real division.

use proptest::prelude::*;

use super::*;
use crate::datapath::test_support::{formats, ray, widths};

fn walk(formats: &Formats, grid: &Grid, ray: &RayWords) -> Vec<(Cell, Crossing)> {
    let mut path = Vec::new();
    let mut here = Some(grid.cell_of(formats, ray.origin));
    while let Some(cell) = here {
        let crossing = grid.crossing(formats, ray, cell);
        path.push((cell, crossing));
        here = crossing.next;
    }
    path
}

/// The closed box of a cell along an axis, coordinate words.
fn slab(formats: &Formats, grid: &Grid, cell: Cell, axis: usize) -> (i128, i128) {
    let side = 1_i128 << grid.cell_log2(formats);
    let low = i128::from(cell.0[axis]) * side - (1 << formats.coord_frac_bits);
    (low, low + side)
}

/// Does the ray run through the open inside of the cell? Slabs as fractions, compared by cross-multiplying.
fn passes_inside(formats: &Formats, grid: &Grid, ray: &RayWords, cell: Cell) -> bool {
    let (mut enter, mut leave) = ((0_i128, 1_i128), (1_i128, 0_i128));
    for axis in 0..3 {
        let (low, high) = slab(formats, grid, cell, axis);
        let (o, d) = (i128::from(ray.origin[axis]), i128::from(ray.dir[axis]));
        if d == 0 {
            if o <= low || o >= high {
                return false;
            }
            continue;
        }
        let (near, far) = if d > 0 { (low - o, high - o) } else { (o - high, o - low) };
        if near * enter.1 > enter.0 * d.abs() {
            enter = (near, d.abs());
        }
        if far * leave.1 < leave.0 * d.abs() {
            leave = (far, d.abs());
        }
    }
    enter.0 * leave.1 < leave.0 * enter.1
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn walk_any_ray_is_unbroken_and_skips_no_cell(
        (formats, ray, g) in widths().prop_flat_map(|(f, d, t)| (Just(formats(f, d, t)), ray(f, d, t), 1_u32..=3))
    ) {
        let grid = Grid { log2_cells: g };
        let path = walk(&formats, &grid, &ray);
        prop_assert!(path.len() <= 3 << g);
        for (step, (cell, crossing)) in path.iter().enumerate() {
            // The point where the ray leaves lies in this closed cell and in the next one.
            let both = [Some(*cell), crossing.next];
            for cell in both.into_iter().flatten() {
                for axis in 0..3 {
                    let (low, high) = slab(&formats, &grid, cell, axis);
                    let (num, den) = (i128::from(crossing.num), i128::from(crossing.den));
                    let at = i128::from(ray.origin[axis]) * den + i128::from(ray.dir[axis]) * num;
                    prop_assert!(low * den <= at && at <= high * den, "step {} axis {}", step, axis);
                }
            }
            if let Some((_, next)) = path.get(step + 1) {
                prop_assert!(crossing.num * next.den <= next.num * crossing.den, "t falls at step {}", step);
            }
        }
        let last = path.last().unwrap();
        let at_face = (0..3).any(|axis| {
            let edge = i128::from(last.1.den) << formats.coord_frac_bits;
            let at = i128::from(ray.origin[axis]) * i128::from(last.1.den)
                + i128::from(ray.dir[axis]) * i128::from(last.1.num);
            at.abs() == edge
        });
        prop_assert!(at_face, "the walk ends inside the cube");
        let mut inside = 0;
        let side = 1_u8 << g;
        for x in 0..side {
            for y in 0..side {
                for z in 0..side {
                    let cell = Cell([x, y, z]);
                    if passes_inside(&formats, &grid, &ray, cell) {
                        inside += 1;
                        prop_assert!(path.iter().any(|(c, _)| *c == cell), "skipped {:?}", cell);
                    }
                }
            }
        }
        // Only rays inside a cell face, or that start on the cube's face and leave, have none.
        prop_assert!(inside <= path.len());
    }

    #[test]
    fn ends_before_near_every_tie_equals_the_rounded_division(
        (f, d, t) in prop_oneof![widths(), Just((16, 8, 8)), Just((20, 8, 10))],
        num in prop_oneof![0_u64..600, 0_u64..1 << 29],
        den in prop_oneof![1_u64..64, 1_u64..1 << 28],
        off in -2_i64..=2,
        mode in 0_usize..3,
    ) {
        let rounding = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor][mode];
        let formats = Formats { rounding, ..formats(f, d, t) };
        let (up, down) = formats.t_shifts();
        let far = rounding.divide(i128::from(num) << up, i128::from(den) << down);
        let best = u64::try_from((far + i128::from(off)).max(0)).unwrap_or(u64::MAX);
        let crossing = Crossing { num, den, next: None };
        prop_assert_eq!(ends_before(&formats, best, &crossing), i128::from(best) < far);
    }
}

#[test]
fn ends_before_every_small_fraction_equals_the_rounded_division() {
    let mut ends = 0;
    // T + D - F = 0, -4 and 8: numerator and denominator as they are, denominator shifted, numerator shifted.
    for (f, d, t) in [(16, 8, 8), (20, 8, 8), (8, 8, 8)] {
        for rounding in [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor] {
            let formats = Formats { rounding, ..formats(f, d, t) };
            let (up, down) = formats.t_shifts();
            for num in 0..80_u64 {
                for den in 1..20_u64 {
                    let far = rounding.divide(i128::from(num) << up, i128::from(den) << down);
                    let near = u64::try_from(far).unwrap();
                    for best in near.saturating_sub(2)..near + 3 {
                        let crossing = Crossing { num, den, next: None };
                        assert_eq!(ends_before(&formats, best, &crossing), best < near, "{num}/{den} {best}");
                        ends += usize::from(best < near);
                    }
                }
            }
        }
    }
    assert!(ends > 5_000, "{ends}");
}

#[test]
fn cell_of_planes_and_corners_is_half_open() {
    let formats = formats(8, 8, 8);
    let grid = Grid { log2_cells: 2 };
    assert_eq!(grid.cell_of(&formats, [-256, -129, -128]), Cell([0, 0, 1]));
    assert_eq!(grid.cell_of(&formats, [-1, 0, 255]), Cell([1, 2, 3]));
    // Outside the cube: the nearest cell.
    assert_eq!(grid.cell_of(&formats, [256, -257, i32::MAX]), Cell([3, 0, 3]));
    let finest = Grid { log2_cells: 7 };
    assert_eq!(finest.cell_of(&formats, [255, -256, 0]), Cell([127, 0, 64]));
}

#[test]
fn crossing_diagonal_ray_takes_axes_in_order() {
    let formats = formats(8, 8, 8);
    let grid = Grid { log2_cells: 1 };
    let ray = RayWords { origin: [-128; 3], dir: [200; 3], t_max: formats.t_limit() };
    let cells: Vec<Cell> = walk(&formats, &grid, &ray).into_iter().map(|(cell, _)| cell).collect();
    assert_eq!(cells, [Cell([0, 0, 0]), Cell([1, 0, 0]), Cell([1, 1, 0]), Cell([1, 1, 1])]);
}

#[test]
fn crossing_from_a_plane_backwards_leaves_at_once() {
    let formats = formats(8, 8, 8);
    let grid = Grid { log2_cells: 1 };
    let ray = RayWords { origin: [0, 5, 5], dir: [-255, 0, 0], t_max: formats.t_limit() };
    let crossing = grid.crossing(&formats, &ray, Cell([1, 1, 1]));
    assert_eq!(crossing, Crossing { num: 0, den: 255, next: Some(Cell([0, 1, 1])) });
}

#[test]
fn advance_limit_at_and_below_the_far_plane_steps_and_ends() {
    let formats = formats(8, 8, 8);
    let grid = Grid { log2_cells: 1 };
    let ray = RayWords { origin: [-128; 3], dir: [255, 0, 0], t_max: formats.t_limit() };
    // Far plane at 128 / 255: t word 128.5, ties to even: 129 (128.502 rounds up).
    assert_eq!(advance(&formats, &grid, &ray, Cell([0; 3]), 129), Some(Cell([1, 0, 0])));
    assert_eq!(advance(&formats, &grid, &ray, Cell([0; 3]), 128), None);
    assert_eq!(advance(&formats, &grid, &ray, Cell([1, 0, 0]), 1024), None);
}
