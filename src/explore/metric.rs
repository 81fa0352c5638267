//! What is measured of a candidate: each metric's name, unit, better direction, and what it takes to know it.

use rtl_model::cost::{Cost as BoardCost, FpgaUse};
use rtl_model::spec::BoardSpec;
use serde::Serialize;

/// Which direction is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// Less is better.
    Minimise,
    /// More is better.
    Maximise,
}

/// What it takes to know a metric of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// The cost model alone.
    Cost,
    /// The clocked board.
    Cycles,
    /// Rays through oracle, board and software; of the formats alone.
    Verification,
    /// The picture by the board's arithmetic and by software; of the formats alone.
    Pictures,
}

/// A metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Metric {
    /// Its name in files.
    pub name: &'static str,
    /// Its unit; empty: a pure number.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub what: &'static str,
    /// Which direction is better.
    pub goal: Goal,
    /// What it takes.
    pub needs: Needs,
}

const fn metric(
    name: &'static str,
    unit: &'static str,
    what: &'static str,
    goal: Goal,
    needs: Needs,
) -> Metric {
    Metric { name, unit, what, goal, needs }
}

use Goal::{Maximise, Minimise};
use Needs::{Cost, Cycles, Pictures, Verification};

/// Every metric, in the order of tables. Sums over the workloads, where there are several; `misclassified` and
/// `image_rmse` are the worst of them.
pub const METRICS: [Metric; 23] = [
    metric("cycles", "cycles", "board cycles", Minimise, Cycles),
    metric("seconds", "s", "cycles at the candidate's clock", Minimise, Cycles),
    metric("cycles_per_ray", "cycles", "board cycles a ray", Minimise, Cycles),
    metric("rays_per_second", "1/s", "rays a second", Maximise, Cycles),
    metric("icu_utilisation", "", "share of the ICUs' cycles in which they worked", Maximise, Cycles),
    metric("energy_j", "J", "energy of the workloads on the board's chips", Minimise, Cycles),
    metric("power_w", "W", "mean power of the board's chips over the workloads", Minimise, Cycles),
    metric("nj_per_ray", "nJ", "energy a ray", Minimise, Cycles),
    metric("rays_per_joule", "1/J", "rays a joule", Maximise, Cycles),
    metric("rays_per_second_per_mm2", "1/s/mm2", "rays a second and area", Maximise, Cycles),
    metric("clock_mhz", "MHz", "the candidate's clock", Maximise, Cost),
    metric("max_clock_mhz", "MHz", "the fastest clock that the critical path allows", Maximise, Cost),
    metric("critical_path_ns", "ns", "longest path between two registers", Minimise, Cost),
    metric("area_mm2", "mm2", "cells and memory, standard cells only", Minimise, Cost),
    metric("gates", "gates", "NAND2 equivalents of the logic, without registers and memory", Minimise, Cost),
    metric("flip_flops", "bits", "registers", Minimise, Cost),
    metric("ram_bits", "bits", "memory on the chips", Minimise, Cost),
    metric("luts", "LUTs", "look-up tables, FPGA only", Minimise, Cost),
    metric("dsps", "DSPs", "multiplier blocks, FPGA only", Minimise, Cost),
    metric("ram_blocks", "blocks", "memory blocks, FPGA only", Minimise, Cost),
    metric("leakage_w", "W", "power at rest", Minimise, Cost),
    metric(
        "misclassified",
        "",
        "share of rays for which board and software name other patches",
        Minimise,
        Verification,
    ),
    metric("image_rmse", "", "relative RMSE of the picture by the board's arithmetic", Minimise, Pictures),
];

impl Metric {
    /// The metric of this name.
    pub fn named(name: &str) -> Option<&'static Metric> {
        METRICS.iter().find(|m| m.name == name)
    }
}

/// A cost's value by the name of its metric; `clock_mhz` is the board's.
pub fn cost_value(name: &str, cost: &BoardCost, spec: &BoardSpec) -> Option<f64> {
    let fpga = |count: fn(&FpgaUse) -> u64| cost.fpga.as_ref().map(|f| count(f) as f64);
    match name {
        "clock_mhz" => Some(spec.clock_mhz),
        "max_clock_mhz" => Some(cost.max_clock_mhz),
        "critical_path_ns" => Some(cost.critical_path_ns),
        "area_mm2" => cost.area_mm2,
        "gates" => Some(cost.gates),
        "flip_flops" => Some(cost.flip_flops as f64),
        "ram_bits" => Some(cost.ram_bits as f64),
        "luts" => fpga(|f| f.luts),
        "dsps" => fpga(|f| f.dsps),
        "ram_blocks" => fpga(|f| f.ram_blocks),
        "leakage_w" => Some(cost.leakage_w),
        _ => None,
    }
}
