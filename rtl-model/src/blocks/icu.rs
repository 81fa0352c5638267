//! Intersection Computation Unit: one ray x patch test every `initiation_interval` cycles, out after `depth`.
//!
//! ```text
//! TestToken (ray context, patch record) --> [ pipeline, depth cycles ] --> TestResult
//! ```
//! The arithmetic is `datapath::ray_patch`, whatever the timing. Stalls as a whole when the result FIFO is full (output
//! full). The unit works in the `initiation_interval` cycles from each test on, whether a token waits or not; beyond
//! them it is starved while a test is inside and idle with none.
//! With a named division unit, depth and interval are `BoardSpec::icu_timing`'s: the stages before the division plus
//! its latency, and the longer of both intervals, since every test, hit or not, passes the unit.
//! Source: the ICU of the 1990-92 board papers; depth and interval ASSUMED (a fully pipelined fixed-point unit).

use crate::datapath::ray_patch::intersect;
use crate::functional::CanonicalCounters;
use crate::memory_image::MemoryImage;
use crate::sim::{Activity, Cause, Cycle, Fifo, Pipe};
use crate::spec::IcuSpec;

use super::{Ctu, TestResult, TestToken};

/// The unit.
#[derive(Clone, Debug)]
pub struct Icu {
    pipe: Pipe<TestResult>,
    initiation_interval: u32,
    cooldown: u32,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct IcuIo<'a> {
    /// The patch records.
    pub image: &'a MemoryImage,
    /// The CTUs of the module, whose context registers hold the rays.
    pub ctus: &'a [Ctu],
    /// From the patch loader.
    pub tests: &'a mut Fifo<TestToken>,
    /// To the reducer.
    pub results: &'a mut Fifo<TestResult>,
    /// Canonical counts.
    pub counters: &'a mut CanonicalCounters,
}

impl Icu {
    /// An idle unit with this timing, a named division unit included.
    pub fn new(spec: &IcuSpec) -> Self {
        Icu { pipe: Pipe::new(spec.depth), initiation_interval: spec.initiation_interval, cooldown: 0 }
    }

    /// True when no test is inside.
    pub fn is_quiet(&self) -> bool {
        self.pipe.is_empty()
    }

