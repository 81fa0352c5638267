use super::design::Design;
use super::hardware::{Hardware, MUX_GATES, REGISTER_WORDS};
use super::memory::Shape;
use super::operators as law;
use super::*;
use crate::fixed::Formats;
use crate::spec::{BoardSpec, Partition};

fn technology(name: &str) -> &'static Technology {
    Technology::named(name).unwrap()
}

fn osu() -> &'static Technology {
    technology("osu-0.35um")
}

fn board(text: &str) -> BoardSpec {
    BoardSpec::from_toml(text).unwrap()
}

fn block<'a>(cost: &'a Cost, name: &str) -> &'a BlockCost {
    cost.blocks.iter().find(|b| b.block == name).unwrap()
}

const EIGHT_BITS: &str = "[formats]\ncoord_frac_bits = 8\ndir_frac_bits = 8\nt_frac_bits = 8";

/// F = D = T = 8, K = 16: a 10 bits, c and n 20, e and den 30, num 31, t 11; divisor without sign 29, dividend 38.
#[test]
fn icu_of_8_bit_formats_is_that_of_the_count_by_hand() {
    let spec = board(EIGHT_BITS);
    let design = Design::new(&spec, osu());
    let datapath = icu::datapath(&design);
    // 12 differences, 15 components of normals, 5 edge values, 6 of face normals, 2 denominators, 5 zero tests, a choice, a
    // numerator, 2 magnitudes, a range check, 11 rows, correction, rounding.
    assert_eq!(datapath.n_units, 12 + 15 + 5 + 6 + 2 + 5 + 1 + 1 + 2 + 1 + 11 + 1 + 1);
    let adder =
        |w: u64, levels: u64| w as f64 * (law::ADDER_BIT_GATES + law::ADDER_LEVEL_GATES * levels as f64);
    let magnitude = |w: u64, levels: u64| {
        w as f64 * (law::MAGNITUDE_BIT_GATES + law::MAGNITUDE_LEVEL_GATES * levels as f64)
    };
    let compare = |w: u64| w as f64 * law::COMPARE_BIT_GATES;
    // Products: bits of partial products, less two words at the end, and the adder.
    let product = |bits: u64, w: u64, levels: u64| {
        bits as f64 * law::PARTIAL_PRODUCT_GATES
            + (bits - 2 * w) as f64 * law::FULL_ADDER_GATES
            + adder(w, levels)
    };
    let three = |w: u64, levels: u64| w as f64 * law::FULL_ADDER_GATES + adder(w, levels);
    let gates = 12.0 * adder(10, 4)
        + 15.0 * product(2 * 10 * 10, 20, 5)
        + 5.0 * product(3 * 20 * 9, 30, 5)
        + 6.0 * three(20, 5)
        + 2.0 * three(30, 5)
        + 5.0 * 30.0
        + (3 * 20 + 30) as f64 * MUX_GATES
        + product(3 * 20 * 10, 31, 5)
        + magnitude(31, 5)
        + magnitude(30, 5)
        // den (2^11 + 1) in 29 + 11 bits, then compared.
        + adder(40, 6)
        + compare(40)
        + 11.0 * (adder(30, 5) + 30.0 * law::SUBTRACT_GATES)
        + adder(30, 5)
        + compare(30)
        + magnitude(11, 4)
        + compare(11);
    assert!(
        (datapath.hardware.gates - gates).abs() < 1e-6,
        "{} gates, {gates} by hand",
        datapath.hardware.gates
    );
    // One stage: its result alone is registered: a t word, 28 bits of patch, facing, valid beside place and t_max of the
    // tags; a valid bit; the job (record, 64 rays, slot); the sequencer.
    let mut spec = spec;
    spec.icu.depth = 1;
    let (t, place, patch) = (11, 2 + 6, 12 * 9 + 29);
    let tags = place + 28 + t + 1;
    let expected = (1 + t + tags) + 1 + (patch + 64 + 2) + 16;
    let cost = Cost::of(&spec, osu());
    assert_eq!(block(&cost, "icu").flip_flops, 4 * expected);
}

