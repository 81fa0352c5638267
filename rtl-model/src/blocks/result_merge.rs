//! Result merge: gathers the rays' results of each bundle and sends them on in ray order when the bundle has ended.
//!
//! ```text
//! RayResult links (one per CTU) --one a cycle, in turn--> [ bundle slots: 64 results each ]
//! bundle ended --one entry a cycle, in ray order--> result FIFO (a hit record each, or one word of hit bits)
//! ```
//! A slot is taken when the bundle generator starts a bundle and free again after its last entry is sent.
//! Stalls: result FIFO full (output full). Source: 1992 board paper (bundles return together); slots ASSUMED.

use crate::datapath::HitWords;
use crate::functional::CanonicalCounters;
use crate::packet::MAX_BUNDLE_RAYS;
use crate::sim::{Activity, Cause, Cycle, Fifo, Wire, next_in_turn};

use super::{HostPort, Job, RayResult, ResultEntry};

#[derive(Clone, Debug)]
struct Slot {
    job: Job,
    hits: [Option<HitWords>; MAX_BUNDLE_RAYS],
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
    /// Slots whose bundle has ended, oldest first: they drain one after the other.
    ended: std::collections::VecDeque<u8>,
    turn: usize,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct ResultMergeIo<'a> {
    /// The command asks for any hit only.
    pub any_hit: bool,
    /// A bundle that starts.
    pub started: &'a Wire<(u8, Job)>,
    /// From the CTUs of the cluster.
    pub results: &'a mut [Fifo<RayResult>],
    /// Toward the host.
    pub host: &'a mut HostPort,
    /// Canonical counts.
    pub counters: &'a mut CanonicalCounters,
}

impl ResultMerge {
    /// `n_slots` free slots.
    pub fn new(n_slots: u32) -> Self {
        let slot = Slot { job: Job::default(), hits: [None; MAX_BUNDLE_RAYS], pending: 0, sent: 0 };
        ResultMerge {
            slots: vec![slot; n_slots as usize],
            taken: 0,
            ended: std::collections::VecDeque::with_capacity(n_slots as usize),
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
    pub fn tick(&mut self, now: Cycle, io: ResultMergeIo<'_>) -> Activity {
        let drained = self.drain(now, io.any_hit, io.host);
        let started = io.started.get(now);
        if let Some((slot, job)) = started {
            self.taken |= 1 << slot;
            let slot = &mut self.slots[usize::from(slot)];
            slot.job = job;
            slot.pending = job.n_rays;
            slot.sent = 0;
        }
        let gathered = self.gather(now, io.results, io.counters);
        if drained == Some(true) || gathered || started.is_some() {
            Activity::Work
        } else if drained == Some(false) {
            Activity::Stall(Cause::OutputFull)
        } else {
            Activity::Idle
        }
    }

    /// Takes one ray's result.
    fn gather(
        &mut self,
        now: Cycle,
        results: &mut [Fifo<RayResult>],
        counters: &mut CanonicalCounters,
    ) -> bool {
        let Some(ctu) = next_in_turn(results.len(), self.turn, |c| results[c].front(now).is_some()) else {
            return false;
        };
        self.turn = ctu + 1;
        let Some(RayResult { slot: id, index, hit }) = results[ctu].pop(now) else { return false };
        let slot = &mut self.slots[usize::from(id)];
        slot.hits[usize::from(index)] = hit;
        counters.hits += u64::from(hit.is_some());
        slot.pending -= 1;
        if slot.pending == 0 {
            self.ended.push_back(id);
        }
        true
    }

    /// Sends one entry of the oldest ended bundle; `Some(false)`: no room.
    fn drain(&mut self, now: Cycle, any_hit: bool, host: &mut HostPort) -> Option<bool> {
        let id = *self.ended.front()?;
        if !host.entries.can_push(now) {
            return Some(false);
        }
        let slot = &mut self.slots[usize::from(id)];
        let n = slot.job.n_rays;
        let entry = if any_hit {
            let hits = slot.hits[..n as usize].iter().enumerate();
            let bits = hits.fold(0, |bits, (i, hit)| bits | u64::from(hit.is_some()) << i);
            ResultEntry::Any { first_ray: slot.job.first_ray, bits, n_rays: n }
        } else {
            ResultEntry::Nearest {
                ray: slot.job.first_ray + slot.sent,
                hit: slot.hits[slot.sent as usize],
                last: slot.sent + 1 == n,
            }
        };
        slot.sent += 1;
        host.entries.push(now, entry);
        if entry.is_last() {
            host.ends.push(now, ());
            self.ended.pop_front();
            self.taken &= !(1 << id);
        }
        Some(true)
    }
}
