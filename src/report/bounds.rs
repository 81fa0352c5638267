//! The bound beside the figure: in how few cycles each resource of the board could have done its part, and what keeps
//! the board from the tightest.
//!
//! ```text
//! BoardSpec, BoardStatistics --> Bounds: a limit (cycles) a resource, largest first; what the ICUs wait for
//!   n units that take a thing every I cycles, w things:  (ceil(w / n) - 1) I + 1       as dealt: work of the busiest
//!   b bus cycles at f_bus, board at f:                   floor((b - 1) f / f_bus) + 1
//!   commands:                                            DMA set-up + interrupt + the host's own cycles, each
//! ```
//! No limit exceeds the cycles taken. Limits of units are those of perfect balance; `as dealt` of the balance that there
//! was. `host` is bus and commands together: set-up and interrupt leave the bus idle. Low-resolution work is work.
//! Not modelled: what of a resource's work must wait for another's (latencies, fill, the order of a ray's cells).

use rtl_model::sim::{BlockAccount, Cause};
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;
use serde::Serialize;

use super::groups::kind;
use super::si::{percent, share};

/// What can limit a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Resource {
    /// The bus, for descriptors.
    HostBusDown,
    /// The bus, for results.
    HostBusUp,
    /// The bus, both ways.
    HostBus,
    /// Set-up, interrupt and the host's own cycles of each command.
    Commands,
    /// Bus and commands, which exclude each other.
    Host,
    /// The DRAM: cycles in which it was occupied.
    Dram,
    /// Cell Traversal Units, a step an interval each.
    Ctus,
    /// The same, of the CTU with most steps.
    CtusAsDealt,
    /// Intersection Computation Units, a test an interval each.
    Icus,
    /// The same, of the ICU with most tests.
    IcusAsDealt,
    /// Cycles in which the busiest patch loader worked.
    PatchLoadersAsDealt,
    /// Cycles in which the busiest shell tracker worked.
    ShellTrackersAsDealt,
    /// Bundle generators, a ray a cycle each.
    BundleGenerators,
    /// Cycles in which the busiest bundle generator worked.
    BundleGeneratorsAsDealt,
}

impl Resource {
    /// As people read it.
    pub fn name(self) -> &'static str {
        match self {
            Resource::HostBusDown => "host bus, down",
            Resource::HostBusUp => "host bus, up",
            Resource::HostBus => "host bus",
            Resource::Commands => "commands",
            Resource::Host => "host bus and commands",
            Resource::Dram => "DRAM",
            Resource::Ctus => "CTUs",
            Resource::CtusAsDealt => "CTUs as dealt",
            Resource::Icus => "ICUs",
            Resource::IcusAsDealt => "ICUs as dealt",
            Resource::PatchLoadersAsDealt => "patch loaders as dealt",
            Resource::ShellTrackersAsDealt => "shell trackers as dealt",
            Resource::BundleGenerators => "bundle generators",
            Resource::BundleGeneratorsAsDealt => "bundle generators as dealt",
        }
    }
}

/// The limit that a resource sets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// Which.
    pub resource: Resource,
    /// Cycles that the work took at least.
    pub cycles: u64,
    /// These cycles over those that were taken: 1 where the resource alone set the pace.
    pub share: f64,
    /// As dealt: the busiest instance.
    pub busiest: Option<String>,
}

/// Something that units waited for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wait {
    /// For what.
    pub what: String,
    /// Share of the units' cycles.
    pub share: f64,
}

/// What the ICUs did not work for, from their account and that of the blocks before them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct IcuWaits {
    /// Share of the ICUs' cycles in which they worked.
    pub work: f64,
    /// The rest of their cycles by cause, largest first.
    pub waits: Vec<Wait>,
    /// Where they mostly starved: what their patch loaders waited for, largest first.
    pub loader_waits: Vec<Wait>,
    /// The reason that follows.
    pub reason: String,
}