#[test]
fn fifo_and_array_are_those_of_the_count_by_hand() {
    assert_eq!(REGISTER_WORDS, 4);
    // 16 entries of 10 bits: 4 in registers, 12 in memory; pointers of 4 bits, a count to 16 of 5.
    let fifo = links::fifo(16, 10);
    assert_eq!((fifo.flip_flops, fifo.ram_bits), (4 * 10 + 4 + 4 + 5, 12 * 10));
    let small = links::fifo(2, 10);
    assert_eq!((small.flip_flops, small.ram_bits), (2 * 10 + 1 + 1 + 2, 0));
    // A multiplexer a held bit, and one for each choice of a bit after the first.
    let array = Hardware::array(3, 7);
    assert_eq!((array.flip_flops, array.ram_bits), (21, 0));
    assert!((array.gates - MUX_GATES * (21.0 + 14.0)).abs() < 1e-9);
    // 256 words of 36 bits on an FPGA are a block; of 37, two; 64 words are look-up tables.
    assert_eq!(Hardware::memory(256, 36).ram_blocks, 1);
    assert_eq!(Hardware::memory(256, 37).ram_blocks, 2);
    assert_eq!((Hardware::memory(64, 36).ram_blocks, Hardware::memory(64, 36).luts), (0, 4.0 * 9.0 * 6.0));
}

/// 16 MiB are 2^18 lines; 4 KiB in 2 ways are 32 sets: 13 bits of tag, valid, one bit of order a way.
#[test]
fn cache_is_that_of_the_count_by_hand() {
    let spec = BoardSpec::default();
    let design = Design::new(&spec, osu());
    let shape = Shape { bytes: 4096, ways: 2, miss_registers: 2, is_written: false };
    assert_eq!((shape.tag_bits(design.line), shape.set_bits(design.line)), (13, 2 * (13 + 1 + 1)));
    let cache = memory::cache(&design, &shape);
    assert_eq!(cache.ram_bits, 32 * 30 + 8 * 4096);
    // Two miss registers: number of the line, its 512 bits, two bits of state.
    assert_eq!(cache.flip_flops, 2 * (18 + 512 + 2));
    let none = memory::cache(&design, &Shape { bytes: 0, ..shape });
    assert_eq!((none.ram_bits, none.flip_flops), (0, cache.flip_flops));
}

#[test]
fn blocks_are_those_of_the_board() {
    let names = |spec: &BoardSpec| {
        Cost::of(spec, osu()).blocks.iter().map(|b| (b.block, b.instances)).collect::<Vec<_>>()
    };
    let shells = names(&BoardSpec::default());
    for expected in
        [("icu", 4), ("ctu", 16), ("shell_tracker", 4), ("mask_cache", 4), ("cluster_buffer", 4), ("dram", 1)]
    {
        assert!(shells.contains(&expected), "{expected:?} in {shells:?}");
    }
    let grid = names(&BoardSpec { partition: Partition::Grid, ..BoardSpec::default() });
    assert!(
        grid.iter().all(|(name, _)| *name != "shell_tracker" && *name != "mask_cache" && *name != "division")
    );
    assert!(names(&board("[division]\nunit = \"newton\"")).contains(&("division", 4)));
}

#[test]
fn named_division_units_cost_what_their_form_says() {
    let unit = |text: &str| {
        let cost = Cost::of(&board(&format!("[division]\n{text}")), osu());
        let b = block(&cost, "division").clone();
        (b.gates, b.flip_flops, b.path_ns)
    };
    let serial = unit("unit = \"non-restoring\"\nform = \"serial\"");
    let unrolled = unit("unit = \"non-restoring\"");
    assert!(unrolled.0 > 3.0 * serial.0 && unrolled.1 > 10 * serial.1 && unrolled.2 == serial.2);
    let radix_16 = unit("unit = \"non-restoring\"\nradix_log2 = 4");
    assert!(radix_16.2 > 2.0 * unrolled.2 && radix_16.1 < unrolled.1 / 2);
    let newton = unit("unit = \"newton\"");
    let two_cycles = unit("unit = \"newton\"\nmultiplier_cycles = 2");
    assert!(two_cycles.2 < newton.2 && two_cycles.1 > newton.1);
    assert!(unit("unit = \"newton\"\nform = \"serial\"").0 < newton.0);
}

