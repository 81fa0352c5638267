//! Every parameter of a board, with unit, default and source tag.
//!
//! ```text
//! boards/*.toml or a user's file --from_toml--> BoardSpec --validate--> Board
//! ```
//! A board file names only what differs from the defaults below, or everything as `boards/delft-1992.toml` does.
//! Clock, word lengths, cache and FIFO sizes, bus and arithmetic of the historical board are not public: tagged `[I]`.

use serde::{Deserialize, Serialize};

use crate::fixed::Formats;

mod division;
mod parameters;
mod validate;

pub use division::{DivisionSpec, DivisionUnit, IcuTiming};
pub use parameters::ParameterRow;
pub use validate::SpecError;

/// A board. All fields have defaults; unknown keys are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BoardSpec {
    /// Name for reports.
    pub name: String,
    /// Board clock (MHz).
    pub clock_mhz: f64,
    /// How rays share the search for patches.
    pub partition: Partition,
    /// Which cluster gets which bundle.
    pub scheduling: Scheduling,
    /// Levels of patch memory.
    pub memory: MemoryLevels,
    /// log2 of the grid's cells per axis; absent: fewest expected steps and tests.
    pub grid_log2: Option<u32>,
    /// Cycles without progress after which a run is given up.
    pub watchdog_cycles: u64,
    /// Number formats.
    pub formats: Formats,
    /// Shells and the bundle tracker's table (partition = "shells", "shells+static").
    pub shells: ShellSpec,
    /// Low-resolution cast, rebalancing, the host's own pace.
    pub dispatch: DispatchSpec,
    /// Clusters and what is in them.
    pub clusters: ClusterSpec,
    /// Cell Traversal Units.
    pub ctu: CtuSpec,
    /// Patch loaders.
    pub loader: LoaderSpec,
    /// Intersection Computation Units.
    pub icu: IcuSpec,
    /// Division unit of the ICUs.
    pub division: DivisionSpec,
    /// Queue depths.
    pub fifos: FifoSpec,
    /// Cache of patch records, one per module.
    pub patch_cache: PatchCacheSpec,
    /// Cache of cell headers and lists, one per module.
    pub list_cache: ListCacheSpec,
    /// Cache of tested masks, one per module (partition in shells).
    pub mask_cache: MaskCacheSpec,
    /// Buffer of a cluster (memory = "hierarchical").
    pub cluster_buffer: ClusterBufferSpec,
    /// The board's DRAM.
    pub dram: DramSpec,
    /// Host bus and DMA.
    pub bus: BusSpec,
    /// Energy of events.
    pub energy: EnergySpec,
}

/// How rays share the search for patches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Partition {
    /// Each ray by itself through a uniform grid: the conventional technique.
    Grid,
    /// A bundle's rays together, shell of cells by shell of cells around their apex.
    Shells,
    /// As `shells`, and a low-resolution cast estimates each bundle's work before bundles are dealt to clusters.
    #[serde(rename = "shells+static")]
    ShellsStatic,
}

impl Partition {
    /// True for both partitions in shells.
    pub fn is_shells(self) -> bool {
        self != Partition::Grid
    }
}

/// Which cluster gets which bundle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheduling {
    /// Bundles in issue order, cut into one range of equal estimated work per cluster; without a low-resolution cast
    /// the estimate is the number of rays.
    Static,
    /// As `static`; when a cluster has run out and what the others have left is too uneven, what is not yet dispatched
    /// is cut anew.
    PseudoDynamic,
    /// The next bundle to the first cluster with room, at no cost: the bound of balance, not of locality.
    Ideal,
}

/// Levels of patch memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MemoryLevels {
    /// No cache: one line register per miss register.
    None,
    /// A cache per module.
    OneLevel,
    /// Caches, cluster buffers, DRAM.
    Hierarchical,
}

/// How shells grow with their distance from the apex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShellGrowth {
    /// All of one thickness.
    Fixed,
    /// Each twice as thick as the one before.
    Double,
}

