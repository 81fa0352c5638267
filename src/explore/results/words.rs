//! Values, points and counts in words.

use super::{Results, Row, Status};
use crate::report::si::{si, significant};

/// A value with its unit, with an SI prefix where the unit takes one: `941 k/s`, `1.25 ms`, `15.20 mm2`.
pub fn shown(value: f64, unit: &str) -> String {
    match unit {
        "s" | "W" | "J" | "cycles" | "gates" | "bits" | "LUTs" => si(value, unit).trim_end().to_owned(),
        "" => significant(value),
        _ => match unit.strip_prefix('1') {
            Some(per) => si(value, per),
            None => format!("{} {unit}", significant(value)),
        },
    }
}

/// A metric of a row in words, `-` where it is not known.
pub fn metric_text(results: &Results, row: &Row, metric: usize) -> String {
    let unit = results.metrics.get(metric).map_or("", |m| m.unit.as_str());
    row.metrics.get(metric).copied().flatten().map_or_else(|| "-".to_owned(), |x| shown(x, unit))
}

/// The point's values with the names of their axes: `icu.depth = 8, partition = grid`.
pub fn point_text(results: &Results, row: &Row) -> String {
    let pairs = results.axes.iter().zip(&row.values).map(|(axis, value)| format!("{} = {value}", axis.name));
    pairs.collect::<Vec<_>>().join(", ")
}

/// A scale for numbers up to `largest`: what to multiply by, and the unit then.
pub fn scaled_unit(unit: &str, largest: f64) -> (f64, String) {
    let power = if largest > 0.0 { (largest.log10() / 3.0).floor() as i32 } else { 0 };
    // Plain numbers up to 10,000 are read as they are; units with prefixes from 1.
    let least = if ["s", "W", "J"].contains(&unit) { 1.0 } else { 0.01 };
    let power = if (least..1e4).contains(&largest) { 0 } else { power.clamp(-3, 4) };
    if power == 0 {
        return (1.0, unit.to_owned());
    }
    let factor = 10_f64.powi(-3 * power);
    let prefix = ["n", "u", "m", "", "k", "M", "G", "T"][(power + 3) as usize];
    let text = match unit {
        "s" | "W" | "J" => format!("{prefix}{unit}"),
        "" => format!("10^{}", 3 * power),
        _ => match unit.strip_prefix('1') {
            Some(per) => format!("10^{}{per}", 3 * power),
            None => format!("10^{} {unit}", 3 * power),
        },
    };
    (factor, text)
}

/// How many rows became what, `simulated` first, kinds without rows left out.
pub fn status_counts(results: &Results) -> Vec<(&'static str, usize)> {
    let n = |of: fn(&Status) -> bool| results.rows.iter().filter(|row| of(&row.status)).count();
    let counts = [
        ("simulated", n(|s| *s == Status::Simulated)),
        ("sampled", n(|s| *s == Status::Sampled)),
        ("shortened", n(|s| *s == Status::Shortened)),
        ("pruned", n(|s| *s == Status::Pruned)),
        ("failed", n(|s| matches!(s, Status::Failed(_)))),
    ];
    counts.into_iter().enumerate().filter(|(i, (_, n))| *i == 0 || *n > 0).map(|(_, c)| c).collect()
}

/// Reasons and how often each, most frequent first, of equal ones the first.
pub fn by_frequency<'a>(reasons: impl Iterator<Item = &'a str>) -> Vec<(&'a str, usize)> {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for reason in reasons {
        match counts.iter_mut().find(|(r, _)| *r == reason) {
            Some((_, n)) => *n += 1,
            None => counts.push((reason, 1)),
        }
    }
    counts.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    counts
}

/// Unit of the blocks' areas: an FPGA's blocks are told in gates, as they have no area.
pub fn area_unit(results: &Results) -> &'static str {
    if results.metrics.iter().any(|m| m.name == "area_mm2") { "mm2" } else { "gates" }
}

/// A text of at most `n` characters.
pub fn shortened(text: &str, n: usize) -> String {
    if text.chars().count() <= n {
        return text.to_owned();
    }
    text.chars().take(n.saturating_sub(3)).chain("...".chars()).collect()
}

/// What a sweep found, in a sentence.
pub fn summary(results: &Results, n_front: usize) -> String {
    let counts: Vec<String> =
        status_counts(results).into_iter().map(|(what, n)| format!("{n} {what}")).collect();
    let impossible = match results.impossible.len() {
        0 => String::new(),
        n => format!(", {n} impossible"),
    };
    let goals: Vec<&str> =
        results.metrics.iter().filter(|m| m.is_objective).map(|m| m.name.as_str()).collect();
    let front = match goals.len() {
        0 => String::new(),
        _ => format!("; {n_front} on the front of {}", goals.join(", ")),
    };
    format!("Of {} combinations {}{impossible}{front}.", results.n_combinations, counts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_take_prefixes_only_where_their_unit_does() {
        let cases = [
            (941_234.0, "1/s", "941 k/s"),
            (0.001_25, "s", "1.25 ms"),
            (1520.0, "mm2", "1520 mm2"),
            (63_100.0, "1/s/mm2", "63.1 k/s/mm2"),
            (0.5, "", "0.5000"),
            (25.0, "MHz", "25.00 MHz"),
        ];
        for (value, unit, text) in cases {
            assert_eq!(shown(value, unit), text);
        }
    }

    #[test]
    fn scaled_units_keep_numbers_of_axes_short() {
        assert_eq!(scaled_unit("1/s", 5e6), (1e-6, "10^6/s".to_owned()));
        assert_eq!(scaled_unit("s", 0.02), (10_f64.powi(3), "ms".to_owned()));
        assert_eq!(scaled_unit("mm2", 20.0), (1.0, "mm2".to_owned()));
        assert_eq!(scaled_unit("gates", 2e4), (1e-3, "10^3 gates".to_owned()));
        assert_eq!(scaled_unit("", 0.0), (1.0, String::new()));
    }

    #[test]
    fn reasons_are_counted_most_frequent_first() {
        assert_eq!(by_frequency(["a", "b", "c", "b"].into_iter()), [("b", 2), ("a", 1), ("c", 1)]);
        assert_eq!((shortened("abcdef", 5), shortened("abcde", 5)), ("ab...".to_owned(), "abcde".to_owned()));
    }
}
