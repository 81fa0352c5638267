//! The tracker with two CTUs, a loader and a reducer that a script plays.

use super::*;
use crate::blocks::bench::Bench;
use crate::datapath::{Facing, HitWords};
use crate::fixed::Formats;
use crate::memory_image::MemoryImage;

/// What a ray's visits are, one a step; it ends after the last.
type Script = Vec<Vec<VisitKind>>;

struct Scene {
    bench: Bench,
    tracker: ShellTracker,
    rays: Fifo<NewRay>,
    requests: Vec<Fifo<StepRequest>>,
    visits: Vec<Fifo<Visit>>,
    entries: Fifo<ListEntry>,
    entry_done: Wire<EntryDone>,
    reduced: Wires<Reduced>,
    ends: Fifo<RayEnd>,
    over: Wire<u8>,
    script: Script,
    steps: Vec<usize>,
    now: Cycle,
    /// Requests in the order in which they were made, with cycle and CTU.
    asked: Vec<(Cycle, usize, u8)>,
    sent: Vec<(Cycle, ListEntry)>,
}

impl Scene {
    fn new(script: Script, entries_deep: u32, table: u32) -> Scene {
        let spec = ShellSpec { entries: table, ..ShellSpec::default() };
        Scene {
            bench: Bench::new(MemoryImage::build(&Formats::default(), &[], Some(3))),
            tracker: ShellTracker::new(&spec, 4, 2),
            rays: Fifo::new(64),
            requests: vec![Fifo::new(2); 2],
            visits: vec![Fifo::new(16); 2],
            entries: Fifo::new(entries_deep),
            entry_done: Wire::new(),
            reduced: Wires::new(1),
            ends: Fifo::new(2),
            over: Wire::new(),
            steps: vec![0; script.len()],
            script,
            now: 0,
            asked: Vec::new(),
            sent: Vec::new(),
        }
    }

    fn give_rays(&mut self) {
        let n_rays = self.script.len() as u8;
        for index in 0..n_rays {
            let ray = RayRef { slot: 0, index };
            self.bench.store.start(ray, *self.bench.store.words(ray));
            self.rays.push(u64::from(index), NewRay { ray, n_rays });
        }
        self.now = u64::from(n_rays);
    }

    fn run(&mut self, cycles: u32) {
        for _ in 0..cycles {
            self.tick(true);
        }
    }

    /// A cycle: the CTUs answer a request at once, whatever cell it is in; `takes`: the loader takes an entry.
    fn tick(&mut self, takes: bool) -> Activity {
        let now = self.now;
        let io = ShellTrackerIo {
            rays: &mut self.rays,
            store: &mut RayStore::new(1),
            requests: &mut self.requests,
            visits: &mut self.visits,
            entries: &mut self.entries,
            entry_done: &self.entry_done,
            reduced: &self.reduced,
            ends: &mut self.ends,
            over: &mut self.over,
        };
        let tracker = &mut self.tracker;
        let activity = self.bench.run(|store, run| tracker.tick(now, ShellTrackerIo { store, ..io }, run));
        for ctu in 0..2 {
            if let Some(StepRequest { ray, .. }) = self.requests[ctu].pop(now) {
                self.asked.push((now, ctu, ray.index));
                let step = &mut self.steps[usize::from(ray.index)];
                let kind =
                    self.script[usize::from(ray.index)].get(*step).copied().unwrap_or(VisitKind::Ended);
                // Every step of every ray is in a cell of its own.
                let cell = Cell([ray.index, *step as u8, 0]);
                *step += 1;
                self.visits[ctu].push(now, Visit { ray, cell, kind });
            }
        }
        if takes {
            self.sent.extend(self.entries.pop(now).map(|entry| (now, entry)));
        }
        self.now += 1;
        activity
    }
}

use VisitKind::{Empty, Occupied};

const PARKED: VisitKind = VisitKind::Parked { occupied: false };

#[test]
fn shell_tracker_asks_in_ray_order_round_by_round_and_gives_the_ctus_turns() {
    let mut scene = Scene::new(
        vec![vec![Empty, Empty, PARKED], vec![Empty, PARKED], vec![Empty, Empty, Empty, PARKED]],
        4,
        8,
    );
    scene.give_rays();
    // Until the first barrier.
    while scene.asked.len() < 9 {
        scene.tick(true);
    }
    // In turn: rays 0 1 2, 0 1 2, 0 2, 2.
    let of_ctu =
        |c| scene.asked.iter().filter(|(_, ctu, _)| *ctu == c).map(|(_, _, ray)| *ray).collect::<Vec<_>>();
    assert_eq!((of_ctu(0), of_ctu(1)), (vec![0, 2, 1, 0, 2], vec![1, 0, 2, 2]));
}