    /// One cycle.
    #[inline]
    pub fn tick(&mut self, now: Cycle, io: IcuIo<'_>) -> Activity {
        if self.pipe.is_empty() && io.tests.front(now).is_none() {
            self.cooldown = self.cooldown.saturating_sub(1);
            return if self.cooldown > 0 { Activity::Work } else { Activity::Idle };
        }
        if let Some(&result) = self.pipe.head() {
            if !io.results.can_push(now) {
                return Activity::Stall(Cause::OutputFull);
            }
            io.results.push(now, result);
        }
        self.cooldown = self.cooldown.saturating_sub(1);
        if self.cooldown > 0 {
            self.pipe.step(None);
            return Activity::Work;
        }
        let input = io.tests.pop(now).map(|TestToken { context, patch, fresh }| {
            io.counters.tests += 1;
            let ray = io.ctus[usize::from(context.ctu)].ray(context.context);
            TestResult { context, hit: intersect(&io.image.formats, ray, io.image.patch_ref(patch)), fresh }
        });
        self.pipe.step(input);
        if input.is_some() {
            self.cooldown = self.initiation_interval;
            Activity::Work
        } else {
            Activity::Stall(Cause::Starved)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::ContextId;
    use crate::datapath::PatchWords;
    use crate::fixed::Formats;
    use crate::spec::{BoardSpec, CtuSpec};

    fn one_patch() -> MemoryImage {
        let corners = [[0, 0, 9], [0, 9, 9], [9, 9, 9], [9, 9, 9]];
        let patch = PatchWords { corners, is_triangle: true, id: 0 };
        MemoryImage::build(&Formats::default(), &[patch], Some(1))
    }

    /// Cycles in which a unit with a token always waiting takes a test, and in which it answers.
    fn takes_and_answers(initiation_interval: u32, depth: u32, cycles: u64) -> (Vec<u64>, Vec<u64>) {
        let (image, ctus) = (one_patch(), [Ctu::new(&CtuSpec::default(), 0)]);
        let mut icu = Icu::new(&IcuSpec { initiation_interval, depth });
        let (mut tests, mut results) = (Fifo::new(2), Fifo::new(2));
        let mut counters = CanonicalCounters::default();
        let (mut takes, mut answers) = (Vec::new(), Vec::new());
        for now in 0..cycles {
            if tests.can_push(now) {
                tests.push(now, TestToken { context: ContextId::default(), patch: 0, fresh: true });
            }
            let before = counters.tests;
            let io = IcuIo {
                image: &image,
                ctus: &ctus,
                tests: &mut tests,
                results: &mut results,
                counters: &mut counters,
            };
            icu.tick(now, io);
            takes.extend((counters.tests > before).then_some(now));
            answers.extend(results.pop(now + 1).map(|_| now));
        }
        (takes, answers)
    }

    #[test]
    fn icu_takes_at_exactly_every_interval_and_answers_at_exactly_depth() {
        for (interval, depth) in [(1, 22), (3, 22), (22, 22), (30, 22), (375, 3500), (3500, 3500)] {
            let (takes, answers) = takes_and_answers(interval, depth, 20_000);
            assert!(takes.len() > 5);
            for (i, take) in (0..).zip(&takes) {
                assert_eq!(*take, takes[0] + i * u64::from(interval), "interval {interval}");
            }
            for (take, answer) in takes.iter().zip(&answers) {
                assert_eq!(answer - take, u64::from(depth), "depth {depth}");
            }
            assert!(takes.len() - answers.len() <= depth.div_ceil(interval) as usize);
        }
    }

    #[test]
    fn icu_with_a_named_division_unit_takes_and_answers_at_its_latency_and_interval() {
        // T = 24: 27 quotient bits at 2 a cycle are 14 cycles, 3 more for check, correction and rounding.
        for (form, interval) in [("serial", 17), ("unrolled", 5)] {
            let text = format!(
                "[icu]\ninitiation_interval = 5\n[division]\nunit = \"non-restoring\"\nradix_log2 = 2\nform = \"{form}\""
            );
            let icu = BoardSpec::from_toml(&text).unwrap().icu_timing();
            let (takes, answers) = takes_and_answers(icu.initiation_interval, icu.depth, 500);
            assert!(takes.len() > 5 && answers.len() > 5);
            assert!(takes.windows(2).all(|pair| pair[1] - pair[0] == interval), "{form}: {takes:?}");
            assert_eq!(answers[0] - takes[0], 22 + 17);
        }
    }

    #[test]
    fn icu_at_25_mhz_with_intervals_375_and_3500_makes_66_700_and_7_140_tests_a_second() {
        let seconds = 0.02; // 500,000 cycles
        for (interval, expected) in [(375, 66.7e3), (3500, 7.14e3)] {
            let (takes, _) = takes_and_answers(interval, 3500, (25e6 * seconds) as u64);
            let rate = takes.len() as f64 / seconds;
            assert!((rate / expected - 1.0).abs() < 0.005, "{rate} tests a second");
        }
    }

    #[test]
    fn icu_works_through_the_interval_and_is_idle_after_it_when_nothing_is_left() {
        let (image, ctus) = (one_patch(), [Ctu::new(&CtuSpec::default(), 0)]);
        let mut icu = Icu::new(&IcuSpec { initiation_interval: 5, depth: 2 });
        let (mut tests, mut results) = (Fifo::new(2), Fifo::new(8));
        tests.push(0, TestToken { context: ContextId::default(), patch: 0, fresh: true });
        let mut counters = CanonicalCounters::default();
        let mut activity = |now| {
            let (tests, results, counters) = (&mut tests, &mut results, &mut counters);
            icu.tick(now, IcuIo { image: &image, ctus: &ctus, tests, results, counters })
        };
        let worked: Vec<bool> = (0..9).map(|now| activity(now) == Activity::Work).collect();
        assert_eq!(worked, [false, true, true, true, true, true, false, false, false]);
    }
}