#[test]
fn newton_widths_are_those_of_the_unit() {
    // T = 24: words of 31 fraction bits and 2 more, a divisor of 76 bits in 3 parts.
    let spec = board("[division]\nunit = \"newton\"");
    let wires = spec.divider().unwrap().width_table();
    let bits = |name: &str| u64::from(wires.iter().find(|w| w.wire == name).unwrap().bits);
    assert_eq!(bits("div_reciprocal"), 24 + 7 + 2);
    let design = Design::new(&spec, osu());
    assert_eq!(design.wire("den_shifted") - 1, 78 - 1);
    assert_eq!(bits("div_quotient"), design.t);
}

#[test]
fn literature_units_have_costs_of_their_own() {
    let icu = |text: &str| block(&Cost::of(&board(&format!("[icu]\n{text}")), osu()), "icu").clone();
    let unfolded = icu("unit = \"cordic-unfolded\"");
    let serial = icu("unit = \"cordic-serial\"");
    assert!(unfolded.gates > 20.0 * serial.gates && unfolded.flip_flops > 10 * serial.flip_flops);
    assert!(icu("unit = \"cordic-serial\"\ncordic_bits = 32").gates > serial.gates);
    let [fast, slow] = ["fast", "slow"].map(|s| icu(&format!("unit = \"subdivision-{s}\"")));
    // One chip; only how long it takes differs.
    assert_eq!((fast.gates, fast.flip_flops, fast.ram_bits), (slow.gates, slow.flip_flops, slow.ram_bits));
    assert!(slow.event_pj > 9.0 * fast.event_pj);
}

#[test]
fn rounded_normals_are_cheaper_than_exact_ones() {
    let gates = |text: &str| block(&Cost::of(&board(&format!("[formats]\n{text}")), osu()), "icu").gates;
    assert!(gates("cross_keep_bits = 24") < 0.8 * gates(""));
    assert!(gates("cross_keep_bits = 24\nrounding = \"floor\"") < gates("cross_keep_bits = 24"));
}

#[test]
fn technologies_are_ordered() {
    let spec = BoardSpec::default();
    let [old, osu_035, osu_018] =
        ["cmos-1.6um", "osu-0.35um", "osu-0.18um"].map(|t| Cost::of(&spec, technology(t)));
    assert!(old.max_clock_mhz < osu_035.max_clock_mhz && osu_035.max_clock_mhz < osu_018.max_clock_mhz);
    assert!(old.area_mm2 > osu_035.area_mm2 && osu_035.area_mm2 > osu_018.area_mm2);
    assert!((old.gates - osu_018.gates).abs() < 1e-6 * old.gates);
    let ecp5 = Cost::of(&spec, technology("ecp5"));
    assert!(
        ecp5.area_mm2.is_none() && ecp5.fpga.is_some_and(|f| f.luts > 0 && f.dsps > 0 && f.ram_blocks > 0)
    );
    assert!(Technology::named("osu-0.13um").is_none());
}

/// Numbers of `Formats` reach the cost only through the width table: as wide as it says.
#[test]
fn widths_of_the_design_are_those_of_the_width_table() {
    let spec = BoardSpec::default();
    let design = Design::new(&spec, osu());
    for row in Formats::default().width_table() {
        assert_eq!(design.wire(row.wire), u64::from(row.bits), "{}", row.wire);
    }
    assert_eq!((design.ray, design.patch, design.hit), (3 * 25 + 3 * 25 + 27, 12 * 25 + 29, 27 + 30));
}

/// The time of a cost: `cargo test --release -p rtl-model --lib cost::tests::cost_takes -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn cost_takes_under_100_microseconds() {
    for depth in [1, 22, 100, 4096] {
        let mut spec = BoardSpec::default();
        spec.icu.depth = depth;
        let start = std::time::Instant::now();
        let n = 1000;
        let sum: u64 = (0..n).map(|_| Cost::of(std::hint::black_box(&spec), osu()).flip_flops).sum();
        let us = start.elapsed().as_secs_f64() * 1e6 / f64::from(n);
        println!("depth {depth}: {us:.1} us ({sum})");
        assert!(us < 100.0, "{us} us");
    }
}
