//! Cell Traversal Unit in shells: a step of a ray, whose place the shell tracker keeps.
//!
//! ```text
//! StepRequest --> [ step pipeline, depth cycles ] --> Visit (the cell entered, its occupancy bit; parked; ended)
//! ```
//! The unit holds no ray: up to `contexts` steps are inside at once, each of another ray.
//! Timing: a step every `initiation_interval` cycles, out after `depth`; with `contexts` under depth / interval, as many
//! in `depth` cycles as there are contexts.
//! Stalls: visit link full stalls the whole pipeline (output full); a request within the interval, or all contexts taken
//! (resource); steps inside and no request (starved).
//! Source: 1990-92 board papers (CTUs feed one ICU); timing ASSUMED, as is the occupancy bit of every cell on the chip.

use crate::answers::{Answers, Step};
use crate::datapath::cell_step::advance;
use crate::datapath::shell::distance;
use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Phase, Pipe};
use crate::spec::CtuSpec;

use super::{RayStore, Run, StepRequest, Visit, VisitKind};

/// The unit.
#[derive(Clone, Debug)]
pub struct ShellCtu {
    pipe: Pipe<Visit>,
    inside: u32,
    contexts: u32,
    initiation_interval: u32,
    cooldown: u32,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct ShellCtuIo<'a> {
    /// The rays' words.
    pub store: &'a RayStore,
    /// From the shell tracker.
    pub requests: &'a mut Fifo<StepRequest>,
    /// To the shell tracker.
    pub visits: &'a mut Fifo<Visit>,
}

impl ShellCtu {
    /// An idle unit.
    pub fn new(spec: &CtuSpec) -> Self {
        ShellCtu {
            pipe: Pipe::new(spec.depth),
            inside: 0,
            contexts: spec.contexts,
            initiation_interval: spec.initiation_interval,
            cooldown: 0,
        }
    }

    /// True when no step is inside.
    #[inline]
    pub fn is_quiet(&self) -> bool {
        self.pipe.is_empty()
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
        io: ShellCtuIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        self.cooldown = self.cooldown.saturating_sub(1);
        let requested = io.requests.front(now).is_some();
        if self.pipe.is_empty() && !requested {
            return Activity::Idle;
        }
        if let Some(&visit) = self.pipe.head() {
            if !io.visits.can_push(now) {
                return Activity::Stall(Cause::OutputFull);
            }
            io.visits.send(now, visit, run.observer);
            let to = if visit.kind == VisitKind::Occupied { Phase::Queued } else { Phase::Away };
            run.observer.ray(now, run.block, visit.ray, Phase::Stepping, to);
            self.inside -= 1;
        }
        let mut visit = None;
        if self.cooldown == 0
            && self.inside < self.contexts
            && let Some(request) = io.requests.take(now, run.observer)
        {
            visit = Some(step(&request, io.store, run));
            run.observer.ray(now, run.block, request.ray, Phase::Away, Phase::Stepping);
            self.cooldown = self.initiation_interval;
            self.inside += 1;
        }
        self.pipe.step(visit);
        match (visit, requested) {
            (Some(_), _) => Activity::Work,
            (None, true) => Activity::Stall(Cause::Resource),
            (None, false) => Activity::Stall(Cause::Starved),
        }
    }
}

