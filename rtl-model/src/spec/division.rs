//! The division unit of the ICUs: its parameters, and what it makes of the ICU's timing.
//!
//! ```text
//! [division], formats --> Divider | none: the division is a part of icu.depth
//! depth = icu.depth + latency        interval = max(icu.initiation_interval, division's)
//! ```
//! A named unit stands behind the `icu.depth` stages up to the division, and every test passes it, hit or not: a unit
//! that divides for hits only would need a buffer to keep the order of results. Not modelled: that buffer.
//! Arithmetic, latency and widths: [`crate::fixed::division`]. The answers are the same whatever the unit.

use serde::{Deserialize, Serialize};

use super::{BoardSpec, IcuSpec, IcuUnit};
use crate::fixed::Formats;
use crate::fixed::division::{
    Divider, DividerForm, DividerFormat, DivisionError, Newton, NewtonParameters, NonRestoring,
};

/// How an ICU divides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DivisionUnit {
    /// Within `icu.depth`, of no stated kind.
    #[default]
    InPipeline,
    /// Digit recurrence behind the pipeline.
    NonRestoring,
    /// Reciprocal table and Newton-Raphson behind the pipeline.
    Newton,
}

/// The division unit of the ICUs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DivisionSpec {
    /// Which unit.
    pub unit: DivisionUnit,
    /// Non-restoring: log2 of the radix = quotient bits a cycle, 1..=4.
    pub radix_log2: u32,
    /// One row or multiplier used again and again, or hardware for each cycle.
    pub form: DividerForm,
    /// Newton: index bits of the reciprocal table, 1..=12.
    pub table_bits: u32,
    /// Newton: iterations, 0..=5, enough for `formats.t_frac_bits` with these table bits.
    pub iterations: u32,
    /// Newton: cycles of a multiplication, 1..=16.
    pub multiplier_cycles: u32,
}

impl Default for DivisionSpec {
    fn default() -> Self {
        DivisionSpec {
            unit: DivisionUnit::InPipeline,
            radix_log2: 1,
            form: DividerForm::Unrolled,
            table_bits: 8,
            iterations: 2,
            multiplier_cycles: 1,
        }
    }
}

impl DivisionSpec {
    fn newton(&self) -> NewtonParameters {
        NewtonParameters {
            table_bits: self.table_bits,
            iterations: self.iterations,
            multiplier_cycles: self.multiplier_cycles,
        }
    }

    /// The unit named, or `None` for a division in the pipeline.
    ///
    /// # Errors
    /// A parameter of the unit outside its range, or one that leaves the quotient inexact.
    pub fn divider(&self, formats: &Formats) -> Result<Option<Divider>, DivisionError> {
        let format = DividerFormat::of(formats);
        Ok(match self.unit {
            DivisionUnit::InPipeline => None,
            DivisionUnit::NonRestoring => {
                Some(Divider::NonRestoring(NonRestoring::new(format, self.radix_log2, self.form)?))
            }
            DivisionUnit::Newton => Some(Divider::Newton(Newton::new(format, self.newton(), self.form)?)),
        })
    }

    /// Checks the ranges of all parameters, and the unit named.
    pub(super) fn validate(&self, formats: &Formats) -> Result<(), DivisionError> {
        NonRestoring::new(DividerFormat::of(formats), self.radix_log2, self.form)?;
        self.newton().validate()?;
        self.divider(formats).map(|_| ())
    }
}

/// What an ICU's blocks are built to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IcuTiming {
    /// Cycles between two tests.
    pub initiation_interval: u32,
    /// Latency of a test in cycles.
    pub depth: u32,
}

impl BoardSpec {
    /// The division unit of a valid board, if one is named.
    pub fn divider(&self) -> Option<Divider> {
        self.division.divider(&self.formats).ok().flatten()
    }

