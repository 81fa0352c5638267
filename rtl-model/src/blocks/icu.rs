//! Intersection Computation Unit: one ray x patch test every `initiation_interval` cycles, out after `depth`.
//!
//! ```text
//! IcuJob (patch record, rays to test with it) --> [ job register ] --a ray an interval--> [ pipeline, depth cycles ]
//!                                                                                              --> TestResult
//! ```
//! The arithmetic is `datapath::ray_patch`, whatever the timing. A job's rays are tested lowest first; the next job is
//! taken, and its first ray tested, in the first cycle in which a test is due and no ray is left.
//! Stalls as a whole when the result FIFO is full (output full). The unit works in the `initiation_interval` cycles from
//! each test on, whether a job waits or not; beyond them it is starved while a test is inside and idle with none.
//! Depth and interval are `BoardSpec::icu_timing`'s: those given, those of a unit from the literature, or, with a named
//! division unit, the stages before the division plus its latency and the longer of both intervals, since every test,
//! hit or not, passes the unit.
//! Source: the ICU of the 1990-92 board papers; depth and interval ASSUMED (a fully pipelined fixed-point unit).

use crate::answers::Answers;
use crate::datapath::ray_patch::SeenPatch;
use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Phase, Pipe, RayRef};
use crate::spec::IcuTiming;

use super::{IcuJob, RayStore, Run, TestResult};

/// The unit.
#[derive(Clone, Debug)]
pub struct Icu {
    pipe: Pipe<TestResult>,
    initiation_interval: u32,
    cooldown: u32,
    /// Its rays are those still to be tested; none: free.
    job: IcuJob,
    /// The job's patch as seen from the origin of the ray tested last.
    seen: Option<([i32; 3], SeenPatch)>,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct IcuIo<'a> {
    /// From the loader.
    pub jobs: &'a mut Fifo<IcuJob>,
    /// The rays.
    pub store: &'a RayStore,
    /// To the reducer.
    pub results: &'a mut Fifo<TestResult>,
}

impl Icu {
    /// An idle unit with this timing.
    pub fn new(timing: &IcuTiming) -> Self {
        Icu {
            pipe: Pipe::new(timing.depth),
            initiation_interval: timing.initiation_interval,
            cooldown: 0,
            job: IcuJob::default(),
            seen: None,
        }
    }

    /// True when no test is inside or to be made.
    #[inline]
    pub fn is_quiet(&self) -> bool {
        self.pipe.is_empty() && self.job.rays == 0
    }

    /// True when time alone changes nothing in it.
    #[inline]
    pub fn is_still(&self) -> bool {
        self.pipe.is_empty() && self.cooldown == 0
    }