/// All limits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Largest first.
    pub limits: Vec<Limit>,
    /// Why it was not the ICUs that set the pace.
    pub icus: IcuWaits,
}

/// Fewest cycles in which `n_units` units, each taking something every `interval` cycles, take `n_things`.
pub(crate) fn units(n_things: u64, n_units: u64, interval: u64) -> u64 {
    match n_things.div_ceil(n_units.max(1)) {
        0 => 0,
        most => (most - 1) * interval + 1,
    }
}

/// Fewest board cycles that have `bus_cycles` edges of the bus.
pub(crate) fn bus(spec: &BoardSpec, bus_cycles: u64) -> u64 {
    let hz = |mhz: f64| (mhz * 1e6).round() as u128;
    let (board, bus) = (hz(spec.clock_mhz), hz(spec.bus.clock_mhz).max(1));
    match bus_cycles {
        0 => 0,
        b => (u128::from(b - 1) * board / bus) as u64 + 1,
    }
}

fn of_kind<'a>(blocks: &'a [BlockAccount], which: &'a str) -> impl Iterator<Item = &'a BlockAccount> {
    blocks.iter().filter(move |b| kind(&b.block) == which)
}

fn sum_of(blocks: &[BlockAccount], which: &str, cause: Cause) -> u64 {
    of_kind(blocks, which).map(|b| b.of(cause)).sum()
}

/// Share of the cycles of a kind of block that went to a cause.
fn share_of(blocks: &[BlockAccount], which: &str, cause: Cause) -> f64 {
    let total = of_kind(blocks, which).map(BlockAccount::total).sum();
    share(sum_of(blocks, which, cause), total)
}

impl Bounds {
    /// The limits of a board of `spec` that counted `s`.
    pub fn new(spec: &BoardSpec, s: &BoardStatistics) -> Bounds {
        let modules = u64::from(spec.clusters.count * spec.clusters.modules);
        let canonical = &s.canonical;
        let low = &canonical.low_resolution;
        let per_command =
            spec.bus.dma_setup_cycles + spec.bus.interrupt_cycles + spec.dispatch.host_cycles_per_command;
        let both = bus(spec, s.bus_down_cycles + s.bus_up_cycles);
        let icu_interval = u64::from(spec.icu_timing().initiation_interval);
        let ctu_interval = u64::from(spec.ctu.initiation_interval);
        let n_ctus = modules * u64::from(spec.clusters.ctus_per_icu);
        let mut limits = Vec::new();
        let mut limit = |resource, cycles: u64, busiest: Option<&BlockAccount>| {
            limits.push(Limit {
                resource,
                cycles,
                share: share(cycles, s.cycles),
                busiest: busiest.map(|b| b.block.clone()),
            });
        };
        limit(Resource::HostBusDown, bus(spec, s.bus_down_cycles), None);
        limit(Resource::HostBusUp, bus(spec, s.bus_up_cycles), None);
        limit(Resource::HostBus, both, None);
        limit(Resource::Commands, s.commands * per_command, None);
        limit(Resource::Host, both + s.commands * per_command, None);
        limit(Resource::Dram, s.dram_busy_cycles, None);
        // A CTU works in exactly the cycles in which a step goes in: steps into cells, out of shells and to the end.
        limit(Resource::Ctus, units(sum_of(&s.blocks, "ctu", Cause::Work), n_ctus, ctu_interval), None);
        limit(Resource::Icus, units(canonical.tests + low.tests, modules, icu_interval), None);
        let rays = canonical.rays + low.rays;
        limit(Resource::BundleGenerators, units(rays, u64::from(spec.clusters.count), 1), None);
        for (resource, which, interval) in [
            (Resource::CtusAsDealt, "ctu", ctu_interval),
            (Resource::IcusAsDealt, "icu", 1),
            (Resource::PatchLoadersAsDealt, "patch_loader", 1),
            (Resource::ShellTrackersAsDealt, "shell_tracker", 1),
            (Resource::BundleGeneratorsAsDealt, "bundle_generator", 1),
        ] {
            // The first of equals.
            let busiest = of_kind(&s.blocks, which)
                .reduce(|a, b| if b.of(Cause::Work) > a.of(Cause::Work) { b } else { a });
            if let Some(block) = busiest {
                limit(resource, units(block.of(Cause::Work), 1, interval), Some(block));
            }
        }
        // Stable: of equal ones the simpler resource first.
        limits.sort_by_key(|l| std::cmp::Reverse(l.cycles));
        let host = share(both + s.commands * per_command, s.cycles);
        Bounds { limits, icus: IcuWaits::new(s, host) }
    }

