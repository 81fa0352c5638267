//! Prints the ICU's longest stage, registers and area, and the board's clock, against `icu.depth`, for the default board in
//! every technology, as markdown tables: `cargo run --release -p rtl-model --example cost_curve`.

use rtl_model::cost::{Cost, Technology};
use rtl_model::spec::BoardSpec;

const DEPTHS: [u32; 15] = [1, 2, 4, 6, 8, 12, 16, 22, 28, 32, 40, 48, 64, 96, 128];

fn main() {
    for technology in Technology::all() {
        println!("\n{}\n", technology.name);
        println!(
            "| icu.depth | ICU path (ns) | through | board's clock (MHz) | critical block | ICU registers | size |"
        );
        println!("|---:|---:|---|---:|---|---:|---:|");
        for depth in DEPTHS {
            let mut spec = BoardSpec::default();
            spec.icu.depth = depth;
            let cost = Cost::of(&spec, technology);
            let Some(icu) = cost.blocks.iter().find(|b| b.block == "icu") else { continue };
            let size = match (cost.area_mm2, cost.fpga) {
                (Some(area), _) => format!("{area:.0} mm2"),
                (None, Some(fpga)) => format!("{} LUTs", fpga.luts),
                (None, None) => String::new(),
            };
            println!(
                "| {depth} | {:.2} | {} | {:.1} | {} | {} | {size} |",
                icu.path_ns,
                icu.path,
                cost.max_clock_mhz,
                cost.critical_block,
                icu.flip_flops / icu.instances
            );
        }
    }
}
