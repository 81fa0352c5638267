//! Division units on the dividends and divisors of whole tests: each gives the hit's t, or no hit where there is none.

use rtl_model::datapath::ray_patch;
use rtl_model::fixed::Formats;
use rtl_model::fixed::division::{
    Divider, DividerForm, DividerFormat, Newton, NewtonParameters, NonRestoring,
};

use crate::cases::{CLASSES, Pair};
use crate::draw::SplitMix;

/// A digit recurrence, and the Newton unit with the fewest table bits that its bound allows for these iterations.
fn units(formats: &Formats) -> [Divider; 2] {
    let format = DividerFormat::of(formats);
    let newton = |table_bits| {
        let parameters = NewtonParameters { table_bits, iterations: 3, multiplier_cycles: 1 };
        Newton::new(format, parameters, DividerForm::Serial).ok()
    };
    [
        Divider::NonRestoring(NonRestoring::new(format, 2, DividerForm::Serial).unwrap()),
        Divider::Newton((1..=12).find_map(newton).unwrap()),
    ]
}

#[test]
fn division_units_on_the_operands_of_whole_tests_give_the_hits_t() {
    let mut words = SplitMix::new(1992);
    let (mut hits, mut beyond) = (0, 0);
    for n in 0..24_000 {
        let (mut formats, Pair { mut ray, patch }) = CLASSES[n % CLASSES.len()].pair_at_a_set(&words.words());
        // The widest range, and full products: then a hit's t is its triangle's alone.
        formats.cross_keep_bits = None;
        ray.t_max = formats.t_limit();
        let taps = ray_patch::taps(&formats, &ray, &patch);
        let ahead = |num: i128, den: i128| num == 0 || (num < 0) == (den < 0);
        let triangles = taps.triangles.iter().flatten();
        let met: Vec<_> = triangles.filter(|w| w.inside && ahead(w.num, w.den)).collect();
        let hit = ray_patch::intersect(&formats, &ray, &patch).map(|hit| hit.t);
        for unit in units(&formats) {
            let quotient =
                |num: i128, den: i128| unit.divide(num.unsigned_abs(), den.unsigned_abs()).unwrap();
            let t = met.iter().filter_map(|w| quotient(w.num_shifted, w.den_shifted).quotient).min();
            assert_eq!(t, hit, "{formats:?} {ray:?} {patch:?}");
        }
        hits += usize::from(hit.is_some());
        beyond += usize::from(hit.is_none() && !met.is_empty());
    }
    assert!(hits > 5_000 && beyond > 0, "{hits} hits, {beyond} beyond 4.0");
}
