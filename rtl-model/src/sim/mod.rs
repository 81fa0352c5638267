//! Clock, FIFO, pipe, wire, account. Nothing here knows what a ray is.
//!
//! Two phases a cycle: blocks `tick` and see FIFOs and wires as they were at the start of the cycle; what they put in is
//! seen from the next cycle on, told apart by the cycle's number. So the order in which blocks tick changes nothing.

mod account;
mod event;
mod fifo;
mod pipe;
mod round_robin;
mod wire;

pub use account::{Accounts, Activity, BlockAccount, Cause};
pub use event::{
    CommandMark, Directory, Event, EventKind, EventLog, EventSink, Move, Observer, Phase, RayRef, Silent,
    activity_of,
};
pub use fifo::{Fifo, FifoStatistics, LinkState, Token};
pub use pipe::Pipe;
pub use round_robin::{for_each_bit, next_in_turn, next_set_bit};
pub use wire::{Wire, Wires};

/// A count of board clock cycles.
pub type Cycle = u64;

/// The stamp of what has not happened: no cycle, and no cycle's predecessor.
const NEVER: Cycle = u64::MAX - 1;
