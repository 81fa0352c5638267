//! Rows of an experiment, as text for the terminal, as Markdown and as CSV.
//!
//! ```text
//! Table: columns, rows of cells --text--> aligned lines   --markdown--> a table of docs/board.md   --csv--> a file
//! ```
//! Text and Markdown show numbers to three or four digits, CSV in full.

use std::fmt::Write as _;

/// A value of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A name.
    Text(String),
    /// A count.
    Count(u64),
    /// A measured or computed number.
    Number(f64),
    /// A number that is to be compared: shown to seven digits.
    Precise(f64),
    /// Not measured.
    None,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Cell {
        Cell::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Cell {
        Cell::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Cell {
        Cell::Count(count)
    }
}

impl From<u32> for Cell {
    fn from(count: u32) -> Cell {
        Cell::Count(count.into())
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Cell {
        Cell::Number(number)
    }
}

/// A row of cells from values of any of their types.
macro_rules! row {
    ($($value:expr),* $(,)?) => { vec![$($crate::experiments::table::Cell::from($value)),*] };
}
pub(super) use row;

/// Rows under named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What its rows are; also the name of its CSV file, in lower case with hyphens.
    pub title: String,
    /// Names with units.
    pub columns: Vec<&'static str>,
    /// A cell a column.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table.
    pub fn new(title: &str, columns: &[&'static str]) -> Table {
        Table { title: title.to_owned(), columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// When it has not a cell a column.
    pub fn push(&mut self, row: Vec<Cell>) {
        assert_eq!(row.len(), self.columns.len(), "a row of '{}'", self.title);
        self.rows.push(row);
    }

    /// Aligned lines under the title.
    pub fn text(&self) -> String {
        let shown: Vec<Vec<String>> =
            self.rows.iter().map(|row| row.iter().map(Cell::shown).collect()).collect();
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|c| {
                let cells = shown.iter().map(|row| row[c].chars().count());
                cells.max().unwrap_or(0).max(self.columns[c].chars().count())
            })
            .collect();
        let mut out = format!("{}\n", self.title);
        let mut line = |cells: &[String]| {
            let padded: Vec<String> = (cells.iter().zip(&widths).enumerate())
                .map(|(c, (cell, &width))| match self.is_text(c) {
                    true => format!("{cell:<width$}"),
                    false => format!("{cell:>width$}"),
                })
                .collect();
            let _ = writeln!(out, "  {}", padded.join("  ").trim_end());
        };
        line(&self.columns.iter().map(|c| (*c).to_owned()).collect::<Vec<_>>());
        shown.iter().for_each(|row| line(row));
        out
    }

    /// A Markdown table.
    pub fn markdown(&self) -> String {
        let mut out = String::new();
        let mut line = |cells: Vec<String>| {
            let _ = writeln!(out, "| {} |", cells.join(" | "));
        };
        line(self.columns.iter().map(|c| (*c).to_owned()).collect());
        line(
            (0..self.columns.len())
                .map(|c| if self.is_text(c) { "---" } else { "---:" }.to_owned())
                .collect(),
        );
        self.rows.iter().for_each(|row| line(row.iter().map(Cell::shown).collect()));
        out
    }

    /// Comma-separated values, a header first.
    pub fn csv(&self) -> String {
        let quoted = |text: &str| match text.contains([',', '"']) {
            true => format!("\"{}\"", text.replace('"', "\"\"")),
            false => text.to_owned(),
        };
        let mut out = self.columns.iter().map(|c| quoted(c)).collect::<Vec<_>>().join(",") + "\n";
        for row in &self.rows {
            let cells: Vec<String> = row
                .iter()
                .map(|cell| match cell {
                    Cell::Text(text) => quoted(text),
                    Cell::Count(n) => n.to_string(),
                    Cell::Number(x) | Cell::Precise(x) => x.to_string(),
                    Cell::None => String::new(),
                })
                .collect();
            out += &(cells.join(",") + "\n");
        }
        out
    }

    /// The title as a part of a file's name.
    pub fn key(&self) -> String {
        let words = self.title.to_lowercase();
        let words = words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
        words.collect::<Vec<_>>().join("-")
    }

    fn is_text(&self, column: usize) -> bool {
        self.rows.iter().any(|row| matches!(row[column], Cell::Text(_)))
    }
}

impl Cell {
    fn shown(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Count(n) => n.to_string(),
            Cell::Number(x) => digits(*x),
            Cell::Precise(x) => precise(*x),
            Cell::None => "-".to_owned(),
        }
    }
}

/// Seven significant digits; fixed notation from a thousandth up.
fn precise(x: f64) -> String {
    let m = x.abs();
    if m == 0.0 {
        return "0".to_owned();
    }
    if m < 1e-3 {
        return format!("{x:.2e}");
    }
    let places = 6 - m.log10().floor().clamp(-3.0, 6.0) as i32;
    format!("{x:.*}", places as usize)
}

/// Three or four significant digits in fixed notation.
pub fn digits(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        m if m >= 1000.0 => format!("{x:.0}"),
        m if m >= 100.0 => format!("{x:.1}"),
        m if m >= 10.0 => format!("{x:.2}"),
        m if m >= 0.01 => format!("{x:.3}"),
        m if m >= 0.000_1 => format!("{x:.5}"),
        _ => format!("{x:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("Waits, by load", &["server", "rho", "wait (cycles)", "n"]);
        table.push(row!["a, b", 0.5, 1234.5, 7_u64]);
        table.push(vec!["c".into(), 0.25.into(), Cell::None, 12_u32.into()]);
        table
    }

    #[test]
    fn table_as_text_aligns_names_left_and_numbers_right() {
        let expected = "Waits, by load
  server    rho  wait (cycles)   n
  a, b    0.500           1234   7
  c       0.250              -  12
";
        assert_eq!(table().text(), expected);
    }

    #[test]
    fn table_as_csv_quotes_commas_and_keeps_all_digits() {
        assert_eq!(table().csv(), "server,rho,wait (cycles),n\n\"a, b\",0.5,1234.5,7\nc,0.25,,12\n");
    }

    #[test]
    fn table_as_markdown_has_a_rule_under_its_header() {
        let text = table().markdown();
        assert_eq!(text.lines().nth(1), Some("| --- | ---: | ---: | ---: |"), "{text}");
        assert_eq!(text.lines().count(), 4);
        assert_eq!(table().key(), "waits-by-load");
    }

    #[test]
    fn digits_of_any_magnitude_are_three_or_more() {
        let cases = [
            (0.0, "0"),
            (66_666.7, "66667"),
            (123.45, "123.5"),
            (-12.345, "-12.35"),
            (1.0, "1.000"),
            (0.000_123_4, "0.00012"),
            (1e-7, "1.00e-7"),
        ];
        for (x, text) in cases {
            assert_eq!(digits(x), text);
        }
    }
}
