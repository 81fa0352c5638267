//! Stochastic shooting: what kernel shots leave is shot by hemisphere bundles, in rounds that tell the error.
//!
//! ```text
//! round: unshot --pass: bundles in proportion to unshot power--> hits --> received --> E, unshot of the next pass ... until
//!        little is left
//! rounds are independent: mean --> E, spread --> error estimate; more rounds until it is under `wanted_error`
//! ```
//! A pass is one stochastic Jacobi iteration (Neumann 1995; Bekaert 1999): every ray carries the same power, so an
//! element that gets power P by rays of power w has variance P w, at most: strata and low-discrepancy places take off from
//! that. From it comes the number of rays, n (P_unshot / P_incident)^2 / error^2 for n elements, where error^2 is
//! what `wanted_error`^2 leaves after the variance of the kernel shots' visibility ([`State::kernel_variance`]).
//! Elements shoot, not patches: each has its own unshot irradiance and rays start inside it.
//!
//! Results are sums of integers, so the order of the rays and the number of threads change nothing; a chunk of bundles is a
//! step, and between steps all there is to know is [`StochasticState`].
//! Not modelled: that this variance is reflected, too; places on elements that are no parallelograms are uniform in (s,t), not in area.

use serde::{Deserialize, Serialize};

use super::shooting::PatchOptics;
use super::state::{State, magnitude};
use super::{SolveError, SolveOptions, SplitIrradiance};
use crate::mesh::{Locator, Mesh, PatchId};
use crate::raycast::transmit::Panes;
use crate::raycast::{Purpose, Query, RayBundle, RayCaster};
use crate::units::Rgb;

mod allocation;
mod bundles;
mod fold;
mod tally;
#[cfg(test)]
mod tests;

use allocation::Allocation;
use bundles::Source;
use fold::Hat;
use tally::{Stray, Tally};

/// Strata along each axis of a bundle: 64 rays where the elements shoot several bundles each, 16 where they do not: rays of
/// one place hit together near edges, and what few places send is noise.
const BUNDLE_SIDES: (u32, u32) = (8, 4);
/// Bundles that an element shoots in the first pass, in the mean, for the larger ones.
const BUNDLES_PER_ELEMENT: f64 = 4.0;
/// Rays of a query; their hits take 6 MiB.
const RAYS_PER_CHUNK: u64 = 1 << 18;
/// Rounds that the rays are planned for; fewer would know their own error badly.
const PLANNED_ROUNDS: u32 = 4;
/// Rounds at most, when the error does not come under what was wanted.
const MAX_ROUNDS: u32 = 16;
/// Share of the wanted error that bundles are planned for at least, whatever kernel shots got wrong: what those leave is
/// not made better by more rays.
const LEAST_ERROR_SHARE: f64 = 0.5;
/// A kernel shot takes about as long as this many rays an element.
const RAYS_PER_KERNEL_SHOT: f64 = 3.0;

/// Where stochastic shooting stands between two chunks.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct StochasticState {
    /// Power that a ray carries (W, all channels).
    ray_power_w: f64,
    /// Strata along each axis of a bundle.
    bundle_side: u32,
    /// A round ends when its unshot power is under this (W).
    stop_w: f64,
    round: u32,
    pass: u32,
    /// Bundles of this pass, and how many of them are done.
    n_bundles: u64,
    next_bundle: u64,
    /// Power that this pass shoots (W, magnitudes of all channels).
    pass_w: f64,
    /// It shoots exitance: what arrives is direct.
    emission: bool,
    /// Irradiance of every element that this round has still to reflect (W/m^2).
    unshot: Vec<Rgb>,
    /// What arrived in this pass.
    tally: Tally,
    /// What arrived in this round at every element, all channels (W/m^2).
    of_round: Vec<f64>,
    /// Sums over rounds of what arrived (W/m^2), the running one included.
    elements: Vec<SplitIrradiance>,
    vertices: Vec<SplitIrradiance>,
    /// Sum over finished rounds of `of_round` squared.
    squares: Vec<f64>,
    /// Sum over finished rounds of what was left unshot (W/m^2).
    left: Vec<Rgb>,
    /// Power that reached no element, summed over rounds (W).
    stray: Stray,
    /// Rays of this round, and of all.
    n_round_rays: u64,
    n_rays: u64,
    /// Rays of the first round.
    n_first_round_rays: u64,
    finished: bool,
}

impl StochasticState {
    /// What this round has still to shoot (W).
    pub(super) fn unshot_power_w(&self) -> f64 {
        self.pass_w
    }

    /// How much of the planned rounds is done.
    pub(super) fn done_share(&self) -> f64 {
        let planned = f64::from(PLANNED_ROUNDS.max(self.round + 1));
        let of_round = match self.round {
            0 => 0.5 * self.next_bundle as f64 / self.n_bundles.max(1) as f64,
            _ => (self.n_round_rays as f64 / self.n_first_round_rays.max(1) as f64).min(1.0),
        };
        ((f64::from(self.round) + of_round) / planned).min(1.0)
    }
}

