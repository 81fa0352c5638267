//! Metrics against an axis, the best value of each objective along it, and what limits the board on both its sides.
//!
//! ```text
//! measured rows --other axes as in the best row (slice) | all rows at a value (mean)--> Curve --best--> Optimum, reason
//! ```
//! A slice changes one thing. Where it has rows at fewer than three values, and means have more, the means are taken: then
//! other axes may vary along the curve too, and `along` says so.

use super::pareto::{Front, is_measured, minimised};
use super::words::shown;
use super::{Results, Row};
use crate::report::si::percent;

/// Rows along an axis with numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Which axis.
    pub axis: usize,
    /// Values that have rows, in ascending order, with those rows; one each of a slice.
    pub stops: Vec<(f64, Vec<usize>)>,
    /// All other axes are held.
    pub is_slice: bool,
    /// Which rows these are, in words.
    pub along: String,
}

/// The best value of a metric along a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimum {
    /// Which metric.
    pub metric: usize,
    /// Which stop.
    pub stop: usize,
    /// The metric there.
    pub value: f64,
    /// What is known of its left and right, in words.
    pub reason: String,
}

/// A curve for each axis that has numbers, and rows at two of them.
pub fn curves(results: &Results, front: &Front) -> Vec<Curve> {
    (0..results.axes.len()).filter_map(|axis| Curve::new(results, front, axis)).collect()
}

impl Curve {
    fn new(results: &Results, front: &Front, axis: usize) -> Option<Curve> {
        let mut values: Vec<f64> =
            results.axes[axis].values.iter().map(super::Value::number).collect::<Option<_>>()?;
        values.sort_by(f64::total_cmp);
        let best = front.objectives.first().and_then(|m| front.best(results, *m)).map(|(row, _)| row);
        let stops = |take: &dyn Fn(&Row) -> bool| -> Vec<(f64, Vec<usize>)> {
            let mut stops: Vec<(f64, Vec<usize>)> = values.iter().map(|v| (*v, Vec::new())).collect();
            for (i, row) in results.rows.iter().enumerate().filter(|(_, row)| is_measured(row) && take(row)) {
                let value = row.values.get(axis).and_then(super::Value::number);
                if let Some(stop) = stops.iter_mut().find(|s| Some(s.0) == value) {
                    stop.1.push(i);
                }
            }
            stops.retain(|s| !s.1.is_empty());
            stops
        };
        let others_as = |a: &Row, b: &Row| {
            a.values.iter().zip(&b.values).enumerate().all(|(i, (x, y))| i == axis || x == y)
        };
        let slice = best.map(|b| stops(&|row| others_as(row, &results.rows[b]))).unwrap_or_default();
        let all = stops(&|_| true);
        let is_slice = slice.len() >= 3 || slice.len() == all.len();
        let along = match best {
            Some(best) if is_slice => {
                let pairs = results.axes.iter().zip(&results.rows[best].values).enumerate();
                let held: Vec<String> = pairs
                    .filter(|(i, _)| *i != axis)
                    .map(|(_, (other, value))| format!("{} = {value}", other.name))
                    .collect();
                if held.is_empty() { String::new() } else { format!("held at {}", held.join(", ")) }
            }
            _ => "mean of all rows at each value; other axes vary".to_owned(),
        };
        let stops = if is_slice { slice } else { all };
        (stops.len() > 1).then_some(Curve { axis, stops, is_slice, along })
    }

    /// The metric at each stop, where it is known: its mean.
    pub fn values(&self, results: &Results, metric: usize) -> Vec<(f64, f64)> {
        self.known(results, metric).into_iter().map(|(stop, value)| (self.stops[stop].0, value)).collect()
    }

    fn known(&self, results: &Results, metric: usize) -> Vec<(usize, f64)> {
        let at = |rows: &[usize]| {
            let known: Vec<f64> =
                rows.iter().filter_map(|r| results.rows[*r].metrics.get(metric).copied().flatten()).collect();
            let mean = known.iter().sum::<f64>() / known.len() as f64;
            mean.is_finite().then_some(mean)
        };
        self.stops.iter().enumerate().filter_map(|(i, (_, rows))| Some((i, at(rows)?))).collect()
    }

    /// Where a metric is best along the curve, the first of equals, and why.
    pub fn optimum(&self, results: &Results, metric: usize) -> Option<Optimum> {
        let m = results.metrics.get(metric)?;
        let (stop, value) = self.known(results, metric).into_iter().reduce(|best, other| {
            if minimised(other.1, m.goal) < minimised(best.1, m.goal) { other } else { best }
        })?;
        let axis = &results.axes[self.axis].name;
        let mut reason =
            format!("{} is best at {axis} = {}: {}.", m.name, self.stops[stop].0, shown(value, &m.unit));
        let sides = [("Below", 0..stop), ("There", stop..stop + 1), ("Above", stop + 1..self.stops.len())];
        if let Some(end) = [(0, "smallest"), (self.stops.len() - 1, "largest")].iter().find(|e| e.0 == stop) {
            reason += &format!(" This is the {} value.", end.1);
        }
        for (name, range) in sides.into_iter().filter(|(_, range)| !range.is_empty()) {
            reason += &format!(" {}", self.side(results, name, range));
        }
        Some(Optimum { metric, stop, value, reason })
    }

