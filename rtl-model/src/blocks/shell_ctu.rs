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