/// Power that flows in the end, if the scene is closed: emitted, and what is unshot now (W, all channels).
struct Flow {
    incident_w: f64,
    unshot_w: f64,
}

impl Flow {
    /// Error of stochastic shooting that, beside that of the kernel shots so far, makes up the wanted one.
    fn wanted_error(&self, mesh: &Mesh, options: &SolveOptions, state: &State) -> f64 {
        let variance: f64 = state.kernel_variance.iter().sum();
        let by_kernel = fold::relative(variance, self.incident_w, mesh.total_area_m2());
        let left = options.wanted_error.powi(2) - by_kernel.powi(2);
        left.max((LEAST_ERROR_SHARE * options.wanted_error).powi(2)).sqrt()
    }
}

fn flow(mesh: &Mesh, optics: &[PatchOptics], state: &State) -> Flow {
    let (mut area, mut reflecting) = (0.0, 0.0);
    for (patch, optics) in mesh.patches.iter().zip(optics) {
        area += patch.area_m2;
        reflecting += patch.area_m2 * optics.reflectance.sum() / 3.0;
    }
    let absorbed = if area > 0.0 { (1.0 - reflecting / area).max(0.01) } else { 1.0 };
    Flow {
        incident_w: magnitude(state.account.emitted_w) / absorbed,
        unshot_w: state.unshot_power_w() / absorbed,
    }
}

/// True when the rays that `patch`'s power adds to the plan are fewer than its kernel shot is worth: their number
/// goes with the square of the unshot power.
pub(super) fn is_cheaper(
    mesh: &Mesh,
    optics: &[PatchOptics],
    options: &SolveOptions,
    state: &State,
    patch: PatchId,
) -> bool {
    let flow = flow(mesh, optics, state);
    let power_w = magnitude(state.unshot_w[patch.0 as usize]);
    let wanted_error = flow.wanted_error(mesh, options, state);
    let rays_per_element = 2.0 * flow.unshot_w * power_w / (flow.incident_w * wanted_error).powi(2);
    rays_per_element < RAYS_PER_KERNEL_SHOT
}

/// The state before the first chunk.
pub(super) fn plan(
    mesh: &Mesh,
    optics: &[PatchOptics],
    options: &SolveOptions,
    state: &State,
) -> StochasticState {
    let flow = flow(mesh, optics, state);
    let n = mesh.elements.len();
    // Variance of an element's mean relative to the square of the mean of all, summed: w n unshot / incident^2.
    let wanted_error = flow.wanted_error(mesh, options, state);
    let ray_power_w = (wanted_error * flow.incident_w).powi(2) / (n as f64 * flow.unshot_w);
    let ray_power_w = ray_power_w * f64::from(PLANNED_ROUNDS);
    let (large, small) = BUNDLE_SIDES;
    let n_large = state.unshot_power_w() / (ray_power_w * f64::from(large * large));
    let mut s = StochasticState {
        ray_power_w,
        bundle_side: if n_large >= BUNDLES_PER_ELEMENT * n as f64 { large } else { small },
        stop_w: options.unshot_share * magnitude(state.account.emitted_w),
        round: 0,
        pass: 0,
        n_bundles: 0,
        next_bundle: 0,
        pass_w: 0.0,
        emission: false,
        unshot: Vec::new(),
        tally: Tally::new(n),
        of_round: vec![0.0; n],
        elements: vec![SplitIrradiance::default(); n],
        vertices: vec![SplitIrradiance::default(); mesh.vertices.len()],
        squares: vec![0.0; n],
        left: vec![Rgb::BLACK; n],
        stray: Stray::default(),
        n_round_rays: 0,
        n_rays: 0,
        n_first_round_rays: 0,
        finished: false,
    };
    s.begin_round(state.elements.iter().map(|e| e.unshot).collect());
    s
}

impl StochasticState {
    fn begin_round(&mut self, unshot: Vec<Rgb>) {
        self.unshot = unshot;
        self.pass = 0;
        self.emission = true;
        self.n_bundles = 0;
        self.next_bundle = 0;
        self.n_round_rays = 0;
        self.of_round.fill(0.0);
    }
}

/// What chunks need beside the state; follows from scene, mesh and state.
pub(super) struct Stochastic<'a> {
    mesh: &'a Mesh,
    /// Of every patch.
    reflectance: Vec<Rgb>,
    offset_m: f64,
    panes: Panes,
    locator: Locator,
    /// Of every vertex.
    hats: Vec<Hat>,
    /// Of the running pass; `None` after a fold and after a resume.
    allocation: Option<Allocation>,
}

