//! The loader with a memory that answers after a given time.

use super::*;
use crate::blocks::bench::Bench;
use crate::datapath::PatchWords;
use crate::fixed::Formats;

struct Scene {
    bench: Bench,
    loader: ShellLoader,
    entries: Fifo<ListEntry>,
    over: Wire<u8>,
    jobs: Fifo<IcuJob>,
    entry_done: Wire<EntryDone>,
    misses: [Fifo<MemoryRequest>; 3],
    fills: [Wire<Line>; 3],
    /// Lines on their way: cycle of arrival, cache, line.
    coming: Vec<(Cycle, usize, Line)>,
    /// Cycles that the memory takes.
    latency: u64,
    now: Cycle,
    sent: Vec<(Cycle, IcuJob)>,
    done: Vec<(Cycle, EntryDone)>,
    requests: Vec<(usize, MemoryRequest)>,
}

/// Three patches in cell (1, 1, 1) of 2 x 2 x 2, the third in (0, 1, 1) too.
fn patches() -> MemoryImage {
    let formats = Formats::default();
    let one = 1_i32 << formats.coord_frac_bits;
    let patch = |id: u32, x: [i32; 2]| {
        let (y, z) = ([one / 4, one / 2], one / 8 * (id as i32 + 1));
        let corners = [[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]];
        PatchWords { corners, is_triangle: false, id }
    };
    let (right, across) = ([one / 4, one / 2], [-one / 4, one / 2]);
    MemoryImage::build(&formats, &[patch(0, right), patch(1, right), patch(2, across)], Some(1))
}

const CELL: Cell = Cell([1, 1, 1]);

impl Scene {
    fn new(latency: u64, cache_bytes: u32, jobs_deep: u32) -> Scene {
        let image = patches();
        let port = || ReadPort::new(cache_bytes, 1, 4);
        let masks = MaskCache::new(1024, 1, 2, Line(image.mask_base()), image.mask_lines_per_slot());
        let spec = LoaderSpec { slots: 4, stations: 4 };
        let loader = ShellLoader::new(&spec, 4, image.n_patches, port(), masks, port());
        Scene {
            bench: Bench::new(image),
            loader,
            entries: Fifo::new(8),
            over: Wire::new(),
            jobs: Fifo::new(jobs_deep),
            entry_done: Wire::new(),
            misses: [Fifo::new(2), Fifo::new(2), Fifo::new(2)],
            fills: [Wire::new(), Wire::new(), Wire::new()],
            coming: Vec::new(),
            latency,
            now: 10,
            sent: Vec::new(),
            done: Vec::new(),
            requests: Vec::new(),
        }
    }

    fn give(&mut self, slot: u8, cell: Cell, mask: u64) {
        self.entries.push(self.now, ListEntry { slot, cell, mask });
        self.now += 1;
    }

    fn tick(&mut self, takes: bool) -> Activity {
        let now = self.now;
        for (cache, misses) in self.misses.iter_mut().enumerate() {
            if let Some(request) = misses.pop(now) {
                self.requests.push((cache, request));
                if !request.write {
                    self.coming.push((now + self.latency, cache, request.line));
                }
            }
        }
        // One line a cycle and cache, oldest first.
        for cache in 0..3 {
            if let Some(at) = self.coming.iter().position(|(when, c, _)| *when <= now && *c == cache) {
                let (_, _, line) = self.coming.remove(at);
                self.fills[cache].set(now, line);
            }
        }
        let [list_misses, patch_misses, mask_misses] = &mut self.misses;
        let [list_fill, patch_fill, mask_fill] = &self.fills;
        let io = ShellLoaderIo {
            entries: &mut self.entries,
            over: &self.over,
            jobs: &mut self.jobs,
            entry_done: &mut self.entry_done,
            list_misses,
            list_fill,
            patch_misses,
            patch_fill,
            mask_misses,
            mask_fill,
        };
        let loader = &mut self.loader;
        let activity = self.bench.run(|_, run| loader.tick(now, io, run));
        if takes {
            self.sent.extend(self.jobs.pop(now).map(|job| (now, job)));
        }
        self.done.extend(self.entry_done.get(now).map(|done| (now, done)));
        self.now += 1;
        activity
    }

    fn run(&mut self, cycles: u32) {
        for _ in 0..cycles {
            self.tick(true);
        }
    }

