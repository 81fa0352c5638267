//! Faults of a scene file, each with its place.
//!
//! ```text
//! (file, text, byte span, message, help) --> file:line:column: message     (+ what a terminal needs to show the line)
//! ```

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A fault of a scene file, or of another file of ours. `Display` is one line, `file:line:column: message`; line and
/// column are absent only when there is no text to point into (no such file, a directory, unreadable, too large).
///
/// Implements [`miette::Diagnostic`]: a binary can show the line itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong: the value and what was expected.
    pub message: String,
    /// Where in the file.
    pub place: Option<Box<Place>>,
    /// What to write instead, when that can be guessed.
    pub help: Option<String>,
}

/// A place in a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Byte range in [`Place::text`].
    pub span: Range<usize>,
    /// The text that `span` points into: the file, or nothing when the file is no text.
    pub text: String,
}

impl SceneError {
    /// A fault of the file as a whole.
    pub(crate) fn of_file(path: &Path, message: impl Into<String>) -> SceneError {
        SceneError { path: path.to_owned(), message: message.into(), place: None, help: None }
    }

    /// A fault at a byte range of the file's text.
    pub(crate) fn at(path: &Path, text: &str, span: Range<usize>, message: impl Into<String>) -> SceneError {
        let span = clamp_to_chars(text, span);
        let (line, column) = line_column(text, span.start);
        let place = Place { line, column, span, text: text.to_owned() };
        SceneError {
            path: path.to_owned(),
            message: one_line(&message.into()),
            place: Some(Box::new(place)),
            help: None,
        }
    }

    /// As [`SceneError::at`], for a file that may be too large to carry along: only the line of the fault is kept.
    pub(crate) fn at_line(
        path: &Path,
        text: &str,
        span: Range<usize>,
        message: impl Into<String>,
    ) -> SceneError {
        let span = clamp_to_chars(text, span);
        let (line, column) = line_column(text, span.start);
        let start = text[..span.start].rfind('\n').map_or(0, |i| i + 1);
        let end = text[span.start..].find('\n').map_or(text.len(), |i| span.start + i);
        // Empty lines before it keep its number right where the line is shown.
        let above = "\n".repeat(line - 1);
        let shown = above.clone() + &text[start..end].chars().take(MAX_MESSAGE_CHARS).collect::<String>();
        let moved = |i: usize| above.len() + i.saturating_sub(start);
        let span = clamp_to_chars(&shown, moved(span.start)..moved(span.end));
        let place = Place { line, column, span, text: shown };
        SceneError { place: Some(Box::new(place)), ..SceneError::of_file(path, one_line(&message.into())) }
    }

    /// The same fault with advice.
    pub(crate) fn with_help(mut self, help: impl Into<String>) -> SceneError {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(place) = &self.place {
            write!(f, ":{}:{}", place.line, place.column)?;
        }
        write!(f, ": {}", self.message)?;
        match &self.help {
            Some(help) => write!(f, " ({help})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for SceneError {}

impl miette::Diagnostic for SceneError {
    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        let place = self.place.as_ref().filter(|p| !p.text.is_empty())?;
        Some(&place.text)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = miette::LabeledSpan> + '_>> {
        let place = self.place.as_ref().filter(|p| !p.text.is_empty())?;
        Some(Box::new(std::iter::once(miette::LabeledSpan::underline(place.span.clone()))))
    }
}

/// Line and column (both from 1, column in characters) of a byte offset.
pub(crate) fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let before = &text[..offset];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// The longest message shown: a file may hold a string of megabytes where a number belongs.
const MAX_MESSAGE_CHARS: usize = 400;

/// `message` on one line, without control characters, at most [`MAX_MESSAGE_CHARS`] long.
fn one_line(message: &str) -> String {
    let mut line: String =
        message.chars().take(MAX_MESSAGE_CHARS).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if line.len() < message.len() {
        line.push_str("...");
    }
    line
}

/// `span` moved inward to lie in `text` on character borders.
fn clamp_to_chars(text: &str, span: Range<usize>) -> Range<usize> {
    let floor = |i: usize| (0..=i.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
    let start = floor(span.start);
    start..floor(span.end).max(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_column_after_multibyte_characters_counts_characters() {
        let text = "a = 1\nname = \"Wände\" # x\n";
        let at = text.find('#').unwrap();
        assert_eq!(line_column(text, at), (2, 16));
        assert_eq!(line_column(text, 0), (1, 1));
        assert_eq!(line_column(text, text.len()), (3, 1));
    }

    #[test]
    fn scene_error_of_a_huge_multiline_value_displays_one_short_line() {
        let e =
            SceneError::at(Path::new("s.toml"), "x\ny", 2..3, "bad\nvalue".to_owned() + &"z".repeat(9999));
        let shown = e.to_string();
        assert!(shown.starts_with("s.toml:2:1: bad value"), "{shown}");
        assert!(shown.len() < 500 && !shown.contains('\n'));
    }

    #[test]
    fn scene_error_beyond_the_text_or_inside_a_character_is_clamped() {
        let e = SceneError::at(Path::new("s"), "ä", 1..99, "m");
        assert_eq!(e.place.unwrap().span, 0..2);
    }
}
