//! Shell tracker: takes a module's bundles through their shells. Ray tracker and bundle tracker in one block.
//!
//! ```text
//! NewRay --> [ ray tracker: cell, limit, open and walking bits ] --StepRequest--> CTUs, in turn
//!            [ bundle tracker: table of (cell, rays) a bundle  ] <----Visit------- CTUs, in the same turn
//!                 |  ^--EntryDone (loader), Reduced (reducer): what is outstanding
//!                 `--ListEntry--> shell loader           bundle over: RayEnd --> result merge
//! ```
//! A bundle's states: filling (its rays arrive) -> walking -> sending (walk over, or table full: its entries go to the
//! loader, one a cycle) -> walking again, or waiting (until nothing is outstanding) -> next shell, or over.
//! - Walking rays step in ray order, round by round: a ray's next step is asked for when its last one is back, and no ray
//!   overtakes another. Steps go to the CTUs in turn and visits are taken in the same turn, so cells enter a bundle's
//!   table in that order whatever the timing (`functional::shells` is the definition).
//! - A visit that finds its bundle's table full waits, and those behind it, until the table's entries are sent.
//! - At the barrier, all results reduced, rays that asked for any hit and have one are closed, and the best t so far
//!   becomes the limit of the next shell's steps.
//!
//! Timing, each cycle: up to k requests out and k visits in, of which one to a table; one entry out; one ray in; one
//! message of each kind; a barrier takes no cycle of its own.
//! Stalls: a request, entry or end that finds its link full (output full); a full table (resource); otherwise, with
//! bundles inside, starved. Source: 1990 board paper (bundle and ray tracking in shells); table, order and timing ours.

use crate::datapath::cell_step::Cell;
use crate::datapath::mailbox::Mailbox;
use crate::datapath::shell::{BundleTable, Inserted, next_radius};
use crate::packet::MAX_BUNDLE_RAYS;
use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Phase, RayRef, Wire, Wires, next_set_bit};
use crate::spec::ShellSpec;

use super::{EntryDone, ListEntry, NewRay, RayEnd, RayStore, Reduced, Run, StepRequest, Visit, VisitKind};

/// What a bundle waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Free,
    /// Rays arrive.
    Filling,
    /// Rays step.
    Walking,
    /// The table's entries go to the loader; `then` walking or waiting.
    Sending {
        sent: u32,
        shell_over: bool,
    },
    /// The barrier.
    Waiting,
    /// The end is to be told.
    Ending,
}

#[derive(Clone, Debug)]
struct Bundle {
    state: State,
    n_rays: u32,
    arrived: u32,
    /// Rays that have not ended.
    open: u64,
    /// Rays that have steps to take in this shell.
    walking: u64,
    /// Rays whose step is in a CTU.
    in_step: u64,
    /// Rays that have not entered their first cell.
    fresh: u64,
    /// The ray after the one whose step was asked for last.
    cursor: u32,
    shell: u32,
    radius: u32,
    cells: [Cell; MAX_BUNDLE_RAYS],
    apexes: [Cell; MAX_BUNDLE_RAYS],
    limits: [u64; MAX_BUNDLE_RAYS],
    table: BundleTable,
    /// Entries sent and not through.
    entries_out: u32,
    /// Tests sent less tests reduced; negative while results overtake the loader's count.
    tests_out: i32,
    /// Cells in which rays will enter the next shell, to be prefetched; how many of them were sent and are not through.
    ahead: Vec<Cell>,
    prefetches_out: u32,
}

