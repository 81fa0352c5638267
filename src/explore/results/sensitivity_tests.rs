use super::super::synthetic;
use super::*;
use crate::explore::value::Value;

/// The maker's space of axes `a` (3 values) and `b` (2), with the metric `seconds` by a formula of their places.
fn grid(keep: impl Fn(usize, usize) -> bool, metric: impl Fn(f64, f64) -> f64) -> Results {
    let cells: Vec<(usize, usize)> = (0..3).flat_map(|a| (0..2).map(move |b| (a, b))).collect();
    let mut results = synthetic::bare(&[("a", 3), ("b", 2)], &["seconds"]);
    for (a, b) in cells.into_iter().filter(|(a, b)| keep(*a, *b)) {
        let values = vec![Value::Integer(a as i64), Value::Integer(b as i64)];
        results.rows.push(synthetic::bare_row((2 * a + b) as u64, values, &[metric(a as f64, b as f64)]));
    }
    results
}

fn shares(results: &Results) -> Vec<Share> {
    sensitivity(results)[0].effects.iter().map(|e| e.share).collect()
}

#[test]
fn share_of_an_additive_metric_on_a_full_grid_is_each_axis_own_variance_and_adds_up_to_one() {
    // Variances 3a: 9 * 2/3 = 6, 4b: 16 * 1/4 = 4.
    let results = grid(|_, _| true, |a, b| 3.0 * a + 4.0 * b);
    let [Share::Of(a), Share::Of(b)] = shares(&results)[..] else { panic!("{:?}", shares(&results)) };
    assert!((a - 0.6).abs() < 1e-12 && (b - 0.4).abs() < 1e-12, "{a} {b}");
    let effects = &sensitivity(&results)[0];
    assert!(effects.is_full_grid && effects.n_rows == 6);
    let means: Vec<f64> = effects.effects[0].levels.iter().map(|l| l.mean).collect();
    assert_eq!(means, [2.0, 5.0, 8.0]);
    let first = &effects.effects[0].levels[0];
    assert_eq!((first.n, first.low, first.high), (2, 0.0, 4.0));
}

#[test]
fn share_of_what_axes_do_only_together_is_in_neither() {
    let sign = |x: f64| if x == 0.0 { -1.0 } else { 1.0 };
    // Of b alone the mean is 1/3 of the sign: a has two values of one sign.
    let results = grid(|a, _| a < 2, |a, b| sign(a) * sign(b));
    let mut results = Results { n_combinations: 4, ..results };
    results.axes[0].values.pop();
    assert_eq!(shares(&results), [Share::Of(0.0), Share::Of(0.0)]);
}

#[test]
fn share_of_a_partial_grid_takes_chance_off_and_says_where_none_can_be_told() {
    // Without (2, 1): means of b are 1 and 0.5; by hand SS_total = 2.8, SS_between = 3 * 0.04 + 2 * 0.09 = 0.3,
    // MS_within = 2.5 / 3, so that (0.3 - 0.8333) / 2.8 < 0.
    let results = grid(|a, b| (a, b) != (2, 1), |a, _| a);
    let [Share::Of(a), Share::Of(b)] = shares(&results)[..] else { panic!("{:?}", shares(&results)) };
    assert_eq!((a, b), (1.0, 0.0));
    // Two rows, two values each: nothing is left.
    let two = grid(|a, b| a == b && a < 2, |a, _| a);
    assert_eq!(shares(&two), [Share::TooFew, Share::TooFew]);
    // One axis alone changes: it explains all.
    let one = grid(|_, b| b == 0, |a, _| a);
    assert_eq!(shares(&one), [Share::Of(1.0), Share::TooFew]);
    assert!(basis(&one, &sensitivity(&one)[0]).contains("3 of 6 combinations"));
}

#[test]
fn share_of_a_metric_that_does_not_change_is_said_and_a_metric_of_no_row_is_left_out() {
    let results = grid(|_, _| true, |_, _| 7.0);
    assert_eq!(shares(&results), [Share::Constant, Share::Constant]);
    let mut none = results.clone();
    none.rows.iter_mut().for_each(|row| row.metrics[0] = None);
    assert!(sensitivity(&none).is_empty());
}

#[test]
fn shortened_and_pruned_rows_count_for_costs_alone() {
    let mut results = grid(|_, _| true, |a, b| a + b);
    for (row, status) in
        results.rows.iter_mut().zip([super::super::Status::Pruned, super::super::Status::Shortened])
    {
        row.status = status;
    }
    assert_eq!(sensitivity(&results)[0].n_rows, 4);
    results.metrics[0].name = "area_mm2".to_owned();
    assert_eq!(sensitivity(&results)[0].n_rows, 6);
}
