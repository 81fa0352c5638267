//! The parameters as `info` lists them, each with its source tag.

use serde::Serialize;

use super::BoardSpec;

/// One parameter as `info` lists it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterRow {
    /// Dotted name, as in the file.
    pub name: &'static str,
    /// Value with unit.
    pub value: String,
    /// Source tag: `[S]` a source says so, `[I]` our choice.
    pub source: &'static str,
}

const OURS: &str = "[I] not public";
const ASSUMED: &str = "[I] ASSUMED, an order of magnitude";
const SHAPE: &str = "[S] structure, [I] number";

impl BoardSpec {
    /// Every parameter, resolved, with its source tag.
    pub fn parameters(&self) -> Vec<ParameterRow> {
        let row = |name, value: String, source| ParameterRow { name, value, source };
        let s = self;
        vec![
            row("clock_mhz", format!("{} MHz", s.clock_mhz), OURS),
            row(
                "partition",
                word(s.partition),
                "[S] shells (1990), shells+static (1991); grid = the conventional technique",
            ),
            row("scheduling", word(s.scheduling), "[S] static (1991), pseudo-dynamic (1992); ideal [I]"),
            row("memory", word(s.memory), "[S] hierarchical, a cache per processing element (1992)"),
            row(
                "grid_log2",
                s.grid_log2.map_or("auto".into(), |g| g.to_string()),
                "[S] uniform grid, [I] size",
            ),
            row("watchdog_cycles", format!("{} cycles", s.watchdog_cycles), "[I] of the model"),
            row("formats.coord_frac_bits", format!("{} bits", s.formats.coord_frac_bits), OURS),
            row("formats.dir_frac_bits", format!("{} bits", s.formats.dir_frac_bits), OURS),
            row("formats.t_frac_bits", format!("{} bits", s.formats.t_frac_bits), OURS),
            row(
                "formats.cross_keep_bits",
                s.formats.cross_keep_bits.map_or("all".into(), |k| format!("{k} bits")),
                OURS,
            ),
            row("formats.rounding", word(s.formats.rounding), OURS),
            row("shells.cells", format!("{} cells", s.shells.cells), "[S] shells, [I] thickness"),
            row("shells.growth", word(s.shells.growth), OURS),
            row("shells.entries", format!("{} cells", s.shells.entries), OURS),
            row("shells.prefetch", s.shells.prefetch.to_string(), OURS),
            row(
                "dispatch.low_resolution_every",
                format!("{} bundles", s.dispatch.low_resolution_every),
                "[S] low-resolution cast (1991), [I] number",
            ),
            row(
                "dispatch.low_resolution_min_bundles",
                format!("{} bundles", s.dispatch.low_resolution_min_bundles),
                OURS,
            ),
            row("dispatch.rebalance_threshold", s.dispatch.rebalance_threshold.to_string(), OURS),
            row("dispatch.rebalance_cycles", format!("{} cycles", s.dispatch.rebalance_cycles), OURS),
            row(
                "dispatch.host_cycles_per_command",
                format!("{} cycles", s.dispatch.host_cycles_per_command),
                "[I] of the model",
            ),
            row("clusters.count", s.clusters.count.to_string(), SHAPE),
            row("clusters.modules", s.clusters.modules.to_string(), SHAPE),
            row("clusters.ctus_per_icu", s.clusters.ctus_per_icu.to_string(), SHAPE),
            row("clusters.bundle_slots", s.clusters.bundle_slots.to_string(), OURS),
            row("ctu.contexts", format!("{} rays", s.ctu.contexts), OURS),
            row("ctu.initiation_interval", format!("{} cycles", s.ctu.initiation_interval), OURS),
            row("ctu.depth", format!("{} cycles", s.ctu.depth), OURS),
            row("loader.slots", format!("{} lists", s.loader.slots), OURS),
            row("loader.stations", format!("{} patches", s.loader.stations), OURS),
            row("icu.unit", word(s.icu.unit), "[I] fixed-pipelined; others from the literature of the time"),
            row("icu.cordic_bits", format!("{} bits", s.icu.cordic_bits), OURS),
            row("icu.initiation_interval", format!("{} cycles", s.icu.initiation_interval), OURS),
            row("icu.depth", format!("{} cycles", s.icu.depth), OURS),
            row("division.unit", word(s.division.unit), OURS),
            row("division.radix_log2", format!("{} bits a cycle", s.division.radix_log2), OURS),
            row("division.form", word(s.division.form), OURS),
            row("division.table_bits", format!("{} bits", s.division.table_bits), OURS),
            row("division.iterations", s.division.iterations.to_string(), OURS),
            row("division.multiplier_cycles", format!("{} cycles", s.division.multiplier_cycles), OURS),
            row("fifos.ctu_icu", format!("{} entries", s.fifos.ctu_icu), OURS),
            row("fifos.icu_reducer", format!("{} entries", s.fifos.icu_reducer), OURS),
            row("fifos.results", format!("{} entries", s.fifos.results), OURS),
            row("fifos.commands", format!("{} entries", s.fifos.commands), OURS),
            row("patch_cache.bytes", format!("{} B", s.patch_cache.bytes), SHAPE),
            row("patch_cache.ways", s.patch_cache.ways.to_string(), OURS),
            row("patch_cache.miss_registers", s.patch_cache.miss_registers.to_string(), OURS),
            row("list_cache.bytes", format!("{} B", s.list_cache.bytes), OURS),
            row("list_cache.ways", s.list_cache.ways.to_string(), OURS),
            row("list_cache.miss_registers", s.list_cache.miss_registers.to_string(), OURS),
            row("mask_cache.bytes", format!("{} B", s.mask_cache.bytes), OURS),
            row("mask_cache.ways", s.mask_cache.ways.to_string(), OURS),
            row("mask_cache.miss_registers", s.mask_cache.miss_registers.to_string(), OURS),
            row("cluster_buffer.bytes", format!("{} B", s.cluster_buffer.bytes), SHAPE),
            row("cluster_buffer.ways", s.cluster_buffer.ways.to_string(), OURS),
            row("cluster_buffer.cycles", format!("{} cycles", s.cluster_buffer.cycles), OURS),
            row("cluster_buffer.miss_registers", s.cluster_buffer.miss_registers.to_string(), OURS),
            row("dram.bytes", format!("{} B", s.dram.bytes), OURS),
            row("dram.width_bits", format!("{} bits", s.dram.width_bits), OURS),
            row("dram.banks", s.dram.banks.to_string(), OURS),
            row("dram.row_bytes", format!("{} B", s.dram.row_bytes), OURS),
            row("dram.row_hit_cycles", format!("{} cycles", s.dram.row_hit_cycles), OURS),
            row("dram.row_miss_cycles", format!("{} cycles", s.dram.row_miss_cycles), OURS),
            row("dram.layout", word(s.dram.layout), OURS),
            row("bus.kind", s.bus.kind.clone(), OURS),
            row("bus.width_bits", format!("{} bits", s.bus.width_bits), OURS),
            row("bus.clock_mhz", format!("{} MHz", s.bus.clock_mhz), OURS),
            row("bus.burst_bytes", format!("{} B", s.bus.burst_bytes), OURS),
            row("bus.arbitration_cycles", format!("{} bus cycles", s.bus.arbitration_cycles), OURS),
            row("bus.dma_setup_cycles", format!("{} cycles", s.bus.dma_setup_cycles), OURS),
            row("bus.interrupt_cycles", format!("{} cycles", s.bus.interrupt_cycles), OURS),
            row("energy.test_pj", format!("{} pJ", s.energy.test_pj), ASSUMED),
            row("energy.step_pj", format!("{} pJ", s.energy.step_pj), ASSUMED),
            row("energy.cache_pj", format!("{} pJ", s.energy.cache_pj), ASSUMED),
            row("energy.buffer_pj", format!("{} pJ", s.energy.buffer_pj), ASSUMED),
            row("energy.dram_line_pj", format!("{} pJ", s.energy.dram_line_pj), ASSUMED),
            row("energy.dram_row_pj", format!("{} pJ", s.energy.dram_row_pj), ASSUMED),
            row("energy.bus_byte_pj", format!("{} pJ", s.energy.bus_byte_pj), ASSUMED),
            row("energy.block_cycle_pj", format!("{} pJ", s.energy.block_cycle_pj), ASSUMED),
        ]
    }
}