/// The block.
#[derive(Clone, Debug)]
pub struct ShellTracker {
    spec: ShellSpec,
    /// By slot of the cluster; those of other modules stay free.
    bundles: Vec<Bundle>,
    /// Slots by state, a bit each.
    busy: u32,
    walking: u32,
    sending: u32,
    waiting: u32,
    /// Of those that wait: nothing is outstanding, or a message may have changed that.
    settled: u32,
    ending: u32,
    n_ctus: usize,
    /// The CTU that gets the next request, and the one that gives the next visit.
    next_request: usize,
    next_visit: usize,
    walk_turn: u32,
    send_turn: u32,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct ShellTrackerIo<'a> {
    /// Rays from the bundle generator.
    pub rays: &'a mut Fifo<NewRay>,
    /// Their best hits.
    pub store: &'a mut RayStore,
    /// To the CTUs.
    pub requests: &'a mut [Fifo<StepRequest>],
    /// From the CTUs.
    pub visits: &'a mut [Fifo<Visit>],
    /// To the loader.
    pub entries: &'a mut Fifo<ListEntry>,
    /// From the loader.
    pub entry_done: &'a Wire<EntryDone>,
    /// From the reducer, reader 0.
    pub reduced: &'a Wires<Reduced>,
    /// To the result merge.
    pub ends: &'a mut Fifo<RayEnd>,
    /// Tells the loader of a bundle that is over.
    pub over: &'a mut Wire<u8>,
}

/// What a cycle's parts came to.
#[derive(Clone, Copy, Debug, Default)]
struct Done {
    worked: bool,
    blocked: bool,
    table_full: bool,
}

impl ShellTracker {
    /// An empty tracker for a cluster's `n_slots` slots and a module's `n_ctus` CTUs.
    pub fn new(spec: &ShellSpec, n_slots: u32, n_ctus: u32) -> Self {
        let bundle = || Bundle {
            state: State::Free,
            n_rays: 0,
            arrived: 0,
            open: 0,
            walking: 0,
            in_step: 0,
            fresh: 0,
            cursor: 0,
            shell: 0,
            radius: 0,
            cells: [Cell([0; 3]); MAX_BUNDLE_RAYS],
            apexes: [Cell([0; 3]); MAX_BUNDLE_RAYS],
            limits: [0; MAX_BUNDLE_RAYS],
            table: BundleTable::new(spec.entries),
            entries_out: 0,
            tests_out: 0,
            ahead: Vec::new(),
            prefetches_out: 0,
        };
        ShellTracker {
            spec: *spec,
            bundles: (0..n_slots).map(|_| bundle()).collect(),
            busy: 0,
            walking: 0,
            sending: 0,
            waiting: 0,
            settled: 0,
            ending: 0,
            n_ctus: n_ctus as usize,
            next_request: 0,
            next_visit: 0,
            walk_turn: 0,
            send_turn: 0,
        }
    }

    /// True when no bundle is inside.
    #[inline]
    pub fn is_quiet(&self) -> bool {
        self.busy == 0
    }

    /// One cycle.
    #[inline]
    pub fn tick<A, O: Observer>(
        &mut self,
        now: Cycle,
        mut io: ShellTrackerIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        if self.busy == 0 && io.rays.front(now).is_none() {
            return Activity::Idle;
        }
        let mut done = Done::default();
        // What the registers hold at the start of the cycle decides what goes out.
        let (walking, sending, ending) = (self.walking, self.sending, self.ending);
        let waits = self.waiting;
        self.take_messages(now, &io, &mut done);
        let waiting = waits & self.settled;
        if ending != 0 {
            self.tell_end(now, ending, &mut io, run, &mut done);
        }
        if sending != 0 {
            self.send_entry(now, sending, &mut io, run, &mut done);
        }
        if waiting != 0 {
            self.pass_barriers(waiting, io.store, run.any_hit, &mut done);
        }
        if walking != 0 {
            self.ask_for_steps(now, walking, io.requests, run, &mut done);
        }
        self.take_visits(now, io.visits, io.store, run, &mut done);
        self.take_ray(now, io.rays, io.store, run, &mut done);
        if done.worked {
            Activity::Work
        } else if done.blocked {
            Activity::Stall(Cause::OutputFull)
        } else if done.table_full {
            Activity::Stall(Cause::Resource)
        } else {
            Activity::Stall(Cause::Starved)
        }
    }

