//! Metrics against an axis, the best value of each objective along it, and what limits the board on both its sides.
//!
//! ```text
//! measured rows --other axes as in the best row (slice) | all rows at a value (mean)--> Curve
//! Curve --best--> Optimum: how clock, cycles and area change on both sides    --stretches--> longest path, tightest resource
//! ```
//! A slice changes one thing. Where it has rows at fewer than three values, and means have more, the means are taken: then
//! other axes may vary along the curve too, and `along` says so.

use super::pareto::{Front, is_measured, minimised};
use super::words::{by_frequency, shown};
use super::{Results, Row};
use crate::report::si::{percent, significant};

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
    /// Where it is best, and how good, in words.
    pub what: String,
    /// How clock, cycles and area change on both sides.
    pub sides: String,
}

impl Optimum {
    /// All of it.
    pub fn reason(&self) -> String {
        format!("{} {}", self.what, self.sides)
    }
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
        let (at, last) = (self.stops[stop].0, self.stops.len() - 1);
        let what = format!("{} is best at {axis} = {at}: {}.", m.name, shown(value, &m.unit));
        let mut sides = Vec::new();
        if let Some(end) = [(0, "smallest"), (last, "largest")].iter().find(|e| e.0 == stop) {
            sides.push(format!("This is the {} value.", end.1));
        }
        for (name, from, to) in [
            (format!("From {} to it", self.stops[0].0), 0, stop),
            (format!("From it to {}", self.stops[last].0), stop, last),
        ] {
            let changes = self.changes(results, from, to);
            if !changes.is_empty() {
                sides.push(format!("{name}: {changes}."));
            }
        }
        Some(Optimum { metric, stop, value, what, sides: sides.join(" ") })
    }

    /// How clock, cycles and area change from one stop to another.
    fn changes(&self, results: &Results, from: usize, to: usize) -> String {
        let change = |(name, label): (&str, &str)| {
            let metric = results.metrics.iter().position(|c| c.name == name)?;
            let known = self.known(results, metric);
            let at = |stop: usize| known.iter().find(|(s, _)| *s == stop).map(|(_, value)| *value);
            let (a, b) = (at(from)?, at(to)?);
            let unit = &results.metrics[metric].unit;
            Some(format!("{label}{} to {} (x{})", shown(a, unit), shown(b, unit), significant(b / a)))
        };
        let told = [("clock_mhz", "clock "), ("cycles", ""), ("area_mm2", "area "), ("luts", "")];
        let changes = told.into_iter().filter(|_| from < to).filter_map(change);
        changes.collect::<Vec<_>>().join(", ")
    }

    /// Stretches of the axis with one longest path and one tightest resource, in words; empty where neither is known.
    pub fn limits(&self, results: &Results) -> String {
        const MOST: usize = 6;
        let most = |names: Vec<&str>| {
            by_frequency(names.into_iter()).first().map_or("", |(name, _)| *name).to_owned()
        };
        let mut stretches: Vec<Stretch> = Vec::new();
        for (value, rows) in &self.stops {
            let rows: Vec<&Row> = rows.iter().map(|r| &results.rows[*r]).collect();
            let block =
                most(rows.iter().map(|r| r.critical_block.as_str()).filter(|b| !b.is_empty()).collect());
            let limit = most(rows.iter().filter_map(|r| Some(r.limit.as_ref()?.0.as_str())).collect());
            let shares = rows.iter().filter_map(|r| r.limit.as_ref().filter(|l| l.0 == limit).map(|l| l.1));
            let (low, high) = extremes(shares);
            match stretches.last_mut().filter(|s| s.block == block && s.limit == limit) {
                Some(s) => (s.to, s.low, s.high) = (*value, s.low.min(low), s.high.max(high)),
                None => stretches.push(Stretch { from: *value, to: *value, block, limit, low, high }),
            }
        }
        if stretches.iter().all(|s| s.block.is_empty() && s.limit.is_empty()) {
            return String::new();
        }
        let more = stretches.len().saturating_sub(MOST);
        let mut text: Vec<String> = stretches.iter().take(MOST).map(Stretch::text).collect();
        if more > 0 {
            text.push(format!("and {more} more stretches"));
        }
        format!("Along {}: {}.", results.axes[self.axis].name, text.join("; "))
    }
}

/// Values of an axis with one longest path and one tightest resource.
struct Stretch {
    from: f64,
    to: f64,
    block: String,
    limit: String,
    /// Smallest and largest share of the cycles that the resource needs.
    low: f64,
    high: f64,
}

impl Stretch {
    fn text(&self) -> String {
        let range = if self.from == self.to {
            self.from.to_string()
        } else {
            format!("{} to {}", self.from, self.to)
        };
        let mut facts = Vec::new();
        if !self.block.is_empty() {
            facts.push(format!("longest path in {}", self.block));
        }
        if !self.limit.is_empty() {
            let (low, high) = (percent(self.low), percent(self.high));
            let share = if low == high { low } else { format!("{low} to {high}") };
            facts.push(format!("tightest {}, {share} of the cycles", self.limit));
        }
        format!("{range}: {}", facts.join(", "))
    }
}

fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
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
        for part in
            ["is best at icu.depth = ", "From 2 to it: clock 13.02 MHz to ", "From it to 60: clock ", " (x"]
        {
            assert!(best.reason().contains(part), "'{part}' is missing in {}", best.reason());
        }
        let limits = curve.limits(&results);
        for part in [
            "Along icu.depth: 2: longest path in icu, tightest ICUs, ",
            "to 60: longest path in patch_cache, ",
        ] {
            assert!(limits.contains(part), "'{part}' is missing in {limits}");
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