    /// Depth and initiation interval of a valid board's ICUs, the division unit included.
    pub fn icu_timing(&self) -> IcuTiming {
        let IcuSpec { unit, cordic_bits: n, initiation_interval, depth } = self.icu;
        let timing = |initiation_interval, depth| IcuTiming { initiation_interval, depth };
        match unit {
            IcuUnit::FixedPipelined => {
                self.divider().map_or(timing(initiation_interval, depth), |unit| IcuTiming {
                    initiation_interval: initiation_interval.max(unit.initiation_interval_cycles()),
                    depth: depth + unit.latency_cycles(),
                })
            }
            IcuUnit::CordicUnfolded => timing(1, 3 * (n + 4) + 20),
            IcuUnit::CordicSerial => timing(3 * n, 3 * n),
            IcuUnit::SubdivisionFast => timing(375, 375),
            IcuUnit::SubdivisionSlow => timing(3500, 3500),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(text: &str) -> IcuTiming {
        BoardSpec::from_toml(text).unwrap().icu_timing()
    }

    #[test]
    fn icu_timing_without_a_named_unit_is_that_of_the_icu() {
        assert_eq!(BoardSpec::default().icu_timing(), IcuTiming { initiation_interval: 1, depth: 22 });
        assert!(BoardSpec::default().divider().is_none());
        let text = "[icu]\ninitiation_interval = 3\ndepth = 7\n[division]\nradix_log2 = 4";
        assert_eq!(timing(text), IcuTiming { initiation_interval: 3, depth: 7 });
    }

    #[test]
    fn icu_timing_of_units_from_the_literature_is_theirs() {
        let cases = [
            ("cordic-unfolded", 1, 3 * 28 + 20),
            ("cordic-serial", 72, 72),
            ("subdivision-fast", 375, 375),
            ("subdivision-slow", 3500, 3500),
        ];
        for (unit, initiation_interval, depth) in cases {
            let text = format!("[icu]\nunit = \"{unit}\"");
            assert_eq!(timing(&text), IcuTiming { initiation_interval, depth }, "{unit}");
        }
    }

    #[test]
    fn icu_timing_with_a_named_unit_adds_its_latency_and_takes_the_longer_interval() {
        let cases = [
            ("unit = \"non-restoring\"", 1, 22 + 30),
            ("unit = \"non-restoring\"\nform = \"serial\"\nradix_log2 = 2", 17, 22 + 17),
            ("unit = \"newton\"", 1, 22 + 11),
            ("unit = \"newton\"\nform = \"serial\"\nmultiplier_cycles = 2", 21, 22 + 21),
            ("unit = \"newton\"\ntable_bits = 3\niterations = 3", 1, 22 + 13),
        ];
        for (text, initiation_interval, depth) in cases {
            assert_eq!(
                timing(&format!("[division]\n{text}")),
                IcuTiming { initiation_interval, depth },
                "{text}"
            );
        }
        let slower =
            "[icu]\ninitiation_interval = 40\n[division]\nunit = \"non-restoring\"\nform = \"serial\"";
        assert_eq!(timing(slower), IcuTiming { initiation_interval: 40, depth: 22 + 30 });
    }

    #[test]
    fn divider_of_the_spec_is_the_one_named() {
        let named = |unit| DivisionSpec { unit, ..DivisionSpec::default() }.divider(&Formats::default());
        assert_eq!(named(DivisionUnit::InPipeline), Ok(None));
        assert!(matches!(named(DivisionUnit::NonRestoring), Ok(Some(Divider::NonRestoring(_)))));
        assert!(matches!(named(DivisionUnit::Newton), Ok(Some(Divider::Newton(_)))));
    }

    #[test]
    fn division_faults_are_named_with_value_and_range() {
        let cases = [
            ("radix_log2 = 0", "division.radix_log2 = 0: expected 1 to 4"),
            ("radix_log2 = 5", "division.radix_log2 = 5: expected 1 to 4"),
            ("table_bits = 0", "division.table_bits = 0: expected 1 to 12"),
            ("table_bits = 13", "division.table_bits = 13: expected 1 to 12"),
            ("iterations = 6", "division.iterations = 6: expected 0 to 5"),
            ("multiplier_cycles = 0", "division.multiplier_cycles = 0: expected 1 to 16"),
            ("multiplier_cycles = 17", "division.multiplier_cycles = 17: expected 1 to 16"),
            ("unit = \"srt\"", "line 2, column 8"),
            ("radix = 2", "line 2"),
            ("unit = \"newton\"\niterations = 1", "expected under 1: iterations = 2"),
            ("unit = \"newton\"\ntable_bits = 6", "expected under 1: table_bits = 7 or iterations = 3"),
        ];
        for (text, expected) in cases {
            let message = BoardSpec::from_toml(&format!("[division]\n{text}")).expect_err(text).to_string();
            assert!(message.contains(expected), "{text:?} gave {message:?}, expected {expected:?}");
        }
        // The bound matters only to the unit that needs it.
        assert!(BoardSpec::from_toml("[division]\nunit = \"non-restoring\"\niterations = 0").is_ok());
    }

    #[test]
    fn watchdog_must_outlast_the_division() {
        let refused = |watchdog_cycles: u32, division: &str| {
            let text =
                format!("watchdog_cycles = {watchdog_cycles}\n[icu]\ndepth = 4000\n[division]\n{division}");
            BoardSpec::from_toml(&text).is_err()
        };
        // All other latencies of the default board take 675 cycles; the unit, 30 more in depth, 29 more in interval.
        let serial = "unit = \"non-restoring\"\nform = \"serial\"";
        assert!(refused(4674, "") && !refused(4675, ""));
        assert!(refused(4733, serial) && !refused(4734, serial));
    }
}