    /// One cycle.
    #[inline]
    pub fn tick<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        io: IcuIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        if self.is_quiet() && io.jobs.front(now).is_none() {
            self.cooldown = self.cooldown.saturating_sub(1);
            return if self.cooldown > 0 { Activity::Work } else { Activity::Idle };
        }
        if let Some(&result) = self.pipe.head() {
            if !io.results.can_push(now) {
                return Activity::Stall(Cause::OutputFull);
            }
            io.results.send(now, result, run.observer);
            run.observer.ray(now, run.block, result.ray, Phase::Testing, Phase::Reducing);
        }
        self.cooldown = self.cooldown.saturating_sub(1);
        if self.cooldown > 0 {
            self.pipe.step(None);
            return Activity::Work;
        }
        if self.job.rays == 0
            && let Some(job) = io.jobs.take(now, run.observer)
        {
            self.job = job;
            self.seen = None;
        }
        if self.job.rays == 0 {
            if !self.pipe.is_empty() {
                self.pipe.step(None);
            }
            return Activity::Stall(Cause::Starved);
        }
        let result = self.next_test(io.store, run);
        run.observer.ray(now, run.block, result.ray, Phase::Loading, Phase::Testing);
        self.pipe.step(Some(result));
        self.cooldown = self.initiation_interval;
        Activity::Work
    }

    /// Tests the lowest ray that is left.
    #[inline]
    fn next_test<A: Answers, O>(&mut self, store: &RayStore, run: &mut Run<'_, A, O>) -> TestResult {
        run.counters.tests += 1;
        let ray = RayRef { slot: self.job.slot, index: self.job.rays.trailing_zeros() as u8 };
        self.job.rays &= self.job.rays - 1;
        let (image, patch, seen) = (run.image, self.job.patch, &mut self.seen);
        let hit = run.answers.test(run.at(ray), || {
            let words = store.words(ray);
            match seen {
                Some((origin, seen)) if *origin == words.origin => {
                    seen.test(&image.formats, words.dir, words.t_max)
                }
                _ => {
                    let from_here = SeenPatch::new(&image.formats, words.origin, image.patch_ref(patch));
                    let hit = from_here.test(&image.formats, words.dir, words.t_max);
                    *seen = Some((words.origin, from_here));
                    hit
                }
            }
        });
        TestResult { ray, context: self.job.context, hit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::bench::Bench;
    use crate::datapath::PatchWords;
    use crate::fixed::Formats;
    use crate::memory_image::MemoryImage;
    use crate::spec::BoardSpec;

    fn one_patch() -> Bench {
        let corners = [[0, 0, 9], [0, 9, 9], [9, 9, 9], [9, 9, 9]];
        let patch = PatchWords { corners, is_triangle: true, id: 0 };
        Bench::new(MemoryImage::build(&Formats::default(), &[patch], Some(1)))
    }

    fn tick(
        bench: &mut Bench,
        icu: &mut Icu,
        now: Cycle,
        jobs: &mut Fifo<IcuJob>,
        results: &mut Fifo<TestResult>,
    ) -> Activity {
        bench.run(|store, run| icu.tick(now, IcuIo { jobs, store, results }, run))
    }

    fn job(rays: u64) -> IcuJob {
        IcuJob { rays, ..IcuJob::default() }
    }

    /// Cycles in which a unit with jobs of `rays` always waiting makes a test, and in which it answers.
    fn tests_and_answers(timing: IcuTiming, rays: u64, cycles: u64) -> (Vec<u64>, Vec<u64>) {
        let (mut bench, mut icu) = (one_patch(), Icu::new(&timing));
        let (mut jobs, mut results) = (Fifo::new(2), Fifo::new(2));
        let (mut tests, mut answers) = (Vec::new(), Vec::new());
        for now in 0..cycles {
            if jobs.can_push(now) {
                jobs.push(now, job(rays));
            }
            let before = bench.counters.tests;
            tick(&mut bench, &mut icu, now, &mut jobs, &mut results);
            tests.extend((bench.counters.tests > before).then_some(now));
            answers.extend(results.pop(now + 1).map(|_| now));
        }
        (tests, answers)
    }

    #[test]
    fn icu_tests_at_exactly_every_interval_and_answers_at_exactly_depth_whatever_the_jobs() {
        for (interval, depth) in [(1, 22), (3, 22), (22, 22), (30, 22), (375, 3500), (3500, 3500)] {
            for rays in [1, 0b1011, u64::MAX] {
                let timing = IcuTiming { initiation_interval: interval, depth };
                let (tests, answers) = tests_and_answers(timing, rays, 20_000);
                assert!(tests.len() > 5);
                for (i, test) in (0..).zip(&tests) {
                    assert_eq!(*test, tests[0] + i * u64::from(interval), "interval {interval}");
                }
                for (test, answer) in tests.iter().zip(&answers) {
                    assert_eq!(answer - test, u64::from(depth), "depth {depth}");
                }
                assert!(tests.len() - answers.len() <= depth.div_ceil(interval) as usize);
            }
        }
    }

    #[test]
    fn icu_tests_the_rays_of_a_job_lowest_first_and_each_once() {
        let (mut bench, mut icu) = (one_patch(), Icu::new(&IcuTiming { initiation_interval: 1, depth: 1 }));
        let (mut jobs, mut results) = (Fifo::new(2), Fifo::new(2));
        jobs.push(0, job(1 << 63 | 0b101));
        let mut rays = Vec::new();
        for now in 1..10 {
            tick(&mut bench, &mut icu, now, &mut jobs, &mut results);
            rays.extend(results.pop(now + 1).map(|result: TestResult| result.ray.index));
        }
        assert_eq!(rays, [0, 2, 63]);
        assert!(icu.is_quiet());
    }

    #[test]
    fn icu_with_a_named_division_unit_tests_and_answers_at_its_latency_and_interval() {
        // T = 24: 27 quotient bits at 2 a cycle are 14 cycles, 3 more for check, correction and rounding.
        for (form, interval) in [("serial", 17), ("unrolled", 5)] {
            let text = format!(
                "[icu]\ninitiation_interval = 5\n[division]\nunit = \"non-restoring\"\nradix_log2 = 2\nform = \"{form}\""
            );
            let timing = BoardSpec::from_toml(&text).unwrap().icu_timing();
            let (tests, answers) = tests_and_answers(timing, 1, 500);
            assert!(tests.len() > 5 && answers.len() > 5);
            assert!(tests.windows(2).all(|pair| pair[1] - pair[0] == interval), "{form}: {tests:?}");
            assert_eq!(answers[0] - tests[0], 22 + 17);
        }
    }

    #[test]
    fn icu_of_subdivision_at_25_mhz_makes_66_700_and_7_140_tests_a_second() {
        let seconds = 0.02; // 500,000 cycles
        for (unit, expected) in [("subdivision-fast", 66.7e3), ("subdivision-slow", 7.14e3)] {
            let timing = BoardSpec::from_toml(&format!("[icu]\nunit = \"{unit}\"")).unwrap().icu_timing();
            let (tests, _) = tests_and_answers(timing, u64::MAX, (25e6 * seconds) as u64);
            let rate = tests.len() as f64 / seconds;
            assert!((rate / expected - 1.0).abs() < 0.005, "{rate} tests a second");
        }
    }

    #[test]
    fn icu_works_through_the_interval_and_is_idle_after_it_when_nothing_is_left() {
        let (mut bench, mut icu) = (one_patch(), Icu::new(&IcuTiming { initiation_interval: 5, depth: 2 }));
        let (mut jobs, mut results) = (Fifo::new(2), Fifo::new(8));
        jobs.push(0, job(1));
        let worked: Vec<bool> = (0..9)
            .map(|now| tick(&mut bench, &mut icu, now, &mut jobs, &mut results) == Activity::Work)
            .collect();
        assert_eq!(worked, [false, true, true, true, true, true, false, false, false]);
    }

    #[test]
    fn icu_with_a_full_result_queue_stalls_as_a_whole_and_loses_nothing() {
        let (mut bench, mut icu) = (one_patch(), Icu::new(&IcuTiming { initiation_interval: 1, depth: 3 }));
        let (mut jobs, mut results) = (Fifo::new(2), Fifo::new(1));
        jobs.push(0, job(0b111));
        let stalls = (1..20)
            .filter(|now| {
                tick(&mut bench, &mut icu, *now, &mut jobs, &mut results)
                    == Activity::Stall(Cause::OutputFull)
            })
            .count();
        assert!(stalls > 10, "{stalls}");
        let mut rays = Vec::new();
        for now in 20..40 {
            rays.extend(results.pop(now).map(|result| result.ray.index));
            tick(&mut bench, &mut icu, now, &mut jobs, &mut results);
        }
        assert_eq!(rays, [0, 1, 2]);
    }
}
