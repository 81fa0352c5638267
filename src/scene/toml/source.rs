//! The text of a file of ours: how it is read, and how faults and warnings point into it.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::ops::Range;
use std::path::Path;

use super::super::SceneError;
use super::super::error::line_column;

/// Largest file (bytes): a scene of about a million surfaces.
pub(crate) const MAX_FILE_BYTES: u64 = 64 << 20;

/// What [`read`] expects of a scene.
pub(crate) const SCENE: &str = "a scene file";

/// A file in memory.
pub(crate) struct Source<'a> {
    /// Where it came from, for messages.
    pub(crate) path: &'a Path,
    /// All of it.
    pub(crate) text: &'a str,
}

impl Source<'_> {
    /// A fault at a byte range.
    pub(crate) fn fault(&self, span: Range<usize>, message: impl Into<String>) -> SceneError {
        SceneError::at(self.path, self.text, span, message)
    }

    /// A warning at a byte range, as one line.
    pub(crate) fn warning(&self, span: Range<usize>, message: &str) -> String {
        let (line, column) = line_column(self.text, span.start);
        format!("{}:{line}:{column}: {message}", self.path.display())
    }

    /// The text of a byte range, as it stands in the file.
    pub(crate) fn slice(&self, span: &Range<usize>) -> &str {
        self.text.get(span.clone()).unwrap_or("")
    }
}

/// Reads a whole file; `expected` says what it should be: "a scene file".
pub(crate) fn read(path: &Path, expected: &str) -> Result<String, SceneError> {
    let of_file = |message: String| SceneError::of_file(path, message);
    let mut file = File::open(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => of_file(format!("no such file, expected {expected}")),
        _ => of_file(format!("cannot be opened: {e}")),
    })?;
    let is_dir = file.metadata().map_err(|e| of_file(format!("cannot be read: {e}")))?.is_dir();
    if is_dir {
        let fault = of_file(format!("is a directory, expected {expected}"));
        let inside = path.join("scene.toml");
        return Err(if expected == SCENE && inside.is_file() {
            fault.with_help(format!("did you mean {}?", inside.display()))
        } else {
            fault
        });
    }
    // One byte beyond the limit tells a file of the limit from a longer one, also of pipes and devices.
    let mut bytes = Vec::new();
    (&mut file)
        .take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| of_file(format!("cannot be read: {e}")))?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(of_file(format!("larger than {} MiB, the limit of {expected}", MAX_FILE_BYTES >> 20)));
    }
    String::from_utf8(bytes).map_err(|e| not_text(path, &e))
}

fn not_text(path: &Path, error: &std::string::FromUtf8Error) -> SceneError {
    let at = error.utf8_error().valid_up_to();
    let valid = std::str::from_utf8(&error.as_bytes()[..at]).unwrap_or_default();
    let message = format!("byte 0x{:02x} at offset {at}, expected UTF-8 text", error.as_bytes()[at]);
    let mut fault = SceneError::at(path, valid, at..at, message);
    if let Some(place) = &mut fault.place {
        // Garbage is not for terminals.
        place.text.clear();
        place.span = 0..0;
    }
    fault
}