/// Shells of cells around an apex, and the bundle tracker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShellSpec {
    /// Thickness of the first shell around the apex's cell (cells), 1..=64.
    pub cells: u32,
    /// Growth of the others.
    pub growth: ShellGrowth,
    /// Entries of a bundle's table of cells, 1..=256.
    pub entries: u32,
    /// While a shell is tested, fetch lists and records of the cells in which its rays will enter the next one.
    pub prefetch: bool,
}

/// How the dispatcher finds and corrects the partition of bundles among clusters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DispatchSpec {
    /// A centre ray is cast first for every so many bundles (partition = "shells+static"), 1..=4096.
    pub low_resolution_every: u32,
    /// Commands of fewer bundles are dealt without a low-resolution cast, 1..=65536.
    pub low_resolution_min_bundles: u32,
    /// Pseudo-dynamic: greatest max/mean of the clusters' remaining estimates that is left alone, 1 to 1000.
    pub rebalance_threshold: f64,
    /// Cycles for which dispatch pauses while the partition is cut, 0..=1000000.
    pub rebalance_cycles: u32,
    /// Board cycles that the host needs before each command, 0..=1000000000.
    pub host_cycles_per_command: u64,
}

/// Clusters and what is in them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ClusterSpec {
    /// Clusters on the board, 1..=16.
    pub count: u32,
    /// Modules (one ICU each) per cluster, 1..=4.
    pub modules: u32,
    /// CTUs per ICU, 1..=16.
    pub ctus_per_icu: u32,
    /// Bundles that a cluster works on at once, 1..=16.
    pub bundle_slots: u32,
}

/// Cell Traversal Units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CtuSpec {
    /// Rays that a CTU holds at once, 1..=64.
    pub contexts: u32,
    /// Cycles between two steps, 1..=4096.
    pub initiation_interval: u32,
    /// Latency of a step in cycles, 1..=4096.
    pub depth: u32,
}

/// Patch loaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoaderSpec {
    /// Cell lists that a loader works on at once, 1..=32.
    pub slots: u32,
    /// Patches that may wait for their records at once (partition in shells), 1..=32.
    pub stations: u32,
}

/// What an ICU's timing follows; its answers are those of the fixed-point datapath whatever it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IcuUnit {
    /// A pipeline of multipliers: `initiation_interval` and `depth` as given.
    #[default]
    FixedPipelined,
    /// CORDIC rotations unrolled in space, n = `cordic_bits`: interval 1, depth 3 (n + 4) + 20.
    CordicUnfolded,
    /// CORDIC rotations on one unit, n = `cordic_bits`: interval and depth 3 n.
    CordicSerial,
    /// Pulleyblank and Kapenga's subdivision of bicubic patches at 25 MHz, the best case: 375 cycles a test.
    SubdivisionFast,
    /// The same, the worst case: 3500 cycles a test.
    SubdivisionSlow,
}

/// Intersection Computation Units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IcuSpec {
    /// What the timing follows.
    pub unit: IcuUnit,
    /// Bits of a CORDIC unit's words, 4..=64.
    pub cordic_bits: u32,
    /// Cycles between two tests, 1..=4096.
    pub initiation_interval: u32,
    /// Latency of a test in cycles, 1..=4096; with a named division unit, of the stages before it.
    pub depth: u32,
}

/// Queue depths in entries, 1..=4096.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FifoSpec {
    /// Every queue on the way from a CTU to its ICU: to the patch loader; in shells to the shell tracker, from it to
    /// the loader, and from the loader to the ICU.
    pub ctu_icu: u32,
    /// ICU to nearest-hit reducer.
    pub icu_reducer: u32,
    /// Results of a cluster, toward the host.
    pub results: u32,
    /// Bundle descriptors waiting in a cluster.
    pub commands: u32,
}

/// The cache of patch records of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PatchCacheSpec {
    /// Size (B): 0, or a power of two of at least a 64-byte line per way.
    pub bytes: u32,
    /// Ways, a power of two in 1..=16.
    pub ways: u32,
    /// Misses that may be open at once, 1..=16.
    pub miss_registers: u32,
}

/// The cache of cell headers and lists of a module; a type of its own, since its defaults differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ListCacheSpec {
    /// Size (B): 0, or a power of two of at least a 64-byte line per way.
    pub bytes: u32,
    /// Ways, a power of two in 1..=16.
    pub ways: u32,
    /// Misses that may be open at once, 1..=16.
    pub miss_registers: u32,
}

