//! Ranges of every parameter.

use super::{BoardSpec, DivisionUnit, IcuUnit};
use crate::fixed::FormatError;
use crate::fixed::division::DivisionError;

/// A parameter that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// Not TOML, an unknown key, or a wrong type.
    #[error("line {line}, column {column}: {message}")]
    Parse {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// A value outside its range.
    #[error("{name} = {value}: expected {expected}")]
    Range {
        /// Dotted name, as in the file.
        name: String,
        /// The value.
        value: String,
        /// What is possible.
        expected: String,
    },
    /// A word length outside its range.
    #[error("formats.{0}")]
    Format(#[from] FormatError),
    /// A division unit that cannot be.
    #[error("division.{0}")]
    Division(#[from] DivisionError),
}

impl SpecError {
    pub(super) fn parse(text: &str, error: &toml::de::Error) -> SpecError {
        let at = error.span().map_or(0, |span| span.start).min(text.len());
        let before = text.get(..at).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        SpecError::Parse {
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            message: error.message().replace('\n', " "),
        }
    }
}

/// Most that bus and board clock may differ by: beyond it a run is all waiting, or all bus.
const MAX_CLOCK_RATIO: f64 = 1000.0;

/// The smallest burst: the longest result record (12 bytes at T = 32) fits.
const MIN_BURST_BYTES: u32 = 16;

fn range(name: &str, value: impl Into<u64>, allowed: std::ops::RangeInclusive<u64>) -> Result<(), SpecError> {
    let value = value.into();
    check(name, value, allowed.contains(&value), || format!("{} to {}", allowed.start(), allowed.end()))
}

fn check(
    name: &str,
    value: impl ToString,
    ok: bool,
    expected: impl FnOnce() -> String,
) -> Result<(), SpecError> {
    if ok {
        return Ok(());
    }
    Err(SpecError::Range { name: name.into(), value: value.to_string(), expected: expected() })
}

fn cache(name: &str, bytes: u32, ways: u32, miss_registers: u32) -> Result<(), SpecError> {
    cache_shape(name, bytes, ways)?;
    range(&format!("{name}.miss_registers"), miss_registers, 1..=16)
}

fn cache_shape(name: &str, bytes: u32, ways: u32) -> Result<(), SpecError> {
    check(&format!("{name}.ways"), ways, ways.is_power_of_two() && ways <= 16, || {
        "a power of two from 1 to 16".into()
    })?;
    let fits = bytes == 0 || (bytes.is_power_of_two() && bytes >= 64 * ways && bytes <= 1 << 28);
    check(&format!("{name}.bytes"), bytes, fits, || {
        format!("0, or a power of two from {} (a line per way) to 2^28", 64 * ways)
    })
}

impl BoardSpec {
    /// The longest that a working board can go without any block working: every latency, one after the other.
    fn longest_wait_cycles(&self) -> u64 {
        let bus_ratio = (self.clock_mhz / self.bus.clock_mhz).ceil() as u64 + 1;
        let icu = self.icu_timing();
        let pipes = icu.depth
            + icu.initiation_interval
            + self.ctu.depth
            + self.ctu.initiation_interval
            + self.cluster_buffer.cycles
            + self.dram.row_hit_cycles.max(self.dram.row_miss_cycles)
            + self.dispatch.rebalance_cycles;
        self.bus.dma_setup_cycles
            + u64::from(pipes)
            + u64::from(self.bus.arbitration_cycles + 1) * bus_ratio
            + 100
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter that cannot be, with value and range.
    pub fn validate(&self) -> Result<(), SpecError> {
        self.formats.validate()?;
        let mhz = |v: f64| v.is_finite() && (0.001..=100_000.0).contains(&v);
        check("clock_mhz", self.clock_mhz, mhz(self.clock_mhz), || "0.001 to 100000 MHz".into())?;
        if let Some(g) = self.grid_log2 {
            let most = self.formats.coord_frac_bits.min(7);
            range("grid_log2", g, 1..=u64::from(most))?;
        }
        range("shells.cells", self.shells.cells, 1..=64)?;
        range("shells.entries", self.shells.entries, 1..=256)?;
        let dispatch = &self.dispatch;
        range("dispatch.low_resolution_every", dispatch.low_resolution_every, 1..=4096)?;
        range("dispatch.low_resolution_min_bundles", dispatch.low_resolution_min_bundles, 1..=65_536)?;
        let threshold = dispatch.rebalance_threshold;
        let fits = threshold.is_finite() && (1.0..=1000.0).contains(&threshold);
        check("dispatch.rebalance_threshold", threshold, fits, || "1 to 1000".into())?;
        range("dispatch.rebalance_cycles", dispatch.rebalance_cycles, 0..=1_000_000)?;
        range("dispatch.host_cycles_per_command", dispatch.host_cycles_per_command, 0..=1_000_000_000)?;
        range("clusters.count", self.clusters.count, 1..=16)?;
        range("clusters.modules", self.clusters.modules, 1..=4)?;
        range("clusters.ctus_per_icu", self.clusters.ctus_per_icu, 1..=16)?;
        range("clusters.bundle_slots", self.clusters.bundle_slots, 1..=16)?;
        // In shells a bundle, and so its slot, belongs to one module.
        let (slots, modules) = (self.clusters.bundle_slots, self.clusters.modules);
        check("clusters.bundle_slots", slots, !self.partition.is_shells() || slots >= modules, || {
            format!(
                "at least one per module ({modules}) with a partition in shells: a bundle is one module's"
            )
        })?;
        check(
            "shells.prefetch",
            self.shells.prefetch,
            !self.shells.prefetch || self.partition.is_shells(),
            || "false with partition = \"grid\", which has no next shell".into(),
        )?;
        range("ctu.contexts", self.ctu.contexts, 1..=64)?;
        range("ctu.initiation_interval", self.ctu.initiation_interval, 1..=4096)?;
        range("ctu.depth", self.ctu.depth, 1..=4096)?;
        range("loader.slots", self.loader.slots, 1..=32)?;
        range("loader.stations", self.loader.stations, 1..=32)?;
        range("icu.cordic_bits", self.icu.cordic_bits, 4..=64)?;
        let (unit, fixed) = (self.division.unit, self.icu.unit == IcuUnit::FixedPipelined);
        check("icu.unit", format!("{:?}", self.icu.unit), fixed || unit == DivisionUnit::InPipeline, || {
            "fixed-pipelined with a division unit named in [division]: the others divide in their own way"
                .into()
        })?;
        range("icu.initiation_interval", self.icu.initiation_interval, 1..=4096)?;
        range("icu.depth", self.icu.depth, 1..=4096)?;
        self.division.validate(&self.formats)?;
        range("fifos.ctu_icu", self.fifos.ctu_icu, 1..=4096)?;
        range("fifos.icu_reducer", self.fifos.icu_reducer, 1..=4096)?;
        range("fifos.results", self.fifos.results, 1..=4096)?;
        range("fifos.commands", self.fifos.commands, 1..=4096)?;
        let (patch, list) = (&self.patch_cache, &self.list_cache);
        cache("patch_cache", patch.bytes, patch.ways, patch.miss_registers)?;
        cache("list_cache", list.bytes, list.ways, list.miss_registers)?;
        let mask = &self.mask_cache;
        cache("mask_cache", mask.bytes, mask.ways, mask.miss_registers)?;
        cache_shape("cluster_buffer", self.cluster_buffer.bytes, self.cluster_buffer.ways)?;
        range("cluster_buffer.cycles", self.cluster_buffer.cycles, 1..=4096)?;
        range("cluster_buffer.miss_registers", self.cluster_buffer.miss_registers, 1..=64)?;
        range("dram.bytes", self.dram.bytes, 4096..=1 << 34)?;
        let w = self.dram.width_bits;
        check("dram.width_bits", w, w.is_power_of_two() && (8..=512).contains(&w), || {
            "8, 16, 32, 64, 128, 256 or 512".into()
        })?;
        range("dram.banks", self.dram.banks, 1..=64)?;
        let row = self.dram.row_bytes;
        check("dram.row_bytes", row, row >= 64 && row.is_multiple_of(64), || "a multiple of 64".into())?;
        range("dram.row_hit_cycles", self.dram.row_hit_cycles, 0..=4096)?;
        range("dram.row_miss_cycles", self.dram.row_miss_cycles, 0..=4096)?;
        let w = self.bus.width_bits;
        check("bus.width_bits", w, w.is_power_of_two() && (8..=128).contains(&w), || {
            "8, 16, 32, 64 or 128".into()
        })?;
        let (bus_mhz, most) = (self.bus.clock_mhz, MAX_CLOCK_RATIO);
        let in_ratio = bus_mhz * most >= self.clock_mhz && bus_mhz <= self.clock_mhz * most;
        check("bus.clock_mhz", bus_mhz, mhz(bus_mhz) && in_ratio, || {
            format!("0.001 to 100000 MHz, and 1/{most} to {most} times clock_mhz ({})", self.clock_mhz)
        })?;
        let burst = self.bus.burst_bytes;
        let word = self.bus.width_bits / 8;
        let fits = (MIN_BURST_BYTES..=1 << 20).contains(&burst) && burst.is_multiple_of(word);
        check("bus.burst_bytes", burst, fits, || {
            format!("a multiple of the bus word, {word} bytes, from {MIN_BURST_BYTES} B to 1 MiB")
        })?;
        let e = &self.energy;
        for (name, pj) in [
            ("test_pj", e.test_pj),
            ("step_pj", e.step_pj),
            ("cache_pj", e.cache_pj),
            ("buffer_pj", e.buffer_pj),
            ("dram_line_pj", e.dram_line_pj),
            ("dram_row_pj", e.dram_row_pj),
            ("bus_byte_pj", e.bus_byte_pj),
            ("block_cycle_pj", e.block_cycle_pj),
        ] {
            let fits = pj.is_finite() && (0.0..=1e9).contains(&pj);
            check(&format!("energy.{name}"), pj, fits, || "0 to 10^9 pJ".into())?;
        }
        range("bus.arbitration_cycles", self.bus.arbitration_cycles, 0..=4096)?;
        range("bus.dma_setup_cycles", self.bus.dma_setup_cycles, 0..=1_000_000)?;
        range("bus.interrupt_cycles", self.bus.interrupt_cycles, 0..=1_000_000)?;
        range("watchdog_cycles", self.watchdog_cycles, self.longest_wait_cycles()..=1_000_000_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn board_file_faults_are_named_with_place_value_and_range() {
        let cases = [
            ("icu = { dept = 3 }", "line 1"),
            ("\n[icu]\ndepth = \"deep\"", "line 3, column 9"),
            ("[icu]\ndepth = 0", "icu.depth = 0: expected 1 to 4096"),
            ("clock_mhz = nan", "clock_mhz = NaN"),
            ("[patch_cache]\nbytes = 100\nways = 2\nmiss_registers = 2", "patch_cache.bytes = 100"),
            ("[formats]\ncoord_frac_bits = 29", "formats.coord_frac_bits = 29"),
            ("partition = \"rings\"", "line 1, column 13"),
            ("[shells]\ncells = 0", "shells.cells = 0: expected 1 to 64"),
            ("[shells]\nentries = 257", "shells.entries = 257"),
            (
                "partition = \"grid\"\n[shells]\nprefetch = true",
                "shells.prefetch = true: expected false with",
            ),
            (
                "[dispatch]\nrebalance_threshold = 0.9",
                "dispatch.rebalance_threshold = 0.9: expected 1 to 1000",
            ),
            (
                "[clusters]\nmodules = 4\nbundle_slots = 3",
                "clusters.bundle_slots = 3: expected at least one per module (4)",
            ),
            ("[icu]\nunit = \"cordic-serial\"\n[division]\nunit = \"newton\"", "icu.unit"),
            ("[energy]\ntest_pj = -1", "energy.test_pj = -1"),
            ("grid_log2 = 8", "grid_log2 = 8: expected 1 to 7"),
            ("[dram]\nwidth_bits = 24", "dram.width_bits = 24"),
            ("[bus]\nburst_bytes = 6", "bus.burst_bytes = 6"),
            ("clusters.count = 17", "clusters.count = 17"),
            ("= 3", "line 1"),
            ("[bus]\nburst_bytes = 12", "bus.burst_bytes = 12"),
            ("[bus]\nclock_mhz = 0.02", "bus.clock_mhz = 0.02"),
            ("[bus]\nclock_mhz = 26000", "bus.clock_mhz = 26000"),
            ("watchdog_cycles = 40", "watchdog_cycles = 40: expected 697"),
            ("watchdog_cycles = 4500\n[dram]\nrow_hit_cycles = 4096", "watchdog_cycles = 4500: expected 4"),
        ];
        for (text, expected) in cases {
            let message = BoardSpec::from_toml(text).expect_err(text).to_string();
            assert!(message.contains(expected), "{text:?} gave {message:?}, expected {expected:?}");
        }
    }
}
