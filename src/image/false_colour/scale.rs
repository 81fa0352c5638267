//! The scale of a false-colour picture: which value gets which place on the colour map, and where its ticks stand.
//!
//! ```text
//! values, ScaleChoice --resolve--> Scale lo..hi --position(value)--> [0, 1]     --ticks--> round values, 1 2 5 x 10^k
//! ```
//! `auto`, linear: from 0 to the 99th percentile of the values that count, rounded up to a round number. `auto`,
//! logarithmic: to the same end, from the 1st percentile of the positive values, rounded down, at most four decades.

use serde::Serialize;

/// Shares of the values that an automatic scale leaves over and under it.
const TAIL: f64 = 0.01;
/// Most decades of an automatic logarithmic scale.
const MAX_AUTO_DECADES: f64 = 4.0;
/// Ends of automatic scales, times a power of ten.
const ROUND: [f64; 12] = [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0];

/// How values run along a scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ScaleKind {
    /// Equal differences, equal lengths.
    #[default]
    Linear,
    /// Equal ratios, equal lengths.
    Log,
}

/// The wanted scale.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScaleChoice {
    /// Its ends; from the values when `None`.
    pub range: Option<[f64; 2]>,
    /// How values run along it.
    pub kind: ScaleKind,
}

/// A scale with known ends, in the unit of the values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scale {
    /// Its lower end; what is less gets the same colour.
    pub lo: f64,
    /// Its upper end; what is more gets the same colour.
    pub hi: f64,
    /// How values run along it.
    pub kind: ScaleKind,
    /// The ends were chosen from the values.
    pub auto: bool,
}

impl ScaleChoice {
    /// What is wrong with the ends, if anything.
    pub fn fault(&self) -> Option<&'static str> {
        let [lo, hi] = self.range?;
        if !(lo.is_finite() && hi.is_finite() && lo < hi) {
            return Some("expected two finite numbers, the first less than the second");
        }
        let starts_at_nothing = self.kind == ScaleKind::Log && lo <= 0.0;
        starts_at_nothing.then_some("a logarithmic scale starts over 0")
    }

    /// The scale for `values`; those that are not finite do not count.
    pub fn resolve(&self, values: impl IntoIterator<Item = f64>) -> Scale {
        if let Some([lo, hi]) = self.range {
            return Scale { lo, hi, kind: self.kind, auto: false };
        }
        let mut values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let rank = |values: &[f64], share: f64| {
            let last = values.len().checked_sub(1)?;
            values.get((share * last as f64).round() as usize).copied()
        };
        let top = rank(&values, 1.0 - TAIL).filter(|top| *top > 0.0);
        let hi = round_up(top.or(values.last().copied()).filter(|v| *v > 0.0).unwrap_or(1.0));
        let lo = match self.kind {
            ScaleKind::Linear => 0.0,
            ScaleKind::Log => {
                let positive = &values[values.partition_point(|v| *v <= 0.0)..];
                let bottom = rank(positive, TAIL).unwrap_or(0.1 * hi);
                round_down(bottom.max(hi * 10f64.powf(-MAX_AUTO_DECADES))).min(0.1 * hi)
            }
        };
        Scale { lo, hi, kind: self.kind, auto: true }
    }
}

impl Scale {
    /// Where a value lies on the scale, from 0 at `lo` to 1 at `hi`; ends take what is beyond them.
    pub fn position(&self, value: f64) -> f64 {
        let at = match self.kind {
            ScaleKind::Linear => (value - self.lo) / (self.hi - self.lo),
            ScaleKind::Log if value <= 0.0 => 0.0,
            ScaleKind::Log => (value / self.lo).ln() / (self.hi / self.lo).ln(),
        };
        at.clamp(0.0, 1.0)
    }

    /// Round values in the scale, at most about `most`, in rising order.
    pub fn ticks(&self, most: usize) -> Vec<f64> {
        let most = most.max(2);
        match self.kind {
            ScaleKind::Linear => {
                let least = (self.hi - self.lo) / most as f64;
                let step = nice(least);
                let (first, last) =
                    ((self.lo / step - 1e-9).ceil() as i64, (self.hi / step + 1e-9).floor() as i64);
                // A product of a whole number and a negative power of ten is off by an ulp; a quotient is not.
                let exact =
                    |k: i64| if step < 1.0 { k as f64 / (1.0 / step).round() } else { k as f64 * step };
                (first..=last).map(exact).collect()
            }
            ScaleKind::Log => {
                let decades = (self.lo.log10().floor() as i32)..=(self.hi.log10().ceil() as i32);
                let inside = |v: &f64| *v >= self.lo * (1.0 - 1e-9) && *v <= self.hi * (1.0 + 1e-9);
                let of = |digits: &[f64], every: usize| -> Vec<f64> {
                    let powers = decades.clone().filter(|e| e.rem_euclid(every as i32) == 0);
                    powers.flat_map(|e| digits.iter().map(move |d| power(*d, e))).filter(inside).collect()
                };
                let tries = [of(&[1.0, 2.0, 5.0], 1), of(&[1.0, 3.0], 1), of(&[1.0], 1)];
                let fits = tries.into_iter().find(|ticks| ticks.len() <= most);
                let ticks = fits.unwrap_or_else(|| of(&[1.0], decades.clone().count().div_ceil(most)));
                // Ends within one decade have too few round values of their own.
                if ticks.len() < 2 { vec![self.lo, self.hi] } else { ticks }
            }
        }
    }
}

/// `digit` x 10^`exponent`, exactly rounded.
fn power(digit: f64, exponent: i32) -> f64 {
    if exponent < 0 { digit / 10f64.powi(-exponent) } else { digit * 10f64.powi(exponent) }
}

