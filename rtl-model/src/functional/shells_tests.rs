//! Bundles in shells: against brute force, and against rays by themselves.

use proptest::prelude::*;

use super::*;
use crate::datapath::PatchWords;
use crate::datapath::test_support::{formats, numbered, patch, ray, widths};
use crate::fixed::{Formats, Rounding};
use crate::functional::trace;
use crate::spec::ShellGrowth;

fn any_shells() -> impl Strategy<Value = ShellSpec> {
    (1_u32..6, any::<bool>(), prop_oneof![1_u32..6, Just(64)]).prop_map(|(cells, doubling, entries)| {
        let growth = if doubling { ShellGrowth::Double } else { ShellGrowth::Fixed };
        ShellSpec { cells, growth, entries, ..ShellSpec::default() }
    })
}

type Scene = (Formats, Vec<PatchWords>, Vec<RayWords>, Option<u32>);

fn scene() -> impl Strategy<Value = Scene> {
    let modes = prop_oneof![Just(Rounding::NearestEven), Just(Rounding::HalfAway), Just(Rounding::Floor)];
    (widths(), modes).prop_flat_map(|((f, d, t), rounding)| {
        let grid = prop_oneof![Just(None), Just(Some(1)), Just(Some(3)), Just(Some(5))];
        (
            Just(Formats { rounding, ..formats(f, d, t) }),
            prop::collection::vec(patch(f), 1..24),
            prop::collection::vec(ray(f, d, t), 1..40),
            grid,
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Explicit rays together, and rays with one apex: the hits are those of each ray alone, whatever the shells.
    #[test]
    fn trace_bundles_hit_what_each_ray_hits_by_itself(
        (formats, patches, mut rays, grid) in scene(), spec in any_shells(), one_apex: bool
    ) {
        let image = MemoryImage::build(&formats, &numbered(patches), grid);
        if one_apex {
            let origin = rays[0].origin;
            rays.iter_mut().for_each(|ray| ray.origin = origin);
        }
        let mut tracer = ShellTracer::new(&image, &spec);
        for any_hit in [false, true] {
            let bundle = tracer.trace(&rays, any_hit);
            for (ray, hit) in rays.iter().zip(&bundle.hits) {
                let alone = trace(&image, ray, any_hit);
                if any_hit {
                    prop_assert_eq!(hit.is_some(), alone.hit.is_some(), "{:?}", ray);
                } else {
                    prop_assert_eq!(*hit, alone.hit, "{:?}", ray);
                }
            }
            prop_assert_eq!(bundle.work.hits, bundle.hits.iter().flatten().count() as u64);
            prop_assert_eq!(tracer.trace(&rays, any_hit), bundle, "no state of an earlier bundle shows");
        }
    }

    /// A bundle of one ray walks on to the far side of a shell, so it enters at least the cells that the ray alone
    /// enters; masks test a patch once, so never more often than there are patches.
    #[test]
    fn trace_bundle_of_one_ray_works_at_least_as_much_and_tests_no_patch_twice(
        (formats, patches, rays, grid) in scene(), spec in any_shells()
    ) {
        let n_patches = patches.len() as u64;
        let image = MemoryImage::build(&formats, &numbered(patches), grid);
        let mut tracer = ShellTracer::new(&image, &spec);
        for ray in &rays {
            let (alone, bundle) = (trace(&image, ray, false), tracer.trace(&[*ray], false));
            prop_assert!(bundle.work.cells >= u64::from(alone.cells));
            prop_assert!(bundle.work.tests <= n_patches);
            prop_assert!(bundle.work.list_entries >= u64::from(alone.list_entries));
        }
    }
}

/// A row of 8 cells along x with a wall in each; the ray starts in the first cell and hits the wall in cell `wall`.
fn row_of_walls(first_wall: i32) -> (MemoryImage, RayWords) {
    let formats = Formats::default();
    let one = 1_i32 << formats.coord_frac_bits;
    let cell = one / 4;
    let walls: Vec<PatchWords> = (first_wall..8)
        .map(|i| {
            let x = -one + i * cell + cell / 2;
            let (low, high) = (cell / 8, cell / 2);
            let corners = [[x, low, low], [x, high, low], [x, high, high], [x, low, high]];
            PatchWords { corners, is_triangle: false, id: i as u32 }
        })
        .collect();
    let image = MemoryImage::build(&formats, &walls, Some(3));
    let ray = RayWords {
        origin: [-one + cell / 4, cell / 4, cell / 4],
        dir: [one - 1, 0, 0],
        t_max: formats.t_limit(),
    };
    (image, ray)
}

#[test]
fn trace_ray_that_hits_in_the_third_cell_enters_and_tests_the_rest_of_its_shell_only() {
    let (image, ray) = row_of_walls(2);
    for (cells, growth, expected_cells, tests) in [
        // Shells {0} {1} {2}: the hit in cell 2 ends the ray.
        (1, ShellGrowth::Fixed, 3, 1),
        // {0} {1, 2}: the same.
        (2, ShellGrowth::Fixed, 3, 1),
        // {0} {1, 2, 3}: cell 3 is entered and its wall tested.
        (3, ShellGrowth::Fixed, 4, 2),
        // {0} {1} {2, 3}.
        (1, ShellGrowth::Double, 4, 2),
        // {0} {1, 2} {3..6}: not entered.
        (2, ShellGrowth::Double, 3, 1),
        (7, ShellGrowth::Fixed, 8, 6),
    ] {
        let spec = ShellSpec { cells, growth, ..ShellSpec::default() };
        let bundle = ShellTracer::new(&image, &spec).trace(&[ray, ray], false);
        assert_eq!(bundle.hits.iter().flatten().map(|h| h.patch).collect::<Vec<_>>(), [2, 2]);
        assert_eq!(bundle.work.cells, 2 * expected_cells, "shells of {cells} {growth:?}");
        assert_eq!(bundle.work.tests, 2 * tests, "shells of {cells} {growth:?}");
        assert_eq!(bundle.work.list_entries, tests, "one list for both rays");
    }
}

#[test]
fn trace_with_a_table_of_two_entries_splits_the_shell_and_reads_lists_again_but_tests_nothing_twice() {
    let (image, ray) = row_of_walls(1);
    let trace = |entries| {
        let spec = ShellSpec { cells: 7, entries, ..ShellSpec::default() };
        ShellTracer::new(&image, &spec).trace(&[ray; 3], false)
    };
    let (whole, split) = (trace(64), trace(2));
    assert_eq!((whole.splits, split.splits), (0, 3), "7 occupied cells, two at a time");
    assert_eq!(whole.hits, split.hits);
    assert_eq!((whole.work.tests, split.work.tests), (21, 21));
    assert_eq!((whole.work.list_entries, split.work.list_entries), (7, 7), "rounds visit a cell by all rays");
    assert_eq!((whole.shells, split.shells), (2, 2));
}
