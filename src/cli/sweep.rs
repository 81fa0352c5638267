//! The values of `verify --sweep`: `NAME=FROM..TO[:STEP]`, both ends included, TO also where the steps miss it.
//!
//! ```text
//! text, board --parse--> Sweep: parameter, a board a value
//! ```

use rtl_model::spec::BoardSpec;

use super::CliError;

/// The parameters that can be swept.
const PARAMETERS: [&str; 5] =
    ["coord_frac_bits", "dir_frac_bits", "t_frac_bits", "cross_keep_bits", "frac_bits"];

/// A sweep as meant.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sweep {
    /// What changes.
    pub(super) parameter: &'static str,
    /// Value and board of each run.
    pub(super) boards: Vec<(u32, BoardSpec)>,
}

impl Sweep {
    /// The sweep that `text` asks for, of the board `spec`.
    ///
    /// # Errors
    /// Another form, an unknown parameter, a value outside its range, with the range.
    pub(super) fn parse(text: &str, spec: &BoardSpec) -> Result<Sweep, CliError> {
        let fault = |what: String| CliError::Usage(format!("--sweep {text}: {what}"));
        let form = || {
            fault("expected NAME=FROM..TO or NAME=FROM..TO:STEP, such as coord_frac_bits=8..28:4".to_owned())
        };
        let (name, range) = text.split_once('=').ok_or_else(form)?;
        let parameter = PARAMETERS.into_iter().find(|p| *p == name.trim());
        let parameter = parameter
            .ok_or_else(|| fault(format!("'{}' is none of {}", name.trim(), PARAMETERS.join(", "))))?;
        let (from, rest) = range.split_once("..").ok_or_else(form)?;
        let (to, step) = rest.split_once(':').unwrap_or((rest, "1"));
        let whole = |what: &str, digits: &str| {
            let digits = digits.trim();
            digits.parse::<u32>().map_err(|_| fault(format!("{what} is '{digits}', expected a whole number")))
        };
        let (from, to, step) = (whole("FROM", from)?, whole("TO", to)?, whole("STEP", step)?);
        if step == 0 {
            return Err(fault("STEP is 0, expected 1 or more".to_owned()));
        }
        if from > to {
            return Err(fault(format!("FROM is {from}, expected at most TO, {to}")));
        }
        let mut boards = Vec::new();
        // No range of a format has more values than this.
        let values = (from..=to).step_by(step as usize).take(64);
        let last = Some(to).filter(|to| !(to - from).is_multiple_of(step));
        for value in values.chain(last) {
            let mut board = spec.clone();
            let f = &mut board.formats;
            match parameter {
                "coord_frac_bits" => f.coord_frac_bits = value,
                "dir_frac_bits" => f.dir_frac_bits = value,
                "t_frac_bits" => f.t_frac_bits = value,
                "cross_keep_bits" => f.cross_keep_bits = Some(value),
                _ => (f.coord_frac_bits, f.dir_frac_bits, f.t_frac_bits) = (value, value, value),
            }
            f.validate().map_err(|e| fault(e.to_string()))?;
            board.validate().map_err(|e| fault(e.to_string()))?;
            boards.push((value, board));
        }
        Ok(Sweep { parameter, boards })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Sweep, String> {
        Sweep::parse(text, &BoardSpec::default()).map_err(|e| e.to_string())
    }

    #[test]
    fn sweep_includes_both_ends_and_changes_only_its_parameter() {
        let sweep = parse("coord_frac_bits=8..28:10").unwrap();
        assert_eq!(sweep.parameter, "coord_frac_bits");
        assert_eq!(sweep.boards.iter().map(|b| b.0).collect::<Vec<_>>(), [8, 18, 28]);
        for (value, board) in &sweep.boards {
            let mut same = BoardSpec::default();
            same.formats.coord_frac_bits = *value;
            assert_eq!(board, &same);
        }
        let all = parse("frac_bits=10..12").unwrap();
        let widths = all
            .boards
            .iter()
            .map(|(_, b)| (b.formats.coord_frac_bits, b.formats.dir_frac_bits, b.formats.t_frac_bits));
        assert_eq!(widths.collect::<Vec<_>>(), [(10, 10, 10), (11, 11, 11), (12, 12, 12)]);
        let keep = parse("cross_keep_bits=16..48:16").unwrap();
        assert_eq!(keep.boards.len(), 3);
        assert_eq!(keep.boards[2].1.formats.cross_keep_bits, Some(48));
        let values = |text| parse(text).unwrap().boards.iter().map(|b| b.0).collect::<Vec<_>>();
        assert_eq!(values("coord_frac_bits=8..28:8"), [8, 16, 24, 28]);
        assert_eq!(values("coord_frac_bits=8..10:5"), [8, 10]);
        assert_eq!(parse("t_frac_bits=32..32").unwrap().boards.len(), 1);
        assert_eq!(parse("dir_frac_bits = 8 .. 9").unwrap().boards.len(), 2);
    }

    #[test]
    fn sweep_that_cannot_be_says_why_and_names_the_range() {
        let cases = [
            ("coord_frac_bits", "expected NAME=FROM..TO"),
            ("coord_frac_bits=8", "expected NAME=FROM..TO"),
            ("coords=8..9", "'coords' is none of coord_frac_bits,"),
            ("coord_frac_bits=7..9", "coord_frac_bits = 7 is outside 8..=28"),
            ("coord_frac_bits=8..29", "coord_frac_bits = 29 is outside 8..=28"),
            ("frac_bits=8..30", "coord_frac_bits = 29 is outside 8..=28"),
            ("t_frac_bits=8..4000000000", "t_frac_bits = 33 is outside 8..=32"),
            ("cross_keep_bits=4..49:45", "cross_keep_bits = 49 is outside 4..=48"),
            ("coord_frac_bits=9..8", "FROM is 9, expected at most TO, 8"),
            ("coord_frac_bits=8..29:20", "coord_frac_bits = 29 is outside 8..=28"),
            ("coord_frac_bits=8..9:0", "STEP is 0"),
            ("coord_frac_bits=8..x", "TO is 'x', expected a whole number"),
            ("coord_frac_bits=-8..9", "FROM is '-8', expected a whole number"),
            ("coord_frac_bits=8..9:1:1", "STEP is '1:1'"),
        ];
        for (text, what) in cases {
            let message = parse(text).unwrap_err();
            assert!(message.starts_with(&format!("--sweep {text}: ")) && message.contains(what), "{message}");
        }
    }
}