/// The least of 1, 2, 5 x 10^k that is `least` or more.
fn nice(least: f64) -> f64 {
    let exponent = least.log10().floor() as i32;
    let steps = [1.0, 2.0, 5.0, 10.0].map(|d| power(d, exponent));
    steps.into_iter().find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(steps[3])
}

fn round_up(value: f64) -> f64 {
    let exponent = value.log10().floor() as i32;
    let ends = ROUND.map(|d| power(d, exponent));
    ends.into_iter().find(|end| *end >= value * (1.0 - 1e-9)).unwrap_or(power(10.0, exponent))
}

fn round_down(value: f64) -> f64 {
    let exponent = value.log10().floor() as i32;
    let ends = ROUND.map(|d| power(d, exponent));
    ends.into_iter().rev().find(|end| *end <= value * (1.0 + 1e-9)).unwrap_or(ends[0])
}

/// A tick's value: as short as it can be, large and small ones with an exponent.
pub(super) fn label(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        1e-3..1e6 => {
            let text = format!("{value:.6}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => format!("{value:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn linear(lo: f64, hi: f64) -> Scale {
        Scale { lo, hi, kind: ScaleKind::Linear, auto: false }
    }

    fn log(lo: f64, hi: f64) -> Scale {
        Scale { lo, hi, kind: ScaleKind::Log, auto: false }
    }

    #[test]
    fn ticks_of_linear_scales_are_multiples_of_1_2_5() {
        assert_eq!(linear(0.0, 500.0).ticks(6), [0.0, 100.0, 200.0, 300.0, 400.0, 500.0]);
        assert_eq!(linear(0.0, 1.5).ticks(8), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4]);
        assert_eq!(linear(130.0, 260.0).ticks(5), [150.0, 200.0, 250.0]);
        assert_eq!(linear(0.0, 0.03).ticks(4), [0.0, 0.01, 0.02, 0.03]);
    }

    #[test]
    fn ticks_of_log_scales_are_1_2_5_then_1_3_then_decades_then_some_of_them() {
        assert_eq!(log(1.0, 100.0).ticks(8), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        assert_eq!(log(1.0, 100.0).ticks(5), [1.0, 3.0, 10.0, 30.0, 100.0]);
        assert_eq!(log(0.01, 100.0).ticks(5), [0.01, 0.1, 1.0, 10.0, 100.0]);
        assert_eq!(log(1e-6, 1e6).ticks(6), [1e-6, 1e-3, 1.0, 1e3, 1e6]);
        assert_eq!(log(3.0, 4.0).ticks(5), [3.0, 4.0]);
    }

    #[test]
    fn position_is_the_share_of_the_length_and_ends_take_what_is_beyond() {
        assert_eq!(linear(100.0, 300.0).position(150.0), 0.25);
        assert!((log(1.0, 1e4).position(10.0) - 0.25).abs() < 1e-12);
        for (value, at) in [(-5.0, 0.0), (0.0, 0.0), (1e9, 1.0)] {
            assert_eq!((linear(1.0, 2.0).position(value), log(1.0, 2.0).position(value)), (at, at));
        }
    }

    #[test]
    fn automatic_scale_leaves_out_a_hundredth_and_ends_at_round_numbers() {
        let ramp = || (0..=1000).map(|i| f64::from(i) * 0.47);
        let scale = ScaleChoice::default().resolve(ramp());
        // The 99th percentile is 465.3.
        assert_eq!((scale.lo, scale.hi, scale.auto), (0.0, 500.0, true));
        let log = ScaleChoice { kind: ScaleKind::Log, ..ScaleChoice::default() }.resolve(ramp());
        // The 1st percentile of the positive ones is 5.17.
        assert_eq!((log.lo, log.hi), (5.0, 500.0));
        let dark = ScaleChoice::default().resolve([0.0, f64::NAN]);
        assert_eq!((dark.lo, dark.hi), (0.0, 1.0));
        assert_eq!(ScaleChoice::default().resolve([]).hi, 1.0);
    }

    #[test]
    fn ends_that_are_none_are_told() {
        let choice = |range, kind| ScaleChoice { range: Some(range), kind }.fault();
        assert_eq!(choice([0.0, 1.0], ScaleKind::Linear), None);
        assert!(choice([1.0, 1.0], ScaleKind::Linear).is_some());
        assert!(choice([0.0, f64::INFINITY], ScaleKind::Linear).is_some());
        assert!(choice([0.0, 1.0], ScaleKind::Log).unwrap().contains("starts over 0"));
    }

    #[test]
    fn labels_are_short() {
        let cases =
            [(0.0, "0"), (0.2, "0.2"), (1500.0, "1500"), (0.0025, "0.0025"), (2e7, "2e7"), (1e-5, "1e-5")];
        for (value, text) in cases {
            assert_eq!(label(value), text);
        }
    }

    proptest! {
        #[test]
        fn ticks_of_any_scale_lie_in_it_and_are_not_too_many(
            lo in 1e-6..1e6f64, ratio in 1.01..1e8f64, most in 2usize..12, is_log: bool,
        ) {
            let kind = if is_log { ScaleKind::Log } else { ScaleKind::Linear };
            let scale = Scale { lo, hi: lo * ratio, kind, auto: false };
            let ticks = scale.ticks(most);
            prop_assert!(ticks.len() <= most + 1, "{ticks:?}");
            prop_assert!(ticks.windows(2).all(|w| w[0] < w[1]), "{ticks:?}");
            let slack = 1e-6 * scale.hi;
            prop_assert!(ticks.iter().all(|t| *t >= lo - slack && *t <= scale.hi + slack), "{ticks:?}");
        }
    }
}
