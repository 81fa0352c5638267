use proptest::prelude::*;

use super::super::operators::{Operator, Part};
use super::super::technology::Technology;
use super::*;

/// A chain of slices with these delays (0.1 ns) and live bits.
fn chain(slices: &[(u32, u64)]) -> Pipeline<'static> {
    let timing = &Technology::named("osu-0.35um").unwrap().timing;
    let mut pipeline = Pipeline::new(timing, 1, 1);
    for &(delay, bits) in slices {
        let parts = vec![Part { delay_ns: f64::from(delay) * 0.1, bits_after: bits }];
        pipeline.phase("slice", vec![(Operator { hardware: Hardware::default(), in_bits: 1, parts }, 1)], 0);
    }
    pipeline
}

/// The least longest of all cuts into at most `stages`, by trying every one.
fn by_trying_all(slices: &[(u32, u64)], stages: u32) -> u32 {
    let n = slices.len();
    (0_u32..1 << (n - 1))
        .filter(|cuts| cuts.count_ones() < stages)
        .map(|cuts| {
            let (mut longest, mut stage) = (0, 0);
            for (i, (delay, _)) in slices.iter().enumerate() {
                stage += delay;
                longest = longest.max(stage);
                if cuts >> i & 1 == 1 {
                    stage = 0;
                }
            }
            longest
        })
        .min()
        .unwrap()
}

proptest! {
    #[test]
    fn cut_of_any_chain_is_the_best_of_all_cuts(
        slices in proptest::collection::vec((1_u32..50, 1_u64..100), 1..10), stages in 1_u32..14,
    ) {
        let cut = chain(&slices).cut(stages);
        let expected = f64::from(by_trying_all(&slices, stages)) * 0.1;
        prop_assert!((cut.longest_ns - expected).abs() < 1e-6, "{} ns, expected {expected}", cut.longest_ns);
    }

    #[test]
    fn cut_a_stage_deeper_is_never_slower_and_never_has_fewer_registers(
        slices in proptest::collection::vec((1_u32..50, 1_u64..100), 1..40), stages in 1_u32..60,
    ) {
        let pipeline = chain(&slices);
        let (cut, deeper) = (pipeline.cut(stages), pipeline.cut(stages + 1));
        prop_assert!(deeper.longest_ns <= cut.longest_ns + 1e-9);
        prop_assert!(deeper.register_bits >= cut.register_bits);
    }
}

#[test]
fn cut_by_hand_stands_at_the_narrow_place_of_equal_ones() {
    // 1 + 1 | 1 + 1, at the wide place, is the only cut into two with 0.2 ns.
    let four = chain(&[(1, 10), (1, 100), (1, 10), (1, 5)]);
    let one = four.cut(1);
    assert_eq!((one.register_bits, (one.longest_ns * 10.0).round()), (5, 4.0));
    let two = four.cut(2);
    assert_eq!((two.register_bits, (two.longest_ns * 10.0).round()), (105, 2.0));
    // A third stage shortens nothing: it is empty, at the narrowest place.
    let three = four.cut(3);
    assert_eq!((three.register_bits, (three.longest_ns * 10.0).round()), (110, 2.0));
    let all = four.cut(4);
    assert_eq!((all.register_bits, (all.longest_ns * 10.0).round()), (125, 1.0));
    assert_eq!(four.cut(1000).register_bits, 125 + 996 * 5);
    // 3 | 1 + 3 | 6 and 3 + 1 | 3 | 6 are equally long: the one with fewer bits.
    for (first, second) in [(10, 20), (20, 10)] {
        let cut = chain(&[(3, first), (1, second), (3, 30), (6, 5)]).cut(3);
        assert_eq!((cut.register_bits, (cut.longest_ns * 10.0).round()), (10 + 30 + 5, 6.0));
    }
}

#[test]
fn operators_beside_the_longest_count_where_they_take_fewest_bits() {
    let timing = &Technology::named("osu-0.35um").unwrap().timing;
    let op = |in_bits, parts: &[(f64, u64)]| Operator {
        hardware: Hardware::default(),
        in_bits,
        parts: parts.iter().map(|&(delay_ns, bits_after)| Part { delay_ns, bits_after }).collect(),
    };
    let long = op(8, &[(1.0, 100), (1.0, 50), (1.0, 10)]);
    // From 7 bits to 3: done early. From 3 to 7: as late as may be.
    let (narrowing, widening) = (op(7, &[(1.0, 3)]), op(3, &[(1.0, 7)]));
    let mut pipeline = Pipeline::new(timing, 1, 8);
    pipeline.phase("all", vec![(long, 1), (narrowing, 2), (widening, 1)], 1000);
    let bits: Vec<u64> = pipeline.slices.iter().map(|slice| slice.bits_after).collect();
    assert_eq!(bits, [100 + 6 + 3 + 1000, 50 + 6 + 3 + 1000, 10 + 6 + 7 + 1000]);
}

#[test]
fn uses_of_an_operator_share_units_behind_multiplexers() {
    let timing = &Technology::named("osu-0.35um").unwrap().timing;
    for (interval, units, ways) in [(1, 12, 1), (2, 6, 2), (5, 3, 4), (11, 2, 6), (12, 1, 12), (4096, 1, 12)]
    {
        let mut pipeline = Pipeline::new(timing, interval, 8);
        pipeline.phase("sums", vec![(timing.adder(10), 12)], 0);
        assert_eq!(pipeline.n_units, units);
        let one = timing.adder(10).hardware.gates;
        let expected = units as f64 * (one + super::super::hardware::MUX_GATES * 20.0 * f64::from(ways - 1));
        assert!((pipeline.hardware.gates - expected).abs() < 1e-6, "interval {interval}");
        assert!((pipeline.work.gates - 12.0 * one).abs() < 1e-6);
        let longest = pipeline.cut(1).longest_ns;
        assert!((longest - timing.adder_ns(10) - timing.choice_ns(ways as u64)).abs() < 1e-9);
    }
}
