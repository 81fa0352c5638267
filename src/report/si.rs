//! Numbers as people read them: SI prefixes with units, percentages.

use glam::DVec3;

/// `value` with an SI prefix and at least three significant digits: `12.3 Mrays`, `941 krays/s`, `50.1 mW`.
pub fn si(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 8] =
        [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n")];
    if value == 0.0 || !value.is_finite() {
        return format!("{value} {unit}");
    }
    // A value that rounds up to 1000 of one prefix belongs to the next.
    let magnitude = value.abs() * 1.000_5;
    let (scale, prefix) =
        PREFIXES.into_iter().find(|(scale, _)| magnitude >= *scale).unwrap_or(PREFIXES[PREFIXES.len() - 1]);
    format!("{} {prefix}{unit}", three_digits(value / scale))
}

/// A count with an SI prefix; below 10,000 the number itself.
pub fn count(value: u64, unit: &str) -> String {
    if value < 10_000 { format!("{value} {unit}") } else { si(value as f64, unit) }
}

/// Bytes in binary prefixes: `640 B`, `1.25 MiB`.
pub fn bytes(value: u64) -> String {
    let mut x = value as f64;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if x < 1023.5 {
            return if unit == "B" { format!("{value} B") } else { format!("{} {unit}", three_digits(x)) };
        }
        x /= 1024.0;
    }
    format!("{} TiB", three_digits(x))
}

/// A share as a percentage with sensible digits: `54.1 %`, `0.012 %`.
pub fn percent(share: f64) -> String {
    format!("{} %", three_digits(100.0 * share))
}

/// Part of a whole, 0 of nothing.
pub fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

/// A position or direction in a message: `0.5, -2, 3e300`.
pub fn vector(v: DVec3) -> String {
    v.to_array().map(number).join(", ")
}

/// A number as short as it can be told exactly: extreme magnitudes with an exponent, not with rows of zeros.
pub fn number(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-4..1e7 => format!("{value}"),
        _ => format!("{value:e}"),
    }
}

/// A value of a table: four significant digits, in fixed notation where that is readable.
pub fn significant(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        m if (999.5..1e7).contains(&m) => format!("{value:.0}"),
        m if (99.95..999.5).contains(&m) => format!("{value:.1}"),
        m if (9.995..99.95).contains(&m) => format!("{value:.2}"),
        m if (0.9995..9.995).contains(&m) => format!("{value:.3}"),
        m if (0.001..0.9995).contains(&m) => format!("{value:.4}"),
        _ => format!("{value:.3e}"),
    }
}

/// Three significant digits in fixed notation where that is readable, in scientific where not.
fn three_digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        m if m >= 99.95 => format!("{value:.0}"),
        m if m >= 9.995 => format!("{value:.1}"),
        m if m >= 0.999_5 => format!("{value:.2}"),
        m if m >= 0.1 => format!("{value:.3}"),
        m if m >= 0.001 => format!("{value:.4}"),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vector_with_extreme_components_stays_short() {
        assert_eq!(vector(DVec3::new(0.5, -2.0, 3e300)), "0.5, -2, 3e300");
        assert_eq!(vector(DVec3::new(0.0, -1e-70, 1e6)), "0, -1e-70, 1000000");
        assert_eq!(number(f64::INFINITY), "inf");
    }

    #[test]
    fn si_of_round_values_picks_the_prefix() {
        let cases = [
            (0.0, "0 W"),
            (1.0, "1.00 W"),
            (999.96, "1.00 kW"),
            (941_234.0, "941 kW"),
            (12_345_678.0, "12.3 MW"),
            (-0.0501, "-50.1 mW"),
            (2e-12, "0.0020 nW"),
        ];
        for (value, text) in cases {
            assert_eq!(si(value, "W"), text, "{value}");
        }
        assert_eq!(si(f64::INFINITY, "W"), "inf W");
    }

    #[test]
    fn significant_digits_of_tables_are_four_where_that_is_readable() {
        let cases = [(0.0, "0"), (208.333, "208.3"), (1.0, "1.000"), (20.0, "20.00"), (12_345.6, "12346")];
        for (value, text) in cases {
            assert_eq!(significant(value), text);
        }
        assert_eq!(significant(2.5e-5), "2.500e-5");
        assert_eq!(significant(-0.25), "-0.2500");
    }

    #[test]
    fn bytes_below_a_kibibyte_are_exact_and_above_have_three_digits() {
        assert_eq!(bytes(640), "640 B");
        assert_eq!(bytes(1024), "1.00 KiB");
        assert_eq!(bytes(1_310_720), "1.25 MiB");
    }

    #[test]
    fn count_below_ten_thousand_is_exact() {
        assert_eq!(count(9_999, "rays"), "9999 rays");
        assert_eq!(count(65_536, "rays"), "65.5 krays");
    }

    #[test]
    fn percent_of_small_and_large_shares_keeps_three_digits() {
        assert_eq!(percent(0.541), "54.1 %");
        assert_eq!(percent(0.000_123), "0.0123 %");
        assert_eq!(percent(0.0), "0 %");
        assert_eq!(share(1, 0), 0.0);
    }
}