    fn jobs(&self) -> Vec<(u8, u32, u64)> {
        self.sent.iter().map(|(_, job)| (job.slot, job.patch, job.rays)).collect()
    }
}

#[test]
fn shell_loader_with_warm_caches_takes_a_cycle_each_for_header_line_verdict_record_and_job() {
    let mut scene = Scene::new(5, 4096, 8);
    scene.give(0, CELL, 0b1);
    scene.run(80);
    assert_eq!(scene.jobs(), [(0, 0, 1), (0, 1, 1), (0, 2, 1)]);
    scene.give(1, CELL, 0b11);
    let given = scene.now;
    let before = scene.sent.len();
    scene.run(20);
    // Taken in the cycle `given`, then header, line, verdict, record, job; seen by the reader one later.
    let cycles: Vec<Cycle> = scene.sent[before..].iter().map(|(now, _)| now - given).collect();
    assert_eq!(cycles, [6, 7, 8], "and a verdict a cycle");
    let (done, entry) = scene.done[1];
    assert_eq!((done - given, entry.tests), (7, 6), "told when the last verdict is through");
    assert!(scene.loader.is_quiet());
}

#[test]
fn shell_loader_gives_each_ray_of_a_bundle_once_and_in_the_order_of_the_table() {
    let mut scene = Scene::new(7, 4096, 8);
    // Both cells list patch 2.
    scene.give(0, Cell([0, 1, 1]), 0b0110);
    scene.give(0, CELL, 0b1100);
    scene.give(2, CELL, 0b0001);
    scene.run(120);
    let of_bundle = |slot| scene.jobs().into_iter().filter(|job| job.0 == slot).collect::<Vec<_>>();
    assert_eq!(of_bundle(0), [(0, 2, 0b0110), (0, 0, 0b1100), (0, 1, 0b1100), (0, 2, 0b1000)]);
    assert_eq!(of_bundle(2), [(2, 0, 1), (2, 1, 1), (2, 2, 1)]);
    assert_eq!(scene.bench.counters.list_entries, 7);
    // The same bundle slot with a new bundle: all is untested again.
    scene.over.set(scene.now - 1, 0);
    scene.tick(true);
    let before = scene.sent.len();
    scene.give(0, Cell([0, 1, 1]), 0b0110);
    scene.run(40);
    assert_eq!(scene.jobs()[before..], [(0, 2, 0b0110)]);
}

#[test]
fn shell_loader_fetches_records_of_several_patches_at_once() {
    let first_and_last = |latency| {
        let mut scene = Scene::new(latency, 4096, 8);
        scene.give(0, CELL, 1);
        scene.run(400);
        (scene.sent[0].0, scene.sent[2].0)
    };
    let (first, last) = first_and_last(50);
    assert!(last - first < 50, "{} cycles apart", last - first);
}

#[test]
fn shell_loader_prefetch_asks_for_all_lines_and_tests_nothing() {
    let mut scene = Scene::new(5, 4096, 8);
    scene.give(0, CELL, 0);
    scene.run(80);
    assert!(scene.sent.is_empty() && scene.bench.counters.list_entries == 0);
    assert!(matches!(scene.done[..], [(_, EntryDone { slot: 0, tests: 0, prefetch: true })]));
    let asked = scene.requests.len();
    assert_eq!(asked, 2 + 3, "header, list, three records");
    scene.give(0, CELL, 1);
    scene.run(20);
    assert_eq!((scene.sent.len(), scene.requests.len()), (3, asked), "all here");
}

#[test]
fn shell_loader_without_room_for_jobs_stalls_and_loses_nothing() {
    let mut scene = Scene::new(2, 4096, 1);
    scene.give(0, CELL, 0b101);
    let stalls = (0..60).filter(|_| scene.tick(false) == Activity::Stall(Cause::OutputFull)).count();
    assert!(stalls > 20, "{stalls}");
    scene.run(20);
    assert_eq!(scene.jobs(), [(0, 0, 0b101), (0, 1, 0b101), (0, 2, 0b101)]);
}

#[test]
fn shell_loader_waiting_for_lines_says_so() {
    let mut scene = Scene::new(30, 0, 8);
    scene.give(0, CELL, 1);
    let activities: Vec<Activity> = (0..20).map(|_| scene.tick(true)).collect();
    assert_eq!(activities[5..], [Activity::Stall(Cause::CacheMiss); 15]);
}
