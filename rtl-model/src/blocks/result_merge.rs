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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::bench::Bench;
    use crate::datapath::{Facing, HitWords};
    use crate::fixed::Formats;
    use crate::memory_image::MemoryImage;

    fn bench() -> Bench {
        Bench::new(MemoryImage::build(&Formats::default(), &[], Some(1)))
    }

    fn tick(
        bench: &mut Bench,
        merge: &mut ResultMerge,
        now: Cycle,
        started: &Wire<(u8, Job)>,
        ends: &mut [Fifo<RayEnd>],
        host: &mut HostPort,
    ) -> Activity {
        bench.run(|store, run| merge.tick(now, ResultMergeIo { started, ends, store, host }, run))
    }

    #[test]
    fn result_merge_sends_a_bundle_in_ray_order_from_the_cycle_after_its_last_end() {
        let (mut bench, mut merge) = (bench(), ResultMerge::new(2));
        let (mut started, mut ends) = (Wire::new(), [Fifo::new(2), Fifo::new(2)]);
        let mut host = HostPort::new(2, 8);
        started.set(0, (1, Job { first_ray: 70, n_rays: 3, ..Job::default() }));
        let ray = |index| RayRef { slot: 1, index };
        let hit = Some(HitWords { t: 5, patch: 9, facing: Facing::Back });
        bench.store.start(ray(2), *bench.store.words(ray(2)));
        bench.store.reduce(ray(2), hit);
        // The rays end out of order, the last one in cycle 6.
        for (now, link, index) in [(3, 0, 2), (3, 1, 0), (5, 0, 1)] {
            ends[link].push(now, RayEnd { ray: ray(index), n_rays: 1 });
        }
        let mut sent = Vec::new();
        for now in 1..12 {
            tick(&mut bench, &mut merge, now, &started, &mut ends, &mut host);
            sent.extend(host.entries.pop(now + 1).map(|entry| (now, entry)));
        }
        let entry = |ray, hit, last| ResultEntry::Nearest { ray, hit, last };
        let expected = [(7, entry(70, None, false)), (8, entry(71, None, false)), (9, entry(72, hit, true))];
        assert_eq!(sent, expected);
        assert!(merge.is_quiet() && bench.counters.hits == 1);
    }

    #[test]
    fn result_merge_with_a_full_queue_holds_its_bundle() {
        let (mut bench, mut merge) = (bench(), ResultMerge::new(1));
        let (mut started, mut ends) = (Wire::new(), [Fifo::new(2)]);
        let mut host = HostPort::new(2, 1);
        started.set(0, (0, Job { n_rays: 2, ..Job::default() }));
        ends[0].push(1, RayEnd { ray: RayRef::default(), n_rays: 2 });
        let activities =
            [1, 2, 3, 4, 5].map(|now| tick(&mut bench, &mut merge, now, &started, &mut ends, &mut host));
        let full = Activity::Stall(Cause::OutputFull);
        assert_eq!(activities, [Activity::Work, Activity::Work, Activity::Work, full, full]);
        assert!(!merge.is_quiet());
        host.entries.pop(6);
        assert_eq!(tick(&mut bench, &mut merge, 7, &started, &mut ends, &mut host), Activity::Work);
        assert!(merge.is_quiet());
    }

    #[test]
    fn result_merge_of_a_low_resolution_job_tells_each_rays_work_to_the_dispatcher_alone() {
        let (mut bench, mut merge) = (bench(), ResultMerge::new(1));
        let (mut started, mut ends) = (Wire::new(), [Fifo::new(2)]);
        let mut host = HostPort::new(2, 4);
        started.set(0, (0, Job { first_ray: 40, n_rays: 2, low_resolution: true, ..Job::default() }));
        for (index, cells) in [(0, 3), (1, 5)] {
            let ray = RayRef { slot: 0, index };
            bench.store.start(ray, *bench.store.words(ray));
            (0..cells).for_each(|_| bench.store.count_cell(ray));
        }
        ends[0].push(1, RayEnd { ray: RayRef::default(), n_rays: 2 });
        let mut estimates = Vec::new();
        for now in 1..9 {
            tick(&mut bench, &mut merge, now, &started, &mut ends, &mut host);
            estimates.extend(host.estimates.pop(now + 1));
        }
        assert_eq!(estimates, [Estimate { index: 40, cost: 3 }, Estimate { index: 41, cost: 5 }]);
        assert!(host.is_quiet() && merge.is_quiet());
    }
}
