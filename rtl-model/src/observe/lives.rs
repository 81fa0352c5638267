//! The life of every ray, by phase: waiting, stepping, queued, loading, testing, reducing, returning.
//!
//! ```text
//! Seen::Rays --> tokens of each ray by phase --> phase in each cycle --> cycles by phase, per ray and summed
//! ```
//! A ray may have many tokens at once (in shells it steps on while its tests are made); its phase in a cycle is the most
//! advanced one that any of its tokens is in. The first token, `waiting`, comes with the ray's birth in the bundle
//! generator and stays for life. A life ends when the result merge has sent the last entry of the ray's bundle: the way
//! of the entry over the bus is not part of it. A life has the cycles from the one of its birth to the one before that of
//! its end, each of them in one phase, so the phases sum to the life.

use std::collections::{BTreeMap, BTreeSet};

use super::{Places, Seen, StreamError};
use crate::sim::{CommandMark, Cycle, Phase, RayRef};

/// Phases of a life.
const N: usize = Phase::LIFE.len();
/// Rays of a cluster's slots.
const RAYS_PER_CLUSTER: usize = 16 * 64;

/// A ray that is on the board, or a place for one.
#[derive(Clone, Copy, Debug)]
struct Living {
    is_alive: bool,
    /// Its life is kept, at this place of `Lives::kept`.
    kept: Option<u32>,
    born: Cycle,
    /// The cycle up to which `cycles` counts.
    since: Cycle,
    /// Phases with a token, a bit each.
    present: u8,
    tokens: [u16; N],
    cycles: [u64; N],
}

const NOBODY: Living =
    Living { is_alive: false, kept: None, born: 0, since: 0, present: 0, tokens: [0; N], cycles: [0; N] };

impl Living {
    /// The most advanced phase.
    #[inline]
    fn phase(&self) -> usize {
        (7 - (self.present | 1).leading_zeros()) as usize
    }

    /// Counts the cycles up to `now` in the present phase.
    #[inline]
    fn settle(&mut self, now: Cycle) {
        self.cycles[self.phase()] += now - self.since;
        self.since = now;
    }
}

/// The life of one ray.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RayLife {
    /// Number of its command in the stream, from 0.
    pub command: u32,
    /// Its number in the command.
    pub ray: u32,
    /// Number of its bundle in the command.
    pub bundle: u32,
    /// Its place in the bundle.
    pub index: u8,
    /// The cluster that it was on.
    pub cluster: u8,
    /// The bundle's slot there.
    pub slot: u8,
    /// The cycle in which the bundle generator made it.
    pub born: Cycle,
    /// The cycle in which the result merge let it go; `None` when the stream ended before.
    pub died: Option<Cycle>,
    /// Cycles by phase, in the order of [`Phase::LIFE`].
    pub cycles: [u64; N],
    /// Phases in turn, each with its first cycle.
    pub spans: Vec<(Cycle, Phase)>,
}

/// Lives, summed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LifeSums {
    /// Rays that lived.
    pub rays: u64,
    /// Their cycles by phase, in the order of [`Phase::LIFE`].
    pub cycles: [u64; N],
    /// Rays by length of life.
    lengths: BTreeMap<u64, u64>,
}

impl LifeSums {
    fn add(&mut self, length: u64, cycles: &[u64; N]) {
        self.rays += 1;
        self.cycles.iter_mut().zip(cycles).for_each(|(sum, n)| *sum += n);
        *self.lengths.entry(length).or_default() += 1;
    }

    /// Cycles of all lives.
    pub fn total(&self) -> u64 {
        self.cycles.iter().sum()
    }

    /// The shortest life.
    pub fn shortest(&self) -> Option<u64> {
        self.lengths.first_key_value().map(|(length, _)| *length)
    }

    /// The longest life.
    pub fn longest(&self) -> Option<u64> {
        self.lengths.last_key_value().map(|(length, _)| *length)
    }

    /// The median life; of an even number the lower of the middle two.
    pub fn median(&self) -> Option<u64> {
        let mut left = self.rays.div_ceil(2);
        self.lengths.iter().find_map(|(length, n)| {
            let found = *n >= left;
            left = left.saturating_sub(*n);
            found.then_some(*length)
        })
    }
}