impl<'a> Stochastic<'a> {
    pub(super) fn new(mesh: &'a Mesh, reflectance: Vec<Rgb>, offset_m: f64, panes: Panes) -> Stochastic<'a> {
        Stochastic {
            mesh,
            reflectance,
            offset_m,
            panes,
            locator: Locator::new(mesh),
            hats: fold::hats(mesh),
            allocation: None,
        }
    }

    /// Casts one chunk of bundles; at the end of a pass folds what arrived into the round, at the end of a round judges the
    /// error. False, and nothing done, when it is good enough.
    pub(super) fn step(
        &mut self,
        state: &mut State,
        options: &SolveOptions,
        caster: &mut dyn RayCaster,
    ) -> Result<bool, SolveError> {
        let State { stochastic: Some(s), elements, unshot_exitance, n_rays, kernel_variance, .. } = state
        else {
            return Ok(false);
        };
        if s.finished {
            return Ok(false);
        }
        if self.allocation.is_none() {
            self.begin_pass(s, unshot_exitance);
        }
        let Some(allocation) = &self.allocation else { return Ok(false) };
        let seed = crate::sampling::hash(options.seed, u64::from(s.round), u64::from(s.pass));
        let end = (s.next_bundle + RAYS_PER_CHUNK / u64::from(s.bundle_side.pow(2))).min(s.n_bundles);
        let sources: Vec<Source> =
            bundles::sources(self.mesh, allocation, seed, self.offset_m, s.next_bundle..end);
        if !sources.is_empty() {
            let query: Vec<RayBundle> = sources.iter().map(|source| source.bundle.clone()).collect();
            let hits = caster.closest_hits(Purpose::FormFactor, Query::Bundles(&query))?;
            let stray = s.tally.add(self.mesh, &self.locator, &sources, &hits, s.pass_w);
            let beyond = self.panes.beyond(caster, Purpose::FormFactor, Query::Bundles(&query), &hits)?;
            let behind =
                s.tally.add_beyond(self.mesh, &self.locator, &sources, hits.len(), &beyond, s.pass_w);
            s.stray.lost_w += stray.lost_w + behind.lost_w;
            s.stray.back_w += stray.back_w + behind.back_w;
            s.stray.passed_w = [0, 1].map(|side| s.stray.passed_w[side] + behind.passed_w[side]);
            s.n_round_rays += hits.len() as u64;
            s.n_rays += hits.len() as u64;
            *n_rays += hits.len() as u64;
        }
        s.next_bundle = end;
        if end == s.n_bundles {
            self.fold(s);
            self.allocation = None;
            if !s.emission && s.left_w(self.mesh, &self.reflectance) <= s.stop_w {
                s.end_round(self.mesh, options, elements, kernel_variance);
            }
        }
        Ok(true)
    }

    /// Deals the pass's bundles out.
    fn begin_pass(&mut self, s: &mut StochasticState, exitance: &[Rgb]) {
        let of_exitance = |s: &StochasticState| {
            Allocation::new(self.mesh, s.ray_power_w, s.bundle_side, |e| {
                exitance[self.mesh.elements[e].patch.0 as usize]
            })
        };
        let of_reflection = |s: &StochasticState| {
            Allocation::new(self.mesh, s.ray_power_w, s.bundle_side, |e| {
                self.reflectance[self.mesh.elements[e].patch.0 as usize] * s.unshot[e]
            })
        };
        let mut allocation = if s.emission { of_exitance(s) } else { of_reflection(s) };
        if s.emission && allocation.n_bundles == 0 {
            s.emission = false;
            allocation = of_reflection(s);
        }
        s.pass_w = allocation.power_w;
        s.n_bundles = allocation.n_bundles;
        self.allocation = Some(allocation);
    }

    fn fold(&self, s: &mut StochasticState) {
        fold::fold(self.mesh, &self.hats, s);
        s.pass += 1;
        s.emission = false;
        s.n_bundles = 0;
        s.next_bundle = 0;
    }
}

/// Memory of an element beside the solver's own (bytes).
pub(super) fn bytes_per_element() -> usize {
    // unshot, left; of_round, squares; sums; tally; the running allocation's power and first bundle.
    2 * size_of::<Rgb>()
        + 2 * size_of::<f64>()
        + size_of::<SplitIrradiance>()
        + Tally::bytes_per_element()
        + size_of::<Rgb>()
        + size_of::<u64>()
}

/// Memory of a patch beside the solver's own (bytes).
pub(super) fn bytes_per_patch() -> usize {
    size_of::<Rgb>() + Locator::bytes_per_patch()
}

/// Memory of a vertex beside the solver's own (bytes).
pub(super) fn bytes_per_vertex() -> usize {
    size_of::<SplitIrradiance>() + size_of::<Hat>()
}
