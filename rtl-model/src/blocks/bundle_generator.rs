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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::bench::Bench;
    use crate::datapath::RayWords;
    use crate::fixed::Formats;
    use crate::memory_image::MemoryImage;

    const RAY: RayWords = RayWords { origin: [0; 3], dir: [1 << 23, 0, 0], t_max: 1 };

    /// Links and cycles of the rays of jobs of 3 rays, with `taken_slots` of 4 slots, through links of depth `depth`
    /// that nobody reads; the activity of each cycle.
    fn dealt(
        mut generator: BundleGenerator,
        taken_slots: u64,
        depth: u32,
    ) -> (Vec<Vec<NewRay>>, Vec<Activity>) {
        let mut bench = Bench::new(MemoryImage::build(&Formats::default(), &[], Some(1)));
        let (mut commands, mut started) = (Fifo::new(2), Wire::new());
        let mut rays = vec![Fifo::new(depth); 2];
        commands.push(0, Job { n_rays: 3, ..Job::default() });
        let activities = (1..9)
            .map(|now| {
                bench.run(|store, run| {
                    run.work = Work::Rays(&[RAY; 3]);
                    let io = BundleGeneratorIo {
                        commands: &mut commands,
                        taken_slots,
                        n_slots: 4,
                        started: &mut started,
                        store,
                        rays: &mut rays,
                    };
                    generator.tick(now, io, run)
                })
            })
            .collect();
        let links = rays.iter_mut().map(|link| (20..30).filter_map(|now| link.pop(now)).collect()).collect();
        (links, activities)
    }

    #[test]
    fn bundle_generator_takes_a_cycle_to_start_and_then_sends_a_ray_a_cycle() {
        let (links, activities) = dealt(BundleGenerator::new(None), 0b1, 4);
        let indices: Vec<Vec<u8>> = links.iter().map(|l| l.iter().map(|r| r.ray.index).collect()).collect();
        assert_eq!(indices, [vec![0, 2], vec![1]], "round the CTUs");
        assert!(links.iter().flatten().all(|new| new.ray.slot == 1 && new.n_rays == 3));
        let works = activities.iter().filter(|a| **a == Activity::Work).count();
        assert_eq!((works, activities[4]), (4, Activity::Idle));
    }

    #[test]
    fn bundle_generator_in_shells_sends_a_bundle_to_the_module_of_its_slot() {
        for (taken, module) in [(0b0, 0), (0b1, 1), (0b11, 0)] {
            let (links, _) = dealt(BundleGenerator::new(Some(2)), taken, 4);
            assert_eq!((links[module].len(), links[1 - module].len()), (3, 0));
        }
    }

    #[test]
    fn bundle_generator_stalls_for_a_slot_and_for_room() {
        let (links, activities) = dealt(BundleGenerator::new(None), 0b1111, 4);
        assert!(links.iter().all(Vec::is_empty));
        assert!(activities.iter().all(|a| *a == Activity::Stall(Cause::Resource)));
        let (links, activities) = dealt(BundleGenerator::new(Some(2)), 0, 1);
        assert_eq!(links[0].len(), 1, "one ray fits");
        assert_eq!(activities[2..], [Activity::Stall(Cause::OutputFull); 6]);
    }
}
