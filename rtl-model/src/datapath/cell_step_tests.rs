//! Tests of the cell step: exact rational references, and the termination rule against a real division.

use std::cell::Cell as Counter;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::*;
use crate::datapath::test_support::{coordinate, direction, formats, ray, widths};

fn walk(formats: &Formats, grid: &Grid, ray: &RayWords) -> Vec<(Cell, Crossing)> {
    let mut path = Vec::new();
    let mut here = Some(grid.cell_of(formats, ray.origin));
    while let Some(cell) = here {
        let crossing = grid.crossing(formats, ray, cell);
        path.push((cell, crossing));
        here = crossing.next;
        assert!(path.len() <= 3 << grid.log2_cells, "the walk doesn't end");
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

/// t as a fraction, denominator > 0.
type T = (i128, i128);

fn order(a: T, b: T) -> std::cmp::Ordering {
    (a.0 * b.1).cmp(&(b.0 * a.1))
}

/// Every t > 0 at which the ray crosses a plane of the grid, up to the cube's face where it leaves: rising, each once.
fn plane_times(formats: &Formats, grid: &Grid, ray: &RayWords) -> Vec<T> {
    let cube = 1_i128 << formats.coord_frac_bits;
    let mut all = Vec::new();
    let mut end: Option<T> = None;
    for axis in 0..3 {
        let (o, d) = (i128::from(ray.origin[axis]), i128::from(ray.dir[axis]));
        let planes = (0..=1_i128 << grid.log2_cells).map(|k| (k << grid.cell_log2(formats)) - cube);
        all.extend(planes.map(|p| ((p - o) * d.signum(), d.abs())).filter(|t| t.0 > 0 && t.1 > 0));
        if d != 0 {
            let face = (if d > 0 { cube - o } else { cube + o }, d.abs());
            end = Some(end.map_or(face, |end| if order(face, end).is_lt() { face } else { end }));
        }
    }
    let end = end.expect("a direction");
    all.retain(|t| order(*t, end).is_le());
    all.sort_by(|a, b| order(*a, *b));
    all.dedup_by(|a, b| order(*a, *b).is_eq());
    all
}

/// The cells that hold a piece of the ray, in order: the half-open cells of the middles between crossings.
fn reference_cells(formats: &Formats, grid: &Grid, ray: &RayWords) -> Vec<Cell> {
    let cube = 1_i128 << formats.coord_frac_bits;
    let mut cells = Vec::new();
    let mut before: T = (0, 1);
    for after in plane_times(formats, grid, ray) {
        // The middle is (n1 d2 + n2 d1) / (2 d1 d2): exact, under 2^90.
        let (num, den) = (before.0 * after.1 + after.0 * before.1, 2 * before.1 * after.1);
        cells.push(Cell([0, 1, 2].map(|axis| {
            let at = (i128::from(ray.origin[axis]) + cube) * den + i128::from(ray.dir[axis]) * num;
            u8::try_from(at.div_euclid(den << grid.cell_log2(formats))).expect("in the cube")
        })));
        before = after;
    }
    cells
}

/// How often the cases that matter came up.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    rays: usize,
    /// Steps at the same t as the one before: through an edge or a corner of a cell.
    ties: usize,
    /// Steps at t = 0: from a plane backwards.
    at_once: usize,
    /// Rays with a component 0 that lie in a plane of the grid.
    in_planes: usize,
}

/// Everything that must hold of a walk.
fn check_walk(formats: &Formats, grid: &Grid, ray: &RayWords, seen: &mut Seen) -> Result<(), TestCaseError> {
    let path = walk(formats, grid, ray);
    seen.rays += 1;
    // Cells in which the ray has a length, against the reference: none is missing, none is too many, same order.
    let mut long_cells = Vec::new();
    let (mut before, mut axis_before): (T, Option<usize>) = ((0, 1), None);
    for (step, (cell, crossing)) in path.iter().enumerate() {
        let at: T = (i128::from(crossing.num), i128::from(crossing.den));
        prop_assert!(order(before, at).is_le(), "t falls at step {}", step);
        if order(before, at).is_lt() {
            long_cells.push(*cell);
            axis_before = None;
        }
        if let Some(next) = crossing.next {
            // A step to a neighbour across one face, in the direction's sense.
            let axis = (0..3).find(|k| next.0[*k] != cell.0[*k]).expect("another cell");
            for k in 0..3 {
                let sense = if k == axis { ray.dir[k].signum() } else { 0 };
                prop_assert_eq!(i32::from(next.0[k]) - i32::from(cell.0[k]), sense, "step {}", step);
            }
            // Across the plane whose distance was given.
            let (low, high) = slab(formats, grid, *cell, axis);
            let plane = if ray.dir[axis] > 0 { high } else { low };
            prop_assert_eq!(at.0, (plane - i128::from(ray.origin[axis])).abs());
            prop_assert_eq!(at.1, i128::from(ray.dir[axis]).abs());
            // Ties in axis order.
            prop_assert!(axis_before.is_none_or(|other| other < axis), "tie at step {}", step);
            seen.ties += usize::from(axis_before.is_some());
            axis_before = Some(axis);
        }
        seen.at_once += usize::from(at.0 == 0);
        before = at;
    }
    prop_assert_eq!(&long_cells, &reference_cells(formats, grid, ray));
    let at_face = (0..3).any(|axis| {
        let at = i128::from(ray.origin[axis]) * before.1 + i128::from(ray.dir[axis]) * before.0;
        at.abs() == before.1 << formats.coord_frac_bits
    });
    prop_assert!(at_face, "the walk ends inside the cube");
    let cell_mask = (1_i32 << grid.cell_log2(formats)) - 1;
    let on_plane = |k: usize| ray.dir[k] == 0 && ray.origin[k] & cell_mask == 0;
    seen.in_planes += usize::from((0..3).any(on_plane));
    Ok(())
}

/// Rays of every width and grid: origins on planes of the grid, on the cube's faces and anywhere; through edges and
/// corners of cells (a whole multiple of a short direction away from one), along planes, with components 0, +-1 and
/// extreme.
fn grid_ray() -> impl Strategy<Value = (Formats, Grid, RayWords)> {
    let width = || prop_oneof![1 => Just(8_u32), 1 => Just(28_u32), 2 => 8_u32..=28];
    (width(), width(), 0_u32..=7).prop_flat_map(|(f, d, g)| {
        let one = 1_i32 << f;
        let on_plane = (0_i32..=1 << g).prop_map(move |k| ((k << (f + 1 - g)) - one).min(one - 1));
        let place =
            prop_oneof![2 => on_plane.clone(), 1 => coordinate(f), 1 => Just(-one), 1 => Just(one - 1)];
        let free = ([place.clone(), place.clone(), place], direction(d));
        // d = short 2^k, o = corner - m short: through the corner exactly.
        let short = [-3_i32..=3, -3_i32..=3, -3_i32..=3].prop_filter("a direction", |s| *s != [0; 3]);
        let through = ([on_plane.clone(), on_plane.clone(), on_plane], short, 0_i32..one).prop_map(
            move |(corner, short, times)| {
                let reach = |k: usize| match short[k] {
                    0 => i32::MAX,
                    s if s > 0 => (corner[k] + one) / s,
                    s => (one - 1 - corner[k]) / -s,
                };
                let times = times.min(reach(0)).min(reach(1)).min(reach(2));
                let most = short.iter().map(|w| w.unsigned_abs()).max().unwrap_or(1);
                let shift = d - (u32::BITS - most.leading_zeros());
                ([0, 1, 2].map(|k| corner[k] - times * short[k]), short.map(|w| w << shift))
            },
        );
        let words = prop_oneof![free, through];
        words.prop_map(move |(origin, dir)| {
            let formats = formats(f, d, 8);
            (formats, Grid { log2_cells: g }, RayWords { origin, dir, t_max: formats.t_limit() })
        })
    })
}

#[test]
fn walk_any_ray_at_any_width_and_grid_is_the_exact_sequence_of_cells() {
    let seen = Counter::new(Seen::default());
    let config = ProptestConfig { cases: 100_000, failure_persistence: None, ..ProptestConfig::default() };
    let outcome = TestRunner::new(config).run(&grid_ray(), |(formats, grid, ray)| {
        ray.validate(&formats).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let mut here = seen.get();
        let outcome = check_walk(&formats, &grid, &ray, &mut here);
        seen.set(here);
        outcome
    });
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
    let seen = seen.get();
    assert!(seen.rays >= 100_000 && seen.ties > 100_000, "{seen:?}");
    assert!(seen.at_once > 10_000 && seen.in_planes > 10_000, "{seen:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn walk_over_coarse_grids_skips_no_cell_of_all(
        (formats, ray, g) in widths().prop_flat_map(|(f, d, t)| (Just(formats(f, d, t)), ray(f, d, t), 0_u32..=3))
    ) {
        // Another reference: every cell of the grid, by its slabs.
        let grid = Grid { log2_cells: g };
        let path = walk(&formats, &grid, &ray);
        let last = (1_usize << g) - 1;
        for n in 0..grid.n_cells() {
            let cell = Cell([n & last, n >> g & last, n >> (2 * g)].map(|w| u8::try_from(w).unwrap()));
            if passes_inside(&formats, &grid, &ray, cell) {
                prop_assert!(path.iter().any(|(c, _)| *c == cell), "skipped {:?}", cell);
            }
        }
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

#[test]
fn crossing_of_a_ray_at_rest_or_of_a_cell_never_entered_is_no_panic() {
    let formats = formats(8, 8, 8);
    let grid = Grid { log2_cells: 2 };
    let at_rest = RayWords { origin: [5; 3], dir: [0; 3], t_max: 0 };
    for cell in [Cell([2; 3]), Cell([0; 3]), Cell([3; 3])] {
        let never = Crossing { num: 1, den: 1, next: None };
        assert_eq!(grid.crossing(&formats, &at_rest, cell), never);
    }
    // The cell lies behind the ray: it is left at once.
    let ray = RayWords { origin: [200, 5, 5], dir: [255, 0, 0], t_max: 0 };
    let behind = Crossing { num: 0, den: 255, next: Some(Cell([1, 2, 2])) };
    assert_eq!(grid.crossing(&formats, &ray, Cell([0, 2, 2])), behind);
    let ray = RayWords { origin: [-200, 5, 5], dir: [-255, 0, 0], ..ray };
    let behind = Crossing { num: 0, den: 255, next: Some(Cell([2, 2, 2])) };
    assert_eq!(grid.crossing(&formats, &ray, Cell([3, 2, 2])), behind);
}

#[test]
fn crossing_widest_words_at_the_finest_grid_are_exact() {
    let formats = formats(28, 28, 32);
    let grid = Grid { log2_cells: 7 };
    let (low, most) = (-(1_i32 << 28), (1_i32 << 28) - 1);
    let ray = RayWords { origin: [low; 3], dir: [most, most - 1, 1], t_max: formats.t_limit() };
    // The whole cube along x, in one cell of a grid of one; a 128th of it in the finest.
    let next = Some(Cell([1, 0, 0]));
    let crossing = Crossing { num: 1 << 22, den: (1 << 28) - 1, next };
    assert_eq!(grid.crossing(&formats, &ray, Cell([0; 3])), crossing);
    let whole = Grid { log2_cells: 0 };
    let crossing = Crossing { num: 1 << 29, den: (1 << 28) - 1, next: None };
    assert_eq!(whole.crossing(&formats, &ray, Cell([0; 3])), crossing);
    // From the upper corner downward: 2^29 - 1 steps to the face.
    let down = RayWords { origin: [most; 3], dir: [-1, -most, -most], ..ray };
    let crossing = Crossing { num: (1 << 29) - 1, den: (1 << 28) - 1, next: None };
    assert_eq!(whole.crossing(&formats, &down, Cell([0; 3])), crossing);
}

#[test]
fn neighbour_at_every_border_is_none_and_inside_is_the_next() {
    let grid = Grid { log2_cells: 3 };
    for axis in 0..3 {
        for place in 0..8_u8 {
            let mut cell = Cell([4, 2, 5]);
            cell.0[axis] = place;
            let moved = |place: u8| {
                let mut next = cell;
                next.0[axis] = place;
                Some(next)
            };
            let (down, up) = (place.checked_sub(1), Some(place + 1).filter(|next| *next < 8));
            for length in [1, 77, i32::MAX] {
                assert_eq!(grid.neighbour(cell, axis, length), up.and_then(moved), "{cell:?} up {axis}");
                assert_eq!(grid.neighbour(cell, axis, -length), down.and_then(moved), "{cell:?} down {axis}");
            }
            assert_eq!(grid.neighbour(cell, axis, 0), None);
        }
    }
    let whole = Grid { log2_cells: 0 };
    assert_eq!(whole.neighbour(Cell([0; 3]), 1, 1), None);
    assert_eq!(whole.neighbour(Cell([0; 3]), 1, -1), None);
}

#[test]
fn index_of_every_cell_interleaves_its_bits_and_is_unique() {
    let finest = Grid { log2_cells: 7 };
    let mut seen = vec![false; finest.n_cells()];
    assert_eq!(seen.len(), 1 << 21);
    for n in 0..seen.len() {
        // De-interleaved bit by bit: bit 3 i + k of the index is bit i of the place along k.
        let mut places = [0_u8; 3];
        for bit in 0..21 {
            places[bit % 3] |= u8::from(n >> bit & 1 == 1) << (bit / 3);
        }
        let index = finest.index(Cell(places));
        assert_eq!(index, n, "{places:?}");
        assert!(!std::mem::replace(&mut seen[index], true));
    }
    // The same in every grid, and bits above the seventh don't count.
    assert_eq!(Grid { log2_cells: 2 }.index(Cell([3, 0, 1])), 0b001_101);
    assert_eq!(finest.index(Cell([0x80, 0x81, 0])), 0b010);
    assert_eq!([0, 1, 3].map(|g| Grid { log2_cells: g }.n_cells()), [1, 8, 512]);
}
