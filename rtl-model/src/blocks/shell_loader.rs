//! Patch loader in shells: turns (cell, rays) into (patch, rays not yet tested), each patch record fetched along.
//!
//! ```text
//! entries --> [ list slots ] --list port--> header, list lines                             (list cache)
//!                   |---------mask port--> tested mask --> rays still to be tested         (mask cache)
//!                   |                                          `--> [ stations ] --patch port--> record (patch cache)
//!                   `--EntryDone--> shell tracker                        `--IcuJob (patch, rays)--> ICU
//! ```
//! A slot: free -> header -> list line -> verdicts, one a list entry -> done -> free; header, line and mask may wait for
//! a line. A verdict other than "all tested" takes a station, which waits for the record and sends the job. Each cycle: one
//! entry taken, one list look-up, one mask look-up and verdict, one patch look-up, one job sent.
//! Headers, lists and records are fetched for all slots and stations at once, but of one bundle only the oldest slot looks
//! at masks and only the oldest station sends: verdicts and jobs come in the order of the bundle's table (so they are
//! canonical, and a record of them can be replayed).
//! An entry without rays is a prefetch: header, list lines and records are asked for, nothing is tested, and what finds
//! no miss register is let go.
//! Timing: header, line, verdict, record, job: one cycle each when the caches hit; a fill and the step that it allows share
//! a cycle. A list of rejected patches costs a cycle a patch.
//! Stalls: ICU link or miss FIFO full (output full), no miss register or station free (resource), lines not here yet (cache
//! miss).
//! Source: patch loading by cell lists (1990 board paper); slots, stations, tested masks and their order ours.

use crate::answers::Answers;
use crate::datapath::cell_step::Cell;
use crate::memory::{
    LINE_WORDS, Line, Lookup, MaskCache, MaskLookup, MaskStore, MemoryRequest, ReadPort, Traffic,
};
use crate::memory_image::MemoryImage;
use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Phase, RayRef, Wire, for_each_bit, next_set_bit};

use crate::spec::LoaderSpec;

use super::{EntryDone, IcuJob, ListEntry, Run};

#[derive(Clone, Copy, Debug)]
struct Slot {
    bundle: u8,
    cell: Cell,
    /// The entry's rays; none: a prefetch.
    mask: u64,
    /// Word address of the next list entry.
    address: u32,
    /// Entries left in the list.
    remaining: u32,
    /// Entries left in the line at hand.
    in_line: u32,
    /// Tests that this entry's verdicts ask for.
    tests: u32,
    /// The line it waits for.
    awaited: Line,
}

/// A patch on its way to the ICU.
#[derive(Clone, Copy, Debug)]
struct Station {
    bundle: u8,
    patch: u32,
    /// The rays to test with it; none: a prefetch.
    rays: u64,
    line: Line,
}

/// Stations by state, a bit each.
#[derive(Clone, Copy, Debug, Default)]
struct StationStates {
    free: u32,
    /// Wants its record.
    wants: u32,
    waits: u32,
    /// Has its record.
    here: u32,
    /// Of those that want one: found no miss register free; they bid again after the next fill.
    full: u32,
}

/// Slots by state, a bit each.
#[derive(Clone, Copy, Debug, Default)]
struct States {
    free: u32,
    /// Wants its cell's header.
    header: u32,
    /// Wants a line of its list.
    list: u32,
    header_waits: u32,
    list_waits: u32,
    /// Has list entries at hand.
    verdict: u32,
    mask_waits: u32,
    done: u32,
    /// Of those that want a header or list line: found no miss register free; they bid again after the next fill.
    list_full: u32,
}