/// The step's function.
#[inline]
fn step<A: Answers, O>(request: &StepRequest, store: &RayStore, run: &mut Run<'_, A, O>) -> Visit {
    let StepRequest { ray, cell, apex, radius, limit_t, enters } = *request;
    let (image, words) = (run.image, store.words(ray));
    let found = run.answers.step(run.at(ray), || {
        if enters {
            return Step::Enter(image.grid.cell_of(&image.formats, words.origin));
        }
        match advance(&image.formats, &image.grid, words, cell, limit_t) {
            None => Step::End,
            Some(next) if distance(next, apex) >= radius => Step::Park(next),
            Some(next) => Step::Enter(next),
        }
    });
    match found {
        Step::Enter(cell) => {
            run.counters.cells += 1;
            run.counters.rays += u64::from(enters);
            let kind = if image.is_occupied(cell) { VisitKind::Occupied } else { VisitKind::Empty };
            Visit { ray, cell, kind }
        }
        Step::Park(cell) => {
            Visit { ray, cell, kind: VisitKind::Parked { occupied: image.is_occupied(cell) } }
        }
        Step::End => Visit { ray, cell, kind: VisitKind::Ended },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::bench::Bench;
    use crate::datapath::RayWords;
    use crate::datapath::cell_step::Cell;
    use crate::fixed::Formats;
    use crate::memory_image::MemoryImage;
    use crate::sim::RayRef;

    /// A row of 8 empty cells along x and a ray in its first one.
    fn row() -> Bench {
        let formats = Formats::default();
        let mut bench = Bench::new(MemoryImage::build(&formats, &[], Some(3)));
        let one = 1 << formats.coord_frac_bits;
        let words = RayWords { origin: [-one; 3], dir: [one - 1, 0, 0], t_max: formats.t_limit() };
        for index in 0..64 {
            bench.store.start(RayRef { slot: 0, index }, words);
        }
        bench
    }

    fn request(index: u8, radius: u32) -> StepRequest {
        let limit_t = Formats::default().t_limit();
        let ray = RayRef { slot: 0, index };
        StepRequest { ray, radius, limit_t, ..StepRequest::default() }
    }

    /// Cycles in which a unit with requests always waiting takes one, and in which a visit leaves it.
    fn takes_and_visits(spec: &CtuSpec) -> (Vec<u64>, Vec<u64>) {
        let (mut bench, mut ctu) = (row(), ShellCtu::new(spec));
        let (mut requests, mut visits) = (Fifo::new(2), Fifo::new(2));
        let (mut takes, mut outs) = (Vec::new(), Vec::new());
        for now in 0..200 {
            if requests.can_push(now) {
                requests.push(now, request((now % 64) as u8, 8));
            }
            let activity = bench.run(|store, run| {
                ctu.tick(now, ShellCtuIo { store, requests: &mut requests, visits: &mut visits }, run)
            });
            takes.extend((activity == Activity::Work).then_some(now));
            outs.extend(visits.pop(now + 1).map(|_| now));
        }
        (takes, outs)
    }

    #[test]
    fn shell_ctu_steps_at_exactly_every_interval_and_out_at_exactly_depth() {
        for (initiation_interval, depth) in [(1, 1), (1, 4), (3, 4), (9, 4)] {
            let spec = CtuSpec { contexts: 16, initiation_interval, depth };
            let (takes, visits) = takes_and_visits(&spec);
            assert!(takes.len() > 15);
            assert!(takes.windows(2).all(|w| w[1] - w[0] == u64::from(initiation_interval)), "{takes:?}");
            for (take, visit) in takes.iter().zip(&visits) {
                assert_eq!(visit - take, u64::from(depth));
            }
        }
    }

    #[test]
    fn shell_ctu_with_one_context_has_one_step_inside() {
        let (takes, _) = takes_and_visits(&CtuSpec { contexts: 1, initiation_interval: 1, depth: 4 });
        assert!(takes.windows(2).all(|w| w[1] - w[0] == 4), "{takes:?}");
    }

    #[test]
    fn shell_ctu_visits_say_what_the_step_came_to_and_wait_for_room() {
        let (mut bench, mut ctu) =
            (row(), ShellCtu::new(&CtuSpec { contexts: 16, initiation_interval: 1, depth: 2 }));
        let (mut requests, mut visits) = (Fifo::new(8), Fifo::<Visit>::new(1));
        let at = |x| Cell([x, 0, 0]);
        let asked = [
            StepRequest { enters: true, ..request(0, 8) },
            request(1, 8),
            request(2, 1),
            StepRequest { cell: at(7), ..request(3, 8) },
            StepRequest { limit_t: 0, ..request(4, 8) },
        ];
        for (now, request) in (0..).zip(asked) {
            requests.push(now, request);
        }
        let (mut kinds, mut full) = (Vec::new(), 0);
        for now in 10..60 {
            // The reader takes every fifth cycle.
            if now % 5 == 0 {
                kinds.extend(visits.pop(now).map(|visit| (visit.cell, visit.kind)));
            }
            let activity = bench.run(|store, run| {
                ctu.tick(now, ShellCtuIo { store, requests: &mut requests, visits: &mut visits }, run)
            });
            full += u32::from(activity == Activity::Stall(Cause::OutputFull));
        }
        let expected = [
            (at(0), VisitKind::Empty),
            (at(1), VisitKind::Empty),
            (at(1), VisitKind::Parked { occupied: false }),
            (at(7), VisitKind::Ended),
            (at(0), VisitKind::Ended),
        ];
        assert_eq!(kinds, expected);
        assert!(full >= 12, "{full} cycles without room");
        assert!(ctu.is_quiet());
    }
}