/// Follows every ray's tokens.
#[derive(Clone, Debug)]
pub struct Lives {
    /// By block: its cluster.
    clusters: Vec<Option<u8>>,
    /// By cluster and [`RayRef::place`].
    living: Vec<Living>,
    /// By cluster and slot: the bundle's number and its first ray's.
    bundles: Vec<(u32, u32)>,
    n_alive: u64,
    commands: u32,
    in_cast: bool,
    /// Command and ray of those whose life is to be kept.
    asked: BTreeSet<(u32, u32)>,
    kept: Vec<RayLife>,
    rays: LifeSums,
    low_resolution: LifeSums,
}

impl Lives {
    /// Nobody has lived yet.
    pub fn new(places: &Places) -> Lives {
        Lives {
            clusters: places.blocks.iter().map(|b| b.cluster).collect(),
            living: vec![NOBODY; places.n_clusters * RAYS_PER_CLUSTER],
            bundles: vec![(0, 0); places.n_clusters * 16],
            n_alive: 0,
            commands: 0,
            in_cast: false,
            asked: BTreeSet::new(),
            kept: Vec::new(),
            rays: LifeSums::default(),
            low_resolution: LifeSums::default(),
        }
    }

    /// Asks for the life of a ray of a command to come. (Those of low-resolution casts cannot be asked for.)
    pub fn ask(&mut self, command: u32, ray: u32) {
        self.asked.insert((command, ray));
    }

    /// Commands so far, the present one included.
    pub fn n_commands(&self) -> u32 {
        self.commands
    }

    /// All rays that have died but those of low-resolution casts.
    pub fn rays(&self) -> &LifeSums {
        &self.rays
    }

    /// The rays of low-resolution casts.
    pub fn low_resolution(&self) -> &LifeSums {
        &self.low_resolution
    }

    /// The lives asked for, in order of birth.
    pub fn kept(&self) -> &[RayLife] {
        &self.kept
    }

    /// Takes what a decoder saw.
    ///
    /// # Errors
    /// [`StreamError::Tokens`]: a token that isn't there moves, a ray is born twice, dies with tokens about or outlives its
    /// command.
    #[inline]
    pub fn see(&mut self, now: Cycle, seen: &Seen) -> Result<(), StreamError> {
        match *seen {
            Seen::Rays { block, slot, mask, from, to } => self.rays_move(now, block, slot, mask, from, to),
            Seen::Bundle { block, slot, job, first_ray } => {
                let cluster = self.cluster(now, block)?;
                self.bundles[cluster * 16 + usize::from(slot & 15)] = (job, first_ray);
                Ok(())
            }
            Seen::Command(mark) => {
                match mark {
                    CommandMark::Nearest | CommandMark::Any => self.commands += 1,
                    CommandMark::LowResolution => self.in_cast = true,
                    CommandMark::Bundles => self.in_cast = false,
                    CommandMark::End => {}
                }
                if self.n_alive > 0 {
                    let what = format!("{} rays outlive their command", self.n_alive);
                    return Err(StreamError::Tokens { cycle: now, what });
                }
                Ok(())
            }
            Seen::Activity { .. } | Seen::Push { .. } | Seen::Pop { .. } => Ok(()),
        }
    }

    fn cluster(&self, now: Cycle, block: u16) -> Result<usize, StreamError> {
        self.clusters[usize::from(block)].map(usize::from).ok_or_else(|| StreamError::Tokens {
            cycle: now,
            what: format!("block {block} moves rays, but stands in no cluster"),
        })
    }

    fn rays_move(
        &mut self,
        now: Cycle,
        block: u16,
        slot: u8,
        mask: u64,
        from: Phase,
        to: Phase,
    ) -> Result<(), StreamError> {
        let cluster = self.cluster(now, block)?;
        let mut left = mask;
        while left != 0 {
            let ray = RayRef { slot: slot & 15, index: left.trailing_zeros() as u8 };
            left &= left - 1;
            self.ray_moves(now, cluster, ray, from, to).map_err(|what| StreamError::Tokens {
                cycle: now,
                what: format!("ray {} in slot {} of cluster {cluster} {what}", ray.index, ray.slot),
            })?;
        }
        Ok(())
    }