    fn set_state(&mut self, slot: usize, state: State) {
        self.bundles[slot].state = state;
        let bit = 1 << slot;
        self.settled |= if state == State::Waiting { bit } else { 0 };
        for (set, is_in) in [
            (&mut self.busy, state != State::Free),
            (&mut self.walking, state == State::Walking),
            (&mut self.sending, matches!(state, State::Sending { .. })),
            (&mut self.waiting, state == State::Waiting),
            (&mut self.ending, state == State::Ending),
        ] {
            *set = *set & !bit | if is_in { bit } else { 0 };
        }
    }

    /// Counts what came back from loader and reducer.
    #[inline]
    fn take_messages(&mut self, now: Cycle, io: &ShellTrackerIo<'_>, done: &mut Done) {
        if let Some(EntryDone { slot, tests, prefetch }) = io.entry_done.get(now) {
            let bundle = &mut self.bundles[usize::from(slot)];
            if prefetch {
                bundle.prefetches_out -= 1;
            } else {
                bundle.entries_out -= 1;
                bundle.tests_out += tests.cast_signed();
            }
            self.settled |= 1 << slot;
            done.worked = true;
        }
        if let Some(Reduced { slot, .. }) = io.reduced.get(now, 0) {
            let bundle = &mut self.bundles[usize::from(slot)];
            bundle.tests_out -= 1;
            self.settled |= u32::from(bundle.tests_out == 0) << slot;
            done.worked = true;
        }
    }

    /// Takes a new ray; with its last one a bundle enters its first shell.
    #[inline]
    fn take_ray<A, O: Observer>(
        &mut self,
        now: Cycle,
        rays: &mut Fifo<NewRay>,
        store: &RayStore,
        run: &mut Run<'_, A, O>,
        done: &mut Done,
    ) {
        let Some(NewRay { ray, n_rays }) = rays.take(now, run.observer) else { return };
        done.worked = true;
        let slot = usize::from(ray.slot);
        let bundle = &mut self.bundles[slot];
        if bundle.state == State::Free {
            bundle.n_rays = u32::from(n_rays);
            bundle.arrived = 0;
            bundle.shell = 0;
            self.set_state(slot, State::Filling);
        }
        let bundle = &mut self.bundles[slot];
        bundle.limits[usize::from(ray.index)] = store.words(ray).t_max;
        bundle.arrived += 1;
        if bundle.arrived == bundle.n_rays {
            bundle.open = u64::MAX >> (64 - bundle.n_rays);
            bundle.fresh = bundle.open;
            self.enter_shell(slot);
        }
    }

    /// All open rays have steps to take in the next shell.
    fn enter_shell(&mut self, slot: usize) {
        let spec = self.spec;
        let bundle = &mut self.bundles[slot];
        bundle.walking = bundle.open;
        bundle.radius = next_radius(&spec, bundle.shell);
        bundle.cursor = 0;
        bundle.shell += 1;
        bundle.ahead.clear();
        self.set_state(slot, State::Walking);
    }

