//! Bundle generator: expands a descriptor into rays, one a cycle, and deals them to the CTUs.
//!
//! ```text
//! command FIFO --Job--> [ bundle, ray counter ] --NewRay--> link of the next CTU with room
//! ```
//! A bundle starts when a slot of the result merge is free (resource). Rays go round the CTUs; none has room: output
//! full. The formulas are `datapath::bundle`. Source: 1992 board paper ("bundle"); timing ASSUMED.

use crate::board::Work;
use crate::fixed::Formats;
use crate::sim::{Activity, Cause, Cycle, Fifo, Wire, next_in_turn};

use super::{Job, NewRay};

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
}

/// The ports of a cycle.
#[derive(Debug)]
pub struct BundleGeneratorIo<'a> {
    /// What the command's jobs hold.
    pub work: Work<'a>,
    /// Number formats.
    pub formats: &'a Formats,
    /// Descriptors.
    pub commands: &'a mut Fifo<Job>,
    /// The result merge's taken slots, as of the start of the cycle, a bit each.
    pub taken_slots: u64,
    /// How many slots it has.
    pub n_slots: u32,
    /// Tells the result merge of a bundle that starts.
    pub started: &'a mut Wire<(u8, Job)>,
    /// A link per CTU of the cluster.
    pub rays: &'a mut [Fifo<NewRay>],
}

impl BundleGenerator {
    /// True when no bundle is being expanded.
    pub fn is_quiet(&self) -> bool {
        self.current.is_none()
    }

    /// One cycle.
    #[inline]
    pub fn tick(&mut self, now: Cycle, io: BundleGeneratorIo<'_>) -> Activity {
        let Some(current) = &mut self.current else {
            let Some(&job) = io.commands.front(now) else { return Activity::Idle };
            // A bundle takes two cycles at least, so the merge's state has every start that was told.
            let slot = (!io.taken_slots).trailing_zeros();
            if slot >= io.n_slots {
                return Activity::Stall(Cause::Resource);
            }
            let slot = slot as u8;
            io.commands.pop(now);
            io.started.set(now, (slot, job));
            self.current = Some(Current { job, slot, next: 0 });
            return Activity::Work;
        };
        let Some(ctu) = next_in_turn(io.rays.len(), self.turn, |c| io.rays[c].can_push(now)) else {
            return Activity::Stall(Cause::OutputFull);
        };
        self.turn = ctu + 1;
        let ray = match io.work {
            Work::Rays(rays) => rays[(current.job.first_ray + current.next) as usize],
            Work::Bundles(bundles) => {
                bundles[current.job.index as usize].ray(io.formats, current.next as usize)
            }
        };
        io.rays[ctu].push(now, NewRay { ray, slot: current.slot, index: current.next as u8 });
        current.next += 1;
        if current.next == current.job.n_rays {
            self.current = None;
        }
        Activity::Work
    }
}