    #[inline]
    fn ray_moves(
        &mut self,
        now: Cycle,
        cluster: usize,
        ray: RayRef,
        from: Phase,
        to: Phase,
    ) -> Result<(), String> {
        let place = cluster * RAYS_PER_CLUSTER + ray.place();
        if (from, to) == (Phase::Away, Phase::Waiting) {
            return self.is_born(now, cluster, ray, place);
        }
        let life = &mut self.living[place];
        if !life.is_alive {
            return Err(format!("moves from {} to {}, but is not on the board", from.name(), to.name()));
        }
        let before = life.phase();
        life.settle(now);
        if from != Phase::Away {
            let tokens = &mut life.tokens[from as usize];
            if *tokens == 0 {
                return Err(format!("has no token {} that could go {}", from.name(), to.name()));
            }
            *tokens -= 1;
            life.present &= !(u8::from(*tokens == 0) << from as u8);
        }
        if to != Phase::Away {
            let tokens = &mut life.tokens[to as usize];
            *tokens = tokens.checked_add(1).ok_or("has over 65535 tokens")?;
            life.present |= 1 << to as u8;
        }
        if from == Phase::Returning && to == Phase::Away {
            return self.dies(now, place);
        }
        let after = life.phase();
        if let Some(kept) = life.kept
            && before != after
        {
            note(&mut self.kept[kept as usize].spans, now, Phase::LIFE[after]);
        }
        Ok(())
    }

    fn is_born(&mut self, now: Cycle, cluster: usize, ray: RayRef, place: usize) -> Result<(), String> {
        let life = &mut self.living[place];
        if life.is_alive {
            return Err("is born, but alive".to_owned());
        }
        *life = Living { is_alive: true, born: now, since: now, ..NOBODY };
        life.tokens[Phase::Waiting as usize] = 1;
        life.present = 1 << Phase::Waiting as u8;
        self.n_alive += 1;
        if self.asked.is_empty() || self.in_cast {
            return Ok(());
        }
        let (bundle, first) = self.bundles[cluster * 16 + usize::from(ray.slot)];
        let id = (self.commands.saturating_sub(1), first.wrapping_add(u32::from(ray.index)));
        if self.asked.remove(&id) {
            life.kept = Some(self.kept.len() as u32);
            self.kept.push(RayLife {
                command: id.0,
                ray: id.1,
                bundle,
                index: ray.index,
                cluster: cluster as u8,
                slot: ray.slot,
                born: now,
                died: None,
                cycles: [0; N],
                spans: vec![(now, Phase::Waiting)],
            });
        }
        Ok(())
    }

    fn dies(&mut self, now: Cycle, place: usize) -> Result<(), String> {
        let life = &mut self.living[place];
        life.is_alive = false;
        if life.present != 1 << Phase::Waiting as u8 {
            return Err(format!("dies with a token {}", Phase::LIFE[life.phase()].name()));
        }
        self.n_alive -= 1;
        let sums = if self.in_cast { &mut self.low_resolution } else { &mut self.rays };
        sums.add(now - life.born, &life.cycles);
        if let Some(kept) = life.kept {
            let kept = &mut self.kept[kept as usize];
            (kept.died, kept.cycles) = (Some(now), life.cycles);
        }
        Ok(())
    }
}

