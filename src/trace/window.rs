//! The window of a waveform or of slices: board clock cycles, from one up to another.

use std::str::FromStr;

use super::TraceError;
use crate::report::si::count;

/// Most cycles of a waveform or of slices, unless it is forced.
pub const MAX_CYCLES: u64 = 1_000_000;

/// Cycles `from..to`, `to` not among them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Window {
    /// The first cycle.
    pub from: u64,
    /// The first cycle after it; none: as far as the run goes.
    pub to: Option<u64>,
}

impl FromStr for Window {
    type Err = String;

    fn from_str(text: &str) -> Result<Window, String> {
        let expected = || "expected cycles FROM..TO, FROM.. or ..TO, like 1000..2000".to_owned();
        let (from, to) = text.split_once("..").ok_or_else(expected)?;
        let cycle = |text: &str| text.trim().parse::<u64>().map_err(|_| expected());
        let from = if from.trim().is_empty() { 0 } else { cycle(from)? };
        let to = if to.trim().is_empty() { None } else { Some(cycle(to)?) };
        if to.is_some_and(|to| to <= from) {
            return Err("expected a cycle TO after FROM".to_owned());
        }
        Ok(Window { from, to })
    }
}

impl Window {
    /// Checks that the window has at most [`MAX_CYCLES`], unless forced.
    ///
    /// # Errors
    /// [`TraceError::Window`].
    pub fn check(self, force: bool) -> Result<Window, TraceError> {
        match self.to {
            Some(to) if !force && to - self.from > MAX_CYCLES => Err(TraceError::Window(format!(
                "--window {}..{to}: {}, expected {MAX_CYCLES} at most, or --force",
                self.from,
                count(to - self.from, "cycles")
            ))),
            _ => Ok(self),
        }
    }

    /// The first cycle that is not inside; a window without end reaches as far as it may.
    pub fn end(self, force: bool) -> u64 {
        let farthest = if force { u64::MAX } else { self.from.saturating_add(MAX_CYCLES) };
        self.to.unwrap_or(farthest)
    }

    /// Checks that the run, which has come to cycle `now`, fits an endless window.
    ///
    /// # Errors
    /// [`TraceError::Window`] when it goes on beyond [`MAX_CYCLES`].
    pub fn check_run(self, force: bool, now: u64) -> Result<(), TraceError> {
        if self.to.is_none() && now > self.end(force) {
            return Err(TraceError::Window(format!(
                "the run goes on beyond cycle {}, and a waveform or slices take {MAX_CYCLES} cycles at most: expected \
                 --window FROM..TO, or --force",
                self.end(force)
            )));
        }
        Ok(())
    }

    /// Checks that the run, which ended at cycle `end`, has cycles in the window.
    ///
    /// # Errors
    /// [`TraceError::Window`] when it hasn't.
    pub fn check_end(self, end: u64) -> Result<(), TraceError> {
        if self.from < end {
            return Ok(());
        }
        Err(TraceError::Window(format!(
            "--window begins with cycle {}: expected one of the run's, 0 to {}",
            self.from,
            end.saturating_sub(1)
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_of_cycles_parses_and_others_say_what_was_expected() {
        let window = |text: &str| text.parse::<Window>();
        assert_eq!(window("10..20"), Ok(Window { from: 10, to: Some(20) }));
        assert_eq!(window("10.."), Ok(Window { from: 10, to: None }));
        assert_eq!(window("..20"), Ok(Window { from: 0, to: Some(20) }));
        for bad in ["", "10", "a..20", "-1..5", "1...5", "1..2..3", "1.5..3"] {
            assert!(window(bad).unwrap_err().contains("FROM..TO"), "{bad}");
        }
        assert!(window("20..20").unwrap_err().contains("after FROM"));
    }

    #[test]
    fn window_over_a_million_cycles_is_refused_unless_forced() {
        let wide = Window { from: 5, to: Some(MAX_CYCLES + 6) };
        assert!(wide.check(false).unwrap_err().to_string().contains("--force"));
        assert!(wide.check(true).is_ok());
        assert!(Window { from: 5, to: Some(MAX_CYCLES + 5) }.check(false).is_ok());
        let open = Window { from: 5, to: None };
        assert!(open.check_run(false, MAX_CYCLES + 5).is_ok());
        assert!(open.check_run(false, MAX_CYCLES + 6).unwrap_err().to_string().contains("--window"));
        assert!(open.check_run(true, u64::MAX).is_ok());
        assert!(wide.check_run(false, u64::MAX).is_ok(), "a window that ends needs no end of the run");
        assert!(open.check_end(6).is_ok());
        assert!(open.check_end(5).unwrap_err().to_string().contains("0 to 4"));
    }
}
