//! Bundle generator: expands a descriptor into rays, one a cycle, and deals them out.
//!
//! ```text
//! command FIFO --Job--> [ bundle, ray counter ] --NewRay--> grid: link of the next CTU with room
//!                                                           shells: link of the module that owns the bundle's slot
//! ```
//! A bundle starts when a slot of the result merge is free (resource). In grid partition rays go round the CTUs; in shells
//! slot s belongs to module s mod M, and all its rays go to that module's shell tracker. No room: output full. The
//! formulas are `datapath::bundle`.
//! Timing: a cycle to take a descriptor, then a ray a cycle.
//! Source: 1992 board paper ("bundle"); timing ASSUMED.

use crate::answers::Answers;
use crate::board::Work;
use crate::sim::{Activity, Cause, Cycle, EventKind, Fifo, Observer, Phase, RayRef, Wire, next_in_turn};

use super::{Job, NewRay, RayStore, Run};

#[derive(Clone, Copy, Debug)]
struct Current {
    job: Job,
    slot: u8,
    next: u32,
}

/// The block.
#[derive(Clone, Debug, Default)]
pub struct BundleGenerator {
    current: Option<Current>,
    turn: usize,
    /// In shells: modules of the cluster. 0 in grid partition.
    n_modules: u8,
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct BundleGeneratorIo<'a> {
    /// Descriptors.
    pub commands: &'a mut Fifo<Job>,
    /// The result merge's taken slots, as of the start of the cycle, a bit each.
    pub taken_slots: u64,
    /// How many slots it has.
    pub n_slots: u32,
    /// Tells the result merge of a bundle that starts.
    pub started: &'a mut Wire<(u8, Job)>,
    /// Where the rays' words go.
    pub store: &'a mut RayStore,
    /// A link per CTU of the cluster (grid), or per module (shells).
    pub rays: &'a mut [Fifo<NewRay>],
}

impl BundleGenerator {
    /// An idle block; `shell_modules` is the number of modules in shells, `None` in grid partition.
    pub fn new(shell_modules: Option<u32>) -> Self {
        BundleGenerator { current: None, turn: 0, n_modules: shell_modules.unwrap_or(0) as u8 }
    }

    /// True when no bundle is being expanded.
    pub fn is_quiet(&self) -> bool {
        self.current.is_none()
    }

    /// One cycle.
    #[inline]
    pub fn tick<A: Answers, O: Observer>(
        &mut self,
        now: Cycle,
        io: BundleGeneratorIo<'_>,
        run: &mut Run<'_, A, O>,
    ) -> Activity {
        let Some(current) = &mut self.current else {
            let Some(&job) = io.commands.front(now) else { return Activity::Idle };
            // A bundle takes two cycles at least, so the merge's state has every start that was told.
            let slot = (!io.taken_slots).trailing_zeros();
            if slot >= io.n_slots {
                return Activity::Stall(Cause::Resource);
            }
            let slot = slot as u8;
            io.commands.take(now, run.observer);
            io.started.set(now, (slot, job));
            run.answers.bundle(run.at(RayRef { slot, index: 0 }), &job);
            if O::ON {
                let payload = u32::from(slot) << 24 | job.index & 0xff_ffff;
                run.observer.event(now, EventKind::Bundle, run.block, payload);
                run.observer.event(now, EventKind::FirstRay, run.block, job.first_ray);
            }
            self.current = Some(Current { job, slot, next: 0 });
            return Activity::Work;
        };
        let link = match self.n_modules {
            0 => next_in_turn(io.rays.len(), self.turn, |c| io.rays[c].can_push(now)),
            n => Some(usize::from(current.slot % n)).filter(|&m| io.rays[m].can_push(now)),
        };
        let Some(link) = link else { return Activity::Stall(Cause::OutputFull) };
        self.turn = link + 1;
        let Current { job, slot, next } = *current;
        let ray = RayRef { slot, index: next as u8 };
        let (work, formats) = (run.work, &run.image.formats);
        let words = run.answers.ray(run.at(ray), || match work {
            Work::Rays(rays) => rays[(job.first_ray + next) as usize],
            Work::Bundles(bundles) => bundles[job.index as usize].ray(formats, next as usize),
        });
        io.store.start(ray, words);
        io.rays[link].send(now, NewRay { ray, n_rays: job.n_rays as u8 }, run.observer);
        run.observer.ray(now, run.block, ray, Phase::Away, Phase::Waiting);
        current.next += 1;
        if current.next == job.n_rays {
            self.current = None;
        }
        Activity::Work
    }
}