/// The cache of tested masks of a module, four patches of a bundle a line, written back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MaskCacheSpec {
    /// Size (B): 0, or a power of two of at least a 64-byte line per way.
    pub bytes: u32,
    /// Ways, a power of two in 1..=16.
    pub ways: u32,
    /// Misses that may be open at once, 1..=16.
    pub miss_registers: u32,
}

/// Order of the patch records in the patch memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PatchLayout {
    /// By patch id: the host's order, surface after surface.
    #[default]
    ById,
    /// By the first cell in Morton order that lists the patch.
    ByCell,
}

/// The buffer of a cluster.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ClusterBufferSpec {
    /// Size (B): 0, or a power of two of at least a 64-byte line per way.
    pub bytes: u32,
    /// Ways, a power of two in 1..=16.
    pub ways: u32,
    /// Latency of a hit in cycles, 1..=4096.
    pub cycles: u32,
    /// Misses that may be open at once, 1..=64.
    pub miss_registers: u32,
}

/// The board's DRAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DramSpec {
    /// Size (B).
    pub bytes: u64,
    /// Width (bits): 8, 16, 32, 64, 128, 256 or 512.
    pub width_bits: u32,
    /// Banks, 1..=64.
    pub banks: u32,
    /// Row of a bank (B), a multiple of 64.
    pub row_bytes: u32,
    /// Cycles to the first beat from an open row, 0..=4096.
    pub row_hit_cycles: u32,
    /// Cycles to the first beat from a closed row, 0..=4096.
    pub row_miss_cycles: u32,
    /// Order of the patch records.
    pub layout: PatchLayout,
}

/// Energy of an event (pJ), 0 to 10^9 each; all ASSUMED: an order of magnitude for CMOS of about 1.5 um at 5 V.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnergySpec {
    /// A ray x patch test.
    pub test_pj: f64,
    /// A cell step.
    pub step_pj: f64,
    /// A look-up in a cache of a module.
    pub cache_pj: f64,
    /// A look-up in a cluster buffer.
    pub buffer_pj: f64,
    /// A line read from or written to the DRAM.
    pub dram_line_pj: f64,
    /// Opening a DRAM row, besides.
    pub dram_row_pj: f64,
    /// A byte over the host bus.
    pub bus_byte_pj: f64,
    /// A cycle of a block, whatever it does: clock and leakage.
    pub block_cycle_pj: f64,
}

/// Host bus and DMA.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BusSpec {
    /// Name of the bus.
    pub kind: String,
    /// Width (bits): 8, 16, 32, 64 or 128.
    pub width_bits: u32,
    /// Bus clock (MHz), 1/1000 to 1000 times the board's.
    pub clock_mhz: f64,
    /// Longest burst (B), a multiple of the width, 16..=2^20.
    pub burst_bytes: u32,
    /// Bus cycles of arbitration before a burst, 0..=4096.
    pub arbitration_cycles: u32,
    /// Board cycles from command to first transfer, 0..=1000000.
    pub dma_setup_cycles: u64,
    /// Board cycles from the last transfer until the host goes on, 0..=1000000.
    pub interrupt_cycles: u64,
}

impl Default for BoardSpec {
    fn default() -> Self {
        BoardSpec {
            name: "custom".into(),
            clock_mhz: 25.0,
            partition: Partition::ShellsStatic,
            scheduling: Scheduling::PseudoDynamic,
            memory: MemoryLevels::Hierarchical,
            grid_log2: None,
            watchdog_cycles: 100_000,
            formats: Formats::default(),
            shells: ShellSpec::default(),
            dispatch: DispatchSpec::default(),
            clusters: ClusterSpec::default(),
            ctu: CtuSpec::default(),
            loader: LoaderSpec::default(),
            icu: IcuSpec::default(),
            division: DivisionSpec::default(),
            fifos: FifoSpec::default(),
            patch_cache: PatchCacheSpec::default(),
            list_cache: ListCacheSpec::default(),
            mask_cache: MaskCacheSpec::default(),
            cluster_buffer: ClusterBufferSpec::default(),
            dram: DramSpec::default(),
            bus: BusSpec::default(),
            energy: EnergySpec::default(),
        }
    }
}

