//! What an observer of a run is told: every token move and every change of a block's activity, 8 bytes each.
//!
//! ```text
//! blocks, FIFOs, accounts --Event--> trait Observer: Silent (nothing, compiled away) | EventLog (chunks of events)
//! ```
//! An event, from its highest bit:
//!
//! | bits | field |
//! |---|---|
//! | 63..60 | kind |
//! | 59..48 | place: the number of a block or link in the board's [`Directory`] |
//! | 47..20 | payload, 28 bits, by kind |
//! | 19..0 | cycle, low 20 bits; a `Clock` event sets the bits above whenever they change |
//!
//! Rays and bundles are named by their slot in the cluster and the ray's place in the bundle; `Bundle` says which
//! bundle of the command a slot holds.

use super::{Activity, Cause, Cycle};

/// Bits of the cycle in an event.
const CYCLE_BITS: u32 = 20;
/// Bits of a payload.
const PAYLOAD_BITS: u32 = 28;
/// Bits of a place.
const PLACE_BITS: u32 = 12;

/// A record of 8 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event(pub u64);

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum EventKind {
    /// payload: bits of the cycle above the low 20, for all that follows.
    Clock = 0,
    /// place: a block; payload: [`Activity`] as [`activity_of`] decodes it, from this cycle on.
    Activity = 1,
    /// place: a link; payload: the token, as [`RayRef`] where it belongs to a ray. It is visible from the next cycle on.
    Push = 2,
    /// place: a link; payload as for `Push`. The entry is free from the next cycle on.
    Pop = 3,
    /// place: a block; payload: a ray and how its token moves, see [`Move`].
    Move = 4,
    /// place: a block; payload: slot and how the tokens of many of its rays move; three `Mask` events follow.
    Moves = 5,
    /// payload: the next bits of a 64-bit mask of rays, lowest first: 28, 28, 8.
    Mask = 6,
    /// place: the cluster's bundle generator; payload: bits 27..24 the slot, 23..0 the job's number in its command.
    Bundle = 7,
    /// A command starts or ends; payload: a [`CommandMark`].
    Command = 8,
    /// Follows `Bundle`; payload: number of the bundle's first ray in its command (or low-resolution cast).
    FirstRay = 9,
}

/// What a `Command` event marks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum CommandMark {
    /// Nearest hits are asked for.
    Nearest = 0,
    /// Hit bits are asked for.
    Any = 1,
    /// The low-resolution cast that precedes a command's bundles begins.
    LowResolution = 2,
    /// The command's bundles themselves begin.
    Bundles = 3,
    /// The last result is delivered; the host is interrupted.
    End = 4,
}

impl CommandMark {
    /// From the payload of a `Command` event.
    pub fn of_payload(payload: u32) -> Option<CommandMark> {
        use CommandMark as M;
        [M::Nearest, M::Any, M::LowResolution, M::Bundles, M::End].get(payload as usize).copied()
    }
}

/// A phase of a ray's life, the most advanced last but for `Away`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Phase {
    /// On the board with no token anywhere: waits for its bundle or its turn.
    Waiting = 0,
    /// In a CTU.
    Stepping = 1,
    /// Its cell is in a FIFO or the bundle table, on the way to the patch loader.
    Queued = 2,
    /// Its cell's list or a patch is being loaded, or waits for the ICU.
    Loading = 3,
    /// In the ICU.
    Testing = 4,
    /// Between ICU and reducer.
    Reducing = 5,
    /// Ended, and not yet delivered.
    Returning = 6,
    /// Not on the board: before it is generated, after it is delivered; of a token: there is none.
    Away = 7,
}

impl Phase {
    /// All phases that a life consists of, in order.
    pub const LIFE: [Phase; 7] = [
        Phase::Waiting,
        Phase::Stepping,
        Phase::Queued,
        Phase::Loading,
        Phase::Testing,
        Phase::Reducing,
        Phase::Returning,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Waiting => "waiting",
            Phase::Stepping => "stepping",
            Phase::Queued => "queued",
            Phase::Loading => "loading",
            Phase::Testing => "testing",
            Phase::Reducing => "reducing",
            Phase::Returning => "returning",
            Phase::Away => "away",
        }
    }

    fn from_bits(bits: u32) -> Phase {
        *Self::LIFE.get(bits as usize & 7).unwrap_or(&Phase::Away)
    }
}

/// A ray of a cluster: the slot of its bundle and its place in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RayRef {
    /// Bundle slot of the cluster, under 16.
    pub slot: u8,
    /// Place in the bundle, under 64.
    pub index: u8,
}

