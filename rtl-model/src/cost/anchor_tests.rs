//! The laws against single operators as synthesised by `docs/cost-model/anchors.sh`, and the figures of DEPENDENCIES.md.

use super::operators::Operator;
use super::technology::{Technology, Timing};

/// Operator, NAND2 equivalents and ns in OSU 0.35 um, the same in OSU 0.18 um. `None`: not what the law is for.
type Anchor = (&'static str, f64, Option<f64>, f64, Option<f64>);

#[rustfmt::skip]
const ANCHORS: [Anchor; 30] = [
    ("add8", 62.4, Some(1.28), 66.7, Some(0.78)),
    ("add16", 144.8, Some(1.92), 147.6, Some(1.10)),
    ("add24", 222.1, Some(2.29), 222.2, Some(1.20)),
    ("add32", 302.8, Some(2.54), 314.3, Some(1.43)),
    ("add48", 474.5, Some(2.90), 472.5, Some(1.69)),
    ("add64", 625.2, Some(3.48), 653.5, Some(1.91)),
    ("add80", 796.1, Some(3.59), 823.1, Some(1.96)),
    ("addsub32", 417.2, Some(2.99), 415.7, Some(1.58)),
    ("addsub80", 1068.3, Some(3.91), 1055.6, Some(2.05)),
    // Alone; rows of a tree drive more, and their delay is fitted to products.
    ("csa24", 258.0, None, 258.0, None),
    ("less8", 57.4, Some(0.72), 52.5, Some(0.47)),
    ("less24", 155.3, Some(1.11), 165.1, Some(0.65)),
    ("less56", 350.0, Some(1.38), 354.9, Some(0.93)),
    ("less80", 493.4, Some(1.48), 473.4, Some(0.92)),
    ("equal24", 106.9, Some(0.66), 78.9, Some(0.41)),
    ("any64", 63.0, Some(0.59), 63.0, Some(0.35)),
    ("abs26", 118.5, Some(1.39), 118.5, Some(0.87)),
    ("abs80", 406.9, Some(2.34), 401.2, Some(1.63)),
    ("mux32", 356.0, Some(0.53), 325.7, Some(0.31)),
    ("shift54", 1027.5, Some(1.40), 1012.1, Some(0.90)),
    ("mul8", 629.9, Some(3.50), 615.8, Some(2.14)),
    ("mul12", 1449.0, Some(4.45), 1338.4, Some(2.87)),
    ("mul16", 2816.2, Some(5.11), 2700.2, Some(3.26)),
    ("mul20", 4467.5, Some(5.82), 4125.2, Some(3.66)),
    ("mul24", 6239.7, Some(6.29), 5666.2, Some(4.05)),
    ("mul28", 8723.0, Some(6.27), 8252.8, Some(3.90)),
    ("mul32", 11497.5, Some(6.60), 11028.0, Some(4.34)),
    ("smul26", 7836.5, Some(6.90), 7393.9, Some(4.38)),
    ("cross26", 16814.6, Some(7.36), 15816.0, Some(4.97)),
    ("dot26", 24623.1, Some(8.27), 22957.6, Some(5.36)),
];

/// LUTs and multipliers of the ECP5.
const ECP5_ANCHORS: [(&str, f64, u64); 16] = [
    ("add24", 24.0, 0),
    ("add80", 80.0, 0),
    ("addsub32", 64.0, 0),
    ("addsub80", 160.0, 0),
    ("csa24", 48.0, 0),
    ("less24", 51.0, 0),
    ("less56", 149.0, 0),
    ("less80", 171.0, 0),
    ("equal24", 16.0, 0),
    ("any64", 21.0, 0),
    ("abs26", 52.0, 0),
    ("mul16", 0.0, 1),
    ("mul20", 50.0, 4),
    ("mul24", 66.0, 4),
    ("mul28", 86.0, 4),
    ("mul32", 106.0, 4),
];

/// Path between registers of a circuit placed and routed alone by nextpnr (ns): docs/cost-model.md.
const ECP5_PATHS: [(&str, f64); 5] =
    [("add24", 3.385), ("add80", 5.250), ("mul18", 7.176), ("mul24", 11.472), ("any64", 4.219)];

fn built(timing: &Timing, name: &str) -> Operator {
    let digits = name.find(|c: char| c.is_ascii_digit()).unwrap();
    let (kind, n) = (&name[..digits], name[digits..].parse::<u64>().unwrap());
    match kind {
        "add" => timing.adder(n),
        "addsub" => timing.adder_subtractor(n),
        "csa" => timing.carry_save_row(n),
        "less" => timing.comparator(n),
        "equal" => timing.equality(n),
        "any" => timing.any(n),
        "abs" => timing.magnitude(n),
        "mux" => timing.multiplexer(n, 4),
        "shift" => timing.shifter(n, 6),
        "mul" | "smul" => timing.sum_of_products(1, n, n, 2 * n),
        "cross" => timing.sum_of_products(2, n, n, 2 * n),
        "dot" => timing.sum_of_products(3, n, n, 2 * n + 2),
        _ => panic!("{name}"),
    }
}

fn assert_close(what: &str, modelled: f64, measured: f64, tolerance: f64) {
    let error = modelled / measured - 1.0;
    assert!(
        error.abs() <= tolerance,
        "{what}: {modelled:.2} modelled, {measured} measured, {:+.1} %",
        error * 100.0
    );
}

fn without_wires(name: &str) -> Timing {
    Timing { wire_factor: 1.0, ..Technology::named(name).unwrap().timing }
}

#[test]
fn operators_of_cells_are_as_synthesised_within_a_quarter_and_6_percent_in_the_mean() {
    let (old, new) = (without_wires("osu-0.35um"), without_wires("osu-0.18um"));
    let (mut errors, mut n) = (0.0, 0.0);
    for (name, gates_old, ns_old, gates_new, ns_new) in ANCHORS {
        for (timing, gates, ns) in [(&old, gates_old, ns_old), (&new, gates_new, ns_new)] {
            let op = built(timing, name);
            let pairs = [(op.hardware.gates, Some(gates), "gates"), (op.total_ns(), ns, "ns")];
            for (modelled, measured, unit) in pairs {
                let Some(measured) = measured else { continue };
                assert_close(&format!("{name} {unit}"), modelled, measured, 0.25);
                errors += (modelled / measured - 1.0).abs();
                n += 1.0;
            }
        }
    }
    assert!(errors / n < 0.06, "mean error {:.1} %", 100.0 * errors / n);
}

#[test]
fn products_are_as_synthesised_within_15_percent() {
    let (old, new) = (without_wires("osu-0.35um"), without_wires("osu-0.18um"));
    let products = ANCHORS.iter().filter(|a| ["mul", "smu", "cro", "dot"].contains(&&a.0[..3]));
    for (name, gates_old, ns_old, gates_new, ns_new) in products {
        for (timing, gates, ns) in [(&old, gates_old, ns_old), (&new, gates_new, ns_new)] {
            let op = built(timing, name);
            assert_close(name, op.hardware.gates, *gates, 0.15);
            assert_close(name, op.total_ns(), ns.unwrap(), 0.15);
        }
    }
}

/// DEPENDENCIES.md: 24 x 24 bits, OSU 0.35 um 563,064 um2 and 6.84 ns, OSU 0.18 um 140,766 um2 and 4.34 ns.
#[test]
fn multiplier_of_24_bits_of_another_flow_is_met_within_11_percent() {
    for (name, um2, ns) in [("osu-0.35um", 563_064.0, 6.84), ("osu-0.18um", 140_766.0, 4.34)] {
        let technology = Technology::named(name).unwrap();
        let op = built(&without_wires(name), "mul24");
        assert_close(name, op.hardware.gates * technology.area.unwrap().gate_um2, um2, 0.11);
        assert_close(name, op.total_ns(), ns, 0.11);
    }
}

/// DEPENDENCIES.md: 24 x 24 bits, ECP5: 4 DSP, 180 MHz (a register behind the blocks).
#[test]
fn multiplier_of_an_fpga_is_that_of_the_dependencies() {
    let timing = without_wires("ecp5");
    let op = built(&timing, "mul24");
    assert_eq!(op.hardware.dsps, 4);
    assert_close("MHz", 1e3 / (op.parts[0].delay_ns + timing.register_ns), 180.0, 0.05);
}

#[test]
fn operators_of_an_fpga_are_as_synthesised_and_routed() {
    let timing = without_wires("ecp5");
    for (name, luts, dsps) in ECP5_ANCHORS {
        let op = built(&timing, name);
        assert_eq!(op.hardware.dsps, dsps, "{name}");
        // Two LUTs more or less do not matter.
        assert!(
            (op.hardware.luts - luts).abs() <= (0.25 * luts).max(2.0),
            "{name}: {} LUTs, {luts} synthesised",
            op.hardware.luts
        );
    }
    // A block alone, without the register that it has behind it, is routed to registers far away.
    for (name, ns) in ECP5_PATHS {
        assert_close(name, built(&timing, name).total_ns() + timing.register_ns, ns, 0.25);
    }
}

#[test]
fn board_of_its_time_is_the_0_35_um_one_scaled() {
    let scale = 1.6 / 0.35;
    let [old, board] = ["osu-0.35um", "cmos-1.6um"].map(|name| Technology::named(name).unwrap());
    let ns = |t: &Technology| built(&t.timing, "mul24").total_ns();
    assert_close("delay", ns(board) / ns(old), scale, 1e-9);
    let area = |t: &Technology| t.area.unwrap();
    for (a, b) in [
        (area(board).gate_um2, area(old).gate_um2),
        (area(board).flip_flop_um2, area(old).flip_flop_um2),
        (area(board).ram_cell_um2, area(old).ram_cell_um2),
    ] {
        assert_close("area", a / b, scale * scale, 1e-9);
    }
    assert_close("energy", board.energy.gate_pj / old.energy.gate_pj, scale * (5.0_f64 / 3.3).powi(2), 1e-9);
}
