//! The cycles of a workload from some of its commands, with an error bar.
//!
//! ```text
//! commands --purpose, mode--> groups --seed--> n of N, each run whole on the board --> cycles y
//!    `--centre ray of every job, arithmetic without time--> work x, rays r of all     |
//!                       group: y = c + a r + b x fitted to the n, summed over all N <-'--> variance
//! ```
//! The unit is a command, because a command's low-resolution cast, start-up, partition and drain do not scale with its
//! bundles, and in it bundles overlap in time: a part of one would have to be corrected for all of that. c are the cycles
//! that every command takes whatever its work (interrupt, host), a those that a ray takes whatever it meets (its way over
//! the bus). Work of a job: its rays times (tests + cells / k) of its centre ray, as a module with k CTUs tests a ray and
//! steps k of them a cycle. Caches are warmed up, uncounted, by bundles that came before a sampled command.
//! Source: the regression estimator of simple random sampling (Cochran, Sampling Techniques, ch. 7), weights 1 / r;
//! variance (1 - n/N) sum (w e / (1 - h))^2 with w the weight of a command in the estimate, e its residual and h its
//! leverage (HC3: MacKinnon, White 1985, for few commands); 95 % by Student's t with n - 2 degrees of freedom, those of
//! several groups joined by Welch and Satterthwaite. Groups of up to [`MIN_SAMPLED`] commands are run whole.

use std::collections::BTreeMap;

use rtl_model::board::Board;
use rtl_model::datapath::RayWords;
use rtl_model::functional;
use rtl_model::statistics::BoardStatistics;
use serde::Serialize;

use crate::raycast::commands::{CastCommand, CommandWords};
use crate::raycast::{CastError, MAX_BUNDLE_RAYS, Purpose};
use crate::sampling::mix;

/// Fewest commands of a group that are run: fewer give no error bar worth its name.
pub const MIN_SAMPLED: usize = 6;
/// Bundles that each cluster is given to warm its caches up.
const WARM_UP_BUNDLES: usize = 8;

/// What a sample says of its workload.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SampleEstimate {
    /// Share of the commands that was asked for.
    pub share: f64,
    /// Seed of the choice.
    pub seed: u64,
    /// Commands of the workload.
    pub n_commands: usize,
    /// Commands that were run.
    pub n_sampled: usize,
    /// Cycles of the whole workload, estimated.
    pub cycles: f64,
    /// Half the width of their 95 % interval; 0 when every command was run.
    pub half_width_cycles: f64,
    /// By purpose and mode.
    pub groups: Vec<GroupEstimate>,
}

/// The part of the commands of one purpose and mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupEstimate {
    /// What the rays are cast for.
    pub purpose: Purpose,
    /// Any hit, not the nearest.
    pub any_hit: bool,
    /// Commands.
    pub n_commands: usize,
    /// Commands that were run.
    pub n_sampled: usize,
    /// Cycles, estimated.
    pub cycles: f64,
    /// Standard error of that.
    pub standard_error_cycles: f64,
}

impl SampleEstimate {
    /// True when `cycles` lies in the interval.
    pub fn covers(&self, cycles: u64) -> bool {
        (self.cycles - cycles as f64).abs() <= self.half_width_cycles + 0.5
    }
}

/// A measured command.
#[derive(Clone, Copy, Debug)]
struct Measured {
    size: Size,
    cycles: f64,
}

/// What is known of a command without running it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Size {
    rays: f64,
    work: f64,
}

impl Size {
    fn plus(self, other: Size) -> Size {
        Size { rays: self.rays + other.rays, work: self.work + other.work }
    }
}

/// What the board counted in a sample, by purpose, and what that says of the workload.
pub type Sampled = (Vec<(Purpose, BoardStatistics)>, SampleEstimate);

