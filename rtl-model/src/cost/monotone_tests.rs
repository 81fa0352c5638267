//! Properties over random valid boards: what more of anything does to a cost.

use proptest::prelude::*;

use super::*;
use crate::board::tests::any_spec;
use crate::spec::{BoardSpec, DivisionUnit, IcuUnit};

/// Valid boards over the whole of the ranges.
fn any_board() -> impl Strategy<Value = BoardSpec> {
    let units = (1_u32..=16, 1_u32..=4, 1_u32..=16, 1_u32..=64, 1_u32..=16);
    let timing = (1_u32..=200, 1_u32..=40, 1_u32..=12, 1_u32..=12, 1_u32..=8);
    let queues = (1_u32..=4096, 1_u32..=300, 1_u32..=4096, 1_u32..=32, 1_u32..=32);
    let sizes = (0_u32..=16, 0_u32..=16, 0_u32..=16, 0_u32..=20, 0_u32..=4);
    let others = (
        0_usize..8,
        4_u32..=64,
        prop::option::of(1_u32..=7),
        1_u32..=256,
        prop::option::of(4_u32..=56),
        12_u32..=34,
    );
    (any_spec(), units, timing, queues, sizes, others)
        .prop_map(|(mut spec, u, t, q, s, o)| {
            spec.clusters.count = u.0;
            spec.clusters.modules = u.1;
            spec.clusters.ctus_per_icu = u.2;
            spec.ctu.contexts = u.3;
            spec.clusters.bundle_slots = u.4.max(u.1);
            (spec.icu.depth, spec.ctu.depth) = (t.0, t.1);
            (spec.icu.initiation_interval, spec.ctu.initiation_interval) = (t.2, t.3);
            spec.cluster_buffer.cycles = t.4;
            (spec.fifos.ctu_icu, spec.fifos.icu_reducer, spec.fifos.results) = (q.0, q.1, q.2);
            (spec.loader.slots, spec.loader.stations) = (q.3, q.4);
            let ways = 1 << s.4;
            let bytes = |log2: u32| if log2 == 0 { 0 } else { (64 * ways) << (log2 - 1).min(10) };
            (spec.patch_cache.bytes, spec.patch_cache.ways) = (bytes(s.0), ways);
            (spec.list_cache.bytes, spec.list_cache.ways) = (bytes(s.1), ways);
            (spec.mask_cache.bytes, spec.mask_cache.ways) = (bytes(s.2), ways);
            (spec.cluster_buffer.bytes, spec.cluster_buffer.ways) = (bytes(s.3), ways);
            let unit = [
                IcuUnit::CordicUnfolded,
                IcuUnit::CordicSerial,
                IcuUnit::SubdivisionFast,
                IcuUnit::SubdivisionSlow,
            ];
            if let Some(unit) = unit.get(o.0) {
                spec.icu.unit = *unit;
                spec.division.unit = DivisionUnit::InPipeline;
            }
            spec.icu.cordic_bits = o.1;
            spec.grid_log2 = o.2.map(|g| g.min(spec.formats.coord_frac_bits));
            spec.shells.entries = o.3;
            spec.formats.cross_keep_bits = o.4.map(|k| k.min(2 * spec.formats.coord_frac_bits));
            spec.dram.bytes = 1 << o.5;
            spec.watchdog_cycles = 1_000_000_000;
            spec
        })
        .prop_filter("a valid board", |spec| spec.validate().is_ok())
}

