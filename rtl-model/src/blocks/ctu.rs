//! Cell Traversal Unit in grid partition: steps its rays through the grid, one step a cycle, each ray waiting for its cell's tests.
//!
//! ```text
//! new rays --> [ contexts ] --ready, in turn--> [ step pipeline, depth cycles ] --+--> cell requests (occupied cell)
//!                 ^   ^---- again (empty cell) ----------------------------------'+--> ray results (ray ended)
//!                 '---- list done, reduced (wires from loader and reducer)
//! ```
//! Context states: free, ready, in the pipeline, waiting (list not through, or tests not reduced). A ray enters its
//! next cell only after every result of the last one is reduced, and a kill acts only there.
//! Timing: a step every `initiation_interval` cycles, out after `depth`; a ray alone steps every
//! max(depth, initiation_interval) cycles.
//! Stalls: request or result link full stalls the whole pipeline (output full); a ray is ready within the interval
//! (resource); all rays waiting (starved).
//! Source: 1990-92 board papers (CTUs feed one ICU); contexts and timing ASSUMED. The occupancy bit of every cell is
//! ASSUMED to be on the CTU's chip, so that empty cells cost no memory access.

use crate::answers::{Answers, Step};
use crate::datapath::HitWords;
use crate::datapath::cell_step::{Cell, advance};
use crate::sim::{Activity, Cause, Cycle, Fifo, Observer, Phase, Pipe, RayRef, Wires, next_set_bit};
use crate::spec::CtuSpec;

use super::{CellRequest, ContextId, ListDone, NewRay, RayEnd, RayStore, Reduced, Run};

#[derive(Clone, Copy, Debug)]
struct Context {
    ray: RayRef,
    cell: Cell,
    best: Option<HitWords>,
    /// Not yet in its first cell.
    entering: bool,
    /// No cell request made yet.
    fresh: bool,
    /// The loader is through with the cell's list.
    list_done: bool,
    /// Tests sent less tests reduced; negative while results overtake the loader's count.
    outstanding: i32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Entered an empty cell: step again.
    Again,
    /// Entered an occupied cell.
    Request,
    /// Left the grid, or nothing nearer can come.
    End,
}

#[derive(Clone, Copy, Debug)]
struct Issued {
    context: u8,
    outcome: Outcome,
}

/// The unit.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Ctu {
    /// A bit per context.
    all: u64,
    free: u64,
    ready: u64,
    turn: u32,
    cooldown: u32,
    pipe: Pipe<Issued>,
    initiation_interval: u32,
    id: u8,
    contexts: Vec<Context>,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct CtuIo<'a> {
    /// The rays' words.
    pub store: &'a RayStore,
    /// Rays from the bundle generator.
    pub rays: &'a mut Fifo<NewRay>,
    /// To the patch loader.
    pub requests: &'a mut Fifo<CellRequest>,
    /// To the result merge.
    pub ends: &'a mut Fifo<RayEnd>,
    /// From the patch loader.
    pub list_done: &'a Wires<ListDone>,
    /// From the reducer.
    pub reduced: &'a Wires<Reduced>,
}

impl Ctu {
    /// An idle unit, number `id` of its module.
    pub fn new(spec: &CtuSpec, id: u8) -> Self {
        let empty = Context {
            ray: RayRef::default(),
            cell: Cell([0; 3]),
            best: None,
            entering: false,
            fresh: false,
            list_done: false,
            outstanding: 0,
        };
        Ctu {
            id,
            contexts: vec![empty; spec.contexts as usize],
            all: u64::MAX >> (64 - spec.contexts),
            free: u64::MAX >> (64 - spec.contexts),
            ready: 0,
            turn: 0,
            pipe: Pipe::new(spec.depth),
            initiation_interval: spec.initiation_interval,
            cooldown: 0,
        }
    }