    /// Asks for up to a step per CTU.
    #[inline]
    fn ask_for_steps<A, O: Observer>(
        &mut self,
        now: Cycle,
        mut slots: u32,
        requests: &mut [Fifo<StepRequest>],
        run: &mut Run<'_, A, O>,
        done: &mut Done,
    ) {
        for _ in 0..self.n_ctus {
            // The next bundle in turn whose next ray's last step is back.
            let ready = loop {
                let Some(slot) = next_set_bit(u64::from(slots), self.walk_turn) else { return };
                let bundle = &self.bundles[slot as usize];
                match next_set_bit(bundle.walking, bundle.cursor) {
                    Some(ray) if bundle.in_step >> ray & 1 == 0 => break Some((slot, ray)),
                    _ => slots &= !(1 << slot),
                }
            };
            let Some((slot, ray)) = ready else { return };
            let link = &mut requests[self.next_request];
            if !link.can_push(now) {
                done.blocked = true;
                return;
            }
            let bundle = &mut self.bundles[slot as usize];
            let (at, bit) = (ray as usize, 1_u64 << ray);
            let request = StepRequest {
                ray: RayRef { slot: slot as u8, index: ray as u8 },
                cell: bundle.cells[at],
                apex: bundle.apexes[at],
                radius: bundle.radius,
                limit_t: bundle.limits[at],
                enters: bundle.fresh & bit != 0,
            };
            link.send(now, request, run.observer);
            bundle.in_step |= bit;
            bundle.cursor = (ray + 1) & 63;
            self.walk_turn = slot + 1;
            self.next_request += 1;
            if self.next_request == self.n_ctus {
                self.next_request = 0;
            }
            done.worked = true;
        }
    }

    /// Takes up to a visit per CTU, of which one enters a table.
    #[inline]
    fn take_visits<A, O: Observer>(
        &mut self,
        now: Cycle,
        visits: &mut [Fifo<Visit>],
        store: &mut RayStore,
        run: &mut Run<'_, A, O>,
        done: &mut Done,
    ) {
        for _ in 0..self.n_ctus {
            let Some(&Visit { ray, cell, kind }) = visits[self.next_visit].front(now) else { return };
            let slot = usize::from(ray.slot);
            let (at, bit) = (usize::from(ray.index), 1_u64 << ray.index);
            let bundle = &mut self.bundles[slot];
            if kind == VisitKind::Occupied {
                // Between the filling of the table and its last entry's leaving nothing may enter it.
                if bundle.state != State::Walking || bundle.table.insert(cell, ray.index) == Inserted::Full {
                    done.table_full = true;
                    if bundle.state == State::Walking {
                        // To close the table is this cycle's work.
                        done.worked = true;
                        self.set_state(slot, State::Sending { sent: 0, shell_over: false });
                    }
                    return;
                }
            }
            visits[self.next_visit].take(now, run.observer);
            done.worked = true;
            self.next_visit += 1;
            if self.next_visit == self.n_ctus {
                self.next_visit = 0;
            }
            bundle.in_step &= !bit;
            match kind {
                VisitKind::Empty | VisitKind::Occupied => {
                    store.count_cell(ray);
                    bundle.cells[at] = cell;
                    if bundle.fresh & bit != 0 {
                        bundle.fresh &= !bit;
                        bundle.apexes[at] = cell;
                    }
                }
                VisitKind::Parked { occupied } => {
                    bundle.walking &= !bit;
                    if occupied && self.spec.prefetch {
                        bundle.ahead.push(cell);
                    }
                }
                VisitKind::Ended => {
                    bundle.walking &= !bit;
                    bundle.open &= !bit;
                }
            }
            if bundle.walking == 0 {
                // Only the last ray's visit can be the last of the shell: nothing is in a CTU any more.
                let next = match bundle.table.is_empty() {
                    true => State::Waiting,
                    false => State::Sending { sent: 0, shell_over: true },
                };
                self.set_state(slot, next);
            }
            if kind == VisitKind::Occupied {
                return;
            }
        }
    }