/// The word that stands for an enum's value in a board file.
fn word(value: impl Serialize) -> String {
    toml::Value::try_from(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The dotted names of all values in a table.
    fn names(prefix: &str, table: &toml::Table, into: &mut BTreeSet<String>) {
        for (key, value) in table {
            let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
            match value.as_table() {
                Some(inner) => names(&name, inner, into),
                None => {
                    into.insert(name);
                }
            }
        }
    }

    #[test]
    fn parameters_list_every_field_of_a_board_but_its_name_once_and_with_a_source() {
        // A field that is absent by default is not in the file: give it a value.
        let mut spec = BoardSpec { grid_log2: Some(3), ..BoardSpec::default() };
        spec.formats.cross_keep_bits = Some(40);
        let mut fields = BTreeSet::new();
        names("", &toml::Table::try_from(&spec).unwrap(), &mut fields);
        assert!(fields.remove("name"));
        let rows = spec.parameters();
        let listed: BTreeSet<String> = rows.iter().map(|row| row.name.to_owned()).collect();
        assert_eq!(listed, fields);
        assert_eq!(rows.len(), listed.len(), "a parameter is listed twice");
        assert!(rows.len() > 60);
        for row in &rows {
            let tagged = ["[S]", "[C]", "[I]"].iter().any(|tag| row.source.starts_with(tag));
            assert!(tagged && !row.value.is_empty(), "{row:?}");
        }
    }
}
