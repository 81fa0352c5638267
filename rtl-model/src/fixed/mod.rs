//! Number formats and rounding: sign + fraction words in [-1, 1), widths chosen at run time.
//!
//! ```text
//! Formats {F, D, T, K, rounding} -> width of every wire (width_table) -> datapath, packet, memory image
//!                               +-> num, den -> division units -> t
//! ```
//! Not modelled: saturation. The width table leaves every wire room for its largest value, so nothing overflows.

pub mod division;
mod formats;
mod rounding;
mod width_table;
mod words;

pub use formats::{FormatError, Formats};
pub use rounding::Rounding;
pub use width_table::WireWidth;
pub(crate) use words::{clamp_to_i64, clamp_to_u8, index, round_to_word, word_count};
