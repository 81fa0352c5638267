//! The datapath's functions again, in f64 with error-free transformations: what "bit-exact" is measured against.
//!
//! ```text
//! quantised words -> f64 (exact) -> expansions: sums of f64 that do not overlap, no bit lost -> rounded once, where
//!                                                                         the datapath rounds -> the same records
//! ```
//! Written from DESIGN 3.2 and 4, not from `datapath/`: no function is shared, only the record types. Candidates of a
//! ray come from its own search in f64, never from the board's cell lists. Not modelled: time, cells.

pub mod bundle;
mod expansion;
mod ray_patch;
mod search;
mod wire_values;

pub use ray_patch::{TriangleWires, Wires, intersect, wires};
pub use search::Oracle;
pub use wire_values::{WireDifference, WireName};
