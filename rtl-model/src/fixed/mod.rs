//! Number formats and rounding (DESIGN: sign + fraction words in [-1, 1), run-time widths).

mod formats;
mod rounding;

pub use formats::{FormatError, Formats, WireWidth};
pub use rounding::Rounding;