    /// The largest limit.
    pub fn tightest(&self) -> Option<&Limit> {
        self.limits.first().filter(|l| l.cycles > 0)
    }

    /// The limit of a resource.
    pub fn of(&self, resource: Resource) -> Option<&Limit> {
        self.limits.iter().find(|l| l.resource == resource)
    }
}

fn sorted(mut waits: Vec<Wait>) -> Vec<Wait> {
    waits.retain(|w| w.share > 0.0);
    waits.sort_by(|a, b| b.share.total_cmp(&a.share));
    waits
}

impl IcuWaits {
    /// `host` is the share of the cycles that bus and commands take.
    fn new(s: &BoardStatistics, host: f64) -> IcuWaits {
        let blocks = &s.blocks;
        let wait = |what: &str, share: f64| Wait { what: what.to_owned(), share };
        let of = |cause| share_of(blocks, "icu", cause);
        let unassigned = "no bundle in their clusters";
        let outside = "outside the first to the last test of a command";
        let waits = sorted(vec![
            wait("starved", of(Cause::Starved)),
            wait("no room at the reducers", of(Cause::OutputFull)),
            wait(unassigned, of(Cause::Idle)),
            wait(outside, of(Cause::Fill) + of(Cause::Drain)),
        ]);
        let loader = |cause| share_of(blocks, "patch_loader", cause);
        let in_shells = of_kind(blocks, "shell_tracker").next().is_some();
        let front = if in_shells { "shell trackers" } else { "CTUs" };
        // Output full is mostly the ICUs' own queue: no reason for them to starve.
        let loader_waits = sorted(vec![
            wait("lines from the patch memory", loader(Cause::CacheMiss) + loader(Cause::Memory)),
            wait("a free miss register", loader(Cause::Resource)),
            wait(&format!("lists from the {front}"), loader(Cause::Starved)),
        ]);
        let reason = match waits.first().map(|w| w.what.as_str()) {
            None => String::new(),
            Some("starved") => match loader_waits.first() {
                None => "starved; lists are short, and the loaders work on each".to_owned(),
                Some(w) if w.what.starts_with("lists") => {
                    format!("starved; loaders wait for {} ({})", w.what, front_state(blocks, in_shells))
                }
                Some(w) => {
                    let dram = share(s.dram_busy_cycles, s.cycles);
                    format!("starved; loaders wait for {} (DRAM busy {})", w.what, percent(dram))
                }
            },
            Some(away) if away == unassigned || away == outside => {
                format!("{away} (host bus and commands: {})", percent(host))
            }
            Some(other) => other.to_owned(),
        };
        IcuWaits { work: of(Cause::Work), waits, loader_waits, reason }
    }
}

/// What the blocks before the loaders did.
fn front_state(blocks: &[BlockAccount], in_shells: bool) -> String {
    let which = if in_shells { "shell_tracker" } else { "ctu" };
    let [work, resource, starved] =
        [Cause::Work, Cause::Resource, Cause::Starved].map(|cause| share_of(blocks, which, cause));
    match () {
        () if work >= resource && work >= starved => format!("at work in {}", percent(work)),
        () if resource >= starved && in_shells => format!("tables full in {}", percent(resource)),
        () => format!("waiting in {}", percent(starved)),
    }
}

#[cfg(test)]
#[path = "bounds_tests.rs"]
mod tests;