#[test]
fn shell_tracker_sends_entries_when_the_shell_is_walked_and_waits_for_all_of_them() {
    let mut scene = Scene::new(vec![vec![Occupied, PARKED], vec![Occupied, Occupied, PARKED]], 4, 8);
    scene.give_rays();
    scene.run(30);
    let cells: Vec<Cell> = scene.sent.iter().map(|(_, entry)| entry.cell).collect();
    assert_eq!(cells, [Cell([0, 0, 0]), Cell([1, 0, 0]), Cell([1, 1, 0])]);
    assert!(scene.sent.windows(2).all(|w| w[1].0 == w[0].0 + 1), "one a cycle");
    let walked = scene.asked.len();
    assert_eq!(walked, 5);
    assert_eq!(scene.tick(true), Activity::Stall(Cause::Starved));
    // Two lists through with a test each, the third without one: no step until the tests are reduced too.
    for tests in [1, 1, 0] {
        scene.entry_done.set(scene.now - 1, EntryDone { slot: 0, tests, prefetch: false });
        scene.tick(true);
    }
    scene.reduced.set(scene.now - 1, 0, Reduced::default());
    scene.tick(true);
    scene.tick(true);
    scene.tick(true);
    assert_eq!(scene.asked.len(), walked, "a test is outstanding");
    scene.reduced.set(scene.now - 1, 0, Reduced::default());
    let barrier = scene.now;
    scene.tick(true);
    scene.tick(true);
    scene.tick(true);
    // The barrier in the cycle of the last message, a request in the next, taken in the one after.
    let mut asked = scene.asked[walked..].to_vec();
    asked.sort_by_key(|(_, _, ray)| *ray);
    assert_eq!(asked, [(barrier + 2, 1, 0), (barrier + 2, 0, 1)]);
}

#[test]
fn shell_tracker_with_a_full_table_sends_it_before_the_walk_goes_on() {
    let mut scene = Scene::new(vec![vec![Occupied, Occupied, Occupied, PARKED]], 8, 2);
    scene.give_rays();
    let resource = (0..40).filter(|_| scene.tick(true) == Activity::Stall(Cause::Resource)).count();
    let cells: Vec<u8> = scene.sent.iter().map(|(_, entry)| entry.cell.0[1]).collect();
    assert_eq!(cells, [0, 1, 2]);
    // The third visit found the table full; it was taken after both entries had left.
    assert!(scene.sent[2].0 > scene.sent[1].0 + 1, "{:?}", scene.sent);
    assert!(resource <= 1, "entries leave meanwhile");
}

#[test]
fn shell_tracker_without_room_for_entries_stalls_and_goes_on() {
    let mut scene = Scene::new(vec![vec![Occupied, Occupied, Occupied, PARKED]], 1, 8);
    scene.give_rays();
    let stalls = (0..30).filter(|_| scene.tick(false) == Activity::Stall(Cause::OutputFull)).count();
    assert!(stalls > 10, "{stalls}");
    scene.run(20);
    assert_eq!(scene.sent.len(), 3);
}

#[test]
fn shell_tracker_ends_a_bundle_in_one_token_and_tells_the_loader() {
    let mut scene = Scene::new(vec![vec![Empty], vec![Empty, Empty], vec![]], 4, 8);
    scene.give_rays();
    let mut ended = None;
    for _ in 0..40 {
        scene.tick(true);
        if let Some(end) = scene.ends.pop(scene.now) {
            assert_eq!(scene.over.get(scene.now), Some(0));
            ended = Some(end);
        }
    }
    assert_eq!(ended, Some(RayEnd { ray: RayRef::default(), n_rays: 3 }));
    assert!(scene.tracker.is_quiet() && scene.sent.is_empty());
}

#[test]
fn shell_tracker_closes_any_hit_rays_at_the_barrier_only() {
    let mut scene = Scene::new(vec![vec![Empty, PARKED, Empty], vec![Empty, PARKED]], 4, 8);
    scene.bench.any_hit = true;
    scene.give_rays();
    // Ray 0 has a hit from the start on, yet walks its shell to the end.
    scene.bench.store.reduce(RayRef::default(), Some(HitWords { t: 1, patch: 0, facing: Facing::Front }));
    scene.run(40);
    let steps_of = |ray| scene.asked.iter().filter(|(_, _, asked)| *asked == ray).count();
    assert_eq!((steps_of(0), steps_of(1)), (2, 3), "ray 1 enters the next shell and ends there");
    assert!(scene.tracker.is_quiet());
}