/// A step up of a parameter.
type Step = (&'static str, fn(&mut BoardSpec));

/// More units, entries, bytes, contexts.
const MORE: [Step; 23] = [
    ("clusters.count", |s| s.clusters.count += 1),
    ("clusters.modules", |s| s.clusters.modules += 1),
    ("clusters.ctus_per_icu", |s| s.clusters.ctus_per_icu += 1),
    ("clusters.bundle_slots", |s| s.clusters.bundle_slots += 1),
    ("ctu.contexts", |s| s.ctu.contexts += 1),
    ("loader.slots", |s| s.loader.slots += 1),
    ("loader.stations", |s| s.loader.stations += 1),
    ("shells.entries", |s| s.shells.entries += 1),
    ("shells.prefetch", |s| s.shells.prefetch = true),
    ("fifos.ctu_icu", |s| s.fifos.ctu_icu += 1),
    ("fifos.icu_reducer", |s| s.fifos.icu_reducer += 1),
    ("fifos.results", |s| s.fifos.results += 1),
    ("fifos.commands", |s| s.fifos.commands += 1),
    ("patch_cache.bytes", |s| s.patch_cache.bytes = more_bytes(s.patch_cache.bytes, s.patch_cache.ways)),
    ("list_cache.bytes", |s| s.list_cache.bytes = more_bytes(s.list_cache.bytes, s.list_cache.ways)),
    ("mask_cache.bytes", |s| s.mask_cache.bytes = more_bytes(s.mask_cache.bytes, s.mask_cache.ways)),
    ("cluster_buffer.bytes", |s| {
        s.cluster_buffer.bytes = more_bytes(s.cluster_buffer.bytes, s.cluster_buffer.ways)
    }),
    ("patch_cache.miss_registers", |s| s.patch_cache.miss_registers += 1),
    ("cluster_buffer.miss_registers", |s| s.cluster_buffer.miss_registers += 1),
    ("grid_log2", |s| s.grid_log2 = s.grid_log2.map(|g| g + 1)),
    ("dram.bytes", |s| s.dram.bytes *= 2),
    ("dram.banks", |s| s.dram.banks += 1),
    ("icu.cordic_bits", |s| s.icu.cordic_bits += 1),
];

fn more_bytes(bytes: u32, ways: u32) -> u32 {
    if bytes == 0 { 64 * ways } else { 2 * bytes }
}

fn osu() -> &'static Technology {
    Technology::named("osu-0.35um").unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn cost_of_any_board_is_finite_positive_and_the_sum_of_its_blocks(spec in any_board()) {
        for technology in Technology::all() {
            let cost = Cost::of(&spec, technology);
            let positive = |x: f64| x.is_finite() && x > 0.0;
            prop_assert!(positive(cost.gates) && positive(cost.critical_path_ns) && positive(cost.max_clock_mhz));
            prop_assert!(positive(cost.leakage_w) && positive(cost.clock_pj) && cost.flip_flops > 0);
            prop_assert!((cost.max_clock_mhz * cost.critical_path_ns - 1e3).abs() < 1e-6);
            let sum = |of: fn(&BlockCost) -> f64| cost.blocks.iter().map(of).sum::<f64>();
            prop_assert!((sum(|b| b.gates) / cost.gates - 1.0).abs() < 1e-9);
            prop_assert_eq!(cost.blocks.iter().map(|b| b.flip_flops).sum::<u64>(), cost.flip_flops);
            prop_assert_eq!(cost.blocks.iter().map(|b| b.ram_bits).sum::<u64>(), cost.ram_bits);
            let longest = cost.blocks.iter().map(|b| b.path_ns).fold(0.0, f64::max);
            prop_assert_eq!(longest, cost.critical_path_ns);
            let critical = cost.blocks.iter().find(|b| b.block == cost.critical_block);
            prop_assert_eq!(critical.map(|b| b.path_ns), Some(longest));
            prop_assert_eq!(cost.area_mm2.is_none(), technology.is_fpga);
            prop_assert_eq!(cost.fpga.is_some(), technology.is_fpga);
            if let Some(area) = cost.area_mm2 {
                prop_assert!((sum(|b| b.area_mm2.unwrap()) / area - 1.0).abs() < 1e-9);
            }
            if let Some(fpga) = cost.fpga {
                let luts: u64 = cost.blocks.iter().map(|b| b.fpga.unwrap().luts).sum();
                prop_assert_eq!(luts, fpga.luts);
            }
            for b in &cost.blocks {
                prop_assert!(b.instances > 0 && positive(b.gates) && positive(b.path_ns), "{:?}", b);
                prop_assert!(b.event_pj.is_finite() && b.event_pj >= 0.0 && !b.path.is_empty(), "{:?}", b);
            }
        }
    }

    #[test]
    fn cost_of_more_units_entries_bytes_or_contexts_is_never_less(spec in any_board()) {
        let before = Cost::of(&spec, osu());
        let mut n = 0;
        for (name, step) in MORE {
            let mut more = spec.clone();
            step(&mut more);
            if more.validate().is_err() {
                continue;
            }
            n += 1;
            let after = Cost::of(&more, osu());
            prop_assert!(after.area_mm2 >= before.area_mm2, "{name}: {:?} to {:?} mm2", before.area_mm2, after.area_mm2);
            prop_assert!(after.flip_flops >= before.flip_flops, "{name}: {} to {} registers", before.flip_flops, after.flip_flops);
            // In shells a cluster's bundles are its modules', each of which then has room for fewer.
            let shares_bundles = name == "clusters.modules" && spec.partition.is_shells();
            let ram = (before.ram_bits, after.ram_bits);
            prop_assert!(ram.1 >= ram.0 || shares_bundles, "{name}: {} to {} bits", ram.0, ram.1);
        }
        prop_assert!(n > 8);
    }

    #[test]
    fn clock_of_a_deeper_icu_or_ctu_is_never_slower_and_its_registers_never_fewer(spec in any_board(), more in 1_u32..40) {
        for technology in Technology::all() {
            let before = Cost::of(&spec, technology);
            let steps: [fn(&mut BoardSpec, u32); 3] = [
                |s, n| s.icu.depth += n,
                |s, n| s.ctu.depth += n,
                |s, n| s.cluster_buffer.cycles += n,
            ];
            for step in steps {
                let mut deeper = spec.clone();
                step(&mut deeper, more);
                let after = Cost::of(&deeper, technology);
                prop_assert!(after.max_clock_mhz >= before.max_clock_mhz - 1e-9);
                prop_assert!(after.flip_flops >= before.flip_flops);
                prop_assert!(after.area_mm2 >= before.area_mm2);
            }
        }
    }

    #[test]
    fn operators_of_a_longer_interval_are_never_more(spec in any_board(), more in 1_u32..10) {
        let units = |spec: &BoardSpec| {
            let design = Design::new(spec, osu());
            (icu::datapath(&design).n_units, ctu::datapath(&design).n_units)
        };
        let mut longer = spec.clone();
        longer.icu.initiation_interval += more;
        longer.ctu.initiation_interval += more;
        let ((icu, ctu), (icu_after, ctu_after)) = (units(&spec), units(&longer));
        prop_assert!(icu_after <= icu && ctu_after <= ctu);
    }

    #[test]
    fn clock_and_area_of_a_newer_technology_are_never_worse(spec in any_board()) {
        let [old, osu_035, osu_018] = ["cmos-1.6um", "osu-0.35um", "osu-0.18um"]
            .map(|name| Cost::of(&spec, Technology::named(name).unwrap()));
        prop_assert!(old.max_clock_mhz < osu_035.max_clock_mhz && osu_035.max_clock_mhz < osu_018.max_clock_mhz);
        prop_assert!(old.area_mm2 > osu_035.area_mm2 && osu_035.area_mm2 > osu_018.area_mm2);
    }

    /// Wider words: logic and memory exactly; registers and area as far as the places of the cuts allow, which move with
    /// the widths.
    #[test]
    fn cost_of_wider_words_is_never_less_but_for_where_the_cuts_fall(spec in any_board()) {
        let before = Cost::of(&spec, osu());
        let steps: [Step; 4] = [
            ("formats.coord_frac_bits", |s| s.formats.coord_frac_bits += 1),
            ("formats.dir_frac_bits", |s| s.formats.dir_frac_bits += 1),
            ("formats.t_frac_bits", |s| s.formats.t_frac_bits += 1),
            ("formats.cross_keep_bits", |s| s.formats.cross_keep_bits = s.formats.cross_keep_bits.map(|k| k + 1)),
        ];
        for (name, step) in steps {
            let mut wider = spec.clone();
            step(&mut wider);
            // Edge normals that are kept whole are not rounded: fewer gates.
            let no_longer_rounds = spec.formats.cross_drop() > 0 && wider.formats.cross_drop() == 0;
            // A Newton unit of wider words takes its divisor in fewer parts.
            let fewer_parts = spec.division.unit == DivisionUnit::Newton;
            if wider.validate().is_err() || no_longer_rounds || fewer_parts {
                continue;
            }
            let after = Cost::of(&wider, osu());
            prop_assert!(after.gates >= before.gates, "{name}: {} to {} gates", before.gates, after.gates);
            prop_assert!(after.ram_bits >= before.ram_bits, "{name}: {} to {} bits", before.ram_bits, after.ram_bits);
            let (a, b) = (before.area_mm2.unwrap(), after.area_mm2.unwrap());
            prop_assert!(b >= 0.9 * a, "{name}: {a} to {b} mm2");
        }
    }
}
