//! What is wrong with a vectors file, and where.

use std::fmt;

/// Longest part of a value that a message repeats (characters).
const SHOWN: usize = 40;

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of text, from 1.
    Line(usize),
    /// A byte of a binary file, from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    /// As it follows a file's name: `:12`, ` byte 48`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(f, ":{line}"),
            Place::Byte(byte) => write!(f, " byte {byte}"),
        }
    }
}

/// A field that cannot be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Which field, or which record.
    pub field: String,
    /// What stands there.
    pub value: String,
    /// What was expected.
    pub expected: String,
}

impl Fault {
    /// A fault; long values are cut.
    pub fn new(field: impl Into<String>, value: impl ToString, expected: impl Into<String>) -> Fault {
        let value = value.to_string();
        let value = match value.char_indices().nth(SHOWN) {
            Some((end, _)) => format!("{}...", &value[..end]),
            None => value,
        };
        Fault { field: field.into(), value, expected: expected.into() }
    }

    /// With its place.
    pub fn at(self, place: Place) -> VectorsError {
        VectorsError { place, fault: self }
    }
}

/// A fault with its place; a caller puts the file's name in front.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {} is {}, expected {}", fault.field, fault.value, fault.expected)]
pub struct VectorsError {
    /// Where.
    pub place: Place,
    /// What.
    pub fault: Fault,
}
