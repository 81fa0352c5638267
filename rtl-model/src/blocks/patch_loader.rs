//! Patch loader in grid partition: turns (cell, ray) into (patch, ray) tokens, each patch record fetched along.
//!
//! ```text
//! cell requests (a FIFO per CTU) --> [ list slots ] --list port--> header, list lines      (list cache)
//!                                        |---------patch port--> patch record --> IcuJob (patch cache)
//!                                        `--list done--> CTU
//! ```
//! A slot: free -> header -> list line -> filter <-> patch -> done -> free; header, line and patch may wait for a
//! line. Each cycle: one request taken, one list look-up, one patch look-up, and in every slot one list entry
//! compared with the ray's mailbox (the last 8 tested ids: tested ones are dropped).
//! Timing: header, line, first entry, first token: one cycle each when the caches hit; a fill and the step that it
//! allows share a cycle.
//! Stalls: ICU link or miss FIFO full (output full), no miss register free (resource), lines not here yet (cache miss).
//! Source: patch loading by cell lists (1990 board paper); slots and mailboxes ASSUMED (mailbox: Amanatides, Woo 1987).

use crate::answers::Answers;
use crate::datapath::cell_step::Cell;
use crate::datapath::mailbox::Mailbox;
use crate::memory::{LINE_WORDS, Line, Lookup, MemoryRequest, ReadPort, Traffic};
use crate::memory_image::MemoryImage;
use crate::sim::{
    Activity, Cause, Cycle, Fifo, Observer, Phase, RayRef, Wire, Wires, for_each_bit, next_in_turn,
    next_set_bit,
};

use super::{CellRequest, ContextId, IcuJob, ListDone, Run};

#[derive(Clone, Copy, Debug)]
struct Slot {
    context: ContextId,
    ray: RayRef,
    cell: Cell,
    /// Word address of the next list entry.
    address: u32,
    /// Entries left in the list.
    remaining: u32,
    /// Entries left in the line at hand.
    in_line: u32,
    /// The entry at hand: a record's number.
    patch: u32,
    /// Tests sent for this cell.
    tests: u32,
    /// The line it waits for.
    awaited: Line,
}

/// Slots by state, a bit each.
#[derive(Clone, Copy, Debug, Default)]
struct States {
    free: u64,
    /// Wants its cell's header.
    header: u64,
    /// Wants a line of its list.
    list: u64,
    header_waits: u64,
    list_waits: u64,
    /// Has list entries at hand.
    filter: u64,
    /// Has an untested entry and wants its record.
    patch: u64,
    patch_waits: u64,
    /// Has the record in its line register.
    patch_here: u64,
    done: u64,
    /// Of those that want a header or list line: found no miss register free; they bid again after the next fill.
    list_full: u64,
    /// The same of those that want a record.
    patch_full: u64,
}

/// The block.
#[derive(Clone, Debug)]
pub struct PatchLoader {
    slots: Vec<Slot>,
    /// A bit per slot.
    all: u64,
    states: States,
    mailboxes: Vec<Mailbox>,
    contexts_per_ctu: usize,
    list_port: ReadPort,
    patch_port: ReadPort,
    take_turn: usize,
    list_turn: u32,
    patch_turn: u32,
    done_turn: u32,
    /// Something changed in this cycle that is no work: a look-up that found no room, or joined one on its way.
    unsettled: bool,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct PatchLoaderIo<'a> {
    /// From the CTUs of the module.
    pub requests: &'a mut [Fifo<CellRequest>],
    /// To the ICU.
    pub jobs: &'a mut Fifo<IcuJob>,
    /// To the CTUs.
    pub list_done: &'a mut Wires<ListDone>,
    /// Lines wanted by the list cache.
    pub list_misses: &'a mut Fifo<MemoryRequest>,
    /// Lines for the list cache.
    pub list_fill: &'a Wire<Line>,
    /// Lines wanted by the patch cache.
    pub patch_misses: &'a mut Fifo<MemoryRequest>,
    /// Lines for the patch cache.
    pub patch_fill: &'a Wire<Line>,
}

impl PatchLoader {
    /// An empty loader with `n_slots` list slots for `n_ctus` CTUs of `contexts` contexts each.
    pub fn new(n_slots: u32, n_ctus: u32, contexts: u32, list_port: ReadPort, patch_port: ReadPort) -> Self {
        let slot = Slot {
            context: ContextId::default(),
            ray: RayRef::default(),
            cell: Cell([0; 3]),
            address: 0,
            remaining: 0,
            in_line: 0,
            patch: 0,
            tests: 0,
            awaited: Line(0),
        };
        PatchLoader {
            slots: vec![slot; n_slots as usize],
            all: u64::MAX >> (64 - n_slots),
            states: States { free: u64::MAX >> (64 - n_slots), ..States::default() },
            mailboxes: vec![Mailbox::default(); (n_ctus * contexts) as usize],
            contexts_per_ctu: contexts as usize,
            list_port,
            patch_port,
            take_turn: 0,
            list_turn: 0,
            patch_turn: 0,
            done_turn: 0,
            unsettled: false,
        }
    }

