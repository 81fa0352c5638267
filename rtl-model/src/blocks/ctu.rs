//! Cell Traversal Unit: steps its rays through the grid, one step a cycle, each ray waiting for its cell's tests.
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

use crate::datapath::cell_step::{Cell, advance};
use crate::datapath::{HitWords, RayWords};
use crate::functional::CanonicalCounters;
use crate::memory_image::MemoryImage;
use crate::sim::{Activity, Cause, Cycle, Fifo, Pipe, Wires, next_set_bit};
use crate::spec::CtuSpec;

use super::{CellRequest, ContextId, ListDone, NewRay, RayResult, Reduced};

#[derive(Clone, Copy, Debug)]
struct Context {
    ray: RayWords,
    cell: Cell,
    best: Option<HitWords>,
    slot: u8,
    index: u8,
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
struct Step {
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
    pipe: Pipe<Step>,
    initiation_interval: u32,
    id: u8,
    contexts: Vec<Context>,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct CtuIo<'a> {
    /// The grid and its occupancy bits.
    pub image: &'a MemoryImage,
    /// The command asks for any hit only.
    pub any_hit: bool,
    /// Rays from the bundle generator.
    pub rays: &'a mut Fifo<NewRay>,
    /// To the patch loader.
    pub requests: &'a mut Fifo<CellRequest>,
    /// To the result merge.
    pub results: &'a mut Fifo<RayResult>,
    /// From the patch loader.
    pub list_done: &'a Wires<ListDone>,
    /// From the reducer.
    pub reduced: &'a Wires<Reduced>,
    /// Canonical counts.
    pub counters: &'a mut CanonicalCounters,
}

impl Ctu {
    /// An idle unit, number `id` of its module.
    pub fn new(spec: &CtuSpec, id: u8) -> Self {
        let empty = Context {
            ray: NewRay::default().ray,
            cell: Cell([0; 3]),
            best: None,
            slot: 0,
            index: 0,
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

    /// The ray in a context, for the ICU.
    #[inline]
    pub fn ray(&self, context: u8) -> &RayWords {
        &self.contexts[usize::from(context)].ray
    }

    /// True when no ray is inside.
    pub fn is_quiet(&self) -> bool {
        self.free == self.all
    }

    /// One cycle.
    #[inline]
    pub fn tick(&mut self, now: Cycle, io: CtuIo<'_>) -> Activity {
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
            self.wake(done.context);
        }
        if let Some(reduced) = io.reduced.get(now, to_me) {
            let context = &mut self.contexts[usize::from(reduced.context)];
            context.best = reduced.best;
            context.outstanding -= 1;
            self.wake(reduced.context);
        }
        let blocked = !self.leave_pipe(now, io.requests, io.results);
        let arrived = self.accept(now, io.rays);
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
                step = Some(Step {
                    context: context as u8,
                    outcome: self.contexts[context as usize].step(io.image, io.any_hit, io.counters),
                });
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
    fn leave_pipe(
        &mut self,
        now: Cycle,
        requests: &mut Fifo<CellRequest>,
        results: &mut Fifo<RayResult>,
    ) -> bool {
        let Some(&Step { context: id, outcome }) = self.pipe.head() else { return true };
        let context = &mut self.contexts[usize::from(id)];
        match outcome {
            Outcome::Again => self.ready |= 1 << id,
            Outcome::Request => {
                if !requests.can_push(now) {
                    return false;
                }
                context.list_done = false;
                let fresh = std::mem::take(&mut context.fresh);
                let from = ContextId { ctu: self.id, context: id };
                requests.push(now, CellRequest { context: from, cell: context.cell, fresh });
            }
            Outcome::End => {
                if !results.can_push(now) {
                    return false;
                }
                results.push(now, RayResult { slot: context.slot, index: context.index, hit: context.best });
                self.free |= 1 << id;
            }
        }
        true
    }

    /// Takes a new ray into a free context; it may step from the next cycle on. Returns that context's bit.
    fn accept(&mut self, now: Cycle, rays: &mut Fifo<NewRay>) -> u64 {
        let Some(context) = next_set_bit(self.free, 0) else { return 0 };
        let Some(NewRay { ray, slot, index }) = rays.pop(now) else { return 0 };
        self.contexts[context as usize] = Context {
            ray,
            cell: Cell([0; 3]),
            best: None,
            slot,
            index,
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
    fn step(&mut self, image: &MemoryImage, any_hit: bool, counters: &mut CanonicalCounters) -> Outcome {
        if std::mem::take(&mut self.entering) {
            counters.rays += 1;
            self.cell = image.grid.cell_of(&image.formats, self.ray.origin);
        } else {
            if any_hit && self.best.is_some() {
                return Outcome::End;
            }
            let limit = self.best.map_or(self.ray.t_max, |hit| hit.t);
            match advance(&image.formats, &image.grid, &self.ray, self.cell, limit) {
                Some(cell) => self.cell = cell,
                None => return Outcome::End,
            }
        }
        counters.cells += 1;
        if image.is_occupied(self.cell) { Outcome::Request } else { Outcome::Again }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::Formats;

    /// Cycles in which steps are made by `n_rays` rays along a row of 8 empty cells, and in which results leave.
    fn steps_and_results(spec: &CtuSpec, n_rays: u32) -> (Vec<u64>, Vec<u64>) {
        let formats = Formats::default();
        let image = MemoryImage::build(&formats, &[], Some(3));
        let one = 1 << formats.coord_frac_bits;
        let ray = RayWords { origin: [-one; 3], dir: [one - 1, 0, 0], t_max: formats.t_limit() };
        let mut ctu = Ctu::new(spec, 0);
        let (mut rays, mut requests, mut results) = (Fifo::new(32), Fifo::new(2), Fifo::new(2));
        for index in 0..n_rays as u8 {
            rays.push(u64::from(index), NewRay { ray, slot: 0, index });
        }
        let (list_done, reduced) = (Wires::new(1), Wires::new(1));
        let mut counters = CanonicalCounters::default();
        let (mut steps, mut ends) = (Vec::new(), Vec::new());
        for now in 100..3000 {
            let io = CtuIo {
                image: &image,
                any_hit: false,
                rays: &mut rays,
                requests: &mut requests,
                results: &mut results,
                list_done: &list_done,
                reduced: &reduced,
                counters: &mut counters,
            };
            if ctu.tick(now, io) == Activity::Work {
                steps.push(now);
            }
            ends.extend(results.pop(now + 1).map(|_| now));
        }
        assert_eq!(counters.cells, 8 * u64::from(n_rays));
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