/// Runs a share of `commands` on `board` and estimates the cycles of all. `progress` gets the share that is done.
///
/// # Errors
/// When the board fails.
pub fn run(
    board: &mut Board,
    commands: &[CastCommand],
    share: f64,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Sampled, CastError> {
    let mut kinds: Vec<(Purpose, bool)> = commands.iter().map(|c| (c.purpose, c.any_hit)).collect();
    kinds.sort();
    kinds.dedup();
    let of_kind = |kind: (Purpose, bool)| -> Vec<usize> {
        (0..commands.len()).filter(|i| (commands[*i].purpose, commands[*i].any_hit) == kind).collect()
    };
    let members: Vec<Vec<usize>> = kinds.iter().map(|kind| of_kind(*kind)).collect();
    let chosen: Vec<Vec<usize>> = members.iter().map(|members| choose(members, share, seed)).collect();
    let mut order: Vec<usize> = chosen.iter().flatten().copied().collect();
    order.sort_unstable();
    let mut cycles = vec![0; commands.len()];
    let mut by_purpose: BTreeMap<Purpose, BoardStatistics> = BTreeMap::new();
    for (done, &i) in order.iter().enumerate() {
        if i > 0 && order[..done].last().is_none_or(|before| *before + 1 != i) {
            run_command(board, &warm_up(board, &commands[i - 1]))?;
        }
        let counted = run_command(board, &commands[i])?;
        cycles[i] = counted.cycles;
        let purpose = commands[i].purpose;
        let sum = by_purpose.get(&purpose).map_or(counted.clone(), |earlier| earlier.plus(&counted));
        by_purpose.insert(purpose, sum);
        progress((done + 1) as f64 / order.len() as f64);
    }
    let fixed = board.spec().bus.interrupt_cycles + board.spec().dispatch.host_cycles_per_command;
    let mut groups = Vec::new();
    let mut freedom = Vec::new();
    for ((kind, members), chosen) in kinds.iter().zip(&members).zip(&chosen) {
        let all_run = chosen.len() == members.len();
        let size = |i: &usize| if all_run { Size::default() } else { size_of(board, &commands[*i]) };
        let sizes: BTreeMap<usize, Size> = members.iter().map(|i| (*i, size(i))).collect();
        let measured: Vec<Measured> =
            chosen.iter().map(|i| Measured { size: sizes[i], cycles: (cycles[*i] - fixed) as f64 }).collect();
        let total = sizes.values().copied().fold(Size::default(), Size::plus);
        let (sum, error) = regression_estimate(&measured, total, members.len());
        groups.push(GroupEstimate {
            purpose: kind.0,
            any_hit: kind.1,
            n_commands: members.len(),
            n_sampled: chosen.len(),
            cycles: sum + fixed as f64 * members.len() as f64,
            standard_error_cycles: error,
        });
        freedom.push(chosen.len().saturating_sub(2));
    }
    let variances: Vec<f64> = groups.iter().map(|g| g.standard_error_cycles.powi(2)).collect();
    let estimate = SampleEstimate {
        share,
        seed,
        n_commands: commands.len(),
        n_sampled: order.len(),
        cycles: groups.iter().map(|g| g.cycles).sum(),
        half_width_cycles: half_width(&variances, &freedom),
        groups,
    };
    Ok((by_purpose.into_iter().collect(), estimate))
}

/// A simple random sample of `members`, in their order.
fn choose(members: &[usize], share: f64, seed: u64) -> Vec<usize> {
    let wanted = (share * members.len() as f64).ceil() as usize;
    let n = wanted.max(MIN_SAMPLED).min(members.len());
    let mut chosen = members.to_vec();
    chosen.sort_by_key(|i| mix(mix(seed).wrapping_add(*i as u64)));
    chosen.truncate(n);
    chosen.sort_unstable();
    chosen
}

/// What the board counts in a command.
fn run_command(board: &mut Board, command: &CastCommand) -> Result<BoardStatistics, CastError> {
    let before = board.statistics();
    let work = command.words.work();
    let done = match command.any_hit {
        true => board.trace_any(work).map(drop),
        false => board.trace_nearest(work).map(drop),
    };
    done.map_err(|e| CastError::Board(e.to_string()))?;
    Ok(board.statistics().since(&before))
}

/// The last bundles of each cluster's part of a command, as a command that is too short for a low-resolution cast.
fn warm_up(board: &Board, before: &CastCommand) -> CastCommand {
    let spec = board.spec();
    let parts = spec.clusters.count as usize;
    let most = (spec.dispatch.low_resolution_min_bundles as usize).saturating_sub(1) / parts;
    let wanted = WARM_UP_BUNDLES.min(most.max(1));
    let words = match &before.words {
        CommandWords::Rays(rays) => {
            let jobs: Vec<&[RayWords]> = rays.chunks(MAX_BUNDLE_RAYS).collect();
            CommandWords::Rays(ends_of_parts(&jobs, parts, wanted).concat())
        }
        CommandWords::Bundles(bundles) => CommandWords::Bundles(ends_of_parts(bundles, parts, wanted)),
    };
    CastCommand { words, ..*before }
}

/// The last `wanted` items of each of `parts` equal parts.
fn ends_of_parts<T: Clone>(items: &[T], parts: usize, wanted: usize) -> Vec<T> {
    let part = |i: usize| &items[i * items.len() / parts..(i + 1) * items.len() / parts];
    (0..parts).flat_map(|i| part(i)[part(i).len().saturating_sub(wanted)..].iter().cloned()).collect()
}

/// The size of a command; its work as its jobs' centre rays tell it.
fn size_of(board: &Board, command: &CastCommand) -> Size {
    let (image, ctus) = (board.image(), f64::from(board.spec().clusters.ctus_per_icu));
    let of_job = |ray: &RayWords, n_rays: usize| {
        let done = functional::trace(image, ray, command.any_hit);
        let rays = n_rays as f64;
        Size { rays, work: rays * (f64::from(done.tests) + f64::from(done.cells) / ctus) }
    };
    match &command.words {
        CommandWords::Rays(rays) => rays
            .chunks(MAX_BUNDLE_RAYS)
            .map(|job| of_job(&job[job.len() / 2], job.len()))
            .fold(Size::default(), Size::plus),
        CommandWords::Bundles(bundles) => bundles
            .iter()
            .map(|job| of_job(&job.ray(&image.formats, job.n_rays() / 2), job.n_rays()))
            .fold(Size::default(), Size::plus),
    }
}

/// The sum over a group of `n_all` commands of size `total`, and its standard error.
fn regression_estimate(measured: &[Measured], total: Size, n_all: usize) -> (f64, f64) {
    let n = measured.len();
    if n == n_all {
        return (measured.iter().map(|m| m.cycles).sum(), 0.0);
    }
    // Normal equations of cycles = a rays + b work, weights 1 / rays.
    let sum = |of: &dyn Fn(&Measured) -> f64| measured.iter().map(of).sum::<f64>();
    let rays = sum(&|m| m.size.rays);
    let work = sum(&|m| m.size.work);
    let square = sum(&|m| m.size.work * m.size.work / m.size.rays);
    let determinant = rays * square - work * work;
    // Commands of one work a ray tell nothing of b: all goes by the rays.
    let is_flat = determinant <= 1e-9 * rays * square;
    let inverse = |u: Size, v: Size| {
        if is_flat {
            return u.rays * v.rays / rays;
        }
        let cross = u.rays * v.work + u.work * v.rays;
        (square * u.rays * v.rays - work * cross + rays * u.work * v.work) / determinant
    };
    let weight = |m: &Measured, of: Size| inverse(of, m.size) / m.size.rays;
    let estimate = |of: Size| sum(&|m| weight(m, of) * m.cycles);
    let parts = measured.iter().map(|m| {
        let leverage = weight(m, m.size).min(0.999);
        weight(m, total) * (m.cycles - estimate(m.size)) / (1.0 - leverage)
    });
    let variance = (1.0 - n as f64 / n_all as f64) * parts.map(|part| part * part).sum::<f64>();
    (estimate(total), variance.sqrt())
}

/// Half the 95 % interval of a sum with these variances and degrees of freedom.
fn half_width(variances: &[f64], freedom: &[usize]) -> f64 {
    let variance: f64 = variances.iter().sum();
    if variance == 0.0 {
        return 0.0;
    }
    let spread: f64 =
        variances.iter().zip(freedom).map(|(v, f)| v * v / (*f as f64).max(1.0)).sum::<f64>() / variance;
    t_95(variance / spread) * variance.sqrt()
}

/// Student's t that 95 % of the distribution with `freedom` degrees lie within.
///
/// Exact to 3 digits for whole degrees up to 10 (fractions take the degree below), then by Cornish and Fisher's
/// expansion, whose error is under 0.001 there.
fn t_95(freedom: f64) -> f64 {
    const FEW: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
    let z: f64 = 1.959_964;
    if freedom < 11.0 {
        return FEW[(freedom.floor() as usize).clamp(1, 10) - 1];
    }
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    z + first / freedom + second / freedom.powi(2) + third / freedom.powi(3)
}

#[cfg(test)]
#[path = "sample_tests.rs"]
mod tests;
