//! Events decoded: masks put together, cycles made whole, places checked.
//!
//! ```text
//! Event, Event, Event... --Decoder--> (cycle, Seen)       Clock and Mask events vanish; Move is a mask of one ray
//! ```

use super::Places;
use crate::sim::{Cause, CommandMark, Cycle, Event, EventKind, Move, Phase, RayRef, activity_of};

/// What an event, or several together, tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// From this cycle on a block does this. (Fill and drain are still starved or idle.)
    Activity {
        /// The block.
        block: u16,
        /// What it does or waits for.
        cause: Cause,
    },
    /// A token goes into a link: it is inside from the next cycle on.
    Push {
        /// The link.
        link: u16,
        /// The token's payload.
        payload: u32,
    },
    /// A token leaves a link: its entry is free from the next cycle on.
    Pop {
        /// The link.
        link: u16,
        /// The token's payload.
        payload: u32,
    },
    /// Each ray of a mask has a token that goes from one phase to another.
    Rays {
        /// The block that moves them.
        block: u16,
        /// Their bundle's slot in the block's cluster.
        slot: u8,
        /// A bit per ray of the bundle.
        mask: u64,
        /// Phase that the tokens leave.
        from: Phase,
        /// Phase that they enter.
        to: Phase,
    },
    /// A slot of the block's cluster takes a bundle.
    Bundle {
        /// The bundle generator.
        block: u16,
        /// The slot.
        slot: u8,
        /// The bundle's number in its command or low-resolution cast.
        job: u32,
        /// The number of its first ray there.
        first_ray: u32,
    },
    /// A command starts, goes on or ends. The cycle of the end is the first that is not the command's.
    Command(CommandMark),
}

/// A stream that no board tells.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StreamError {
    /// Bits that no event has.
    #[error("event {at}: {bits:#018x} is no event")]
    NoEvent {
        /// Which event.
        at: u64,
        /// Its bits.
        bits: u64,
    },
    /// A block or link that the directory doesn't have.
    #[error("event {at}: {what} {number}, but the directory has {n}")]
    Place {
        /// Which event.
        at: u64,
        /// `block` or `link`.
        what: &'static str,
        /// The number.
        number: u16,
        /// How many there are.
        n: usize,
    },
    /// An event where it cannot be.
    #[error("event {at}: {what}")]
    Order {
        /// Which event.
        at: u64,
        /// What is wrong.
        what: &'static str,
    },
    /// Tokens that cannot have moved so.
    #[error("cycle {cycle}: {what}")]
    Tokens {
        /// When.
        cycle: Cycle,
        /// What is wrong, with the ray or link.
        what: String,
    },
    /// A directory whose names are not those of a board's blocks and links.
    #[error("directory: {0}")]
    Directory(String),
}

/// What a decoder waits for.
#[derive(Clone, Copy, Debug)]
enum Pending {
    Nothing,
    /// `n` of three mask events are in.
    Mask {
        n: u32,
        mask: u64,
        block: u16,
        moved: Move,
        slot: u8,
    },
    FirstRay {
        block: u16,
        slot: u8,
        job: u32,
    },
}

/// Decodes a stream, event by event.
#[derive(Clone, Debug)]
pub struct Decoder {
    n_blocks: usize,
    n_links: usize,
    /// Bits of the cycle above an event's own.
    clock: Option<u64>,
    latest: Cycle,
    n_events: u64,
    pending: Pending,
}

impl Decoder {
    /// A decoder at the start of a stream about `places`.
    pub fn new(places: &Places) -> Decoder {
        Decoder {
            n_blocks: places.blocks.len(),
            n_links: places.links.len(),
            clock: None,
            latest: 0,
            n_events: 0,
            pending: Pending::Nothing,
        }
    }

    /// Events so far.
    pub fn n_events(&self) -> u64 {
        self.n_events
    }

    /// Takes the next event; what it tells, if it ends something.
    ///
    /// # Errors
    /// An event that cannot be there.
    #[inline]
    pub fn read(&mut self, event: Event) -> Result<Option<(Cycle, Seen)>, StreamError> {
        let at = self.n_events;
        self.n_events += 1;
        let Some(kind) = event.kind() else { return Err(StreamError::NoEvent { at, bits: event.0 }) };
        let payload = event.payload();
        if kind == EventKind::Clock {
            self.clock = Some(u64::from(payload));
            return Ok(None);
        }
        let Some(clock) = self.clock else { return Err(order(at, "before the first clock event")) };
        let now = event.cycle(clock);
        if now < self.latest {
            return Err(order(at, "earlier than the one before it"));
        }
        self.latest = now;
        match (kind, self.pending) {
            (EventKind::Mask, Pending::Mask { n, mask, block, moved, slot }) => {
                let mask = mask | u64::from(payload) << (28 * n);
                if n < 2 {
                    self.pending = Pending::Mask { n: n + 1, mask, block, moved, slot };
                    return Ok(None);
                }
                self.pending = Pending::Nothing;
                return Ok(Some((now, Seen::Rays { block, slot, mask, from: moved.from, to: moved.to })));
            }
            (EventKind::FirstRay, Pending::FirstRay { block, slot, job }) => {
                self.pending = Pending::Nothing;
                return Ok(Some((now, Seen::Bundle { block, slot, job, first_ray: payload })));
            }
            (EventKind::Mask | EventKind::FirstRay, _) => {
                return Err(order(at, "follows nothing that it ends"));
            }
            (_, Pending::Nothing) => {}
            _ => return Err(order(at, "another event was to come")),
        }
        let place = event.place();
        let (what, n) = match kind {
            EventKind::Push | EventKind::Pop => ("link", self.n_links),
            _ => ("block", self.n_blocks),
        };
        if usize::from(place) >= n {
            return Err(StreamError::Place { at, what, number: place, n });
        }
        let seen = match kind {
            EventKind::Activity => Seen::Activity { block: place, cause: activity_of(payload) },
            EventKind::Push => Seen::Push { link: place, payload },
            EventKind::Pop => Seen::Pop { link: place, payload },
            EventKind::Move => {
                let (Move { from, to }, RayRef { slot, index }) = Move::of_payload(payload);
                Seen::Rays { block: place, slot, mask: 1 << index, from, to }
            }
            EventKind::Moves => {
                let (moved, ray) = Move::of_payload(payload);
                self.pending = Pending::Mask { n: 0, mask: 0, block: place, moved, slot: ray.slot };
                return Ok(None);
            }
            EventKind::Bundle => {
                let (slot, job) = ((payload >> 24) as u8, payload & 0xff_ffff);
                self.pending = Pending::FirstRay { block: place, slot, job };
                return Ok(None);
            }
            EventKind::Command => match CommandMark::of_payload(payload) {
                Some(mark) => Seen::Command(mark),
                None => return Err(StreamError::NoEvent { at, bits: event.0 }),
            },
            EventKind::Clock | EventKind::Mask | EventKind::FirstRay => return Ok(None),
        };
        Ok(Some((now, seen)))
    }
}

fn order(at: u64, what: &'static str) -> StreamError {
    StreamError::Order { at, what }
}