/// The block.
#[derive(Clone, Debug)]
pub struct ShellLoader {
    slots: Vec<Slot>,
    all: u32,
    states: States,
    /// For each slot the older slots of its bundle, a bit each.
    older: Vec<u32>,
    stations: Vec<Station>,
    all_stations: u32,
    station_states: StationStates,
    /// For each station the older stations of its bundle, a bit each.
    older_stations: Vec<u32>,
    masks: MaskStore,
    list_port: ReadPort,
    mask_port: MaskCache,
    patch_port: ReadPort,
    list_turn: u32,
    verdict_turn: u32,
    patch_turn: u32,
    job_turn: u32,
    done_turn: u32,
    /// Something changed in this cycle that is no work: a look-up that found no room, or joined one on its way.
    unsettled: bool,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct ShellLoaderIo<'a> {
    /// From the shell tracker.
    pub entries: &'a mut Fifo<ListEntry>,
    /// A bundle that is over.
    pub over: &'a Wire<u8>,
    /// To the ICU.
    pub jobs: &'a mut Fifo<IcuJob>,
    /// To the shell tracker.
    pub entry_done: &'a mut Wire<EntryDone>,
    /// Lines wanted by the list cache, and lines for it.
    pub list_misses: &'a mut Fifo<MemoryRequest>,
    /// As above.
    pub list_fill: &'a Wire<Line>,
    /// Lines wanted by the patch cache.
    pub patch_misses: &'a mut Fifo<MemoryRequest>,
    /// Lines for the patch cache.
    pub patch_fill: &'a Wire<Line>,
    /// Lines wanted and written back by the mask cache.
    pub mask_misses: &'a mut Fifo<MemoryRequest>,
    /// Lines for the mask cache.
    pub mask_fill: &'a Wire<Line>,
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

impl ShellLoader {
    /// An empty loader for a cluster's `n_bundles` slots and a scene of `n_patches`.
    pub fn new(
        spec: &LoaderSpec,
        n_bundles: u32,
        n_patches: u32,
        list_port: ReadPort,
        mask_port: MaskCache,
        patch_port: ReadPort,
    ) -> Self {
        let slot = Slot {
            bundle: 0,
            cell: Cell([0; 3]),
            mask: 0,
            address: 0,
            remaining: 0,
            in_line: 0,
            tests: 0,
            awaited: Line(0),
        };
        let station = Station { bundle: 0, patch: 0, rays: 0, line: Line(0) };
        let (n_slots, n_stations) = (spec.slots as usize, spec.stations as usize);
        let (all, all_stations) = (u32::MAX >> (32 - spec.slots), u32::MAX >> (32 - spec.stations));
        ShellLoader {
            slots: vec![slot; n_slots],
            all,
            states: States { free: all, ..States::default() },
            older: vec![0; n_slots],
            stations: vec![station; n_stations],
            all_stations,
            station_states: StationStates { free: all_stations, ..StationStates::default() },
            older_stations: vec![0; n_stations],
            masks: MaskStore::new(n_bundles, n_patches),
            list_port,
            mask_port,
            patch_port,
            list_turn: 0,
            verdict_turn: 0,
            patch_turn: 0,
            job_turn: 0,
            done_turn: 0,
            unsettled: false,
        }
    }

    /// Traffic of the list, patch and mask caches.
    pub fn traffic(&self) -> [Traffic; 3] {
        [self.list_port.traffic(), self.patch_port.traffic(), self.mask_port.traffic()]
    }

    /// True when no list is being worked on and no line is on its way.
    #[inline]
    pub fn is_quiet(&self) -> bool {
        self.states.free == self.all
            && self.station_states.free == self.all_stations
            && self.list_port.is_quiet()
            && self.patch_port.is_quiet()
            && self.mask_port.is_quiet()
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
        mut io: ShellLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        if let Some(bundle) = io.over.get(now) {
            self.masks.start_bundle(bundle);
            self.mask_port.drop_bundle(bundle);
        }
        if self.is_quiet() && io.entries.front(now).is_none() {
            return Activity::Idle;
        }
        self.unsettled = false;
        self.take_fills(now, &io, run.image);
        // Every step acts on the states after the fills: a slot moves by one state a cycle, a fill besides.
        let (start, stations) = (self.states, self.station_states);
        let finished = self.finish(now, start.done, &mut io, run);
        let sent = self.send_job(now, stations.here, &mut io, run);
        let patch = self.read_record(now, stations, &mut io, run);
        let judged = self.judge(now, start.verdict, stations.free, &mut io, run);
        let listed = self.read_list(now, start, &mut io, run);
        let taken = self.take_entry(now, io.entries, run);
        let settled = self.mask_port.settle(now, io.mask_misses, run.observer);
        let ports = [sent, patch, judged, listed];
        if finished || taken || settled || ports.contains(&Port::Looked) {
            Activity::Work
        } else if ports.contains(&Port::OutputFull) {
            Activity::Stall(Cause::OutputFull)
        } else if ports.contains(&Port::Refused) {
            Activity::Stall(Cause::Resource)
        } else {
            Activity::Stall(Cause::CacheMiss)
        }
    }

    fn take_fills(&mut self, now: Cycle, io: &ShellLoaderIo<'_>, image: &MemoryImage) {
        let (slots, states) = (&mut self.slots, &mut self.states);
        if let Some(line) = self.list_port.fill(now, io.list_fill) {
            self.unsettled = true;
            states.list_full = 0;
            for_each_bit(u64::from(states.header_waits | states.list_waits), |i| {
                if slots[i].awaited != line {
                    return;
                }
                let bit = 1 << i;
                if states.header_waits & bit != 0 {
                    states.header_waits &= !bit;
                    read_header(&mut slots[i], image);
                    states.list |= bit;
                } else {
                    states.list_waits &= !bit;
                    read_line(&mut slots[i]);
                    states.verdict |= bit;
                }
            });
        }
        if let Some(line) = self.mask_port.fill(now, io.mask_fill) {
            self.unsettled = true;
            for_each_bit(u64::from(states.mask_waits), |i| {
                if slots[i].awaited == line {
                    states.mask_waits &= !(1 << i);
                    states.verdict |= 1 << i;
                }
            });
        }
        if let Some(line) = self.patch_port.fill(now, io.patch_fill) {
            self.unsettled = true;
            let states = &mut self.station_states;
            states.full = 0;
            for_each_bit(u64::from(states.waits), |i| {
                if self.stations[i].line == line {
                    states.waits &= !(1 << i);
                    states.here |= 1 << i;
                }
            });
        }
    }