    /// True when no ray is inside.
    pub fn is_quiet(&self) -> bool {
        self.free == self.all
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
        io: CtuIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        let to_me = usize::from(self.id);
        let messages = io.list_done.has(now, to_me) | io.reduced.has(now, to_me);
        let arrival = (self.free != 0) && io.rays.front(now).is_some();
        if !(messages | arrival) & (self.ready == 0) & self.pipe.is_empty() {
            self.cooldown = self.cooldown.saturating_sub(1);
            return if self.is_quiet() { Activity::Idle } else { Activity::Stall(Cause::Starved) };
        }
        if let Some(done) = io.list_done.get(now, to_me) {
            let context = &mut self.contexts[usize::from(done.context)];
            context.list_done = true;
            context.outstanding += done.tests.cast_signed();
            run.observer.ray(now, run.block, context.ray, Phase::Loading, Phase::Away);
            self.wake(done.context);
        }
        if let Some(reduced) = io.reduced.get(now, to_me) {
            let context = &mut self.contexts[usize::from(reduced.context)];
            context.best = reduced.best;
            context.outstanding -= 1;
            self.wake(reduced.context);
        }
        let blocked = !self.leave_pipe(now, io.requests, io.ends, run);
        let arrived = self.accept(now, io.rays, run);
        self.cooldown = self.cooldown.saturating_sub(1);
        let mut issued = false;
        if !blocked {
            let mut step = None;
            if self.cooldown == 0
                && let Some(context) = next_set_bit(self.ready & !arrived, self.turn)
            {
                self.ready &= !(1 << context);
                self.turn = context + 1;
                self.cooldown = self.initiation_interval;
                issued = true;
                let stepping = &mut self.contexts[context as usize];
                run.observer.ray(now, run.block, stepping.ray, Phase::Away, Phase::Stepping);
                step = Some(Issued { context: context as u8, outcome: stepping.step(io.store, run) });
            }
            if issued || !self.pipe.is_empty() {
                self.pipe.step(step);
            }
        }
        if issued {
            Activity::Work
        } else if blocked {
            Activity::Stall(Cause::OutputFull)
        } else if self.ready & !arrived != 0 {
            Activity::Stall(Cause::Resource)
        } else if !self.is_quiet() {
            Activity::Stall(Cause::Starved)
        } else {
            Activity::Idle
        }
    }

    fn wake(&mut self, id: u8) {
        let context = &self.contexts[usize::from(id)];
        if context.list_done && context.outstanding == 0 {
            self.ready |= 1 << id;
        }
    }

    /// Sends the pipeline's oldest step on; false when its link is full.
    fn leave_pipe<A, O: Observer>(
        &mut self,
        now: Cycle,
        requests: &mut Fifo<CellRequest>,
        ends: &mut Fifo<RayEnd>,
        run: &mut Run<'_, A, O>,
    ) -> bool {
        let Some(&Issued { context: id, outcome }) = self.pipe.head() else { return true };
        let context = &mut self.contexts[usize::from(id)];
        match outcome {
            Outcome::Again => {
                self.ready |= 1 << id;
                run.observer.ray(now, run.block, context.ray, Phase::Stepping, Phase::Away);
            }
            Outcome::Request => {
                if !requests.can_push(now) {
                    return false;
                }
                context.list_done = false;
                let fresh = std::mem::take(&mut context.fresh);
                let from = ContextId { ctu: self.id, context: id };
                let (ray, cell) = (context.ray, context.cell);
                requests.send(now, CellRequest { context: from, ray, cell, fresh }, run.observer);
                run.observer.ray(now, run.block, ray, Phase::Stepping, Phase::Queued);
            }
            Outcome::End => {
                if !ends.can_push(now) {
                    return false;
                }
                let ray = context.ray;
                ends.send(now, RayEnd { ray, n_rays: 1 }, run.observer);
                run.observer.ray(now, run.block, ray, Phase::Stepping, Phase::Returning);
                self.free |= 1 << id;
            }
        }
        true
    }

    /// Takes a new ray into a free context; it may step from the next cycle on. Returns that context's bit.
    fn accept<A, O: Observer>(
        &mut self,
        now: Cycle,
        rays: &mut Fifo<NewRay>,
        run: &mut Run<'_, A, O>,
    ) -> u64 {
        let Some(context) = next_set_bit(self.free, 0) else { return 0 };
        let Some(NewRay { ray, .. }) = rays.take(now, run.observer) else { return 0 };
        self.contexts[context as usize] = Context {
            ray,
            cell: Cell([0; 3]),
            best: None,
            entering: true,
            fresh: true,
            list_done: false,
            outstanding: 0,
        };
        self.free &= !(1 << context);
        self.ready |= 1 << context;
        1 << context
    }
}