impl Default for ShellSpec {
    fn default() -> Self {
        ShellSpec { cells: 2, growth: ShellGrowth::Fixed, entries: 64, prefetch: false }
    }
}

impl Default for DispatchSpec {
    fn default() -> Self {
        DispatchSpec {
            low_resolution_every: 16,
            low_resolution_min_bundles: 64,
            rebalance_threshold: 1.25,
            rebalance_cycles: 500,
            host_cycles_per_command: 0,
        }
    }
}

impl Default for MaskCacheSpec {
    fn default() -> Self {
        MaskCacheSpec { bytes: 16384, ways: 4, miss_registers: 2 }
    }
}

impl Default for EnergySpec {
    fn default() -> Self {
        EnergySpec {
            test_pj: 20_000.0,
            step_pj: 2_000.0,
            cache_pj: 1_000.0,
            buffer_pj: 4_000.0,
            dram_line_pj: 100_000.0,
            dram_row_pj: 50_000.0,
            bus_byte_pj: 1_000.0,
            block_cycle_pj: 400.0,
        }
    }
}

impl Default for ClusterSpec {
    fn default() -> Self {
        ClusterSpec { count: 4, modules: 1, ctus_per_icu: 4, bundle_slots: 4 }
    }
}

impl Default for CtuSpec {
    fn default() -> Self {
        CtuSpec { contexts: 16, initiation_interval: 1, depth: 4 }
    }
}

impl Default for LoaderSpec {
    fn default() -> Self {
        LoaderSpec { slots: 8, stations: 8 }
    }
}

impl Default for IcuSpec {
    fn default() -> Self {
        IcuSpec { unit: IcuUnit::FixedPipelined, cordic_bits: 24, initiation_interval: 1, depth: 22 }
    }
}

impl Default for FifoSpec {
    fn default() -> Self {
        FifoSpec { ctu_icu: 16, icu_reducer: 16, results: 256, commands: 2 }
    }
}

impl Default for PatchCacheSpec {
    fn default() -> Self {
        PatchCacheSpec { bytes: 4096, ways: 2, miss_registers: 2 }
    }
}

impl Default for ListCacheSpec {
    fn default() -> Self {
        ListCacheSpec { bytes: 2048, ways: 2, miss_registers: 2 }
    }
}

impl Default for ClusterBufferSpec {
    fn default() -> Self {
        ClusterBufferSpec { bytes: 32 * 1024, ways: 4, cycles: 3, miss_registers: 4 }
    }
}

impl Default for DramSpec {
    fn default() -> Self {
        DramSpec {
            bytes: 16 << 20,
            width_bits: 32,
            banks: 4,
            row_bytes: 1024,
            row_hit_cycles: 2,
            row_miss_cycles: 6,
            layout: PatchLayout::ById,
        }
    }
}

impl Default for BusSpec {
    fn default() -> Self {
        BusSpec {
            kind: "sbus".into(),
            width_bits: 32,
            clock_mhz: 25.0,
            burst_bytes: 64,
            arbitration_cycles: 4,
            dma_setup_cycles: 50,
            interrupt_cycles: 500,
        }
    }
}

const PRESETS: [(&str, &str); 2] = [
    ("delft-1992", include_str!("../../boards/delft-1992.toml")),
    ("minimal", include_str!("../../boards/minimal.toml")),
];