impl RayRef {
    /// Its place in a table of all rays of a cluster.
    #[inline]
    pub fn place(self) -> usize {
        usize::from(self.slot) << 6 | usize::from(self.index)
    }

    /// As the low bits of a payload: slot 4, index 6.
    #[inline]
    pub fn payload(self) -> u32 {
        u32::from(self.slot) << 6 | u32::from(self.index)
    }

    /// From the low 10 bits of a payload.
    pub fn of_payload(payload: u32) -> RayRef {
        RayRef { slot: (payload >> 6 & 15) as u8, index: (payload & 63) as u8 }
    }
}

/// A token of a ray goes from one phase to another; from or to [`Phase::Away`] it begins or ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Move {
    /// Phase that the token leaves.
    pub from: Phase,
    /// Phase that it enters.
    pub to: Phase,
}

impl Move {
    /// Payload of a `Move` or `Moves` event: from 3, to 3, slot 4, index 6 bits.
    #[inline]
    pub fn payload(self, ray: RayRef) -> u32 {
        (self.from as u32) << 13 | (self.to as u32) << 10 | ray.payload()
    }

    /// From a payload.
    pub fn of_payload(payload: u32) -> (Move, RayRef) {
        let phase = |at: u32| Phase::from_bits(payload >> at & 7);
        (Move { from: phase(13), to: phase(10) }, RayRef::of_payload(payload))
    }
}

/// The payload of an `Activity` event.
pub(super) fn activity_payload(activity: Activity, assigned: bool) -> u32 {
    match activity {
        Activity::Work => Cause::Work as u32,
        Activity::Stall(cause) => cause as u32,
        Activity::Idle => {
            if assigned {
                Cause::Starved as u32
            } else {
                Cause::Idle as u32
            }
        }
    }
}

/// The cause that an `Activity` event's payload names. (Fill and drain are told apart from idle only at a run's end.)
pub fn activity_of(payload: u32) -> Cause {
    *Cause::ALL.get(payload as usize).unwrap_or(&Cause::Idle)
}

impl Event {
    /// An event; a payload's bits above 28 are dropped.
    #[inline]
    pub fn new(now: Cycle, kind: EventKind, place: u16, payload: u32) -> Event {
        Event(
            (kind as u64) << 60
                | (u64::from(place) & ((1 << PLACE_BITS) - 1)) << 48
                | (u64::from(payload) & ((1 << PAYLOAD_BITS) - 1)) << CYCLE_BITS
                | now & ((1 << CYCLE_BITS) - 1),
        )
    }

    /// What happened; `None` for bits that no event has.
    pub fn kind(self) -> Option<EventKind> {
        use EventKind as K;
        [
            K::Clock,
            K::Activity,
            K::Push,
            K::Pop,
            K::Move,
            K::Moves,
            K::Mask,
            K::Bundle,
            K::Command,
            K::FirstRay,
        ]
        .get((self.0 >> 60) as usize)
        .copied()
    }

    /// The place.
    pub fn place(self) -> u16 {
        (self.0 >> 48 & ((1 << PLACE_BITS) - 1)) as u16
    }

    /// The payload.
    pub fn payload(self) -> u32 {
        (self.0 >> CYCLE_BITS & ((1 << PAYLOAD_BITS) - 1)) as u32
    }

    /// The cycle, given the bits above the low 20 that the last `Clock` event set.
    pub fn cycle(self, clock: u64) -> Cycle {
        clock << CYCLE_BITS | self.0 & ((1 << CYCLE_BITS) - 1)
    }
}

/// Who is told of a run's events. Static dispatch: an observer that ignores them costs nothing.
pub trait Observer {
    /// False when nobody looks: blocks then skip what only events need.
    const ON: bool;

    /// An event.
    fn event(&mut self, now: Cycle, kind: EventKind, place: u16, payload: u32);

    /// A ray's token moves.
    #[inline]
    fn ray(&mut self, now: Cycle, block: u16, ray: RayRef, from: Phase, to: Phase) {
        if Self::ON {
            self.event(now, EventKind::Move, block, Move { from, to }.payload(ray));
        }
    }

    /// A token each of the rays in `mask` moves.
    #[inline]
    fn rays(&mut self, now: Cycle, block: u16, slot: u8, mask: u64, from: Phase, to: Phase) {
        if Self::ON && mask != 0 {
            let ray = RayRef { slot, index: 0 };
            self.event(now, EventKind::Moves, block, Move { from, to }.payload(ray));
            for shift in [0, 28, 56] {
                self.event(now, EventKind::Mask, block, (mask >> shift) as u32 & ((1 << PAYLOAD_BITS) - 1));
            }
        }
    }
}

