//! Consumers of a run's events: what became of every ray, where stalls come from, how utilisation goes over time.
//!
//! ```text
//! chunks of Event --stream.rs: Decoder--> (cycle, Seen) --lives.rs-----> Lives: per ray its cycles by phase
//! Directory --places.rs--> Places: kinds, ends of links   --roots.rs-----> Roots: output full, followed downstream
//!                                                         --intervals.rs-> Intervals: causes by kind of block over time
//! ```
//! All of them see the cycles in which the board is clocked: the host's side of an interrupt, which a command's
//! statistics also count, is not among them. Nothing here writes a file. A stream that no board can have told is an
//! error, so that files of events can be read back.

mod intervals;
mod lives;
mod places;
mod roots;
mod stream;

pub use intervals::{Interval, Intervals};
pub use lives::{LifeSums, Lives, RayLife};
pub use places::{BlockPlace, Kind, LinkPlace, Places};
pub use roots::{Root, Roots};
pub use stream::{Decoder, Seen, StreamError};

#[cfg(test)]
mod tests;