    /// Traffic of the list cache and of the patch cache.
    pub fn traffic(&self) -> [Traffic; 2] {
        [self.list_port.traffic(), self.patch_port.traffic()]
    }

    /// True when no list is being worked on and no line is on its way.
    pub fn is_quiet(&self) -> bool {
        self.states.free == self.all && self.list_port.is_quiet() && self.patch_port.is_quiet()
    }

    /// True when time alone changes nothing in it.
    #[inline]
    pub fn is_still(&self) -> bool {
        !self.unsettled
    }

    /// One cycle.
    #[inline]
    pub fn tick<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        mut io: PatchLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        if self.states.free == self.all && io.requests.iter().all(|r| r.front(now).is_none()) {
            // Lines asked for by slots are always awaited by them, so no fill can be on its way here.
            return Activity::Idle;
        }
        self.unsettled = false;
        self.take_fills(now, &io, run.image);
        // Every step acts on the states after the fills: a slot moves by one state a cycle, a fill besides.
        let start = self.states;
        let finished = self.finish(now, start.done, &mut io);
        let (sent, port) = self.send_test(now, start, &mut io, run);
        let filtered = self.filter(start.filter, run);
        let listed = self.read_list(now, start, &mut io, run);
        let taken = self.take_request(now, io.requests, run);
        if finished || sent || filtered || listed == Port::Looked || taken {
            return Activity::Work;
        }
        let either = |state| port == state || listed == state;
        Activity::Stall(if either(Port::OutputFull) {
            Cause::OutputFull
        } else if either(Port::Refused) {
            Cause::Resource
        } else {
            Cause::CacheMiss
        })
    }

    fn take_fills(&mut self, now: Cycle, io: &PatchLoaderIo<'_>, image: &MemoryImage) {
        if let Some(line) = self.list_port.fill(now, io.list_fill) {
            self.unsettled = true;
            self.states.list_full = 0;
            for_each_bit(self.states.header_waits, |i| {
                if self.slots[i].awaited == line {
                    self.states.header_waits &= !(1 << i);
                    read_header(&mut self.slots[i], image);
                    self.states.list |= 1 << i;
                }
            });
            for_each_bit(self.states.list_waits, |i| {
                if self.slots[i].awaited == line {
                    self.states.list_waits &= !(1 << i);
                    read_line(&mut self.slots[i]);
                    self.states.filter |= 1 << i;
                }
            });
        }
        if let Some(line) = self.patch_port.fill(now, io.patch_fill) {
            self.unsettled = true;
            self.states.patch_full = 0;
            for_each_bit(self.states.patch_waits, |i| {
                if self.slots[i].awaited == line {
                    self.states.patch_waits &= !(1 << i);
                    self.states.patch_here |= 1 << i;
                }
            });
        }
    }

    /// Tells one CTU that a list is through.
    fn finish(&mut self, now: Cycle, done: u64, io: &mut PatchLoaderIo<'_>) -> bool {
        let Some(i) = next_set_bit(done, self.done_turn) else { return false };
        self.done_turn = i + 1;
        self.states.done &= !(1 << i);
        self.states.free |= 1 << i;
        let slot = &self.slots[i as usize];
        let done = ListDone { context: slot.context.context, tests: slot.tests };
        io.list_done.set(now, usize::from(slot.context.ctu), done);
        true
    }

    /// The patch port: one look-up or one record from a line register, then one token.
    fn send_test<A, O: Observer>(
        &mut self,
        now: Cycle,
        start: States,
        io: &mut PatchLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> (bool, Port) {
        if start.patch_here | start.patch == 0 {
            return (false, Port::Nothing);
        }
        if !io.jobs.can_push(now) {
            return (false, Port::OutputFull);
        }
        // Records at hand first: they hold what others may wait for.
        let here = next_set_bit(start.patch_here, self.patch_turn);
        let Some(i) = here.or_else(|| next_set_bit(start.patch & !start.patch_full, self.patch_turn)) else {
            return (false, Port::Refused);
        };
        self.patch_turn = i + 1;
        let (bit, slot) = (1u64 << i, &mut self.slots[i as usize]);
        if here.is_none() {
            let line = Line::of_word(run.image.patch_address(slot.patch));
            match self.patch_port.read(now, line, io.patch_misses, run.observer) {
                Lookup::Hit => {}
                Lookup::Waits => {
                    slot.awaited = line;
                    self.states.patch &= !bit;
                    self.states.patch_waits |= bit;
                    self.unsettled = true;
                    return (false, Port::Looked);
                }
                Lookup::Busy => {
                    self.unsettled = true;
                    return (false, Port::OutputFull);
                }
                Lookup::Full => {
                    self.states.patch_full |= bit;
                    self.unsettled = true;
                    return (false, Port::Refused);
                }
            }
        }
        self.states.patch &= !bit;
        self.states.patch_here &= !bit;
        let (context, ray, patch) = (slot.context, slot.ray, slot.patch);
        io.jobs.send(now, IcuJob { slot: ray.slot, context, patch, rays: 1 << ray.index }, run.observer);
        run.observer.ray(now, run.block, ray, Phase::Away, Phase::Loading);
        slot.tests += 1;
        self.next_entry(i);
        (true, Port::Looked)
    }

    /// In every slot with entries at hand, compares one with the mailbox.
    fn filter<A: Answers, O>(&mut self, filtering: u64, run: &mut Run<'_, A, O>) -> bool {
        for_each_bit(filtering, |i| {
            let slot = &mut self.slots[i];
            slot.patch = run.image.list_entry(slot.address);
            slot.address += 1;
            slot.remaining -= 1;
            slot.in_line -= 1;
            run.counters.list_entries += 1;
            let mailbox = &mut self.mailboxes[slot.context.index(self.contexts_per_ctu)];
            self.states.filter &= !(1 << i);
            let (at, patch) = (run.at(slot.ray), slot.patch);
            // The entry stands in its slot until it is tested, and the context asks for nothing else meanwhile.
            let wanted = run.answers.wanted(at, || {
                let known = mailbox.contains(patch);
                if !known {
                    mailbox.push(patch);
                }
                u64::from(!known)
            });
            if wanted == 0 {
                self.next_entry(i as u32);
            } else {
                self.states.patch |= 1 << i;
            }
        });
        filtering != 0
    }

    /// After an entry: the next one, the next line, or done.
    fn next_entry(&mut self, i: u32) {
        let slot = &self.slots[i as usize];
        let state = if slot.remaining == 0 {
            &mut self.states.done
        } else if slot.in_line == 0 {
            &mut self.states.list
        } else {
            &mut self.states.filter
        };
        *state |= 1 << i;
    }

    /// The list port: one look-up of a header or of a list line.
    fn read_list<A, O: Observer>(
        &mut self,
        now: Cycle,
        start: States,
        io: &mut PatchLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Port {
        let wanted = start.header | start.list;
        if wanted == 0 {
            return Port::Nothing;
        }
        let Some(i) = next_set_bit(wanted & !start.list_full, self.list_turn) else { return Port::Refused };
        self.list_turn = i + 1;
        let (bit, slot) = (1u64 << i, &mut self.slots[i as usize]);
        let is_header = start.header & bit != 0;
        let address = if is_header { run.image.header_address(slot.cell) } else { slot.address };
        let line = Line::of_word(address);
        let lookup = self.list_port.read(now, line, io.list_misses, run.observer);
        match lookup {
            Lookup::Hit | Lookup::Waits => {}
            Lookup::Busy => {
                self.unsettled = true;
                return Port::OutputFull;
            }
            Lookup::Full => {
                self.states.list_full |= bit;
                self.unsettled = true;
                return Port::Refused;
            }
        }
        slot.awaited = line;
        let waits = lookup == Lookup::Waits;
        if is_header {
            self.states.header &= !bit;
            if waits {
                self.states.header_waits |= bit;
            } else {
                read_header(slot, run.image);
                self.states.list |= bit;
            }
        } else {
            self.states.list &= !bit;
            if waits {
                self.states.list_waits |= bit;
            } else {
                read_line(slot);
                self.states.filter |= bit;
            }
        }
        Port::Looked
    }

    /// Takes one cell request into a free slot.
    fn take_request<A, O: Observer>(
        &mut self,
        now: Cycle,
        requests: &mut [Fifo<CellRequest>],
        run: &mut Run<'_, A, O>,
    ) -> bool {
        let Some(free) = next_set_bit(self.states.free, 0) else { return false };
        let n = requests.len();
        let Some(ctu) = next_in_turn(n, self.take_turn, |c| requests[c].front(now).is_some()) else {
            return false;
        };
        self.take_turn = ctu + 1;
        let Some(CellRequest { context, ray, cell, fresh }) = requests[ctu].take(now, run.observer) else {
            return false;
        };
        run.observer.ray(now, run.block, ray, Phase::Queued, Phase::Loading);
        if fresh {
            let mailbox = context.index(self.contexts_per_ctu);
            self.mailboxes[mailbox] = Mailbox::default();
        }
        let slot = &mut self.slots[free as usize];
        slot.context = context;
        slot.ray = ray;
        slot.cell = cell;
        slot.tests = 0;
        self.states.free &= !(1 << free);
        self.states.header |= 1 << free;
        true
    }
}

/// What a port did in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Port {
    /// No slot wanted it.
    Nothing,
    /// A look-up, or a record sent.
    Looked,
    /// No miss register free for whoever wants it.
    Refused,
    /// Its FIFO, to the ICU or to the next level, is full.
    OutputFull,
}

fn read_header(slot: &mut Slot, image: &MemoryImage) {
    (slot.address, slot.remaining) = image.cell_list(slot.cell);
}

fn read_line(slot: &mut Slot) {
    slot.in_line = slot.remaining.min(LINE_WORDS - slot.address % LINE_WORDS);
}
