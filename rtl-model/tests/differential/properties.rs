//! One property a class: at least 10^5 pairs, shrunk and stored when one fails.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::{Config, FileFailurePersistence, TestCaseError, TestError, TestRunner};
use rtl_model::fixed::Formats;

use crate::agreement::{Kind, Tally, check};
use crate::cases::{CLASSES, Class, Pair, any_formats};
use crate::draw::{Draw, Words};

/// Pairs in a case, 32 on average.
const PAIRS: std::ops::RangeInclusive<usize> = 1..=63;
const CASES: u32 = 3_500;
const LEAST_PAIRS: u64 = 100_000;

/// Absolute: proptest looks for stored cases from the working directory upward, but stores them relative to it.
const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/differential/properties.rs");

fn config(test_name: &'static str) -> Config {
    let default = Config::default();
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() { default.cases } else { CASES };
    Config {
        cases,
        failure_persistence: Some(Box::new(FileFailurePersistence::SourceParallel("proptest-regressions"))),
        source_file: Some(SOURCE),
        test_name: Some(test_name),
        // Of a case of 63 pairs of 32 words; the default would depend on the number of cases.
        max_shrink_iters: 100_000,
        ..default
    }
}

/// Runs board and oracle on pairs built from words; the tally of what they were, none after a shortened run, whose
/// shares say nothing.
fn agree(test_name: &'static str, build: impl Fn(&Words) -> (Formats, Pair)) -> Option<Tally> {
    let config = config(test_name);
    let full = config.cases >= CASES;
    let sum = Cell::new(Tally::default());
    let strategy = prop::collection::vec(prop::array::uniform32(any::<i32>()), PAIRS);
    let outcome = TestRunner::new(config).run(&strategy, |case| {
        let mut tally = sum.get();
        for words in &case {
            let (formats, pair) = build(words);
            valid(&formats, &pair).map_err(TestCaseError::fail)?;
            check(&formats, &pair, &mut tally).map_err(TestCaseError::fail)?;
        }
        sum.set(tally);
        Ok(())
    });
    match outcome {
        Ok(()) => {}
        // The words are in the stored line; the reason has the pair that they build.
        Err(TestError::Fail(reason, case)) => panic!("{} pairs left in the case\n{reason}", case.len()),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
    let tally = sum.get();
    assert!(tally.count(Kind::Pair) >= if full { LEAST_PAIRS } else { 1 }, "{tally}");
    full.then_some(tally)
}

/// Builders must stay inside what the formats allow.
fn valid(formats: &Formats, pair: &Pair) -> Result<(), String> {
    formats.validate().map_err(|fault| fault.to_string())?;
    pair.ray.validate(formats).map_err(|fault| format!("{fault}: {formats:?} {pair:?}"))?;
    let one = 1_i32 << formats.coord_frac_bits;
    let inside = pair.patch.corners.iter().flatten().all(|word| (-one..one).contains(word));
    let (id, closed) = (pair.patch.id, pair.patch.corners[3] == pair.patch.corners[2]);
    if inside && id < 1 << 28 && (closed || !pair.patch.is_triangle) {
        Ok(())
    } else {
        Err(format!("not a patch: {formats:?} {pair:?}"))
    }
}

fn class_agrees(class: Class, test_name: &'static str) {
    let Some(tally) = agree(test_name, |words| class.pair_at_a_set(words)) else {
        return;
    };
    let pairs = tally.count(Kind::Pair);
    for (kind, thousandths) in class.must_show() {
        let count = tally.count(*kind);
        assert!(count * 1_000 >= pairs * thousandths, "{class:?}: {count} {kind:?} in {tally}");
        assert!(count > 0, "{class:?}: no {kind:?} in {tally}");
    }
}

macro_rules! class_properties {
    ($($name:ident: $class:ident,)*) => {
        $(#[test] fn $name() { class_agrees(Class::$class, stringify!($name)); })*

        #[test]
        fn classes_all_have_a_property() {
            assert_eq!([$(Class::$class),*], CLASSES);
        }
    };
}

class_properties! {
    pair_random_board_equals_oracle: Random,
    pair_aimed_board_equals_oracle: Aimed,
    pair_through_a_vertex_board_equals_oracle: Vertex,
    pair_through_or_along_an_edge_board_equals_oracle: Edge,
    pair_grazing_board_equals_oracle: Grazing,
    pair_origin_on_the_patch_board_equals_oracle: OnPatch,
    pair_sliver_board_equals_oracle: Sliver,
    pair_at_cube_corners_board_equals_oracle: CubeCorner,
    pair_of_extreme_words_board_equals_oracle: ExtremeWords,
    pair_at_the_end_of_the_range_board_equals_oracle: RangeEnd,
    pair_with_tiny_den_board_equals_oracle: TinyDen,
    pair_with_degenerate_patch_board_equals_oracle: Degenerate,
}

#[test]
fn pair_of_any_class_at_any_formats_board_equals_oracle() {
    let rounded = Cell::new(0_u64);
    let tally = agree("pair_of_any_class_at_any_formats_board_equals_oracle", |words| {
        let mut draw = Draw::new(words);
        let class = draw.of(&CLASSES);
        let formats = any_formats(&mut draw);
        rounded.set(rounded.get() + u64::from(formats.cross_drop() > 0));
        (formats, class.pair(&formats, &mut draw))
    });
    let Some(tally) = tally else {
        return;
    };
    assert!(rounded.get() * 3 > tally.count(Kind::Pair), "{} rounded of {tally}", rounded.get());
    let kinds = [
        Kind::Front,
        Kind::Back,
        Kind::HitAtZero,
        Kind::HitAtMax,
        Kind::Behind,
        Kind::Beyond,
        Kind::Both,
        Kind::HitAtEdge,
        Kind::InPlane,
        Kind::UnitDen,
        Kind::NoArea,
    ];
    for kind in kinds {
        assert!(tally.count(kind) > 0, "no {kind:?} in {tally}");
    }
}