/// Notes a phase that begins in cycle `now`: of several in one cycle the last counts.
fn note(spans: &mut Vec<(Cycle, Phase)>, now: Cycle, phase: Phase) {
    if spans.last().is_some_and(|(since, _)| *since == now) {
        spans.pop();
    }
    if spans.last().is_none_or(|(_, before)| *before != phase) {
        spans.push((now, phase));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Directory;

    fn lives() -> Lives {
        let blocks =
            ["cluster0.bundle_generator", "cluster0.result_merge", "dram"].map(String::from).to_vec();
        let mut lives = Lives::new(&Places::new(&Directory { blocks, links: Vec::new() }).unwrap());
        lives.see(0, &Seen::Command(CommandMark::Nearest)).unwrap();
        lives.see(0, &Seen::Bundle { block: 0, slot: 3, job: 5, first_ray: 100 }).unwrap();
        lives
    }

    fn rays(mask: u64, from: Phase, to: Phase) -> Seen {
        Seen::Rays { block: 0, slot: 3, mask, from, to }
    }

    #[test]
    fn life_of_a_ray_with_several_tokens_is_in_the_most_advanced_phase_each_cycle() {
        use Phase::*;
        let mut lives = lives();
        lives.ask(0, 101);
        for (now, mask, from, to) in [
            (10, 0b11, Away, Waiting),
            (12, 0b10, Away, Stepping),
            (16, 0b10, Stepping, Queued),
            (17, 0b10, Queued, Loading),
            // In one cycle through several phases: the last one counts.
            (20, 0b10, Away, Loading),
            (20, 0b10, Loading, Testing),
            (21, 0b10, Away, Stepping),
            (25, 0b10, Testing, Reducing),
            (26, 0b10, Reducing, Away),
            (27, 0b10, Loading, Away),
            (30, 0b10, Stepping, Away),
            (31, 0b11, Away, Returning),
            (40, 0b11, Returning, Away),
        ] {
            lives.see(now, &rays(mask, from, to)).unwrap();
        }
        lives.see(50, &Seen::Command(CommandMark::End)).unwrap();
        let [life] = lives.kept() else { panic!("one was asked for") };
        assert_eq!((life.bundle, life.index, life.born, life.died), (5, 1, 10, Some(40)));
        //                        waiting  stepping queued loading testing reducing returning
        assert_eq!(life.cycles, [2 + 1, 4 + 3, 1, 3 + 1, 5, 1, 9]);
        assert_eq!(life.cycles.iter().sum::<u64>(), 30);
        let spans = [
            (10, Waiting),
            (12, Stepping),
            (16, Queued),
            (17, Loading),
            (20, Testing),
            (25, Reducing),
            (26, Loading),
            (27, Stepping),
            (30, Waiting),
            (31, Returning),
        ];
        assert_eq!(life.spans, spans);
        let sums = lives.rays();
        assert_eq!((sums.rays, sums.total(), sums.median()), (2, 60, Some(30)));
    }

    #[test]
    fn life_sums_median_is_the_lower_of_the_middle_two() {
        let mut sums = LifeSums::default();
        assert_eq!(sums.median(), None);
        for (length, median) in [(7, 7), (3, 3), (9, 7), (9, 7), (9, 9)] {
            sums.add(length, &[0; N]);
            assert_eq!(sums.median(), Some(median));
        }
        assert_eq!((sums.shortest(), sums.longest()), (Some(3), Some(9)));
    }

    #[test]
    fn lives_of_tokens_that_cannot_be_are_refused_by_name() {
        use Phase::*;
        let fault = |moves: &[(Phase, Phase)]| {
            let mut lives = lives();
            let all = moves.iter().map(|(from, to)| lives.see(7, &rays(1, *from, *to)));
            all.collect::<Result<Vec<()>, _>>().unwrap_err().to_string()
        };
        let ray = "cycle 7: ray 0 in slot 3 of cluster 0 ";
        assert_eq!(
            fault(&[(Away, Stepping)]),
            format!("{ray}moves from away to stepping, but is not on the board")
        );
        assert_eq!(fault(&[(Away, Waiting), (Away, Waiting)]), format!("{ray}is born, but alive"));
        let lost = [(Away, Waiting), (Queued, Loading)];
        assert_eq!(fault(&lost), format!("{ray}has no token queued that could go loading"));
        let early = [(Away, Waiting), (Away, Loading), (Away, Returning), (Returning, Away)];
        assert_eq!(fault(&early), format!("{ray}dies with a token loading"));
        let mut lives = lives();
        lives.see(8, &rays(0b101, Away, Waiting)).unwrap();
        let e = lives.see(9, &Seen::Command(CommandMark::End)).unwrap_err().to_string();
        assert_eq!(e, "cycle 9: 2 rays outlive their command");
        let outside = Seen::Rays { block: 2, slot: 0, mask: 1, from: Away, to: Waiting };
        assert!(lives.see(9, &outside).unwrap_err().to_string().contains("stands in no cluster"));
    }
}