    /// What limits the board at some stops, and how clock, cycles and area change along them.
    fn side(&self, results: &Results, name: &str, range: std::ops::Range<usize>) -> String {
        let (first, last) = (self.stops[range.start].0, self.stops[range.end - 1].0);
        let rows: Vec<&Row> =
            self.stops[range.clone()].iter().flat_map(|s| &s.1).map(|r| &results.rows[*r]).collect();
        let blocks = names(rows.iter().map(|r| r.critical_block.as_str()).filter(|b| !b.is_empty()));
        let limits = names(rows.iter().filter_map(|r| Some(r.limit.as_ref()?.0.as_str())));
        let mut facts: Vec<String> = Vec::new();
        if !blocks.is_empty() {
            facts.push(format!("longest path in {}", blocks.join(", then ")));
        }
        if let Some((low, high)) = extremes(rows.iter().filter_map(|r| Some(r.limit.as_ref()?.1))) {
            let share = if percent(low) == percent(high) {
                percent(low)
            } else {
                format!("{} to {}", percent(low), percent(high))
            };
            facts.push(format!("limit {} ({share} of the cycles)", limits.join(", then ")));
        }
        for metric in ["clock_mhz", "cycles", "area_mm2", "luts"] {
            let Some(m) = results.metrics.iter().position(|c| c.name == metric) else { continue };
            let along: Vec<f64> = (self.known(results, m).into_iter())
                .filter(|(stop, _)| range.contains(stop))
                .map(|(_, value)| value)
                .collect();
            let unit = &results.metrics[m].unit;
            let label = if metric == "clock_mhz" {
                "clock "
            } else if metric == "area_mm2" {
                "area "
            } else {
                ""
            };
            match along.as_slice() {
                [] => {}
                [one] => facts.push(format!("{label}{}", shown(*one, unit))),
                [first, .., last] if shown(*first, unit) == shown(*last, unit) => {
                    facts.push(format!("{label}{}", shown(*first, unit)));
                }
                [first, .., last] => {
                    facts.push(format!("{label}{} to {}", shown(*first, unit), shown(*last, unit)));
                }
            }
        }
        let where_ = match () {
            () if name == "There" => name.to_owned(),
            () if first == last => format!("{name} ({first})"),
            () => format!("{name} ({first} to {last})"),
        };
        format!("{where_}: {}.", facts.join(", "))
    }
}

/// Names in the order in which they come, repetitions left out; of many the most frequent.
fn names<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Vec<&'a str> {
    const MOST: usize = 3;
    let frequent: Vec<&str> =
        super::words::by_frequency(names.clone()).into_iter().take(MOST).map(|(name, _)| name).collect();
    super::columns::first_seen(names.filter(|n| frequent.contains(n)))
}

fn extremes(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    (low <= high).then_some((low, high))
}

#[cfg(test)]
mod tests {
    use super::super::synthetic;
    use super::*;

    #[test]
    fn curve_of_one_axis_has_a_stop_a_value_and_names_the_best_with_its_reason() {
        let results = synthetic::depths();
        let front = Front::of(&results);
        let all = curves(&results, &front);
        assert_eq!(all.len(), 1);
        let curve = &all[0];
        assert!(curve.is_slice && curve.along.is_empty() && curve.stops.len() == 30);
        let metric = results.metrics.iter().position(|m| m.name == "rays_per_second_per_mm2").unwrap();
        let best = curve.optimum(&results, metric).unwrap();
        let expected = (0..30).max_by(|a, b| {
            let of = |i: usize| results.rows[i].metrics[metric].unwrap();
            of(*a).total_cmp(&of(*b))
        });
        assert_eq!(Some(best.stop), expected);
        for part in [
            "is best at icu.depth = ",
            "Below (2 to ",
            "longest path in icu",
            "limit ICUs",
            "clock ",
            "Above",
        ] {
            assert!(best.reason.contains(part), "'{part}' is missing in {}", best.reason);
        }
    }

    #[test]
    fn curve_of_several_axes_is_a_slice_through_the_best_row_where_there_are_rows() {
        let results = synthetic::large();
        let front = Front::of(&results);
        let all = curves(&results, &front);
        // The partition has no numbers.
        assert_eq!(all.iter().map(|c| c.axis).collect::<Vec<_>>(), [0, 1, 2, 3]);
        let (best, _) = front.best(&results, front.objectives[0]).unwrap();
        for curve in &all {
            assert!(curve.is_slice && curve.along.starts_with("held at "));
            for row in curve.stops.iter().flat_map(|s| &s.1) {
                let differ =
                    (0..5).filter(|i| results.rows[*row].values[*i] != results.rows[best].values[*i]);
                assert!(differ.into_iter().all(|i| i == curve.axis));
            }
        }
    }

    #[test]
    fn curve_of_scattered_rows_is_a_mean_and_says_so() {
        let mut results = synthetic::bare(&[("a", 4), ("b", 4)], &["seconds"]);
        results.metrics[0].is_objective = true;
        for (ordinal, (a, b)) in [(0, 0), (0, 1), (1, 2), (2, 3), (3, 0)].into_iter().enumerate() {
            let values = [a, b].map(crate::explore::value::Value::Integer).to_vec();
            results.rows.push(synthetic::bare_row(ordinal as u64, values, &[(a + 10 * b) as f64]));
        }
        let curve = &curves(&results, &Front::of(&results))[0];
        assert!(!curve.is_slice && curve.along.starts_with("mean"), "{}", curve.along);
        assert_eq!(curve.values(&results, 0), [(0.0, 5.0), (1.0, 21.0), (2.0, 32.0), (3.0, 3.0)]);
        assert_eq!(curve.optimum(&results, 0).unwrap().stop, 3);
    }
}
