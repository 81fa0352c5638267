//! Result merge: counts the rays of each bundle that have ended and sends their hits on in ray order when all have.
//!
//! ```text
//! RayEnd links (grid: one per CTU, shells: one per module) --one a cycle, in turn--> [ bundle slots ]
//! bundle ended --one entry a cycle, in ray order--> result FIFO (a hit record each, or one word of hit bits)
//!              --low-resolution job: a ray's work an entry--> estimate FIFO, to the dispatcher
//! ```
//! A slot is taken when the bundle generator starts a bundle and free again after its last entry is sent. Bundles leave
//! one after the other in the order in which they ended.
//! Timing: an end that comes in cycle n is counted in n, the bundle's first entry goes out in n + 1 at the earliest.
//! Stalls: result or estimate FIFO full (output full). Source: 1992 board paper (bundles return together); slots ASSUMED.

use std::collections::VecDeque;

use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Phase, RayRef, Wire, next_in_turn};

use super::{Estimate, HostPort, Job, RayEnd, RayStore, ResultEntry, Run};

#[derive(Clone, Debug, Default)]
struct Slot {
    job: Job,
    /// Rays still to come; a bundle with none has ended.
    pending: u32,
    /// Entries sent.
    sent: u32,
}

/// The block.
#[derive(Clone, Debug)]
pub struct ResultMerge {
    slots: Vec<Slot>,
    /// Taken slots, a bit each.
    taken: u64,
    /// Slots whose bundle has ended, oldest first: they drain one after the other. At most one entry a slot.
    ended: VecDeque<u8>,
    turn: usize,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct ResultMergeIo<'a> {
    /// A bundle that starts.
    pub started: &'a Wire<(u8, Job)>,
    /// From the CTUs or trackers of the cluster.
    pub ends: &'a mut [Fifo<RayEnd>],
    /// The rays' hits.
    pub store: &'a RayStore,
    /// Toward host and dispatcher.
    pub host: &'a mut HostPort,
}

impl ResultMerge {
    /// `n_slots` free slots.
    pub fn new(n_slots: u32) -> Self {
        ResultMerge {
            slots: vec![Slot::default(); n_slots as usize],
            taken: 0,
            ended: VecDeque::with_capacity(n_slots as usize),
            turn: 0,
        }
    }

    /// The taken slots, a bit each.
    pub fn taken_slots(&self) -> u64 {
        self.taken
    }

    /// True when no bundle is in progress.
    pub fn is_quiet(&self) -> bool {
        self.taken == 0
    }

    /// One cycle.
    #[inline]
    pub fn tick<A, O: Observer>(
        &mut self,
        now: Cycle,
        io: ResultMergeIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        let drained = self.drain(now, io.store, io.host, run);
        let started = io.started.get(now);
        if let Some((slot, job)) = started {
            self.taken |= 1 << slot;
            self.slots[usize::from(slot)] = Slot { job, pending: job.n_rays, sent: 0 };
        }
        let gathered = self.gather(now, io.ends, io.store, run);
        if drained == Some(true) || gathered || started.is_some() {
            Activity::Work
        } else if drained == Some(false) {
            Activity::Stall(Cause::OutputFull)
        } else {
            Activity::Idle
        }
    }

    /// Takes the end of one ray or bundle.
    fn gather<A, O: Observer>(
        &mut self,
        now: Cycle,
        ends: &mut [Fifo<RayEnd>],
        store: &RayStore,
        run: &mut Run<'_, A, O>,
    ) -> bool {
        let Some(link) = next_in_turn(ends.len(), self.turn, |c| ends[c].front(now).is_some()) else {
            return false;
        };
        self.turn = link + 1;
        let Some(RayEnd { ray, n_rays }) = ends[link].take(now, run.observer) else { return false };
        for i in 0..n_rays {
            let ray = RayRef { slot: ray.slot, index: ray.index + i };
            run.counters.hits += u64::from(store.best(ray).is_some());
        }
        let slot = &mut self.slots[usize::from(ray.slot)];
        slot.pending -= u32::from(n_rays);
        if slot.pending == 0 {
            self.ended.push_back(ray.slot);
        }
        true
    }

    /// Sends one entry of the oldest ended bundle; `Some(false)`: no room.
    fn drain<A, O: Observer>(
        &mut self,
        now: Cycle,
        store: &RayStore,
        host: &mut HostPort,
        run: &mut Run<'_, A, O>,
    ) -> Option<bool> {
        let id = *self.ended.front()?;
        let slot = &mut self.slots[usize::from(id)];
        let n = slot.job.n_rays;
        let ray = |i: u32| RayRef { slot: id, index: i as u8 };
        if slot.job.low_resolution {
            if !host.estimates.can_push(now) {
                return Some(false);
            }
            let (index, cost) = (slot.job.first_ray + slot.sent, store.cost(ray(slot.sent)));
            host.estimates.send(now, Estimate { index, cost }, run.observer);
            slot.sent += 1;
            if slot.sent < n {
                return Some(true);
            }
        } else {
            if !host.entries.can_push(now) {
                return Some(false);
            }
            let entry = if run.any_hit {
                let bits = (0..n).fold(0, |bits, i| bits | u64::from(store.best(ray(i)).is_some()) << i);
                ResultEntry::Any { first_ray: slot.job.first_ray, bits, n_rays: n }
            } else {
                ResultEntry::Nearest {
                    ray: slot.job.first_ray + slot.sent,
                    hit: store.best(ray(slot.sent)),
                    last: slot.sent + 1 == n,
                }
            };
            slot.sent += 1;
            host.entries.send(now, entry, run.observer);
            if !entry.is_last() {
                return Some(true);
            }
            host.ends.push(now, ());
        }
        if O::ON {
            run.observer.rays(now, run.block, id, u64::MAX >> (64 - n), Phase::Returning, Phase::Away);
        }
        self.ended.pop_front();
        self.taken &= !(1 << id);
        Some(true)
    }
}