impl Context {
    /// Enters the first or the next cell, or ends the ray.
    #[inline]
    fn step<A: Answers, O>(&mut self, store: &RayStore, run: &mut Run<'_, A, O>) -> Outcome {
        let entering = std::mem::take(&mut self.entering);
        run.counters.rays += u64::from(entering);
        if !entering && run.any_hit && self.best.is_some() {
            return Outcome::End;
        }
        let (image, at) = (run.image, self.cell);
        let ray = store.words(self.ray);
        let limit_t = self.best.map_or(ray.t_max, |hit| hit.t);
        let step = run.answers.step(run.at(self.ray), || {
            if entering {
                return Step::Enter(image.grid.cell_of(&image.formats, ray.origin));
            }
            advance(&image.formats, &image.grid, ray, at, limit_t).map_or(Step::End, Step::Enter)
        });
        let Step::Enter(cell) = step else { return Outcome::End };
        self.cell = cell;
        run.counters.cells += 1;
        if image.is_occupied(cell) { Outcome::Request } else { Outcome::Again }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answers::Live;
    use crate::blocks::bench::Bench;
    use crate::datapath::RayWords;
    use crate::fixed::Formats;
    use crate::memory_image::MemoryImage;

    /// Cycles in which steps are made by `n_rays` rays along a row of 8 empty cells, and in which results leave.
    fn steps_and_results(spec: &CtuSpec, n_rays: u32) -> (Vec<u64>, Vec<u64>) {
        let formats = Formats::default();
        let mut bench = Bench::new(MemoryImage::build(&formats, &[], Some(3)));
        let one = 1 << formats.coord_frac_bits;
        let words = RayWords { origin: [-one; 3], dir: [one - 1, 0, 0], t_max: formats.t_limit() };
        let mut ctu = Ctu::new(spec, 0);
        let (mut rays, mut requests, mut results) = (Fifo::new(32), Fifo::new(2), Fifo::new(2));
        for index in 0..n_rays as u8 {
            let ray = RayRef { slot: 0, index };
            bench.store.start(ray, words);
            rays.push(u64::from(index), NewRay { ray, n_rays: 1 });
        }
        let (list_done, reduced) = (Wires::new(1), Wires::new(1));
        let (mut steps, mut ends) = (Vec::new(), Vec::new());
        for now in 100..3000 {
            let activity = bench.run(|store, run| {
                let io = CtuIo {
                    store,
                    rays: &mut rays,
                    requests: &mut requests,
                    ends: &mut results,
                    list_done: &list_done,
                    reduced: &reduced,
                };
                ctu.tick::<Live, _>(now, io, run)
            });
            if activity == Activity::Work {
                steps.push(now);
            }
            ends.extend(results.pop(now + 1).map(|_| now));
        }
        assert_eq!(bench.counters.cells, 8 * u64::from(n_rays));
        assert_eq!(ends.len() as u32, n_rays);
        (steps, ends)
    }

    #[test]
    fn ctu_ray_alone_steps_at_exactly_the_longer_of_depth_and_interval_and_leaves_after_depth() {
        for (initiation_interval, depth) in [(1, 4), (4, 4), (7, 4), (1, 1), (3, 9)] {
            let spec = CtuSpec { contexts: 2, initiation_interval, depth };
            let (steps, ends) = steps_and_results(&spec, 1);
            assert_eq!(steps.len(), 9, "8 cells and the step out of the grid");
            let apart = u64::from(initiation_interval.max(depth));
            assert!(steps.windows(2).all(|w| w[1] - w[0] == apart), "{steps:?}");
            assert_eq!(ends, [steps[8] + u64::from(depth)]);
        }
    }

    #[test]
    fn ctu_of_many_rays_steps_at_exactly_every_interval() {
        for (initiation_interval, depth) in [(1, 4), (3, 4), (5, 9)] {
            let spec = CtuSpec { contexts: 16, initiation_interval, depth };
            let (steps, _) = steps_and_results(&spec, 16);
            assert_eq!(steps.len(), 9 * 16);
            // The first rays come one a cycle, and the last leave the others behind: look between.
            let apart = u64::from(initiation_interval);
            assert!(steps[4..120].windows(2).all(|w| w[1] - w[0] == apart), "{steps:?}");
        }
    }
}