    /// Tells the tracker that an entry's list is through.
    fn finish<A, O: Observer>(
        &mut self,
        now: Cycle,
        done: u32,
        io: &mut ShellLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> bool {
        let Some(i) = next_set_bit(u64::from(done), self.done_turn) else { return false };
        self.done_turn = i + 1;
        let bit = 1 << i;
        self.states.done &= !bit;
        self.states.free |= bit;
        self.older.iter_mut().for_each(|older| *older &= !bit);
        let Slot { bundle, mask, tests, .. } = self.slots[i as usize];
        io.entry_done.set(now, EntryDone { slot: bundle, tests, prefetch: mask == 0 });
        run.observer.rays(now, run.block, bundle, mask, Phase::Loading, Phase::Away);
        true
    }

    /// Sends one job: of each bundle its oldest station's.
    #[inline]
    fn send_job<A, O: Observer>(
        &mut self,
        now: Cycle,
        here: u32,
        io: &mut ShellLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Port {
        let mut bids = here;
        let i = loop {
            let Some(i) = next_set_bit(u64::from(bids), self.job_turn) else { return Port::Nothing };
            if self.older_stations[i as usize] == 0 {
                break i;
            }
            bids &= !(1 << i);
        };
        if !io.jobs.can_push(now) {
            return Port::OutputFull;
        }
        self.job_turn = i + 1;
        let Station { bundle, patch, rays, .. } = self.stations[i as usize];
        io.jobs.send(now, IcuJob { slot: bundle, patch, rays, ..IcuJob::default() }, run.observer);
        self.station_states.here &= !(1 << i);
        self.free_station(i);
        Port::Looked
    }

    fn free_station(&mut self, i: u32) {
        self.station_states.free |= 1 << i;
        self.older_stations.iter_mut().for_each(|older| *older &= !(1 << i));
    }

    /// The patch port: one look-up.
    #[inline]
    fn read_record<A, O: Observer>(
        &mut self,
        now: Cycle,
        start: StationStates,
        io: &mut ShellLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Port {
        if start.wants == 0 {
            return Port::Nothing;
        }
        let bids = u64::from(start.wants & !start.full);
        let Some(i) = next_set_bit(bids, self.patch_turn) else { return Port::Refused };
        let (bit, station) = (1_u32 << i, &mut self.stations[i as usize]);
        station.line = Line::of_word(run.image.patch_address(station.patch));
        let lookup = self.patch_port.read(now, station.line, io.patch_misses, run.observer);
        let states = &mut self.station_states;
        let prefetch = station.rays == 0;
        match lookup {
            // Asked for, or let go.
            _ if prefetch => {
                states.wants &= !bit;
                self.free_station(i);
            }
            Lookup::Hit => {
                states.wants &= !bit;
                states.here |= bit;
            }
            Lookup::Waits => {
                states.wants &= !bit;
                states.waits |= bit;
            }
            Lookup::Busy => {
                self.unsettled = true;
                return Port::OutputFull;
            }
            Lookup::Full => {
                states.full |= bit;
                self.unsettled = true;
                return Port::Refused;
            }
        }
        self.patch_turn = i + 1;
        Port::Looked
    }

    /// A station takes a patch and the rays to test with it.
    fn take_station(&mut self, i: u32, station: Station) {
        let busy = self.all_stations & !self.station_states.free;
        let mut older = 0;
        for_each_bit(u64::from(busy), |j| {
            older |= u32::from(self.stations[j].bundle == station.bundle && self.stations[j].rays != 0) << j;
        });
        self.older_stations[i as usize] = older;
        self.stations[i as usize] = station;
        self.station_states.free &= !(1 << i);
        self.station_states.wants |= 1 << i;
    }

    /// The mask port: one list entry's verdict.
    #[inline]
    fn judge<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        bids: u32,
        free_stations: u32,
        io: &mut ShellLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Port {
        if bids == 0 {
            return Port::Nothing;
        }
        // One that is freed in this cycle is free from the next on: the choice is made by the state at its start.
        let Some(station) = next_set_bit(u64::from(free_stations), 0) else { return Port::Refused };
        // Of each bundle its oldest slot; prefetches need no masks.
        let mut bids = bids;
        let i = loop {
            let Some(i) = next_set_bit(u64::from(bids), self.verdict_turn) else { return Port::Nothing };
            if self.older[i as usize] == 0 || self.slots[i as usize].mask == 0 {
                break i;
            }
            bids &= !(1 << i);
        };
        self.verdict_turn = i + 1;
        let (bit, slot) = (1_u32 << i, &mut self.slots[i as usize]);
        let patch = run.image.list_entry(slot.address);
        let mut wanted = 0;
        if slot.mask != 0 {
            let line = self.mask_port.line(slot.bundle, patch);
            match self.mask_port.look_up(now, line, io.mask_misses, run.observer) {
                MaskLookup::Here => {}
                MaskLookup::Waits => {
                    slot.awaited = line;
                    self.states.verdict &= !bit;
                    self.states.mask_waits |= bit;
                    return Port::Looked;
                }
                MaskLookup::Busy => {
                    self.unsettled = true;
                    return Port::OutputFull;
                }
                MaskLookup::Full => {
                    self.unsettled = true;
                    return Port::Refused;
                }
            }
            let (masks, bundle, mask) = (&mut self.masks, slot.bundle, slot.mask);
            let at = run.at(RayRef { slot: bundle, index: 0 });
            wanted = run.answers.wanted(at, || masks.take_untested(bundle, patch, mask));
            if wanted != 0 {
                self.mask_port.write(line);
            }
            run.counters.list_entries += 1;
        }
        slot.tests += wanted.count_ones();
        slot.address += 1;
        slot.remaining -= 1;
        slot.in_line -= 1;
        self.states.verdict &= !bit;
        let (bundle, prefetch) = (slot.bundle, slot.mask == 0);
        if wanted != 0 || prefetch {
            self.take_station(station, Station { bundle, patch, rays: wanted, line: Line(0) });
            run.observer.rays(now, run.block, bundle, wanted, Phase::Away, Phase::Loading);
        }
        self.next_entry(i);
        Port::Looked
    }

    /// After a patch: the next one, the next line, or done.
    fn next_entry(&mut self, i: u32) {
        let slot = &self.slots[i as usize];
        let state = if slot.remaining == 0 {
            &mut self.states.done
        } else if slot.in_line == 0 {
            &mut self.states.list
        } else {
            &mut self.states.verdict
        };
        *state |= 1 << i;
    }

    /// The list port: one look-up of a header or of a list line.
    #[inline]
    fn read_list<A, O: Observer>(
        &mut self,
        now: Cycle,
        start: States,
        io: &mut ShellLoaderIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Port {
        let wanted = start.header | start.list;
        if wanted == 0 {
            return Port::Nothing;
        }
        let bids = u64::from(wanted & !start.list_full);
        let Some(i) = next_set_bit(bids, self.list_turn) else { return Port::Refused };
        self.list_turn = i + 1;
        let (bit, slot) = (1_u32 << i, &mut self.slots[i as usize]);
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
        let states = &mut self.states;
        let (wants, waits, then) = if is_header {
            (&mut states.header, &mut states.header_waits, &mut states.list)
        } else {
            (&mut states.list, &mut states.list_waits, &mut states.verdict)
        };
        *wants &= !bit;
        if lookup == Lookup::Waits {
            *waits |= bit;
        } else {
            *then |= bit;
            if is_header {
                read_header(slot, run.image);
            } else {
                read_line(slot);
            }
        }
        Port::Looked
    }

    /// Takes one entry into a free slot.
    #[inline]
    fn take_entry<A, O: Observer>(
        &mut self,
        now: Cycle,
        entries: &mut Fifo<ListEntry>,
        run: &mut Run<'_, A, O>,
    ) -> bool {
        let Some(free) = next_set_bit(u64::from(self.states.free), 0) else { return false };
        let Some(ListEntry { slot: bundle, cell, mask }) = entries.take(now, run.observer) else {
            return false;
        };
        run.observer.rays(now, run.block, bundle, mask, Phase::Queued, Phase::Loading);
        let busy = self.all & !self.states.free;
        let mut older = 0;
        for_each_bit(u64::from(busy), |i| {
            older |= u32::from(self.slots[i].bundle == bundle && self.slots[i].mask != 0) << i;
        });
        self.older[free as usize] = older;
        let slot = &mut self.slots[free as usize];
        (slot.bundle, slot.cell, slot.mask, slot.tests) = (bundle, cell, mask, 0);
        self.states.free &= !(1 << free);
        self.states.header |= 1 << free;
        true
    }
}

fn read_header(slot: &mut Slot, image: &MemoryImage) {
    (slot.address, slot.remaining) = image.cell_list(slot.cell);
}

fn read_line(slot: &mut Slot) {
    slot.in_line = slot.remaining.min(LINE_WORDS - slot.address % LINE_WORDS);
}

#[cfg(test)]
#[path = "shell_loader_tests.rs"]
mod tests;