impl BoardSpec {
    /// The names of the presets that are compiled in.
    pub fn preset_names() -> &'static [&'static str] {
        const NAMES: [&str; PRESETS.len()] = [PRESETS[0].0, PRESETS[1].0];
        &NAMES
    }

    /// A preset by name.
    ///
    /// # Panics
    /// Never: a test loads every preset.
    pub fn preset(name: &str) -> Option<BoardSpec> {
        let (_, text) = PRESETS.iter().find(|(preset, _)| *preset == name)?;
        Some(Self::from_toml(text).unwrap_or_else(|e| panic!("preset {name}: {e}")))
    }

    /// Parses and validates a board file's text.
    ///
    /// # Errors
    /// Syntax, unknown keys, wrong types (all with line and column), values outside their range.
    pub fn from_toml(text: &str) -> Result<BoardSpec, SpecError> {
        let spec: BoardSpec = toml::from_str(text).map_err(|e| SpecError::parse(text, &e))?;
        spec.validate()?;
        Ok(spec)
    }

    /// This board for comparisons ray by ray: with rounded edge normals, where an answer depends on the patches that a
    /// ray is tested with, in grid partition; as it is otherwise.
    pub fn comparable_by_ray(mut self) -> BoardSpec {
        if self.formats.cross_drop() > 0 {
            self.partition = Partition::Grid;
            self.shells.prefetch = false;
        }
        self
    }

    /// Bytes of patch memory that the tested masks of a scene of `n_patches` take: 16 a patch, bundle slot and module.
    pub fn mask_bytes(&self, n_patches: u32) -> u64 {
        if !self.partition.is_shells() {
            return 0;
        }
        let c = &self.clusters;
        let line = u64::from(crate::memory::LINE_BYTES);
        let lines = u64::from(n_patches.div_ceil(crate::memory::MASKS_PER_LINE).max(1));
        u64::from(c.count * c.modules * c.bundle_slots) * lines * line
    }

    /// Sizes (B) of the caches after `memory` is applied: a level that this hierarchy lacks has 0.
    pub(crate) fn effective_cache_bytes(&self) -> EffectiveCaches {
        let (first, buffer) = match self.memory {
            MemoryLevels::None => (false, false),
            MemoryLevels::OneLevel => (true, false),
            MemoryLevels::Hierarchical => (true, true),
        };
        EffectiveCaches {
            patch: if first { self.patch_cache.bytes } else { 0 },
            list: if first { self.list_cache.bytes } else { 0 },
            mask: if first { self.mask_cache.bytes } else { 0 },
            buffer: if buffer { self.cluster_buffer.bytes } else { 0 },
        }
    }
}

/// Cache sizes in bytes after the choice of memory levels.
pub(crate) struct EffectiveCaches {
    pub(crate) patch: u32,
    pub(crate) list: u32,
    pub(crate) mask: u32,
    pub(crate) buffer: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_all_load_and_carry_their_name() {
        assert!(BoardSpec::preset_names().len() >= 2);
        for name in BoardSpec::preset_names() {
            assert_eq!(BoardSpec::preset(name).unwrap().name, *name);
        }
        assert!(BoardSpec::preset("unheard-of").is_none());
    }

    #[test]
    fn delft_preset_names_every_parameter_and_is_the_default() {
        let delft = BoardSpec::preset("delft-1992").unwrap();
        assert_eq!(delft, BoardSpec { name: "delft-1992".into(), ..BoardSpec::default() });
        let text = PRESETS[0].1;
        for row in delft.parameters() {
            let key = row.name.rsplit('.').next().unwrap();
            assert!(
                text.lines().any(|l| l.trim_start_matches("# ").starts_with(key)),
                "{} is not in the file",
                row.name
            );
        }
    }

    #[test]
    fn minimal_preset_has_the_number_formats_of_the_default() {
        assert_eq!(BoardSpec::preset("minimal").unwrap().formats, BoardSpec::default().formats);
    }

    #[test]
    fn spec_cache_with_its_size_alone_keeps_the_other_defaults() {
        let spec = BoardSpec::from_toml("[patch_cache]\nbytes = 8192\n[list_cache]\nways = 4").unwrap();
        assert_eq!(spec.patch_cache, PatchCacheSpec { bytes: 8192, ways: 2, miss_registers: 2 });
        assert_eq!(spec.list_cache, ListCacheSpec { bytes: 2048, ways: 4, miss_registers: 2 });
        assert!(BoardSpec::from_toml("[patch_cache]\nlines = 8").is_err());
    }

    #[test]
    fn spec_survives_a_round_trip_through_toml() {
        let spec = BoardSpec { grid_log2: Some(5), ..BoardSpec::preset("minimal").unwrap() };
        assert_eq!(BoardSpec::from_toml(&toml::to_string(&spec).unwrap()).unwrap(), spec);
    }
}