/// Nobody looks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {
    const ON: bool = false;

    #[inline]
    fn event(&mut self, _: Cycle, _: EventKind, _: u16, _: u32) {}
}

/// Events handed on at once, at most.
const CHUNK: usize = 1 << 15;

/// Takes events chunk by chunk.
pub type EventSink<'a> = &'a mut dyn FnMut(&[Event]);

/// Gathers events into chunks for a sink. The first event is a `Clock`.
pub struct EventLog<'a> {
    chunk: Box<[Event; CHUNK]>,
    /// Events of the chunk that are pending, under `CHUNK`.
    pending: usize,
    clock: u64,
    sink: EventSink<'a>,
}

impl std::fmt::Debug for EventLog<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("EventLog").field("pending", &self.pending).finish_non_exhaustive()
    }
}

impl<'a> EventLog<'a> {
    /// A log into `sink`.
    pub fn new(sink: EventSink<'a>) -> Self {
        EventLog { chunk: Box::new([Event(0); CHUNK]), pending: 0, clock: u64::MAX, sink }
    }

    /// Hands on what is pending.
    pub fn flush(&mut self) {
        (self.sink)(&self.chunk[..self.pending]);
        self.pending = 0;
    }

    /// The mask says what always holds, so that no bound needs a check.
    #[inline]
    fn put(&mut self, event: Event) {
        self.chunk[self.pending & (CHUNK - 1)] = event;
        self.pending += 1;
        if self.pending == CHUNK {
            self.hand_on();
        }
    }

    #[cold]
    #[inline(never)]
    fn hand_on(&mut self) {
        self.flush();
    }

    #[cold]
    #[inline(never)]
    fn set_clock(&mut self, now: Cycle) {
        self.clock = now >> CYCLE_BITS;
        self.put(Event::new(now, EventKind::Clock, 0, self.clock as u32));
    }
}

impl Observer for EventLog<'_> {
    const ON: bool = true;

    #[inline]
    fn event(&mut self, now: Cycle, kind: EventKind, place: u16, payload: u32) {
        if now >> CYCLE_BITS != self.clock {
            self.set_clock(now);
        }
        self.put(Event::new(now, kind, place, payload));
    }
}

/// Names of the places that events speak of.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Directory {
    /// Blocks by number: `cluster0.module0.icu`.
    pub blocks: Vec<String>,
    /// Links by number: name and depth in entries.
    pub links: Vec<(String, u32)>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn event_fields_come_back_as_they_went_in() {
        let event = Event::new((7 << 20) + 12345, EventKind::Pop, 4095, (1 << 28) - 3);
        assert_eq!(event.kind(), Some(EventKind::Pop));
        assert_eq!((event.place(), event.payload()), (4095, (1 << 28) - 3));
        assert_eq!(event.cycle(7), (7 << 20) + 12345);
        let ray = RayRef { slot: 13, index: 61 };
        let moved = Move { from: Phase::Testing, to: Phase::Away };
        assert_eq!(Move::of_payload(moved.payload(ray)), (moved, ray));
        assert_eq!(Event(u64::MAX).kind(), None);
    }

    #[test]
    fn event_log_sets_the_clock_first_and_whenever_its_upper_bits_change() {
        let mut seen = Vec::new();
        let mut sink = |events: &[Event]| seen.extend_from_slice(events);
        let mut log = EventLog::new(&mut sink);
        for now in [5, (1 << 20) - 1, 1 << 20, (3 << 20) + 9] {
            log.event(now, EventKind::Push, 1, 2);
        }
        log.rays(3 << 20, 9, 5, 0x8000_0001_0000_0003, Phase::Loading, Phase::Away);
        log.flush();
        let (mut clock, mut cycles) = (0, Vec::new());
        for event in &seen {
            match event.kind() {
                Some(EventKind::Clock) => clock = u64::from(event.payload()),
                Some(EventKind::Push) => cycles.push(event.cycle(clock)),
                _ => {}
            }
        }
        assert_eq!(cycles, [5, (1 << 20) - 1, 1 << 20, (3 << 20) + 9]);
        let mask = seen[seen.len() - 3..].iter().rev().fold(0_u64, |m, e| m << 28 | u64::from(e.payload()));
        assert_eq!(mask, 0x8000_0001_0000_0003);
    }
}
