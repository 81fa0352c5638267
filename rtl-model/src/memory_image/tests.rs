//! Tests of the memory image: layout, round trip, completeness of the lists, choice of the grid.

use proptest::prelude::*;

use super::*;
use crate::datapath::test_support::{formats, numbered, patch, widths};
use crate::packet::patch_bytes;

fn cells(grid: Grid) -> impl Iterator<Item = Cell> {
    let side = 1_u8 << grid.log2_cells;
    (0..side).flat_map(move |z| (0..side).flat_map(move |y| (0..side).map(move |x| Cell([x, y, z]))))
}

fn touches(formats: &Formats, grid: Grid, patch: &PatchWords, cell: Cell) -> bool {
    let side = 1_i64 << grid.cell_log2(formats);
    let corner = cell.0.map(|c| i64::from(c) * side - (1 << formats.coord_frac_bits));
    let [v0, v1, v2, v3] = patch.corners;
    [[v0, v1, v2], [v0, v2, v3]].iter().any(|t| tri_box::TriangleAxes::new(*t).touches(corner, side))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn build_random_patches_lists_exactly_the_closed_cells_and_keeps_every_bit(
        (formats, patches, g) in widths().prop_flat_map(|(f, d, t)| {
            (Just(formats(f, d, t)), prop::collection::vec(patch(f), 0..30), 1_u32..=4)
        })
    ) {
        let patches = numbered(patches);
        let image = MemoryImage::build(&formats, &patches, Some(g));
        prop_assert_eq!(image.grid, Grid { log2_cells: g });
        for base in [image.header_base, image.list_base, image.patch_base] {
            prop_assert_eq!(base % 16, 0);
        }
        prop_assert_eq!(image.n_patches as usize, patches.len());
        prop_assert_eq!(image.words.len(), image.patch_address(image.n_patches) as usize);
        for patch in &patches {
            prop_assert_eq!(&image.patch(patch.id), patch);
            let at = image.patch_address(patch.id) as usize;
            prop_assert_eq!(&unpack_patch(&formats, &image.words[at..]).unwrap(), patch);
        }
        let mut next = image.list_base;
        let mut in_memory_order: Vec<Cell> = cells(image.grid).collect();
        in_memory_order.sort_by_key(|cell| image.grid.index(*cell));
        for cell in in_memory_order {
            let (first, count) = image.cell_list(cell);
            prop_assert_eq!(first, next);
            next += count;
            let list: Vec<u32> = (first..next).map(|address| image.list_entry(address)).collect();
            let expected: Vec<u32> =
                patches.iter().filter(|p| touches(&formats, image.grid, p, cell)).map(|p| p.id).collect();
            prop_assert_eq!(list, expected);
            prop_assert_eq!(image.is_occupied(cell), count > 0);
        }
        prop_assert!(next <= image.patch_base);
    }
}

/// A wavy floor of n x n quads.
fn floor(formats: &Formats, n: i32) -> Vec<PatchWords> {
    let one = f64::from(1_i32 << formats.coord_frac_bits);
    let vertex = |i: i32, j: i32| {
        let (x, y) = (f64::from(2 * i - n) / f64::from(n) * 0.9, f64::from(2 * j - n) / f64::from(n) * 0.9);
        [x, y, 0.3 * (3.0 * x).sin() * (2.0 * y).cos()].map(|w| (w * one) as i32)
    };
    let quad = |i, j| [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
    let corners = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| quad(i, j));
    numbered(corners.map(|corners| PatchWords { corners, is_triangle: false, id: 0 }).collect())
}

/// Expected work of a ray: cells crossed times (a quarter for the step + tests).
fn work(image: &MemoryImage) -> f64 {
    let entries: u32 = cells(image.grid).map(|cell| image.cell_list(cell).1).sum();
    let side = f64::from(1_u32 << image.grid.log2_cells);
    side * (0.25 + f64::from(entries) / side.powi(3))
}

#[test]
fn build_automatic_grid_has_the_least_expected_work() {
    let formats = Formats::default();
    let mut chosen_grids = Vec::new();
    for n in [1, 6, 20, 45] {
        let patches = floor(&formats, n);
        let chosen = MemoryImage::build(&formats, &patches, None);
        let best = (1..=6)
            .map(|g| work(&MemoryImage::build(&formats, &patches, Some(g))))
            .fold(f64::INFINITY, f64::min);
        assert!(work(&chosen) <= best, "n = {n}: {}", chosen.grid.log2_cells);
        assert!(chosen.size_bytes() <= 16 << 20);
        chosen_grids.push(chosen.grid.log2_cells);
    }
    assert!(chosen_grids.is_sorted() && chosen_grids[0] < chosen_grids[3], "{chosen_grids:?}");
}

#[test]
fn build_within_a_small_memory_takes_the_best_grid_that_fits_to_the_byte() {
    let formats = Formats::default();
    let patches = floor(&formats, 20);
    let sizes: Vec<u64> =
        (1..=6).map(|g| MemoryImage::build(&formats, &patches, Some(g)).size_bytes() as u64).collect();
    let free = MemoryImage::build(&formats, &patches, None);
    assert!(free.grid.log2_cells > 2);
    for g in 1..=free.grid.log2_cells {
        let size = sizes[g as usize - 1];
        let exact = MemoryImage::build_within(&formats, &patches, None, size);
        assert_eq!((exact.grid.log2_cells, exact.size_bytes() as u64), (g, size));
        let less = MemoryImage::build_within(&formats, &patches, None, size - 1);
        assert_eq!(less.grid.log2_cells, (g - 1).max(1));
    }
}

#[test]
fn grid_index_of_every_cell_is_unique_and_eight_around_a_corner_are_neighbours() {
    let grid = Grid { log2_cells: 3 };
    let mut seen = vec![false; grid.n_cells()];
    for cell in cells(grid) {
        assert!(!std::mem::replace(&mut seen[grid.index(cell)], true), "{cell:?} shares its index");
        let corner = Cell(cell.0.map(|place| place & !1));
        assert_eq!(grid.index(cell) / 8, grid.index(corner) / 8);
    }
    assert!(seen.into_iter().all(|s| s));
}

#[test]
fn build_asked_for_too_fine_a_grid_takes_the_finest() {
    let formats = formats(8, 8, 8);
    assert_eq!(MemoryImage::build(&formats, &[], Some(9)).grid, Grid { log2_cells: 7 });
    assert_eq!(MemoryImage::build(&formats, &[], None).grid, Grid { log2_cells: 1 });
}

#[test]
fn build_two_images_of_one_scene_are_equal() {
    let formats = Formats::default();
    let patches = floor(&formats, 10);
    assert_eq!(MemoryImage::build(&formats, &patches, None), MemoryImage::build(&formats, &patches, None));
}

#[test]
fn patch_record_at_the_widest_format_fits_its_line() {
    assert_eq!(patch_bytes(&Formats::default()), 44);
    assert!(patch_bytes(&formats(28, 28, 32)) <= 4 * PATCH_LINE_WORDS);
}