    /// Sends one table entry, or, when no bundle has any, one cell to prefetch.
    #[inline]
    fn send_entry<A, O: Observer>(
        &mut self,
        now: Cycle,
        sending: u32,
        io: &mut ShellTrackerIo<'_>,
        run: &mut Run<'_, A, O>,
        done: &mut Done,
    ) {
        let Some(slot) = next_set_bit(u64::from(sending), self.send_turn) else { return };
        if !io.entries.can_push(now) {
            done.blocked = true;
            return;
        }
        done.worked = true;
        let at = slot as usize;
        let bundle = &mut self.bundles[at];
        let State::Sending { sent, shell_over } = bundle.state else { return };
        let slot = slot as u8;
        let n_entries = bundle.table.len() as u32;
        if sent < n_entries {
            let entry = bundle.table.entry(sent as usize);
            io.entries.send(now, ListEntry { slot, cell: entry.cell, mask: entry.mask }, run.observer);
            bundle.entries_out += 1;
        } else {
            // After the entries, the cells of the shell to come.
            let cell = bundle.ahead[(sent - n_entries) as usize];
            io.entries.send(now, ListEntry { slot, cell, mask: 0 }, run.observer);
            bundle.prefetches_out += 1;
        }
        let sent = sent + 1;
        let n_ahead = if shell_over { bundle.ahead.len() as u32 } else { 0 };
        if sent == n_entries {
            bundle.ahead = distinct(&bundle.ahead);
        }
        let n_ahead = if sent == n_entries && shell_over { bundle.ahead.len() as u32 } else { n_ahead };
        if sent < n_entries + n_ahead {
            bundle.state = State::Sending { sent, shell_over };
            return;
        }
        bundle.table.clear();
        self.send_turn = u32::from(slot) + 1;
        self.set_state(at, if shell_over { State::Waiting } else { State::Walking });
    }

    /// Bundles with nothing outstanding go on to their next shell, or end.
    #[inline]
    fn pass_barriers(&mut self, waiting: u32, store: &RayStore, any_hit: bool, done: &mut Done) {
        let mut left = waiting;
        while left != 0 {
            let slot = left.trailing_zeros() as usize;
            left &= left - 1;
            let bundle = &mut self.bundles[slot];
            if bundle.entries_out != 0 || bundle.tests_out != 0 {
                self.settled &= !(1 << slot);
                continue;
            }
            let mut open = bundle.open;
            while open != 0 {
                let index = open.trailing_zeros() as u8;
                open &= open - 1;
                if let Some(best) = store.best(RayRef { slot: slot as u8, index }) {
                    bundle.limits[usize::from(index)] = best.t;
                    if any_hit {
                        bundle.open &= !(1 << index);
                    }
                }
            }
            if bundle.open != 0 {
                self.enter_shell(slot);
            } else if bundle.prefetches_out == 0 {
                self.set_state(slot, State::Ending);
            } else {
                // Until the last prefetch is through.
                self.settled &= !(1 << slot);
                continue;
            }
            done.worked = true;
        }
    }

    /// Tells one bundle's end.
    fn tell_end<A, O: Observer>(
        &mut self,
        now: Cycle,
        ending: u32,
        io: &mut ShellTrackerIo<'_>,
        run: &mut Run<'_, A, O>,
        done: &mut Done,
    ) {
        if !io.ends.can_push(now) {
            done.blocked = true;
            return;
        }
        let slot = ending.trailing_zeros() as u8;
        let bundle = &self.bundles[usize::from(slot)];
        let n_rays = bundle.n_rays as u8;
        io.ends.send(now, RayEnd { ray: RayRef { slot, index: 0 }, n_rays }, run.observer);
        io.over.set(now, slot);
        let all = u64::MAX >> (64 - bundle.n_rays);
        run.observer.rays(now, run.block, slot, all, Phase::Away, Phase::Returning);
        self.set_state(usize::from(slot), State::Free);
        done.worked = true;
    }
}

/// The cells, without those that one of the last eight distinct ones equals.
fn distinct(cells: &[Cell]) -> Vec<Cell> {
    let mut seen = Mailbox::default();
    let number = |cell: &Cell| cell.0.iter().fold(0, |n, place| n << 8 | u32::from(*place));
    let mut is_new = |cell: &&Cell| {
        let is_new = !seen.contains(number(cell));
        if is_new {
            seen.push(number(cell));
        }
        is_new
    };
    cells.iter().filter(|cell| is_new(cell)).copied().collect()
}

#[cfg(test)]
#[path = "shell_tracker_tests.rs"]
mod tests;
