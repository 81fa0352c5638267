//! One axis: values to pixels, and its ticks.

use super::Scale;

/// Room between the outermost values and the frame, as a share of its width.
const ROOM: f64 = 0.04;

/// An axis of a panel.
pub(super) struct Ruler<'a> {
    scale: &'a Scale,
    /// Range in the scale's own measure.
    low: f64,
    high: f64,
    /// Pixels at `low` and `high`.
    from: i32,
    to: i32,
}

impl<'a> Ruler<'a> {
    pub(super) fn new(scale: &'a Scale, values: &[f64], from: i32, to: i32) -> Ruler<'a> {
        let measured = || values.iter().map(|v| measure(scale, *v)).filter(|v| v.is_finite());
        let (mut low, mut high) =
            measured().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        match scale {
            Scale::Names(names) => (low, high) = (-0.5, names.len() as f64 - 0.5),
            Scale::Linear { from_zero: true } => {
                (low, high) = (low.min(0.0), high.max(0.0));
                high += if high > low { 1.5 * ROOM * (high - low) } else { 1.0 };
                low -= if low < 0.0 { ROOM * (high - low) } else { 0.0 };
            }
            _ => {
                let room = if high > low { ROOM * (high - low) } else { 0.5 };
                (low, high) = (low - room, high + room);
            }
        }
        Ruler { scale, low, high, from, to }
    }

    /// The pixel of a value; the near end for one that the scale has no place for.
    pub(super) fn pixel(&self, value: f64) -> i32 {
        let v = measure(self.scale, value);
        let share = if v.is_finite() { (v - self.low) / (self.high - self.low) } else { 0.0 };
        self.from + (share.clamp(0.0, 1.0) * f64::from(self.to - self.from)).round() as i32
    }

    /// Values with labels.
    pub(super) fn ticks(&self, values: &[f64]) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Names(names) => (0..).map(f64::from).zip(names.iter().cloned()).collect(),
            Scale::Linear { .. } => {
                let rough = (self.high - self.low) / 6.5;
                let power = 10_f64.powf(rough.log10().floor());
                let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= rough);
                let step = step.unwrap_or(rough);
                let first = (self.low / step - 1e-9).ceil() as i64;
                (first..)
                    .map(|i| i as f64 * step)
                    .take_while(|v| *v <= self.high + 1e-9 * step)
                    .map(|v| (v, short(v, step)))
                    .collect()
            }
            Scale::Log => {
                // The measured values themselves while they are few and apart, else powers of ten and their parts.
                let mut own: Vec<f64> = values.to_vec();
                own.sort_by(f64::total_cmp);
                own.dedup();
                let gap = |w: &[f64]| measure(self.scale, w[1]) - measure(self.scale, w[0]);
                let apart = own.windows(2).all(|w| gap(w) > 0.055 * (self.high - self.low));
                if !own.is_empty() && own.len() <= 12 && apart {
                    return own.into_iter().map(|v| (v, plain(v))).collect();
                }
                let decades = self.high - self.low;
                let parts: &[f64] = match decades {
                    d if d > 3.0 => &[1.0],
                    d if d > 1.2 => &[1.0, 2.0, 5.0],
                    _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
                };
                (self.low.floor() as i32..=self.high.ceil() as i32)
                    .flat_map(|k| parts.iter().map(move |p| p * 10_f64.powi(k)))
                    .filter(|v| (self.low..=self.high).contains(&v.log10()))
                    .map(|v| (v, plain(v)))
                    .collect()
            }
        }
    }
}

fn measure(scale: &Scale, value: f64) -> f64 {
    match scale {
        Scale::Log => value.log10(),
        _ => value,
    }
}

/// A tick of a linear axis, with the digits that its step needs.
fn short(value: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    format!("{value:.decimals$}")
}

/// A tick of a logarithmic axis.
fn plain(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if (1e-4..1e7).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, values: &[f64]) -> Vec<String> {
        let ruler = Ruler::new(&scale, values, 0, 100);
        ruler.ticks(values).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_of_a_linear_axis_from_zero_are_round_and_include_zero() {
        assert_eq!(labels(Scale::Linear { from_zero: true }, &[3.0, 9.4]), ["0", "2", "4", "6", "8"]);
        assert_eq!(
            labels(Scale::Linear { from_zero: true }, &[0.01, 0.031]),
            ["0.00", "0.01", "0.02", "0.03"]
        );
    }

    #[test]
    fn ticks_of_a_logarithmic_axis_are_the_values_while_few_and_decades_otherwise() {
        assert_eq!(labels(Scale::Log, &[1.0, 4.0, 16.0]), ["1", "4", "16"]);
        let many: Vec<f64> = (0..40).map(|i| 1.3_f64.powi(i)).collect();
        assert_eq!(labels(Scale::Log, &many), ["1", "10", "100", "1000", "10000"]);
    }

    #[test]
    fn ruler_puts_larger_values_further_on_and_the_impossible_at_the_near_end() {
        let scale = Scale::Log;
        let ruler = Ruler::new(&scale, &[1.0, 100.0], 10, 110);
        assert!(ruler.pixel(1.0) < ruler.pixel(10.0) && ruler.pixel(10.0) < ruler.pixel(100.0));
        assert_eq!(ruler.pixel(10.0), 60);
        assert_eq!(ruler.pixel(0.0), 10);
    }
}
